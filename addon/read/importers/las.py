# SPDX-License-Identifier: GPL-3.0-or-later
"""LAS 1.0 to 1.4 (ASPRS), read in pieces; LAZ and COPC through lazrs, in a process of its own."""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Iterator
from pathlib import Path

import numpy as np

from ... import jobs, native
from .. import readers, unpacking
from . import crs
from .las_header import POINT_FORMATS, Header, fault, read_header, record_of
from .reading import Filter, Pieces, PointFile, Progress, colors_of, crs_notes, name_of, origin_of

SMALL_PIECE = 1 << 17  # points that take some 30 ms
FEW = 1000  # points that tell where a file lies

MOST_SECONDS = 1e12  # 30,000 years: a GPS time beyond was never one

# attribute → the field of a record it comes from
_SCALARS = {"intensity": "intensity", "user_data": "user_data", "point_source_id": "point_source_id",
            "scan_angle": "scan_angle", "scan_angle_rank": "scan_angle_rank", "nir": "nir"}
_OURS = {*_SCALARS, "positions", "rgb", "class", "gps_time", "return_number", "number_of_returns"}

FORMATS = "LAZ and COPC"  # as readers.PACKAGES has them


def missing() -> str:
    return f"{readers.how_to(FORMATS)}, or convert the file to LAS"


def preview(path: Path) -> list[str]:
    header = read_header(path)
    size = header.upper - header.lower
    names = {name for name, _ in POINT_FORMATS.get(header.form, [])}
    return [f"LAS {header.version}, point format {header.form}{', compressed' * header.compressed}",
            f"{header.points:,} points", f"{size[0]:,.1f} x {size[1]:,.1f} x {size[2]:,.1f}",
            *(["cannot be read yet: choose Install Readers in the add-on's preferences"] * (header.compressed and readers.lacks("laspy", "lazrs"))),
            *(["colors"] * ("red" in names)), *(["GPS time"] * ("gps_time" in names)),
            *(["extra: " + ", ".join(extra.name for extra in header.extras)] * bool(header.extras)),
            *([f"units: {header.units}"] * bool(header.units)), *([crs.name(header.crs)[:80]] * bool(header.crs))]


def _pieces(path: Path, header: Header, size: int) -> Iterator[np.ndarray | None]:
    """Records, size at a time; None: nothing yet."""
    kind = record_of(path, header)
    have = (path.stat().st_size - header.data_offset) // kind.itemsize
    if have < header.points and not header.compressed:
        raise fault(path, f"ends after {max(have, 0):,} of {header.points:,} points")
    if not (np.isfinite([header.scale, header.offset]).all() and (header.scale != 0.0).all()):
        numbers = " ".join(f"{value:g}" for value in (*header.scale, *header.offset))
        raise fault(path, f"its scale and offset are 0 or no numbers: {numbers}")
    if header.compressed:
        yield from _unpacked(path, header, kind, size)
        return
    for first in range(0, header.points, size):
        yield np.fromfile(path, kind, min(size, header.points - first), offset=header.data_offset + first * kind.itemsize)


