# SPDX-License-Identifier: GPL-3.0-or-later
"""A short open tour through places. Does not import bpy."""

from __future__ import annotations

import numpy as np

STARTS = 32  # places that a first tour begins at, at most
ROUNDS = 50  # of improving a tour, at most: tours of 1,000 random places take about 10
MOST = 1000  # places that are ordered; the order of more, as of a mobile scanner, stays
SAME = 1e-6  # of the places' extent: nearer places are one


def order(places: np.ndarray) -> list[int]:
    """Indices of (n, 3) places in the order of a short tour that ends elsewhere than it begins. Places that repeat another are left out.

    Nearest neighbor from several starts; then 2-opt (Croes 1958) on the best, until nothing improves. The end with the smaller index
    comes first."""
    if not 2 <= len(places) <= MOST:
        return list(range(len(places)))
    extent = float(np.ptp(places, axis=0).max())
    kept = [i for i in range(len(places)) if not i or np.linalg.norm(places[:i] - places[i], axis=1).min() > SAME * extent]
    away = np.linalg.norm(places[kept][:, None] - places[kept][None], axis=2)
    starts = range(0, len(kept), -(-len(kept) // STARTS))
    best = _improved(min((_nearest(away, start) for start in starts), key=lambda tour: _length(away, tour)), away)
    found = [kept[i] for i in best]
    return found if found[0] <= found[-1] else found[::-1]


def _length(away: np.ndarray, tour: np.ndarray) -> float:
    return float(away[tour[:-1], tour[1:]].sum())


def _nearest(away: np.ndarray, start: int) -> np.ndarray:
    left = np.ones(len(away), bool)
    tour = [start]
    left[start] = False
    while len(tour) < len(away):
        tour.append(int(np.where(left, away[tour[-1]], np.inf).argmin()))
        left[tour[-1]] = False
    return np.array(tour)


def _improved(tour: np.ndarray, away: np.ndarray) -> np.ndarray:
    """Reverses parts of the tour while that shortens it. A part at an end has one side to connect."""
    count = len(tour)
    for _ in range(ROUNDS):
        changed = False
        for i in range(count - 1):  # the part begins at i and ends at j > i
            ends = tour[i + 1:]
            after = np.append(tour[i + 2:], -1)
            old = np.where(after >= 0, away[ends, after], 0.0) + (away[tour[i - 1], tour[i]] if i else 0.0)
            new = np.where(after >= 0, away[tour[i], after], 0.0) + (away[tour[i - 1], ends] if i else 0.0)
            gain = old - new
            j = int(gain.argmax())
            if gain[j] > 1e-9 * (old[j] + new[j]):
                tour = np.concatenate([tour[:i], tour[i:i + j + 2][::-1], tour[i + j + 2:]])
                changed = True
        if not changed:
            break
    return tour
