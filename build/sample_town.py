# SPDX-License-Identifier: GPL-3.0-or-later
"""A small town of points for the sample scenes: houses with gabled roofs around a square, a church, a wall, trees, ground.
Nothing in it is measured. The same points every time. Meters, z up."""
import numpy as np

GROUND, TREES, HOUSES = 2, 5, 6  # LAS classes
WALLS = np.array([(0.86, 0.80, 0.68), (0.80, 0.66, 0.50), (0.84, 0.84, 0.80), (0.72, 0.76, 0.74), (0.87, 0.74, 0.62), (0.70, 0.56, 0.48)])
ROOFS = np.array([(0.58, 0.27, 0.19), (0.50, 0.24, 0.18), (0.40, 0.30, 0.27), (0.63, 0.33, 0.22)])
TIMBER, GLASS, DOOR, STONE = (0.30, 0.22, 0.17), (0.16, 0.21, 0.27), (0.25, 0.30, 0.22), (0.66, 0.62, 0.55)
# Middle x, y, length, depth, height of the eaves, turn in degrees. A gable's ridge runs along the length.
PLACES = ((-13, 9, 8, 6.5, 5.6, 0), (-4, 10, 7, 6.5, 6.8, 0), (18.5, 9, 7.5, 6.5, 5.2, -12), (-15.5, -1, 7.5, 6, 5.0, 90), (-14.5, -10, 8, 6, 6.0, 84),
          (15.5, -1, 8, 6.5, 6.2, 92), (14, -10.5, 7, 6, 4.8, 80), (-5, -14.5, 8.5, 6, 4.4, 4), (5, -15, 7, 6, 5.2, -3))
GROVE = ((-6.5, -5.5, 5.4, 3.6), (6.8, -4.5, 6.2, 4.0), (8.5, 14.5, 7.0, 4.4), (-9.5, 15.5, 6.5, 4.2), (0.5, -20, 6.8, 4.4), (20.5, 15.5, 6.2, 4.0))


class Points:
    """Collects parts: positions, colors from 0 to 1, and one class each."""

    def __init__(self, spacing, seed):
        self.spacing, self.random = spacing, np.random.default_rng(seed)
        self.parts = []

    def add(self, position, color, kind):
        color = np.broadcast_to(color, position.shape) * self.random.normal(1, 0.035, (len(position), 1))
        self.parts.append((position, np.clip(color, 0, 1), np.full(len(position), kind, np.uint8)))

    def plane(self, wide, high):
        """Coordinates of points on a rectangle, jittered on a grid."""
        across, up = (max(1, round(side / self.spacing)) for side in (wide, high))
        grid = np.stack(np.meshgrid(np.arange(across), np.arange(up), indexing="ij"), -1).reshape(-1, 2)
        place = (grid + self.random.uniform(0.1, 0.9, grid.shape)) / (across, up)
        return place[:, 0] * wide, place[:, 1] * high

    def arrays(self):
        """Positions float32, colors uint8, classes uint8."""
        position, color, kind = (np.concatenate(columns) for columns in zip(*self.parts))
        return position.astype(np.float32), np.round(color * 255).astype(np.uint8), kind


def turned(position, x, y, degrees):
    angle = np.radians(degrees)
    across, along = position[:, 0], position[:, 1]
    return np.stack([x + across * np.cos(angle) - along * np.sin(angle), y + across * np.sin(angle) + along * np.cos(angle), position[:, 2]], 1)


def wall_of(points, wide, high, color, storeys, door):
    """(along the wall, outwards, up) of a wall with windows that lie 12 cm behind it, and their colors."""
    u, v = points.plane(wide, high)
    bays = max(1, round(wide / 2.3))
    bay = wide / bays
    storey = max(2.4, high / storeys)
    across, up = (u % bay) - bay / 2, v % storey
    beam = (v % storey < 0.14) & (v > 1)
    window = (np.abs(across) < 0.45) & (np.abs(up - 1.55) < 0.65) & (v < high - 0.3)
    frame = (np.abs(across) < 0.56) & (np.abs(up - 1.55) < 0.76) & (v < high - 0.3)
    plinth = v < 0.5
    entry = door & (np.abs(u - wide / 2) < 0.6) & (v < 2.3)
    shade = np.where(plinth[:, None], STONE, np.asarray(color) * (0.94 + 0.06 * np.sin(0.9 * u + 1.7 * v))[:, None])
    for here, paint in ((beam, TIMBER), (frame, (0.90, 0.88, 0.84)), (window, GLASS), (entry, DOOR)):
        shade = np.where(here[:, None], paint, shade)
    return np.stack([u - wide / 2, np.where(window | entry, -0.12, np.where(plinth, 0.05, 0.0)), v], 1), shade


