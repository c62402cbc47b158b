# SPDX-License-Identifier: GPL-3.0-or-later
"""Turntable and Walk-Through: cameras with keyframes around points, and from station to station."""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty
from bpy.types import Context, Object, Operator
from mathutils import Euler, Matrix, Vector

from .. import native, point_data
from . import analyze, clip_range, keys, polls, scanner, stations, tour

AIR = 1.04  # of the size of what a turntable frames: as much as the library's framing leaves
CIRCLE = 64  # places of a circle that stand for it: they miss 0.12 % of its radius
WIDE = 24.0  # mm: rooms are seen from within


def chosen(context: Context) -> list[Object]:
    """The selected objects with points; all visible clouds if none are selected."""
    selected = [obj for obj in context.selected_objects if point_data.may_have_points(obj)]
    return selected or [obj for obj in context.view_layer.objects if point_data.is_cloud(obj) and obj.visible_get()]


def new_camera(context: Context, name: str) -> Object:
    """A perspective camera, linked to the scene and made its camera. The sensor and lens are those of the scene's camera."""
    scene, data = context.scene, bpy.data.cameras.new(name)
    before = scene.camera.data if scene.camera and scene.camera.type == 'CAMERA' else None
    if before and before.type == 'PERSP':
        for attribute in ("lens", "sensor_fit", "sensor_width", "sensor_height"):
            setattr(data, attribute, getattr(before, attribute))
    camera = bpy.data.objects.new(name, data)
    context.collection.objects.link(camera)
    scene.camera = camera
    return camera


class _CameraPath:
    """Beside bpy.types.Operator."""

    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return polls.allowed(cls, "" if chosen(context) else "the scene has no points")

    def finish(self, camera: Object, before: Object | None, text: str) -> set[str]:
        stays = f". '{before.name}' is still there" if before else ""
        self.report({'INFO'}, f"Added the camera '{camera.name}' and made it the scene's camera{stays}. {text}")
        return {'FINISHED'}


class PATINA_OT_turntable(_CameraPath, Operator):
    """Add a camera that orbits the selected points once over the scene's frames. Orbits all points if none are selected"""

    bl_idname = "object.patina_turntable"
    bl_label = "Turntable"

    frames: IntProperty(name="Frames", default=250, min=keys.LEAST_FRAMES, soft_max=2000, options={'SKIP_SAVE'},
                        description="Number of frames. The scene's frame range ends after them")
    turns: FloatProperty(name="Turns", default=1.0, min=0.01, soft_max=10.0, max=1000.0, step=25,
                         description="Number of turns. Whole numbers loop without a repeated frame")
    direction: EnumProperty(name="Direction", default='LEFT', items=(
        ('LEFT', "Counterclockwise", "The camera moves counterclockwise, seen from above", 0),
        ('RIGHT', "Clockwise", "The camera moves clockwise, seen from above", 1)))
    elevation: FloatProperty(name="Elevation", default=math.radians(20.0), min=-math.pi / 2, max=math.pi / 2, subtype='ANGLE',
                             description="Angle of the camera above the horizon")
    start: FloatProperty(name="Start Angle", default=0.0, subtype='ANGLE', soft_min=-math.pi, soft_max=math.pi,
                         description="Angle around the vertical where the camera starts. 0 is the front, at negative Y")

    def execute(self, context: Context) -> set[str]:
        scene, before = context.scene, context.scene.camera
        depsgraph = context.evaluated_depsgraph_get()
        try:
            corners = analyze.corners_of(depsgraph, set(chosen(context)), scene.frame_current)
        except native.PatinaError as error:
            self.report({'ERROR'}, f"Patina: {error}")
            return {'CANCELLED'}
        body = _Body.of(corners)
        if body is None:
            self.report({'ERROR'}, "Patina: there are no points to orbit. Select objects with points")
            return {'CANCELLED'}
        pivot = bpy.data.objects.new("Turntable Pivot", None)
        pivot.location = body.center
        pivot.empty_display_size = 0.2 * body.reach
        context.collection.objects.link(pivot)
        camera = new_camera(context, "Turntable")
        camera.parent = pivot
        rotation = Euler((math.pi / 2 - self.elevation, 0.0, 0.0)).to_matrix()
        camera.matrix_local = rotation.to_4x4()
        context.view_layer.update()
        place = self._fitting(context, camera, body)
        camera.matrix_local = Matrix.Translation(place) @ rotation.to_4x4()
        clip_range.fit(camera.data, 2.0 * body.reach, place.length + body.reach)
        frames, full = keys.take_frames(self, scene), 2.0 * math.pi * self.turns * (1.0 if self.direction == 'LEFT' else -1.0)
        first = scene.frame_start
        keys.add(pivot, "rotation_euler", 2, [(first, self.start), (first + frames, self.start + full)], 'LINEAR', 'LINEAR')
        return self.finish(camera, before, f"{self.turns:g} turn{'s' * (self.turns != 1.0)} in {frames:,} frames. "
                                           f"Keyframes of '{pivot.name}' turn it")

    def _fitting(self, context: Context, camera: Object, body: _Body) -> Vector:
        """Where the camera sees all of the body, relative to its center. The body looks the same from each side, so all angles fit. The
        camera's rotation alone decides, so places near zero lose nothing to float32."""
        depsgraph = context.evaluated_depsgraph_get()
        flat = [value for place in body.rims() for value in AIR * place]
        place, _ = camera.evaluated_get(depsgraph).camera_fit_coords(depsgraph, flat)
        return place


