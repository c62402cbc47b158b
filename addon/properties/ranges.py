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
        description="Draw this object as range images, whatever the scene's Surface setting is. Merges scans that do not fit exactly into one "
                    "surface")
    gamma: FloatProperty(
        name="Merge Distance", override=_OVERRIDE, default=0.0, min=0.0, soft_max=1.0, subtype='DISTANCE', unit='LENGTH', precision=4,
        description="Largest depth difference between points of one surface. Larger steps are edges. Set it to the distance between misaligned scans")
    use_gamma: switch("gamma", 0.01, "Use a fixed distance. Disabled: twice the distance between the scanner's samples")
    pixel: FloatProperty(
        name="Pixel Size", override=_OVERRIDE, default=0.0, min=0.0, soft_min=1.0, soft_max=8.0, max=64.0, precision=2,
        description="Width of a merging cell, in pixels. Larger cells close wider gaps and blur more")
    use_pixel: switch("pixel", 2.0, "Use a fixed size. Disabled: neighboring samples fall into neighboring pixels, with several sizes if the "
                                 "density varies")
    sharpness: FloatProperty(
        name="Sharpness", override=_OVERRIDE, default=0.0, min=0.0, soft_min=0.5, max=0.95, precision=2,
        description="Size of the cells of a second, finer image, relative to the first. It is used at outlines and where many points share a cell. "
                    "Takes twice as long")
    use_sharpness: switch("sharpness", SHARPNESS, "Render two passes, with sharper outlines and details. Disabled: one pass", "Two Passes")
    use_cull: BoolProperty(
        name="Cull Scans", override=_OVERRIDE, default=False,
        description="Leave out scans that look away from the view direction. Faster, and hides their back sides. Needs scan directions")
    cull: FloatProperty(
        name="Angle", override=_OVERRIDE, default=math.radians(90.0), min=math.radians(1.0), max=math.pi, subtype='ANGLE',
        description="Leave out scans whose direction differs from the view direction by more than this angle")
