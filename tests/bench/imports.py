# SPDX-License-Identifier: GPL-3.0-or-later
"""How long a large LAZ takes to come into Blender, and how much memory: as a mesh, as a linked cloud, and again.

bench.py calls measure(); the file runs itself in a bpy module, once to write the LAZ and once for each import, and in Debian's
Blender. Processor seconds stand beside the others, for other programs make those long.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
WHEELS = ROOT / "build/out/wheels"
PIECE = 1 << 20


def measure(points: int, library: Path) -> str:
    """A table, or "skip: " and why there is none."""
    with tempfile.TemporaryDirectory(prefix="patina-bench-") as name:
        folder = Path(name)
        python = ROOT / "build/out/bpy45/bin/python"
        if not python.exists():
            return "skip: needs build/out/bpy45 (build/setup test)."
        if not WHEELS.is_dir():
            subprocess.run([ROOT / "build/package"], capture_output=True, check=False)
        wheels = [path for kind in ("laspy", "lazrs") for path in sorted(WHEELS.glob(f"{kind}-*"))
                  if "-none-any" in path.name or "-cp311-" in path.name]
        if len(wheels) < 2:
            return f"skip: needs wheels of laspy and lazrs, which build/package fetches into {WHEELS}."
        for wheel in wheels:
            zipfile.ZipFile(wheel).extractall(folder)
        (folder / "patina").symlink_to(ROOT / "addon")
        (folder / "data").mkdir()
        environment = {**os.environ, "PYTHONPATH": name, "PATINA_LIBRARY": str(library),
                       "BLENDER_USER_DATAFILES": str(folder / "data"), "PYTHONDONTWRITEBYTECODE": "1"}
        rows = []
        module, debian = [python, __file__], [
            "blender", "-b", "--factory-startup", "--python-use-system-env", "--python", __file__, "--"]
        for program, step, label in ((module, "write", ""), (module, "mesh", "import as a mesh"),
                                     (debian, "mesh", "the same in Debian's Blender"),
                                     (module, "link", "link, the first time"), (module, "link", "link, again")):
            done = subprocess.run([*program, step, folder / "scan.laz", str(points)], env=environment,
                                  capture_output=True, text=True, check=False)
            if done.returncode:
                return f"skip: {label or step}: {(done.stderr.strip().splitlines() or ['failed'])[-1]}"
            if label:
                got = json.loads(done.stdout.splitlines()[-1])
                if program is module:
                    before = got["before_mb"]
                rows.append(f"| {label} | {got['seconds']:.2f} | {got['processor']:.2f} | {got['peak_mb']:,.0f} |")
        size = (folder / "scan.laz").stat().st_size / 1e6
        head = f"{points:,} points, LAZ of {size:,.0f} MB, Blender 4.5 as a module (its {before:,.0f} MB counted)."
        return "\n".join([head, "", "| | s | processor, s | peak memory, MB |", "|---|---|---|---|", *rows])


def write(path: Path, points: int) -> None:
    """A flown strip: ground with waves, colours, intensity, GPS time, two classes."""
    import laspy
    import numpy as np
    header = laspy.LasHeader(point_format=3, version="1.2")
    header.scales, header.offsets = [0.001] * 3, [500000, 5000000, 100]
    rng = np.random.default_rng(1)
    with laspy.open(str(path), mode="w", header=header, do_compress=True) as file:
        for first in range(0, points, PIECE):
            index = np.arange(first, min(first + PIECE, points))
            x, y = (part * 0.05 + rng.normal(0, 0.01, len(index)) for part in (index % 5000, index // 5000))
            z = 3 * np.sin(x * 0.1) * np.cos(y * 0.07) + rng.normal(0, 0.02, len(index))
            record = laspy.ScaleAwarePointRecord.zeros(len(index), header=header)
            record.x, record.y, record.z = 500000 + x, 5000000 + y, 100 + z
            record.intensity = 200 + 100 * np.sin(x) + rng.integers(0, 40, len(index))
            record.gps_time = 1e5 + index * 2e-6
            record.classification = np.where(z > 1, 5, 2)
            record.return_number[:] = record.number_of_returns[:] = 1
            for shift, name in enumerate(("red", "green", "blue")):
                record[name] = (100 + 20 * shift + 60 * np.sin(x * 0.5) + rng.integers(0, 20, len(index))).astype(int) * 256
            file.write_points(record)


def peak_mb() -> float:
    """In MB (10^6 bytes); Linux counts in kibibytes."""
    import resource
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6


def bring(step: str, path: Path) -> None:
    import bpy
    import patina
    patina.register()
    before = peak_mb()
    start, used = time.perf_counter(), time.process_time()
    bpy.ops.import_scene.patina_points(filepath=str(path), link=step == "link")
    print(json.dumps({"seconds": time.perf_counter() - start, "processor": time.process_time() - used,
                      "peak_mb": peak_mb(), "before_mb": before}), flush=True)
    os._exit(0)  # the bpy module may hang in its own clean-up


if __name__ == "__main__":
    wanted = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else sys.argv[1:]
    if wanted[0] == "write":
        write(Path(wanted[1]), int(wanted[2]))
    else:
        bring(wanted[0], Path(wanted[1]))