class _Body:
    """The cylinder around a vertical axis that holds some corners."""

    def __init__(self, center: Vector, radius: float, half: float) -> None:
        self.center, self.radius, self.half = center, radius, half
        self.reach = math.hypot(radius, half)

    @staticmethod
    def of(corners: Sequence[Vector]) -> _Body | None:
        """None without finite corners. Points at one place have a small body; rounding of large coordinates is held, too."""
        places = np.array(corners, np.float64).reshape(-1, 3)
        places = places[np.isfinite(places).all(axis=1)]
        if not len(places):
            return None
        lower, upper = places.min(axis=0), places.max(axis=0)
        center = 0.5 * (lower + upper)
        rounding = float(np.spacing(np.abs(places).max().astype(np.float32)))
        radius = float(np.linalg.norm((places - center)[:, :2], axis=1).max()) + rounding
        half = 0.5 * float(upper[2] - lower[2]) + rounding
        return _Body(Vector(center), radius, half)

    def rims(self) -> list[Vector]:
        """Places on the upper and the lower edge."""
        angles = [2.0 * math.pi * i / CIRCLE for i in range(CIRCLE)]
        return [Vector((self.radius * math.cos(angle), self.radius * math.sin(angle), height)) for angle in angles
                for height in (-self.half, self.half)]


