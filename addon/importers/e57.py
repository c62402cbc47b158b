# SPDX-License-Identifier: GPL-3.0-or-later
"""E57 (ASTM E2807) through pye57: all scans in one cloud, each point with its scan's number. What is wrong with one scan is told by its
number; the others are there."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection, Iterator
from pathlib import Path

import numpy as np

from .. import jobs, native, readers, unpacking
from ..unpacking import e57_xml
from . import scans
from .crs import units
from .reading import Filter, Pieces, PointFile, Progress, colors_of, crs_notes, grid_normals, origin_of, regular, scanners_of

PREVIEWED = 1 << 20  # bytes of XML that a preview reads
SMALL_PIECE = 1 << 17  # points that take some 30 ms
LISTED = 5  # scans that a warning names
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


class File:
    """The head of an E57, and the process that unpacks its points, which starts with the first of them. Close it."""

    def __init__(self, path: Path, head: e57_xml.Head) -> None:
        self.path, self.head, self.scans = path, head, head.scans
        self._process: unpacking.Unpacker | None = None
        self._widest = max((len(_fields(scan)) for scan in self.scans), default=1) or 1
        most = max((scan.points for scan in self.scans), default=1)
        self._piece = max(1, min(SMALL_PIECE, most, unpacking.SLOT // (8 * self._widest)))  # points

    def pieces(self, index: int, names: Collection[str]) -> Iterator[tuple[int, list[np.ndarray]] | None]:
        """How many points, and the named fields of theirs, float64; None: nothing yet."""
        if self._process is None:
            self._process = unpacking.Unpacker(self.path, "e57", 8 * self._piece * self._widest, 32 * self.head.xml)
        self._process.tell({"scan": index, "fields": list(names), "piece": self._piece})
        for answer in self._process.answers():
            if answer is None:
                yield None
            elif "slot" in answer:
                count = answer["count"]
                raw = np.frombuffer(self._process.take(answer["slot"], 8 * count * len(names)), np.float64)
                yield count, [raw[at * count:(at + 1) * count] for at in range(len(names))]

    def close(self) -> None:
        if self._process:
            self._process.close()


def _open(path: Path) -> File:
    if readers.lacks("pye57", "pyquaternion"):
        raise native.PatinaError(f"{path.name}: {readers.how_to('E57')}", -5)
    head = _head(path)
    try:
        e57_xml.check(path, head)
    except e57_xml.E57Error as error:
        raise native.PatinaError(f"{path.name}: {error}", -4) from None
    return File(path, head)


def _head(path: Path, most: int | None = None) -> e57_xml.Head:
    try:
        return e57_xml.read(regular(path), most)
    except OSError as error:
        raise native.PatinaError(f"{path.name}: cannot be read: {error.strerror or error}", -3) from None
    except e57_xml.E57Error as error:
        raise native.PatinaError(f"{path.name}: {error}", -4) from None


def _first_line(error: Exception) -> str:
    return next(iter(str(error).strip().splitlines()), type(error).__name__)


def preview(path: Path) -> list[str]:
    head = _head(path, PREVIEWED)
    more = "" if head.whole else "more than "
    return [f"E57, {more}{len(head.scans)} scans", f"{more}{sum(scan.points for scan in head.scans):,} points",
            *(["cannot be read yet: choose Install Readers in the add-on's preferences"] * readers.lacks("pye57", "pyquaternion")),
            *sorted({field.name for scan in head.scans for field in scan.fields})]


def read(path: Path, wanted: Filter, progress: Progress) -> PointFile:
    return jobs.finish(steps(path, wanted, progress))


def steps(path: Path, wanted: Filter, progress: Progress) -> jobs.Steps[PointFile]:
    """The same with a pause after each piece."""
    file = _open(path)
    parts: list[dict[str, np.ndarray]] = []
    stations: list[np.ndarray] = []
    poses: list[Pose] = []
    faults: list[tuple[str, int, str]] = []
    failed: native.PatinaError | None = None
    done, read, index = 0, 0, 0
    try:
        total = max(sum(scan.points for scan in file.scans), 1)
        for index, scan in enumerate(file.scans):
            what = f"{path.name}: scan {index}"
            pose, wrong = _pose(scan)
            stations.append(_station(scan, pose))
            poses.append(pose or Pose())
            if wrong:
                faults.append(("are left out, because their quaternions or places are no poses" if pose is None else
                               "have quaternions of other lengths than 1, which are taken as of length 1", index, wrong))
            if pose is None:
                continue
            if scan.points < 2:
                faults.append(("have one point each", index, " has one point") if scan.points else ("have no points", index, " has no points"))
            first, before = len(parts), read
            if scan.points and not _has_places(scan):
                failed = native.PatinaError(f"{what}: its points have no positions: {', '.join(field.name for field in scan.fields)}", -4)
                faults.append(("have points without positions", index, str(failed).removeprefix(what)))
                continue
            for found in _pieces(file, index, pose):
                progress.step(read / total)
                if found is not None:
                    count, data = found
                    read += count
                    keep = wanted.mask(done, data["positions"])
                    done += len(keep)
                    part = {name: values[keep] for name, values in data.items()}
                    parts.append(part | {"scan": np.full(int(keep.sum()), index, np.float32)})
                yield jobs.Pause()
            if read - before < scan.points:
                faults.append(("hold fewer points than they announce", index, f" announces {scan.points:,} points and holds {read - before:,}"))
            _level_colors(scan, parts[first:])
    except native.PatinaError as error:
        if error.code == native.CANCELLED:
            raise
        raise native.PatinaError(str(error).replace(f"{path.name}: ", f"{path.name}: scan {index}: ", 1), error.code) from None
    except MemoryError:
        raise native.PatinaError(f"{path.name}: scan {index}: not enough memory for its points", -2) from None
    finally:
        file.close()
    if failed and not parts:
        raise failed
    crs = file.head.crs
    points = merge(path.stem, parts, {"crs": crs, **crs_notes(units(crs))} if crs else {})
    points.notes |= scanners_of(stations if np.isfinite(stations).any() else [], points.origin)
    points.notes |= scans.note(_described(file.scans, points, stations, poses, faults))
    points.warnings += joined(path.name, faults)
    if wanted.every == 1:  # a thinned grid is none
        yield from grid_normals(points, stations, progress)
    return points


def joined(name: str, faults: list[tuple[str, int, str]]) -> list[str]:
    """A warning for each kind of fault, however many scans have it. faults: what several scans have in common, the scan's number, and
    what is wrong with this one."""
    found: dict[str, list[tuple[int, str]]] = {}
    for kind, index, text in faults:
        found.setdefault(kind, []).append((index, text))
    told = []
    for kind, those in found.items():
        if len(those) == 1:
            told.append(f"{name}: scan {those[0][0]}{those[0][1]}")
        else:
            numbers = ", ".join(str(index) for index, _ in those[:LISTED]) + ", ..." * (len(those) > LISTED)
            told.append(f"{name}: {len(those):,} scans {kind}: scans {numbers}")
    return told


def _pose(scan: e57_xml.Scan) -> tuple[Pose | None, str]:
    """The turn and the place of a scan, none where it has no pose; or None, where it is none of a pose; and what is wrong, to be said
    behind the scan's number."""
    if not scan.has_pose:
        return Pose(), ""
    values = {axis: scan.rotation.get(axis, math.nan) for axis in "wxyz"} if scan.rotation else {"w": 1.0, "x": 0.0, "y": 0.0, "z": 0.0}
    w, x, y, z = (values[axis] for axis in "wxyz")
    place = np.array([scan.translation.get(axis, math.nan) if scan.translation else 0.0 for axis in "xyz"])
    length = math.sqrt(w * w + x * x + y * y + z * z)
    if not (math.isfinite(length) and length > 1e-6 and np.isfinite(place).all()):
        return None, f" is left out: its quaternion {w:g} {x:g} {y:g} {z:g} or its place is no pose"
    wrong = f": its quaternion is of length {length:g}, and taken as of length 1" if abs(length - 1.0) > 1e-3 else ""
    w, x, y, z = (value / length for value in (w, x, y, z))
    turn = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
    return Pose(turn, place), wrong


