# SPDX-License-Identifier: GPL-3.0-or-later
"""A custom ramp to start from, and a range without strays."""

from __future__ import annotations

import bpy
import numpy as np
from bpy.app.handlers import persistent
from bpy.types import Context, Operator

from .. import jobs, native, point_data
from ..sync.points import attributes, linked

STOPS = 6  # of a custom ramp that begins as one of ours
SHARE = 0.02  # of the points that a robust range leaves out at either end


class _ColorOperator:
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return point_data.may_have_points(context.object)


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
    """Set the range so that 2 % of the points are below it and 2 % above, so that strays do not flatten the colors"""

    bl_idname = "object.patina_robust_range"
    bl_label = "Robust Range"

    def execute(self, context: Context) -> set[str]:
        obj = context.object
        group = obj.patina.colors
        try:
            found = _linked_range(obj, context.scene.frame_current) if obj.patina.linked_file else range_of(obj, SHARE)
        except native.PatinaError as error:
            self.report({'ERROR'}, f"Patina: {error}")
            return {'CANCELLED'}
        if found is None:
            self.report({'WARNING'}, "There are no values to take a range from")
            return {'CANCELLED'}
        group.range_min, group.range_max = found
        group.use_range = True
        return {'FINISHED'}


def range_of(obj: bpy.types.Object, share: float) -> tuple[float, float] | None:
    """Of what colors points that Blender holds: without a share of them at either end. None: nothing finite does."""
    group, data = obj.patina.colors, obj.data
    count = point_data.count_of(data)
    if group.source == 'SCALAR':
        values = attributes.scalars(data, count, group.scalar)
    elif group.source in {'HEIGHT', 'OBJECT_HEIGHT'}:
        values = attributes.positions(data, count)
        if values is not None:
            matrix = obj.matrix_world if group.source == 'HEIGHT' else None
            values = values[:, 2] if matrix is None else values @ np.array(matrix[2][:3]) + matrix[2][3]
    else:
        values = None
    values = None if values is None else values[np.isfinite(values)]
    if values is None or not len(values):
        return None
    return tuple(float(value) for value in np.quantile(values, (share, 1.0 - share)))


def _linked_range(obj: bpy.types.Object, frame: int) -> tuple[float, float] | None:
    source = linked.source_of(obj, frame, [])
    if obj.patina.colors.source != 'SCALAR' or source is None:
        return None
    cloud = jobs.run(lambda: linked.load(source), lambda: None, lambda: False).cloud
    return cloud.scalar_range(SHARE) if cloud.has_scalars else None


@persistent
def _follow_ramps(_scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Blender tells viewports nothing of a texture: the objects that take its ramp are said to have changed."""
    painted = {update.id.original for update in depsgraph.updates if isinstance(update.id, bpy.types.Texture)}
    for obj in bpy.data.objects if painted else ():
        if obj.patina.colors.texture in painted:
            obj.update_tag(refresh={'OBJECT'})


_register, _unregister = bpy.utils.register_classes_factory((PATINA_OT_new_ramp, PATINA_OT_robust_range))


def register() -> None:
    _register()
    bpy.app.handlers.depsgraph_update_post.append(_follow_ramps)


def unregister() -> None:
    bpy.app.handlers.depsgraph_update_post.remove(_follow_ramps)
    _unregister()
