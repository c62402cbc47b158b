# SPDX-License-Identifier: GPL-3.0-or-later
"""A scan that is made up: trees before a house's wall, on a lawn, as one scanner's look would not have it. Points of all sides, with
colors and LAS classes: 2 ground, 5 trees, 6 the house. Meters, z up; the wall stands at y = 3 and faces -y."""

from __future__ import annotations

import numpy as np

TREES = ((-2.6, 0.4, 4.4, 1.7), (0.6, -0.6, 5.2, 2.0), (3.4, 0.9, 3.9, 1.5))  # x, y, height, width of the crown
WIDE, DEEP, HIGH = 14.0, 9.0, 6.0
SHARES = (0.25, 0.3, 0.45)  # of the points: lawn, house, trees


def grove(count: int, seed: int = 5) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Positions and normals (n, 3) float32, colors (n, 3) uint8 sRGB, classes (n,) uint8, in no order. Leaves point anywhere."""
    random = np.random.default_rng(seed)
    lawn, house = int(SHARES[0] * count), int(SHARES[1] * count)
    parts = [_lawn(lawn, random), _house(house, random), _trees(count - lawn - house, random)]
    order = random.permutation(count)
    position = np.concatenate([part[0] for part in parts])[order].astype(np.float32)
    color = np.concatenate([part[1] for part in parts])[order] * random.normal(1.0, 0.06, (count, 1))
    classes = np.repeat(np.uint8([2, 6, 5]), [len(part[0]) for part in parts])[order]
    normal = np.concatenate([np.tile((0.0, 0.0, 1.0), (lawn, 1)), np.tile((0.0, -1.0, 0.0), (house, 1)),
                             random.normal(size=(count - lawn - house, 3))])[order]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return position, normal.astype(np.float32), np.clip(color * 255.0, 0, 255).astype(np.uint8), classes


def _lawn(count: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    x, y = random.uniform(-WIDE / 2, WIDE / 2, count), random.uniform(-DEEP / 2 - 1.0, 3.0, count)
    z = 0.05 * np.sin(2.1 * x) * np.sin(1.7 * y) + random.normal(0.0, 0.008, count)
    path = np.abs(x - 1.4 - 0.4 * np.sin(y)) < 0.6
    return np.stack([x, y, z], 1), np.where(path[:, None], (0.62, 0.57, 0.50), (0.36, 0.47, 0.20))


def _house(count: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A wall of bricks with windows, a door, and a plinth that stands before it."""
    x, z = random.uniform(-WIDE / 2 + 1.0, WIDE / 2 - 1.0, count), random.uniform(0.0, HIGH, count)
    window = (np.abs((x + 0.2) % 2.4 - 1.2) < 0.45) & ((np.abs(z - 1.9) < 0.75) | (np.abs(z - 4.4) < 0.65))
    door = (np.abs(x - 1.4) < 0.6) & (z < 2.4)
    plinth = z < 0.5
    joint = (z % 0.25 < 0.03) | ((x + 0.25 * np.floor(z / 0.25)) % 0.5 < 0.03)
    y = 3.0 + np.where(window, 0.2, 0.0) - np.where(plinth, 0.1, 0.0) + random.normal(0.0, 0.004, count)
    brick = np.where(joint[:, None], (0.75, 0.72, 0.68), (0.70, 0.36, 0.26))
    color = np.where(plinth[:, None], (0.55, 0.54, 0.52), brick)
    color = np.where(window[:, None], (0.20, 0.27, 0.36), color)
    return np.stack([x, y, z], 1), np.where(door[:, None], (0.20, 0.30, 0.22), color)


def _trees(count: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Crowns of leaves in clusters, on trunks."""
    tree = np.array(TREES)[random.choice(len(TREES), count, p=np.array([t[3] ** 2 for t in TREES]) / sum(t[3] ** 2 for t in TREES))]
    wood = random.random(count) < 0.06
    angle, up = random.uniform(0.0, 2 * np.pi, count), random.random(count)
    trunk = np.stack([0.12 * np.cos(angle), 0.12 * np.sin(angle), up * 0.55 * tree[:, 2]], 1)
    heart = random.normal(size=(len(TREES), 90, 3))  # of the clusters, in a ball
    heart *= np.cbrt(random.random((len(TREES), 90, 1))) / np.linalg.norm(heart, axis=2, keepdims=True)
    which = np.searchsorted([t[0] for t in TREES], tree[:, 0])
    leaf = heart[which, random.integers(0, 90, count)] + 0.13 * random.normal(size=(count, 3))
    crown = leaf * np.stack([tree[:, 3] / 2, tree[:, 3] / 2, 0.32 * tree[:, 2]], 1) + np.stack(
        [0 * up, 0 * up, 0.66 * tree[:, 2]], 1)
    position = np.where(wood[:, None], trunk, crown) + np.stack([tree[:, 0], tree[:, 1], 0 * up], 1)
    green = np.array([0.24, 0.40, 0.13]) * (0.7 + 0.5 * np.clip(leaf[:, 2:] * 0.5 + 0.5, 0.0, 1.0))
    return position, np.where(wood[:, None], (0.33, 0.25, 0.18), green)
