# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's effects in image space, and the camera's depth of field."""

from __future__ import annotations

from typing import Any

import bpy

from ...description.settings import Effects, off
from ...description.view import Focus
from ...native.abi import EFFECTS, OWN_EFFECTS
from ...properties import enum_number


def read(scene: bpy.types.Scene, focus: Focus | None, notices: list[str]) -> Effects:
    effects = scene.patina.effects
    values: dict[str, Any] = {field["name"]: 0 for effect in EFFECTS for field in effect["fields"]}
    for effect in OWN_EFFECTS:
        values |= {field["name"]: _value(effects, field) for field in effect["fields"]}
        if not getattr(effects, f"use_{effect['name']}"):
            values |= off(effect)
    if values["fog_density"] and values["fog_end"] <= values["fog_start"]:
        notices.append("fog is left out: its end is not beyond its start")
        values["fog_density"] = 0.0
    return Effects(**values).through(focus)


def _value(effects: bpy.types.PropertyGroup, field: dict[str, Any]) -> Any:
    value = getattr(effects, field["property"])
    if field["kind"] == "CHOICE":
        return enum_number(effects, field["property"])
    if field["kind"] in ("COLOR", "AXIS"):
        return tuple(value)
    return int(value) if field["kind"] == "SWITCH" else value
