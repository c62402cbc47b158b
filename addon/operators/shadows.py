# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake Shadows and Load Shadows: shadow textures in a file beside the scene, computed once."""

from __future__ import annotations

import bpy
from bpy.props import StringProperty
from bpy.types import Context, Event, Operator
from bpy_extras.io_utils import ExportHelper, ImportHelper

from .. import native, sync
from ..description.scene import SceneDescription
from ..draw import render

EXTENSION = ".patina-shadows"


class _ShadowOperator:
    """Works on the scene as it renders now."""

    bl_options = {'REGISTER', 'UNDO'}
    filename_ext = EXTENSION
    filter_glob: StringProperty(default="*" + EXTENSION, options={'HIDDEN'})

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.scene.render.engine == "PATINA" and context.scene.camera is not None

    def execute(self, context: Context) -> set[str]:
        path = bpy.path.abspath(self.filepath)
        manager = context.window_manager
        manager.progress_begin(0.0, 1.0)
        try:
            depsgraph = context.evaluated_depsgraph_get()
            view = sync.final_view(context.scene.camera.evaluated_get(depsgraph), depsgraph)
            description = sync.describe(depsgraph, view, lambda what, progress: False)
            self._work(description, path)
        except (native.PatinaError, sync.CameraError) as error:
            self.report({'ERROR'}, f"Patina: {error}")
            return {'CANCELLED'}
        finally:
            manager.progress_end()
        context.scene.patina.shadow_file = self.filepath
        self.report({'INFO'}, f"Shadows come from {path} now")
        return {'FINISHED'}


class PATINA_OT_bake_shadows(_ShadowOperator, Operator, ExportHelper):
    """Compute the shadows of all lights once and save them to a file"""

    bl_idname = "patina.bake_shadows"
    bl_label = "Bake Shadows"

    def invoke(self, context: Context, event: Event) -> set[str]:
        if not self.filepath:
            self.filepath = bpy.path.ensure_ext(bpy.path.basename(bpy.data.filepath).rpartition(".")[0] or "scene", EXTENSION)
        return ExportHelper.invoke(self, context, event)

    def _work(self, description: SceneDescription, path: str) -> None:
        render.bake_shadows(description, path)


class PATINA_OT_load_shadows(_ShadowOperator, Operator, ImportHelper):
    """Load baked shadows for this scene. Reports why they do not fit, if so"""

    bl_idname = "patina.load_shadows"
    bl_label = "Load Shadows"

    def _work(self, description: SceneDescription, path: str) -> None:
        render.check_shadows(description, path)


_CLASSES = (PATINA_OT_bake_shadows, PATINA_OT_load_shadows)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
