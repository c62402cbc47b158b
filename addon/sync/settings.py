# SPDX-License-Identifier: GPL-3.0-or-later
"""Scene properties → the library's settings and the choice of device."""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ..properties import enum_number
from .camera import View

# Scene.patina.device → patina_device_desc.name
DEVICES = {'AUTO': "auto", 'CPU': "cpu", 'CPU_SCALAR': "cpu-scalar", 'GL': "gl-egl", 'GL_SOFTWARE': "gl-osmesa"}


@dataclass(frozen=True)
class DeviceChoice:
    name: str
    threads: int


@dataclass(frozen=True)
class Settings:
    """patina_settings."""

    width: int
    height: int
    region: tuple[int, int, int, int]
    quality: int
    fill: int
    fill_iterations: int
    smooth: int
    antialias: int
    film_transparent: int
    world_color: tuple[float, float, float]
    layers: int


def read(scene: bpy.types.Scene, view: View, world_color: tuple[float, float, float]) -> Settings:
    patina = scene.patina
    return Settings(
        width=view.width, height=view.height, region=view.region,
        quality=enum_number(patina, "quality"),
        fill=enum_number(patina, "fill"),
        fill_iterations=patina.fill_iterations,
        smooth=enum_number(patina, "smooth"),
        antialias=enum_number(patina, "antialias"),
        film_transparent=int(scene.render.film_transparent),
        world_color=world_color,
        layers=patina.layers)


def device(scene: bpy.types.Scene) -> DeviceChoice:
    return DeviceChoice(DEVICES[scene.patina.device], _threads(scene))


def _threads(scene: bpy.types.Scene) -> int:
    """Patina's own number, else Blender's fixed one (also `blender -t`), else 0: one per core."""
    if scene.patina.threads:
        return scene.patina.threads
    return scene.render.threads if scene.render.threads_mode == 'FIXED' else 0
