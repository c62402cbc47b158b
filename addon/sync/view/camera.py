# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's camera and picture size → the library's window and region."""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy
import numpy as np
from mathutils import Matrix

from ...description.view import Camera, Focus, Panorama, View


class CameraError(Exception):
    """A camera that Patina cannot draw through; the text is for the artist."""


def final_view(camera: bpy.types.Object | None, depsgraph: bpy.types.Depsgraph,
               eye: tuple[Matrix, float] | None = None) -> View:
    """The view of a final render through the evaluated camera object. eye: one of a stereo pair, its matrix and its shift in
    Blender's units."""
    if camera is None or camera.type != 'CAMERA':
        raise CameraError("the scene has no camera")
    render = depsgraph.scene_eval.render
    _check(camera)
    if camera.data.type == 'PANO':
        return _panoramic(camera, render, eye[0] if eye else camera.matrix_world)
    width, height = picture_size(render)
    matrix = camera.calc_matrix_camera(depsgraph, x=width, y=height, scale_x=render.pixel_aspect_x,
                                       scale_y=render.pixel_aspect_y)
    data = camera.data
    if data.type not in {'PERSP', 'ORTHO'}:
        kind = data.bl_rna.properties["type"].enum_items[data.type].name.lower()
        raise CameraError(f"'{camera.name}' is a {kind} camera: Patina draws perspective, orthographic and panoramic ones")
    left, right, bottom, top = window(matrix, data.type == 'ORTHO')
    place, shift = eye or (camera.matrix_world, data.shift_x)
    wide = width * render.pixel_aspect_x >= height * render.pixel_aspect_y
    across = data.sensor_fit == 'HORIZONTAL' or data.sensor_fit == 'AUTO' and wide
    moved = (shift - data.shift_x) * (right - left if across else top - bottom)
    return View(width, height, border_region(render, width, height), Camera(
        orthographic=int(data.type == 'ORTHO'),
        world_from_camera=row_major(place),
        left=left + moved, right=right + moved, bottom=bottom, top=top,
        near_clip=data.clip_start, far_clip=data.clip_end), focus_of(camera))


def _check(camera: bpy.types.Object) -> None:
    """CameraError for one that animation or a script gave values by which nothing can be seen."""
    data = camera.data
    if data.type == 'ORTHO' and not data.ortho_scale > 0.0:
        raise CameraError(f"'{camera.name}' cannot see anything: its orthographic scale is {data.ortho_scale:g}")
    if data.type == 'PERSP' and not (math.isfinite(data.lens) and data.sensor_width > 0.0 and data.sensor_height > 0.0):
        raise CameraError(f"'{camera.name}' cannot see anything: its field of view is 0")
    if not data.clip_end > data.clip_start:
        raise CameraError(f"'{camera.name}' cannot see anything: Clip End, {data.clip_end:g}, is not beyond Clip Start, {data.clip_start:g}")
    if not abs(camera.matrix_world.to_3x3().determinant()) > 0.0:
        raise CameraError(f"'{camera.name}' cannot see anything: its scale is 0")


def _panoramic(camera: bpy.types.Object, render: bpy.types.RenderSettings, place: Matrix) -> View:
    """Equirectangular, whatever Blender's panorama says: it has that choice for Cycles only, in its add-on until 4.5. Limits
    of longitude and latitude count where they are set for it."""
    data = camera.data
    settings = data if hasattr(data, "panorama_type") else getattr(data, "cycles", None)
    longitude, latitude = (-math.pi, math.pi), (-math.pi / 2, math.pi / 2)
    if getattr(settings, "panorama_type", "") == 'EQUIRECTANGULAR':
        longitude = (settings.longitude_min, settings.longitude_max)
        latitude = (settings.latitude_min, settings.latitude_max)
    notice = ""
    if hasattr(settings, "panorama_type"):
        choice = settings.bl_rna.properties["panorama_type"]
        if settings.panorama_type not in {'EQUIRECTANGULAR', choice.default}:  # Cycles' own default is nobody's choice here
            notice = (f"'{camera.name}' is drawn as an equirectangular panorama: Patina knows no "
                      f"{choice.enum_items[settings.panorama_type].name}")
    width, height = picture_size(render)
    region = border_region(render, width, height)
    matrix = row_major(place)
    return View(width, height, region,
                Camera(0, matrix, -1.0, 1.0, -1.0, 1.0, data.clip_start, data.clip_end),
                panorama=Panorama(width, height, region, matrix, longitude, latitude, data.clip_start, data.clip_end), notice=notice)


