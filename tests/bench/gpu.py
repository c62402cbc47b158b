# SPDX-License-Identifier: GPL-3.0-or-later
"""What frames of an OpenGL device take and ask for: of each pass the time on the device, the bytes that it moves by the plan, what
these would take at the measured bandwidth, dispatches, empty ones, barriers, calls, copies and waits. Beside it the processor's time,
and whether both show the same. Needs numpy alone.

    python tests/bench/gpu.py POINTS [--device NAME] [--size WxH]... [--what NAME]... [--seconds S] [--frames N]
    python tests/bench/gpu.py POINTS --threads [--size WxH]... [--seconds S] [--frames N]

Prints a row of bench.json as soon as it is measured, one a line. --threads: the processor with 1, 2, 4, ... and all threads.
--seconds: no case begins later; a case that has begun takes a few seconds more."""

from __future__ import annotations

import argparse
import json
import mmap
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[2] / "addon"), str(Path(__file__).resolve().parent)]

import machine  # noqa: E402
import stage as stages  # noqa: E402
from modes import COLOR_AND_DEPTH, MODES, QUALITIES, Mode, scene_of  # noqa: E402
from native.abi import SOFT, SOFT_MODEL, SURFACE  # noqa: E402
from native.points import ScanSet  # noqa: E402
from tables import count, joined, table  # noqa: E402
from truth import Scene, scenes  # noqa: E402

import native  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
RING, TUBE = 1.0, 0.4  # of the torus of tests/truth
BLOCK = 1 << 20  # points that a process makes at once
SOFT_POINTS, RANGES = "soft points", "range images"
WAYS = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], np.float32)  # of the scans of range images
OWN = {
    "discs": Mode(settings=QUALITIES["splats"]),
    SOFT_POINTS: Mode(style={"soft": SOFT["ALL"], "soft_model": SOFT_MODEL["EXPRESS"], "soft_opacity": 0.1}),
    RANGES: Mode(settings={"surface": SURFACE["RANGES"]}),
}
KNOWN = {**MODES, **OWN}
WHATS = ("surface", "6 layers", "shadows 10", "discs", SOFT_POINTS, RANGES, "shadows kept", "shadows 1", "lines 2", "eye-dome lighting",
         "ambient obscurance", "depth of field")  # the most important first
SIZES = {"1024x1024": (1024, 1024), "1920x1080": (1920, 1080), "4096x4096": (4096, 4096)}
WARM_UP, MEASURED = 3, 5  # frames before those that are timed; frames that are measured, behind them
PATIENCE = 2.5  # seconds of frames of a device, after which a slow case stops at three
COUNTS = ("dispatches", "empty", "barriers", "calls", "copies", "waits")
TOL_COLOR = 2e-5  # as in tests/tolerances.h: colors of devices may differ by this share of the brightest
GOALS = {  # ms on an H100 or H200: (points, width, what)
    (1_000_000, 1024, "surface"): 0.6, (10_000_000, 1024, "surface"): 0.9, (100_000_000, 1024, "surface"): 4.0,
    (1_000_000, 4096, "surface"): 2.0, (1_000_000, 1024, "discs"): 1.5, (1_000_000, 1024, "6 layers"): 2.5,
    (1_000_000, 1024, "shadows 10"): 3.0,
}


# ---- points --------------------------------------------------------------------------------------------------------------------------


def _shared(shape: tuple[int, ...], kind: type) -> np.ndarray:
    """An array that forked processes write into."""
    size = int(np.prod(shape)) * np.dtype(kind).itemsize
    return np.frombuffer(mmap.mmap(-1, max(size, 1)), kind, int(np.prod(shape))).reshape(shape)


