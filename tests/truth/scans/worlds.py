# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds that campaigns scan, for tuning and training. Metres, z up. worlds_held.py has those that are held out."""

from __future__ import annotations

import numpy as np

from .places import _flat, _lamp, _materials, _windows
from .solids import GLASS, MIRROR, Place, Solids, turned


def glazed(s: Solids, x0: float, z0: float, x1: float, z1: float, y: float, m: dict[str, int], columns: int = 2, rows: int = 3,
           bar: float = 0.05) -> None:
    """A window in x and z: a pane at y, its frame and its mullions."""
    s.part(gloss=GLASS)
    s.quads([(x0, y, z0)], [(x1, y, z0)], [(x1, y, z1)], [(x0, y, z1)], m["glass"])
    s.part(thin=True)
    for x in np.linspace(x0, x1, columns + 1):
        s.box((x - bar / 2, y - bar / 2, z0), (x + bar / 2, y + bar / 2, z1), m["wood"])
    for z in np.linspace(z0, z1, rows + 1):
        s.box((x0, y - bar / 2, z - bar / 2), (x1, y + bar / 2, z + bar / 2), m["wood"])


def chandelier(s: Solids, place: Place, metal: int, crystal: int, arms: int = 8, radius: float = 0.7, drop: float = 1.6) -> None:
    """A chain, a shaft, arms with cups and candles, strings of drops."""
    x, y, z = place
    s.part(thin=True)
    for k in range(int(drop / 0.08)):
        s.ring((x, y, z + drop - 0.08 * k), 0.03, 0.006, "xy"[k % 2], metal, 12)
    s.part()
    s.lathe([(0.0, -0.3), (0.09, -0.2), (0.03, -0.1), (0.06, 0.05), (0.02, 0.2)], place, metal, 32)
    for k in range(arms):
        turn = 2.0 * np.pi * k / arms
        c, d = np.cos(turn), np.sin(turn)
        t = np.linspace(0.0, 1.0, 9)
        r, h = radius * t, -0.25 * np.sin(np.pi * t) + 0.12 * t
        s.part(thin=True)
        s.path(np.stack([x + c * r, y + d * r, z + h], axis=1), 0.01, metal, 6)
        tip = (x + c * radius, y + d * radius, z + 0.12)
        s.tube(tip, (tip[0], tip[1], tip[2] + 0.14), 0.011, crystal, sides=8)
        s.part()
        s.lathe([(0.0, -0.02), (0.05, 0.0), (0.055, 0.015)], tip, metal, 20)
        s.part(thin=True)
        for i in range(1, 12):
            q = i / 12.0
            h = 0.35 - 0.23 * q - 0.12 * np.sin(np.pi * q)
            s.blob((x + c * radius * q, y + d * radius * q, z + h), (0.012, 0.012, 0.018), crystal, segments=8)
        for i in range(4):
            s.blob((tip[0], tip[1], tip[2] - 0.06 - 0.05 * i), (0.01, 0.01, 0.02), crystal, segments=8)


