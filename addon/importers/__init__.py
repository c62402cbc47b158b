# SPDX-License-Identifier: GPL-3.0-or-later
"""Files → points → meshes of vertices with attributes. One module a format reads; the mesh is made here."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

# One colour and one normal attribute, under names that every Blender from 3.4 on allows ("normal" is reserved
# before 4.0) and that sync.attributes looks for.
COLOR_NAME = "Col"
NORMAL_NAME = "Normal"


@dataclass(frozen=True)
class PointFile:
    name: str
    positions: np.ndarray  # (n, 3) float32, relative to origin
    normals: np.ndarray | None  # (n, 3) float32
    colors: np.ndarray | None  # (n, 4) uint8 sRGB or float32 linear
    scalars: dict[str, np.ndarray]  # (n,) float32 by name
    origin: tuple[float, float, float]  # float64
    invalid: int  # positions that are not finite


def to_mesh(points: PointFile) -> bpy.types.Mesh:
    """A mesh of vertices alone. Byte colours stay bytes, everything else is float."""
    mesh = bpy.data.meshes.new(points.name)
    mesh.vertices.add(len(points.positions))
    mesh.vertices.foreach_set("co", points.positions.reshape(-1))
    if points.colors is not None:
        _add_colors(mesh, points.colors)
    if points.normals is not None:
        _add(mesh, NORMAL_NAME, 'FLOAT_VECTOR').data.foreach_set("vector", points.normals.reshape(-1))
    for name, values in points.scalars.items():
        _add(mesh, name, 'FLOAT').data.foreach_set("value", values)
    mesh.update()
    return mesh


def _add_colors(mesh: bpy.types.Mesh, colors: np.ndarray) -> None:
    if colors.dtype == np.uint8:
        attribute = _add(mesh, COLOR_NAME, 'BYTE_COLOR')
        attribute.data.foreach_set("color_srgb", (colors / np.float32(255)).reshape(-1))
    else:
        attribute = _add(mesh, COLOR_NAME, 'FLOAT_COLOR')
        attribute.data.foreach_set("color", colors.reshape(-1))
    mesh.color_attributes.active_color = mesh.attributes[attribute.name]


def _add(mesh: bpy.types.Mesh, name: str, kind: str) -> bpy.types.Attribute:
    """A new point attribute; Blender refuses some names ("id", "crease", ... by version) and clashes: those get
    a prefix."""
    if name and name not in mesh.attributes:
        try:
            attribute = mesh.attributes.new(name, kind, 'POINT')
        except RuntimeError:
            attribute = None
        if attribute:
            return attribute
    return mesh.attributes.new(f"file_{name}", kind, 'POINT')
