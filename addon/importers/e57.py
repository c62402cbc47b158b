# SPDX-License-Identifier: GPL-3.0-or-later
"""E57 (ASTM E2807) through pye57: all scans in one cloud, each point with its scan's number. What is wrong with one scan is told by its
number; the others are there."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from .. import jobs, native, readers
from . import scans
from .crs import units
from .reading import Filter, Pieces, PointFile, Progress, colors_of, crs_notes, grid_normals, origin_of, scanners_of

SMALL_PIECE = 1 << 17  # points that take some 30 ms
CELLS = 1 << 24  # a grid's rows or columns: more are no whole numbers in float32

_CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
_SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
_COLORS = ("colorRed", "colorGreen", "colorBlue")
_NORMALS = ("normalX", "normalY", "normalZ")  # of the extension "nor", as are others
_INVALID = ("cartesianInvalidState", "sphericalInvalidState")

# Names of attributes, as the other readers have them; other fields keep theirs, without an extension's prefix.
_NAMES = {"rowIndex": "row", "columnIndex": "column", "returnIndex": "return_number", "returnCount": "number_of_returns",
          "classification": "class", "Classification": "class", "pointSourceId": "point_source_id"}


@dataclasses.dataclass(frozen=True)
class Pose:
    turn: np.ndarray | None = None  # (3, 3); None: none
    place: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(3))

    def matrix(self) -> tuple[float, ...]:
        """Three rows of four."""
        turn = np.eye(3) if self.turn is None else self.turn
        return tuple(np.column_stack([turn, self.place]).ravel().tolist())


def _open(path: Path) -> Any:
    if readers.lacks("pye57"):
        raise native.PatinaError(f"{path.name}: {readers.how_to('E57')}", -5)
    try:
        readers.load("pye57")
        import pye57
    except ImportError:
        raise native.PatinaError(f"{path.name}: {readers.how_to('E57')}", -5) from None
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
    stations: list[np.ndarray] = []
    poses: list[Pose] = []
    warnings: list[str] = []
    failed: native.PatinaError | None = None
    done, read, index, crs = 0, 0, 0, ""
    try:
        crs = _crs(file)
        headers = [file.get_header(index) for index in range(file.scan_count)]
        total = max(sum(header.point_count for header in headers), 1)
        for index, header in enumerate(headers):
            what = f"{path.name}: scan {index}"
            pose, wrong = _pose(header)
            stations.append(_station(header, pose))
            poses.append(pose or Pose())
            if wrong:
                warnings.append(f"{what}{wrong}")
            if pose is None:
                continue
            if header.point_count < 2:
                warnings.append(f"{what} has {'one point' if header.point_count else 'no points'}")
            first = len(parts)
            if header.point_count and not _has_places(header):
                failed = native.PatinaError(f"{what}: its points have no positions: {', '.join(header.point_fields)}", -4)
                warnings.append(str(failed))
                continue
            for count, data in _pieces(file, header, pose):
                progress.step(read / total)
                read += count
                keep = wanted.mask(done, data["positions"])
                done += len(keep)
                part = {name: values[keep] for name, values in data.items()}
                parts.append(part | {"scan": np.full(int(keep.sum()), index, np.float32)})
                yield jobs.Pause()
            _level_colors(header, parts[first:])
    except native.PatinaError:
        raise
    except Exception as error:
        raise native.PatinaError(f"{path.name}: scan {index}: {_first_line(error)}", -4) from None
    finally:
        file.close()
    if failed and not parts:
        raise failed
    points = merge(path.stem, parts, {"crs": crs, **crs_notes(units(crs))} if crs else {})
    points.warnings += warnings
    points.notes |= scanners_of(stations if np.isfinite(stations).any() else [], points.origin)
    points.notes |= scans.note(_described(headers, points, stations, poses, path.name))
    if wanted.every == 1:  # a thinned grid is none
        yield from grid_normals(points, stations, progress)
    return points


def _pose(header: Any) -> tuple[Pose | None, str]:
    """The turn and the place of a scan, none where it has no pose; or None, where it is none of a pose; and what is wrong, to be said
    behind the scan's number."""
    if not header.has_pose():
        return Pose(), ""
    pose, values = header.node["pose"], {"w": 1.0, "x": 0.0, "y": 0.0, "z": 0.0}
    if pose.isDefined("rotation"):
        values = {axis: float(pose["rotation"][axis].value()) for axis in "wxyz"}
    w, x, y, z = (values[axis] for axis in "wxyz")
    place = np.array([float(pose["translation"][axis].value()) for axis in "xyz"] if pose.isDefined("translation") else [0.0] * 3)
    length = math.sqrt(w * w + x * x + y * y + z * z)
    if not (math.isfinite(length) and length > 1e-6 and np.isfinite(place).all()):
        return None, f" is left out: its quaternion {w:g} {x:g} {y:g} {z:g} or its place is no pose"
    wrong = f": its quaternion is of length {length:g}, and taken as of length 1" if abs(length - 1.0) > 1e-3 else ""
    w, x, y, z = (value / length for value in (w, x, y, z))
    turn = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
    return Pose(turn, place), wrong


