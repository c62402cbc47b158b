# SPDX-License-Identifier: GPL-3.0-or-later
"""Every scan of ../shared/data from three cameras, before and after: filling alone of points as they come, and the default, analysed,
with the scanners' places where the file knows them.

    build/out/venv/bin/python tests/bench/gallery.py [NAME]... [--library FILE] [--out FOLDER] [--manual]
    build/out/venv/bin/python tests/bench/gallery.py NAME --view X,Y,Z,AZIMUTH,ELEVATION,DISTANCE... [--out FOLDER]
    build/out/venv/bin/python tests/bench/gallery.py --trust [--manual]

Writes FOLDER/NAME.jpg, a contact sheet each: the cameras from left to right, before above, after beneath. --manual: into
.pictures/scans, and its README.md that shows them. --trust: all points above, the default beneath, FOLDER/trust-NAME.jpg and trust.md. --view: other cameras, FOLDER/NAME-view.png, to choose them by.
X, Y, Z: where it looks, in parts of the box of the points without strays; degrees around z from -y and above the
horizon; how far from there, in diagonals of the box."""

from __future__ import annotations

import argparse
import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib.font_manager
import numpy as np
from PIL import Image, ImageDraw, ImageFont

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
DATA = ROOT.parent / "shared/data"
sys.path[:0] = [str(ROOT / "tests"), str(HERE)]

from leaves import package  # noqa: E402

SIZE, SHOWN = (1280, 960), (400, 300)  # pixels drawn, and on the sheet
GAP, LABEL = 6, 22
PAPER, INK = (250, 250, 248), (40, 40, 40)
SKY = (0.72, 0.78, 0.84)  # sRGB
FOV = 50.0
SURFACE_AUTO, SURFACE_FILL = 0, 2
View = tuple[float, float, float, float, float, float]
TITLES = ("near", "within", "far")


@dataclass(frozen=True)
class Scan:
    """views: see above, near, within or grazing, far. up: which axis of the file points up."""

    file: str
    told: str
    views: tuple[View, View, View]
    up: str = "z"

    @property
    def name(self) -> str:
        return Path(self.file).name.split(".")[0].lower().replace("_", "-")