def _make(job: tuple[int, int]) -> None:
    """Points of the torus, evenly by area, in no order."""
    begin, end = job
    random = np.random.default_rng(1 + begin)
    missing, found = end - begin, []
    while missing > 0:  # the outer half has more area: reject in proportion
        inside = random.random(2 * missing + 16, np.float32) * np.float32(2.0 * np.pi)
        kept = random.random(len(inside), np.float32) * np.float32(RING + TUBE) <= RING + np.float32(TUBE) * np.cos(inside)
        found.append(inside[kept][:missing])
        missing -= len(found[-1])
    inside = np.concatenate(found)
    around = random.random(end - begin, np.float32) * np.float32(2.0 * np.pi)
    position, normal, color = _arrays[0][begin:end], _arrays[1], _arrays[2]
    own = np.empty((end - begin, 3), np.float32)
    own[:, 2] = np.sin(inside)
    flat, c, s = np.cos(inside), np.cos(around), np.sin(around)
    own[:, 0], own[:, 1] = flat * c, flat * s
    position[:] = np.float32(TUBE) * own
    position[:, 0] += np.float32(RING) * c
    position[:, 1] += np.float32(RING) * s
    if normal is not None:
        normal[begin:end] = own
        for axis in range(3):  # as truth.srgb_bytes
            wave = np.sin(3.0 * position[:, axis] + position[:, (axis + 1) % 3] + np.float32(axis))
            color[begin:end, axis] = np.rint(np.float32(127.5) + np.float32(100.0) * wave)


_arrays: list[np.ndarray | None] = []  # of the processes that _make runs in


def torus(points: int, bare: bool = False) -> stages.Stage:
    """The torus with so many points, made by all cores: 100 million in seconds. bare: without normals and colors, for memory's sake."""
    _arrays[:] = [_shared((points, 3), np.float32), None if bare else _shared((points, 3), np.float32), None if bare else _shared((points, 3), np.uint8)]
    jobs = [(begin, min(begin + BLOCK, points)) for begin in range(0, points, BLOCK)]
    with get_context("fork").Pool(min(machine.cores(), len(jobs))) as pool:
        pool.map(_make, jobs, chunksize=1)
    scene: Scene = scenes.build("torus")
    return stages.Stage(*_arrays, spacing=float(np.sqrt(scene.area / points)),
                        camera=lambda turn: stages.orbit(turn, stages.ELEVATION, stages.DISTANCE, stages.FOV),
                        style={"lighting": 2, "cull_back": 1}, lights=tuple(light.fields() for light in scene.lights), scene=scene, name="torus")


class Subject:
    """A cloud that is rendered by several devices: what each case shows of it."""

    def __init__(self, points: int, bare: bool = False) -> None:
        start = time.perf_counter()
        self.stage = torus(points, bare)
        made = time.perf_counter()
        self.cloud = native.Cloud(self.stage.position, self.stage.normal, self.stage.color)
        self.points, self.seconds = points, {"generate_s": made - start, "upload_ms": 1e3 * (time.perf_counter() - made)}
        self.scans: ScanSet | None = None
        # the cloud has its own; range images need the normals once more
        self.stage = replace(self.stage, position=None, color=None, normal=self.stage.normal if points <= 2_000_000 else None)
        _arrays.clear()

    def scene(self, what: str, size: tuple[int, int], turn: float) -> native.Scene:
        mode = KNOWN[what]
        if what == RANGES and not self.scans:
            of = np.argmax(self.stage.normal @ WAYS.T, axis=1).astype(np.uint16)
            self.scans = ScanSet(self.cloud, of, [(-way, self.stage.spacing) for way in WAYS])
        if what == RANGES:
            mode = replace(mode, style={"scans": self.scans})
        return scene_of(self.cloud, self.stage, mode, size, turn, passes=COLOR_AND_DEPTH, **QUALITIES["refined"])

    def may(self, what: str) -> bool:
        return what != RANGES or self.stage.normal is not None


# ---- frames --------------------------------------------------------------------------------------------------------------------------


def _timed(frame: native.Frame, make: Callable[[float], native.Scene], frames: int) -> dict[str, Any]:
    """Times of frames as anybody draws them, the camera a degree further each time; then of their passes."""
    first, times, work, began = 0.0, [], [], time.perf_counter()
    for i in range(WARM_UP + frames):
        scene = make(float(i))
        start, spent = time.perf_counter(), time.process_time()
        frame.render(scene)
        elapsed = 1e3 * (time.perf_counter() - start)
        first = first or elapsed  # with the upload, and shaders compiled
        if i >= WARM_UP or time.perf_counter() - began > PATIENCE:
            times.append(elapsed)
            work.append(1e3 * (time.process_time() - spent))
        if len(times) >= 3 and time.perf_counter() - began > PATIENCE:
            break
    passes: dict[str, list[float]] = {}
    frame.measure()
    for i in range(MEASURED if time.perf_counter() - began < PATIENCE else 1):
        frame.render(make(float(i)))
        stats = frame.pass_stats()
        for name, ms in stats["passes"].items():
            passes.setdefault(name, []).append(ms)
    frame.measure(False)
    return {"frames": len(times), "ms_median": median(times), "ms_min": min(times), "ms_max": max(times), "work_ms": median(work), "first_ms": first,
            "passes": {name: median(values) for name, values in passes.items()}, "work": stats["work"],
            **{key: stats[key] for key in ("gl", "cpu") if key in stats}}


