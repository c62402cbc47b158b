# SPDX-License-Identifier: GPL-3.0-or-later
"""Effects in image space: depth cues and means of drawing. Depth of field is the camera's own."""

from __future__ import annotations

from bpy.props import BoolProperty, FloatProperty, FloatVectorProperty, IntProperty
from bpy.types import PropertyGroup

from .automatic import switch

_OVERRIDE = {'LIBRARY_OVERRIDABLE'}


class PatinaEffectsProperties(PropertyGroup):
    use_edl: BoolProperty(
        name="Eye-Dome Lighting", override=_OVERRIDE, default=False,
        description="What lies behind its neighbors on screen is darker: shape shows without light and normals")
    edl_strength: FloatProperty(
        name="Strength", override=_OVERRIDE, default=1.0, min=0.0, max=10.0, soft_max=3.0,
        description="How dark edges and slopes become")
    edl_radius: FloatProperty(
        name="Radius", override=_OVERRIDE, default=1.4, min=1.0, max=16.0, subtype='PIXEL',
        description="How far away the neighbors lie that are compared")
    use_obscurance: BoolProperty(
        name="Ambient Obscurance", override=_OVERRIDE, default=False,
        description="Folds and corners are darker, by what surrounds them")
    obscurance_strength: FloatProperty(
        name="Strength", override=_OVERRIDE, default=1.0, min=0.0, max=10.0, soft_max=3.0,
        description="How dark folds and corners become")
    obscurance_radius: FloatProperty(
        name="Radius", override=_OVERRIDE, default=0.0, min=0.0, soft_max=10.0, subtype='DISTANCE', unit='LENGTH',
        precision=4,
        description="How far around a point others darken it, at most 32 pixels")
    use_obscurance_radius: switch("obscurance_radius", 0.1, "A fixed radius; else it is a 32nd of the clouds' diagonal")
    use_fog: BoolProperty(
        name="Fog", override=_OVERRIDE, default=False, description="Points fade with their distance")
    fog_start: FloatProperty(
        name="Start", override=_OVERRIDE, default=5.0, min=0.0, subtype='DISTANCE', unit='LENGTH',
        description="Distance from the camera at which fog begins")
    fog_end: FloatProperty(
        name="End", override=_OVERRIDE, default=25.0, min=0.0, subtype='DISTANCE', unit='LENGTH',
        description="Distance from the camera at which fog is as dense as it becomes")
    fog_density: FloatProperty(
        name="Density", override=_OVERRIDE, default=1.0, min=0.0, max=1.0, subtype='FACTOR',
        description="How much fog hides at its end and beyond")
    fog_use_color: BoolProperty(
        name="Own Color", override=_OVERRIDE, default=False,
        description="A color of its own; else points fade into the background")
    fog_color: FloatVectorProperty(
        name="Color", override=_OVERRIDE, default=(0.7, 0.75, 0.8), min=0.0, soft_max=1.0, subtype='COLOR', size=3,
        description="Color of the fog")
    use_toon: BoolProperty(
        name="Toon", override=_OVERRIDE, default=False,
        description="Light goes in bands, with obscurance and eye-dome lighting; the points' own colors stay")
    toon_bands: IntProperty(
        name="Bands", override=_OVERRIDE, default=3, min=2, max=16, description="How many lights there are")
    toon_softness: FloatProperty(
        name="Softness", override=_OVERRIDE, default=0.15, min=0.0, max=1.0, subtype='FACTOR',
        description="Share of a band that its edge takes")
    use_hatch: BoolProperty(
        name="Hatching", override=_OVERRIDE, default=False,
        description="Strokes that follow the surface, wider where the picture is darker")
    hatch_levels: IntProperty(
        name="Directions", override=_OVERRIDE, default=2, min=1, max=3,
        description="Strokes in so many directions, each from darker tones on")
    hatch_spacing: FloatProperty(
        name="Spacing", override=_OVERRIDE, default=6.0, min=3.0, soft_max=40.0, max=1000.0, subtype='PIXEL',
        description="Distance of two strokes on screen")
    hatch_opacity: FloatProperty(
        name="Opacity", override=_OVERRIDE, default=1.0, min=0.01, max=1.0, subtype='FACTOR',
        description="How much the ink hides")
    hatch_ground: FloatProperty(
        name="White Ground", override=_OVERRIDE, default=0.0, min=0.0, max=1.0, subtype='FACTOR',
        description="How far the points' colors give way to white beneath the strokes")
    hatch_color: FloatVectorProperty(
        name="Ink", override=_OVERRIDE, default=(0.01, 0.01, 0.012), min=0.0, soft_max=1.0, subtype='COLOR', size=3,
        description="Color of the strokes")
    use_paper: BoolProperty(
        name="Paper", override=_OVERRIDE, default=False,
        description="The whole picture is tinted and grained as if it were on paper")
    paper_color: FloatVectorProperty(
        name="Tint", override=_OVERRIDE, default=(0.93, 0.88, 0.78), min=0.0, max=1.0, subtype='COLOR', size=3,
        description="Color of the paper")
    paper_grain: FloatProperty(
        name="Grain", override=_OVERRIDE, default=0.15, min=0.0, max=1.0, subtype='FACTOR',
        description="How uneven the paper is")
