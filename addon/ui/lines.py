# SPDX-License-Identifier: GPL-3.0-or-later
"""Silhouettes, in the render properties."""

from __future__ import annotations

import bpy
from bpy.types import Context, Panel

from . import rows
from .panels import PatinaPanel


class PATINA_PT_lines(PatinaPanel, Panel):
    bl_label = "Lines"
    bl_context = "render"
    bl_options = {'DEFAULT_CLOSED'}

    def draw_header(self, context: Context) -> None:
        self.layout.prop(context.scene.patina.lines, "use", text="")

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        lines = context.scene.patina.lines
        layout.active = lines.use
        layout.prop(lines, "units")
        layout.prop(lines, "width" if lines.units == 'PIXELS' else "width_world")
        layout.prop(lines, "soft")
        layout.prop(lines, "opacity")
        layout.prop(lines, "source")
        layout.prop(lines, "tint" if lines.source == 'POINT' else "color")
        if lines.source == 'DEPTH':
            layout.prop(lines, "far_color")
            layout.prop(lines, "near")
            rows.automatic(layout, lines, "far")
        layout.prop(lines, "surface")
        if lines.surface == 'PAPER':
            layout.prop(lines, "paper")
        rows.automatic(layout, lines, "offset")


register, unregister = bpy.utils.register_classes_factory((PATINA_PT_lines,))
