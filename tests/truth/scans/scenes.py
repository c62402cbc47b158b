# SPDX-License-Identifier: GPL-3.0-or-later
"""The virtual scenes, their scanners and eight cameras each: near, within, grazing, far. Metres, z up.

FROZEN: scenes, scanners, cameras and thresholds may not change any more; test_scans.py holds their sum. Rules and numbers of
the renderer are tuned on the scenes that are not `held_out` alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from . import places
from .solids import Place, Solids

WIDTH, HEIGHT, FOV = 960, 640, 55.0  # pixels; degrees, vertical
SKY = (0.55, 0.70, 0.90)  # sRGB
STEP = 0.01  # metres to the side between the two frames of a pair in motion


@dataclass(frozen=True)
class View:
    eye: Place
    target: Place
    motion: bool = False


@dataclass(frozen=True)
class Survey:
    """pattern "stations": step degrees, noise and registration metres (one sigma), stations: eyes; "airborne": step metres
    between lines, height over zero; "photos": count of points, noise in shares of the distance 1 : noise."""

    pattern: str
    stations: tuple[Place, ...]
    step: float = 0.2
    noise: float = 0.003
    registration: float = 0.006
    drop: float = 0.01
    divergence: float = 0.001  # radians, whole beam
    count: int = 0
    area: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)  # x0, y0, x1, y1 that is flown over


@dataclass(frozen=True)
class Scene:
    name: str
    make: Callable[[], Solids]
    survey: Survey
    views: tuple[View, ...]
    held_out: bool = False
    seed: int = 1


def _views(*places: tuple[Place, Place]) -> tuple[View, ...]:
    """The second and the sixth are seen in motion, too."""
    return tuple(View(eye, target, index in (1, 5)) for index, (eye, target) in enumerate(places))


SCENES: tuple[Scene, ...] = (
    Scene("street", places.street, Survey("stations", ((-9.0, -1.0, 1.8), (3.0, 1.5, 1.8), (15.0, -1.0, 1.8)), 0.2), _views(
        ((-6.0, 3.0, 1.7), (-8.0, 6.0, 1.5)), ((-13.0, 4.6, 1.7), (-4.0, 4.0, 1.0)), ((6.5, 3.0, 1.7), (7.0, 6.0, 4.2)),
        ((-11.5, 5.2, 1.7), (2.0, 5.9, 2.2)), ((2.5, -3.0, 1.6), (0.5, -5.2, 2.2)), ((24.0, -2.0, 4.0), (-2.0, 2.0, 1.5)),
        ((14.0, 3.0, 1.6), (18.5, 5.3, 3.0)), ((-2.0, -5.3, 1.7), (-8.0, 4.5, 1.2)))),
    Scene("facade", places.facade, Survey("stations", ((-4.5, -6.5, 1.7), (4.0, -5.0, 1.7)), 0.2), _views(
        ((-4.0, -2.0, 1.7), (-5.2, 0.3, 2.0)), ((0.0, -8.5, 1.7), (0.0, 0.0, 3.0)), ((1.0, -3.0, 3.5), (-0.5, -0.8, 4.9)),
        ((-6.8, -0.6, 1.6), (4.0, -0.1, 2.2)), ((3.2, -1.6, 1.3), (2.1, -1.6, 0.7)), ((5.5, -5.0, 1.6), (-2.0, 0.0, 4.5)),
        ((4.5, -1.5, 1.9), (5.0, 0.4, 2.1)), ((-2.0, -1.4, 1.2), (0.5, 0.2, 0.8)))),
    Scene("room", places.room, Survey("stations", ((1.5, 2.5, 1.4), (5.0, 3.4, 1.4)), 0.25), _views(
        ((3.2, 3.7, 1.5), (3.2, 1.8, 0.7)), ((0.6, 0.6, 1.6), (5.0, 4.0, 1.0)), ((4.2, 1.6, 1.3), (5.9, 1.4, 1.4)),
        ((5.8, 2.8, 1.2), (5.6, 0.2, 1.4)), ((2.0, 2.6, 1.2), (1.8, 5.2, 1.5)), ((5.7, 4.7, 1.3), (1.0, 0.5, 0.7)),
        ((2.0, 1.0, 0.4), (4.5, 3.5, 0.5)), ((2.75, 0.5, 1.0), (3.2, 3.0, 0.8)))),
    Scene("railing", places.railing, Survey("stations", ((-3.0, -1.0, 1.6), (4.0, 1.5, 1.6)), 0.2), _views(
        ((0.5, 2.4, 1.5), (0.8, 4.5, 0.4)), ((-6.0, -2.0, 1.6), (4.0, 8.0, 0.0)), ((-7.0, 3.5, 0.9), (4.0, 3.9, 0.5)),
        ((0.0, -2.0, 1.7), (0.0, 15.0, 1.5)), ((-3.0, 7.0, 0.2), (1.0, 10.0, -0.7)), ((2.0, -1.0, 1.8), (6.0, 7.0, 4.0)),
        ((0.0, 8.0, 0.3), (-1.0, 3.0, 0.4)), ((5.0, 2.6, 1.4), (3.4, 1.0, 0.7)))),
    Scene("columns", places.columns, Survey("stations", ((-8.0, -9.0, 1.1), (7.0, -8.0, 1.1), (0.5, -1.0, 1.6)), 0.25), _views(
        ((-4.6, -4.0, 1.6), (-3.4, -2.4, 1.2)), ((-9.0, -10.0, 1.2), (0.0, -2.0, 2.8)), ((-6.9, -1.2, 1.6), (7.0, -1.6, 2.0)),
        ((-3.6, -4.0, 4.2), (-3.6, -2.4, 4.9)), ((4.0, 0.3, 1.6), (5.2, 1.8, 1.5)), ((8.8, -5.6, 0.8), (-4.0, -2.0, 1.5)),
        ((1.0, -4.8, 0.4), (3.0, -2.6, 0.6)), ((0.4, 0.6, 1.7), (-3.0, -4.5, 2.2)))),
    Scene("trees", places.trees, Survey("stations", ((0.0, -3.0, 1.8), (-2.0, 7.0, 1.8), (3.5, 1.5, 1.8)), 0.25), _views(
        ((-2.5, 1.0, 1.7), (-5.0, 2.0, 4.0)), ((0.0, -12.0, 1.7), (1.0, 5.0, 2.5)), ((3.0, -1.8, 1.3), (2.9, 0.4, 0.7)),
        ((3.0, 3.0, 1.7), (4.6, 5.0, 3.8)), ((-2.0, -9.2, 1.0), (-9.0, -9.5, 0.6)), ((10.0, 9.0, 3.5), (-3.0, -2.0, 2.0)),
        ((1.5, -2.0, 0.8), (6.0, 3.0, 0.3)), ((0.3, 2.0, 1.7), (0.0, 15.0, 1.6)))),
    Scene("terrain", places.terrain, Survey("airborne", (), 0.14, 0.01, 0.012, 0.02, 0.0005, area=(-40.0, -40.0, 40.0, 40.0)), _views(
        ((-2.0, -8.0, 3.5), (-6.0, 8.0, 3.0)), ((-38.0, -38.0, 25.0), (5.0, 5.0, 0.0)), ((-25.0, 22.0, 3.0), (20.0, 24.5, 2.0)),
        ((12.0, -2.0, 4.0), (12.0, 12.0, 4.0)), ((0.0, 0.0, 60.0), (0.0, 1.0, 0.0)), ((35.0, -20.0, 10.0), (0.0, 8.0, 2.0)),
        ((-30.0, 3.0, 8.0), (28.0, 9.0, 9.0)), ((-22.0, -20.0, 5.0), (-15.0, -14.0, 3.0)))),
    Scene("statue", places.statue, Survey("photos", ((-2.4, -2.6, 1.5), (0.0, -2.9, 1.6), (2.4, -2.6, 1.5), (-2.7, 0.6, 1.8),
                                                     (2.7, 0.6, 1.8), (-1.3, -2.8, 2.6), (1.3, -2.8, 0.7)),
                                          noise=0.0012, drop=0.1, count=700_000), _views(
        ((0.6, -1.2, 2.1), (0.1, 0.0, 2.2)), ((2.2, -2.5, 1.7), (0.0, 0.0, 1.6)), ((0.25, -0.75, 2.6), (0.0, 0.0, 2.4)),
        ((-1.2, -0.9, 1.3), (0.0, 0.0, 1.4)), ((0.4, -2.4, 0.7), (0.0, 0.0, 0.6)), ((-2.6, -2.6, 2.8), (0.3, 0.3, 1.5)),
        ((-0.9, 0.3, 2.0), (2.9, 1.9, 1.9)), ((0.9, -0.9, 1.9), (0.36, -0.45, 2.0)))),
    Scene("stairs", places.stairs, Survey("stations", ((-0.4, -3.5, 1.6), (2.6, -1.5, 1.6), (2.2, 4.4, 3.6)), 0.25), _views(
        ((0.0, -1.2, 1.6), (0.0, 2.0, 0.9)), ((-3.0, -5.5, 1.7), (1.5, 4.0, 2.2)), ((1.9, 1.0, 1.5), (0.8, 1.8, 1.5)),
        ((0.0, 1.8, 2.9), (0.0, 5.0, 2.9)), ((3.6, 4.2, 4.5), (0.5, 1.0, 1.0)), ((5.0, -5.0, 2.0), (0.0, 3.0, 2.0)),
        ((-0.9, -0.6, 0.7), (0.6, 3.0, 1.8)), ((1.8, 2.6, 1.2), (2.8, 4.0, 2.6))), held_out=True),
    Scene("court", places.court, Survey("stations", ((-3.0, -4.0, 1.6), (4.5, -1.5, 1.6), (0.0, 5.5, 1.6)), 0.22), _views(
        ((-3.0, -3.2, 1.6), (-1.0, -1.5, 1.3)), ((7.0, -7.0, 1.7), (-4.0, 6.0, 2.5)), ((-6.8, -7.5, 1.6), (-6.4, 8.0, 1.8)),
        ((1.0, -0.5, 1.7), (3.0, 2.0, 4.0)), ((-1.0, 6.3, 1.6), (1.8, 8.3, 1.9)), ((-4.0, 2.0, 1.6), (7.5, -2.0, 2.5)),
        ((3.2, -6.4, 1.5), (4.5, -3.5, 0.5)), ((0.0, 2.5, 1.5), (1.5, 5.0, 2.7))), held_out=True),
    Scene("village", places.village, Survey("airborne", (), 0.13, 0.01, 0.012, 0.02, 0.0005, area=(-38.0, -36.0, 36.0, 38.0)), _views(
        ((-10.0, -6.0, 3.0), (-20.0, -14.0, 4.0)), ((-36.0, -36.0, 20.0), (5.0, 5.0, 2.0)), ((-12.0, -1.0, 2.0), (20.0, 2.0, 2.0)),
        ((3.0, 2.0, 4.0), (3.0, 10.0, 4.0)), ((0.0, 5.0, 55.0), (0.0, 6.0, 0.0)), ((35.0, 30.0, 12.0), (0.0, 0.0, 2.0)),
        ((-2.0, -9.0, 6.0), (28.0, 0.0, 7.0)), ((6.0, 18.0, 5.0), (14.0, 25.0, 5.0))), held_out=True),
    Scene("fountain", places.fountain, Survey("photos", ((-3.0, -3.2, 1.6), (0.0, -3.7, 1.6), (3.0, -2.9, 1.7), (3.6, 0.3, 1.7),
                                                         (-3.6, 0.2, 1.7), (-2.4, 2.8, 1.8), (2.3, 2.9, 1.8), (0.4, -3.0, 2.8)),
                                              noise=0.0012, drop=0.1, count=800_000), _views(
        ((-1.0, -1.9, 1.4), (0.0, 0.0, 1.2)), ((-3.0, -3.3, 2.0), (0.3, 0.4, 0.8)), ((0.5, -2.9, 0.9), (0.5, 0.0, 0.6)),
        ((0.6, -0.7, 2.3), (0.0, 0.0, 2.2)), ((1.9, -2.0, 0.5), (-2.0, -2.2, 0.4)), ((3.7, 2.5, 2.6), (-0.5, -0.3, 0.8)),
        ((-1.9, 0.3, 0.9), (0.0, 0.1, 0.7)), ((-3.4, 1.2, 1.5), (3.4, 3.5, 1.2))), held_out=True),
)


def named(name: str) -> Scene:
    for scene in SCENES:
        if scene.name == name:
            return scene
    raise ValueError(f"no scene '{name}': there are {', '.join(one.name for one in SCENES)}")
