# SPDX-License-Identifier: GPL-3.0-or-later
"""Measurements of objects: kept in the object's own space, read in the scene's and in the file's coordinates, and written as text.

A measurement follows its object, and scale counts. Its points are float64, as text: what Blender itself keeps is float32."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import bpy
import numpy as np

from ..description import measures
from ..description.measures import Figure, MeasureError, Measurement, Texts, Values
from .points import origin

DIGITS = 4  # behind the point: of lengths in meters a tenth of a millimeter
# Meters, name, digits that are a tenth of a millimeter, by Blender's unit of length.
_FIXED = {'KILOMETERS': (1000.0, "km", 7), 'METERS': (1.0, "m", 4), 'CENTIMETERS': (0.01, "cm", 2), 'MILLIMETERS': (0.001, "mm", 1),
          'MICROMETERS': (1e-6, "µm", 0), 'MILES': (1609.344, "mi", 7), 'FEET': (0.3048, "ft", 4), 'INCHES': (0.0254, "in", 3),
          'THOU': (0.0000254, "thou", 0)}
_FOOT = 0.3048
_INSERT = ((1.0, 6), (0.001, 4), (0.01, 5), (0.3048, 2), (0.0254, 1), (1200.0 / 3937.0, 21))  # meters and number of DXF's $INSUNITS


@dataclass(frozen=True)
class Found:
    """A measurement as the scene has it now."""

    obj: bpy.types.Object
    index: int
    name: str
    kind: str
    points: np.ndarray  # (n, 3) float64, Blender's coordinates
    values: Values


def add(obj: bpy.types.Object, kind: str, world: np.ndarray, name: str = "") -> bpy.types.PropertyGroup:
    """Keeps a measurement of points in Blender's coordinates, (n, 3) float64. MeasureError."""
    measures.check(kind, world)
    return add_local(obj, kind, to_local(obj, world), name)


def add_local(obj: bpy.types.Object, kind: str, local: np.ndarray, name: str = "") -> bpy.types.PropertyGroup:
    """The same of points in the object's own space."""
    measures.check(kind, local)
    if obj.library is not None:
        raise MeasureError(f"'{obj.name}' belongs to another file: make a library override of it first")
    group = obj.patina.measures
    entry = group.entries.add()
    entry.kind, entry.places = kind, packed(local)
    entry.name = name or _free_name(group, measures.WORDS[kind].capitalize())
    group.active = len(group.entries) - 1
    return entry


def _free_name(group: bpy.types.PropertyGroup, word: str) -> str:
    taken = {entry.name for entry in group.entries}
    return next(name for number in range(1, len(taken) + 2) if (name := f"{word} {number}") not in taken)


def packed(points: np.ndarray) -> str:
    return " ".join(repr(float(value)) for value in np.asarray(points).ravel())


def unpacked(text: str) -> np.ndarray:
    """(n, 3) float64. MeasureError unless the text holds that."""
    try:
        numbers = [float(word) for word in text.replace(",", " ").replace(";", " ").split()]
    except ValueError:
        raise MeasureError("Coordinates are numbers: X Y Z of each point, separated by spaces") from None
    if not numbers or len(numbers) % 3:
        raise MeasureError(f"Coordinates are X Y Z of each point, and these are {len(numbers)} numbers")
    return np.array(numbers, np.float64).reshape(-1, 3)


# ---- spaces ------------------------------------------------------------------------------------------------------------


def _matrix(obj: bpy.types.Object) -> np.ndarray:
    matrix = np.array(obj.matrix_world, np.float64)
    if not np.isfinite(matrix).all() or not np.linalg.det(matrix[:3, :3]):
        raise MeasureError(f"'{obj.name}' has no size: its scale is 0 or not a number")
    return matrix


def to_local(obj: bpy.types.Object, world: np.ndarray) -> np.ndarray:
    matrix = _matrix(obj)
    return np.linalg.solve(matrix[:3, :3], (world - matrix[:3, 3]).T).T


def to_world(obj: bpy.types.Object, local: np.ndarray) -> np.ndarray:
    matrix = _matrix(obj)
    return local @ matrix[:3, :3].T + matrix[:3, 3]


def to_file(obj: bpy.types.Object, scene: bpy.types.Scene, local: np.ndarray) -> np.ndarray:
    """In the coordinates of the file that the object came from; Blender's, where it came from none."""
    turn, move = origin.to_file(obj, scene)
    return local @ turn.T + move


def from_file(obj: bpy.types.Object, scene: bpy.types.Scene, places: np.ndarray) -> np.ndarray:
    _matrix(obj)
    turn, move = origin.to_file(obj, scene)
    return np.linalg.solve(turn, (places - move).T).T


def is_placed(obj: bpy.types.Object, scene: bpy.types.Scene) -> bool:
    """Whether the object has coordinates of a file, or lies in a scene that has."""
    return origin.PROPERTY in obj or bool(origin.shared_of(obj, scene).any())


# ---- reading -----------------------------------------------------------------------------------------------------------


def read(obj: bpy.types.Object, index: int) -> Found:
    """MeasureError where what is kept cannot be measured."""
    entry = obj.patina.measures.entries[index]
    try:
        points = to_world(obj, unpacked(entry.places))
        measures.check(entry.kind, points)
    except MeasureError as error:
        raise MeasureError(f"{entry.name}: {error}") from None
    return Found(obj, index, entry.name, entry.kind, points, measures.values(entry.kind, points))


