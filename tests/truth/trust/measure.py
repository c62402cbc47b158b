# SPDX-License-Identifier: GPL-3.0-or-later
"""Lets the library write the features of virtual scans, for train.py and report.py.

    build/out/venv/bin/python tests/truth/trust/measure.py FOLDER [--scenes campaigns]

NAME.f32: raw float32 (points, F), in the order of the scan. NAME.known.f32: the same with the stations, where every sample has one.
The library is $PATINA_LIBRARY, else build/out/release/libpatina.so."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "addon")]

from truth.scans import campaigns  # noqa: E402
from truth.scans.exact import Stage  # noqa: E402


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--scenes", default="campaigns")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    os.environ.setdefault("PATINA_LIBRARY", str(ROOT / "build/out/release/libpatina.so"))
    import native
    for scene in campaigns.group(options.scenes):
        scan = Stage(scene).scan
        every = len(scan.stations) > int(scan.scan.max())
        for ending, given in ((".f32", {}), (".known.f32", {"stations": scan.stations,
                                                            "station": scan.scan.astype(np.uint8)[:, None]})):
            if given and not every:
                continue
            cloud = native.Cloud(np.ascontiguousarray(scan.position, np.float32), None, np.ascontiguousarray(scan.color))
            features = np.zeros((len(scan), native.abi.TRUST_FEATURES), np.float32)
            cloud.analyse(trust_features=features, **given)
            features.tofile(options.folder / (scene.name + ending))
        print(f"{scene.name}: {len(scan):,} points", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
