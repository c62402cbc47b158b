# SPDX-License-Identifier: GPL-3.0-or-later
"""Faults of colors in virtual scans, and what is left of them in images.

    build/out/venv/bin/python tests/truth/scans/colors.py [--coarse 3] [room facade columns ...]

Of each scene, seen by its second camera: PSNR with its own colors, with scans of other exposure and white balance, kept and balanced,
and with points without a color, kept and lent. --coarse: how much wider the scanner's step is."""

from __future__ import annotations

import argparse
import os
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "addon")]

from truth.scans import metrics, scanner  # noqa: E402
from truth.scans.exact import INSIDE, camera  # noqa: E402
from truth.scans.scanner import Scan, srgb_bytes  # noqa: E402
from truth.scans.scenes import SKY, named  # noqa: E402
from truth.scans.solids import linear  # noqa: E402

WIDTH, HEIGHT = 240, 160
NEAR = 0.05  # of z: pixels that show another surface are not compared


def exposed(scan: Scan, seed: int = 1) -> np.ndarray:
    """sRGB bytes: each scan's light times a factor up to two and a white balance of its own. The reciprocals' mean is 1, which is the gauge of
    what balances them."""
    random = np.random.default_rng(seed)
    count = int(scan.scan.max()) + 1
    factors = np.exp(random.uniform(-0.7, 0.7, (count, 1)) + random.uniform(-0.15, 0.15, (count, 3)))
    factors *= np.mean(1.0 / factors, axis=0)
    return srgb_bytes(linear(scan.color / 255.0) * factors[scan.scan])


def specked(scan: Scan, share: float = 0.08, seed: int = 2) -> np.ndarray:
    """sRGB bytes: a share of the points have no color."""
    color = scan.color.copy()
    color[np.random.default_rng(seed).random(len(color)) < share] = 0
    return color


@dataclass
class Stage:
    """A scene that was scanned coarsely, and what its camera sees: color (h, w, 3) linear and depth (h, w), inf for the sky."""

    scan: Scan
    camera: Any
    color: np.ndarray
    depth: np.ndarray


def stage(name: str, coarse: float, index: int = 1) -> Stage:
    scene = named(name)
    world = scene.make().world()
    scan = scanner.scan(world, replace(scene.survey, step=coarse * scene.survey.step), scene.seed)
    seen = camera(scene.views[index], 0.0, WIDTH, HEIGHT)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    color, depth = np.zeros((HEIGHT * WIDTH, 3)), np.full(HEIGHT * WIDTH, np.inf)
    for k, (u, v) in enumerate(INSIDE):
        origin, way = seen.rays(x.ravel() + u, y.ravel() + v, WIDTH, HEIGHT)
        t, triangle = world.rays.trace(np.array(origin[0]), way)
        hit = triangle >= 0
        own = np.tile(linear(np.array(SKY)), (len(t), 1))
        place = origin[0] + t[hit, None] * way[hit]
        own[hit] = world.rays.albedo(place, triangle[hit])
        color += own / len(INSIDE)
        if k == 0:
            depth[hit] = t[hit]
    return Stage(scan, seen, color.reshape(HEIGHT, WIDTH, 3), depth.reshape(HEIGHT, WIDTH))


class Drawer:
    def __init__(self, device: str = "cpu") -> None:
        os.environ.setdefault("PATINA_LIBRARY", str(ROOT / "build/out/release/libpatina.so"))
        import native
        from native import points
        self.native, self.points = native, points
        self.frame = native.Frame(native.Device(device))

    def draw(self, of: Stage, color: np.ndarray, balanced: bool = False, keep: bool = False, **settings: Any) -> tuple[np.ndarray, np.ndarray]:
        """Linear color (h, w, 3) and depth (h, w)."""
        scan = of.scan
        cloud = self.native.Cloud(np.ascontiguousarray(scan.position, np.float32), None, np.ascontiguousarray(color))
        cloud.analyse(stations=scan.stations, station=scan.scan.astype(np.uint8)[:, None], keep_colors=keep)
        grade = None
        if balanced:
            scans, count = scan.scan.astype(np.uint16), int(scan.scan.max()) + 1
            grade = self.points.Grade(cloud, scans, [(1.0, 1.0, 1.0, 0.0)] * count, self.points.gains(cloud, scans, count))
        scene = self.native.Scene()
        scene.add_cloud(cloud, grade=grade, lighting=1)
        scene.set_settings(**{"width": WIDTH, "height": HEIGHT, "world_color": linear(np.array(SKY)).tolist(), "passes": 3, **settings})
        scene.set_camera(**of.camera.fields())
        self.frame.render(scene)
        return self.frame.read("COMBINED")[..., :3], self.frame.read("DEPTH")[..., 0]

    def psnr(self, of: Stage, color: np.ndarray, **how: Any) -> float:
        drawn, depth = self.draw(of, color, **how)
        both = np.isfinite(of.depth) & np.isfinite(depth)
        same = both & (np.abs(np.where(both, depth, 0.0) - np.where(both, of.depth, 1.0)) < NEAR * np.where(both, of.depth, 0.0))
        return metrics.psnr(metrics.srgb(drawn), metrics.srgb(of.color), same)


def measured(name: str, coarse: float) -> dict[str, float]:
    drawer, of = Drawer(), stage(name, coarse)
    wrong, black = exposed(of.scan), specked(of.scan)
    return {"own colors": drawer.psnr(of, of.scan.color), "exposed": drawer.psnr(of, wrong), "balanced": drawer.psnr(of, wrong, balanced=True),
            "uncolored": drawer.psnr(of, black, keep=True), "lent": drawer.psnr(of, black)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=["room", "facade", "columns"])
    parser.add_argument("--coarse", type=float, default=3.0)
    options = parser.parse_args()
    for number, name in enumerate(options.scenes):
        found = measured(name, options.coarse)
        if not number:
            print("| scene | " + " | ".join(found) + " |\n|" + "---|" * (len(found) + 1))
        print(f"| {name} | " + " | ".join(f"{value:.2f}" for value in found.values()) + " |", flush=True)


if __name__ == "__main__":
    main()
