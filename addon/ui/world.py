# SPDX-License-Identifier: GPL-3.0-or-later
"""The world's picture, below its nodes."""

from __future__ import annotations

import bpy
from bpy.types import Context, Panel

from ..operators.world import PATINA_OT_bake_world
from .panels import PatinaPanel


class PATINA_PT_world(PatinaPanel, Panel):
    bl_label = "Baked Picture"
    bl_context = "world"
    bl_options = {'DEFAULT_CLOSED'}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and context.world is not None

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        patina = context.world.patina
        layout.prop(patina, "picture")
        row = layout.row()
        row.active = patina.picture is not None
        row.prop(patina, "use_picture")
        layout.operator(PATINA_OT_bake_world.bl_idname)


register, unregister = bpy.utils.register_classes_factory((PATINA_PT_world,))
