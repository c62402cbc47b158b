# SPDX-License-Identifier: GPL-3.0-or-later
"""Survey drawings: a plane, an extent and a scale, and what follows from them. Lengths are in units of the scene unless they are on paper."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

LINE = 0.25e-3  # meters on paper: a third of it is a pixel
ACCURACY = 0.18e-3  # meters on paper: the error that a scale allows
MOST_PIXELS = 65536  # a side, of the library and of Blender
LEAST_PIXELS = 4  # a side: Blender renders no less
PIXEL_BYTES = 4  # of an image of 8 bits
AIR = 0.02  # around what a new drawing shows, as a share of its longer side
LEVEL = 0.7  # vertical part of a normal from which on a surface is no wall
_TRIPLES, _INLIERS, _ROUNDS = 64, 2.5, 4  # of a robust fit: trials; standard deviations; rounds


class DrawingError(Exception):
    """The text is for the artist."""


@dataclass(frozen=True)
class Frame:
    """A drawing in Blender's coordinates. The viewer looks against right x up; of a ceiling, along it, at what a mirror on the plane shows."""

    origin: np.ndarray  # (3,) float64, the middle of the extent
    right: np.ndarray  # unit
    up: np.ndarray
    width: float
    height: float
    front: float  # how far before the plane it reaches
    back: float
    scale: float  # N of 1:N
    unit: float = 1.0  # meters per unit
    pixel: float = 0.0  # side of a pixel; 0: a third of a line
    thickness: float = 0.0  # of the cut; 0: automatic
    ceiling: bool = False

    @property
    def normal(self) -> np.ndarray:
        """Towards the viewer of a drawing that is not of a ceiling."""
        return np.cross(self.right, self.up)

    @property
    def side(self) -> float:
        """Of a pixel."""
        return self.pixel or self.scale * LINE / 3.0 / self.unit

    def size(self) -> tuple[int, int]:
        """Width and height in pixels, rounded up. DrawingError if there are too many."""
        sides = [max(int(np.ceil(length / self.side - 1e-3)), LEAST_PIXELS) for length in (self.width, self.height)]
        if max(sides) > MOST_PIXELS:
            raise DrawingError(f"an image of {sides[0]:,} x {sides[1]:,} pixels is too large. The most is {MOST_PIXELS:,} a side: use a smaller scale, "
                               "larger pixels, or a smaller extent")
        return sides[0], sides[1]

    def paper(self) -> tuple[float, float]:
        """Width and height on paper, meters."""
        return self.width * self.unit / self.scale, self.height * self.unit / self.scale


def check(frame: Frame, name: str) -> None:
    """DrawingError if nothing can be drawn with these numbers."""
    numbers = (*frame.origin, *frame.right, *frame.up, frame.width, frame.height, frame.front, frame.back, frame.scale, frame.pixel, frame.thickness)
    if not np.isfinite(numbers).all():
        raise DrawingError(f"'{name}': a number of its place or size is not finite. Clear its location, rotation and scale")
    if not frame.scale > 0.0:
        raise DrawingError(f"'{name}': the scale is 1:{frame.scale:g}. Set N of 1:N above 0, as 50 for 1:50")
    if not (frame.width > 0.0 and frame.height > 0.0):
        raise DrawingError(f"'{name}': the extent is {frame.width:g} x {frame.height:g}. Set its width and height above 0")
    if not frame.front + frame.back > 0.0:
        raise DrawingError(f"'{name}': its depth is 0. Set how far it reaches in front of the plane, or behind it")


def facts(frame: Frame, spacing: float, sigma: float) -> list[tuple[str, str]]:
    """Names and texts of what the drawing is, and of what the points support. spacing, sigma: of the points, units; 0: not known."""
    width, height = frame.paper()
    needed, allowed = frame.side * frame.unit, ACCURACY * frame.scale
    rows = [("Paper", f"{1e3 * width:,.0f} x {1e3 * height:,.0f} mm"), ("Pixel", f"{1e3 * needed:.2g} mm")]
    try:
        across, along = frame.size()
        rows.append(("Image", f"{across:,} x {along:,} pixels, {across * along * PIXEL_BYTES / 1e6:,.1f} MB"))
    except DrawingError as error:
        rows.append(("Image", str(error)))
    wanted = f"1:{frame.scale:g} needs a point every {1e3 * frame.scale * LINE / 3.0:.2g} mm"
    rows.append(("Points", f"{wanted}; these have one every {1e3 * spacing * frame.unit:.2g} mm" if spacing else wanted))
    noise = f"; noise is {1e3 * sigma * frame.unit:.2g} mm" if sigma else ""
    return [*rows, ("Accuracy", f"1:{frame.scale:g} allows an error of {1e3 * allowed:.2g} mm{noise}")]