def agreement(a: native.Frame, b: native.Frame) -> dict[str, Any]:
    """How far two frames of one scene differ: pixels whose keys do, and the greatest difference of colors, as a share of the brightest."""
    colors, others = a.read("COMBINED"), b.read("COMBINED")
    brightest = max(1.0, float(np.abs(others).max()))
    far = float(np.abs(colors - others).max()) / brightest
    keys = int(np.count_nonzero(a.read_keys() != b.read_keys()))
    return {"keys_differ": keys, "colors_differ": far, "same": keys == 0 and far <= TOL_COLOR}


def _row(subject: Subject, what: str, size: tuple[int, int], device: native.Device, asked: str, threads: int, frame: native.Frame,
         timing: dict[str, Any]) -> dict[str, Any]:
    stats = frame.stats()
    quality = "splats" if what == "discs" else "refined"
    return {"group": "gpu", "scene": "torus", "mode": "surface" if what == "discs" else what, "what": what, "device": asked, "width": size[0],
            "height": size[1], "points": subject.points, "quality": quality, "threads": threads, **timing, "peak_mb": machine.memory_peak(),
            "error": {}, "device_name": device.name, "device_description": device.description, "hardware": bool(device.hardware),
            "plane_bytes": stats["plane_bytes"], "cloud_bytes": subject.cloud.bytes, "points_scattered": stats["points_scattered"],
            **subject.seconds}


def rows(points: int, name: str, whats: list[str], sizes: list[str], seconds: float, frames: int) -> Iterator[dict[str, Any]]:
    """Of each case the device's row, then the processor's."""
    end = time.monotonic() + seconds
    subject = Subject(points, bare=points > 200_000_000)
    devices = {asked: native.Device(asked) for asked in dict.fromkeys((name, "cpu"))}
    drawn = {asked: native.Frame(device) for asked, device in devices.items()}
    for what, size in [(whats[0], SIZES[size]) for size in sizes] + [(what, SIZES[sizes[0]]) for what in whats[1:]]:
        if time.monotonic() > end:
            yield _absent(points, what, size, name, "no time was left")
            continue
        if not subject.may(what):
            continue
        found = {}
        try:
            for asked, device in devices.items():
                found[asked] = _row(subject, what, size, device, asked, 0, drawn[asked], _timed(
                    drawn[asked], lambda turn, what=what, size=size: subject.scene(what, size, turn), frames if asked == name else min(frames, 7)))
            for frame in drawn.values():
                frame.render(subject.scene(what, size, 0.0))
            if len(drawn) == 2:
                found[name] |= agreement(drawn[name], drawn["cpu"])
        except native.PatinaError as error:
            yield _absent(points, what, size, name, str(error))
        yield from found.values()


def scaling(points: int, sizes: list[str], seconds: float, frames: int) -> Iterator[dict[str, Any]]:
    """The processor by threads."""
    end, subject, cores = time.monotonic() + seconds, Subject(points), machine.cores()
    for threads in sorted({*(2**k for k in range(8) if 2**k <= cores), cores}, reverse=True):
        device = native.Device("cpu", threads)
        frame = native.Frame(device)
        for size in (SIZES[size] for size in sizes):
            if time.monotonic() > end:
                yield _absent(points, "surface", size, "cpu", "no time was left")
                continue
            timing = _timed(frame, lambda turn, size=size: subject.scene("surface", size, turn), frames)
            yield _row(subject, "surface", size, device, "cpu", threads, frame, timing) | {"group": "scaling"}


def separately(words: list[str]) -> Iterator[dict[str, Any]]:
    """The rows that this program prints, as a process of its own."""
    with subprocess.Popen([sys.executable, __file__, *words], stdout=subprocess.PIPE, text=True) as process:
        for line in process.stdout or ():
            if line.startswith("{"):
                yield json.loads(line)


def _absent(points: int, what: str, size: tuple[int, int], name: str, why: str) -> dict[str, Any]:
    return {"group": "gpu", "scene": f"torus, {size[0]} x {size[1]}", "mode": what, "device": name, "points": points, "quality": "refined", "unavailable": why}


