# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the virtual scans with the library and holds the pictures against the exact ones.

    build/out/venv/bin/python tests/truth/scans/run.py [--scenes a,b | tuning | held | all | trained | unseen | campaigns]
        [--cameras 0,3]
        [--analysis off|on|stations|free|grid] [--set surface=1]... [--style radius=0.02]... [--effect ...]... [--hook FILE.py]
        [--pictures FOLDER] [--json FILE]

The library is $PATINA_LIBRARY, else build/out/release/libpatina.so. A hook is a Python file with any of
    cloud(native, scan, scene) -> native.Cloud     the cloud that is drawn; scan: truth.scans.scanner.Scan
    settings(scene) -> dict, style(scene) -> dict   more fields of patina_settings, patina_cloud_style
    after(native, cloud, scene)                     told once the cloud is there
Exact views are kept in $PATINA_TRUTH_CACHE, else build/out/truth-cache; the first run makes them (minutes)."""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "addon")]

from truth.scans import metrics  # noqa: E402
from truth.scans.campaigns import group, named  # noqa: E402
from truth.scans.exact import Exact, Stage, camera  # noqa: E402
from truth.scans.filters import FILTERS  # noqa: E402
from truth.scans.scenes import HEIGHT, SKY, STEP, WIDTH, Scene  # noqa: E402
from truth.scans.solids import linear  # noqa: E402

COLUMNS = ("false", "lost", "sky", "psnr", "ceiling", "ssim", "thin", "width", "outline", "flicker", "invented", "hiding", "ms", "work")
PERCENT = ("false", "lost", "sky", "thin", "invented", "hiding")
TITLES = [f"{c} %" if c in PERCENT else {"psnr": "PSNR", "ssim": "SSIM", "outline": "outline px"}.get(c, c) for c in COLUMNS]
PAINT = {"false": (1.0, 0.1, 0.1), "lost": (0.1, 0.2, 1.0), "sky": (1.0, 0.0, 1.0), "hiding": (1.0, 0.6, 0.0)}


class Drawer:
    """The library, and what it is asked for."""

    def __init__(self, options: argparse.Namespace) -> None:
        os.environ.setdefault("PATINA_LIBRARY", str(ROOT / "build/out/release/libpatina.so"))
        import native
        self.native = native
        self.device = native.Device(options.device, options.threads)
        self.frame = native.Frame(self.device)
        self.settings, self.style, self.effects = (_fields(given) for given in (options.set, options.style, options.effect))
        self.hook = _hook(options.hook)
        self.analysis = options.analysis
        self.filter = FILTERS.get(getattr(options, "filter", None) or "")

    def cloud(self, stage: Stage) -> Any:
        make = getattr(self.hook, "cloud", None)
        scan = stage.scan
        kept = self.filter(scan.position) if self.filter else slice(None)
        made = make(self.native, scan, stage.scene) if make else \
            self.native.Cloud(np.ascontiguousarray(scan.position[kept], np.float32), None, np.ascontiguousarray(scan.color[kept]))
        if self.analysis != "off" and hasattr(made, "analyse") and not make:
            # samples of a walk have no station
            known = self.analysis in ("stations", "free", "grid") and not self.filter and len(scan.stations) > int(scan.scan.max())
            by_grid = known and self.analysis == "grid"
            made.analyse(stations=scan.stations if known else None,
                         station=scan.scan.astype(np.uint8)[:, None] if known else None,
                         free_space=known and self.analysis == "free", by_grid=by_grid,
                         grid=(_lines(scan.row), _lines(scan.column)) if by_grid else None)
            if self.analysis == "free":
                self.style.setdefault("free_space", 2)
        getattr(self.hook, "after", lambda *_: None)(self.native, made, stage.scene)
        return made

    def more(self, kind: str, scene: Scene) -> dict[str, Any]:
        return getattr(self, kind) | getattr(self.hook, kind, lambda _: {})(scene)

    def draw(self, cloud: Any, stage: Stage, index: int, step: float = 0.0, times: int = 1
             ) -> tuple[np.ndarray, np.ndarray, tuple[float, float]]:
        """Linear colour (h, w, 3), depth (h, w), milliseconds: the least of `times` after a first, on the clock and of the
        processor."""
        scene = self.native.Scene()
        scene.add_cloud(cloud, **self.more("style", stage.scene))
        scene.set_settings(**{"width": WIDTH, "height": HEIGHT, "world_color": linear(np.array(SKY)).tolist(), "passes": 3,
                              **self.more("settings", stage.scene)})
        if self.effects:
            scene.set_effects(**self.effects)
        scene.set_camera(**camera(stage.scene.views[index], step).fields())
        best = np.inf, np.inf
        for k in range(times + 1):
            began, spent = time.perf_counter(), time.process_time()
            self.frame.render(scene)
            if k:
                best = (min(best[0], 1e3 * (time.perf_counter() - began)), min(best[1], 1e3 * (time.process_time() - spent)))
        return self.frame.read("COMBINED")[..., :3], self.frame.read("DEPTH")[..., 0], best


def _lines(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values, np.int32)[:, None]


def _fields(given: list[str]) -> dict[str, Any]:
    return {name: json.loads(value) for name, _, value in (one.partition("=") for one in given)}


def _hook(path: str | None) -> Any:
    if not path:
        return None
    spec = importlib.util.spec_from_file_location("hook", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def painted(exact: Exact, color: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """Truth and picture above, errors and ceiling beneath; sRGB bytes, row 0 at the top."""
    ours, theirs = metrics.srgb(color), metrics.srgb(exact.color)
    shown = 0.25 + 0.35 * np.repeat(theirs.mean(axis=2, keepdims=True), 3, axis=2)
    shown[~exact.scanned] *= 0.5
    for name, mask in metrics.classes(exact, depth).items():
        if name in PAINT:
            shown[mask] = PAINT[name]
    ceiling = np.where(exact.scanned[..., None], exact.ceiling / np.float32(255.0), 0.0)
    rows = [np.hstack([theirs[::-1], ours[::-1]]), np.hstack([shown[::-1], ceiling[::-1]])]
    return np.rint(255.0 * np.vstack(rows)).clip(0, 255).astype(np.uint8)


def mean(rows: list[dict[str, Any]]) -> dict[str, float]:
    """Over cameras; what is not a number is left out."""
    found = {}
    for name in COLUMNS:
        values = np.array([row[name] for row in rows if name in row], float)
        values = values[np.isfinite(values)]
        found[name] = float(values.mean()) if len(values) else float("nan")
    return found


def cells(values: dict[str, float]) -> list[str]:
    found = []
    for column in COLUMNS:
        value = values[column] * (100.0 if column in PERCENT else 1.0)
        digits = {"ssim": 3, "ms": 1, "work": 1, "outline": 2, "width": 2}.get(column, 1)
        found.append("–" if not np.isfinite(value) else f"{value:.{digits}f}")
    return found


def line(name: str, values: dict[str, float]) -> str:
    return "| " + " | ".join([name, *cells(values)]) + " |"


def table(rows: list[dict[str, Any]]) -> str:
    """By scene; the means weigh scenes alike."""
    names = list(dict.fromkeys(row["scene"] for row in rows))
    head = ["scene", *TITLES]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    by_scene = {name: mean([row for row in rows if row["scene"] == name]) for name in names}
    lines += [line(name + " (held out)" * named(name).held_out, by_scene[name]) for name in names]
    for title, wanted in (("**mean, tuning**", False), ("**mean, held out**", True)):
        some = [by_scene[name] for name in names if named(name).held_out == wanted]
        if some:
            lines.append(line(title, mean(some)))
    return "\n".join(lines)


def scenes_of(words: str) -> list[Scene]:
    return group(words)


def measure(drawer: Any, scenes: list[Scene], cameras: list[int], pictures: Path | None = None, motion: bool = True,
            times: int = 1) -> list[dict[str, Any]]:
    """A row a camera. drawer: cloud(stage) and draw(cloud, stage, index, step, times), as Drawer's."""
    rows = []
    for scene in scenes:
        stage = Stage(scene)
        began = time.perf_counter()
        cloud = drawer.cloud(stage)
        build = time.perf_counter() - began
        for index in cameras:
            exact = stage.view(index)
            color, depth, (ms, work) = drawer.draw(cloud, stage, index, 0.0, times)
            row = {"scene": scene.name, "held_out": scene.held_out, "camera": index, "points": len(stage.scan),
                   "build_s": build, **metrics.measure(exact, color, depth), "ms": ms, "work": work}
            if scene.views[index].motion and motion:
                moved, _, _ = drawer.draw(cloud, stage, index, STEP, 0)
                row["flicker"] = metrics.flicker((exact, stage.view(index, True)), (color, moved))
            rows.append(row)
            if pictures:
                import imageio.v3 as image
                pictures.mkdir(parents=True, exist_ok=True)
                image.imwrite(pictures / f"{scene.name}-{index}.png", painted(exact, color, depth))
        print(line(scene.name, mean([row for row in rows if row["scene"] == scene.name])), file=sys.stderr, flush=True)
    return rows


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", default="tuning", help="names with commas, or tuning (default), held, all: the frozen scenes; "
                        "trained, unseen, campaigns: those with the errors of real scanners")
    parser.add_argument("--cameras", default="0,1,2,3,4,5,6,7")
    parser.add_argument("--set", action="append", default=[], metavar="FIELD=JSON", help="of patina_settings")
    parser.add_argument("--style", action="append", default=[], metavar="FIELD=JSON", help="of patina_cloud_style")
    parser.add_argument("--effect", action="append", default=[], metavar="FIELD=JSON", help="of patina_effects")
    parser.add_argument("--hook", help="a Python file, see above")
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--analysis", choices=("off", "on", "stations", "free", "grid"), default="on",
                        help="what every point knows, where the library finds it out; with the scanners' places; without what they "
                        "saw through; and with neighbours in their grids")
    parser.add_argument("--filter", choices=list(FILTERS), help="draw only the points that one of CloudCompare's filters keeps; without stations")
    parser.add_argument("--times", type=int, default=1, help="timed frames a camera; the least counts")
    parser.add_argument("--still", action="store_true", help="no flicker")
    parser.add_argument("--pictures", type=Path, help="truth, picture, errors and ceiling of each camera go here as PNG")
    parser.add_argument("--json", type=Path, help="a row a camera goes here")
    parser.add_argument("--by-camera", action="store_true", help="print each camera, too")
    parser.add_argument("--make", action="store_true", help="only make what is kept")
    options = parser.parse_args()
    scenes, cameras = scenes_of(options.scenes), [int(one) for one in options.cameras.split(",")]
    if options.make:
        for scene in scenes:
            began = time.perf_counter()
            stage = Stage(scene)
            views = [stage.view(index) for index in cameras]
            [stage.view(index, True) for index in cameras if scene.views[index].motion]
            print(f"{scene.name}: {len(stage.scan):,} points, scanned {np.mean([one.scanned.mean() for one in views]):.2f}, "
                  f"sky {np.mean([one.sky.mean() for one in views]):.2f}, {time.perf_counter() - began:.0f} s", flush=True)
        return 0
    rows = measure(Drawer(options), scenes, cameras, options.pictures, not options.still, options.times)
    if options.by_camera:
        for row in rows:
            print(line(f"{row['scene']} {row['camera']}", mean([row])))
    print(table(rows))
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
