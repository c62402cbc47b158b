# SPDX-License-Identifier: GPL-3.0-or-later
"""Export of survey drawings: images by the engine, cut lines as DXF, SVG and curves; one, or all of the scene."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty
from bpy.types import Context, Event, Object, Operator

from .. import native, sync, whole
from ..description.drawings import DrawingError
from ..draw import drawings as drawn
from ..sync import drawings
from ..sync.points import origin
from . import images_to_scale, polls
from .drawings import _OfOne
from .export_dialog import ExportDialog
from .picking import Reports

FORMATS = ('PNG', 'DXF', 'SVG')
_FAILURES = (DrawingError, native.PatinaError, sync.CameraError)


def _flat() -> BoolProperty:
    return BoolProperty(name="Flat", default=False, description="DXF in millimeters of the sheet. Disabled: in meters, at the true place in the world")


class _Exports(Reports):
    """Beside bpy.types.Operator."""

    def write(self, context: Context, obj: Object, path: Path, flat: bool) -> str:
        """Writes one file. Returns what it holds. One of _FAILURES, OSError."""
        scene, frame = context.scene, drawings.frame_of(obj, context.scene)
        if path.suffix.lower() == ".png":
            return self._write_image(scene, frame, path)
        context.view_layer.update()
        with drawn.cut_lines(context.evaluated_depsgraph_get(), frame, origin.zero_of(scene), obj.name_full, lambda what, share: False) as drawing:
            drawing.write(path, flat)
            info = drawing.info()
        return f"{path.name}: cut lines of {info['cut']:.4g} m, bridged {info['bridged']:.4g} m"

    @staticmethod
    def _write_image(scene: bpy.types.Scene, frame: drawings.Frame, path: Path) -> str:
        width, height = drawn.check_room(frame)
        with images_to_scale.camera_for(scene, frame, width, height):
            if not images_to_scale.write(scene, path):
                raise DrawingError("the render was canceled. No image was written")
        if images_to_scale.is_level(frame):
            target = path.with_suffix(".pgw")
            whole.write(target, images_to_scale.world_file(frame, width, height, origin.zero_of(scene)).encode("ascii"))
        return f"{path.name}: {width:,} x {height:,} pixels"


class PATINA_OT_export_drawing(_OfOne, _Exports, ExportDialog, Operator):
    """Export a survey drawing as an image (.png), or its cut lines for CAD (.dxf) and graphics programs (.svg)"""

    bl_idname = "export_scene.patina_drawing"
    bl_label = "Export Drawing"
    bl_options = {'PRESET'}

    kind: EnumProperty(name="Format", default='PNG', items=(
        ('PNG', "PNG", "Image to scale, with the scene's render settings", 0),
        ('DXF', "DXF", "Cut lines of release 2018, at the true place in the world", 1),
        ('SVG', "SVG", "Cut lines in millimeters of the sheet", 2)))
    flat: _flat()
    filter_glob: StringProperty(default="*.png;*.dxf;*.svg", options={'HIDDEN'})

    @classmethod
    def poll(cls, context: Context) -> bool:
        return polls.allowed(cls, "" if drawings.of_scene(context.view_layer) else "the scene has no drawing")

    def invoke(self, context: Context, event: Event) -> set[str]:
        try:
            drawings.frame_of(self.chosen(context), context.scene)
        except DrawingError as error:
            return self.refused(str(error))
        return super().invoke(context, event)

    def kind_of(self, path: Path) -> str:
        named = path.suffix[1:].upper()
        return named if named in FORMATS else ""

    def execute(self, context: Context) -> set[str]:
        path = Path(bpy.path.abspath(self.filepath))
        if not path.suffix:
            path = path.with_suffix(f".{self.kind.lower()}")
        try:
            if not self.kind_of(path):
                raise DrawingError(f"'{path.name}': drawings are exported as .png, .dxf or .svg")
            if path.exists() and not self.overwrite:
                raise DrawingError(f"'{path}' exists. Choose another name, or set overwrite=True")
            self.report({'INFO'}, self.write(context, self.chosen(context), path, self.flat))
        except _FAILURES as error:
            return self.refused(str(error))
        except OSError as error:
            return self.refused(f"{path.name} cannot be written: {error.strerror}")
        return {'FINISHED'}


class PATINA_OT_drawing_to_curves(_OfOne, Operator):
    """Add the cut lines of this drawing to the scene as curves, one object for each layer"""

    bl_idname = "object.patina_drawing_to_curves"
    bl_label = "Cut Lines to Curves"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return polls.allowed(cls, "" if drawings.of_scene(context.view_layer) else "the scene has no drawing")

    def execute(self, context: Context) -> set[str]:
        scene = context.scene
        try:
            obj = self.chosen(context)
            frame = drawings.frame_of(obj, scene)
            with drawn.cut_lines(context.evaluated_depsgraph_get(), frame, origin.zero_of(scene), obj.name_full, lambda what, share: False) as drawing:
                lines = drawing.lines()
            if not lines:
                raise DrawingError("all cut lines are shorter than 0.5 mm on paper. Use a larger scale or extent")
            added = drawings.add_curves(context, obj.name, frame, lines)
        except _FAILURES as error:
            return self.refused(str(error))
        self.report({'INFO'}, f"Added {', '.join(curve.name for curve in added)}")
        return {'FINISHED'}


class PATINA_OT_export_drawings(_Exports, Operator):
    """Export all survey drawings of the scene to a folder. Each file is named after its drawing"""

    bl_idname = "export_scene.patina_drawings"
    bl_label = "Export All Drawings"

    directory: StringProperty(name="Folder", subtype='DIR_PATH', description="Folder that the files are written to")
    filter_folder: BoolProperty(default=True, options={'HIDDEN'})
    image: BoolProperty(name="PNG", default=True, description="Write an image of each drawing")
    dxf: BoolProperty(name="DXF", default=True, description="Write the cut lines of each drawing for CAD programs")
    svg: BoolProperty(name="SVG", default=False, description="Write the cut lines of each drawing for graphics programs")
    flat: _flat()
    overwrite: BoolProperty(name="Overwrite", default=False, description="Replace files of the same names")

    @classmethod
    def poll(cls, context: Context) -> bool:
        return polls.allowed(cls, "" if drawings.of_scene(context.view_layer) else "the scene has no drawing")

    def invoke(self, context: Context, _event: Event) -> set[str]:
        context.window_manager.fileselect_add(self)
        return {'RUNNING_MODAL'}

    def execute(self, context: Context) -> set[str]:
        folder = Path(bpy.path.abspath(self.directory))
        endings = [ending for ending, wanted in ((".png", self.image), (".dxf", self.dxf), (".svg", self.svg)) if wanted]
        found = drawings.of_scene(context.view_layer)
        if not endings or not folder.is_dir():
            return self.refused("no format is chosen" if not endings else f"there is no folder '{folder}'")
        files = {folder / f"{bpy.path.clean_name(obj.name)}{ending}": obj for obj in found for ending in endings}
        there = [path.name for path in files if path.exists()]
        if there and not self.overwrite:
            return self.refused(f"{', '.join(there[:5])}{' and others' * (len(there) > 5)} exist. Choose another folder, or enable Overwrite")
        failed = []
        for path, obj in files.items():
            try:
                self.write(context, obj, path, self.flat)
            except (*_FAILURES, OSError) as error:
                failed.append(f"{path.name}: {error}")
        for text in failed:
            self.report({'WARNING'}, f"Patina: {text}")
        self.report({'INFO'}, f"Exported {len(files) - len(failed)} of {len(files)} files to {folder}")
        return {'FINISHED'} if len(failed) < len(files) else {'CANCELLED'}


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_export_drawing, PATINA_OT_drawing_to_curves, PATINA_OT_export_drawings))
