# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces whose every crossing with a ray is known, and which give random points, uniform in area, of themselves."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from . import roots


def rotation(axis: str, degrees: float) -> np.ndarray:
    """4x4 rotation around x, y or z."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    matrix = np.eye(4)
    matrix[i, i], matrix[i, j], matrix[j, i], matrix[j, j] = c, -s, s, c
    return matrix


def translation(x: float, y: float, z: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


@dataclass(frozen=True, eq=False)
class Surface:
    """Placed by a rigid matrix, world from object. A subclass knows its own object space: _roots, _normal, _sample,
    area and radius (of a ball around its origin that holds it)."""

    opacity: float = field(default=1.0, kw_only=True)
    place: np.ndarray = field(default_factory=lambda: np.eye(4), kw_only=True)

    def placed(self, *matrices: np.ndarray) -> Surface:
        """A copy, moved by the matrices, the last one first."""
        place = self.place
        for matrix in reversed(matrices):
            place = matrix @ place
        return replace(self, place=place)

    def crossings(self, origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """Every t at which the lines origin + t direction, both (n, 3), meet the surface: (n, most), NaN-padded."""
        o = (origin - self.place[:3, 3]) @ self.place[:3, :3]
        d = direction @ self.place[:3, :3]
        dd = np.einsum("ij,ij->i", d, d)
        nearest = -np.einsum("ij,ij->i", o, d) / dd  # t is counted from there: better conditioned far from the eye
        o = o + nearest[:, None] * d
        room = self.radius**2 - np.einsum("ij,ij->i", o, o)
        near = np.flatnonzero(room > 0.0)
        if not len(near):
            return np.full((len(o), 1), np.nan)
        t = self._roots(o[near], d[near], np.sqrt(room[near] / dd[near]))
        result = np.full((len(o), t.shape[1]), np.nan)
        result[near] = t + nearest[near, None]
        return result

    def normal(self, point: np.ndarray) -> np.ndarray:
        """Unit normal, outward or up, at points (n, 3) of the surface."""
        return self._normal((point - self.place[:3, 3]) @ self.place[:3, :3]) @ self.place[:3, :3].T

    def sample(self, count: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Positions and normals of random points, uniform in area."""
        position, normal = self._sample(count, random)
        turn = self.place[:3, :3].T
        return position @ turn + self.place[:3, 3], normal @ turn

    def _sample(self, count: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Crossings with uniform random lines are uniform in area (Cauchy, Crofton)."""
        found = np.empty((0, 3))
        while len(found) < count:
            lines = max(int(1.2 * (count - len(found)) * 2.0 * np.pi * self.radius**2 / self.area), 64)
            point, _ = self._crofton(lines, random)
            found = np.concatenate([found, random.permutation(point)])
        found = found[:count]
        return found, self._normal(found)

    def _crofton(self, lines: int, random: np.random.Generator) -> tuple[np.ndarray, float]:
        """Crossings with uniform random lines through the ball, and the area that their number tells."""
        direction = random.normal(size=(lines, 3))
        direction /= np.linalg.norm(direction, axis=1)[:, None]
        origin = random.normal(size=(lines, 3))
        origin -= np.einsum("ij,ij->i", origin, direction)[:, None] * direction
        origin *= (self.radius * np.sqrt(random.random(lines)) / np.linalg.norm(origin, axis=1))[:, None]
        half = np.sqrt(np.maximum(self.radius**2 - np.einsum("ij,ij->i", origin, origin), 0.0))
        t = self._roots(origin, direction, half)
        row, column = np.nonzero(~np.isnan(t))
        return (origin[row] + t[row, column][:, None] * direction[row],
                2.0 * np.pi * self.radius**2 * len(row) / lines)


@dataclass(frozen=True, eq=False)
class Sphere(Surface):
    radius: float = 1.0

    @property
    def area(self) -> float:
        return 4.0 * np.pi * self.radius**2

    def _roots(self, o: np.ndarray, d: np.ndarray, half: np.ndarray) -> np.ndarray:
        return np.stack([-half, half], axis=1)

    def _normal(self, p: np.ndarray) -> np.ndarray:
        return p / self.radius

    def _sample(self, count: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        normal = random.normal(size=(count, 3))
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        return self.radius * normal, normal


@dataclass(frozen=True, eq=False)
class Torus(Surface):
    """Around z."""

    ring: float = 1.0
    tube: float = 0.4

    @property
    def area(self) -> float:
        return 4.0 * np.pi**2 * self.ring * self.tube

    @property
    def radius(self) -> float:
        return self.ring + self.tube

    def _roots(self, o: np.ndarray, d: np.ndarray, half: np.ndarray) -> np.ndarray:
        # (|p|^2 + R^2 - r^2)^2 = 4 R^2 (x^2 + y^2), o at right angles to d
        dd, oo = np.einsum("ij,ij->i", d, d), np.einsum("ij,ij->i", o, o) + self.ring**2 - self.tube**2
        od = 2.0 * np.einsum("ij,ij->i", o, d)
        flat_o, flat_d, four = o[:, :2], d[:, :2], 4.0 * self.ring**2
        c = np.stack([oo**2 - four * np.einsum("ij,ij->i", flat_o, flat_o),
                      2.0 * od * oo - 2.0 * four * np.einsum("ij,ij->i", flat_o, flat_d),
                      od**2 + 2.0 * dd * oo - four * np.einsum("ij,ij->i", flat_d, flat_d),
                      2.0 * dd * od, dd**2], axis=1)
        return roots.polynomial(c, -half, half)

    def _normal(self, p: np.ndarray) -> np.ndarray:
        across = np.hypot(p[:, 0], p[:, 1])[:, None]
        return (p - np.pad(p[:, :2] / across, ((0, 0), (0, 1))) * self.ring) / self.tube

    def _sample(self, count: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        inside = np.empty(count)
        filled = 0
        while filled < count:  # the outer half has more area: reject in proportion
            angle = random.random(count) * (2.0 * np.pi)
            angle = angle[random.random(count) * self.radius <= self.ring + self.tube * np.cos(angle)][: count - filled]
            inside[filled : filled + len(angle)] = angle
            filled += len(angle)
        around = random.random(count) * (2.0 * np.pi)
        normal = np.stack([np.cos(inside) * np.cos(around), np.cos(inside) * np.sin(around), np.sin(inside)], axis=1)
        centre = np.stack([np.cos(around), np.sin(around), np.zeros(count)], axis=1) * self.ring
        return centre + self.tube * normal, normal


@dataclass(frozen=True, eq=False)
class Rectangle(Surface):
    """width x height around the origin in the plane z = 0, normal +z."""

    width: float = 2.0
    height: float = 2.0

    @property
    def area(self) -> float:
        return self.width * self.height

    @property
    def radius(self) -> float:
        return 0.5 * np.hypot(self.width, self.height)

    def _roots(self, o: np.ndarray, d: np.ndarray, half: np.ndarray) -> np.ndarray:
        with np.errstate(divide="ignore", invalid="ignore"):
            t = -o[:, 2] / d[:, 2]
            p = np.abs(o[:, :2] + t[:, None] * d[:, :2])
        inside = (p[:, 0] <= 0.5 * self.width) & (p[:, 1] <= 0.5 * self.height)
        return np.where(inside, t, np.nan)[:, None]

    def _normal(self, p: np.ndarray) -> np.ndarray:
        return np.broadcast_to(np.array([0.0, 0.0, 1.0]), p.shape).copy()

    def _sample(self, count: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        position = np.zeros((count, 3))
        position[:, :2] = (random.random((count, 2)) - 0.5) * [self.width, self.height]
        return position, self._normal(position)


@dataclass(frozen=True, eq=False)
class Box(Surface):
    """Closed; half its edges."""

    half: tuple[float, float, float] = (0.7, 0.7, 0.7)

    @property
    def area(self) -> float:
        a, b, c = self.half
        return 8.0 * (a * b + b * c + c * a)

    @property
    def radius(self) -> float:
        return float(np.linalg.norm(self.half))

    def _roots(self, o: np.ndarray, d: np.ndarray, half: np.ndarray) -> np.ndarray:
        size = np.array(self.half)
        with np.errstate(divide="ignore", invalid="ignore"):
            a, b = (-size - o) / d, (size - o) / d
        enter, leave = np.fmin(a, b).max(axis=1), np.fmax(a, b).min(axis=1)
        hit = enter < leave
        return np.stack([np.where(hit, enter, np.nan), np.where(hit, leave, np.nan)], axis=1)

    def _normal(self, p: np.ndarray) -> np.ndarray:
        share = p / np.array(self.half)
        axis = np.abs(share).argmax(axis=1)
        normal = np.zeros_like(p)
        rows = np.arange(len(p))
        normal[rows, axis] = np.sign(share[rows, axis])
        return normal

    def _sample(self, count: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        a, b, c = self.half
        axis = random.choice(3, count, p=np.array([b * c, a * c, a * b]) / (b * c + a * c + a * b))
        position = (2.0 * random.random((count, 3)) - 1.0) * self.half
        rows = np.arange(count)
        side = np.where(random.random(count) < 0.5, -1.0, 1.0)
        position[rows, axis] = side * np.array(self.half)[axis]
        normal = np.zeros((count, 3))
        normal[rows, axis] = side
        return position, normal


@dataclass(frozen=True, eq=False)
class Saddle(Surface):
    """z = bend (x^2 - y^2) within |x|, |y| <= half."""

    half: float = 0.9
    bend: float = 0.7

    @cached_property
    def area(self) -> float:
        node, weight = np.polynomial.legendre.leggauss(64)
        x, y = np.meshgrid(node * self.half, node * self.half)
        w = np.outer(weight, weight) * self.half**2
        return float((w * np.sqrt(1.0 + 4.0 * self.bend**2 * (x**2 + y**2))).sum())

    @property
    def radius(self) -> float:
        return self.half * np.sqrt(2.0 + (self.bend * self.half) ** 2)

    def _roots(self, o: np.ndarray, d: np.ndarray, half: np.ndarray) -> np.ndarray:
        sign = self.bend * np.array([1.0, -1.0])
        c = np.stack([(sign * o[:, :2] ** 2).sum(axis=1) - o[:, 2],
                      2.0 * (sign * o[:, :2] * d[:, :2]).sum(axis=1) - d[:, 2],
                      (sign * d[:, :2] ** 2).sum(axis=1)], axis=1)
        t = roots.polynomial(c, -half, half)
        p = np.abs(o[:, None, :2] + t[..., None] * d[:, None, :2])
        with np.errstate(invalid="ignore"):
            return np.where((p <= self.half).all(axis=2), t, np.nan)

    def _normal(self, p: np.ndarray) -> np.ndarray:
        normal = np.stack([-2.0 * self.bend * p[:, 0], 2.0 * self.bend * p[:, 1], np.ones(len(p))], axis=1)
        return normal / np.linalg.norm(normal, axis=1)[:, None]

    def _sample(self, count: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        found = np.empty((0, 2))
        steepest = np.sqrt(1.0 + 8.0 * (self.bend * self.half) ** 2)
        while len(found) < count:
            p = (2.0 * random.random((count, 2)) - 1.0) * self.half
            kept = random.random(count) * steepest < np.sqrt(1.0 + 4.0 * self.bend**2 * (p**2).sum(axis=1))
            found = np.concatenate([found, p[kept]])
        p = found[:count]
        position = np.column_stack([p, self.bend * (p[:, 0] ** 2 - p[:, 1] ** 2)])
        return position, self._normal(position)


@dataclass(frozen=True, eq=False)
class Gyroid(Surface):
    """sin kx cos ky + sin ky cos kz + sin kz cos kx = level within a ball, k waves a unit times 2 pi. Both sides
    show."""

    radius: float = 1.2
    waves: float = 0.8
    level: float = 0.3

    @cached_property
    def area(self) -> float:
        return self._crofton(100_000, np.random.default_rng(7))[1]  # within about 0.2 %

    def _field(self, p: np.ndarray) -> np.ndarray:
        s, c = np.sin(2.0 * np.pi * self.waves * p), np.cos(2.0 * np.pi * self.waves * p)
        return s[:, 0] * c[:, 1] + s[:, 1] * c[:, 2] + s[:, 2] * c[:, 0] - self.level

    def _gradient(self, p: np.ndarray) -> np.ndarray:
        k = 2.0 * np.pi * self.waves
        s, c = np.sin(k * p), np.cos(k * p)
        return k * np.stack([c[:, i] * c[:, (i + 1) % 3] - s[:, (i + 2) % 3] * s[:, i] for i in range(3)], axis=1)

    def _roots(self, o: np.ndarray, d: np.ndarray, half: np.ndarray) -> np.ndarray:
        k = 2.0 * np.pi * self.waves

        def value(rows: np.ndarray, t: np.ndarray) -> np.ndarray:
            return self._field(o[rows] + t[:, None] * d[rows])

        def slope(rows: np.ndarray, t: np.ndarray) -> np.ndarray:
            return np.einsum("ij,ij->i", self._gradient(o[rows] + t[:, None] * d[rows]), d[rows])

        # |second derivative| along a unit vector u: at most k^2 sum (|u_i| + |u_j|)^2 <= 4 k^2
        bend = 4.0 * k**2 * np.einsum("ij,ij->i", d, d)
        return roots.smooth(value, slope, bend, -half, half, 8)

    def _normal(self, p: np.ndarray) -> np.ndarray:
        gradient = self._gradient(p)
        return gradient / np.linalg.norm(gradient, axis=1)[:, None]
