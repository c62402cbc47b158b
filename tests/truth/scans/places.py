# SPDX-License-Identifier: GPL-3.0-or-later
"""The virtual scenes' shapes and looks. Metres, z up. Frozen as scenes.py says."""

from __future__ import annotations

import numpy as np

from .solids import Place, Solids, turned


def _materials(s: Solids) -> dict[str, int]:
    return {
        "bricks": s.material("bricks", (0.62, 0.33, 0.25), (0.67, 0.52, 0.45), 0.25, 0.3),
        "plaster": s.material("clouds", (0.85, 0.79, 0.66), (0.70, 0.63, 0.52), 0.8, 0.2),
        "white": s.material("plain", (0.88, 0.87, 0.84), grain=0.12),
        "stone": s.material("clouds", (0.70, 0.67, 0.60), (0.56, 0.53, 0.48), 0.25, 0.35),
        "blocks": s.material("bricks", (0.68, 0.64, 0.56), (0.54, 0.51, 0.46), 0.9, 0.35),
        "paving": s.material("tiles", (0.50, 0.49, 0.47), (0.39, 0.38, 0.37), 0.4, 0.35),
        "asphalt": s.material("clouds", (0.30, 0.30, 0.31), (0.38, 0.37, 0.36), 0.3, 0.5),
        "wood": s.material("wood", (0.50, 0.33, 0.19), (0.40, 0.26, 0.15), 0.15, 0.3),
        "glass": s.material("clouds", (0.16, 0.20, 0.24), (0.30, 0.36, 0.42), 0.6, 0.1),
        "iron": s.material("plain", (0.14, 0.14, 0.15), grain=0.2),
        "red": s.material("plain", (0.60, 0.12, 0.10), grain=0.15),
        "poster": s.material("checks", (0.88, 0.86, 0.78), (0.35, 0.40, 0.60), 0.1, 0.1),
        "grass": s.material("clouds", (0.34, 0.42, 0.18), (0.45, 0.46, 0.24), 0.4, 0.5),
        "leaf": s.material("clouds", (0.26, 0.44, 0.14), (0.40, 0.52, 0.18), 0.5, 0.3),
        "bark": s.material("wood", (0.36, 0.28, 0.21), (0.22, 0.17, 0.13), 0.12, 0.5),
        "roof": s.material("tiles", (0.58, 0.27, 0.19), (0.46, 0.22, 0.15), 0.25, 0.3),
        "earth": s.material("clouds", (0.47, 0.39, 0.29), (0.36, 0.33, 0.24), 0.7, 0.4),
        "marble": s.material("clouds", (0.86, 0.84, 0.80), (0.74, 0.73, 0.73), 0.2, 0.12),
        "carpet": s.material("checks", (0.55, 0.22, 0.18), (0.62, 0.36, 0.26), 0.16, 0.3),
        "floor": s.material("tiles", (0.58, 0.42, 0.27), (0.48, 0.34, 0.21), 0.2, 0.3),
    }


def _flat(s: Solids, lo: Place, hi: Place, z: float, material: int) -> None:
    s.part()
    s.quads([(lo[0], lo[1], z)], [(hi[0], lo[1], z)], [(hi[0], hi[1], z)], [(lo[0], hi[1], z)], material)


def _windows(columns: int, rows: int, x: float, z: float, dx: float, dz: float, width: float, height: float
             ) -> list[tuple[float, float, float, float]]:
    return [(x + i * dx, z + k * dz, x + i * dx + width, z + k * dz + height) for i in range(columns) for k in range(rows)]


def _lamp(s: Solids, x: float, y: float, m: dict[str, int], height: float = 5.0) -> None:
    s.part()
    s.tube((x, y, 0), (x, y, height), 0.07, m["iron"], 0.04)
    s.tube((x, y, 0), (x, y, 0.8), 0.11, m["iron"])
    s.tube((x, y, height), (x, y + 0.9, height + 0.2), 0.03, m["iron"])
    s.blob((x, y + 0.95, height + 0.15), (0.18, 0.3, 0.1), m["white"], segments=24)


def _car(s: Solids, x: float, y: float, m: dict[str, int], paint: str = "red") -> None:
    s.part()
    s.box((x, y, 0.3), (x + 4.2, y + 1.7, 0.85), m[paint])
    s.blob((x + 2.1, y + 0.85, 0.85), (1.5, 0.8, 0.6), m["glass"], segments=40)
    for dx in (0.8, 3.3):
        for dy in (0.1, 1.6):
            s.ring((x + dx, y + dy, 0.32), 0.24, 0.09, "y", m["iron"], 24)


