# SPDX-License-Identifier: GPL-3.0-or-later
"""What every point knows, as attributes; a camera that frames points without their strays."""

from __future__ import annotations

from collections import OrderedDict

import bpy
import numpy as np
from bpy.props import BoolProperty
from bpy.types import Context, Event, Operator
from mathutils import Matrix, Vector

from .. import jobs, native, point_data
from ..read.importers import Progress
from ..sync import losses
from ..sync.analyses import analysis, analyzing
from ..sync.points import attributes, content, linked
from ..sync.points.made import NORMAL_NAME, WHOLE
from . import polls
from .steps import Stepped

# attribute → its type, the key of an element's values
WRITTEN = {NORMAL_NAME: ('FLOAT_VECTOR', "vector"), "spacing": ('FLOAT', "value"), "radius": ('FLOAT', "value"),
           "thickness": ('FLOAT', "value"), "kind": ('INT8', "value"), "trust": ('FLOAT', "value")}
SOFT = {name: ('FLOAT', "value") for name in ("soft_radius", "uncertainty", "density")}

NEAREST = 1e-4  # of how far a 3D view reaches, where it begins
VIEW_SENSOR = 36.0  # mm, half of what the lens of a 3D view shows the longer side of
BOXES = 64  # that are remembered

Box = tuple[tuple[float, ...], tuple[float, ...]]
_boxes: OrderedDict[tuple[int, ...], Box | None] = OrderedDict()  # without strays, by what the places hash to


class PATINA_OT_analyze(Stepped, Operator):
    """Compute the surface around each point from its neighbors, and store it as attributes: normal, spacing, radius, thickness, kind (1 surface, 2 border, 3 line, 4 foliage, 5 stray) and trust"""

    bl_idname = "object.patina_analyze"
    bl_label = "Analyze"
    bl_options = {'REGISTER', 'UNDO'}

    by_grid: BoolProperty(
        name="By Scan Grid", default=False,
        description="Also use the neighbors in the rows and columns of each scan")
    soft: BoolProperty(
        name="For Soft Points", default=False, options={'SKIP_SAVE'},
        description="Also store the attributes for soft points: soft_radius, uncertainty (0 to 1) and density (points per square unit of the "
                    "object). Takes about twice as long")

    @classmethod
    def poll(cls, context: Context) -> bool:
        obj = context.object
        return (point_data.may_have_points(obj) and obj.mode == 'OBJECT' and obj.data.library is None
                and not obj.patina.linked_file)

    def execute(self, context: Context) -> set[str]:
        self._progress = Progress()
        return self.begin(context, self._analyze(context.object))

    def invoke(self, context: Context, _event: Event) -> set[str]:
        self._invoked = True
        return self.execute(context)

    def _analyze(self, obj: bpy.types.Object) -> jobs.Steps[set[str]]:
        data = obj.data
        count = point_data.count_of(data)
        positions = attributes.positions(data, count) if count else None
        if positions is None:
            self.report({'ERROR'}, f"Patina: '{obj.name}' has no points")
            return {'CANCELLED'}
        try:
            with self._progress.part(0, 2).inner() as inner:
                normals = attributes.normals(data, count, obj.patina.normal_attribute)
                task = native.Cloud.start(positions, normals, None, None, inner)
            yield task
            cloud = task.result()
            part = self._progress.part(1, 2)
            part.doing = analysis.label(cloud)
            stations = analysis.stations(obj, obj.data, count, self.by_grid)
            if self.by_grid and not (stations and stations.by_grid):
                self.report({'WARNING'}, f"Patina: '{obj.name}': {analysis.NO_GRID}")
            with part.inner() as inner:
                task = analyzing.start(cloud, stations, inner)
            yield task
            task.result()
        except native.PatinaCancelled:
            self.report({'INFO'}, "Patina: canceled. Nothing was written")
            return {'CANCELLED'}
        except native.PatinaError as error:
            self.report({'ERROR'}, f"Patina: {error}")
            return {'CANCELLED'}
        found = cloud.neighbourhoods("normal", "spacing", "half_axes", "sigma", "kind", "trust")
        found["half_axes"] = np.ascontiguousarray(found["half_axes"][:, 0])
        for name, values in zip(WRITTEN, found.values(), strict=True):
            _write(data, name, values)
        if self.soft:
            walked = cloud.neighbourhoods("soft_radius", "uncertainty")
            with np.errstate(divide='ignore'):
                walked["density"] = np.where(found["spacing"] > 0.0, found["spacing"] ** -2.0, 0.0).astype(np.float32)
            for name, values in walked.items():
                _write(data, name, values)
        point_data.changed(data)
        kinds = ", ".join(f"{number:,} {name.lower()}" for name, number in zip(native.KINDS, cloud.kinds, strict=True) if number)
        self.report({'INFO'}, f"Analyzed {count:,} points: {kinds}")
        return {'FINISHED'}


