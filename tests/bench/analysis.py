# SPDX-License-Identifier: GPL-3.0-or-later
"""What every point knows: how long it takes beside scipy's cKDTree, how much memory, and how far normals are off.

    build/out/venv/bin/python tests/bench/analysis.py [--points N] [--library FILE]

Times are of the same run: wall clock with two threads and two workers, and processor seconds, which a busy machine does not
change as much. Normals beside plain planes through 30 neighbours, which is what Open3D's estimate_normals computes (and
Open3D's own, where PYTHON_OPEN3D names a Python that has it). Angles between directions, sides apart."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
NOISE = (0.0, 0.25, 0.5, 1.0, 2.0)  # spacings, along the normal
COUNT = 100_000
OPEN3D = """import sys, numpy as np, open3d as o
p = o.geometry.PointCloud(o.utility.Vector3dVector(np.load(sys.argv[1]).astype(float)))
p.estimate_normals(o.geometry.KDTreeSearchParamKNN(30))
np.save(sys.argv[2], np.asarray(p.normals))"""


def library(path: Path | None = None):
    os.environ.setdefault("PATINA_LIBRARY", str(path or ROOT / "build/out/release/libpatina.so"))
    sys.path.insert(0, str(ROOT / "addon"))
    import native
    return native


def torus(count: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    u, v = random.random((2, 2 * count)) * 2 * np.pi
    kept = np.flatnonzero(random.random(2 * count) < (1 + 0.4 * np.cos(v)) / 1.4)[:count]
    u, v = u[kept], v[kept]
    ring = 1 + 0.4 * np.cos(v)
    normals = np.c_[np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)]
    return np.c_[ring * np.cos(u), ring * np.sin(u), 0.4 * np.sin(v)], normals


def sphere(count: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    normals = random.standard_normal((count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return normals, normals


def box(count: int, random: np.random.Generator, size: tuple[float, ...] = (1, 1, 1)) -> tuple[np.ndarray, np.ndarray]:
    size = np.array(size)
    area = np.prod(size) / size
    side = random.choice(6, count, p=np.repeat(area / area.sum() / 2, 2))
    points, normals = random.random((count, 3)) * 2 - 1, np.zeros((count, 3))
    sign = side % 2 * 2.0 - 1
    points[np.arange(count), side // 2] = normals[np.arange(count), side // 2] = sign
    return points * size, normals


def plate(count: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A thin one: its sides are five spacings apart."""
    return box(count, random, (1, 1, 2.5 * np.sqrt(8 / count)))


SHAPES: dict[str, Callable[[int, np.random.Generator], tuple[np.ndarray, np.ndarray]]] = {
    "sphere": sphere, "torus": torus, "cube": box, "thin plate": plate}
AREA = {"sphere": 4 * np.pi, "torus": 4 * np.pi**2 * 0.4, "cube": 24.0, "thin plate": 8.0}


def plain_normals(points: np.ndarray, count: int = 30) -> np.ndarray:
    from scipy.spatial import cKDTree

    near = points[cKDTree(points).query(points, count)[1]]
    near = near - near.mean(1, keepdims=True)
    return np.linalg.eigh(np.einsum("nki,nkj->nij", near, near))[1][:, :, 0]


def open3d_normals(points: np.ndarray) -> np.ndarray | None:
    python = os.environ.get("PYTHON_OPEN3D")
    if not python:
        return None
    with tempfile.TemporaryDirectory() as folder:
        here, there = Path(folder) / "in.npy", Path(folder) / "out.npy"
        np.save(here, points)
        if subprocess.run([python, "-c", OPEN3D, here, there], capture_output=True, check=False).returncode:
            return None
        return np.load(there)


def angles(found: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Degrees; NaN without a normal."""
    length = np.linalg.norm(found, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.degrees(np.arccos(np.clip(np.abs((found * truth).sum(1)) / length, 0, 1)))


def normals_table(native) -> str:
    rows = ["| shape | noise, spacings | ours: median, rms | 30 neighbours | Open3D | no normal, % | right side, % |",
            "|---|---|---|---|---|---|---|"]
    say = lambda a: "–" if a is None else f"{np.nanmedian(a):.2f}, {np.sqrt(np.nanmean(a**2)):.2f}"  # noqa: E731
    for name, make in SHAPES.items():
        for noise in NOISE:
            random = np.random.default_rng(19)
            points, truth = make(COUNT, random)
            points = points + truth * random.standard_normal((COUNT, 1)) * noise * np.sqrt(AREA[name] / COUNT)
            points = np.ascontiguousarray(points, np.float32)
            with native.Cloud(points) as cloud:
                cloud.analyse(keep_normals=False)
                ours = cloud.neighbourhoods("normal")["normal"].astype(float)
            has = np.abs(ours).sum(1) > 0
            other = open3d_normals(points)
            right = ((ours * truth).sum(1) > 0)[has].mean()
            rows.append(f"| {name} | {noise:g} | {say(angles(ours, truth))} | {say(angles(plain_normals(points), truth))} | "
                        f"{say(None if other is None else angles(other, truth))} | {100 * (1 - has.mean()):.2f} | {100 * right:.2f} |")
    return "\n".join(rows)


def timed(work: Callable[[], object]) -> tuple[float, float]:
    """Wall and processor seconds."""
    start, before = time.perf_counter(), os.times()
    work()
    after = os.times()
    return time.perf_counter() - start, after.user + after.system - before.user - before.system


def status(key: str) -> int:
    """Of /proc/self/status, bytes."""
    line = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith(key))
    return int(line.split()[1]) * 1024


def times_table(native, count: int) -> str:
    from scipy.spatial import cKDTree

    points = torus(count, np.random.default_rng(19))[0].astype(np.float32)
    with native.Cloud(points, threads=2) as cloud:
        room = np.empty(count, np.float32)
        del room
        before = status("VmRSS")
        Path("/proc/self/clear_refs").write_text("5")
        whole = timed(lambda: cloud.analyse(threads=2))
        extra = (status("VmHWM") - before) / count
        ours = timed(lambda: cloud.neighbourhoods("soft_radius", neighbours=16, threads=2))
    theirs = timed(lambda: cKDTree(points).query(points, 17, workers=2))
    rows = [f"| {name} | {wall:.2f} | {work:.2f} | {theirs[0] / wall:.1f} | {theirs[1] / work:.1f} |"
            for name, (wall, work) in (("16 neighbours", ours), ("the whole analysis", whole), ("scipy's cKDTree, 17", theirs))]
    return "\n".join([f"{count:,} random points of a torus; the analysis takes {extra:.1f} bytes a point beside the cloud.", "",
                      "| | s | processor, s | times as fast | by processor |", "|---|---|---|---|---|", *rows])


def times(count: int, path: Path | None = None) -> str:
    return times_table(library(path), count)


def normals(path: Path | None = None) -> str:
    return normals_table(library(path))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, default=10_000_000)
    parser.add_argument("--library", type=Path)
    options = parser.parse_args()
    print(times(options.points, options.library) + "\n\n" + normals(options.library))


if __name__ == "__main__":
    main()
