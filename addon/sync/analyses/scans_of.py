# SPDX-License-Identifier: GPL-3.0-or-later
"""Which scan each point of a cloud is of, as attributes say it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import analysis

SCAN_ENDING = ".scan"  # of the file of them beside a kept cloud
SCAN_NAMES = (analysis.SCAN, "point_source_id")  # of the attributes that say it
MOST_SCANS = 1024  # that the library grades


@dataclass(frozen=True)
class Scans:
    """Which scan each point is of, by an attribute of the file; written beside the cloud, a uint16 for each point: index into numbers."""

    name: str
    numbers: tuple[int, ...]


def scans_in(scalars: dict[str, np.ndarray]) -> tuple[Scans | None, np.ndarray | None]:
    """What a file says of its points' scans, where it has several."""
    name = next((name for name in SCAN_NAMES if name in scalars), "")
    values = scalars.get(name)
    numbers = None if values is None or not len(values) else whole(values)
    if numbers is None:
        return None, None
    used = np.flatnonzero(np.bincount(numbers, minlength=1))
    if not 1 < len(used) <= MOST_SCANS:
        return None, None
    return Scans(name, tuple(used.tolist())), places_of(used)[numbers]


def whole(values: np.ndarray) -> np.ndarray | None:
    """As uint16; None where some are no such numbers."""
    if not (values.min(initial=0) >= 0 and values.max(initial=0) <= 65535):
        return None
    numbers = values.astype(np.uint16)
    return None if (numbers != values).any() else numbers


def places_of(numbers: np.ndarray) -> np.ndarray:
    """(65536,) uint16: the index of each of these numbers."""
    places = np.zeros(65536, np.uint16)
    places[numbers] = np.arange(len(numbers))
    return places
