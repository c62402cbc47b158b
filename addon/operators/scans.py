# SPDX-License-Identifier: GPL-3.0-or-later
"""Scans of a linked cloud: listed to be graded, and colored by which a point is of."""

from __future__ import annotations

import bpy
from bpy.types import Context, Object, Operator

from .. import importers, native
from . import points


class _OfScans:
    """Beside bpy.types.Operator."""

    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return not points.editable(context.object)

    def execute(self, context: Context) -> set[str]:
        obj = context.object
        try:
            done = self.change(obj, points.cloud_of(obj, context))
        except (native.PatinaError, OSError) as error:
            self.report({'ERROR'}, importers.told(f"Patina: '{obj.name}': {error}"))
            return {'CANCELLED'}
        obj.update_tag(refresh={'OBJECT'})  # what is unset, or taken from a list, says nothing itself
        return done


class PATINA_OT_scans_list(_OfScans, Operator):
    """List the file's scans, so that the colors of each can be graded. What is listed already keeps its grade"""

    bl_idname = "object.patina_scans_list"
    bl_label = "Grade Scans"

    def change(self, obj: Object, cloud: native.Cloud) -> set[str]:
        if not cloud.has_colors:
            self.report({'ERROR'}, f"Patina: '{obj.name}' has no colors to grade")
            return {'CANCELLED'}
        scans = obj.patina.points.scans
        wanted = [f"Scan {number}" for number in cloud.scan_numbers] or ["All Points"]
        while len(scans) > len(wanted):
            scans.remove(len(scans) - 1)
        for index, name in enumerate(wanted):
            item = scans[index] if index < len(scans) else scans.add()
            item.name = name
        obj.patina.points.scan = min(obj.patina.points.scan, len(wanted) - 1)
        return {'FINISHED'}


class PATINA_OT_scans_reset(_OfScans, Operator):
    """Show the colors of all scans as the file has them"""

    bl_idname = "object.patina_scans_reset"
    bl_label = "Reset Grades"

    def change(self, obj: Object, cloud: native.Cloud) -> set[str]:
        for item in obj.patina.points.scans:
            for name in ("gain", "gamma", "saturation", "temperature"):
                item.property_unset(name)
        return {'FINISHED'}


class PATINA_OT_scans_color(_OfScans, Operator):
    """Color each point by the scan that it is of, by a ramp; Color: Attribute brings the points' own colors back"""

    bl_idname = "object.patina_scans_color"
    bl_label = "Color by Scan"

    def change(self, obj: Object, cloud: native.Cloud) -> set[str]:
        if not cloud.scan_name:
            self.report({'ERROR'}, f"Patina: '{obj.name}': the file does not say which scans its points are of")
            return {'CANCELLED'}
        group = obj.patina.colors
        group.scalar, group.source, group.ramp, group.use_range = cloud.scan_name, 'SCALAR', 'SPECTRUM', False
        if obj.patina.lighting == 'AUTO':
            obj.patina.lighting = 'UNLIT'  # as the points' own colors are: the colors shall be told apart
        return {'FINISHED'}


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_scans_list, PATINA_OT_scans_reset, PATINA_OT_scans_color))
