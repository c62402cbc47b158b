# SPDX-License-Identifier: GPL-3.0-or-later
"""Orthographic plans to a stated scale: a camera that looks down, a picture of the right size, a world file beside it."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
from bpy.props import BoolProperty, FloatProperty, StringProperty
from bpy.types import Context, Operator
from bpy_extras.io_utils import ExportHelper
from mathutils import Matrix, Vector

from .. import point_data
from ..draw.engine import PatinaRenderEngine
from ..sync.points import origin

INCH = 0.0254  # metres
MOST = 65536  # pixels a side, of the library and of Blender
WORLD_FILES = {".png": ".pgw", ".tif": ".tfw", ".tiff": ".tfw", ".jpg": ".jgw", ".jpeg": ".jgw"}


class PATINA_OT_render_plan(Operator, ExportHelper):
    """Render the selected points from above at a fixed scale, with a world file next to the image"""

    bl_idname = "render.patina_plan"
    bl_label = "Render Plan"
    bl_options = {'REGISTER'}

    filename_ext = ".png"
    filter_glob: StringProperty(default="*.png;*.tif;*.tiff", options={'HIDDEN'})
    check_extension = None  # PNG or TIFF, as the name says
    scale: FloatProperty(name="Scale 1 :", default=100.0, min=1e-3, soft_max=10000.0, precision=1,
                         description="Meters in the scene per meter on paper")
    dpi: FloatProperty(name="Dots per Inch", default=300.0, min=1.0, soft_max=1200.0, precision=0,
                       description="Resolution of the printer. Together with the scale it sets the size of a pixel")
    margin: FloatProperty(name="Margin", default=0.02, min=0.0, max=1.0, subtype='FACTOR',
                          description="Margin around the points, as a share of the longer side")
    write_picture: BoolProperty(name="Render", default=True,
                                description="Render immediately. Disabled: only set the camera and the resolution")

    def execute(self, context: Context) -> set[str]:
        scene = context.scene
        path = Path(bpy.path.abspath(self.filepath))
        if path.suffix.lower() not in WORLD_FILES:
            path = path.with_name(path.name + ".png")
        box = _box(context)
        if box is None:
            self.report({'ERROR'}, "Patina: select objects with points first")
            return {'CANCELLED'}
        pixel = self.scale * INCH / self.dpi / scene.unit_settings.scale_length
        width, height = _size(box, pixel, self.margin)
        if max(width, height) > MOST:
            self.report({'ERROR'}, f"Patina: a plan of {width:,} x {height:,} pixels; the most is {MOST:,} a side: "
                                   "a smaller scale or fewer dots per inch make it fit")
            return {'CANCELLED'}
        camera = _camera(context, box, pixel, width, height)
        render = scene.render
        render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
        render.pixel_aspect_x = render.pixel_aspect_y = 1.0
        render.use_border = False
        scene.camera = camera
        if self.write_picture:
            kind = 'TIFF' if path.suffix.lower().startswith(".tif") else 'PNG'
            kept = render.filepath, render.use_file_extension, render.image_settings.file_format
            render.filepath, render.use_file_extension = str(path), False
            try:
                render.image_settings.file_format = kind
                if bpy.ops.render.render(write_still=True) != {'FINISHED'}:
                    return {'CANCELLED'}
            finally:
                render.filepath, render.use_file_extension, render.image_settings.file_format = kept
        zero, unit = _survey(context)
        corner = zero + (camera.location.x - 0.5 * width * pixel, camera.location.y + 0.5 * height * pixel, 0.0)
        target = path.with_suffix(WORLD_FILES[path.suffix.lower()])
        try:
            target.write_text(world_file(corner[0] / unit, corner[1] / unit, pixel / unit), encoding="ascii")
        except OSError as error:
            self.report({'ERROR'}, f"Patina: {target.name} cannot be written: {error.strerror}")
            return {'CANCELLED'}
        self.report({'INFO'}, f"{width:,} x {height:,} pixels of {pixel:.6g} units; world file {target.name}. "
                            f"The scene now uses the camera '{camera.name}' and this resolution")
        return {'FINISHED'}


def _survey(context: Context) -> tuple[np.ndarray, float]:
    """Where in the world Blender's zero is to the selected points, in metres, and how many of them a unit of their survey is."""
    scanned = next((obj for obj in context.selected_objects if origin.PROPERTY in obj), None)
    if scanned is None:
        return np.array(context.scene.get(origin.PROPERTY, origin.ZERO), np.float64), 1.0
    return origin.shared_of(scanned, context.scene), float(np.linalg.norm(origin.axes_of(scanned)[:, 0]))


def world_file(left: float, top: float, pixel: float) -> str:
    """The six lines of a world file: a pixel's size, no rotation, the centre of the upper left pixel."""
    values = (pixel, 0.0, 0.0, -pixel, left + 0.5 * pixel, top - 0.5 * pixel)
    return "".join(f"{value:.10f}\n" for value in values)


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


def _size(box: tuple[np.ndarray, np.ndarray], pixel: float, margin: float) -> tuple[int, int]:
    extent = (box[1] - box[0])[:2]
    room = extent + 2.0 * margin * extent.max()
    width, height = (max(int(np.ceil(side / pixel - 1e-3)), 4) for side in room)  # Blender renders no less than 4 pixels
    return width, height


def _camera(context: Context, box: tuple[np.ndarray, np.ndarray], pixel: float, width: int,
            height: int) -> bpy.types.Object:
    """The camera "Plan", made at the first time."""
    camera = bpy.data.objects.get("Plan")
    if camera is None or camera.type != 'CAMERA' or camera.name not in context.scene.objects:
        camera = bpy.data.objects.new("Plan", bpy.data.cameras.new("Plan"))
        context.scene.collection.objects.link(camera)
    middle, depth = 0.5 * (box[0] + box[1]), float(box[1][2] - box[0][2])
    room = max(0.01 * depth, 10.0 * pixel)
    camera.matrix_world = Matrix.Translation((middle[0], middle[1], box[1][2] + 2.0 * room))
    data = camera.data
    data.type, data.sensor_fit = 'ORTHO', 'HORIZONTAL'
    data.ortho_scale = width * pixel
    data.shift_x = data.shift_y = 0.0
    data.clip_start, data.clip_end = room, depth + 4.0 * room
    return camera


def _menu(self: bpy.types.Menu, context: Context) -> None:
    if context.engine == PatinaRenderEngine.bl_idname:
        self.layout.operator(PATINA_OT_render_plan.bl_idname, text="Render Plan to Scale...")


def register() -> None:
    bpy.utils.register_class(PATINA_OT_render_plan)
    bpy.types.TOPBAR_MT_render.append(_menu)


def unregister() -> None:
    bpy.types.TOPBAR_MT_render.remove(_menu)
    bpy.utils.unregister_class(PATINA_OT_render_plan)