SCANS = (
    Scan("lidar/lion_takanawa_normals.ply", "a stone lion among leaves, colours and normals",
         ((0.5, 0.3, 0.72, 20, 5, 0.22), (0.5, 0.5, 0.25, 75, 8, 0.3), (0.5, 0.5, 0.5, 30, 12, 0.62))),
    Scan("heritage/espacio_escultorico_full_density_crop.las", "a ring of prisms on lava and scrub, colours",
         ((0.22, 0.3, 0.35, 250, 4, 0.06), (0.5, 0.1, 0.4, 10, 3, 0.16), (0.5, 0.5, 0.4, 40, 25, 0.55))),
    Scan("lidar/vol_total.las", "fields, trees and a farmhouse from the air, colours",
         ((0.12, 0.75, 0.5, 60, 8, 0.07), (0.04, 0.3, 0.6, 300, 20, 0.15), (0.5, 0.5, 0.3, 30, 30, 0.62))),
    Scan("lidar/autzen_trim.las", "a park by a river from the air, colours",
         ((0.35, 0.5, 0.35, 40, 10, 0.12), (0.5, 0.5, 0.35, 300, 3, 0.25), (0.5, 0.5, 0.4, 340, 30, 0.65))),
    Scan("lidar/lone-star.laz", "a rock face, neither colours nor normals",
         ((0.5, 0.5, 0.3, 220, 5, 0.2), (0.5, 0.5, 0.4, 220, 3, 0.45), (0.5, 0.5, 0.5, 200, 15, 0.7))),
    Scan("lidar/CSite4_orig-utm.pcd", "a city from the air",
         ((0.45, 0.55, 0.6, 40, 18, 0.15), (0.4, 0.5, 0.6, 310, 20, 0.2), (0.5, 0.5, 0.2, 30, 40, 0.75))),
    Scan("lidar/FSite7_orig-utm.pcd", "fields and a railway from the air, with high outliers",
         ((0.4, 0.7, 0.12, 40, 15, 0.12), (0.5, 0.35, 0.1, 60, 4, 0.25), (0.5, 0.5, 0.3, 30, 30, 0.75))),
    Scan("lidar/samp11-utm.pcd", "a steep slope from the air",
         ((0.5, 0.5, 0.45, 300, 18, 0.15), (0.4, 0.3, 0.3, 60, 6, 0.3), (0.5, 0.5, 0.5, 300, 35, 0.75))),
    Scan("lidar/vegetation_1_3.las", "a plant",
         ((0.5, 0.5, 0.5, 120, 5, 0.4), (0.5, 0.5, 0.3, 210, 3, 0.6), (0.5, 0.5, 0.5, 30, 20, 0.9))),
    Scan("lidar/certainty3d-color-utm-feet-navd88.las", "strips of ground, colours",
         ((0.37, 0.42, 0.5, 300, 25, 0.1), (0.35, 0.4, 0.5, 300, 25, 0.2), (0.4, 0.5, 0.5, 0, 60, 0.4))),
    Scan("lidar/sample_c.las", "a thinned strip of ground, colours",
         ((0.5, 0.5, 0.95, 30, 12, 0.12), (0.5, 0.5, 0.95, 300, 4, 0.25), (0.5, 0.5, 0.6, 30, 35, 0.65))),
    Scan("lidar/warsaw_small.las", "trees and cars, thinned, colours",
         ((0.55, 0.5, 0.3, 30, 5, 0.3), (0.6, 0.5, 0.5, 300, 3, 0.45), (0.5, 0.5, 0.4, 30, 30, 0.8))),
    Scan("lidar/room_scan1.pcd", "rooms, seen by a scanner among them",
         ((0.5, 0.5, 0.3, 60, 10, 0.1), (0.5, 0.5, 0.5, 200, 3, 0.2), (0.5, 0.5, 0.5, 30, 35, 0.5))),
    Scan("lidar/office1.pcd", "an office, one view of a depth camera",
         ((0.45, 0.5, 0.4, -20, 10, 0.4), (0.6, 0.6, 0.4, 20, 3, 0.35), (0.5, 0.5, 0.45, 0, 5, 0.75)), "-y"),
    Scan("stanford/bunny/bun_zipper.ply", "the bunny's vertices, normals of its faces",
         ((0.3, 0.5, 0.7, 20, 10, 0.25), (0.5, 0.5, 0.4, 200, 3, 0.5), (0.5, 0.5, 0.5, 30, 15, 0.85)), "y"),
    Scan("stanford/bunny_range/bun.conf", "ten range images of the bunny",
         ((0.5, 0.5, 0.6, 30, 25, 0.3), (0.5, 0.5, 0.4, 200, 3, 0.5), (0.5, 0.5, 0.5, 30, 15, 0.85)), "y"),
    Scan("stanford/dragon_range/dragonStandRight.conf", "fifteen range images of the dragon",
         ((0.3, 0.5, 0.6, 20, 10, 0.3), (0.5, 0.5, 0.4, 250, 5, 0.35), (0.5, 0.5, 0.5, 20, 12, 0.7)), "y"),
    Scan("stanford/dragon_range_union/dragon_ranges_registered.ply", "the same in one file",
         ((0.5, 0.5, 0.7, 30, 25, 0.3), (0.6, 0.5, 0.4, 160, 8, 0.35), (0.5, 0.5, 0.5, 200, 12, 0.8)), "y"),
    Scan("stanford/armadillo_inward_normals.ply", "a slice of the armadillo's vertices, normals turned inward",
         ((0.5, 0.75, 0.65, 150, 5, 0.25), (0.5, 0.6, 0.6, 170, 5, 0.4), (0.5, 0.5, 0.5, 60, 10, 0.8)), "y"),
)


