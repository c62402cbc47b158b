# SPDX-License-Identifier: GPL-3.0-or-later
"""A brush for soft points of imported clouds, in a 3D view: Blender's own weight brushes paint nothing on a mesh without faces."""

from __future__ import annotations

import time

import bpy
import numpy as np
from bpy.props import BoolProperty, CollectionProperty, FloatProperty
from bpy.types import Context, Event, Operator, OperatorMousePath

from .. import native, sync
from ..properties.brush import RADIUS, STRENGTH, THROUGH
from ..read import importers
from . import polls
from .soft_strokes import Stroke, swept, why_not, write
from .view_tools import NAVIGATION, OverView, Place, is_over, is_view, largest_view, place_of

EVERY, SHARE = 0.25, 4.0  # seconds between two writings within a stroke; times as long as one takes, at least
GROWTH = 1.15  # of the radius, a press

_END = {'RET', 'NUMPAD_ENTER', 'ESC', 'RIGHTMOUSE'}
_SIZES = {'LEFT_BRACKET': 1.0 / GROWTH, 'RIGHT_BRACKET': GROWTH, 'WHEELDOWNMOUSE': 1.0 / GROWTH, 'WHEELUPMOUSE': GROWTH}


class PATINA_OT_soft_brush(OverView, Operator):
    """Paint the soft points of the active cloud in the 3D viewport. Drag to paint, Shift to erase, [ and ] or Ctrl Wheel to change the radius, X to include hidden points, Enter or Esc to finish"""

    bl_idname = "object.patina_soft_brush"
    bl_label = "Paint Soft Points"
    bl_options = {'UNDO'}

    path: CollectionProperty(type=OperatorMousePath, options={'SKIP_SAVE', 'HIDDEN'})
    strength: FloatProperty(**STRENGTH, options={'SKIP_SAVE'})
    radius: FloatProperty(**RADIUS, options={'SKIP_SAVE'})
    through: BoolProperty(**THROUGH, options={'SKIP_SAVE'})

    @classmethod
    def poll(cls, context: Context) -> bool:
        return polls.allowed(cls, why_not(context.object))

    def execute(self, context: Context) -> set[str]:
        places = [tuple(item.loc) for item in self.path]
        obj = context.object
        if not places:
            return self._refused("a stroke has at least one place")
        try:
            with Stroke(context, obj, self.radius, self.through) as stroke:
                for place in places:
                    stroke.to(place)
                stroke.to(places[-1], last=True)
        except (native.PatinaError, sync.CameraError) as error:
            return self._refused(str(error))
        if not stroke.bits.any():
            self.report({'INFO'}, "There are no points of the object here")
            return {'CANCELLED'}
        write(obj, stroke.bits, self.strength)
        return {'FINISHED'}

    def _refused(self, why: str) -> set[str]:
        self.report({'ERROR'}, importers.told(f"Patina: {why}"))
        return {'CANCELLED'}

    # ---- in a view

    def invoke(self, context: Context, _event: Event) -> set[str]:
        if not is_view(context):
            return self._in_a_view(context)
        self._place: Place | None = None
        self._stroke: Stroke | None = None
        self._timer = None
        self.begin(context, "")
        self._tell(context)
        return {'RUNNING_MODAL'}

    def _in_a_view(self, context: Context) -> set[str]:
        """Begun by a button elsewhere."""
        view = largest_view(context)
        if view is None:
            return self._refused("soft points are painted in a 3D view, and the window has none")
        with context.temp_override(area=view[0], region=view[1]):
            bpy.ops.object.patina_soft_brush('INVOKE_DEFAULT')
        return {'CANCELLED'}  # this one

    def _tell(self, context: Context, first: str = "") -> None:
        through = "on" if context.window_manager.patina_brush.through else "off"
        context.workspace.status_text_set(f"{first}Drag: paint soft points. Shift: paint them hard, [ and ] or Ctrl Wheel: radius, "
                                          f"X: through what is before them ({through}), Enter or Esc: end")

    def shown(self) -> tuple[list[Place], bool]:
        radius = bpy.context.window_manager.patina_brush.radius
        return (swept(self._place, self._place, radius).tolist() if self._place else []), False

    def modal(self, context: Context, event: Event) -> set[str]:
        if not is_view(context):  # its area is another one, or gone
            return self._end(context)
        context.area.tag_redraw()
        try:
            return self._painting(context, event) if self._stroke else self._waiting(context, event)
        except (native.PatinaError, sync.CameraError) as error:
            self._end(context)
            return self._refused(str(error))

    def _waiting(self, context: Context, event: Event) -> set[str]:
        """Between strokes: all but what the brush needs is Blender's."""
        over = is_over(context, event)
        self._place = place_of(context, event) if over else None
        pressed = event.value == 'PRESS'
        if pressed and (event.type == 'ESC' or over and event.type in _END):
            return self._end(context)
        if not over or event.alt or event.type in {'Z', 'Y'} and (event.ctrl or event.oskey):  # another region, navigation, undo
            return {'PASS_THROUGH'}
        brush = context.window_manager.patina_brush
        if pressed and event.type == 'LEFTMOUSE':
            return self._start(context, event)
        if pressed and event.type == 'X':
            brush.through = not brush.through
            self._tell(context)
        elif pressed and event.type in _SIZES and (event.ctrl or "BRACKET" in event.type):
            brush.radius *= _SIZES[event.type]
        elif event.type.startswith(NAVIGATION):
            return {'PASS_THROUGH'}
        return {'RUNNING_MODAL'}

    def _start(self, context: Context, event: Event) -> set[str]:
        why, brush = why_not(context.object), context.window_manager.patina_brush
        if why:
            self._end(context)
            return self._refused(why)
        self._stroke = Stroke(context, context.object, brush.radius, brush.through)
        self._amount = 0.0 if event.shift else brush.strength
        self._timer = context.window_manager.event_timer_add(EVERY, window=context.window)
        self._next = 0.0  # when its points are written
        self._news = self._stroke.to(place_of(context, event))
        return {'RUNNING_MODAL'}

    def _painting(self, context: Context, event: Event) -> set[str]:
        self._place = place_of(context, event)
        ends = event.type == 'LEFTMOUSE' and event.value == 'RELEASE' or event.type in _END and event.value == 'PRESS'
        if ends or event.type == 'MOUSEMOVE':
            self._news = self._stroke.to(self._place, last=ends) or self._news
        if ends:
            self._finish(context)
        elif self._news and event.type == 'TIMER' and time.monotonic() >= self._next:
            self._write()
        return self._end(context) if event.type in _END else {'RUNNING_MODAL'}

    def _write(self) -> None:
        """What the stroke has so far, where it has something. Between strokes and events no object is kept: undo would take it."""
        obj = bpy.data.objects.get(self._stroke.name)
        if self._stroke.bits.any() and not why_not(obj):
            start = time.monotonic()
            write(obj, self._stroke.bits, self._amount)
            self._next = time.monotonic() + SHARE * (time.monotonic() - start)
        self._news = False

    def _finish(self, context: Context) -> None:
        """Of a stroke: a step of undo, where it met points."""
        if self._news:
            self._write()
        met = int(np.unpackbits(self._stroke.bits).sum())
        if met:
            bpy.ops.ed.undo_push(message=self.bl_label)
        self._tell(context, f"{met:,} points painted. " if met else "There are no points of the object here. ")
        self._drop(context)

    def _drop(self, context: Context) -> None:
        if self._timer:
            context.window_manager.event_timer_remove(self._timer)
        if self._stroke:
            self._stroke.close()
        self._stroke = self._timer = None

    def _end(self, context: Context) -> set[str]:
        self._drop(context)
        self.end(context)
        return {'CANCELLED'}  # its strokes are steps of undo themselves

    def cancel(self, context: Context) -> None:
        self._end(context)


register, unregister = bpy.utils.register_classes_factory((PATINA_OT_soft_brush,))
