# SPDX-License-Identifier: GPL-3.0-or-later
"""Points are selected by the values of an attribute: those of a mesh for Edit Mode here, those of a linked cloud by points.py."""

from __future__ import annotations

import bpy
import numpy as np
from bpy.props import EnumProperty, FloatProperty, StringProperty
from bpy.types import Context, Event, Object, Operator

from .. import jobs, native, point_data
from ..read import importers
from ..sync.points import attributes, linked, origin
from . import polls

HOW = (('SET', "Set", "Select only these points", 0), ('ADD', "Extend", "Add to the selection", 1), ('SUB', "Subtract", "Remove from the selection", 2),
       ('AND', "Intersect", "Keep only selected points that are also in this group", 3))


def attribute_property() -> StringProperty:
    return StringProperty(name="Attribute", options={'SKIP_SAVE'},
                          description="Name of the attribute. Empty: the one that colors the points, or else the height in the world")


def limit_property(name: str, description: str) -> FloatProperty:
    return FloatProperty(name=name, default=0.0, options={'SKIP_SAVE'}, description=description)


LEAST, MOST = ("Minimum", "Smallest value that is selected"), ("Maximum", "Largest value that is selected")


def name_of(obj: Object, name: str) -> str:
    """The attribute that is meant; "": the height."""
    group = obj.patina.colors
    return name or (group.scalar if group.source == 'SCALAR' else "")


def within(values: np.ndarray, least: float, most: float) -> np.ndarray:
    """(n,) bool. Limits are float32, as Blender's properties. PatinaError if they hold no value at all."""
    if least > most:
        raise native.PatinaError(f"the minimum {least:g} is greater than the maximum {most:g}")
    values = values.astype(np.float32)
    return (values >= np.float32(least)) & (values <= np.float32(most))


def suggested(obj: Object, name: str) -> tuple[float, float]:
    """The range of colors if that is what is asked for, else of the values that Blender holds."""
    group = obj.patina.colors
    if group.use_range and group.source == 'SCALAR' and name_of(obj, name) == group.scalar:
        return group.range_min, group.range_max
    if obj.patina.linked_file:
        return 0.0, 0.0
    values = of_mesh(obj, name)
    values = values[np.isfinite(values)]
    return (float(values.min()), float(values.max())) if len(values) else (0.0, 0.0)


def of_mesh(obj: Object, name: str) -> np.ndarray:
    """(n,) of an object with points that Blender holds, in Object Mode. PatinaError if it has no such attribute."""
    data, name = obj.data, name_of(obj, name)
    count = point_data.count_of(data)
    if not name:
        matrix = obj.matrix_world
        return attributes.positions(data, count).astype(np.float64) @ np.array(matrix[2][:3]) + matrix[2][3]
    values = attributes.scalars(data, count, name)
    if values is None:
        raise native.PatinaError(f"'{obj.name}' has no attribute '{name}' of numbers")
    return values[:, 0]


def of_linked(obj: Object, name: str, frame: int) -> np.ndarray:
    """(n,) of a linked cloud's points in the order of its file, which is read for it. PatinaError."""
    source, name = linked.source_of(obj, frame, []), name_of(obj, name)
    if source is None:
        raise native.PatinaError("the file is missing")
    if source.is_saved:
        raise native.PatinaError("a saved cloud does not give its values. Link the file that it was made from")
    points = jobs.run(lambda: importers.reader(source.path).read(source.path, importers.Filter(), importers.Progress()), lambda: None, lambda: False)
    if name:
        if name not in points.scalars:
            known = ", ".join(points.scalars) or "none"
            raise native.PatinaError(f"the file has no attribute '{name}'. It has: {known}")
        return points.scalars[name].reshape(-1)
    own = np.array(obj.get(origin.PROPERTY, points.origin), np.float64)
    matrix = obj.matrix_world
    return (points.positions + (np.array(points.origin) - own)) @ np.array(matrix[2][:3]) + matrix[2][3]


class PATINA_OT_select_by_value(Operator):
    """Select the points of a mesh whose attribute lies within a range, for Edit Mode"""

    bl_idname = "mesh.patina_select_by_value"
    bl_label = "Select Points by Value"
    bl_options = {'REGISTER', 'UNDO'}

    attribute: attribute_property()
    least: limit_property(*LEAST)
    most: limit_property(*MOST)
    how: EnumProperty(name="How", items=HOW)

    @classmethod
    def poll(cls, context: Context) -> bool:
        obj = context.object
        if obj is None or obj.type != 'MESH' or obj.patina.linked_file or obj.mode not in {'OBJECT', 'EDIT'} or not len(obj.data.vertices):
            return polls.allowed(cls, "Select a mesh of points. Convert point clouds to a mesh first")
        return polls.allowed(cls, "The points are of another file. Make them local first" if obj.data.library else "")

    def invoke(self, context: Context, _event: Event) -> set[str]:
        try:
            if not self.properties.is_property_set("least") and not self.properties.is_property_set("most"):
                with _object_mode(context.object):
                    self.least, self.most = suggested(context.object, self.attribute)
        except native.PatinaError as error:
            self.report({'WARNING'}, f"Patina: {error}")
        return context.window_manager.invoke_props_dialog(self, width=320)

    def draw(self, context: Context) -> None:
        self.layout.use_property_split = True
        self.layout.prop_search(self, "attribute", context.object.data, "attributes")
        for name in ("least", "most", "how"):
            self.layout.prop(self, name)

    def execute(self, context: Context) -> set[str]:
        obj = context.object
        try:
            with _object_mode(obj):
                total = self._select(obj)
        except native.PatinaError as error:
            self.report({'ERROR'}, f"Patina: {error}")
            return {'CANCELLED'}
        self.report({'INFO'}, f"Selected {total:,} of {len(obj.data.vertices):,} points")
        return {'FINISHED'}

    def _select(self, obj: Object) -> int:
        mesh = obj.data
        old, hidden = np.zeros(len(mesh.vertices), bool), np.zeros(len(mesh.vertices), bool)
        mesh.vertices.foreach_get("select", old)
        mesh.vertices.foreach_get("hide", hidden)
        new = within(of_mesh(obj, self.attribute), self.least, self.most)
        new = {'SET': new, 'ADD': old | new, 'SUB': old & ~new, 'AND': old & new}[self.how] & ~hidden
        if len(mesh.polygons):
            mesh.polygons.foreach_set("select", np.zeros(len(mesh.polygons), bool))
        if len(mesh.edges):
            mesh.edges.foreach_set("select", np.zeros(len(mesh.edges), bool))
        mesh.vertices.foreach_set("select", new)
        mesh.update()
        return int(new.sum())


class _object_mode:
    """A mesh in Edit Mode keeps its points elsewhere: it leaves the mode, and enters it again."""

    def __init__(self, obj: Object) -> None:
        self._edits = obj.mode == 'EDIT'

    def __enter__(self) -> None:
        if self._edits:
            bpy.ops.object.mode_set(mode='OBJECT')

    def __exit__(self, *_: object) -> None:
        if self._edits:
            bpy.ops.object.mode_set(mode='EDIT')


def _menu(self: bpy.types.Menu, _context: Context) -> None:
    self.layout.separator()
    self.layout.operator(PATINA_OT_select_by_value.bl_idname)


def register() -> None:
    bpy.utils.register_class(PATINA_OT_select_by_value)
    bpy.types.VIEW3D_MT_select_edit_mesh.append(_menu)


def unregister() -> None:
    bpy.types.VIEW3D_MT_select_edit_mesh.remove(_menu)
    bpy.utils.unregister_class(PATINA_OT_select_by_value)
