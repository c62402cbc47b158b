# SPDX-License-Identifier: GPL-3.0-or-later
"""Points → files, with the origin added back in float64. PLY (binary, little endian) and LAS 1.2. Knows no Blender."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from .importers.scans import Scan

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


def write_ply(path: Path, points: Points) -> None:
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


# Scalars that a LAS record has a place for, with what fits.
_LAS_SCALARS = (("intensity", "intensity", 65535), ("class", "raw_classification", 31), ("user_data", "user_data", 255),
                ("point_source_id", "point_source_id", 65535))


def write_las(path: Path, points: Points, gps_time_start: float = 0.0) -> list[str]:
    """LAS 1.2, point format 3, 0.1 mm steps where the box allows. Returns the names of scalars that it has no place
    for."""
    positions = points.positions
    lower, upper = positions.min(axis=0), positions.max(axis=0)
    offset = np.floor(lower)
    scale = np.maximum(1e-4, 2.0 ** np.ceil(np.log2(np.maximum(upper - offset, 1e-9) / 2 ** 31)))
    kind = np.dtype([("X", "<i4"), ("Y", "<i4"), ("Z", "<i4"), ("intensity", "<u2"), ("bit_fields", "u1"),
                     ("raw_classification", "u1"), ("scan_angle_rank", "i1"), ("user_data", "u1"),
                     ("point_source_id", "<u2"), ("gps_time", "<f8"), ("red", "<u2"), ("green", "<u2"), ("blue", "<u2")])
    rows = np.zeros(len(positions), kind)
    for i, axis in enumerate("XYZ"):
        rows[axis] = np.rint((positions[:, i] - offset[i]) / scale[i])
    rows["bit_fields"] = 1 | 1 << 3  # the only return of its pulse
    left = set(points.scalars)
    for name, target, most in _LAS_SCALARS:
        if name in points.scalars:
            left.discard(name)
            rows[target] = np.clip(np.nan_to_num(points.scalars[name]), 0, most)
    if {"return_number", "number_of_returns"} <= left:
        left -= {"return_number", "number_of_returns"}
        numbers = (np.clip(points.scalars[name], 0, 7).astype(np.uint8) for name in ("return_number",
                                                                                      "number_of_returns"))
        first, second = numbers
        rows["bit_fields"] = first | second << 3
    if "gps_time" in left:
        left.discard("gps_time")
        rows["gps_time"] = points.scalars["gps_time"].astype(np.float64) + gps_time_start
    if points.colors is not None:
        for i, name in enumerate(("red", "green", "blue")):
            rows[name] = points.colors[:, i].astype(np.uint16) * 257
    crs = points.crs.encode()[:65534] + b"\0" if points.crs else b""
    with open(path, "wb") as file:
        file.write(_las_header(len(rows), crs, scale, offset, lower, upper))
        rows.tofile(file)
    return sorted(left)


def _las_header(count: int, crs: bytes, scale: Sequence[float], offset: Sequence[float], lower: Sequence[float],
                upper: Sequence[float]) -> bytes:
    record = struct.pack("<H16sHH32s", 0, b"LASF_Projection", 2112, len(crs), b"WKT") + crs if crs else b""
    head = struct.pack("<4sHHIHH8sBB32s32sHHHIIBHI5I", b"LASF", 0, 0, 0, 0, 0, bytes(8), 1, 2, b"Patina", b"Patina", 1,
                       1, 227, 227 + len(record), 1 if crs else 0, 3, 34, count, count, 0, 0, 0, 0)
    box = [value for pair in zip(upper, lower, strict=True) for value in pair]
    return head + struct.pack("<12d", *scale, *offset, *box) + record
