# SPDX-License-Identifier: GPL-3.0-or-later
"""Combine by Depth has two scenes: the artist's, and the one of its points, which follows it.

Blender renders the second one at the first one's size, but by its own camera, border and aspect, and of its own root collection and
view layers: before every picture, when the file is saved, and when Blender says that something changed, these are brought over. (It
says so of collections, not of a scene's settings.)
"""

from __future__ import annotations

from collections.abc import Iterator

import bpy
from bpy.app.handlers import persistent
from bpy.types import ID, LayerCollection, Scene

from . import combination

MARK = "patina_points_of"  # on the points' scene: the one that shows them. Until version 0.1 its name

# Of Scene.render; what else is there (engine, film, output) is each scene's own.
RENDER = ("resolution_x", "resolution_y", "resolution_percentage", "pixel_aspect_x", "pixel_aspect_y", "use_border",
          "use_crop_to_border", "border_min_x", "border_max_x", "border_min_y", "border_max_y", "fps", "fps_base")
FRAMES = ("frame_start", "frame_end", "frame_step", "camera")
LAYER = ("exclude", "holdout", "indirect_only")  # of a collection in a view layer

_known: dict[str, set[tuple[str, str]]] = {}  # by the points' scene: what lay at the root of the first one when last looked at


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
    _follow_root(points, first)
    for layer in points.view_layers:
        _follow_layer(layer.layer_collection, (first.view_layers.get(layer.name) or first.view_layers[0]).layer_collection)


def bring_own(points: Scene, old: Scene) -> None:
    """What lies at the root of the old scene of points, and not of the new one, lies there too."""
    for theirs, ours in _roots(old, points):
        have = set(ours)
        for item in [item for item in theirs if item not in have]:
            ours.link(item)


def _roots(first: Scene, points: Scene) -> tuple[tuple, tuple]:
    """A scene's root is a collection that no other scene can have; those in it are shared."""
    ours, theirs = points.collection, first.collection
    return (theirs.children, ours.children), (theirs.objects, ours.objects)


def _follow_root(points: Scene, first: Scene) -> None:
    """What comes to the first scene's root comes here, and what leaves it leaves; what was put here alone stays."""
    known, now = _known.get(points.name, set()), set()
    for theirs, ours in _roots(first, points):
        wanted, have = list(theirs), set(ours)
        for item in wanted:
            if item not in have:
                ours.link(item)
        for item in have.difference(wanted):
            if _key(item) in known:
                ours.unlink(item)
        now.update(map(_key, wanted))
    _known[points.name] = now


def _key(item: ID) -> tuple[str, str]:
    return item.bl_rna.identifier, item.name_full


def _follow_layer(ours: LayerCollection, theirs: LayerCollection) -> None:
    """Collections below, the outer ones first: they take the inner ones along."""
    known = {child.collection: child for child in theirs.children}
    for child in list(ours.children):
        other = known.get(child.collection)
        if other is None:
            continue
        for name in LAYER:
            if getattr(child, name) != getattr(other, name):
                setattr(child, name, getattr(other, name))
        _follow_layer(child, other)


@persistent
def _follow(*_) -> None:
    for points, first in pairs():
        follow(points, first)
    for scene in bpy.data.scenes:
        if combination.take_out(scene):
            tell(f"'{scene.name}' is rendered without points: the scene that held them is gone. Combine them anew")


def tell(text: str) -> None:
    """On the console and in a window, if there is one. From any thread, for Blender renders on another."""
    print(f"Warning: Patina: {text}", flush=True)

    def show() -> None:
        manager = bpy.context.window_manager
        with bpy.context.temp_override(window=manager.windows[0]):
            manager.popup_menu(lambda menu, _context: menu.layout.label(text=text), title="Patina", icon='ERROR')

    if not bpy.app.background:
        bpy.app.timers.register(show)


@persistent
def _forget(*_) -> None:
    _known.clear()


def register() -> None:
    for handlers, function in _handlers():
        handlers.append(function)


def unregister() -> None:
    for handlers, function in _handlers():
        handlers.remove(function)
    _known.clear()


def _handlers() -> tuple[tuple, ...]:
    handlers = bpy.app.handlers
    return ((handlers.load_pre, _forget), *((when, _follow) for when in (
        handlers.load_post, handlers.depsgraph_update_post, handlers.render_init, handlers.render_pre, handlers.save_pre)))
