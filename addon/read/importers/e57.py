# SPDX-License-Identifier: GPL-3.0-or-later
"""E57 (ASTM E2807) through pye57: all scans in one cloud, each point with its scan's number. What is wrong with one scan is told by its
number; the others are there."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import numpy as np

from ... import jobs, native
from .. import readers
from ..unpacking import e57_xml
from . import e57_pieces, scans
from .crs import units
from .e57_scans import Pose, has_places, head_of, level_colors, names_of, open_file, pieces_of, pose_of, station_of
from .reading import Filter, Pieces, PointFile, Progress, colors_of, crs_notes, grid_normals, origin_of, scanners_of

PREVIEWED = 1 << 20  # bytes of XML that a preview reads
LISTED = 5  # scans that a warning names
CELLS = 1 << 24  # a grid's rows or columns: more are no whole numbers in float32

def _first_line(error: Exception) -> str:
    return next(iter(str(error).strip().splitlines()), type(error).__name__)


def preview(path: Path) -> list[str]:
    head = head_of(path, PREVIEWED)
    more = "" if head.whole else "more than "
    return [f"E57, {more}{len(head.scans)} scans", f"{more}{sum(scan.points for scan in head.scans):,} points",
            *(["cannot be read yet: choose Install Readers in the add-on's preferences"] * readers.lacks("pye57", "pyquaternion")),
            *sorted({field.name for scan in head.scans for field in scan.fields})]


def read(path: Path, wanted: Filter, progress: Progress) -> PointFile:
    return jobs.finish(steps(path, wanted, progress))


def steps(path: Path, wanted: Filter, progress: Progress) -> jobs.Steps[PointFile]:
    """The same with a pause after each piece."""
    file = open_file(path)
    parts: list[dict[str, np.ndarray]] = []
    stations: list[np.ndarray] = []
    poses: list[Pose] = []
    faults: list[tuple[str, int, str]] = []
    failed: native.PatinaError | None = None
    done, read, index = 0, 0, 0
    try:
        total = max(sum(scan.points for scan in file.scans), 1)
        for index, scan in enumerate(file.scans):
            what = f"{path.name}: scan {index}"
            pose, wrong = pose_of(scan)
            stations.append(station_of(scan, pose))
            poses.append(pose or Pose())
            if wrong:
                faults.append(("are left out, because their quaternions or places are no poses" if pose is None else
                               "have quaternions of other lengths than 1, which are taken as of length 1", index, wrong))
            if pose is None:
                continue
            if scan.points < 2:
                faults.append(("have one point each", index, " has one point") if scan.points else ("have no points", index, " has no points"))
            first, before = len(parts), read
            if scan.points and not has_places(scan):
                failed = native.PatinaError(f"{what}: its points have no positions: {', '.join(field.name for field in scan.fields)}", -4)
                faults.append(("have points without positions", index, str(failed).removeprefix(what)))
                continue
            for found in pieces_of(file, index, pose):
                progress.step(read / total)
                if found is not None:
                    count, data = found
                    read += count
                    keep = wanted.mask(done, data["positions"])
                    done += len(keep)
                    part = {name: values[keep] for name, values in data.items()}
                    parts.append(part | {"scan": np.full(int(keep.sum()), index, np.float32)})
                yield jobs.Pause()
            if read - before < scan.points:
                faults.append(("hold fewer points than they announce", index, f" announces {scan.points:,} points and holds {read - before:,}"))
            level_colors(scan, parts[first:])
    except native.PatinaError as error:
        if error.code == native.CANCELLED:
            raise
        raise native.PatinaError(str(error).replace(f"{path.name}: ", f"{path.name}: scan {index}: ", 1), error.code) from None
    except MemoryError:
        raise native.PatinaError(f"{path.name}: scan {index}: not enough memory for its points", -2) from None
    finally:
        file.close()
    if failed and not parts:
        raise failed
    crs = file.head.crs
    points = merge(path.stem, parts, {"crs": crs, **crs_notes(units(crs))} if crs else {})
    points.notes |= scanners_of(stations if np.isfinite(stations).any() else [], points.origin)
    points.notes |= scans.note(_described(file.scans, points, stations, poses, faults))
    points.warnings += joined(path.name, faults)
    if wanted.every == 1:  # a thinned grid is none
        yield from grid_normals(points, stations, progress)
    return points


def joined(name: str, faults: list[tuple[str, int, str]]) -> list[str]:
    """A warning for each kind of fault, however many scans have it. faults: what several scans have in common, the scan's number, and
    what is wrong with this one."""
    found: dict[str, list[tuple[int, str]]] = {}
    for kind, index, text in faults:
        found.setdefault(kind, []).append((index, text))
    told = []
    for kind, those in found.items():
        if len(those) == 1:
            told.append(f"{name}: scan {those[0][0]}{those[0][1]}")
        else:
            numbers = ", ".join(str(index) for index, _ in those[:LISTED]) + ", ..." * (len(those) > LISTED)
            told.append(f"{name}: {len(those):,} scans {kind}: scans {numbers}")
    return told


def _described(headers: list[e57_xml.Scan], points: PointFile, stations: list[np.ndarray], poses: list[Pose],
               faults: list[tuple[str, int, str]]) -> list[scans.Scan]:
    """What is known of each scan; adds what is wrong with their grids to the faults."""
    found = []
    of = points.scalars.get("scan", np.empty(0, np.float32))
    for index, header in enumerate(headers):
        own = slice(*np.searchsorted(of, (index, index + 1)))
        places = points.positions[own].astype(np.float64)
        direction = scans.direction(places, stations[index] - points.origin)
        interval, grid = 0.0, (0, 0)
        if {"rowIndex", "columnIndex"} <= names_of(header) and len(places):
            row, column = (points.scalars[axis][own] for axis in ("row", "column"))
            good = (row >= 0) & (column >= 0) & (row < CELLS) & (column < CELLS)
            if not good.all():
                faults.append(("have points in no cell of their grids", index, f": {int((~good).sum()):,} points lie in no cell of its grid"))
            if taken := scans.twice(row[good], column[good]):
                faults.append(("have several points in one cell of their grids", index, f": {taken:,} points lie in cells of its grid that others have"))
            interval = scans.interval(places[good], row[good], column[good])
            grid = (int(column[good].max(initial=-1)) + 1, int(row[good].max(initial=-1)) + 1)
        found.append(scans.Scan(header.name, len(places), direction, interval, poses[index].matrix(), grid))
    return found


def in_pieces(path: Path, least: int, names: Collection[str], progress: Progress) -> jobs.Steps[Pieces | None]:
    return (yield from e57_pieces.steps(path, least, names, progress))


def merge(name: str, parts: list[dict[str, np.ndarray]], notes: dict[str, str | float]) -> PointFile:
    """One cloud from scans: float64 "positions", "rgb" (integers), other columns as scalars; what a scan lacks is 0."""
    positions = np.concatenate([part["positions"] for part in parts]) if parts else np.empty((0, 3))
    finite = np.isfinite(positions).all(axis=1)
    bounds = (positions[finite].min(axis=0), positions[finite].max(axis=0)) if finite.any() else (np.zeros(3),) * 2
    origin = origin_of(*bounds, 1e-4)
    columns = {}
    for column in sorted({column for part in parts for column in part} - {"positions"}):
        width = next(part[column].shape[1:] for part in parts if column in part)
        columns[column] = np.concatenate([part.get(column, np.zeros((len(part["positions"]), *width), np.float32))
                                          for part in parts])
    rgb, normals = columns.pop("rgb", None), columns.pop("normals", None)
    return PointFile(
        name, (positions - origin).astype(np.float32),
        None if normals is None else normals.astype(np.float32),
        None if rgb is None else colors_of(rgb.astype(np.uint16)),
        {key: values.astype(np.float32) for key, values in columns.items()}, origin, int((~finite).sum()), notes)
