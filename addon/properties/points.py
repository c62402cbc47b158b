# SPDX-License-Identifier: GPL-3.0-or-later
"""Single points of linked clouds: how they are chosen; and the scans of any cloud: which are shown, and how they are graded."""

from __future__ import annotations

from bpy.props import CollectionProperty
from bpy.types import PropertyGroup

from .heard import BoolProperty, FloatProperty, IntProperty, StringProperty

_OVERRIDE = {'LIBRARY_OVERRIDABLE'}


class PatinaScanProperties(PropertyGroup):
    """Whether one scan is shown, and how its colors are changed; its name is what the list shows."""

    number: IntProperty(name="Number", override=_OVERRIDE, default=-1, options={'HIDDEN'},
                        description="Value of the scan attribute. -1: there is no attribute, and this entry stands for all points")
    count: StringProperty(name="Points", override=_OVERRIDE, options={'HIDDEN'}, description="Number of points")
    hide: BoolProperty(name="Hide", override=_OVERRIDE, default=False,
                       description="Hide the points of this scan. They cast no shadow and stay in exports")
    solo: BoolProperty(name="Solo", override=_OVERRIDE, default=False, description="Draw only the scans that are solo")
    gain: FloatProperty(name="Gain", override=_OVERRIDE, default=1.0, min=0.0, soft_max=4.0, max=1000.0, precision=3,
                        description="Exposure of the scan's colors")
    gamma: FloatProperty(name="Gamma", override=_OVERRIDE, default=1.0, min=0.1, soft_min=0.25, soft_max=4.0, max=10.0, precision=3,
                         description="Gamma. Above 1 dark parts become lighter, below 1 darker")
    saturation: FloatProperty(name="Saturation", override=_OVERRIDE, default=1.0, min=0.0, soft_max=2.0, max=10.0, precision=3,
                              description="Saturation. 0 is gray, 1 is unchanged")
    temperature: FloatProperty(name="Temperature", override=_OVERRIDE, default=0.0, soft_min=-2.0, soft_max=2.0, min=-8.0, max=8.0,
                               precision=3, description="Color temperature, in stops between red and blue. Above 0 is warmer, below 0 is colder")


class PatinaPointsProperties(PropertyGroup):
    through: BoolProperty(
        name="Through", override=_OVERRIDE, default=False,
        description="Also select points hidden behind others")
    scans: CollectionProperty(type=PatinaScanProperties, name="Scans", override=_OVERRIDE,
                              description="Scans of the points, with visibility and color grading")
    use_balance: BoolProperty(
        name="Balance Scans", override=_OVERRIDE, default=True,
        description="Match exposure and white balance of the scans where they overlap")
    use_lent_colors: BoolProperty(
        name="Color Uncolored Points", override=_OVERRIDE, default=True,
        description="Give black points among colored ones the mean color of their trusted neighbors. Needs the analysis")
    scan: IntProperty(name="Scan", override=_OVERRIDE, default=0, min=0, options={'HIDDEN'}, description="Active scan in the list")
    class_number: IntProperty(name="Class", override=_OVERRIDE, default=2, min=0, max=255,
                              description="LAS class to select: 2 ground, 6 building, 7 noise")