def viewport_view(region: bpy.types.Region, space: bpy.types.SpaceView3D, rv3d: bpy.types.RegionView3D,
                  scene: bpy.types.Scene) -> View:
    """What a 3D view shows: through its camera (with zoom, offset and shift) or freely."""
    matrix = rv3d.window_matrix
    orthographic = matrix[3][3] == 1.0
    left, right, bottom, top = window(matrix, orthographic)
    a, b = float(matrix[2][2]), float(matrix[2][3])
    clips = ((b + 1.0) / a, (b - 1.0) / a) if orthographic else (b / (a - 1.0), b / (a + 1.0))
    return View(region.width, region.height, viewport_region(region, space, rv3d, scene), Camera(
        orthographic=int(orthographic),
        world_from_camera=tuple(np.linalg.inv(np.array(rv3d.view_matrix, np.float64)).ravel().tolist()),
        left=left, right=right, bottom=bottom, top=top, near_clip=clips[0], far_clip=clips[1]),
        focus_of(space.camera or scene.camera) if rv3d.view_perspective == 'CAMERA' else None)


def focus_of(camera: bpy.types.Object | None) -> Focus | None:
    """The depth of field of a camera object, as Cycles has it: the lens is as wide as the focal length in thousandths of a unit
    over the f-number, in orthographic views a unit over it."""
    if camera is None or camera.type != 'CAMERA' or not camera.data.dof.use_dof:
        return None
    data, lens = camera.data, camera.data.dof
    distance = lens.focus_distance
    if lens.focus_object:
        place = camera.matrix_world.normalized()
        distance = abs((lens.focus_object.matrix_world.translation - place.translation).dot(place.col[2].to_3d()))
    length = 1.0 if data.type == 'ORTHO' else 0.001 * data.lens
    return Focus(max(distance, 1e-6), length / max(lens.aperture_fstop, 1e-5))


def viewport_region(region: bpy.types.Region, space: bpy.types.SpaceView3D, rv3d: bpy.types.RegionView3D,
                    scene: bpy.types.Scene) -> tuple[int, int, int, int]:
    """The part of a 3D view that is rendered: the camera's border, or the view's own; else all of it."""
    width, height = region.width, region.height
    whole = (0, 0, width, height)
    if rv3d.view_perspective == 'CAMERA':
        render = scene.render
        camera = space.camera or scene.camera
        if not render.use_border or camera is None or camera.type != 'CAMERA':
            return whole
        frame = camera_frame(region, rv3d, camera, scene)
        x = [frame[0] + (frame[2] - frame[0]) * share for share in (render.border_min_x, render.border_max_x)]
        y = [frame[1] + (frame[3] - frame[1]) * share for share in (render.border_min_y, render.border_max_y)]
    elif space.use_render_border:
        x = [width * share for share in (space.render_border_min_x, space.render_border_max_x)]
        y = [height * share for share in (space.render_border_min_y, space.render_border_max_y)]
    else:
        return whole
    x0, x1 = (int(min(max(value, 0), width)) for value in x)
    y0, y1 = (int(min(max(value, 0), height)) for value in y)
    return (x0, y0, x1, y1) if x0 < x1 and y0 < y1 else whole


def camera_frame(region: bpy.types.Region, rv3d: bpy.types.RegionView3D, camera: bpy.types.Object,
                 scene: bpy.types.Scene) -> tuple[float, float, float, float]:
    """x0, y0, x1, y1 of the camera's picture in a view through it, pixels from the region's bottom left."""
    to_screen = np.array(rv3d.perspective_matrix, np.float64) @ np.array(camera.matrix_world.normalized(), np.float64)
    corners = np.array([(*corner, 1.0) for corner in camera.data.view_frame(scene=scene)]) @ to_screen.T
    places = (corners[:, :2] / corners[:, 3:] * 0.5 + 0.5) * (region.width, region.height)
    return (*places.min(axis=0), *places.max(axis=0))


def row_major(matrix: Sequence[Sequence[float]]) -> tuple[float, ...]:
    return tuple(value for row in matrix for value in row)


def window(projection: Sequence[Sequence[float]], orthographic: bool) -> tuple[float, float, float, float]:
    """left, right, bottom, top of a projection matrix, in float64; shift and pixel aspect are in them.

    A perspective matrix maps x/-z to (x P00 / -z) - P02, an orthographic one x to x P00 + P03; the window's edges
    are where that is -1 and 1. CameraError where there is no such window.
    """
    edges = []
    for axis in (0, 1):
        scale = float(projection[axis][axis])
        offset = float(projection[axis][3] if orthographic else -projection[axis][2])
        if not scale or not math.isfinite(scale):
            raise CameraError("nothing can be seen: the field of view, or the orthographic scale, is 0")
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
