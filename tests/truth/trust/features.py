# SPDX-License-Identifier: GPL-3.0-or-later
"""What the nearest neighbors of a point say of its trust: the features, written plainly. The library computes the same ones.

For a point p with its K nearest others (ties by number), d_k is the distance of the k-th. c, n and λ0 ≤ λ1 ≤ λ2 are the mean, the
normal and the variances of the k nearest without p. Trees only compare, so ratios stand in for logarithms."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

K = 24
SIZES = (6, 12, 24)
NAMES = tuple(f"{name}_{k}" for k in SIZES for name in ("own_mean", "own_min", "flat", "line", "off_d", "off_rms", "mean_d")) + (
    "d1_d6", "d6_d24", "mutual_6", "mutual_12", "mutual_24", "bend_6", "bend_12", "theirs_d", "theirs_rms", "theirs_min", "second")
CHUNK = 1 << 17
SMALL = 1e-9  # of the cloud's extent: floor of distances; its square: floor of variances
MOST_RMS = 20.0  # of a neighbor's plane


def neighbors(position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n, K) distances and numbers of the nearest others; clouds of fewer points repeat the last."""
    n = len(position)
    k = min(K + 1, n)
    d, i = cKDTree(position).query(position, k=k, workers=-1)
    d, i = d.reshape(n, k), i.reshape(n, k)
    other = i != np.arange(n)[:, None]
    other[other.all(axis=1), -1] = False  # points that coincide hide the point itself
    if k == 1:
        return np.zeros((n, K)), np.zeros((n, K), np.int64)
    d, i = d[other].reshape(n, k - 1), i[other].reshape(n, k - 1)
    pad = [(0, 0), (0, K - (k - 1))]
    return np.pad(d, pad, "edge"), np.pad(i, pad, "edge")


def planes(position: np.ndarray, index: np.ndarray, of: np.ndarray, k: int, floor: float
           ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of points `of`: c - p (m, 3), n (m, 3), λ (m, 3)."""
    mean, normal, spread = np.empty((len(of), 3)), np.empty((len(of), 3)), np.empty((len(of), 3))
    for begin in range(0, len(of), CHUNK):
        some = of[begin : begin + CHUNK]
        away = position[index[some, :k]] - position[some][:, None]
        c = away.mean(axis=1)
        away -= c[:, None]
        value, vector = np.linalg.eigh(np.einsum("nka,nkb->nab", away, away) / k)
        here = slice(begin, begin + len(some))
        mean[here], normal[here], spread[here] = c, vector[:, :, 0], np.maximum(value, floor)
    return mean, normal, spread


def features(position: np.ndarray, of: np.ndarray | None = None) -> np.ndarray:
    """position (n, 3) float64 → (m, F) float32 of all points, or of those with numbers `of`."""
    position = np.asarray(position, np.float64)
    of = np.arange(len(position)) if of is None else np.asarray(of)
    extent = float(np.ptp(position, axis=0).max()) or 1.0
    least = SMALL * extent
    d, index = neighbors(position)
    d = np.maximum(d, least)
    whom = np.unique(np.concatenate([of, index[of, :12].ravel()]))  # whose planes are needed
    place = np.full(len(position), -1, np.int64)
    place[whom] = np.arange(len(whom))
    c12, n12, l12 = planes(position, index, whom, 12, least**2)
    out: list[np.ndarray] = []
    own, near = d[of], index[of]
    for k in SIZES:
        theirs = d[near[:, :k], k - 1]
        c, n, v = (x[place[of]] for x in (c12, n12, l12)) if k == 12 else planes(position, index, of, k, least**2)
        off = np.abs(np.einsum("na,na->n", c, n))
        dk = own[:, k - 1]
        out += [dk / theirs.mean(axis=1), dk / theirs.min(axis=1), v[:, 0] / v[:, 1], v[:, 1] / v[:, 2], off / dk,
                off / np.sqrt(v[:, 0]), np.linalg.norm(c, axis=1) / dk]
    out += [own[:, 0] / own[:, 5], own[:, 5] / own[:, 23]]
    out += [(own[:, :k] <= d[near[:, :k], k - 1]).sum(axis=1) for k in SIZES]
    mine = n12[place[of]]
    out += [np.abs(np.einsum("na,nka->nk", mine, n12[place[near[:, :k]]])).mean(axis=1) for k in (6, 12)]
    who = near[:, :12]
    at = place[who]
    away = np.abs(np.einsum("nka,nka->nk", position[of][:, None] - position[who] - c12[at], n12[at]))
    rms = np.minimum(away / np.sqrt(l12[at][..., 0]), MOST_RMS)
    out += [(away / d[who, 11]).mean(axis=1), rms.mean(axis=1), rms.min(axis=1)]
    out.append(own[:, 11] / d[index[who, :6], 11].mean(axis=(1, 2)))
    return np.stack(out, axis=1).astype(np.float32)
