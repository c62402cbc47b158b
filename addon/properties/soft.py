# SPDX-License-Identifier: GPL-3.0-or-later
"""Which points of an object are soft, and what their balls are like."""

from __future__ import annotations

import bpy
from bpy.types import PropertyGroup

from .heard import BoolProperty, EnumProperty, FloatProperty, PointerProperty, StringProperty
from .numbers import attribute_names

_OVERRIDE = {'LIBRARY_OVERRIDABLE'}


class PatinaSoftProperties(PropertyGroup):
    use: BoolProperty(
        name="Soft Points", override=_OVERRIDE, default=False,
        description="Draw points as soft balls instead of a surface: all points, or those chosen below. They cast and receive shadows")
    styled: BoolProperty(override=_OVERRIDE, default=False, options={'HIDDEN'})  # by a style: the next one undoes it
    by: EnumProperty(
        name="Soft", override=_OVERRIDE, default='ALL',
        description="Value that decides which points are soft: those whose value, mapped to 0 to 1, is above the threshold",
        items=(
            ('ALL', "All Points", "Every point", 0),
            ('ATTRIBUTE', "Attribute", "A point attribute, a vertex group or painted weights", 1),
            ('LUMINANCE', "Luminance", "Brightness of the point's own color", 2),
            ('CLASSES', "Classes", "Points of the classes listed below", 3),
            ('DISTANCE', "Distance", "Distance from an object or from the camera", 4),
            ('UNCERTAINTY', "Uncertainty", "Disagreement between a point's normal and its neighbors. Takes time for many points", 5),
            ('DENSITY', "Density", "Density of the points", 6)))
    attribute: StringProperty(
        name="Attribute", override=_OVERRIDE, search=attribute_names, search_options={'SUGGESTION'},
        description="Point attribute or vertex group. For a linked file: one of its columns")
    classes: StringProperty(name="Classes", override=_OVERRIDE, default="3-5", description="Classes that are soft, up to 255, such as 3-5, 64")
    target: PointerProperty(
        name="Object", type=bpy.types.Object, override=_OVERRIDE, description="Object that distances are measured from. None: the scene's camera")
    shape: EnumProperty(
        name="From", override=_OVERRIDE, default='POINT', description="Part of the object that distances are measured from",
        items=(
            ('POINT', "Its Origin", "Distance from the object's origin", 0),
            ('PLANE', "Its Plane", "Distance along the object's Z axis. Negative below its XY plane", 1),
            ('AXIS', "Its Axis", "Distance from the object's Z axis", 2)))
    use_range: BoolProperty(
        name="Range", override=_OVERRIDE, default=False,
        description="Map the values between the limits below to 0 to 1. Disabled: values within 0 and 1 are used unchanged, others are mapped from "
                    "their 1st to their 99th percentile")
    range_min: FloatProperty(name="From", override=_OVERRIDE, default=0.0, precision=3, description="Value that is mapped to 0")
    range_max: FloatProperty(name="To", override=_OVERRIDE, default=1.0, precision=3, description="Value that is mapped to 1")
    invert: BoolProperty(name="Invert", override=_OVERRIDE, default=False, description="Swap soft and solid points")
    hide: BoolProperty(
        name="Hide", override=_OVERRIDE, default=False,
        description="Hide the points above the threshold instead of drawing them as soft balls. They cast no shadow and stay in exports")
    threshold: FloatProperty(
        name="Threshold", override=_OVERRIDE, default=0.5, min=0.0, max=1.0, subtype='FACTOR',
        description="Points with a mapped value above this are soft")
    transition: FloatProperty(
        name="Transition", override=_OVERRIDE, default=0.0, min=0.0, max=1.0, subtype='FACTOR',
        description="Share of the range above the threshold over which points change from solid to soft. If all points are soft: how much each one "
                    "shows")
    use_radius: BoolProperty(name="Radius", override=_OVERRIDE, default=False,
                             description="Use one radius for all points. Disabled: the radius attribute of each point, or 1.13 spacings")
    radius: FloatProperty(
        name="Radius", override=_OVERRIDE, default=0.05, min=1e-6, soft_max=1.0, subtype='DISTANCE', unit='LENGTH', precision=4,
        description="Radius of the balls")
    opacity: FloatProperty(
        name="Opacity", override=_OVERRIDE, default=0.5, min=0.001, max=1.0, subtype='FACTOR',
        description="Opacity of a ball through its center, multiplied by the points' opacity")
