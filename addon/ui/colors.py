# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels of the points' colours, of hidden classes, and of objects that cut."""

from __future__ import annotations

import bpy
from bpy.types import Context, Menu, Object, Panel, UILayout

from .. import point_data
from ..properties.colors import CLASS_NAMES, class_name
from ..sync.points import coloring
from .panels import PatinaPanel


class ColorPanel(PatinaPanel):
    """Below the points of an object's data."""

    bl_context = "data"
    bl_parent_id = "PATINA_PT_points"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and point_data.may_have_points(context.object)


class PATINA_MT_color_by(Menu):
    """Lists what the points of the active object can be colored by"""

    bl_idname = "PATINA_MT_color_by"
    bl_label = "Color By"

    def draw(self, context: Context) -> None:
        layout, obj = self.layout, context.object
        layout.operator_context = 'INVOKE_DEFAULT'
        for choice in coloring.choices(obj):
            layout.operator("object.patina_color_by", text=choice.label).choice = choice.label
        layout.separator()
        if not obj.patina.linked_file and "spacing" not in obj.data.attributes:
            layout.operator("object.patina_analyze", text="Analyze for Spacing, Thickness, Kind")
        layout.operator("object.patina_cloud_distance", text="Measure Distance to Cloud")
        layout.operator("object.patina_height_above_ground", text="Measure Height Above Ground")


def draw_color_by(layout: UILayout, obj: Object) -> None:
    """The row that shows what the points are colored by, and opens the menu."""
    row = layout.row(heading="Color By")
    row.use_property_decorate = False
    row.menu(PATINA_MT_color_by.bl_idname, text=coloring.current(obj))


class PATINA_PT_color(ColorPanel, Panel):
    bl_label = "Color"

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        obj = context.object
        group = obj.patina.colors
        draw_color_by(layout, obj)
        if group.source == 'OWN':
            if not obj.patina.linked_file:
                layout.prop_search(obj.patina, "color_attribute", obj.data, "attributes", text="Attribute")
            layout.prop(obj.patina, "color", text="Fallback")
            layout.prop(obj.patina.points, "use_lent_colors")
        if group.source == 'FIXED':
            layout.prop(obj.patina, "color")
        if group.source == 'SCALAR':
            if obj.patina.linked_file:
                layout.prop(group, "scalar")
            else:
                layout.prop_search(group, "scalar", obj.data, "attributes")
        elif context.scene.patina.effects.contour_source == 'ATTRIBUTE':
            if obj.patina.linked_file:
                layout.prop(group, "contour")
            else:
                layout.prop_search(group, "contour", obj.data, "attributes")
        if group.source not in {'OWN', 'FIXED', 'MATERIAL'}:
            self._draw_ramp(group)
        layout.prop(group, "exposure")
        layout.prop(group, "contrast")
        if not obj.patina.linked_file:
            column = layout.column(align=True)
            column.operator_context = 'INVOKE_DEFAULT'
            column.operator("object.patina_cloud_distance")
            column.operator("object.patina_height_above_ground")

    def _draw_ramp(self, group: bpy.types.PropertyGroup) -> None:
        layout = self.layout
        row = layout.row(align=True)
        row.prop(group, "ramp")
        row.operator("object.patina_new_ramp", text="", icon='ADD')
        if group.ramp == 'CUSTOM':
            layout.prop(group, "texture")
            if group.texture and group.texture.color_ramp:
                layout.template_color_ramp(group.texture, "color_ramp", expand=True)
        column = layout.column(align=True)
        row = column.row(align=True)
        row.prop(group, "use_range")
        if group.source not in {'DISTANCE', 'TRUST'}:
            row.operator("object.patina_robust_range", text="Robust")
        if group.use_range:
            column.prop(group, "range_min")
            column.prop(group, "range_max")
        layout.prop(group, "use_legend")


class PATINA_PT_classes(ColorPanel, Panel):
    bl_label = "Hidden Classes"
    bl_options = {'DEFAULT_CLOSED'}
    bl_order = 1

    def draw(self, context: Context) -> None:
        layout = self.layout
        obj = context.object
        group = obj.patina.colors
        flow = layout.grid_flow(columns=2, even_columns=True, align=True)
        for number in range(len(CLASS_NAMES)):
            flow.prop(group, "hidden", index=number, text=class_name(number))
        layout.use_property_split = True
        layout.prop(group, "hidden_more")
        if not obj.patina.linked_file:
            layout.prop_search(group, "class_attribute", obj.data, "attributes")


class PATINA_PT_cuts(ColorPanel, Panel):
    bl_label = "Clip"
    bl_order = 1

    def draw_header(self, context: Context) -> None:
        self.layout.prop(context.object.patina.colors, "use_clips", text="")

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.active = context.object.patina.colors.use_clips
        row = layout.row(align=True)
        row.operator("object.patina_add_clip_box")
        row.operator("object.patina_add_clip_plane")


class PATINA_PT_clip(PatinaPanel, Panel):
    bl_label = "Patina Clip"
    bl_context = "object"
    bl_options = {'DEFAULT_CLOSED'}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and context.object and context.object.type in {'MESH', 'EMPTY'}

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        group = context.object.patina.clip
        layout.prop(group, "shape")
        column = layout.column()
        column.active = group.shape != 'NONE'
        column.prop(group, "cut")
        column.prop(group, "tint_strength", text="Tint", slider=True)
        inner = column.column()
        inner.active = group.tint_strength > 0.0
        inner.prop(group, "tint", text="Color")
        inner.prop(group, "tint_width")


register, unregister = bpy.utils.register_classes_factory(
    (PATINA_MT_color_by, PATINA_PT_color, PATINA_PT_classes, PATINA_PT_cuts, PATINA_PT_clip))
