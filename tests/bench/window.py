# SPDX-License-Identifier: GPL-3.0-or-later
"""A viewport that orbits many points, in a real window: what Patina takes, what the upload takes, what Blender takes alone.

tests/blender/figures.py measures, in Blender under Xvfb. There everything runs on the same cores: Patina's work, and Blender's
window through llvmpipe.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path

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


def measure(points: int, library: Path) -> str:
    """A table, or "skip: " and why there is none."""
    if not shutil.which("blender") or not shutil.which("xvfb-run"):
        return "skip: needs Blender and xvfb-run (build/setup test)."
    command = ["xvfb-run", "-a", "-s", "-screen 0 1280x800x24", "blender", "--enable-event-simulate",
               "--factory-startup", "--python", str(ROOT / "tests/blender/test_window.py"), "--", "figures"]
    environment = {**os.environ, "PATINA_LIBRARY": str(library), "PATINA_FIGURES_POINTS": str(points)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    found = [line for line in done.stdout.splitlines() if line.startswith('{"points"')]
    if done.returncode or not found:
        return f"skip: {(done.stdout.strip().splitlines() or ['failed'])[-1]}"
    got = json.loads(found[-1])
    head = (f"{got['points']:,} points, a view of {got['width']} × {got['height']} in a window of 1280 × 800, overlays hidden, "
            f"*{got['transform']}* view transform, Blender's settings of the factory else, the middle mouse button drags; while "
            f"moving {2.0 ** (got['strata'] - 6):.0%} of the points, a pixel for {got['shrink']} × {got['shrink']}.")
    return "\n".join([head, "", "| orbiting | |", "|---|---|", *(f"| {label} | {form.format(got[name])} |"
                                                                 for label, name, form in ROWS)])