def _station(header: Any, pose: Pose | None) -> np.ndarray:
    """Where the scanner stood, in the file's coordinates; NaN where that is not said. Without a pose a scan that has ranges
    or a grid was taken from zero; points alone may come from anywhere."""
    local = {_SPHERICAL[0], "rowIndex", "columnIndex"} & set(header.point_fields)
    known = pose is not None and (header.has_pose() or local)
    return pose.place.copy() if known else np.full(3, np.nan)


def _described(headers: list[Any], points: PointFile, stations: list[np.ndarray], poses: list[Pose], name: str) -> list[scans.Scan]:
    """What is known of each scan; says at the points what is wrong with their grids."""
    found = []
    of = points.scalars.get("scan", np.empty(0, np.float32))
    for index, header in enumerate(headers):
        own = np.flatnonzero(of == index)
        own = slice(own[0], own[-1] + 1) if len(own) else slice(0)
        places = points.positions[own].astype(np.float64)
        direction = scans.direction(places, stations[index] - points.origin)
        interval, grid = 0.0, (0, 0)
        if {"rowIndex", "columnIndex"} <= set(header.point_fields) and len(places):
            row, column = (points.scalars[axis][own] for axis in ("row", "column"))
            good = (row >= 0) & (column >= 0) & (row < CELLS) & (column < CELLS)
            if not good.all():
                points.warnings.append(f"{name}: scan {index}: {int((~good).sum()):,} points lie in no cell of its grid")
            if taken := scans.twice(row[good], column[good]):
                points.warnings.append(f"{name}: scan {index}: {taken:,} points lie in cells of its grid that others have")
            interval = scans.interval(places[good], row[good], column[good])
            grid = (int(column[good].max(initial=-1)) + 1, int(row[good].max(initial=-1)) + 1)
        found.append(scans.Scan(_name(header), len(places), direction, interval, poses[index].matrix(), grid))
    return found


def _name(header: Any) -> str:
    try:
        return str(header.node["name"].value())
    except Exception:  # the element is optional
        return ""


def _has_places(header: Any) -> bool:
    fields = _fields(header)
    return any(all(name in fields for name in names) for names in (_CARTESIAN, _SPHERICAL))


def _fields(header: Any) -> dict[str, str]:
    """The numbers that the scan's points declare: local name → name in the file."""
    from pye57 import libe57
    prototype = libe57.StructureNode(header.points.prototype())
    numbers = (libe57.IntegerNode, libe57.ScaledIntegerNode, libe57.FloatNode)
    return {name.rpartition(":")[2]: name for name in header.point_fields if isinstance(prototype[name], numbers)}


