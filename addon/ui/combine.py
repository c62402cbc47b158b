# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of Combine by Depth: in the points' scene, and in the one that another engine renders."""

from __future__ import annotations

import bpy
from bpy.types import Context, Panel

from ..operators.combine import PATINA_OT_combine, PATINA_OT_other_scene
from ..sync.view import pairs
from .panels import PatinaPanel


class PATINA_PT_combine(PatinaPanel, Panel):
    bl_label = "Combine by Depth"
    bl_context = "render"
    bl_options = {'DEFAULT_CLOSED'}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) or pairs.points_of(context.scene) is not None

    def draw(self, context: Context) -> None:
        layout = self.layout
        first, points = pairs.first_of(context.scene), pairs.points_of(context.scene)
        if first:
            layout.label(text=f"The points of {first.name}", icon='SCENE_DATA')
            layout.operator(PATINA_OT_other_scene.bl_idname, text="Go to Its Scene")
        elif points:
            layout.label(text=f"With the points of {points.name}", icon='SCENE_DATA')
            layout.operator(PATINA_OT_other_scene.bl_idname, text="Go to the Points' Scene")
        else:
            layout.operator_menu_enum(PATINA_OT_combine.bl_idname, "engine", text="Combine with")


register, unregister = bpy.utils.register_classes_factory((PATINA_PT_combine,))