def street() -> Solids:
    """A street between two fronts, barred windows, a balcony, lamps, cars: as in the trial that began all this."""
    s = Solids(11)
    m = _materials(s)
    _flat(s, (-14, -4), (26, 4), 0.0, m["asphalt"])
    for y0, y1 in ((4.0, 6.0), (-6.0, -4.0)):
        s.part()
        s.box((-14, y0, -0.2), (26, y1, 0.14), m["paving"])
    s.matrix = turned(0.0, (-12.0, 6.0, 0.14))
    s.wall(16, 9, _windows(5, 1, 1.0, 1.1, 3.0, 3.0, 1.2, 1.7), 0.35, m["bricks"], m["stone"], m["glass"], m["iron"])
    s.matrix = turned(0.0, (4.0, 6.3, 0.14))
    s.wall(14, 7, [*_windows(4, 2, 1.2, 1.0, 3.3, 3.0, 1.3, 1.8)], 0.3, m["plaster"], m["stone"], m["glass"])
    s.matrix = turned(180.0, (22.0, -6.0, 0.14))
    s.wall(34, 6, [*_windows(11, 1, 1.0, 0.0, 3.0, 3.0, 1.4, 2.6)], 0.5, m["blocks"], m["stone"], m["wood"], m["iron"])
    s.matrix = np.eye(4)
    s.railing((-11.0, 4.15, 0.14), (-5.0, 4.15, 0.14), m["iron"])
    s.railing((8.0, 4.15, 0.14), (13.0, 4.15, 0.14), m["iron"], gap=0.16)
    s.railing((-9.0, -4.15, 0.14), (-1.0, -4.15, 0.14), m["iron"])
    s.tree((1.0, -4.8, 0.1), 4.5, 1.5, m["bark"], m["leaf"], 4000)
    s.part(thin=True)
    for x, y in ((-4.5, 4.3), (5.5, -4.3), (12.5, 4.3)):
        s.tube((x, y, 0.1), (x, y, 2.6), 0.03, m["iron"])
    s.part()
    for x, y in ((-4.5, 4.3), (5.5, -4.3), (12.5, 4.3)):
        s.box((x - 0.02, y - 0.3, 2.1), (x, y + 0.3, 2.6), m["poster"])
    s.part()
    s.box((5.0, 5.0, 3.6), (9.4, 6.3, 3.75), m["stone"])
    s.railing((5.0, 5.05, 3.75), (9.4, 5.05, 3.75), m["iron"])
    s.part()
    s.box((-12.0, 5.8, 8.9), (4.0, 6.2, 9.3), m["stone"])
    for x in (-8.0, 3.0, 14.0):
        _lamp(s, x, 4.5, m)
    _car(s, -4.0, 1.9, m)
    _car(s, 8.0, -3.8, m, "white")
    s.part(thin=True)
    s.cable((-8, 4.5, 5.0), (3.0, 4.5, 5.0), 0.4, 0.012, m["iron"])
    s.cable((3.0, 4.5, 5.0), (10.0, -6.0, 6.0), 0.5, 0.012, m["iron"])
    s.part()
    for x in np.arange(-4, 8, 1.5):
        s.tube((x, 4.2, 0), (x, 4.2, 1.0), 0.06, m["iron"])
    s.part()
    s.box((12.0, 4.4, 0.14), (13.2, 4.9, 1.9), m["poster"])
    s.tree((18.0, 5.0, 0.1), 6.0, 2.0, m["bark"], m["leaf"], 5000)
    return s


def facade() -> Solids:
    """One house near by: two storeys of deep barred windows, a cornice, a balcony, a door with steps."""
    s = Solids(12)
    m = _materials(s)
    _flat(s, (-9, -9), (9, 0), 0.0, m["paving"])
    s.matrix = turned(0.0, (-7.0, 0.0, 0.0))
    s.wall(14, 8.5, [*_windows(2, 1, 1.2, 1.0, 2.6, 3.0, 1.3, 1.9), (6.2, 0.4, 7.8, 3.0),
                     *_windows(2, 1, 9.3, 1.0, 2.6, 3.0, 1.3, 1.9)], 0.45, m["plaster"], m["stone"], m["glass"], m["iron"])
    s.matrix = turned(0.0, (-7.0, -0.001, 8.5))
    s.wall(14, 1.0, [(0.5 + 0.6 * k, 0.25, 0.8 + 0.6 * k, 0.75) for k in range(22)], 0.2, m["stone"], m["stone"], m["stone"])
    s.matrix = np.eye(4)
    for k in range(3):
        s.part()
        s.box((-1.2 + 0.2 * k, -1.2 + 0.35 * k, 0.13 * k), (1.2 - 0.2 * k, 0.0, 0.13 * (k + 1)), m["stone"])
    s.part()
    s.box((-3.0, -1.2, 4.1), (3.0, 0.0, 4.3), m["stone"])
    s.railing((-3.0, -1.15, 4.3), (3.0, -1.15, 4.3), m["iron"])
    s.railing((-3.0, -1.15, 4.3), (-3.0, -0.05, 4.3), m["iron"])
    s.railing((3.0, -1.15, 4.3), (3.0, -0.05, 4.3), m["iron"])
    for x in np.arange(-6.8, 6.9, 0.5):
        s.part()
        s.box((x, -0.25, 8.1), (x + 0.16, 0.0, 8.5), m["stone"])
    for x in (-2.2, 2.2):
        s.part()
        s.lathe([(0.0, 0), (0.3, 0), (0.25, 0.1), (0.3, 0.45), (0.42, 0.5), (0.4, 0.55), (0.0, 0.5)], (x, -1.6, 0), m["roof"])
        s.part(thin=True)
        s.leaves(np.array([x, -1.6, 0.9]) + s.random.normal(scale=(0.25, 0.25, 0.22), size=(1200, 3)), 0.07, m["leaf"])
    return s


