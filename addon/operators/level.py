# SPDX-License-Identifier: GPL-3.0-or-later
"""Turns scans upright that lie on their back or are tilted. Never without being told to."""

from __future__ import annotations

import math

import bpy
import numpy as np
from bpy.types import Context, Object, Operator
from mathutils import Matrix, Vector

from .. import jobs, native, point_data
from ..read.importers import Progress
from ..sync.analyses import measuring, upright
from ..sync.points import attributes
from . import polls
from .steps import Stepped

LINKED_POINTS = 200_000  # of a linked cloud that are looked at
TILTED = "patina_tilt"  # custom property of an object: degrees, as the import estimated them


def estimate(obj: Object, progress: Progress, frame: int = 0) -> jobs.Steps[upright.Vertical | None]:
    """The vertical of an object's points, in their space. None if their planes do not tell. frame: for linked clouds."""
    if obj.patina.linked_file:
        positions = yield from measuring.linked_places(obj, frame, LINKED_POINTS, progress)
    else:
        count = point_data.count_of(obj.data)
        positions = attributes.positions(obj.data, count) if count else None
    if positions is None:
        return None
    up = np.array(obj.matrix_world.to_3x3().transposed() @ Vector((0.0, 0.0, 1.0)), np.float64)
    return (yield from upright.estimate(positions, up / max(np.linalg.norm(up), 1e-30), progress))


def note(obj: Object, progress: Progress) -> jobs.Steps[str]:
    """Estimates the tilt of new points and notes it for the panel. Returns a message, or "" if they are upright or unknown. Canceled, it
    leaves the tilt unknown: the points are there."""
    try:
        found = yield from estimate(obj, progress)
    except native.PatinaError:
        return ""
    if found is None or not found.is_tilted:
        return ""
    obj[TILTED] = math.degrees(found.tilt)
    return f"'{obj.name}' seems tilted by {obj[TILTED]:.0f} degrees. Points > Level turns it upright"


class PATINA_OT_level(Stepped, Operator):
    """Turn the active points upright, around their center. The vertical is estimated from their largest horizontal and vertical planes"""

    bl_idname = "object.patina_level"
    bl_label = "Level"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context: Context) -> bool:
        obj = context.object
        if not point_data.may_have_points(obj) or obj.mode != 'OBJECT':
            return polls.allowed(cls, "Select points, in Object Mode")
        there = obj.patina.linked_file or point_data.holds_points(obj)
        return polls.allowed(cls, "" if there else "Meshes with faces cannot be leveled. Select a cloud")

    def execute(self, context: Context) -> set[str]:
        self._progress = Progress()
        return self.begin(context, self._level(context, context.object))

    def invoke(self, context: Context, _event: bpy.types.Event) -> set[str]:
        self._invoked = True
        return self.execute(context)

    def _level(self, context: Context, obj: Object) -> jobs.Steps[set[str]]:
        try:
            found = yield from estimate(obj, self._progress, context.scene.frame_current)
        except native.PatinaCancelled:
            self.report({'INFO'}, "Patina: canceled. Nothing was turned")
            return {'CANCELLED'}
        except native.PatinaError as error:
            self.report({'ERROR'}, f"Patina: {error}")
            return {'CANCELLED'}
        if found is None:
            self.report({'WARNING'}, f"Patina: '{obj.name}' has no planes that tell its vertical. Rotate it by hand")
            return {'CANCELLED'}
        obj.pop(TILTED, None)
        if not found.is_tilted:
            self.report({'INFO'}, f"'{obj.name}' is upright to {math.degrees(upright.UPRIGHT):.0f} degree")
            return {'FINISHED'}
        matrix = obj.matrix_world.copy()
        direction = matrix.to_3x3().inverted_safe().transposed() @ Vector(found.direction)
        turn = direction.rotation_difference(Vector((0.0, 0.0, 1.0))).to_matrix().to_4x4()
        corners = [matrix @ Vector(corner) for corner in point_data.corners(obj)]
        center = sum(corners, Vector()) / len(corners)
        obj.matrix_world = Matrix.Translation(center) @ turn @ Matrix.Translation(-center) @ matrix
        self.report({'INFO'}, f"Turned '{obj.name}' by {math.degrees(found.tilt):.1f} degrees")
        return {'FINISHED'}


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_level,))
