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
        description="Use the image instead of the world's nodes, as light and as background")
    picture: PointerProperty(
        name="Picture", type=bpy.types.Image, override=_OVERRIDE,
        description="Panorama of the world from Bake World, for nodes that Patina cannot evaluate, such as Sky Texture")
