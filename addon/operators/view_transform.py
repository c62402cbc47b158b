# SPDX-License-Identifier: GPL-3.0-or-later
"""A button where the scene's view transform changes the colours of scans."""

from __future__ import annotations

import bpy
from bpy.types import Context, Operator


class PATINA_OT_true_colors(Operator):
    """Set the view transform to Standard, which shows scan colors unchanged"""

    bl_idname = "render.patina_true_colors"
    bl_label = "Show Colors as Scanned"
    bl_options = {'REGISTER', 'UNDO'}

    def execute(self, context: Context) -> set[str]:
        view = context.scene.view_settings
        view.view_transform, view.look = 'Standard', 'None'
        view.exposure, view.gamma = 0.0, 1.0
        return {'FINISHED'}


def changes_colors(scene: bpy.types.Scene) -> bool:
    """Whether the view transform grades what is shown."""
    view = scene.view_settings
    return view.view_transform not in {'Standard', 'Raw'} or view.look != 'None' or view.exposure != 0.0 or \
        view.gamma != 1.0


def register() -> None:
    bpy.utils.register_class(PATINA_OT_true_colors)


def unregister() -> None:
    bpy.utils.unregister_class(PATINA_OT_true_colors)
