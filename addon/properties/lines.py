# SPDX-License-Identifier: GPL-3.0-or-later
"""Silhouettes: lines around what the points show."""

from __future__ import annotations

from bpy.types import PropertyGroup

from .automatic import switch
from .heard import BoolProperty, EnumProperty, FloatProperty, FloatVectorProperty

_OVERRIDE = {'LIBRARY_OVERRIDABLE'}


class PatinaLinesProperties(PropertyGroup):
    use: BoolProperty(
        name="Lines", override=_OVERRIDE, default=False,
        description="Draw a line along every outline, before the background and before what lies behind")
    units: EnumProperty(
        name="Width in", override=_OVERRIDE, default='PIXELS',
        description="What the width counts",
        items=(
            ('PIXELS', "Pixels", "As wide everywhere", 0),
            ('WORLD', "Scene Units", "Narrower far away, as if the line were part of the object; at most 16 pixels", 1)))
    width: FloatProperty(
        name="Width", override=_OVERRIDE, default=2.0, min=0.1, max=16.0, precision=1, step=10, subtype='PIXEL',
        description="Pixels of the picture")
    width_world: FloatProperty(
        name="Width", override=_OVERRIDE, default=0.01, min=1e-6, soft_max=1.0, subtype='DISTANCE', unit='LENGTH', precision=4,
        description="Width in the scene's units")
    offset: FloatProperty(
        name="Least Step", override=_OVERRIDE, default=0.0, min=0.0, soft_max=1.0, subtype='DISTANCE', unit='LENGTH', precision=4,
        description="How far something must lie behind to show a line. Small steps show creases and noise too")
    use_offset: switch("offset", 0.02, "A fixed step; else it is twice the spacing of the points, or their layer distance",
                       "Set Least Step")
    opacity: FloatProperty(
        name="Opacity", override=_OVERRIDE, default=1.0, min=0.0, max=1.0, subtype='FACTOR',
        description="How much a line hides of what is under it")
    soft: FloatProperty(
        name="Softness", override=_OVERRIDE, default=0.0, min=0.0, max=1.0, subtype='FACTOR',
        description="Share of the width over which a line fades outwards")
    source: EnumProperty(
        name="Color", override=_OVERRIDE, default='FIXED',
        description="Where lines take their color from",
        items=(
            ('FIXED', "One Color", "The same everywhere", 0),
            ('POINT', "Points", "The color of the points along the outline, darker", 1),
            ('DEPTH', "Depth", "From one color near to another far", 2)))
    color: FloatVectorProperty(
        name="Line Color", override=_OVERRIDE, default=(0.0, 0.0, 0.0), min=0.0, soft_max=1.0, subtype='COLOR', size=3,
        description="Color of lines; by depth, of the nearest")
    far_color: FloatVectorProperty(
        name="Far Color", override=_OVERRIDE, default=(0.6, 0.6, 0.6), min=0.0, soft_max=1.0, subtype='COLOR', size=3,
        description="Color of the farthest lines")
    tint: FloatProperty(
        name="Brightness", override=_OVERRIDE, default=0.25, min=0.0, soft_max=1.0, subtype='FACTOR',
        description="How bright lines are beside the points that they belong to")
    near: FloatProperty(
        name="Near", override=_OVERRIDE, default=0.0, min=0.0, subtype='DISTANCE', unit='LENGTH',
        description="Distance from the camera up to which lines have the line color")
    far: FloatProperty(
        name="Far", override=_OVERRIDE, default=0.0, min=0.0, subtype='DISTANCE', unit='LENGTH',
        description="Distance from which on lines have the far color")
    use_far: switch("far", lambda group: group.near + 10.0, "A fixed distance beyond Near; else it is what the scene spans", least="near")
    surface: EnumProperty(
        name="Surface", override=_OVERRIDE, default='SHOWN',
        description="What lies under the lines",
        items=(
            ('SHOWN', "Points", "The points as they are", 0),
            ('PAPER', "Paper", "One color, without light", 1),
            ('NONE', "Nothing", "Lines alone; opaque points hide still what is behind them", 2)))
    paper: FloatVectorProperty(
        name="Paper", override=_OVERRIDE, default=(1.0, 1.0, 1.0), min=0.0, soft_max=1.0, subtype='COLOR', size=3,
        description="Color of the surface under the lines")
