# SPDX-License-Identifier: GPL-3.0-or-later
"""Walks through virtual scans: how even frame times are, how dear the dearest view, and VTK's points beside.

    build/out/venv/bin/python tests/bench/walk.py [--scenes NAMES] [--modes default,stations] [--frames N] [--slow N]
        [--library FILE]

The walk leads straight from each of a scene's eight cameras to the next, through walls where they are in the way: harder than a
walker has it. Every frame is drawn in ROUNDS rounds, and its least time counts, for other programs disturb single frames. The
torus is that of the headline, analysed, at the same size, before and after each scan. --slow: so many slowest frames, by pass."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(ROOT / "tests"), str(HERE), str(ROOT / "addon")]

import stage  # noqa: E402
from scans import FAR, NEAR, peer_command  # noqa: E402
from tables import count, table  # noqa: E402
from truth.camera import Camera, orbit  # noqa: E402
from truth.scans.exact import Stage, camera  # noqa: E402
from truth.scans.run import scenes_of  # noqa: E402
from truth.scans.scenes import FOV, HEIGHT, SKY, WIDTH  # noqa: E402
from truth.scans.solids import linear  # noqa: E402

SCENES = "street,court,room,columns"  # those of 1.4 million points and more
MODES = {"default": "not known", "stations": "known"}  # scanners' places
LEG, ROUNDS, TURNS = 24, 3, 9  # frames from camera to camera; times each is drawn; frames of the torus
COLOR_AND_DEPTH = 3


@dataclass
class Times:
    """Milliseconds of frames, on the clock and of the processor; and of their passes."""

    clock: np.ndarray
    work: np.ndarray
    passes: list[dict[str, float]]


def path(cameras: list[Camera], leg: int) -> list[Camera]:
    """So many cameras from each to the next, and the last."""
    turns = Slerp(np.arange(len(cameras)), Rotation.from_matrix([one.matrix[:3, :3] for one in cameras]))
    eyes = np.array([one.eye for one in cameras])
    found = []
    for at in np.linspace(0, len(cameras) - 1, leg * (len(cameras) - 1) + 1):
        k = min(int(at), len(cameras) - 2)
        matrix = np.eye(4)
        matrix[:3, :3] = turns(at).as_matrix()
        matrix[:3, 3] = eyes[k] + (at - k) * (eyes[k + 1] - eyes[k])
        found.append(replace(cameras[0], matrix=matrix))
    return found


def drawn(frame: Any, scene: Any, cameras: list[Camera], rounds: int = ROUNDS) -> Times:
    """The scene from these cameras, after a picture that uploads."""
    shape = rounds, len(cameras)
    times = Times(np.empty(shape), np.empty(shape), [{} for _ in cameras])
    for k in range(-1, rounds):
        for number, one in enumerate(cameras if k >= 0 else cameras[:1]):
            scene.set_camera(**one.fields())
            start, spent = time.perf_counter(), time.process_time()
            frame.render(scene)
            times.clock[k, number] = 1e3 * (time.perf_counter() - start)
            times.work[k, number] = 1e3 * (time.process_time() - spent)
            for name, ms in frame.pass_stats()["passes"].items():
                least = times.passes[number].get(name, np.inf) if k > 0 else np.inf
                times.passes[number][name] = min(least, ms)
    return Times(times.clock.min(axis=0), times.work.min(axis=0), times.passes)


def scene_of(native: Any, cloud: Any, style: dict[str, Any] | None = None, lights: tuple[dict[str, Any], ...] = ()) -> Any:
    scene = native.Scene()
    scene.add_cloud(cloud, **(style or {}))
    for light in lights:
        scene.add_light(**light)
    scene.set_settings(width=WIDTH, height=HEIGHT, world_color=linear(np.array(SKY)).tolist(), passes=COLOR_AND_DEPTH)
    return scene


def vtk(shown: Stage) -> dict[str, list[float]]:
    """VTK's points of 3 pixels from the scan's cameras: milliseconds, "work" of the processor; {} without VTK."""
    command = peer_command("vtk")
    if not command:
        return {}
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "scan.npz"
        np.savez(source, position=shown.scan.position.astype(np.float32), color=shown.scan.color,
                 matrix=np.stack([camera(view).matrix for view in shown.scene.views]), fov=FOV, width=WIDTH, height=HEIGHT,
                 near=NEAR, far=FAR, sky=np.array(SKY))
        done = subprocess.run([*command, str(source), folder, "3"], capture_output=True, text=True)
        said = [line for line in done.stdout.splitlines() if line.startswith("{")]
        if not said:
            raise OSError(f"vtk: {(done.stderr + done.stdout).strip().splitlines()[-1:]}")
        return json.loads(said[-1])


def measure(scenes: str = SCENES, modes: tuple[str, ...] = tuple(MODES), leg: int = LEG) -> list[dict[str, Any]]:
    """A row a scan and mode."""
    import native

    device = native.Device("cpu")
    frame = native.Frame(device)
    ring = stage.analytic({"surface": "torus", "points": 1_000_000})
    torus = native.Cloud(ring.position, ring.normal, ring.color)
    torus.analyse()
    around = [orbit(float(k), stage.ELEVATION, stage.DISTANCE, stage.FOV, WIDTH / HEIGHT) for k in range(TURNS)]
    rows = []
    for scene in scenes_of(scenes):
        shown = Stage(scene)
        scan, views = shown.scan, [camera(view) for view in scene.views]
        peer = vtk(shown)
        for mode in modes:
            cloud = native.Cloud(np.ascontiguousarray(scan.position, np.float32), None, np.ascontiguousarray(scan.color))
            known = mode == "stations"
            cloud.analyse(stations=scan.stations if known else None, station=scan.scan.astype(np.uint8)[:, None] if known else None)
            before = drawn(frame, scene_of(native, torus, ring.style, ring.lights), around)
            walk = drawn(frame, scene_of(native, cloud), path(views, leg))
            still = drawn(frame, scene_of(native, cloud), views)
            after = drawn(frame, scene_of(native, torus, ring.style, ring.lights), around)
            rows.append({"scene": scene.name, "mode": mode, "points": len(scan), "walk": walk, "views": still, "vtk": peer,
                         "torus": {kind: float(min(np.median(getattr(one, kind)) for one in (before, after)))
                                   for kind in ("clock", "work")}})
    return rows


def markdown(rows: list[dict[str, Any]]) -> str:
    """By the processor's time, which other programs hardly disturb."""
    body = []
    for row in rows:
        walk, views, torus = row["walk"].work, row["views"].work, row["torus"]["work"]
        middle, most = np.median(walk), np.quantile(walk, 0.99)
        peer = np.array(row["vtk"].get("3 work", []))
        body.append([row["scene"], count(row["points"]), MODES[row["mode"]], f"{middle:.1f}", f"{most:.1f}", f"{most / middle:.2f}×",
                     f"{np.median(row['walk'].clock):.1f}", f"{torus:.1f}", f"{views.max():.1f}", f"{views.max() / torus:.2f}×",
                     f"{(peer / views).min():.1f}× to {(peer / views).max():.1f}×" if len(peer) else "–"])
    head = ["scan", "points", "scanners", "median, ms", "99th percentile, ms", "ratio", "median by the clock, ms", "torus, ms",
            "dearest of eight views, ms", "against the torus", "VTK takes"]
    return f"{WIDTH} × {HEIGHT}, {ROUNDS} rounds; milliseconds of the processor where not said otherwise.\n\n" + table(head, body)


