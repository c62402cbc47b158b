# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of points become PointClouds, and PointClouds become meshes. Objects stay the same: what they hold, their drivers and what points to
them. Blender's own conversion changes the data; what it drops is put back here: custom properties, animation of the data, Geometry Nodes
modifiers and the color attribute that is drawn."""

from __future__ import annotations

import bpy
from bpy.types import ID, Context, Object, Operator

from .. import point_data
from ..read import importers
from ..sync.points import attributes
from . import polls


def why_not(obj: Object | None, kind: str) -> str:
    """Why an object cannot become one of this kind ('MESH' or 'POINTCLOUD'); empty: it can."""
    if kind == 'POINTCLOUD' and not point_data.HAS_CLOUDS:
        return "this needs Blender 4.5 or later"
    if obj is None or obj.type != {'MESH': 'POINTCLOUD', 'POINTCLOUD': 'MESH'}[kind]:
        return "the active object is no mesh" if kind == 'POINTCLOUD' else "the active object is no point cloud"
    if obj.patina.linked_file:
        return "a linked file's points are not Blender's"
    if obj.library or obj.data.library or obj.override_library or obj.data.override_library:
        return "the object belongs to another file"
    if obj.mode != 'OBJECT':
        return "only in Object Mode"
    if kind == 'POINTCLOUD' and (len(obj.data.polygons) or len(obj.data.edges)):
        return "the mesh has edges or faces: a point cloud would lose them"
    return "" if point_data.count_of(obj.data) else "the object has no points"


def dropped(obj: Object, kind: str) -> list[str]:
    """What a conversion would lose: modifiers that a PointCloud cannot have, shape keys."""
    lost = [f"modifier '{modifier.name}'" for modifier in obj.modifiers if modifier.type != 'NODES'] if kind == 'POINTCLOUD' else []
    return lost + (["shape keys"] if getattr(obj.data, "shape_keys", None) else [])


def convert(objects: list[Object], kind: str) -> None:
    """Makes objects that can be of this kind into it. RuntimeError where Blender refuses."""
    kept = [_Kept(obj, kind) for obj in objects]
    try:
        for item in kept:
            for modifier in item.obj.modifiers:
                modifier.show_viewport = False  # Blender applies those that are shown
        point_data.convert(objects, kind)
    finally:
        for item in kept:
            item.restore()


class _Kept:
    """What Blender's conversion of an object drops."""

    def __init__(self, obj: Object, kind: str) -> None:
        data = obj.data
        self.obj, self._kind, self._name = obj, kind, data.name
        self._properties = dict(data.items())
        self._color = _drawn_color(obj)
        self._modifiers = {modifier.name: modifier.show_viewport for modifier in obj.modifiers if modifier.type == 'NODES'}
        self._copy = obj.copy()  # with copies of its modifiers and drivers
        self._data = data if data.animation_data else None
        self._old = data

    def restore(self) -> None:
        obj, data = self.obj, self.obj.data
        if obj.type == self._kind:
            point_data.drop_selection(data)
            for key, value in self._properties.items():
                data[key] = value
            self._restore_color(data)
            if self._data:
                _copy_animation(self._data, data)
        if self._modifiers:
            _copy_modifiers(self._copy, obj, self._modifiers)
        _restore_drivers(self._copy, obj)
        bpy.data.objects.remove(self._copy)
        if obj.type == self._kind:
            if self._old != data and not self._old.users:
                (bpy.data.meshes if isinstance(self._old, bpy.types.Mesh) else bpy.data.pointclouds).remove(self._old)
            data.name = self._name
            point_data.changed(data)
        obj.update_tag()

    def _restore_color(self, data: ID) -> None:
        if self._color is None:
            return
        if hasattr(data.color_attributes, "active_color"):
            index = data.color_attributes.find(self._color)
            if index >= 0:
                data.color_attributes.active_color_index = data.color_attributes.render_color_index = index
        elif not self.obj.patina.color_attribute and _first_color(data) != self._color:
            self.obj.patina.color_attribute = self._color
        if self._kind == 'POINTCLOUD' and not any(data.materials):
            data.materials.clear()
            data.materials.append(point_data.color_material(self._color))


def _drawn_color(obj: Object) -> str | None:
    """The name of the color attribute that is drawn where the artist names none."""
    group = obj.data.color_attributes
    for index in (getattr(group, "render_color_index", -1), getattr(group, "active_color_index", -1)):
        if 0 <= index < len(group) and group[index].domain == 'POINT':
            return group[index].name
    return _first_color(obj.data)


