# SPDX-License-Identifier: GPL-3.0-or-later
"""How long a LAZ takes to become a saved cloud on the disk, beside laspy's bare reading of it in the same run, and the peak memory.

    python tests/bench/building.py [--points N] [--memory MB] [--folder FOLDER] [--library FILE]

Where a `pdal` is on the path, beside it too: PDAL reads the same LAZ, and makes a COPC of it.

The Python needs numpy, laspy and lazrs: that of build/out/venv, with the readers of build/out/readers on PYTHONPATH. Each step is a process of its own, so that its peak is its own."""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import types
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PIECE = 1 << 20


def native():
    """The add-on's ctypes, without Blender."""
    package = types.ModuleType("patina")
    package.__path__ = [str(ROOT / "addon")]
    sys.modules["patina"] = package
    from patina.native import building
    return building


def read(path: Path) -> int:
    import laspy
    with laspy.open(str(path)) as file:
        return sum(len(points) for points in file.chunk_iterator(PIECE))


def build(path: Path, out: Path, memory: int) -> int:
    import laspy
    import numpy as np
    building = native()
    with laspy.open(str(path)) as file:
        header = file.header
        origin = tuple(float(value) for value in np.floor(header.mins))
        done = 0
        with building.Builder(out, memory, header.point_count, (tuple(header.mins), tuple(header.maxs))) as builder:
            for points in file.chunk_iterator(PIECE):
                raw = points.array
                positions = np.empty((len(raw), 3), np.float32)
                for axis, name in enumerate("XYZ"):
                    positions[:, axis] = raw[name] * header.scales[axis] + (header.offsets[axis] - origin[axis])
                builder.add(positions, colors=np.stack([raw[name] for name in ("red", "green", "blue")], 1),
                            scalars=np.ascontiguousarray(raw["intensity"]).reshape(-1, 1),
                            classes=(raw["raw_classification"] & 31).reshape(-1, 1), origin=origin)
                done += len(raw)
            print(f"read {time.perf_counter() - START:.1f} s", file=sys.stderr)
            builder.start_end().result()
    return done


def step(name: str, *rest: str) -> dict:
    done = subprocess.run([sys.executable, __file__, "--step", name, *rest], stdout=subprocess.PIPE, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def peer(*command: str) -> dict:
    """Another program's time and peak memory."""
    start = time.perf_counter()
    running = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, code, used = os.wait4(running.pid, 0)
    running.returncode = os.waitstatus_to_exitcode(code)
    if running.returncode:
        raise SystemExit(f"{' '.join(command)} ended with {running.returncode}")
    return {"seconds": time.perf_counter() - start, "processor": used.ru_utime + used.ru_stime, "peak_mb": used.ru_maxrss * 1024 / 1e6}


def peers(laz: Path) -> dict[str, dict]:
    """What PDAL takes, where it is there."""
    pdal = shutil.which("pdal")
    if not pdal:
        print("skip: no pdal on the path")
        return {}
    return {"PDAL reads all (pdal info --stats)": peer(pdal, "info", "--stats", str(laz)),
            "PDAL makes a COPC (pdal translate)": peer(pdal, "translate", str(laz), str(laz.with_name("scan.copc.laz")), "--writer", "writers.copc")}


def main() -> None:
    given = argparse.ArgumentParser()
    given.add_argument("--points", type=int, default=20_000_000)
    given.add_argument("--memory", type=int, default=1000, help="MB")
    given.add_argument("--folder", default=None)
    given.add_argument("--library", default=str(ROOT / "build/out/release/libpatina.so"))
    wanted = given.parse_args()
    os.environ["PATINA_LIBRARY"] = wanted.library
    with tempfile.TemporaryDirectory(prefix="patina-bench-", dir=wanted.folder) as name:
        laz, cloud = Path(name) / "scan.laz", Path(name) / "scan.cloud"
        step("write", str(laz), str(wanted.points))
        found = {label: step(*which) for label, which in (
            ("laspy alone", ("read", str(laz))), ("built on the disk", ("build", str(laz), str(cloud), str(wanted.memory * 10 ** 6))),
            ("laspy alone, again", ("read", str(laz))))} | peers(laz)
        print(f"{wanted.points:,} points, LAZ of {laz.stat().st_size / 1e6:,.0f} MB, cloud of {cloud.stat().st_size / 1e6:,.0f} MB, "
              f"cap {wanted.memory:,} MB\n\n| | s | processor, s | million points a processor's second | peak memory, MB |\n|---|---|---|---|---|")
        for label, got in found.items():
            print(f"| {label} | {got['seconds']:.1f} | {got['processor']:.1f} | {wanted.points / got['processor'] / 1e6:.2f} | {got['peak_mb']:,.0f} |")


START = time.perf_counter()

if __name__ == "__main__":
    if sys.argv[1:2] == ["--step"]:
        import imports
        what, rest = sys.argv[2], sys.argv[3:]
        if what == "write":
            imports.write(Path(rest[0]), int(rest[1]))
        elif what == "read":
            read(Path(rest[0]))
        else:
            build(Path(rest[0]), Path(rest[1]), int(rest[2]))
        print(json.dumps({"seconds": time.perf_counter() - START, "processor": time.process_time(), "peak_mb": imports.peak_mb()}))
    else:
        main()
