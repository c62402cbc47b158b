# SPDX-License-Identifier: GPL-3.0-or-later
"""Stanford's .conf: range scans as PLY files with a place each, all in one cloud."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .. import jobs, native
from . import library
from .e57 import merge
from .reading import Filter, PointFile, Progress


def _scans(path: Path) -> list[tuple[str, np.ndarray]]:
    """Name, and tx ty tz qx qy qz qw of each `bmesh` line."""
    scans = []
    try:
        text = path.read_text("utf-8", "replace")
    except OSError as error:
        raise native.PatinaError(f"{path.name}: cannot be read: {error.strerror}", -3) from None
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split()
        if words[:1] != ["bmesh"]:
            continue
        try:
            values = np.array(words[2:9], np.float64)
            if len(values) != 7:
                raise ValueError
        except ValueError:
            raise native.PatinaError(f"{path.name}: line {number}: a name and seven numbers were expected", -4) from None
        scans.append((words[1], values))
    if not scans:
        raise native.PatinaError(f"{path.name}: no line begins with 'bmesh'", -4)
    return scans


def preview(path: Path) -> list[str]:
    scans = _scans(path)
    return [f"{len(scans)} scans", *(name for name, _ in scans[:8])]


def rotation(q: np.ndarray) -> np.ndarray:
    """Of the conjugate of the quaternion x y z w, as the reconstructions need it."""
    x, y, z, w = q / np.linalg.norm(q) * (-1, -1, -1, 1)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def read(path: Path, wanted: Filter, progress: Progress) -> PointFile:
    return jobs.finish(steps(path, wanted, progress))


def steps(path: Path, wanted: Filter, progress: Progress) -> jobs.Steps[PointFile]:
    """The same in steps."""
    scans, parts, done = _scans(path), [], 0
    for index, (name, place) in enumerate(scans):
        scan = yield from library.steps(path.parent / name, Filter(), progress.part(index, len(scans)))
        matrix = rotation(place[3:])
        positions = (scan.positions.astype(np.float64) + scan.origin) @ matrix.T + place[:3]
        keep = wanted.mask(done, positions)
        done += len(positions)
        part = {"positions": positions[keep], "scan": np.full(int(keep.sum()), index, np.float32)}
        part |= {key: values[keep] for key, values in scan.scalars.items()}
        if scan.normals is not None:
            part["normals"] = (scan.normals @ matrix.T)[keep]
        if scan.colors is not None and scan.colors.dtype == np.uint8:
            part["rgb"] = scan.colors[keep, :3]
        parts.append(part)
    return merge(path.stem, parts, {})
