# SPDX-License-Identifier: GPL-3.0-or-later
"""Color By, a custom ramp to start from, and a range without strays."""

from __future__ import annotations

import bpy
import numpy as np
from bpy.app.handlers import persistent
from bpy.props import StringProperty
from bpy.types import Context, Operator

from .. import native, point_data
from ..sync.points import coloring

STOPS = 6  # of a custom ramp that begins as one of ours


class _ColorOperator:
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return point_data.may_have_points(context.object)


class PATINA_OT_color_by(_ColorOperator, Operator):
    """Color the points by this. The range is between the 1st and 99th percentile of the values"""

    bl_idname = "object.patina_color_by"
    bl_label = "Color By"

    choice: StringProperty(name="Color By", description="One of the labels that the menu Color By lists")

    def execute(self, context: Context) -> set[str]:
        obj = context.object
        listed = {choice.label: choice for choice in coloring.choices(obj)}
        if self.choice not in listed:
            self.report({'ERROR'}, f"Patina: '{obj.name}' has no '{self.choice}' to color by. It has {', '.join(listed)}")
            return {'CANCELLED'}
        try:
            if not coloring.apply(obj, listed[self.choice], context.scene.frame_current):
                self.report({'WARNING'}, f"'{obj.name}': '{self.choice}' has no finite values")
        except native.PatinaError as error:
            self.report({'ERROR'}, f"Patina: {error}")
            return {'CANCELLED'}
        return {'FINISHED'}


class PATINA_OT_new_ramp(_ColorOperator, Operator):
    """Create an editable copy of the chosen color ramp"""

    bl_idname = "object.patina_new_ramp"
    bl_label = "New Custom Ramp"

    def execute(self, context: Context) -> set[str]:
        group = context.object.patina.colors
        colors = native.ramp("viridis" if group.ramp in {'CUSTOM', 'CLASSES'} else group.ramp.lower())
        texture = bpy.data.textures.new(f"{context.object.name} Ramp", 'NONE')
        texture.use_color_ramp = True
        elements = texture.color_ramp.elements
        for place in np.linspace(0.0, 1.0, STOPS)[1:-1]:
            elements.new(float(place))
        for element in elements:
            element.color = (*map(float, colors[round(element.position * (len(colors) - 1))]), 1.0)
        group.texture = texture
        group.ramp = 'CUSTOM'
        return {'FINISHED'}


class PATINA_OT_robust_range(_ColorOperator, Operator):
    """Set the range so that 1 % of the points are below it and 1 % above, so that strays do not flatten the colors"""

    bl_idname = "object.patina_robust_range"
    bl_label = "Robust Range"

    def execute(self, context: Context) -> set[str]:
        obj = context.object
        group = obj.patina.colors
        try:
            found = coloring.value_range(obj, coloring.SHARE, context.scene.frame_current)
        except native.PatinaError as error:
            self.report({'ERROR'}, f"Patina: {error}")
            return {'CANCELLED'}
        if found is None:
            self.report({'WARNING'}, "There are no values to take a range from")
            return {'CANCELLED'}
        group.range_min, group.range_max = found
        group.use_range = True
        return {'FINISHED'}


@persistent
def _follow_ramps(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Blender tells viewports nothing of a texture: the objects that take its ramp are said to have changed."""
    painted = {update.id.original for update in depsgraph.updates if isinstance(update.id, bpy.types.Texture)}
    for obj in bpy.data.objects if painted else ():
        if obj.patina.colors.texture in painted:
            obj.update_tag(refresh={'OBJECT'})


_register, _unregister = bpy.utils.register_classes_factory((PATINA_OT_color_by, PATINA_OT_new_ramp, PATINA_OT_robust_range))


def register() -> None:
    _register()
    bpy.app.handlers.depsgraph_update_post.append(_follow_ramps)


def unregister() -> None:
    bpy.app.handlers.depsgraph_update_post.remove(_follow_ramps)
    _unregister()
