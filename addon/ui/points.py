# SPDX-License-Identifier: GPL-3.0-or-later
"""The first lines of points, where an artist looks first: in the sidebar and in the object's own tab. All lines are in the tab of
the object's data."""

from __future__ import annotations

import bpy
from bpy.types import Context, Panel

from ..operators import add_light, convert_points, level
from ..operators.clips import PATINA_OT_add_clip_box, PATINA_OT_add_clip_plane
from . import rows, trust
from .colors import draw_color_by
from .panels import PatinaPanel, shows_points
from .statistics import SidebarPanel


class _FirstLines:
    bl_label = "Points"
    decorated = True

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and shows_points(context)

    def draw(self, context: Context) -> None:
        layout = self.layout
        if not convert_points.why_not(context.object, 'POINTCLOUD'):
            layout.operator(convert_points.PATINA_OT_to_point_cloud.bl_idname, icon='POINTCLOUD_DATA')
        layout.use_property_split = True
        layout.use_property_decorate = self.decorated
        patina = context.object.patina
        colors = patina.colors
        column = layout.column()
        draw_color_by(column, context.object)
        if colors.source == 'FIXED':
            column.prop(patina, "color", text=" ")
        elif colors.source not in {'OWN', 'MATERIAL'}:
            column.prop(colors, "ramp")
        layout.prop(patina, "opacity")
        layout.prop(patina, "lighting")
        if patina.lighting == 'LIT' and add_light.is_dark(context.scene):
            rows.sentence(context, layout, "No light reaches this cloud", 'ERROR')
            layout.operator(add_light.PATINA_OT_add_light.bl_idname, icon='LIGHT_SUN')
        rows.automatic(layout, patina, "radius").active = context.scene.patina.surface in {'AUTO', 'SPLATS'} and not patina.ranges.use
        trust.draw_slider(layout, patina)
        tilt = context.object.get(level.TILTED, 0.0)
        if tilt:
            rows.sentence(context, layout, f"The points seem tilted by {tilt:.0f} degrees", 'INFO')
            layout.operator(level.PATINA_OT_level.bl_idname)
        row = layout.row(heading="Clip", align=True)
        row.use_property_decorate = False
        row.prop(colors, "use_clips", text="")
        row = row.row(align=True)
        row.active = colors.use_clips
        row.operator(PATINA_OT_add_clip_box.bl_idname, text="Box")
        row.operator(PATINA_OT_add_clip_plane.bl_idname, text="Plane")


class PATINA_PT_sidebar_points(_FirstLines, SidebarPanel, Panel):
    bl_order = 1
    decorated = False  # dots of keys would take a fifth of its width


class PATINA_PT_object_points(_FirstLines, PatinaPanel, Panel):
    bl_context = "object"


_CLASSES = (PATINA_PT_sidebar_points, PATINA_PT_object_points)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
