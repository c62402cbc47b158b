# SPDX-License-Identifier: GPL-3.0-or-later
"""Speed against error: a random torus at 1024x1024 on every device, with its exact picture beside every time.

    build/bench [--quick] [--compare OLD.json] [--device NAME]... [--points N]... [--out FOLDER]

Writes bench.md, bench.json and bench.png. Times are figures, never verdicts: nothing here passes or fails.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import case as one_case
import machine
import report
import truth

ROOT = Path(__file__).resolve().parents[2]
SIZE = 1024


def cases(options: argparse.Namespace) -> list[dict[str, Any]]:
    """device, points, quality, threads of each row; the GL devices may be software: one size is enough there."""
    devices = options.device or ["cpu", "gl-egl", "gl-osmesa"]
    sizes = options.points or ([100_000, 1_000_000] if options.quick else [100_000, 1_000_000, 10_000_000])
    chosen = []
    for device in devices:
        for points in sizes:
            if device.startswith("gl") and points != 1_000_000 and not options.points:
                continue
            chosen.append((device, points, "refined", 0))
            if points == 1_000_000:
                chosen.append((device, points, "paper", 0))
        if device == "cpu" and not options.quick and machine.cores() > 1:
            chosen.append((device, 1_000_000, "refined", 1))
    return [{"scene": "torus", "mode": "surface", "device": device, "width": SIZE, "height": SIZE, "points": points,
             "quality": quality, "threads": threads, "frames": options.frames}
            for device, points, quality, threads in chosen]


def run(case: dict[str, Any]) -> dict[str, Any]:
    """The row of a case, measured in a fresh process."""
    done = subprocess.run([sys.executable, str(Path(one_case.__file__))], input=json.dumps(case), text=True,
                          stdout=subprocess.PIPE, cwd=Path(__file__).parent)
    if done.returncode:
        return {**case, "unavailable": f"the case ended with status {done.returncode}"}
    return json.loads(done.stdout)


def measure(options: argparse.Namespace) -> dict[str, Any]:
    os.environ["PATINA_LIBRARY"] = str(options.library)
    result = {
        "date": datetime.date.today().isoformat(), "processor": machine.processor(), "cores": machine.cores(),
        "load": os.getloadavg()[0],
        "version": one_case.native.library().patina_version().decode(), "frames": options.frames,
        "distance": truth.DISTANCE, "elevation": truth.ELEVATION, "fov": truth.FOV,
        "bandwidth": machine.copy_bandwidth(machine.cores()), "bandwidth_one": machine.copy_bandwidth(1), "rows": [],
    }
    with tempfile.TemporaryDirectory() as folder:
        exact = str(Path(folder) / "truth.npz")
        truth.cast(truth.view(0.0), SIZE).save(exact)
        for case in cases(options):
            row = run({**case, "library": str(options.library), "truth": exact})
            row.pop("library", None)
            row.pop("truth", None)
            if "unavailable" in row:
                print(f"skip {row['device']}: {row['unavailable']}", file=sys.stderr)
            else:
                moved = 12 * row["points"] + row["plane_bytes"]
                row["floor_ms"] = moved / result["bandwidth"] / 1e6
                print(f"{report.name_of(row)}, {row['points']} points, {row['quality']}: {row['ms_median']:.2f} ms "
                      f"({row['ms_min']:.2f} to {row['ms_max']:.2f})", file=sys.stderr)
            result["rows"].append(row)
    return result


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer sizes: at most two minutes")
    parser.add_argument("--compare", type=Path, metavar="OLD.json", help="print ratios to an older run")
    parser.add_argument("--device", action="append", help="default: cpu, gl-egl, gl-osmesa")
    parser.add_argument("--points", action="append", type=int)
    parser.add_argument("--frames", type=int, default=24, help="measured frames a case (default 24)")
    parser.add_argument("--out", type=Path, default=ROOT / "build/out/bench")
    parser.add_argument("--library", type=Path, default=ROOT / "build/out/release/libpatina.so")
    options = parser.parse_args()
    options.library = options.library.resolve()
    if not options.library.is_file():
        parser.error(f"there is no {options.library}: run build/compile first")
    old = json.loads(options.compare.read_text()) if options.compare else None

    result = measure(options)
    text = report.markdown(result)
    if old:
        text += "\n" + report.compare(result, old)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "bench.md").write_text(text)
    (options.out / "bench.json").write_text(json.dumps(result, indent=1))
    if any("unavailable" not in row for row in result["rows"]):
        report.plot(result, options.out / "bench.png")
    print(text)
    print(f"written: {options.out}/bench.md, bench.json, bench.png")
    return 0


if __name__ == "__main__":
    sys.exit(main())
