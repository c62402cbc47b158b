# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets of how well surfaces are drawn: the artist's own, saved by the button at the panel's head. How they look is a
style's (styles.py); the two share no property."""

from __future__ import annotations

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel
from bpy.types import Operator, Panel

from ..engine import PatinaRenderEngine

FOLDER = "patina/render"


class PATINA_OT_preset_add(AddPresetBase, Operator):
    """Save the surface settings under a name, or remove the chosen preset"""

    bl_idname = "render.patina_preset_add"
    bl_label = "Patina Preset"
    preset_menu = "PATINA_PT_presets"
    preset_defines = ["patina = bpy.context.scene.patina"]
    preset_values = [f"patina.{name}" for name in ("surface", "error_target", "quality", "fill", "fill_iterations",
                                                  "antialias", "samples")]
    preset_subdir = FOLDER


class PATINA_PT_presets(PresetPanel, Panel):
    bl_label = "Surface Presets"
    preset_subdir = FOLDER
    preset_operator = "script.execute_preset"
    preset_add_operator = PATINA_OT_preset_add.bl_idname
    COMPAT_ENGINES = {PatinaRenderEngine.bl_idname}


_CLASSES = (PATINA_OT_preset_add, PATINA_PT_presets)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