def read(scan: Scan) -> Any:
    from patina.read.importers import las, library, pcd
    from patina.read.importers.reading import Filter, Progress

    path = DATA / scan.file
    module = {".las": las, ".laz": las, ".pcd": pcd}.get(path.suffix, library)
    return module.read(path, Filter(), Progress())


# A file's axes in the world, z up.
UPRIGHT = {"z": np.eye(3), "y": np.array([(1, 0, 0), (0, 0, -1), (0, 1, 0)]), "-y": np.array([(1, 0, 0), (0, 0, 1), (0, -1, 0)])}


def whole(values: np.ndarray | None, kind: type) -> np.ndarray | None:
    return None if values is None else np.ascontiguousarray(values, kind).reshape(-1, 1)


def clouds(scan: Scan) -> tuple[Any, Any, str]:
    """Before, after, and what is known of the scanners. As addon/sync has it."""
    from patina import native

    points = read(scan)
    made = [native.Cloud(np.ascontiguousarray(points.positions), points.normals, points.colors) for _ in range(2)]
    places = np.array(points.notes.get("scanners", []), float).reshape(-1, 3)
    known = len(places) > 0 and np.isfinite(places).all()
    columns = [whole(points.scalars.get(name), kind) for name, kind in
               (("scan", np.uint16), ("row", np.uint32), ("column", np.uint32))]
    told = known and (columns[0] is not None or len(places) == 1)
    if told and columns[0] is None:
        columns[0] = np.zeros((len(points.positions), 1), np.uint16)
    grid = (columns[1], columns[2]) if told and columns[1] is not None and columns[2] is not None else None
    made[1].analyse(stations=places if known else None, station=columns[0] if told else None, grid=grid)
    return made[0], made[1], f", {len(places)} known place{'s' * (len(places) != 1)} of the scanner" if known else ""


def camera(box: tuple[Any, Any], view: View) -> Any:
    from truth.camera import look

    low, high = np.array(box)
    size = float(np.linalg.norm(high - low))
    turn, rise = np.radians(view[3:5])
    target = low + np.array(view[:3]) * (high - low)
    back = np.array([np.sin(turn) * np.cos(rise), -np.cos(turn) * np.cos(rise), np.sin(rise)])
    seen = look(target + view[5] * size * back, target, FOV, SIZE[0] / SIZE[1])
    return type(seen)(**{**vars(seen), "near": 0.001 * size, "far": 20.0 * size})


def lights(seen: Any) -> list[dict[str, Any]]:
    """Over the left shoulder, and a weak one from the right, as `patina render` has them."""
    axes = np.asarray(seen.matrix)[:3, :3]
    return [{"type": 1, "power": power, "color": color, "direction": (-axes @ np.array(place)).tolist()}
            for place, color, power in (((-0.8, 0.75, 0.45), (1.0, 0.97, 0.92), 2.8), ((0.9, 0.1, 0.6), (0.8, 0.9, 1.0), 0.6))]


def drawn(frame: Any, cloud: Any, turn: np.ndarray, seen: Any, surface: int, least_trust: float = 0.0) -> Image.Image:
    from patina import native
    from truth.scans.solids import linear

    with native.Scene() as scene:
        matrix = np.eye(4)
        matrix[:3, :3] = turn
        scene.add_cloud(cloud, world_from_object=matrix.ravel().tolist(), least_trust=least_trust)
        for light in lights(seen):
            scene.add_light(**light)
        scene.set_settings(width=SIZE[0], height=SIZE[1], surface=surface, passes=3, own_background=1,
                           background=linear(np.array(SKY)).tolist(), world_color=(0.05, 0.05, 0.05))
        scene.set_camera(**seen.fields())
        frame.render(scene)
    rgb = np.clip(frame.read("COMBINED")[::-1, :, :3], 0.0, 1.0)
    encoded = np.where(rgb <= 0.0031308, 12.92 * rgb, 1.055 * rgb ** (1 / 2.4) - 0.055)
    return Image.fromarray(np.rint(255.0 * encoded).astype(np.uint8))