def hall() -> Solids:
    """A hall with tall windows, a chandelier, a mirror over a hearth, curtains, chairs along the walls."""
    s = Solids(31)
    m = _materials(s)
    _flat(s, (0, 0), (12, 8), 0.0, m["floor"])
    _flat(s, (0, 0), (12, 8), 4.6, m["white"])
    openings = [(1.0 + 2.8 * k, 0.5, 2.6 + 2.8 * k, 3.8) for k in range(4)]
    s.matrix = turned(0.0, (0.0, 8.0, 0.0))
    s.wall(12, 4.6, openings, 0.4, m["plaster"], m["white"], -1)
    for x0, z0, x1, z1 in openings:
        glazed(s, x0, z0, x1, z1, 0.25, m, 2, 5)
    s.matrix = np.eye(4)
    for a, b in (((0, 0), (12, 0)), ((0, 0), (0, 8)), ((12, 0), (12, 8))):
        s.part()
        s.quads([(*a, 0)], [(*b, 0)], [(*b, 4.6)], [(*a, 4.6)], m["plaster"])
    for x0 in (0.6, 3.4, 6.2, 9.0):
        for x in (x0, x0 + 2.2):
            s.part()
            u, z = np.meshgrid(np.linspace(0.0, 0.4, 40), np.linspace(0.1, 4.0, 12))
            s.sheet(np.stack([x + u, 7.85 + 0.05 * np.sin(50.0 * u + 0.3 * z), z], axis=2), m["red"])
    s.part()  # outside
    _flat(s, (-6, 8), (18, 20), -0.8, m["grass"])
    s.box((-4, 18, -0.8), (16, 18.4, 3.5), m["bricks"])
    s.tree((3.0, 13.0, -0.8), 6.0, 2.0, m["bark"], m["leaf"], 3500)
    chandelier(s, (4.0, 4.0, 2.9), m["iron"], m["marble"])
    chandelier(s, (8.0, 4.0, 2.9), m["iron"], m["marble"], 10, 0.6)
    s.part()
    s.box((4.8, 0.0, 0.0), (5.1, 0.4, 1.2), m["marble"])
    s.box((6.9, 0.0, 0.0), (7.2, 0.4, 1.2), m["marble"])
    s.box((4.7, 0.0, 1.2), (7.3, 0.5, 1.3), m["marble"])
    s.part(gloss=MIRROR)
    s.quads([(5.0, 0.02, 1.5)], [(7.0, 0.02, 1.5)], [(7.0, 0.02, 3.6)], [(5.0, 0.02, 3.6)], m["iron"])
    s.part()
    for lo, hi in (((4.9, 0, 1.4), (7.1, 0.06, 1.5)), ((4.9, 0, 3.6), (7.1, 0.06, 3.7)), ((4.9, 0, 1.4), (5.0, 0.06, 3.7)),
                   ((7.0, 0, 1.4), (7.1, 0.06, 3.7))):
        s.box(lo, hi, m["wood"])
    for x in (5.2, 6.8):
        s.part()
        s.lathe([(0.0, 0.0), (0.07, 0.0), (0.02, 0.05), (0.09, 0.2), (0.04, 0.3), (0.05, 0.32)], (x, 0.25, 1.3), m["poster"], 32)
    for x in (1.0, 2.0, 3.0, 8.4, 9.4, 10.4):
        s.matrix = turned(s.random.uniform(-15, 15), (x, 0.6, 0))
        s.part(thin=True)
        for dx in (-0.2, 0.2):
            for dy, top in ((0.2, 0.45), (-0.2, 1.0)):
                s.tube((dx, dy, 0), (dx, dy, top), 0.016, m["wood"], sides=8)
        for dx in np.linspace(-0.14, 0.14, 5):
            s.tube((dx, -0.2, 0.45), (dx, -0.2, 0.95), 0.007, m["wood"], sides=6)
        s.part()
        s.box((-0.22, -0.22, 0.43), (0.22, 0.22, 0.47), m["red"])
        s.matrix = np.eye(4)
    s.part()
    s.box((4.5, 3.2, 0.72), (7.5, 4.8, 0.77), m["wood"])
    for x in (4.7, 7.3):
        for y in (3.4, 4.6):
            s.lathe([(0.06, 0), (0.03, 0.2), (0.06, 0.5), (0.04, 0.72)], (x, y, 0), m["wood"], 24)
    for k in range(6):
        s.part()
        x = 4.8 + 0.5 * k
        s.lathe([(0.03, 0.0), (0.005, 0.03), (0.005, 0.1), (0.03, 0.13), (0.035, 0.2)], (x, 3.6, 0.77), m["white"], 20)
    for k in range(4):
        s.part()
        s.box((0.0, 1.0 + 1.6 * k, 1.5), (0.04, 2.2 + 1.6 * k, 2.9), m[("poster", "leaf", "blocks", "poster")[k]])
    return s


