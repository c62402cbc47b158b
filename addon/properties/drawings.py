# SPDX-License-Identifier: GPL-3.0-or-later
"""Survey drawings: an object's plane with an extent, a depth and a scale."""

from __future__ import annotations

import bpy
from bpy.types import PropertyGroup

from .automatic import switch
from .measures import redraw

_OVERRIDE = {'LIBRARY_OVERRIDABLE'}

KINDS = (
    ('PLAN', "Plan", "Seen from above", 1),
    ('ELEVATION', "Elevation", "A wall or a building, seen from the front", 2),
    ('SECTION', "Section", "What the plane cuts, and what is behind it", 3),
    ('CEILING', "Reflected Ceiling Plan", "What is above the plane, as a mirror on the floor shows it", 4))


def _length(name: str, default: float, about: str) -> bpy.props.FloatProperty:
    return bpy.props.FloatProperty(name=name, override=_OVERRIDE, default=default, min=0.0, soft_max=1000.0, subtype='DISTANCE', unit='LENGTH',
                                   precision=4, update=redraw, description=about)


def _line_third(group: PropertyGroup) -> float:
    return round(group.scale * 0.25e-3 / 3.0, 5) or 1e-3


class PatinaDrawingProperties(PropertyGroup):
    kind: bpy.props.EnumProperty(
        name="Drawing", override=_OVERRIDE, default='NONE', update=redraw, description="What kind of survey drawing this object is",
        items=(('NONE', "None", "No drawing", 0), *KINDS))
    width: _length("Width", 10.0, "Width of the extent, along the object's X axis")
    height: _length("Height", 10.0, "Height of the extent, along the object's Y axis")
    front: _length("In Front", 0.0, "Distance in front of the plane up to which the image shows points")
    back: _length("Behind", 10.0, "Distance behind the plane up to which the image shows points")
    scale: bpy.props.FloatProperty(name="Scale 1 :", override=_OVERRIDE, default=50.0, min=0.0, soft_max=10000.0, precision=1, update=redraw,
                                   description="Meters of the building per meter on paper")
    pixel: _length("Pixel Size", 0.0, "Size of a pixel on the building")
    use_pixel: switch("pixel", _line_third, "Set the size of a pixel. Disabled: a third of a line of 0.25 mm on paper")
    thickness: _length("Cut Thickness", 0.0, "Thickness of the slab of points through which cut lines are traced. A thicker one suits sparse scans of straight walls")
    use_thickness: switch("thickness", 0.02, "Set the thickness of the slab. Disabled: three times the distance between points", "Set Cut Thickness")
