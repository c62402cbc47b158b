# SPDX-License-Identifier: GPL-3.0-or-later
"""Measurements, which an object keeps and takes along."""

from __future__ import annotations

import bpy
from bpy.types import Context, PropertyGroup

_OVERRIDE = {'LIBRARY_OVERRIDABLE'}

KINDS = (
    ('DISTANCE', "Distance", "Length of a line through two points or more, in total and for each leg", 'DRIVER_DISTANCE', 0),
    ('HEIGHT', "Height", "Vertical and horizontal distance of two points", 'EMPTY_SINGLE_ARROW', 1),
    ('ANGLE', "Angle", "Angle between three points. The second is the corner", 'DRIVER_ROTATIONAL_DIFFERENCE', 2),
    ('AREA', "Area", "Area and perimeter of a polygon, on the plane that fits its corners best", 'MESH_PLANE', 3),
    ('POINT', "Point", "Coordinates of one point", 'EMPTY_AXIS', 4))


def redraw(_group: PropertyGroup | None, context: Context) -> None:
    """Draws all 3D views again."""
    for window in context.window_manager.windows if context.window_manager else ():
        for area in window.screen.areas:
            if area.type == 'VIEW_3D':
                area.tag_redraw()


class PatinaMeasure(PropertyGroup):
    name: bpy.props.StringProperty(name="Name", override=_OVERRIDE, update=redraw, description="Name of the measurement")
    kind: bpy.props.EnumProperty(name="Kind", override=_OVERRIDE, update=redraw, items=KINDS, description="What is measured between the points")
    hide: bpy.props.BoolProperty(name="Hide", override=_OVERRIDE, default=False, update=redraw,
                                 description="Hide the measurement in 3D views and renders. It stays in the list and in exports")
    # x y z of each, separated by blanks: Blender's own numbers are float32
    places: bpy.props.StringProperty(name="Coordinates", override=_OVERRIDE, update=redraw, options={'HIDDEN'},
                                     description="Points of the measurement in the object's own space")


class PatinaMeasuresProperties(PropertyGroup):
    entries: bpy.props.CollectionProperty(type=PatinaMeasure, name="Measurements", override={'LIBRARY_OVERRIDABLE', 'USE_INSERTION'},
                                          description="Measurements of this object", options={'HIDDEN'})
    active: bpy.props.IntProperty(name="Measurement", override=_OVERRIDE, default=0, min=0, options={'HIDDEN'},
                                  description="Active measurement in the list")