def _station(scan: e57_xml.Scan, pose: Pose | None) -> np.ndarray:
    """Where the scanner stood, in the file's coordinates; NaN where that is not said. Without a pose a scan that has ranges
    or a grid was taken from zero; points alone may come from anywhere."""
    local = {_SPHERICAL[0], "rowIndex", "columnIndex"} & _names(scan)
    known = pose is not None and (scan.has_pose or local)
    return pose.place.copy() if known else np.full(3, np.nan)


def _described(headers: list[e57_xml.Scan], points: PointFile, stations: list[np.ndarray], poses: list[Pose],
               faults: list[tuple[str, int, str]]) -> list[scans.Scan]:
    """What is known of each scan; adds what is wrong with their grids to the faults."""
    found = []
    of = points.scalars.get("scan", np.empty(0, np.float32))
    for index, header in enumerate(headers):
        own = slice(*np.searchsorted(of, (index, index + 1)))
        places = points.positions[own].astype(np.float64)
        direction = scans.direction(places, stations[index] - points.origin)
        interval, grid = 0.0, (0, 0)
        if {"rowIndex", "columnIndex"} <= _names(header) and len(places):
            row, column = (points.scalars[axis][own] for axis in ("row", "column"))
            good = (row >= 0) & (column >= 0) & (row < CELLS) & (column < CELLS)
            if not good.all():
                faults.append(("have points in no cell of their grids", index, f": {int((~good).sum()):,} points lie in no cell of its grid"))
            if taken := scans.twice(row[good], column[good]):
                faults.append(("have several points in one cell of their grids", index, f": {taken:,} points lie in cells of its grid that others have"))
            interval = scans.interval(places[good], row[good], column[good])
            grid = (int(column[good].max(initial=-1)) + 1, int(row[good].max(initial=-1)) + 1)
        found.append(scans.Scan(header.name, len(places), direction, interval, poses[index].matrix(), grid))
    return found


