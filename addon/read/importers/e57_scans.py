# SPDX-License-Identifier: GPL-3.0-or-later
"""The scans of an E57: their poses, their fields, and their points piece by piece."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection, Iterator
from pathlib import Path

import numpy as np

from ... import native
from .. import readers, unpacking
from ..unpacking import e57_xml
from .reading import regular

SMALL_PIECE = 1 << 17  # points that take some 30 ms

_CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
_SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
COLORS = ("colorRed", "colorGreen", "colorBlue")
NORMALS = ("normalX", "normalY", "normalZ")  # of the extension "nor", as are others
_INVALID = ("cartesianInvalidState", "sphericalInvalidState")

# Names of attributes, as the other readers have them; other fields keep theirs, without an extension's prefix.
NAMES = {"rowIndex": "row", "columnIndex": "column", "returnIndex": "return_number", "returnCount": "number_of_returns",
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
        self._widest = max((len(fields_of(scan)) for scan in self.scans), default=1) or 1
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


def open_file(path: Path) -> File:
    if readers.lacks("pye57", "pyquaternion"):
        raise native.PatinaError(f"{path.name}: {readers.how_to('E57')}", -5)
    head = head_of(path)
    try:
        e57_xml.check(path, head)
    except e57_xml.E57Error as error:
        raise native.PatinaError(f"{path.name}: {error}", -4) from None
    return File(path, head)


def head_of(path: Path, most: int | None = None) -> e57_xml.Head:
    try:
        return e57_xml.read(regular(path), most)
    except OSError as error:
        raise native.PatinaError(f"{path.name}: cannot be read: {error.strerror or error}", -3) from None
    except e57_xml.E57Error as error:
        raise native.PatinaError(f"{path.name}: {error}", -4) from None


def pose_of(scan: e57_xml.Scan) -> tuple[Pose | None, str]:
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


def station_of(scan: e57_xml.Scan, pose: Pose | None) -> np.ndarray:
    """Where the scanner stood, in the file's coordinates; NaN where that is not said. Without a pose a scan that has ranges
    or a grid was taken from zero; points alone may come from anywhere."""
    local = {_SPHERICAL[0], "rowIndex", "columnIndex"} & names_of(scan)
    known = pose is not None and (scan.has_pose or local)
    return pose.place.copy() if known else np.full(3, np.nan)


def names_of(scan: e57_xml.Scan) -> set[str]:
    return {field.name for field in scan.fields}


def has_places(scan: e57_xml.Scan) -> bool:
    fields = fields_of(scan)
    return any(all(name in fields for name in names) for names in (_CARTESIAN, _SPHERICAL))


def fields_of(scan: e57_xml.Scan) -> dict[str, e57_xml.Field]:
    """The numbers that the scan's points declare, by local name."""
    return {field.name.rpartition(":")[2]: field for field in scan.fields if field.kind in {"Float", "Integer", "ScaledInteger"}}


def pieces_of(file: File, index: int, pose: Pose, places: bool = False) -> Iterator[tuple[int, dict[str, np.ndarray]] | None]:
    """How many points were read, and of the valid ones "positions" in the file's coordinates, "normals" and "rgb" where there
    are such (the latter as the file has them), and all other numbers by name. None: nothing yet. places: positions alone."""
    scan = file.scans[index]
    if not scan.points:
        return
    fields = fields_of(scan)
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
    for name, parts in (("normals", NORMALS), ("rgb", COLORS)):
        if all(part in piece for part in parts):
            found[name] = np.stack([piece.pop(part) for part in parts], 1).astype(np.float32)
    if pose.turn is not None:
        found["positions"] = found["positions"] @ pose.turn.T + pose.place
        if "normals" in found:
            found["normals"] = found["normals"] @ pose.turn.T.astype(np.float32)
    for name, values in piece.items():
        if name not in {*_CARTESIAN, *_SPHERICAL}:
            found.setdefault(NAMES.get(name, name), values.astype(np.float32))
    return found


def knows_levels(scan: e57_xml.Scan) -> bool:
    """Whether a scan's colours have limits before its points are read, as far as it has any."""
    if not set(COLORS) <= set(fields_of(scan)):
        return True
    limits = [[_limit(scan, name, end) for end in ("Minimum", "Maximum")] for name in COLORS]
    return bool(np.isfinite(limits).all() and all(high > low for low, high in limits))


def level_colors(scan: e57_xml.Scan, parts: list[dict[str, np.ndarray]]) -> None:
    """Brings a scan's colours to 0..65535, from the limits that it declares, else from those of its numbers."""
    colored = [part for part in parts if "rgb" in part]
    if not colored:
        return
    for axis, name in enumerate(COLORS):
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
    field = fields_of(scan)[name]
    value = field.low if end == "Minimum" else field.high
    return value if abs(value) < 1e30 else math.nan


def _cartesian(piece: dict[str, np.ndarray]) -> np.ndarray:
    if _CARTESIAN[0] in piece:
        return np.stack([piece[name] for name in _CARTESIAN], 1)
    away, azimuth, elevation = (piece[name] for name in _SPHERICAL)
    level = away * np.cos(elevation)
    return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), away * np.sin(elevation)], 1)
