# SPDX-License-Identifier: GPL-3.0-or-later
"""A light and a background of the picture's own, in place of the scene's: what styles need to look the same anywhere."""

from __future__ import annotations

from math import radians

from bpy.types import PropertyGroup

from .heard import BoolProperty, FloatProperty, FloatVectorProperty

_OVERRIDE = {'LIBRARY_OVERRIDABLE'}


class PatinaStudioProperties(PropertyGroup):
    use_light: BoolProperty(
        name="Studio Light", override=_OVERRIDE, default=False,
        description="Light the points with one large light and ambient light, instead of the scene's lights and the world")
    azimuth: FloatProperty(
        name="Azimuth", override=_OVERRIDE, default=radians(-45), min=radians(-180), max=radians(180), subtype='ANGLE',
        description="Direction of the light around the vertical. 0 is behind the camera, negative is to its left")
    height: FloatProperty(
        name="Height", override=_OVERRIDE, default=radians(45), min=radians(-90), max=radians(90), subtype='ANGLE',
        description="Height of the light above the horizon")
    follow_camera: BoolProperty(
        name="Follow Camera", override=_OVERRIDE, default=True,
        description="The light follows the scene's camera. Disabled: azimuth 0 is the direction -Y")
    color: FloatVectorProperty(
        name="Color", override=_OVERRIDE, default=(1.0, 1.0, 1.0), min=0.0, soft_max=1.0, subtype='COLOR', size=3,
        description="Color of the light")
    strength: FloatProperty(
        name="Strength", override=_OVERRIDE, default=3.0, min=0.0, soft_max=10.0,
        description="Strength in watts per square meter, as in Blender's sun lights. At 3.14 a surface that faces the light shows its own color")
    angle: FloatProperty(
        name="Size", override=_OVERRIDE, default=radians(20), min=0.0, max=radians(90), subtype='ANGLE',
        description="Angular size of the light. Larger lights have softer shadows")
    fill: FloatProperty(
        name="Fill", override=_OVERRIDE, default=0.25, min=0.0, max=1.0, subtype='FACTOR',
        description="Strength of a fill light from the other side, without shadows, as a share of the first light")
    ambient: FloatVectorProperty(
        name="Ambient", override=_OVERRIDE, default=(0.1, 0.1, 0.1), min=0.0, soft_max=1.0, subtype='COLOR', size=3,
        description="Strength of the light from all directions")
    use_headlight: BoolProperty(
        name="Headlight", override=_OVERRIDE, default=False,
        description="Add a light at the camera or viewpoint, without shadows, that lights all lit points")
    headlight: FloatProperty(
        name="Strength", override=_OVERRIDE, default=3.0, min=0.0, soft_max=10.0,
        description="Strength in watts per square meter, as in Blender's sun lights. At 3.14 a surface that faces the camera shows its own color")
    use_background: BoolProperty(
        name="Background", override=_OVERRIDE, default=False,
        description="Use a background color instead of the world")
    background: FloatVectorProperty(
        name="Background Color", override=_OVERRIDE, default=(0.8, 0.8, 0.8), min=0.0, soft_max=1.0, subtype='COLOR', size=3,
        description="Background color")
