# SPDX-License-Identifier: GPL-3.0-or-later
"""File > Import > Point Cloud, and dropping files into a view (Blender 4.1 and later)."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, FloatVectorProperty, IntProperty, StringProperty
from bpy.types import Context, Operator, OperatorFileListElement
from bpy_extras.io_utils import ImportHelper

from .. import importers, jobs, native, styles
from ..importers import PointFile, origin
from ..sync import files, linked, sequence
from ..sync.analysis import SCANNERS
from .steps import Stepped

_previews: dict[tuple[str, float], list[str]] = {}  # of the file that is looked at last


class PATINA_OT_import_points(Stepped, Operator, ImportHelper):
    """Import point files with colours, normals and scalars: PLY, LAS, LAZ, COPC, E57, PTX, PTS, XYZ, CSV, PCD, conf"""

    bl_idname = "import_scene.patina_points"
    bl_label = "Import Points"
    bl_options = {'REGISTER', 'UNDO', 'PRESET'}

    filter_glob: StringProperty(default=";".join(f"*{ending}" for ending in importers.FORMATS), options={'HIDDEN'})
    files: CollectionProperty(type=OperatorFileListElement, options={'HIDDEN', 'SKIP_SAVE'})
    directory: StringProperty(subtype='DIR_PATH', options={'HIDDEN', 'SKIP_SAVE'})
    origin: EnumProperty(
        name="Origin", default='SHARED',
        description="Where files with large (georeferenced) coordinates go",
        items=(
            ('SHARED', "Shared", "All files of the scene share one origin and keep their places to each other", 0),
            ('OWN', "Own", "Each file goes near zero and remembers its own origin", 1)))
    link: BoolProperty(
        name="Link", default=False,
        description="Keep the points out of Blender: the object is a box, Patina reads the file itself. For scans too large "
                    "for a mesh; the filters below do not apply")
    sequence: BoolProperty(
        name="Sequence", default=False,
        description="Files in the same folder whose names differ by a number become one object, which shows one of them a "
                    "frame")
    every: IntProperty(
        name="Keep Every", default=1, min=1, soft_max=100,
        description="Keep each so-manieth point: 1 keeps all, 10 a tenth")
    use_box: BoolProperty(name="Only Within a Box", default=False, description="Leave out points outside of a box")
    box_min: FloatVectorProperty(name="From", subtype='XYZ', precision=3,
                                 description="Lower corner, in the file's own coordinates")
    box_max: FloatVectorProperty(name="To", subtype='XYZ', precision=3, default=(1.0, 1.0, 1.0),
                                 description="Upper corner, in the file's own coordinates")

    def draw(self, _context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(self, "origin")
        layout.prop(self, "link")
        row = layout.row()
        row.active = self.link
        row.prop(self, "sequence")
        column = layout.column()
        column.active = not self.link
        column.prop(self, "every")
        column.prop(self, "use_box")
        if self.use_box:
            column.prop(self, "box_min")
            column.prop(self, "box_max")
        lines = _preview(self._paths()[0])
        if lines:
            column = layout.box().column(align=True)
            for line in lines:
                column.label(text=line)

    def execute(self, context: Context) -> set[str]:
        self._progress = importers.Progress()
        return self.begin(context, self._link(context) if self.link else self._import(context))

    def _import(self, context: Context) -> jobs.Steps[set[str]]:
        found, paths = [], self._paths()
        for index, path in enumerate(paths):
            try:
                points = yield from self._read(path, self._progress.part(index, len(paths)))
            except native.PatinaCancelled:
                return self._ended([mesh for mesh, _ in found])
            if points:
                found.append((importers.to_mesh(points), points.origin))
        if not found:
            return {'CANCELLED'}
        bpy.ops.object.select_all(action='DESELECT') if bpy.ops.object.select_all.poll() else None
        shared = self._shared_origin(context, [own for _, own in found])
        for mesh, own in found:
            self._add(context, bpy.data.objects.new(mesh.name, mesh), own, shared)
        count = sum(len(mesh.vertices) for mesh, _ in found)
        self.report({'INFO'}, f"Imported {count:,} points from {len(found)} file{'s' * (len(found) > 1)}. In the sidebar, Patina > "
                              "Frame Points aims the camera")
        return {'FINISHED'}

    def _ended(self, meshes: list[bpy.types.Mesh]) -> set[str]:
        for mesh in meshes:
            bpy.data.meshes.remove(mesh)
        self.report({'INFO'}, "Patina: nothing was imported, for it was ended before")
        return {'CANCELLED'}

    def _shared_origin(self, context: Context, origins: list) -> origin.Origin | None:
        return origin.shared(context.scene, origins) if self.origin == 'SHARED' else None

    def _add(self, context: Context, obj: bpy.types.Object, own: origin.Origin, shared: origin.Origin | None) -> None:
        """Places the object, selected, in the scene."""
        warning = origin.place(obj, own, shared)
        if warning:
            self.report({'WARNING'}, warning)
        context.collection.objects.link(obj)
        styles.dress(context.scene, obj)
        obj.select_set(True)
        context.view_layer.objects.active = obj

    def _link(self, context: Context) -> jobs.Steps[set[str]]:
        found: dict[Path, linked.Linked] = {}  # by the path or pattern that objects shall name
        paths = self._paths()
        for index, path in enumerate(paths):
            name, first = self._named(path)
            if name in found:
                continue
            try:
                source = linked.source(first, analyzed=name == first)  # of a sequence none is
                if source is None:
                    raise native.PatinaError("there is no such file")
                importers.reader(first)
                found[name] = yield from linked.steps(source, self._progress.part(index, len(paths)))
            except native.PatinaCancelled:
                return self._ended([])
            except native.PatinaError as error:
                self.report({'ERROR'}, f"Patina: {first.name}: {error}")
        shared = self._shared_origin(context, [item.origin for item in found.values()])
        for path, item in found.items():
            name = path.stem.replace("#", "").rstrip("_-. ") or path.stem if self.sequence else path.stem
            obj = bpy.data.objects.new(name, linked.box_mesh(name, item.box))
            if item.scanners:
                obj.data[SCANNERS] = item.scanners
            files.assign(obj, files.as_preferred(path))
            obj.patina.sequence.start = context.scene.frame_start
            self._add(context, obj, item.origin, shared)
        self.report({'INFO'}, f"Linked {sum(item.cloud.count for item in found.values()):,} points. In the sidebar, Patina > "
                              "Frame Points aims the camera")
        return {'FINISHED'} if found else {'CANCELLED'}

    def _named(self, path: Path) -> tuple[Path, Path]:
        """What an object names, and the file to read now: of a sequence its pattern and its first file."""
        pattern = sequence.pattern_of(path) if self.sequence else None
        files = sequence.files_of(pattern) if pattern else {}
        return (pattern, files[min(files)]) if files else (path, path)

    def invoke(self, context: Context, event: bpy.types.Event) -> set[str]:
        self._invoked = True
        if self.directory and any(item.name for item in self.files):  # dropped
            return self.execute(context)
        return super().invoke(context, event)

    def _paths(self) -> list[Path]:
        if self.directory and any(item.name for item in self.files):
            return [Path(bpy.path.abspath(self.directory)) / item.name for item in self.files]
        return [Path(bpy.path.abspath(self.filepath))]

    def _filter(self) -> importers.Filter:
        return importers.Filter(self.every, (tuple(self.box_min), tuple(self.box_max)) if self.use_box else None)

    def _read(self, path: Path, progress: importers.Progress) -> jobs.Steps[PointFile | None]:
        """A file's points, or None and a message."""
        wanted = self._filter()
        try:
            points = yield from importers.steps(path, wanted, progress)
        except native.PatinaCancelled:
            raise
        except native.PatinaError as error:
            text = str(error)
            self.report({'ERROR'}, f"Patina: {text}" if path.name in text else f"Patina: {path.name}: {text}")
            return None
        for text in points.warnings:
            self.report({'WARNING'}, f"Patina: {text}")
        if points.invalid:
            self.report({'WARNING'}, f"{path.name}: {points.invalid:,} points without a finite position are "
                                     "kept, but never drawn")
        if not len(points.positions):
            left = "" if wanted.keeps_all() else " that the filters keep"
            self.report({'ERROR'}, f"Patina: {path.name} holds no points{left}")
            return None
        return points


