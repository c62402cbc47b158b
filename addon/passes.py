# SPDX-License-Identifier: GPL-3.0-or-later
"""The one table of render passes: registers them, asks the library for their planes, writes them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import bpy
import numpy as np

from .native import MOST_LAYERS
from .sync import Camera

# What Blender's engines write where nothing is: infinity would make NaN in the compositor's arithmetic.
DEPTH_OF_NOTHING = np.float32(1e10)


@dataclass(frozen=True)
class RenderPass:
    name: str  # in Blender
    channels: int
    channel_ids: str
    kind: str  # of compositor socket
    plane: str  # in the library
    enabled: Callable[[bpy.types.ViewLayer], bool]
    convert: Callable[[np.ndarray, Camera], np.ndarray] = lambda plane, camera: plane


def _depth(plane: np.ndarray, camera: Camera) -> np.ndarray:
    """Distance to the camera's plane, as in Blender's engines; the library measures orthographic z from near."""
    start = np.float32(camera.near_clip if camera.orthographic else 0.0)
    return np.where(np.isfinite(plane), plane + start, DEPTH_OF_NOTHING)


def _of_layer(number: int) -> tuple[RenderPass, ...]:
    """What one layer of surface shows by itself; 1 is the nearest."""
    def wanted(layer: bpy.types.ViewLayer) -> bool:
        return layer.patina.pass_layers >= number

    return (RenderPass(f"Layer {number}", 4, "RGBA", 'COLOR', f"COMBINED {number}", wanted),
            RenderPass(f"Layer {number} Depth", 1, "Z", 'VALUE', f"DEPTH {number}", wanted, _depth),
            RenderPass(f"Layer {number} Normal", 3, "XYZ", 'VECTOR', f"NORMAL {number}", wanted))


PASSES = (
    RenderPass("Combined", 4, "RGBA", 'COLOR', "COMBINED", lambda layer: True),
    RenderPass("Depth", 1, "Z", 'VALUE', "DEPTH", lambda layer: layer.use_pass_z, _depth),
    RenderPass("Normal", 3, "XYZ", 'VECTOR', "NORMAL", lambda layer: layer.use_pass_normal),
    RenderPass("Source", 1, "X", 'VALUE', "SOURCE", lambda layer: layer.patina.use_pass_source),
    *(item for number in range(1, MOST_LAYERS + 1) for item in _of_layer(number)),
)


def enabled(layer: bpy.types.ViewLayer) -> list[RenderPass]:
    return [render_pass for render_pass in PASSES if render_pass.enabled(layer)]


def register(engine: bpy.types.RenderEngine, scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> None:
    """Tells Blender which passes this layer will have."""
    for item in enabled(layer):
        engine.register_pass(scene, layer, item.name, item.channels, item.channel_ids, item.kind)


def write(engine: bpy.types.RenderEngine, layer: bpy.types.ViewLayer, camera: Camera,
          planes: dict[str, np.ndarray]) -> None:
    """Hands the planes of a whole picture (a render border counts as one) to Blender."""
    height, width = planes["COMBINED"].shape[:2]
    items = enabled(layer)
    for item in items:
        if item.name != "Combined":
            engine.add_pass(item.name, item.channels, item.channel_ids, layer=layer.name)
    result = engine.begin_result(0, 0, width, height, layer=layer.name)
    if result is None:
        return
    try:
        if (result.resolution_x, result.resolution_y) != (width, height):
            raise RuntimeError(f"Blender asks for {result.resolution_x} x {result.resolution_y} pixels, "
                               f"{width} x {height} were rendered")
        for item in items:
            pixels = np.ascontiguousarray(item.convert(planes[item.plane], camera), np.float32)
            for target in result.layers[0].passes:  # more than one of a name in stereo
                if target.name == item.name:
                    _set_pixels(target, pixels)
    finally:
        engine.end_result(result)


def _set_pixels(target: bpy.types.RenderPass, pixels: np.ndarray) -> None:
    height, width, channels = pixels.shape
    try:
        target.rect.foreach_set(pixels.reshape(-1))
    except TypeError:  # Blender 3.x counts pixels here, not values, and takes the whole buffer
        target.rect.foreach_set(pixels.reshape(height * width, channels))
