# SPDX-License-Identifier: GPL-3.0-or-later
"""Clouds in files, larger than what a picture may hold of them: a terraced town with trees, written as a saved cloud (town.c, 19 bytes a
point). Each picture is a run of the command line of its own, from a disk that holds nothing of the file in memory, and again.

    build/out/venv/bin/python tests/bench/files.py [--across N] [--folder FOLDER] [--library FILE] [--levels]

--across: quarters a side, of a million points each: 3, 10; 32 is a billion, and 20 GB on the disk. --levels: the town lies in levels, and
pictures leave out what is finer than so many pixels, as the viewport's first ones do."""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
QUARTER, STOREY = 40.0, 3.0  # metres: tests/scenes/town.h
SIZE, CAPS, ROUNDS = "1920x1080", ("100G", "500M"), 3
LEVELS_CAP, DETAILS = "2G", (4.0, 1.0, 0.0)  # pixels between points; 0: all points
QUARTER_POINTS, COARSEST = 1000000, 1 << 16


@dataclass
class Run:
    ms: float
    peak: float  # MB, as what follows
    disk: float
    mapped: dict[str, int]


def looks(across: int) -> dict[str, str]:
    """All of the town; and a street in its middle, along it."""
    side, middle = QUARTER * across, QUARTER * (across // 2) + QUARTER / 2
    ground = STOREY * (across // 2)
    return {"overview": f"{-0.4 * side},{-0.75 * side},{0.75 * side},{side / 2},{side / 2},{STOREY * across / 2},40",
            "close-up": f"{middle + 2},{middle - 14},{ground + 6},{middle + 14},{middle + 10},{ground + 3},50"}


def levels(across: int) -> int:
    """As many as the builder leaves a cloud in (SPEC 13)."""
    count = 1
    while across ** 2 * QUARTER_POINTS >> 2 * (count - 1) > COARSEST:
        count += 1
    return count


def forget(path: Path) -> None:
    """What the system holds of the file."""
    descriptor = os.open(path, os.O_RDONLY)
    os.fsync(descriptor)
    os.posix_fadvise(descriptor, 0, 0, os.POSIX_FADV_DONTNEED)
    os.close(descriptor)


def draw(patina: Path, cloud: Path, look: str, cap: str, detail: float = 0.0) -> Run:
    """The first picture's milliseconds; of the disk all that was read, opening and a second picture beside it too."""
    with tempfile.TemporaryDirectory() as folder, subprocess.Popen(
            [patina, "render", cloud, "-o", Path(folder) / "town.png", "--size", SIZE, "--look", look, "--device", "cpu",
             "--memory", cap, "--detail", str(detail), "--repeat", "1", "--stats", "json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as child:
        assert child.stdout and child.stderr
        out, said = child.stdout.read(), child.stderr.read()
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise OSError(said)
    return Run(float(said.rsplit(",", 1)[1].split()[0]), usage.ru_maxrss / 1024, usage.ru_inblock * 512e-6, json.loads(out)["mapped"])


def rows_of(patina: Path, cloud: Path, across: int) -> list[str]:
    rows = []
    for view, look in looks(across).items():
        for cap in CAPS:
            runs: dict[str, list[Run]] = {"cold": [], "warm": []}
            for _ in range(ROUNDS):
                forget(cloud)
                for disk in runs:
                    runs[disk].append(draw(patina, cloud, look, cap))
            ms = {disk: statistics.median(run.ms for run in some) for disk, some in runs.items()}
            some = runs["cold"] + runs["warm"]
            mapped, disk = some[0].mapped, statistics.median(run.disk for run in runs["cold"])
            rows.append(f"| {across**2},000,000 | {view} | {'none' if not mapped['cap'] else cap} | {ms['cold']:.0f} | {ms['warm']:.0f} | "
                        f"{max(run.peak for run in some):.0f} | {mapped['rounds']} | {1e-6 * mapped['read']:.0f} | {disk:.0f} | "
                        f"{disk * 1e6 / mapped['read']:.1f} |")
            print(rows[-1], file=sys.stderr)
    return rows


def measure_levels(sizes: tuple[int, ...], library: Path, folder: Path | None = None) -> str:
    patina, town = library.parent / "patina", library.parent / "tests/bench/town"
    rows = ["| points | view | pixels between points | cold, ms | warm, ms | peak memory, MB | rounds | asked by passes over points, MB | of the file | read of the disk, MB |",
            "|---|---|---|---|---|---|---|---|---|---|"]
    for across in sizes:
        with tempfile.TemporaryDirectory(dir=folder) as temporary:
            cloud = Path(temporary) / "town.cloud"
            subprocess.run([town, cloud, str(across), str(QUARTER_POINTS), str(levels(across))], check=True, capture_output=True)
            for view, look in looks(across).items():
                for detail in DETAILS:
                    forget(cloud)
                    cold = draw(patina, cloud, look, LEVELS_CAP, detail)
                    warm = [draw(patina, cloud, look, LEVELS_CAP, detail) for _ in range(ROUNDS)]
                    read = cold.mapped["read"]
                    rows.append(f"| {across**2},000,000 | {view} | {detail:.0f} | {cold.ms:.0f} | {statistics.median(run.ms for run in warm):.0f} | "
                                f"{max(run.peak for run in (cold, *warm)):.0f} | {cold.mapped['rounds']} | {1e-6 * read:.1f} | {read / cloud.stat().st_size:.2%} | {cold.disk:.0f} |")
                    print(rows[-1], file=sys.stderr)
    return "\n".join(rows)


def measure(sizes: tuple[int, ...], library: Path, folder: Path | None = None) -> str:
    patina, town = library.parent / "patina", library.parent / "tests/bench/town"
    rows = ["| points | view | cap | cold, ms | warm, ms | peak memory, MB | rounds | asked by passes over points, MB | read of the disk, MB | times |",
            "|---|---|---|---|---|---|---|---|---|---|"]
    for across in sizes:
        with tempfile.TemporaryDirectory(dir=folder) as temporary:
            cloud = Path(temporary) / "town.cloud"
            subprocess.run([town, cloud, str(across)], check=True, capture_output=True)
            rows += rows_of(patina, cloud, across)
    return "\n".join(rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--across", type=int, action="append")
    parser.add_argument("--folder", type=Path, help="where there is room on a disk")
    parser.add_argument("--library", type=Path, default=ROOT / "build/out/release/libpatina.so")
    parser.add_argument("--levels", action="store_true")
    options = parser.parse_args()
    print((measure_levels if options.levels else measure)(tuple(options.across or (3, 10)), options.library, options.folder))


if __name__ == "__main__":
    main()
