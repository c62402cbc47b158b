# SPDX-License-Identifier: GPL-3.0-or-later
"""What every reader of point files takes and gives. Nothing here knows Blender: reading may run on any thread."""

from __future__ import annotations

import contextlib
import stat
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ... import jobs, native
from .crs import Units

ZERO = (0.0, 0.0, 0.0)

PIECE = 1 << 20  # points that are worked on at once where a whole column would cost memory


@dataclass(frozen=True)
class Filter:
    """Which points are kept while reading."""

    every: int = 1  # each so-manieth in file order
    box: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None  # file coordinates

    def keeps_all(self) -> bool:
        return self.every == 1 and self.box is None

    def mask(self, first: int, positions: np.ndarray, origin: tuple[float, float, float] = ZERO) -> np.ndarray:
        """(n,) bool, of points first, first + 1, ... at positions + origin."""
        keep = np.ones(len(positions), bool)
        if self.every > 1:
            keep[:] = False
            keep[-first % self.every::self.every] = True
        if self.box:
            lower, upper = (np.asarray(corner) - origin for corner in self.box)
            keep &= ((positions >= lower) & (positions <= upper)).all(axis=1)
        return keep


@dataclass
class PointFile:
    name: str
    positions: np.ndarray  # (n, 3) float32, relative to origin
    normals: np.ndarray | None  # (n, 3) float32
    colors: np.ndarray | None  # (n, 4) uint8 sRGB or float32 linear
    scalars: dict[str, np.ndarray]  # (n,) float32, or bytes with a sign or without, by name
    origin: tuple[float, float, float]  # float64
    invalid: int  # positions that are not finite
    # kept with the mesh: "crs", "units" (metres of a unit across and up), "gps_time_start", "scanners" (x, y, z of each,
    # relative to origin)
    notes: dict[str, str | float | list[float]] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)  # sentences on what the file lacks or has too much
    splats: bool = False  # discs of Gaussian splats: scalars "opacity" and "radius" are theirs

    def filtered(self, wanted: Filter) -> PointFile:
        if wanted.keeps_all():
            return self
        return self.only(wanted.mask(0, self.positions, self.origin))

    def finite(self) -> tuple[PointFile, int]:
        """Without positions that are not finite, which no box could hold, and how many they were."""
        left_out = self.invalid
        return (self.only(np.isfinite(self.positions).all(axis=1)), left_out) if left_out else (self, 0)

    def only(self, keep: np.ndarray) -> PointFile:
        """(n,) bool."""
        return replace(
            self, positions=self.positions[keep],
            normals=None if self.normals is None else self.normals[keep],
            colors=None if self.colors is None else self.colors[keep],
            scalars={name: values[keep] for name, values in self.scalars.items()},
            invalid=int((~np.isfinite(self.positions[keep]).all(axis=1)).sum()))


@dataclass(frozen=True)
class Pieces:
    """A file's points, which are never in memory all at once."""

    count: int
    origin: tuple[float, float, float]
    box: tuple[tuple[float, float, float], tuple[float, float, float]]  # file coordinates, as far as known
    notes: dict[str, str | float | list[float]]
    each: Callable[[Progress], Iterator[PointFile | None]]  # all with the same arrays, relative to origin; colors rather (n, 3) uint16. None: a pause
    narrow: bool = True  # colors of 16 bits may become bytes
    zeros: bool = False  # what is zero everywhere stays; else, where colors may become bytes, it is none


class Progress:
    """Of one file; value() and cancel() from any thread."""

    def __init__(self, given: native.Progress | None = None) -> None:
        """given: serves all calls of the library, for one who has it already."""
        self._value = 0.0
        self._cancelled = False
        self._given = given
        self._native: native.Progress | None = None
        self._part: tuple[Progress, float] | None = None  # under way, and its share of the whole
        self._doing = "Reading points"

    def value(self) -> float:
        inner, part = self._native, self._part
        if part:
            return self._value + part[1] * part[0].value()
        return inner.value() if inner else self._value

    @property
    def doing(self) -> str:
        """What is under way, for the artist."""
        part = self._part
        return part[0].doing if part else self._doing

    @doing.setter
    def doing(self, what: str) -> None:
        self._doing = what

    def cancel(self) -> None:
        self._cancelled = True
        inner, part = self._native, self._part
        if part:
            part[0].cancel()
        if inner:
            inner.cancel()

    def part(self, index: int, count: int) -> Progress:
        """Of one of several jobs that follow each other, files for one; until the next."""
        self.step(index / count)
        part = Progress(self._given)
        self._part = (part, 1.0 / count)
        return part

    def step(self, value: float) -> None:
        """Readers call it often. PatinaCancelled when nobody wants the file any more."""
        self._value = value
        if self._cancelled:
            raise native.PatinaCancelled("reading was cancelled", native.CANCELLED)

    @contextlib.contextmanager
    def inner(self) -> Iterator[native.Progress]:
        """For a call of the library. Stays open until this object goes, for other threads may look at it."""
        self.follow(self._given or native.Progress())
        yield self._native

    def follow(self, progress: native.Progress) -> None:
        """From now on this one says how far it is, and is cancelled."""
        self._native = progress
        if self._cancelled:
            progress.cancel()


