# SPDX-License-Identifier: GPL-3.0-or-later
"""Files → points → PointClouds or meshes of vertices, with attributes. One module a format reads; the data is made here."""

from __future__ import annotations

from collections.abc import Collection
from importlib import import_module
from pathlib import Path
from types import ModuleType

import bpy
import numpy as np

from .. import point_data
from ..jobs import Steps
from ..native import PatinaError
from .reading import Filter, Pieces, PointFile, Progress, name_of, regular, told

__all__ = ["FORMATS", "Filter", "Pieces", "PointFile", "Progress", "in_pieces", "name_of", "preview", "reader", "steps", "to_data", "told"]

# One colour and one normal attribute, under names that every Blender from 3.4 on allows ("normal" is reserved
# before 4.0) and that sync.attributes looks for.
# Not "color": of a PointCloud, Cycles 4.5 to 5.2 shows an attribute of that name black.
COLOR_NAME = "Col"
NORMAL_NAME = "Normal"

# What Blender takes bytes as: as they are from 4.2 on (0.1 ms a million), before that rather as wider ones (25 ms, bytes 55).
WHOLE = np.int8 if bpy.app.version >= (4, 2, 0) else np.int32


# ending → module with read(path, filter, progress), steps(path, filter, progress) and preview(path), loaded with its first file
FORMATS = {".ply": "library", ".xyz": "library", ".txt": "library", ".csv": "library", ".asc": "library", ".pts": "library",
           ".ptx": "library", ".las": "las", ".laz": "las", ".e57": "e57", ".pcd": "pcd", ".conf": "library",
           ".cloud": "saved"}
PACKED_SPLATS = {".spz", ".splat", ".ksplat", ".sog"}


def reader(path: Path) -> ModuleType:
    """The module for a file's ending; PatinaError names those there are."""
    name = FORMATS.get(path.suffix.lower())
    if path.suffix.lower() in PACKED_SPLATS:
        raise PatinaError(f"packed Gaussian splats ({path.suffix}) are not read: convert them to a PLY, as SuperSplat exports it", -5)
    if path.name.lower() == "ept.json":
        raise PatinaError("EPT folders can only be linked. Enable Link", -5)
    if name is None:
        raise PatinaError(f"'{path.suffix}' is none of {' '.join(FORMATS)}", -5)
    regular(path)  # raises where it is no file
    return import_module(f"{__name__}.{name}")


def steps(path: Path, wanted: Filter, progress: Progress) -> Steps[PointFile]:
    """A file's points, read in steps. PatinaError when it cannot be read."""
    return (yield from reader(path).steps(path, wanted, progress))


def in_pieces(path: Path, least: int, names: Collection[str], progress: Progress) -> Steps[Pieces | None]:
    """The points of a file of more than least, with those scalars that are named; None where there are not so many, or where the
    format is read whole. PatinaError when it cannot be read."""
    pieces = getattr(reader(path), "in_pieces", None)
    return (yield from pieces(path, least, names, progress)) if pieces else None


def preview(path: Path) -> list[str]:
    """What is inside, a few lines, without reading the points. Never raises."""
    try:
        return [told(line) for line in reader(path).preview(path)]
    except (PatinaError, OSError, ValueError) as error:
        return [told(error)]


def to_data(points: PointFile, cloud: bool) -> bpy.types.ID:
    """A PointCloud, or a mesh of vertices alone. Byte colours stay bytes, and so do scalars from -128 to 127 that come as such;
    everything else is float. Takes the arrays out of `points` one by one: a large file needs little more memory than the data."""
    data = point_data.new(told(points.name), points.positions, cloud)
    places = points.positions if cloud and point_data.RADIUS not in points.scalars else None
    points.positions = points.positions[:0].copy()
    if points.colors is not None:
        name = _add_colors(data, points.colors)
        points.colors = None
        if cloud:
            data.materials.append(point_data.color_material(name))
    if points.normals is not None:
        _add(data, NORMAL_NAME, 'FLOAT_VECTOR').data.foreach_set("vector", points.normals.reshape(-1))
        points.normals = None
    for name in list(points.scalars):
        _add_scalar(data, name, points.scalars.pop(name))
    for name, value in points.notes.items():
        data[f"patina_{name}"] = value
    data = point_data.finished(data, cloud)
    if places is not None:
        point_data.add_display_radii(data, places)
    return data


def _add_colors(data: bpy.types.ID, colors: np.ndarray) -> str:
    """Returns the name of the attribute."""
    if colors.dtype == np.uint8:
        attribute = _add(data, COLOR_NAME, 'BYTE_COLOR')
        attribute.data.foreach_set("color_srgb", (colors / np.float32(255)).reshape(-1))
    else:
        attribute = _add(data, COLOR_NAME, 'FLOAT_COLOR')
        attribute.data.foreach_set("color", colors.reshape(-1))
    name = attribute.name
    if hasattr(data.color_attributes, "active_color"):  # of meshes
        data.color_attributes.active_color = data.attributes[name]
    return name


def _add_scalar(data: bpy.types.ID, name: str, values: np.ndarray) -> None:
    if values.dtype.itemsize == 1 and values.max(initial=0) <= 127 and name != point_data.RADIUS:  # that of Blender's is a float
        values = values.astype(WHOLE)
        kind = 'INT8'
    else:
        values = values.astype(np.float32, copy=False)
        kind = 'FLOAT'
    _add(data, name, kind).data.foreach_set("value", values)


def _add(data: bpy.types.ID, name: str, kind: str) -> bpy.types.Attribute:
    """A new point attribute; Blender refuses some names ("id", "crease", ... by version) and clashes: those get
    a prefix."""
    if name and name not in data.attributes:
        try:
            attribute = data.attributes.new(name, kind, 'POINT')
        except RuntimeError:
            attribute = None
        if attribute:
            return attribute
    return data.attributes.new(f"file_{name}", kind, 'POINT')
