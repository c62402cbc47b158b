# SPDX-License-Identifier: GPL-3.0-or-later
"""The cloud that thumbnails of styles show where there is no scene: a fluted urn on a block of stone, on a floor.

Made by rule, the same points every time: round and flat, smooth and rough, with colours, normals and a broken rim.
"""

from __future__ import annotations

import numpy as np

HEIGHT = 1.5  # of all but the floor; it stands at z = 0 around the origin
_GOLDEN = np.pi * (3 - np.sqrt(5))
# Radius of the urn at heights above the block
_OUTLINE = np.array([(0.00, 0.27), (0.05, 0.27), (0.08, 0.20), (0.13, 0.11), (0.20, 0.13), (0.34, 0.33), (0.50, 0.42),
                     (0.64, 0.42), (0.76, 0.34), (0.86, 0.22), (0.94, 0.19), (1.00, 0.23), (1.06, 0.33), (1.10, 0.345)])
_BLOCK, _FLOOR = (0.34, 0.40), 1.5  # half width and height of the block, radius of the floor


_CLASSES = (5, 6, 2)  # as LAS has them: styles by class show the urn as a plant


def classes(count: int) -> np.ndarray:
    """Of points(count): uint8 (n,)."""
    return np.repeat(np.array(_CLASSES, np.uint8), [len(part[0]) for part in _parts(count, np.random.default_rng(7))])


def _parts(count: int, generator: np.random.Generator) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    return [_urn(count * 5 // 10, generator), _block(count * 2 // 10, generator), _floor(count * 3 // 10, generator)]


def points(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """About so many points: positions and normals float32 (n, 3), colours uint8 sRGB (n, 4)."""
    generator = np.random.default_rng(7)
    parts = _parts(count, generator)
    position, normal, color = (np.concatenate(arrays) for arrays in zip(*parts))
    color = np.clip(color * generator.normal(1.0, 0.035, (len(color), 1)), 0, 1)
    bytes_ = np.full((len(color), 4), 255, np.uint8)
    bytes_[:, :3] = np.round(color * 255)
    return position.astype(np.float32), normal.astype(np.float32), bytes_


def _profile(z: np.ndarray) -> np.ndarray:
    """Radius of the urn, rounded off between the corners of its outline."""
    shift = 0.012
    return sum(np.interp(z + shift * k, *_OUTLINE.T) for k in range(-3, 4)) / 7


def _radius(z: np.ndarray, angle: np.ndarray) -> np.ndarray:
    flutes = np.clip((z - 0.26) / 0.1, 0, 1) * np.clip((0.56 - z) / 0.06, 0, 1)
    bead = 0.012 * np.exp(-((z - 0.66) / 0.016) ** 2) * (1 + np.cos(angle * 36))
    return _profile(z) * (1 + 0.035 * flutes * (np.abs(np.cos(angle * 12)) - 0.5)) + bead


def _urn(count: int, generator: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    z, angle = generator.uniform(0, _OUTLINE[-1, 0], 3 * count), generator.uniform(0, 2 * np.pi, 3 * count)
    step = 1e-3
    r = _radius(z, angle)
    up = (_radius(z + step, angle) - _radius(z - step, angle)) / (2 * step)
    around = (_radius(z, angle + step) - _radius(z, angle - step)) / (2 * step)
    kept = generator.uniform(0, 0.9, len(z)) < r * np.sqrt(1 + up * up)  # as many on each part of the surface
    kept &= z < 0.93 + 0.3 * np.abs(np.sin(0.5 * (angle - 5.6))) + 0.015 * np.sin(11 * angle)  # a piece of the rim is missing
    z, angle, r, up, around = (values[kept][:count] for values in (z, angle, r, up, around))
    c, s = np.cos(angle), np.sin(angle)
    position = np.stack([r * c, r * s, z + _BLOCK[1]], 1)
    normal = np.stack([c + around / r * s, s - around / r * c, -up], 1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    clay, slip = np.array([0.72, 0.44, 0.30]), np.array([0.25, 0.20, 0.22])
    band = ((z > 0.70) & (z < 0.80) | (z > 0.13) & (z < 0.17) | (z > 1.04))[:, None]
    key = ((z > 0.715) & (z < 0.785) & (np.sin(angle * 14) + 0.6 * np.sin(z * 90) > 0.5))[:, None]
    return position, normal, np.where(band & ~key, slip, clay) * (0.97 + 0.03 * np.sin(23 * z + 4 * c)[:, None])


def _block(count: int, generator: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    half, height = _BLOCK
    side = generator.integers(0, 5, count)  # 0: the top
    u, v = generator.uniform(-half, half, count), generator.uniform(0, 1, count)
    turn = (side - 1) * np.pi / 2
    outward = np.where(side == 0, 0, 1)
    x, y = u, np.where(side == 0, (2 * v - 1) * half, -half)
    z = np.where(side == 0, height, v * height)
    c, s = np.cos(turn * outward), np.sin(turn * outward)
    position = np.stack([c * x - s * y, s * x + c * y, z], 1)
    normal = np.stack([s * outward, -c * outward, 1.0 - outward], 1)
    grain = 0.03 * np.sin(9 * position @ (1, 0.7, 2.1)) + 0.03 * np.sin(5 * position @ (0.3, 1, -0.8))
    return position, normal, np.array([0.74, 0.71, 0.64]) * (0.95 + grain)[:, None]


def _floor(count: int, generator: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    index = np.arange(count) + 0.5
    r, angle = _FLOOR * np.sqrt(index / count), index * _GOLDEN
    x, y = r * np.cos(angle), r * np.sin(angle)
    outside = np.maximum(np.abs(x), np.abs(y)) > _BLOCK[0]
    x, y = x[outside], y[outside]
    joints = np.minimum(np.abs((x + 0.17) % 0.5 - 0.25), np.abs((y + 0.1) % 0.5 - 0.25)) > 0.237
    tone = 0.93 + 0.1 * np.sin(np.floor((x + 0.42) / 0.5) * 2.3 + np.floor((y + 0.35) / 0.5) * 4.1)
    color = np.array([0.56, 0.55, 0.50]) * (tone * np.where(joints, 0.7, 1.0))[:, None]
    none = np.zeros(len(x))
    return np.stack([x, y, none + generator.normal(0, 0.001, len(x))], 1), np.stack([none, none, none + 1], 1), color
