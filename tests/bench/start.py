# SPDX-License-Identifier: GPL-3.0-or-later
"""What the add-on adds to Blender's start, beside an add-on that does nothing, and the sizes of its packages.

bench.py calls measure(); the file runs itself in Debian's Blender and in a bpy module, a process for each time.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

ROOT = Path(__file__).resolve().parents[2]
EMPTY = 'bl_info = {"name": "Empty", "blender": (3, 4, 0), "category": "Render"}\n\n\ndef register():\n    pass\n\n\ndef unregister():\n    pass\n'


def measure(rounds: int) -> str:
    """A table, or "skip: " and why there is none."""
    rows = []
    with tempfile.TemporaryDirectory(prefix="patina-bench-") as name:
        folder = Path(name)
        (folder / "empty.py").write_text(EMPTY, encoding="utf-8")
        (folder / "patina").symlink_to(ROOT / "addon")
        debian = ["blender", "-b", "--factory-startup", "--python", __file__, "--"]
        for label, program in (("Blender 3.4.1", debian), ("Blender 5.0 as a module", [ROOT / "build/out/bpy50/bin/python", __file__])):
            seconds: dict[str, list[float]] = {"empty": [], "patina": []}
            for _ in range(rounds + 1):  # the first compiles the Python
                for module, times in seconds.items():
                    try:
                        done = subprocess.run([*program, module, name], capture_output=True, text=True, check=False)
                    except FileNotFoundError as error:
                        return f"skip: {error}"
                    got = [line for line in done.stdout.splitlines() if line.startswith("{")]
                    if not got:
                        return f"skip: {label}: {(done.stderr.strip().splitlines() or ['failed'])[-1]}"
                    times.append(json.loads(got[-1])["ms"])
                    loaded = json.loads(got[-1])["loaded"]
                    if loaded:
                        return f"skip: {label}: the library was loaded at the start: {loaded}"
            rows.append(f"| {label} | " + " | ".join(f"{median(times[1:]):.1f}" for times in seconds.values()) + " |")
    sizes = [f"| {path.name} | {path.stat().st_size / 1e6:.2f} |" for place in ("packages/all", "packages")
             for path in sorted((ROOT / "build/out" / place).glob("patina-*.zip"))]
    return "\n".join(["| enabled at the start, processor ms | an empty add-on | Patina |", "|---|---|---|", *rows, "",
                      "The library is not loaded by it.", "", "| package | MB |", "|---|---|", *dict.fromkeys(sizes)])


def run(module: str, folder: str) -> None:
    sys.path.append(folder)
    sys.dont_write_bytecode, sys.pycache_prefix = False, str(Path(folder) / "compiled")  # as installed add-ons have it
    import addon_utils  # is there once bpy is
    start = time.process_time()
    assert addon_utils.enable(module), module
    spent = 1e3 * (time.process_time() - start)
    with open("/proc/self/maps", encoding="utf-8") as maps:
        loaded = sorted({line.split()[-1] for line in maps if "libpatina" in line})
    print("\n" + json.dumps({"ms": spent, "loaded": loaded}), flush=True)
    os._exit(0)  # the bpy module may hang in its own clean-up


if __name__ == "__main__":
    import bpy  # noqa: F401
    run(*sys.argv[-2:])
