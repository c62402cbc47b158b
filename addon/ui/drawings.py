# SPDX-License-Identifier: GPL-3.0-or-later
"""Survey drawings in the sidebar of a 3D view: new ones, the list, and the active one's settings."""

from __future__ import annotations

import bpy
from bpy.types import Context, Panel

from ..operators import drawings, export_drawings, polls
from ..properties.drawings import KINDS
from ..sync import drawings as kept
from ..sync.drawings import DrawingError
from . import rows
from .statistics import SidebarPanel

ICONS = {'PLAN': 'AXIS_TOP', 'ELEVATION': 'AXIS_FRONT', 'SECTION': 'MOD_BOOLEAN', 'CEILING': 'MOD_MIRROR'}
_NEW = ((drawings.PATINA_OT_add_drawing, 'VIEW', "Current View"), (drawings.PATINA_OT_pick_drawing, 'WALL', "Wall"),
        (drawings.PATINA_OT_pick_drawing, 'LINE', "Section Line"), (drawings.PATINA_OT_pick_drawing, 'POINTS', "Three Points"),
        (drawings.PATINA_OT_add_drawing, 'PLAN', "Plan"), (drawings.PATINA_OT_add_drawing, 'CEILING', "Ceiling Plan"))


class PATINA_PT_drawings(SidebarPanel, Panel):
    bl_label = "Survey Drawings"
    bl_order = 3
    bl_options = {'DEFAULT_CLOSED'}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return polls.has_points(context)

    def draw(self, context: Context) -> None:
        layout = self.layout
        column = layout.column(align=True)
        column.operator_context = 'INVOKE_REGION_WIN'  # the view, not the sidebar
        for start in range(0, len(_NEW), 2):
            row = column.row(align=True)
            for operator, by, text in _NEW[start:start + 2]:
                row.operator(operator.bl_idname, text=text).by = by
        found = kept.of_scene(context.view_layer)
        self._list(context, found)
        if kept.is_drawing(context.object):
            self._settings(context, context.object)

    def _list(self, context: Context, found: list[bpy.types.Object]) -> None:
        column = self.layout.column(align=True)
        for obj in found:
            row = column.row(align=True)
            active = obj == context.object
            row.operator(drawings.PATINA_OT_select_drawing.bl_idname, text=obj.name, icon=ICONS[obj.patina.drawing.kind], depress=active).drawing = obj.name
            row.operator(drawings.PATINA_OT_look_through_drawing.bl_idname, text="", icon='HIDE_OFF').drawing = obj.name
            row.operator_context = 'INVOKE_DEFAULT'
            row.operator(export_drawings.PATINA_OT_export_drawing.bl_idname, text="", icon='EXPORT').drawing = obj.name
        row = self.layout.row()
        row.operator_context = 'INVOKE_DEFAULT'
        row.enabled = bool(found)
        row.operator(export_drawings.PATINA_OT_export_drawings.bl_idname, text="Export All Drawings...", icon='EXPORT')

    def _settings(self, context: Context, obj: bpy.types.Object) -> None:
        column, group = self.layout.column(), obj.patina.drawing
        column.use_property_split, column.use_property_decorate = True, False
        for name in ("kind", "scale", "width", "height", "front", "back"):
            column.prop(group, name)
        rows.automatic(column, group, "thickness")
        rows.automatic(column, group, "pixel")
        self.layout.operator(export_drawings.PATINA_OT_drawing_to_curves.bl_idname, icon='OUTLINER_OB_CURVE').drawing = obj.name
        try:
            facts, supported = kept.facts(obj, context.scene)
        except DrawingError as error:
            rows.sentence(context, self.layout, str(error), 'ERROR')
            return
        rows.table(context, self.layout, facts)
        if not supported:
            rows.sentence(context, self.layout, "The points do not support this scale", 'ERROR')


assert set(ICONS) == {item[0] for item in KINDS}
register, unregister = bpy.utils.register_classes_factory((PATINA_PT_drawings,))
