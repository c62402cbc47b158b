# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects that cut clouds → the library's clips."""

from __future__ import annotations

import bpy
from mathutils import Matrix, Vector

from ...description.view import Clip
from ...properties import enum_number
from .. import losses
from .camera import row_major


def cuts(obj: bpy.types.Object) -> bool:
    """Whether the object is a clip, and so is not drawn itself."""
    return obj.patina.clip.shape != 'NONE'


def collect(depsgraph: bpy.types.Depsgraph, notices: list[str]) -> list[Clip]:
    clips = []
    for instance in depsgraph.object_instances:
        obj = instance.object
        if not cuts(obj) or not losses.is_placed(instance, notices):
            continue
        clips.append(of_object(obj, instance.matrix_world))
    return clips


def of_object(obj: bpy.types.Object, place: Matrix) -> Clip:
    """Of an object that cuts, evaluated or not; place: its matrix in the world."""
    group = obj.patina.clip
    matrix = place @ _box(obj) if group.shape == 'BOX' else place
    return Clip(
        world_from_clip=row_major(matrix), shape=enum_number(group, "shape") - 1, cut=int(group.cut),
        tint=tuple(group.tint), tint_strength=group.tint_strength, tint_width=group.tint_width)


def of_view(region_3d: bpy.types.RegionView3D) -> list[Clip]:
    """The clipping region of a 3D view (Alt B): planes whose outer side is not shown."""
    clips = []
    for plane in region_3d.clip_planes if region_3d.use_clip_planes else ():
        inward = Vector(plane[:3])
        if not inward.length:
            continue
        matrix = (-inward).to_track_quat('Z', 'Y').to_matrix().to_4x4()
        matrix.translation = inward * (-plane[3] / inward.length_squared)
        clips.append(Clip(row_major(matrix), shape=1, cut=0, tint=(0.0, 0.0, 0.0), tint_strength=0.0, tint_width=0.0))
    return clips


def _box(obj: bpy.types.Object) -> Matrix:
    """The object's box from -1 to 1, in its own coordinates."""
    if obj.type == 'EMPTY':
        return Matrix.Scale(obj.empty_display_size, 4)
    corners = [Vector(corner) for corner in obj.bound_box]
    lower, upper = (Vector(edge(corner[k] for corner in corners) for k in range(3)) for edge in (min, max))
    return Matrix.Translation((lower + upper) / 2) @ Matrix.Diagonal((*((upper - lower) / 2), 1.0))
