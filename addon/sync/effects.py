# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's effects in image space, and the camera's depth of field."""

from __future__ import annotations

from dataclasses import make_dataclass, replace
from typing import Any

import bpy

from ..native.abi import EFFECTS
from ..properties import enum_number
from .camera import Focus

_FIELDS = [field for effect in EFFECTS for field in effect["fields"]]
_TYPES = {"NUMBER": float, "COLOR": tuple[float, float, float], "AXIS": tuple[float, float, float]}


class _Effects:
    def through(self, focus: Focus | None) -> Effects:
        """With the depth of field of a view."""
        return replace(self, focus_aperture=focus.aperture if focus else 0.0,
                       focus_distance=focus.distance if focus else 0.0)

    def shrunk(self, factor: int) -> Effects:
        """For a picture of larger pixels, as far as lengths in pixels may become less."""
        return replace(self, **{field["name"]: max(getattr(self, field["name"]) / factor, field["least"])
                                for field in _FIELDS if field.get("unit") == "PIXELS"})

    def focus_alone(self) -> Effects:
        """All others off."""
        return replace(self, **{name: value for effect in EFFECTS if effect["panel"] != "CAMERA"
                                for name, value in _off(effect).items()})


# patina_effects; what is switched off has no strength.
Effects = make_dataclass("Effects", [("exact", int, 1)] + [(field["name"], _TYPES.get(field["kind"], int)) for field in _FIELDS],
                         bases=(_Effects,), frozen=True, kw_only=True)


def read(scene: bpy.types.Scene, focus: Focus | None, notices: list[str]) -> Effects:
    effects = scene.patina.effects
    values: dict[str, Any] = {}
    for effect in EFFECTS:
        shown = effect["panel"] != "CAMERA"
        values |= {field["name"]: _value(effects, field) if shown else 0 for field in effect["fields"]}
        if shown and not getattr(effects, f"use_{effect['name']}"):
            values |= _off(effect)
    if values["fog_density"] and values["fog_end"] <= values["fog_start"]:
        notices.append("fog is left out: its end is not beyond its start")
        values["fog_density"] = 0.0
    return Effects(**values).through(focus)


def _off(effect: dict[str, Any]) -> dict[str, Any]:
    return {field["name"]: (field.get("zero") or 0.0,) * 3 if field["kind"] == "COLOR" else 0
            for field in effect["fields"] if field["when"] == "STRENGTH"}


def _value(effects: bpy.types.PropertyGroup, field: dict[str, Any]) -> Any:
    value = getattr(effects, field["property"])
    if field["kind"] == "CHOICE":
        return enum_number(effects, field["property"])
    if field["kind"] in ("COLOR", "AXIS"):
        return tuple(value)
    return int(value) if field["kind"] == "SWITCH" else value
