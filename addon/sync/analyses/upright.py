# SPDX-License-Identifier: GPL-3.0-or-later
"""Estimates the vertical of a scan from its largest planes: floors and ceilings are perpendicular to it, walls are parallel."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ... import native
from ...jobs import Steps
from ...read.importers import Progress

POINTS = 30_000  # that are analyzed, a random choice of all
CANDIDATES = 300  # normals that are tried as the direction of a plane
NEAR = math.radians(6.0)  # between a normal and the plane that it counts to
LEAST_LEVEL = 0.05  # of the area: horizontal planes, without which nothing is known of the vertical
LEAST_WALLS = 0.1  # of the area: vertical planes, without which a slope would count as a tilted floor
LEAST_EXPLAINED = 0.6  # of the area: horizontal and vertical planes together
COMPARABLE = 0.9  # of what the best direction explains: directions that explain so much are compared by their largest plane
CLEARLY = 2.0  # times as large a plane, for a direction farther than TILT from the present one to be preferred
TILT = math.radians(45.0)
THICK = 100.0  # layers of the cloud's extent, two of which are as thick as a plane
UPRIGHT = math.radians(1.0)  # a smaller tilt is not offered


@dataclass(frozen=True)
class Vertical:
    direction: np.ndarray  # (3,) float64, of length 1, in the space of the points
    tilt: float  # radians between it and the present vertical

    @property
    def is_tilted(self) -> bool:
        return self.tilt > UPRIGHT


def estimate(positions: np.ndarray, up: np.ndarray, progress: Progress) -> Steps[Vertical | None]:
    """positions: (n, 3); up: (3,) the present vertical in their space, of length 1. None if the planes do not tell. PatinaError if the
    points cannot be analyzed."""
    finite = positions[np.isfinite(positions).all(axis=1)]
    few = np.random.default_rng(1).permutation(len(finite))[:POINTS]
    if len(few) < 100:
        return None
    places = np.ascontiguousarray(finite[np.sort(few)], np.float32)
    with progress.inner() as inner:
        task = native.Cloud.start(places, None, None, None, inner)
    yield task
    cloud = task.result()
    with progress.inner() as inner:
        task = cloud.start_analysis(inner)
    yield task
    task.result()
    found = cloud.neighbourhoods("normal", "spacing")
    return of_planes(places, found["normal"].astype(np.float64), found["spacing"].reshape(-1).astype(np.float64) ** 2, up)


def of_planes(places: np.ndarray, normals: np.ndarray, areas: np.ndarray, up: np.ndarray) -> Vertical | None:
    """(n, 3), (n, 3), (n,): points, their unit normals and areas."""
    known = np.isfinite(normals).all(axis=1) & (np.abs(normals).max(axis=1) > 0.0) & np.isfinite(areas)
    places, normals, areas = places[known], normals[known], areas[known]
    areas = np.minimum(areas, np.quantile(areas, 0.95)) if len(areas) else areas  # strays stand for no large planes
    if len(areas) < 100 or areas.sum() <= 0.0:
        return None
    shares = areas / areas.sum()
    axes = _axes(normals, shares)
    level = [_level(normals, shares, axis) for axis in axes]
    walls = [_upright(normals, shares, axis) for axis in axes]
    explained = [sum(parts) for parts in zip(level, walls, strict=True)]
    good = [i for i in range(len(axes)) if level[i] >= LEAST_LEVEL and walls[i] >= LEAST_WALLS and explained[i] >= max(LEAST_EXPLAINED, COMPARABLE * max(explained))]
    if not good:
        return None
    largest = [_largest(places, normals, shares, axis) for axis in axes]
    best, present = max(good, key=lambda i: largest[i]), [i for i in range(len(axes)) if abs(axes[i] @ up) > math.cos(TILT)]
    if best not in present and any(largest[best] < CLEARLY * largest[i] for i in present):
        present = [i for i in present if i in good]
        if not present:
            return None  # a slope without walls, for example
        best = present[0]
    axis = axes[best] * (1.0 if axes[best] @ up >= 0.0 else -1.0)
    tilt = math.acos(min(float(axis @ up), 1.0))
    if tilt > TILT:  # either end may be up: most of the floor is below the middle
        heights = (places - places.mean(axis=0)) @ axis
        floor = np.abs(normals @ axis) > math.cos(NEAR)
        if np.sum(shares[floor] * np.sign(heights[floor])) > 0.0:
            axis = -axis
        tilt = math.acos(max(min(float(axis @ up), 1.0), -1.0))
    return Vertical(axis, tilt)


def _level(normals: np.ndarray, shares: np.ndarray, axis: np.ndarray) -> float:
    return float(shares[np.abs(normals @ axis) > math.cos(NEAR)].sum())


def _largest(places: np.ndarray, normals: np.ndarray, shares: np.ndarray, axis: np.ndarray) -> float:
    """The area of the largest single plane perpendicular to the axis: both walls of a room are as large as its floor, one is not."""
    near = np.abs(normals @ axis) > math.cos(NEAR)
    heights = places[near] @ axis
    extent = float(np.ptp(places, axis=0).max())
    if not near.any() or extent <= 0.0:
        return 0.0
    bins = ((heights - heights.min()) * (THICK / extent)).astype(np.int64)
    areas = np.bincount(bins, shares[near])
    return float((areas + np.append(areas[1:], 0.0)).max())  # a plane may lie across two


def _upright(normals: np.ndarray, shares: np.ndarray, axis: np.ndarray) -> float:
    return float(shares[np.abs(normals @ axis) < math.sin(NEAR)].sum())


def _axes(normals: np.ndarray, shares: np.ndarray) -> list[np.ndarray]:
    """Up to three directions of the largest planes, more than 45 degrees apart, the largest first."""
    tried = normals[np.random.default_rng(2).choice(len(normals), CANDIDATES, p=shares)]
    near = np.abs(normals @ tried.T) > math.cos(NEAR)
    area, found = shares @ near, []
    for index in np.argsort(-area, kind='stable'):
        axis = tried[index]
        if len(found) < 3 and all(abs(axis @ other) < math.cos(TILT) for other in found):
            found.append(_refined(normals, shares, axis))
    return found


def _refined(normals: np.ndarray, shares: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """The mean direction of the normals near it, twice, the second time of half as wide a cone."""
    for width in (NEAR, 0.5 * NEAR):
        near = np.abs(normals @ axis) > math.cos(width)
        spread = (normals[near] * shares[near, None]).T @ normals[near]
        axis = np.linalg.eigh(spread)[1][:, -1]
    return axis
