# SPDX-License-Identifier: GPL-3.0-or-later
"""What a case shows: points, camera, lights, and the exact picture where there is one. Slow ones are kept in
build/out/bench/cache, under a name that changes with the truth's source."""

from __future__ import annotations

import hashlib
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))

from truth import Camera, Picture, Points, Scene, orbit, sample, scenes  # noqa: E402

DISTANCE, ELEVATION, FOV = 3.6, 40.0, 45.8
CLOSED = ("sphere", "torus", "tori", "corner", "fin", "shadow")  # back faces are never seen: culled
BLOCK = 4_000_000  # points that are sampled at once
KEPT = 2_000_000  # larger clouds are sampled anew each time


def _source() -> str:
    digest = hashlib.sha256()
    for path in sorted((ROOT / "tests/truth").glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


CACHE = ROOT / "build/out/bench/cache" / _source()


def tidy() -> None:
    """Removes what older sources of the truth made."""
    for folder in CACHE.parent.glob("*"):
        if folder != CACHE:
            shutil.rmtree(folder, ignore_errors=True)


def kept(name: str, make: Callable[[], dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """The arrays that make() gives, from the cache when they are there."""
    path = CACHE / f"{name}.npz"
    if path.is_file():
        with np.load(path) as arrays:
            return {key: arrays[key] for key in arrays.files}
    arrays = make()
    CACHE.mkdir(parents=True, exist_ok=True)
    partial = path.with_suffix(".part.npz")
    np.savez(partial, **arrays)
    partial.replace(path)
    return arrays


@dataclass(frozen=True, eq=False)
class Stage:
    """position, normal float32 (n, 3), normal None where points have none; color uint8 sRGB (n, 3) or None; spacing:
    world units. style, lights: fields of the descriptors. camera: of a turn in degrees. scene: the surfaces, None where
    they are not known."""

    position: np.ndarray
    normal: np.ndarray | None
    color: np.ndarray | None
    spacing: float
    camera: Callable[[float], Camera]
    style: dict[str, Any] = field(default_factory=dict)
    lights: tuple[dict[str, Any], ...] = ()
    scene: Scene | None = None
    name: str = ""
    opacity: np.ndarray | None = None  # float32 (n, 1); None: opaque

    def exact(self, turn: float, width: int, height: int, layers: int = 1, shadow_samples: int = 0,
              sun_angle: float = 0.0, dark: bool = False) -> Picture:
        """The picture at a turn of the camera, float32, without its layers but for the last transmittance. dark: no
        light but the world's."""
        def make() -> dict[str, np.ndarray]:
            lights = () if dark else tuple(replace(one, angle=sun_angle) for one in self.scene.lights)
            scene = replace(self.scene, lights=lights)
            picture = scene.picture(self.camera(turn), width, height, layers, 8, shadow_samples)
            arrays = {one.name: getattr(picture, one.name) for one in fields(Picture)}
            arrays["layer_transmittance"] = arrays["layer_transmittance"][-1:]
            arrays["layer_depth"] = arrays["layer_color"] = arrays["surface"] = np.empty(0)
            return {name: array.astype(np.float32) for name, array in arrays.items()}

        name = f"{self.name}-{width}x{height}-{turn:g}-{layers}-{shadow_samples}-{sun_angle:g}{'-dark' * dark}"
        return Picture(**kept(name, make))


def points_of(name: str, scene: Scene, count: int, pattern: str, noise: float) -> Points:
    if count > KEPT and pattern == "random":
        arrays: dict[str, np.ndarray] = {}
        for begin in range(0, count, BLOCK):
            part = sample(scene, min(BLOCK, count - begin), pattern, noise, 1 + begin // BLOCK)
            for key in ("position", "normal", "color", "surface"):
                values = getattr(part, key)
                whole = arrays.setdefault(key, np.empty((count, *values.shape[1:]), values.dtype))
                whole[begin : begin + len(values)] = values
        return Points(**arrays, spacing=float(np.sqrt(scene.area / count)))
    arrays = kept(f"{name}-{pattern}-{noise:g}-{count}", lambda: vars(sample(scene, count, pattern, noise)))
    return Points(**{**arrays, "spacing": float(arrays["spacing"])})


def with_strays(points: Points, share: float) -> Points:
    """And so many more, uniform in a box of 1.3 times the points' own, with the normals and colours of others."""
    random = np.random.default_rng(5)
    count = int(round(share * len(points)))
    low, high = points.position.min(axis=0), points.position.max(axis=0)
    place = 0.5 * (low + high) + 0.65 * (high - low) * random.uniform(-1.0, 1.0, (count, 3))
    like = random.integers(0, len(points), count)
    more = {name: np.concatenate([getattr(points, name), getattr(points, name)[like]]) for name in ("normal", "color", "surface")}
    return replace(points, position=np.concatenate([points.position, place.astype(np.float32)]), **more)


def density_count(name: str, density: float, height: int) -> int:
    """Points of a scene that make so many a pixel where it faces the camera."""
    area = kept(f"{name}-area", lambda: {"area": np.array(scenes.build(name).area)})["area"]
    pixel = orbit(0.0, ELEVATION, DISTANCE, FOV).pixel(height, DISTANCE)
    return max(int(round(density * float(area) / pixel**2)), 1)


def analytic(case: dict[str, Any]) -> Stage:
    name, clear, distance = case["surface"], bool(case.get("clear")), case.get("distance", DISTANCE)
    scene = scenes.build(name)
    points = points_of(name, scene, case["points"], case.get("pattern", "random"), case.get("noise", 0.0))
    opacity = scene.opacities.astype(np.float32)[points.surface][:, None] if clear else None
    points = with_strays(points, case.get("strays", 0.0))
    if not clear:
        scene = Scene(tuple(replace(one, opacity=1.0) for one in scene.surfaces), scene.lights)
    return Stage(points.position, None if case.get("bare") else points.normal, points.color, points.spacing,
                 lambda turn: orbit(turn, ELEVATION, distance, FOV),
                 {"lighting": 2, "cull_back": int(name in CLOSED and not clear)},
                 tuple(light.fields() for light in scene.lights), scene,
                 name + "-clear" * clear + f"-from-{distance:g}" * (distance != DISTANCE), opacity)


def stage_of(case: dict[str, Any]) -> Stage:
    if case.get("paper"):
        import papers
        return papers.stage(case["paper"])
    return analytic(case)
