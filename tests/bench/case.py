# SPDX-License-Identifier: GPL-3.0-or-later
"""One case of the bench: a scene on a device, timed, and held against the exact picture. Runs in a process of its own,
so that its peak memory is its own."""

from __future__ import annotations

import os
import sys
import time
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from statistics import median
from typing import Any

sys.path[:0] = [str(Path(__file__).resolve().parents[2] / "addon"), str(Path(__file__).resolve().parent)]

import machine  # noqa: E402
import metrics  # noqa: E402
import stage as stages  # noqa: E402
from modes import ALL_PASSES, COLOR_AND_DEPTH, LAYERS, MODES, QUALITIES, Mode, scene_of  # noqa: E402

import native  # noqa: E402  the add-on's binding, the only one there is

WARM_UP = 4
PATIENCE = 6.0  # seconds of frames, after which a slow case stops at five
STEADY_FRAMES, STEADY_STEP = 8, 0.05  # pictures and degrees between them: a third of a pixel at 1024


def frames(frame: native.Frame, make: Any, count: int) -> dict[str, Any]:
    """A camera that turns one degree a frame: times; medians of the passes and of what is in none of them ("rest"); why
    other passes are left out. work: processor time, all threads, which other programs hardly disturb."""
    times, work, passes, skipped = [], [], {}, {}
    began = time.perf_counter()
    for i in range(count + WARM_UP):
        scene = make(float(i))
        start, spent = time.perf_counter(), time.process_time()
        frame.render(scene)
        elapsed = 1e3 * (time.perf_counter() - start)
        if i < WARM_UP and time.perf_counter() - began < 0.5 * PATIENCE:
            continue
        times.append(elapsed)
        work.append(1e3 * (time.process_time() - spent))
        stats = frame.pass_stats()
        skipped = stats["skipped"]
        rest = elapsed - sum(stats["passes"].values())
        for name, ms in {**stats["passes"], "rest": rest}.items():
            passes.setdefault(name, []).append(ms)
        if len(times) >= 5 and time.perf_counter() - began > PATIENCE:
            break
    return {"frames": len(times), "ms_median": median(times), "ms_min": min(times), "ms_max": max(times),
            "work_ms": median(work), "passes": {name: median(values) for name, values in passes.items()},
            "skipped": skipped}


def picture(frame: native.Frame) -> metrics.Shown:
    return metrics.Shown(frame.read("COMBINED"), frame.read("DEPTH")[..., 0], frame.read("NORMAL"))


def steadiness(frame: native.Frame, make: Any, shown: stages.Stage, width: int, height: int) -> dict[str, float]:
    steady = metrics.Steadiness()
    for i in range(STEADY_FRAMES):
        frame.render(make(i * STEADY_STEP))
        steady.add(shown.exact(i * STEADY_STEP, width, height), picture(frame))
    return steady.result()


def errors(shown: stages.Stage, case: dict[str, Any], mode: Mode, planes: metrics.Shown, spacing: float
           ) -> dict[str, float]:
    size = case["width"], case["height"]
    if not mode.light:
        return metrics.errors(shown.exact(0.0, *size, LAYERS if case["mode"] == "layers" else 1), planes, spacing)
    angle = mode.light.get("angle", 0.0)
    exact = shown.exact(0.0, *size, 1, 1024 if angle else 1, angle)
    bare, dark = shown.exact(0.0, *size), shown.exact(0.0, *size, dark=True)
    return metrics.errors(exact, planes, spacing) | metrics.shadow(exact, bare, dark.color, planes)


def measure(case: dict[str, Any]) -> dict[str, Any]:
    """The row's fields and more. Frames are timed with colour and depth, as other programs have them; all passes are
    asked for afterwards, where there is a truth to hold them against."""
    base = machine.memory_now()
    mode = MODES[case["mode"]]
    if mode.missing():
        raise native.PatinaError(f"not built yet: the library has no '{mode.missing()}'")
    device = native.Device(case["device"], case["threads"])
    shown = stages.stage_of(case)
    upload_ms = []
    for _ in range(3 if case["points"] <= 1_000_000 and case.get("uploads") else 1):
        start = time.perf_counter()
        cloud = native.Cloud(shown.position, shown.normal, shown.color, opacities=shown.opacity)
        upload_ms.append(1e3 * (time.perf_counter() - start))
    start = time.perf_counter()
    if case["quality"] in ("analysed", "averaged", "known discs", "final"):
        cloud.analyse()
    analysis_ms = 1e3 * (time.perf_counter() - start)
    spacing, count, scene_known = shown.spacing, len(shown.position), shown.scene is not None
    shown = stages.Stage(**{**vars(shown), "position": None, "normal": None, "color": None,
                            "opacity": None})  # the cloud has its own
    machine.reset_peak()

    def make(turn: float, passes: int = COLOR_AND_DEPTH) -> native.Scene:
        return scene_of(cloud, shown, mode, (case["width"], case["height"]), turn, passes=passes, **QUALITIES[case["quality"]])

    frame = native.Frame(device)
    timing = frames(frame, make, case["frames"])
    peak = machine.memory_peak() - base
    stats = frame.stats()
    frame.render(make(0.0, ALL_PASSES))
    error, read_ms = {}, 0.0
    if scene_known and not mode.lines and not case.get("unheld"):  # the truth has no lines
        start = time.perf_counter()
        planes = picture(frame)
        read_ms = 1e3 * (time.perf_counter() - start)
        error = errors(shown, case, mode, planes, spacing)
        if case.get("steady"):
            error |= steadiness(frame, lambda turn: make(turn, ALL_PASSES), shown, case["width"], case["height"])
    return {**case, "points": count, **timing, "peak_mb": peak, "error": error, "device_name": device.name,
            "device_description": device.description, "read_ms": read_ms, "upload_ms": median(upload_ms),
            "analysis_ms": analysis_ms, "plane_bytes": stats["plane_bytes"], "cloud_bytes": cloud.bytes,
            "points_scattered": stats["points_scattered"]}


def _work(case: dict[str, Any], library: str, answer: Connection) -> None:
    os.environ["PATINA_LIBRARY"] = library
    try:
        answer.send(measure(case))
    except (native.PatinaError, RuntimeError, MemoryError) as error:
        answer.send({**case, "unavailable": str(error) or type(error).__name__})


def run(case: dict[str, Any], library: str) -> dict[str, Any]:
    """The case, measured in a fresh process."""
    context = get_context("forkserver")
    context.set_forkserver_preload(["case"])
    answer, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_work, args=(case, library, theirs))
    process.start()
    theirs.close()
    try:
        result = answer.recv()
    except EOFError:
        result = None
    process.join()
    return result or {**case, "unavailable": f"the case ended with status {process.exitcode}"}
