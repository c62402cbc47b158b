# SPDX-License-Identifier: GPL-3.0-or-later
"""Other programs in the same run: the same points, camera and truth. One that is not installed is a line that says
so."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from statistics import median
from typing import Any

import metrics
import numpy as np
import stage
from truth import linear

HERE = Path(__file__).resolve().parent
PYTHON = "/usr/bin/python3"  # Debian's, for its VTK
POINTS, SIZE = 1_000_000, 1024
EFFECTS = {"points 3 px + 6 peels": "6 layers", "points 3 px + shadow map": "shadows kept",
           "points 3 px + shadow map, moving light": "shadows 1"}  # VTK's → our mode
STYLE_ERRORS = ("coverage_iou", "false_holes", "false_growth", "outer_growth", "depth_rms_spacings")
VTK = ("points 1 px", "points 3 px", "points 5 px", "points 3 px + EDL", "gaussian")


def _row(name: str, quality: str, mode: str = "surface", **more: Any) -> dict[str, Any]:
    return {"group": "peers" if mode == "surface" else "effects", "scene": "torus", "mode": mode, "device": name,
            "width": SIZE, "height": SIZE, "points": POINTS, "quality": quality, "threads": 0, **more}


def _done(command: list[str], seconds: float, environment: dict[str, str]) -> tuple[dict[str, Any] | None, str]:
    """The JSON on the program's last line, or why there is none."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=seconds,
                              env={**os.environ, **environment})
    except subprocess.TimeoutExpired:
        return None, f"took longer than {seconds:.0f} s"
    except OSError as error:
        return None, str(error)
    for line in reversed(done.stdout.splitlines()):
        if line.startswith("{"):
            return json.loads(line), ""
    lines = [line for line in (done.stderr + done.stdout).splitlines() if line.strip()]
    return None, f"status {done.returncode}: {lines[-1].strip()[:200] if lines else 'it said nothing'}"


def _measured(name: str, command: list[str], target: Path, exact: stage.Picture, spacing: float, seconds: float,
              mode: str = "surface", **environment: str) -> Iterator[dict[str, Any]]:
    """A row for every kind of time that the program tells. exact is the picture of the opaque torus without shadows."""
    target.unlink(missing_ok=True)
    said, reason = _done(command, seconds, environment)
    if said is None:
        yield _row(name, "peer", mode, unavailable=reason)
        return
    error = {}
    if target.is_file() and mode == "surface":
        with np.load(target) as arrays:
            shown = metrics.Shown(arrays["rgba"], arrays["depth"] if "depth" in arrays else None)
        error = metrics.errors(exact, shown, spacing)
    for quality, times in said["times"].items():
        yield _row(name, quality, mode, ms_median=median(times), ms_min=min(times), ms_max=max(times),
                   peak_mb=said["peak_mb"], passes={}, error=error, frames=len(times), note=said.get("note", ""))


def measure(quick: bool, library: Path) -> Iterator[dict[str, Any]]:
    """Rows of the headline cloud, by each program that there is."""
    with _staged(8 if quick else 14) as (source, target, exact, spacing):
        yield from _vtk(quick, source, target, exact, spacing)
        yield from _blender(quick, library, source, target, exact, spacing)


def measure_styles(quick: bool, library: Path) -> Iterator[dict[str, Any]]:
    """The headline cloud in every style that is shipped, as Blender describes it to the library. No truth knows their
    colours; coverage and depth it knows."""
    program, reason = _blender_3()
    if not program:
        yield {**_row("cpu", "styles"), "group": "styles", "unavailable": reason}
        return
    with _staged(6 if quick else 12) as (source, target, exact, spacing):
        said, reason = _done(_script(program, "styles", source, target), 300.0, {"PATINA_LIBRARY": str(library)})
        if said is None:
            yield {**_row("cpu", "styles"), "group": "styles", "unavailable": reason}
            return
        with np.load(target) as arrays:
            for key, told in said.items():
                error = metrics.errors(exact, metrics.Shown(arrays[f"{key} rgba"], arrays[f"{key} depth"]), spacing)
                yield {**_row("cpu", told["label"]), "group": "styles", "device_name": told["device"],
                       "ms_median": median(told["times"]), "ms_min": min(told["times"]), "ms_max": max(told["times"]),
                       "peak_mb": 0.0, "passes": told["passes"], "frames": len(told["times"]),
                       "error": {name: value for name, value in error.items() if name in STYLE_ERRORS}}


