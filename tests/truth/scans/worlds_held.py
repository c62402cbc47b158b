# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds that campaigns scan and that nothing is tuned or trained on. They are of another make than those of worlds.py: curved
fronts, vaults and timber instead of straight walls. Metres, z up."""

from __future__ import annotations

import numpy as np

from .places import _materials
from .solids import GLASS, MIRROR, Solids


def _arch(s: Solids, a: np.ndarray, b: np.ndarray, spring: float, rise: float, wide: float, material: int, pieces: int = 14
          ) -> None:
    """A rib of square section over the ground line from a to b (two coordinates each), pointed."""
    t = np.linspace(0.0, 1.0, pieces + 1)
    z = spring + rise * np.sqrt(np.maximum(1.0 - np.abs(2.0 * t - 1.0) ** 1.8, 0.0))
    line = np.column_stack([(1 - t)[:, None] * a + t[:, None] * b, z])
    s.path(line, wide, material, 8)


def lane() -> Solids:
    """A bent lane between curved fronts with shop windows, shutters, awnings, signs, stalls, bicycles, wires; puddles."""
    s = Solids(41)
    m = _materials(s)

    def middle(x: np.ndarray) -> np.ndarray:
        return 2.2 * np.sin(0.16 * x)

    x = np.arange(-16.0, 16.01, 0.5)
    s.part()
    s.sheet(np.stack([np.stack([x, middle(x) + side, 0.0 * x + 0.04 * abs(side) ** 0.5], axis=1)
                      for side in np.linspace(-2.6, 2.6, 9)]), m["paving"])
    for k in range(5):
        s.part(gloss=MIRROR)
        px, py = s.random.uniform(-10, 10), s.random.uniform(-1.2, 1.2)
        turn = np.linspace(0.0, 2.0 * np.pi, 25)
        r = s.random.uniform(0.3, 0.7) * (1.0 + 0.2 * np.sin(3.0 * turn))
        rim = np.stack([px + 1.6 * r * np.cos(turn), middle(px) + py + 0.6 * r * np.sin(turn), np.full(25, 0.075)], axis=1)
        s.triangles(np.stack([np.broadcast_to(rim.mean(axis=0), (24, 3)), rim[:-1], rim[1:]], axis=1), m["asphalt"])
    for side in (-1, 1):
        at, number = -16.0, 0
        while at < 15.0:
            width = s.random.uniform(3.2, 5.0)
            tall = s.random.uniform(6.5, 9.5)
            front = m[("plaster", "bricks", "white", "stone", "blocks")[s.random.integers(5)]]
            a = np.array([at, middle(np.array(at)) + 2.6 * side])
            b = np.array([at + width, middle(np.array(at + width)) + 2.6 * side])
            along = (b - a) / np.linalg.norm(b - a)
            s.matrix = np.eye(4)  # x along the front, y into the house
            s.matrix[:2, 0], s.matrix[:2, 1] = along, np.array([-along[1], along[0]]) * side
            s.matrix[2, 2], s.matrix[:2, 3] = 1.0, a
            length = float(np.linalg.norm(b - a))
            shop = number % 2 == 0
            low = [(0.4, 0.5, length - 1.6, 2.4), (length - 1.2, 0.0, length - 0.3, 2.3)] if shop else \
                [(0.6, 1.0, 1.6, 2.3), (length - 1.5, 0.0, length - 0.5, 2.3)]
            high = [(0.5 + 1.5 * k, z, 1.3 + 1.5 * k, z + 1.4) for z in np.arange(3.4, tall - 1.6, 2.6)
                    for k in range(int((length - 0.6) / 1.5))]
            s.wall(length, tall, low + high, 0.22, front, m["stone"], -1)
            s.part()
            s.box((length - 1.2, 0.15, 0.0), (length - 0.3, 0.2, 2.3), m["wood"])
            for k, (x0, z0, x1, z1) in enumerate(low[:1] + high):
                s.part(gloss=GLASS)
                s.quads([(x0, 0.17, z0)], [(x1, 0.17, z0)], [(x1, 0.17, z1)], [(x0, 0.17, z1)], m["glass"])
                s.part(thin=True)
                for px in np.linspace(x0, x1, 3):
                    s.box((px - 0.02, 0.14, z0), (px + 0.02, 0.2, z1), m["white"])
                s.box((x0, 0.14, 0.5 * (z0 + z1) - 0.02), (x1, 0.2, 0.5 * (z0 + z1) + 0.02), m["white"])
                if k and s.random.random() < 0.6:  # shutters, ajar
                    s.part()
                    s.quads([(x0, 0.0, z0)], [(x0 - 0.35, -0.2, z0)], [(x0 - 0.35, -0.2, z1)], [(x0, 0.0, z1)], m["leaf"])
                    s.quads([(x1, 0.0, z0)], [(x1 + 0.35, -0.2, z0)], [(x1 + 0.35, -0.2, z1)], [(x1, 0.0, z1)], m["leaf"])
                elif k and s.random.random() < 0.5:
                    s.part(thin=True)
                    s.box((x0, -0.25, z0), (x1, -0.22, z0 + 0.03), m["iron"])
                    s.box((x0, -0.25, z0 + 0.5), (x1, -0.22, z0 + 0.53), m["iron"])
                    for px in np.arange(x0, x1, 0.1):
                        s.tube((px, -0.235, z0), (px, -0.235, z0 + 0.5), 0.006, m["iron"], sides=5)
            s.part()  # rooms
            s.box((0.05, 2.2, 0.0), (length - 0.05, 2.3, tall), m["poster"])
            for z in np.arange(0.0, tall, 2.6):
                s.box((0.05, 0.23, z), (length - 0.05, 2.2, z + 0.05), m["floor"])
            if shop:
                s.part()
                s.quads([(0.2, 0.0, 2.9)], [(length - 1.3, 0.0, 2.9)], [(length - 1.3, -1.0, 2.45)], [(0.2, -1.0, 2.45)], m["red"])
                s.part(thin=True)
                for px in (0.25, length - 1.35):
                    s.tube((px, 0.0, 2.3), (px, -1.0, 2.45), 0.01, m["iron"], sides=5)
                for k in range(5):  # goods within
                    s.part()
                    s.box((0.5 + 0.4 * k, 0.4, 0.6), (0.75 + 0.4 * k, 0.8, 0.8 + 0.15 * (k % 3)), m[("red", "leaf", "white")[k % 3]])
            else:
                s.part(thin=True)
                s.tube((0.3, 0.0, 3.0), (0.3, -0.8, 3.0), 0.012, m["iron"], sides=6)
                s.part()
                s.box((0.28, -0.8, 2.3), (0.32, -0.2, 2.9), m["poster"])
            s.part()
            s.tube((0.02, -0.06, 0.0), (0.02, -0.06, tall), 0.045, m["iron"])
            s.box((0.0, -0.35, tall), (length, 0.3, tall + 0.2), m["roof"])
            at, number = at + width, number + 1
    s.matrix = np.eye(4)
    for px, py in ((-9.0, 1.2), (-8.5, 1.25), (6.0, -1.4)):  # bicycles
        y = float(middle(np.array(px))) + py
        s.part(thin=True)
        for dx in (0.0, 1.05):
            s.ring((px + dx, y, 0.35), 0.33, 0.012, "y", m["iron"], 40)
            for turn in np.radians(np.arange(0, 180, 20)):
                c, d = 0.33 * np.cos(turn), 0.33 * np.sin(turn)
                s.tube((px + dx - c, y, 0.35 - d), (px + dx + c, y, 0.35 + d), 0.0015, m["iron"], sides=4)
        for p, q in (((0, 0.35), (0.3, 0.85)), ((0.3, 0.85), (0.8, 0.8)), ((0.45, 0.3), (0.8, 0.8)), ((0.45, 0.3), (0.3, 0.85)),
                     ((0.8, 0.95), (1.05, 0.35)), ((0, 0.35), (0.45, 0.3))):
            s.tube((px + p[0], y, p[1]), (px + q[0], y, q[1]), 0.016, m["red"], sides=8)
        s.tube((px + 0.8, y - 0.25, 0.98), (px + 0.8, y + 0.25, 0.98), 0.012, m["iron"], sides=6)
    for px in (-4.0, -2.0):  # stalls
        y = float(middle(np.array(px))) - 1.3
        s.part()
        s.box((px, y, 0.8), (px + 1.5, y + 0.8, 0.85), m["wood"])
        s.sheet(np.array([[(px - 0.1, y - 0.1, 2.1), (px + 1.6, y - 0.1, 2.1)], [(px - 0.1, y + 0.4, 2.4), (px + 1.6, y + 0.4, 2.4)],
                          [(px - 0.1, y + 0.9, 2.1), (px + 1.6, y + 0.9, 2.1)]]), m["white"])
        s.part(thin=True)
        for dx in (0.0, 1.5):
            for dy in (0.0, 0.8):
                s.tube((px + dx, y + dy, 0.05), (px + dx, y + dy, 2.15), 0.018, m["iron"], sides=6)
        s.part()
        for k in range(25):
            s.blob((px + s.random.uniform(0.1, 1.4), y + s.random.uniform(0.1, 0.7), 0.9), (0.05, 0.05, 0.05), m["red"], segments=12)
    s.part(thin=True)
    for px in (-12.0, -5.0, 1.0, 8.0):
        y = float(middle(np.array(px)))
        s.cable((px, y - 2.5, 6.0), (px + 1.0, y + 2.7, 5.8), 0.35, 0.006, m["iron"])
        for k in range(1, 8):
            s.tube((px + k / 8, y - 2.5 + 0.65 * k, 5.6), (px + k / 8, y - 2.5 + 0.65 * k, 5.35), 0.003, m["iron"], sides=4)
    s.tree((11.5, float(middle(np.array(11.5))) + 1.0, 0.0), 4.5, 1.3, m["bark"], m["leaf"], 3000)
    s.part()
    s.box((17.0, -6.0, 0.0), (17.4, 8.0, 9.0), m["bricks"])
    s.box((-17.4, -8.0, 0.0), (-17.0, 6.0, 9.0), m["stone"])
    return s


def chapel() -> Solids:
    """Two bays of ribbed vault on shafts, traceried windows without glass and one with, pews, candle stands, a lamp on chains,
    an altar with figures."""
    s = Solids(42)
    m = _materials(s)
    rows, depth, half = (-8.0, -4.0, 0.0, 4.0, 8.0), 8.0, 3.6
    s.part()
    s.quads([(-half, -depth, 0)], [(half, -depth, 0)], [(half, depth, 0)], [(-half, depth, 0)], m["floor"])
    for side in (-1.0, 1.0):
        for k, y in enumerate(rows[:-1]):
            y0, y1, sill, top = y + 1.2, y + 2.8, 1.8, 5.2
            x, deep = half * side, 0.35 * side
            s.part()
            for lo, hi, z0, z1 in ((y, y0, 0, 7), (y1, y + 4, 0, 7), (y0, y1, 0, sill), (y0, y1, top, 7)):
                s.quads([(x, lo, z0)], [(x, hi, z0)], [(x, hi, z1)], [(x, lo, z1)], m["plaster"])
            s.part()
            for lo, hi, z0, z1 in ((y0, y0, sill, top), (y1, y1, sill, top)):
                s.quads([(x, lo, z0)], [(x + deep, hi, z0)], [(x + deep, hi, z1)], [(x, lo, z1)], m["stone"])
            for z in (sill, top):
                s.quads([(x, y0, z)], [(x, y1, z)], [(x + deep, y1, z)], [(x + deep, y0, z)], m["stone"])
            s.part(thin=True)  # tracery
            px = x + 0.2 * side
            for yy in np.linspace(y0, y1, 4):
                s.tube((px, yy, sill), (px, yy, 4.4), 0.035, m["stone"], sides=8)
            turn = np.linspace(0.0, 2.0 * np.pi, 25)
            for cy, cz, r in ((y0 + 0.53, 4.4, 0.26), (y0 + 1.07, 4.4, 0.26), (y0 + 0.8, 4.83, 0.3)):
                s.path(np.stack([np.full(25, px), cy + r * np.cos(turn), cz + r * np.sin(turn)], axis=1), 0.03, m["stone"], 6)
            if k % 2:
                s.part(gloss=GLASS)
                s.quads([(px, y0, sill)], [(px, y1, sill)], [(px, y1, top)], [(px, y0, top)], m["glass"])
                s.part(thin=True)
                for z in np.arange(sill + 0.3, top, 0.3):
                    s.tube((px, y0, z), (px, y1, z), 0.006, m["iron"], sides=5)
        for y in rows:
            s.part()
            for dx, dy in ((0.0, 0.0), (0.11, 0.11), (0.11, -0.11)):
                s.tube((half * side - (0.1 + dx) * side, y + dy, 0), (half * side - (0.1 + dx) * side, y + dy, 4.6), 0.08, m["stone"],
                       sides=16)
            s.lathe([(0.2, 4.5), (0.28, 4.65), (0.24, 4.75)], (half * side - 0.18 * side, y, 0), m["stone"], 32)
    for y in rows:
        s.part()
        _arch(s, np.array([-half, y]), np.array([half, y]), 4.6, 2.6, 0.12, m["stone"])
    for y in rows[:-1]:
        s.part()
        _arch(s, np.array([-half, y]), np.array([half, y + 4.0]), 4.6, 2.7, 0.09, m["stone"])
        _arch(s, np.array([-half, y + 4.0]), np.array([half, y]), 4.6, 2.7, 0.09, m["stone"])
    s.part()
    t = np.linspace(0.0, 1.0, 25)
    z = 4.7 + 2.75 * np.sqrt(np.maximum(1.0 - np.abs(2.0 * t - 1.0) ** 1.8, 0.0))
    s.sheet(np.stack([np.stack([-half + 2 * half * t, np.full(25, y), z + 0.1], axis=1) for y in np.linspace(-depth, depth, 9)]),
            m["white"])
    for y in (-depth, depth):
        s.part()
        s.quads([(-half, y, 0)], [(half, y, 0)], [(half, y, 8)], [(-half, y, 8)], m["blocks"])
    for y in np.arange(-5.5, 3.0, 1.0):
        for x in (-2.6, 0.6):
            s.part()
            s.box((x, y, 0.42), (x + 2.0, y + 0.4, 0.46), m["wood"])
            s.box((x, y - 0.04, 0.0), (x + 2.0, y, 0.95), m["wood"])
            s.box((x, y, 0), (x + 0.05, y + 0.4, 0.7), m["wood"])
            s.box((x + 1.95, y, 0), (x + 2.0, y + 0.4, 0.7), m["wood"])
    s.part()
    s.box((-1.3, 6.0, 0), (1.3, 7.0, 1.0), m["marble"])
    s.box((-1.5, 5.9, 1.0), (1.5, 7.1, 1.1), m["marble"])
    for x in (-1.0, -0.4, 0.4, 1.0):
        s.part(thin=True)
        s.lathe([(0.0, 1.1), (0.07, 1.1), (0.015, 1.2), (0.015, 1.5), (0.04, 1.55), (0.012, 1.56), (0.012, 1.8), (0.0, 1.82)],
                (x, 6.5, 0), m["iron"], 16)
    s.part()
    s.blob((0.0, 7.5, 2.3), (0.28, 0.2, 0.6), m["poster"], 0.08, 3.0, 64)
    s.blob((0.0, 7.45, 3.05), (0.12, 0.13, 0.16), m["poster"], 0.04, 5.0, 48)
    for x in (-2.6, 2.6):  # stands of candles
        s.part(thin=True)
        s.tube((x, 4.6, 0), (x, 4.6, 1.3), 0.018, m["iron"], sides=8)
        s.ring((x, 4.6, 1.3), 0.3, 0.01, "z", m["iron"], 40)
        for k in range(14):
            turn = 2.0 * np.pi * k / 14
            s.tube((x + 0.3 * np.cos(turn), 4.6 + 0.3 * np.sin(turn), 1.3), (x + 0.3 * np.cos(turn), 4.6 + 0.3 * np.sin(turn), 1.5),
                   0.008, m["white"], sides=6)
        for k in range(3):
            turn = 2.0 * np.pi * k / 3
            s.tube((x, 4.6, 0.3), (x + 0.35 * np.cos(turn), 4.6 + 0.35 * np.sin(turn), 0.0), 0.012, m["iron"], sides=6)
    for y in (-4.0, 1.0):  # wheels of light on three chains
        s.part(thin=True)
        s.ring((0.0, y, 3.0), 0.8, 0.016, "z", m["iron"], 64)
        s.ring((0.0, y, 3.0), 0.45, 0.01, "z", m["iron"], 48)
        for k in range(3):
            turn = 2.0 * np.pi * k / 3
            s.tube((0.8 * np.cos(turn), y + 0.8 * np.sin(turn), 3.0), (0.0, y, 4.3), 0.005, m["iron"], sides=5)
        s.tube((0.0, y, 4.3), (0.0, y, 7.2), 0.006, m["iron"], sides=5)
        for k in range(12):
            turn = 2.0 * np.pi * k / 12
            s.tube((0.8 * np.cos(turn), y + 0.8 * np.sin(turn), 3.0), (0.8 * np.cos(turn), y + 0.8 * np.sin(turn), 3.18), 0.012,
                   m["white"], sides=6)
    s.part()  # outside
    for side in (-1.0, 1.0):
        s.box((side * 9.0, -12, -0.5), (side * 9.3, 12, 4.0), m["bricks"])
        s.quads([(side * 3.9, -12, -0.3)], [(side * 9, -12, -0.3)], [(side * 9, 12, -0.3)], [(side * 3.9, 12, -0.3)], m["grass"])
    return s


def loft() -> Solids:
    """A timber loft: rafters, purlins, struts, a wall of slats with gaps, a ladder, tools, baskets, ropes, sacks, cobwebs of
    wire, a dormer window."""
    s = Solids(43)
    m = _materials(s)
    s.part()
    for k in range(40):  # boards
        y = -4.0 + 0.2 * k
        s.box((-7, y + 0.004, -0.03 + s.random.uniform(-0.004, 0.004)), (7, y + 0.196, 0.0), m["wood"])
    s.box((-7, -4, -0.3), (7, 4, -0.2), m["plaster"])
    for side in (-1.0, 1.0):
        s.part()
        s.quads([(-7, 4.2 * side, 0.6)], [(7, 4.2 * side, 0.6)], [(7, 0, 4.8)], [(-7, 0, 4.8)], m["roof"])
        s.quads([(-7, 4.0 * side, -0.2)], [(7, 4.0 * side, -0.2)], [(7, 4.0 * side, 0.9)], [(-7, 4.0 * side, 0.9)], m["blocks"])
        for x in np.arange(-6.6, 6.7, 0.9):
            s.part()
            s.tube((x, 4.1 * side, 0.6), (x, 0.0, 4.65), 0.06, m["wood"], sides=4)
        s.part()
        s.tube((-7, 2.1 * side, 2.5), (7, 2.1 * side, 2.5), 0.1, m["wood"], sides=4)
        for x in np.arange(-6.0, 6.1, 3.0):
            s.part()
            s.box((x - 0.08, 2.02 * side, 0.0), (x + 0.08, 2.18 * side, 2.45), m["bark"])
            s.part(thin=True)
            s.tube((x, 2.1 * side, 1.6), (x + 0.8, 2.1 * side, 2.45), 0.05, m["wood"], sides=4)
            s.tube((x, 2.1 * side, 1.6), (x - 0.8, 2.1 * side, 2.45), 0.05, m["wood"], sides=4)
    for x in np.arange(-6.0, 6.1, 3.0):
        s.part()
        s.box((x - 0.07, -2.1, 2.5), (x + 0.07, 2.1, 2.66), m["wood"])
        s.tube((x, 0.0, 2.6), (x, 0.0, 4.6), 0.07, m["wood"], sides=4)
    s.part()
    s.triangles([[(7, -4.2, 0.6), (7, 4.2, 0.6), (7, 0, 4.8)]], m["bricks"])
    s.quads([(7, -4, -0.2)], [(7, 4, -0.2)], [(7, 4.2, 0.6)], [(7, -4.2, 0.6)], m["bricks"])
    s.part(thin=True)  # slats with light between
    for y in np.arange(-3.9, 3.95, 0.16):
        top = 0.8 + 4.0 * (1.0 - abs(y) / 4.2)
        s.box((-7.02, y, 0.0), (-6.98, y + 0.11, top), m["wood"])
    s.part()
    s.box((-11, -8, -3.0), (-10.8, 8, 6.0), m["plaster"])
    s.part(thin=True)
    for dy in (0.0, 0.45):
        s.tube((2.0, 1.0 + dy, 0.0), (3.2, 1.0 + dy, 3.2), 0.025, m["wood"], sides=8)
    for k in range(11):
        t = (k + 0.5) / 11
        s.tube((2.0 + 1.2 * t, 1.0, 3.2 * t), (2.0 + 1.2 * t, 1.45, 3.2 * t), 0.015, m["wood"], sides=6)
    for k, x in enumerate((-5.4, -4.9, -4.4, -3.9)):  # tools against a post
        s.part(thin=True)
        s.tube((x, -3.4, 0.0), (x + 0.1, -3.85, 1.5), 0.014, m["wood"], sides=6)
        if k % 2:
            for d in np.linspace(-0.15, 0.15, 5):
                s.tube((x + 0.1 + d, -3.85, 1.5), (x + 0.1 + d, -3.8, 1.75), 0.005, m["iron"], sides=5)
        else:
            s.box((x - 0.02, -3.95, 1.45), (x + 0.22, -3.93, 1.75), m["iron"])
    for x, y in ((-2.0, 3.0), (-1.2, 3.2), (-1.6, 2.5), (5.0, -2.9), (5.6, -2.3)):
        s.part()
        s.blob((x, y, 0.35), (0.34, 0.28, 0.4), m["poster"], 0.08, 2.0, 40)
    for x, y in ((0.5, -2.8), (1.3, -3.1), (4.5, 2.6)):
        s.part()
        s.lathe([(0.0, 0.02), (0.22, 0.0), (0.32, 0.35), (0.3, 0.35), (0.2, 0.04)], (x, y, 0), m["wood"], 40)
        s.part(thin=True)
        turn = np.linspace(0.0, np.pi, 14)
        s.path(np.stack([x + 0.3 * np.cos(turn), np.full(14, y), 0.35 + 0.28 * np.sin(turn)], axis=1), 0.01, m["wood"], 6)
    s.part(thin=True)
    for x0, x1, y in ((-6, -3, 0.6), (-3, 0, -0.5), (0, 3, 0.4), (3, 6, -0.8)):
        s.cable((x0, y, 2.5), (x1, y, 2.5), 0.5, 0.008, m["poster"])
    for k in range(7):
        x = -4.5 + 1.3 * k
        s.tube((x, 0.2, 2.5), (x, 0.2, 1.9), 0.003, m["iron"], sides=4)
        s.ring((x, 0.2, 1.84), 0.06, 0.006, "xy"[k % 2], m["iron"], 20)
    s.part()
    s.box((3.6, -1.0, 0.75), (5.4, 0.0, 0.8), m["wood"])
    for x in (3.7, 5.3):
        for y in (-0.9, -0.1):
            s.box((x - 0.04, y - 0.04, 0), (x + 0.04, y + 0.04, 0.75), m["wood"])
    s.lathe([(0.0, 0.8), (0.1, 0.8), (0.13, 0.95), (0.05, 1.1), (0.06, 1.15)], (4.2, -0.5, 0), m["roof"], 40)
    s.part(thin=True)  # a wheel with spokes
    s.ring((-0.6, -3.5, 0.62), 0.58, 0.035, "y", m["wood"], 60)
    for turn in np.radians(np.arange(0, 360, 30)):
        s.tube((-0.6, -3.5, 0.62), (-0.6 + 0.56 * np.cos(turn), -3.5, 0.62 + 0.56 * np.sin(turn)), 0.016, m["wood"], sides=6)
    s.part(thin=True)
    n = 5000
    s.leaves(np.column_stack([s.random.normal(1.8, 0.7, n), s.random.normal(3.0, 0.4, n), np.abs(s.random.normal(0.0, 0.25, n))]),
             0.09, m["grass"])
    s.part(gloss=GLASS)
    s.quads([(6.97, -0.6, 2.2)], [(6.97, 0.6, 2.2)], [(6.97, 0.6, 3.2)], [(6.97, -0.6, 3.2)], m["glass"])
    s.part(thin=True)
    for y in (-0.6, 0.0, 0.6):
        s.box((6.94, y - 0.025, 2.2), (6.99, y + 0.025, 3.2), m["wood"])
    return s
