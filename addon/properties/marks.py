# SPDX-License-Identifier: GPL-3.0-or-later
"""What is written over the image: legends, scale bar, north arrow, title block."""

from __future__ import annotations

from math import radians

from bpy.types import PropertyGroup

from .heard import BoolProperty, FloatProperty, StringProperty

_OVERRIDE = {'LIBRARY_OVERRIDABLE'}


class PatinaMarksProperties(PropertyGroup):
    use_bar: BoolProperty(
        name="Scale Bar", override=_OVERRIDE, default=False,
        description="Show a bar of a round length. In perspective views it needs a distance")
    bar_distance: FloatProperty(
        name="Distance", override=_OVERRIDE, default=0.0, min=0.0, subtype='DISTANCE', unit='LENGTH',
        description="Distance from the camera at which the bar is right in perspective views. Without a distance only orthographic views show a bar")
    use_north: BoolProperty(
        name="North Arrow", override=_OVERRIDE, default=False,
        description="Show an arrow to the north, which is +Y. Hidden in views along that direction")
    north: FloatProperty(
        name="North", override=_OVERRIDE, default=0.0, min=radians(-360), max=radians(360), subtype='ANGLE',
        description="Direction of north, clockwise from +Y as seen from above")
    use_title: BoolProperty(
        name="Title Block", override=_OVERRIDE, default=False,
        description="Show a title, and a note below it")
    title: StringProperty(
        name="Title", override=_OVERRIDE, description="First line of the title block. Empty: the scene's name")
    note: StringProperty(
        name="Note", override=_OVERRIDE, description="Second line of the title block, such as the author and the date")
    use_measures: BoolProperty(
        name="Measurements", override=_OVERRIDE, default=False,
        description="Show measurements in the Overlay pass, and in the image if Burn In is enabled. The viewport always shows them")
    size: FloatProperty(
        name="Text Size", override=_OVERRIDE, default=1.0, min=0.25, max=8.0, soft_min=0.5, soft_max=3.0,
        description="Size of the text, relative to the image")
    burn: BoolProperty(
        name="Burn In", override=_OVERRIDE, default=False,
        description="Write legends, scale bar, north arrow and title into rendered images. Disabled: they are in the viewport and in the "
                    "Overlay pass")
