# SPDX-License-Identifier: GPL-3.0-or-later
"""The view layer's Cryptomatte, by Blender's own properties."""

from __future__ import annotations

import bpy
from bpy.types import Context, Panel

from .panels import PatinaPanel


class PATINA_PT_cryptomatte(PatinaPanel, Panel):
    bl_label = "Cryptomatte"
    bl_context = "view_layer"
    bl_parent_id = "PATINA_PT_passes"

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layer = context.view_layer
        column = layout.column(heading="Include")
        column.prop(layer, "use_pass_cryptomatte_object", text="Object")
        column.prop(layer, "use_pass_cryptomatte_asset", text="Asset")
        row = layout.row()
        row.active = layer.use_pass_cryptomatte_object or layer.use_pass_cryptomatte_asset
        row.prop(layer, "pass_cryptomatte_depth", text="Levels")


register, unregister = bpy.utils.register_classes_factory((PATINA_PT_cryptomatte,))