def seen_from(cloud: Any, scan: Scan, views: tuple[View, ...]) -> list[Any]:
    """A camera for each view."""
    corners = np.array(cloud.dense_box()) @ UPRIGHT[scan.up].T
    return [camera((corners.min(axis=0), corners.max(axis=0)), view) for view in views]


def joined(rows: list[tuple[str, list[Image.Image]]]) -> Image.Image:
    """A sheet of one row for each title and its images."""
    width, height = SHOWN
    out = Image.new("RGB", (len(rows[0][1]) * (width + GAP) + GAP, len(rows) * (height + LABEL + GAP)), PAPER)
    draw = ImageDraw.Draw(out)
    font = ImageFont.truetype(matplotlib.font_manager.findfont("DejaVu Sans"), 14)
    for row, (title, images) in enumerate(rows):
        for column, image in enumerate(images):
            x, y = GAP + column * (width + GAP), row * (height + LABEL + GAP)
            out.paste(image.resize(SHOWN, Image.Resampling.LANCZOS), (x, y + LABEL))
            draw.text((x + 2, y + LABEL // 2), f"{TITLES[column % 3]}, {title}", INK, font, anchor="lm")
    return out


def sheet(frame: Any, scan: Scan, views: tuple[View, ...]) -> tuple[Image.Image, str]:
    """The contact sheet, and what the manual says beneath."""
    before, after, known = clouds(scan)
    rows = [(title, [drawn(frame, cloud, UPRIGHT[scan.up], seen, surface) for seen in seen_from(before, scan, views)])
            for title, cloud, surface in (("before", before, SURFACE_FILL), ("after", after, SURFACE_AUTO))]
    return joined(rows), f"{before.count:,} points{known}"


def trusted(frame: Any, scan: Scan, views: tuple[View, ...]) -> tuple[Image.Image, str]:
    """The contact sheet of all points and of trusted ones, and its row of the table."""
    _, cloud, _ = clouds(scan)
    images: dict[str, list[Image.Image]] = {"all points": [], "default": []}
    gone, untrusted = [], 0
    for seen in seen_from(cloud, scan, views):
        shown = []
        for title, least in (("all points", -1.0), ("default", 0.0)):
            images[title].append(drawn(frame, cloud, UPRIGHT[scan.up], seen, SURFACE_AUTO, least))
            shown.append(np.isfinite(frame.read("DEPTH")[..., 0]))
        untrusted = frame.stats()["untrusted"]
        gone.append(100.0 * (shown[0] & ~shown[1]).sum() / max(shown[0].sum(), 1))
    figures = " / ".join(f"{share:.2f}" for share in gone)
    return joined(list(images.items())), f"{100.0 * untrusted / cloud.count:.2f} | {figures}"


def trust_page(told: list[tuple[Scan, str]]) -> str:
    parts = ["# Real scans: all points, and only trusted ones", "",
             "Each sheet shows three views with default settings: all points above (`--trust 0`), the default beneath.",
             "[The manual](../../addon/manual/trust.md) explains trust. `build/gallery --trust --manual` draws the images and writes this",
             "page.", "",
             "| scan | points left out % | near, within, far: pixels that showed something and show nothing now % |", "|---|---|---|",
             *(f"| {Path(scan.file).name} | {figures} |" for scan, figures in told), ""]
    parts += [f"Scans of which less than {SHOWN_FROM} % is left out show no difference, and no sheet is kept.", ""]
    for scan, figures in told:
        if float(figures.partition(" ")[0]) < SHOWN_FROM:
            continue
        parts += [f"**{Path(scan.file).name}**: {scan.told}.", JUDGED.get(scan.name, ""), "", f"![{scan.told}](trust-{scan.name}.jpg)", ""]
    return "\n".join([*parts, CREDITS])


def page(told: list[tuple[Scan, str]]) -> str:
    parts = ["# Real scans, before and after", "",
             "Every scan of the folder that the tests use, from three cameras, 1280 × 960 with the defaults, reduced. Above: filling",
             "alone, of points as they come (`--analysis off --surface fill`). Beneath: the default, analysed, with the scanners'",
             "places where the file knows them. `build/gallery --manual` draws the pictures and writes this page.", ""]
    for scan, what in told:
        parts += [f"**{Path(scan.file).name}**: {scan.told}; {what}.", "", f"![{scan.told}]({scan.name}.jpg)", ""]
    return "\n".join([*parts, CREDITS])


# What the sheets of trust show, by scan.
JUDGED = {
    "espacio-escultorico-full-density-crop": "False surface below the platform goes. Worse: the sparse scrub at the rims gets small holes.",
    "autzen-trim": "Discs in front of the trees shrink or go. Worse: some crowns get holes.",
    "lone-star": "Specks beside the chimney go. Worse: gaps on the sparse ground grow.",
    "csite4-orig-utm": "Specks in the air and beyond the rim go. Worse: sparse facades lose points.",
    "fsite7-orig-utm": "Better: false surface in the air goes, but not all of it. Worse: the row of sparse trees on the field goes, too.",
    "samp11-utm": "Specks above the slope go.",
    "vegetation-1-3": "Leaves that are single points go: a little worse.",
    "certainty3d-color-utm-feet-navd88": "Specks beside the strips go. Worse: the strips' frayed ends get shorter.",
    "room-scan1": "Sheets between furniture and walls, and one of two discs in the air, go.",
    "office1": "The veil behind edges, which depth cameras make, gets thinner.",
}
SHOWN_FROM = 0.05  # percent of the points left out: sheets with less show no difference
CREDITS = """Sources and terms of the scans: [images](../README.md). Bunny, dragon and armadillo come from the Stanford 3D Scanning
Repository, Stanford Computer Graphics Laboratory.
"""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="of scans, or parts of them; all")
    parser.add_argument("--view", action="append", help="X,Y,Z,AZIMUTH,ELEVATION,DISTANCE")
    parser.add_argument("--library", type=Path, default=ROOT / "build/out/release/libpatina.so")
    parser.add_argument("--out", type=Path, default=ROOT / "build/out/gallery")
    parser.add_argument("--manual", action="store_true")
    parser.add_argument("--trust", action="store_true", help="all points, and the default")
    options = parser.parse_args()
    os.environ["PATINA_LIBRARY"] = str(options.library.resolve())
    package()
    from patina import native

    if options.manual:
        options.out = ROOT / ".pictures/scans"
    options.out.mkdir(parents=True, exist_ok=True)
    frame = native.Frame(native.Device("cpu"))
    told = []
    for scan in SCANS:
        if options.names and not any(word in scan.name for word in options.names):
            continue
        if not (DATA / scan.file).is_file():
            print(f"skip {scan.name}: there is no {scan.file}", file=sys.stderr)
            continue
        views = tuple(tuple(float(word) for word in view.split(",")) for view in options.view or ()) or scan.views
        try:
            picture, what = (trusted if options.trust else sheet)(frame, scan, views)
        except native.PatinaError as error:  # LAZ without laspy
            print(f"skip {scan.name}: {error}", file=sys.stderr)
            continue
        name = f"trust-{scan.name}" if options.trust else scan.name
        if not (options.trust and options.manual and float(what.partition(" ")[0]) < SHOWN_FROM):
            picture.save(options.out / (f"{name}-view.png" if options.view else f"{name}.jpg"), quality=80)
        told.append((scan, what))
        print(f"{scan.name}: {what}", flush=True)
    if options.manual and not options.names:
        name, text = ("trust.md", trust_page(told)) if options.trust else ("README.md", page(told))
        (options.out / name).write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
