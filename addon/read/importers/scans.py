# SPDX-License-Identifier: GPL-3.0-or-later
"""What files say of the scans that their points are of, beside the point attribute "scan". Nothing here knows Blender."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

NOTE = "scans"  # of a PointFile; "patina_scans" of the data
PROPERTY = "patina_scans"

ALL_AROUND = 0.75  # the mean of the unit vectors of a cone of 60 degrees, as the library has it
Direction = tuple[float, float, float]
UNKNOWN: Direction = (0.0, 0.0, 0.0)
HERE = (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)  # the pose of a scan in the file's own coordinates


@dataclass(frozen=True)
class Scan:
    """One scan of a file; its number is its place in the list, and what the attribute "scan" says."""

    name: str
    count: int
    direction: Direction = UNKNOWN  # in which the scanner looked, unit; UNKNOWN, or all around
    interval: float = 0.0  # between neighbouring samples, in the file's unit; 0: not known
    pose: tuple[float, ...] = HERE  # the file's coordinates from the scan's own: three rows of four
    grid: tuple[int, int] = (0, 0)  # columns and rows; 0: there is none


def packed(scans: Sequence[Scan]) -> str:
    return json.dumps([vars(scan) for scan in scans])


def unpacked(text: object) -> list[Scan]:
    """None where it is not what was packed."""
    try:
        found = [Scan(str(item["name"]), int(item["count"]), tuple(map(float, item["direction"])), float(item["interval"]),
                      tuple(map(float, item.get("pose", HERE))), tuple(map(int, item.get("grid", (0, 0))))) for item in json.loads(text)]
    except (TypeError, ValueError, KeyError, AttributeError, OverflowError, RecursionError):
        return []
    return found if all(scan.count >= 0 and len(scan.direction) == 3 and len(scan.pose) == 12 and len(scan.grid) == 2 for scan in found) else []


def note(scans: Sequence[Scan]) -> dict[str, str]:
    return {NOTE: packed(scans)} if scans else {}


def direction(positions: np.ndarray, station: np.ndarray) -> Direction:
    """Of the rays from a station to (n, 3) places; UNKNOWN where these lie more than 60 degrees about, or it is not known."""
    return mean_way(*ways(positions, station))


def ways(positions: np.ndarray, station: np.ndarray) -> tuple[np.ndarray, int]:
    """The sum of unit vectors from a station to those of the places that are somewhere else, and how many these are."""
    found = positions - station
    lengths = np.linalg.norm(found, axis=1)
    good = np.isfinite(lengths) & (lengths > 0.0)
    return (found[good] / lengths[good, None]).sum(axis=0), int(good.sum())


def mean_way(total: np.ndarray, count: int) -> Direction:
    length = float(np.linalg.norm(total)) / max(count, 1)
    return tuple(map(float, total / count / length)) if count and length >= ALL_AROUND else UNKNOWN


def interval(positions: np.ndarray, row: np.ndarray, column: np.ndarray) -> float:
    """The median way between neighbours in a grid: (n, 3) places in cells (n,); 0 where none lie beside each other."""
    ways = []
    for along, across in ((row, column), (column, row)):
        order = np.lexsort((along, across))
        beside = (np.diff(along[order]) == 1) & (np.diff(across[order]) == 0)
        steps = np.linalg.norm(np.diff(positions[order], axis=0)[beside], axis=1)
        ways.append(steps[np.isfinite(steps)])
    found = np.concatenate(ways)
    return float(np.median(found)) if len(found) else 0.0


def twice(row: np.ndarray, column: np.ndarray) -> int:
    """How many points lie in a cell in which another one lies."""
    return len(row) - len(np.unique(row.astype(np.float64) * 2.0 ** 26 + column))
