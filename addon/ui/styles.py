# SPDX-License-Identifier: GPL-3.0-or-later
"""Styles by picture, in the render properties and in the sidebar; the light and background that they set."""

from __future__ import annotations

import bpy
from bpy.types import Context, Menu, Panel

from ..styles import styles
from . import rows
from .panels import PatinaPanel
from .statistics import SidebarPanel


class _StylePanel:
    bl_label = "Style"

    def draw(self, context: Context) -> None:
        layout = self.layout
        style = context.scene.patina.style
        row = layout.row()
        row.template_icon_view(style, "chosen", show_labels=True, scale=6.0, scale_popup=6.0)
        column = row.column(align=True)
        column.operator("patina.save_style", text="", icon='ADD')
        column.operator("patina.delete_style", text="", icon='REMOVE')
        column.menu(PATINA_MT_styles.__name__, text="", icon='DOWNARROW_HLT')
        column = layout.column()
        column.prop(style, "chosen", text="")
        inner = column.column()
        inner.use_property_split = True
        inner.prop(style, "objects")
        if style.notice:
            rows.sentence(context, column, style.notice, 'INFO')


class PATINA_MT_styles(Menu):
    bl_label = "Styles"

    def draw(self, context: Context) -> None:
        self.layout.operator("patina.load_style", text="Load from File...", icon='FILE_FOLDER')
        self.layout.operator("wm.path_open", text="Open Folder of Own Styles", icon='FOLDER_REDIRECT').filepath = \
            str(styles.own_folder())


class PATINA_PT_style(PatinaPanel, _StylePanel, Panel):
    bl_context = "render"
    bl_order = 0


class PATINA_PT_sidebar_style(SidebarPanel, _StylePanel, Panel):
    bl_order = 0


class PATINA_PT_studio_light(PatinaPanel, Panel):
    bl_label = "Studio Light"
    bl_context = "render"
    bl_options = {'DEFAULT_CLOSED'}

    def draw_header(self, context: Context) -> None:
        self.layout.prop(context.scene.patina.studio, "use_light", text="")

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        studio = context.scene.patina.studio
        layout.active = studio.use_light
        for name in ("azimuth", "height", "follow_camera", "color", "strength", "angle", "fill", "ambient"):
            layout.prop(studio, name)


class PATINA_PT_headlight(PatinaPanel, Panel):
    bl_label = "Headlight"
    bl_context = "render"
    bl_options = {'DEFAULT_CLOSED'}

    def draw_header(self, context: Context) -> None:
        self.layout.prop(context.scene.patina.studio, "use_headlight", text="")

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        studio = context.scene.patina.studio
        layout.active = studio.use_headlight
        layout.prop(studio, "headlight")


_CLASSES = (PATINA_MT_styles, PATINA_PT_style, PATINA_PT_sidebar_style, PATINA_PT_studio_light, PATINA_PT_headlight)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
