# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of survey drawings over 3D views, and the cut lines of what a scene draws."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import gpu
import numpy as np

from .. import memory, native
from ..description.drawings import DrawingError, Frame
from ..native.drawings import Drawing
from ..native.points import pick
from ..sync import drawings
from ..sync.analyses.analyzing import ANALYSES
from . import render
from .measures import Pen
from .over_views import OverViews

INK = (0.25, 0.72, 1.0, 1.0)
TICK = 0.06  # of the shorter side: the arrow that shows where the drawing looks
RESULT_BYTES = 24  # of Blender's image and the file's, a pixel, while it is rendered


def outline(frame: Frame) -> list[np.ndarray]:
    """Lines, (n, 3) each: the extent, and an arrow from its lower left corner to where the viewer looks."""
    right, up = 0.5 * frame.width * frame.right, 0.5 * frame.height * frame.up
    corners = [frame.origin + x * right + y * up for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))]
    size = TICK * min(frame.width, frame.height)
    ahead, side = size * (frame.normal if frame.ceiling else -frame.normal), 0.3 * size * frame.right
    tip = corners[0] + ahead
    return [np.stack(corners), np.stack([corners[0], tip]), np.stack([tip - 0.4 * ahead + side, tip, tip - 0.4 * ahead - side])]


def _draw() -> None:
    """Drawings of visible objects, where the view shows overlays."""
    context = bpy.context
    if context.region_data is None or not context.space_data.overlay.show_overlays:
        return
    found = list(drawings.shown(context.view_layer, context.space_data))
    if not found:
        return
    pen = Pen(context)
    try:
        for obj in found:
            try:
                frame = drawings.frame_of(obj, context.scene)
            except DrawingError:
                continue
            lines = outline(frame)
            pen.lines([place for line in lines for place in pen.segments(line)], INK)
            at = pen.place(lines[0][3])
            if at:
                pen.text(at, f"{obj.name}  1:{frame.scale:g}")
    finally:
        gpu.state.blend_set('NONE')


def check_room(frame: Frame) -> tuple[int, int]:
    """Width and height of the drawing's image. DrawingError if it is too large, or if memory is short."""
    width, height = frame.size()
    needed, free = RESULT_BYTES * width * height, memory.free()
    if free is not None and needed > free:
        raise DrawingError(f"an image of {width:,} x {height:,} pixels needs {needed / 1e9:,.1f} GB of memory, and {free / 1e9:,.1f} GB are free: use a "
                           "smaller scale, larger pixels, or a smaller extent")
    return width, height


def cut_lines(depsgraph: bpy.types.Depsgraph, frame: Frame, zero: np.ndarray, name: str, poll: Callable[[str, float], bool]) -> Drawing:
    """Of the points that the scene draws: without hidden ones. zero: the place of the world, in meters, that Blender's is. name: full one of
    the drawing. DrawingError, PatinaError."""
    description = drawings.described(depsgraph, frame, poll)
    with ANALYSES.drawing(), native.Scene() as scene:
        render.describe(scene, description, ["COMBINED"])
        return drawings.cut(frame, description, [pick(scene, index, None) for index in range(len(description.clouds))], zero, name)


_over = OverViews(_draw, 'POST_PIXEL')
register, unregister = _over.register, _over.unregister
