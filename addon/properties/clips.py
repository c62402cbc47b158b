# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects that cut clouds."""

from __future__ import annotations

from bpy.types import PropertyGroup

from .heard import BoolProperty, EnumProperty, FloatProperty, FloatVectorProperty

_OVERRIDE = {'LIBRARY_OVERRIDABLE'}


class PatinaClipProperties(PropertyGroup):
    shape: EnumProperty(
        name="Shape", override=_OVERRIDE, default='NONE',
        description="Whether this object cuts points",
        items=(
            ('NONE', "None", "An object like any other", 0),
            ('BOX', "Clip Box", "The cube of an empty, or the bounding box of a mesh", 1),
            ('PLANE', "Clip Plane", "The object's XY plane: what lies above it is cut off", 2)))
    cut: BoolProperty(
        name="Cut Out", override=_OVERRIDE, default=False,
        description="Box: cuts out what lies in it, else keeps only that. Plane: cuts off what lies below")
    tint: FloatVectorProperty(
        name="Tint", override=_OVERRIDE, default=(0.9, 0.06, 0.03), min=0.0, soft_max=1.0, subtype='COLOR', size=3,
        description="Color of the points beside the cut")
    tint_strength: FloatProperty(
        name="Strength", override=_OVERRIDE, default=0.0, min=0.0, max=1.0, subtype='FACTOR',
        description="How much of the tint there is; 0: none")
    tint_width: FloatProperty(
        name="Width", override=_OVERRIDE, default=0.05, min=0.0, soft_max=10.0, subtype='DISTANCE', unit='LENGTH',
        precision=3, description="How far from the cut the tint reaches")
