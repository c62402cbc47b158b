# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel of what is written over the image."""

from __future__ import annotations

import bpy
from bpy.types import Context, Panel

from .panels import PatinaPanel


class PATINA_PT_marks(PatinaPanel, Panel):
    bl_label = "Scale Bar and Title"
    bl_context = "render"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        marks = context.scene.patina.marks
        layout.prop(marks, "use_bar")
        row = layout.row()
        row.active = marks.use_bar
        row.prop(marks, "bar_distance")
        layout.prop(marks, "use_north")
        row = layout.row()
        row.active = marks.use_north
        row.prop(marks, "north")
        layout.prop(marks, "use_title")
        column = layout.column()
        column.active = marks.use_title
        column.prop(marks, "title")
        column.prop(marks, "note")
        layout.prop(marks, "use_measures")
        layout.prop(marks, "size")
        layout.prop(marks, "burn")


register, unregister = bpy.utils.register_classes_factory((PATINA_PT_marks,))
