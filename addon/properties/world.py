# SPDX-License-Identifier: GPL-3.0-or-later
"""What the artist sets on a world."""

from __future__ import annotations

import bpy
from bpy.types import PropertyGroup

from .heard import BoolProperty, PointerProperty

_OVERRIDE = {'LIBRARY_OVERRIDABLE'}


class PatinaWorldProperties(PropertyGroup):
    use_picture: BoolProperty(
        name="Use Picture", override=_OVERRIDE, default=True,
        description="The picture stands for the world's nodes, as light and behind the points")
    picture: PointerProperty(
        name="Picture", type=bpy.types.Image, override=_OVERRIDE,
        description="The world all around, as Bake World makes it: for nodes that Patina does not know, such as Sky Texture")