def house(points, place, number):
    """Four walls, two gables, a roof with eaves, a chimney."""
    x, y, length, depth, eaves, degrees = place
    color, tiles = WALLS[number % len(WALLS)], ROOFS[number % len(ROOFS)]
    rise = depth * 0.52
    for side in (0, 180, 90, 270):
        wide, away = (length, depth / 2) if side in (0, 180) else (depth, length / 2)
        wall, shade = wall_of(points, wide, eaves - 0.2, color, max(1, round(eaves / 2.7)), side == 0)
        wall[:, 1] = -(wall[:, 1] + away)  # outwards is -y
        points.add(turned(turned(wall, 0, 0, side), x, y, degrees), shade, HOUSES)
        if side in (90, 270):
            u, v = points.plane(wide, rise)
            inside = np.abs(u - wide / 2) < wide / 2 * (1 - (v + 0.25) / rise)  # below the roof
            gable = np.stack([u[inside] - wide / 2, np.full(inside.sum(), -away), eaves - 0.2 + v[inside]], 1)
            points.add(turned(turned(gable, 0, 0, side), x, y, degrees), color * 0.97, HOUSES)
    slope = np.hypot(depth / 2 + 0.4, rise * (1 + 0.8 / depth))
    for sign in (-1, 1):
        u, v = points.plane(length + 0.8, slope)
        row = 0.03 * (1 - (v % 0.42) / 0.42)
        tile = tiles * (0.82 + 0.2 * (v % 0.42) / 0.42 + 0.07 * np.sin(11 * u + 5 * np.floor(v / 0.42)))[:, None]
        far = 1 - v / slope  # from the ridge
        roof = np.stack([u - length / 2 - 0.4, sign * far * (depth / 2 + 0.4), eaves + rise * (1 - far * (1 + 0.8 / depth)) + row + 0.08], 1)
        points.add(turned(roof, x, y, degrees), tile, HOUSES)
    for side in (0, 90, 180, 270):
        u, v = points.plane(0.7, rise * 0.75 + 0.6)
        brick = np.where(((v % 0.16) < 0.03)[:, None], (0.62, 0.58, 0.54), (0.52, 0.30, 0.24))
        stack = turned(np.stack([u - 0.35, np.full(len(u), -0.35), eaves + rise * 0.55 + v], 1), 0, 0, side)
        points.add(turned(stack + (length * 0.28, depth * 0.12, 0), x, y, degrees), brick, HOUSES)


def church(points, x, y):
    """A nave, and a tower with a spire of eight sides."""
    house(points, (x + 3.4, y + 0.6, 9, 6.4, 6.4, 0), 2)
    for side in (0, 90, 180, 270):
        u, v = points.plane(4.4, 12)
        arch = (np.abs(u - 2.2) < 0.55) & (np.abs(v - 9.6) < 1.0) | (np.abs(u - 2.2) < 0.7) & (v < 2.6) & (side == 0)
        band = (np.abs(v - 7.6) < 0.15) | (np.abs(v - 11.8) < 0.2)
        joint = (v % 0.5 < 0.06) | ((u + 0.5 * np.floor(v / 0.5)) % 1.0 < 0.06)
        shade = np.where(joint[:, None], (0.56, 0.53, 0.47), np.asarray(STONE) * 1.08)
        shade = np.where(arch[:, None], (0.13, 0.13, 0.15), np.where(band[:, None], (0.78, 0.74, 0.66), shade))
        tower = np.stack([u - 2.2, -2.2 + np.where(arch, 0.3, np.where(band, -0.1, 0)), v], 1)
        points.add(turned(turned(tower, 0, 0, side), x - 3, y, 0), shade, HOUSES)
    for side in range(8):
        u, v = points.plane(2.1, 6.2)
        inside = np.abs(u - 1.05) < 1.05 * (1 - v / 6.2)
        u, v = u[inside] - 1.05, v[inside]
        copper = np.array((0.33, 0.47, 0.42)) * (0.9 + 0.15 * (v % 0.5))[:, None]
        spire = np.stack([u, -2.5 * (1 - v / 6.2), 12 + v], 1)
        points.add(turned(turned(spire, 0, 0, 45 * side), x - 3, y, 0), copper, HOUSES)


