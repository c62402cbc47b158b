# SPDX-License-Identifier: GPL-3.0-or-later
"""Scans of a cloud: listed to be hidden and graded, and colored by which a point is of."""

from __future__ import annotations

import bpy
import numpy as np
from bpy.types import Context, Object, Operator

from .. import native, point_data
from ..read import importers
from ..read.importers import scans
from ..sync.analyses import scans_of
from ..sync.points import attributes, edits
from . import points, polls

LOOK = ("gain", "gamma", "saturation", "temperature", "hide", "solo")


def refused(obj: Object | None) -> str:
    """Why the scans of an object cannot be listed; empty: they can."""
    if obj is not None and obj.patina.linked_file:
        return points.editable(obj)
    if not point_data.holds_points(obj):
        return "the active object has no points"
    if obj.library or obj.mode != 'OBJECT':
        return "the object belongs to another file" if obj.library else "only in Object Mode"
    return ""


def of_points(obj: Object) -> tuple[scans_of.Scans | None, np.ndarray | None]:
    """Which scans a mesh's or point cloud's points are of; None where there is one, or it is not said."""
    data = obj.data
    count = point_data.count_of(data)
    columns = {name: attributes.scalars(data, count, name) for name in scans_of.SCAN_NAMES}
    return scans_of.scans_in({name: values[:, 0] for name, values in columns.items() if values is not None})


def known(obj: Object, context: Context) -> tuple[scans_of.Scans | None, np.ndarray | None]:
    """The same of any object. PatinaError where its file cannot be read."""
    if not obj.patina.linked_file:
        return of_points(obj)
    cloud = points.cloud_of(obj, context)
    return (scans_of.Scans(cloud.scan_name, cloud.scan_numbers), edits.scans_of(cloud)) if cloud.scan_name else (None, None)


class OfScans:
    """Beside bpy.types.Operator."""

    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return polls.allowed(cls, refused(context.object))

    def execute(self, context: Context) -> set[str]:
        obj = context.object
        try:
            done = self.change(context, obj)
        except (native.PatinaError, OSError) as error:
            self.report({'ERROR'}, importers.told(f"Patina: '{obj.name}': {error}"))
            return {'CANCELLED'}
        obj.update_tag(refresh={'OBJECT'})  # what is unset, or taken from a list, says nothing itself
        return done

    def change(self, context: Context, obj: Object) -> set[str]:
        raise NotImplementedError


class PATINA_OT_scans_list(OfScans, Operator):
    """List the scans of the points, to hide or grade each one. Listed scans keep their settings"""

    bl_idname = "object.patina_scans_list"
    bl_label = "List Scans"

    def change(self, context: Context, obj: Object) -> set[str]:
        if obj.patina.linked_file and not points.cloud_of(obj, context).has_colors and not known(obj, context)[0]:
            self.report({'ERROR'}, f"Patina: '{obj.name}' has no colors to grade, and no scans")
            return {'CANCELLED'}
        listed(obj, *known(obj, context))
        return {'FINISHED'}


def listed(obj: Object, found: scans_of.Scans | None, of: np.ndarray | None) -> None:
    """Brings the object's list up to date."""
    group = obj.patina.points
    kept = {edits.number_of(item): {name: getattr(item, name) for name in LOOK if item.is_property_set(name)} for item in group.scans}
    called = {item.number: item.name for item in group.scans if item.number >= 0}
    told = scans.unpacked(obj.data.get(scans.PROPERTY)) if found is None or found.name == "scan" else []
    numbers = found.numbers if found else (edits.ALL,)
    counts = np.bincount(of, minlength=len(numbers)) if of is not None else [None] * len(numbers)
    group.scans.clear()
    for number, count in zip(numbers, counts, strict=True):
        item = group.scans.add()
        item.number = number
        name = told[number].name if 0 <= number < len(told) else ""
        item.name = called.get(number) or importers.told(name) or (f"Scan {number}" if number >= 0 else "All Points")
        item.count = "" if count is None else f"{count:,}"
        for key, value in kept.get(number, {}).items():
            setattr(item, key, value)
    group.scan = min(group.scan, len(numbers) - 1)


class PATINA_OT_scans_reset(OfScans, Operator):
    """Show all scans, and remove their grades"""

    bl_idname = "object.patina_scans_reset"
    bl_label = "Reset Scans"

    def change(self, context: Context, obj: Object) -> set[str]:
        obj.patina.points.property_unset("use_balance")
        for item in obj.patina.points.scans:
            for name in LOOK:
                item.property_unset(name)
        return {'FINISHED'}


class PATINA_OT_scans_color(OfScans, Operator):
    """Color each point by its scan. Needs at least two scans. Set Color to Own Colors to return"""

    bl_idname = "object.patina_scans_color"
    bl_label = "Color by Scan"

    def change(self, context: Context, obj: Object) -> set[str]:
        found, _ = known(obj, context)
        if not found:
            self.report({'ERROR'}, f"Patina: '{obj.name}' has one scan only, or its file does not name the scan of each point")
            return {'CANCELLED'}
        group = obj.patina.colors
        group.scalar, group.source, group.ramp, group.use_range = found.name, 'SCALAR', 'SPECTRUM', False
        if obj.patina.lighting == 'AUTO':
            obj.patina.lighting = 'UNLIT'  # as the points' own colors are: the colors shall be told apart
        return {'FINISHED'}


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_scans_list, PATINA_OT_scans_reset, PATINA_OT_scans_color))