def _write(data: bpy.types.ID, name: str, values: np.ndarray) -> None:
    """Makes the point attribute, in place of one that is there."""
    kind, key = (WRITTEN | SOFT)[name]
    attribute = point_data.writable(data, name, kind)
    if kind == 'INT8':
        values = values.astype(WHOLE)
    attribute.data.foreach_set(key, values.reshape(-1))


class PATINA_OT_frame_points(Operator):
    """Move the scene's camera and the 3D views, without rotating them, to frame the selected points. Frames all points if none are selected. Ignores distant strays"""

    bl_idname = "object.patina_frame_points"
    bl_label = "Frame Points"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return polls.allowed(cls, "the scene has no camera" if context.scene.camera is None else "") \
            and any(point_data.may_have_points(obj) for obj in context.view_layer.objects)

    def execute(self, context: Context) -> set[str]:
        depsgraph = context.evaluated_depsgraph_get()
        try:
            corners = corners_of(depsgraph, {obj for obj in context.selected_objects if point_data.may_have_points(obj)}, context.scene.frame_current)
        except native.PatinaError as error:
            self.report({'ERROR'}, f"Patina: {error}")
            return {'CANCELLED'}
        if not corners:
            self.report({'WARNING'}, "There are no points to frame")
            return {'CANCELLED'}
        frame(context, corners)
        camera = context.scene.camera.data
        before = camera.clip_start, camera.clip_end
        widen_clips(context.scene.camera, corners)
        for name, old, new in zip(("Start", "End"), before, (camera.clip_start, camera.clip_end), strict=True):
            if new != old:
                self.report({'INFO'}, f"Patina: set the camera's Clip {name} to {new:.4g}")
        return {'FINISHED'}


def frame(context: Context, corners: list[Vector]) -> None:
    """Moves the scene's camera and the 3D views, without rotating them, so that they see all corners."""
    camera, depsgraph = context.scene.camera, context.evaluated_depsgraph_get()
    flat = [value for corner in corners for value in corner]
    place, scale = camera.evaluated_get(depsgraph).camera_fit_coords(depsgraph, flat)
    camera.matrix_world = Matrix.LocRotScale(place, camera.matrix_world.to_quaternion(), camera.matrix_world.to_scale())
    if camera.data.type == 'ORTHO':
        camera.data.ortho_scale = scale
    _move_views(context, corners)


def widen_clips(camera: bpy.types.Object, corners: list[Vector]) -> None:
    """Changes Clip Start and Clip End where a corner is nearer or farther than the camera sees."""
    place, rotation, _ = camera.matrix_world.decompose()
    forward = rotation @ Vector((0.0, 0.0, -1.0))
    near = min((corner - place).dot(forward) for corner in corners)
    far = max((corner - place).length for corner in corners)
    if 0.0 < near < camera.data.clip_start:
        camera.data.clip_start = 0.5 * near
    if camera.data.clip_end < far:
        camera.data.clip_end = 1.2 * far


def _move_views(context: Context, corners: list[Vector]) -> None:
    """The window's 3D views look at the corners' middle, from so far that they see all and as far as that takes. They begin no nearer than
    Blender's depths, of 24 bits, can tell overlays from points amid them."""
    middle = sum(corners, Vector()) / len(corners)
    radius = max((corner - middle).length for corner in corners)
    for area in context.screen.areas if context.screen else ():
        if area.type != 'VIEW_3D' or not radius:
            continue
        space = area.spaces.active
        view = space.region_3d
        if view.view_perspective == 'CAMERA':
            continue
        view.view_location = middle
        view.view_distance = radius * max(space.lens / VIEW_SENSOR, 0.5) * 1.7
        reach = 2.0 * (view.view_distance + radius)
        space.clip_start, space.clip_end = max(space.clip_start, NEAREST * reach), max(space.clip_end, reach)


