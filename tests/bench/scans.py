# SPDX-License-Identifier: GPL-3.0-or-later
"""Virtual scans against exact views: our own settings, and VTK's points of 1 to 7 pixels, alike.

    build/out/venv/bin/python tests/bench/scans.py [--scenes tuning|held|all|trained|unseen|campaigns|NAMES] [--cameras 0,1,…] [--modes MODE,…]
        [--still] [--by-scene] [--json FILE] [--add FILE]... [--readme]

MODE: default, stations (the scanners' places are known), free (and what they saw through is left out), grid (and neighbours
in their grids tell where surfaces end), all (untrusted points too), sor, noise (all points that one of CloudCompare's filters keeps),
filling, discs, ranges (ours);
vtk 1, vtk 3 EDL, … (points of so many pixels); cycles 0.02, eevee 0.02, … (spheres of a radius in metres; EEVEE takes
minutes a picture on llvmpipe). The default
is all but eevee. --add: rows of earlier runs, whose modes are not measured again; --readme: the table of figures."""

from __future__ import annotations

import argparse
import datetime
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(ROOT / "tests"), str(HERE)]

from tables import table  # noqa: E402
from truth.scans import metrics, run  # noqa: E402
from truth.scans.exact import Stage, camera  # noqa: E402
from truth.scans.scenes import FOV, HEIGHT, SKY, STEP, WIDTH, Scene  # noqa: E402
from truth.scans.solids import linear  # noqa: E402

PYTHON = "/usr/bin/python3"  # Debian's, for its VTK
OURS = {"default": ("on", []), "stations": ("stations", []), "free": ("free", []), "grid": ("grid", []), "all": ("on", []),
        "sor": ("on", []), "noise": ("on", []), "filling": ("off", []), "discs": ("off", ["surface=1"]), "ranges": ("off", ["surface=3"])}
UNTRUSTED = ("all", "sor", "noise")  # untrusted points are drawn
CYCLES = ("cycles 0.01", "cycles 0.02", "cycles 0.04")
VTK = ("vtk 1", "vtk 3", "vtk 5", "vtk 7", "vtk 5 EDL")
NEAR, FAR = 0.05, 500.0


def _screen() -> list[str]:
    if os.environ.get("DISPLAY"):
        return []
    return [shutil.which("xvfb-run"), "-a", "-s", "-screen 0 1280x1280x24"] if shutil.which("xvfb-run") else []


def vtk_version() -> str:
    """Of Debian's Python, or "" where there is none."""
    try:
        done = subprocess.run([PYTHON, "-c", "import vtk; print(vtk.vtkVersion().GetVTKVersion())"],
                              capture_output=True, text=True)
    except OSError:
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""


def peer_command(program: str) -> list[str]:
    """What draws with VTK's points, Cycles' or EEVEE's spheres: [] where it is not there."""
    if program == "vtk":
        return [*_screen(), PYTHON, str(HERE / "peer_scans.py")] if vtk_version() else []
    python = ROOT / "build/out/bpy45/bin/python"
    if not python.is_file():
        return []
    return [*(_screen() if program == "eevee" else []), str(python), str(HERE / "peer_scans_blender.py")]


def peer_rows(scenes: list[Scene], cameras: list[int], program: str, sizes: list[str], motion: bool = True) -> Iterator[dict[str, Any]]:
    """Rows as run.measure gives them, with "mode". sizes: pixels of VTK's points, metres of Blender's radii."""
    command = peer_command(program)
    for scene in scenes if command else ():
        stage = Stage(scene)
        views = [(index, 0.0) for index in cameras] + [(index, STEP) for index in cameras if motion and scene.views[index].motion]
        with tempfile.TemporaryDirectory() as folder:
            source = Path(folder) / "scan.npz"
            np.savez(source, position=stage.scan.position.astype(np.float32), color=stage.scan.color,
                     matrix=np.stack([camera(scene.views[index], step).matrix for index, step in views]), fov=FOV, width=WIDTH,
                     height=HEIGHT, near=NEAR, far=FAR, sky=np.array(SKY))
            done = subprocess.run([*command, str(source), folder, *([] if program == "vtk" else [program]), *sizes],
                                  capture_output=True, text=True)
            said = [line for line in done.stdout.splitlines() if line.startswith("{")]
            if not said:
                raise OSError(f"{program}: {(done.stderr + done.stdout).strip().splitlines()[-1:]}")
            times = json.loads(said[-1])
            for size in sizes:
                pictures = []
                for number in range(len(views)):
                    with np.load(Path(folder) / f"{size.replace(' ', '_')}-{number}.npz") as arrays:
                        rgb = arrays["rgb"]
                        rgb = linear(rgb / 255.0).astype(np.float32) if rgb.dtype == np.uint8 else rgb
                        pictures.append((rgb, arrays["depth"]))
                for number, index in enumerate(cameras):
                    row = {"scene": scene.name, "held_out": scene.held_out, "camera": index, "points": len(stage.scan),
                           "mode": f"{program} {size}", **metrics.measure(stage.view(index), *pictures[number]),
                           "ms": times[size][number], "work": times.get(f"{size} work", [np.nan] * len(views))[number]}
                    if motion and scene.views[index].motion:
                        moved = pictures[views.index((index, STEP))][0]
                        row["flicker"] = metrics.flicker((stage.view(index), stage.view(index, True)),
                                                         (pictures[number][0], moved))
                    yield row


