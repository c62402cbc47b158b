# SPDX-License-Identifier: GPL-3.0-or-later
"""Scene properties → the library's settings and the choice of device."""

from __future__ import annotations

import sys

import bpy

from ... import choices, options
from ...description.settings import DeviceChoice, Settings
from ...description.view import View
from ...properties import enum_number
from ..lighting.world import World

# Scene.patina.device → patina_device_desc.name
DEVICES = {'AUTO': "auto", 'CPU': "cpu", 'CPU_SCALAR': "cpu-scalar", 'GL': "gl-wgl" if sys.platform == "win32" else "gl-egl",
           'GL_SOFTWARE': "gl-osmesa"}


def read(scene: bpy.types.Scene, view: View, world: World) -> Settings:
    patina, studio = scene.patina, scene.patina.studio
    forced = options.read()
    quality = forced.get("quality")
    return Settings(
        width=view.width, height=view.height, region=view.region,
        quality=enum_number(patina, "quality") if quality is None else _number(patina, "quality", quality),
        fill=enum_number(patina, "fill"),
        fill_iterations=patina.fill_iterations,
        smooth=enum_number(patina, "smooth"),
        antialias=enum_number(patina, "antialias"),
        film_transparent=int(scene.render.film_transparent),
        world_color=tuple(studio.ambient) if studio.use_light else world.ambient,
        world_directed=int(bool(world.light) and not studio.use_light),
        world_light=world.light or (0.0,) * 27,
        own_background=int(studio.use_light or studio.use_background or world.plain_light is not None),
        background=tuple(studio.background) if studio.use_background else world.color,
        shadow_uncut=int(patina.shadow_uncut),
        layers=patina.layers,
        surface=enum_number(patina, "surface"),
        error_target=0.0 if quality else 0.01 * patina.error_target,
        shadow_samples=0 if patina.shadow_error else patina.shadow_samples,
        shadow_error=0.01 * patina.shadow_error,
        shadow_resolution=patina.shadow_resolution,
        depth=enum_number(patina, "depth"),
        average=int(patina.average),
        shadow_lazy=1)  # a final picture


def shadow_file(scene: bpy.types.Scene) -> str:
    """Absolute, late, and relative to the library that the scene comes from."""
    patina = scene.patina
    if not patina.use_shadows or not patina.shadow_file:
        return ""
    return bpy.path.abspath(patina.shadow_file, library=scene.original.library)


def samples(scene: bpy.types.Scene) -> int:
    """Of a final picture, for each pixel; 0: by the noise alone."""
    patina = scene.patina
    return int(options.read().get("samples", 0)) or _at_most(patina.samples, noise(scene), patina.is_property_set("samples"))


def noise(scene: bpy.types.Scene) -> float:
    """That ends the samples of a final picture; 0: none does."""
    return float(options.read().get("noise", scene.patina.noise))


def viewport_samples(scene: bpy.types.Scene) -> tuple[int, float]:
    """Of a viewport at rest, and the noise that ends them."""
    return _at_most(scene.patina.viewport_samples, scene.patina.viewport_noise), scene.patina.viewport_noise


def _at_most(samples: int, threshold: float, chosen: bool = True) -> int:
    """The most samples. One sample has no noise to measure. With a threshold, 1 stands for as many as it takes (0), and so does the
    default. chosen: whether the user set the number."""
    return 0 if threshold > 0.0 and (samples == 1 or not chosen) else samples


def _number(group: bpy.types.PropertyGroup, name: str, item: str) -> int:
    return group.bl_rna.properties[name].enum_items[item].value


def device(scene: bpy.types.Scene) -> DeviceChoice:
    """By the command line, else the scene, else the artist's preferences."""
    forced, known = options.read(), choices.get()
    chosen = forced.get("device", scene.patina.device)
    if chosen == 'AUTO' and known and "device" not in forced:
        chosen = known.device
    return DeviceChoice(DEVICES[chosen], forced.get("threads") or _threads(scene, known.threads if known else 0),
                        choices.cloud_bytes())


def _threads(scene: bpy.types.Scene, preferred: int) -> int:
    """The scene's own number, else Blender's fixed one (also `blender -t`), else the preferred one, else 0: one per core."""
    if scene.patina.threads:
        return scene.patina.threads
    return scene.render.threads if scene.render.threads_mode == 'FIXED' else preferred
