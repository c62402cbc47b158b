# SPDX-License-Identifier: GPL-3.0-or-later
"""The one table of render passes: registers them, asks the library for their planes, writes them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import bpy
import numpy as np

from ..description.scene import SceneDescription
from ..native import MOST_LAYERS
from . import cryptomatte, marks

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
    # the library's plane, the described scene, the planes' region → the pass
    convert: Callable[[np.ndarray, SceneDescription], np.ndarray] = lambda plane, scene: plane


def _depth(plane: np.ndarray, scene: SceneDescription) -> np.ndarray:
    """Distance to the camera's plane, of panoramas to the camera, as in Blender's engines; the library measures orthographic z from near."""
    return np.where(np.isfinite(plane), plane + np.float32(_start(scene)), DEPTH_OF_NOTHING)


def _start(scene: SceneDescription) -> float:
    return scene.camera.near_clip if scene.camera.orthographic else 0.0


def _rays(scene: SceneDescription) -> tuple[np.ndarray, np.ndarray]:
    """x (width,) and y (height, 1) of the pixels' centres in the camera's window."""
    camera, settings = scene.camera, scene.settings
    x0, y0, x1, y1 = settings.region
    x = camera.left + (np.arange(x0, x1) + 0.5) * (camera.right - camera.left) / settings.width
    y = camera.bottom + (np.arange(y0, y1) + 0.5) * (camera.top - camera.bottom) / settings.height
    return x, y[:, None]


def _around(scene: SceneDescription) -> tuple[np.ndarray, np.ndarray]:
    """Longitudes (width,) and latitudes (height, 1) of a panorama's pixels."""
    panorama = scene.panorama
    x0, y0, x1, y1 = panorama.region
    angles = [low + (np.arange(first, last) + 0.5) * (high - low) / size for (low, high), first, last, size in (
        (panorama.longitude, x0, x1, panorama.width), (panorama.latitude, y0, y1, panorama.height))]
    return angles[0], angles[1][:, None]


def _position(plane: np.ndarray, scene: SceneDescription) -> np.ndarray:
    """World coordinates, 0 where nothing is. Row by row: float64 only where needed."""
    x, y = _around(scene) if scene.panorama else _rays(scene)
    matrix = np.array(scene.camera.world_from_camera).reshape(4, 4)
    axes = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)
    out = np.zeros((*plane.shape[:2], 3), np.float32)
    for row, z in enumerate(plane[..., 0]):
        some = np.isfinite(z)
        z = z[some].astype(np.float64) + _start(scene)
        if scene.panorama:
            level = z * np.cos(y[row, 0])
            view = np.stack([level * np.sin(x[some]), z * np.sin(y[row, 0]), -level * np.cos(x[some])], 1)
        else:
            grow = 1.0 if scene.camera.orthographic else z
            view = np.stack([x[some] * grow, y[row, 0] * grow * np.ones_like(z), -z], 1)
        out[row, some] = view @ axes.T + matrix[:3, 3]
    return out


def _mist(plane: np.ndarray, scene: SceneDescription) -> np.ndarray:
    """0 where it begins, 1 where everything has vanished, by distance from the camera (its plane, orthographic)."""
    if scene.mist is None:
        return np.ones_like(plane)
    distance = plane[..., 0] + np.float32(_start(scene))
    if not scene.camera.orthographic and not scene.panorama:
        x, y = _rays(scene)
        distance = distance * np.sqrt(1.0 + x * x + y * y)
    share = np.clip((distance - scene.mist.start) / max(scene.mist.depth, 1e-6), 0.0, 1.0)
    power = {'QUADRATIC': 2.0, 'LINEAR': 1.0, 'INVERSE_QUADRATIC': 0.5}[scene.mist.falloff]
    return (share ** power)[..., None].astype(np.float32)


def _object_index(numbers: np.ndarray, scene: SceneDescription) -> np.ndarray:
    """The pass index of the object that each pixel shows."""
    indices = np.array([*(item.pass_index for item in (*scene.clouds, *scene.meshes)), 0], np.float32)
    return indices[cryptomatte.shown_items(numbers, scene)][..., None]


