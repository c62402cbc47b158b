# SPDX-License-Identifier: GPL-3.0-or-later
"""What [S]'s cheaper order costs: points sorted once along three axes, both ways, and drawn in that of the six which lies nearest to the
view. A parallel view looks through any depth at the same pixels: points that are moved along it to where their axis' order has them are
drawn in that order by the same kernel, and their picture is held against the exact one. Pop: how far a pixel changes where the view turns
from one axis to the next, beside what the exact order changes over a tenth of a degree there.

    python tests/bench/presort.py [--library FILE] [--quick]"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import Any

sys.path[:0] = [str(Path(__file__).resolve().parents[2] / "addon"), str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parents[1])]

import groves  # noqa: E402
import numpy as np  # noqa: E402
from native.abi import SOFT, SOFT_MODEL  # noqa: E402
from truth.camera import Camera  # noqa: E402

import native  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
SIZE, PLANTS = 512, 5
TURNS, STEP = (0.0, 1.0, 20.0, 45.0), 0.1  # degrees
AHEAD, ASIDE = (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0)  # the axes on both sides of 45 degrees


Points = tuple[np.ndarray, np.ndarray, float, float]  # positions, colors, radius, opacity through a center


def grove(millions: float, classes: tuple[int, ...]) -> Points:
    """Of the made-up scan; balls of 2 cm."""
    position, _, color, own = groves.grove(round(millions * 1e6))
    some = np.isin(own, classes)
    return position[some], color[some], 0.02, 0.1


def chain() -> Points:
    """Ten spheres, each into the next, askew to all axes."""
    along = np.linspace(-1.0, 1.0, 10)[:, None]
    color = 255.0 * np.abs(np.cos(np.arange(10.0)[:, None] * np.array([1.0, 1.7, 2.3])))
    return (along * np.array([1.0, 0.8, 0.3])).astype(np.float32), color.astype(np.uint8), 0.35, 0.6


def level() -> Points:
    """Spheres half over each other whose centers lie at one depth of the first view."""
    x, z = (each.ravel() for each in np.meshgrid(np.arange(-4, 5), np.arange(-4, 5)))
    color = np.stack([x % 3 * 127, z % 2 * 255, (x + z) % 4 * 85], 1).astype(np.uint8)
    return 0.2 * np.stack([x, 0 * x, z], 1).astype(np.float32), color, 0.25, 0.6


def _picture(device: native.Device, points: Points, angle: float, axis: tuple[float, float, float] | None = None) -> np.ndarray:
    """The view is level and looks `angle` degrees from +y; axis: in whose order points are drawn, None: the exact one."""
    position, color, radius, opacity = points
    turn = np.radians(angle)
    right, into = np.array([np.cos(turn), np.sin(turn), 0.0]), np.array([-np.sin(turn), np.cos(turn), 0.0])
    own = position.astype(np.float64) - (position.min(axis=0) + position.max(axis=0)) / 2.0
    half = 1.02 * float(np.linalg.norm(own, axis=1).max()) + radius
    if axis is not None:
        own += np.outer(own @ axis - own @ into, into)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = right, (0.0, 0.0, 1.0), -into, -4.0 * half * into
    scene = native.Scene()
    cloud = native.Cloud(own.astype(np.float32), None, np.ascontiguousarray(color))
    scene.add_cloud(cloud, lighting=1, soft=SOFT["ALL"], soft_model=SOFT_MODEL["EXPRESS"], soft_radius=radius, soft_opacity=opacity)
    scene.set_settings(width=SIZE, height=SIZE, passes=1, own_background=1, background=(0.8, 0.85, 0.9))
    scene.set_camera(**Camera(matrix, -half, half, -half, half, near=half, far=7.0 * half, orthographic=True).fields())
    frame = native.Frame(device)
    frame.render(scene)
    return frame.read("COMBINED")[..., :3].astype(np.float64)


def _off(one: np.ndarray, other: np.ndarray) -> tuple[float, float]:
    """Root mean square where either shows anything, and worst."""
    shown = (np.abs(one - one[0, 0]) + np.abs(other - other[0, 0])).max(axis=2) > 1e-6
    apart = np.abs(one - other)[shown]
    return float(np.sqrt(np.square(apart).mean())), float(apart.max())


def measure(device: native.Device, points: Points) -> dict[str, Any]:
    exact = {turn: _picture(device, points, turn) for turn in (*TURNS, TURNS[-1] + STEP)}
    last = TURNS[-1]
    return {"turns": [_off(exact[turn], _picture(device, points, turn, AHEAD)) for turn in TURNS],
            "pop": _off(_picture(device, points, last, AHEAD), _picture(device, points, last, ASIDE)),
            "step": _off(exact[last], exact[last + STEP])}


def table(found: dict[str, dict[str, Any]]) -> str:
    """Cells: rms, worst; linear color."""
    head = ["scene", *(f"{turn:g}° from the axis" for turn in TURNS), "pop at the change of axes", f"exact, {STEP:g}° further"]
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    for name, row in found.items():
        cells = [f"{rms:.4f}, {worst:.3f}" for rms, worst in (*row["turns"], row["pop"], row["step"])]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def text(quick: bool, _library: Path | None = None) -> str:
    device = native.Device("cpu", 2)
    millions = 0.1 if quick else 1.2
    scenes = {f"trees, of {millions:g}M": grove(millions, (PLANTS,)), f"house, lawn and trees, {millions:g}M": grove(millions, (2, PLANTS, 6)),
              "chain of ten": chain(), "equal depths": level()}
    return table({name: measure(device, points) for name, points in scenes.items()})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--library", type=Path, default=ROOT / "build/out/release/libpatina.so")
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    os.environ["PATINA_LIBRARY"] = str(options.library.resolve())
    print(text(options.quick))


if __name__ == "__main__":
    main()
