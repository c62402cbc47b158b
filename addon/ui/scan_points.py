# SPDX-License-Identifier: GPL-3.0-or-later
"""Points of a linked cloud and scans of any, in the sidebar of a 3D view."""

from __future__ import annotations

import bpy
from bpy.types import Context, Menu, Panel, UIList

from .. import point_data
from ..sync.analyses import scans_of
from ..sync.points import edits
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
        layout.operator("object.patina_select_untrusted", text="Untrusted")
        operator = layout.operator("object.patina_points_select_by", text="By Value...")
        operator.by, operator.how = 'VALUE', 'SET'
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
        column.operator("object.patina_select_untrusted")
        operator = column.operator("object.patina_points_select_by", text="Select by Value...")
        operator.by, operator.how = 'VALUE', 'SET'
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
    def draw_item(self, _context: Context, layout: bpy.types.UILayout, data: object, item: object, _icon: int, _owner: object,
                  _active: str) -> None:
        row = layout.row(align=True)
        row.prop(item, "name", text="", emboss=False)
        side = row.row()
        side.alignment = 'RIGHT'
        side.active = False
        graded = edits.grade_of_item(item) != edits.NEUTRAL
        side.label(text=f"{'graded  ' * graded}{item.count}")
        row.prop(item, "solo", text="", icon='SOLO_ON' if item.solo else 'SOLO_OFF', emboss=False)
        row.prop(item, "hide", text="", icon='HIDE_ON' if item.hide else 'HIDE_OFF', emboss=False)


class PATINA_PT_scans(SidebarPanel, Panel):
    bl_label = "Scans"
    bl_options = {'DEFAULT_CLOSED'}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and _has_scans(context.object)

    def draw(self, context: Context) -> None:
        layout, obj = self.layout, context.object
        group = obj.patina.points
        column = layout.column()
        column.active = obj.patina.colors.source == 'OWN'
        column.prop(group, "use_balance")
        column.prop(group, "use_lent_colors")
        layout.operator("object.patina_scans_color")
        layout.operator("object.patina_scans_list")
        if not group.scans:
            return
        layout.template_list("PATINA_UL_scans", "", group, "scans", group, "scan", rows=3)
        if group.scan < len(group.scans):
            self._draw_grade(obj, group.scans[group.scan])
        layout.operator("object.patina_scans_reset")

    def _draw_grade(self, obj: bpy.types.Object, item: bpy.types.PropertyGroup) -> None:
        layout = self.layout
        layout.use_property_split = True
        column = layout.column()
        column.active = obj.patina.colors.source == 'OWN'
        for name in ("gain", "gamma", "saturation", "temperature"):
            column.prop(item, name, slider=True)
        number = edits.number_of(item)
        if number >= 0 and obj.patina.linked_file:
            operator = layout.operator("object.patina_points_select_by", text="Select Its Points")
            operator.by, operator.number, operator.how = 'SCAN', number, 'SET'


def _has_scans(obj: bpy.types.Object | None) -> bool:
    if not point_data.may_have_points(obj):
        return False
    return bool(obj.patina.linked_file or obj.patina.points.scans) or any(name in obj.data.attributes for name in scans_of.SCAN_NAMES)


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