def _mattes(kind: str, number: int) -> RenderPass:
    """Names and shares of the ranks 2 number and 2 number + 1."""
    def wanted(layer: bpy.types.ViewLayer) -> bool:
        return getattr(layer, f"use_pass_cryptomatte_{kind.lower()}") and number < _matte_passes(layer)

    # lowercase where Cycles writes it so, for readers of files
    return RenderPass(f"Crypto{kind}{number:02d}", 4, "RGBA" if bpy.app.version < (4, 2, 0) else "rgba", 'COLOR',
                      f"{cryptomatte.PLANE} {kind} {number}", wanted)


def _matte_passes(layer: bpy.types.ViewLayer) -> int:
    return (min(layer.pass_cryptomatte_depth, cryptomatte.MOST_RANKS) + 1) // 2


def _of_layer(number: int) -> tuple[RenderPass, ...]:
    """What one layer of surface shows by itself; 1 is the nearest."""
    def wanted(layer: bpy.types.ViewLayer) -> bool:
        return layer.patina.pass_layers >= number

    return (RenderPass(f"Layer {number}", 4, "RGBA", 'COLOR', f"COMBINED {number}", wanted),
            RenderPass(f"Layer {number} Depth", 1, "Z", 'VALUE', f"DEPTH {number}", wanted, _depth),
            RenderPass(f"Layer {number} Normal", 3, "XYZ", 'VECTOR', f"NORMAL {number}", wanted))


def _full(scene: SceneDescription) -> int:
    return 0 if scene.panorama else scene.settings.width


def _burned(plane: np.ndarray, scene: SceneDescription) -> np.ndarray:
    return marks.over(scene.marks, plane, _full(scene)) if scene.marks and scene.marks.burn else plane


def _overlay(plane: np.ndarray, scene: SceneDescription) -> np.ndarray:
    return marks.paint(scene.marks, plane.shape[1], plane.shape[0], _full(scene)) if scene.marks else np.zeros_like(plane)


