# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators made of steps: a script waits for the last one; a user's Blender goes on between them, and Esc ends it."""

from __future__ import annotations

import time

from bpy.types import Context, Event

from .. import jobs
from ..read.importers import Progress

TICK = 0.01  # seconds from one look at a user's operator to the next
SHARE = 0.03  # seconds that a look works, and a step beyond


class Stepped:
    """Beside bpy.types.Operator. execute() returns begin(...); invoke() says first that a user wants it."""

    _invoked = False  # by a user, not by a script
    _steps = None  # under way; Blender evaluates annotations here
    _progress: Progress

    def begin(self, context: Context, steps: jobs.Steps[set[str]]) -> set[str]:
        self._steps = steps
        if not self._invoked:
            return jobs.finish(steps)
        self._task = None
        self._timer = context.window_manager.event_timer_add(TICK, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {'RUNNING_MODAL'}

    def modal(self, context: Context, event: Event) -> set[str]:
        """Goes on at each tick of a timer; all else that the user does waits for its end."""
        if event.type == 'ESC':
            self._progress.cancel()
        elif event.type != 'TIMER':
            return {'RUNNING_MODAL'}
        done, until = set(), time.monotonic() + SHARE
        try:
            while time.monotonic() < until:
                if self._task is None or self._task.done():
                    self._task = next(self._steps)
                else:
                    time.sleep(0.001)
        except StopIteration as end:
            done = end.value
        text = f"{self._progress.doing}: {100.0 * self._progress.value():.0f} %, Esc ends it"
        context.workspace.status_text_set(None if done else text)
        if not done:
            return {'RUNNING_MODAL'}
        context.window_manager.event_timer_remove(self._timer)
        self._invoked = False  # other settings in the panel of the last operator: that waits
        return done

    def cancel(self, context: Context) -> None:
        """Blender ends it, or the choice of files was given up."""
        if self._steps:
            self._progress.cancel()
            if self._task:
                self._task.close()  # waits for what its steps hold
            self._steps.close()
            context.workspace.status_text_set(None)
