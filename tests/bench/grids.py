# SPDX-License-Identifier: GPL-3.0-or-later
"""What scanners' grids tell, held against the truth: the scans of a Stanford .conf, with and without their grids, filled, as discs and as
range images, beside the model that was made of them, as triangles.

    build/out/venv/bin/python tests/bench/grids.py SCANS.conf MODEL.ply [--size N]

normal: mean angle off the model's, degrees, over pixels that both draw within a millimetre and a half; outline: pixels that one
draws and the other does not, beside all of the model's, percent; specks: pixels nearer than the model by more than that."""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "addon"), str(Path(__file__).resolve().parent)]

from tables import table  # noqa: E402

NEAR = 1.5e-3  # of the models' unit, metres
SURFACES = {"automatic": 0, "discs": 1, "filling": 2, "range images": 3}
VIEWS = (0.0, 70.0, 140.0, 210.0, 290.0)  # degrees about the vertical, y


def faces(path: Path) -> np.ndarray:
    """(n, 3, 3) corners of an ASCII PLY of triangles."""
    lines = path.read_text(encoding="ascii").splitlines()
    end = lines.index("end_header")
    vertices, triangles = (next(int(line.split()[-1]) for line in lines[:end] if line.startswith(f"element {what}"))
                           for what in ("vertex", "face"))
    places = np.array([line.split()[:3] for line in lines[end + 1:end + 1 + vertices]], np.float64)
    corners = np.array([line.split()[1:4] for line in lines[end + 1 + vertices:end + 1 + vertices + triangles]], np.int64)
    return places[corners]


def look(turn: float, middle: np.ndarray, size: float) -> dict[str, object]:
    a = np.radians(turn)
    back, up = np.array([np.sin(a), 0.0, np.cos(a)]), np.array([0.0, 1.0, 0.0])
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([np.cross(up, back), up, back], 1)
    matrix[:3, 3] = middle + 4.0 * size * back
    scale = 0.62 * size
    return {"world_from_camera": matrix.reshape(-1).tolist(), "orthographic": 1, "left": -scale, "right": scale, "bottom": -scale,
            "top": scale, "near_clip": size, "far_clip": 8.0 * size}


def draw(native: object, frame: object, size: int, camera: dict[str, object], surface: int, add: object) -> dict[str, np.ndarray]:
    scene = native.Scene()
    add(scene)
    scene.set_settings(width=size, height=size, surface=surface, passes=7)
    scene.set_camera(**camera)
    frame.render(scene)
    return {name: frame.read(name) for name in ("DEPTH", "NORMAL")}


def measure(ours: dict[str, np.ndarray], truth: dict[str, np.ndarray]) -> tuple[float, float, float]:
    depth, model = ours["DEPTH"][..., 0], truth["DEPTH"][..., 0]
    shown, there = np.isfinite(depth), np.isfinite(model)
    both = shown & there
    off = np.where(shown, depth, 0.0) - np.where(there, model, 0.0)
    near = both & (np.abs(off) < NEAR)
    cosine = np.abs((ours["NORMAL"] * truth["NORMAL"]).sum(2))[near].clip(0.0, 1.0)
    specks = both & (off < -NEAR)
    return float(np.degrees(np.arccos(cosine)).mean()), 100.0 * (shown != there).sum() / there.sum(), 100.0 * specks.sum() / there.sum()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scans", type=Path)
    parser.add_argument("model", type=Path)
    parser.add_argument("--size", type=int, default=600)
    options = parser.parse_args()
    os.environ.setdefault("PATINA_LIBRARY", str(ROOT / "build/out/release/libpatina.so"))
    import native
    frame = native.Frame(native.Device("cpu"))
    corners = faces(options.model)
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-30)
    mesh = native.Mesh(np.ascontiguousarray(corners.reshape(-1, 3), np.float32), np.repeat(flat, 3, 0).astype(np.float32), None)
    file = native.File(str(options.scans))
    places = np.ascontiguousarray(file.positions() + np.array(file.origin), np.float32)
    row, column, scan = (np.ascontiguousarray(file.attribute(file.attributes.index(name)), np.float32).reshape(-1, 1)
                         for name in ("row", "column", "scan"))
    told = file.scans()
    grid = (row.astype(np.uint32), column.astype(np.uint32))
    middle, size = 0.5 * (corners.min((0, 1)) + corners.max((0, 1))), float(np.ptp(corners, axis=(0, 1)).max())
    cameras = [look(turn, middle, size) for turn in VIEWS]
    truth = [draw(native, frame, options.size, camera, 0, lambda scene: scene.add_mesh(mesh)) for camera in cameras]
    rows = []
    for words in ("without", "with"):
        cloud = native.Cloud(places, None, None)
        began = time.perf_counter()
        cloud.analyse(grid=grid, scan=scan.astype(np.uint16), by_grid=words == "with",
                      directions=np.array([one.direction for one in told], np.float64))
        spent = time.perf_counter() - began
        for name, surface in SURFACES.items():
            if name == "range images" and words == "with":
                continue  # these ask no analysis
            found = [measure(draw(native, frame, options.size, camera, surface, lambda scene: scene.add_cloud(cloud)), picture)
                     for camera, picture in zip(cameras, truth, strict=True)]
            normal, outline, specks = np.mean(found, axis=0)
            rows.append([name, words, f"{normal:.2f}", f"{outline:.2f}", f"{specks:.2f}", f"{spent:.1f}"])
    print(table(["surface", "the grid", "normal °", "outline %", "specks %", "analysis s"], rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
