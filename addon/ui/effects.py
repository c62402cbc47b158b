# SPDX-License-Identifier: GPL-3.0-or-later
"""Depth cues and means of drawing, in the render properties."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.types import Context, Panel

from ..native.abi import OWN_EFFECTS
from . import rows
from .panels import PatinaPanel


class _Group(PatinaPanel):
    """The panel above the panels of effects of one kind."""

    bl_context = "render"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, _context: Context) -> None:
        pass


class _EffectPanel(_Group):
    """A switch in the head, properties below."""

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


def _panel(base: type, name: str, label: str, **values: Any) -> type:
    return type(f"PATINA_PT_{name}", (base, Panel), {"bl_label": label, "__module__": __name__, **values})


# panel of effects.def → name and label of the panel above. A panel without effects is not shown.
_GROUPS = {"CUES": ("depth_cues", "Depth Cues"), "DRAWING": ("drawing", "Drawing"), "IMAGE": ("image", "Whole Image")}
PANELS = tuple(_panel(_EffectPanel, effect["name"], effect["label"], effect=effect, bl_parent_id=f"PATINA_PT_{_GROUPS[effect['panel']][0]}")
               for effect in OWN_EFFECTS)
_CLASSES = (*(_panel(_Group, *_GROUPS[panel]) for panel in dict.fromkeys(effect["panel"] for effect in OWN_EFFECTS)), *PANELS)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
