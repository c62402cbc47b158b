# SPDX-License-Identifier: GPL-3.0-or-later
"""Motion blur of a final picture: at which moments it is taken, and how many of its samples fall to each."""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from . import settings

_GOLDEN = 0.6180339887498949


@dataclass(frozen=True)
class Moment:
    """One state of the scene in a picture."""

    offset: float  # frames from the picture's own
    samples: int  # of each pixel
    shift: tuple[float, float]  # of the picture, pixels: moments of one sample each share out a pixel; (0, 0) with the data
    gives_data: bool  # whether depth and other data come from it: the moment nearest to the frame


def moments(scene: bpy.types.Scene) -> list[Moment]:
    """The moments in their order, evenly spread over the time that the shutter is open, each in the middle of its part. They
    share the samples of anti-aliasing evenly, at least one each."""
    samples = settings.samples(scene)
    render = scene.render
    if not render.use_motion_blur or render.motion_blur_shutter <= 0.0:
        return [Moment(0.0, samples, (0.0, 0.0), True)]
    steps = scene.patina.motion_steps
    share = -(-samples // steps) if samples else 0
    begin = {'START': 0.0, 'CENTER': -0.5, 'END': -1.0}[position(scene)]
    offsets = [(begin + (step + 0.5) / steps) * render.motion_blur_shutter for step in range(steps)]
    nearest = min(range(steps), key=lambda step: abs(offsets[step]))
    def shift(step: int) -> tuple[float, float]:
        turn = (step - nearest) % steps if share == 1 else 0
        return (turn / steps + 0.5) % 1.0 - 0.5, (turn * _GOLDEN + 0.5) % 1.0 - 0.5

    return [Moment(offset, share, shift(step), step == nearest) for step, offset in enumerate(offsets)]


def position(scene: bpy.types.Scene) -> str:
    """When the shutter is open: START, CENTER or END at the frame."""
    return getattr(*position_property(scene))


def position_property(scene: bpy.types.Scene) -> tuple[bpy.types.bpy_struct, str]:
    """Where Blender keeps it: with EEVEE until 4.1."""
    name = "motion_blur_position"
    return (scene.render if hasattr(scene.render, name) else scene.eevee), name
