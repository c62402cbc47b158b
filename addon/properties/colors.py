# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the colour of an object's points comes from, and which classes are hidden."""

from __future__ import annotations

import bpy
from bpy.types import PropertyGroup

from .heard import BoolProperty, BoolVectorProperty, EnumProperty, FloatProperty, PointerProperty, StringProperty

_OVERRIDE = {'LIBRARY_OVERRIDABLE'}

CLASSES = 32  # with a switch of their own: Blender's vectors end there, and those of LAS before 1.4

# LAS 1.4, table 17
CLASS_NAMES = ("Never Classified", "Unassigned", "Ground", "Low Vegetation", "Medium Vegetation", "High Vegetation",
               "Building", "Low Point", "Key Point", "Water", "Rail", "Road Surface", "Overlap", "Wire, Guard",
               "Wire, Conductor", "Transmission Tower", "Wire Connector", "Bridge Deck", "High Noise")


def class_name(number: int) -> str:
    return f"{number}  {CLASS_NAMES[number]}" if number < len(CLASS_NAMES) else str(number)


class PatinaColorProperties(PropertyGroup):
    source: EnumProperty(
        name="Color Source", override=_OVERRIDE, default='OWN',
        description="Where the color of the points comes from",
        items=(
            ('OWN', "Own Colors", "The points' own colors", 0),
            ('FIXED', "One Color", "One color for all points", 1),
            ('SCALAR', "Attribute", "A ramp over numbers that the points have: intensity, class, scan number", 2),
            ('HEIGHT', "Height", "A ramp over the world's Z", 3),
            ('OBJECT_HEIGHT', "Local Height", "A ramp over the object's own Z", 4),
            ('DISTANCE', "Distance", "A ramp over the distance from the camera", 5)))
    scalar: StringProperty(
        name="Attribute", override=_OVERRIDE, description="Point attribute that the ramp is laid over")
    contour: StringProperty(
        name="Contour Attribute", override=_OVERRIDE,
        description="Point attribute that contour lines along an attribute follow; a ramp over an attribute brings its own")
    ramp: EnumProperty(
        name="Ramp", override=_OVERRIDE, default='VIRIDIS',
        description="Colors from the least value to the greatest",
        items=(
            ('VIRIDIS', "Viridis", "Violet, green, yellow: even steps of lightness, safe for color-blind eyes", 0),
            ('GREY', "Gray", "Black to white", 1),
            ('HEAT', "Heat", "Black, red, yellow, white", 2),
            ('SPECTRUM', "Spectrum", "Blue, green, yellow, red", 3),
            ('RELIEF', "Relief", "Water, meadow, rock, snow", 4),
            ('DIVERGING', "Diverging", "Blue, white, red: for values around a middle", 5),
            ('CLASSES', "LAS Classes", "A color for each class", 6),
            ('CUSTOM', "Custom", "A color ramp of your own", 7)))
    texture: PointerProperty(
        name="Custom Ramp", type=bpy.types.Texture, override=_OVERRIDE,
        description="Texture whose color ramp is taken; it may be shared by objects")
    use_range: BoolProperty(
        name="Range", override=_OVERRIDE, default=False,
        description="The ramp reaches between the values below; else from the least to the greatest")
    range_min: FloatProperty(name="From", override=_OVERRIDE, default=0.0, precision=3,
                             description="Value at the ramp's beginning")
    range_max: FloatProperty(name="To", override=_OVERRIDE, default=1.0, precision=3,
                             description="Value at the ramp's end")
    exposure: FloatProperty(
        name="Exposure", override=_OVERRIDE, default=0.0, soft_min=-5.0, soft_max=5.0, min=-32.0, max=32.0,
        description="Brightness of the points' colors, in stops, before they are lit")
    contrast: FloatProperty(
        name="Contrast", override=_OVERRIDE, default=1.0, min=0.01, soft_min=0.2, soft_max=3.0, max=16.0,
        description="Contrast of the points' colors around mid gray")
    class_attribute: StringProperty(
        name="Classes", override=_OVERRIDE,
        description="Point attribute that holds the points' classes; empty: class or classification")
    hidden: BoolVectorProperty(
        name="Hidden Classes", override=_OVERRIDE, size=CLASSES, default=(False,) * CLASSES,
        description="Points of this class are not drawn and cast no shadow")
    hidden_more: StringProperty(
        name="Others", override=_OVERRIDE, description="Further classes to hide, up to 255: 64, 70-79")
    use_clips: BoolProperty(
        name="Clip", override=_OVERRIDE, default=True, description="Clip boxes and planes cut these points")
