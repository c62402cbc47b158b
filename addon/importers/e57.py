# SPDX-License-Identifier: GPL-3.0-or-later
"""E57 (ASTM E2807) through pye57: all scans in one cloud, each point with its scan's number."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

from .. import native
from .reading import Filter, PointFile, Progress, colors_of, origin_of, scanners_of

MISSING = ("E57 files need the Python package pye57: Patina's extension for Blender 4.2 and later brings it; elsewhere "
           "run \"{python}\" -m pip install --user pye57")


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
    file = _open(path)
    parts: list[dict[str, np.ndarray]] = []
    scanners: list[np.ndarray] = []
    done, crs = 0, ""
    try:
        crs = _crs(file)
        for index in range(file.scan_count):
            progress.step(index / max(file.scan_count, 1))
            header = file.get_header(index)
            if header.has_pose():
                scanners.append(header.translation)
            data = file.read_scan(index, intensity=True, colors=True, ignore_missing_fields=True)
            positions = np.stack([data[f"cartesian{axis}"] for axis in "XYZ"], 1)
            keep = wanted.mask(done, positions)
            done += len(positions)
            part = {"positions": positions[keep], "scan": np.full(int(keep.sum()), index, np.float32)}
            if "intensity" in data:
                part["intensity"] = data["intensity"][keep]
            if "colorRed" in data:
                part["rgb"] = np.stack([data[f"color{name}"] for name in ("Red", "Green", "Blue")], 1)[keep]
            parts.append(part)
    except native.PatinaError:
        raise
    except Exception as error:
        raise native.PatinaError(f"{path.name}: scan {len(parts)}: {_first_line(error)}", -4) from None
    finally:
        file.close()
    points = merge(path.stem, parts, {"crs": crs} if crs else {})
    points.notes |= scanners_of(scanners, points.origin)
    return points


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