class PATINA_OT_walk_through(_CameraPath, Operator):
    """Add a camera that moves through the selected stations. With no station selected: through all stations of the selected points, in the order of a short tour"""

    bl_idname = "object.patina_walk_through"
    bl_label = "Walk-Through"

    frames: IntProperty(name="Frames", default=250, min=keys.LEAST_FRAMES, soft_max=2000, options={'SKIP_SAVE'},
                        description="Number of frames. The scene's frame range ends after them")
    reverse: BoolProperty(name="Reverse", default=False, description="Move from the last station to the first")
    height: FloatProperty(name="Height Offset", default=0.0, subtype='DISTANCE', unit='LENGTH',
                          description="Height of the camera above the stations")
    lens: FloatProperty(name="Focal Length", default=WIDE, min=1.0, soft_max=200.0, subtype='DISTANCE_CAMERA',
                        description="Focal length of the camera")

    @classmethod
    def poll(cls, context: Context) -> bool:
        return polls.allowed(cls, "" if chosen(context) or _selected_stations(context) else "the scene has no points")

    def execute(self, context: Context) -> set[str]:
        scene, before = context.scene, context.scene.camera
        stops = np.array(_stops(context), np.float64).reshape(-1, 3)
        stops = stops[tour.order(stops)]
        if len(stops) < 2:
            found = "there is one station" if len(stops) else "the points have no stations: their file does not store where the scanners stood"
            self.report({'ERROR'}, f"Patina: {found}. Walk-Through needs at least two stations, as E57 and PTX files store them")
            return {'CANCELLED'}
        stops = (stops[::-1] if self.reverse else stops) + (0.0, 0.0, self.height)
        camera = new_camera(context, "Walk-Through")
        camera.data.lens = self.lens
        extent = max([max(obj.dimensions) for obj in chosen(context)], default=0.0) or float(np.ptp(stops, axis=0).max())
        clip_range.fit(camera.data, extent)
        frames = keys.take_frames(self, scene)
        _key_path(camera, stops, scene.frame_start, scene.frame_start + frames - 1)
        scene.frame_set(scene.frame_current)
        return self.finish(camera, before, f"It moves through {len(stops):,} stations in {frames:,} frames")


def _selected_stations(context: Context) -> list[Object]:
    return [obj for obj in context.selected_objects if obj.type == 'EMPTY' and stations.PROPERTY in obj]


def _stops(context: Context) -> list[Vector]:
    """Places in the world of the selected stations; else of all stations of the chosen clouds, where their empties are now."""
    context.view_layer.update()
    selected = _selected_stations(context)
    if selected:
        return [empty.matrix_world.translation.copy() for empty in selected]
    found = []
    for obj in chosen(context):
        known, empties = scanner.positions(obj), stations.of(obj)
        for index in sorted({*empties, *range(len(known))}):
            if index in empties:
                found.append(empties[index].matrix_world.translation.copy())
            elif np.isfinite(known[index]).all():
                found.append(obj.matrix_world @ Vector(known[index]))
    return found


def _key_path(camera: Object, stops: np.ndarray, first: float, last: float) -> None:
    """Keys the location at each stop, at a constant mean speed, and the rotation between two stops, where it looks from one to the other."""
    steps = np.diff(stops, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    frames = first + (last - first) * np.concatenate([[0.0], np.cumsum(lengths)]) / lengths.sum()
    for axis in range(3):
        keys.add(camera, "location", axis, list(zip(frames.tolist(), stops[:, axis].tolist(), strict=True)), 'BEZIER')
    yaw = np.unwrap(np.arctan2(-steps[:, 0], steps[:, 1]))
    pitch = np.arctan2(steps[:, 2], np.linalg.norm(steps[:, :2], axis=1))
    middles = [first, *(0.5 * (frames[:-1] + frames[1:])).tolist(), last]
    for axis, values in ((0, math.pi / 2 + pitch), (1, 0.0 * pitch), (2, yaw)):
        values = [values[0], *values, values[-1]]
        keys.add(camera, "rotation_euler", axis, [(frame, float(value)) for frame, value in zip(middles, values, strict=True)], 'BEZIER')


def _draw_camera_menu(self: bpy.types.Menu, context: Context) -> None:
    if any(map(point_data.is_cloud, context.view_layer.objects)):
        self.layout.operator(PATINA_OT_turntable.bl_idname, icon='CON_CAMERASOLVER')
        self.layout.operator(PATINA_OT_walk_through.bl_idname, icon='CON_FOLLOWPATH')


_register, _unregister = bpy.utils.register_classes_factory((PATINA_OT_turntable, PATINA_OT_walk_through))


def register() -> None:
    _register()
    bpy.types.VIEW3D_MT_camera_add.append(_draw_camera_menu)


def unregister() -> None:
    bpy.types.VIEW3D_MT_camera_add.remove(_draw_camera_menu)
    _unregister()
