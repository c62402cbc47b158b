# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels of panoramic cameras, and of clouds that know where their scanner stood."""

from __future__ import annotations

import bpy
import numpy as np
from bpy.types import Context, Panel

from ..draw.engine import PatinaRenderEngine
from ..operators import scanner
from . import rows


class _DataPanel:
    bl_space_type = 'PROPERTIES'
    bl_region_type = 'WINDOW'
    bl_context = "data"
    COMPAT_ENGINES = {PatinaRenderEngine.bl_idname}


class PATINA_PT_panorama(_DataPanel, Panel):
    bl_label = "Panorama"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES and context.camera is not None and context.camera.type == 'PANO'

    def draw(self, context: Context) -> None:
        rows.sentence(context, self.layout, "Drawn as an equirectangular picture", 'INFO')


class PATINA_PT_scanner(_DataPanel, Panel):
    bl_label = "Scanner"
    bl_parent_id = "PATINA_PT_points"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES and len(scanner.positions(context.object)) > 0

    def draw(self, context: Context) -> None:
        count = int(np.isfinite(scanner.positions(context.object)).all(axis=1).sum())
        self.layout.label(text=f"{count} position{'s' * (count > 1)} of scanners")
        self.layout.operator(scanner.PATINA_OT_camera_at_scanner.bl_idname)
        self.layout.operator("view3d.patina_view_from_here")
        self.layout.operator("object.patina_add_stations")


register, unregister = bpy.utils.register_classes_factory((PATINA_PT_panorama, PATINA_PT_scanner))
