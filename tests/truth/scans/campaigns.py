# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes that are scanned with the errors of real scanners (campaign.py): worlds of their own, and some of the frozen scenes
once more, under the name SCENE-errors. split.json says which of all scenes are for tuning and training, and which are held out:
nothing may be chosen by what these show."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from . import worlds, worlds_held
from .campaign import Campaign, Instrument, Passer, Station, Walk
from .scenes import SCENES, Scene, _views
from .scenes import named as frozen
from .solids import Place

SPLIT: dict[str, list[str]] = json.loads((Path(__file__).resolve().parent / "split.json").read_text())
TURN = 150.0  # seconds of a scanner's whole turn

# Makes of scanners. By phase: any two surfaces mix; by pulse: near ones.
PHASE = Instrument(noise=0.001, divergence=0.0003, pulse=20.0, reach=90.0, filters=0.7, strays=4e-4)
PULSE = Instrument(noise=0.003, divergence=0.0004, pulse=0.8, reach=250.0, filters=0.3, strays=3e-5, registration=0.006)
COARSE = Instrument(noise=0.005, divergence=0.0012, aperture=0.005, pulse=1.6, reach=60.0, filters=0.3, strays=2e-4, registration=0.012)
WAVE = Instrument(noise=0.002, divergence=0.0003, pulse=0.35, reach=180.0, picks="first", strays=2e-5)
LAST = Instrument(noise=0.004, divergence=0.0005, pulse=0.5, reach=200.0, picks="last", strays=5e-5, registration=0.01)
HANDHELD = Instrument(noise=0.005, divergence=0.0015, aperture=0.004, pulse=0.9, reach=30.0, filters=0.5, strays=3e-4, drift=0.02,
                      registration=0.01)


def passing(eye: Place, place: Place, heading: float, speed: float = 1.2, seconds: float = 8.0) -> Passer:
    """Someone who walks in a direction (degrees) and is at `place` when the scanner at `eye` looks there."""
    when = np.arctan2(place[1] - eye[1], place[0] - eye[0]) / (2.0 * np.pi) % 1.0
    half = 0.5 * seconds
    step = speed * half * np.array([np.cos(np.radians(heading)), np.sin(np.radians(heading)), 0.0])
    a, b = np.asarray(place, float) - step, np.asarray(place, float) + step
    return Passer(tuple(a.tolist()), tuple(b.tolist()), float(when - half / TURN), float(when + half / TURN))


def _stations(*all_: tuple[Place, Instrument]) -> tuple[Station, ...]:
    return tuple(Station(eye, instrument) for eye, instrument in all_)


def _with(station: Station, *passers: Passer) -> Station:
    return replace(station, passers=passers)


def _again(name: str, campaign: Campaign, seed: int) -> Scene:
    old = frozen(name)
    return Scene(f"{name}-errors", old.make, campaign, old.views, old.held_out, seed)  # type: ignore[arg-type]


def _new(name: str, make: object, campaign: Campaign, seed: int, *views: tuple[Place, Place]) -> Scene:
    return Scene(name, make, campaign, _views(*views), name in SPLIT["held out"], seed)  # type: ignore[arg-type]


def _grid(instrument: Instrument, step: float, **more: float | str) -> Instrument:
    return replace(instrument, step=step, **more)  # type: ignore[arg-type]


