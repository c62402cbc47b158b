# SPDX-License-Identifier: GPL-3.0-or-later
"""One case of the bench, in a process of its own so that its peak memory is its own: JSON in, one JSON row out."""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from statistics import median
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "addon"))

import native  # noqa: E402  the add-on's binding, the only one there is
import machine  # noqa: E402
import truth  # noqa: E402

WARM_UP = 4
QUALITIES = {"refined": {"quality": 0, "fill": 0}, "paper": {"quality": 1, "fill": 1}}


def uploads(points: int, runs: int) -> tuple[native.Cloud, list[float]]:
    arrays = truth.torus(points)
    cloud, times = None, []
    for _ in range(runs):
        start = time.perf_counter()
        cloud = native.Cloud(*arrays)
        times.append(1e3 * (time.perf_counter() - start))
    return cloud, times


def scene_of(cloud: native.Cloud, case: dict[str, Any]) -> native.Scene:
    scene = native.Scene()
    scene.add_cloud(cloud, lighting=2, cull_back=1)
    scene.add_light(type=1, power=truth.SUN_POWER, direction=(-truth.SUN).tolist())
    scene.set_settings(width=case["width"], height=case["height"], film_transparent=1,
                       world_color=[truth.WORLD] * 3, **QUALITIES[case["quality"]])
    return scene


def frames(frame: native.Frame, scene: native.Scene, count: int) -> dict[str, Any]:
    """A camera that turns one degree a frame: times; medians of the passes and of what is in none of them ("rest"); why
    other passes are left out. work: processor time, all threads, which other programs hardly disturb."""
    times, work, passes, skipped = [], [], {}, {}
    for i in range(count + WARM_UP):
        scene.set_camera(**truth.view(float(i)).fields())
        start, spent = time.perf_counter(), time.process_time()
        frame.render(scene)
        elapsed = 1e3 * (time.perf_counter() - start)
        if i < WARM_UP:
            continue
        times.append(elapsed)
        work.append(1e3 * (time.process_time() - spent))
        stats = frame.pass_stats()
        skipped = stats["skipped"]
        rest = elapsed - sum(stats["passes"].values())
        for name, ms in {**stats["passes"], "rest": rest}.items():
            passes.setdefault(name, []).append(ms)
    return {"frames": count, "ms_median": median(times), "ms_min": min(times), "ms_max": max(times),
            "work_ms": median(work), "passes": {name: median(values) for name, values in passes.items()},
            "skipped": skipped}


def run(case: dict[str, Any]) -> dict[str, Any]:
    device = native.Device(case["device"], case["threads"])
    cloud, upload_ms = uploads(case["points"], 3 if case["points"] <= 1_000_000 else 1)
    machine.reset_peak()
    scene = scene_of(cloud, case)
    frame = native.Frame(device)
    timing = frames(frame, scene, case["frames"])
    peak = machine.memory_peak()
    stats = frame.stats()

    scene.set_camera(**truth.view(0.0).fields())
    frame.render(scene)
    start = time.perf_counter()
    depth, normal, rgba = frame.read("DEPTH")[..., 0], frame.read("NORMAL"), frame.read("COMBINED")
    read_ms = 1e3 * (time.perf_counter() - start)
    exact = truth.Picture.load(case["truth"])
    return {
        **{name: case[name] for name in ("scene", "mode", "device", "width", "height", "points", "quality", "threads")},
        "device_name": device.name, "device_description": device.description, **timing, "read_ms": read_ms,
        "upload_ms": median(upload_ms), "peak_mb": peak, "plane_bytes": stats["plane_bytes"],
        "cloud_bytes": cloud.bytes, "points_scattered": stats["points_scattered"],
        "error": truth.errors(exact, depth, normal, rgba, case["points"]),
    }


def main() -> int:
    case = json.load(sys.stdin)
    os.environ["PATINA_LIBRARY"] = case["library"]
    try:
        row = run(case)
    except native.PatinaError as error:
        row = {**case, "unavailable": str(error)}
    json.dump(row, sys.stdout)
    return 0


if __name__ == "__main__":
    sys.exit(main())
