# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes for the independent check: what the other scenes do not have. A knot, sharp edges, plates thinner than the points lie
apart, spheres that touch, slits, shells within shells."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from . import roots
from .surfaces import Box, Rectangle, Sphere, Surface, rotation, translation


@dataclass(frozen=True, eq=False)
class Traced(Surface):
    """Found by rays through fine triangles, then moved onto the surface itself by Newton's steps along the ray."""

    def corners(self) -> np.ndarray:
        """(n, 3, 3), closer to the surface than a thousandth of what is looked for."""
        raise NotImplementedError

    def _away(self, p: np.ndarray) -> np.ndarray:
        """Signed distance of places near the surface."""
        raise NotImplementedError

    @cached_property
    def _rays(self) -> object:
        from .scans.rays import Rays
        corners = self.corners()
        return Rays(corners, np.zeros(len(corners), np.int32), [])

    def _roots(self, o: np.ndarray, d: np.ndarray, half: np.ndarray) -> np.ndarray:
        rows, found = [], []
        active, start = np.arange(len(o)), -1.001 * half
        while len(active):
            t, triangle = self._rays.trace(o[active] + start[active, None] * d[active], d[active])
            hit = triangle >= 0
            active = active[hit]
            start[active] += t[hit]
            rows.append(active)
            found.append(start[active].copy())
            start[active] += 1e-7
        if not rows:
            return np.full((len(o), 1), np.nan)
        row, t = np.concatenate(rows), np.concatenate(found)
        for _ in range(2):
            p = o[row] + t[:, None] * d[row]
            slope = np.einsum("ij,ij->i", self._normal(p), d[row])
            steep = np.abs(slope) > 0.02 * np.linalg.norm(d[row], axis=1)
            t = t - np.where(steep, self._away(p) / np.where(steep, slope, 1.0), 0.0)
        return roots.packed(row, t, len(o))


