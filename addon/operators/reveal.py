# SPDX-License-Identifier: GPL-3.0-or-later
"""Reveal: points that appear by height, time, class or distance, by keyframes of clips, hidden classes and soft points."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty
from bpy.types import Context, Object, Operator
from mathutils import Vector

from .. import jobs, native, point_data
from ..properties.colors import CLASSES
from ..sync.points import attributes, coloring, linked
from ..sync.points.colors import scalar_name
from . import analyze, camera_paths, keys, polls

MARGIN = 1e-3  # of a range, beyond either end: at the first frame nothing shows
STRAYS = 0.01  # of the height: strays farther than this from the others take the first and last frame alone
SOFT = ("use", "by", "attribute", "hide", "use_range", "range_min", "range_max", "invert", "threshold", "target", "shape")


class Refused(Exception):
    """Why points cannot be revealed so; the text is for the user."""


class PATINA_OT_reveal(Operator):
    """Let the selected points appear over the scene's frames. Reveals all points if none are selected"""

    bl_idname = "object.patina_reveal"
    bl_label = "Reveal"
    bl_options = {'REGISTER', 'UNDO'}

    by: EnumProperty(name="Reveal By", default='HEIGHT', items=(
        ('HEIGHT', "Height", "A clip plane moves through the points. It clips all clouds whose Clip is enabled", 0),
        ('TIME', "Time", "Points appear in the order of a point attribute, such as the time of their measurement", 1),
        ('CLASS', "Class", "Classes appear one after another", 2),
        ('DISTANCE', "Distance", "Points appear in the order of their distance from an empty. A selected object without points is used instead",
         3)))
    frames: IntProperty(name="Frames", default=250, min=keys.LEAST_FRAMES, soft_max=2000, options={'SKIP_SAVE'},
                        description="Number of frames. The scene's frame range ends after them")
    attribute: StringProperty(name="Attribute", description="Point attribute for Time. Empty: the time of the measurement")
    invert: BoolProperty(name="From the End", default=False, description="Begin with the highest, latest or farthest points, or with the last class")
    vanish: BoolProperty(name="Vanish", default=False, description="Play it backward: the points disappear")

    @classmethod
    def poll(cls, context: Context) -> bool:
        return polls.allowed(cls, "" if camera_paths.chosen(context) else "the scene has no points")

    def execute(self, context: Context) -> set[str]:
        objects = camera_paths.chosen(context)
        before = [(obj, {name: getattr(obj.patina.soft, name) for name in SOFT}) for obj in objects]
        work = {'HEIGHT': self._by_height, 'TIME': self._by_time, 'CLASS': self._by_class, 'DISTANCE': self._by_distance}[self.by]
        try:
            said = work(context, objects)
        except (native.PatinaError, Refused) as error:
            for obj, values in before:
                for name, value in values.items():
                    setattr(obj.patina.soft, name, value)
            self.report({'ERROR'}, f"Patina: {error}")
            return {'CANCELLED'}
        self.report({'INFO'}, said)
        return {'FINISHED'}

    def draw(self, _context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "by")
        layout.prop(self, "frames")
        if self.by == 'TIME':
            layout.prop(self, "attribute")
        layout.prop(self, "invert")
        layout.prop(self, "vanish")

    def _span(self, context: Context) -> tuple[int, int, int]:
        """Number of frames, the first and the last."""
        frames, first = keys.take_frames(self, context.scene), context.scene.frame_start
        return frames, first, first + frames - 1

    def _in_order(self, context: Context, values: Sequence[float]) -> list[tuple[float, float]]:
        """(frame, value) pairs, evenly from the first frame to the last, or backward."""
        _, first, last = self._span(context)
        return list(zip(np.linspace(first, last, len(values)).tolist(), values[::-1] if self.vanish else values, strict=True))

    # ---- height

    def _by_height(self, context: Context, objects: list[Object]) -> str:
        dense, whole = (np.array(corners, np.float64) for corners in (_corners(context, objects), _boxes(objects)))
        lower, upper = dense.min(axis=0), dense.max(axis=0)
        height = max(float(upper[2] - lower[2]), float(np.spacing(np.float32(np.abs(dense).max()))), 1e-6)
        ends = [float(lower[2]) - MARGIN * height, float(upper[2]) + MARGIN * height]
        bottom, top = min(ends[0], float(whole[:, 2].min()) - MARGIN * height), max(ends[1], float(whole[:, 2].max()) + MARGIN * height)
        frames, first, last = self._span(context)
        marks = [(first, bottom), (last, top)]
        if bottom < ends[0] - STRAYS * height or top > ends[1] + STRAYS * height:
            marks = [(first, bottom), (first + 1, ends[0]), (last - 1, ends[1]), (last, top)] if frames > 4 else marks
        if self.invert != self.vanish:
            marks = [(first + last - frame, value) for frame, value in reversed(marks)]
        empty = bpy.data.objects.new("Reveal Plane", None)
        empty.empty_display_type = 'SINGLE_ARROW'
        empty.empty_display_size = 0.2 * max(*(upper - lower).tolist(), 1e-3)
        empty.location = (*(0.5 * (lower + upper)).tolist()[:2], marks[0][1])
        empty.patina.clip.shape, empty.patina.clip.cut = 'PLANE', self.invert
        context.collection.objects.link(empty)
        keys.add(empty, "location", 2, marks, 'LINEAR')
        context.scene.frame_set(context.scene.frame_current)
        shy = [obj.name for obj in objects if not obj.patina.colors.use_clips]
        left = f". Enable Clip for {', '.join(map(repr, shy))}, which it does not clip" if shy else ""
        return f"Keyframes move '{empty.name}' through the points. It clips all clouds whose Clip is enabled{left}"

    # ---- class

    def _by_class(self, context: Context, objects: list[Object]) -> str:
        there = {obj: _classes(obj, context.scene.frame_current) for obj in objects}
        numbers = sorted({number for found in there.values() for number in found if number < CLASSES})[::-1 if self.invert else 1]
        if len(numbers) < 2:
            has = f"only class {numbers[0]}" if numbers else "no class from 0 to 31"
            raise Refused(f"the points have {has}. Reveal By Class needs at least two")
        frames, first, last = self._span(context)
        for place, number in enumerate(numbers):
            begins = first + place * frames // len(numbers)
            marks = [(first, 1.0), (begins, 0.0)] if begins > first else [(first, 0.0)]
            if self.vanish:
                marks = [(first, 0.0), (last + 1 - (begins - first), 1.0)]
            for obj in [obj for obj, found in there.items() if number in found and (
                    not obj.patina.colors.hidden[number] or keys.is_keyed(obj, "patina.colors.hidden", number))]:
                keys.add(obj, "patina.colors.hidden", number, marks, 'CONSTANT')
        context.scene.frame_set(context.scene.frame_current)
        others = sorted({number for found in there.values() for number in found if number >= CLASSES})
        if others:
            self.report({'WARNING'}, f"Classes above 31 cannot be keyed and stay visible: {', '.join(map(str, others))}")
        return f"Keyframes of Hidden Classes show {len(numbers)} classes, one after another"

    # ---- attribute and distance

    def _by_time(self, context: Context, objects: list[Object]) -> str:
        ranges = {}
        for obj in objects:
            group, name = self._softened(obj, context), self.attribute or _time_of(obj)
            if not name:
                raise Refused(f"'{obj.name}' has no attribute for the time of its points. Name one under Attribute")
            if obj.patina.linked_file and scalar_name(obj) not in {"", name}:
                raise Refused(f"'{obj.name}' is colored by '{scalar_name(obj)}', and a linked cloud holds one column. Set Color By to Color")
            group.by, group.attribute, group.use = 'ATTRIBUTE', name, True
            ranges[obj] = _range_of(obj, name, context.scene.frame_current)
        for obj, (low, high) in ranges.items():
            self._key_threshold(context, obj, low, high)
        context.scene.frame_set(context.scene.frame_current)
        return f"Keyframes of Soft Points > Threshold show the points in the order of '{objects[-1].patina.soft.attribute}'"

    def _by_distance(self, context: Context, objects: list[Object]) -> str:
        groups = [self._softened(obj, context) for obj in objects]
        corners = np.array(_boxes(objects) if self.invert else _corners(context, objects), np.float64)
        others = [obj for obj in context.selected_objects if not point_data.may_have_points(obj)]
        center = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
        extent = float(np.ptp(corners, axis=0).max())
        target = (context.object if context.object in others else others[0]) if others else bpy.data.objects.new("Reveal Center", None)
        if not others:
            target.location = center
            target.empty_display_size = 0.1 * extent or 1.0
            context.collection.objects.link(target)
        else:
            center = np.array(target.matrix_world.translation)
        far = float(np.linalg.norm(corners - center, axis=1).max()) or 1.0
        for obj, group in zip(objects, groups, strict=True):
            group.by, group.shape, group.target, group.use = 'DISTANCE', 'POINT', target, True
            self._key_threshold(context, obj, 0.0, far)
        context.scene.frame_set(context.scene.frame_current)
        return f"Keyframes of Soft Points > Threshold show the points in the order of their distance from '{target.name}'"

    def _softened(self, obj: Object, context: Context) -> bpy.types.PropertyGroup:
        """The object's settings of soft points, if they are free."""
        group = obj.patina.soft
        if group.use and not group.hide:
            raise Refused(f"'{obj.name}' has soft points, and their threshold is needed. Disable Soft Points, or reveal by height or class")
        if obj.patina.linked_file and (source := linked.source_of(obj, context.scene.frame_current, [])) and source.streamed:
            raise Refused(f"the points of '{obj.name}' are read as needed. Use Linked File > Read Whole, or reveal by height or class")
        return group

    def _key_threshold(self, context: Context, obj: Object, low: float, high: float) -> None:
        """Hides what is above the threshold, and keys it from 0 to 1."""
        group, more = obj.patina.soft, MARGIN * (high - low)
        group.use_range, group.range_min, group.range_max = True, low - more, high + more
        group.hide, group.invert = True, self.invert
        keys.add(obj, "patina.soft.threshold", -1, self._in_order(context, [0.0, 1.0]), 'LINEAR')


