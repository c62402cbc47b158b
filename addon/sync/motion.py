# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion blur of a final picture: at which moments it is taken, and which of its samples fall to each."""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from . import settings


@dataclass(frozen=True)
class Moment:
    """One state of the scene in a picture."""

    offset: float  # frames from the picture's own
    samples: tuple[int, ...]  # of the jitter: numbers below that of all samples, each falls to one moment
    gives_data: bool  # whether depth and other data come from it: the moment nearest to the frame


def moments(scene: bpy.types.Scene) -> list[Moment]:
    """The moments in their order, evenly spread over the time that the shutter is open, each in the middle of its part. They
    share the samples of anti-aliasing evenly, at least one each."""
    samples = settings.samples(scene)
    render = scene.render
    if not render.use_motion_blur or render.motion_blur_shutter <= 0.0:
        return [Moment(0.0, tuple(range(samples)), True)]
    steps = scene.patina.motion_steps
    share = -(-samples // steps)
    begin = {'START': 0.0, 'CENTER': -0.5, 'END': -1.0}[position(scene)]
    offsets = [(begin + (step + 0.5) / steps) * render.motion_blur_shutter for step in range(steps)]
    nearest = min(range(steps), key=lambda step: abs(offsets[step]))

    def numbers(step: int) -> tuple[int, ...]:  # the frame's own moment begins with the sample that looks straight
        first = (step - nearest) % steps * share
        return tuple(range(first, first + share))

    return [Moment(offset, numbers(step), step == nearest) for step, offset in enumerate(offsets)]


def position(scene: bpy.types.Scene) -> str:
    """When the shutter is open: START, CENTER or END at the frame."""
    return getattr(*position_property(scene))


def position_property(scene: bpy.types.Scene) -> tuple[bpy.types.bpy_struct, str]:
    """Where Blender keeps it: with EEVEE until 4.1."""
    name = "motion_blur_position"
    return (scene.render if hasattr(scene.render, name) else scene.eevee), name
