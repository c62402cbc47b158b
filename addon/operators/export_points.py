# SPDX-License-Identifier: GPL-3.0-or-later
"""File > Export > Point Cloud: PLY, LAS, LAZ, COPC and E57, in the coordinates that the points came from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, StringProperty
from bpy.types import Context, Operator

from .. import jobs, native, point_data
from ..read import importers
from ..read.importers import scans
from ..sync.analyses import analysis, trust
from ..sync.analyses.analyzing import ANALYSES
from ..sync.points import attributes, edits, linked, origin
from ..write import exporters
from .export_dialog import ExportDialog


class PATINA_OT_export_points(Operator, ExportDialog):
    """Export the points of mesh and point cloud objects with colors, normals and scalars, in the file's original coordinates"""

    bl_idname = "export_scene.patina_points"
    bl_label = "Export Points"
    bl_options = {'PRESET'}

    kind: EnumProperty(
        name="Format", default='PLY',
        items=(('PLY', "PLY", "Binary, with all scalars and float64 positions", 0),
               ('LAS', "LAS", "LAS 1.2, point format 3, with the scalars that LAS can store", 1),
               ('LAZ', "LAZ", "LAS 1.2, compressed. Needs the packages laspy and lazrs", 2),
               ('E57', "E57", "One scan in the file per scan, with colors and intensity. Needs the package pye57", 3),
               ('COPC', "COPC", "LAZ 1.4 as an octree, which programs and browsers read as needed. Needs the package lazrs", 4)))
    selected: BoolProperty(name="Selected Only", default=True, description="Export only the selected objects")
    trusted: BoolProperty(name="Trusted Only", default=False,
                          description="Leave out the untrusted points, as Trust does. At 0, leave out those that the automatic threshold would. "
                                      "Points without an analysis are analyzed first")
    filter_glob: StringProperty(default=";".join(f"*.{name}" for name in exporters.NEEDS), options={'HIDDEN'})

    def kind_of(self, path: Path) -> str:
        try:
            extension = exporters.extension_of(path)
        except exporters.ExportError:
            return ""
        return 'COPC' if extension == "copc.laz" else extension.upper()

    def ending_of(self, kind: str) -> str:
        return "copc.laz" if kind == 'COPC' else kind.lower()

    def execute(self, context: Context) -> set[str]:
        try:
            path = self._path()
        except exporters.ExportError as error:
            self.report({'ERROR'}, f"Patina: {error}")
            return {'CANCELLED'}
        objects, solid = self._objects(context)
        parts, untrusted = [], 0
        try:
            for obj in objects:
                keep = self._trusted(obj, context.scene) if self.trusted else None
                untrusted += 0 if keep is None else int((~keep).sum())
                parts.append(_of_object(obj, context.scene, keep))
        except native.PatinaError as error:
            self.report({'ERROR'}, importers.told(f"Patina: {error}"))
            return {'CANCELLED'}
        points = _join(list(filter(None, parts)))
        if points is None:
            self.report({'ERROR'}, "Patina: no selected object has points" if self.selected
                        else "Patina: no visible object has points")
            return {'CANCELLED'}
        try:
            left = exporters.write(path, points, _gps_start(objects))
        except OSError as error:
            self.report({'ERROR'}, f"Patina: {path.name} cannot be written: {error.strerror}")
            return {'CANCELLED'}
        except exporters.ExportError as error:
            self.report({'ERROR'}, f"Patina: {error}")
            return {'CANCELLED'}
        if left:
            self.report({'WARNING'}, f"{path.suffix[1:].upper()} has no place for {', '.join(left)}")
        out = [f"{untrusted:,} untrusted points"] * self.trusted + [f"{solid} mesh{'es' * (solid > 1)} with faces"] * bool(solid)
        self.report({'INFO'}, f"Exported {len(points.positions):,} points to {path.name}{'. Left out: ' * bool(out)}{', '.join(out)}")
        return {'FINISHED'}

    def _trusted(self, obj: bpy.types.Object, scene: bpy.types.Scene) -> np.ndarray:
        """(n,) bool, of all points of an evaluated object, or of its file. PatinaError where the trust is not known."""
        try:
            cloud, least = trust.analyzed_cloud(obj, scene), trust.least_of(obj.patina)
        except native.PatinaError as error:
            raise native.PatinaError(f"'{obj.name}': {error}", error.code) from None
        if trust.none_is_trusted(cloud, least):
            self.report({'WARNING'}, f"Patina: '{obj.name}': no point is trusted, so all of them are exported")
        with ANALYSES.drawing():
            return ~trust.untrusted(cloud, least)

    def _path(self) -> Path:
        """The file to write. ExportError if name and format disagree, or if the file exists and must stay."""
        path = Path(bpy.path.abspath(self.filepath))
        named, ending = exporters.extension_of(path), self.ending_of(self.kind)
        if not named:
            path = path.with_name(f"{path.name}.{ending}")
        elif self.properties.is_property_set("kind") and named != ending:
            raise exporters.ExportError(f"'{path.name}' does not fit the format {self.kind}. Name the file .{ending}, or leave the format out")
        if path.exists() and not self.overwrite:
            raise exporters.ExportError(f"'{path}' exists. Choose another name, or set overwrite=True")
        return path

    def _objects(self, context: Context) -> tuple[list[bpy.types.Object], int]:
        """Evaluated, and how many were left out: faces' corners are no scan, unless there is nothing else."""
        depsgraph = context.evaluated_depsgraph_get()
        found = [obj.evaluated_get(depsgraph) for obj in context.view_layer.objects
                 if point_data.may_have_points(obj) and obj.visible_get() and (obj.select_get() or not self.selected)]
        points = [obj for obj in found if point_data.is_cloud(obj)]
        return (points, len(found) - len(points)) if points else (found, 0)


