# SPDX-License-Identifier: GPL-3.0-or-later
"""Measure Points: a tool that picks points of the shown surface and keeps a measurement, and an operator that takes coordinates."""

from __future__ import annotations

import bpy
import numpy as np
from bpy.props import EnumProperty, StringProperty
from bpy.types import Context, Event, Object, Operator, WorkSpaceTool

from ..description.measures import COUNTS, MeasureError
from ..properties.measures import KINDS, redraw
from ..sync import measures
from .picking import PickPoints, Reports
from .view_surface import Hit


def _kind_property() -> EnumProperty:
    return EnumProperty(name="Kind", items=KINDS, default='DISTANCE', description="What is measured between the points")


def owner_of(context: Context, name: str) -> Object:
    """The object of the scene with this full name. MeasureError."""
    obj = next((obj for obj in context.view_layer.objects if obj.name_full == name), None)
    if obj is None:
        raise MeasureError(f"'{name}' is only shown as an instance: measure on an object of this view layer")
    return obj


class _Kept:
    """Beside bpy.types.Operator."""

    def _kept(self, context: Context, obj: Object) -> set[str]:
        """Says what the last measurement of the object is."""
        found = measures.read(obj, obj.patina.measures.active)
        redraw(None, context)
        self.report({'INFO'}, f"{found.name}: {measures.value_text(found, context.scene)}")
        return {'FINISHED'}


class PATINA_OT_measure(PickPoints, _Kept, Operator):
    """Measure on the surface that the view shows. Click points, Ctrl to toggle snapping, Backspace to remove the last, Enter or right click to finish, Esc to cancel"""

    bl_idname = "object.patina_measure"
    bl_label = "Measure Points"
    bl_options = {'UNDO'}

    kind: _kind_property()

    def most(self) -> int:
        return COUNTS[self.kind][1]

    def title(self) -> str:
        self.figure = self.kind
        return next(item[1] for item in KINDS if item[0] == self.kind)

    def again(self) -> None:
        bpy.ops.object.patina_measure('INVOKE_DEFAULT', kind=self.kind, snap=self.snap)

    def keep(self, context: Context, hits: list[Hit]) -> set[str]:
        if not hits:
            raise MeasureError("A measurement needs points: click on the surface")
        obj = owner_of(context, hits[0].name)
        measures.add(obj, self.kind, np.stack([hit.world for hit in hits]))
        return self._kept(context, obj)


class PATINA_OT_add_measurement(Reports, _Kept, Operator):
    """Add a measurement between points whose coordinates are known"""

    bl_idname = "object.patina_add_measurement"
    bl_label = "Add by Coordinates"
    bl_options = {'REGISTER', 'UNDO'}

    kind: _kind_property()
    coordinates: StringProperty(name="Coordinates", description="X Y Z of each point, separated by spaces, commas or semicolons")
    space: EnumProperty(name="Space", default='FILE', description="What the coordinates are relative to", items=(
        ('FILE', "File", "Coordinates of the file that the object came from, as an export writes them", 0),
        ('SCENE', "Scene", "Blender's coordinates", 1),
        ('OBJECT', "Object", "Coordinates in the object's own space", 2)))
    title: StringProperty(name="Name", description="Name of the measurement. Empty: its kind and a number")

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.object is not None

    def invoke(self, context: Context, _event: Event) -> set[str]:
        return context.window_manager.invoke_props_dialog(self, width=420)

    def execute(self, context: Context) -> set[str]:
        obj = context.object
        try:
            places = measures.unpacked(self.coordinates)
            if self.space == 'FILE':
                places = measures.from_file(obj, context.scene, places)
            elif self.space == 'SCENE':
                places = measures.to_local(obj, places)
            measures.add_local(obj, self.kind, places, self.title)
            return self._kept(context, obj)
        except MeasureError as error:
            return self.refused(str(error))


# ---- the tool ----------------------------------------------------------------------------------------------------------


def _settings(_context: Context, layout: bpy.types.UILayout, tool: WorkSpaceTool) -> None:
    properties = tool.operator_properties(PATINA_OT_measure.bl_idname)
    layout.prop(properties, "kind")
    layout.prop(properties, "snap")


class PatinaMeasureTool(WorkSpaceTool):
    bl_space_type = 'VIEW_3D'
    bl_context_mode = 'OBJECT'
    bl_idname = "patina.measure"
    bl_label = "Measure Points"
    bl_description = "Measure distance, height, angle, area or coordinates on the shown surface, snapping to trusted points"
    bl_icon = "ops.view3d.ruler"
    bl_keymap = ((PATINA_OT_measure.bl_idname, {"type": 'LEFTMOUSE', "value": 'PRESS'}, None),)
    draw_settings = staticmethod(_settings)


_register, _unregister = bpy.utils.register_classes_factory((PATINA_OT_measure, PATINA_OT_add_measurement))


def register() -> None:
    _register()
    if not bpy.app.background:
        bpy.utils.register_tool(PatinaMeasureTool, separator=False)


def unregister() -> None:
    if not bpy.app.background:
        bpy.utils.unregister_tool(PatinaMeasureTool)
    _unregister()
