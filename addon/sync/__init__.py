# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's depsgraph → a description of the scene that needs Blender no more.

What crosses is in dataclasses whose fields are those of the library's descriptors. Reading Blender happens on the
calling thread; building clouds happens on a worker, polled.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import bpy

from . import clouds, lights, settings, world
from .camera import Camera, CameraError, View, final_view
from .clouds import CloudItem, CloudStyle
from .lights import Light
from .settings import DeviceChoice, Settings

__all__ = ["Camera", "CameraError", "CloudItem", "CloudStyle", "DeviceChoice", "Light", "SceneDescription",
           "Settings", "View", "describe", "final_view"]


@dataclass(frozen=True)
class SceneDescription:
    clouds: list[CloudItem]
    lights: list[Light]
    camera: Camera
    settings: Settings
    device: DeviceChoice
    notices: list[str]  # what the artist should know about things left out, a sentence each


def describe(depsgraph: bpy.types.Depsgraph, view: View, poll: Callable[[str, float], bool]) -> SceneDescription:
    """Reads the scene. poll(what, progress of it) is called during long steps and returns True to cancel."""
    notices: list[str] = []
    scene = depsgraph.scene_eval
    background = world.background(scene.world, notices)
    return SceneDescription(
        clouds=clouds.collect(depsgraph, poll, notices),
        lights=lights.collect(depsgraph, notices),
        camera=view.camera,
        settings=settings.read(scene, view, background),
        device=settings.device(scene),
        notices=notices,
    )