def supported(frame: Frame, spacing: float, sigma: float) -> bool:
    """Whether the points, as far as they are known, are close and exact enough for the scale."""
    return spacing * frame.unit <= frame.scale * LINE / 3.0 and sigma * frame.unit <= ACCURACY * frame.scale


# ---- planes --------------------------------------------------------------------------------------------------------------


def axes_of(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Right and up of a drawing whose viewer looks against this unit normal: upright, or north up if it is level."""
    flat = np.hypot(normal[0], normal[1])
    if flat < 1e-6:
        return np.array((1.0, 0.0, 0.0)), np.array((0.0, np.sign(normal[2]) or 1.0, 0.0))
    right = np.array((-normal[1], normal[0], 0.0)) / flat
    return right, np.cross(normal, right)


def by_points(points: np.ndarray, towards: Callable[[np.ndarray], np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middle, right and up of the plane through three points: one at the left, one at the right, one above them. towards: the direction from
    a place to the viewer. DrawingError if they are on a line."""
    along, aside = points[1] - points[0], points[2] - points[0]
    normal = np.cross(along, aside)
    if not np.linalg.norm(normal) > 1e-6 * np.linalg.norm(along) * np.linalg.norm(aside):
        raise DrawingError("the three points are on a line. Choose a third one beside the line of the others")
    normal /= np.linalg.norm(normal)
    middle = points.mean(axis=0)
    right = along / np.linalg.norm(along)
    if normal @ towards(middle) < 0.0:  # they were chosen from the right to the left
        right, normal = -right, -normal
    return middle, right, np.cross(normal, right)


def by_line(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same of a section through two points, upright; the view is to the left of the line. DrawingError if one is above the other."""
    along = (points[1] - points[0]) * (1.0, 1.0, 0.0)
    length = np.linalg.norm(along)
    if not length > 1e-6 * max(np.abs(points[1] - points[0]).max(), 1e-12):
        raise DrawingError("the two points are above each other. Choose a line across the view from above")
    return points.mean(axis=0), along / length, np.array((0.0, 0.0, 1.0))


def by_wall(points: np.ndarray, vertical: bool, towards: Callable[[np.ndarray], np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same of the plane that fits most of these points of a surface, (n, 3). vertical: the plane is upright. DrawingError if there is none."""
    middle, normal, near = _fit(points)
    if vertical:
        if abs(normal[2]) > LEVEL:
            raise DrawingError("the surface here is nearly level. Choose a place on a wall, or disable Vertical")
        flat = points[near, :2] - middle[:2]
        normal = np.array((*np.linalg.svd(flat, full_matrices=False)[2][1], 0.0))
    normal = -normal if normal @ towards(middle) < 0.0 else normal
    return (middle, *axes_of(normal))


def _fit(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middle, unit normal, and which points are near the plane with the least median distance, refined by least squares."""
    if len(points) < 3:
        raise DrawingError("too few points here show a surface. Choose a place with more points, or move closer")
    random, best = np.random.default_rng(1), (np.inf, points[0], np.array((0.0, 0.0, 1.0)))
    for _ in range(_TRIPLES):
        a, b, c = points[random.choice(len(points), 3, replace=False)]
        normal = np.cross(b - a, c - a)
        length = np.linalg.norm(normal)
        if length > 0.0:
            median = float(np.median(np.abs((points - a) @ (normal / length))))
            best = min(best, (median, a, normal / length), key=lambda each: each[0])
    median, middle, normal = best
    if not np.isfinite(median):
        raise DrawingError("the points here are on a line. Choose a place with more points, or move closer")
    for _ in range(_ROUNDS):
        away = np.abs((points - middle) @ normal)
        near = away <= max(_INLIERS * 1.4826 * np.median(away), 1e-9)
        middle = points[near].mean(axis=0)
        normal = np.linalg.svd(points[near] - middle, full_matrices=False)[2][2]
    return middle, normal, near


def around(corners: np.ndarray, middle: np.ndarray, right: np.ndarray, up: np.ndarray) -> tuple[np.ndarray, float, float, float, float]:
    """A new middle on the plane, width, height, and how far the corners, (n, 3), reach before and behind the plane, with some air."""
    table = (corners - middle) @ np.stack([right, up, np.cross(right, up)], 1)
    low, high = table.min(axis=0), table.max(axis=0)
    sides = high - low
    air = AIR * max(float(sides[:2].max()), 1e-3)
    center = 0.5 * (low + high)
    return middle + center[0] * right + center[1] * up, float(sides[0]) + 2 * air, float(sides[1]) + 2 * air, float(high[2]) + air, float(-low[2]) + air
