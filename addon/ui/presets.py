# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets of how well surfaces are drawn: those that come along, and the artist's own, saved by the button at the panel's head. How they look is a
style's (styles.py); the two share no property."""

from __future__ import annotations

from pathlib import Path

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel
from bpy.types import Context, Menu, Operator, Panel

from ..draw.engine import PatinaRenderEngine

FOLDER = "patina/render"  # of the artist's own, in Blender's folder of presets
SHIPPED = Path(__file__).resolve().parents[1] / "presets/render"


class PATINA_OT_preset_add(AddPresetBase, Operator):
    """Save the surface settings as a preset, or remove the chosen preset"""

    bl_idname = "render.patina_preset_add"
    bl_label = "Patina Preset"
    preset_menu = "PATINA_PT_presets"
    preset_defines = ["patina = bpy.context.scene.patina"]
    preset_values = [f"patina.{name}" for name in ("surface", "error_target", "quality", "fill", "fill_iterations",
                                                  "antialias", "average", "samples", "noise")]
    preset_subdir = FOLDER


class PATINA_PT_presets(PresetPanel, Panel):
    bl_label = "Surface Presets"
    preset_subdir = FOLDER
    preset_operator = "script.execute_preset"
    preset_add_operator = PATINA_OT_preset_add.bl_idname
    COMPAT_ENGINES = {PatinaRenderEngine.bl_idname}

    def draw(self, context: Context) -> None:
        self.layout.emboss = 'PULLDOWN_MENU'
        self.layout.operator_context = 'EXEC_DEFAULT'
        self.path_menu([str(SHIPPED)], self.preset_operator, filter_ext=lambda ending: ending == ".py")  # cannot be removed
        self.layout.separator()
        Menu.draw_preset(self, context)


_CLASSES = (PATINA_OT_preset_add, PATINA_PT_presets)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
