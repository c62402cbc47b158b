# SPDX-License-Identifier: GPL-3.0-or-later
"""Range images: [K Tables I, II], seconds of an Athlon XP 2600+ (one core, 2004) beside ours, and filling, discs and this mode on the same
scans. No screen size is printed: 512 x 512 is ours to assume, and so are four layers, a second pass of 0.75, a right angle of culling.

Scans of the bunny and the dragon are the Stanford ones, where they are there; others are made of a torus, by exact rays from as many
directions, each with noise (0.15 of the interval of its samples) and a fault of its own in its place (0.3)."""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

sys.path[:0] = [str(Path(__file__).resolve().parents[2] / "addon"), str(Path(__file__).resolve().parent)]

import case as cases  # noqa: E402
import metrics  # noqa: E402
import numpy as np  # noqa: E402
import stage as stages  # noqa: E402
from modes import ALL_PASSES, COLOR_AND_DEPTH  # noqa: E402
from native.points import ScanSet  # noqa: E402
from tables import table  # noqa: E402
from truth import look, orbit, scenes  # noqa: E402
from truth.camera import parallel  # noqa: E402
from truth.scene import srgb_bytes  # noqa: E402

import native  # noqa: E402

DATA = stages.ROOT.parent / "shared/data/stanford"
SIZE, LAYERS, SHARPNESS, CULLING = 512, 4, 0.75, np.pi / 2.0
RANGES, SPLATS = 3, 1  # patina_surface
NOISE, OFF = 0.15, 0.3  # of the interval
GRAZED = 0.1  # cosine, less of which a scanner does not see
DIRECTIONS = 18  # of the scans that surfaces are compared on
ONE_PASS, MORE = 40.0, 100.0  # times as fast as printed: one pass; two, and alpha


@dataclass(frozen=True)
class Row:
    """Of the tables. wanted: how many times as fast."""

    model: str
    s: float
    what: str
    printed: float | None  # seconds
    wanted: float | None
    style: dict[str, Any] = field(default_factory=dict)


TWO, ALPHA, CULLED = {"range_sharpness": SHARPNESS}, {"transparency": 0.5}, {"range_cull": CULLING}
TABLE = (
    Row("Bunny", 2.7, "one pass", 0.20, ONE_PASS),
    Row("Bunny", 2.7, "two passes", 0.41, MORE, TWO),
    Row("Bunny", 2.7, "alpha", 0.44, MORE, ALPHA),
    Row("Bunny", 2.7, "alpha, two passes", 0.91, MORE, TWO | ALPHA),
    Row("Buddha", 1.6, "one pass", 0.47, ONE_PASS),
    Row("Buddha", 1.6, "two passes", 0.98, MORE, TWO),
    Row("Beetle", 1.31, "one pass", 0.28, ONE_PASS),
    Row("Beetle", 1.31, "one pass, culled", 0.23, ONE_PASS, CULLED),
    Row("Bunny", 2.7, "one pass, culled", None, None, CULLED),
    Row("Dragon", 2.7, "one pass", None, None),
    Row("Dragon", 2.7, "one pass, culled", None, None, CULLED),
    Row("Dragon", 2.7, "two passes", None, None, TWO),
)
MADE = {"Buddha": (1_274_573, 18), "Beetle": (559_327, 9), "Bunny": (362_272, 10), "Dragon": (469_193, 15)}  # points, directions
REAL = {"Bunny": "bunny_range/bun.conf", "Dragon": "dragon_range/dragonStandRight.conf"}


@dataclass(frozen=True, eq=False)
class Scans:
    stage: stages.Stage
    of: np.ndarray  # (n,) uint16
    told: list[tuple[Any, float]]  # direction and interval of each
    interval: float


# ---- scans ---------------------------------------------------------------------------------------------------------


def _ways(count: int) -> list[tuple[float, float]]:
    """Azimuth and elevation of scanners, degrees: around, from above and from the side in turns, every fifth from below."""
    return [(360.0 * k / count, -45.0 if k % 5 == 4 else (55.0, 10.0)[k % 2]) for k in range(count)]


