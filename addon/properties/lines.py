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
        description="Draw a line along each outline, against the background and against surfaces behind")
    units: EnumProperty(
        name="Width in", override=_OVERRIDE, default='PIXELS',
        description="Unit of the line width",
        items=(
            ('PIXELS', "Pixels", "The same width everywhere", 0),
            ('WORLD', "Scene Units", "Thinner with distance, as if the line were part of the object. At most 16 pixels", 1)))
    width: FloatProperty(
        name="Width", override=_OVERRIDE, default=2.0, min=0.1, max=16.0, precision=1, step=10, subtype='PIXEL',
        description="Width in pixels")
    width_world: FloatProperty(
        name="Width", override=_OVERRIDE, default=0.01, min=1e-6, soft_max=1.0, subtype='DISTANCE', unit='LENGTH', precision=4,
        description="Width in scene units")
    offset: FloatProperty(
        name="Least Step", override=_OVERRIDE, default=0.0, min=0.0, soft_max=1.0, subtype='DISTANCE', unit='LENGTH', precision=4,
        description="Smallest step in depth that shows a line. Small values also show creases and noise")
    use_offset: switch("offset", 0.02, "Use a fixed step. Disabled: twice the spacing of the points, or their layer distance",
                       "Set Least Step")
    opacity: FloatProperty(
        name="Opacity", override=_OVERRIDE, default=1.0, min=0.0, max=1.0, subtype='FACTOR',
        description="Opacity of the lines")
    soft: FloatProperty(
        name="Softness", override=_OVERRIDE, default=0.0, min=0.0, max=1.0, subtype='FACTOR',
        description="Share of the width over which a line fades out")
    source: EnumProperty(
        name="Color", override=_OVERRIDE, default='FIXED',
        description="Source of the line color",
        items=(
            ('FIXED', "One Color", "The same color everywhere", 0),
            ('POINT', "Points", "Darker color of the points along the outline", 1),
            ('DEPTH', "Depth", "From a near color to a far color", 2)))
    color: FloatVectorProperty(
        name="Line Color", override=_OVERRIDE, default=(0.0, 0.0, 0.0), min=0.0, soft_max=1.0, subtype='COLOR', size=3,
        description="Color of the lines. By depth: of the nearest lines")
    far_color: FloatVectorProperty(
        name="Far Color", override=_OVERRIDE, default=(0.6, 0.6, 0.6), min=0.0, soft_max=1.0, subtype='COLOR', size=3,
        description="Color of the farthest lines")
    tint: FloatProperty(
        name="Brightness", override=_OVERRIDE, default=0.25, min=0.0, soft_max=1.0, subtype='FACTOR',
        description="Brightness of the lines relative to their points")
    near: FloatProperty(
        name="Near", override=_OVERRIDE, default=0.0, min=0.0, subtype='DISTANCE', unit='LENGTH',
        description="Distance up to which lines have the near color")
    far: FloatProperty(
        name="Far", override=_OVERRIDE, default=0.0, min=0.0, subtype='DISTANCE', unit='LENGTH',
        description="Distance from which lines have the far color")
    use_far: switch("far", lambda group: group.near + 10.0, "Use a fixed distance beyond Near. Disabled: the extent of the scene", least="near")
    surface: EnumProperty(
        name="Surface", override=_OVERRIDE, default='SHOWN',
        description="What is drawn under the lines",
        items=(
            ('SHOWN', "Points", "The points, unchanged", 0),
            ('PAPER', "Paper", "One color, unlit", 1),
            ('NONE', "Nothing", "Only lines. Opaque points still hide what is behind them", 2)))
    paper: FloatVectorProperty(
        name="Paper", override=_OVERRIDE, default=(1.0, 1.0, 1.0), min=0.0, soft_max=1.0, subtype='COLOR', size=3,
        description="Color of the surface under the lines")
