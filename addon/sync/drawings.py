# SPDX-License-Identifier: GPL-3.0-or-later
"""Survey drawings: objects whose matrix is the plane, and the points that their cut lines are traced through."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

import bpy
import numpy as np
from mathutils import Matrix

from .. import native, point_data
from ..description import drawings
from ..description.drawings import DrawingError, Frame
from ..description.scene import SceneDescription
from ..description.view import Camera, View
from ..native.drawings import Drawing
from . import describe
from .analyses import estimates


def is_drawing(obj: bpy.types.Object | None) -> bool:
    return obj is not None and obj.patina.drawing.kind != 'NONE'


def of_scene(layer: bpy.types.ViewLayer) -> list[bpy.types.Object]:
    """All drawings, by name."""
    return sorted(filter(is_drawing, layer.objects), key=lambda obj: obj.name)


def shown(layer: bpy.types.ViewLayer, space: bpy.types.SpaceView3D) -> Iterator[bpy.types.Object]:
    """Those that a 3D view shows."""
    return (obj for obj in layer.objects if is_drawing(obj) and obj.visible_get(view_layer=layer) and obj.visible_in_viewport_get(space))


def frame_of(obj: bpy.types.Object, scene: bpy.types.Scene) -> Frame:
    """The object's scale counts for its extent. DrawingError if nothing can be drawn."""
    matrix, group = np.array(obj.matrix_world, np.float64), obj.patina.drawing
    with np.errstate(all='ignore'):
        sides = np.linalg.norm(matrix[:3, :2], axis=0)
        right, up = (matrix[:3, :2] / sides).T
        up = up - (up @ right) * right
        up = up / np.linalg.norm(up)
    frame = Frame(matrix[:3, 3], right, up, group.width * float(sides[0]), group.height * float(sides[1]), group.front, group.back, group.scale,
                  scene.unit_settings.scale_length, group.pixel, group.thickness, group.kind == 'CEILING')
    drawings.check(frame, obj.name)
    return frame


def facts(obj: bpy.types.Object, scene: bpy.types.Scene) -> tuple[list[tuple[str, str]], bool]:
    """Names and texts of what the drawing is, and whether the points, as far as they are known, support its scale. DrawingError."""
    frame, (spacing, sigma) = frame_of(obj, scene), estimates.of_drawing(obj.name_full)
    return drawings.facts(frame, spacing, sigma), drawings.supported(frame, spacing, sigma)


def create(context: bpy.types.Context, kind: str, place: tuple[np.ndarray, np.ndarray, np.ndarray], corners: np.ndarray,
           size: tuple[float, float] | None = None, depth: tuple[float, float] | None = None) -> bpy.types.Object:
    """A new drawing, selected and active. place: a point of the plane, right and up; corners: (n, 3), what is to be drawn. size: width, around
    the place, and 0 or height; None: what the corners take. depth: before and behind, in meters; None: what the corners take."""
    middle, right, up = place
    unit = context.scene.unit_settings.scale_length
    center, width, height, front, back = drawings.around(corners, middle, right, up)
    if size:
        width, center = size[0], middle + ((center - middle) @ up) * up
    name = bpy.types.Object.bl_rna.properties["patina"].fixed_type.properties["drawing"].fixed_type.properties["kind"].enum_items[kind].name
    empty = bpy.data.objects.new(name, None)
    empty.empty_display_type, empty.empty_display_size = 'ARROWS', 0.05 * max(width, height)
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([right, up, np.cross(right, up), center])
    empty.matrix_world = Matrix(matrix.tolist())
    group = empty.patina.drawing
    group.kind, group.width, group.height = kind, width, height
    group.front, group.back = (length / unit for length in depth) if depth else (max(front, 0.0), max(back, 0.0))
    context.collection.objects.link(empty)
    point_data.select_alone(context, empty)
    return empty


