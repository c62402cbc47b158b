# SPDX-License-Identifier: GPL-3.0-or-later
"""Measurements between points: their values in float64, and the lines and labels that show them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

COUNTS = {'DISTANCE': (2, 0), 'HEIGHT': (2, 2), 'ANGLE': (3, 3), 'AREA': (3, 0), 'POINT': (1, 1)}  # least and most points; 0: any number
WORDS = {'DISTANCE': "distance", 'HEIGHT': "height", 'ANGLE': "angle", 'AREA': "area", 'POINT': "point"}
ARC = 0.25  # of the shorter side of an angle: the radius of its arc
_ARC_PARTS = 16


class MeasureError(Exception):
    """The text is for the artist."""


@dataclass(frozen=True)
class Values:
    """Lengths and areas in units of the points, angles in radians."""

    value: float  # of a distance the total, of a height the vertical difference, of an area the planar area, of a point 0
    legs: tuple[float, ...] = ()  # of a distance
    horizontal: float | None = None  # of a height
    perimeter: float | None = None  # of an area


@dataclass(frozen=True)
class Figure:
    """What is drawn of a measurement, in the space of its points."""

    lines: tuple[np.ndarray, ...]  # (n, 3) each
    labels: tuple[tuple[np.ndarray, str], ...]  # place and text
    closed: bool = False  # the first line is a polygon


@dataclass(frozen=True)
class Texts:
    """How values are written."""

    length: Callable[[float], str]
    area: Callable[[float], str]
    angle: Callable[[float], str]


@dataclass(frozen=True)
class Measurement:
    """One that is written to a file."""

    name: str
    kind: str
    cloud: str
    values: Values
    factor: float  # from the scene's unit of length to `unit`
    unit: str  # of length; "": the scene has none
    scene: np.ndarray  # (n, 3) float64, Blender's coordinates
    file: np.ndarray  # (n, 3) float64, coordinates of the file that the cloud came from
    figure: Figure  # in the coordinates that drawings are written in
    insert: int = 0  # the unit of these coordinates, as DXF's $INSUNITS numbers it; 0: not known


def check(kind: str, points: np.ndarray) -> None:
    """MeasureError where these points, (n, 3), cannot be measured so."""
    least, most = COUNTS[kind]
    count = len(points)
    if count < least or most and count > most:
        wanted = f"{least} point{'s' * (least > 1)}" if most else f"at least {least} points"
        raise MeasureError(f"{'An' if kind in {'ANGLE', 'AREA'} else 'A'} {WORDS[kind]} needs {wanted}, not {count}")
    if not np.isfinite(points).all():
        raise MeasureError("A coordinate is not a finite number")
    if kind == 'ANGLE' and min(math.dist(points[1], points[0]), math.dist(points[1], points[2])) == 0.0:
        raise MeasureError("An angle needs three different points: its second point, the corner, is also another one")


def values(kind: str, points: np.ndarray) -> Values:
    """Of points that check() accepts. The area is that of the polygon on the plane that fits its corners best; the perimeter is along its edges
    in space. A polygon that crosses itself counts its parts with opposite signs."""
    if kind == 'DISTANCE':
        legs = tuple(np.linalg.norm(np.diff(points, axis=0), axis=1).tolist())
        return Values(math.fsum(legs), legs)
    if kind == 'HEIGHT':
        across = points[1] - points[0]
        return Values(abs(float(across[2])), horizontal=math.hypot(across[0], across[1]))
    if kind == 'ANGLE':
        one, other = points[0] - points[1], points[2] - points[1]
        return Values(math.atan2(float(np.linalg.norm(np.cross(one, other))), float(one @ other)))
    if kind == 'AREA':
        away = points - points.mean(axis=0)
        normal = np.linalg.svd(away)[2][2]
        doubled = np.cross(away, np.roll(away, -1, axis=0)).sum(axis=0)
        edges = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
        return Values(0.5 * abs(float(doubled @ normal)), perimeter=math.fsum(edges.tolist()))
    return Values(0.0)


def summary(kind: str, found: Values, texts: Texts) -> str:
    """The values of one measurement on a line; of a point nothing."""
    if kind == 'DISTANCE':
        return texts.length(found.value)
    if kind == 'HEIGHT':
        return f"{texts.length(found.value)}, horizontal {texts.length(found.horizontal)}"
    if kind == 'ANGLE':
        return texts.angle(found.value)
    return f"{texts.area(found.value)}, perimeter {texts.length(found.perimeter)}" if kind == 'AREA' else ""


def figure(kind: str, points: np.ndarray, found: Values, texts: Texts, place: str) -> Figure:
    """place: the text of a point's coordinates."""
    if kind == 'HEIGHT':
        low, high = points[np.argsort(points[:, 2], kind="stable")]
        corner = np.array((low[0], low[1], high[2]))
        return Figure((np.stack([low, corner, high]),), ((0.5 * (low + corner), texts.length(found.value)),
                                                         (0.5 * (corner + high), texts.length(found.horizontal))))
    if kind == 'ANGLE':
        arc = _arc(points, found.value)
        return Figure((points, arc), ((arc[len(arc) // 2], texts.angle(found.value)),))
    if kind == 'AREA':
        return Figure((np.concatenate([points, points[:1]]),), ((points.mean(axis=0), summary(kind, found, texts)),), closed=True)
    if kind == 'POINT':
        return Figure((), ((points[0], place),))
    legs = tuple((0.5 * (one + other), texts.length(leg)) for one, other, leg in zip(points, points[1:], found.legs, strict=False))
    return Figure((points,), (*legs, (points[-1], f"Total {texts.length(found.value)}")) if len(legs) > 1 else legs)


def _arc(points: np.ndarray, angle: float) -> np.ndarray:
    """From one side to the other; of a straight angle along any plane."""
    one, other = points[0] - points[1], points[2] - points[1]
    radius = ARC * min(np.linalg.norm(one), np.linalg.norm(other))
    along = one / np.linalg.norm(one)
    across = other - (other @ along) * along
    if np.linalg.norm(across) <= 1e-9 * np.linalg.norm(other):
        across = np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))])
    across = across / np.linalg.norm(across)
    turns = np.linspace(0.0, angle, _ARC_PARTS + 1)[:, None]
    return points[1] + radius * (np.cos(turns) * along + np.sin(turns) * across)