def _pieces(file: Any, header: Any, pose: Pose, places: bool = False) -> Iterator[tuple[int, dict[str, np.ndarray]]]:
    """How many points were read, and of the valid ones "positions" in the file's coordinates, "normals" and "rgb" where there
    are such (the latter as the file has them), and all other numbers by name. pye57's own way knows a few fields of certain
    types; float64 holds what any file declares. places: positions alone."""
    from pye57 import libe57
    if not header.point_count:
        return
    fields, size = _fields(header), min(SMALL_PIECE, header.point_count)
    if places:
        needed = (_CARTESIAN if all(name in fields for name in _CARTESIAN) else _SPHERICAL) + _INVALID
        fields = {name: field for name, field in fields.items() if name in needed}
    data = {name: np.empty(size, np.float64) for name in fields}
    buffers = libe57.VectorSourceDestBuffer()
    for name, field in fields.items():
        buffers.append(libe57.SourceDestBuffer(file.image_file, field, data[name], size, True, True))
    reader = header.points.reader(buffers)
    try:
        while count := reader.read():
            piece = {name: values[:count] for name, values in data.items()}
            valid = np.ones(count, bool)
            for name in _INVALID:
                if name in piece:
                    valid &= piece.pop(name) == 0
            yield count, _columns({name: values[valid] for name, values in piece.items()}, pose)
    finally:
        reader.close()


def _columns(piece: dict[str, np.ndarray], pose: Pose) -> dict[str, np.ndarray]:
    found = {"positions": _cartesian(piece)}
    for name, parts in (("normals", _NORMALS), ("rgb", _COLORS)):
        if all(part in piece for part in parts):
            found[name] = np.stack([piece.pop(part) for part in parts], 1).astype(np.float32)
    if pose.turn is not None:
        found["positions"] = found["positions"] @ pose.turn.T + pose.place
        if "normals" in found:
            found["normals"] = found["normals"] @ pose.turn.T.astype(np.float32)
    for name, values in piece.items():
        if name not in {*_CARTESIAN, *_SPHERICAL}:
            found.setdefault(_NAMES.get(name, name), values.astype(np.float32))
    return found


def _knows_levels(header: Any) -> bool:
    """Whether a scan's colours have limits before its points are read, as far as it has any."""
    from pye57 import libe57
    if not set(_COLORS) <= set(_fields(header)):
        return True
    prototype = libe57.StructureNode(header.points.prototype())
    limits = [[_limit(header, prototype, name, end) for end in ("Minimum", "Maximum")] for name in _COLORS]
    return bool(np.isfinite(limits).all() and all(high > low for low, high in limits))


def in_pieces(path: Path, least: int, names: Collection[str], progress: Progress) -> jobs.Steps[Pieces | None]:
    from . import e57_pieces
    return (yield from e57_pieces.steps(path, least, names, progress))


def _level_colors(header: Any, parts: list[dict[str, np.ndarray]]) -> None:
    """Brings a scan's colours to 0..65535, from the limits that it declares, else from those of its numbers."""
    from pye57 import libe57
    colored = [part for part in parts if "rgb" in part]
    if not colored:
        return
    prototype = libe57.StructureNode(header.points.prototype())
    for axis, name in enumerate(_COLORS):
        low, high = (_limit(header, prototype, name, end) for end in ("Minimum", "Maximum"))
        if not np.isfinite([low, high]).all() or high <= low:
            most = max((float(part["rgb"][:, axis].max(initial=0.0)) for part in colored), default=0.0)
            low, high = 0.0, 1.0 if most <= 1.0 else 255.0 if most <= 255.0 else 65535.0
        for part in colored:
            part["rgb"][:, axis] = np.rint(np.clip((part["rgb"][:, axis] - low) / (high - low), 0.0, 1.0) * 65535.0)


def _limit(header: Any, prototype: Any, name: str, end: str) -> float:
    """NaN when neither the scan nor the numbers' own type says it."""
    if header.node.isDefined(f"colorLimits/{name}{end}"):
        return float(header.node["colorLimits"][f"{name}{end}"].value())
    value = float(getattr(prototype[name], end.lower())())
    return value if abs(value) < 1e30 else np.nan


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
