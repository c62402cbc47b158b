# SPDX-License-Identifier: GPL-3.0-or-later
"""Speed against error: known scenes on every device, the exact picture beside every time, other programs, the paper's
table.

    build/bench [--quick | --full] [--compare OLD.json] [--device NAME]... [--only GROUP]... [--out FOLDER] [--readme]

Writes bench.md, bench.json, plots and bench.html, which shows them all, to build/out/bench. Times are figures, never
verdicts: nothing here passes or fails. bench.json: "rows" hold scene, mode, device, width, height, points, quality,
threads, ms_median, ms_min, ms_max, peak_mb, passes {name: ms}, error {metric: value}; "details" hold what else is known
of them, in the same order; "absent" what could not be measured, and why.

    --quick   one size and density of each scene: within two minutes
    --full    scenes x devices x qualities x sizes x densities, and 10^8 points where memory allows: hours
    --readme  every figure that README.md and tests/bench/README.md quote, written into them: half an hour; with --only,
              those of these groups

Some groups are of --full, --readme and --only alone: meshes (as triangles against as points), import (a LAZ of 30 million points
into Blender), viewport (orbiting 10 million in its window), frames (the same in each Blender that
build/blender provides, in turns; 45 minutes), tests (what tests find), leaves (shadows on real scans), scans (virtual
scans against exact views; half an hour more where these are not kept yet), independent (shapes that no rule was made on), session
(ten minutes of work in Blender), analysis (what every point knows, 10 million), files (a town of 100 million points under a cap, 1.9 GB
on the disk), walk (frame by frame
through virtual scans), ranges (range images beside [K Tables I, II], and beside filling and discs), soft (soft points in the sizes
of [S Table 1], its models and orders, and against OSPRay), platforms (Blender's start with the add-on, sizes of packages, instructions of NEON's inner
loops), first (a newcomer's wait from the package to the first image). With --quick they take a million points, and one
minute. Two are of --only alone, for they need what most machines lack: gpu (frames of OpenGL, pass by pass, beside the processor) and
scaling (threads up to all cores).
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import analysis
import case as cases
import cues
import files
import first_image
import gpu
import imports
import instructions
import machine
import meshes
import page
import papers
import peers
import plots
import presort
import quoted
import ranges
import readme
import report
import rows as kept
import scans
import soft
import soft_models
import soft_points
import stage
import start
import tables
import volumes
import walk
import window

ROOT = Path(__file__).resolve().parents[2]
LARGEST = 20_000_000  # points of a case in the product of scenes and densities
SURFACES = list(stage.scenes.SURFACES)
LEVELS = ("cpu-avx2", "cpu-sse42", "cpu-scalar")  # what processors have that are not the best
GROUPS = ("headline", "levels", "discs", "inside", "points", "pixels", "threads", "scenes", "layers", "shadows", "patterns",
          "steady", "papers", "effects", "lines", "styles", "peers", "cues", "hard", "tests", "meshes", "import", "viewport",
          "frames", "leaves", "scans", "independent", "session", "analysis", "files", "walk", "ranges", "soft", "platforms", "first", "gpu", "scaling")


def case_of(group: str, surface: str = "torus", device: str = "cpu", size: int = 1024, points: int = 0,
            density: float = 0, quality: str = "refined", threads: int = 0, frames: int = 24, pattern: str = "random",
            noise: float = 0.0, **more: Any) -> dict[str, Any]:
    label = surface + (f" {pattern}" if pattern != "random" else "") + (f" noise {noise:g}" if noise else "")
    label += f" strays {more['strays']:g}" if more.get("strays") else ""
    return {"group": group, "scene": label, "surface": surface, "mode": "surface", "device": device, "width": size,
            "height": size, "points": points or stage.density_count(surface, density, size), "density": density,
            "quality": quality, "threads": threads, "frames": frames, "pattern": pattern, "noise": noise, **more}


def chosen(options: argparse.Namespace) -> list[dict[str, Any]]:
    """The cases of this run, those that the headline needs first."""
    quick, full, n = options.quick, options.full, options.frames
    gl = [name for name in options.device if name.startswith("gl")]
    found = []
    for device in options.device:
        found.append(case_of("headline", device=device, points=1_000_000, frames=n, uploads=1))
        if not (quick and device in gl):
            found.append(case_of("headline", device=device, points=1_000_000, quality="paper", frames=n))
    main = options.device[0]
    for quality in ("unfilled", "splats"):
        found.append(case_of("headline", device=main, points=1_000_000, quality=quality, frames=n))
    if not quick:
        found += [case_of("levels", device=name, points=1_000_000, frames=n) for name in LEVELS]
        found += [case_of("discs", device=main, points=count, quality=quality, frames=n)
                  for count in (62_500, 250_000, 1_000_000) for quality in ("refined", "splats")]
        found += [case_of("effects", device=main, points=1_000_000, quality=quality, mode=mode, frames=n)
                  for mode in peers.EFFECTS.values() for quality in ("refined", "paper")]
        found += [case_of("inside", device=main, points=count, frames=n, distance=1.2, bare=bare,
                          scene="torus from inside" + ", without normals" * bare)
                  for count in (1_000_000, 100_000) for bare in (0, 1)]
    found += [case_of("lines", device=main, points=1_000_000, mode=mode, frames=n, scene=f"torus, {mode}")
              for mode in ("surface", "lines 2", "lines 8", "lines 16")]
    counts = [100_000] if quick else [10_000, 100_000, 10_000_000] + [100_000_000] * full
    found += [case_of("points", device=main, points=count, frames=n, uploads=1) for count in counts]
    if not quick:
        found += [case_of("points", device=name, points=count, frames=7) for name in gl for count in (10_000, 100_000)]
        found += [case_of("pixels", device=main, size=size, points=1_000_000, frames=n)
                  for size in [256, 512, 2048] + [4096] * full]
        found += [case_of("threads", device=main, points=1_000_000, threads=threads, frames=n)
                  for threads in sorted({1, *(2**k for k in range(1, 8) if 2**k <= machine.cores()), machine.cores()})]
    frames = 5 if quick else 9
    sizes = [256, 512, 1024] if full else [256]
    densities = [1.0] if quick else [0.1, 0.3, 1.0, 3.0, 10.0, 30.0]
    for surface in SURFACES:
        for size in sizes:
            for density in densities:
                for quality in ["refined"] if quick else ["refined", "paper", "splats"]:
                    found += [case_of("scenes", surface, device, size, density=density, quality=quality, frames=frames)
                              for device in options.device
                              if device == main or full or (density == 1.0 and not quick)]
    found += [case_of("layers", "tori", device, 256, density=density, mode="layers", clear=1, frames=frames)
              for density in ([3.0] if quick else [0.3, 1.0, 3.0, 10.0]) for device in options.device
              if device == main or not quick]
    found += [case_of("shadows", "shadow", main, 256, density=3.0, mode=mode, frames=frames)
              for mode in ("shadows 1", "shadows 10")]
    if not quick:
        found += [case_of("patterns", surface, main, 512, density=density, pattern=pattern, noise=noise, frames=frames)
                  for surface in ("torus", "corner") for density in (0.3, 1.0, 4.0)
                  for pattern in ("random", "blue", "scan") for noise in (0.0, 0.5, 1.0)]
        found += [case_of("steady", surface, main, 256, density=density, frames=frames, steady=1)
                  for surface in ("torus", "corner", "plane75") for density in (0.3, 1.0, 4.0)]
    else:
        found.append(case_of("steady", "sphere", main, 256, density=1.0, frames=frames, steady=1))
    found += papers.cases(main, quick)
    if full or options.readme or "independent" in options.only:
        found += independent(main, quick)
    return [one for one in found if not options.only or one["group"] in options.only]


def independent(device: str, quick: bool) -> list[dict[str, Any]]:
    """The shapes that no rule was made on, by density: analysed, averaged, with 16 samples, and as discs, not analysed and
    analysed; on two of them noise, strays and scan rows of 1 : 10. The sphere turns. Ten minutes, half of them for the exact
    pictures where these are not kept."""
    cases = []
    shapes = ["sphere", *stage.scenes.SHAPES][: 2 if quick else None]
    for surface in shapes:
        for density in [1.0] if quick else [0.2, 1.0, 4.0] + [16.0] * (surface == "sphere"):
            cases += [case_of("independent", surface, device, 256, density=density, quality=quality, frames=3,
                              steady=int(surface == "sphere"))
                      for quality in ("analysed", "averaged", "final", "splats", "known discs")]
    for more in ({"noise": 1.0}, {"strays": 0.001}, {"pattern": "rows"}):
        for surface in ("knot",) if quick else ("sphere", "knot"):
            cases += [case_of("independent", surface, device, 256, density=density, quality=quality, frames=3, **more)
                      for density in (1.0, 4.0) for quality in ("analysed", "splats", "known discs")]
    return cases


def frame_rows(options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """Rows of gpu.py, each number of points in a process of its own."""
    sizes = list(gpu.SIZES)[: 1 if options.quick else None]
    device = next((name for name in options.device if name != "cpu"), "gl-egl")
    asked: list[list[str]] = []
    if "gpu" in options.only:
        asked += [[str(points), "--device", device, *(word for what in whats for word in ("--what", what))]
                  for points, whats in ((1_000_000, gpu.WHATS), (10_000_000, ("surface",)), (100_000_000, ("surface",)))[: 1 if options.quick else None]]
    if "scaling" in options.only:
        asked += [[str(points), "--threads"] for points in (1_000_000, 10_000_000)[: 1 if options.quick else None]]
    for words in asked:
        case = {"group": "gpu", "scene": "torus", "mode": "surface", "device": device, "points": int(words[0]), "quality": "refined"}
        reason = too_large(case)
        yield from [{**case, "unavailable": reason}] if reason else gpu.separately(
            [*words, "--frames", str(options.frames), *(word for size in sizes for word in ("--size", size))])


def too_large(case: dict[str, Any]) -> str:
    """Why a case is left out, or ""."""
    if case["group"] == "scenes" and case["points"] > LARGEST:
        return f"{case['points']:,} points, more than the {LARGEST:,} of this table"
    need = case["points"] * 90 / 2**20  # our cloud while it is built, beside the arrays
    free = machine.memory_free()
    return f"needs about {need:.0f} MB, {free:.0f} are free" if need > free else ""


def hard_cases(options: argparse.Namespace) -> str:
    """The table of tests/hard/hard.py."""
    devices = options.device[:1] if options.quick else options.device
    done = subprocess.run([sys.executable, str(ROOT / "tests/hard/hard.py"), "--library", str(options.library),
                           *(word for name in devices for word in ("--device", name))], capture_output=True, text=True)
    return "\n".join(line for line in done.stdout.splitlines() if line.startswith("|")) or f"skip: {done.stderr}"


# What stands on the page beside the rows: group, title, and what measures it, as Markdown.
PARTS: dict[str, tuple[str, str, Callable[[argparse.Namespace], str]]] = {
    "hard": ("hard", "Hard cases", hard_cases),
    "cues": ("cues", "Depth cues and means of drawing on the torus", lambda options: cues.text(options.quick, options.library, options.device[0])),
    "holes": ("tests", "Holes against density", lambda options: quoted.holes(options.library)),
    "outlines": ("tests", "Outlines", lambda options: quoted.outlines(options.library)),
    "slopes": ("tests", "Slopes", lambda options: quoted.slopes(options.library)),
    "layers": ("tests", "Layers", lambda options: quoted.layers(options.library)),
    "line widths": ("tests", "Widths of lines", lambda options: quoted.line_widths(options.library)),
    "sun": ("tests", "Shadows of a sun", lambda options: quoted.sun(options.library)),
    "expected": ("tests", "Expected errors", lambda options: quoted.expected(options.library)),
    "meshes": ("meshes", "Meshes", lambda options: meshes.measure(options.library)),
    "import": ("import", "Large imports",
               lambda options: imports.measure(1_000_000 if options.quick else 30_000_000, options.library)),
    "viewport": ("viewport", "Viewport",
                 lambda options: window.measure(1_000_000 if options.quick else 10_000_000, options.library)),
    "frames": ("frames", "Frames of each Blender",
               lambda options: window.versions((1_000_000,) if options.quick else (1_000_000, 10_000_000), options.library,
                                               1 if options.quick else window.ROUNDS)),
    "leaves": ("leaves", "Specks of shadows", lambda options: quoted.leaves(options.library)),
    "analysis": ("analysis", "What every point knows",
                 lambda options: analysis.times(1_000_000 if options.quick else 10_000_000, options.library)),
    "files": ("files", "Clouds larger than memory", lambda options: files.measure((1,) if options.quick else (3, 10), options.library)),
    "normals": ("analysis", "Normals of known shapes", lambda options: analysis.normals(options.library)),
    "walk": ("walk", "Walks through virtual scans", lambda options: walk.text(options.quick, options.library)),
    "start": ("platforms", "Blender's start, and the packages", lambda options: start.measure(3 if options.quick else 9)),
    "first": ("first", "From the zip to the first image",
              lambda options: first_image.measure(*((1, 100_000) if options.quick else (3, 1_000_000)))),
    "instructions": ("platforms", "Instructions of inner loops, NEON's against AVX2's",
                     lambda options: instructions.table(options.library.parent, ROOT / "build/out/linux-arm64")),
    "soft points": ("soft", "[S Table 1]: frames a second on a GTX 1080 → ours", lambda options: soft_points.text(options.quick, options.library)),
    "soft models": ("soft", "[S Figs. 6, 7]: differences from Base", lambda options: soft_models.text(options.quick, options.library)),
    "presort": ("soft", "[S]'s presorted orders against the exact one", lambda options: presort.text(options.quick, options.library)),
    "volumes": ("soft", "Soft points and OSPRay's particle volume", lambda options: volumes.text(options.quick, options.library)),
    "session": ("session", "A long session", lambda options: quoted.session(1 if options.quick else 10, options.library)),
}


def measure(options: argparse.Namespace) -> dict[str, Any]:
    os.environ["PATINA_LIBRARY"] = str(options.library)
    stage.tidy()
    result = kept.begin(cases.native.library().patina_version().decode(), frames=options.frames)

    def keep(row: dict[str, Any]) -> None:
        say(row)
        kept.add(result, row)
        kept.write(result, options.out)

    for case in chosen(options):
        reason = too_large(case)
        keep({**case, "unavailable": reason} if reason else cases.run(case, str(options.library)))
    if "gpu" in options.only:
        result["gpu_bandwidth"] = gpu.bandwidth("gl-egl", options.library.parent)
    for row in frame_rows(options):
        keep(row)
    for group, others in (("styles", peers.measure_styles), ("peers", peers.measure)):
        for row in others(options.quick, options.library) if not options.only or group in options.only else ():
            keep(row)
    if not options.only or "shadows" in options.only:
        result["soft"] = soft.measure(options.device[0])
    if "scans" in options.only or ((options.full or options.readme) and not options.only):
        result["scans"] = scans.measure(options.quick)
    if "ranges" in options.only or ((options.full or options.readme) and not options.only):
        result["ranges"] = ranges.measure(options.quick)
    for name, (group, title, part) in PARTS.items():
        everything = options.full or options.readme or group == "hard"
        if group in options.only or (everything and not options.only):
            try:
                text = part(options)
            except (OSError, subprocess.SubprocessError) as error:
                text = f"skip: {error}"
            print(f"{group}: {name}: {text.splitlines()[-1]}", file=sys.stderr)
            result["parts"][name] = {"title": title, "text": text}
            kept.write(result, options.out)
    return result


def say(row: dict[str, Any]) -> None:
    name = f"{row['group']}: {row['scene']}, {row['mode']}, {tables.name_of(row)}, {row['width']}, " \
           f"{row['points']:,} points, {row['quality']}"
    if "unavailable" in row:
        print(f"skip {name}: {row['unavailable']}", file=sys.stderr)
    else:
        print(f"{name}: {row['ms_median']:.2f} ms ({row['ms_min']:.2f} to {row['ms_max']:.2f})", file=sys.stderr)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    amount = parser.add_mutually_exclusive_group()
    amount.add_argument("--quick", action="store_true", help="at most two minutes")
    amount.add_argument("--full", action="store_true", help="the whole product: hours")
    parser.add_argument("--compare", type=Path, metavar="OLD.json", help="print ratios to an older run")
    parser.add_argument("--device", action="append", help="default: cpu, gl-egl, gl-osmesa; the first has most cases")
    parser.add_argument("--only", action="append", choices=GROUPS, help="these groups of cases")
    parser.add_argument("--frames", type=int, default=24, help="measured frames a case, at most (default 24)")
    parser.add_argument("--out", type=Path, default=ROOT / "build/out/bench")
    parser.add_argument("--library", type=Path, default=ROOT / "build/out/release/libpatina.so")
    parser.add_argument("--readme", action="store_true", help="write the figures into README.md, tests/bench/README.md and .pictures/")
    parser.add_argument("--from", dest="source", type=Path, metavar="BENCH.json",
                        help="measure nothing: tables of that run")
    options = parser.parse_args()
    options.library = options.library.resolve()
    options.only = options.only or []
    options.device = options.device or ["cpu", "gl-egl"] + ["gl-osmesa"] * (not options.quick)
    if not options.library.is_file() and not options.source:
        parser.error(f"there is no {options.library}: run build/compile first")
    old = json.loads(options.compare.read_text()) if options.compare else None

    result = json.loads(options.source.read_text()) if options.source else measure(options)
    text = report.markdown(result)
    if old:
        text += "\n" + report.compare(result, old)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "bench.md").write_text(text)
    kept.write(result, options.out)
    drawn = plots.draw(result, options.out)
    (options.out / "bench.html").write_text(page.html(text, drawn))
    print(text)
    print("written to " + str(options.out) + ": " + ", ".join(["bench.md", "bench.json", "bench.html", *drawn]))
    if options.readme:
        print(readme.update(result, ROOT))
    return 0


if __name__ == "__main__":
    sys.exit(main())
