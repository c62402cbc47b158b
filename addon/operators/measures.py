# SPDX-License-Identifier: GPL-3.0-or-later
"""Measurements in the list: remove, frame, copy, export."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty
from bpy.types import Context, Object, Operator
from mathutils import Vector

from ..description.measures import MeasureError
from ..properties.measures import redraw
from ..sync import measures
from ..write import measures as files
from ..write.exporters import ExportError
from .export_dialog import ExportDialog

CLOSE = 1.4  # of its extent, how far a view is from what it frames


class _OfOne:
    """Beside bpy.types.Operator: of one measurement of an object."""

    bl_options = {'REGISTER', 'UNDO', 'INTERNAL'}

    owner: StringProperty(options={'HIDDEN', 'SKIP_SAVE'})  # name of the object; "": the active one
    index: IntProperty(default=-1, options={'HIDDEN', 'SKIP_SAVE'})  # -1: the active one

    def _chosen(self, context: Context) -> tuple[Object, int]:
        """MeasureError."""
        obj = context.view_layer.objects.get(self.owner) if self.owner else context.object
        if obj is None:
            raise MeasureError(f"There is no object '{self.owner}'" if self.owner else "No object is active")
        group = obj.patina.measures
        index = group.active if self.index < 0 else self.index
        if not 0 <= index < len(group.entries):
            raise MeasureError(f"'{obj.name}' has no measurement to choose")
        return obj, index

    def execute(self, context: Context) -> set[str]:
        try:
            return self._run(context, *self._chosen(context))
        except MeasureError as error:
            self.report({'ERROR'}, f"Patina: {error}")
            return {'CANCELLED'}


class PATINA_OT_remove_measurement(_OfOne, Operator):
    """Delete this measurement"""

    bl_idname = "object.patina_remove_measurement"
    bl_label = "Delete Measurement"

    def _run(self, context: Context, obj: Object, index: int) -> set[str]:
        if obj.library is not None:
            raise MeasureError(f"'{obj.name}' belongs to another file")
        group = obj.patina.measures
        group.entries.remove(index)
        group.active = max(min(group.active, len(group.entries) - 1), 0)
        redraw(None, context)
        return {'FINISHED'}


class PATINA_OT_copy_measurement(_OfOne, Operator):
    """Copy the value of this measurement with its unit, or the coordinates of a point"""

    bl_idname = "object.patina_copy_measurement"
    bl_label = "Copy Value"
    bl_options = {'INTERNAL'}

    def _run(self, context: Context, obj: Object, index: int) -> set[str]:
        text = measures.value_text(measures.read(obj, index), context.scene)
        context.window_manager.clipboard = text
        self.report({'INFO'}, f"Copied {text}")
        return {'FINISHED'}


class PATINA_OT_frame_measurement(_OfOne, Operator):
    """Move the view to this measurement"""

    bl_idname = "object.patina_frame_measurement"
    bl_label = "Frame"
    bl_options = {'INTERNAL'}

    def _run(self, context: Context, obj: Object, index: int) -> set[str]:
        points = measures.read(obj, index).points
        space = context.space_data if context.space_data and context.space_data.type == 'VIEW_3D' else next(
            (area.spaces.active for area in (context.screen.areas if context.screen else ()) if area.type == 'VIEW_3D'), None)
        if space is None:
            raise MeasureError("Framing needs a 3D viewport, and the window has none")
        view = space.region_3d
        if view.view_perspective == 'CAMERA':
            view.view_perspective = 'PERSP'
        extent = float(np.linalg.norm(np.ptp(points, axis=0)))
        view.view_location = Vector(0.5 * (points.min(axis=0) + points.max(axis=0)))
        if extent > 0.0:
            view.view_distance = CLOSE * extent * space.lens / 36.0
        redraw(None, context)
        return {'FINISHED'}


class PATINA_OT_export_measurements(Operator, ExportDialog):
    """Export measurements as a table (.csv) or as a drawing (.dxf)"""

    bl_idname = "export_scene.patina_measurements"
    bl_label = "Export Measurements"
    bl_options = {'PRESET'}

    kind: EnumProperty(name="Format", default='CSV', items=(
        ('CSV', "CSV", "Table with a row for each measurement, and coordinates in full precision", 0),
        ('DXF', "DXF", "Drawing of release 2018 with lines and values on the layer measure. Needs the package ezdxf", 1)))
    space: EnumProperty(name="Drawing", default='FILE', description="Coordinates of the drawing. A table has both", items=(
        ('FILE', "File", "Coordinates of the file that each object came from", 0),
        ('SCENE', "Scene", "Blender's coordinates", 1)))
    selected: BoolProperty(name="Selected Only", default=False, description="Export only measurements of the selected objects")
    filter_glob: StringProperty(default="*.csv;*.dxf", options={'HIDDEN'})

    def kind_of(self, path: Path) -> str:
        named = path.suffix[1:].upper()
        return named if named in files.FORMATS else ""

    def execute(self, context: Context) -> set[str]:
        try:
            path = self._path()
            found, damaged = self._measurements(context)
            files.write(path, [measures.exported(one, context.scene, self.space == 'FILE') for one in found])
        except (ExportError, MeasureError) as error:
            self.report({'ERROR'}, f"Patina: {error}")
            return {'CANCELLED'}
        except OSError as error:
            self.report({'ERROR'}, f"Patina: {path.name} cannot be written: {error.strerror}")
            return {'CANCELLED'}
        if damaged:
            self.report({'WARNING'}, f"Patina: left out: {'; '.join(damaged)}")
        self.report({'INFO'}, f"Exported {len(found)} measurement{'s' * (len(found) != 1)} to {path.name}")
        return {'FINISHED'}

    def _path(self) -> Path:
        """ExportError if name and format disagree, or if the file exists and must stay."""
        path = Path(bpy.path.abspath(self.filepath))
        named = path.suffix[1:].upper()
        if not named:
            path = path.with_suffix(f".{self.kind.lower()}")
        elif named not in files.FORMATS:
            raise ExportError(f"'{path.name}': measurements cannot be written as .{named.lower()}. Use .csv or .dxf")
        elif self.properties.is_property_set("kind") and named != self.kind:
            raise ExportError(f"'{path.name}' does not fit the format {self.kind}. Name the file .{self.kind.lower()}, or leave the format out")
        if path.exists() and not self.overwrite:
            raise ExportError(f"'{path}' exists. Choose another name, or set overwrite=True")
        return path

    def _measurements(self, context: Context) -> tuple[list[measures.Found], list[str]]:
        """Hidden ones too, and what is wrong with others. MeasureError if there are none."""
        found, damaged = [], []
        for obj in measures.measured(context.view_layer.objects):
            for index in range(len(obj.patina.measures.entries)) if obj.select_get() or not self.selected else ():
                try:
                    found.append(measures.read(obj, index))
                except MeasureError as error:
                    damaged.append(str(error))
        if not found:
            raise MeasureError(damaged[0] if damaged else "No selected object has measurements" if self.selected else "The scene has no measurements")
        return found, damaged


def _menu(self: bpy.types.Menu, _context: Context) -> None:
    self.layout.operator(PATINA_OT_export_measurements.bl_idname, text="Point Cloud Measurements (.csv/.dxf)")


_register, _unregister = bpy.utils.register_classes_factory(
    (PATINA_OT_remove_measurement, PATINA_OT_copy_measurement, PATINA_OT_frame_measurement, PATINA_OT_export_measurements))


def register() -> None:
    _register()
    bpy.types.TOPBAR_MT_file_export.append(_menu)


def unregister() -> None:
    bpy.types.TOPBAR_MT_file_export.remove(_menu)
    _unregister()
