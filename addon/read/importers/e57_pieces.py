# SPDX-License-Identifier: GPL-3.0-or-later
"""E57 piece by piece, for clouds that are built on the disk. Scans with a grid are not: what normals it gives, and what its stations saw
through, is asked of all its rows at once; nor are files of which something is wrong, which e57.steps tells."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ... import jobs, native
from ..unpacking import e57_xml
from . import e57_scans, scans
from .crs import units
from .reading import Pieces, PointFile, Progress, crs_notes, origin_of, scanners_of

_GRID = {"rowIndex", "columnIndex"}


def steps(path: Path, least: int, names: Collection[str], progress: Progress) -> jobs.Steps[Pieces | None]:
    """None: the file is read whole. Places are read twice: the origin follows from the box of all of them, whatever the file says of it."""
    file = e57_scans.open_file(path)
    try:
        headers = file.scans
        total = sum(header.points for header in headers)
        if total <= least or not all(map(_comes_in_pieces, headers)):
            return None
        poses = [e57_scans.pose_of(header)[0] or e57_scans.Pose() for header in headers]
        lower, upper = np.full(3, np.inf), np.full(3, -np.inf)
        for index, pose in enumerate(poses):
            for found in e57_scans.pieces_of(file, index, pose, places=True):
                progress.step(0.0)
                if found is None:
                    yield jobs.Pause()
                    continue
                piece = found[1]
                positions = piece["positions"][np.isfinite(piece["positions"]).all(axis=1)]
                lower, upper = np.minimum(lower, positions.min(axis=0, initial=np.inf)), np.maximum(upper, positions.max(axis=0, initial=-np.inf))
                yield jobs.Pause()
        if not np.isfinite(lower).all():
            return None
        crs = file.head.crs
    except native.PatinaError as error:
        if error.code == native.CANCELLED:
            raise
        return None  # what is wrong is told by whoever reads it whole
    finally:
        file.close()
    notes: dict[str, Any] = {"crs": crs, **crs_notes(units(crs))} if crs else {}
    origin = origin_of(lower, upper, 1e-4)
    wanted = frozenset(names)
    return Pieces(total, origin, (tuple(lower.tolist()), tuple(upper.tolist())), notes,
                  lambda reading: _each(path, poses, origin, wanted, notes, reading), zeros=True)


def _comes_in_pieces(header: e57_xml.Scan) -> bool:
    if header.points < 2:
        return False
    pose, wrong = e57_scans.pose_of(header)
    return pose is not None and not wrong and e57_scans.has_places(header) and not e57_scans.names_of(header) & _GRID and e57_scans.knows_levels(header)


def _each(path: Path, poses: list[e57_scans.Pose], origin: tuple[float, float, float], names: frozenset[str], notes: dict[str, Any],
          progress: Progress) -> Iterator[PointFile | None]:
    """All with the columns that any scan has; notes: what is known of the scans is written there at the end."""
    file = e57_scans.open_file(path)
    try:
        headers = file.scans
        total, done = sum(header.points for header in headers), 0
        fields = [set(e57_scans.fields_of(header)) for header in headers]
        colored, has_normals = (any(set(needed) <= own for own in fields) for needed in (e57_scans.COLORS, e57_scans.NORMALS))
        columns = names & {e57_scans.NAMES.get(name, name) for own in fields for name in own} | {"scan"}
        stations = [e57_scans.station_of(header, pose) for header, pose in zip(headers, poses, strict=True)]
        described = []
        for index, (header, pose) in enumerate(zip(headers, poses, strict=True)):
            way, count, held = np.zeros(3), 0, 0
            for found in e57_scans.pieces_of(file, index, pose):
                progress.step(done / total)
                if found is None:
                    yield None
                    continue
                read, piece = found
                done += read
                e57_scans.level_colors(header, [piece])
                size = len(piece["positions"])
                points = PointFile(path.stem, (piece["positions"] - origin).astype(np.float32), None, None, {}, origin, 0)
                if has_normals:
                    points.normals = piece.get("normals", np.zeros((size, 3), np.float32))
                if colored:
                    points.colors = piece["rgb"].astype(np.uint16) if "rgb" in piece else np.zeros((size, 3), np.uint16)
                piece["scan"] = np.full(size, index, np.float32)
                points.scalars = {name: piece.get(name, np.zeros(size, np.float32)) for name in columns}
                sums = scans.ways(points.positions.astype(np.float64), stations[index] - origin)
                way, count = way + sums[0], count + sums[1]
                held += size
                yield points
            described.append(scans.Scan(header.name, held, scans.mean_way(way, count), 0.0, pose.matrix(), (0, 0)))
        notes.update(scanners_of(stations if np.isfinite(stations).any() else [], origin) | scans.note(described))
    finally:
        file.close()
