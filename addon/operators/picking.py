# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that pick points of the shown surface with clicks in a 3D view, or at the pixels of a script."""

from __future__ import annotations

import time

import bpy
from bpy.props import BoolProperty, CollectionProperty
from bpy.types import Context, Event, OperatorMousePath

from .. import native, sync
from ..description.drawings import DrawingError
from ..description.measures import MeasureError
from ..draw import measures as drawing
from ..read import importers
from .view_surface import Hit, Surface
from .view_tools import NAVIGATION, OverView, Place, is_over, is_view, largest_view, place_of, view_of

REACH = 12.0  # pixels, at a resolution scale of 1, within which a point is snapped to
RESTS = 0.15  # seconds that a view rests before the surface under the mouse is looked at: navigation stays fluent

_NOTHING = "There is no surface under the mouse"
FAILURES = (native.PatinaError, sync.CameraError, MeasureError, DrawingError)


class Reports:
    """Beside bpy.types.Operator."""

    def refused(self, why: str) -> set[str]:
        self.report({'ERROR'}, importers.told(f"Patina: {why}"))
        return {'CANCELLED'}


class PickPoints(Reports, OverView):
    """Beside bpy.types.Operator, one with UNDO: what is picked goes to keep()."""

    snap: BoolProperty(name="Snap to Points", default=True, description="Snap to the nearest trusted point. Hold Ctrl to do the opposite")
    path: CollectionProperty(type=OperatorMousePath, options={'SKIP_SAVE', 'HIDDEN'})
    figure = 'DISTANCE'  # what is drawn between the points: a kind of measurement

    def most(self) -> int:
        """How many points end it; 0: any number."""
        raise NotImplementedError

    def title(self) -> str:
        """What is done, for the status bar."""
        raise NotImplementedError

    def again(self) -> None:
        """Invokes the operator once more, in the view that the context names now."""
        raise NotImplementedError

    def keep(self, context: Context, hits: list[Hit]) -> set[str]:
        """One of FAILURES."""
        raise NotImplementedError

    def execute(self, context: Context) -> set[str]:
        places = [tuple(item.loc) for item in self.path]
        try:
            with Surface(context) as surface:
                hits = [surface.at(place, self._reach(context, self.snap)) for place in places]
            missed = next((place for place, hit in zip(places, hits, strict=True) if hit is None), None)
            if missed:
                raise MeasureError(f"There is no surface at pixel {missed[0]:.0f}, {missed[1]:.0f} of the view")
            return self.keep(context, hits)
        except FAILURES as error:
            return self.refused(str(error))

    @staticmethod
    def _reach(context: Context, snap: bool) -> float:
        return REACH * (context.preferences.system.ui_scale or 1.0) if snap else 0.0

    # ---- in a view

    def invoke(self, context: Context, event: Event) -> set[str]:
        if not is_view(context):
            return self._in_a_view(context)
        self._hits: list[Hit] = []
        self._place: Place | None = None
        self._hover: Hit | None = None
        self._surface: Surface | None = None
        self._seen = self._now = view_of(context)
        self._moved = 0.0
        first = ""
        if event.type == 'LEFTMOUSE' and event.value in {'PRESS', 'CLICK'} and is_over(context, event):  # the tool was clicked with
            self._place = place_of(context, event)
            try:
                hit = self._at(context, self.snap != event.ctrl)
            except FAILURES as error:
                self._let_go()
                return self.refused(str(error))
            self._hits += [hit] if hit else []
            first = "" if hit else f"{_NOTHING}. "
        self.begin(context, "")  # what is modal from here on ends in modal(): Blender frees an operator that ends in invoke()
        self._tell(context, first)
        return {'RUNNING_MODAL'}

    def _in_a_view(self, context: Context) -> set[str]:
        """Begun by a button elsewhere."""
        view = largest_view(context)
        if view is None:
            return self.refused("picking points needs a 3D viewport, and the window has none")
        with context.temp_override(area=view[0], region=view[1]):
            self.again()
        return {'CANCELLED'}  # this one

    def _tell(self, context: Context, first: str = "") -> None:
        context.workspace.status_text_set(f"{first}{self.title()}, {len(self._hits)} points. Click: add a point, Ctrl: {'do not snap' if self.snap else 'snap'}, "
                                          "Backspace: remove the last point, Enter or right click: finish, Esc: cancel")

    def end(self, context: Context) -> None:
        super().end(context)
        self._let_go()
        if context.area:
            context.area.tag_redraw()

    def _let_go(self) -> None:
        if self._surface:
            self._surface.close()
        self._surface = None

    def modal(self, context: Context, event: Event) -> set[str]:
        if not is_view(context):  # its area is another one, or gone
            self.end(context)
            return {'CANCELLED'}
        context.area.tag_redraw()
        try:
            return self._event(context, event)
        except FAILURES as error:
            self.end(context)
            return self.refused(str(error))

    def _event(self, context: Context, event: Event) -> set[str]:
        pressed, over = event.value == 'PRESS', is_over(context, event)
        if self._hits and len(self._hits) == self.most():  # by the click that began it
            return self._finish(context)
        if pressed and event.type == 'ESC':
            self.end(context)
            return {'CANCELLED'}
        if pressed and event.type in {'RET', 'NUMPAD_ENTER'} or pressed and over and event.type == 'RIGHTMOUSE':
            return self._finish(context)
        if event.type.startswith(NAVIGATION) or not over or event.alt:
            self._hover = None
            return {'PASS_THROUGH'}
        self._place = place_of(context, event)
        if pressed and event.type == 'LEFTMOUSE':
            return self._click(context, self.snap != event.ctrl)
        if pressed and event.type == 'BACK_SPACE' and self._hits:
            self._hits.pop()
            self._tell(context)
        elif event.type in {'MOUSEMOVE', 'LEFT_CTRL', 'RIGHT_CTRL'} and self._rests(context):
            self._hover = self._at(context, self.snap != event.ctrl)
        return {'RUNNING_MODAL'}

    def _rests(self, context: Context) -> bool:
        """Whether the view has not moved for a moment."""
        view = view_of(context)
        if view != self._now:
            self._now, self._moved, self._hover = view, time.monotonic(), None
        return time.monotonic() - self._moved > RESTS

    def _at(self, context: Context, snap: bool) -> Hit | None:
        """Under the mouse, in the view as it is now."""
        view = view_of(context)
        if self._surface is None or view != self._seen:
            self._let_go()
            self._surface, self._seen = Surface(context), view
        return self._surface.at(self._place, self._reach(context, snap))

    def _click(self, context: Context, snap: bool) -> set[str]:
        hit = self._at(context, snap)
        if hit is None:
            self._tell(context, f"{_NOTHING}. ")
            return {'RUNNING_MODAL'}
        self._hits.append(hit)
        self._tell(context)
        return self._finish(context) if len(self._hits) == self.most() else {'RUNNING_MODAL'}

    def _finish(self, context: Context) -> set[str]:
        self.end(context)
        return self.keep(context, self._hits)

    def _draw_over(self) -> None:
        context = bpy.context
        if context.region != self._region:
            return
        hover = [self._hover] if self._hover else []
        drawing.draw_unfinished(context, self.figure, [hit.world for hit in (*self._hits, *hover)], bool(hover and hover[0].snapped))
