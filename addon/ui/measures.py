# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of measurements in the sidebar of a 3D view."""

from __future__ import annotations

import contextlib

import bpy
from bpy.types import Context, Panel, UIList

from ..operators import measure, measures, polls
from ..properties.measures import KINDS
from ..sync import measures as kept
from ..sync.measures import MeasureError
from . import rows
from .statistics import SidebarPanel

ICONS = {item[0]: item[3] for item in KINDS}


class PATINA_UL_measures(UIList):
    def draw_item(self, context: Context, layout: bpy.types.UILayout, data: bpy.types.PropertyGroup, item: bpy.types.PropertyGroup, _icon: int,
                  _active_data: bpy.types.PropertyGroup, _active: str, index: int = 0, _filter: int = 0) -> None:
        try:
            text = kept.details(kept.read(data.id_data, index), context.scene)[0][1]
        except MeasureError:
            text = "Damaged"
        split = layout.split(factor=0.5)
        split.prop(item, "name", text="", emboss=False, icon=ICONS[item.kind])
        row = split.row(align=True)
        row.active = not item.hide
        row.label(text=text)
        row.prop(item, "hide", text="", emboss=False, icon='HIDE_ON' if item.hide else 'HIDE_OFF')


class PATINA_PT_measures(SidebarPanel, Panel):
    bl_label = "Measurements"
    bl_order = 2
    bl_options = {'DEFAULT_CLOSED'}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return polls.has_points(context)

    def draw(self, context: Context) -> None:
        layout = self.layout
        column = layout.column(align=True)
        column.operator_context = 'INVOKE_REGION_WIN'  # the view, not the sidebar
        for start in range(0, len(KINDS), 2):
            row = column.row(align=True)
            for kind, label, _about, icon, _number in KINDS[start:start + 2]:
                row.operator(measure.PATINA_OT_measure.bl_idname, text=label, icon=icon).kind = kind
        for obj in kept.measured(context.view_layer.objects):
            self._draw_object(context, obj)
        column = layout.column(align=True)
        column.operator_context = 'INVOKE_DEFAULT'
        column.operator(measure.PATINA_OT_add_measurement.bl_idname, text="Add by Coordinates...")
        row = column.row(align=True)
        row.enabled = any(True for _ in kept.measured(context.view_layer.objects))
        row.operator(measures.PATINA_OT_export_measurements.bl_idname, text="Export Measurements...", icon='EXPORT')

    def _draw_object(self, context: Context, obj: bpy.types.Object) -> None:
        layout, group = self.layout.column(), obj.patina.measures
        layout.label(text=obj.name, icon='OUTLINER_OB_POINTCLOUD')
        layout.template_list(PATINA_UL_measures.__name__, obj.name, group, "entries", group, "active", rows=3)
        row = layout.row(align=True)
        for operator, text, icon in ((measures.PATINA_OT_frame_measurement, "Frame", 'NONE'), (measures.PATINA_OT_copy_measurement, "Copy", 'NONE'),
                                     (measures.PATINA_OT_remove_measurement, "", 'X')):
            row.operator(operator.bl_idname, text=text, icon=icon).owner = obj.name
        with contextlib.suppress(MeasureError):
            if group.active < len(group.entries):
                rows.table(context, layout, kept.details(kept.read(obj, group.active), context.scene))


register, unregister = bpy.utils.register_classes_factory((PATINA_UL_measures, PATINA_PT_measures))