def colors_of(rgb: np.ndarray) -> np.ndarray:
    """(n, 3) uint16 sRGB → (n, 4): bytes where no detail is lost (8 bits in the low or in the high byte), else linear
    floats. Piece by piece, for the steps between need several times the memory."""
    pieces = [slice(first, first + PIECE) for first in range(0, len(rgb), PIECE)]
    if all(rgb[piece].max() <= 255 for piece in pieces):
        return _opaque(rgb, pieces, np.uint8, 255, lambda part: part)
    if (not any((rgb[piece] & 255).any() for piece in pieces)
            or all((rgb[piece] == (rgb[piece] >> 8) * 257).all() for piece in pieces)):
        return _opaque(rgb, pieces, np.uint8, 255, lambda part: part >> 8)
    s = (np.arange(65536) / 65535.0)
    linear = np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4).astype(np.float32)
    return _opaque(rgb, pieces, np.float32, 1.0, lambda part: linear[part])


def _opaque(rgb: np.ndarray, pieces: list[slice], kind: type, one: float,
            convert: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    rgba = np.empty((len(rgb), 4), kind)
    rgba[:, 3] = one
    for piece in pieces:
        rgba[piece, :3] = convert(rgb[piece])
    return rgba


def regular(path: Path) -> Path:
    """The path. PatinaError where it is there and no file: opening a named pipe waits for who writes into it."""
    with contextlib.suppress(OSError, ValueError):
        mode = path.stat().st_mode
        if not stat.S_ISREG(mode):
            raise native.PatinaError(f"{path.name}: is {'a folder' if stat.S_ISDIR(mode) else 'a device or pipe'}, not a file", native.FILE)
    return path


_CONTROLS = {code: "\N{REPLACEMENT CHARACTER}" for code in (*range(9), *range(11, 32), *range(127, 160), *range(0xD800, 0xDC80), *range(0xDD00, 0xE000))}


def told(text: object) -> str:
    """As Blender's texts and names take it: bytes of a file's name that are no UTF-8, and control characters, which a terminal obeys, become
    replacement characters."""
    plain = str(text).translate(_CONTROLS)
    return plain.encode("utf-8", "surrogateescape").decode("utf-8", "replace")


def name_of(path: Path) -> str:
    """A file's name without its ending, which may be double; of an EPT's ept.json its folder's."""
    return path.parent.name if path.name.lower() == "ept.json" else path.stem.removesuffix(".copc")


def crs_notes(units: Units | None) -> dict[str, list[float]]:
    """The note of a coordinate system's units; none where they are metres, or angles."""
    if units is None or units.degrees or (units.across, units.up) == (1.0, 1.0):
        return {}
    return {"units": [units.across, units.up]}


def scanners_of(places: Sequence[Sequence[float]], origin: tuple[float, float, float]) -> dict[str, list[float]]:
    """The note of where scanners stood, in the file's coordinates; none when that is not known."""
    return {"scanners": (np.asarray(places, np.float64) - origin).ravel().tolist()} if len(places) else {}


def grid_normals(points: PointFile, stations: Sequence[np.ndarray], progress: Progress) -> jobs.Steps[None]:
    """Gives points of scans with a grid (scalars row and column), a station (file coordinates; NaN: not known) and no normals
    those of the grid. Scans follow each other, numbered by the scalar "scan"; without that there is one."""
    if not {"row", "column"} <= points.scalars.keys():
        return
    for index, station in enumerate(stations):
        own = slice(*np.searchsorted(points.scalars["scan"], (index, index + 1))) if "scan" in points.scalars else slice(len(points.positions))
        if not len(points.positions[own]) or not np.isfinite(station).all() or \
                points.normals is not None and points.normals[own].any():
            continue
        progress.step(1.0)
        task = native.start_grid_normals(points.positions[own], points.scalars["column"][own], points.scalars["row"][own],
                                         np.subtract(station, points.origin))
        yield task
        normals = task.result()
        if normals.any():
            points.normals = np.zeros_like(points.positions) if points.normals is None else points.normals
            points.normals[own] = normals


def origin_of(lower: np.ndarray, upper: np.ndarray, detail: float) -> tuple[float, float, float]:
    """An origin for a file's box: none where float32 keeps half its detail, else the lower corner in whole units."""
    most = float(np.abs([lower, upper]).max()) if np.isfinite([lower, upper]).all() else 0.0
    if most * 2.0 ** -24 <= 0.5 * detail:
        return ZERO
    return tuple(float(value) for value in np.floor(lower))