def our_rows(scenes: list[Scene], cameras: list[int], mode: str, motion: bool = True) -> list[dict[str, Any]]:
    analysis, settings = OURS[mode]
    options = argparse.Namespace(device="cpu", threads=0, analysis=analysis, set=settings, effect=[], hook=None,
                                 style=["least_trust=-1.0"] if mode in UNTRUSTED else [], filter=mode)
    rows = run.measure(run.Drawer(options), scenes, cameras, motion=motion)
    return [{**row, "mode": mode} for row in rows]


def means(rows: list[dict[str, Any]], held_out: bool) -> dict[str, float]:
    """Of a mode; scenes weigh alike."""
    names = dict.fromkeys(row["scene"] for row in rows if row["held_out"] == held_out)
    return run.mean([run.mean([row for row in rows if row["scene"] == name]) for name in names])


def markdown(rows: list[dict[str, Any]]) -> str:
    """A line a mode, over the scenes that rules were tuned on and over the others."""
    head = ["", *run.TITLES]
    body = []
    for held_out, title in ((False, "scenes for tuning"), (True, "scenes held out")):
        for mode in dict.fromkeys(row["mode"] for row in rows):
            some = [row for row in rows if row["mode"] == mode]
            if any(row["held_out"] == held_out for row in some):
                body.append([f"{title}: {name_of(mode)}", *run.cells(means(some, held_out))])
    return table(head, body)


def by_scene(rows: list[dict[str, Any]]) -> str:
    """A line a scene and way: Patina, the size of VTK's points with the best PSNR and the one with the least false and lost, and what
    CloudCompare's filters leave. work: milliseconds of the processor."""
    body = []
    for name in dict.fromkeys(row["scene"] for row in rows):
        found = {mode: run.mean([row for row in rows if row["scene"] == name and row["mode"] == mode])
                 for mode in dict.fromkeys(row["mode"] for row in rows if row["scene"] == name)}
        sizes = [mode for mode in found if mode.startswith("vtk") and "EDL" not in mode]
        best = {max(sizes, key=lambda mode: found[mode]["psnr"]): "best PSNR",
                min(sizes, key=lambda mode: found[mode]["false"] + found[mode]["lost"]): "least false + lost"} if sizes else {}
        for mode in [mode for mode in found if mode not in sizes] + list(best):
            values = found[mode]
            body.append([name, name_of(mode) + (f" ({best[mode]})" if mode in best else ""), f"{values['psnr']:.1f}",
                         *(f"{100 * values[column]:.1f}" for column in ("false", "lost", "sky")), f"{values['work']:.0f}"])
    return table(["scene", "drawn by", "PSNR", "false %", "lost %", "sky %", "work, ms"], body)


NAMES = {"default": "Patina", "all": "Patina, all points", "sor": "SOR filter, then Patina", "noise": "noise filter, then Patina",
         "stations": "Patina, scanners known", "free": "Patina, free space used", "grid": "Patina, scanners' grids used",
         "filling": "Patina, filling alone",
         "discs": "Patina, discs of 1.75 spacings", "ranges": "Patina, range images"}
SHOWN = ("default", "stations", "free", "grid", "filling", "discs", *VTK, *CYCLES)  # of the bench


def name_of(mode: str) -> str:
    program, _, size = mode.partition(" ")
    told = {"vtk": f"VTK's points, {size} px", "cycles": f"Cycles' spheres, {size} m", "eevee": f"EEVEE's spheres, {size} m"}
    return NAMES.get(mode) or told[program].replace(" EDL px", " px + EDL")


def all_rows(scenes: list[Scene], cameras: list[int], modes: list[str], motion: bool = True) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = []
    for mode in modes:
        if mode in OURS:
            rows += our_rows(scenes, cameras, mode, motion)
    for program in ("vtk", "cycles", "eevee"):
        sizes = [mode.removeprefix(program + " ") for mode in modes if mode.startswith(program)]
        rows += peer_rows(scenes, cameras, program, sizes, motion) if sizes else []
    return rows


def measure(quick: bool) -> list[dict[str, Any]]:
    """Rows of the bench. quick: two scenes, two cameras."""
    if quick:
        return all_rows(run.scenes_of("railing,stairs"), [0, 1], ["default", "filling", "vtk 3"])
    return all_rows(run.scenes_of("all"), list(range(8)), list(SHOWN))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", default="all")
    parser.add_argument("--cameras", default="0,1,2,3,4,5,6,7")
    parser.add_argument("--modes", default=",".join(SHOWN))
    parser.add_argument("--still", action="store_true", help="no flicker")
    parser.add_argument("--by-scene", action="store_true", help="a table by scene: Patina, VTK's best size, CloudCompare's filters")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--add", type=Path, action="append", default=[])
    parser.add_argument("--readme", action="store_true")
    options = parser.parse_args()
    kept = [row for path in options.add for row in json.loads(path.read_text())]
    modes = [mode for mode in options.modes.split(",") if mode and mode not in {row["mode"] for row in kept}]
    rows = all_rows(run.scenes_of(options.scenes), [int(one) for one in options.cameras.split(",")], modes, not options.still)
    order = {mode: number for number, mode in enumerate((*OURS, *VTK, *CYCLES))}
    rows = sorted(rows + kept, key=lambda row: order.get(row["mode"], len(order)))
    if options.readme:
        import machine
        import readme
        print(readme.update({"scans": rows, "rows": [], "details": [], "parts": {}, "processor": machine.processor(),
                             "cores": machine.cores(), "date": datetime.date.today().isoformat()}, ROOT))
    print(by_scene(rows) if options.by_scene else markdown(rows))
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