def ruin() -> Solids:
    """Broken walls with gaps, an arch, ivy and saplings on them, rubble, tall grass, brambles, two trees."""
    s = Solids(32)
    m = _materials(s)

    def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return 0.25 * np.sin(0.5 * x + 1.0) * np.cos(0.4 * y) + 0.12 * np.sin(1.7 * x) * np.sin(1.3 * y + 0.5)

    s.part()
    s.ground((-14, 14), (-12, 12), 0.25, m["earth"], height)
    for x0, y0, turn, length in ((-6.0, -4.0, 0.0, 11.0), (-6.0, -4.0, 90.0, 8.0), (5.0, -4.0, 82.0, 7.0), (-6.0, 4.0, 5.0, 6.0)):
        s.matrix = turned(turn, (x0, y0, -0.4))
        s.part()
        x, top = 0.0, s.random.uniform(2.5, 4.5)
        while x < length:
            w = s.random.uniform(0.25, 0.6)
            top = float(np.clip(top + s.random.normal(scale=0.5), 0.5, 5.5))
            gap = 0.3 < x / length < 0.42
            s.box((x, -0.3 - s.random.uniform(0, 0.06), 3.4 if gap else 0.0), (x + w, 0.3 + s.random.uniform(0, 0.06),
                  max(top, 3.9 if gap else 0.0)), m["blocks"])
            x += w
        s.part(thin=True)  # ivy
        for _ in range(5):
            a, b = s.random.uniform(0, length), s.random.uniform(0.5, 2.5)
            n = 900
            s.leaves(np.column_stack([s.random.normal(a, 0.5, n), -0.36 - np.abs(s.random.normal(0, 0.05, n)),
                                      s.random.uniform(0, 1, n) ** 0.7 * b + 0.3]), 0.06, m["leaf"])
        s.part(thin=True)
        for _ in range(6):
            a, h = s.random.uniform(0, length), s.random.uniform(1.5, 4.0)
            s.path(np.array([(a, -0.4, 0.2), (a + 0.1, -0.5, 0.5 * h), (a - 0.1, -0.45, h)]), 0.008, m["bark"], 6)
        s.matrix = np.eye(4)
    for _ in range(90):
        s.part()
        x, y = s.random.uniform(-9, 8), s.random.uniform(-8, 7)
        r = s.random.uniform(0.08, 0.35, 3)
        s.blob((x, y, float(height(np.array(x), np.array(y))) + 0.3 * r[2]), r, m["stone"], 0.15, 2.5, 20)
    s.part(thin=True)
    for _ in range(2500):
        x, y = s.random.uniform(-10, 9), s.random.uniform(-9, 8)
        z = float(height(np.array(x), np.array(y)))
        bend = s.random.normal(scale=0.08, size=2)
        s.triangles([[(x, y, z), (x + 0.012, y, z), (x + bend[0], y + bend[1], z + s.random.uniform(0.15, 0.6))]], m["grass"])
    for x, y in ((-8.0, -1.0), (2.0, 2.5), (6.5, -7.0), (-3.0, -7.0)):
        s.part(thin=True)
        middle = np.array([x, y, 0.5])
        s.leaves(middle + s.random.normal(scale=(0.6, 0.6, 0.35), size=(2200, 3)), 0.05, m["leaf"])
        for _ in range(18):
            a = middle + s.random.normal(scale=(0.4, 0.4, 0.0), size=3) - [0, 0, 0.5]
            s.path(np.array([a, a + s.random.normal(scale=0.3, size=3) + [0, 0, 0.6],
                             a + s.random.normal(scale=0.7, size=3) + [0, 0, 0.9]]), 0.005, m["bark"], 5)
    s.tree((-1.0, 0.5, 0.0), 6.0, 2.0, m["bark"], m["leaf"], 6000)
    s.tree((8.5, 4.0, 0.0), 7.5, 2.4, m["bark"], m["leaf"], 6000, 0.07)
    s.part(thin=True)  # a bare sapling
    for _ in range(40):
        a = np.array([-4.0, -6.0, 0.1]) + [0, 0, s.random.uniform(0.4, 1.8)]
        s.tube(a, a + s.random.normal(scale=0.35, size=3) + [0, 0, 0.3], 0.004, m["bark"], 0.002, 5)
    s.tube((-4.0, -6.0, 0.0), (-4.0, -6.0, 2.2), 0.018, m["bark"], 0.006)
    return s


