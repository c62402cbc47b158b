# SPDX-License-Identifier: GPL-3.0-or-later
"""Orthographic plans to a stated scale: a camera that looks down, an image of the right size, a world file next to it. The dialog
asks for the sheet first. A render restores the scene."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty
from bpy.types import Context, Operator
from bpy_extras.io_utils import ExportHelper
from mathutils import Vector

from .. import point_data, whole
from ..description.drawings import LEAST_PIXELS, DrawingError, Frame
from ..draw.engine import PatinaRenderEngine
from ..sync.points import origin
from . import images_to_scale
from .images_to_scale import WORLD_FILES

INCH = 0.0254  # metres
SHEETS = {"A4": (0.210, 0.297), "A3": (0.297, 0.420), "A2": (0.420, 0.594), "A1": (0.594, 0.841), "A0": (0.841, 1.189),
          "LETTER": (0.2159, 0.2794), "TABLOID": (0.2794, 0.4318)}  # meters, upright
_STEPS = (1.0, 2.0, 2.5, 5.0)  # of scales, times powers of ten


def _dpi() -> FloatProperty:
    return FloatProperty(name="Dots per Inch", default=150.0, min=1.0, soft_max=1200.0, precision=0,
                         description="Resolution of the printer. Together with the scale it sets the size of a pixel")


def _margin() -> FloatProperty:
    return FloatProperty(name="Margin", default=0.02, min=0.0, max=1.0, subtype='FACTOR',
                         description="Margin around the points, as a share of the longer side")


class PATINA_OT_plan_sheet(Operator):
    """Choose the sheet for a plan of the selected points, then the file. The scale is the largest round one that fits the sheet"""

    bl_idname = "render.patina_plan_sheet"
    bl_label = "Render Plan to Scale"
    bl_options = {'INTERNAL'}

    sheet: EnumProperty(name="Sheet", default="A3", description="Sheet of paper that the plan must fit",
                        items=[(name, name.title(), f"{1000 * sides[0]:.0f} x {1000 * sides[1]:.0f} mm") for name, sides in SHEETS.items()])
    dpi: _dpi()
    margin: _margin()

    def invoke(self, context: Context, _event: bpy.types.Event) -> set[str]:
        if _box(context) is None:
            self.report({'ERROR'}, "Patina: select objects with points first")
            return {'CANCELLED'}
        return context.window_manager.invoke_props_dialog(self, width=360)

    def draw(self, context: Context) -> None:
        self.layout.use_property_split = True
        for name in ("sheet", "dpi", "margin"):
            self.layout.prop(self, name)
        box = _box(context)
        if box:
            scale = scale_for(box, SHEETS[self.sheet], self.margin, context.scene.unit_settings.scale_length)
            self.layout.label(text=f"Scale 1 : {scale:g}")
            self.layout.label(text=_size_text(context.scene, box, scale, self.dpi, self.margin))

    def execute(self, context: Context) -> set[str]:
        box = _box(context)
        if box is None:
            self.report({'ERROR'}, "Patina: select objects with points first")
            return {'CANCELLED'}
        scale = scale_for(box, SHEETS[self.sheet], self.margin, context.scene.unit_settings.scale_length)
        return bpy.ops.render.patina_plan('INVOKE_DEFAULT', scale=scale, dpi=self.dpi, margin=self.margin)


class PATINA_OT_render_plan(Operator, ExportHelper):
    """Render the selected points from above at a fixed scale, with a world file next to the image"""

    bl_idname = "render.patina_plan"
    bl_label = "Render Plan"
    bl_options = {'UNDO'}

    filename_ext = ".png"
    filter_glob: StringProperty(default="*.png;*.tif;*.tiff", options={'HIDDEN'})
    check_extension = None  # PNG or TIFF, as the name says
    scale: FloatProperty(name="Scale 1 :", default=100.0, min=1e-3, soft_max=10000.0, precision=1,
                         description="Meters in the scene per meter on paper")
    dpi: _dpi()
    margin: _margin()
    write_picture: BoolProperty(name="Render", default=True,
                                description="Render now, and restore the camera and the resolution afterwards. Disabled: only set them")

    def draw(self, context: Context) -> None:
        for name in ("scale", "dpi", "margin", "write_picture"):
            self.layout.prop(self, name)
        box = _box(context)
        if box:
            self.layout.label(text=_size_text(context.scene, box, self.scale, self.dpi, self.margin))

    def execute(self, context: Context) -> set[str]:
        scene = context.scene
        path = Path(bpy.path.abspath(self.filepath))
        if path.suffix.lower() not in WORLD_FILES:
            path = path.with_name(path.name + ".png")
        target = path.with_suffix(WORLD_FILES[path.suffix.lower()])
        box = _box(context)
        if box is None:
            self.report({'ERROR'}, "Patina: select objects with points first")
            return {'CANCELLED'}
        try:
            frame = frame_of(box, _pixel(scene, self.scale, self.dpi), self.margin)
            width, height = frame.size()
            if self.write_picture:
                with images_to_scale.camera_for(scene, frame, width, height):
                    if not images_to_scale.write(scene, path):
                        return {'CANCELLED'}
                done = "The scene's camera and resolution are unchanged"
            else:
                camera = _camera(scene)
                images_to_scale.set_up(scene, camera, frame, width, height)
                done = f"The scene now uses the camera '{camera.name}' and this resolution"
            whole.write(target, images_to_scale.world_file(frame, width, height, *_survey(context)).encode("ascii"))
        except DrawingError as error:
            self.report({'ERROR'}, f"Patina: {error}")
            return {'CANCELLED'}
        except OSError as error:
            self.report({'ERROR'}, f"Patina: {target.name} cannot be written: {error.strerror}")
            return {'CANCELLED'}
        self.report({'INFO'}, f"{width:,} x {height:,} pixels of {frame.side:.6g} units; world file {target.name}. {done}")
        return {'FINISHED'}


def _camera(scene: bpy.types.Scene) -> bpy.types.Object:
    """The camera "Plan" of the scene, or a new one."""
    known = bpy.data.objects.get("Plan")
    if known and known.type == 'CAMERA' and known.name in scene.objects:
        return known
    camera = bpy.data.objects.new("Plan", bpy.data.cameras.new("Plan"))
    scene.collection.objects.link(camera)
    return camera


def _pixel(scene: bpy.types.Scene, scale: float, dpi: float) -> float:
    """Side of a pixel in scene units."""
    return scale * INCH / dpi / scene.unit_settings.scale_length


def scale_for(box: tuple[np.ndarray, np.ndarray], sheet: tuple[float, float], margin: float, unit: float) -> float:
    """The smallest N of the round scales 1 : N at which the plan fits the sheet, upright or across. unit: meters per scene unit."""
    extent = (box[1] - box[0])[:2]
    room = np.sort(extent + 2.0 * margin * extent.max()) * unit
    needed = max(float((room / np.sort(sheet)).max()), 1e-3)
    power = 10.0 ** np.floor(np.log10(needed))
    return float(next(step * power for step in (*_STEPS, 10.0) if step * power >= needed * (1.0 - 1e-9)))


def _size_text(scene: bpy.types.Scene, box: tuple[np.ndarray, np.ndarray], scale: float, dpi: float, margin: float) -> str:
    """The size of the image in pixels, and of the file in megabytes before compression."""
    try:
        width, height = frame_of(box, _pixel(scene, scale, dpi), margin).size()
    except DrawingError as error:
        return str(error)
    settings = scene.render.image_settings
    size = width * height * 4 * (2 if settings.color_depth in {'16', '32'} else 1)
    return f"{width:,} x {height:,} pixels, at most {size / 1e6:,.1f} MB"


def _survey(context: Context) -> tuple[np.ndarray, float]:
    """Where in the world Blender's zero is to the selected points, in metres, and how many of them a unit of their survey is."""
    scanned = next((obj for obj in context.selected_objects if origin.PROPERTY in obj), None)
    if scanned is None:
        return np.array(context.scene.get(origin.PROPERTY, origin.ZERO), np.float64), 1.0
    return origin.shared_of(scanned, context.scene), float(np.linalg.norm(origin.axes_of(scanned)[:, 0]))


