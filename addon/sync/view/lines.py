# SPDX-License-Identifier: GPL-3.0-or-later
"""Scene properties → the library's lines."""

from __future__ import annotations

import bpy

from ...description.settings import Lines
from ...description.view import Camera
from ...properties import enum_number


def read(scene: bpy.types.Scene, camera: Camera) -> Lines | None:
    """None: no lines."""
    lines = scene.patina.lines
    if not lines.use:
        return None
    start = camera.near_clip if camera.orthographic else 0.0  # where the library counts depth from
    world = lines.units == 'WORLD'
    color = (lines.tint,) * 3 if lines.source == 'POINT' else tuple(lines.color)
    return Lines(
        width=lines.width_world if world else lines.width,
        world=int(world),
        offset=lines.offset,
        source=enum_number(lines, "source"),
        color=color,
        far_color=tuple(lines.far_color),
        range=(lines.near - start, lines.far - start) if lines.far > lines.near else (0.0, 0.0),
        transparency=1.0 - lines.opacity,
        soft=lines.soft,
        surface=enum_number(lines, "surface"),
        paper=tuple(lines.paper))
