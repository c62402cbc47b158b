# SPDX-License-Identifier: GPL-3.0-or-later
"""Soft points against a volume renderer's: OSPRay's particle volume (peer_ospray.py) sums Gaussians and marches through them, Patina's
Base integrates balls of density 1 - s / r. Both draw the same points with the same reach and the same opacity through a center, and each
is held against the exact integral of its own kernel, in float64.

    python tests/bench/volumes.py [--library FILE] [--quick]"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any

sys.path[:0] = [str(Path(__file__).resolve().parents[2] / "addon"), str(Path(__file__).resolve().parent)]

import numpy as np  # noqa: E402
from native.abi import SOFT, SOFT_MODEL  # noqa: E402
from scipy.special import erf  # noqa: E402

import native  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
SIDE, OPACITY, PIXELS = 2.0, 0.5, 2000  # of the square that is seen; through a ball's center; pixels that are held against the truth
RATES = (1.0, 4.0, 16.0)  # samples of OSPRay: 1 is its default
SCENES = {"even": (0.05, 0.05), "1 : 30": (0.016, 0.48)}  # least and greatest radius, even in their logarithm
FRAMES = 15


def libraries() -> Path | str:
    """Where OSPRay's lie, or why there are none."""
    found = sorted((ROOT / "build/out/ospray").glob("lib/python3*/site-packages/ovito/plugins/libospray.so.3"))
    if found:
        return found[0].parent
    reason = ROOT / "build/out/ospray.skip"
    return reason.read_text().strip() if reason.is_file() else "build/setup bench has not fetched OSPRay"