def railings() -> Solids:
    """A front of balconies with railings of four makes, lattices before windows, glazing, a fire escape, pipes, cables."""
    s = Solids(33)
    m = _materials(s)
    _flat(s, (-12, -11), (12, 0), 0.0, m["asphalt"])
    s.part()
    s.box((-12, -2.2, 0), (12, 0, 0.15), m["paving"])
    openings = _windows(6, 3, 0.9, 0.6, 3.4, 3.2, 1.5, 2.1)
    s.matrix = turned(0.0, (-10.0, 0.0, 0.15))
    s.wall(20, 10.5, openings, 0.3, m["bricks"], m["stone"], -1)
    for x0, z0, x1, z1 in openings:
        glazed(s, x0, z0, x1, z1, 0.2, m, 2, 2, 0.06)
        s.part()  # what is behind
        s.box((x0 - 0.5, 2.4, z0 - 0.4), (x1 + 0.5, 2.5, z1 + 0.4), m["white"])
        s.box((x0 - 0.5, 0.3, z0 - 0.42), (x1 + 0.5, 2.5, z0 - 0.4), m["floor"])
    s.matrix = np.eye(4)
    for k in range(6):
        x0, z = -9.6 + 3.4 * k, 3.4 + 3.2 * (k % 2)
        s.part()
        s.box((x0, -1.1, z), (x0 + 2.5, 0.0, z + 0.14), m["stone"])
        gap, bar = ((0.11, 0.016), (0.09, 0.012), (0.15, 0.03), (0.12, 0.02))[k % 4]
        for a, b in (((x0, -1.05), (x0 + 2.5, -1.05)), ((x0, -1.05), (x0, 0.0)), ((x0 + 2.5, -1.05), (x0 + 2.5, 0.0))):
            s.railing((*a, z + 0.14), (*b, z + 0.14), m["iron"] if k % 2 else m["white"], 1.0, gap, bar)
        if k % 3 == 0:
            s.part(thin=True)
            s.leaves(np.array([x0 + 1.2, -1.15, z + 0.7]) + s.random.normal(scale=(0.7, 0.08, 0.2), size=(900, 3)), 0.07,
                     m["leaf"])
    for k in (0, 2, 4):  # lattices of flat iron before windows below
        x0 = -9.1 + 3.4 * k
        s.part(thin=True)
        for t in np.arange(-2.1, 1.5, 0.16):
            for way in (1, -1):
                lo, hi = max(t, 0.0), min(t + 2.1, 1.5)
                if hi > lo:
                    xa, xb = (lo, hi) if way > 0 else (1.5 - lo, 1.5 - hi)
                    s.tube((x0 + xa, -0.05, 0.75 + lo - t), (x0 + xb, -0.05, 0.75 + hi - t), 0.008, m["iron"], sides=6)
    for x in (-10.6, 0.2, 10.4):
        s.part()
        s.tube((x, -0.12, 0.2), (x, -0.12, 10.4), 0.055, m["iron"])
    for k in range(14):  # an iron stair
        s.part(thin=True)
        y, z = -2.4 - 0.25 * k, 3.4 - 0.22 * k
        s.box((8.4, y, z), (9.4, y + 0.22, z + 0.03), m["iron"])
    s.railing((8.4, -5.9, 0.3), (8.4, -2.2, 3.5), m["iron"], 1.0, 0.2, 0.02)
    s.railing((9.4, -5.9, 0.3), (9.4, -2.2, 3.5), m["iron"], 1.0, 0.2, 0.02)
    s.part(thin=True)
    for z, sag in ((6.0, 0.5), (6.4, 0.3), (8.2, 0.6)):
        s.cable((-10.0, -0.2, z), (9.0, -10.5, z + 0.8), sag, 0.008, m["iron"])
    s.railing((-11, -7.5, 0), (4, -7.5, 0), m["iron"], 1.1, 0.1, 0.014)
    s.tree((-7.0, -8.8, 0.0), 5.0, 1.5, m["bark"], m["leaf"], 3500)
    _lamp(s, 3.0, -3.0, m, 4.5)
    s.part()
    s.box((-4.0, -5.0, 0.3), (0.0, -3.4, 0.9), m["poster"])
    s.blob((-2.0, -4.2, 0.9), (1.4, 0.75, 0.6), m["iron"], segments=40)
    return s


