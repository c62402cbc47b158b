# SPDX-License-Identifier: GPL-3.0-or-later
"""What is drawn over all 3D views while the add-on is enabled."""

from __future__ import annotations

from collections.abc import Callable

import bpy


class OverViews:
    """Calls a function for each 3D view that Blender draws. when: 'POST_VIEW' or 'POST_PIXEL', Blender's. Without a window it does
    nothing."""

    def __init__(self, draw: Callable[[], None], when: str) -> None:
        self._draw, self._when = draw, when
        self._handler: object | None = None

    def register(self) -> None:
        if not bpy.app.background:
            self._handler = bpy.types.SpaceView3D.draw_handler_add(self._draw, (), 'WINDOW', self._when)

    def unregister(self) -> None:
        if self._handler:
            bpy.types.SpaceView3D.draw_handler_remove(self._handler, 'WINDOW')
        self._handler = None
