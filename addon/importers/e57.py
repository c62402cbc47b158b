# SPDX-License-Identifier: GPL-3.0-or-later
"""E57 (ASTM E2807) through pye57: all scans in one cloud, each point with its scan's number."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from .. import jobs, native
from .reading import Filter, PointFile, Progress, colors_of, origin_of, scanners_of

MISSING = ("E57 files need the Python package pye57: Patina's extension for Blender 4.2 and later brings it; elsewhere "
           "run \"{python}\" -m pip install --user pye57")


SMALL_PIECE = 1 << 17  # points that take some 30 ms

_CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
_SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
_INVALID = ("cartesianInvalidState", "sphericalInvalidState")
_COLORS = ("colorRed", "colorGreen", "colorBlue")
_FIELDS = (*_CARTESIAN, *_SPHERICAL, *_INVALID, "intensity", *_COLORS)


def _open(path: Path) -> Any:
    try:
        import pye57
    except ImportError:
        raise native.PatinaError(MISSING.format(python=sys.executable), -5) from None
    try:
        return pye57.E57(str(path))
    except Exception as error:  # libE57 throws its own kinds
        raise native.PatinaError(f"{path.name}: cannot be read: {_first_line(error)}", -4) from None


def _first_line(error: Exception) -> str:
    return next(iter(str(error).strip().splitlines()), type(error).__name__)


def preview(path: Path) -> list[str]:
    file = _open(path)
    try:
        headers = [file.get_header(index) for index in range(file.scan_count)]
        return [f"E57, {len(headers)} scans", f"{sum(header.point_count for header in headers):,} points",
                *sorted({field for header in headers for field in header.point_fields})]
    finally:
        file.close()


def read(path: Path, wanted: Filter, progress: Progress) -> PointFile:
    return jobs.finish(steps(path, wanted, progress))


def steps(path: Path, wanted: Filter, progress: Progress) -> jobs.Steps[PointFile]:
    """The same with a pause after each piece."""
    file = _open(path)
    parts: list[dict[str, np.ndarray]] = []
    scanners: list[np.ndarray] = []
    done, read, index, crs = 0, 0, 0, ""
    try:
        crs = _crs(file)
        headers = [file.get_header(index) for index in range(file.scan_count)]
        total = max(sum(header.point_count for header in headers), 1)
        for index, header in enumerate(headers):
            if header.has_pose():
                scanners.append(header.translation)
            for count, data in _pieces(file, header):
                progress.step(read / total)
                read += count
                keep = wanted.mask(done, data["positions"])
                done += len(keep)
                part = {name: values[keep] for name, values in data.items()}
                parts.append(part | {"scan": np.full(int(keep.sum()), index, np.float32)})
                yield jobs.Pause()
    except native.PatinaError:
        raise
    except Exception as error:
        raise native.PatinaError(f"{path.name}: scan {index}: {_first_line(error)}", -4) from None
    finally:
        file.close()
    points = merge(path.stem, parts, {"crs": crs} if crs else {})
    points.notes |= scanners_of(scanners, points.origin)
    return points


def _pieces(file: Any, header: Any) -> Iterator[tuple[int, dict[str, np.ndarray]]]:
    """How many points were read, and of the valid ones "positions" in the file's coordinates, "intensity" and "rgb" where
    there are such."""
    data, buffers = file.make_buffers([name for name in _FIELDS if name in header.point_fields],
                                      max(min(SMALL_PIECE, header.point_count), 1))
    reader = header.points.reader(buffers)
    try:
        while count := reader.read():
            piece = {name: values[:count] for name, values in data.items()}
            valid = np.ones(count, bool)
            for name in _INVALID:
                if name in piece:
                    valid &= piece[name] == 0
            piece = {name: values[valid] for name, values in piece.items()}
            positions = _cartesian(piece)
            if header.has_pose():
                positions = file.to_global(positions, header.rotation, header.translation)
            found = {"positions": positions}
            if "intensity" in piece:
                found["intensity"] = piece["intensity"]
            if all(name in piece for name in _COLORS):
                found["rgb"] = np.stack([piece[name] for name in _COLORS], 1)
            yield count, found
    finally:
        reader.close()


def _cartesian(piece: dict[str, np.ndarray]) -> np.ndarray:
    if _CARTESIAN[0] in piece:
        return np.stack([piece[name] for name in _CARTESIAN], 1)
    away, azimuth, elevation = (piece[name] for name in _SPHERICAL)
    level = away * np.cos(elevation)
    return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), away * np.sin(elevation)], 1)


def _crs(file: Any) -> str:
    try:
        return str(file.root["coordinateMetadata"].value())
    except Exception:  # the element is optional
        return ""


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