def generated(count: int, directions: int) -> Scans:
    """Range images of the torus, parallel rays on square grids, so fine that all scans together have so many points."""
    scene = scenes.build("torus")

    def make() -> dict[str, np.ndarray]:
        random, cameras = np.random.default_rng(11), [parallel(orbit(a, e, 3.6), 3.6) for a, e in _ways(directions)]

        def taken(camera: Any, n: int) -> tuple[np.ndarray, np.ndarray]:
            picture = scene.picture(camera, n, n, 1, 0)
            y, x = np.divmod(np.arange(n * n), n)
            start, way = camera.rays(x + 0.5, y + 0.5, n, n)
            depth = picture.depth.reshape(-1)
            facing = np.abs((picture.normal.reshape(-1, 3) * way).sum(1)) > GRAZED
            seen = np.isfinite(depth) & facing
            return (start[seen] + depth[seen, None] * way[seen]), -camera.matrix[:3, 2]

        share = sum(len(taken(camera, 96)[0]) for camera in cameras) / 96.0**2
        n = int(np.ceil(np.sqrt(1.01 * count / share)))
        interval = (cameras[0].right - cameras[0].left) / n
        places, of, ways = [], [], []
        for index, camera in enumerate(cameras):
            found, way = taken(camera, n)
            places.append(found + random.normal(0.0, NOISE, (len(found), 1)) * interval * way + random.normal(0.0, OFF, 3) * interval / 3**0.5)
            of.append(np.full(len(found), index))
            ways.append(way)
        place, of = np.concatenate(places), np.concatenate(of)
        kept = np.sort(random.permutation(len(place))[:count])
        return {"position": place[kept].astype(np.float32), "of": of[kept].astype(np.uint16), "way": np.array(ways), "interval": np.array(interval)}

    arrays = stages.kept(f"range-images-{count}-{directions}-{GRAZED}", make)
    position, interval = arrays["position"], float(arrays["interval"])
    color = np.rint(srgb_bytes(position.astype(np.float64))).astype(np.uint8)
    shown = stages.Stage(position, None, color, interval, lambda turn: orbit(turn, stages.ELEVATION, stages.DISTANCE, stages.FOV), {"lighting": 2},
                         tuple(light.fields() for light in scene.lights), scene, "torus")
    return Scans(shown, arrays["of"], [(way, interval) for way in arrays["way"]], interval)


def real(name: str) -> Scans | None:
    path = DATA / REAL.get(name, "none")
    if not path.is_file():
        return None
    with native.File(str(path)) as file:
        told, attributes = file.scans(), {one: file.attribute(index) for index, one in enumerate(file.attributes)}
        position = file.positions() + np.float32(0.0)
    upright, signs = [0, 2, 1], np.float32([1, -1, 1])  # y is up in the file
    position = np.ascontiguousarray(position[:, upright] * signs)
    low, high = position.min(axis=0).astype(float), position.max(axis=0).astype(float)
    centre, size = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))

    def camera(turn: float) -> Any:
        a, rise = np.radians(turn + 20.0), np.radians(20.0)
        back = np.array([np.sin(a) * np.cos(rise), -np.cos(a) * np.cos(rise), np.sin(rise)])
        one = look(centre + 1.9 * size * back, centre)
        return type(one)(**{**vars(one), "near": 0.1 * size, "far": 10.0 * size})

    sun = {"type": 1, "power": np.pi, "direction": [-0.36, 0.48, -0.8]}
    shown = stages.Stage(position, None, None, max(scan.interval for scan in told), camera, {"lighting": 2}, (sun,))
    return Scans(shown, attributes["scan"].astype(np.uint16), [(np.array(scan.direction)[upright] * signs, scan.interval) for scan in told], shown.spacing)


# ---- what is measured ------------------------------------------------------------------------------------------------


def _drawn(scans: Scans, cloud: native.Cloud, known: ScanSet | None, device: native.Device, frames: int, style: dict[str, Any],
           settings: dict[str, Any]) -> dict[str, Any]:
    """Times, and the error where there is a truth."""
    def make(turn: float, passes: int = COLOR_AND_DEPTH) -> native.Scene:
        scene = native.Scene()
        scene.add_cloud(cloud, scans=known, **{**scans.stage.style, **style})
        for light in scans.stage.lights:
            scene.add_light(**light)
        scene.set_settings(width=SIZE, height=SIZE, film_transparent=1, world_color=[0.05] * 3, passes=passes, **settings)
        scene.set_camera(**scans.stage.camera(turn).fields())
        return scene

    frame = native.Frame(device)
    found = cases.frames(frame, make, frames)
    frame.render(make(0.0, ALL_PASSES))
    if scans.stage.scene is not None and "transparency" not in style:
        found["error"] = metrics.errors(scans.stage.exact(0.0, SIZE, SIZE), cases.picture(frame), scans.interval)
    return found