PASSES = (
    RenderPass("Combined", 4, "RGBA", 'COLOR', "COMBINED", lambda layer: True, _burned),
    RenderPass("Overlay", 4, "RGBA", 'COLOR', "COMBINED", lambda layer: layer.patina.use_pass_overlay, _overlay),
    RenderPass("Depth", 1, "Z", 'VALUE', "DEPTH", lambda layer: layer.use_pass_z, _depth),
    RenderPass("Mist", 1, "Z", 'VALUE', "DEPTH", lambda layer: layer.use_pass_mist, _mist),
    RenderPass("Position", 3, "XYZ", 'VECTOR', "DEPTH", lambda layer: layer.use_pass_position, _position),
    RenderPass("Normal", 3, "XYZ", 'VECTOR', "NORMAL", lambda layer: layer.use_pass_normal),
    RenderPass("Shadow", 3, "RGB", 'COLOR', "SHADOW", lambda layer: layer.patina.use_pass_shadow,
               lambda plane, camera: np.repeat(plane, 3, 2)),
    RenderPass("IndexOB" if bpy.app.version < (5, 0, 0) else "Object Index", 1, "X", 'VALUE', "NUMBERS",
               lambda layer: layer.use_pass_object_index, _object_index),
    RenderPass("Source", 1, "X", 'VALUE', "SOURCE", lambda layer: layer.patina.use_pass_source),
    RenderPass("Line", 1, "X", 'VALUE', "LINE", lambda layer: layer.patina.use_pass_line),
    RenderPass("Trust", 1, "X", 'VALUE', "TRUST", lambda layer: layer.patina.use_pass_trust),
    RenderPass("Thickness", 1, "X", 'VALUE', "THICKNESS", lambda layer: layer.patina.use_pass_thickness),
    RenderPass("Density", 1, "X", 'VALUE', "DENSITY", lambda layer: layer.patina.use_pass_density),
    RenderPass("Disagreement", 1, "X", 'VALUE', "DISAGREEMENT", lambda layer: layer.patina.use_pass_disagreement),
    *(item for number in range(1, MOST_LAYERS + 1) for item in _of_layer(number)),
    *(_mattes(kind, number) for kind in cryptomatte.KINDS for number in range(cryptomatte.MOST_RANKS // 2)),
)


def eyes(settings: bpy.types.RenderSettings) -> list[str]:
    """The stereo views that are rendered; one without a name where there is no stereo."""
    if not settings.use_multiview:
        return [""]
    wanted = [view.name for view in settings.views if view.use]
    if settings.views_format == 'STEREO_3D':
        wanted = [name for name in wanted if name in {"left", "right"}]
    return wanted or [""]


def enabled(layer: bpy.types.ViewLayer) -> list[RenderPass]:
    return [render_pass for render_pass in PASSES if render_pass.enabled(layer)]


def register(engine: bpy.types.RenderEngine, scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> None:
    """Tells Blender which passes this layer will have."""
    for item in enabled(layer):
        engine.register_pass(scene, layer, item.name, item.channels, item.channel_ids, item.kind)


class Shown:
    """A picture on its way into Blender, of one view layer and eye (the name of a stereo view): what there is of it may be shown
    before it is finished. Its size is that of a whole picture; a render border counts as one."""

    def __init__(self, engine: bpy.types.RenderEngine, layer: bpy.types.ViewLayer, eye: str = "") -> None:
        self._engine, self._layer, self._eye = engine, layer, eye
        self._result: bpy.types.RenderResult | None = None
        self._items = enabled(layer)

    def __enter__(self) -> Shown:
        return self

    def __exit__(self, *_: object) -> None:
        """Blender keeps what was put."""
        if self._result is not None:
            self._engine.end_result(self._result)
            self._result = None

    def put(self, scene: SceneDescription, planes: dict[str, np.ndarray], show: bool = True) -> None:
        """Planes of the picture, at first all of them and later those that changed. show: at once."""
        height, width = planes["COMBINED"].shape[:2]
        if self._result is None and not self._begin(width, height):
            return
        for item in self._items:
            if item.plane in planes:
                pixels = np.ascontiguousarray(item.convert(planes[item.plane], scene), np.float32)
                for target in self._result.layers[0].passes:
                    if target.name == item.name:
                        _set_pixels(target, pixels)
        if show:
            self._engine.update_result(self._result)

    def _begin(self, width: int, height: int) -> bool:
        for item in self._items:
            if item.name != "Combined":
                self._engine.add_pass(item.name, item.channels, item.channel_ids, layer=self._layer.name)
        self._result = self._engine.begin_result(0, 0, width, height, layer=self._layer.name, view=self._eye)
        if self._result is None:
            return False
        if (self._result.resolution_x, self._result.resolution_y) != (width, height):
            raise RuntimeError(f"Blender asks for {self._result.resolution_x} x {self._result.resolution_y} pixels, "
                               f"{width} x {height} were rendered")
        return True


def write(engine: bpy.types.RenderEngine, layer: bpy.types.ViewLayer, scene: SceneDescription,
          planes: dict[str, np.ndarray], eye: str = "", begun: Shown | None = None) -> None:
    """Hands the planes of a finished picture to Blender, and ends what was begun of it: Blender copies all passes at each end."""
    for kind in cryptomatte.KINDS:
        if getattr(layer, f"use_pass_cryptomatte_{kind.lower()}"):
            for name, value in cryptomatte.metadata(layer.name, kind, cryptomatte.names(scene, kind)).items():
                engine.get_result().stamp_data_add_field(name, value)
    with begun or Shown(engine, layer, eye) as shown:
        shown.put(scene, planes, show=False)


def _set_pixels(target: bpy.types.RenderPass, pixels: np.ndarray) -> None:
    height, width, channels = pixels.shape
    try:
        target.rect.foreach_set(pixels.reshape(-1))
    except TypeError:  # Blender 3.x counts pixels here, not values, and takes the whole buffer
        target.rect.foreach_set(pixels.reshape(height * width, channels))
