# SPDX-License-Identifier: GPL-3.0-or-later
"""LAS 1.0 to 1.4 (ASPRS), read in pieces; LAZ and COPC through lazrs, in a process of its own."""

from __future__ import annotations

import contextlib
import itertools
import os
import struct
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from .. import jobs, native, readers, unpacking
from . import crs
from .reading import Filter, Pieces, PointFile, Progress, colors_of, crs_notes, name_of, origin_of, regular

SMALL_PIECE = 1 << 17  # points that take some 30 ms
FEW = 1000  # points that tell where a file lies

_OLD = [("X", "<i4"), ("Y", "<i4"), ("Z", "<i4"), ("intensity", "<u2"), ("bit_fields", "u1"),
        ("raw_classification", "u1"), ("scan_angle_rank", "i1"), ("user_data", "u1"), ("point_source_id", "<u2")]
_NEW = [("X", "<i4"), ("Y", "<i4"), ("Z", "<i4"), ("intensity", "<u2"), ("bit_fields", "u1"),
        ("classification_flags", "u1"), ("classification", "u1"), ("user_data", "u1"), ("scan_angle", "<i2"),
        ("point_source_id", "<u2"), ("gps_time", "<f8")]
_GPS = [("gps_time", "<f8")]
_RGB = [("red", "<u2"), ("green", "<u2"), ("blue", "<u2")]
_NIR = [("nir", "<u2")]
_WAVE = [("wave", "V29")]  # where its waveform lies: not read
_FORMATS = {0: _OLD, 1: _OLD + _GPS, 2: _OLD + _RGB, 3: _OLD + _GPS + _RGB, 4: _OLD + _GPS + _WAVE,
            5: _OLD + _GPS + _RGB + _WAVE, 6: _NEW, 7: _NEW + _RGB, 8: _NEW + _RGB + _NIR, 9: _NEW + _WAVE,
            10: _NEW + _RGB + _NIR + _WAVE}

# data_type of an extra dimension, from 1; 11 to 30 are pairs and triples of the same
_EXTRA_TYPES = ("u1", "i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f4", "<f8")
_NO_DATA, _SCALE, _OFFSET = 1, 8, 16  # bits of its options

MOST_SECONDS = 1e12  # 30,000 years: a GPS time beyond was never one

# attribute → the field of a record it comes from
_SCALARS = {"intensity": "intensity", "user_data": "user_data", "point_source_id": "point_source_id",
            "scan_angle": "scan_angle", "scan_angle_rank": "scan_angle_rank", "nir": "nir"}
_OURS = {*_SCALARS, "positions", "rgb", "class", "gps_time", "return_number", "number_of_returns"}

FORMATS = "LAZ and COPC"  # as readers.PACKAGES has them


def missing() -> str:
    return f"{readers.how_to(FORMATS)}, or convert the file to LAS"


@dataclass(frozen=True)
class Extra:
    """A dimension that follows the fields of the point format."""

    name: str
    kind: str  # of numpy; raw bytes: "V" and their number
    count: int  # of values a point
    options: int
    no_data: bytes  # 24: three of the widest type
    scale: tuple[float, ...]  # 3
    offset: tuple[float, ...]

    def values(self, raw: np.ndarray, axis: int) -> np.ndarray:
        """(n,) of one of its values: bytes as they are, else float32; NaN where the file says that there is none."""
        number = np.dtype(self.kind)
        empty = np.zeros(len(raw), bool)
        if self.options & _NO_DATA:
            widest = "<f8" if number.kind == "f" else f"<{number.kind}8"
            empty = raw == np.frombuffer(self.no_data, widest)[axis].astype(number)
        scaled = self.options & (_SCALE | _OFFSET)
        if not scaled and not empty.any():
            return raw if number.itemsize == 1 else raw.astype(np.float32)
        values = raw * (self.scale[axis] if self.options & _SCALE else 1.0) + (self.offset[axis] if self.options & _OFFSET
                                                                              else 0.0)
        values[empty] = np.nan
        return values.astype(np.float32)


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
    laszip: bytes = b""  # the record that says how points are packed
    extras: tuple[Extra, ...] = ()
    units: crs.Units | None = None
    warnings: tuple[str, ...] = ()
    end: int | None = None  # byte behind the points, where the file says what follows them


def _fail(path: Path, what: str) -> native.PatinaError:
    return native.PatinaError(f"{path.name}: {what}", -4)


