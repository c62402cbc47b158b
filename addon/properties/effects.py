# SPDX-License-Identifier: GPL-3.0-or-later
"""Effects in image space, as the library's table lists them. Depth of field is the camera's own."""

from __future__ import annotations

from typing import Any

from bpy.types import PropertyGroup

from ..native.abi import OWN_EFFECTS
from .automatic import switch
from .heard import BoolProperty, EnumProperty, FloatProperty, FloatVectorProperty, IntProperty

_OVERRIDE = {'LIBRARY_OVERRIDABLE'}
_BOUNDLESS = 1e30
_UNITS = {"NONE": {}, "SHARE": {"subtype": 'FACTOR'}, "PIXELS": {"subtype": 'PIXEL'}, "COLOR": {"subtype": 'COLOR', "size": 3},
          "LENGTH": {"subtype": 'DISTANCE', "unit": 'LENGTH'}, "HEIGHT": {"subtype": 'DISTANCE', "unit": 'LENGTH'}}


def _property(field: dict[str, Any]) -> Any:
    shared = {"name": field["label"], "description": field["about"], "override": _OVERRIDE}
    if field["kind"] == "SWITCH":
        return BoolProperty(default=False, **shared)
    if field["kind"] == "CHOICE":
        return EnumProperty(items=[(*item, number) for number, item in enumerate(field["items"])], default=field["items"][0][0], **shared)
    if field["kind"] == "AXIS":
        return FloatVectorProperty(default=(0.0, 0.0, 1.0), size=3, subtype='XYZ', **shared)
    bounds = {"min": field["low"], "soft_max": field["usual"], "max": field["high"]}
    shared |= {name: value for name, value in bounds.items() if abs(value) < _BOUNDLESS}
    if field["kind"] == "COUNT":
        return IntProperty(default=field["start"], **shared)
    kind = FloatVectorProperty if field["kind"] == "COLOR" else FloatProperty
    precise = {"precision": 4} if "automatic" in field else {}
    return kind(default=field["start"], **_UNITS[field["unit"]], **precise, **shared)


def _properties() -> dict[str, Any]:
    """name → property; use_NAME switches the effect NAME."""
    found = {}
    for effect in OWN_EFFECTS:
        found[f"use_{effect['name']}"] = BoolProperty(name=effect["label"], override=_OVERRIDE, default=False, description=effect["about"])
        for field in effect["fields"]:
            found[field["property"]] = _property(field)
            if "automatic" in field:
                found[f"use_{field['name']}"] = switch(field["name"], *field["automatic"])
    return found


class PatinaEffectsProperties(PropertyGroup):
    __annotations__ = _properties()
