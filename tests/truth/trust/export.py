# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes virtual scans for programs that compute features of them.

    build/out/venv/bin/python tests/truth/trust/export.py FOLDER [--scenes trained]

NAME.ply: binary, x y z as double, red green blue as uchar, scan as int. Beside it, raw and in the order of its points: NAME.wrong
and NAME.cause (uint8; numbers of scanner.CAUSES), NAME.off (float32, metres). NAME.stations: a station a line, x y z; samples of
a walk have scan numbers behind these."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "tests"))

from truth.scans import campaigns  # noqa: E402
from truth.scans.exact import Stage  # noqa: E402
from truth.scans.scanner import Scan  # noqa: E402

LAYOUT = np.dtype([*((axis, "<f8") for axis in "xyz"), *((name, "u1") for name in ("red", "green", "blue")), ("scan", "<i4")])
WORDS = {"<f8": "double", "|u1": "uchar", "<i4": "int"}


def write(scan: Scan, folder: Path, name: str) -> None:
    points = np.empty(len(scan), LAYOUT)
    for k, axis in enumerate("xyz"):
        points[axis] = scan.position[:, k]
    for k, channel in enumerate(("red", "green", "blue")):
        points[channel] = scan.color[:, k]
    points["scan"] = scan.scan
    fields = "\n".join(f"property {WORDS[LAYOUT[field].str]} {field}" for field in LAYOUT.names)
    with open(folder / f"{name}.ply", "wb") as file:
        file.write(f"ply\nformat binary_little_endian 1.0\nelement vertex {len(scan)}\n{fields}\nend_header\n".encode())
        points.tofile(file)
    scan.wrong.astype(np.uint8).tofile(folder / f"{name}.wrong")
    scan.cause.astype(np.uint8).tofile(folder / f"{name}.cause")
    scan.off.astype(np.float32).tofile(folder / f"{name}.off")
    np.savetxt(folder / f"{name}.stations", scan.stations.reshape(-1, 3), "%.9g")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--scenes", default="trained")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    for scene in campaigns.group(options.scenes):
        scan = Stage(scene).scan
        write(scan, options.folder, scene.name)
        print(f"{scene.name}: {len(scan):,} points, {100.0 * scan.wrong.mean():.2f} % wrong", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
