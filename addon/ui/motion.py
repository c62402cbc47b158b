# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of motion blur: Blender's own shutter, and how many moments."""

from __future__ import annotations

import bpy
from bpy.types import Context, Panel

from ..draw.engine import PatinaRenderEngine
from ..sync.view import motion


class PATINA_PT_motion_blur(Panel):
    bl_label = "Motion Blur"
    bl_space_type = 'PROPERTIES'
    bl_region_type = 'WINDOW'
    bl_context = "render"
    bl_options = {'DEFAULT_CLOSED'}
    COMPAT_ENGINES = {PatinaRenderEngine.bl_idname}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES

    def draw_header(self, context: Context) -> None:
        self.layout.prop(context.scene.render, "use_motion_blur", text="")

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.active = context.scene.render.use_motion_blur
        layout.prop(*motion.position_property(context.scene), text="Position")
        layout.prop(context.scene.render, "motion_blur_shutter")
        layout.prop(context.scene.patina, "motion_steps")


register, unregister = bpy.utils.register_classes_factory((PATINA_PT_motion_blur,))
