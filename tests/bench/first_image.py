# SPDX-License-Identifier: GPL-3.0-or-later
"""How long a newcomer waits between the zip and the first image: each step, in Blenders that have never seen Patina.

bench.py calls measure() after build/package; the file runs itself inside of Blender. Typing, and the clicks between the steps, are not
counted.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from shutil import copy
from statistics import median
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
LEGACY = """import bpy, sys
assert bpy.ops.preferences.addon_install(filepath=sys.argv[-1]) == {"FINISHED"}
assert bpy.ops.preferences.addon_enable(module="patina") == {"FINISHED"}
assert bpy.ops.wm.save_userpref() == {"FINISHED"}"""
STEPS = {"install": "install the zip", "start": "start Blender", "import": "import the scan", "set_up": "*Set Up for Points*",
         "first": "**F12: the first image**", "again": "F12 again"}


def programs() -> dict[str, tuple[str, list[str]]]:
    """{Blender: (which zip it takes, how it starts)}, those that are here."""
    newest = ROOT / "build/out/blender-5.2"
    return {"Blender 3.4.1": ("-legacy", ["blender"])} | ({"Blender 5.2": ("", [str(newest)])} if newest.exists() else {})


def run(command: list[str], environment: dict[str, str]) -> str:
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise OSError((done.stderr.strip() or done.stdout.strip() or "failed").splitlines()[-1])
    return done.stdout


def walk(program: list[str], package: Path, scan: Path) -> dict[str, float]:
    """Seconds of each step, with folders of a user who has never opened Blender. The scan's folder is one that the Blender can read."""
    with tempfile.TemporaryDirectory(dir=scan.parent) as home:
        environment = {name: value for name, value in os.environ.items() if not name.startswith(("PATINA_", "PYTHON"))}
        for name in ("SCRIPTS", "CONFIG", "EXTENSIONS", "DATAFILES"):
            environment[f"BLENDER_USER_{name}"] = str(Path(home) / name.lower())
            Path(environment[f"BLENDER_USER_{name}"]).mkdir()
        environment["XDG_CACHE_HOME"] = str(Path(home) / "cache")
        install = ["-b", "--python-exit-code", "1", "--python-expr", LEGACY, "--", str(package)] if package.stem.endswith("-legacy") else \
            ["--command", "extension", "install-file", "-r", "user_default", "--enable", str(package)]
        start = time.perf_counter()
        run([*program, *install], environment)
        seconds = {"install": time.perf_counter() - start}
        start = time.time()
        said = run([*program, "-b", "--python-exit-code", "1", "--python", str(scan.with_name("first_image.py")), "--", str(scan), home], environment)
        found = json.loads(next(line for line in said.splitlines() if line.startswith("{")))
        return seconds | {"start": found.pop("began") - start} | found


def inside(scan: str, folder: str) -> None:
    """In Blender: from its start scene to two renders of the scan."""
    import bpy
    import numpy as np
    found: dict[str, Any] = {"began": time.time()}
    scene, image = bpy.context.scene, str(Path(folder) / "image.png")
    scene.render.filepath = image
    for name, step in (("import", lambda: bpy.ops.import_scene.patina_points(filepath=scan)), ("set_up", bpy.ops.scene.patina_set_up),
                       ("first", lambda: bpy.ops.render.render(write_still=True)), ("again", lambda: bpy.ops.render.render(write_still=True))):
        start = time.perf_counter()
        assert step() == {'FINISHED'}, name
        found[name] = time.perf_counter() - start
    picture = bpy.data.images.load(image)
    values = np.array(picture.pixels[:], dtype=np.float32).reshape(-1, 4)
    assert tuple(picture.size) == (1920, 1080), tuple(picture.size)
    shown = float((np.abs(values - values[0]).max(axis=1) > 0.05).mean())
    assert shown > 0.1, f"the first image shows next to nothing: {shown:.1%} of its pixels"
    print("\n" + json.dumps(found), flush=True)


def measure(rounds: int, points: int) -> str:
    """A table, or "skip: " and why there is none."""
    columns = {}
    with tempfile.TemporaryDirectory(prefix="patina-first-") as name:
        scan = Path(name) / "scan.ply"
        subprocess.run(["/usr/bin/python3", str(ROOT / "build/relief"), str(scan), str(points)], check=True, capture_output=True)
        copy(__file__, name)
        for label, (kind, program) in programs().items():
            zips = [path for path in (ROOT / "build/out/packages").glob("patina-*.zip") if path.stem.endswith(f"linux-x64{kind}")]
            if len(zips) != 1:
                return "skip: build/package has packed nothing"
            package = Path(copy(zips[0], name))
            try:
                walks = [walk(program, package, scan) for _ in range(rounds)]
            except OSError as error:
                return f"skip: {label}: {error}"
            columns[label] = {step: median(one[step] for one in walks) for step in STEPS}
            columns[label]["all"] = median(sum(seconds for step, seconds in one.items() if step != "again") for one in walks)
    rows = [f"| {title} | " + " | ".join(f"{column[step]:.1f}" for column in columns.values()) + " |"
            for step, title in (STEPS | {"all": "**from the zip to the first image**"}).items()]
    return "\n".join([f"{points:,} points with colors, 1920 × 1080, the medians of {rounds} runs.", "",
                      f"| s | {' | '.join(columns)} |", "|---|" + "---|" * len(columns), *rows])


if __name__ == "__main__":
    if "--" in sys.argv:
        inside(*sys.argv[-2:])
    else:
        print(measure(3, 1_000_000))
