# SPDX-License-Identifier: GPL-3.0-or-later
"""The two filters that users of CloudCompare run on scans before they render them, by its defaults. A filter takes positions (n, 3) and
returns which points stay (n,) bool.

sor: "statistical outlier removal". A point's mean distance to its 6 nearest others is at most the cloud's mean of these plus one standard
deviation. noise: a point lies within one standard deviation of the plane through its 6 nearest others; it has three at least."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

NEIGHBORS = 6
SIGMAS = 1.0
CHUNK = 1 << 18


def _nearest(position: np.ndarray, tree: cKDTree, begin: int) -> tuple[np.ndarray, np.ndarray]:
    """Distances and numbers of the nearest others of CHUNK points. Of points that coincide any one counts as the point itself."""
    some = position[begin : begin + CHUNK]
    distance, number = tree.query(some, k=min(NEIGHBORS + 1, len(position)), workers=1)
    other = number != np.arange(begin, begin + len(some))[:, None]
    other[other.all(axis=1), -1] = False
    shape = len(some), -1
    return distance[other].reshape(shape), number[other].reshape(shape)


def sor(position: np.ndarray) -> np.ndarray:
    if len(position) <= 1:
        return np.ones(len(position), bool)
    tree = cKDTree(position)
    mean = np.concatenate([_nearest(position, tree, begin)[0].mean(axis=1) for begin in range(0, len(position), CHUNK)])
    return mean <= mean.mean() + SIGMAS * mean.std()


def noise(position: np.ndarray) -> np.ndarray:
    keep = np.zeros(len(position), bool)
    if len(position) <= 3:
        return keep
    tree = cKDTree(position)
    for begin in range(0, len(position), CHUNK):
        _, number = _nearest(position, tree, begin)
        away = position[number] - position[begin : begin + CHUNK, None]
        middle = away.mean(axis=1)
        away -= middle[:, None]
        value, vector = np.linalg.eigh(np.einsum("nka,nkb->nab", away, away) / away.shape[1])
        off = np.abs(np.einsum("na,na->n", middle, vector[:, :, 0]))
        keep[begin : begin + CHUNK] = off <= SIGMAS * np.sqrt(np.maximum(value[:, 0], 0.0))
    return keep


FILTERS: dict[str, Callable[[np.ndarray], np.ndarray]] = {"sor": sor, "noise": noise}
