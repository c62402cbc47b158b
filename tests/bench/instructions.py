# SPDX-License-Identifier: GPL-3.0-or-later
"""Instructions of the inner loops, NEON's against AVX2's, counted in the compiled kernels: linux-arm64 cannot be timed here.

An inner loop is what lies between a backward jump and where it goes, without another such within. Of each kernel those count that
work on vectors in more than a third of their instructions; a round is taken as one vector of 8 lanes (AVX2) or 4 (NEON), so a loop that
the compiler unrolled counts for more than it costs. Calls and what memory costs do not show.

    instructions.py [build/out/release] [build/out/linux-arm64]
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from statistics import median

ROOT = Path(__file__).resolve().parents[2]
BUILDS = {"avx2": ("objdump", 8, re.compile(r"%[xy]mm\d+")), "neon": ("llvm-objdump", 4, re.compile(r"\bv\d+\.\d+[bhsd]|\b[qd]\d+\b"))}
LINE = re.compile(r"^\s*([0-9a-f]+):\s+(\S+)\s*(.*)$")
TARGET = re.compile(r"(?:^|[\s,])(?:0x)?([0-9a-f]+)\s*<")
LEAST = 8  # instructions of a loop that counts


def loops(path: Path, level: str) -> list[int]:
    """Lengths of a compiled file's inner loops over vectors, in instructions."""
    program, _, vector = BUILDS[level]
    text = subprocess.run([program, "-d", "--no-show-raw-insn", path], capture_output=True, text=True, check=True).stdout
    found: list[int] = []
    for function in re.split(r"\n\n?[0-9a-f]+ <[^>]+>:\n", text)[1:]:
        lines = [match for line in function.splitlines() if (match := LINE.match(line))]
        at = {int(line[1], 16): index for index, line in enumerate(lines)}
        spans = []
        for index, line in enumerate(lines):
            jump = line[2].startswith(("j", "b.", "cb", "tb")) or line[2] == "b"
            target = TARGET.search(line[3]) if jump else None
            first = at.get(int(target[1], 16)) if target else None
            if first is not None and first < index:
                spans.append((first, index))
        for first, last in spans:
            inner = not any((a, b) != (first, last) and first <= a and b <= last for a, b in spans)
            wide = sum(bool(vector.search(line[3])) for line in lines[first:last + 1])
            if inner and last - first + 1 >= LEAST and 3 * wide > last - first + 1:
                found.append(last - first + 1)
    return found


def table(release: Path, arm: Path) -> str:
    """As Markdown, or "skip: " and why there is none."""
    folders = {"avx2": release / "CMakeFiles/kernels_avx2.dir", "neon": arm / "CMakeFiles/kernels_neon.dir"}
    for folder in folders.values():
        if not folder.is_dir():
            return f"skip: needs {folder}: build/setup arm64, build/compile linux-arm64."
    files = {level: {path.name.removesuffix(".c.o"): path for path in folder.rglob("*/kernels/*.c.o")} for level, folder in folders.items()}
    rows, ratios = [], []
    for name in sorted(files["avx2"].keys() & files["neon"].keys()):
        counted = {level: loops(files[level][name], level) for level in BUILDS}
        if not all(counted.values()):
            continue
        lanes = {level: sum(found) / len(found) / BUILDS[level][1] for level, found in counted.items()}
        ratios.append(lanes["neon"] / lanes["avx2"])
        rows.append(f"| {name} | {len(counted['avx2'])} | {lanes['avx2']:.1f} | {len(counted['neon'])} | {lanes['neon']:.1f} | {ratios[-1]:.1f} |")
    head = ["| kernel | AVX2: inner loops | instructions a lane | NEON: inner loops | instructions a lane | times |", "|---|---|---|---|---|---|"]
    return "\n".join([*head, *rows, "", f"Median of {len(rows)} kernels: {median(ratios):.1f} times as many a lane."])


if __name__ == "__main__":
    given = [Path(argument) for argument in sys.argv[1:3]]
    print(table(*(given + [ROOT / "build/out/release", ROOT / "build/out/linux-arm64"][len(given):])))
