# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's camera and picture size → the library's window and region."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np


class CameraError(Exception):
    """A camera that Patina cannot draw through; the text is for the artist."""


@dataclass(frozen=True)
class Camera:
    """patina_camera: the window at distance 1 (perspective) or in world units (orthographic)."""

    orthographic: int
    world_from_camera: tuple[float, ...]  # 16, row-major
    left: float
    right: float
    bottom: float
    top: float
    near_clip: float
    far_clip: float


@dataclass(frozen=True)
class View:
    """What is drawn: the full picture's size, the part of it, and the camera of the full picture."""

    width: int
    height: int
    region: tuple[int, int, int, int]  # x0, y0, x1, y1 from the bottom left; the whole picture when no border
    camera: Camera


def final_view(camera: bpy.types.Object | None, depsgraph: bpy.types.Depsgraph) -> View:
    """The view of a final render through the evaluated camera object."""
    if camera is None or camera.type != 'CAMERA':
        raise CameraError("the scene has no camera")
    render = depsgraph.scene_eval.render
    width, height = picture_size(render)
    matrix = camera.calc_matrix_camera(depsgraph, x=width, y=height, scale_x=render.pixel_aspect_x,
                                       scale_y=render.pixel_aspect_y)
    data = camera.data
    if data.type not in {'PERSP', 'ORTHO'}:
        kind = data.bl_rna.properties["type"].enum_items[data.type].name.lower()
        raise CameraError(f"'{camera.name}' is a {kind} camera: Patina draws perspective and orthographic ones")
    left, right, bottom, top = window(matrix, data.type == 'ORTHO')
    return View(width, height, border_region(render, width, height), Camera(
        orthographic=int(data.type == 'ORTHO'),
        world_from_camera=row_major(camera.matrix_world),
        left=left, right=right, bottom=bottom, top=top,
        near_clip=data.clip_start, far_clip=data.clip_end))


def row_major(matrix: Sequence[Sequence[float]]) -> tuple[float, ...]:
    return tuple(value for row in matrix for value in row)


def window(projection: Sequence[Sequence[float]], orthographic: bool) -> tuple[float, float, float, float]:
    """left, right, bottom, top of a projection matrix, in float64; shift and pixel aspect are in them.

    A perspective matrix maps x/-z to (x P00 / -z) - P02, an orthographic one x to x P00 + P03; the window's edges
    are where that is -1 and 1.
    """
    edges = []
    for axis in (0, 1):
        scale = float(projection[axis][axis])
        offset = float(projection[axis][3] if orthographic else -projection[axis][2])
        edges += [(-1.0 - offset) / scale, (1.0 - offset) / scale]
    return tuple(edges)


def picture_size(render: bpy.types.RenderSettings) -> tuple[int, int]:
    """The full picture in pixels, cut to integers as Blender cuts."""
    percentage = render.resolution_percentage
    return (max(render.resolution_x * percentage // 100, 1), max(render.resolution_y * percentage // 100, 1))


def border_region(render: bpy.types.RenderSettings, width: int, height: int) -> tuple[int, int, int, int]:
    """The render border in pixels. Blender multiplies in float32 and cuts; with or without cropping it wants just
    these pixels and sets them into the full picture itself."""
    if not render.use_border:
        return (0, 0, width, height)

    def pixel(share: float, size: int) -> int:
        return int(np.float32(share) * np.float32(size))

    return (pixel(render.border_min_x, width), pixel(render.border_min_y, height),
            pixel(render.border_max_x, width), pixel(render.border_max_y, height))