def lattice() -> Solids:
    """A statue of smooth parts before a garden lattice of thin laths with climbing roses, a hedge and a wall behind it."""
    s = Solids(34)
    m = _materials(s)
    _flat(s, (-5, -5), (5, 5), 0.0, m["earth"])
    s.part()
    s.lathe([(0.0, 0), (0.6, 0), (0.6, 0.12), (0.5, 0.2), (0.45, 0.8), (0.55, 0.9), (0.55, 1.0), (0.0, 1.0)], (0, 0, 0), m["stone"],
            64)
    s.part()
    s.lathe([(0.0, 1.0), (0.3, 1.0), (0.26, 1.3), (0.2, 1.6), (0.22, 1.8), (0.0, 1.85)], (0.0, 0.0, 0.0), m["marble"], 160, 11, 0.04)
    s.part()
    s.blob((0.0, 0.0, 2.0), (0.23, 0.15, 0.3), m["marble"], 0.06, 3.0)
    s.blob((0.02, -0.03, 2.46), (0.1, 0.12, 0.15), m["marble"], 0.05, 5.0)
    s.part()
    s.tube((0.2, 0.0, 2.2), (0.5, -0.05, 2.5), 0.06, m["marble"], 0.05, 32)
    s.tube((0.5, -0.05, 2.5), (0.55, -0.1, 2.85), 0.05, m["marble"], 0.035, 32)
    s.tube((-0.2, 0.0, 2.2), (-0.42, -0.1, 1.9), 0.06, m["marble"], 0.05, 32)
    s.tube((-0.42, -0.1, 1.9), (-0.2, -0.3, 1.85), 0.05, m["marble"], 0.04, 32)
    s.part(thin=True)
    s.tube((0.56, -0.1, 2.0), (0.56, -0.1, 3.4), 0.01, m["iron"])
    s.ring((-0.2, -0.32, 1.85), 0.12, 0.008, "y", m["iron"], 24)
    s.part(thin=True)
    for t in np.arange(-3.0, 3.01, 0.15):  # laths along both diagonals
        for way in (1.0, -1.0):
            lo, hi = max(-2.5, t - 1.25), min(2.5, t + 1.25)
            if hi - lo > 0.1:
                za, zb = 1.45 + way * (lo - t), 1.45 + way * (hi - t)
                s.tube((lo, 1.2 + 0.006 * way, za), (hi, 1.2 + 0.006 * way, zb), 0.009, m["wood"], sides=4)
    s.part()
    for x in (-2.5, -0.83, 0.83, 2.5):
        s.box((x - 0.04, 1.16, 0.0), (x + 0.04, 1.24, 2.9), m["wood"])
    s.box((-2.6, 1.15, 2.75), (2.6, 1.25, 2.85), m["wood"])
    s.part(thin=True)
    for x in (-1.8, 1.9):
        n = 1500
        s.leaves(np.column_stack([s.random.normal(x, 0.3, n), s.random.normal(1.15, 0.06, n), s.random.uniform(0.1, 2.6, n)]), 0.05,
                 m["leaf"])
        for _ in range(10):
            a = x + s.random.normal(scale=0.2)
            s.path(np.array([(x, 1.15, 0.0), (a, 1.1, 1.0), (a + 0.1, 1.18, 2.4)]), 0.006, m["bark"], 5)
    s.part(thin=True)
    n = 6000
    s.leaves(np.column_stack([s.random.uniform(-4.5, 4.5, n), s.random.normal(3.0, 0.2, n), s.random.uniform(0.0, 1.7, n)]), 0.05,
             m["leaf"])
    s.part()
    s.box((-5, 4.6, 0), (5, 5, 3.2), m["plaster"])
    for x in (-2.4, 2.4):
        s.part()
        s.lathe([(0.0, 0), (0.25, 0), (0.2, 0.1), (0.3, 0.45), (0.36, 0.5), (0.0, 0.48)], (x, -1.2, 0), m["roof"], 48)
        s.part(thin=True)
        for _ in range(160):
            turn, out = s.random.uniform(0, 2 * np.pi), s.random.uniform(0.1, 0.4)
            tip = (x + out * np.cos(turn), -1.2 + out * np.sin(turn), s.random.uniform(0.7, 1.3))
            s.triangles([[(x - 0.012, -1.2, 0.45), (x + 0.012, -1.2, 0.45), tip]], m["leaf"])
    s.railing((-3.5, -3.0, 0), (3.5, -3.0, 0), m["iron"], 0.6, 0.13, 0.015)
    return s


