# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangles of virtual scenes: boxes, tubes, lathes, leaves, walls with openings. Metres, z up. A part is one surface to
the metrics; a thin part is a bar, wire or leaf."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from .rays import PATTERNS, Material, Rays

Place = Sequence[float]
GLASS, MIRROR = 1, 2  # of a part: a pane that one sees through; a polished or wet surface


def linear(srgb: np.ndarray) -> np.ndarray:
    value = np.asarray(srgb, np.float64)
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def turned(degrees: float, place: Place = (0.0, 0.0, 0.0)) -> np.ndarray:
    """(4, 4): around z, then moved."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    matrix = np.eye(4)
    matrix[:2, :2] = [[c, -s], [s, c]]
    matrix[:3, 3] = place
    return matrix


@dataclass(eq=False)
class World:
    """What is traced. corners (n, 3, 3), material (n,), surface (n,): number of the part; thin (parts,) bool; gloss (parts,)
    uint8: 0 matt, GLASS or MIRROR; clear: rays against all but glass, or `rays` where there is no glass."""

    corners: np.ndarray
    material: np.ndarray
    surface: np.ndarray
    thin: np.ndarray
    rays: Rays
    gloss: np.ndarray
    clear: Rays
    solid: np.ndarray  # the triangles of `clear`

    def off(self, place: np.ndarray, parts: np.ndarray, most: np.ndarray) -> np.ndarray:
        """The distance (n,) of each place (n, 3) from the nearest of its own parts (n, k), at most `most` (n,); -1 stands for
        no part."""
        return self.rays.nearest(place, self.surface, parts, most)

    @property
    def normal(self) -> np.ndarray:
        return self.rays.normal


class Solids:
    """Collects triangles; every call adds to the part that part() began."""

    def __init__(self, seed: int = 1) -> None:
        self.random = np.random.default_rng(seed)
        self._corners: list[np.ndarray] = []
        self._material: list[np.ndarray] = []
        self._surface: list[np.ndarray] = []
        self._thin: list[bool] = []
        self._gloss: list[int] = []
        self._materials: list[Material] = []
        self.matrix = np.eye(4)

    def part(self, thin: bool = False, gloss: int = 0) -> None:
        self._thin.append(thin)
        self._gloss.append(gloss)

    def material(self, pattern: str, first: Place, second: Place = (0.6, 0.58, 0.55), length: float = 0.3,
                 grain: float = 0.25) -> int:
        """first, second: sRGB 0..1; length: of the pattern, metres."""
        self._materials.append(Material(PATTERNS[pattern], 0, tuple(linear(np.array(first))),
                                        tuple(linear(np.array(second))), length, grain))
        return len(self._materials) - 1

    def triangles(self, corners: np.ndarray, material: int) -> None:
        corners = np.asarray(corners, np.float64).reshape(-1, 3, 3)
        self._corners.append(corners @ self.matrix[:3, :3].T + self.matrix[:3, 3])
        self._material.append(np.full(len(corners), material, np.int32))
        self._surface.append(np.full(len(corners), len(self._thin) - 1, np.int32))

    def quads(self, a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray, material: int) -> None:
        a, b, c, d = (np.asarray(one, np.float64).reshape(-1, 3) for one in (a, b, c, d))
        self.triangles(np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]), material)

    def sheet(self, places: np.ndarray, material: int) -> None:
        """places (rows, columns, 3): a surface over a grid."""
        p = np.asarray(places, np.float64)
        self.quads(p[:-1, :-1], p[:-1, 1:], p[1:, 1:], p[1:, :-1], material)

    def box(self, lo: Place, hi: Place, material: int) -> None:
        x0, y0, z0 = np.minimum(lo, hi)
        x1, y1, z1 = np.maximum(lo, hi)
        p = np.array([(x0, y0, z0), (x1, y0, z0), (x1, y1, z0), (x0, y1, z0), (x0, y0, z1), (x1, y0, z1), (x1, y1, z1),
                      (x0, y1, z1)])
        sides = np.array([(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (4, 5, 6, 7), (3, 2, 1, 0)])
        self.quads(*(p[sides[:, k]] for k in range(4)), material)

    def tube(self, a: Place, b: Place, radius: float, material: int, end: float | None = None, sides: int = 10) -> None:
        """A capped cylinder, or a cone towards b of radius `end`."""
        a, b = np.asarray(a, float), np.asarray(b, float)
        axis = (b - a) / np.linalg.norm(b - a)
        u = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
        u /= np.linalg.norm(u)
        turn = np.linspace(0.0, 2.0 * np.pi, sides + 1)
        ring = np.cos(turn)[:, None] * u + np.sin(turn)[:, None] * np.cross(axis, u)
        rows = np.stack([np.broadcast_to(a, ring.shape), a + radius * ring, b + (radius if end is None else end) * ring,
                         np.broadcast_to(b, ring.shape)])
        self.sheet(rows, material)

    def path(self, places: np.ndarray, radius: float, material: int, sides: int = 8) -> None:
        for a, b in zip(places[:-1], places[1:]):
            self.tube(a, b, radius, material, sides=sides)

    def cable(self, a: Place, b: Place, sag: float, radius: float, material: int, pieces: int = 24) -> None:
        t = np.linspace(0.0, 1.0, pieces + 1)[:, None]
        places = (1.0 - t) * np.asarray(a, float) + t * np.asarray(b, float)
        places[:, 2] -= 4.0 * sag * (t * (1.0 - t))[:, 0]
        self.path(places, radius, material)

    def lathe(self, profile: Sequence[tuple[float, float]], place: Place, material: int, segments: int = 64, flutes: int = 0,
              depth: float = 0.0) -> None:
        """profile: (radius, height) from below; flutes of a depth run along it."""
        turn = np.linspace(0.0, 2.0 * np.pi, segments + 1)
        r, z = np.asarray(profile, float).T
        r = r[:, None] - depth * np.abs(np.sin(0.5 * flutes * turn))[None] * (r > 0.0)[:, None]
        self.sheet(np.stack([place[0] + r * np.cos(turn), place[1] + r * np.sin(turn),
                             place[2] + np.broadcast_to(z[:, None], r.shape)], axis=2), material)

    def blob(self, place: Place, radii: Place, material: int, bumps: float = 0.0, waves: float = 5.0,
             segments: int = 96) -> None:
        """An ellipsoid, its radius waved by `bumps`."""
        turn, rise = np.meshgrid(np.linspace(0, 2 * np.pi, segments + 1), np.linspace(-np.pi / 2, np.pi / 2, segments // 2 + 1))
        u = np.stack([np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)], axis=2)
        wave = 1.0 + bumps * np.sin(waves * np.pi * u[..., 0]) * np.sin(
            waves * np.pi * u[..., 1] + 1.0) * np.cos(waves * u[..., 2])
        self.sheet(np.asarray(place) + u * np.asarray(radii) * wave[..., None], material)

    def ring(self, place: Place, ring: float, tube: float, axis: str, material: int, segments: int = 48) -> None:
        a, b = np.meshgrid(np.linspace(0, 2 * np.pi, segments + 1), np.linspace(0, 2 * np.pi, segments // 3 + 1))
        r = ring + tube * np.cos(b)
        shape = np.stack([r * np.cos(a), r * np.sin(a), tube * np.sin(b)], axis=2)
        self.sheet(np.roll(shape, {"z": 0, "x": 1, "y": 2}[axis], axis=2) + np.asarray(place), material)

    def ground(self, x: tuple[float, float], y: tuple[float, float], step: float, material: int,
               height: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> None:
        px, py = np.meshgrid(np.arange(x[0], x[1] + step / 2, step), np.arange(y[0], y[1] + step / 2, step))
        self.sheet(np.stack([px, py, height(px, py)], axis=2), material)

    def leaves(self, places: np.ndarray, size: float, material: int) -> None:
        """A bent diamond at each place, turned at random; size: its length."""
        count = len(places)
        along = self.random.normal(size=(count, 3))
        along /= np.linalg.norm(along, axis=1)[:, None]
        across = np.cross(along, self.random.normal(size=(count, 3)))
        across /= np.linalg.norm(across, axis=1)[:, None]
        half = 0.5 * size * self.random.uniform(0.7, 1.2, (count, 1))
        lift = 0.25 * half * np.cross(along, across)
        self.quads(places - half * along, places - 0.6 * half * across + lift, places + half * along,
                   places + 0.6 * half * across + lift, material)

    def tree(self, place: Place, height: float, crown: float, bark: int, leaf: int, leaves: int, size: float = 0.09) -> None:
        """Trunk, boughs, and leaves around the boughs' ends."""
        place = np.asarray(place, float)
        self.part()
        top = place + [0.0, 0.0, 0.75 * height]
        self.tube(place - [0, 0, 0.3], top, 0.03 * height, bark, 0.012 * height)
        tips = []
        for _ in range(14):
            start = place + [0.0, 0.0, height * self.random.uniform(0.35, 0.72)]
            turn, rise = self.random.uniform(0, 2 * np.pi), self.random.uniform(0.1, 1.0)
            way = np.array([np.cos(turn) * np.cos(rise), np.sin(turn) * np.cos(rise), np.sin(rise)])
            tip = start + crown * self.random.uniform(0.6, 1.0) * way
            self.tube(start, tip, 0.008 * height, bark, 0.003 * height, sides=6)
            tips += [start + t * (tip - start) for t in (0.45, 0.6, 0.75, 0.9, 1.0)]
        self.part(thin=True)
        middle = np.array(tips)[self.random.integers(0, len(tips), leaves)]
        self.leaves(middle + self.random.normal(scale=0.16 * crown, size=(leaves, 3)), size, leaf)

    def wall(self, width: float, height: float, openings: Sequence[tuple[float, float, float, float]], depth: float,
             front: int, reveal: int, pane: int, bars: int = -1, gap: float = 0.12, bar: float = 0.024) -> None:
        """In x and z, its front at y = 0, its openings (x0, z0, x1, z1) going back to y = depth, with a pane there; bars
        of a thickness stand in them a third deep."""
        xs = sorted({0.0, width, *(x for o in openings for x in (o[0], o[2]))})
        zs = sorted({0.0, height, *(z for o in openings for z in (o[1], o[3]))})
        self.part()
        cells = [(x0, z0, x1, z1) for x0, x1 in zip(xs[:-1], xs[1:]) for z0, z1 in zip(zs[:-1], zs[1:])
                 if not any(o[0] <= x0 and x1 <= o[2] and o[1] <= z0 and z1 <= o[3] for o in openings)]
        c = np.array(cells)

        def at(x: np.ndarray, y: float, z: np.ndarray) -> np.ndarray:
            return np.stack([x, np.full(len(x), y), z], axis=1)

        self.quads(at(c[:, 0], 0, c[:, 1]), at(c[:, 2], 0, c[:, 1]), at(c[:, 2], 0, c[:, 3]), at(c[:, 0], 0, c[:, 3]), front)
        self.part()
        for x0, z0, x1, z1 in openings:
            corner = np.array([(x0, z0), (x1, z0), (x1, z1), (x0, z1)])
            after = np.roll(corner, -1, axis=0)
            self.quads(at(corner[:, 0], 0, corner[:, 1]), at(after[:, 0], 0, after[:, 1]), at(after[:, 0], depth, after[:, 1]),
                       at(corner[:, 0], depth, corner[:, 1]), reveal)
        if pane >= 0:
            self.part()
            o = np.array(openings)
            self.quads(at(o[:, 0], depth, o[:, 1]), at(o[:, 2], depth, o[:, 1]), at(o[:, 2], depth, o[:, 3]),
                       at(o[:, 0], depth, o[:, 3]), pane)
        if bars >= 0:
            self.part(thin=True)
            for x0, z0, x1, z1 in openings:
                for x in np.arange(x0 + gap, x1 - 0.5 * gap, gap):
                    self.box((x - bar / 2, depth / 3, z0), (x + bar / 2, depth / 3 + bar, z1), bars)
                middle = 0.5 * (z0 + z1)
                self.box((x0, depth / 3, middle - bar / 2), (x1, depth / 3 + bar, middle + bar / 2), bars)

    def railing(self, a: Place, b: Place, material: int, height: float = 1.0, gap: float = 0.12, bar: float = 0.024,
                post: float = 2.0) -> None:
        """Upright square bars between two rails from a to b, which may climb."""
        a, b = np.asarray(a, float), np.asarray(b, float)
        length = float(np.hypot(*(b - a)[:2]))
        along = (b - a) / length
        side = np.array([-along[1], along[0], 0.0]) * bar / 2
        up = np.array([0.0, 0.0, 1.0])

        def beam(p: np.ndarray, q: np.ndarray, u: np.ndarray, v: np.ndarray) -> None:
            ring = [-u - v, u - v, u + v, -u + v, -u - v]
            self.sheet(np.array([[p + r for r in ring], [q + r for r in ring]]), material)

        self.part(thin=True)
        flat = np.array([along[0], along[1], 0.0]) * bar / 2
        for s in np.arange(gap, length, gap):
            base = a + s * along
            beam(base + 0.1 * up, base + height * up, flat, side)
        for z, thick in ((0.1, 1.0), (height, 1.6)):
            beam(a + z * up, b + z * up, thick * side, thick * up * bar / 2)
        self.part()
        for s in np.linspace(0.0, length, int(np.ceil(length / post)) + 1):
            base = a + s * along
            beam(base, base + (height + 0.05) * up, 1.8 * flat, 1.8 * side)

    def world(self) -> World:
        corners, material, surface = (np.concatenate(one) for one in (self._corners, self._material, self._surface))
        gloss = np.array(self._gloss, np.uint8)
        rays = Rays(corners, material, self._materials)
        solid = np.flatnonzero(gloss[surface] != GLASS)
        clear = rays if len(solid) == len(corners) else Rays(corners[solid], material[solid], self._materials)
        return World(corners, material, surface, np.array(self._thin), rays, gloss, clear, solid)
