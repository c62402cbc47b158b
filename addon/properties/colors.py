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
        description="Source of the points' color",
        items=(
            ('OWN', "Own Colors", "The points' own colors", 0),
            ('FIXED', "One Color", "One color for all points", 1),
            ('SCALAR', "Attribute", "Color ramp over a point attribute, such as intensity, class or scan number", 2),
            ('HEIGHT', "Height", "Color ramp over the world's Z axis", 3),
            ('OBJECT_HEIGHT', "Local Height", "Color ramp over the object's Z axis", 4),
            ('DISTANCE', "Distance", "Color ramp over the distance from the camera", 5),
            ('TRUST', "Trust", "Color ramp over the trust of each point. Points without an analysis have the fallback color", 6),
            # not the library's: to it these are the points' own colors
            ('MATERIAL', "Material", "The base color of the material's nodes, evaluated for each point", 7)))
    scalar: StringProperty(
        name="Attribute", override=_OVERRIDE, description="Point attribute that the color ramp shows")
    contour: StringProperty(
        name="Contour Attribute", override=_OVERRIDE,
        description="Point attribute for contour lines along an attribute. A color ramp over an attribute uses its own")
    ramp: EnumProperty(
        name="Ramp", override=_OVERRIDE, default='VIRIDIS',
        description="Colors from the smallest value to the largest",
        items=(
            ('VIRIDIS', "Viridis", "Violet, green, yellow. Even lightness, suitable for color-blind viewers", 0),
            ('GREY', "Gray", "Black to white", 1),
            ('HEAT', "Heat", "Black, red, yellow, white", 2),
            ('SPECTRUM', "Spectrum", "Blue, green, yellow, red", 3),
            ('RELIEF', "Relief", "Water, meadow, rock, snow", 4),
            ('DIVERGING', "Diverging", "Blue, white, red, for values around a center", 5),
            ('CLASSES', "LAS Classes", "One color per class", 6),
            ('CUSTOM', "Custom", "Your own color ramp", 7)))
    texture: PointerProperty(
        name="Custom Ramp", type=bpy.types.Texture, override=_OVERRIDE,
        description="Texture that holds the color ramp. Objects can share it")
    use_range: BoolProperty(
        name="Range", override=_OVERRIDE, default=False,
        description="Use the range below. Disabled: from the smallest value to the largest")
    range_min: FloatProperty(name="From", override=_OVERRIDE, default=0.0, precision=3,
                             description="Value at the start of the ramp")
    range_max: FloatProperty(name="To", override=_OVERRIDE, default=1.0, precision=3,
                             description="Value at the end of the ramp")
    use_legend: BoolProperty(
        name="Legend", override=_OVERRIDE, default=False,
        description="Show the colors and their values over the image: in the viewport, in the Overlay pass, and in the image if Burn In is enabled")
    exposure: FloatProperty(
        name="Exposure", override=_OVERRIDE, default=0.0, soft_min=-5.0, soft_max=5.0, min=-32.0, max=32.0,
        description="Exposure of the points' colors before lighting, in stops")
    contrast: FloatProperty(
        name="Contrast", override=_OVERRIDE, default=1.0, min=0.01, soft_min=0.2, soft_max=3.0, max=16.0,
        description="Contrast of the points' colors around middle gray")
    class_attribute: StringProperty(
        name="Classes", override=_OVERRIDE,
        description="Point attribute with the classes. Empty: class or classification")
    hidden: BoolVectorProperty(
        name="Hidden Classes", override=_OVERRIDE, size=CLASSES, default=(False,) * CLASSES,
        description="Hide points of this class. They cast no shadow")
    hidden_more: StringProperty(
        name="Others", override=_OVERRIDE, description="More classes to hide, up to 255, such as 64, 70-79")
    use_clips: BoolProperty(
        name="Clip", override=_OVERRIDE, default=True, description="Clip boxes and planes clip these points")