def _first_color(data: ID) -> str | None:
    names = [item.name for item in data.color_attributes if item.domain == 'POINT']
    return next((name for name in (*attributes.COLOR_NAMES, *names) if name in names), None)


def _copy_modifiers(source: Object, obj: Object, shown: dict[str, bool]) -> None:
    """Gives an object the modifiers of another, of these names, in their order."""
    collection, layer = bpy.context.scene.collection, bpy.context.view_layer
    before, active = [item for item in layer.objects if item and item.select_get()], layer.objects.active
    collection.objects.link(source)
    try:
        for item in before:
            item.select_set(False)
        obj.select_set(True)
        source.select_set(True)
        layer.objects.active = source
        for name in shown:
            if name not in obj.modifiers:
                bpy.ops.object.modifier_copy_to_selected(modifier=name)
    finally:
        collection.objects.unlink(source)
        for item in before:
            item.select_set(True)
        layer.objects.active = active
    for name, visible in shown.items():
        if name in obj.modifiers:
            obj.modifiers[name].show_viewport = visible


def _restore_drivers(source: Object, obj: Object) -> None:
    if not source.animation_data:
        return
    there = {(curve.data_path, curve.array_index) for curve in obj.animation_data.drivers} if obj.animation_data else set()
    for curve in source.animation_data.drivers:
        if (curve.data_path, curve.array_index) not in there:
            (obj.animation_data or obj.animation_data_create()).drivers.from_existing(src_driver=curve)


def _copy_animation(old: ID, new: ID) -> None:
    animation = new.animation_data_create()
    if old.animation_data.action:
        animation.action = old.animation_data.action
        slot = getattr(old.animation_data, "action_slot", None)
        if slot:
            try:
                animation.action_slot = slot
            except (TypeError, RuntimeError):
                pass  # a slot of meshes alone
    for curve in old.animation_data.drivers:
        animation.drivers.from_existing(src_driver=curve)


class _Converting:
    bl_options = {'REGISTER', 'UNDO'}
    kind = ''

    @classmethod
    def poll(cls, context: Context) -> bool:
        return polls.allowed(cls, why_not(context.object, cls.kind))

    def execute(self, context: Context) -> set[str]:
        chosen = [obj for obj in {context.object: None, **dict.fromkeys(context.selected_objects)} if not why_not(obj, self.kind)]
        objects, lost = [], []
        for obj in chosen:
            losses = dropped(obj, self.kind)
            if losses:
                lost.append(f"'{obj.name}' stays as it is: a point cloud cannot have {', '.join(losses)}")
            else:
                objects.append(obj)
        for text in lost:
            self.report({'WARNING' if objects else 'ERROR'}, importers.told(f"Patina: {text}. Apply or remove them first"))
        if not objects:
            return {'CANCELLED'}
        counts = [point_data.count_of(obj.data) for obj in objects]
        try:
            convert(objects, self.kind)
        except RuntimeError as error:
            self.report({'ERROR'}, importers.told(f"Patina: {error}"))
            return {'CANCELLED'}
        for obj in objects:
            if obj.type == 'POINTCLOUD':
                count = point_data.count_of(obj.data)
                point_data.add_display_radii(obj.data, attributes.positions(obj.data, count))
                point_data.spare_spheres(obj)
            else:
                point_data.drop_display_radii(obj.data)
        self.report({'INFO'}, f"Converted {sum(counts):,} points of {len(objects)} object{'s' * (len(objects) > 1)}")
        return {'FINISHED'}


class PATINA_OT_to_point_cloud(_Converting, Operator):
    """Convert the selected meshes of points to point cloud objects, which Solid shading shows in color. Keeps attributes, materials, edits, scans, styles, drivers and Geometry Nodes modifiers"""

    bl_idname = "object.patina_to_point_cloud"
    bl_label = "Convert to Point Cloud"
    kind = 'POINTCLOUD'


class PATINA_OT_to_mesh(_Converting, Operator):
    """Convert the selected point cloud objects to meshes of points. Keeps attributes, materials, edits, scans, styles, drivers and Geometry Nodes modifiers"""

    bl_idname = "object.patina_to_mesh"
    bl_label = "Convert to Mesh"
    kind = 'MESH'


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_to_point_cloud, PATINA_OT_to_mesh))
