# SPDX-License-Identifier: GPL-3.0-or-later
"""A torus of random points, its exact picture by float64 ray casting, and what separates a picture from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

RING, TUBE = 1.0, 0.4
AREA = 4.0 * np.pi**2 * RING * TUBE
SUN = np.array([0.36, -0.48, 0.8])  # towards the light
SUN_POWER = np.pi  # W/m2: a white Lambert surface that faces it shows 1
WORLD = 0.05
DISTANCE, ELEVATION, FOV = 3.6, 40.0, 45.8


# ---- points --------------------------------------------------------------------------------------------------


def srgb_bytes(position: np.ndarray) -> np.ndarray:
    """A colour that varies smoothly over the surface, before rounding to bytes."""
    turned = np.roll(position, -1, axis=-1)
    return 127.5 + 100.0 * np.sin(3.0 * position + turned + np.arange(3))


def linear(srgb: np.ndarray) -> np.ndarray:
    value = np.clip(srgb / 255.0, 0.0, 1.0)
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def torus(count: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions, normals (float32) and colours (uint8 sRGB), area-uniform, in random order."""
    random = np.random.default_rng(seed)
    inside = np.empty(count)
    filled = 0
    while filled < count:  # the outer half has more area: reject in proportion
        angle = random.random(count) * (2.0 * np.pi)
        angle = angle[random.random(count) * (RING + TUBE) <= RING + TUBE * np.cos(angle)][: count - filled]
        inside[filled : filled + len(angle)] = angle
        filled += len(angle)
    around = random.random(count) * (2.0 * np.pi)
    normals = np.stack([np.cos(inside) * np.cos(around), np.cos(inside) * np.sin(around), np.sin(inside)], axis=1)
    centres = np.stack([np.cos(around), np.sin(around), np.zeros(count)], axis=1) * RING
    positions = centres + TUBE * normals
    colors = np.rint(srgb_bytes(positions)).astype(np.uint8)
    return positions.astype(np.float32), normals.astype(np.float32), colors


# ---- camera --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class View:
    """A perspective camera that looks at the origin; matrix is world_from_camera, half the window at distance 1."""

    matrix: np.ndarray
    half: float

    def fields(self) -> dict[str, object]:
        """The fields of patina_camera, for a square picture."""
        return {"world_from_camera": self.matrix.ravel().tolist(), "left": -self.half, "right": self.half,
                "bottom": -self.half, "top": self.half, "near_clip": 0.1, "far_clip": 100.0}


def view(azimuth: float) -> View:
    turn, rise = np.radians(azimuth), np.radians(ELEVATION)
    back = np.array([np.sin(turn) * np.cos(rise), -np.cos(turn) * np.cos(rise), np.sin(rise)])
    right = np.array([np.cos(turn), np.sin(turn), 0.0])
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = right, np.cross(back, right), back, DISTANCE * back
    return View(matrix, float(np.tan(np.radians(FOV) / 2.0)))


# ---- the exact picture -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Picture:
    """At pixel centres, row 0 at the bottom. depth: +inf where nothing is; color: linear, not premultiplied."""

    depth: np.ndarray
    normal: np.ndarray
    color: np.ndarray

    def save(self, path: str) -> None:
        np.savez(path, depth=self.depth, normal=self.normal, color=self.color)

    @staticmethod
    def load(path: str) -> Picture:
        with np.load(path) as arrays:
            return Picture(arrays["depth"], arrays["normal"], arrays["color"])


def _distance(point: np.ndarray) -> np.ndarray:
    return np.hypot(np.hypot(point[:, 0], point[:, 1]) - RING, point[:, 2]) - TUBE


def cast(camera: View, size: int) -> Picture:
    """Walks along each ray by the distance to the torus, which never passes the first hit."""
    axis = ((np.arange(size) + 0.5) / size * 2.0 - 1.0) * camera.half
    u, v = np.meshgrid(axis, axis)
    local = np.stack([u, v, -np.ones_like(u)], axis=-1).reshape(-1, 3)
    scale = np.linalg.norm(local, axis=1)
    ray = (local / scale[:, None]) @ camera.matrix[:3, :3].T
    origin = camera.matrix[:3, 3]
    along = -ray @ origin
    outer = RING + TUBE
    reach = outer**2 - (origin @ origin - along**2)
    active = np.flatnonzero(reach > 0.0)
    start, end = along[active] - np.sqrt(reach[active]), along[active] + np.sqrt(reach[active])
    t = start.copy()
    hit = np.full(len(ray), np.inf)
    while len(active):
        step = _distance(origin + t[:, None] * ray[active])
        done = step < 1e-10
        hit[active[done]] = t[done]
        t = t + step
        walking = ~done & (t <= end)
        active, t, end = active[walking], t[walking], end[walking]

    found = np.isfinite(hit)
    point = origin + hit[found, None] * ray[found]
    across = np.hypot(point[:, 0], point[:, 1])[:, None]
    normal_found = (point - np.pad(point[:, :2] / across, ((0, 0), (0, 1))) * RING) / TUBE
    normal = np.zeros_like(ray)
    normal[found] = normal_found
    light = np.maximum(normal_found @ SUN, 0.0) * (SUN_POWER / np.pi) + WORLD
    color = np.zeros_like(ray)
    color[found] = linear(srgb_bytes(point)) * light[:, None]
    depth = np.where(found, hit / scale, np.inf)  # distance to the camera plane
    return Picture(depth.reshape(size, size), normal.reshape(size, size, 3), color.reshape(size, size, 3))


# ---- metrics -----------------------------------------------------------------------------------------------------


def _around(mask: np.ndarray) -> np.ndarray:
    """How many of the 3x3 pixels around are set; beyond the border counts as the border does."""
    wide = np.pad(mask.astype(np.uint8), 1, mode="edge")
    rows = wide[:-2] + wide[1:-1] + wide[2:]
    return rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:]


def errors(truth: Picture, depth: np.ndarray, normal: np.ndarray, rgba: np.ndarray, points: int) -> dict[str, float]:
    """Coverage in shares of the truth's area; depth in spacings (1/sqrt(points per area)), normals in degrees, colour
    against Lambert, these where the truth covers the 3x3 pixels around. rgba: premultiplied, transparent film."""
    expected, shown = np.isfinite(truth.depth), np.isfinite(depth)
    around = _around(expected)
    area = float(expected.sum())
    inner = (around == 9) & shown
    spacing = np.sqrt(AREA / points)
    off = np.abs(depth[inner].astype(np.float64) - truth.depth[inner]) / spacing
    dots = np.sum(normal[inner].astype(np.float64) * truth.normal[inner], axis=1)
    angle = np.degrees(np.arccos(np.clip(dots, -1.0, 1.0)))
    alpha = np.maximum(rgba[inner][:, 3:4].astype(np.float64), 1e-6)
    color = rgba[inner][:, :3] / alpha - truth.color[inner]
    return {
        "coverage_iou": float((expected & shown).sum() / max((expected | shown).sum(), 1)),
        "false_holes": float((expected & ~shown).sum() / area),
        "inner_holes": float(((around == 9) & ~shown).sum() / area),
        "false_growth": float((~expected & shown).sum() / area),
        "outer_growth": float(((around == 0) & shown).sum() / area),
        "depth_rms_spacings": float(np.sqrt(np.mean(off**2))),
        "depth_p999_spacings": float(np.quantile(off, 0.999)),
        "normal_mean_degrees": float(np.mean(angle)),
        "normal_p99_degrees": float(np.quantile(angle, 0.99)),
        "color_rms": float(np.sqrt(np.mean(color**2))),
    }