def tree(points, place, leaves):
    """A trunk, and a crown of leaves in clusters."""
    x, y, high, wide = place
    u, v = points.plane(0.9, high * 0.5)
    angle = u / 0.9 * 2 * np.pi
    points.add(np.stack([x + 0.16 * np.cos(angle), y + 0.16 * np.sin(angle), v], 1), (0.34, 0.27, 0.20), TREES)
    heart = points.random.normal(size=(60, 3))
    heart *= np.cbrt(points.random.random((60, 1))) / np.linalg.norm(heart, axis=1, keepdims=True)
    leaf = heart[points.random.integers(0, 60, leaves)] + 0.14 * points.random.normal(size=(leaves, 3))
    green = np.array((0.30, 0.44, 0.16)) * (0.75 + 0.4 * np.clip(leaf[:, 2:] * 0.5 + 0.5, 0, 1))
    points.add(leaf * (wide / 2, wide / 2, 0.32 * high) + (x, y, 0.64 * high), green, TREES)


def ground(points, reach):
    """Cobbles on the square, lawn around it, a round fountain in the middle."""
    u, v = points.plane(2 * reach, 2 * reach)
    x, y = u - reach, v - reach
    inside = np.hypot(x, y) < reach
    x, y = x[inside], y[inside]
    paved = (np.abs(x) < 10.5) & (np.abs(y) < 10.5) | (np.abs(x - 1.5) < 1.6)
    cobble = 0.5 + 0.5 * np.sin(9 * x) * np.sin(9 * y + 4.5 * np.floor(x * 9 / np.pi))
    z = np.where(paved, 0.02 * cobble, 0.06 + 0.05 * np.sin(0.7 * x) * np.sin(0.6 * y)) + points.random.normal(0, 0.008, len(x))
    stones = np.array((0.52, 0.49, 0.45)) * (0.8 + 0.25 * cobble)[:, None]
    grass = np.array((0.37, 0.47, 0.22)) * (0.92 + 0.12 * np.sin(2.3 * x + np.sin(1.9 * y)))[:, None]
    points.add(np.stack([x, y, z], 1), np.where(paved[:, None], stones, grass), GROUND)
    for radius, low, high in ((1.9, 0.0, 0.7), (1.6, 0.35, 0.7), (0.3, 0.3, 2.2)):
        u, v = points.plane(2 * np.pi * radius, high - low)
        points.add(np.stack([radius * np.cos(u / radius), radius * np.sin(u / radius), low + v], 1), STONE, HOUSES)
    u, v = points.plane(3.8, 3.8)
    away = np.hypot(u - 1.9, v - 1.9)
    basin = away < 1.9
    rim = away[basin] > 1.6
    points.add(np.stack([u[basin] - 1.9, v[basin] - 1.9, np.where(rim, 0.7, 0.42)], 1), np.where(rim[:, None], STONE, (0.28, 0.40, 0.44)), HOUSES)


def town(spacing=0.19):
    """Positions (n, 3) float32 in meters, colors (n, 3) uint8 sRGB, LAS classes (n,) uint8."""
    points = Points(spacing, 7)
    ground(points, 26)
    for number, place in enumerate(PLACES):
        house(points, place, number)
    church(points, 5, 12)
    for place in GROVE:
        tree(points, place, round(70 / spacing ** 2))
    return points.arrays()


def garden(spacing=0.08):
    """A house behind trees. Arrays as town() returns them."""
    points = Points(spacing, 11)
    u, v = points.plane(16, 12)
    x, y = u - 8, v - 8.5
    path = np.abs(x - 0.3 * np.sin(y)) < 0.6
    lawn = np.array((0.38, 0.48, 0.22)) * (0.9 + 0.15 * np.sin(2.1 * x + np.sin(3.3 * y)))[:, None]
    points.add(np.stack([x, y, 0.05 * np.sin(1.3 * x) * np.sin(1.1 * y) + points.random.normal(0, 0.008, len(x))], 1),
               np.where(path[:, None], (0.63, 0.58, 0.50), lawn), GROUND)
    house(points, (0, 3, 11, 6, 5.4, 0), 4)
    for place in ((-4.2, -2.2, 5.6, 3.4), (-0.6, -2.8, 6.4, 3.8), (3.6, -2.0, 5.4, 3.6)):
        tree(points, place, 9000)
    return points.arrays()
