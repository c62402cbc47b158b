# SPDX-License-Identifier: GPL-3.0-or-later
"""What tests find, as the pages of figures quote it: each function runs a test's program or measures, and answers in Markdown, with a
line that begins with "skip" where something is not there."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

from tables import table

ROOT = Path(__file__).resolve().parents[2]
SUN_HEIGHTS = ("2", "5", "10", "20", "45", "90")


def _said(name: str, library: Path) -> list[str]:
    """The lines that tests/scenes/NAME prints; the programs lie beside the library."""
    program = library.parent / "tests/scenes" / name
    done = subprocess.run([str(program), "--device", "cpu"], capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


def _rows(lines: list[str], pattern: str) -> list[list[str]]:
    """Words of the lines that match, rules and brackets left out."""
    return [re.sub("[|():,]", " ", line).split() for line in lines if re.match(pattern, line)]


def holes(library: Path) -> str:
    body = []
    for cells in _rows(_said("test_holes", library), r" +[\d.]+ \|"):
        density, (none, paper, paper_grown, closed, closed_grown) = cells[0], map(float, cells[1:6])
        body.append([density, f"{none:.2f}", f"{paper:.3f}", f"{paper_grown:.3f}", f"{closed:.3f}", f"{closed_grown:.3f}"])
    return table(["points a pixel", "unfilled: open, %", "paper: open, %", "paper: grown, %", "closed: open, %",
                  "closed: grown, %"], body)


def outlines(library: Path) -> str:
    rows = _rows(_said("test_silhouette", library), r" +(disc|square|triangle) ")
    dense = [row for row in rows if float(row[3]) >= 1.0]
    sparse = [row for row in rows if row[3] == "0.2"]
    worst = max(sparse, key=lambda row: float(row[5]))
    mean = [float(row[4]) for row in sparse]
    return (f"From one point a pixel on, closed filling grows them by at most {max(float(row[5]) for row in dense):.3f} %, at any "
            f"angle tried; the paper's filling by up to {max(float(row[9]) for row in dense):.2f} %. At 0.2 points a pixel closed "
            f"filling grows them by {min(mean):.2f} to {max(mean):.2f} % on average, by {float(worst[5]):.1f} % in the worst case, "
            f"a {worst[0]} at {worst[2]}°.")


def slopes(library: Path) -> str:
    rows = _rows(_said("test_tilt", library), r" +\d+ (ortho|persp) ")
    most = [max(float(row[column]) for row in rows) for column in (3, 6)]
    return (f"A plane tilted from {rows[0][0]}° to {rows[-1][0]}°, {rows[0][2]} to {rows[-1][2]} points a pixel, loses at most "
            f"{most[0]:.3f} % of its measured pixels to the removal of occluded points, {most[1]:.3f} % without normals.")


def layers(library: Path) -> str:
    text = " ".join(_said("test_transparency", library))
    inner, count, every = re.search(r"within 1/255: ([\d.]+)% of (\d+) interior.*?, ([\d.]+)% of all \d+", text).groups()
    shown = [float(part) for part in re.findall(r"layer \d: ([\d.]+)%", text)]
    return (f"Transmittance is within 1/255 of the truth in {float(inner):.2f} % of {int(count):,} pixels, and layers 1 to "
            f"{len(shown)} show exactly their surface in {min(shown):.2f} to {max(shown):.2f} %. Over all pixels, outlines "
            f"included, it is within 1/255 in {float(every):.1f} %.")


def line_widths(library: Path) -> str:
    said = _said("test_lines", library)
    contours, tilts = _rows(said, r" +\w+ +(persp|ortho) with "), _rows(said, r" +\d+ \| \d+, ")
    widths = [f"{low:.2f} to {high:.2f}" for found in ([float(row[column]) for row in contours] for column in (4, 9, 14, 19))
              for low, high in [(min(found), max(found))]]
    away = sum(int(row[column + 1]) for row in contours for column in (4, 9, 14, 19))
    tilt, *counts = (int(word) for word in tilts[-1])
    before = next((int(row[0]) for row in tilts[:-1] if any(int(word) for word in row[2::2])), tilt)
    plain = f"without normals it shows none below {before}°, and at {tilt}° {', '.join(f'{n:,}' for n in counts[1::2])}"
    return (f"With normals, lines 1, 2, 4 and 9 pixels wide are found {', '.join(widths[:3])} and {widths[3]} wide, {away or 'no'} "
            f"pixels elsewhere. A plane tilted up to {tilt}° shows {max(max(map(int, row[1::2])) for row in tilts) or 'none'}; "
            f"{plain} of 36,864 pixels at 1, 4 and 30 points a pixel.")


def sun(library: Path) -> str:
    said = _said("test_shadow", library)
    found = {(row[0], row[1]): row[2:] for row in _rows(said, r" +\d+ with")}
    body = []
    for kind, name in (("with", "with normals"), ("without", "without normals")):
        cells = [found[height, kind] for height in SUN_HEIGHTS]
        body += [[f"wrong, {name}, %", *(f"{float(cell[0]):.2f}" for cell in cells)],
                 ["acne, leaks", *(f"{cell[1]}, {cell[2]}" for cell in cells)]]
    falls = re.search(r"falls as n\^([-\d.]+)", "\n".join(said))[1]
    off = re.search(r"against the truth ([\d.]+)", "\n".join(said))[1]
    return table(["sun's height", *(f"{height}°" for height in SUN_HEIGHTS)], body) + (
        f"\n\nSoft shadows converge as n<sup>{falls.replace('-', '−')}</sup> on our own 4096 samples; these are off from the exact "
        f"penumbra by {float(off):.3f} rms over the plane, because borders are a spacing wide and filling widens them.")


def expected(library: Path) -> str:
    """How far expected errors are exceeded on shapes that the curves were not measured on."""
    import curves

    frame, factors = curves.native.Frame(curves.native.Device("cpu", 0)), {}
    for surface in ("corner", "saddle", "gyroid"):
        pairs = [curves.rendered(frame, surface, density) for density in (4.0, 1.0, 0.3)]
        factors[surface] = max(off["color"] / stats["expected"]["color"] for stats, off in pairs)
    return (f"**Error targets.** What pictures of a box were off by was at most {factors['corner']:.1f} times the error expected, of a "
            f"saddle {factors['saddle']:.1f}, of a gyroid, sheet behind sheet, {factors['gyroid']:.1f} times.")


def leaves(library: Path) -> str:
    done = subprocess.run([sys.executable, str(ROOT / "tests/bench/leaves.py"), "--library", str(library)], capture_output=True,
                          text=True, check=True)
    return done.stdout.strip()


def session(minutes: float, library: Path) -> str:
    done = subprocess.run(["/usr/bin/python3", str(ROOT / "tests/blender/long_session.py"), "--minutes", str(minutes)],
                          env={**os.environ, "PATINA_LIBRARY": str(library)}, capture_output=True, text=True, check=False)
    found = [line for line in done.stdout.splitlines() if " rounds in " in line]
    return f"{found[-1][0].upper()}{found[-1][1:]}." if found else "skip: " + (done.stdout.strip().splitlines() or ["failed"])[-1]