def _gps_start(objects: list[bpy.types.Object]) -> float:
    return next((obj.original.data["patina_gps_time_start"] for obj in objects
                 if "patina_gps_time_start" in obj.original.data), 0.0)


def read_local(obj: bpy.types.Object) -> exporters.Points | None:
    """An evaluated object's points in its own space, its origin added."""
    data = obj.data
    count = point_data.count_of(data)
    local = attributes.positions(data, count) if count else None
    if local is None:
        return None
    own = np.array(obj.original.get(origin.PROPERTY, origin.ZERO), np.float64)
    told = obj.original.data
    return exporters.Points(local.astype(np.float64) + own, attributes.normals(data, count, obj.patina.normal_attribute),
                            _bytes(attributes.colors(data, count, obj.patina.color_attribute)), _scalars(data, count),
                            **_scans(told.get(scans.PROPERTY), told.get(analysis.SCANNERS), np.eye(3), own, own))


def _scans(told: object, stations: Sequence[float] | None, turn: np.ndarray, move: np.ndarray, own: np.ndarray) -> dict[str, Any]:
    """Fields of exporters.Points, of what an object tells of its scans, moved as its points are: turn (3, 3), and to where its zero comes;
    own: where that lies in the file that it was read from."""
    found = []
    for scan in scans.unpacked(told):
        pose = np.array(scan.pose).reshape(3, 4)
        placed = np.column_stack([turn @ pose[:, :3], turn @ (pose[:, 3] - own) + move])
        direction = turn @ np.array(scan.direction)
        length = np.linalg.norm(direction)
        found.append(replace(scan, direction=tuple((direction / length).tolist()) if length else scans.UNKNOWN, pose=tuple(placed.ravel().tolist())))
    places = None if stations is None else np.array(stations, np.float64).reshape(-1, 3) @ turn.T + move
    return {"scans": found, "stations": places}


def _bytes(colors: np.ndarray | None) -> np.ndarray | None:
    """(n, 3) sRGB bytes of byte or linear colours."""
    if colors is None or colors.dtype == np.uint8:
        return None if colors is None else colors[:, :3]
    c = np.clip(colors[:, :3], 0.0, 1.0)
    return np.rint(np.where(c <= 0.0031308, c * 12.92, 1.055 * c ** (1 / 2.4) - 0.055) * 255).astype(np.uint8)


def _of_object(obj: bpy.types.Object, scene: bpy.types.Scene, keep: np.ndarray | None = None) -> exporters.Points | None:
    """keep: (n,) bool, of all points that the object or its file has; None: all."""
    if obj.patina.linked_file:
        return _of_linked(obj, scene, keep)
    with attributes.readable(obj) as data:
        found = _read(obj, data, scene)
    return found if found is None or keep is None else exporters.only(found, keep)


