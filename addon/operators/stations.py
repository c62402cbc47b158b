# SPDX-License-Identifier: GPL-3.0-or-later
"""Empties where the scanners of a cloud stood: children of its object, one a scan whose file says so."""

from __future__ import annotations

import bpy
import numpy as np
from bpy.types import Context, Object, Operator
from mathutils import Vector

from ..read.importers import scans, told
from . import polls, scanner

PROPERTY = "patina_station"  # of an empty: the scan's number
MOST = 1000  # at a time: Blender takes half a minute for 40,000 new objects
SIZE = 0.02  # of the cloud's greatest extent


def of(obj: Object) -> dict[int, Object]:
    """The stations that an object has, by the scans' numbers."""
    return {int(child[PROPERTY]): child for child in obj.children if child.type == 'EMPTY' and PROPERTY in child}


def missing(obj: Object) -> list[int]:
    """Scans whose station is known and not there."""
    known, there = scanner.positions(obj), of(obj)
    return [index for index, place in enumerate(known) if np.isfinite(place).all() and index not in there]


def add(obj: Object, collections: list[bpy.types.Collection]) -> int:
    """Adds the stations that are not there yet, MOST at a time, and returns how many. They point where the scanner looked, where that is known."""
    known, wanted = scanner.positions(obj), missing(obj)[:MOST]
    names = scans.unpacked(obj.data.get(scans.PROPERTY))
    for index in wanted:
        scan = names[index] if index < len(names) else scans.Scan("", 0)
        empty = bpy.data.objects.new(told(f"{obj.name} {scan.name or f'scan {index}'}"), None)
        empty[PROPERTY] = index
        empty.parent = obj
        empty.location = known[index]
        empty.empty_display_size = max(obj.dimensions) * SIZE / max(*map(abs, obj.matrix_world.to_scale()), 1e-9) or 1.0
        if any(scan.direction):
            empty.empty_display_type = 'SINGLE_ARROW'
            empty.rotation_mode = 'QUATERNION'
            empty.rotation_quaternion = Vector(scan.direction).to_track_quat('Z', 'Y')
        for collection in collections:
            collection.objects.link(empty)
    return len(wanted)


class PATINA_OT_add_stations(Operator):
    """Add an empty at each scanner position that the file stores. Existing ones are kept"""

    bl_idname = "object.patina_add_stations"
    bl_label = "Add Stations"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context: Context) -> bool:
        obj = context.object
        return polls.allowed(cls, "" if obj is not None and missing(obj) else "the file does not say where its scanners stood"
                             if obj is None or not of(obj) else "all stations are there")

    def execute(self, context: Context) -> set[str]:
        obj = context.object
        count = add(obj, list(obj.users_collection) or [context.collection])
        left = len(missing(obj))
        self.report({'INFO'}, f"Added {count:,} station{'s' * (count != 1)}" + f"; {left:,} more can be added" * bool(left))
        return {'FINISHED'}


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_add_stations,))