def measured(objects: Iterator[bpy.types.Object]) -> Iterator[bpy.types.Object]:
    """Those that have measurements."""
    return (obj for obj in objects if len(obj.patina.measures.entries))


def shown(layer: bpy.types.ViewLayer, space: bpy.types.SpaceView3D | None = None) -> Iterator[Found]:
    """Measurements that are not hidden, of visible objects. Damaged ones are left out. space: a 3D view, for local view."""
    for obj in measured(layer.objects):
        if not obj.visible_get(view_layer=layer) or space and not obj.visible_in_viewport_get(space):
            continue
        for index, entry in enumerate(obj.patina.measures.entries):
            if not entry.hide:
                try:
                    yield read(obj, index)
                except MeasureError:
                    continue


# ---- texts -------------------------------------------------------------------------------------------------------------


def texts(scene: bpy.types.Scene) -> Texts:
    """How values are written in the scene's units."""
    settings = scene.unit_settings
    scale = settings.scale_length

    def written(value: float, power: int) -> str:
        if settings.system == 'NONE':
            return f"{value:.{DIGITS}f}"
        if settings.length_unit in _FIXED:
            size, name, digits = _FIXED[settings.length_unit]
            digits = digits if power == 1 else min(digits, max(2 * digits - DIGITS, 0))
            return f"{value * (scale / size) ** power:.{digits}f} {name}{'²' if power == 2 else ''}"
        kind = 'LENGTH' if power == 1 else 'AREA'
        return bpy.utils.units.to_string(settings.system, kind, value * scale ** power, precision=DIGITS, split_unit=settings.use_separate)

    def angle(value: float) -> str:
        return f"{value:.4f} rad" if settings.system_rotation == 'RADIANS' else f"{math.degrees(value):.2f}°"

    return Texts(lambda value: written(value, 1), lambda value: written(value, 2), angle)


def place_text(found: Found, scene: bpy.types.Scene) -> str:
    """The coordinates of the first point: of the file that the object came from, or Blender's."""
    place = found.points[0]
    if is_placed(found.obj, scene):
        place = to_file(found.obj, scene, to_local(found.obj, found.points[:1]))[0]
    return ", ".join(f"{value:.{DIGITS}f}" for value in place)


def value_text(found: Found, scene: bpy.types.Scene) -> str:
    return place_text(found, scene) if found.kind == 'POINT' else measures.summary(found.kind, found.values, texts(scene))


def details(found: Found, scene: bpy.types.Scene) -> list[tuple[str, str]]:
    """Names and texts of all values, the most important first."""
    written, values = texts(scene), found.values
    if found.kind == 'DISTANCE':
        legs = [(f"Leg {number}", written.length(leg)) for number, leg in enumerate(values.legs, 1)]
        return [("Length", written.length(values.value)), *(legs if len(legs) > 1 else [])]
    if found.kind == 'HEIGHT':
        return [("Height", written.length(values.value)), ("Horizontal", written.length(values.horizontal))]
    if found.kind == 'ANGLE':
        return [("Angle", written.angle(values.value))]
    if found.kind == 'AREA':
        return [("Area", written.area(values.value)), ("Perimeter", written.length(values.perimeter))]
    return list(zip("XYZ", place_text(found, scene).split(", "), strict=True))


def figure(found: Found, scene: bpy.types.Scene) -> Figure:
    """In Blender's coordinates."""
    place = place_text(found, scene) if found.kind == 'POINT' else ""
    return measures.figure(found.kind, found.points, found.values, texts(scene), place)


# ---- files -------------------------------------------------------------------------------------------------------------


def _unit(scene: bpy.types.Scene) -> tuple[float, str]:
    """From a scene unit to the unit that values are exported in, and its name."""
    settings = scene.unit_settings
    if settings.system == 'NONE':
        return 1.0, ""
    return (settings.scale_length / _FOOT, "ft") if settings.system == 'IMPERIAL' else (settings.scale_length, "m")


def _insert(meters: float) -> int:
    return next((number for size, number in _INSERT if math.isclose(size, meters, rel_tol=1e-6)), 0)


def exported(found: Found, scene: bpy.types.Scene, as_file: bool) -> Measurement:
    """as_file: drawings are written in the coordinates of the file that the object came from, else in Blender's."""
    local = to_local(found.obj, found.points)
    drawn = figure(found, scene)
    settings = scene.unit_settings
    insert = 0 if settings.system == 'NONE' else _insert(settings.scale_length)
    if as_file and is_placed(found.obj, scene):
        def moved(points: np.ndarray) -> np.ndarray:
            return to_file(found.obj, scene, to_local(found.obj, points))

        drawn = Figure(tuple(map(moved, drawn.lines)), tuple((moved(place[None])[0], text) for place, text in drawn.labels), drawn.closed)
        insert = _insert(abs(np.linalg.det(origin.axes_of(found.obj))) ** (1.0 / 3.0))
    factor, unit = _unit(scene)
    return Measurement(found.name, found.kind, found.obj.name, found.values, factor, unit, found.points, to_file(found.obj, scene, local), drawn, insert)
