# SPDX-License-Identifier: GPL-3.0-or-later
"""Select points of linked clouds in a view, by box or lasso: an operator that draws its outline, and two tools that begin it."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np
from bpy.props import BoolProperty, CollectionProperty, EnumProperty
from bpy.types import Context, Event, Object, Operator, OperatorMousePath, WorkSpaceTool

from .. import native, sync
from ..sync.points import edits
from . import points, polls
from .points import HOW
from .view_tools import OverView, Place, Seen, describe, is_view, place_of

STEP = 3.0  # pixels between two corners of a lasso
MOST = 4000  # corners
_HOW = {(False, False): 'SET', (True, False): 'ADD', (False, True): 'SUB', (True, True): 'AND'}  # by Shift and Ctrl


def points_in(context: Context, names: set[str], outline: np.ndarray, through: bool) -> dict[str, edits.Bits]:
    """Of the objects of these names that the view shows: which points an outline, (n, 2) pixels of the view, holds. PatinaError."""
    with Seen(describe(context), names, through) as seen:
        return seen.points(outline)


def targets(context: Context) -> list[Object]:
    """The selected objects whose points can be edited, or the active one."""
    chosen = {obj.name_full: obj for obj in [context.object, *context.selected_objects] if obj and not points.editable(obj)}
    return list(chosen.values())


class PATINA_OT_points_select(OverView, Operator):
    """Select points of linked clouds with a box or lasso. Shift extends, Ctrl subtracts, Shift+Ctrl intersects"""

    bl_idname = "object.patina_points_select"
    bl_label = "Select Points"
    bl_options = {'REGISTER', 'UNDO'}

    shape: EnumProperty(name="Shape", items=(('BOX', "Box", "", 0), ('LASSO', "Lasso", "", 1)))
    # not of the last time: keys and the panel say them
    how: EnumProperty(name="How", items=HOW, options={'SKIP_SAVE'})
    through: BoolProperty(name="Through", default=False, options={'SKIP_SAVE'},
                          description="Also select points hidden behind others")
    path: CollectionProperty(type=OperatorMousePath, options={'SKIP_SAVE', 'HIDDEN'})  # corners; of a box two

    @classmethod
    def poll(cls, context: Context) -> bool:
        return polls.allowed(cls, points.editable(context.object))

    def execute(self, context: Context) -> set[str]:
        outline = self._outline()
        if outline is None:
            self.report({'ERROR'}, "Patina: an outline needs at least three corners, a box two")
            return {'CANCELLED'}
        objects = targets(context)
        try:
            with points.ANALYSES.drawing():
                found = points_in(context, {obj.name_full for obj in objects}, outline, self.through)
        except (native.PatinaError, sync.CameraError) as error:
            self.report({'ERROR'}, points.importers.told(f"Patina: {error}"))
            return {'CANCELLED'}
        told = []
        for obj in objects:
            if obj.name_full not in found:
                continue  # not in this view
            bits = found[obj.name_full]
            try:
                count = points.cloud_of(obj, context).count
            except native.PatinaError as error:  # others can be
                self.report({'WARNING'}, points.importers.told(f"Patina: '{obj.name}': {error}"))
                continue
            old = points.edits_of(self, obj, count)
            new = replace(old, selected=points.combine(self.how, old.selected, bits))
            points.write(obj, new)
            told.append(points.said(new))
        self.report({'INFO'}, "; ".join(told) or "The view shows no points of the object")
        return {'FINISHED'}

    def _outline(self) -> np.ndarray | None:
        places = np.array([tuple(item.loc) for item in self.path], np.float64).reshape(-1, 2)
        if self.shape == 'LASSO':
            return places if len(places) >= 3 else None
        if len(places) < 2:
            return None
        (x0, y0), (x1, y1) = places.min(axis=0), places.max(axis=0)
        return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])

    # ---- in a view

    def invoke(self, context: Context, event: Event) -> set[str]:
        if not is_view(context):
            self.report({'ERROR'}, "Patina: use this tool in a 3D viewport")
            return {'CANCELLED'}
        self._corners: list[Place] = []
        self._place = place_of(context, event)
        self._asked = self.properties.is_property_set("how")  # by a script
        self._keys = (event.shift, event.ctrl)
        if not self.properties.is_property_set("through"):
            shading = context.space_data.shading
            self.through = context.object.patina.points.through or getattr(shading, "show_xray", False) and shading.type == 'SOLID'
        if event.type in {'LEFTMOUSE', 'EVT_TWEAK_L'} and event.value in {'PRESS', 'CLICK_DRAG'}:  # a tool: the button is held
            start = (event.mouse_prev_press_x - context.region.x, event.mouse_prev_press_y - context.region.y) \
                if event.value == 'CLICK_DRAG' else self._place
            self._corners = [start]
        self._take_tool(context)
        self.begin(context, "Drag around points. Shift: extend, Ctrl: subtract, both: intersect, X: through what is before them, Esc: end")
        return {'RUNNING_MODAL'}

    def _take_tool(self, context: Context) -> None:
        """Whoever begins with a button goes on with the tool of that shape. Which points H and X mean hangs on points_keys alone."""
        tool = context.workspace.tools.from_space_view3d_mode(context.mode)
        if tool and tool.idname not in {PatinaSelectBox.bl_idname, PatinaSelectLasso.bl_idname}:
            bpy.ops.wm.tool_set_by_id(name=(PatinaSelectLasso if self.shape == 'LASSO' else PatinaSelectBox).bl_idname)

    def modal(self, context: Context, event: Event) -> set[str]:
        context.area.tag_redraw()
        self._place = place_of(context, event)
        if event.type in {'ESC', 'RIGHTMOUSE'}:
            self.end(context)
            return {'CANCELLED'}
        if event.type == 'X' and event.value == 'PRESS':
            self.through = not self.through
        if event.type == 'LEFTMOUSE' and event.value == 'PRESS':
            self._corners = [self._place]
        elif event.type == 'MOUSEMOVE' and self._corners:
            self._extend()
        elif event.type == 'LEFTMOUSE' and event.value == 'RELEASE' and self._corners:
            self._extend(last=True)
            self.end(context)
            if not self._asked:  # keys that were held when it began, or are now
                self.how = _HOW[event.shift or self._keys[0], event.ctrl or self._keys[1]]
            return self._finish(context)
        return {'RUNNING_MODAL'}

    def _extend(self, last: bool = False) -> None:
        far = np.hypot(*np.subtract(self._place, self._corners[-1])) >= STEP
        if self.shape == 'LASSO' and (far or last) and len(self._corners) < MOST:
            self._corners.append(self._place)

    def _finish(self, context: Context) -> set[str]:
        corners = self._corners if self.shape == 'LASSO' else [self._corners[0], self._place]
        (x0, y0), (x1, y1) = np.min(corners, axis=0), np.max(corners, axis=0)
        if max(x1 - x0, y1 - y0) < STEP:  # a click: nothing is chosen, and what was stays with Shift and Ctrl
            corners = [(x0, y0), (x0, y0), (x0, y0)]
        self.path.clear()
        for corner in corners:
            self.path.add().loc = corner
        return self.execute(context)

    def shown(self) -> tuple[list[Place], bool]:
        if not self._corners:
            return [], False
        if self.shape == 'LASSO':
            return [*self._corners, self._place], False
        (x0, y0), (x1, y1) = self._corners[0], self._place
        return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)], True


# ---- tools -----------------------------------------------------------------------------------------------------------


def _keys(shape: str) -> tuple:
    select = PATINA_OT_points_select.bl_idname
    held = ({}, {"shift": True}, {"ctrl": True}, {"shift": True, "ctrl": True})
    return (
        *((select, {"type": 'LEFTMOUSE', "value": 'CLICK_DRAG', **keys}, {"properties": [("shape", shape)]}) for keys in held),
        ("object.patina_points_select_all", {"type": 'A', "value": 'PRESS'}, {"properties": [("action", 'SELECT')]}),
        ("object.patina_points_select_all", {"type": 'A', "value": 'PRESS', "alt": True}, {"properties": [("action", 'DESELECT')]}),
        ("object.patina_points_select_all", {"type": 'I', "value": 'PRESS', "ctrl": True}, {"properties": [("action", 'INVERT')]}),
        ("object.patina_points_hide", {"type": 'H', "value": 'PRESS'}, {"properties": [("unselected", False)]}),
        ("object.patina_points_hide", {"type": 'H', "value": 'PRESS', "shift": True}, {"properties": [("unselected", True)]}),
        ("object.patina_points_reveal", {"type": 'H', "value": 'PRESS', "alt": True}, None),
        ("object.patina_points_delete", {"type": 'X', "value": 'PRESS'}, None),
        ("object.patina_points_delete", {"type": 'DEL', "value": 'PRESS'}, None),
    )


def _tool_settings(context: Context, layout: bpy.types.UILayout, _tool: WorkSpaceTool) -> None:
    why = points.editable(context.object)
    if why:
        layout.label(text=why.capitalize(), icon='INFO')
    else:
        layout.prop(context.object.patina.points, "through", icon='XRAY')


class PatinaSelectBox(WorkSpaceTool):
    bl_space_type = 'VIEW_3D'
    bl_context_mode = 'OBJECT'
    bl_idname = "patina.points_box"
    bl_label = "Select Points: Box"
    bl_description = "Select points of linked clouds by box. Shift extends, Ctrl subtracts; H hides, X deletes"
    bl_icon = "ops.generic.select_box"
    bl_keymap = _keys('BOX')
    draw_settings = staticmethod(_tool_settings)


class PatinaSelectLasso(WorkSpaceTool):
    bl_space_type = 'VIEW_3D'
    bl_context_mode = 'OBJECT'
    bl_idname = "patina.points_lasso"
    bl_label = "Select Points: Lasso"
    bl_description = "Select points of linked clouds by lasso. Shift extends, Ctrl subtracts; H hides, X deletes"
    bl_icon = "ops.generic.select_lasso"
    bl_keymap = _keys('LASSO')
    draw_settings = staticmethod(_tool_settings)


def register() -> None:
    bpy.utils.register_class(PATINA_OT_points_select)
    if not bpy.app.background:
        bpy.utils.register_tool(PatinaSelectBox, separator=True, group=True)
        bpy.utils.register_tool(PatinaSelectLasso, after={PatinaSelectBox.bl_idname})


def unregister() -> None:
    if not bpy.app.background:
        bpy.utils.unregister_tool(PatinaSelectLasso)
        bpy.utils.unregister_tool(PatinaSelectBox)
    bpy.utils.unregister_class(PATINA_OT_points_select)
