# SPDX-License-Identifier: GPL-3.0-or-later
"""One case of the bench: a scene on a device, timed, and held against the exact picture. Runs in a process of its own,
so that its peak memory is its own."""

from __future__ import annotations

import os
import sys
import time
from dataclasses import dataclass, field
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[2] / "addon"), str(Path(__file__).resolve().parent)]

import machine  # noqa: E402
import metrics  # noqa: E402
import stage as stages  # noqa: E402
from looks import CUES  # noqa: E402

import native  # noqa: E402  the add-on's binding, the only one there is

WARM_UP = 4
PATIENCE = 6.0  # seconds of frames, after which a slow case stops at five
QUALITIES = {"refined": {"quality": 0, "fill": 0}, "paper": {"quality": 1, "fill": 1, "fill_iterations": 1},
             "unfilled": {"quality": 1, "fill": 2}, "splats": {"surface": 1},
             "analysed": {},  # the default once the library knows what every point is
             "averaged": {"average": 1},  # the same, means of the points about a surface
             "known discs": {"surface": 1, "depth": 1},  # the same as discs, their depth of the surface
             "final": {"pixel_samples": 16, "depth": 1}}  # the same, for final pictures
LAYERS = 8  # rays through the nested tori meet up to eight surfaces
COLOR_AND_DEPTH, ALL_PASSES = 3, 0  # patina_settings.passes
STEADY_FRAMES, STEADY_STEP = 8, 0.05  # pictures and degrees between them: a third of a pixel at 1024
FIELDS = ("scene", "mode", "device", "width", "height", "points", "quality", "threads", "ms_median", "ms_min", "ms_max",
          "peak_mb", "passes", "error")  # of a row, as the README and other programs know it


@dataclass(frozen=True)
class Mode:
    """What a mode asks for beyond lit surfaces: fields of patina_settings, patina_cloud_style, patina_light_desc,
    patina_effects and patina_lines."""

    settings: dict[str, Any] = field(default_factory=dict)
    style: dict[str, Any] = field(default_factory=dict)
    light: dict[str, Any] = field(default_factory=dict)
    effects: dict[str, Any] = field(default_factory=dict)
    still: bool = False  # lights that cast stay where they are, and their shadow textures are kept
    lines: dict[str, Any] = field(default_factory=dict)

    def missing(self) -> str:
        """The first field that the binding does not have yet, or ""."""
        for wanted, known in ((self.settings, native.abi.Settings), (self.style, native.abi.CloudStyle),
                              (self.light, native.abi.LightDesc), (self.effects, native.abi.Effects),
                              (self.lines, native.abi.Lines)):
            names = {name for name, *_ in known._fields_}
            for name in wanted:
                if name not in names:
                    return name
        return ""


# The papers' columns. A mode whose fields the library lacks is listed as not built yet.
MODES = {
    "surface": Mode(),
    "layers": Mode(settings={"layers": LAYERS}),
    "3 layers": Mode(settings={"layers": 3}, style={"transparency": 0.5}),
    "6 layers": Mode(settings={"layers": 6}, style={"transparency": 0.5}),
    "shadows kept": Mode(light={"shadows": 1}, still=True),
    "shadows 1": Mode(settings={"shadow_samples": 1, "shadow_lazy": 1}, light={"shadows": 1}),
    "shadows 5": Mode(settings={"shadow_samples": 5, "shadow_lazy": 1}, light={"shadows": 1, "angle": 0.1}),
    "shadows 10": Mode(settings={"shadow_samples": 10, "shadow_lazy": 1}, light={"shadows": 1, "angle": 0.1}),
    "lines 2": Mode(lines={"width": 2.0}),
    "lines 8": Mode(lines={"width": 8.0}),
    "lines 16": Mode(lines={"width": 16.0}),
}

MODES |= {name: Mode(effects=effects) for name, effects in CUES.items()}


def fill_scene(scene: native.Scene, cloud: native.Cloud, shown: stages.Stage, mode: Mode, turn: float) -> None:
    """Adds cloud, lights and lines. Lights that cast shadows turn too, unless the mode lets them be."""
    scene.add_cloud(cloud, **{**shown.style, **mode.style})
    if mode.lines:
        scene.set_lines(**mode.lines)
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    for light in shown.lights:
        light = {**light, **mode.light}
        if mode.light and not mode.still:
            x, y, z = light["direction"]
            light["direction"] = [c * x - s * y, s * x + c * y, z]
        scene.add_light(**light)


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
    if case.get("graphics") and not device.hardware:
        raise native.PatinaError(f"not a graphics processor: {device.description}")
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
        scene = native.Scene()
        fill_scene(scene, cloud, shown, mode, turn)
        scene.set_settings(width=case["width"], height=case["height"], film_transparent=1, world_color=[0.05] * 3,
                           passes=passes, **{**QUALITIES[case["quality"]], **mode.settings})
        scene.set_effects(**mode.effects)
        scene.set_camera(**shown.camera(turn).fields())
        return scene

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
