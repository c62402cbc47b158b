# SPDX-License-Identifier: GPL-3.0-or-later
"""Select the points that Trust leaves out: of a mesh or a PointCloud, in Object or Edit Mode, and of a linked cloud."""

from __future__ import annotations

from dataclasses import replace

import bmesh
import bpy
import numpy as np
from bpy.props import EnumProperty
from bpy.types import Context, Object, Operator

from .. import native, point_data
from ..read import importers
from ..sync.analyses import trust
from ..sync.analyses.analyzing import ANALYSES
from ..sync.points import edits
from . import points, polls
from .points import HOW

SELECTION = ".selection"  # point attribute of a PointCloud; without it all points are selected


class PATINA_OT_select_untrusted(Operator):
    """Select the points that Trust leaves out, or, where Trust is 0, those that it leaves out by default"""

    bl_idname = "object.patina_select_untrusted"
    bl_label = "Select Untrusted"
    bl_options = {'REGISTER', 'UNDO'}

    how: EnumProperty(name="How", items=HOW, options={'SKIP_SAVE'})

    @classmethod
    def poll(cls, context: Context) -> bool:
        return polls.allowed(cls, _why_not(context.object))

    def execute(self, context: Context) -> set[str]:
        obj = context.object
        least = trust.least_of(obj.patina)
        try:
            cloud = trust.analyzed_cloud(obj, context.scene)
            with ANALYSES.drawing():
                found = trust.untrusted(cloud, least)
        except (native.PatinaError, OSError) as error:
            self.report({'ERROR'}, importers.told(f"Patina: '{obj.name}': {error}"))
            return {'CANCELLED'}
        if trust.none_is_trusted(cloud, least):
            self.report({'WARNING'}, f"Patina: '{obj.name}': no point is trusted, so all of them are drawn, and none is selected")
            return {'CANCELLED'}
        selected = self._select(obj, found)
        self.report({'INFO'}, f"{int(found.sum()):,} of {len(found):,} points are untrusted. {selected:,} points are selected")
        return {'FINISHED'}

    def _select(self, obj: Object, found: np.ndarray) -> int:
        """How many are selected now."""
        if obj.patina.linked_file:
            return self._select_linked(obj, found)
        if obj.type == 'POINTCLOUD':
            return self._select_cloud(obj, found)
        return self._select_edited(obj, found) if obj.mode == 'EDIT' else self._select_mesh(obj, found)

    def _select_linked(self, obj: Object, found: np.ndarray) -> int:
        old = points.edits_of(self, obj, len(found))
        new = replace(old, selected=points.combine(self.how, old.selected, edits.of_flags(found) & ~old.gone))
        points.write(obj, new)
        return new.totals["selected"]

    def _select_cloud(self, obj: Object, found: np.ndarray) -> int:
        known = obj.data.attributes.get(SELECTION)
        old = np.ones(len(found), bool)
        if known and known.data_type == 'BOOLEAN' and len(known.data) == len(found):
            known.data.foreach_get("value", old)
        new = points.combine(self.how, old, found)
        point_data.writable(obj.data, SELECTION, 'BOOLEAN').data.foreach_set("value", new)
        point_data.changed(obj.data)
        return int(new.sum())

    def _select_mesh(self, obj: Object, found: np.ndarray) -> int:
        vertices = obj.data.vertices
        old, hidden = np.empty(len(found), bool), np.empty(len(found), bool)
        vertices.foreach_get("select", old)
        vertices.foreach_get("hide", hidden)
        new = points.combine(self.how, old, found) & ~hidden
        vertices.foreach_set("select", new)
        point_data.changed(obj.data)
        return int(new.sum())

    def _select_edited(self, obj: Object, found: np.ndarray) -> int:
        edited = bmesh.from_edit_mesh(obj.data)
        edited.select_mode |= {'VERT'}
        old, hidden = (np.fromiter(values, bool, len(found)) for values in
                       ((vertex.select for vertex in edited.verts), (vertex.hide for vertex in edited.verts)))
        new = points.combine(self.how, old, found) & ~hidden
        for vertex, own in zip(edited.verts, new.tolist(), strict=True):
            vertex.select = own
        edited.select_flush_mode()
        bmesh.update_edit_mesh(obj.data, loop_triangles=False, destructive=False)
        return int(new.sum())


def _why_not(obj: Object | None) -> str:
    """Why untrusted points of an object cannot be selected; empty: they can."""
    if obj is not None and obj.patina.linked_file:
        return points.editable(obj)
    if not point_data.holds_points(obj):
        return "the active object has no points, or has faces"
    if obj.library or obj.data.library:
        return "the object belongs to another file"
    return "" if obj.mode in {'OBJECT', 'EDIT'} else "only in Object Mode and Edit Mode"


def _menu(self: bpy.types.Menu, context: Context) -> None:
    if context.object is not None and not _why_not(context.object):
        self.layout.separator()
        self.layout.operator(PATINA_OT_select_untrusted.bl_idname)


# The Select menus of Edit Mode; that of PointClouds came with their Edit Mode.
_MENUS = [menu for name in ("VIEW3D_MT_select_edit_mesh", "VIEW3D_MT_select_edit_pointcloud") if (menu := getattr(bpy.types, name, None))]


def register() -> None:
    bpy.utils.register_class(PATINA_OT_select_untrusted)
    for menu in _MENUS:
        menu.append(_menu)


def unregister() -> None:
    for menu in _MENUS:
        menu.remove(_menu)
    bpy.utils.unregister_class(PATINA_OT_select_untrusted)