CAMPAIGNS: tuple[Scene, ...] = (
    _new("hall", worlds.hall, Campaign(_stations(
        ((3.0, 2.2, 1.5), _grid(PHASE, 0.28)), ((9.0, 5.6, 1.5), _grid(PHASE, 0.28)), ((6.0, 2.4, 1.7), _grid(PHASE, 0.38, reach=12.0)))),
        101,
        ((2.0, 2.0, 1.7), (4.0, 4.0, 3.0)), ((0.8, 0.9, 1.6), (10.0, 7.0, 1.8)), ((5.0, 5.0, 1.7), (4.0, 8.0, 2.0)),
        ((8.6, 3.0, 2.4), (8.0, 4.0, 3.0)), ((6.0, 2.5, 1.6), (6.0, 0.0, 2.0)), ((11.2, 1.0, 1.7), (2.0, 6.0, 1.5)),
        ((9.6, 1.8, 1.2), (9.0, 0.4, 0.6)), ((2.0, 6.8, 1.5), (11.0, 7.6, 2.2))),
    _new("ruin", worlds.ruin, Campaign(_stations(
        ((-2.5, -1.5, 1.7), _grid(PULSE, 0.38, registration=0.02, rain=3e-4)), ((3.0, 1.0, 1.7), _grid(PULSE, 0.38, registration=0.02)),
        ((-9.0, -6.5, 1.8), _grid(PULSE, 0.31, registration=0.02)), ((7.5, 8.5, 1.8), _grid(PULSE, 0.44, registration=0.03)))), 102,
        ((-3.0, -2.0, 1.7), (-5.5, 1.0, 1.8)), ((-10.0, -8.0, 1.7), (0.0, 0.0, 1.5)), ((1.0, -2.5, 1.6), (5.0, -1.0, 1.6)),
        ((-4.0, 2.0, 1.6), (-3.0, 4.2, 2.0)), ((0.0, -7.0, 1.5), (-1.5, -4.3, 1.5)), ((9.0, 9.0, 2.5), (0.0, 0.0, 1.0)),
        ((3.0, 0.5, 1.2), (2.0, 2.6, 0.5)), ((-5.0, -6.8, 1.4), (-3.8, -5.8, 1.0))),
    _new("railings", worlds.railings, Campaign((
        _with(Station((-5.0, -5.6, 1.7), _grid(WAVE, 0.28)), passing((-5.0, -5.6, 1.7), (-1.0, -1.3, 0.15), 0.0, 0.5),
              passing((-5.0, -5.6, 1.7), (5.0, -6.0, 0.0), 80.0)),
        Station((5.5, -6.5, 1.7), _grid(WAVE, 0.28, noise=0.003)))), 103,
        ((-4.0, -3.5, 1.7), (-6.0, 0.0, 3.0)), ((0.0, -9.5, 1.7), (0.0, 0.0, 4.0)), ((6.0, -3.5, 1.8), (8.9, -3.5, 2.2)),
        ((-9.5, -1.2, 1.7), (5.0, -0.4, 3.5)), ((-2.0, -6.5, 1.3), (-2.0, -7.5, 0.6)), ((9.0, -9.0, 2.0), (-4.0, 0.0, 4.5)),
        ((-8.0, -2.6, 1.6), (-8.4, 0.0, 1.6)), ((2.0, -4.0, 1.6), (3.6, -0.6, 4.3))),
    _new("lattice", worlds.lattice, Campaign(_stations(
        ((-1.8, -2.2, 1.5), _grid(PHASE, 0.25, reach=60.0, strays=2e-4)), ((2.0, -1.9, 1.4), _grid(PHASE, 0.3, noise=0.0015)))), 104,
        ((0.8, -1.4, 1.8), (0.0, 0.0, 1.9)), ((2.6, -3.6, 1.7), (0.0, 0.5, 1.5)), ((-0.9, -0.8, 2.3), (0.0, 0.0, 2.4)),
        ((-1.5, 0.2, 1.6), (-0.5, 1.2, 1.5)), ((0.0, -3.6, 0.9), (0.0, 0.0, 1.0)), ((-3.5, -3.0, 2.4), (0.5, 1.0, 1.3)),
        ((1.6, 0.4, 1.2), (1.9, 1.2, 1.2)), ((-2.9, -2.0, 1.1), (-2.4, -1.2, 0.8))),
    _new("trench", worlds.trench, Campaign(
        _stations(((0.5, 0.2, -0.2), _grid(COARSE, 0.38)), ((-6.0, -4.5, 1.7), _grid(COARSE, 0.31))),
        (Walk(((-5.0, -3.6, 1.3), (4.6, -3.6, 1.3), (4.8, 3.6, 1.3), (-4.8, 3.6, 1.3), (-5.0, -3.6, 1.3)), HANDHELD, 350_000),)), 105,
        ((0.0, -2.8, 0.6), (0.0, 0.5, -1.7)), ((-6.0, -5.5, 1.8), (1.0, 0.0, -1.0)), ((-1.5, 0.0, -0.6), (-2.2, 1.8, -0.6)),
        ((2.8, -1.6, -0.7), (-1.0, 0.2, -1.6)), ((5.0, -3.0, 1.2), (6.5, -1.6, 0.5)), ((6.5, 5.5, 2.2), (0.0, 0.0, -1.2)),
        ((-0.5, -0.6, -1.0), (1.0, 0.4, -1.6)), ((3.6, 1.8, 0.0), (4.0, 2.4, -0.7))),
    _new("machines", worlds.machines, Campaign(_stations(
        *(((x, y, 1.6), _grid(COARSE if k % 2 else PHASE, 0.53, strays=6e-4)) for k, (x, y) in enumerate(
            ((-10.0, 0.0), (-5.0, -1.0), (0.0, 2.4), (2.5, -4.2), (6.5, 1.5), (10.5, 4.5)))))), 106,
        ((-6.0, 0.5, 1.7), (-8.0, 3.5, 2.0)), ((-11.0, -3.0, 1.7), (6.0, 2.0, 2.0)), ((-2.0, -3.4, 1.6), (-1.0, -5.5, 2.5)),
        ((1.0, 2.2, 1.6), (-3.0, 0.6, 3.0)), ((4.0, -1.5, 1.3), (4.3, -2.7, 0.6)), ((11.0, 6.0, 2.5), (-4.0, -2.0, 2.5)),
        ((6.0, 3.0, 1.6), (6.0, 5.2, 1.2)), ((9.0, 0.5, 1.8), (8.5, -3.0, 2.5))),
    _new("lane", worlds_held.lane, Campaign((
        _with(Station((-8.0, -2.0, 1.7), _grid(PULSE, 0.31, noise=0.002, pulse=1.2, rain=5e-4)),
              passing((-8.0, -2.0, 1.7), (-3.0, -0.6, 0.08), 20.0)),
        _with(Station((1.0, 0.4, 1.7), _grid(PULSE, 0.31, noise=0.002, pulse=1.2, rain=5e-4)),
              passing((1.0, 0.4, 1.7), (5.0, 1.6, 0.08), 200.0, 0.4)),
        Station((9.5, 2.0, 1.7), _grid(PULSE, 0.38, noise=0.002, pulse=1.2, reach=25.0)))), 107,
        ((-5.0, -1.2, 1.7), (-8.5, -0.8, 0.5)), ((-13.0, -1.9, 1.7), (0.0, 0.0, 2.0)), ((0.0, 0.2, 1.7), (3.0, 3.3, 2.0)),
        ((4.0, 1.6, 1.6), (14.0, 2.0, 2.5)), ((-2.5, 0.0, 1.6), (-2.5, -1.8, 1.2)), ((13.0, 3.0, 3.0), (-2.0, 0.0, 2.0)),
        ((5.0, 0.6, 1.3), (6.5, 0.4, 0.5)), ((-10.0, -2.5, 1.6), (-7.0, 0.6, 4.5))),
    _new("chapel", worlds_held.chapel, Campaign(
        _stations(((-0.3, -5.8, 1.5), _grid(PHASE, 0.35, noise=0.0015, strays=2e-4)), ((0.0, 3.6, 1.5), _grid(PHASE, 0.35, noise=0.0015))),
        (Walk(((0.0, -6.5, 1.4), (0.1, 4.0, 1.4), (-2.0, 5.2, 1.4), (2.0, 5.2, 1.4)), replace(HANDHELD, noise=0.004, drift=0.012),
              350_000),)), 108,
        ((0.0, -2.5, 1.7), (0.0, 0.9, 3.0)), ((0.0, -7.3, 1.7), (0.0, 7.0, 3.0)), ((1.5, 0.0, 1.7), (3.6, -2.0, 3.5)),
        ((-2.0, 3.6, 1.6), (-2.6, 4.6, 1.3)), ((0.3, 4.9, 1.6), (0.0, 7.0, 1.8)), ((2.8, 6.5, 2.2), (-2.0, -6.0, 2.0)),
        ((-3.2, -6.8, 1.2), (-1.0, -2.0, 0.6)), ((0.0, 2.5, 1.5), (-3.6, 2.2, 5.0))),
    _new("loft", worlds_held.loft, Campaign(_stations(
        ((-4.2, 0.3, 1.5), _grid(LAST, 0.3)), ((1.0, -1.2, 1.5), _grid(LAST, 0.3)), ((5.9, 1.2, 1.4), _grid(LAST, 0.38, noise=0.006)))),
        109,
        ((1.0, 0.2, 1.6), (2.6, 1.2, 1.6)), ((-6.4, -2.0, 1.6), (5.0, 1.0, 1.6)), ((-3.2, -2.2, 1.5), (-4.6, -3.8, 1.0)),
        ((-5.0, 1.5, 1.6), (-7.0, 0.0, 2.0)), ((3.2, -1.8, 1.4), (4.4, -0.5, 0.9)), ((6.4, 3.0, 1.7), (-4.0, -1.0, 2.0)),
        ((0.2, -1.8, 1.1), (-0.6, -3.5, 0.6)), ((-1.0, 0.9, 1.2), (-1.6, 3.0, 0.4))),
    _again("street", Campaign((
        _with(Station((-9.0, -1.0, 1.8), _grid(PULSE, 0.31)), passing((-9.0, -1.0, 1.8), (-3.0, 3.2, 0.0), 0.0)),
        Station((3.0, 1.5, 1.8), _grid(PULSE, 0.31)), Station((15.0, -1.0, 1.8), _grid(COARSE, 0.38, rain=4e-4)))), 111),
    _again("room", Campaign(_stations(((1.5, 2.5, 1.4), _grid(PHASE, 0.38)), ((5.0, 3.4, 1.4), _grid(WAVE, 0.5))), (
        Walk(((1.0, 1.0, 1.3), (5.0, 1.2, 1.3), (4.6, 4.2, 1.3), (1.5, 4.0, 1.3)), HANDHELD, 200_000),)), 112),
    _again("trees", Campaign(_stations(((0.0, -3.0, 1.8), _grid(LAST, 0.38)), ((-2.0, 7.0, 1.8), _grid(PULSE, 0.38, rain=1e-3)),
                                       ((3.5, 1.5, 1.8), _grid(WAVE, 0.44)))), 113),
    _again("columns", Campaign(_stations(((-8.0, -9.0, 1.1), _grid(PHASE, 0.31)), ((0.5, -1.0, 1.6), _grid(COARSE, 0.5)))), 114),
    _again("stairs", Campaign(_stations(((-0.4, -3.5, 1.6), _grid(PHASE, 0.38)), ((2.6, -1.5, 1.6), _grid(PULSE, 0.38)),
                                        ((2.2, 4.4, 3.6), _grid(PULSE, 0.44)))), 115),
    _again("court", Campaign((_with(Station((-3.0, -4.0, 1.6), _grid(COARSE, 0.31)),
                                    passing((-3.0, -4.0, 1.6), (2.0, -1.5, 0.0), 90.0, 0.8)),
                              Station((4.5, -1.5, 1.6), _grid(COARSE, 0.38, registration=0.03)),
                              Station((0.0, 5.5, 1.6), _grid(PHASE, 0.44)))), 116),
)

ALL: tuple[Scene, ...] = (*SCENES, *CAMPAIGNS)


def named(name: str) -> Scene:
    for scene in ALL:
        if scene.name == name:
            return scene
    raise ValueError(f"no scene '{name}': there are {', '.join(one.name for one in ALL)}")


def group(words: str) -> list[Scene]:
    """Names with commas, or a group: tuning, held, all (the frozen scenes, whose figures have been told), trained, unseen
    (campaigns for training, and those held out), campaigns (both)."""
    groups = {"tuning": [one for one in SCENES if not one.held_out], "held": [one for one in SCENES if one.held_out],
              "all": list(SCENES), "trained": [one for one in CAMPAIGNS if not one.held_out],
              "unseen": [one for one in CAMPAIGNS if one.held_out], "campaigns": list(CAMPAIGNS)}
    return groups[words] if words in groups else [named(one) for one in words.split(",")]
