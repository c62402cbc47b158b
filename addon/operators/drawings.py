# SPDX-License-Identifier: GPL-3.0-or-later
"""Survey drawings: add one in one click, and look through it."""

from __future__ import annotations

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty
from bpy.types import Context, Menu, Object, Operator
from mathutils import Matrix, Vector

from .. import native, point_data
from ..description import drawings as planes
from ..description.drawings import LEVEL, DrawingError
from ..properties.measures import redraw
from ..sync import drawings
from . import analyze, camera_paths, polls
from .picking import PickPoints, Reports
from .view_surface import Hit, Surface
from .view_tools import largest_view

WALL = 40.0  # pixels, at a resolution scale of 1, around the place whose surface is a wall's plane
CLOSE = 1.06  # of what a view looks at: how much it shows
VIEW_SENSOR = 72.0  # mm, what the lens of a 3D view shows the longer side of

_Place = tuple[np.ndarray, np.ndarray, np.ndarray]
_views: dict[int, tuple] = {}  # by 3D view: what it showed before it looked through a drawing


def corners_of(context: Context) -> np.ndarray:
    """(n, 3), of the boxes without strays of the selected points, else of all visible ones. DrawingError, PatinaError."""
    chosen = camera_paths.chosen(context)
    found = analyze.corners_of(context.evaluated_depsgraph_get(), set(chosen), context.scene.frame_current) if chosen else []
    table = np.array(found, np.float64).reshape(-1, 3)
    table = table[np.isfinite(table).all(axis=1)]
    if not len(table):
        raise DrawingError("there are no points to draw. Select objects with points")
    return table


def _scale() -> FloatProperty:
    return FloatProperty(name="Scale 1 :", default=50.0, min=1e-3, soft_max=10000.0, precision=1, description="Meters of the building per meter on paper")


class PATINA_OT_add_drawing(Reports, Operator):
    """Add a survey drawing of the selected points: an empty whose frame is the sheet. Draws all points if none are selected"""

    bl_idname = "object.patina_add_drawing"
    bl_label = "Add Drawing"
    bl_options = {'REGISTER', 'UNDO'}

    by: EnumProperty(name="Plane", default='VIEW', description="Where the plane of the drawing is", items=(
        ('VIEW', "Current View", "Across the 3D view, through its center", 0),
        ('PLAN', "Plan", "Level, seen from above", 1),
        ('CEILING', "Reflected Ceiling Plan", "Level, what is above it as a mirror on the floor shows it", 2)))
    level: FloatProperty(name="Height", default=1.0, subtype='DISTANCE', unit='LENGTH',
                         description="Height of a plan's plane above the lowest point")
    scale: _scale()

    @classmethod
    def poll(cls, context: Context) -> bool:
        return polls.allowed(cls, "" if camera_paths.chosen(context) else "the scene has no points")

    def execute(self, context: Context) -> set[str]:
        try:
            corners = corners_of(context)
            kind, place = self._of_view(context, corners) if self.by == 'VIEW' else self._level(corners)
            obj = drawings.create(context, kind, place, corners)
        except (DrawingError, native.PatinaError) as error:
            return self.refused(str(error))
        group = obj.patina.drawing
        group.scale = self.scale
        if self.by == 'PLAN':
            group.front = 0.0
        elif self.by == 'CEILING':
            group.front, group.back = 0.0, group.front
        self.report({'INFO'}, f"Added the drawing '{obj.name}'")
        return {'FINISHED'}

    def _level(self, corners: np.ndarray) -> tuple[str, _Place]:
        low, high = corners.min(axis=0), corners.max(axis=0)
        middle = np.array((*(0.5 * (low + high))[:2], min(low[2] + self.level, high[2])))
        return self.by, (middle, np.array((1.0, 0.0, 0.0)), np.array((0.0, 1.0, 0.0)))

    def _of_view(self, context: Context, corners: np.ndarray) -> tuple[str, _Place]:
        found = _view_of(context)
        if found is None:
            raise DrawingError("the window has no 3D view to take the plane from. Choose another plane")
        view = found[1]
        axes = np.array(view.view_matrix.inverted(), np.float64)[:3, :3]
        axes /= np.linalg.norm(axes, axis=0)
        middle = np.array(view.view_location, np.float64) if view.view_perspective != 'CAMERA' else 0.5 * (corners.min(axis=0) + corners.max(axis=0))
        return 'PLAN' if axes[2, 2] > LEVEL else 'ELEVATION', (middle, axes[:, 0], axes[:, 1])


