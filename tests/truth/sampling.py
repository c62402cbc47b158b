# SPDX-License-Identifier: GPL-3.0-or-later
"""Points of a scene's surfaces: uniform random, blue noise (Poisson discs), or scan lines; with noise along the
normal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .scene import Scene, srgb_bytes

ROWS = 10.0  # how many times as far apart as their samples the lines of the pattern "rows" lie
PATTERNS = ("random", "blue", "scan", "rows")


@dataclass(frozen=True, eq=False)
class Points:
    """position, normal float32 (n, 3); color uint8 sRGB (n, 3); surface: index (n). spacing: 1 / sqrt(points per
    area)."""

    position: np.ndarray
    normal: np.ndarray
    color: np.ndarray
    surface: np.ndarray
    spacing: float

    def __len__(self) -> int:
        return len(self.position)


def count_for(scene: Scene, density: float, pixel: float) -> int:
    """How many points make `density` a pixel where a surface faces the camera; pixel: its size there, world units."""
    return max(int(round(density * scene.area / pixel**2)), 1)


def sample(scene: Scene, count: int, pattern: str = "random", noise: float = 0.0, seed: int = 1) -> Points:
    """About `count` points (random: exactly), in random order (scan: as scanned). noise: standard deviation along the
    normal, in spacings; colours are those of the true surface."""
    random = np.random.default_rng(seed)
    if pattern == "random":
        position, normal, surface = _random(scene, count, random)
    elif pattern == "blue":
        position, normal, surface = _blue(scene, count, random)
    elif pattern == "scan":
        position, normal, surface = _scan(scene, count)
    elif pattern == "rows":
        position, normal, surface = _scan(scene, count, ROWS)
    else:
        raise ValueError(f"no pattern '{pattern}': there are {', '.join(PATTERNS)}")
    color = np.rint(srgb_bytes(position)).astype(np.uint8)
    spacing = float(np.sqrt(scene.area / max(len(position), 1)))
    if noise:
        position = position + random.normal(scale=noise * spacing, size=len(position))[:, None] * normal
    return Points(position.astype(np.float32), normal.astype(np.float32), color, surface, spacing)


def _random(scene: Scene, count: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    areas = np.array([surface.area for surface in scene.surfaces])
    if len(areas) == 1:
        counts = [count]
    else:
        counts = random.multinomial(count, areas / areas.sum())
    parts = [surface.sample(int(n), random) for surface, n in zip(scene.surfaces, counts)]
    position, normal = (np.concatenate(arrays) for arrays in zip(*parts))
    surface = np.repeat(np.arange(len(areas), dtype=np.int16), counts)
    if len(areas) > 1:
        order = random.permutation(count)
        position, normal, surface = position[order], normal[order], surface[order]
    return position, normal, surface


def _blue(scene: Scene, count: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Poisson discs: of four candidates a point, those stay that are first, in random order, among all within a radius;
    the radius is such that about `count` stay."""
    try:
        from scipy.spatial import cKDTree
    except ImportError:
        raise RuntimeError("blue noise needs scipy, which build/setup installs with scikit-image") from None
    position, normal, surface = _random(scene, 4 * count, random)
    radius = 0.68 * np.sqrt(scene.area / count)
    pairs = cKDTree(position).query_pairs(radius, output_type="ndarray")
    pairs = pairs[surface[pairs[:, 0]] == surface[pairs[:, 1]]]  # sheets do not thin each other
    undecided = np.ones(len(position), bool)
    kept = np.zeros(len(position), bool)
    while undecided.any():  # the earlier of a pair goes first: order is random already
        first, second = pairs.min(axis=1), pairs.max(axis=1)
        waits = np.zeros(len(position), bool)
        waits[second] = True
        won = undecided & ~waits
        kept |= won
        beaten = np.zeros(len(position), bool)
        beaten[second[won[first]]] = True
        undecided &= ~won & ~beaten
        pairs = pairs[undecided[first] & undecided[second]]
    chosen = np.flatnonzero(kept)
    return position[chosen], normal[chosen], surface[chosen]


def _scan(scene: Scene, count: int, ratio: float = 4.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Seven registered range scans in parallel light, lines `ratio` times as far apart as the samples in them; a sample
    counts where it meets the surface at less than 75 degrees. Uneven on purpose: scans overlap, slopes are sparse. With
    rows of 1 : 10 two scans, which do not overlap much."""
    ways = np.array([[0.31, -0.76, 0.57], [-0.82, -0.39, 0.42], [0.77, 0.48, 0.43], [-0.36, 0.80, 0.48],
                     [0.05, 0.11, 0.99], [0.54, -0.37, -0.76], [-0.61, 0.33, -0.72]])
    ways = ways[: 2 if ratio == ROWS else None]
    reach = max(float(np.linalg.norm(surface.place[:3, 3])) + surface.radius for surface in scene.surfaces)

    def scans(step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        parts = []
        for way in ways / np.linalg.norm(ways, axis=1)[:, None]:
            u = np.cross(way, [0.0, 0.0, 1.0])
            u /= np.linalg.norm(u)
            along, across = np.arange(-reach, reach, step / np.sqrt(ratio)), np.arange(-reach, reach, step * np.sqrt(ratio))
            a, b = np.meshgrid(along, across)
            origin = 2.0 * reach * way + a.reshape(-1, 1) * u + b.reshape(-1, 1) * np.cross(way, u)
            for begin in range(0, len(origin), 1 << 17):
                part = origin[begin : begin + (1 << 17)]
                t, owner = scene.crossings(part, np.broadcast_to(-way, part.shape))
                hit = np.flatnonzero(np.isfinite(t[:, 0]))
                point, whose = part[hit] - t[hit, 0, None] * way, owner[hit, 0]
                normal = scene.normals(whose, point)
                steep = np.abs(normal @ way) > 0.26
                parts.append((point[steep], normal[steep], whose[steep].astype(np.int16)))
        return tuple(np.concatenate(arrays) for arrays in zip(*parts))

    coarse = 2.0 * reach / 160.0
    return scans(coarse * np.sqrt(len(scans(coarse)[0]) / count))
