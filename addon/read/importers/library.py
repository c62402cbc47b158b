# SPDX-License-Identifier: GPL-3.0-or-later
"""PLY, XYZ, CSV, PTS, PTX and conf files through the library's readers."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path

import numpy as np

from ... import jobs, native
from ...native.rows import Rows
from . import scans
from .reading import ZERO, Filter, Pieces, PointFile, Progress, regular, scanners_of

SMALL_PIECE = 1 << 17  # points that take some 30 ms
MOST_LISTS = 1 << 23  # rows with lists that are gone through at one go, which takes some 0.1 s


def read(path: Path, wanted: Filter, progress: Progress) -> PointFile:
    """Reads a file whole, then filters. PatinaError when it cannot be read."""
    return jobs.finish(steps(path, wanted, progress))


def steps(path: Path, wanted: Filter, progress: Progress) -> jobs.Steps[PointFile]:
    """The same in steps."""
    with progress.inner() as inner:
        task = native.File.start(str(path), inner)
    yield task
    with task.result() as file:
        found = file.scans()
        told = [scans.Scan(scan.name, scan.count, scan.direction, scan.interval, scan.pose, scan.grid) for scan in found]
        stations = file.stations()
        if not len(stations) and any(scan.station for scan in found):
            stations = [scan.station or (np.nan,) * 3 for scan in found]
        # the log is the whole process's; nobody else reads it
        names = {path.name, *(scan.name for scan in told if scan.name)}
        warnings = [text for level, text in native.log_lines() if level == 1 and any(name in text for name in names)]
        return PointFile(
            name=path.stem,
            positions=file.positions(),
            normals=file.normals(),
            colors=file.colors(),
            scalars={name: file.attribute(index) for index, name in enumerate(file.attributes)},
            origin=file.origin,
            invalid=file.invalid_positions,
            notes=scanners_of(stations, file.origin) | scans.note(told),
            warnings=warnings,
            splats=file.splats).filtered(wanted)


def in_pieces(path: Path, least: int, names: Collection[str], progress: Progress) -> jobs.Steps[Pieces | None]:
    """The points of a binary PLY piece by piece, with those of their scalars that are named; None where there are not more than least, where
    the library reads the file whole, of a text, all of which would have to be looked through to know the first thing of it, and of many lists."""
    yield from ()
    try:
        with open(regular(path), "rb") as file:
            head = file.read(65536)
    except OSError:
        return None  # whoever reads it whole says what is wrong
    if not head.startswith(b"ply") or b"format binary" not in head or path.stat().st_size < least or _lists(head) > MOST_LISTS:
        return None
    try:
        with progress.inner() as inner, Rows(path, inner) as rows:
            if rows.whole or rows.count <= least:
                return None
            count = rows.count
            origin = next((window.origin for window in rows.windows(1)), ZERO)
    except native.PatinaCancelled:
        raise
    except native.PatinaError:
        return None
    wanted = frozenset(names)
    return Pieces(count, origin, (ZERO, ZERO), {}, lambda progress: _each(path, wanted, progress), narrow=False)


def _each(path: Path, names: frozenset[str], progress: Progress) -> Iterator[PointFile]:
    done = 0
    with progress.inner() as inner, Rows(path, inner) as rows:
        for window in rows.windows(SMALL_PIECE):
            progress.step(done / rows.count)
            done += window.count
            kept = names | {"opacity", "radius"} if window.splats else names
            scalars = {name: window.attribute(index) for index, name in enumerate(window.attributes) if name in kept}
            yield PointFile(path.stem, window.positions(), window.normals(), window.colors(), scalars, window.origin,
                            window.invalid_positions, splats=window.splats)


def _lists(head: bytes) -> int:
    """Rows of a PLY that have lists: where one ends is known when it has been looked at. Those before the points are gone through when the
    file is opened, those behind them with the last window."""
    rows, total = 0, 0
    for line in head.split(b"end_header")[0].splitlines():
        words = line.split()
        if words[:1] == [b"element"]:
            rows = int(words[2]) if len(words) == 3 and words[2].isdigit() else 0
        elif words[:2] == [b"property", b"list"]:
            total, rows = total + rows, 0
    return total


def preview(path: Path) -> list[str]:
    """What the head of the file says: a PLY's header, else the first lines."""
    with open(regular(path), "rb") as file:
        head = file.read(65536)
    if path.suffix.lower() == ".conf":
        names = [words[1] for line in head.decode("utf-8", "replace").splitlines() if (words := line.split())[:1] == ["bmesh"]
                 and len(words) > 1]
        return [f"{len(names)} scans", *names[:8]]
    if not head.startswith(b"ply"):
        lines = head.decode("utf-8", "replace").splitlines()
        return [f"{path.stat().st_size / 1e6:,.1f} MB of text", *(line[:60] for line in lines[:4])]
    lines, inside = [], False
    for line in head.split(b"end_header")[0].decode("utf-8", "replace").splitlines():
        words = line.split()
        if words[:1] == ["format"]:
            lines.append(f"PLY {words[1]}")
        elif words[:1] == ["element"] and len(words) == 3:
            inside = words[1] in {"vertex", "vertices", "point", "points"}
            if inside:
                lines.append(f"{int(words[2]):,} points" if words[2].isdigit() else words[2])
        elif words[:1] == ["property"] and inside and words[1] != "list":
            lines.append(f"{words[-1]}: {words[1]}")
    return lines
