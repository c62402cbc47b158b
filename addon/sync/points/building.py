# SPDX-License-Identifier: GPL-3.0-or-later
"""Clouds of large files, built on the disk, piece by piece: the file never is in memory whole."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ... import choices, jobs, memory, native
from ...native.building import Builder
from ...read import importers
from ...whole import writing
from ..analyses.scans_of import MOST_SCANS, SCAN_ENDING, SCAN_NAMES, Scans, places_of, whole
from . import attributes

Corner = tuple[float, float, float]

LARGE = 1 << 22  # points: files of more, of the formats that are read in pieces, are built on the disk; all others in memory
BYTES = 120  # of memory that a point takes where its file is read whole, built and analyzed


def names_of(scalar: str) -> set[str]:
    """Of the scalars that a linked cloud has a use for."""
    return {scalar, *attributes.CLASS_NAMES, *SCAN_NAMES} - {""}


def fits_in_memory(count: int) -> bool:
    """Where the disk lacks room, a file may still be read whole; where nobody tells what is free, as smaller ones are."""
    free = memory.free()
    return free is None or free > BYTES * count


def steps(pieces: importers.Pieces, place: Path, scalar: str, offset: Corner, hide_uncolored: bool, progress: importers.Progress,
          parts: int, colors: bool = True) -> jobs.Steps[Scans | None]:
    """Builds the cloud's file, and beside it which scans its points are of, which it gives. offset: added to the pieces' positions.
    The first two of so many parts of the progress. PatinaError where the disk lacks room, too."""
    wanted = [own - shift for own, shift in zip(pieces.origin, offset, strict=True)]  # origin of what is built
    box = tuple(tuple(value - start for value, start in zip(corner, wanted, strict=True)) for corner in pieces.box)
    reading = progress.part(0, parts)
    shown = not hide_uncolored or not colors
    with _Scans(place) as scans, \
            Builder(place, choices.cloud_bytes(), pieces.count, box, narrow=pieces.narrow, zeros=pieces.zeros) as builder:
        for piece in pieces.each(reading):
            if piece is not None:
                opacity, radius = (column(piece, name) if piece.splats else None for name in ("opacity", "radius"))
                rgb = piece.colors if colors else None
                has = attributes.colored(rgb) if hide_uncolored and rgb is not None else None
                shown = shown or has is None or bool(has.any())
                opacity = opacity if has is None else attributes.only(opacity, has)
                builder.add(piece.positions, piece.normals, rgb, opacity, radius, column(piece, scalar), classes(piece), offset)
                scans.add(piece.scalars)
            yield jobs.Pause()
        if not shown:  # colors that are black everywhere are none, and hide nobody
            builder.close()
            return (yield from steps(pieces, place, scalar, offset, hide_uncolored, progress, parts, colors=False))
        writing = progress.part(1, parts)
        writing.doing = f"Building {pieces.count:,} points on the disk"
        with writing.inner() as inner:
            task = builder.start_end(inner)
        try:
            yield task
            task.result()
        finally:
            task.close()  # which waits: the builder goes after it
        return scans.keep()


def column(piece: importers.PointFile, name: str) -> np.ndarray | None:
    values = piece.scalars.get(name)
    return None if values is None else np.ascontiguousarray(values, np.float32).reshape(-1, 1)


def classes(piece: importers.PointFile) -> np.ndarray | None:
    name = next((name for name in attributes.CLASS_NAMES if name in piece.scalars), "")
    values = column(piece, name)
    return None if values is None else attributes.as_classes(values)


class _Scans:
    """Which scan each point is of, on the disk."""

    def __init__(self, place: Path) -> None:
        self._place = place
        self._name = ""
        self._file: BinaryIO | None = None  # a uint16 a point, as the file numbers them
        self._counts = np.zeros(65536, np.int64)

    def __enter__(self) -> _Scans:
        self._file = tempfile.TemporaryFile(dir=self._place.parent)  # which goes with its process
        return self

    def __exit__(self, *_: object) -> None:
        self._close()

    def _close(self) -> None:
        if self._file:
            self._file.close()
        self._file = None

    def add(self, scalars: dict[str, np.ndarray]) -> None:
        self._name = self._name or next((name for name in SCAN_NAMES if name in scalars), "")
        numbers = whole(scalars[self._name]) if self._file and self._name in scalars else None
        if numbers is None:
            self._close()
            return
        self._counts += np.bincount(numbers, minlength=65536)
        try:
            self._file.write(numbers.tobytes())
        except OSError as error:
            raise native.PatinaError(f"{self._place}: cannot be written: {error.strerror}", native.FILE) from None

    def keep(self) -> Scans | None:
        """Writes them beside the cloud, as indices of the numbers that there are, if there are several."""
        numbers = np.flatnonzero(self._counts)
        if not self._file or not 1 < len(numbers) <= MOST_SCANS:
            return None
        places = places_of(numbers)
        self._file.seek(0)
        try:
            with writing(self._place.with_suffix(SCAN_ENDING)) as out:
                while data := self._file.read(1 << 22):
                    out.write(places[np.frombuffer(data, np.uint16)].tobytes())
        except OSError as error:
            raise native.PatinaError(f"{self._place}: cannot be written: {error.strerror}", native.FILE) from None
        return Scans(self._name, tuple(numbers.tolist()))