def trench() -> Solids:
    """A trench in steps with walls of fieldstones at its bottom, section strings, poles, a ladder, buckets, a sieve, a sheet."""
    s = Solids(35)
    m = _materials(s)

    def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        inner = np.maximum(np.abs(x) - 3.0, np.abs(y) - 2.0)
        outer = np.maximum(np.abs(x) - 4.2, np.abs(y) - 3.2)
        rough = 0.02 * np.sin(7.0 * x) * np.sin(6.0 * y) + 0.05 * np.sin(0.9 * x + y)
        return rough - 0.9 * np.clip(-outer / 0.12, 0.0, 1.0) - 0.8 * np.clip(-inner / 0.12, 0.0, 1.0)

    s.part()
    s.ground((-9, 9), (-8, 8), 0.06, m["earth"], height)
    for x0, y0, turn, length in ((-2.6, -0.4, 0.0, 4.0), (-0.5, -1.6, 90.0, 3.0), (1.4, -1.0, 60.0, 2.2)):
        s.matrix = turned(turn, (x0, y0, -1.7))
        for x in np.arange(0.0, length, 0.22):
            for row in range(int(s.random.integers(1, 4))):
                s.part()
                s.blob((x + s.random.normal(scale=0.02), s.random.normal(scale=0.03), 0.08 + 0.16 * row),
                       (0.13, s.random.uniform(0.12, 0.2), 0.09), m["stone"], 0.12, 2.0, 20)
        s.matrix = np.eye(4)
    for _ in range(130):
        s.part()
        x, y = s.random.uniform(-2.9, 2.9), s.random.uniform(-1.9, 1.9)
        r = s.random.uniform(0.02, 0.08, 3)
        s.blob((x, y, -1.7 + r[2] * 0.5), r, m["stone"], 0.1, 2.0, 14)
    s.part(thin=True)
    for x in np.arange(-5.0, 5.01, 2.0):  # the grid's strings and pegs
        s.cable((x, -3.9, 0.28), (x, 3.9, 0.28), 0.02, 0.0015, m["white"], 4)
    for y in np.arange(-3.0, 3.01, 2.0):
        s.cable((-5.0, y, 0.3), (5.0, y, 0.3), 0.02, 0.0015, m["white"], 4)
    for x in np.arange(-5.0, 5.01, 2.0):
        for y in (-3.9, 3.9):
            s.tube((x, y, -0.1), (x, y, 0.34), 0.008, m["iron"], sides=6)
    for x, y, z in ((-1.0, 0.6, -1.7), (2.3, 1.2, -1.7), (3.6, -1.0, -0.9)):  # ranging poles
        for k in range(4):
            s.part(thin=True)
            s.tube((x, y, z + 0.5 * k), (x, y, z + 0.5 * k + 0.5), 0.014, m[("red", "white")[k % 2]], sides=8)
    s.part(thin=True)  # a ladder
    for dx in (0.0, 0.4):
        s.tube((-2.4 + dx, 1.2, -1.7), (-2.4 + dx, 2.5, 0.9), 0.02, m["wood"], sides=8)
    for k in range(9):
        t = (k + 0.5) / 9.0
        s.tube((-2.4, 1.2 + 1.3 * t, -1.7 + 2.6 * t), (-2.0, 1.2 + 1.3 * t, -1.7 + 2.6 * t), 0.012, m["wood"], sides=6)
    for x, y, z in ((1.0, 0.4, -1.7), (-1.6, -1.2, -1.7), (4.0, 2.4, -0.9), (5.2, 0.3, 0.0)):
        s.part()
        s.lathe([(0.0, 0.02), (0.11, 0.0), (0.15, 0.3), (0.14, 0.3), (0.1, 0.03)], (x, y, z), m["iron"], 32)
        s.part(thin=True)
        turn = np.linspace(0.0, np.pi, 12)
        s.path(np.stack([x + 0.15 * np.cos(turn), np.full(12, y), z + 0.3 + 0.13 * np.sin(turn)], axis=1), 0.003, m["iron"], 5)
    s.part(thin=True)  # a sieve on legs
    for x in np.arange(6.0, 7.01, 0.025):
        s.tube((x, -2.0, 0.8), (x, -1.2, 0.8), 0.001, m["iron"], sides=4)
    for y in np.arange(-2.0, -1.19, 0.025):
        s.tube((6.0, y, 0.8), (7.0, y, 0.8), 0.001, m["iron"], sides=4)
    for x in (6.0, 7.0):
        for y in (-2.0, -1.2):
            s.tube((x, y, 0.0), (x, y, 0.9), 0.02, m["wood"], sides=6)
    s.part()
    s.blob((6.5, -1.6, 0.0), (0.9, 0.8, 0.4), m["earth"], 0.05, 3.0, 48)
    s.part()
    u, v = np.meshgrid(np.linspace(-1.5, 1.5, 30), np.linspace(-1.0, 1.0, 20))
    s.sheet(np.stack([u - 6.5, v + 2.0, 0.15 + 0.06 * np.sin(4 * u) * np.sin(5 * v)], axis=2), m["poster"])
    for _ in range(1200):
        if _ == 0:
            s.part(thin=True)
        x, y = s.random.uniform(-9, 9), s.random.choice((-1, 1)) * s.random.uniform(4.2, 8)
        z = float(height(np.array(x), np.array(y)))
        s.triangles([[(x, y, z), (x + 0.01, y, z), (x + s.random.normal(scale=0.05), y, z + s.random.uniform(0.1, 0.35))]],
                    m["grass"])
    return s


