# SPDX-License-Identifier: GPL-3.0-or-later
"""The color that points without one take from their material, as Geometry Nodes sets it: Blender knows one for a point cloud."""

from __future__ import annotations

import bpy

from .meshes import base_color


def color(obj: bpy.types.Object) -> tuple[float, ...]:
    """Of an evaluated object's points that have none: the artist's, else that of the first material, else the usual gray."""
    patina, materials = obj.patina, getattr(obj.data, "materials", ())
    first = next(iter(materials), None)
    if patina.is_property_set("color") or first is None:
        return tuple(patina.color)
    return tuple(base_color(first)[:3])
