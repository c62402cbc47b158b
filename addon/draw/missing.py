# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects whose linked file is missing: a red box with the object's name in the viewport, and a line in the status bar."""

from __future__ import annotations

import blf
import bpy
import gpu
from bpy_extras.view3d_utils import location_3d_to_region_2d
from gpu_extras.batch import batch_for_shader
from mathutils import Vector

from ..sync.losses import MissingFile
from . import viewport

RED = (1.0, 0.05, 0.05, 1.0)
MOST = 100  # objects whose box is drawn
TEXT = 12  # points: the size of the names
_EDGES = ((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7))  # of Object.bound_box

_handlers: list[object] = []
_said = ""  # the line when the status bar was drawn last


def _names(area: bpy.types.Area) -> list[str]:
    """Of the objects whose linked file is missing, in a 3D view in Rendered shading."""
    found = viewport.of_area(area) if area.type == 'VIEW_3D' and area.spaces.active.shading.type == 'RENDERED' else None
    return [notice.object_name for notice in found.notices if isinstance(notice, MissingFile)] if found else []


def _objects(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The objects without their file that the 3D view shows."""
    names = dict.fromkeys(_names(context.area))
    if not names:
        return []
    visible = {obj.name: obj for obj in context.visible_objects}
    return [visible[name] for name in names if name in visible][:MOST]


def _corners(obj: bpy.types.Object) -> list[Vector]:
    return [obj.matrix_world @ Vector(corner) for corner in obj.bound_box]


def _draw_boxes() -> None:
    if status() != _said and not bpy.app.timers.is_registered(_redraw_status):
        bpy.app.timers.register(_redraw_status)
    lines = []
    for obj in _objects(bpy.context):
        corners = _corners(obj)
        lines += [tuple(corners[i]) for edge in _EDGES for i in edge]
    if lines:
        shader = gpu.shader.from_builtin('UNIFORM_COLOR')
        gpu.state.depth_test_set('NONE')
        shader.bind()
        shader.uniform_float("color", RED)
        batch_for_shader(shader, 'LINES', {"pos": lines}).draw(shader)


def _draw_names() -> None:
    context = bpy.context
    for obj in _objects(context):
        places = [place for corner in _corners(obj) if (place := location_3d_to_region_2d(context.region, context.region_data, corner))]
        if places:
            blf.size(0, TEXT * context.preferences.system.ui_scale)
            blf.color(0, *RED)
            blf.position(0, min(place.x for place in places), max(place.y for place in places) + 4.0, 0.0)
            blf.draw(0, f"{obj.name}: file missing")


def status() -> str:
    """The line of the status bar; "" if no file is missing."""
    areas = (area for window in bpy.context.window_manager.windows for area in window.screen.areas)
    names = list(dict.fromkeys(name for area in areas for name in _names(area)))
    if not names:
        return ""
    others = f" and {len(names) - 1} more" if len(names) > 1 else ""
    return f"Patina: the linked file of '{names[0]}'{others} is missing. Use File > External Data > Find Missing Files"


def _redraw_status() -> None:
    """Blender redraws its status bar for no change of a scene, but when its text is set."""
    for window in bpy.context.window_manager.windows:
        window.workspace.status_text_set(None)


def _draw_status(header: bpy.types.Header, _context: bpy.types.Context) -> None:
    global _said
    _said = text = status()
    if text:
        header.layout.label(text=text, icon='ERROR')


def register() -> None:
    if bpy.app.background:
        return
    add = bpy.types.SpaceView3D.draw_handler_add
    _handlers[:] = [add(_draw_boxes, (), 'WINDOW', 'POST_VIEW'), add(_draw_names, (), 'WINDOW', 'POST_PIXEL')]
    bpy.types.STATUSBAR_HT_header.append(_draw_status)


def unregister() -> None:
    if bpy.app.timers.is_registered(_redraw_status):
        bpy.app.timers.unregister(_redraw_status)
    if _handlers:
        for handler in _handlers:
            bpy.types.SpaceView3D.draw_handler_remove(handler, 'WINDOW')
        bpy.types.STATUSBAR_HT_header.remove(_draw_status)
    _handlers.clear()
