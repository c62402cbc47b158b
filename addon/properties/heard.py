# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's kinds of properties, heard also where a script or an operator sets them.

Blender tags the owner of a property that Python sets, and redraws the 3D views that show it, only where the property has
something to call; one that an artist sets it tags in any case.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy


def _nothing(_group: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    pass


def _heard(kind: Callable[..., Any]) -> Callable[..., Any]:
    return lambda **keywords: kind(**{"update": _nothing, **keywords})


BoolProperty = _heard(bpy.props.BoolProperty)
BoolVectorProperty = _heard(bpy.props.BoolVectorProperty)
EnumProperty = _heard(bpy.props.EnumProperty)
FloatProperty = _heard(bpy.props.FloatProperty)
FloatVectorProperty = _heard(bpy.props.FloatVectorProperty)
IntProperty = _heard(bpy.props.IntProperty)
PointerProperty = _heard(bpy.props.PointerProperty)
StringProperty = _heard(bpy.props.StringProperty)
