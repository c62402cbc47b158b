# SPDX-License-Identifier: GPL-3.0-or-later
"""The distance of a cloud to another one, and its height above the ground, as attributes that color the points."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np
from bpy.props import EnumProperty, FloatProperty
from bpy.types import Context, Event, Object, Operator

from .. import jobs, native, point_data
from ..native.measure import Ground, Scales, distance_scales, ground_lengths, start_distance, start_ground
from ..read.importers import Progress
from ..sync.analyses import measuring
from ..sync.points import attributes, coloring
from . import linked_points, polls
from .steps import Stepped

_items: list[tuple] = []  # Blender keeps no reference to the texts


def _length(name: str, description: str) -> FloatProperty:
    return FloatProperty(name=name, default=0.0, min=0.0, soft_max=100.0, precision=3, subtype='DISTANCE', unit='LENGTH',
                         options={'SKIP_SAVE'}, description=description)


def _others(_self: Operator, context: Context | None) -> list[tuple]:
    """Objects that the active one can be compared with, the selected ones first."""
    active = context.object if context else None
    found = [obj for obj in context.scene.objects if point_data.may_have_points(obj) and obj != active] if context else []
    found.sort(key=lambda obj: (not obj.select_get(), obj.type == 'MESH' and bool(len(obj.data.polygons)), obj.name))
    _items[:] = [(obj.name, obj.name, "") for obj in found] or [("", "None", "The scene has no other cloud and no mesh")]
    return _items


def _zero(obj: Object) -> np.ndarray:
    return np.array(obj.matrix_world.translation, np.float64)


class _Measuring(Stepped):
    """Of a cloud that Blender holds: a dialog, then steps, then a color."""

    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context: Context) -> bool:
        obj = context.object
        if not point_data.may_have_points(obj) or obj.mode != 'OBJECT':
            return polls.allowed(cls, "Select points, in Object Mode")
        if obj.patina.linked_file:
            return polls.allowed(cls, linked_points.why_not(obj) or
                                 "Linked clouds hold no attributes. Convert to Mesh, or import the file without Link")
        if not point_data.holds_points(obj):
            return polls.allowed(cls, "Meshes with faces cannot be measured. Select a cloud")
        return polls.allowed(cls, "The points are of another file. Make them local first" if obj.data.library else cls.why_not(context))

    @classmethod
    def why_not(cls, _context: Context) -> str:
        return ""

    def invoke(self, context: Context, _event: Event) -> set[str]:
        self._progress = Progress()
        try:
            self.suggest(context)
        except native.PatinaError as error:
            self.report({'ERROR'}, f"Patina: {error}")
            return {'CANCELLED'}
        self._invoked = True
        return context.window_manager.invoke_props_dialog(self, width=320)

    def propose(self, **lengths: float) -> None:
        """Sets the properties that the caller left out, to two digits as an artist would choose them."""
        for name, value in lengths.items():
            if not self.properties.is_property_set(name):
                setattr(self, name, float(f"{value:.2g}"))

    def execute(self, context: Context) -> set[str]:
        self._progress = Progress()
        return self.begin(context, self._measure(context, context.object))

    def _measure(self, context: Context, obj: Object) -> jobs.Steps[set[str]]:
        try:
            text = yield from self.measure(context, obj)
        except native.PatinaCancelled:
            self.report({'INFO'}, "Patina: canceled. Nothing was written")
            return {'CANCELLED'}
        except native.PatinaError as error:
            self.report({'ERROR'}, f"Patina: {error}")
            return {'CANCELLED'}
        self.report({'INFO'}, text)
        return {'FINISHED'}


def _color_by(obj: Object, name: str, frame: int) -> None:
    """Colors the points by an attribute, with a legend."""
    point_data.changed(obj.data)
    choice = next(choice for choice in coloring.choices(obj) if choice.source == 'SCALAR' and choice.attribute == name)
    coloring.apply(obj, choice, frame)
    obj.patina.colors.use_legend = True


class PATINA_OT_cloud_distance(_Measuring, Operator):
    """Measure the distance of the active points to another cloud or mesh, along their normals (M3C2). Stores the distance and its 95 % confidence interval as attributes, and colors the points by the distance"""

    bl_idname = "object.patina_cloud_distance"
    bl_label = "Distance to Cloud"

    other: EnumProperty(name="Other", items=_others, options={'SKIP_SAVE'}, description="Cloud or mesh that the distance is measured to")
    cylinder: _length("Cylinder", "Diameter of the cylinder whose points are averaged: about 30 points. 0 chooses it by the spacing")
    normal_scale: _length("Normal Scale", "Diameter of the ball whose points give the normal. 0 is twice the cylinder")
    depth: _length("Depth", "Surfaces farther away than this are not looked for. 0 is ten cylinders")
    registration_error: _length("Registration Error", "How well the clouds are aligned, as a standard deviation. It widens the interval")

    @classmethod
    def why_not(cls, context: Context) -> str:
        return "" if _others(None, context)[0][0] else "The scene has no other cloud and no mesh"

    def draw(self, _context: Context) -> None:
        self.layout.use_property_split = True
        for name in ("other", "cylinder", "normal_scale", "depth", "registration_error"):
            self.layout.prop(self, name)

    def suggest(self, context: Context) -> None:
        own = measuring.places(context.object, context.object.data, _zero(context.object))
        found = distance_scales(own, self._points_of(context, own, True), Scales())
        self.propose(cylinder=found.cylinder, normal_scale=found.normal_scale, depth=found.depth)

    def measure(self, context: Context, obj: Object) -> jobs.Steps[str]:
        own = measuring.places(obj, obj.data, _zero(obj))
        self._progress.doing = "Measuring distances"
        other = self._points_of(context, own, False)
        scales = distance_scales(own, other, self._scales())
        yield jobs.Pause()
        with self._progress.inner() as inner:
            task = start_distance(own, other, measuring.normals(obj), scales, inner)
        yield task
        distance, interval = task.result()
        known = np.isfinite(distance)
        if not known.any():
            raise native.PatinaError(f"'{self.other}' has no surface within {scales.depth:.3g} of the points of '{obj.name}'. Choose a greater Depth "
                                     "or Cylinder. Nothing was written")
        measuring.write(obj, measuring.DISTANCE, distance)
        measuring.write(obj, measuring.INTERVAL, interval)
        _color_by(obj, measuring.DISTANCE, context.scene.frame_current)
        changed = int((np.abs(distance[known]) > interval[known]).sum())
        return (f"Measured {int(known.sum()):,} of {len(distance):,} points: median {np.median(distance[known]):.3g}, "
                f"{changed:,} changed by more than their interval")

    def _scales(self) -> Scales:
        return Scales(self.cylinder, self.normal_scale, self.depth, self.registration_error)

    def _points_of(self, context: Context, own: np.ndarray, cloud_only: bool) -> np.ndarray:
        """(n, 3) places of the other object, from the active one. cloud_only: none of a mesh, whose samples depend on the scales."""
        other = context.scene.objects.get(self.other)
        if other is None:
            raise native.PatinaError("choose the other cloud or mesh")
        if other.patina.linked_file:
            found = jobs.finish(measuring.linked_places(other, context.scene.frame_current, None, self._progress))
            return measuring.in_world(other, found, _zero(context.object))
        zero = _zero(context.object)
        evaluated = other.evaluated_get(context.evaluated_depsgraph_get())
        with attributes.readable(evaluated) as data:
            if other.type != 'MESH' or not len(data.polygons):
                return measuring.places(other, data, zero)
            if cloud_only:
                return np.empty((0, 3))
            scales = distance_scales(own, np.empty((0, 3)), replace(self._scales(), registration_error=0.0))
            return measuring.sampled(other, data, zero, scales.cylinder / measuring.SAMPLES)


class PATINA_OT_height_above_ground(_Measuring, Operator):
    """Find the ground under the active points, with the world's Z up. Stores the height of each point above it as an attribute, and colors the points by it"""

    bl_idname = "object.patina_height_above_ground"
    bl_label = "Height Above Ground"

    cell: _length("Cell", "Width of the cells in which the ground is found. 0 chooses it by extent and spacing")
    largest: _length("Largest Object", "Width of the largest building or other object on the ground. Wider ones count as ground. 0 is 100 cells")
    threshold: _length("Threshold", "Points nearer to the ground than this count as ground. 0 is one cell")

    def draw(self, _context: Context) -> None:
        self.layout.use_property_split = True
        for name in ("cell", "largest", "threshold"):
            self.layout.prop(self, name)

    def suggest(self, context: Context) -> None:
        found = ground_lengths(measuring.places(context.object, context.object.data, _zero(context.object)), Ground())
        self.propose(cell=found.cell, largest=found.largest, threshold=found.threshold)

    def measure(self, context: Context, obj: Object) -> jobs.Steps[str]:
        own = measuring.places(obj, obj.data, _zero(obj))
        self._progress.doing = "Finding the ground"
        yield jobs.Pause()
        with self._progress.inner() as inner:
            task = start_ground(own, Ground(self.cell, self.largest, self.threshold), inner)
        yield task
        height, ground = task.result()
        if not np.isfinite(height).any():
            raise native.PatinaError(f"'{obj.name}' has no finite positions")
        measuring.write(obj, measuring.HEIGHT, height)
        _color_by(obj, measuring.HEIGHT, context.scene.frame_current)
        return (f"Found the ground of {len(height):,} points: {int(ground.sum()):,} are ground, the highest is "
                f"{np.nanmax(height):.3g} above it")


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_cloud_distance, PATINA_OT_height_above_ground))