def room() -> Solids:
    """A furnished room with a window and an open door; the camera is within."""
    s = Solids(13)
    m = _materials(s)
    _flat(s, (0, 0), (6, 5), 0.0, m["floor"])
    _flat(s, (0, 0), (6, 5), 2.7, m["white"])
    _flat(s, (2.0, 1.2), (4.4, 3.4), 0.01, m["carpet"])
    s.matrix = turned(0.0, (0.0, 5.0, 0.0))
    s.wall(6, 2.7, [(1.0, 0.9, 2.6, 2.3), (3.6, 0.9, 5.2, 2.3)], 0.4, m["plaster"], m["white"], -1, m["iron"])
    s.matrix = turned(90.0, (0.0, 0.0, 0.0))
    s.wall(5, 2.7, [(1.0, 0.0, 1.9, 2.1)], 0.15, m["white"], m["wood"], -1)
    s.matrix = np.eye(4)
    s.part()
    s.box((-3.0, -0.5, -0.2), (-2.9, 5.5, 2.8), m["bricks"])
    s.box((-2.9, -0.5, -0.2), (0.0, 5.5, 0.0), m["paving"])
    s.part()
    s.quads([(6, 0, 0)], [(6, 5, 0)], [(6, 5, 2.7)], [(6, 0, 2.7)], m["plaster"])
    s.part()
    s.quads([(0, 0, 0)], [(6, 0, 0)], [(6, 0, 2.7)], [(0, 0, 2.7)], m["bricks"])
    s.part()
    s.box((2.4, 1.7, 0.72), (4.0, 2.7, 0.76), m["wood"])
    for x in (2.47, 3.93):
        for y in (1.77, 2.63):
            s.box((x - 0.03, y - 0.03, 0), (x + 0.03, y + 0.03, 0.72), m["wood"])
    for x, y, turn in ((2.7, 1.3, 0), (3.6, 1.3, 10), (2.8, 3.1, 180), (3.7, 3.2, 200)):
        s.matrix = turned(turn, (x, y, 0))
        s.part()
        s.box((-0.22, -0.22, 0.43), (0.22, 0.22, 0.46), m["wood"])
        s.part(thin=True)
        for dx in (-0.2, 0.2):
            s.tube((dx, 0.2, 0), (dx, 0.2, 0.43), 0.015, m["iron"])
            s.tube((dx, -0.2, 0), (dx, -0.2, 0.95), 0.015, m["iron"])
        for z in (0.6, 0.7, 0.8, 0.9):
            s.box((-0.2, -0.21, z), (0.2, -0.19, z + 0.04), m["wood"])
        s.matrix = np.eye(4)
    for k in range(5):
        s.part()
        s.box((5.65, 0.4, 0.3 + 0.45 * k), (6.0, 2.4, 0.33 + 0.45 * k), m["wood"])
        y = 0.42
        while y < 2.25:
            thick, tall = s.random.uniform(0.02, 0.06), s.random.uniform(0.2, 0.38)
            s.box((5.7, y, 0.33 + 0.45 * k), (5.95, y + thick, 0.33 + 0.45 * k + tall),
                  m[("red", "poster", "wood", "white", "leaf")[s.random.integers(5)]])
            y += thick + s.random.uniform(0.001, 0.03)
    s.part()
    s.box((4.2, 0.3, 0.0), (5.4, 0.95, 0.45), m["red"])
    s.blob((4.8, 0.6, 0.5), (0.6, 0.35, 0.15), m["red"], segments=40)
    s.part(thin=True)
    s.tube((3.2, 2.2, 2.7), (3.2, 2.2, 1.9), 0.008, m["iron"])
    s.tube((0.5, 4.5, 0), (0.5, 4.5, 1.5), 0.014, m["iron"])
    s.part()
    s.lathe([(0.25, 1.6), (0.12, 1.9), (0.0, 1.9)], (3.2, 2.2, 0), m["white"])
    s.lathe([(0.2, 1.4), (0.1, 1.7)], (0.5, 4.5, 0), m["white"])
    s.lathe([(0.0, 0), (0.15, 0), (0.2, 0.2), (0.12, 0.4), (0.15, 0.5)], (5.4, 4.4, 0), m["roof"])
    s.part(thin=True)
    s.leaves(np.array([5.4, 4.4, 0.9]) + s.random.normal(scale=(0.2, 0.2, 0.22), size=(700, 3)), 0.12, m["leaf"])
    s.part()
    s.box((1.2, 0.0, 1.1), (2.2, 0.03, 1.9), m["poster"])
    return s