def _unpacked(path: Path, header: Header, kind: np.dtype, size: int) -> Iterator[np.ndarray | None]:
    if readers.lacks("lazrs"):
        raise native.PatinaError(f"{path.name}: {missing()}", -5)
    if not header.laszip:
        raise fault(path, "cannot be unpacked: it has no record that says how its points are packed")
    size = max(1, min(size, unpacking.SLOT // kind.itemsize, header.points))
    with unpacking.Unpacker(path, "laz", size * kind.itemsize, 2 * path.stat().st_size, offset=header.data_offset, vlr=header.laszip.hex(),
                            record=kind.itemsize, points=header.points, piece=size) as process:
        for answer in process.answers():
            if answer is None:
                yield None
            elif "slot" in answer:
                yield np.frombuffer(process.take(answer["slot"], answer["count"] * kind.itemsize), kind)


class _Columns:
    """Arrays filled piece by piece, in memory that is taken once: pieces put together at the end would need twice as much.
    A column begins with its first number that is not zero: many fields the scanner never filled."""

    def __init__(self, most: int) -> None:
        self._most = most  # points
        self._arrays: dict[str, np.ndarray] = {}
        self.count = 0  # of points so far

    def add(self, found: dict[str, np.ndarray]) -> None:
        end = self.count + len(found["positions"])
        for name, values in found.items():
            if name not in self._arrays:
                if name != "positions" and not values.any():
                    continue
                self._arrays[name] = np.zeros((self._most, *values.shape[1:]), values.dtype)  # zeros are no memory yet
            self._arrays[name][self.count:end] = values
        self.count = end

    def __iter__(self) -> Iterator[str]:
        return iter(list(self._arrays))

    def take(self, name: str) -> np.ndarray | None:
        """The column, which is gone here then; None for one of zeros."""
        values = self._arrays.pop(name, None)
        return None if values is None else values[:self.count]


def read(path: Path, wanted: Filter, progress: Progress) -> PointFile:
    """Reads and filters piece by piece. PatinaError when it cannot be read."""
    return jobs.finish(steps(path, wanted, progress))


def steps(path: Path, wanted: Filter, progress: Progress) -> jobs.Steps[PointFile]:
    """The same with a pause after each piece."""
    try:
        header = read_header(path)
    except OSError as error:
        raise native.PatinaError(f"{path.name}: cannot be read: {error.strerror}", -3) from None
    try:
        return (yield from _read(path, header, wanted, progress))
    except (MemoryError, OverflowError):
        raise native.PatinaError(f"{path.name}: memory is short for its {header.points:,} points", -2) from None


def _read(path: Path, header: Header, wanted: Filter, progress: Progress) -> jobs.Steps[PointFile]:
    origin = _origin(path, header)
    columns = _Columns(header.points)
    done = 0
    with contextlib.closing(_pieces(path, header, SMALL_PIECE)) as pieces:
        for piece in pieces:
            progress.step(done / max(header.points, 1))
            if piece is not None:
                positions = _places(header, piece, origin)
                keep = slice(None) if wanted.keeps_all() else wanted.mask(done, positions, origin)
                done += len(piece)
                columns.add(_extras(header, piece, keep) | {"positions": positions[keep]} | _fields(piece, keep))
            yield jobs.Pause()
    return _assemble(path, header, origin, columns)


def _box_is_wrong(header: Header) -> bool:
    """Whether the box of all points is where no point of the file's scale and offset can be."""
    reach = np.abs(header.scale) * 2.0 ** 31 * (1.0 + 1e-6)
    inside = (header.lower >= header.offset - reach) & (header.upper <= header.offset + reach) & (header.lower <= header.upper)
    return bool(header.points) and not inside.all()  # nor NaN


def _origin(path: Path, header: Header) -> tuple[float, float, float]:
    """From the box of all points; from the first points where that box is wrong."""
    lower, upper = header.lower, header.upper
    if _box_is_wrong(header):
        with contextlib.closing(_pieces(path, header, FEW)) as pieces:
            first = next((piece for piece in pieces if piece is not None), None)
        if first is not None:
            places = np.stack([first[axis] for axis in "XYZ"], 1) * header.scale + header.offset
            lower, upper = places.min(axis=0), places.max(axis=0)
    return origin_of(lower, upper, float(np.abs(header.scale).min()))


def _faults(path: Path, header: Header) -> list[str]:
    """Warnings on what the header says: records within the points, another number of points, a box where no point can be."""
    found = list(header.warnings)
    end = path.stat().st_size if header.end is None else min(header.end, path.stat().st_size)
    more = (end - header.data_offset) // max(header.record_size, 1) - header.points
    if more > 0 and not header.compressed and (header.end is not None or header.version <= "1.2"):
        found.append(f"{path.name}: announces {header.points:,} points; {more:,} more records follow, which are left out")
    if _box_is_wrong(header):
        box = " ".join(f"{value:g}" for value in (*header.lower, *header.upper))
        found.append(f"{path.name}: its box, {box}, is not of its points, and is not used")
    return found


def _places(header: Header, piece: np.ndarray, origin: tuple[float, float, float]) -> np.ndarray:
    positions = np.empty((len(piece), 3), np.float32)
    for axis, name in enumerate("XYZ"):
        positions[:, axis] = piece[name] * header.scale[axis] + (header.offset[axis] - origin[axis])
    return positions


def _fields(piece: np.ndarray, keep: np.ndarray | slice) -> dict[str, np.ndarray]:
    """What the point format itself has, but positions."""
    names = piece.dtype.names
    found = {scalar: piece[name][keep] for scalar, name in _SCALARS.items() if name in names}
    found["class"] = (piece["raw_classification"][keep] & 31 if "raw_classification" in names
                      else piece["classification"][keep])
    bits = piece["bit_fields"][keep]
    share = 15 if "classification" in names else 7
    found["return_number"] = bits & share
    found["number_of_returns"] = bits >> (4 if share == 15 else 3) & share
    if "gps_time" in names:
        found["gps_time"] = piece["gps_time"][keep]
    if "red" in names:
        found["rgb"] = np.stack([piece[name][keep] for name in ("red", "green", "blue")], 1)
    return found


def in_pieces(path: Path, least: int, names: Collection[str], _progress: Progress) -> jobs.Steps[Pieces | None]:
    """The points piece by piece, with those of their scalars that are named; None where there are not more than least."""
    try:
        header = read_header(path)
    except OSError as error:
        raise native.PatinaError(f"{path.name}: cannot be read: {error.strerror}", -3) from None
    yield from ()
    if header.points <= least:
        return None
    origin = _origin(path, header)
    return Pieces(header.points, origin, (tuple(header.lower.tolist()), tuple(header.upper.tolist())), crs_notes(header.units),
                  lambda progress: _told(path, header, _each(path, header, origin, frozenset(names), progress)))


def _told(path: Path, header: Header, pieces: Iterator[PointFile | None]) -> Iterator[PointFile | None]:
    """The pieces; what keeps them from being read as PatinaError."""
    try:
        yield from pieces
    except (MemoryError, OverflowError):
        raise native.PatinaError(f"{path.name}: memory is short for its {header.points:,} points", -2) from None
    except OSError as error:
        raise native.PatinaError(f"{path.name}: cannot be read: {error.strerror or error}", -3) from None


def _each(path: Path, header: Header, origin: tuple[float, float, float], names: frozenset[str],
          progress: Progress) -> Iterator[PointFile | None]:
    """None: nothing yet."""
    start, passes, done = 0.0, 1, 0
    if "gps_time" in names and "gps_time" in record_of(path, header).names:  # which begins with the earliest, wherever that is
        start, passes = np.inf, 2
        for piece in _pieces(path, header, SMALL_PIECE):
            progress.step(done / header.points / passes)
            if piece is None:
                yield None
                continue
            done += len(piece)
            times = piece["gps_time"]
            start = min(start, float(times[np.abs(times) <= MOST_SECONDS].min(initial=np.inf)))
            yield None
        start = start if np.isfinite(start) else 0.0
    for piece in _pieces(path, header, SMALL_PIECE):
        progress.step(done / header.points / passes)
        if piece is None:
            yield None
            continue
        done += len(piece)
        found = _extras(header, piece, slice(None)) | _fields(piece, slice(None))
        if "gps_time" in found:
            times = found["gps_time"]
            found["gps_time"] = np.where(np.abs(times) <= MOST_SECONDS, times - start, np.nan).astype(np.float32)
        normals = next(([found[name] for name in normal] for normal in _normal_names(header) if all(name in found for name in normal)), None)
        yield PointFile(name_of(path), _places(header, piece, origin), None if normals is None else np.stack(normals, 1).astype(np.float32),
                        found.get("rgb"), {name: values for name, values in found.items() if name in names}, origin, 0)


def _extras(header: Header, piece: np.ndarray, keep: np.ndarray | slice) -> dict[str, np.ndarray]:
    """Values of the extra dimensions by name; of those with two or three, with a number behind it."""
    found = {}
    for index, extra in enumerate(header.extras):
        if f"extra {index}" not in piece.dtype.names or extra.kind[0] == "V":
            continue
        raw = piece[f"extra {index}"][keep]
        for axis in range(extra.count):
            name = extra.name or f"extra {index}"
            name = name if extra.count == 1 else f"{name} {axis}"
            name = f"extra {name}" if name in _OURS or name in found else name
            found[name] = extra.values(raw[:, axis], axis)
    return found


def _normal_names(header: Header) -> Iterator[list[str]]:
    """Of extra dimensions, as CloudCompare and PDAL write them."""
    by_name = {extra.name.lower(): extra.name for extra in header.extras}
    for names in (("normalx", "normaly", "normalz"), ("nx", "ny", "nz")):
        if all(name in by_name for name in names):
            yield [by_name[name] for name in names]


def _normals_of(header: Header, columns: _Columns) -> np.ndarray | None:
    for names in _normal_names(header):
        found = [columns.take(name) for name in names]
        normals = np.zeros((columns.count, 3), np.float32)
        for axis, values in enumerate(found):
            normals[:, axis] = 0.0 if values is None else values
        return normals if any(values is not None for values in found) else None
    return None


def _assemble(path: Path, header: Header, origin: tuple[float, float, float], columns: _Columns) -> PointFile:
    positions = columns.take("positions")
    if positions is None:
        return PointFile(name_of(path), np.empty((0, 3), np.float32), None, None, {}, origin, 0, {}, _faults(path, header))
    notes: dict[str, str | float] = {"crs": header.crs} if header.crs else {}
    notes |= crs_notes(header.units)
    rgb = columns.take("rgb")
    colors = None if rgb is None else colors_of(rgb)
    del rgb  # before more is made
    scalars = {}
    times = columns.take("gps_time")
    if times is not None:  # float32 holds no GPS second: kept from the first one on
        good = np.abs(times) <= MOST_SECONDS  # no NaN either
        start = float(times[good].min()) if good.any() else 0.0
        times[~good] = np.nan
        times -= start
        scalars["gps_time"] = times.astype(np.float32)
        notes["gps_time_start"] = start
    del times
    normals = _normals_of(header, columns)
    for name in columns:
        values = columns.take(name)
        scalars[name] = values if values.dtype.itemsize == 1 else values.astype(np.float32)
    degrees = header.units is not None and header.units.degrees
    warnings = [f"{path.name}: its coordinates are longitude and latitude in degrees; project them to see right shapes"] * degrees
    return PointFile(name_of(path), positions, normals, colors, scalars, origin, 0, notes, _faults(path, header) + warnings)
