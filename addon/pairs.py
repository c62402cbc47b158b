# SPDX-License-Identifier: GPL-3.0-or-later
"""Combine by Depth has two scenes: the artist's, and the one of its points, which follows it.

Blender renders the second one at the first one's size, but by its own camera, border and aspect: before every picture, and when
the file is saved, these are brought over. Blender gives no sign when a scene's settings change.
"""

from __future__ import annotations

from collections.abc import Iterator

import bpy
from bpy.app.handlers import persistent
from bpy.types import Scene

MARK = "patina_points_of"  # on the points' scene: the one that shows them. Until version 0.1 its name

# Of Scene.render; what else is there (engine, film, output) is each scene's own.
RENDER = ("resolution_x", "resolution_y", "resolution_percentage", "pixel_aspect_x", "pixel_aspect_y", "use_border",
          "use_crop_to_border", "border_min_x", "border_max_x", "border_min_y", "border_max_y", "fps", "fps_base")
FRAMES = ("frame_start", "frame_end", "frame_step", "camera")


def first_of(points: Scene) -> Scene | None:
    """The scene that shows these points; None for one that is not such a scene, or whose first scene is gone."""
    mark = points.get(MARK)
    return bpy.data.scenes.get(mark) if isinstance(mark, str) else mark


def points_of(scene: Scene) -> Scene | None:
    return next((points for points, first in pairs() if first == scene), None)


def pairs() -> Iterator[tuple[Scene, Scene]]:
    """(the points' scene, the first one)"""
    for points in bpy.data.scenes:
        first = first_of(points) if points.library is None else None
        if first and first != points:
            yield points, first


def follow(points: Scene, first: Scene) -> None:
    """Brings over what differs."""
    if isinstance(points[MARK], str):
        points[MARK] = first
    for theirs, ours, names in ((first.render, points.render, RENDER), (first, points, FRAMES)):
        for name in names:
            if getattr(ours, name) != getattr(theirs, name):
                setattr(ours, name, getattr(theirs, name))
    if len(points.timeline_markers):  # they would switch the camera; the first scene's have done it
        points.timeline_markers.clear()


@persistent
def _follow(*_) -> None:
    for points, first in pairs():
        follow(points, first)


def register() -> None:
    for handlers in _handlers():
        handlers.append(_follow)


def unregister() -> None:
    for handlers in _handlers():
        handlers.remove(_follow)


def _handlers() -> tuple[list, ...]:
    handlers = bpy.app.handlers
    return handlers.render_init, handlers.render_pre, handlers.save_pre
