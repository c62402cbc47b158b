# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of older versions of the add-on: brought to the present form when their file is loaded, stamped when it is saved.

Blender stores what the artist set, not what was left as it came. So a new default, like a new name or meaning, changes old
files, unless a step here says what they meant. The number of a scene's version is the number of steps that it has behind it.
A step is done once for each scene that Patina draws, and finds it as the step before left it.
"""

from __future__ import annotations

from typing import Any

import bpy
from bpy.app.handlers import persistent


def _meshes_were_left_out(scene: bpy.types.Scene) -> None:
    """Until version 1 meshes with faces were not drawn, unless the artist asked for it."""
    if not scene.patina.is_property_set("meshes"):
        scene.patina.meshes = 'OFF'


def _strays_were_hidden(scene: bpy.types.Scene) -> None:
    """Until version 2 stray points had a switch of their own, and points of little certainty a threshold. Both are left out for their
    trust now, unless the object draws all points."""
    for obj in scene.objects:
        if obj.library is not None:
            continue
        stored = _stored(obj)
        if stored.get("hide_stray") and obj.patina.least_trust == 0.0:
            obj.patina.property_unset("least_trust")
        for name in ("hide_stray", "least_certainty"):
            if name in stored:
                del stored[name]


def _one_sample_was_the_default(scene: bpy.types.Scene) -> None:
    """Until version 3 a final render took one sample by default."""
    if not scene.patina.is_property_set("samples"):
        scene.patina.samples = 1


def _stored(obj: bpy.types.Object) -> Any:
    """What is saved of an object's properties, by name, those that are no longer known too; like a dict."""
    return obj.patina if bpy.app.version < (5, 0, 0) else obj.patina.bl_system_properties_get() or {}


STEPS = (_meshes_were_left_out, _strays_were_hidden, _one_sample_was_the_default)


def bring(scene: bpy.types.Scene) -> None:
    """Does the steps that a scene lacks. One that another engine draws is new to Patina: there is nothing to bring."""
    if scene.render.engine == 'PATINA':
        for step in STEPS[scene.patina.version:]:
            step(scene)
    stamp(scene)


def stamp(scene: bpy.types.Scene) -> None:
    scene.patina.version = max(scene.patina.version, len(STEPS))


def notice(scene: bpy.types.Scene) -> str:
    """What the artist should know about the version; mostly nothing."""
    if scene.patina.version <= len(STEPS):
        return ""
    return "the file was saved by a newer version of Patina: what this one does not know is kept, but not drawn"


@persistent
def _loaded(*_) -> None:
    for scene in bpy.data.scenes:
        bring(scene)


@persistent
def _saving(*_) -> None:
    for scene in bpy.data.scenes:
        stamp(scene)


def register() -> None:
    bpy.app.handlers.load_post.append(_loaded)
    bpy.app.handlers.save_pre.append(_saving)


def unregister() -> None:
    bpy.app.handlers.save_pre.remove(_saving)
    bpy.app.handlers.load_post.remove(_loaded)