def machines() -> Solids:
    """A hall with tanks, pumps, racks of pipes with flanges and valves, a walkway of grating, trusses, ducts, cables, a fence."""
    s = Solids(36)
    m = _materials(s)
    steel, yellow = s.material("plain", (0.55, 0.56, 0.58), grain=0.15), s.material("plain", (0.75, 0.6, 0.12), grain=0.15)
    _flat(s, (-12, -7), (12, 7), 0.0, m["paving"])
    for a, b in (((-12, -7), (12, -7)), ((-12, 7), (12, 7)), ((-12, -7), (-12, 7)), ((12, -7), (12, 7))):
        s.part()
        s.quads([(*a, 0)], [(*b, 0)], [(*b, 7)], [(*a, 7)], m["blocks"])
    _flat(s, (-12, -7), (12, 7), 7.0, m["white"])
    for x in np.arange(-10.0, 10.1, 4.0):  # trusses
        s.part(thin=True)
        s.tube((x, -7, 5.6), (x, 7, 5.6), 0.04, steel)
        s.tube((x, -7, 6.6), (x, 7, 6.6), 0.04, steel)
        for k in range(14):
            s.tube((x, -7 + k, 5.6 + (k % 2)), (x, -6 + k, 6.6 - (k % 2)), 0.02, steel, sides=6)
    for x, y, r, h in ((-8.0, 3.5, 1.1, 4.0), (-4.5, 3.8, 0.9, 3.2), (8.5, -3.0, 1.2, 4.5)):
        s.part()
        s.lathe([(0.0, 0.5), (r, 0.7), (r, h), (0.6 * r, h + 0.35), (0.0, h + 0.45)], (x, y, 0), steel, 80)
        for z in (1.2, h - 0.4):
            s.ring((x, y, z), r + 0.01, 0.03, "z", m["iron"], 64)
        s.part(thin=True)
        for turn in np.radians((45, 135, 225, 315)):
            s.tube((x + 0.8 * r * np.cos(turn), y + 0.8 * r * np.sin(turn), 0), (x + 0.8 * r * np.cos(turn), y + 0.8 * r *
                   np.sin(turn), 0.9), 0.05, m["iron"])
        for k in range(12):
            s.tube((x - 0.2, y - r - 0.12, 0.3 + 0.3 * k), (x + 0.2, y - r - 0.12, 0.3 + 0.3 * k), 0.012, yellow, sides=6)
        for dx in (-0.2, 0.2):
            s.tube((x + dx, y - r - 0.12, 0.0), (x + dx, y - r - 0.12, h), 0.018, yellow, sides=6)
    for k, (r, y) in enumerate(((0.11, -5.9), (0.06, -5.6), (0.16, -5.2), (0.03, -4.9), (0.045, -4.75), (0.022, -4.65))):
        z = 3.4 + 0.04 * k
        s.part()
        paint = (steel, m["red"], m["white"], m["iron"], m["leaf"], yellow)[k]
        s.tube((-11.8, y, z), (11.8, y, z), r, paint, sides=20)
        for x in np.arange(-10.0, 11.0, 3.0):
            s.lathe([(r, 0.0), (1.7 * r, 0.0), (1.7 * r, 0.03), (r, 0.03)], (x, y, z + r), paint, 20)
        for x in np.arange(-9.0 + 0.7 * k, 11.0, 5.0):  # down to the floor
            s.tube((x, y, z), (x, y, 1.0), 0.8 * r, paint, sides=16)
            s.tube((x, y, 1.0), (x, y + 1.4, 1.0), 0.8 * r, paint, sides=16)
            s.part(thin=True)
            s.ring((x, y + 0.2, 1.5), 0.14, 0.008, "z", m["red"], 24)
            s.tube((x, y, 1.5), (x, y + 0.2, 1.5), 0.01, m["iron"], sides=6)
            s.part()
    for x in np.arange(-11.0, 11.1, 2.2):
        s.part(thin=True)
        s.box((x - 0.03, -6.2, 3.1), (x + 0.03, -4.4, 3.16), m["iron"])
        s.tube((x, -4.4, 0.0), (x, -4.4, 3.15), 0.03, m["iron"])
    s.part(thin=True)  # grating
    for x in np.arange(-6.0, 6.01, 0.06):
        s.box((x - 0.002, 0.0, 2.6), (x + 0.002, 1.2, 2.63), steel)
    for y in np.arange(0.0, 1.21, 0.1):
        s.box((-6.0, y - 0.003, 2.6), (6.0, y + 0.003, 2.62), steel)
    s.railing((-6.0, 0.0, 2.63), (6.0, 0.0, 2.63), yellow, 1.0, 0.9, 0.03, 1.5)
    s.railing((-6.0, 1.2, 2.63), (6.0, 1.2, 2.63), yellow, 1.0, 0.9, 0.03, 1.5)
    for x in (-6.0, -2.0, 2.0, 6.0):
        for y in (0.0, 1.2):
            s.part()
            s.box((x - 0.06, y - 0.06, 0), (x + 0.06, y + 0.06, 2.6), m["iron"])
    for x in (-2.5, 0.5, 3.5):
        s.part()
        s.box((x, -3.2, 0), (x + 1.6, -2.2, 0.25), m["stone"])
        s.matrix = turned(90.0, (x + 0.8, -2.7, 0.62)) @ np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]])
        s.lathe([(0.0, -0.6), (0.3, -0.58), (0.32, 0.1), (0.18, 0.15), (0.16, 0.6), (0.0, 0.62)], (0, 0, 0), m["leaf"], 48, 24, 0.02)
        s.matrix = np.eye(4)
        s.part(thin=True)
        s.cable((x + 0.8, -2.4, 0.9), (x + 0.8, -4.5, 3.2), 0.3, 0.009, m["iron"])
    s.part(thin=True)  # a mesh guard
    for x in np.arange(4.5, 7.51, 0.05):
        s.tube((x, 4.0, 0.1), (x, 4.0, 2.0), 0.002, steel, sides=4)
    for z in np.arange(0.1, 2.01, 0.05):
        s.tube((4.5, 4.0, z), (7.5, 4.0, z), 0.002, steel, sides=4)
    s.part()
    s.box((5.0, 5.0, 0), (7.0, 6.3, 1.8), m["poster"])
    s.tube((-12, 5.5, 5.0), (12, 5.5, 5.0), 0.35, steel, sides=32)
    for x in (-7.0, 0.0, 7.0):
        s.part(thin=True)
        s.tube((x, 2.5, 7.0), (x, 2.5, 5.2), 0.006, m["iron"], sides=5)
        s.part()
        s.lathe([(0.22, 4.9), (0.1, 5.1), (0.03, 5.2)], (x, 2.5, 0), m["white"], 32)
    return s
