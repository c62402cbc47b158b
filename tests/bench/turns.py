# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of large clouds one after another, as a viewport draws them: the overview that is orbited, in levels, and a street, exact.

    build/out/venv/bin/python tests/bench/turns.py CLOUD:ACROSS ... [--pictures 25] [--library FILE]

CLOUD: a town in levels as tests/bench/town writes it, ACROSS quarters a side. The clouds draw in turns, a device of their own each, so
that what else the machine does troubles all alike. Medians, by the clock and of the processor, and what each takes beside the first."""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(ROOT / "tests"), str(HERE), str(ROOT / "addon")]

import files  # noqa: E402
from truth.camera import Camera, look  # noqa: E402

WIDTH, HEIGHT, CAP = 1920, 1080, 2 * 10 ** 9
TURN = 1.0  # degrees a picture
VIEWS = {"overview": 4.0, "close-up": 0.0}  # pixels between points; 0: all points


def seen_from(across: int, view: str, turn: float) -> Camera:
    """The look of files.py; of the overview, so many degrees further around the town."""
    *places, fov = map(float, files.looks(across)[view].split(","))
    eye, target = np.array(places[:3]), np.array(places[3:])
    angle = np.radians(turn)
    spin = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    eye = target + spin @ (eye - target) if view == "overview" else eye + (0.0, 0.0, 0.001 * turn)
    near = 1e-3 * float(np.linalg.norm(eye - target))
    camera = look(eye, target, fov, WIDTH / HEIGHT)
    return Camera(camera.matrix, camera.left, camera.right, camera.bottom, camera.top, near, 1e5 * near)


def measured(clouds: list[tuple[Path, int]], view: str, pictures: int) -> list[np.ndarray]:
    """Of each cloud (pictures, 2): milliseconds by the clock and of the processor, after two pictures that do not count."""
    import native

    drawn: list[tuple[Any, Any, int]] = []
    for path, across in clouds:
        scene = native.Scene()
        scene.add_cloud(native.Cloud.open(path))
        scene.set_settings(width=WIDTH, height=HEIGHT, detail=VIEWS[view])
        drawn.append((native.Frame(native.Device("cpu", 0, CAP)), scene, across))
    times = np.empty((len(clouds), pictures + 2, 2))
    for picture in range(pictures + 2):
        for k, (frame, scene, across) in enumerate(drawn):
            scene.set_camera(**seen_from(across, view, TURN * picture).fields())
            start, spent = time.perf_counter(), time.process_time()
            frame.render(scene)
            times[k, picture] = 1e3 * (time.perf_counter() - start), 1e3 * (time.process_time() - spent)
    return list(times[:, 2:])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clouds", nargs="+")
    parser.add_argument("--pictures", type=int, default=25)
    parser.add_argument("--library", type=Path, default=ROOT / "build/out/release/libpatina.so")
    given = parser.parse_args()
    os.environ["PATINA_LIBRARY"] = str(given.library)
    clouds = [(Path(name), int(across)) for name, _, across in (one.rpartition(":") for one in given.clouds)]
    print("| points | view | ms | of the processor, ms | times the first |\n|---|---|---|---|---|")
    for view in VIEWS:
        found = measured(clouds, view, given.pictures)
        ratios = [np.median(times[:, 0] / found[0][:, 0]) for times in found]
        for (_, across), times, ratio in zip(clouds, found, ratios, strict=True):
            print(f"| {across ** 2},000,000 | {view} | {np.median(times[:, 0]):.1f} | {np.median(times[:, 1]):.1f} | {ratio:.2f} |", flush=True)


if __name__ == "__main__":
    main()