def _names(scan: e57_xml.Scan) -> set[str]:
    return {field.name for field in scan.fields}


def _has_places(scan: e57_xml.Scan) -> bool:
    fields = _fields(scan)
    return any(all(name in fields for name in names) for names in (_CARTESIAN, _SPHERICAL))


def _fields(scan: e57_xml.Scan) -> dict[str, e57_xml.Field]:
    """The numbers that the scan's points declare, by local name."""
    return {field.name.rpartition(":")[2]: field for field in scan.fields if field.kind in {"Float", "Integer", "ScaledInteger"}}


def _pieces(file: File, index: int, pose: Pose, places: bool = False) -> Iterator[tuple[int, dict[str, np.ndarray]] | None]:
    """How many points were read, and of the valid ones "positions" in the file's coordinates, "normals" and "rgb" where there
    are such (the latter as the file has them), and all other numbers by name. None: nothing yet. places: positions alone."""
    scan = file.scans[index]
    if not scan.points:
        return
    fields = _fields(scan)
    if places:
        needed = (_CARTESIAN if all(name in fields for name in _CARTESIAN) else _SPHERICAL) + _INVALID
        fields = {name: field for name, field in fields.items() if name in needed}
    for found in file.pieces(index, [field.name for field in fields.values()]):
        if found is None:
            yield None
            continue
        count, values = found
        piece = dict(zip(fields, values, strict=True))
        valid = np.ones(count, bool)
        for name in _INVALID:
            if name in piece:
                valid &= piece.pop(name) == 0
        yield count, _columns({name: values[valid] for name, values in piece.items()}, pose)


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


def _knows_levels(scan: e57_xml.Scan) -> bool:
    """Whether a scan's colours have limits before its points are read, as far as it has any."""
    if not set(_COLORS) <= set(_fields(scan)):
        return True
    limits = [[_limit(scan, name, end) for end in ("Minimum", "Maximum")] for name in _COLORS]
    return bool(np.isfinite(limits).all() and all(high > low for low, high in limits))


def in_pieces(path: Path, least: int, names: Collection[str], progress: Progress) -> jobs.Steps[Pieces | None]:
    from . import e57_pieces
    return (yield from e57_pieces.steps(path, least, names, progress))


def _level_colors(scan: e57_xml.Scan, parts: list[dict[str, np.ndarray]]) -> None:
    """Brings a scan's colours to 0..65535, from the limits that it declares, else from those of its numbers."""
    colored = [part for part in parts if "rgb" in part]
    if not colored:
        return
    for axis, name in enumerate(_COLORS):
        low, high = (_limit(scan, name, end) for end in ("Minimum", "Maximum"))
        if not np.isfinite([low, high]).all() or high <= low:
            most = max((float(part["rgb"][:, axis].max(initial=0.0)) for part in colored), default=0.0)
            low, high = 0.0, 1.0 if most <= 1.0 else 255.0 if most <= 255.0 else 65535.0
        for part in colored:
            part["rgb"][:, axis] = np.rint(np.clip((part["rgb"][:, axis] - low) / (high - low), 0.0, 1.0) * 65535.0)


def _limit(scan: e57_xml.Scan, name: str, end: str) -> float:
    """NaN when neither the scan nor the numbers' own type says it."""
    if f"{name}{end}" in scan.limits:
        return scan.limits[f"{name}{end}"]
    field = _fields(scan)[name]
    value = field.low if end == "Minimum" else field.high
    return value if abs(value) < 1e30 else math.nan


def _cartesian(piece: dict[str, np.ndarray]) -> np.ndarray:
    if _CARTESIAN[0] in piece:
        return np.stack([piece[name] for name in _CARTESIAN], 1)
    away, azimuth, elevation = (piece[name] for name in _SPHERICAL)
    level = away * np.cos(elevation)
    return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), away * np.sin(elevation)], 1)


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
