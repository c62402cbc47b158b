# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's depsgraph → a description of the scene that needs Blender no more.

What crosses is in dataclasses whose fields are those of the library's descriptors. Reading Blender happens on the
calling thread; clouds are built by native threads.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import bpy

from .. import migrate
from . import clipping, clips, clouds, effects, lights, lines, settings, world
from .camera import Camera, CameraError, Focus, Panorama, View, final_view, viewport_view
from .clips import Clip
from .clips import of_view as view_clips
from .clouds import CloudItem, CloudStyle, Pending, PendingLink, Trusted, changed_owners, style_of
from .effects import Effects
from .lights import Headlight, Light
from .lines import Lines
from .meshes import MeshItem
from .settings import DeviceChoice, Settings
from .world import Mist, World

__all__ = ["Camera", "CameraError", "Clip", "CloudItem", "CloudStyle", "DeviceChoice", "Light", "Lines", "MeshItem", "Mist",
           "Panorama", "Pending", "PendingLink", "Effects", "Focus",
           "SceneDescription", "Settings", "Trusted", "View", "World", "changed_owners", "describe", "describe_items",
           "describe_viewport", "final_view", "style_of", "view_clips", "viewport_view"]


@dataclass(frozen=True)
class SceneDescription:
    clouds: list[CloudItem]
    meshes: list[MeshItem]
    clips: list[Clip]
    lights: list[Light]
    headlight: Headlight | None
    lines: Lines | None
    camera: Camera
    panorama: Panorama | None  # all around from where the camera stands
    settings: Settings
    effects: Effects
    device: DeviceChoice
    mist: Mist | None
    behind: World | None  # what is seen behind all, by direction; None: the settings' background, or a transparent film
    shadow_file: str  # baked shadow textures; empty: none
    notices: list[str]  # what the artist should know about things left out, a sentence each


def describe(depsgraph: bpy.types.Depsgraph, view: View, poll: Callable[[str, float], bool],
             frame: int | None = None) -> SceneDescription:
    """Reads the scene of a final render. poll(what, progress of it) is called during long steps and returns True to
    cancel. frame: whose files sequences show, where the scene stands at a moment beside it."""
    notices: list[str] = []
    taking = clouds.TakingNow(poll, notices)
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
    )