def railing() -> Solids:
    """A terrace with railings of 24 mm bars, a mesh fence and cables; what stands behind must stay seen."""
    s = Solids(14)
    m = _materials(s)
    _flat(s, (-8, -3), (8, 4), 0.0, m["paving"])
    _flat(s, (-25, 4), (25, 22), -1.5, m["grass"])
    s.part()
    s.quads([(-8, 4, -1.5)], [(8, 4, -1.5)], [(8, 4, 0)], [(-8, 4, 0)], m["blocks"])
    s.railing((-8, 3.9, 0), (8, 3.9, 0), m["iron"])
    s.railing((-8, -3, 0), (-8, 3.9, 0), m["iron"])
    s.railing((8, -3, 0), (8, 3.9, 0), m["iron"], gap=0.2)
    s.part()
    s.quads([(-8, -3, 0)], [(8, -3, 0)], [(8, -3, 4)], [(-8, -3, 4)], m["bricks"])
    s.part(thin=True)
    for x in np.arange(-6.0, 6.01, 0.05):
        s.tube((x, 10, -1.5), (x, 10, 0.0), 0.0025, m["iron"], sides=4)
    for z in np.arange(-1.45, 0.01, 0.2):
        s.tube((-6, 10, z), (6, 10, z), 0.003, m["iron"], sides=4)
    s.part()
    for x in np.arange(-6.0, 6.01, 2.0):
        s.tube((x, 10, -1.5), (x, 10, 0.2), 0.03, m["iron"])
    for x in (-7.0, 7.0):
        s.part()
        s.tube((x, 6, -1.5), (x, 6, 5.5), 0.1, m["wood"])
        s.box((x - 0.6, 5.95, 4.9), (x + 0.6, 6.05, 5.0), m["wood"])
    s.part(thin=True)
    for dx in (-0.5, 0.5):
        for z in (5.0, 4.6):
            s.cable((-7 + dx, 6, z), (7 + dx, 6, z), 0.35, 0.01, m["iron"])
    s.cable((-7, 6, 5.2), (-2, -3, 3.8), 0.2, 0.008, m["iron"])
    s.part()
    s.box((-3, 15, -1.5), (4, 19, 1.8), m["plaster"])
    s.box((-3.3, 14.7, 1.8), (4.3, 19.3, 2.0), m["roof"])
    s.tree((8, 12, -1.5), 5.0, 1.6, m["bark"], m["leaf"], 4000)
    s.part()
    s.box((-4.5, 0.5, 0.42), (-2.7, 1.0, 0.47), m["wood"])
    for x in (-4.3, -2.9):
        s.box((x - 0.04, 0.55, 0), (x + 0.04, 0.95, 0.42), m["iron"])
    s.part()
    s.lathe([(0.0, 0), (0.4, 0), (0.35, 0.5), (0.5, 0.6), (0.0, 0.55)], (3.5, 1.0, 0), m["stone"])
    s.part(thin=True)
    s.leaves(np.array([3.5, 1.0, 0.9]) + s.random.normal(scale=0.22, size=(900, 3)), 0.08, m["leaf"])
    return s


