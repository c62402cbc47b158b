# SPDX-License-Identifier: GPL-3.0-or-later
"""File > Import > Point Cloud, and dropping files into a view (Blender 4.1 and later)."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, FloatProperty, FloatVectorProperty, IntProperty, StringProperty
from bpy.types import Context, Operator, OperatorFileListElement
from bpy_extras.io_utils import ImportHelper

from .. import jobs, native, point_data
from ..read import importers
from ..read.importers import PointFile, name_of, saved, told
from ..styles import styles
from ..sync.points import addresses, built, files, linked, made, origin, sequence
from . import first_look, level, set_up, stations
from .steps import Stepped

METERS = (1.0, 1.0)  # of a file's units, across and up

_previews: dict[tuple[str, float], list[str]] = {}  # of the file that is looked at last


class PATINA_OT_import_points(Stepped, Operator, ImportHelper):
    """Import point files with colors, normals and scalars: PLY, LAS, LAZ, COPC, E57, PTX, PTS, XYZ, CSV, PCD, conf; link EPT"""

    bl_idname = "import_scene.patina_points"
    bl_label = "Import Points"
    bl_options = {'REGISTER', 'UNDO', 'PRESET'}

    filter_glob: StringProperty(default=";".join(f"*{ending}" for ending in [*importers.FORMATS, "ept.json"]), options={'HIDDEN'})
    files: CollectionProperty(type=OperatorFileListElement, options={'HIDDEN', 'SKIP_SAVE'})
    directory: StringProperty(subtype='DIR_PATH', options={'HIDDEN', 'SKIP_SAVE'})
    origin: EnumProperty(
        name="Origin", default='SHARED',
        description="Origin of files with large (georeferenced) coordinates",
        items=(
            ('SHARED', "Shared", "All files share one origin and keep their positions relative to each other", 0),
            ('OWN', "Own", "Each file is moved near zero and stores its own origin", 1)))
    unit: EnumProperty(
        name="Unit", default='FILE',
        description="Length unit of the file. One meter becomes one Blender unit",
        items=(
            ('FILE', "From File", "The unit of the file's coordinate system. Meters if the file has none", 0),
            ('METERS', "Meters", "", 1), ('CENTIMETERS', "Centimeters", "", 2), ('MILLIMETERS', "Millimeters", "", 3),
            ('FEET', "Feet", "International feet, 0.3048 m", 4), ('US_FEET', "US Survey Feet", "1200/3937 m", 5),
            ('INCHES', "Inches", "", 6)))
    scale: FloatProperty(name="Scale", default=1.0, min=1e-6, soft_min=0.001, soft_max=1000.0, max=1e6,
                         description="Additional scale factor")
    up_axis: EnumProperty(
        name="Up Axis", default='Z', description="Axis of the file that points up",
        items=(
            ('Z', "Z", "As in Blender and in surveys", 0), ('Y', "Y", "As in many scans of objects", 1),
            ('NEGATIVE_Y', "-Y", "As in photogrammetry whose first camera is the origin", 2)))
    kind: EnumProperty(
        name="Points As", default='AUTO', description="Type of the objects that hold the points",
        items=(
            ('AUTO', "Automatic", "Point clouds in Blender 4.5 and later, meshes in earlier versions", 0),
            ('POINTCLOUD', "Point Cloud", "Point cloud objects, which Solid and Material Preview shading show in color", 1),
            ('MESH', "Mesh", "Meshes of vertices. Needed for modifiers other than Geometry Nodes", 2)))
    frame: BoolProperty(name="Frame Points", default=False,
                        description="Aim the scene's camera at the imported points. Ignores distant strays")
    stations: BoolProperty(
        name="Stations", default=True,
        description="Add an empty at each scanner position stored in the file (E57, PTX), parented to the points")
    link: BoolProperty(
        name="Link", default=False,
        description="Keep the points in the file. The object is a box, and Patina reads the file itself. For scans that are too large for Blender. "
                    "The filters below do not apply")
    stream: EnumProperty(
        name="Read COPC", default='AUTO',
        description="How linked COPC files are read",
        items=(
            ('AUTO', "Automatic", "As needed for files of 20 million points or more", 0),
            ('ON', "As Needed", "Read the points that a view shows. No conversion, analysis or stations", 1),
            ('OFF', "Whole", "Convert, analyze and cache the whole file", 2)))
    sequence: BoolProperty(
        name="Sequence", default=False,
        description="Import numbered files of the same folder as one object that shows one file per frame")
    every: IntProperty(
        name="Keep Every", default=1, min=1, soft_max=100,
        description="Keep one point of this many. 1 keeps all, 10 keeps a tenth")
    use_box: BoolProperty(name="Only Within a Box", default=False, description="Leave out points outside a box")
    box_min: FloatVectorProperty(name="From", subtype='XYZ', precision=3,
                                 description="Lower corner, in the file's own coordinates")
    box_max: FloatVectorProperty(name="To", subtype='XYZ', precision=3, default=(1.0, 1.0, 1.0),
                                 description="Upper corner, in the file's own coordinates")

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.prop(self, "origin")
        layout.prop(self, "unit")
        layout.prop(self, "scale")
        layout.prop(self, "up_axis")
        row = layout.row()
        row.active = not self.link
        row.prop(self, "kind")
        layout.prop(self, "frame")
        layout.prop(self, "stations")
        layout.prop(self, "link")
        column = layout.column()
        column.active = self.link
        column.prop(self, "stream")
        column.prop(self, "sequence")
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
            width = max(int(context.region.width / (7.5 * context.preferences.system.ui_scale)) - 4, 20)  # letters
            for line in lines:
                for part in textwrap.wrap(line, width) or [""]:
                    column.label(text=part)

    def execute(self, context: Context) -> set[str]:
        if any(path.is_dir() for path in self._paths()):  # of a dialog where none was chosen
            self._tell('ERROR', "choose a file: a folder alone was given")
            return {'CANCELLED'}
        self._progress = importers.Progress()
        return self.begin(context, self._link(context, self._paths()) if self.link else self._take(context))

    def _take(self, context: Context) -> jobs.Steps[set[str]]:
        """Imports what can be imported, and links saved clouds, for which there is no other way."""
        links, reads = ([path for path in self._paths() if saved.is_saved(path) == kind] for kind in (True, False))
        done = (yield from self._link(context, links)) if links else set()  # first: Esc ends what is read
        if reads:
            done |= yield from self._import(context, reads)
        return done - {'CANCELLED'} or done

    def _import(self, context: Context, paths: list[Path]) -> jobs.Steps[set[str]]:
        found = []
        cloud = self._wants_clouds(context)
        for index, path in enumerate(paths):
            try:
                points = yield from self._read(path, self._progress.part(index, len(paths)))
            except native.PatinaCancelled:
                return self._ended([data for data, *_ in found])
            if points:
                units = points.notes.get("units", METERS)
                found.append((made.to_data(points, cloud), points.origin, units, points.splats))
        if not found:
            return {'CANCELLED'}
        _select_none()
        for data, own, units, splats in found:
            obj = bpy.data.objects.new(data.name, data)
            point_data.spare_spheres(obj)
            self._add(context, obj, own, units)
            if splats:
                obj.patina.opacity_attribute, obj.patina.radius_attribute = "opacity", "radius"
            self._color(context, obj)
            if not splats and (said := (yield from level.note(obj, self._progress))):
                self.report({'INFO'}, told(f"Patina: {said}"))
        self._finish(context)
        count = sum(point_data.count_of(data) for data, *_ in found)
        self.report({'INFO'}, f"Imported {count:,} point{'s' * (count != 1)} from {len(found)} file{'s' * (len(found) > 1)}. "
                              + _told_next(context))
        return {'FINISHED'}

    def _wants_clouds(self, context: Context) -> bool:
        """Whether points become PointClouds."""
        if self.kind == 'POINTCLOUD' and not point_data.HAS_CLOUDS:
            self._tell('WARNING', "this Blender has no point clouds of its own: the points become a mesh. Blender 4.5 and later have them")
        wanted = self.kind != 'MESH' and point_data.HAS_CLOUDS
        return wanted and (point_data.RESIZES or context.mode == 'OBJECT')  # Blender's conversion works in Object Mode alone

    def _ended(self, found: list[bpy.types.ID]) -> set[str]:
        for data in found:
            (bpy.data.meshes if isinstance(data, bpy.types.Mesh) else bpy.data.pointclouds).remove(data)
        self.report({'INFO'}, "Patina: import canceled. Nothing was imported")
        return {'CANCELLED'}

    def _add(self, context: Context, obj: bpy.types.Object, own: origin.Origin, units: Sequence[float]) -> None:
        """Places the object, selected, in the scene. units: metres of the file's, across and up."""
        if self.unit != 'FILE':
            units = (origin.UNITS[self.unit],) * 2
        turn = None
        if (self.up_axis, self.scale, *units) != ('Z', 1.0, 1.0, 1.0):
            turn = origin.axes(self.up_axis, units[0] * self.scale, units[1] * self.scale)
        shared, away = None, 0.0
        if self.origin == 'SHARED':
            shared = origin.shared(context.scene, own, turn)
            away = origin.apart(context.scene, shared)
        warning = origin.place(obj, own, shared, turn)
        if away:
            warning = f"'{obj.name}' lies {away:,.1f} km from the points that are there: both are near zero"
        if warning:
            self._tell('WARNING', warning)
        context.collection.objects.link(obj)
        styles.dress(context.scene, obj)
        if self.stations:
            added = stations.add(obj, [context.collection])
            left = len(stations.missing(obj)) if added == stations.MOST else 0
            if left:
                self._tell('WARNING', f"'{obj.name}' has {added + left:,} stations; the first {added:,} have empties. Add Stations adds more")
        obj.select_set(True)
        context.view_layer.objects.active = obj

    def _color(self, context: Context, obj: bpy.types.Object, cloud: native.Cloud | None = None) -> None:
        """The first look of new points; with another engine, Set Up chooses it. cloud: of a linked file."""
        if context.engine == set_up.PatinaRenderEngine.bl_idname:
            if said := first_look.color_imported(obj, context.scene.frame_current, cloud):
                self.report({'INFO'}, told(f"Patina: {said}"))

    def _finish(self, context: Context) -> None:
        """Once the points are there, and selected."""
        if self.frame and bpy.ops.object.patina_frame_points.poll():
            bpy.ops.object.patina_frame_points()
        if self._invoked and set_up.untouched(context.scene):
            set_up.offer(context)

    def _tell(self, kind: str, text: str) -> None:
        self.report({kind}, told(f"Patina: {text}"))

    def _link(self, context: Context, paths: list[Path]) -> jobs.Steps[set[str]]:
        found: dict[Path, linked.Linked] = {}  # by the path or pattern that objects shall name
        for index, path in enumerate(paths):
            name, first = self._named(path)
            if name in found:
                continue
            try:
                spared = context.engine == set_up.PatinaRenderEngine.bl_idname and context.scene.patina.surface == 'RANGES'
                streamed = name == first and addresses.is_streamed(first, self.stream)
                source = linked.source(first, analyzed=name == first and not spared, streamed=streamed)  # of a sequence none is
                if source is None:
                    raise native.PatinaError("there is no such file")
                if not streamed:
                    importers.reader(first)
                found[name] = yield from linked.steps(source, self._progress.part(index, len(paths)))
                built.CACHE.keep_streamed(source, found[name].cloud)
            except native.PatinaCancelled:
                return self._ended([])
            except native.PatinaError as error:
                self._tell('ERROR', f"{first.name}: {error}")
        if not found:
            return {'CANCELLED'}
        _select_none()
        for path, item in found.items():
            name = told(name_of(path).replace("#", "").rstrip("_-. ") or path.stem if self.sequence and self.link else name_of(path))
            obj = bpy.data.objects.new(name, linked.box_mesh(name, item.box, item))
            files.assign(obj, files.as_preferred(path))
            obj.patina.sequence.start = context.scene.frame_start
            obj.patina.stream = self.stream
            self._add(context, obj, item.origin, item.units)
            if not self.sequence and not item.cloud.stream:
                self._color(context, obj, item.cloud)
        self._finish(context)
        count = sum(item.cloud.count for item in found.values())
        self.report({'INFO'}, f"Linked {count:,} point{'s' * (count != 1)}. {_told_next(context)}")
        return {'FINISHED'}

    def _named(self, path: Path) -> tuple[Path, Path]:
        """What an object names, and the file to read now: of a sequence its pattern and its first file."""
        pattern = sequence.pattern_of(path) if self.sequence and self.link else None
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
            self._tell('ERROR', text if path.name in text else f"{path.name}: {text}")
            return None
        for text in points.warnings:
            self._tell('WARNING', text)
        points, left_out = points.finite()
        if left_out:
            self._tell('WARNING', f"{path.name}: {left_out:,} point{'s' * (left_out != 1)} without a finite position left out")
        if not len(points.positions):
            left = "" if wanted.keeps_all() else " that the filters keep"
            self._tell('ERROR', f"{path.name} holds no points{left}")
            return None
        return points


def _select_none() -> None:
    if bpy.ops.object.select_all.poll():
        bpy.ops.object.select_all(action='DESELECT')


def _told_next(context: Context) -> str:
    """What to do with new points, where this engine's own buttons are there or not."""
    if context.engine == set_up.PatinaRenderEngine.bl_idname:
        return "In the sidebar, Patina > Frame Points aims the camera"
    return "In the sidebar, Patina > Set Up for Points renders them"


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
