# SPDX-License-Identifier: GPL-3.0-or-later
"""Linked clouds become meshes, and meshes become linked clouds."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import StringProperty
from bpy.types import Context, Object, Operator
from bpy_extras.io_utils import ExportHelper

from .. import jobs, native, point_data
from ..read import importers
from ..read.importers import saved
from ..read.streaming.address import is_ept
from ..sync.points import edits, files, linked, made, origin
from ..write import exporters
from . import export_points, polls


def why_not(obj: Object) -> str:
    """Why the points of a linked cloud cannot become a mesh, and what to do instead; "" if they can."""
    path = obj.patina.linked_file
    if saved.is_saved(Path(path)):
        return "A saved cloud cannot be converted. Import the file that it was made from, without Link"
    if is_ept(path):
        return "An EPT folder cannot be converted. Import a file that it was made from, without Link"
    return ""


class PATINA_OT_linked_to_mesh(Operator):
    """Import the linked file's points into Blender for editing. Deleted points are left out"""

    bl_idname = "object.patina_linked_to_mesh"
    bl_label = "Convert to Mesh"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context: Context) -> bool:
        obj = context.object
        return obj is not None and obj.mode == 'OBJECT' and bool(obj.patina.linked_file) and polls.allowed(cls, why_not(obj))

    def execute(self, context: Context) -> set[str]:
        obj, notices = context.object, []
        try:
            points = export_points.read_linked(obj, context.scene.frame_current, notices)
        except native.PatinaError as error:
            self.report({'ERROR'}, importers.told(f"Patina: {error}"))
            return {'CANCELLED'}
        for notice in notices:
            self.report({'WARNING' if points else 'ERROR'}, f"Patina: {notice}")
        if points is None:
            return {'CANCELLED'}
        box = obj.data
        obj.data = made.to_data(points, cloud=False)
        files.assign(obj, "")
        if edits.PROPERTY in obj:
            del obj[edits.PROPERTY]
        if not box.users:
            bpy.data.meshes.remove(box)
        return {'FINISHED'}


class PATINA_OT_mesh_to_linked(Operator, ExportHelper):
    """Write the object's points to a PLY file and replace them with a link to it"""

    bl_idname = "object.patina_mesh_to_linked"
    bl_label = "Convert to Linked Cloud"
    bl_options = {'REGISTER', 'UNDO'}

    filename_ext = ".ply"
    filter_glob: StringProperty(default="*.ply", options={'HIDDEN'})

    @classmethod
    def poll(cls, context: Context) -> bool:
        obj = context.object
        return point_data.holds_points(obj) and obj.mode == 'OBJECT'

    def execute(self, context: Context) -> set[str]:
        obj, path = context.object, Path(bpy.path.abspath(self.filepath))
        points = export_points.read_local(obj.evaluated_get(context.evaluated_depsgraph_get()))
        if points is None:
            self.report({'ERROR'}, f"Patina: '{obj.name}' has no points")
            return {'CANCELLED'}
        try:
            exporters.write_ply(path, points)
            found = jobs.run(lambda: linked.load(linked.source(path)), lambda: None, lambda: False)
        except (native.PatinaError, OSError) as error:
            self.report({'ERROR'}, importers.told(f"Patina: {path.name}: {error}"))
            return {'CANCELLED'}
        if obj.type != 'MESH':  # a linked cloud shows a box
            point_data.convert([obj], 'MESH')
        obj.data = linked.box_mesh(obj.name, found.box, found)
        # the file's own origin may differ from the object's by what float32 holds
        obj[origin.PROPERTY] = [float(value) for value in found.origin]
        files.assign(obj, files.as_preferred(path))
        return {'FINISHED'}


def register() -> None:
    for cls in (PATINA_OT_linked_to_mesh, PATINA_OT_mesh_to_linked):
        bpy.utils.register_class(cls)


def unregister() -> None:
    for cls in (PATINA_OT_mesh_to_linked, PATINA_OT_linked_to_mesh):
        bpy.utils.unregister_class(cls)