def _cloud(radii: tuple[float, float], points: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(7)
    position = random.uniform(-1.0, 1.0, (points, 3)).astype(np.float32)
    least, most = np.log(radii)
    return position, np.exp(random.uniform(least, most, points)).astype(np.float32)


def _depths(position: np.ndarray, radius: np.ndarray, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Exact optical depths along -z at places of the square: of our balls, and of OSPRay's Gaussians."""
    ours, theirs = np.zeros(len(x)), np.zeros(len(x))
    for k in range(0, len(radius), 1000):
        r = radius[k:k + 1000].astype(np.float64)[:, None]
        u = np.hypot(position[k:k + 1000, :1] - x, position[k:k + 1000, 1:2] - y) / r
        at = np.nonzero(u < 1.0)
        u, pixel = u[at], at[1]
        h = np.sqrt(1.0 - u * u)
        np.add.at(ours, pixel, h - np.where(u > 0.0, u * u * np.arcsinh(h / np.maximum(u, 1e-300)), 0.0))
        np.add.at(theirs, pixel, np.exp(-4.5 * u * u) * erf(3.0 * h / np.sqrt(2.0)) / erf(3.0 / np.sqrt(2.0)))
    through = -np.log1p(-OPACITY)
    return through * ours, through * theirs


def _rms(alpha: np.ndarray, exact: np.ndarray) -> float:
    return float(np.sqrt(np.square(alpha - exact).mean()))


def _own(position: np.ndarray, radius: np.ndarray, size: int, model: str) -> tuple[np.ndarray, list[float], list[float]]:
    """Alpha (size, size), and of each frame the processor's milliseconds and the clock's."""
    scene = native.Scene()
    cloud = native.Cloud(position, None, None, radii=radius.reshape(-1, 1))
    scene.add_cloud(cloud, lighting=1, soft=SOFT["ALL"], soft_model=SOFT_MODEL[model], soft_opacity=OPACITY, color=(1.0, 1.0, 1.0))
    scene.set_settings(width=size, height=size, film_transparent=1, smooth=3, antialias=2)
    matrix = np.eye(4)
    matrix[2, 3] = 10.0
    half = SIDE / 2.0
    scene.set_camera(orthographic=1, world_from_camera=tuple(matrix.ravel()), left=-half, right=half, bottom=-half, top=half,
                     near_clip=0.1, far_clip=100.0)
    frame = native.Frame(native.Device("cpu", 2))
    own, wall = [], []
    for _ in range(FRAMES + 2):
        start, clock = time.process_time(), time.perf_counter()
        frame.render(scene)
        own.append(1e3 * (time.process_time() - start))
        wall.append(1e3 * (time.perf_counter() - clock))
    return frame.read("COMBINED")[..., 3], own[2:], wall[2:]


def measure(quick: bool = False) -> dict[str, Any]:
    points, size = (500 if quick else 2_000), 128
    folder, rows = libraries(), []
    y, x = np.divmod(np.random.default_rng(3).choice(size * size, min(PIXELS, size * size), replace=False), size)
    at = [(pixels + 0.5) / size * SIDE - SIDE / 2.0 for pixels in (x, y)]
    for name, radii in SCENES.items():
        position, radius = _cloud(radii, points)
        ours, theirs = (1.0 - np.exp(-depth) for depth in _depths(position, radius, *at))
        for model in ("BASE", "EXPRESS"):
            alpha, own, wall = _own(position, radius, size, model)
            rows.append({"radii": name, "what": f"Patina, {model.capitalize()}", "work": median(own), "ms": median(wall),
                         "rms": _rms(alpha[y, x], ours)})
        if isinstance(folder, Path):
            rows += _peer(folder, name, position, radius, size, lambda alpha, exact=theirs: _rms(alpha[y, x], exact))
    return {"points": points, "size": size, "rows": rows, "absent": "" if isinstance(folder, Path) else folder}


def _peer(folder: Path, name: str, position: np.ndarray, radius: np.ndarray, size: int, rms: Any) -> list[dict[str, Any]]:
    """weights: through each center as much of the light as through ours."""
    weight = -np.log1p(-OPACITY) / (radius / 3.0 * np.sqrt(2.0 * np.pi) * erf(3.0 / np.sqrt(2.0)))
    with tempfile.TemporaryDirectory() as place:
        source, target = Path(place) / "scene.npz", Path(place) / "alpha.npz"
        np.savez(source, position=position, radius=radius, weight=weight.astype(np.float32), most=_most(position, radius, weight),
                 side=SIDE, size=size)
        done = subprocess.run([sys.executable, str(Path(__file__).parent / "peer_ospray.py"), str(folder), source, target, "2",
                               *map(str, RATES)], stdout=subprocess.PIPE, text=True, timeout=3000, check=False)
        if done.returncode:
            return [{"radii": name, "what": "OSPRay", "absent": f"status {done.returncode}"}]
        said = json.loads(done.stdout.splitlines()[-1])
        alphas = np.load(target)["alpha"]
    return [{"radii": name, "what": f"OSPRay 3.2, {rate:g} sample{'s' * (rate > 1)}" + ", its default" * (rate == 1.0), "work": work,
             "ms": wall, "rms": rms(alpha), "built": said["built"], "default": rate == 1.0}
            for rate, work, wall, alpha in zip(RATES, said["times"], said["walls"], alphas)]  # it may have stopped before the last one


def _most(position: np.ndarray, radius: np.ndarray, weight: np.ndarray) -> float:
    """No less than what the Gaussians add up to: at the centers it is greatest, and a third more is left."""
    p, r, w = (array.astype(np.float64) for array in (position, radius, weight))
    dense = np.argsort(-w)[:2000]
    most = 0.0
    for k in range(0, len(dense), 200):
        square = np.square(p[dense[k:k + 200], None, :] - p[None]).sum(2) / np.square(r)
        most = max(most, float((w * np.exp(-4.5 * square) * (square < 1.0)).sum(1).max()))
    return 1.33 * most


def text(quick: bool, _library: Path | None = None) -> str:
    found = measure(quick)
    if found["absent"]:
        return f"skip: {found['absent']}"
    lines = ["| radii | what | rms of opacity against its own kernel's integral | work, ms | against Base | against Express |",
             "|---|---|---|---|---|---|"]
    for name in SCENES:
        rows = [row for row in found["rows"] if row["radii"] == name]
        base, express = (row["work"] for row in rows[:2])
        for row in rows:
            lines.append(f"| {name} | {row['what']} | – | – | – | {row['absent']} |" if "absent" in row else
                         f"| {name} | {row['what']} | {row['rms']:.1e} | {row['work']:.1f} | {row['work'] / base:.1f}× | "
                         f"{row['work'] / express:.1f}× |")
    built = ", ".join(f"{row['built'] / 1e3:.1f} s ({row['radii']})" for row in found["rows"] if row.get("default"))
    return (f"{found['points']:,} balls in a cube, {found['size']} × {found['size']} pixels, half of the light through a ball's center. Work: "
            "milliseconds of the processor, all threads'. Express is another model: its difference from Base's integral stands as its "
            f"error. Before its first picture OSPRay builds for {built}.\n\n" + "\n".join(lines))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--library", type=Path, default=ROOT / "build/out/release/libpatina.so")
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    os.environ["PATINA_LIBRARY"] = str(options.library.resolve())
    print(text(options.quick))


if __name__ == "__main__":
    main()
