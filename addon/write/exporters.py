# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes points to files, with the origin added back in float64: PLY (binary, little endian), LAS 1.2, LAZ, COPC and E57. Does not import
bpy.

LAZ needs the packages laspy and lazrs, COPC needs lazrs, E57 needs pye57 (readers.py installs them).
"""

from __future__ import annotations

import math
import os
import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from .. import whole
from ..read import readers
from ..read.importers.scans import Scan
from . import copc

# The packages that each format needs, by the extension of its files.
NEEDS = {"ply": (), "las": (), "laz": ("laspy", "lazrs"), "copc.laz": ("lazrs",), "e57": ("pye57", "pyquaternion")}
_LAZ_PIECE = 1_000_000  # points that are compressed at a time: 34 MB of records


class ExportError(Exception):
    """The text is for the artist: what cannot be written, and what to do."""


def extension_of(path: Path) -> str:
    """The format that a file name stands for, "" if it has no extension. ExportError if the extension is not one of NEEDS."""
    extension = "copc.laz" if path.name.lower().endswith(".copc.laz") else path.suffix.lower()[1:]
    if extension and extension not in NEEDS:
        raise ExportError(f"'{path.name}': points cannot be written as .{extension}. Use {', '.join('.' + name for name in NEEDS)}")
    return extension


def write(path: Path, points: Points, gps_time_start: float = 0.0) -> list[str]:
    """Writes the format that the file name stands for. Returns the names of columns that the format has no place for.

    The file appears once it is complete: a file of this name stays as it is if writing fails. Raises ExportError if a package is
    missing, OSError if the file cannot be written. gps_time_start is added to the scalar gps_time of LAS and LAZ, in seconds."""
    extension = extension_of(path)
    missing = [name for name in NEEDS[extension] if readers.lacks(name)]
    if missing:
        raise ExportError(f"'{path.name}': {extension.partition('.')[0].upper()} needs the Python package {' and '.join(missing)}. "
                          "Use Install Readers in the add-on's preferences")
    with whole.Folder(".patina-export-", path.parent) as folder:
        part = folder / f"points.{extension}"
        try:
            left = _WRITERS[extension](part, points, gps_time_start)
        except (ExportError, OSError, MemoryError):
            raise
        except Exception as error:  # of libE57 and lazrs, each has its own kind: a full disk for example
            raise ExportError(f"'{path.name}' cannot be written: {str(error).strip().partition(chr(10))[0]}") from None
        os.replace(part, path)
    return left

_PLY_TYPES = {"f4": "float", "f8": "double", "u1": "uchar"}


@dataclass(frozen=True)
class Points:
    """Columns of one or more clouds."""

    positions: np.ndarray  # (n, 3) float64, the origin included
    normals: np.ndarray | None  # (n, 3) float32
    colors: np.ndarray | None  # (n, 3) uint8 sRGB
    scalars: dict[str, np.ndarray]  # (n,) float32
    crs: str = ""
    scans: Sequence[Scan] = ()  # the scalar "scan" says which of them each point is of; directions and poses in the positions' coordinates
    stations: np.ndarray | None = None  # (scans, 3) float64, in these too; NaN: not known


def only(points: Points, keep: np.ndarray) -> Points:
    """keep: (n,) bool."""
    normals, colors = (None if column is None else column[keep] for column in (points.normals, points.colors))
    return replace(points, positions=points.positions[keep], normals=normals, colors=colors,
                   scalars={name: values[keep] for name, values in points.scalars.items()})


def _scan_lines(points: Points) -> list[str]:
    """For the header, as the library's reader has them: ply_scans.c."""
    lines = []
    for index, scan in enumerate(points.scans):
        station = points.stations[index] if points.stations is not None and index < len(points.stations) else (math.nan,) * 3
        there = all(map(math.isfinite, station))
        numbers = (*(station if there else (0.0,) * 3), *scan.pose)
        name = " ".join(scan.name.split()).encode("utf-8", "replace").decode("utf-8")
        lines.append(" ".join(["obj_info patina_scan", *map(str, scan.grid), *(repr(float(value)) for value in (scan.interval, *scan.direction)),
                               "at" if there else "nowhere", *(repr(float(value)) for value in numbers), name]).rstrip())
    return lines


