# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects that cut clouds."""

from __future__ import annotations

from bpy.types import PropertyGroup

from .heard import BoolProperty, EnumProperty, FloatProperty, FloatVectorProperty

_OVERRIDE = {'LIBRARY_OVERRIDABLE'}


class PatinaClipProperties(PropertyGroup):
    shape: EnumProperty(
        name="Shape", override=_OVERRIDE, default='NONE',
        description="Whether this object clips points",
        items=(
            ('NONE', "None", "No clipping", 0),
            ('BOX', "Clip Box", "Clip with the cube of an empty, or with the bounding box of a mesh", 1),
            ('PLANE', "Clip Plane", "Clip what is above the object's XY plane", 2)))
    cut: BoolProperty(
        name="Cut Out", override=_OVERRIDE, default=False,
        description="Box: hide the points inside instead of outside. Plane: hide the points below instead of above")
    tint: FloatVectorProperty(
        name="Tint", override=_OVERRIDE, default=(0.9, 0.06, 0.03), min=0.0, soft_max=1.0, subtype='COLOR', size=3,
        description="Color of points near the cut")
    tint_strength: FloatProperty(
        name="Strength", override=_OVERRIDE, default=0.0, min=0.0, max=1.0, subtype='FACTOR',
        description="Strength of the tint")
    tint_width: FloatProperty(
        name="Width", override=_OVERRIDE, default=0.05, min=0.0, soft_max=10.0, subtype='DISTANCE', unit='LENGTH',
        precision=3, description="Distance from the cut up to which points are tinted")