def slowest(rows: list[dict[str, Any]], most: int) -> str:
    """The slowest frames of each walk, by pass, beside the median of all its frames."""
    lines = []
    for row in rows:
        walk = row["walk"]
        names = sorted({name for one in walk.passes for name in one})
        middle = {name: float(np.median([one.get(name, 0.0) for one in walk.passes])) for name in names}
        for number in np.argsort(-walk.work)[:most]:
            parts = sorted(walk.passes[number].items(), key=lambda item: middle[item[0]] - item[1])[:4]
            lines.append(f"{row['scene']}, {row['mode']}, frame {number} of {len(walk.work)}: {walk.work[number]:.1f} ms; " +
                         ", ".join(f"{name} {ms:.1f} ({middle[name]:.1f})" for name, ms in parts))
    return "\n".join(lines)


def text(quick: bool, library: Path) -> str:
    """For the bench."""
    os.environ["PATINA_LIBRARY"] = str(library)
    return markdown(measure("street" if quick else SCENES, ("default",) if quick else tuple(MODES), 6 if quick else LEG))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", default=SCENES)
    parser.add_argument("--modes", default=",".join(MODES))
    parser.add_argument("--frames", type=int, default=LEG, help="from camera to camera")
    parser.add_argument("--slow", type=int, default=0)
    parser.add_argument("--library", type=Path, default=ROOT / "build/out/release/libpatina.so")
    options = parser.parse_args()
    os.environ["PATINA_LIBRARY"] = str(options.library.resolve())
    rows = measure(options.scenes, tuple(options.modes.split(",")), options.frames)
    print(markdown(rows))
    if options.slow:
        print(slowest(rows, options.slow))
    return 0


if __name__ == "__main__":
    sys.exit(main())
