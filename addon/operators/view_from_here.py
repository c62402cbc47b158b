# SPDX-License-Identifier: GPL-3.0-or-later
"""View from Here: the 3D view, and on request a camera, at a station. Walk: Blender's walk navigation without gravity."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np
from bpy.props import BoolProperty, IntProperty
from bpy.types import Area, Context, Object, Operator, SpaceView3D
from mathutils import Matrix, Quaternion, Vector

from .. import native, point_data
from ..read.importers import scans
from . import analyze, camera_paths, clip_range, polls, scanner, stations

BEFORE = 0.05  # of the extent: how far before the eye the view turns around
STEEP = 0.999  # of a direction's length, along the vertical: up is not known


def _station_of(obj: Object | None) -> bool:
    return obj is not None and obj.type == 'EMPTY' and stations.PROPERTY in obj


def why_not(obj: Object | None) -> str:
    """Why an object gives no place to view from; empty: it gives one."""
    if _station_of(obj) or obj is not None and (stations.of(obj) or np.isfinite(scanner.positions(obj)).all(axis=1).any()):
        return ""
    return "select a station, or points whose file stores where the scanners stood (E57, PTX)"


class PATINA_OT_view_from_here(Operator):
    """Put the 3D view at the active station, or at a station of the active points. Looks where the scanner looked, or at the middle of the points"""

    bl_idname = "view3d.patina_view_from_here"
    bl_label = "View from Here"
    bl_options = {'REGISTER', 'UNDO'}

    scan: IntProperty(name="Scan", default=0, min=0, options={'SKIP_SAVE'},
                      description="Number of the scan in the file, starting at 0, if points are active")
    camera: BoolProperty(name="Add Camera", default=False, description="Also add a camera there, and make it the scene's camera")

    @classmethod
    def poll(cls, context: Context) -> bool:
        return polls.allowed(cls, why_not(context.object))

    def execute(self, context: Context) -> set[str]:
        obj = context.object
        cloud, scan = (obj.parent, int(obj[stations.PROPERTY])) if _station_of(obj) else (obj, self.scan)
        eye = obj.matrix_world.translation.copy() if _station_of(obj) else _place(obj, scan)
        if eye is None:
            self.report({'ERROR'}, f"Patina: '{obj.name}' does not store where the scanner of scan {scan} stood. "
                                   f"It has {_numbers(obj)}")
            return {'CANCELLED'}
        try:
            corners = _corners(context, cloud)
        except native.PatinaError as error:
            self.report({'ERROR'}, f"Patina: {error}")
            return {'CANCELLED'}
        extent = clip_range.extent_of([*corners, eye]) or 1.0
        turn = _turn(_direction(cloud, scan), sum(corners, Vector()) / len(corners) - eye if corners else Vector(), extent)
        far = max([(place - eye).length for place in (*corners, *_visible(context))], default=0.0)
        area = view_of(context)
        if area:
            _look(area.spaces.active, eye, turn, extent, far)
        if self.camera:
            self._add_camera(context, obj.name, eye, turn, extent, far)
        elif area is None:
            self.report({'WARNING'}, "There is no 3D view to move. Enable Add Camera")
        else:
            self.report({'INFO'}, "Moved the view. F12 shows the scene's camera: enable Add Camera to render from here")
        return {'FINISHED'}

    def _add_camera(self, context: Context, name: str, eye: Vector, turn: Quaternion, extent: float, far: float) -> None:
        before = context.scene.camera
        camera = camera_paths.new_camera(context, f"{name} View")
        camera.data.lens = camera_paths.WIDE
        camera.matrix_world = Matrix.Translation(eye) @ turn.to_matrix().to_4x4()
        clip_range.fit(camera.data, extent, far)
        stays = f". '{before.name}' is still there" if before else ""
        self.report({'INFO'}, f"Added the camera '{camera.name}' and made it the scene's camera{stays}")


def _place(obj: Object, scan: int) -> Vector | None:
    """In the world, where the scanner of a scan stood: at its empty, if there is one."""
    empty = stations.of(obj).get(scan)
    if empty:
        return empty.matrix_world.translation.copy()
    known = scanner.positions(obj)
    return obj.matrix_world @ Vector(known[scan]) if scan < len(known) and np.isfinite(known[scan]).all() else None


def _numbers(obj: Object) -> str:
    known = scanner.positions(obj)
    found = sorted({*stations.of(obj), *np.flatnonzero(np.isfinite(known).all(axis=1)).tolist()})
    return f"stations of the scans {', '.join(map(str, found[:10]))}{' and others' * (len(found) > 10)}"


def _direction(cloud: Object | None, scan: int) -> Vector:
    """In the world, where the scanner looked; zero if it looked all around, or if nothing is known."""
    known = scans.unpacked(cloud.data.get(scans.PROPERTY)) if cloud is not None and cloud.data else []
    if scan >= len(known) or not any(known[scan].direction):
        return Vector()
    return cloud.matrix_world.to_3x3() @ Vector(known[scan].direction)


def _corners(context: Context, cloud: Object | None) -> list[Vector]:
    """In the world, of a cloud's box without strays. PatinaError if its file cannot be read."""
    if not point_data.may_have_points(cloud):
        return []
    found = analyze.corners_of(context.evaluated_depsgraph_get(), {cloud}, context.scene.frame_current)
    return [corner for corner in found if np.isfinite(corner).all()]