def columns() -> Solids:
    """A portico: fluted columns with rings and ornaments, steps, a coffered wall behind."""
    s = Solids(15)
    m = _materials(s)
    _flat(s, (-12, -14), (12, 6), -0.6, m["paving"])
    for k in range(4):
        s.part()
        s.box((-8 + 0.3 * k, -4 + 0.3 * k, -0.6 + 0.15 * k), (8 - 0.3 * k, 3, -0.45 + 0.15 * k), m["stone"])
    for x in np.linspace(-6, 6, 6):
        s.part()
        s.box((x - 0.55, -3.05, 0), (x + 0.55, -1.95, 0.2), m["marble"])
        s.lathe([(0.5, 0.2), (0.52, 0.28), (0.45, 0.36), (0.47, 0.44), (0.42, 0.5)], (x, -2.5, 0), m["marble"])
        s.lathe([(0.42, 0.5), (0.42, 2.0), (0.36, 4.5)], (x, -2.5, 0), m["marble"], 160, 20, 0.035)
        s.lathe([(0.36, 4.5), (0.42, 4.55), (0.38, 4.62), (0.55, 4.9), (0.6, 4.95)], (x, -2.5, 0), m["marble"])
        s.box((x - 0.62, -3.12, 4.95), (x + 0.62, -1.88, 5.15), m["marble"])
        s.part()
        for turn in np.radians((45, 135, 225, 315)):
            s.ring((x + 0.5 * np.cos(turn), -2.5 + 0.5 * np.sin(turn), 4.8), 0.1, 0.03, "y", m["marble"], 24)
    s.part()
    s.box((-7, -3.2, 5.15), (7, 3, 5.6), m["stone"])
    for x in np.arange(-6.8, 6.81, 0.8):
        s.part()
        s.box((x - 0.2, -3.28, 5.2), (x - 0.08, -3.2, 5.55), m["stone"])
        s.box((x - 0.05, -3.28, 5.2), (x + 0.07, -3.2, 5.55), m["stone"])
        s.blob((x + 0.35, -3.2, 5.4), (0.13, 0.06, 0.13), m["stone"], segments=24)
    s.part()
    s.triangles([[(-7.3, -3.3, 5.6), (7.3, -3.3, 5.6), (0, -3.3, 7.6)]], m["stone"])
    s.part()
    s.quads([(-7.3, -3.3, 5.6), (7.3, -3.3, 5.6)], [(0, -3.3, 7.6), (0, -3.3, 7.6)], [(0, 3, 7.6), (0, 3, 7.6)],
            [(-7.3, 3, 5.6), (7.3, 3, 5.6)], m["roof"])
    s.matrix = turned(0.0, (-7.0, 1.5, 0.0))
    s.wall(14, 5.15, [(1.0, 0.8, 3.0, 3.2), (6.0, 0.0, 8.0, 3.6), (11.0, 0.8, 13.0, 3.2)], 0.6, m["blocks"], m["marble"],
           m["wood"])
    s.matrix = np.eye(4)
    for x in (-6.0, -3.6, 1.2, 3.6):
        s.railing((x + 0.5, -2.5, 0), (x + 1.9, -2.5, 0), m["iron"], 1.9, 0.1, 0.02)
    for x in (-2.4, 2.4):
        s.part(thin=True)
        s.tube((x, -0.6, 5.15), (x, -0.6, 2.9), 0.01, m["iron"])
        for turn in np.radians(np.arange(0, 360, 30)):
            s.tube((x, -0.6, 3.5), (x + 0.5 * np.cos(turn), -0.6 + 0.5 * np.sin(turn), 2.8), 0.008, m["iron"], sides=6)
        s.part()
        s.ring((x, -0.6, 2.8), 0.5, 0.02, "z", m["iron"])
    for x in (-8.5, -2.4, 2.4, 8.5):
        s.part()
        s.lathe([(0.0, 0), (0.35, 0), (0.3, 0.1), (0.4, 0.6), (0.0, 0.55)], (x, -4.6, -0.6), m["roof"])
        s.part(thin=True)
        s.leaves(np.array([x, -4.6, 0.5]) + s.random.normal(scale=(0.3, 0.3, 0.4), size=(1500, 3)), 0.09, m["leaf"])
    for x in (-11, 11):
        s.tree((x, -6.5, -0.6), 7.0, 2.2, m["bark"], m["leaf"], 6000)
    s.part(thin=True)
    for x0 in np.arange(-10, 10, 2.0):
        s.cable((x0, -6.0, 0.3), (x0 + 2.0, -6.0, 0.3), 0.25, 0.014, m["red"], 12)
    s.part()
    for x0 in np.arange(-10, 10.1, 2.0):
        s.tube((x0, -6.0, -0.6), (x0, -6.0, 0.35), 0.03, m["iron"])
    s.part()
    s.blob((-5.0, 1.6, 1.5), (0.35, 0.3, 0.5), m["marble"], 0.08, 4.0)
    s.blob((5.0, 1.6, 1.5), (0.35, 0.3, 0.5), m["marble"], 0.08, 6.0)
    return s


def trees() -> Solids:
    """A park: trees with leaves, a hedge, grass, a bench, a path."""
    s = Solids(16)
    m = _materials(s)
    s.part()
    s.ground((-20, 20), (-20, 20), 0.5, m["grass"], lambda x, y: 0.3 * np.sin(0.3 * x) * np.cos(0.25 * y))
    s.part()
    s.ground((-1.2, 1.2), (-20, 20), 0.3, m["earth"], lambda x, y: 0.04 + 0.3 * np.sin(0.3 * x) * np.cos(0.25 * y))
    for x, y, tall, crown in ((-5, 2, 7, 2.4), (4.5, 5, 6, 2.0), (6.5, -4, 8, 2.6), (-7, -6, 5, 1.7), (-3.5, 11, 7, 2.2)):
        s.tree((x, y, 0.0), tall, crown, m["bark"], m["leaf"], 7000)
    s.part(thin=True)
    s.leaves(np.column_stack([s.random.uniform(-9, -3, 5000), s.random.normal(-9.5, 0.25, 5000),
                              s.random.uniform(0.05, 1.1, 5000)]), 0.06, m["leaf"])
    s.part()
    s.box((2.0, 0.0, 0.55), (3.8, 0.5, 0.6), m["wood"])
    for z in (0.75, 0.95):
        s.box((2.0, 0.5, z), (3.8, 0.54, z + 0.12), m["wood"])
    for x in (2.2, 3.6):
        s.box((x - 0.03, 0.05, 0), (x + 0.03, 0.54, 1.1), m["iron"])
    _lamp(s, -1.8, 4.0, m, 3.5)
    s.part(thin=True)
    for _ in range(700):
        x, y = s.random.uniform(-4, 8), s.random.uniform(-8, 8)
        z = 0.3 * np.sin(0.3 * x) * np.cos(0.25 * y)
        s.triangles([[(x, y, z), (x + 0.03, y, z), (x + 0.05, y + 0.05, z + s.random.uniform(0.15, 0.4))]], m["leaf"])
    s.part()
    s.box((-19.5, 15, -0.5), (19.5, 15.4, 2.4), m["bricks"])
    return s