def read_header(path: Path) -> Header:
    with open(regular(path), "rb") as file:
        head = file.read(375)
        if len(head) < 227 or head[:4] != b"LASF":
            raise _fail(path, "not a LAS file: its first bytes are not 'LASF'")
        header_size, data_offset, records, form, record_size, count = struct.unpack_from("<HIIBHI", head, 94)
        box = struct.unpack_from("<12d", head, 131)
        end = None
        if head[24:26] >= b"\x01\x04" and len(head) >= 255:
            end = struct.unpack_from("<Q", head, 235)[0] or None
            count = struct.unpack_from("<Q", head, 247)[0] or count
        if header_size < 227 or data_offset < header_size:
            raise _fail(path, f"its points begin at byte {data_offset:,}, its header takes {header_size:,} bytes and at least 227")
        warnings = [f"{path.name}: {text}" for text in _overlap(file, header_size, min(records, 4096), data_offset)]
        words, extras, keys, laszip = _records(file, head, header_size, min(records, 4096), data_offset)
    return Header(f"{head[24]}.{head[25]}", count, form & 0x3F, bool(form & 0xC0), record_size, data_offset,
                  np.array(box[0:3]), np.array(box[3:6]), np.array(box[7:12:2]), np.array(box[6:12:2]), words, laszip, extras,
                  crs.units(words, keys), tuple(warnings), end)


def _records(file: BinaryIO, head: bytes, at: int, records: int, end: int
             ) -> tuple[str, tuple[Extra, ...], dict[int, float], bytes]:
    """Of the variable records, before the points and behind them: the text of the coordinate system (WKT, else what the
    GeoTIFF keys say in words), the extra dimensions, the GeoTIFF keys that are numbers, and what LASzip says of its packing."""
    wkt = words = ""
    directory, doubles, laszip = b"", b"", b""
    extras: tuple[Extra, ...] = ()
    for user, number, data in itertools.chain(_before(file, at, records, end), _behind(file, head)):
        if user == b"LASF_Projection" and number in {2112, 34737}:
            text = data.rstrip(b"\0").decode("utf-8", "replace")
            wkt, words = (wkt or text, words) if number == 2112 else (wkt, words or text)
        elif user == b"LASF_Projection" and number == 34735:
            directory = directory or data
        elif user == b"LASF_Projection" and number == 34736:
            doubles = doubles or data
        elif user == b"laszip encoded" and number == 22204:
            laszip = laszip or data
        elif user == b"LASF_Spec" and number == 4:
            extras = extras or tuple(_extra(data[i:i + 192]) for i in range(0, len(data) - 191, 192))
    return wkt or words, extras, _geo_keys(directory, doubles), laszip


def _geo_keys(directory: bytes, doubles: bytes) -> dict[int, float]:
    """The keys of a GeoTIFF directory whose values are numbers; of those that are words, where they begin."""
    entries = [struct.unpack_from("<4H", directory, at) for at in range(8, len(directory) - 7, 8)]
    found: dict[int, float] = {key: value for key, place, _, value in entries if place in {0, 34737}}
    for key, place, _, index in entries:
        if place == 34736 and 8 * index + 8 <= len(doubles):
            found[key] = struct.unpack_from("<d", doubles, 8 * index)[0]
    return found


def _before(file: BinaryIO, at: int, records: int, end: int) -> Iterator[tuple[bytes, int, bytes]]:
    for _ in range(records):
        file.seek(at)
        record = file.read(54)
        if len(record) < 54 or at + 54 > end:
            return
        number, length = struct.unpack_from("<HH", record, 18)
        yield record[2:18].rstrip(b"\0"), number, file.read(length)
        at += 54 + length


def _behind(file: BinaryIO, head: bytes) -> Iterator[tuple[bytes, int, bytes]]:
    """LAS 1.4 alone."""
    at, records = struct.unpack_from("<QI", head, 235) if head[24:26] >= b"\x01\x04" and len(head) >= 247 else (0, 0)
    size = file.seek(0, os.SEEK_END)
    for _ in range(min(records, 4096)):
        if at > size:  # file systems refuse to seek to places far behind a file's end
            return
        file.seek(at)
        record = file.read(60)
        if len(record) < 60:
            return
        number, length = struct.unpack_from("<HQ", record, 18)
        yield record[2:18].rstrip(b"\0"), number, file.read(min(length, 1 << 20))
        at += 60 + length