def _by_scan(points: Points) -> Points:
    """Points of each scan behind each other, in their order."""
    of = points.scalars.get("scan")
    if not points.scans or of is None or (np.diff(of) >= 0).all():
        return points
    order = np.argsort(of, kind="stable")
    return replace(points, positions=points.positions[order], normals=None if points.normals is None else points.normals[order],
                   colors=None if points.colors is None else points.colors[order],
                   scalars={name: values[order] for name, values in points.scalars.items()})


def write_ply(path: Path, points: Points) -> list[str]:
    """Positions as float64, normals and scalars as float32. Every column has a place."""
    points = _by_scan(points)
    columns = [(axis, "f8", points.positions[:, i]) for i, axis in enumerate("xyz")]
    if points.normals is not None:
        columns += [(f"n{axis}", "f4", points.normals[:, i]) for i, axis in enumerate("xyz")]
    if points.colors is not None:
        columns += [(name, "u1", points.colors[:, i]) for i, name in enumerate(("red", "green", "blue"))]
    columns += [(name.replace(" ", "_"), "f4", values) for name, values in points.scalars.items()]
    rows = np.zeros(len(points.positions), np.dtype([(name, f"<{kind}") for name, kind, _ in columns]))
    for name, _, values in columns:
        rows[name] = values
    header = ["ply", "format binary_little_endian 1.0", *_scan_lines(points), f"element vertex {len(rows)}"]
    header += [f"property {_PLY_TYPES[kind]} {name}" for name, kind, _ in columns]
    with open(path, "wb") as file:
        file.write("\n".join([*header, "end_header", ""]).encode())
        rows.tofile(file)
    return []


# Scalars that a LAS record has a place for, with what fits.
_LAS_SCALARS = (("intensity", "intensity", 65535), ("class", "raw_classification", 255), ("user_data", "user_data", 255),
                ("point_source_id", "point_source_id", 65535))
_LAS_3 = np.dtype([("X", "<i4"), ("Y", "<i4"), ("Z", "<i4"), ("intensity", "<u2"), ("bit_fields", "u1"),
                   ("raw_classification", "u1"), ("scan_angle_rank", "i1"), ("user_data", "u1"),
                   ("point_source_id", "<u2"), ("gps_time", "<f8"), ("red", "<u2"), ("green", "<u2"), ("blue", "<u2")])


def _las_rows(points: Points, kind: np.dtype, gps_time_start: float) -> tuple[np.ndarray, float, np.ndarray, list[str]]:
    """Records, the step and offset (3,) of their coordinates, and the names of scalars that they have no place for. Steps are 0.1 mm
    where the box allows. kind: _LAS_3, or one of copc.py, which holds more classes and returns."""
    positions, first = points.positions, kind == _LAS_3
    offset = np.floor(positions.min(axis=0))
    scale = max(1e-4, 2.0 ** math.ceil(math.log2(max(float((positions.max(axis=0) - offset).max()), 1e-9) / (2 ** 31 - 1))))
    rows = np.zeros(len(positions), kind)
    for i, axis in enumerate("XYZ"):
        rows[axis] = np.rint((positions[:, i] - offset[i]) / scale)
    bits, most_returns = (3, 7) if first else (4, 15)
    rows["bit_fields"] = 1 | 1 << bits  # the only return of its pulse
    left = set(points.scalars)
    for name, target, most in _LAS_SCALARS:
        if name in points.scalars:
            left.discard(name)
            rows[target] = np.clip(np.nan_to_num(points.scalars[name]), 0, 31 if first and name == "class" else most)
    returns = ("return_number", "number_of_returns")
    if left.issuperset(returns):
        left.difference_update(returns)
        number, total = (np.clip(np.nan_to_num(points.scalars[name]), 0, most_returns).astype(np.uint8) for name in returns)
        rows["bit_fields"] = number | total << bits
    if "gps_time" in left:
        left.discard("gps_time")
        rows["gps_time"] = points.scalars["gps_time"].astype(np.float64) + gps_time_start
    if points.colors is not None:
        for i, name in enumerate(("red", "green", "blue")):
            rows[name] = points.colors[:, i].astype(np.uint16) * 257
    return rows, scale, offset, sorted(left)


def _crs(points: Points) -> bytes:
    return points.crs.encode()[:65534] + b"\0" if points.crs else b""


