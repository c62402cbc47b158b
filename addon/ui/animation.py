# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel of what animates points with one click, in the sidebar of a 3D view."""

from __future__ import annotations

import bpy
from bpy.types import Context, Panel

from ..operators import camera_paths, reveal
from .statistics import SidebarPanel


class PATINA_PT_animation(SidebarPanel, Panel):
    bl_label = "Animation"
    bl_options = {'DEFAULT_CLOSED'}
    bl_order = 2

    def draw(self, _context: Context) -> None:
        column = self.layout.column(align=True)
        column.operator(camera_paths.PATINA_OT_turntable.bl_idname, icon='CON_CAMERASOLVER')
        column.operator(camera_paths.PATINA_OT_walk_through.bl_idname, icon='CON_FOLLOWPATH')
        row = self.layout.row(align=True)
        row.operator_menu_enum(reveal.PATINA_OT_reveal.bl_idname, "by", text="Reveal", icon='HIDE_OFF')


register, unregister = bpy.utils.register_classes_factory((PATINA_PT_animation,))