def corners_of(depsgraph: bpy.types.Depsgraph, chosen: set[bpy.types.Object], frame: int) -> list[Vector]:
    """In the world: of the chosen objects and what they make, points of Geometry Nodes and instances; with none chosen of all that is
    points, without such of all. PatinaError where a file cannot be read."""
    points: list[Vector] = []
    others: list[Vector] = []  # of faces, where points are looked for
    boxes: dict[int, list[Vector]] = {}  # by datablock: a thousand instances share one
    radii: dict[tuple[int, str], float] = {}
    surface = depsgraph.scene_eval.patina.surface
    for instance in depsgraph.object_instances:
        obj = instance.object
        owner = instance.parent if instance.is_instance else obj
        if not point_data.may_have_points(obj) or chosen and owner.original not in chosen or not losses.is_placed(instance, []):
            continue
        key = obj.data.as_pointer()
        if key not in boxes:
            boxes[key] = dense_corners(obj, frame)
        solid = not chosen and obj.type == 'MESH' and len(obj.data.polygons) and not obj.patina.linked_file
        corners = boxes[key] if solid else _widened(boxes[key], instance.matrix_world, _radius_of(obj, surface, frame, radii))
        (others if solid else points).extend(instance.matrix_world @ corner for corner in corners)
    return points or others


def _radius_of(obj: bpy.types.Object, surface: str, frame: int, known: dict[tuple[int, str], float]) -> tuple[float, float]:
    """How far beyond its place a point may show, as the radius of its disc or soft ball: in the world where one is set for all, and in the
    object's units where points have their own. Points of one object may be discs and balls."""
    patina, soft = obj.patina, obj.patina.soft
    balls = soft.use and not (soft.hide and soft.by != 'ALL')
    discs = (not (balls and soft.by == 'ALL') and not patina.ranges.use
             and (surface == 'SPLATS' or surface == 'AUTO' and analysis.wanted(obj) != 0))
    ones = [soft.radius if soft.use_radius else 0.0] * balls + [patina.radius] * discs
    if all(ones):
        return max(ones, default=0.0), 0.0
    name = content.radius_name(obj, surface)
    key = (obj.data.as_pointer(), name)
    if key not in known:
        known[key] = _largest_radius(obj, name, frame)
    return max(ones), known[key]


def _largest_radius(obj: bpy.types.Object, name: str, frame: int) -> float:
    if obj.patina.linked_file:
        source = linked.source_of(obj, frame, [])
        return jobs.run(lambda: linked.load(source), lambda: None, lambda: False).cloud.radius_most if source else 0.0
    if not name:
        return 0.0
    with attributes.readable(obj) as data:
        values = attributes.scalars(data, point_data.count_of(data), name)
    values = values[np.isfinite(values)] if values is not None else np.empty(0)
    return max(float(values.max()), 0.0) if len(values) else 0.0


def _widened(corners: list[Vector], matrix: Matrix, radius: tuple[float, float]) -> list[Vector]:
    """The corners of a box in the object's space, farther apart by a radius of the world and one of the object."""
    if not corners or not any(radius):
        return corners
    middle = sum(corners, Vector()) / len(corners)
    stretch = [matrix.col[k].to_3d().length for k in range(3)]
    most = max(stretch)
    reach = [max(radius[0], radius[1] * most) / stretch[k] if stretch[k] > 0.0 else 0.0 for k in range(3)]
    signs = [[1.0 if i >> k & 1 else -1.0 for k in range(3)] for i in range(8)]
    half = [max(abs(corner[k] - middle[k]) for corner in corners) for k in range(3)]
    return [Vector(middle[k] + sign[k] * (half[k] + reach[k]) for k in range(3)) for sign in signs]


def dense_corners(obj: bpy.types.Object, frame: int) -> list[Vector]:
    """Of the box without strays, in the object's space. Of a mesh with faces, of all of it. PatinaError where a file cannot be read."""
    if obj.patina.linked_file:
        source = linked.source_of(obj, frame, [])
        if source is None:
            return []
        box = _box_of(jobs.run(lambda: linked.load(source), lambda: None, lambda: False).cloud)
    else:
        with attributes.readable(obj) as data:
            count = point_data.count_of(data)
            positions = attributes.positions(data, count) if count else None
        if positions is None:
            return []
        if obj.type == 'MESH' and len(obj.data.polygons):
            return [Vector(corner) for corner in obj.bound_box]
        box = jobs.run(lambda: _dense_box(positions), lambda: None, lambda: False)
    return [Vector(box[i >> k & 1][k] for k in range(3)) for i in range(8)] if box else []


def _box_of(cloud: native.Cloud) -> Box | None:
    return cloud.dense_box() if cloud.drawn else None


def _dense_box(positions: np.ndarray) -> Box | None:
    """Known by what the places hash to: an import frames its points, Set Up frames them again and asks what light reaches them, and a
    cloud takes a hundred times as long as the hash."""
    places = native.start_fingerprint(positions, None, None, None).result()
    if places not in _boxes:
        _boxes[places] = _box_of(native.Cloud(positions))
        while len(_boxes) > BOXES:
            _boxes.popitem(last=False)
    return _boxes[places]


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_analyze, PATINA_OT_frame_points))
