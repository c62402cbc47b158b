# SPDX-License-Identifier: GPL-3.0-or-later
"""Add Clip Box, Add Clip Plane: empties that cut the clouds, placed around the selected one."""

from __future__ import annotations

import bpy
from bpy.types import Context, Menu, Object, Operator
from mathutils import Vector

from .. import point_data
from ..draw.engine import PatinaRenderEngine

SMALLEST = 1e-3  # half size of a box around points that lie in a plane


def _corners(context: Context) -> list[Vector]:
    """World corners of the selected objects' bounding boxes, those of points."""
    def of(obj: Object) -> list[Vector]:
        return [obj.matrix_world @ Vector(corner) for corner in point_data.corners(obj)]

    chosen = [obj for obj in context.selected_objects if point_data.may_have_points(obj)]
    return [corner for obj in chosen for corner in of(obj)]


class _AddClip:
    bl_options = {'REGISTER', 'UNDO'}

    def execute(self, context: Context) -> set[str]:
        corners = _corners(context) or [context.scene.cursor.location + Vector((k, k, k)) for k in (-1.0, 1.0)]
        lower, upper = (Vector(edge(corner[k] for corner in corners) for k in range(3)) for edge in (min, max))
        empty = bpy.data.objects.new(self.bl_label.removeprefix("Add "), None)
        empty.location = (lower + upper) / 2
        self._shape(empty, (upper - lower) / 2)
        context.collection.objects.link(empty)
        point_data.select_alone(context, empty)
        return {'FINISHED'}


class PATINA_OT_add_clip_box(_AddClip, Operator):
    """Add a box around the selected points. Only points inside it are drawn. Move, rotate and scale it to clip"""

    bl_idname = "object.patina_add_clip_box"
    bl_label = "Add Clip Box"

    def _shape(self, empty: Object, half: Vector) -> None:
        empty.empty_display_type = 'CUBE'
        empty.scale = [max(size, SMALLEST) for size in half]
        empty.patina.clip.shape = 'BOX'


class PATINA_OT_add_clip_plane(_AddClip, Operator):
    """Add a plane through the middle of the selected points. Points above it are not drawn"""

    bl_idname = "object.patina_add_clip_plane"
    bl_label = "Add Clip Plane"

    def _shape(self, empty: Object, half: Vector) -> None:
        empty.empty_display_type = 'SINGLE_ARROW'
        empty.empty_display_size = max(half.length / 2, SMALLEST)
        empty.patina.clip.shape = 'PLANE'


def _draw_menu(self: Menu, context: Context) -> None:
    if context.engine == PatinaRenderEngine.bl_idname:
        self.layout.separator()
        self.layout.operator(PATINA_OT_add_clip_box.bl_idname, text="Clip Box", icon='CUBE')
        self.layout.operator(PATINA_OT_add_clip_plane.bl_idname, text="Clip Plane", icon='MESH_PLANE')


_register, _unregister = bpy.utils.register_classes_factory((PATINA_OT_add_clip_box, PATINA_OT_add_clip_plane))


def register() -> None:
    _register()
    bpy.types.VIEW3D_MT_add.append(_draw_menu)


def unregister() -> None:
    bpy.types.VIEW3D_MT_add.remove(_draw_menu)
    _unregister()
