# SPDX-License-Identifier: GPL-3.0-or-later
"""Single points of linked clouds: how they are chosen; and the scans of any cloud: which are shown, and how they are graded."""

from __future__ import annotations

from bpy.props import CollectionProperty
from bpy.types import PropertyGroup

from .heard import BoolProperty, FloatProperty, FloatVectorProperty, IntProperty, StringProperty

_OVERRIDE = {'LIBRARY_OVERRIDABLE'}


class PatinaScanProperties(PropertyGroup):
    """Whether one scan is shown, and how its colors are changed; its name is what the list shows."""

    number: IntProperty(name="Number", override=_OVERRIDE, default=-1, options={'HIDDEN'},
                        description="What the point attribute says of its points; -1: there is none, and these are all")
    count: StringProperty(name="Points", override=_OVERRIDE, options={'HIDDEN'}, description="How many points it has")
    hide: BoolProperty(name="Hide", override=_OVERRIDE, default=False,
                       description="Its points are not drawn and cast no shadow; they stay in exports")
    solo: BoolProperty(name="Solo", override=_OVERRIDE, default=False, description="Of all scans draw only those that are solo")
    balance: FloatVectorProperty(
        name="Balance", override=_OVERRIDE, size=3, default=(1.0, 1.0, 1.0), min=0.0, soft_max=4.0, max=1000.0, precision=3,
        description="Multiplies the light of red, green and blue, as Balance Colors found, while Balance is on")
    gain: FloatProperty(name="Gain", override=_OVERRIDE, default=1.0, min=0.0, soft_max=4.0, max=1000.0, precision=3,
                        description="Multiplies the light of the colors")
    gamma: FloatProperty(name="Gamma", override=_OVERRIDE, default=1.0, min=0.1, soft_min=0.25, soft_max=4.0, max=10.0, precision=3,
                         description="Above 1 dark parts become lighter, below 1 darker; white stays")
    saturation: FloatProperty(name="Saturation", override=_OVERRIDE, default=1.0, min=0.0, soft_max=2.0, max=10.0, precision=3,
                              description="0: gray; 1: as it is")
    temperature: FloatProperty(name="Temperature", override=_OVERRIDE, default=0.0, soft_min=-2.0, soft_max=2.0, min=-8.0, max=8.0,
                               precision=3, description="Above 0 warmer, below 0 colder, at the same lightness; stops between red and blue")


class PatinaPointsProperties(PropertyGroup):
    through: BoolProperty(
        name="Through", override=_OVERRIDE, default=False,
        description="Select points that others hide too; else only those that the view shows")
    scans: CollectionProperty(type=PatinaScanProperties, name="Scans", override=_OVERRIDE,
                              description="That the points are of: which are shown, and what is changed of the colors of each")
    use_balance: BoolProperty(
        name="Balance", override=_OVERRIDE, default=False,
        description="Bring the colors of the scans to each other, by what Balance Colors found where they overlap")
    scan: IntProperty(name="Scan", override=_OVERRIDE, default=0, min=0, options={'HIDDEN'}, description="Active in the list")
    class_number: IntProperty(name="Class", override=_OVERRIDE, default=2, min=0, max=255,
                              description="Class to select, as in LAS: 2 ground, 6 building, 7 noise")
