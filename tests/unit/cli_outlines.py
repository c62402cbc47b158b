# SPDX-License-Identifier: GPL-3.0-or-later
"""Outlines of `patina draw`: tests that test_cli.py runs."""

import math
import random
import re

import cli
import cli_drawings

FAR = (5000000.0, 4999000.0, 250.0)
SPACING, SIGMA, PIXEL = 0.006, 0.002, 0.004
WALL, BOX, DEPTH = (1.0, 0.7), (0.3, 0.2, 0.75, 0.5), 0.2  # the wall, a box in front of it (x0, z0, x1, z1), and how far in front


def facade(name, lean=0.0):
    """A box in front of a wall, with noise and 0.5 % wrong points. lean: how much nearer the box is at its top than at its bottom."""
    chance = random.Random(5)
    points = []
    for width, height, x0, z0, away, slope in ((*WALL, 0, 0, 0, 0), (BOX[2] - BOX[0], BOX[3] - BOX[1], *BOX[:2], DEPTH, lean / (BOX[3] - BOX[1]))):
        for i in range(round(width / SPACING)):
            for j in range(round(height / SPACING)):
                x, z = (i + chance.random()) * SPACING, (j + chance.random()) * SPACING
                off = chance.gauss(0, SIGMA) if chance.random() > 0.005 else chance.choice((-1, 1)) * chance.uniform(0.02, 0.5)
                points.append((FAR[0] + x0 + x, FAR[1] - away - slope * z + off, FAR[2] + z0 + z))
    return cli.write_ply(name, points, kind="double")


def sides(x0, z0, x1, z1):
    return [((x0, z0), (x1, z0)), ((x1, z0), (x1, z1)), ((x1, z1), (x0, z1)), ((x0, z1), (x0, z0))]


def along(a, b, step=0.002):
    count = max(1, round(math.dist(a, b) / step))
    return [tuple(a[k] + (i + 0.5) / count * (b[k] - a[k]) for k in range(len(a))) for i in range(count)]


def from_sides(place, lines):
    """Distance of a place from the nearest of the straight lines."""
    least = math.inf
    for a, b in lines:
        d = [b[k] - a[k] for k in range(2)]
        t = sum((place[k] - a[k]) * d[k] for k in range(2)) / (d[0] ** 2 + d[1] ** 2)
        t = min(max(t, 0), 1)
        least = min(least, math.hypot(*(place[k] - a[k] - t * d[k] for k in range(2))))
    return least


def drawn(path):
    """Places along all outlines of a DXF file: x, z and the distance before the wall."""
    places = []
    for vertices, closed in cli_drawings.read_polylines(path, "outline"):
        own = [(x - FAR[0], z - FAR[2], FAR[1] - y) for x, y, z in vertices]
        for a, b in zip(own, own[1:] + own[:1] if closed else own[1:], strict=False):
            places += along(a, b)
    return places


def test_outlines():
    """A box in front of a wall: both rectangles within a pixel and half a spacing, and at their depth."""
    facade("facade.ply")
    done = cli.run("draw", "facade.ply", "--plane=elevation:0", "--outlines", f"--pixel={PIXEL}", "--scale=20", "-o", "out.dxf", "-o", "out.svg")
    told = re.search(r"out.dxf: 1:20, outlines of ([\d.]+) m", done.stderr)
    assert told, done.stderr
    places, allowed = drawn("out.dxf"), PIXEL + SPACING / 2
    wanted = sides(*BOX) + sides(0, 0, *WALL)
    false = sum(from_sides(place, wanted) > allowed for place in places) / len(places)
    truth = [place for side in wanted for place in along(*side)]
    grid = {}
    for x, z, _ in places:
        grid.setdefault((math.floor(x / allowed), math.floor(z / allowed)), []).append((x, z))

    def missing(place):
        cell = [math.floor(value / allowed) for value in place]
        return all(math.dist(place, other) > allowed for i in (-1, 0, 1) for j in (-1, 0, 1) for other in grid.get((cell[0] + i, cell[1] + j), ()))

    missed = sum(map(missing, truth)) / len(truth)
    assert missed <= 0.05 and false <= 0.02, (missed, false)
    for x, z, depth in places:
        if from_sides((x, z), sides(*BOX)) <= allowed:
            assert abs(depth - DEPTH) < SPACING, (x, z, depth)
