# SPDX-License-Identifier: GPL-3.0-or-later
"""Points and scans of a linked cloud, in the sidebar of a 3D view."""

from __future__ import annotations

import bpy
from bpy.types import Context, Menu, Panel, UIList

from ..sync import edits
from . import rows
from .statistics import SidebarPanel


class _LinkedPanel(SidebarPanel):
    bl_options = {'DEFAULT_CLOSED'}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and context.object is not None and bool(context.object.patina.linked_file)


class PATINA_MT_points(Menu):
    """Beside the Object menu: in a 3D view, of a linked cloud"""

    bl_label = "Points"

    def draw(self, _context: Context) -> None:
        layout = self.layout
        layout.operator_context = 'INVOKE_REGION_WIN'
        for shape, text in (('BOX', "Box Select"), ('LASSO', "Lasso Select")):
            layout.operator("object.patina_points_select", text=text).shape = shape
        layout.separator()
        for action, text in (('SELECT', "All"), ('DESELECT', "None"), ('INVERT', "Invert")):
            layout.operator("object.patina_points_select_all", text=text).action = action
        layout.separator()
        layout.operator("object.patina_points_hide", text="Hide Selected").unselected = False
        layout.operator("object.patina_points_hide", text="Hide Unselected").unselected = True
        layout.operator("object.patina_points_reveal", text="Reveal Hidden")
        layout.separator()
        layout.operator("object.patina_points_delete", text="Delete Selected")
        layout.operator("object.patina_points_restore", text="Restore Deleted")


class PATINA_PT_points_edit(_LinkedPanel, Panel):
    bl_label = "Points of the Scan"

    def draw(self, context: Context) -> None:
        layout, obj = self.layout, context.object
        group = obj.patina.points
        column = layout.column(align=True)
        row = column.row(align=True)
        row.operator_context = 'INVOKE_REGION_WIN'  # the view, not the sidebar
        for shape, text, icon in (('BOX', "Box", 'MESH_PLANE'), ('LASSO', "Lasso", 'CURVE_DATA')):
            row.operator("object.patina_points_select", text=text, icon=icon).shape = shape
        row.prop(group, "through", text="", icon='XRAY')
        row = column.row(align=True)
        for action, text in (('SELECT', "All"), ('DESELECT', "None"), ('INVERT', "Invert")):
            row.operator("object.patina_points_select_all", text=text).action = action
        row = layout.row(align=True)
        row.prop(group, "class_number")
        operator = row.operator("object.patina_points_select_by", text="Select")
        operator.by, operator.number, operator.how = 'CLASS', group.class_number, 'SET'
        operator = layout.operator_menu_enum("object.patina_points_select_by", "clip", text="Select Within Clip")
        operator.by, operator.how = 'CLIP', 'SET'
        column = layout.column(align=True)
        row = column.row(align=True)
        row.operator("object.patina_points_hide", text="Hide").unselected = False
        row.operator("object.patina_points_hide", text="Others").unselected = True
        row.operator("object.patina_points_reveal", text="Reveal")
        row = column.row(align=True)
        row.operator("object.patina_points_delete", text="Delete")
        row.operator("object.patina_points_restore", text="Restore")
        self._totals(context)

    def _totals(self, context: Context) -> None:
        packed = edits.packed_of(context.object)
        if not packed:
            return
        try:
            totals = edits.unpacked(packed).totals
        except edits.Damaged as damaged:
            rows.sentence(context, self.layout, str(damaged), 'ERROR')
        else:
            rows.table(context, self.layout, [(name.capitalize(), f"{total:,}") for name, total in totals.items()])
        self.layout.operator("object.patina_points_forget")


class PATINA_UL_scans(UIList):
    def draw_item(self, _context: Context, layout: bpy.types.UILayout, _data: object, item: object, _icon: int, _owner: object,
                  _active: str) -> None:
        layout.label(text=item.name)
        state = (item.gain, item.gamma, item.saturation, item.temperature)
        layout.label(text="" if state == edits.NEUTRAL else "graded")


class PATINA_PT_scans(_LinkedPanel, Panel):
    bl_label = "Scans"

    def draw(self, context: Context) -> None:
        layout = self.layout
        group = context.object.patina.points
        layout.operator("object.patina_scans_color")
        layout.operator("object.patina_scans_list")
        if not group.scans:
            return
        layout.template_list("PATINA_UL_scans", "", group, "scans", group, "scan", rows=3)
        if group.scan < len(group.scans):
            item = group.scans[group.scan]
            layout.use_property_split = True
            layout.active = context.object.patina.colors.source == 'OWN'
            column = layout.column()
            for name in ("gain", "gamma", "saturation", "temperature"):
                column.prop(item, name, slider=True)
            number = item.name.rpartition(" ")[2]
            if number.isdigit():
                operator = layout.operator("object.patina_points_select_by", text="Select Its Points")
                operator.by, operator.number, operator.how = 'SCAN', int(number), 'SET'
        layout.operator("object.patina_scans_reset")


def _menu(self: Menu, context: Context) -> None:
    if _LinkedPanel.poll(context):
        self.layout.separator()
        self.layout.menu(PATINA_MT_points.__name__)


_register, _unregister = bpy.utils.register_classes_factory(
    (PATINA_MT_points, PATINA_PT_points_edit, PATINA_UL_scans, PATINA_PT_scans))


def register() -> None:
    _register()
    bpy.types.VIEW3D_MT_object.append(_menu)


def unregister() -> None:
    bpy.types.VIEW3D_MT_object.remove(_menu)
    _unregister()