# ---- bandwidth ------------------------------------------------------------------------------------------------------------------------


def bandwidth(name: str, build: Path, megabytes: int = 1024) -> float:
    """GB/s that the device writes where a kernel does nothing else; 0: not known."""
    program = build / "tests/bench/bandwidth"
    try:
        done = subprocess.run([str(program), name, str(megabytes)], capture_output=True, text=True, timeout=30, check=True)
        return float(json.loads(done.stdout)["write_gbs"])
    except (OSError, subprocess.SubprocessError, ValueError, KeyError):
        return 0.0


# ---- as a table -----------------------------------------------------------------------------------------------------------------------


def _of(row: dict[str, Any]) -> str:
    return f"{count(row['points'])}, {row['width']} x {row['height']}, {row['what']}"


def markdown(result: dict[str, Any], few: bool = False) -> str:
    """A frame a row; then the passes of each. few: of the first alone."""
    found = joined(result, "gpu")
    drawn = list({_of(row): row for row in found if row["device"] != "cpu" and "gl" in row}.values())  # what was repeated once
    if not drawn:
        return ""
    beside = {_of(row): row for row in found if row["device"] == "cpu"}
    speed = result.get("gpu_bandwidth", 0.0)
    body = []
    for row in drawn:
        gl, cpu = row["gl"], beside.get(_of(row))
        goal = GOALS.get((row["points"], row["width"], row["what"]))
        same = "–" if "same" not in row else "same" if row["same"] else f"{row['keys_differ']} keys, colors {row['colors_differ']:.1e}"
        body.append([_of(row), f"{row['ms_median']:.2f}", f"{goal:g}" if goal else "–", f"{sum(row['passes'].values()):.2f}",
                     f"{gl['bytes'] / 1e6:.0f}", f"{gl['bytes'] / speed / 1e6:.3f}" if speed else "–", *(str(gl[name]) for name in COUNTS),
                     f"{cpu['ms_median']:.1f}" if cpu else "–", same])
    text = table(["points, size, what", "ms", "goal", "in passes", "MB", "floor, ms", *COUNTS, "processor, ms", "against it"], body)
    return "\n\n".join([f"{drawn[0]['device_description']}. Floor: the bytes at {speed:.0f} GB/s, which a kernel that only writes reaches.", text,
                        *(f"{_of(row)}:\n\n{passes(row, speed)}" for row in drawn[: 1 if few else None])])


def passes(row: dict[str, Any], speed: float) -> str:
    """A pass a row; what is in none of them is "beside"."""
    work = dict(row["work"])
    work["beside"] = {name: row["gl"][name] - sum(one[name] for one in work.values()) for name in (*COUNTS, "bytes")}
    body = [[name, f"{row['passes'][name]:.3f}" if name in row["passes"] else "–", f"{one['bytes'] / 1e6:.2f}",
             f"{one['bytes'] / speed / 1e6:.4f}" if speed else "–", *(str(one[key]) for key in COUNTS)] for name, one in work.items()]
    return table(["pass", "ms", "MB", "floor, ms", *COUNTS], body)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("points", type=int)
    parser.add_argument("--device", default="gl-egl")
    parser.add_argument("--size", action="append", help="WxH; default: " + ", ".join(SIZES))
    parser.add_argument("--what", action="append", choices=KNOWN, help="the first in all sizes, all in the first; default: surface")
    parser.add_argument("--seconds", type=float, default=1e9)
    parser.add_argument("--frames", type=int, default=12)
    parser.add_argument("--threads", action="store_true")
    options = parser.parse_args()
    sizes = options.size or list(SIZES)
    for size in sizes:
        width, height = size.split("x")
        SIZES[size] = int(width), int(height)
    found = scaling(options.points, sizes, options.seconds, options.frames) if options.threads else rows(
        options.points, options.device, options.what or ["surface"], sizes, options.seconds, options.frames)
    try:
        for row in found:
            print(json.dumps(row), flush=True)
    except (native.PatinaError, MemoryError) as error:
        print(json.dumps(_absent(options.points, "surface", SIZES[sizes[0]], options.device, str(error) or type(error).__name__)), flush=True)
    return 0


if __name__ == "__main__":
    os.environ.setdefault("PATINA_LIBRARY", str(ROOT / "build/out/release/libpatina.so"))
    sys.exit(main())