def _overlap(file: BinaryIO, at: int, records: int, end: int) -> Iterator[str]:
    """Says which of the records before the points reaches into them, if one does."""
    for index in range(records):
        file.seek(at)
        record = file.read(54)
        if len(record) < 54:
            return
        at += 54 + struct.unpack_from("<H", record, 20)[0]
        if at > end:
            yield f"its record {index} of {records:,} ends at byte {at:,}, where its points begin at byte {end:,} already"
            return


def _extra(record: bytes) -> Extra:
    kind, options = record[2], record[3]
    name = record[4:36].split(b"\0")[0].decode("utf-8", "replace").strip()
    if not 1 <= kind <= 30:  # nobody says what it is, only how long
        return Extra(name, f"V{options}", 1, 0, b"", (), ())
    return Extra(name, _EXTRA_TYPES[(kind - 1) % 10], 1 + (kind - 1) // 10, options, record[40:64],
                 struct.unpack_from("<3d", record, 112), struct.unpack_from("<3d", record, 136))


def is_copc(path: Path) -> int | None:
    """How many points a COPC holds; None for other files."""
    with open(regular(path), "rb") as file:
        head = file.read(429)
    if len(head) < 429 or head[:4] != b"LASF" or head[377:381] != b"copc":
        return None
    return struct.unpack_from("<Q", head, 247)[0]


def preview(path: Path) -> list[str]:
    header = read_header(path)
    size = header.upper - header.lower
    names = {name for name, _ in _FORMATS.get(header.form, [])}
    return [f"LAS {header.version}, point format {header.form}{', compressed' * header.compressed}",
            f"{header.points:,} points", f"{size[0]:,.1f} x {size[1]:,.1f} x {size[2]:,.1f}",
            *(["cannot be read yet: choose Install Readers in the add-on's preferences"] * (header.compressed and readers.lacks("laspy", "lazrs"))),
            *(["colors"] * ("red" in names)), *(["GPS time"] * ("gps_time" in names)),
            *(["extra: " + ", ".join(extra.name for extra in header.extras)] * bool(header.extras)),
            *([f"units: {header.units}"] * bool(header.units)), *([crs.name(header.crs)[:80]] * bool(header.crs))]


def _record(path: Path, header: Header) -> np.dtype:
    """Of a point: the fields of its format, then the extra dimensions as "extra 0", ..., as far as the record holds them."""
    fields = _FORMATS.get(header.form)
    if fields is None:
        raise _fail(path, f"point format {header.form} is not one of LAS 1.0 to 1.4")
    size = np.dtype(fields).itemsize
    if header.record_size < size:
        raise _fail(path, f"records of {header.record_size} bytes cannot hold point format {header.form}")
    more = []
    for index, extra in enumerate(header.extras):
        kind = np.dtype((extra.kind, (extra.count,)))
        if size + kind.itemsize > header.record_size:
            break
        more += [(f"extra {index}", extra.kind, (extra.count,))] * bool(kind.itemsize)
        size += kind.itemsize
    return np.dtype(fields + more + [("more", f"V{header.record_size - size}")] * (header.record_size > size))


def _pieces(path: Path, header: Header, size: int) -> Iterator[np.ndarray | None]:
    """Records, size at a time; None: nothing yet."""
    kind = _record(path, header)
    have = (path.stat().st_size - header.data_offset) // kind.itemsize
    if have < header.points and not header.compressed:
        raise _fail(path, f"ends after {max(have, 0):,} of {header.points:,} points")
    if not (np.isfinite([header.scale, header.offset]).all() and (header.scale != 0.0).all()):
        numbers = " ".join(f"{value:g}" for value in (*header.scale, *header.offset))
        raise _fail(path, f"its scale and offset are 0 or no numbers: {numbers}")
    if header.compressed:
        yield from _unpacked(path, header, kind, size)
        return
    for first in range(0, header.points, size):
        yield np.fromfile(path, kind, min(size, header.points - first), offset=header.data_offset + first * kind.itemsize)


def _unpacked(path: Path, header: Header, kind: np.dtype, size: int) -> Iterator[np.ndarray | None]:
    if readers.lacks("lazrs"):
        raise native.PatinaError(f"{path.name}: {missing()}", -5)
    if not header.laszip:
        raise _fail(path, "cannot be unpacked: it has no record that says how its points are packed")
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
    if "gps_time" in names and "gps_time" in _record(path, header).names:  # which begins with the earliest, wherever that is
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
