# SPDX-License-Identifier: GPL-3.0-or-later
"""Orthographic plans to a stated scale: a camera that looks down, an image of the right size, a world file next to it. The dialog
asks for the sheet first. A render restores the scene."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty
from bpy.types import Context, Operator
from bpy_extras.io_utils import ExportHelper
from mathutils import Matrix, Vector

from .. import point_data
from ..draw.engine import PatinaRenderEngine
from ..sync.points import origin

INCH = 0.0254  # metres
MOST = 65536  # pixels a side, of the library and of Blender
WORLD_FILES = {".png": ".pgw", ".tif": ".tfw", ".tiff": ".tfw", ".jpg": ".jgw", ".jpeg": ".jgw"}
SHEETS = {"A4": (0.210, 0.297), "A3": (0.297, 0.420), "A2": (0.420, 0.594), "A1": (0.594, 0.841), "A0": (0.841, 1.189),
          "LETTER": (0.2159, 0.2794), "TABLOID": (0.2794, 0.4318)}  # meters, upright
_STEPS = (1.0, 2.0, 2.5, 5.0)  # of scales, times powers of ten
_RESTORED = ("resolution_x", "resolution_y", "resolution_percentage", "pixel_aspect_x", "pixel_aspect_y", "use_border")


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
        box = _box(context)
        if box is None:
            self.report({'ERROR'}, "Patina: select objects with points first")
            return {'CANCELLED'}
        pixel = _pixel(context.scene, self.scale, self.dpi)
        width, height = _size(box, pixel, self.margin)
        if max(width, height) > MOST:
            self.report({'ERROR'}, f"Patina: a plan of {width:,} x {height:,} pixels; the most is {MOST:,} a side: "
                                   "a smaller scale or fewer dots per inch make it fit")
            return {'CANCELLED'}
        if self.write_picture:
            with _restored(scene):
                camera = _set_up(context, None, box, pixel, width, height)
                place = camera.location.copy()
                try:
                    if not _write(scene, path):
                        return {'CANCELLED'}
                finally:
                    bpy.data.cameras.remove(camera.data)  # and its object
            done = "The scene's camera and resolution are unchanged"
        else:
            known = bpy.data.objects.get("Plan")
            usable = known and known.type == 'CAMERA' and known.name in scene.objects
            camera = _set_up(context, known if usable else None, box, pixel, width, height)
            place = camera.location
            done = f"The scene now uses the camera '{camera.name}' and this resolution"
        zero, unit = _survey(context)
        corner = zero + (place.x - 0.5 * width * pixel, place.y + 0.5 * height * pixel, 0.0)
        target = path.with_suffix(WORLD_FILES[path.suffix.lower()])
        try:
            target.write_text(world_file(corner[0] / unit, corner[1] / unit, pixel / unit), encoding="ascii")
        except OSError as error:
            self.report({'ERROR'}, f"Patina: {target.name} cannot be written: {error.strerror}")
            return {'CANCELLED'}
        self.report({'INFO'}, f"{width:,} x {height:,} pixels of {pixel:.6g} units; world file {target.name}. {done}")
        return {'FINISHED'}


@contextlib.contextmanager
def _restored(scene: bpy.types.Scene) -> Iterator[None]:
    """Restores the scene's camera and resolution afterwards, whatever happens."""
    camera, values = scene.camera, {name: getattr(scene.render, name) for name in _RESTORED}
    try:
        yield
    finally:
        scene.camera = camera
        for name, value in values.items():
            setattr(scene.render, name, value)


def _write(scene: bpy.types.Scene, path: Path) -> bool:
    """Renders the plan to a PNG or TIFF file. Returns False if the user canceled."""
    render = scene.render
    kept = render.filepath, render.use_file_extension, render.image_settings.file_format
    render.filepath, render.use_file_extension = str(path), False
    try:
        render.image_settings.file_format = 'TIFF' if path.suffix.lower().startswith(".tif") else 'PNG'
        return bpy.ops.render.render(write_still=True) == {'FINISHED'}
    finally:
        render.filepath, render.use_file_extension, render.image_settings.file_format = kept


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
    width, height = _size(box, _pixel(scene, scale, dpi), margin)
    if max(width, height) > MOST:
        return f"{width:,} x {height:,} pixels. The most is {MOST:,} a side"
    settings = scene.render.image_settings
    size = width * height * 4 * (2 if settings.color_depth in {'16', '32'} else 1)
    return f"{width:,} x {height:,} pixels, at most {size / 1e6:,.1f} MB"


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


def _set_up(context: Context, camera: bpy.types.Object | None, box: tuple[np.ndarray, np.ndarray], pixel: float, width: int,
            height: int) -> bpy.types.Object:
    """Makes the scene render the plan. Returns the camera, a new one named "Plan" if None is given."""
    scene, render = context.scene, context.scene.render
    if camera is None:
        camera = bpy.data.objects.new("Plan", bpy.data.cameras.new("Plan"))
        scene.collection.objects.link(camera)
    render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
    render.pixel_aspect_x = render.pixel_aspect_y = 1.0
    render.use_border = False
    scene.camera = camera
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
        self.layout.operator(PATINA_OT_plan_sheet.bl_idname, text="Render Plan to Scale...")


def register() -> None:
    bpy.utils.register_class(PATINA_OT_plan_sheet)
    bpy.utils.register_class(PATINA_OT_render_plan)
    bpy.types.TOPBAR_MT_render.append(_menu)


def unregister() -> None:
    bpy.types.TOPBAR_MT_render.remove(_menu)
    bpy.utils.unregister_class(PATINA_OT_render_plan)
    bpy.utils.unregister_class(PATINA_OT_plan_sheet)
