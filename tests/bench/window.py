# SPDX-License-Identifier: GPL-3.0-or-later
"""A viewport that orbits many points, in a real window: what Patina takes, what the upload takes, what Blender takes alone.

tests/blender/figures.py and frame_figures.py measure, in Blender under Xvfb. There everything runs on the same cores: Patina's work, and Blender's
window through llvmpipe.
"""

from __future__ import annotations

import itertools
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from statistics import median

ROOT = Path(__file__).resolve().parents[2]
ROWS = (
    ("Patina delivers, pictures a second, no redraw of Blender's between them", "delivered_a_second", "{:.0f}"),
    ("of that its work on one picture, ms", "work_ms", "{:.1f}"),
    ("of that Blender's thread is busy with one picture, ms", "busy_ms", "{:.1f}"),
    ("upload of one picture through llvmpipe, ms", "upload_ms", "{:.1f}"),
    ("drawing it through llvmpipe, ms", "draw_ms", "{:.1f}"),
    ("the longest stay of Blender's thread with Patina while moving, ms", "longest_ms", "{:.0f}"),
    ("Blender redraws its window a second, Patina left out", "bare_redraws_a_second", "{:.1f}"),
    ("the processor's time for that, both cores together, ms a redraw", "bare_processor_ms", "{:.0f}"),
    ("Blender redraws its window a second, with Patina", "redraws_a_second", "{:.1f}"),
    ("new pictures in the window a second", "shown_a_second", "{:.1f}"),
    ("the processor's time for that, both cores together, ms a picture", "processor_ms", "{:.0f}"),
    ("as many with *Smooth Wires: Overlay* off in Blender's preferences", "rough_shown_a_second", "{:.1f}"),
    ("from the last motion to the whole picture, s", "rest_s", "{:.2f}"),
    ("of that Patina's work on the whole picture, ms", "whole_ms", "{:.1f}"),
)


# And up to how many points: 4.3 draws overlays of vertices as 3.4 does, where a redraw of 10 million takes 8 s of a processor.
VERSIONS = (("3.4", "opengl", 10_000_000), ("4.3", "opengl", 1_000_000), ("5.2", "opengl", 10_000_000), ("5.2", "vulkan", 10_000_000))
ROUNDS = 3
LONGEST = 1500  # s, of a session
PARTS = (  # of a frame, with overlays hidden or shown
    ("a redraw of the orbit", "whole_ms"),
    ("the same by the clock", "whole_clock_ms"),
    ("Blender alone, without Patina's drawing", "bare_ms"),
    ("the same by the clock", "bare_clock_ms"),
    ("with the last image uploaded and drawn, without a new one", "shown_ms"),
    ("of that, upload of the image", "upload_ms"),
    ("of that, nearest depths around each pixel", "cover_ms"),
    ("of that, drawing the image and uploading its depths", "draw_ms"),
    ("of that, erasing the overlays behind the points", "after_ms"),
    ("sum of these four: Patina's cost beyond rendering", "beyond_ms"),
)


def versions(counts: tuple[int, ...], library: Path, rounds: int = ROUNDS) -> str:
    """A table of what a frame takes in each available Blender, medians of several rounds. Each round measures all Blenders in turn.
    Returns "skip: " and the reason if none is available."""
    if not shutil.which("xvfb-run"):
        return "skip: needs xvfb-run (build/setup test)."
    found: dict[int, dict[str, list[dict]]] = {points: {} for points in counts}
    notes = []
    try:
        for index, points, (version, backend, most) in itertools.product(range(rounds), counts, VERSIONS):
            if points > most:
                continue
            name = f"{version} {'OpenGL' if backend == 'opengl' else 'Vulkan'}"
            got = _frames(points, version, backend, library)
            print(f"frames: round {index + 1}, {name}, {points:,} points: {got if isinstance(got, str) else json.dumps(got)}", file=sys.stderr)
            if isinstance(got, str):
                notes.append(f"Blender {name}, {points:,} points, round {index + 1}: {got}")
            else:
                found[points].setdefault(name, []).append(got)
    except KeyboardInterrupt:
        print("frames: canceled. The table has the finished sessions.", file=sys.stderr)
    tables = [_table(points, found[points]) for points in counts if found[points]]
    return "\n\n".join([*tables, *notes]) if tables else f"skip: {'; '.join(notes)}"


def _table(points: int, found: dict[str, list[dict]]) -> str:
    """Medians. found: what the sessions of each Blender measured."""
    some, times = next(iter(found.values()))[0], sorted({len(sessions) for sessions in found.values()})
    rounds = " to ".join(str(count) for count in dict.fromkeys((times[0], times[-1])))
    rows = [f"| {points:,} points, {some['width']} × {some['height']}, ms, medians of {rounds} sessions; overlays | | " + " | ".join(found) + " |",
            "|---|---|" + "---|" * len(found)]
    for overlays in ("hidden", "shown"):
        rows += [f"| {overlays} | {label} | " + " | ".join(f"{median(got[overlays][key] for got in sessions):.1f}" for sessions in found.values()) + " |"
                 for label, key in PARTS]
    return "\n".join(rows)


def _frames(points: int, version: str, backend: str, library: Path) -> dict | str:
    """What tests/blender/frame_figures.py says; a text: why nothing."""
    provided = subprocess.run([ROOT / "build/blender", version], capture_output=True, text=True, check=False)
    if provided.returncode:
        return (provided.stderr.strip().splitlines() or ["not there"])[-1]
    command = [provided.stdout.split()[-1], *(["--gpu-backend", backend] if version != "3.4" else [])]
    return _measured(command, "frames", points, library)


def _measured(blender: list[str], what: str, points: int, library: Path) -> dict | str:
    """The figures that tests/blender/test_window.py prints in a Blender; a text: why none."""
    command = ["xvfb-run", "-a", "-s", "-screen 0 1280x800x24", *blender, "--enable-event-simulate", "--factory-startup", "--python",
               str(ROOT / "tests/blender/test_window.py"), "--", what]
    environment = {**os.environ, "PATINA_LIBRARY": str(library), "PATINA_FIGURES_POINTS": str(points)}
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False, timeout=LONGEST)
    except subprocess.TimeoutExpired:
        return f"ended after {LONGEST} s"
    found = [line for line in done.stdout.splitlines() if line.startswith('{"points"')]
    return json.loads(found[-1]) if found and not done.returncode else (done.stdout.strip().splitlines() or ["failed"])[-1]


def measure(points: int, library: Path) -> str:
    """A table, or "skip: " and why there is none."""
    if not shutil.which("blender") or not shutil.which("xvfb-run"):
        return "skip: needs Blender and xvfb-run (build/setup test)."
    got = _measured(["blender"], "figures", points, library)
    if isinstance(got, str):
        return f"skip: {got}"
    head = (f"{got['points']:,} points, a view of {got['width']} × {got['height']} in a window of 1280 × 800, overlays hidden, "
            f"*{got['transform']}* view transform, Blender's settings of the factory else, the middle mouse button drags; while "
            f"moving {2.0 ** (got['strata'] - 6):.0%} of the points, a pixel for {got['shrink']} × {got['shrink']}.")
    return "\n".join([head, "", "| orbiting | |", "|---|---|", *(f"| {label} | {form.format(got[name])} |"
                                                                 for label, name, form in ROWS)])
