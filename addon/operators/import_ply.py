# SPDX-License-Identifier: GPL-3.0-or-later
"""File > Import > Point Cloud (.ply)."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import CollectionProperty, EnumProperty, StringProperty
from bpy.types import Context, Operator, OperatorFileListElement
from bpy_extras.io_utils import ImportHelper

from .. import jobs, native
from ..importers import origin, ply, to_mesh
from ..importers import PointFile


class PATINA_OT_import_ply(Operator, ImportHelper):
    """Import PLY files as points with colours, normals and scalars; faces are left out"""

    bl_idname = "import_scene.patina_ply"
    bl_label = "Import PLY Points"
    bl_options = {'REGISTER', 'UNDO'}

    filename_ext = ".ply"
    filter_glob: StringProperty(default="*.ply", options={'HIDDEN'})
    files: CollectionProperty(type=OperatorFileListElement, options={'HIDDEN', 'SKIP_SAVE'})
    directory: StringProperty(subtype='DIR_PATH', options={'HIDDEN', 'SKIP_SAVE'})
    origin: EnumProperty(
        name="Origin", default='SHARED',
        description="Where files with large (georeferenced) coordinates go",
        items=(
            ('SHARED', "Shared", "All files of the scene share one origin and keep their places to each other", 0),
            ('OWN', "Own", "Each file goes near zero and remembers its own origin", 1)))

    def execute(self, context: Context) -> set[str]:
        points = [read for path in self._paths() if (read := self._read(context, path))]
        if not points:
            return {'CANCELLED'}
        bpy.ops.object.select_all(action='DESELECT') if bpy.ops.object.select_all.poll() else None
        shared = origin.shared(context.scene, [item.origin for item in points]) if self.origin == 'SHARED' else None
        for item in points:
            obj = bpy.data.objects.new(item.name, to_mesh(item))
            warning = origin.place(obj, item.origin, shared)
            if warning:
                self.report({'WARNING'}, warning)
            context.collection.objects.link(obj)
            obj.select_set(True)
            context.view_layer.objects.active = obj
        count = sum(len(item.positions) for item in points)
        self.report({'INFO'}, f"Imported {count:,} points from {len(points)} file{'s' * (len(points) > 1)}")
        return {'FINISHED'}

    def _paths(self) -> list[Path]:
        if self.directory and any(item.name for item in self.files):
            return [Path(bpy.path.abspath(self.directory)) / item.name for item in self.files]
        return [Path(bpy.path.abspath(self.filepath))]

    def _read(self, context: Context, path: Path) -> PointFile | None:
        """A file's points, or None and a message. Reads on a worker thread and shows progress at the cursor."""
        manager = context.window_manager
        manager.progress_begin(0.0, 1.0)
        try:
            with native.Progress() as progress:

                def poll() -> bool:
                    manager.progress_update(progress.value())
                    return False

                points = jobs.run(lambda: ply.read(path, progress), progress.cancel, poll)
        except native.PatinaError as error:
            self.report({'ERROR'}, f"Patina: {path.name}: {error}")
            return None
        finally:
            manager.progress_end()
        if points.invalid:
            self.report({'WARNING'}, f"{path.name}: {points.invalid:,} points without a finite position are "
                                     "kept, but never drawn")
        if not len(points.positions):
            self.report({'ERROR'}, f"Patina: {path.name} holds no points")
            return None
        return points


def _menu(self: bpy.types.Menu, _context: Context) -> None:
    self.layout.operator(PATINA_OT_import_ply.bl_idname, text="Point Cloud (.ply)")


def register() -> None:
    bpy.utils.register_class(PATINA_OT_import_ply)
    bpy.types.TOPBAR_MT_file_import.append(_menu)


def unregister() -> None:
    bpy.types.TOPBAR_MT_file_import.remove(_menu)
    bpy.utils.unregister_class(PATINA_OT_import_ply)
