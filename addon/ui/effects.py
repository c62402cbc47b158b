# SPDX-License-Identifier: GPL-3.0-or-later
"""Depth cues and means of drawing, in the render properties."""

from __future__ import annotations

import bpy
from bpy.types import Context, Panel

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
    switch = ""
    names: tuple[str, ...] = ()

    def draw_header(self, context: Context) -> None:
        self.layout.prop(context.scene.patina.effects, self.switch, text="")

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        effects = context.scene.patina.effects
        layout.active = getattr(effects, self.switch)
        for name in self.names:
            if f"use_{name}" in effects.bl_rna.properties:
                rows.automatic(layout, effects, name)
            else:
                layout.prop(effects, name)


class PATINA_PT_edl(_EffectPanel, Panel):
    bl_label = "Eye-Dome Lighting"
    bl_parent_id = "PATINA_PT_depth_cues"
    switch = "use_edl"
    names = ("edl_strength", "edl_radius")


class PATINA_PT_obscurance(_EffectPanel, Panel):
    bl_label = "Ambient Obscurance"
    bl_parent_id = "PATINA_PT_depth_cues"
    switch = "use_obscurance"
    names = ("obscurance_strength", "obscurance_radius")


class PATINA_PT_fog(_EffectPanel, Panel):
    bl_label = "Fog"
    bl_parent_id = "PATINA_PT_depth_cues"
    switch = "use_fog"
    names = ("fog_start", "fog_end", "fog_density", "fog_use_color")

    def draw(self, context: Context) -> None:
        _EffectPanel.draw(self, context)
        row = self.layout.row()
        row.active = context.scene.patina.effects.fog_use_color
        row.prop(context.scene.patina.effects, "fog_color")


class PATINA_PT_toon(_EffectPanel, Panel):
    bl_label = "Toon"
    bl_parent_id = "PATINA_PT_drawing"
    switch = "use_toon"
    names = ("toon_bands", "toon_softness")


class PATINA_PT_hatching(_EffectPanel, Panel):
    bl_label = "Hatching"
    bl_parent_id = "PATINA_PT_drawing"
    switch = "use_hatch"
    names = ("hatch_levels", "hatch_spacing", "hatch_color", "hatch_opacity", "hatch_ground")


class PATINA_PT_paper(_EffectPanel, Panel):
    bl_label = "Paper"
    bl_parent_id = "PATINA_PT_drawing"
    switch = "use_paper"
    names = ("paper_color", "paper_grain")


_CLASSES = (PATINA_PT_depth_cues, PATINA_PT_drawing, PATINA_PT_edl, PATINA_PT_obscurance, PATINA_PT_fog, PATINA_PT_toon,
            PATINA_PT_hatching, PATINA_PT_paper)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
