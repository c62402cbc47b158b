# SPDX-License-Identifier: GPL-3.0-or-later
"""How an object's points are drawn as range images [Kawata & Kanai]."""

from __future__ import annotations

import math

from bpy.types import PropertyGroup

from .automatic import switch
from .heard import BoolProperty, FloatProperty

_OVERRIDE = {'LIBRARY_OVERRIDABLE'}

SHARPNESS = 0.75  # within [K II.E]'s 0.66 to 0.83


class PatinaRangeProperties(PropertyGroup):
    use: BoolProperty(
        name="Range Images", override=_OVERRIDE, default=False,
        description="Draw this object as range images whatever the scene's surface is: scans that do not quite fit merge into one "
                    "surface, whose normals come from the picture. For points of one or several scanners")
    gamma: FloatProperty(
        name="Merge Distance", override=_OVERRIDE, default=0.0, min=0.0, soft_max=1.0, subtype='DISTANCE', unit='LENGTH', precision=4,
        description="Points so far behind the nearest one in their pixel are of one surface with it, and greater steps are edges: as much "
                    "as scans are off each other")
    use_gamma: switch("gamma", 0.01, "A distance of your own; else twice the way between the scanner's samples")
    pixel: FloatProperty(
        name="Pixel Size", override=_OVERRIDE, default=0.0, min=0.0, soft_min=1.0, soft_max=8.0, max=64.0, precision=2,
        description="Pixels of the picture across one of those in which points are merged: larger ones close wider gaps, and blur")
    use_pixel: switch("pixel", 2.0, "A size of your own; else so that neighboring samples fall into neighboring pixels, of several sizes where "
                                 "points lie closer here than there")
    sharpness: FloatProperty(
        name="Sharpness", override=_OVERRIDE, default=0.0, min=0.0, soft_min=0.5, max=0.95, precision=2,
        description="A second, finer picture shows where many points share a pixel and at outlines: its pixels are so much smaller. "
                    "Takes twice as long")
    use_sharpness: switch("sharpness", SHARPNESS, "Two passes: sharper outlines and details; else one", "Two Passes")
    use_cull: BoolProperty(
        name="Cull Scans", override=_OVERRIDE, default=False,
        description="Leave out scans that looked another way than the view does, whole: faster, and their undersides cannot show. For scans "
                    "whose direction is known")
    cull: FloatProperty(
        name="Angle", override=_OVERRIDE, default=math.radians(90.0), min=math.radians(1.0), max=math.pi, subtype='ANGLE',
        description="Scans are left out whose direction is farther than this from the view's")