def _house(s: Solids, m: dict[str, int], x: float, y: float, turn: float, size: tuple[float, float, float]) -> None:
    w, d, h = size
    s.matrix = turned(turn, (x, y, -0.5))
    s.part()
    s.box((-w / 2, -d / 2, 0), (w / 2, d / 2, h), m["plaster"])
    s.part()
    e, top = 0.4, h + 0.45 * d
    s.quads([(-w / 2 - e, -d / 2 - e, h - 0.2), (-w / 2 - e, d / 2 + e, h - 0.2)], [(w / 2 + e, -d / 2 - e, h - 0.2), (w / 2 + e, d / 2 + e, h - 0.2)],
            [(w / 2 + e, 0, top), (w / 2 + e, 0, top)], [(-w / 2 - e, 0, top), (-w / 2 - e, 0, top)], m["roof"])
    s.part()
    s.triangles([[(-w / 2, -d / 2, h), (-w / 2, d / 2, h), (-w / 2, 0, top - 0.1)], [(w / 2, -d / 2, h), (w / 2, d / 2, h), (w / 2, 0, top - 0.1)]],
                m["plaster"])
    s.part()
    s.box((w / 4, 0.3, h), (w / 4 + 0.6, 0.9, top + 0.8), m["bricks"])
    s.matrix = np.eye(4)


