# SPDX-License-Identifier: GPL-3.0-or-later
"""Depth cues and means of drawing, in the render properties."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.types import Context, Panel

from ..native.abi import EFFECTS
from . import rows
from .panels import PatinaPanel


class PATINA_PT_depth_cues(PatinaPanel, Panel):
    bl_label = "Depth Cues"
    bl_context = "render"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, _context: Context) -> None:
        pass


class PATINA_PT_drawing(PatinaPanel, Panel):
    bl_label = "Drawing"
    bl_context = "render"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, _context: Context) -> None:
        pass


class _EffectPanel(PatinaPanel):
    """A switch in the head, properties below."""

    bl_context = "render"
    bl_options = {'DEFAULT_CLOSED'}
    effect: dict[str, Any] = {}

    def draw_header(self, context: Context) -> None:
        self.layout.prop(context.scene.patina.effects, f"use_{self.effect['name']}", text="")

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        effects = context.scene.patina.effects
        layout.active = getattr(effects, f"use_{self.effect['name']}")
        names = {field["name"]: field["property"] for field in self.effect["fields"]}
        for field in self.effect["fields"]:
            on, _, choice = field["when"].partition("=")
            if choice and getattr(effects, names[on]) != choice:
                continue
            if "automatic" in field:
                rows.automatic(layout, effects, field["property"])
                continue
            row = layout.row()
            row.active = bool(getattr(effects, names[on])) if on in names else True
            row.prop(effects, field["property"])


def _panel(effect: dict[str, Any]) -> type:
    """The panel of an effect."""
    parent = "PATINA_PT_depth_cues" if effect["panel"] == "CUES" else "PATINA_PT_drawing"
    return type(f"PATINA_PT_{effect['name']}", (_EffectPanel, Panel), {
        "bl_label": effect["label"], "bl_parent_id": parent, "effect": effect, "__module__": __name__})


PANELS = tuple(_panel(effect) for effect in EFFECTS if effect["panel"] != "CAMERA")
_CLASSES = (PATINA_PT_depth_cues, PATINA_PT_drawing, *PANELS)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