@dataclass(frozen=True, eq=False)
class Knot(Traced):
    """A tube around a trefoil: scale (sin s + 2 sin 2s, cos s - 2 cos 2s, -sin 3s)."""

    scale: float = 0.4
    tube: float = 0.19

    @property
    def radius(self) -> float:
        return 3.0 * self.scale + self.tube

    def _curve(self, s: np.ndarray, derivative: int = 0) -> np.ndarray:
        turn = s + 0.5 * np.pi * derivative  # each derivative of a sine is a quarter turn further
        k = derivative
        return self.scale * np.stack([np.sin(turn) + 2.0 ** (k + 1) * np.sin(2 * s + 0.5 * np.pi * k),
                                      np.cos(turn) - 2.0 ** (k + 1) * np.cos(2 * s + 0.5 * np.pi * k),
                                      -(3.0**k) * np.sin(3 * s + 0.5 * np.pi * k)], axis=-1)

    @cached_property
    def area(self) -> float:
        s = np.arange(4096) * (2.0 * np.pi / 4096)
        length = np.linalg.norm(self._curve(s, 1), axis=1).mean() * 2.0 * np.pi
        return float(2.0 * np.pi * self.tube * length)  # Pappus, for any tube that does not touch itself

    def _on(self, s: np.ndarray, turn: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Places, normals, and area by ds dturn of the tube's parameters."""
        first, second = self._curve(s, 1), self._curve(s, 2)
        speed = np.linalg.norm(first, axis=-1, keepdims=True)
        tangent = first / speed
        bend = (second - np.sum(second * tangent, axis=-1, keepdims=True) * tangent) / speed**2
        curvature = np.linalg.norm(bend, axis=-1, keepdims=True)
        u = bend / curvature
        normal = np.cos(turn)[..., None] * u + np.sin(turn)[..., None] * np.cross(tangent, u)
        area = self.tube * speed[..., 0] * (1.0 - self.tube * curvature[..., 0] * np.cos(turn))
        return self._curve(s) + self.tube * normal, normal, area

    def corners(self) -> np.ndarray:
        s, turn = np.meshgrid(np.linspace(0, 2 * np.pi, 1201), np.linspace(0, 2 * np.pi, 161), indexing="ij")
        p, _, _ = self._on(s, turn)
        p[-1], p[:, -1] = p[0], p[:, 0]
        a, b, c, d = (one.reshape(-1, 3) for one in (p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]))
        return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])

    @cached_property
    def _tree(self) -> object:
        from scipy.spatial import cKDTree
        return cKDTree(self._curve(np.arange(2048) * (2.0 * np.pi / 2048)))

    def _nearest(self, p: np.ndarray) -> np.ndarray:
        """The curve's place nearest to each: of 2048, then Newton."""
        s = self._tree.query(p)[1] * (2.0 * np.pi / 2048)
        for _ in range(4):
            off, first, second = self._curve(s) - p, self._curve(s, 1), self._curve(s, 2)
            s = s - np.sum(off * first, axis=1) / (np.sum(first * first, axis=1) + np.sum(off * second, axis=1))
        return self._curve(s)

    def _away(self, p: np.ndarray) -> np.ndarray:
        return np.linalg.norm(p - self._nearest(p), axis=1) - self.tube

    def _normal(self, p: np.ndarray) -> np.ndarray:
        normal = p - self._nearest(p)
        return normal / np.linalg.norm(normal, axis=1)[:, None]

    def _sample(self, count: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        s = np.linspace(0, 2 * np.pi, 512)
        most = 1.02 * self._on(s, np.full(512, np.pi))[2].max()
        position, normal = [], []
        left = count
        while left > 0:
            place, out, area = self._on(2 * np.pi * random.random(2 * left + 64), 2 * np.pi * random.random(2 * left + 64))
            kept = np.flatnonzero(random.random(len(area)) * most < area)[:left]
            position.append(place[kept])
            normal.append(out[kept])
            left -= len(kept)
        return np.concatenate(position), np.concatenate(normal)


@dataclass(frozen=True, eq=False)
class Astroid(Traced):
    """A column over x = a cos^3, y = a sin^3, |z| <= half: four edges of no angle at all."""

    across: float = 1.1
    half: float = 0.6

    @property
    def radius(self) -> float:
        return float(np.hypot(self.across, self.half))

    @property
    def area(self) -> float:
        return 12.0 * self.across * self.half + 2.0 * 0.375 * np.pi * self.across**2

    def corners(self) -> np.ndarray:
        turn = np.linspace(0.0, 2.0 * np.pi, 4 * 400 + 1)
        p = np.column_stack([np.cos(turn) ** 3, np.sin(turn) ** 3]) * self.across
        p[-1] = p[0]

        def at(flat: np.ndarray, z: float) -> np.ndarray:
            return np.column_stack([flat, np.full(len(flat), z)])

        a, b, c, d = at(p[:-1], -self.half), at(p[1:], -self.half), at(p[1:], self.half), at(p[:-1], self.half)
        middle = np.zeros((len(a), 2))
        return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1), np.stack([a, b, at(middle, -self.half)], 1),
                               np.stack([d, c, at(middle, self.half)], 1)])

    def _cap(self, p: np.ndarray) -> np.ndarray:
        return np.abs(np.abs(p[:, 2]) - self.half) < 1e-6

    def _normal(self, p: np.ndarray) -> np.ndarray:
        turn = np.arctan2(np.cbrt(p[:, 1]), np.cbrt(p[:, 0]))
        c, s = np.cos(turn), np.sin(turn)
        normal = np.column_stack([np.abs(s) * np.sign(c), np.abs(c) * np.sign(s), np.zeros(len(p))])
        cap = self._cap(p)
        normal[cap] = np.sign(p[cap, 2])[:, None] * [0.0, 0.0, 1.0]
        return normal

    def _away(self, p: np.ndarray) -> np.ndarray:
        return np.zeros(len(p))  # the triangles' sagitta, a millionth, stays

    def _sample(self, count: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        side = int(random.binomial(count, 12.0 * self.across * self.half / self.area))
        turn = np.arcsin(np.sqrt(random.random(side)))  # the arc's length grows with sin^2
        p = np.column_stack([np.cos(turn) ** 3, np.sin(turn) ** 3]) * self.across * random.choice([-1.0, 1.0], (side, 2))
        parts = [np.column_stack([p, self.half * random.uniform(-1.0, 1.0, side)])]
        left = count - side
        while left > 0:
            flat = random.uniform(-1.0, 1.0, (6 * left + 64, 2))
            flat = flat[(np.abs(flat) ** (2.0 / 3.0)).sum(axis=1) < 1.0][:left] * self.across
            parts.append(np.column_stack([flat, self.half * random.choice([-1.0, 1.0], len(flat))]))
            left -= len(flat)
        position = random.permutation(np.concatenate(parts))
        return position, self._normal(position)


def _slits() -> tuple[Surface, ...]:
    """Boards 0.2 wide with gaps of 0.005 to 0.08 between them, before a wall."""
    gaps, x = (0.005, 0.01, 0.02, 0.04, 0.08), -0.68
    found = [Rectangle(width=2.4, height=2.0).placed(rotation("x", 50.0), translation(0.0, 0.0, -0.4))]
    for gap in (*gaps, 0.0):
        found.append(Rectangle(width=0.2, height=1.6).placed(rotation("x", 50.0), translation(x + 0.1, 0.0, 0.0)))
        x += 0.2 + gap
    return tuple(found)


# All fit the camera that truth.orbit() gives; lengths in its units, where a million points lie some 0.004 apart.
SHAPES: dict[str, Callable[[], tuple[Surface, ...]]] = {
    "knot": lambda: (Knot(),),
    "astroid": lambda: (Astroid().placed(rotation("z", 20.0), rotation("x", 25.0)),),
    "plates": lambda: tuple(Box(half=(0.7, 0.5 * thick, 0.45)).placed(rotation("z", 25.0), translation(0.0, y, 0.0))
                            for y, thick in ((-0.6, 0.004), (-0.2, 0.008), (0.2, 0.016), (0.6, 0.032))),
    "kissing": lambda: (Sphere(radius=0.5).placed(translation(-0.5, 0.0, 0.0)),
                        Sphere(radius=0.5).placed(translation(0.5, 0.0, 0.0)),
                        Sphere(radius=0.3).placed(translation(0.0, 0.0, float(np.sqrt(0.8**2 - 0.5**2))))),
    "slits": _slits,
    "shells": lambda: (Sphere(radius=0.9), Sphere(radius=0.89)),
}