def _preview(path: Path) -> list[str]:
    """What the file dialog shows of the chosen file; read once, for panels are drawn often."""
    try:
        key = (str(path), path.stat().st_mtime if path.is_file() else 0.0)
    except OSError:
        return []
    if not key[1]:
        return []
    if key not in _previews:
        _previews.clear()
        _previews[key] = importers.preview(path)
    return _previews[key]


def _menu(self: bpy.types.Menu, _context: Context) -> None:
    self.layout.operator(PATINA_OT_import_points.bl_idname, text="Point Cloud (.ply/.las/.laz/.e57/.pts/...)")


_CLASSES: list[type] = [PATINA_OT_import_points]

if hasattr(bpy.types, "FileHandler"):  # Blender 4.1
    class PATINA_FH_points(bpy.types.FileHandler):
        bl_idname = "PATINA_FH_points"
        bl_label = "Point Cloud"
        bl_import_operator = PATINA_OT_import_points.bl_idname
        bl_file_extensions = ";".join(ending for ending in importers.FORMATS if ending not in {".txt", ".csv"})

        @classmethod
        def poll_drop(cls, context: Context) -> bool:
            return context.area is not None and context.area.type in {'VIEW_3D', 'OUTLINER'}

    _CLASSES.append(PATINA_FH_points)


def register() -> None:
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.TOPBAR_MT_file_import.append(_menu)


def unregister() -> None:
    bpy.types.TOPBAR_MT_file_import.remove(_menu)
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