def _visible(context: Context) -> list[Vector]:
    """In the world, the boxes of all visible objects that have one."""
    return [obj.matrix_world @ Vector(corner) for obj in context.view_layer.objects if obj.visible_get() and obj.type in point_data.TYPES
            for corner in obj.bound_box if np.isfinite(corner).all()]


def _turn(looked: Vector, to_middle: Vector, extent: float) -> Quaternion:
    """Of a camera that looks in the first direction that says something, upright; else north and level."""
    for way in (looked, to_middle):
        if way.length > 1e-3 * extent or way is looked and way.length:
            steep = abs(way.normalized().z) > STEEP
            return way.to_track_quat('-Z', 'Y') if not steep else Vector((0.0, 1e-2, way.normalized().z)).to_track_quat('-Z', 'Y')
    return Vector((0.0, 1.0, 0.0)).to_track_quat('-Z', 'Y')


def view_of(context: Context) -> Area | None:
    """The 3D view that an operator runs in, else the largest of the window."""
    if context.area and context.area.type == 'VIEW_3D':
        return context.area
    areas = [area for area in context.window.screen.areas if area.type == 'VIEW_3D'] if context.window else []
    areas = [area for area in areas if area.spaces.active.region_3d]
    return max(areas, key=lambda area: area.width * area.height, default=None)


def _look(space: SpaceView3D, eye: Vector, turn: Quaternion, extent: float, far: float) -> None:
    view = space.region_3d
    clip_range.fit(space, extent, far)
    view.view_perspective = 'PERSP'
    view.view_rotation = turn
    view.view_distance = BEFORE * extent
    view.view_location = eye + turn @ Vector((0.0, 0.0, -BEFORE * extent))


class PATINA_OT_walk(Operator):
    """Start Blender's walk navigation without gravity, so that the view stays at its height. The preference Gravity is not changed"""

    bl_idname = "view3d.patina_walk"
    bl_label = "Walk Without Gravity"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return bpy.ops.view3d.walk.poll()

    def invoke(self, context: Context, _event: bpy.types.Event) -> set[str]:
        walk_without_gravity(context, lambda: bpy.ops.view3d.walk('INVOKE_DEFAULT'))
        return {'FINISHED'}


def walk_without_gravity(context: Context, walk: Callable[[], object]) -> None:
    """Calls walk() while the preference Gravity is off: walk navigation reads it once, when it starts."""
    preferences = context.preferences
    settings, dirty = preferences.inputs.walk_navigation, preferences.is_dirty
    before = settings.use_gravity
    try:
        if before:
            settings.use_gravity = False
        walk()
    finally:
        if before:
            settings.use_gravity = True
            preferences.is_dirty = dirty


def _draw_navigation(self: bpy.types.Menu, context: Context) -> None:
    if any(map(point_data.is_cloud, context.view_layer.objects)):
        self.layout.separator()
        self.layout.operator(PATINA_OT_walk.bl_idname)
        self.layout.operator(PATINA_OT_view_from_here.bl_idname)


def _draw_context(self: bpy.types.Menu, context: Context) -> None:
    if _station_of(context.object):
        self.layout.separator()
        self.layout.operator(PATINA_OT_view_from_here.bl_idname)


_register, _unregister = bpy.utils.register_classes_factory((PATINA_OT_view_from_here, PATINA_OT_walk))


def register() -> None:
    _register()
    bpy.types.VIEW3D_MT_view_navigation.append(_draw_navigation)
    bpy.types.VIEW3D_MT_object_context_menu.append(_draw_context)


def unregister() -> None:
    bpy.types.VIEW3D_MT_object_context_menu.remove(_draw_context)
    bpy.types.VIEW3D_MT_view_navigation.remove(_draw_navigation)
    _unregister()