def _hills(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return 1.5 * np.sin(0.06 * x) * np.cos(0.05 * y) + 0.4 * np.sin(0.31 * x + 0.2 * y) + 2.0 * (y > 25) * np.clip((y - 25) / 4, 0, 1)


def terrain() -> Solids:
    """Hills with a wall along a scarp, a house, trees, a mast; scanned from the air."""
    s = Solids(17)
    m = _materials(s)
    s.part()
    s.ground((-50, 50), (-50, 50), 1.0, m["grass"], _hills)
    s.part()
    s.box((-50, 24.6, -1.5), (50, 25.0, 3.2), m["blocks"])
    s.part()
    s.box((-30, -0.3, -2), (30, 0.3, 2.0), m["blocks"])
    _house(s, m, 12, 12, 20, (12, 8, 4.5))
    _house(s, m, -15, -14, -35, (9, 7, 4))
    for x, y, tall in ((-8, 10, 9), (-14, 14, 8), (25, 5, 10), (3, -15, 7), (20, -20, 9)):
        s.tree((x, y, float(_hills(np.array(x), np.array(y)))), tall, 0.32 * tall, m["bark"], m["leaf"], 5000, 0.22)
    s.part()
    s.tube((-25, 10, -2), (-25, 10, 12), 0.15, m["iron"], 0.08)
    s.tube((28, 10, -2), (28, 10, 12), 0.15, m["iron"], 0.08)
    s.part(thin=True)
    s.cable((-25, 10, 12), (28, 10, 12), 2.0, 0.02, m["iron"], 40)
    return s


def statue() -> Solids:
    """A figure of smooth parts with folds on a plinth before a wall; from photographs."""
    s = Solids(18)
    m = _materials(s)
    _flat(s, (-3, -3), (3, 2), 0.0, m["paving"])
    s.part()
    s.quads([(-3, 2, 0)], [(3, 2, 0)], [(3, 2, 4)], [(-3, 2, 4)], m["bricks"])
    s.part()
    s.box((-0.5, -0.5, 0), (0.5, 0.5, 0.9), m["stone"])
    s.box((-0.58, -0.58, 0.8), (0.58, 0.58, 0.9), m["stone"])
    s.part()
    s.lathe([(0.0, 0.9), (0.38, 0.9), (0.36, 1.1), (0.27, 1.5), (0.2, 1.75), (0.0, 1.8)], (0, 0, 0), m["marble"], 240, 14, 0.05)
    s.part()
    s.blob((0, 0, 1.95), (0.24, 0.16, 0.33), m["marble"], 0.05, 3.0)
    s.part()
    s.blob((0, -0.02, 2.45), (0.11, 0.13, 0.16), m["marble"], 0.04, 6.0)
    s.ring((0, -0.01, 2.52), 0.12, 0.02, "z", m["marble"])
    s.part()
    s.tube((0.22, 0, 2.15), (0.42, -0.15, 1.85), 0.07, m["marble"], 0.055, 40)
    s.tube((0.42, -0.15, 1.85), (0.35, -0.45, 2.05), 0.055, m["marble"], 0.04, 40)
    s.tube((-0.22, 0, 2.15), (-0.33, 0.02, 1.75), 0.07, m["marble"], 0.055, 40)
    s.tube((-0.33, 0.02, 1.75), (-0.3, -0.12, 1.45), 0.055, m["marble"], 0.045, 40)
    s.blob((0.35, -0.48, 2.08), (0.05, 0.06, 0.05), m["marble"], segments=40)
    s.part(thin=True)
    s.tube((0.36, -0.5, 0.95), (0.36, -0.5, 2.9), 0.012, m["iron"])
    s.part()
    s.ring((0.36, -0.5, 2.9), 0.06, 0.01, "x", m["iron"])
    s.railing((-1.6, -1.6, 0), (1.6, -1.6, 0), m["iron"], 0.8)
    return s


def stairs() -> Solids:
    """Two flights between walls, a landing, a railing that climbs; an arch behind."""
    s = Solids(19)
    m = _materials(s)
    _flat(s, (-6, -6), (6, 0), 0.0, m["paving"])
    for k in range(12):
        s.part()
        s.box((-1.2, 0.3 * k, -0.2), (1.2, 0.3 * k + 0.3, 0.17 * (k + 1)), m["stone"])
    s.part()
    s.box((-1.2, 3.6, -0.2), (4.0, 5.2, 2.04), m["stone"])
    for k in range(8):
        s.part()
        s.box((1.5 + 0.3 * k, 3.7, 2.0), (1.8 + 0.3 * k, 5.2, 2.04 + 0.17 * (k + 1)), m["blocks"])
    s.railing((-1.15, 0.1, 0.2), (-1.15, 3.6, 2.1), m["iron"])
    s.railing((1.15, 0.1, 0.2), (1.15, 3.6, 2.1), m["iron"])
    s.railing((1.15, 3.65, 2.04), (1.6, 3.65, 2.04), m["iron"])
    s.railing((1.5, 3.7, 2.1), (3.9, 3.7, 3.4), m["iron"])
    s.part()
    s.box((-1.8, 0, 0), (-1.4, 5.2, 3.5), m["bricks"])
    s.matrix = turned(0.0, (-1.8, 5.2, 0.0))
    s.wall(6.5, 6, [(0.9, 2.04, 2.3, 4.5), (4.0, 3.9, 5.4, 5.4)], 0.4, m["plaster"], m["stone"], m["wood"], m["iron"])
    s.matrix = np.eye(4)
    s.part()
    s.box((-6, -0.1, 0), (-1.8, 0.2, 3.0), m["blocks"])
    s.part()
    s.lathe([(0.0, 0), (0.25, 0), (0.3, 0.35), (0.2, 0.4)], (2.5, -1.0, 0), m["roof"])
    s.part(thin=True)
    s.leaves(np.array([2.5, -1.0, 0.75]) + s.random.normal(scale=0.2, size=(800, 3)), 0.09, m["leaf"])
    _lamp(s, 4.5, -2.0, m, 4.0)
    return s


def court() -> Solids:
    """A courtyard: an arcade of columns, a tree, a well with an iron frame, washing lines, barred windows."""
    s = Solids(20)
    m = _materials(s)
    _flat(s, (-8, -8), (8, 8), 0.0, m["paving"])
    s.matrix = turned(0.0, (-8.0, 8.0, 0.0))
    s.wall(16, 7, _windows(5, 2, 1.2, 1.0, 3.0, 3.2, 1.1, 1.6), 0.4, m["plaster"], m["stone"], m["glass"], m["iron"])
    s.matrix = turned(-90.0, (8.0, 8.0, 0.0))
    s.wall(16, 7, _windows(5, 1, 1.2, 3.9, 3.0, 3.2, 1.1, 1.6), 0.3, m["bricks"], m["stone"], m["wood"])
    s.matrix = np.eye(4)
    for y in np.linspace(-6.5, 6.5, 6):
        s.part()
        s.box((-5.8, y - 0.35, 0), (-5.1, y + 0.35, 0.15), m["stone"])
        s.lathe([(0.3, 0.15), (0.26, 0.3), (0.22, 2.6), (0.32, 2.8)], (-5.45, y, 0), m["marble"], 48)
    s.part()
    s.box((-5.8, -8, 2.8), (-5.1, 8, 3.3), m["stone"])
    s.part()
    s.quads([(-5.1, -8, 3.3)], [(-5.1, 8, 3.3)], [(-8, 8, 4.6)], [(-8, -8, 4.6)], m["roof"])
    s.part()
    s.quads([(-8, -8, 0)], [(-8, 8, 0)], [(-8, 8, 4.6)], [(-8, -8, 4.6)], m["blocks"])
    s.tree((3.0, 2.0, 0.0), 6.0, 2.2, m["bark"], m["leaf"], 9000)
    s.part()
    s.lathe([(0.9, 0), (0.9, 0.8), (0.7, 0.8), (0.7, 0.1), (0.0, 0.1)], (-1.0, -1.5, 0), m["stone"])
    s.part(thin=True)
    for x in (-1.8, -0.2):
        s.tube((x, -1.5, 0.8), (x, -1.5, 2.2), 0.015, m["iron"])
    s.tube((-1.8, -1.5, 2.2), (-0.2, -1.5, 2.2), 0.02, m["iron"])
    s.tube((-1.0, -1.5, 2.2), (-1.0, -1.5, 0.9), 0.006, m["iron"])
    s.part(thin=True)
    for z in (3.0, 3.2):
        s.cable((-5.1, 5, z), (8, 4, z + 0.3), 0.25, 0.006, m["iron"])
    for k in range(6):
        s.part()
        x = -3.0 + 1.6 * k
        s.quads([(x, 4.78 - 0.12 * k, 2.9)], [(x + 0.7, 4.73 - 0.12 * k, 2.9)], [(x + 0.7, 4.7 - 0.12 * k, 2.1)], [(x, 4.8 - 0.12 * k, 2.1)],
                m[("poster", "white", "red")[k % 3]])
    s.railing((2.0, -8, 0), (2.0, -4, 0), m["iron"])
    s.railing((2.0, -4, 0), (8.0, -4, 0), m["iron"])
    return s


def village() -> Solids:
    """Houses, lanes, trees and walls; from the air."""
    s = Solids(21)
    m = _materials(s)
    s.part()
    s.ground((-45, 45), (-45, 45), 1.0, m["earth"], lambda x, y: 0.8 * np.sin(0.05 * x + 0.04 * y))
    for x, y, turn, size in ((-20, -15, 10, (10, 8, 5)), (-5, -18, -5, (9, 7, 4.5)), (12, -14, 15, (12, 8, 6)), (-16, 8, 80, (11, 7, 5)),
                             (3, 10, 25, (8, 8, 4)), (20, 12, 60, (14, 9, 5.5)), (-30, 25, 0, (10, 7, 4)), (5, 30, 5, (10, 8, 5))):
        _house(s, m, x, y, turn, size)
    for x, y, tall in ((-8, -4, 8), (10, 2, 9), (28, -8, 10), (-28, -2, 7), (14, 25, 8), (-10, 22, 9)):
        s.tree((x, y, 0), tall, 0.32 * tall, m["bark"], m["leaf"], 4500, 0.22)
    s.part()
    for a, b in (((-30, -3), (-12, -2)), ((-2, 0), (20, 3)), ((-3, 16), (-3, 35))):
        s.box((min(a[0], b[0]), min(a[1], b[1]), -1), (max(a[0], b[0]) + 0.3, max(a[1], b[1]) + 0.3, 1.8), m["blocks"])
    s.part()
    s.tube((0, -8, -1), (0, -8, 9), 0.12, m["wood"])
    s.tube((30, 0, -1), (30, 0, 9), 0.12, m["wood"])
    s.part(thin=True)
    s.cable((0, -8, 8.8), (30, 0, 8.8), 0.8, 0.015, m["iron"], 40)
    return s


def fountain() -> Solids:
    """A basin with a bowl on a twisted shaft and figures, an iron fence around; from photographs."""
    s = Solids(22)
    m = _materials(s)
    _flat(s, (-4, -4), (4, 4), 0.0, m["paving"])
    s.part()
    s.lathe([(1.6, 0), (1.6, 0.5), (1.7, 0.55), (1.7, 0.62), (1.4, 0.62), (1.4, 0.2), (0.0, 0.2)], (0, 0, 0), m["stone"], 96)
    s.part()
    s.lathe([(0.3, 0.2), (0.3, 0.5), (0.18, 0.6), (0.2, 1.3), (0.3, 1.4)], (0, 0, 0), m["marble"], 160, 10, 0.04)
    s.lathe([(0.2, 1.4), (0.8, 1.65), (0.85, 1.7), (0.78, 1.7), (0.0, 1.55)], (0, 0, 0), m["marble"], 96)
    s.part()
    s.blob((0, 0, 1.95), (0.16, 0.16, 0.35), m["marble"], 0.1, 3.0)
    s.blob((0, 0, 2.4), (0.1, 0.1, 0.13), m["marble"], 0.04, 6.0)
    for turn in np.radians((0, 90, 180, 270)):
        s.part()
        s.blob((0.75 * np.cos(turn), 0.75 * np.sin(turn), 0.45), (0.16, 0.16, 0.25), m["marble"], 0.09, 4.0, 64)
        s.part(thin=True)
        s.tube((0.85 * np.cos(turn), 0.85 * np.sin(turn), 0.5), (0.5 * np.cos(turn), 0.5 * np.sin(turn), 1.0), 0.014, m["iron"])
    for a, b in (((-2.2, -2.2, 0), (2.2, -2.2, 0)), ((2.2, -2.2, 0), (2.2, 2.2, 0)), ((-2.2, 2.2, 0), (-2.2, -2.2, 0))):
        s.railing(a, b, m["iron"], 0.7, 0.15)
    s.part()
    s.box((-3.9, 3.4, 0), (3.9, 3.8, 2.2), m["blocks"])
    s.part()
    s.box((2.8, -3.2, 0.42), (3.6, -1.2, 0.48), m["wood"])
    s.box((2.9, -3.0, 0), (3.5, -2.9, 0.42), m["stone"])
    s.box((2.9, -1.5, 0), (3.5, -1.4, 0.42), m["stone"])
    return s
