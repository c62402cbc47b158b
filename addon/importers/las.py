# SPDX-License-Identifier: GPL-3.0-or-later
"""LAS 1.0 to 1.4 (ASPRS), read in pieces; LAZ and COPC through laspy with lazrs."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .. import jobs, native
from .reading import Filter, PointFile, Progress, colors_of, origin_of

SMALL_PIECE = 1 << 17  # points that take some 30 ms

_OLD = [("X", "<i4"), ("Y", "<i4"), ("Z", "<i4"), ("intensity", "<u2"), ("bit_fields", "u1"),
        ("raw_classification", "u1"), ("scan_angle_rank", "i1"), ("user_data", "u1"), ("point_source_id", "<u2")]
_NEW = [("X", "<i4"), ("Y", "<i4"), ("Z", "<i4"), ("intensity", "<u2"), ("bit_fields", "u1"),
        ("classification_flags", "u1"), ("classification", "u1"), ("user_data", "u1"), ("scan_angle", "<i2"),
        ("point_source_id", "<u2"), ("gps_time", "<f8")]
_GPS = [("gps_time", "<f8")]
_RGB = [("red", "<u2"), ("green", "<u2"), ("blue", "<u2")]
_FORMATS = {0: _OLD, 1: _OLD + _GPS, 2: _OLD + _RGB, 3: _OLD + _GPS + _RGB, 4: _OLD + _GPS, 5: _OLD + _GPS + _RGB,
            6: _NEW, 7: _NEW + _RGB, 8: _NEW + _RGB + [("nir", "<u2")], 9: _NEW, 10: _NEW + _RGB}

# attribute → the field of a record it comes from
_SCALARS = {"intensity": "intensity", "user_data": "user_data", "point_source_id": "point_source_id",
            "scan_angle": "scan_angle", "scan_angle_rank": "scan_angle_rank", "nir": "nir"}

MISSING = ("LAZ and COPC files need the Python packages laspy and lazrs: Patina's extension for Blender 4.2 and later "
           "brings them; elsewhere run \"{python}\" -m pip install --user laspy lazrs, or unpack the file to LAS")


@dataclass(frozen=True)
class Header:
    version: str
    points: int
    form: int  # of a point record
    compressed: bool
    record_size: int
    data_offset: int
    scale: np.ndarray  # (3,) float64
    offset: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    crs: str


def _fail(path: Path, what: str) -> native.PatinaError:
    return native.PatinaError(f"{path.name}: {what}", -4)


def read_header(path: Path) -> Header:
    with open(path, "rb") as file:
        head = file.read(375)
        if len(head) < 227 or head[:4] != b"LASF":
            raise _fail(path, "not a LAS file: its first bytes are not 'LASF'")
        header_size, data_offset, records, form, record_size, count = struct.unpack_from("<HIIBHI", head, 94)
        box = struct.unpack_from("<12d", head, 131)
        if head[24:26] >= b"\x01\x04" and len(head) >= 255:
            count = struct.unpack_from("<Q", head, 247)[0] or count
        crs = _crs(file, header_size, min(records, 4096), data_offset)
    return Header(f"{head[24]}.{head[25]}", count, form & 0x3F, bool(form & 0xC0), record_size, data_offset,
                  np.array(box[0:3]), np.array(box[3:6]), np.array(box[7:12:2]), np.array(box[6:12:2]), crs)


def _crs(file, at: int, records: int, end: int) -> str:
    """The text of the coordinate system: WKT, else what the GeoTIFF keys say in words."""
    words = ""
    for _ in range(records):
        file.seek(at)
        record = file.read(54)
        if len(record) < 54 or at + 54 > end:
            break
        user, number, length = record[2:18].rstrip(b"\0"), *struct.unpack_from("<HH", record, 18)
        if user == b"LASF_Projection" and number in {2112, 34737}:
            text = file.read(length).rstrip(b"\0").decode("utf-8", "replace")
            if number == 2112:
                return text
            words = text
        at += 54 + length
    return words


def preview(path: Path) -> list[str]:
    header = read_header(path)
    size = header.upper - header.lower
    names = {name for name, _ in _FORMATS.get(header.form, [])}
    return [f"LAS {header.version}, point format {header.form}{', compressed' * header.compressed}",
            f"{header.points:,} points", f"{size[0]:,.1f} x {size[1]:,.1f} x {size[2]:,.1f}",
            *(["colours"] * ("red" in names)), *(["GPS time"] * ("gps_time" in names)),
            *([header.crs[:60]] * bool(header.crs))]


def _pieces(path: Path, header: Header, size: int) -> Iterator[np.ndarray]:
    if header.compressed:
        try:
            import laspy
            import lazrs  # noqa: F401  laspy finds it by itself
        except ImportError:
            import sys
            raise native.PatinaError(MISSING.format(python=sys.executable), -5) from None
        try:
            with laspy.open(str(path)) as file:
                for points in file.chunk_iterator(size):
                    yield points.array
        except (laspy.errors.LaspyException, lazrs.LazrsError, ValueError, OSError) as error:
            raise _fail(path, f"cannot be unpacked: {error}") from None
        return
    fields = _FORMATS.get(header.form)
    if fields is None:
        raise _fail(path, f"point format {header.form} is not one of LAS 1.0 to 1.4")
    kind = np.dtype(fields)
    if header.record_size < kind.itemsize:
        raise _fail(path, f"records of {header.record_size} bytes cannot hold point format {header.form}")
    padding = header.record_size - kind.itemsize
    kind = np.dtype(fields + [("more", f"V{padding}")] * bool(padding))
    have = (path.stat().st_size - header.data_offset) // kind.itemsize
    if have < header.points:
        raise _fail(path, f"ends after {max(have, 0):,} of {header.points:,} points")
    for first in range(0, header.points, size):
        yield np.fromfile(path, kind, min(size, header.points - first), offset=header.data_offset + first * kind.itemsize)


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
    origin = origin_of(header.lower, header.upper, float(header.scale.min()))
    columns = _Columns(header.points)
    done = 0
    for piece in _pieces(path, header, SMALL_PIECE):
        progress.step(done / max(header.points, 1))
        names = piece.dtype.names
        positions = np.empty((len(piece), 3), np.float32)
        for axis, name in enumerate("XYZ"):
            positions[:, axis] = piece[name] * header.scale[axis] + (header.offset[axis] - origin[axis])
        keep = slice(None) if wanted.keeps_all() else wanted.mask(done, positions, origin)
        done += len(piece)
        found = {"positions": positions[keep]}
        found |= {scalar: piece[name][keep] for scalar, name in _SCALARS.items() if name in names}
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
        columns.add(found)
        yield jobs.Pause()
    return _assemble(path, header, origin, columns)


def _assemble(path: Path, header: Header, origin: tuple[float, float, float], columns: _Columns) -> PointFile:
    positions = columns.take("positions")
    if positions is None:
        return PointFile(path.stem, np.empty((0, 3), np.float32), None, None, {}, origin, 0)
    notes: dict[str, str | float] = {"crs": header.crs} if header.crs else {}
    rgb = columns.take("rgb")
    colors = None if rgb is None else colors_of(rgb)
    del rgb  # before more is made
    scalars = {}
    times = columns.take("gps_time")
    if times is not None:  # float32 holds no GPS second: kept from the first one on
        start = float(np.nanmin(times)) if np.isfinite(times).any() else 0.0
        times -= start
        scalars["gps_time"] = times.astype(np.float32)
        notes["gps_time_start"] = start
    del times
    for name in columns:
        values = columns.take(name)
        scalars[name] = values if values.dtype.itemsize == 1 else values.astype(np.float32)
    return PointFile(path.stem, positions, None, colors, scalars, origin, 0, notes)
