# SPDX-License-Identifier: GPL-3.0-or-later
"""What stands before the points of a LAS file: its header, its records, and how a point is laid out."""

from __future__ import annotations

import itertools
import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ... import native
from . import crs
from .reading import regular

_OLD = [("X", "<i4"), ("Y", "<i4"), ("Z", "<i4"), ("intensity", "<u2"), ("bit_fields", "u1"),
        ("raw_classification", "u1"), ("scan_angle_rank", "i1"), ("user_data", "u1"), ("point_source_id", "<u2")]
_NEW = [("X", "<i4"), ("Y", "<i4"), ("Z", "<i4"), ("intensity", "<u2"), ("bit_fields", "u1"),
        ("classification_flags", "u1"), ("classification", "u1"), ("user_data", "u1"), ("scan_angle", "<i2"),
        ("point_source_id", "<u2"), ("gps_time", "<f8")]
_GPS = [("gps_time", "<f8")]
_RGB = [("red", "<u2"), ("green", "<u2"), ("blue", "<u2")]
_NIR = [("nir", "<u2")]
_WAVE = [("wave", "V29")]  # where its waveform lies: not read
POINT_FORMATS = {0: _OLD, 1: _OLD + _GPS, 2: _OLD + _RGB, 3: _OLD + _GPS + _RGB, 4: _OLD + _GPS + _WAVE,
            5: _OLD + _GPS + _RGB + _WAVE, 6: _NEW, 7: _NEW + _RGB, 8: _NEW + _RGB + _NIR, 9: _NEW + _WAVE,
            10: _NEW + _RGB + _NIR + _WAVE}

# data_type of an extra dimension, from 1; 11 to 30 are pairs and triples of the same
_EXTRA_TYPES = ("u1", "i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f4", "<f8")
_NO_DATA, _SCALE, _OFFSET = 1, 8, 16  # bits of its options


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


def fault(path: Path, what: str) -> native.PatinaError:
    return native.PatinaError(f"{path.name}: {what}", -4)


def read_header(path: Path) -> Header:
    with open(regular(path), "rb") as file:
        head = file.read(375)
        if len(head) < 227 or head[:4] != b"LASF":
            raise fault(path, "not a LAS file: its first bytes are not 'LASF'")
        header_size, data_offset, records, form, record_size, count = struct.unpack_from("<HIIBHI", head, 94)
        box = struct.unpack_from("<12d", head, 131)
        end = None
        if head[24:26] >= b"\x01\x04" and len(head) >= 255:
            end = struct.unpack_from("<Q", head, 235)[0] or None
            count = struct.unpack_from("<Q", head, 247)[0] or count
        if header_size < 227 or data_offset < header_size:
            raise fault(path, f"its points begin at byte {data_offset:,}, its header takes {header_size:,} bytes and at least 227")
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


def record_of(path: Path, header: Header) -> np.dtype:
    """Of a point: the fields of its format, then the extra dimensions as "extra 0", ..., as far as the record holds them."""
    fields = POINT_FORMATS.get(header.form)
    if fields is None:
        raise fault(path, f"point format {header.form} is not one of LAS 1.0 to 1.4")
    size = np.dtype(fields).itemsize
    if header.record_size < size:
        raise fault(path, f"records of {header.record_size} bytes cannot hold point format {header.form}")
    more = []
    for index, extra in enumerate(header.extras):
        kind = np.dtype((extra.kind, (extra.count,)))
        if size + kind.itemsize > header.record_size:
            break
        more += [(f"extra {index}", extra.kind, (extra.count,))] * bool(kind.itemsize)
        size += kind.itemsize
    return np.dtype(fields + more + [("more", f"V{header.record_size - size}")] * (header.record_size > size))