def _corners(context: Context, objects: list[Object]) -> list[Vector]:
    """In the world, of the boxes without strays."""
    found = analyze.corners_of(context.evaluated_depsgraph_get(), set(objects), context.scene.frame_current)
    found = [corner for corner in found if np.isfinite(corner).all()]
    if not found:
        raise Refused("there are no points to reveal. Select objects with points")
    return found


def _boxes(objects: list[Object]) -> list[Vector]:
    """In the world, of all points."""
    return [obj.matrix_world @ Vector(corner) for obj in objects for corner in point_data.corners(obj)]


def _cloud_of(obj: Object, frame: int) -> native.Cloud:
    """Of a linked file. PatinaError if it cannot be read."""
    notices: list[str] = []
    source = linked.source_of(obj, frame, notices)
    if source is None:
        raise native.PatinaError(notices[0] if notices else f"'{obj.name}': the file is missing")
    return jobs.run(lambda: linked.load(source), lambda: None, lambda: False).cloud


def _classes(obj: Object, frame: int) -> set[int]:
    """The classes that an object's points have."""
    if obj.patina.linked_file:
        bits = _cloud_of(obj, frame).class_bits
        return {number for number in range(256) if bits[number // 32] >> number % 32 & 1}
    with attributes.readable(obj) as data:
        found = attributes.classes(data, point_data.count_of(data), obj.patina.colors.class_attribute)
    return set() if found is None else set(np.unique(found).tolist())


def _time_of(obj: Object) -> str:
    """The attribute that holds the time of points; empty: none is known."""
    if obj.patina.linked_file:
        return "gps_time" if Path(obj.patina.linked_file).suffix.lower() in coloring.LAS else ""
    return next((choice.attribute for choice in coloring.choices(obj) if choice.label.startswith("Time")), "")


def _range_of(obj: Object, name: str, frame: int) -> tuple[float, float]:
    """The least and the greatest value of an attribute."""
    if obj.patina.linked_file:
        cloud = _cloud_of(obj, frame)
        low, high = cloud.scalar_range(0.0) if cloud.has_scalars else (np.nan, np.nan)
    else:
        with attributes.readable(obj) as data:
            values = attributes.scalars(data, point_data.count_of(data), name)
        values = np.empty(0) if values is None else values[np.isfinite(values)]
        low, high = (float(values.min()), float(values.max())) if len(values) else (np.nan, np.nan)
    if not low < high:
        has = f"one value of '{name}'" if low == high else f"no attribute '{name}' with finite values"
        raise Refused(f"'{obj.name}' has {has}. Choose another attribute")
    return low, high


def _draw_menu(self: bpy.types.Menu, context: Context) -> None:
    if any(map(point_data.is_cloud, context.view_layer.objects)):
        self.layout.separator()
        self.layout.operator(camera_paths.PATINA_OT_turntable.bl_idname)
        self.layout.operator(camera_paths.PATINA_OT_walk_through.bl_idname)
        self.layout.operator_menu_enum(PATINA_OT_reveal.bl_idname, "by", text="Reveal Points")


_register, _unregister = bpy.utils.register_classes_factory((PATINA_OT_reveal,))


def register() -> None:
    _register()
    bpy.types.VIEW3D_MT_object_animation.append(_draw_menu)


def unregister() -> None:
    bpy.types.VIEW3D_MT_object_animation.remove(_draw_menu)
    _unregister()
