# SPDX-License-Identifier: GPL-3.0-or-later
"""Distances between clouds, and the ground: arrays in, arrays out."""

from __future__ import annotations

from ctypes import byref
from dataclasses import dataclass

import numpy as np

from . import abi
from .arrays import view
from .handles import Progress, Task, handle_of
from .loader import check, library


@dataclass(frozen=True)
class Scales:
    """Lengths of the distance between clouds, in the unit of the positions; 0: by the spacing."""

    cylinder: float = 0.0  # diameter of the cylinder whose points are averaged
    normal_scale: float = 0.0  # diameter of the ball whose points give the normal
    depth: float = 0.0  # how far the cylinder reaches at most
    registration_error: float = 0.0  # of the clouds to each other, one standard deviation


@dataclass(frozen=True)
class Ground:
    """Lengths of the search for the ground, in the unit of the positions; 0: by extent and spacing."""

    cell: float = 0.0  # width of the finest cells
    largest: float = 0.0  # width of the largest object
    threshold: float = 0.0  # points nearer to the ground are ground


def _distance_of(positions: np.ndarray, other: np.ndarray, normals: np.ndarray | None, scales: Scales) -> abi.DistanceDesc:
    return abi.DistanceDesc(count=len(positions), other_count=len(other), position=view(positions, len(positions)),
                            normal=view(normals, len(positions)), other=view(other, len(other)), **vars(scales))


def distance_scales(positions: np.ndarray, other: np.ndarray, scales: Scales) -> Scales:
    """The scales with those that are 0 chosen by the spacing of the coarser cloud. PatinaError if no spacing can be told."""
    described = _distance_of(positions, other, None, scales)
    check(library().patina_distance_defaults(byref(described)))
    return Scales(**{name: getattr(described, name) for name in vars(scales)})


def start_distance(positions: np.ndarray, other: np.ndarray, normals: np.ndarray | None, scales: Scales,
                   progress: Progress | None = None) -> Task:
    """A task that gives the distance of each point to the other cloud, and its 95 % interval: (n,) float32 each, NaN where it is not
    known. positions, other: (n, 3) floats; normals: (n, 3) floats or None."""
    distance, interval = (np.empty(len(positions), np.float32) for _ in range(2))
    return Task("cloud_distance", byref(_distance_of(positions, other, normals, scales)), handle_of(progress), distance.ctypes.data,
                interval.ctypes.data, keep=(positions, other, normals, distance, interval, progress),
                finish=lambda task: (distance, interval))


def ground_lengths(positions: np.ndarray, given: Ground) -> Ground:
    """The lengths with those that are 0 chosen by extent and spacing. PatinaError if these cannot be told."""
    described = abi.GroundDesc(count=len(positions), position=view(positions, len(positions)), **vars(given))
    check(library().patina_ground_defaults(byref(described)))
    return Ground(**{name: getattr(described, name) for name in vars(given)})


def start_ground(positions: np.ndarray, given: Ground, progress: Progress | None = None) -> Task:
    """A task that gives the height of each point above the ground, (n,) float32, NaN where it is not known, and whether it is ground,
    (n,) bool. positions: (n, 3) floats, z is up."""
    height, ground = np.empty(len(positions), np.float32), np.empty(len(positions), np.uint8)
    described = abi.GroundDesc(count=len(positions), position=view(positions, len(positions)), **vars(given))
    return Task("ground", byref(described), handle_of(progress), height.ctypes.data, ground.ctypes.data,
                keep=(positions, height, ground, progress), finish=lambda task: (height, ground.astype(bool)))
