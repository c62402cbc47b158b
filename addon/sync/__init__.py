# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's depsgraph → a description of the scene that needs Blender no more.

What crosses is in dataclasses whose fields are those of the library's descriptors. Reading Blender happens on the
calling thread; clouds are built by native threads.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import bpy

from .. import migrate
from ..description.meshes import MeshItem
from ..description.points import CloudItem
from ..description.scene import SceneDescription
from ..description.view import View
from .lighting import lights, world
from .lighting.world import World
from .points import clouds
from .points.built import Pending, PendingLink
from .points.style import style_of
from .points.taking import TakingNow, Trusted, changed_owners
from .view import clipping, clips, effects, lines, marks, settings
from .view.camera import CameraError, final_view, viewport_view
from .view.clips import of_view as view_clips
from .view.marks import read as view_marks

__all__ = ["CameraError", "Pending", "PendingLink", "Trusted", "World", "changed_owners", "describe", "describe_items",
           "describe_viewport", "final_view", "style_of", "view_clips", "view_marks", "viewport_view"]


def describe(depsgraph: bpy.types.Depsgraph, view: View, poll: Callable[[str, float], bool],
             frame: int | None = None) -> SceneDescription:
    """Reads the scene of a final render. poll(what, progress of it) is called during long steps and returns True to
    cancel. frame: whose files sequences show, where the scene stands at a moment beside it."""
    notices: list[str] = []
    taking = TakingNow(poll, notices)
    return describe_items(depsgraph, view, notices,
                          clouds.collect(depsgraph, taking, notices, frame=frame, settle=taking.settle))


def describe_viewport(depsgraph: bpy.types.Depsgraph, view: View, trusted: Trusted,
                      space: bpy.types.SpaceView3D) -> SceneDescription:
    """Reads the scene for a viewport: only points that changed; clouds are left to be built."""
    notices: list[str] = []

    def visible(instance: bpy.types.DepsgraphObjectInstance) -> bool:  # local view, local collections
        obj = instance.parent if instance.is_instance else instance.object
        return obj.visible_in_viewport_get(space)

    found = describe_items(depsgraph, view, notices, clouds.collect(depsgraph, trusted.take(notices), notices, visible,
                                                                    trusting=True))
    samples, noise = settings.viewport_samples(depsgraph.scene_eval)
    return replace(found, settings=replace(found.settings, pixel_samples=samples, pixel_noise=noise))


def describe_items(depsgraph: bpy.types.Depsgraph, view: View, notices: list[str],
                   items: list[CloudItem | MeshItem]) -> SceneDescription:
    """Lights, world and settings of a scene around clouds and meshes that the caller has."""
    scene = depsgraph.scene_eval
    points = [item for item in items if isinstance(item, CloudItem)]
    notices += filter(None, [migrate.notice(scene), clipping.notice(points, view), view.notice])
    studio = scene.patina.studio
    replaced = studio.use_light and studio.use_background  # then nothing of the world is drawn
    around = world.read(None if replaced else scene.world, notices)
    read = settings.read(scene, view, around)
    found_lights, headlight = lights.collect(depsgraph, notices, around.spot), lights.headlight(scene, view, notices)
    notices += filter(None, [lights.notice(points, lights.missing(found_lights, headlight, around))])
    behind = around if around.behind and not (read.film_transparent or studio.use_background) else None
    return SceneDescription(
        clouds=points,
        meshes=[item for item in items if isinstance(item, MeshItem)],
        clips=clips.collect(depsgraph, notices),
        lights=found_lights,
        headlight=headlight,
        lines=lines.read(scene, view.camera),
        camera=view.camera,
        panorama=view.panorama,
        settings=replace(read, film_transparent=1) if behind else read,  # then it is laid behind
        effects=effects.read(scene, view.focus, notices),
        device=settings.device(scene),
        mist=world.mist(scene.world),
        behind=behind,
        shadow_file=settings.shadow_file(scene),
        notices=notices,
        marks=marks.read(scene, view, points, depsgraph.view_layer),
    )
