# SPDX-License-Identifier: GPL-3.0-or-later
"""[S Figs. 6, 7]: one sphere, two that intersect, and trees before a wall, drawn by the Concentric model with more and more shells and by
the Express model, and how far each lies from Base: Euclidean differences of linear colour, where there is anything soft.

    python tests/bench/soft_models.py [--library FILE]"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parents[2] / "addon"), str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parents[1])]

import groves  # noqa: E402
import numpy as np  # noqa: E402
from native.abi import FIELD_SOURCE, SOFT, SOFT_MODEL  # noqa: E402
from native.points import Field  # noqa: E402
from truth import look  # noqa: E402

import native  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
SIZE, PLANTS, POINTS = 512, 5, 100_000
SHELLS = (1, 2, 4, 8, 16, 32, 64)
ALL = {"soft": SOFT["ALL"], "soft_radius": 1.0, "soft_opacity": 0.9}


def _scenes() -> dict[str, tuple]:
    """Clouds, how they are soft, and from where they are seen."""
    position, normal, color, classes = groves.grove(POINTS)
    trees = native.Cloud(position, normal, color, classes=classes.reshape(-1, 1))
    field = Field(trees, source=FIELD_SOURCE["CLASSES"], classes=(1 << PLANTS, *[0] * 7))
    single = native.Cloud(np.zeros((1, 3), np.float32), None, np.uint8([[230, 90, 40]]))
    pair = native.Cloud(np.float32([[-0.5, 0.2, 0.0], [0.5, -0.2, 0.1]]), None, np.uint8([[230, 90, 40], [40, 110, 220]]))
    before = look(np.array([0.0, -4.0, 0.0]), np.zeros(3))
    return {"one sphere": (single, ALL, before), "two that intersect": (pair, ALL, before),
            f"trees before a wall, {POINTS:,} points": (trees, {"soft": SOFT["FIELD"], "field": field, "soft_threshold": 0.5, "soft_opacity": 0.1},
                                                    look(np.array([0.0, -9.5, 3.2]), np.array([0.0, 0.5, 2.4])))}


def _picture(device: native.Device, of: tuple, model: str, shells: int = 0) -> np.ndarray:
    cloud, soft, camera = of
    scene = native.Scene()
    scene.add_cloud(cloud, lighting=1, soft_model=SOFT_MODEL[model], soft_shells=shells, **soft)
    scene.set_settings(width=SIZE, height=SIZE, passes=1, own_background=1, background=(0.8, 0.85, 0.9))
    scene.set_camera(**camera.fields())
    frame = native.Frame(device)
    frame.render(scene)
    return frame.read("COMBINED")[..., :3].astype(np.float64)


def _off(one: np.ndarray, other: np.ndarray, bare: np.ndarray) -> str:
    apart = np.linalg.norm(one - other, axis=2)[np.abs(one - bare).max(axis=2) > 1e-6]
    return f"{np.sqrt(np.square(apart).mean()):.1e}, {apart.max():.1e}"


def text(_quick: bool, _library: Path | None = None) -> str:
    """Cells: rms, worst."""
    device = native.Device("cpu", 2)
    head = ["scene", *(f"Concentric, {n}" for n in SHELLS), "as many as its size asks for", "Express"]
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    for name, of in _scenes().items():
        base = _picture(device, of, "BASE")
        bare = _picture(device, (of[0], {**of[1], "soft_opacity": 1e-6}, of[2]), "EXPRESS")
        cells = [_off(base, _picture(device, of, "CONCENTRIC", n), bare) for n in (*SHELLS, 0)]
        lines.append(f"| {name} | " + " | ".join([*cells, _off(base, _picture(device, of, "EXPRESS"), bare)]) + " |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--library", type=Path, default=ROOT / "build/out/release/libpatina.so")
    options = parser.parse_args()
    os.environ["PATINA_LIBRARY"] = str(options.library.resolve())
    print(text(False))


if __name__ == "__main__":
    main()
