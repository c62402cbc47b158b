# SPDX-License-Identifier: GPL-3.0-or-later
"""Styles of survey drawings: tests that test_cli.py runs. What images show is computed from the add-on's files of styles."""

import json
import math
from pathlib import Path

import cli
import cli_rasters

PRESETS = Path(__file__).resolve().parents[2] / "addon/presets/styles"
FILES = {"watercolor": "watercolour"}
STYLES = ("plaster", "technical", "ink", "blueprint", "museum", "watercolor", "night", "xray")


def preset(name):
    return json.loads((PRESETS / f"{FILES.get(name, name)}.json").read_text(encoding="utf-8"))


def linear(color):
    values = [int(color[i:i + 2], 16) / 255 for i in (1, 3, 5)]
    return [value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4 for value in values]


def encoded(color):
    return [255 * min(1, 12.92 * value if value <= 0.0031308 else 1.055 * value ** (1 / 2.4) - 0.055) for value in color]


def lit(found):
    """What a gray wall shows that faces the viewer, by Studio Light: two suns and ambient light."""
    scene = found["scene"]
    azimuth, height, strength = (scene.get(f"studio.{name}", default) for name, default in (("azimuth", -45), ("height", 45), ("strength", 3)))
    suns = ((azimuth, height, strength), (azimuth + 120, abs(height) / 3, strength * scene.get("studio.fill", 0.25)))
    light = sum(power / math.pi * max(0, math.cos(math.radians(a)) * math.cos(math.radians(h))) for a, h, power in suns)
    lamp, ambient = linear(scene.get("studio.color", "#ffffff")), linear(scene["studio.ambient"])
    own = linear(found["points"]["color"]) if "color" in found["points"] else [0.8] * 3
    return [own[k] * (light * lamp[k] + ambient[k]) for k in range(3)]


def grained(found, color):
    """Paper whose grain is even between 1 and 1 - grain is darker by half of that."""
    return [value * (1 - found["scene"].get("effects.paper_grain", 0) / 2) for value in color]


def near(color, wanted, most=2):
    return all(abs(a - b) <= most for a, b in zip(color, wanted, strict=False))


def mean(rows, ys, xs):
    pixels = [rows[y][x] for y in ys for x in xs]
    return [sum(pixel[k] for pixel in pixels) / len(pixels) for k in range(3)]


def wall():
    """2 m x 2 m without colors, of 80 x 80 pixels in the middle of an image of 120 x 120."""
    step = 2 / 119
    cli.write_ply("wall.ply", [(x * step - 1, 0, z * step - 1) for x in range(120) for z in range(120)], normals=[(0, -1, 0)] * 14400)


def test_draw_styles():
    wall()
    jobs = [{"plane": "elevation:0", "extent": [3, 3], "pixel": 0.025, "style": name, "output": f"{name}.png"} for name in ("scan", *STYLES)]
    (cli.FOLDER / "styles.json").write_text(json.dumps(jobs), encoding="utf-8")
    cli.run("draw", "wall.ply", "--batch=styles.json")
    cli.run("draw", "wall.ply", "--plane=elevation:0", "--extent=3,3", "--pixel=0.025", "-o", "plain.png")
    assert (cli.FOLDER / "scan.png").read_bytes() == (cli.FOLDER / "plain.png").read_bytes()
    images = {name: cli.read_png(f"{name}.png")[3] for name in STYLES}
    shown = {name: mean(rows, range(50, 70), range(50, 70)) for name, rows in images.items()}
    for name, rows in images.items():
        found = preset(name)
        tint = linear(found["scene"].get("effects.paper_color", "#ffffff"))
        background = encoded(grained(found, [a * b for a, b in zip(linear(found["scene"]["studio.background"]), tint, strict=True)]))
        assert all(row[x][3] == 255 for row in rows for x in range(120)), name
        assert near(mean(rows, range(12), range(120)), background), (name, mean(rows, range(12), range(120)), background)
    for name in ("plaster", "museum", "blueprint"):
        wanted = encoded(grained(preset(name), lit(preset(name))))
        assert near(shown[name], wanted), (name, shown[name], wanted)
    assert near(shown["technical"], encoded(linear(preset("technical")["points"]["color"]))), shown["technical"]
    share, behind = preset("xray")["points"]["opacity"], linear(preset("xray")["scene"]["studio.background"])
    through = [share * a + (1 - share) * b for a, b in zip(lit(preset("xray")), behind, strict=True)]
    assert near(shown["xray"], encoded(through)), (shown["xray"], encoded(through))
    low, high = images["night"][97][60], images["night"][22][60]  # viridis: violet below, yellow above
    assert low[2] > low[1] and high[0] > high[2] and high[1] > high[2] + 60, (low, high)
    strokes = [row[x] for row in images["ink"][30:90] for x in range(30, 90)]
    assert sum(pixel[0] > 240 for pixel in strokes) > 300 and min(pixel[0] for pixel in strokes) < 120, "pen strokes on white"
    for name, dark in (("ink", True), ("technical", True), ("blueprint", False)):  # lines around the wall, outside of it
        line = [images[name][60][x][0] for x in range(14, 21)]
        assert min(line) < 40 if dark else max(line) > 200, (name, line)


def test_draw_styles_keep_distances():
    """Depth maps, masks and outlines are the same in each style, though lines and transparent surfaces have depths of their own."""
    cli_rasters.board("board.ply", (1, 0, 0), (0, 0, 1), away=0.1)
    for name in ("scan", "ink", "xray"):
        cli.run("draw", "board.ply", "--plane=elevation:0", "--pixel=0.01", "--depth-map", "--mask", "--outlines", f"--style={name}",
                "-o", f"{name}.tif", "-o", f"{name}.svg")
    for ending in ("-depth.tif", "-mask.tif", ".svg", ".json"):
        plain = (cli.FOLDER / f"scan{ending}").read_bytes()
        assert plain and all((cli.FOLDER / f"{name}{ending}").read_bytes() == plain for name in ("ink", "xray")), ending
    assert b'id="outline"' in (cli.FOLDER / "scan.svg").read_bytes()
    assert len({(cli.FOLDER / f"{name}.tif").read_bytes() for name in ("scan", "ink", "xray")}) == 3


def test_draw_unknown_style():
    wall()
    for name in ("trust", "", "xray_walls"):
        done = cli.run("draw", "wall.ply", "--plane=elevation:0", "--style", name, "-o", "a.png", code=2)
        assert f"'{name}' is no value for option '--style': see 'patina help --style'" in done.stderr, done.stderr
    named = cli.run("help", "--style").stdout.replace(",", " ").split()
    assert all(name in named for name in ("scan", *STYLES)), named
