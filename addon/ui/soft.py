# SPDX-License-Identifier: GPL-3.0-or-later
"""Panel of an object's soft points."""

from __future__ import annotations

import bpy
from bpy.types import Context, Object, Panel, PropertyGroup, UILayout

from .. import point_data
from ..draw import histogram
from ..sync.points.colors import scalar_name
from . import rows
from .colors import ColorPanel

HISTOGRAM = 7.0  # lines of the panel

class PATINA_PT_soft(ColorPanel, Panel):
    bl_label = "Soft Points"
    bl_options = {'DEFAULT_CLOSED'}
    bl_order = 1

    def draw_header(self, context: Context) -> None:
        self.layout.prop(context.object.patina.soft, "use", text="")

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        obj = context.object
        group = obj.patina.soft
        if point_data.holds_points(obj):
            self._draw_brush(context)
        layout = layout.column()
        layout.active = group.use
        layout.prop(group, "by")
        if group.by == 'ATTRIBUTE':
            layout.prop(group, "attribute")
            if not obj.patina.linked_file:
                layout.operator("object.patina_analyze", text="Analyze to Attributes").soft = True
            other = scalar_name(obj)
            if obj.patina.linked_file and other and other != group.attribute:
                layout.label(text=f"A linked file gives one column: '{other}'", icon='INFO')
        if group.by == 'CLASSES':
            layout.prop(group, "classes")
        if group.by == 'DISTANCE':
            layout.prop(group, "target")
            layout.prop(group, "shape")
        if group.by != 'ALL':
            self._draw_threshold(layout, group)
            self._draw_histogram(context, layout, obj)
            layout.prop(group, "hide")
        layout = layout.column()
        layout.active = not (group.hide and group.by != 'ALL')
        layout.prop(group, "transition")
        layout.prop(group, "opacity")
        row = layout.row(heading="Radius")
        row.prop(group, "use_radius", text="")
        row = row.row()
        row.active = group.use_radius
        row.prop(group, "radius", text="")

    def _draw_brush(self, context: Context) -> None:
        brush = context.window_manager.patina_brush
        column = self.layout.column(align=True)
        column.operator("object.patina_soft_brush", icon='BRUSH_DATA')
        row = column.row(align=True)
        row.use_property_split = False
        row.prop(brush, "strength")
        row.prop(brush, "radius")
        row.prop(brush, "through", text="", icon='XRAY')

    def _draw_threshold(self, layout: UILayout, group: PropertyGroup) -> None:
        if group.by not in {'CLASSES', 'LUMINANCE'}:
            column = layout.column(align=True)
            column.prop(group, "use_range")
            if group.use_range:
                column.prop(group, "range_min")
                column.prop(group, "range_max")
        layout.prop(group, "invert")
        layout.prop(group, "threshold")

    def _draw_histogram(self, context: Context, layout: UILayout, obj: Object) -> None:
        found, threshold = histogram.of(obj), obj.patina.soft.threshold
        if found is None:
            rows.sentence(context, layout, "A histogram is shown here once a view in Rendered shading, or a render, has drawn the points", 'NONE')
            return
        row = layout.row()
        row.template_icon(histogram.icon(obj, found), scale=HISTOGRAM)
        column = row.column(align=True)
        for text in (f"{found.share(threshold):.1%} of {found.counts.sum():,} points are soft", f"0 is {found.number(0.0):.5g}",
                     f"Threshold is {found.number(threshold):.5g}", f"1 is {found.number(1.0):.5g}"):
            column.label(text=text)


register, unregister = bpy.utils.register_classes_factory((PATINA_PT_soft,))
