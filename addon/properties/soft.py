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
        description="Draw points as balls of density instead of a surface: all points, or those chosen below. They cast and receive shadows")
    styled: BoolProperty(override=_OVERRIDE, default=False, options={'HIDDEN'})  # by a style: the next one undoes it
    by: EnumProperty(
        name="Soft", override=_OVERRIDE, default='ALL',
        description="Which points are soft: those whose number, brought to 0 to 1, is above the threshold",
        items=(
            ('ALL', "All Points", "Every point", 0),
            ('ATTRIBUTE', "Attribute", "Numbers that the points have, a vertex group or painted weights", 1),
            ('LUMINANCE', "Luminance", "How bright a point's own color is", 2),
            ('CLASSES', "Classes", "Points of the classes named below", 3),
            ('DISTANCE', "Distance", "How far a point is from an object, or from the camera", 4),
            ('UNCERTAINTY', "Uncertainty", "How badly a point's neighbors agree with its normal. Takes a while for many points", 5),
            ('DENSITY', "Density", "How dense the points lie", 6)))
    attribute: StringProperty(
        name="Attribute", override=_OVERRIDE, search=attribute_names, search_options={'SUGGESTION'},
        description="Point attribute of numbers, or vertex group; of a linked file: one of its columns")
    classes: StringProperty(name="Classes", override=_OVERRIDE, default="3-5", description="Classes that are soft, up to 255: 3-5, 64")
    target: PointerProperty(
        name="Object", type=bpy.types.Object, override=_OVERRIDE, description="What distances are from; none: the scene's camera")
    shape: EnumProperty(
        name="From", override=_OVERRIDE, default='POINT', description="What of the object distances are from",
        items=(
            ('POINT', "Its Origin", "In all directions", 0),
            ('PLANE', "Its Plane", "Along its Z; below its X and Y axes the distance is negative. A camera's looks towards negative ones", 1),
            ('AXIS', "Its Axis", "Across its Z axis: a column", 2)))
    use_range: BoolProperty(
        name="Range", override=_OVERRIDE, default=False,
        description="Numbers count from 0 to 1 between the values below; else as they are where all are within 0 and 1, or from their "
                    "least to their greatest but for one of a hundred")
    range_min: FloatProperty(name="From", override=_OVERRIDE, default=0.0, precision=3, description="Number that counts as 0")
    range_max: FloatProperty(name="To", override=_OVERRIDE, default=1.0, precision=3, description="Number that counts as 1")
    invert: BoolProperty(name="Invert", override=_OVERRIDE, default=False, description="Soft is what would not be, and the reverse")
    threshold: FloatProperty(
        name="Threshold", override=_OVERRIDE, default=0.5, min=0.0, max=1.0, subtype='FACTOR',
        description="Points with more than this, of 0 to 1, are soft")
    transition: FloatProperty(
        name="Transition", override=_OVERRIDE, default=0.0, min=0.0, max=1.0, subtype='FACTOR',
        description="Share of the range above the threshold over which points lead from dense to soft, so that no edge shows. Of all "
                    "points: how much each shows by itself")
    use_radius: BoolProperty(name="Radius", override=_OVERRIDE, default=False,
                             description="One radius for all; else each point's own where an attribute says so, else 1.13 spacings")
    radius: FloatProperty(
        name="Radius", override=_OVERRIDE, default=0.05, min=1e-6, soft_max=1.0, subtype='DISTANCE', unit='LENGTH', precision=4,
        description="Of the balls")
    opacity: FloatProperty(
        name="Opacity", override=_OVERRIDE, default=0.5, min=0.001, max=1.0, subtype='FACTOR',
        description="Of a ball through its center, times the points' opacity")