def read_linked(obj: bpy.types.Object, frame: int, notices: list[str], keep: np.ndarray | None = None) -> importers.PointFile | None:
    """The file that an object links, without the points that were deleted, and those that keep leaves out. None, with a notice, where it
    is missing."""
    source = linked.source_of(obj, frame, notices)
    if source is None:
        return None
    module = importers.reader(source.path)
    points = jobs.run(lambda: module.read(source.path, importers.Filter(), importers.Progress()), lambda: None, lambda: False)
    try:
        edited = edits.for_cloud(edits.packed_of(obj), len(points.positions))
    except edits.Damaged as damaged:
        notices.append(f"'{obj.name}': {damaged}")
        edited = None
    if edited and edited.totals["deleted"]:
        left = ~edits.flags(edited.deleted, edited.count)
        keep = left if keep is None else left & keep
    return points if keep is None else points.only(keep)


def _of_linked(obj: bpy.types.Object, scene: bpy.types.Scene, keep: np.ndarray | None) -> exporters.Points:
    notices: list[str] = []
    points = read_linked(obj, scene.frame_current, notices, keep)
    if points is None:
        raise native.PatinaError(notices[0] if notices else f"'{obj.name}': the file is missing")
    own = np.array(obj.original.get(origin.PROPERTY, points.origin), np.float64)
    turn, move = origin.to_file(obj, scene)
    normals = points.normals if points.normals is None else _turned(points.normals, turn)
    return exporters.Points((points.positions + (np.array(points.origin) - own)) @ turn.T + move, normals, _bytes(points.colors),
                            {name: values.astype(np.float32) for name, values in points.scalars.items()},
                            str(points.notes.get("crs", "")),
                            **_scans(points.notes.get(scans.NOTE), points.notes.get("scanners"), turn,
                                     turn @ (np.array(points.origin) - own) + move, np.array(points.origin)))


def _turned(normals: np.ndarray, turn: np.ndarray) -> np.ndarray:
    return normals @ np.linalg.inv(turn) if np.linalg.det(turn) else normals


def _read(obj: bpy.types.Object, data: bpy.types.ID, scene: bpy.types.Scene) -> exporters.Points | None:
    count = point_data.count_of(data)
    local = attributes.positions(data, count) if count else None
    if local is None:
        return None
    turn, move = origin.to_file(obj, scene)
    positions = local.astype(np.float64) @ turn.T + move
    normals = attributes.normals(data, count, obj.patina.normal_attribute)
    colors = attributes.colors(data, count, obj.patina.color_attribute)
    if normals is not None:
        normals = _turned(normals, turn)
    return exporters.Points(positions, normals, _bytes(colors), _scalars(data, count),
                            str(obj.original.data.get("patina_crs", "")), **_scans(
                                obj.original.data.get(scans.PROPERTY), obj.original.data.get(analysis.SCANNERS), turn, move,
                                np.array(obj.original.get(origin.PROPERTY, origin.ZERO), np.float64)))


def _scalars(data: bpy.types.ID, count: int) -> dict[str, np.ndarray]:
    found = {}
    shown_only = {point_data.RADIUS} if point_data.are_for_display(data) else ()
    for attribute in data.attributes:
        if attribute.data_type in {'FLOAT', 'INT', 'INT8'} and not attribute.name.startswith(".") and attribute.name not in shown_only:
            values = attributes.scalars(data, count, attribute.name)
            if values is not None:
                found[attribute.name] = values[:, 0]
    return found


def _join(parts: list[exporters.Points]) -> exporters.Points | None:
    """One set of columns; what a part lacks is 0."""
    if len(parts) < 2:
        return parts[0] if parts else None

    def column(values: list[np.ndarray | None], width: tuple[int, ...]) -> np.ndarray | None:
        if all(value is None for value in values):
            return None
        kind = next(value.dtype for value in values if value is not None)
        return np.concatenate([np.zeros((len(part.positions), *width), kind) if value is None else value
                               for part, value in zip(parts, values, strict=True)])

    names = {name: None for part in parts for name in part.scalars}
    return exporters.Points(
        np.concatenate([part.positions for part in parts]), column([part.normals for part in parts], (3,)),
        column([part.colors for part in parts], (3,)),
        {name: column([part.scalars.get(name) for part in parts], ()) for name in names},
        next((part.crs for part in parts if part.crs), ""))


def _menu(self: bpy.types.Menu, _context: Context) -> None:
    self.layout.operator(PATINA_OT_export_points.bl_idname, text="Point Cloud (.ply/.las/.laz/.copc.laz/.e57)")


def register() -> None:
    bpy.utils.register_class(PATINA_OT_export_points)
    bpy.types.TOPBAR_MT_file_export.append(_menu)


def unregister() -> None:
    bpy.types.TOPBAR_MT_file_export.remove(_menu)
    bpy.utils.unregister_class(PATINA_OT_export_points)