class PATINA_OT_pick_drawing(PickPoints, Operator):
    """Add a survey drawing by clicks on the surface that the view shows. Ctrl toggles snapping, Backspace removes the last point, Esc cancels"""

    bl_idname = "object.patina_pick_drawing"
    bl_label = "Pick Drawing"
    bl_options = {'UNDO'}

    by: EnumProperty(name="Plane", default='WALL', description="What the clicks choose", items=(
        ('WALL', "Wall", "One click: an elevation on the plane that fits the surface around it", 0),
        ('POINTS', "Three Points", "Three clicks: an elevation on the plane through a point at the left, one at the right, and one above", 1),
        ('LINE', "Line", "Two clicks: an upright section through both points. The view is to the left of the line", 2)))
    vertical: BoolProperty(name="Vertical", default=True, description="Make the plane of a wall upright")
    scale: _scale()

    def most(self) -> int:
        return {'WALL': 1, 'POINTS': 3, 'LINE': 2}[self.by]

    def title(self) -> str:
        return {'WALL': "Click a wall", 'POINTS': "Click left, right and upper point", 'LINE': "Click both ends of the section"}[self.by]

    def again(self) -> None:
        bpy.ops.object.patina_pick_drawing('INVOKE_DEFAULT', by=self.by, vertical=self.vertical, scale=self.scale, snap=self.snap)

    def keep(self, context: Context, hits: list[Hit]) -> set[str]:
        if len(hits) != self.most():
            raise DrawingError(f"this plane needs {self.most()} point{'s' * (self.most() > 1)}, not {len(hits)}: {self.title()}")
        corners, points = corners_of(context), np.stack([hit.world for hit in hits])
        unit = context.scene.unit_settings.scale_length
        kind, size, depth = 'ELEVATION', None, (1.0, 1.0)
        if self.by == 'LINE':
            place, kind = planes.by_line(points), 'SECTION'
            size, depth = (float(np.linalg.norm((points[1] - points[0])[:2])), 0.0), None
        else:
            with Surface(context) as surface:
                if self.by == 'POINTS':
                    place = planes.by_points(points, surface.towards)
                else:
                    near = surface.around(hits[0].pixel, WALL * (context.preferences.system.ui_scale or 1.0))
                    place = planes.by_wall(near, self.vertical, surface.towards)
                kind = 'PLAN' if abs(np.cross(place[1], place[2])[2]) > LEVEL else kind
        obj = drawings.create(context, kind, place, corners, size, depth)
        group = obj.patina.drawing
        group.scale = self.scale
        if kind == 'SECTION':
            group.front = 0.0
        self.report({'INFO'}, f"Added the drawing '{obj.name}', {group.width * unit:.2f} x {group.height * unit:.2f} m")
        return {'FINISHED'}


# ---- views ---------------------------------------------------------------------------------------------------------------


def _view_of(context: Context) -> tuple[bpy.types.Area, bpy.types.RegionView3D, bpy.types.Region] | None:
    """The context's 3D view, else the largest."""
    if context.area and context.area.type == 'VIEW_3D':
        region = next(region for region in context.area.regions if region.type == 'WINDOW')
        return context.area, context.region_data or context.area.spaces.active.region_3d, region
    found = largest_view(context)
    return found and (found[0], found[0].spaces.active.region_3d, found[1])


class _OfOne(Reports):
    """Beside bpy.types.Operator: of one drawing."""

    drawing: StringProperty(options={'HIDDEN', 'SKIP_SAVE'}, description="Name of the drawing. Empty: the active object")

    def chosen(self, context: Context) -> Object:
        """DrawingError."""
        obj = context.view_layer.objects.get(self.drawing) if self.drawing else context.object
        if not drawings.is_drawing(obj):
            raise DrawingError(f"'{self.drawing}' is no drawing" if self.drawing else "no drawing is active. Select one")
        return obj