def add_curves(context: bpy.types.Context, name: str, frame: Frame, lines: list[tuple[str, bool, np.ndarray]]) -> list[bpy.types.Object]:
    """Curves of lines as Drawing.lines() gives them: an object for each layer that has some, with the drawing's axes. They are selected."""
    added = []
    for layer in dict.fromkeys(layer for layer, _, _ in lines):
        curve = bpy.data.curves.new(f"{name} {layer}", 'CURVE')
        curve.dimensions = '3D'
        for _, closed, vertices in (line for line in lines if line[0] == layer):
            spline = curve.splines.new('POLY')
            spline.points.add(len(vertices) - 1)
            places = np.column_stack([vertices / frame.unit, np.zeros(len(vertices)), np.ones(len(vertices))])
            spline.points.foreach_set("co", places.astype(np.float32).ravel())
            spline.use_cyclic_u = closed
        obj = bpy.data.objects.new(curve.name, curve)
        matrix = np.eye(4)
        matrix[:3] = np.column_stack([frame.right, frame.up, np.cross(frame.right, frame.up), frame.origin])
        obj.matrix_world = Matrix(matrix.tolist())
        context.collection.objects.link(obj)
        added.append(obj)
    point_data.select_alone(context, added[0])
    for obj in added:
        obj.select_set(True)
    return added


def camera_matrix(frame: Frame, away: float) -> np.ndarray:
    """(4, 4), where a camera shows the drawing, so far before its plane. That of a ceiling looks up, and is mirrored."""
    back = -frame.normal if frame.ceiling else frame.normal
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([frame.right, frame.up, back, frame.origin + away * back])
    return matrix


# ---- vectors -------------------------------------------------------------------------------------------------------------


def _view(frame: Frame) -> View:
    width, height = 64, 64
    camera = Camera(1, tuple(camera_matrix(frame, frame.front + 1.0).ravel()), -0.5 * frame.width, 0.5 * frame.width, -0.5 * frame.height,
                    0.5 * frame.height, 1.0, 1.0 + frame.front + frame.back)
    return View(width, height, (0, 0, width, height), camera)


def described(depsgraph: bpy.types.Depsgraph, frame: Frame, poll: Callable[[str, float], bool]) -> SceneDescription:
    """The scene, its clouds built and analyzed. DrawingError if a cloud cannot be cut, PatinaError if one cannot be read."""
    found = describe(depsgraph, _view(frame), poll)
    for item in found.clouds:
        if item.cloud.stream:
            raise DrawingError(f"'{item.name}' is read as needed, so it cannot be cut. Set its Read to Whole, or hide it")
        if not item.cloud.has_shapes:
            raise DrawingError(f"'{item.name}' is not analyzed, so it cannot be cut. Set its Surface to another one than Range Images, or hide it")
    if not found.clouds:
        raise DrawingError("there are no visible points to draw")
    return found


def cut(frame: Frame, description: SceneDescription, bits: Iterable[np.ndarray], zero: np.ndarray, name: str) -> Drawing:
    """The cut lines of a scene's clouds, in meters of the world, whose place zero is Blender's. bits: of each cloud's points that the scene
    draws. name: full one of the drawing, for its estimates."""
    unit = frame.unit
    drawing = Drawing(zero + unit * frame.origin, frame.right, frame.up, (unit * frame.width, unit * frame.height), unit * frame.front,
                      unit * frame.back, frame.scale)
    places = np.array([item.style.world_from_object for item in description.clouds], np.float64).reshape(-1, 4, 4)
    places[:, :3] *= unit
    places[:, :3, 3] += zero
    try:
        drawing.cut([item.cloud for item in description.clouds], places, list(bits), unit * frame.thickness)
    except native.PatinaError as error:
        drawing.close()
        uneven = next((item.name for item, place in zip(description.clouds, places, strict=True) if not _is_even(place)), None)
        if uneven:
            raise DrawingError(f"'{uneven}' is scaled differently along its axes, so it cannot be cut. Apply its scale, or hide it") from None
        if error.code == native.abi.ERROR["ERROR_EMPTY"]:
            raise DrawingError("the plane meets no surface of visible points within its extent. Move it, or make the extent larger") from None
        raise
    info = drawing.info()
    estimates.keep_drawn(name, info["spacing"] / unit, info["sigma"] / unit)
    return drawing


def _is_even(place: np.ndarray) -> bool:
    square = place[:3, :3].T @ place[:3, :3]
    mean = np.trace(square) / 3.0
    return bool(np.isfinite(place).all() and mean > 0.0 and np.abs(square - mean * np.eye(3)).max() <= 1e-4 * mean)
