# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of [S Table 1]: its sizes at 1024 x 1024, plain splatting, one layer of transparency and soft points, our frames a second
beside the printed ones. Its scans are not to be had: trees before a wall (groves.py) in their sizes stand for them.

    python tests/bench/soft_points.py [--library FILE] [--device NAME] [--millions 1.2 3.9 ...]"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path
from statistics import median
from typing import Any

sys.path[:0] = [str(Path(__file__).resolve().parents[2] / "addon"), str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parents[1])]

import groves  # noqa: E402
import numpy as np  # noqa: E402
from native.abi import FIELD_SOURCE, SOFT, SOFT_MODEL  # noqa: E402
from native.points import Field  # noqa: E402
from truth import look  # noqa: E402

import native  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
PRINTED = {1.2: (196.8, 150.1, 154.4), 3.9: (46.4, 26.7, 31.9), 7.5: (19.1, 12.3, 15.5), 10.8: (14.8, 8.0, 9.6), 16.0: (9.1, 5.4, 6.6),
           27.2: (5.3, 2.9, 3.6)}  # millions of points: frames a second of SP, OLT, ST, GTX 1080
COLUMNS = {"SP": "SPLATS", "OLT": "ONE_LAYER", "ST": "EXPRESS"}
SIZE, FRAMES, OPACITY, PLANTS = 1024, 5, 0.1, 5
COLOR_AND_DEPTH = 3  # as the other tables are timed: all passes would count every soft point, whatever light is left


def _scene(cloud: native.Cloud, field: Field | None, model: int, turn: float) -> native.Scene:
    scene = native.Scene()
    soft = {"soft": SOFT["FIELD"], "field": field, "soft_model": model, "soft_opacity": OPACITY, "soft_threshold": 0.5} if field else {}
    scene.add_cloud(cloud, lighting=1, **soft)
    scene.set_settings(width=SIZE, height=SIZE, passes=COLOR_AND_DEPTH, own_background=1, background=(0.8, 0.85, 0.9))
    angle = np.radians(turn)
    scene.set_camera(**look(np.array([9.5 * np.sin(angle), -9.5 * np.cos(angle), 3.2]), np.array([0.0, 0.5, 2.4])).fields())
    return scene


def _frames(device: native.Device, cloud: native.Cloud, field: Field | None, model: int, count: int) -> tuple[np.ndarray, float, float]:
    """The first picture; medians of the processor's and the clock's milliseconds, the camera a degree further each time."""
    frame, own, wall = native.Frame(device), [], []
    frame.render(_scene(cloud, field, model, 0.0))
    picture = frame.read("COMBINED")[..., :3].copy()
    for k in range(count):
        scene = _scene(cloud, field, model, float(k))
        start, clock = time.process_time(), time.perf_counter()
        frame.render(scene)
        own.append(1e3 * (time.process_time() - start))
        wall.append(1e3 * (time.perf_counter() - clock))
    return picture, median(own or [0.0]), median(wall or [0.0])


def measure(device: str, millions: list[float], threads: int = 2) -> dict[str, Any]:
    rows = []
    for size in millions:
        position, normal, color, classes = groves.grove(round(size * 1e6))
        cloud = native.Cloud(position, normal, color, classes=classes.reshape(-1, 1))
        del position, normal, color, classes
        field = Field(cloud, source=FIELD_SOURCE["CLASSES"], classes=(1 << PLANTS, *[0] * 7))
        opened = native.Device(device, threads)
        row: dict[str, Any] = {"millions": size, "work": {}, "ms": {}, "rms": {}}
        exact = _frames(opened, cloud, field, SOFT_MODEL["BASE"], 0)[0]
        for column, model in COLUMNS.items():
            if model in SOFT_MODEL:
                shown, row["work"][column], row["ms"][column] = _frames(opened, cloud, field, SOFT_MODEL[model], FRAMES)
                row["rms"][column] = float(np.sqrt(np.square(shown - exact).mean()))
        _, row["work"]["filled"], row["ms"]["filled"] = _frames(opened, cloud, None, 0, FRAMES)
        rows.append(row)
        print(f"soft: {size} million points: work {row['work']}, clock {row['ms']}, rms {row['rms']}", file=sys.stderr, flush=True)
    return {"device": opened.description, "threads": threads, "rows": rows}


def table(found: dict[str, Any]) -> str:
    threads = found["threads"]
    lines = ["| points | SP | OLT | ST | its model's error, rms | ST against SP | filled, without soft points |", "|---|---|---|---|---|---|---|"]
    for row in found["rows"]:
        cells = []
        for column, printed in zip(COLUMNS, PRINTED[row["millions"]], strict=True):
            work = row["work"].get(column)
            ours = 1e3 * threads / work if work else 0.0
            cells.append(f"{printed:g} → {ours:.1f} (**{ours / printed:.2f}×**)" if work else f"{printed:g} → –")
        against = f"{row['work']['ST'] / row['work']['SP']:.2f}×" if "SP" in row["work"] else "–"
        lines.append(f"| {row['millions']:g}M | " + " | ".join(cells) + f" | {row['rms']['ST']:.4f} | {against} | "
                     f"{1e3 * threads / row['work']['filled']:.1f} |")
    return "\n".join(lines)


def text(quick: bool, _library: Path | None = None) -> str:
    """Of the best that this processor has, and of AVX2 where that is another."""
    millions = [1.2] if quick else list(PRINTED)
    parts, described = [], set()
    for device in ("cpu", "cpu-avx2"):
        try:
            description = native.Device(device, 2).description
            if description in described:
                continue
            described.add(description)
            found = measure(device, millions)
        except native.PatinaError as error:
            parts.append(f"{device}: {error}")
            continue
        parts.append(f"{found['device']}:\n\n{table(found)}")
    return "\n\n".join(parts)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--library", type=Path, default=ROOT / "build/out/release/libpatina.so")
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--millions", type=float, nargs="+", default=list(PRINTED))
    options = parser.parse_args()
    os.environ["PATINA_LIBRARY"] = str(options.library.resolve())
    found = measure(options.device, options.millions)
    print(f"{found['device']}:\n\n{table(found)}")


if __name__ == "__main__":
    main()
