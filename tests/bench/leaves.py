# SPDX-License-Identifier: GPL-3.0-or-later
"""The leaf test: real scans with vegetation, noise and outliers under a sun, and how many specks their shadows show.

    build/out/venv/bin/python tests/bench/leaves.py [--library FILE] [--pictures FOLDER] [--size N]

A speck is a pixel whose share of light differs by more than 0.7 of the shadow's strength from the mean of six to eight
neighbours on the same surface; counted among 10,000 pixels that take a tenth of the sun's light or more. The share is what the picture shows: its
colour with shadows over that without, under the sun alone, neither smoothed. Half transparent clouds are counted twice: in
every layer by itself, and in the picture that the layers make, whose surface is the nearest one. Scans are those of
../shared/data; one that is not there is a line that says so. Another build's --library gives the counts before a change."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT.parent / "shared/data"
SCANS = ("lidar/lion_takanawa_normals.ply", "heritage/espacio_escultorico_full_density_crop.las", "lidar/vol_total.las",
         "lidar/FSite7_orig-utm.pcd", "lidar/vegetation_1_3.las")
SUN = np.array([-0.5, 0.6, -0.6])
WAYS = {"1 sample": (1, 0.0, 0.0), "16 samples": (16, 0.03, 0.0), "half transparent": (1, 0.0, 0.5)}  # angle, transparency
HEAD = (*WAYS, "its layers")
LAYERS = 4  # of a half transparent cloud


def package() -> None:
    """The add-on's readers without Blender: the package, but not what registers it."""
    sys.modules["patina"] = ModuleType("patina")
    sys.modules["patina"].__path__ = [str(ROOT / "addon")]


def read(path: Path) -> tuple[np.ndarray, np.ndarray | None]:
    from patina import native
    from patina.read.importers import las, pcd
    from patina.read.importers.reading import Filter, Progress

    if path.suffix == ".ply":
        with native.File(str(path)) as file:
            return file.positions(), file.normals()
    points = (las if path.suffix == ".las" else pcd).read(path, Filter(), Progress())
    return points.positions, points.normals


def specks(share: np.ndarray, depth: np.ndarray, near: float, strength: float) -> tuple[int, int]:
    """Specks, and pixels that could be some. near: how far apart neighbours of one surface lie at most; strength: light
    that a shadow takes."""
    some, total, count = np.isfinite(depth), np.zeros(share.shape), np.zeros(share.shape)
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            if dx or dy:
                z = np.roll(depth, (dy, dx), (0, 1))
                same = some & np.roll(some, (dy, dx), (0, 1))
                same &= np.abs(np.where(same, z, 0.0) - np.where(same, depth, 0.0)) < near
                total += np.where(same, np.roll(share, (dy, dx), (0, 1)), 0.0)
                count += same
    able = count >= 6
    return int((able & (np.abs(share - total / np.maximum(count, 1)) > 0.7 * strength)).sum()), int(able.sum())


def render(frame: Any, cloud: Any, camera: dict[str, Any], way: tuple[int, float, float], shadows: int = 1,
           **settings: Any) -> None:
    from patina import native

    samples, angle, transparency = way
    with native.Scene() as scene:
        scene.add_cloud(cloud, lighting=2, transparency=transparency)
        scene.add_light(type=1, power=3.0, direction=SUN.tolist(), shadows=shadows, angle=angle)
        scene.set_settings(shadow_samples=samples, layers=LAYERS, **settings)
        scene.set_camera(**camera)
        frame.render(scene)


def shares(frame: Any, cloud: Any, camera: dict[str, Any], size: int, way: tuple[int, float, float]
           ) -> list[tuple[np.ndarray, np.ndarray]]:
    """Share of the light, and depth, of every pixel: of the picture, then of every layer. Depth is infinite where there is
    little light that shadows could take."""
    suffixes = ["", *(f" {layer}" for layer in range(1, LAYERS + 1))]
    shown, depth = [], []
    for shadows in (1, 0):
        render(frame, cloud, camera, way, shadows, width=size, height=size, smooth=3, antialias=2, layer_passes=3)
        shown.append([frame.read("COMBINED" + suffix)[..., :3].sum(axis=2) for suffix in suffixes])
        depth = [frame.read("DEPTH" + suffix)[..., 0] for suffix in suffixes]
    found = []
    for dark, bare, z in zip(*shown, depth):
        some = bare > 0.1 * bare.max()
        found.append((dark / np.where(some, bare, 1.0), np.where(some, z, np.inf)))
    return found


def camera_of(position: np.ndarray) -> dict[str, Any]:
    """Frames what lies between the 1st and 99th percentiles: outliers are not to shrink the rest."""
    from truth import look

    low, high = np.nanpercentile(position, [1, 99], axis=0)
    centre, reach = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    one = look(centre + 1.5 * reach * np.array([0.55, -0.65, 0.52]), centre)
    return type(one)(**{**vars(one), "near": 0.02 * reach, "far": 20.0 * reach}).fields()


def save(path: Path, rgba: np.ndarray) -> None:
    import matplotlib.image

    matplotlib.image.imsave(path, np.clip(rgba[::-1, :, :3], 0.0, 1.0) ** (1 / 2.2))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--library", type=Path, default=ROOT / "build/out/release/libpatina.so")
    parser.add_argument("--pictures", type=Path, help="a folder for them")
    parser.add_argument("--size", type=int, default=1024)
    options = parser.parse_args()
    os.environ["PATINA_LIBRARY"] = str(options.library.resolve())
    sys.path.insert(0, str(ROOT / "tests"))
    package()
    from patina import native

    print("| scan | points | " + " | ".join(HEAD) + " |\n" + "|---" * (2 + len(HEAD)) + "|")
    with native.Device("cpu") as device, native.Frame(device) as frame:
        for name in SCANS:
            if not (DATA / name).is_file():
                print(f"skip {name}: there is no ../shared/data/{name}")
                continue
            position, normal = read(DATA / name)
            cells = []
            with native.Cloud(position, normal) as cloud:
                for way, how in WAYS.items():
                    camera, near = camera_of(position), 8.0 * cloud.layer_distance  # 16 spacings
                    counts = [specks(*one, near, 1.0 - how[2]) for one in shares(frame, cloud, camera, options.size, how)]
                    for some in (counts[:1], counts[1:])[: 1 + (how[2] > 0.0)]:
                        found, able = np.sum(some, axis=0)
                        cells.append(f"{1e4 * found / max(able, 1):.1f}")
                    if options.pictures:
                        options.pictures.mkdir(parents=True, exist_ok=True)
                        render(frame, cloud, camera, how, width=options.size, height=options.size, world_color=[0.15] * 3)
                        save(options.pictures / f"{Path(name).stem} {way}.png", frame.read("COMBINED"))
            print(f"| {Path(name).stem} | {len(position):,} | " + " | ".join(cells) + " |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