def _box(context: Context) -> tuple[np.ndarray, np.ndarray] | None:
    """Lower and upper corner of the selected objects with points, in Blender's coordinates."""
    depsgraph = context.evaluated_depsgraph_get()
    corners = [obj.matrix_world @ Vector(corner) for obj in context.view_layer.objects
               if obj.select_get() and point_data.may_have_points(obj)
               for corner in point_data.corners(obj.evaluated_get(depsgraph))]
    if not corners:
        return None
    table = np.array(corners, np.float64)
    return table.min(axis=0), table.max(axis=0)


def frame_of(box: tuple[np.ndarray, np.ndarray], pixel: float, margin: float) -> Frame:
    """The plan of a box from above, whose extent is whole pixels. Its plane is above the box."""
    sides = (box[1] - box[0])[:2]
    sides = np.maximum(np.ceil((sides + 2.0 * margin * sides.max()) / pixel - 1e-3), LEAST_PIXELS) * pixel
    middle, depth = 0.5 * (box[0] + box[1]), float(box[1][2] - box[0][2])
    room = max(0.01 * depth, 10.0 * pixel)
    return Frame(np.array((middle[0], middle[1], box[1][2] + room)), np.array((1.0, 0.0, 0.0)), np.array((0.0, 1.0, 0.0)), float(sides[0]), float(sides[1]),
                 front=0.0, back=depth + 2.0 * room, scale=1.0, pixel=pixel)


def _menu(self: bpy.types.Menu, context: Context) -> None:
    if context.engine == PatinaRenderEngine.bl_idname:
        self.layout.operator(PATINA_OT_plan_sheet.bl_idname, text="Render Plan to Scale...")


def register() -> None:
    bpy.utils.register_class(PATINA_OT_plan_sheet)
    bpy.utils.register_class(PATINA_OT_render_plan)
    bpy.types.TOPBAR_MT_render.append(_menu)


def unregister() -> None:
    bpy.types.TOPBAR_MT_render.remove(_menu)
    bpy.utils.unregister_class(PATINA_OT_render_plan)
    bpy.utils.unregister_class(PATINA_OT_plan_sheet)