def measure(quick: bool) -> dict[str, Any]:
    device, frames = native.Device("cpu", 0), 12 if quick else 24
    result: dict[str, Any] = {"paper": [], "surfaces": [], "device": device.name}
    for model in dict.fromkeys(row.model for row in TABLE):
        found = real(model)
        scans, known = found or generated(*MADE[model]), None
        cloud = native.Cloud(scans.stage.position, None, scans.stage.color)
        known = ScanSet(cloud, scans.of, scans.told)
        for row in (row for row in TABLE if row.model == model):
            got = _drawn(scans, cloud, known, device, frames, {"range_pixel": row.s, **row.style}, {"surface": RANGES, "layers": LAYERS})
            result["paper"].append({"model": model if found else f"{model}'s size, generated", "points": len(scans.of), "s": row.s, "what": row.what,
                                    "printed": row.printed, "wanted": row.wanted, **got})
            print(f"ranges: {result['paper'][-1]['model']}, {row.what}: {got['ms_median']:.2f} ms, work {got['work_ms']:.2f}", file=sys.stderr)
    for count in (35_000, 140_000, 560_000)[: 1 if quick else 3]:
        scans = generated(count, DIRECTIONS)
        for name, surface, analysed, style in (("filling", 0, True, {}), ("filling, not analysed", 0, False, {}), ("discs", SPLATS, True, {}),
                                               ("range images", RANGES, False, {}), ("range images, two passes", RANGES, False, TWO)):
            start = time.process_time()
            cloud = native.Cloud(scans.stage.position, None, scans.stage.color)
            built = time.process_time() - start
            if analysed:
                cloud.analyse()
            before = time.process_time() - start - built
            known = ScanSet(cloud, scans.of, scans.told)
            got = _drawn(scans, cloud, known, device, frames, style, {"surface": surface})
            result["surfaces"].append({"points": count, "surface": name, "analysis_s": before, **got})
            print(f"ranges: {count:,} points, {name}: {got['ms_median']:.2f} ms, {got['error']['color_psnr']:.2f} dB", file=sys.stderr)
    return result


# ---- what is said ----------------------------------------------------------------------------------------------------


def paper(found: dict[str, Any]) -> str:
    body = []
    for row in found["paper"]:
        error, printed = row.get("error"), row["printed"]
        body.append([row["model"], f"{row['points']:,}", f"{row['s']:g}", row["what"], f"{printed:.2f}" if printed else "–", f"{row['ms_median']:.1f}",
                     f"{row['work_ms']:.1f}", f"**{1000 * printed / row['ms_median']:.0f}×**" if printed else "–",
                     f"{1000 * printed / row['work_ms']:.0f}×" if printed else "–", f"{row['wanted']:.0f}×" if printed else "–",
                     f"{error['color_psnr']:.1f} dB, {error['normal_mean_degrees']:.1f}°" if error else "no truth"])
    return table(["scans", "points", "s", "what", "printed, s", "ours, ms", "work, ms", "ratio", "ratio of work", "aim", "PSNR, normals off"], body)


def surfaces(found: dict[str, Any]) -> str:
    body = [[f"{row['points']:,}", row["surface"], f"{row['ms_median']:.1f}", f"{row['work_ms']:.1f}", f"{row['analysis_s']:.2f}",
             f"{row['error']['color_psnr']:.1f}", f"{row['error']['normal_mean_degrees']:.2f}", f"{row['error']['depth_rms_spacings']:.2f}",
             f"{100 * (1 - row['error']['coverage_iou']):.2f}"] for row in found["surfaces"]]
    return table(["points", "surface", "ms a frame", "work, ms", "analysis before, s of work", "PSNR, dB", "normals off, °", "depth rms, intervals",
                  "coverage wrong, %"], body)


def markdown(found: dict[str, Any]) -> str:
    return (f"## Range images\n\n[K Tables I, II], {SIZE} x {SIZE}, {LAYERS} layers, {found['device']}.\n\n{paper(found)}\n\n"
            f"{DIRECTIONS} scans of a torus, three surfaces.\n\n{surfaces(found)}\n")
