# SPDX-License-Identifier: GPL-3.0-or-later
"""Points of files → PointClouds or meshes of vertices, with attributes."""

from __future__ import annotations

import bpy
import numpy as np

from ... import point_data
from ...read.importers import PointFile, told

# One colour and one normal attribute, under names that every Blender from 3.4 on allows ("normal" is reserved
# before 4.0) and that sync.attributes looks for.
# Not "color": of a PointCloud, Cycles 4.5 to 5.2 shows an attribute of that name black.
COLOR_NAME = "Col"
NORMAL_NAME = "Normal"

# What Blender takes bytes as: as they are from 4.2 on (0.1 ms a million), before that rather as wider ones (25 ms, bytes 55).
WHOLE = np.int8 if bpy.app.version >= (4, 2, 0) else np.int32


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