def write_las(path: Path, points: Points, gps_time_start: float = 0.0) -> list[str]:
    """LAS 1.2, point format 3. Returns the names of scalars that it has no place for."""
    rows, scale, offset, left = _las_rows(points, _LAS_3, gps_time_start)
    lower, upper = points.positions.min(axis=0), points.positions.max(axis=0)
    with open(path, "wb") as file:
        file.write(_las_header(len(rows), _crs(points), (scale,) * 3, offset, lower, upper))
        rows.tofile(file)
    return left


def write_laz(path: Path, points: Points, gps_time_start: float = 0.0) -> list[str]:
    """The records of write_las, compressed. Takes the room of the LAS file beside it meanwhile."""
    readers.load("laspy", "lazrs")
    import laspy
    plain = path.with_suffix(".las")
    left = write_las(plain, points, gps_time_start)
    with laspy.open(plain) as source, laspy.open(path, mode="w", header=source.header, do_compress=True,
                                                 laz_backend=laspy.LazBackend.Lazrs) as target:
        for piece in source.chunk_iterator(_LAZ_PIECE):
            target.write_points(piece)
    plain.unlink()
    return left


def write_copc(path: Path, points: Points, gps_time_start: float = 0.0) -> list[str]:
    """LAZ 1.4, point format 6 or 7. Returns the names of scalars that it has no place for."""
    readers.load("lazrs")
    rows, scale, offset, left = _las_rows(points, copc.PLAIN if points.colors is None else copc.COLORED, gps_time_start)
    copc.write(path, rows, scale, offset, _crs(points))
    return left


def write_e57(path: Path, points: Points) -> list[str]:
    """Writes each scan as a scan of the E57 file, or one scan if the points have none. Returns the names of columns that are left out.

    Each scan's coordinates are float32, relative to its station or to the corner of its box: within 1 mm up to 16 km from there."""
    readers.load("pye57")
    import pye57
    points = _by_scan(points)
    of = points.scalars.get("scan") if points.scans else None
    file = pye57.E57(str(path), mode="w")
    try:
        for index in range(len(points.scans) if of is not None else 1):
            rows = np.flatnonzero(of == index) if of is not None else np.arange(len(points.positions))
            if len(rows):
                _write_e57_scan(file, points, rows, index)
    finally:
        file.close()
    left = set(points.scalars) - {"intensity"} - ({"scan"} if of is not None else set())
    return sorted([*left, *(["normals"] if points.normals is not None else [])])


def _write_e57_scan(file: object, points: Points, rows: np.ndarray, index: int) -> None:
    positions = points.positions[rows]
    station = points.stations[index] if points.stations is not None and index < len(points.stations) else (math.nan,) * 3
    center = np.array(station, np.float64) if all(map(math.isfinite, station)) else np.floor(positions.min(axis=0))
    columns = {f"cartesian{axis}": (positions[:, i] - center[i]).astype(np.float32).astype(np.float64) for i, axis in enumerate("XYZ")}
    if points.colors is not None:
        columns |= {f"color{name}": points.colors[rows, i] for i, name in enumerate(("Red", "Green", "Blue"))}
    if "intensity" in points.scalars:
        columns["intensity"] = np.nan_to_num(points.scalars["intensity"][rows])
    name = points.scans[index].name if index < len(points.scans) else ""
    file.write_scan_raw(columns, name=name or f"Scan {index + 1}", rotation=np.array([1.0, 0.0, 0.0, 0.0]), translation=center)


def _las_header(count: int, crs: bytes, scale: Sequence[float], offset: Sequence[float], lower: Sequence[float],
                upper: Sequence[float]) -> bytes:
    record = struct.pack("<H16sHH32s", 0, b"LASF_Projection", 2112, len(crs), b"WKT") + crs if crs else b""
    head = struct.pack("<4sHHIHH8sBB32s32sHHHIIBHI5I", b"LASF", 0, 0, 0, 0, 0, bytes(8), 1, 2, b"Patina", b"Patina", 1,
                       1, 227, 227 + len(record), 1 if crs else 0, 3, 34, count, count, 0, 0, 0, 0)
    box = [value for pair in zip(upper, lower, strict=True) for value in pair]
    return head + struct.pack("<12d", *scale, *offset, *box) + record


_WRITERS = {"ply": lambda path, points, _start: write_ply(path, points), "las": write_las, "laz": write_laz, "copc.laz": write_copc,
            "e57": lambda path, points, _start: write_e57(path, points)}