@contextlib.contextmanager
def _staged(turns: int) -> Iterator[tuple[Path, Path, stage.Picture, float]]:
    """The headline cloud in a file for other programs, where their picture goes, the exact one, and the spacing."""
    shown = stage.analytic({"surface": "torus", "points": POINTS})
    sun = shown.scene.lights[0]
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "cloud.npz"
        np.savez(source, position=shown.position, normal=shown.normal,
                 color=linear(shown.color.astype(np.float64)).astype(np.float32),
                 matrix=np.stack([shown.camera(float(turn)).matrix for turn in range(turns)]), fov=stage.FOV, size=SIZE,
                 towards=sun.towards, power=sun.power, world=shown.scene.world, spacing=shown.spacing)
        yield source, Path(folder) / "shown.npz", shown.exact(0.0, SIZE, SIZE), shown.spacing


def _screen() -> list[str]:
    """What gives a program a screen where there is none."""
    if os.environ.get("DISPLAY"):
        return []
    return [shutil.which("xvfb-run"), "-a", "-s", "-screen 0 1280x1280x24"] if shutil.which("xvfb-run") else []


def _vtk(quick: bool, source: Path, target: Path, exact: stage.Picture, spacing: float) -> Iterator[dict[str, Any]]:
    found = subprocess.run([PYTHON, "-c", "import vtk; print(vtk.vtkVersion().GetVTKVersion())"], capture_output=True,
                           text=True)
    if found.returncode:
        yield _row("VTK", "peer", unavailable="python3-vtk9 is not installed: build/setup test installs it")
        return
    version = found.stdout.strip()
    for mode in VTK[1:2] if quick else (*VTK, *EFFECTS):
        yield from _measured(f"VTK {version} {mode}", [*_screen(), PYTHON, str(HERE / "peer_vtk.py"), mode, str(source),
                                                       str(target)], target, exact, spacing, 240.0,
                             EFFECTS.get(mode, "surface"))


def _blender(quick: bool, library: Path, source: Path, target: Path, exact: stage.Picture, spacing: float
             ) -> Iterator[dict[str, Any]]:
    """F12: a whole render, the camera a degree further; moving camera: the same with what the engine keeps."""
    program, reason = _blender_3()
    if not program:
        yield _row("Blender", "peer", unavailable=reason)
        return
    version = _version(program)
    for mode in ("cycles", "patina") if quick else ("cycles", "patina", "eevee", "workbench"):
        name = f"Patina in Blender {version}" if mode == "patina" else f"{mode.capitalize()} {version}"
        screen = _screen() if mode in ("eevee", "workbench") else []
        if mode in ("eevee", "workbench") and not screen and not os.environ.get("DISPLAY"):
            yield _row(name, "peer", unavailable="needs a screen, and xvfb is not installed")
            continue
        yield from _measured(name, [*screen, *_script(program, mode, source, target)], target, exact, spacing, 300.0,
                             PATINA_LIBRARY=str(library))


def _script(program: str, mode: str, source: Path, target: Path) -> list[str]:
    return [program, "-b", "--factory-startup", "--python-exit-code", "1", "--python", str(HERE / "peer_blender.py"), "--",
            mode, str(source), str(target), str(stage.ROOT / "addon")]


def _version(program: str) -> str:
    said = subprocess.run([program, "--version"], capture_output=True, text=True).stdout.split()
    return said[1] if len(said) > 1 else "?"


def _blender_3() -> tuple[str, str]:
    """The program; or else empty, and why."""
    program = shutil.which("blender")
    if not program:
        return "", "blender is not installed: build/setup demo installs it"
    version = _version(program)
    if version.split(".")[0] != "3":
        return "", f"this is Blender {version}, the script speaks to 3.x"
    return program, ""