class PATINA_OT_select_drawing(_OfOne, Operator):
    """Select this drawing"""

    bl_idname = "object.patina_select_drawing"
    bl_label = "Select Drawing"
    bl_options = {'UNDO', 'INTERNAL'}

    def execute(self, context: Context) -> set[str]:
        try:
            obj = self.chosen(context)
        except DrawingError as error:
            return self.refused(str(error))
        point_data.select_alone(context, obj)
        return {'FINISHED'}


class PATINA_OT_look_through_drawing(_OfOne, Operator):
    """Show this drawing in the 3D view: without perspective, and only what its depth and extent contain. Once more: go back"""

    bl_idname = "view3d.patina_look_through_drawing"
    bl_label = "Look Through Drawing"
    bl_options = {'INTERNAL'}

    def execute(self, context: Context) -> set[str]:
        found = _view_of(context)
        if found is None:
            return self.refused("looking through a drawing needs a 3D viewport, and the window has none")
        area, view, region = found
        space, key = area.spaces.active, view.as_pointer()
        try:
            obj = self.chosen(context)
            frame = drawings.frame_of(obj, context.scene)
        except DrawingError as error:
            return self.refused(str(error))
        kept = _views.pop(key, None)
        if kept:
            _put_back(view, space, kept)
        if not kept or kept[0] != obj.name_full:
            _views[key] = (obj.name_full, view.view_perspective, view.view_location.copy(), view.view_rotation.copy(), view.view_distance,
                           view.use_clip_planes, [tuple(plane) for plane in view.clip_planes])
            _look(view, space, region, frame)
        redraw(None, context)
        return {'FINISHED'}


def _look(view: bpy.types.RegionView3D, space: bpy.types.SpaceView3D, region: bpy.types.Region, frame: planes.Frame) -> None:
    back = -frame.normal if frame.ceiling else frame.normal
    right = np.cross(frame.up, back)  # a view is not mirrored
    matrix = Matrix(np.column_stack([right, frame.up, back]).tolist())
    view.view_perspective = 'ORTHO'
    view.view_rotation = matrix.to_quaternion()
    view.view_location = Vector(frame.origin)
    longer, width, height = max(region.width, region.height), max(region.width, 1), max(region.height, 1)
    view.view_distance = CLOSE * max(frame.width / width, frame.height / height) * longer * space.lens / VIEW_SENSOR
    sides = ((right, 0.5 * frame.width), (-right, 0.5 * frame.width), (frame.up, 0.5 * frame.height), (-frame.up, 0.5 * frame.height),
             (back, frame.back), (-back, frame.front))
    view.clip_planes = [(*axis, reach - axis @ frame.origin) for axis, reach in sides]
    view.use_clip_planes = True


def _put_back(view: bpy.types.RegionView3D, space: bpy.types.SpaceView3D, kept: tuple) -> None:
    _, perspective, location, rotation, distance, clipped, clip_planes = kept
    view.view_perspective, view.view_location, view.view_rotation, view.view_distance = perspective, location, rotation, distance
    view.clip_planes, view.use_clip_planes = clip_planes, clipped


def _draw_menu(self: Menu, context: Context) -> None:
    if polls.has_points(context):
        self.layout.separator()
        self.layout.operator(PATINA_OT_add_drawing.bl_idname, text="Survey Drawing", icon='IMAGE_PLANE').by = 'VIEW'


_register, _unregister = bpy.utils.register_classes_factory(
    (PATINA_OT_add_drawing, PATINA_OT_pick_drawing, PATINA_OT_select_drawing, PATINA_OT_look_through_drawing))


def register() -> None:
    _register()
    bpy.types.VIEW3D_MT_add.append(_draw_menu)


def unregister() -> None:
    bpy.types.VIEW3D_MT_add.remove(_draw_menu)
    _views.clear()
    _unregister()
