# SPDX-License-Identifier: GPL-3.0-or-later
"""A camera where a scanner stood, for clouds whose file says where that was (E57, PTX)."""

from __future__ import annotations

import math

import bpy
import numpy as np
from bpy.props import BoolProperty, IntProperty
from bpy.types import Context, Operator
from mathutils import Matrix, Vector

from ..sync.analyses.analysis import SCANNERS
from . import clip_range


def positions(obj: bpy.types.Object | None) -> np.ndarray:
    """(n, 3) in the object's coordinates, one a scan, NaN for one that does not say; n is 0 where nothing is known."""
    known = obj.data.get(SCANNERS) if obj and obj.data else None
    return np.empty((0, 3)) if known is None else np.array(known, np.float64).reshape(-1, 3)


class PATINA_OT_camera_at_scanner(Operator):
    """Add a level camera at the position of a scan, facing the scan's north"""

    bl_idname = "object.patina_camera_at_scanner"
    bl_label = "Camera at Scanner Position"
    bl_options = {'REGISTER', 'UNDO'}

    scan: IntProperty(name="Scan", default=0, min=0, description="Number of the scan in the file, starting at 0")
    panoramic: BoolProperty(name="Panoramic", default=True, description="Equirectangular camera that sees all directions")

    @classmethod
    def poll(cls, context: Context) -> bool:
        return len(positions(context.object)) > 0

    def execute(self, context: Context) -> set[str]:
        obj = context.object
        known = positions(obj)
        if self.scan >= len(known):
            self.report({'ERROR'}, f"Patina: '{obj.name}' has scans 0 to {len(known) - 1}, there is no {self.scan}")
            return {'CANCELLED'}
        if not np.isfinite(known[self.scan]).all():
            self.report({'ERROR'}, f"Patina: scan {self.scan} of '{obj.name}' does not say where its scanner stood")
            return {'CANCELLED'}
        data = bpy.data.cameras.new(f"{obj.name} scan {self.scan}")
        data.type = 'PANO' if self.panoramic else 'PERSP'
        place = obj.matrix_world @ Vector(known[self.scan])
        clip_range.fit(data, clip_range.extent_of([place, *(obj.matrix_world @ Vector(corner) for corner in obj.bound_box)]))
        camera = bpy.data.objects.new(data.name, data)
        camera.matrix_world = Matrix.Translation(place) @ Matrix.Rotation(math.pi / 2, 4, 'X')
        context.collection.objects.link(camera)
        context.scene.camera = camera
        return {'FINISHED'}


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_camera_at_scanner,))
