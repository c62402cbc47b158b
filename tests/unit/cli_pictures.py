# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures on the command line: soft points, samples, lines, panoramas, effects: tests that test_cli.py runs."""

import json
import math
import random

import cli
import effects as table


def test_pixel_samples():
    """The mean of several samples has soft outlines; what the tool says it took, and what it refuses."""
    cli.ball("soft.ply")
    cli.run("render", "soft.ply", "-o", "one.png", "--size", "64x64", "--transparent")
    told = json.loads(cli.run("render", "soft.ply", "-o", "many.png", "--size", "64x64", "--transparent", "--pixel-samples", "16",
                          "--stats", "json").stdout)
    assert told["points"], told
    one, many = ({pixel[3] for row in cli.read_png(name)[3] for pixel in row} for name in ("one.png", "many.png"))
    assert len(many) > 2 * len(one), (one, many)
    for bad in ("0", "4097", "x"):
        assert cli.run("render", "soft.ply", "-o", "no.png", "--pixel-samples", bad, code=2)


def test_soft():
    """A wall whose columns have rising numbers, left dark and of class 2, right bright and of class 6, before a green one: what is soft
    lets the green through, by every field; and the modes to compare with."""
    step = 2 / 119
    rows = ["x,y,z,red,green,blue,classification,rise"]
    rows += [f"{x * step - 1},0,{z * step - 1},{40 if x < 60 else 255},0,0,{2 if x < 60 else 6},{10 * x}" for x in range(120) for z in range(120)]
    (cli.FOLDER / "soft.csv").write_text("\n".join(rows))
    cli.wall("green.ply", lambda x, z: (0, 255, 0), y=0.5)
    view = ["--size", "64x64", "--look", "0,-3,0,0,0,0", "--unlit", "--background", "0,0,0", "-o", "soft.png"]
    style = ["--soft-opacity", "0.1", "--soft-radius", "0.03"]

    def at(*arguments):
        analysis = "on" if any("density" in word or "uncertainty" in word for word in arguments) else "off"
        cli.run("render", "soft.csv", "green.ply", *view, "--analysis", analysis, *arguments)
        rows = cli.read_png("soft.png")[3]
        return [rows[32][x] for x in (16, 48)]

    def soft(*arguments):
        return [pixel[1] > 60 for pixel in at("--soft", "express,1", *style, *arguments)]

    assert not any(pixel[1] > 60 for pixel in at()) and soft() == [True, True]
    assert soft("--soft-field", "rise") == [False, True] and soft("--soft-field", "rise,1190,0") == [True, False]
    assert soft("--soft-field", "rise,0,1190", "--soft-threshold", "0.1") == [True, True]
    assert soft("--soft-field", "rise,0,1190", "--soft-threshold", "0.95") == [False, False]
    assert soft("--soft-field", "luminance", "--soft-threshold", "0.1") == [False, True]
    assert soft("--soft-field", "class:6,7") == [False, True]
    assert soft("--soft-field", "point:-1,0,0,0,2") == [False, True]
    assert soft("--soft-field", "plane:0,0,0,2,0,0,-1,1") == [False, True]
    assert soft("--soft-field", "axis:1,0,0,0,0,1,2,0") == [False, True]
    for word in ("density", "uncertainty"):  # even points: all or none, and both pictures come
        soft("--soft-field", word)
        soft("--soft-field", f"{word},0,1e9", "--soft-threshold", "0.5")
    assert all(pixel[1] < 30 and pixel[0] > 30 for pixel in at("--soft", "sp,1", *style)), "splats are opaque"
    through = at("--soft", "olt,1", *style)
    assert all(pixel[1] > 200 > 1 < pixel[0] for pixel in through), "a layer of a tenth"
    assert "no attribute 'height'" in cli.run("render", "soft.csv", *view, "--soft", "base", "--soft-field", "height", code=1).stderr
    for bad in (["--soft", "volume"], ["--soft-field", "rise"], ["--soft", "base", "--soft-threshold", "0.5"],
                ["--soft", "base", "--soft-field", "class:x"], ["--soft", "base", "--soft-field", "plane:0,0,0"],
                ["--soft", "base", "--soft-field", "axis:0,0,0,0,0,0"], ["--soft", "base", "--soft-field", "rise,1"],
                ["--soft", "base", "--soft-field", "rise", "--soft-threshold", "2"]):
        cli.run("render", "soft.csv", *view, *bad, code=2)


def test_soft_shadows():
    """A soft ball over a floor dims it under a sun, and less than a solid one; without shadows it does not."""
    rows = [f"{x / 30 - 2},{y / 30 - 2},-1,200,200,200" for x in range(120) for y in range(120)]
    (cli.FOLDER / "floor.csv").write_text("x,y,z,red,green,blue\n" + "\n".join(rows))
    cli.ball("over.ply", count=4000)
    view = ["--size", "64x64", "--look", "0,-3,9,0,0,-1", "--lit", "--sun", "90,60", "-o", "shade.png"]

    def light(*arguments):
        cli.run("render", "floor.csv", "over.ply", *view, *arguments)
        return sum(sum(pixel[:3]) for row in cli.read_png("shade.png")[3] for pixel in row)

    style = ["--soft-opacity", "0.1", "--soft-radius", "0.1"]
    bare, soft, solid = light("--soft", "base,2", *style), light("--soft", "base,2", *style, "--shadows"), light("--shadows")
    denser = light("--soft", "base,2", "--soft-radius", "0.1", "--soft-opacity", "0.4", "--shadows")
    assert soft < 0.995 * bare and denser < soft, (bare, soft, denser, solid)
    assert "run  dim" in cli.run("render", "floor.csv", "over.ply", *view, "--soft", "base,2", "--shadows", "--dump-plan").stdout
    assert "run  dim" not in cli.run("render", "floor.csv", "over.ply", *view, "--shadows", "--dump-plan").stdout


def test_noise():
    """Samples end where the picture is as good as was asked for; the planes beside it are of one sample."""
    cli.ball("noisy.ply")
    (cli.FOLDER / "noisy").mkdir()
    taken = []
    for noise, *most in (("0.03",), ("0.01",), ("0.001", "--pixel-samples", "36")):
        told = json.loads(cli.run("render", "noisy.ply", "-o", "noisy.png", "--size", "64x64", "--transparent", "--noise", noise, *most,
                              "--dump-planes", "noisy", "--stats", "json").stdout)
        assert 0 < told["pixel_error"] <= float(noise) or told["pixel_samples"] == 36, told
        taken.append(told["pixel_samples"])
    assert 4 <= taken[0] < taken[1] <= 256 and taken[2] == 36, taken
    files = {path.name: path.stat().st_size for path in (cli.FOLDER / "noisy").iterdir()}
    assert files["DEPTH_0.raw"] == 64 * 64 * 4 and "KEYS_0.raw" in files, files
    assert "FROM_0.raw" not in files, files  # it would be of the last of the finer pictures
    for bad in ("0", "1.5", "x"):
        assert cli.run("render", "noisy.ply", "-o", "no.png", "--noise", bad, code=2)


def test_average():
    """Of many points a pixel, in colours at random, the mean shows: grey, where one of them would be as colourful as it is."""
    dice = random.Random(3)
    rows = [(dice.uniform(-1, 1), dice.uniform(-1, 1), 0.0, *(255 * dice.randrange(2) for _ in range(3))) for _ in range(20000)]
    with open(cli.FOLDER / "dice.ply", "w") as file:
        file.write("ply\nformat ascii 1.0\nelement vertex 20000\nproperty float x\nproperty float y\nproperty float z\n"
                   "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n")
        file.writelines(" ".join(map(str, row)) + "\n" for row in rows)
    spread = []
    for more in ((), ("--average",)):
        cli.run("render", "dice.ply", "-o", "dice.png", "--size", "40x40", "--look", "0,0,5,0,0,0,30", "--unlit", *more)
        values = [value for row in cli.read_png("dice.png")[3][10:30] for pixel in row[10:30] for value in pixel]
        middle = sum(values) / len(values)
        spread.append((sum((value - middle) ** 2 for value in values) / len(values)) ** 0.5)
    assert spread[1] < 0.5 * spread[0], spread
    plan = cli.run("render", "dice.ply", "-o", "dice.png", "--size", "40x40", "--average", "--dump-plan")
    assert "run  average" in plan.stdout + plan.stderr, plan


def test_default_picture():
    cli.ball("default.ply")
    assert "default.png" in cli.run("render", "default.ply", "-o", "default.png").stderr
    width, height, channels, rows = cli.read_png("default.png")
    assert (width, height, channels) == (1024, 1024, 3)
    assert rows[0][0] == (63, 63, 63)  # linear 0.05
    covered = sum(pixel != (63, 63, 63) for row in rows for pixel in row) / (width * height)
    assert 0.2 < covered < 0.9, covered  # framed
    middle = rows[512][512]
    assert max(middle) > 100, middle  # lit


def test_colors_are_kept_and_rows_are_upright():
    cli.wall("wall.ply", lambda x, z: (200, 30, 60) if z > 0 else (10, 120, 255))
    cli.run("render", "wall.ply", "-o", "wall.png", *cli.FRONT, "--smooth", "off")
    width, height, channels, rows = cli.read_png("wall.png")
    assert (width, height, channels) == (64, 64, 3)
    assert rows[20][32] == (200, 30, 60) and rows[43][32] == (10, 120, 255), (rows[20][32], rows[43][32])
    cli.run("render", "wall.ply", "-o", "lit.png", *cli.FRONT, "--smooth", "off", "--lit")
    assert cli.read_png("lit.png")[3][20][32] != (200, 30, 60)


def test_headlight():
    """A wall is brightest where it faces the camera, wherever that is."""
    cli.wall("head.ply", lambda x, z: (128, 128, 128))
    seen = {}
    for turn in (0, 60, -60):
        x, y = 6 * math.sin(math.radians(turn)), -6 * math.cos(math.radians(turn))
        cli.run("render", "head.ply", "-o", "head.png", "--look", f"{x},{y},0,0,0,0,30", "--size", "64x64", "--smooth", "off", "--lit",
            "--headlight", "--background", "0,0,0")
        seen[turn] = cli.read_png("head.png")[3][32][32][0]
    assert abs(seen[0] - 125) <= 2 and abs(seen[60] - 91) <= 3 and abs(seen[60] - seen[-60]) <= 1, seen
    cli.run("render", "head.ply", "-o", "x.png", "--headlight", "--shadows", code=2)


def test_largest_gap():
    cli.wall("gap.ply", lambda x, z: (200, 30, 60), count=12)
    for name, options in (("wide", ("--radius", "0.2")), ("narrow", ("--radius", "0.05")),
                          ("limited", ("--radius", "0.2", "--largest-gap", "0.1"))):
        cli.run("render", "gap.ply", "-o", f"{name}.png", *cli.FRONT, "--surface", "splats", *options)
    assert cli.read_png("limited.png") == cli.read_png("narrow.png") != cli.read_png("wide.png")


def test_transparent_film_is_not_premultiplied():
    cli.wall("film.ply", lambda x, z: (200, 100, 50))
    cli.run("render", "film.ply", "-o", "film.png", *cli.FRONT, "--transparent")
    _, _, channels, rows = cli.read_png("film.png")
    assert channels == 4 and rows[0][0][3] == 0 and rows[32][32] == (200, 100, 50, 255)
    partial = [pixel for row in rows for pixel in row if 0 < pixel[3] < 255]
    for pixel in partial:  # an edge is as orange as the middle
        assert all(abs(a - b) <= 3 for a, b in zip(pixel, (200, 100, 50))), pixel


def test_opacity_of_each_file():
    cli.wall("glass.ply", lambda x, z: (200, 100, 50))
    cli.wall("behind.ply", lambda x, z: (10, 120, 255), y=2.0)
    view = (*cli.FRONT, "--transparent")
    seen = {}
    for opacity, alpha in (("0.5,1", 255), ("0.5", 191), ("0,1", 255), ("1,0.3", 255)):
        cli.run("render", "glass.ply", "behind.ply", "-o", "glass.png", *view, "--opacity", opacity)
        pixel = cli.read_png("glass.png")[3][32][32]
        assert abs(pixel[3] - alpha) <= 1, (opacity, pixel)
        seen[opacity] = pixel[:3]
    assert seen["0,1"] == (10, 120, 255) and seen["1,0.3"] == (200, 100, 50), seen
    assert seen["0.5,1"] not in (seen["0,1"], seen["1,0.3"])
    cli.run("render", "glass.ply", "behind.ply", "-o", "glass.png", *view, "--opacity", "0.5,1", "--layers", "1")
    assert abs(cli.read_png("glass.png")[3][32][32][3] - 128) <= 1
    stats = json.loads(cli.run("render", "glass.ply", "behind.ply", *view, "--opacity", "0.5,1", "--stats", "json").stdout)
    assert stats["layers"] == 2, stats


def test_lines():
    cli.wall("red.ply", lambda x, z: (255, 0, 0))
    shown = {}
    for name, options in (("plain", []), ("black", ["--lines", "4"]), ("half", ["--lines", "4,0,0.5"]),
                          ("alone", ["--lines", "4", "--line-surface", "none"]),
                          ("blue", ["--lines", "4,0,1", "--line-color", "0,0,1", "--line-surface", "paper"])):
        cli.run("render", "red.ply", "-o", "lines.png", *cli.FRONT, "--ortho", "4", "--transparent", *options)
        shown[name] = cli.read_png("lines.png")[3]
    row = len(shown["plain"]) // 2
    edge = next(x for x, pixel in enumerate(shown["plain"][row]) if pixel[3] == 255)  # the wall's left side
    at = {name: (rows[row][edge - 3], rows[row][row]) for name, rows in shown.items()}
    assert at["plain"][0][3] == 0 and at["plain"][1] == (255, 0, 0, 255), at
    assert at["black"] == ((0, 0, 0, 255), (255, 0, 0, 255)), at
    assert abs(at["half"][0][3] - 128) <= 1 and at["half"][1] == (255, 0, 0, 255), at
    assert at["alone"][0] == (0, 0, 0, 255) and at["alone"][1][3] == 0, at
    assert at["blue"] == ((0, 0, 255, 255), (255, 255, 255, 255)), at


def test_a_mesh_hides_and_is_hidden():
    cli.wall("behind.ply", lambda x, z: (0, 255, 0), y=1.0)
    cli.wall("before.ply", lambda x, z: (0, 0, 255), y=-1.0)
    (cli.FOLDER / "square.obj").write_text("v -0.5 0 -0.5\nv 0.5 0 -0.5\nv 0.5 0 0.5\nv -0.5 0 0.5\nvn 0 1 0\nf 1//1 2//1 3//1 -1//1\n")
    view = ("--size", "64x64", "--ortho", "4", "--look", "0,-5,0,0,0,0")
    for cloud, middle in (("behind.ply", "mesh"), ("before.ply", "points")):
        cli.run("render", cloud, "--mesh", "square.obj", "-o", "mesh.png", *view)
        rows = cli.read_png("mesh.png")[3]
        r, g, b = rows[32][32]
        assert (max(r, g, b) - min(r, g, b) <= 1 and r > 20) if middle == "mesh" else (r, g, b) == (0, 0, 255), (cloud, rows[32][32])
        assert rows[32][20] == ((0, 255, 0) if middle == "mesh" else (0, 0, 255)), (cloud, rows[32][20])
    cli.run("render", "--mesh", "square.obj", "-o", "mesh.png", *view)  # no points at all
    (cli.FOLDER / "bad.obj").write_text("v 0 0 0\nf 1 2 3\n")
    assert "line 2" in cli.run("render", "--mesh", "bad.obj", "-o", "mesh.png", code=1).stderr


def test_background():
    cli.ball("background.ply", 500)
    cli.run("render", "background.ply", "-o", "background.png", "--size", "32x32", "--background", "1,0.2140411,0")
    assert cli.read_png("background.png")[3][0][0] == (255, 127, 0)
    lit = [cli.read_png("background.png")[3][16][16]]
    cli.run("render", "background.ply", "-o", "background.png", "--size", "32x32", "--background", "1,0.2140411,0", "--ambient",
        "0,0,0.5", "--lit")
    assert cli.read_png("background.png")[3][0][0] == (255, 127, 0)
    lit.append(cli.read_png("background.png")[3][16][16])
    assert lit[1][2] > lit[0][2] + 50, lit  # blue light in front of an orange background


def test_ortho_width():
    cli.wall("ortho.ply", lambda x, z: (255, 255, 255))
    cli.run("render", "ortho.ply", "-o", "ortho.png", "--look", "0,-6,0,0,0,0", "--ortho", "4", "--size", "80x40",
        "--background", "0,0,0", "--antialias", "off")
    rows = cli.read_png("ortho.png")[3]
    wide = sum(pixel == (255, 255, 255) for pixel in rows[20])
    assert abs(wide - 40) <= 2, wide  # 2 of 4 units in 80 pixels
    assert all(pixel == (255, 255, 255) for pixel in rows[0][30:50])  # 2 units high


def test_panorama():
    """Points ahead (north), to the right, behind and above of an eye stand where a compass says."""
    size = ("--panorama", "128x64", "--eye", "5,6,7", "--antialias", "off", "--fill", "off", "--smooth", "off")
    for place, (x, y) in (((5, 9, 7), (64, 32)), ((8, 6, 7), (96, 32)), ((5, 3, 7), (0, 32)), ((5, 9, 10), (64, 16))):
        cli.write_ply("around.ply", [place] * 4, [(255, 0, 0)] * 4)
        cli.run("render", "around.ply", "-o", "around.png", *size)
        rows = cli.read_png("around.png")[3]
        assert len(rows) == 64 and len(rows[0]) == 128
        red = [(column, row) for row, pixels in enumerate(rows) for column, pixel in enumerate(pixels) if pixel[0] > pixel[1] + 40]
        assert red and all(abs((column - x + 64) % 128 - 64) <= 1 and abs(row - y) <= 1 for column, row in red), (place, red)
    cli.run("render", "around.ply", "-o", "part.png", *size, "--region", "60,40,70,50")
    assert cli.read_png("part.png")[3] == [row[60:70] for row in rows[64 - 50:64 - 40]]


def test_look_turns_with_its_target():
    cli.write_ply("point.ply", [(3, 1, 2)] * 4, [(255, 0, 0)] * 4)
    for look in ("0,0,0,3,1,2", "3,1,9,3,1,2", "3,1,-9,3,1,2"):
        cli.run("render", "point.ply", "-o", "point.png", "--look", look, "--size", "33x33", "--antialias", "off")
        rows = cli.read_png("point.png")[3]
        red = [(x, y) for y, row in enumerate(rows) for x, pixel in enumerate(row) if pixel[0] > 200]
        assert red and all(abs(x - 16) <= 1 and abs(y - 16) <= 1 for x, y in red), (look, red)


def test_region_is_a_crop():
    cli.ball("region.ply")
    view = ("--size", "90x70", "--camera", "20,30")
    cli.run("render", "region.ply", "-o", "whole.png", *view)
    cli.run("render", "region.ply", "-o", "part.png", *view, "--region", "31,12,66,57")
    whole, part = cli.read_png("whole.png"), cli.read_png("part.png")
    assert part[:2] == (35, 45)
    assert part[3] == [row[31:66] for row in whole[3][70 - 57:70 - 12]]


def test_choices_change_the_picture():
    cli.ball("choices.ply", 3000)
    seen = {}
    base = ("render", "choices.ply", "-o", "choice.png", "--size", "200x200")
    for choice in ((), ("--quality", "paper"), ("--fill", "off"), ("--fill", "paper"), ("--smooth", "off"),
                   ("--smooth", "box"), ("--antialias", "off"), ("--unlit",), ("--camera", "80,10"),
                   ("--camera", "30,40,20"), ("--ortho", "3"), ("--fill", "paper", "--iterations", "3")):
        cli.run(*base, *choice)
        picture = (cli.FOLDER / "choice.png").read_bytes()
        assert picture not in seen, (choice, seen[picture])
        seen[picture] = choice


def test_effects():
    """Each effect changes the picture in its own way; a region is a crop with all of them; what cannot be is refused."""
    cli.ball("effects.ply", 3000)
    base = ("render", "effects.ply", "-o", "effect.png", "--size", "120x100", "--lit")
    effects = (("--edl", "1"), ("--edl", "1,4"), ("--obscurance", "2,0.5"), ("--toon", "3,0.2"), ("--hatch", "2"),
               ("--hatch", "1,8,0.5,1,0.2,0,0"), ("--fog", "1,6"), ("--fog", "1,6,0.5,0.9,0.1,0.1"), ("--focus", "2,0.3"),
               ("--paper", "0.4"), ("--paper", "0.1,0.9,0.8,0.6"))
    seen = {}
    for effect in table.own():  # those that no choice shows: as Blender begins them
        if not any(choice[0] == f"--{effect['name']}" for choice in effects):
            begun = {field["name"]: field["start"] for field in effect["fields"] if "start" in field}
            effects += tuple(word for name, value in begun.items() for word in
                             ("--effect", f"{name}={','.join(map(str, value)) if isinstance(value, tuple) else value}")),
    assert any("contour_width=1" in choice for choice in effects)
    for choice in ((), *effects):
        cli.run(*base, *choice)
        picture = (cli.FOLDER / "effect.png").read_bytes()
        assert picture not in seen, (choice, seen[picture])
        seen[picture] = choice
    cli.run(*base, "--effect", "hatch_levels=1", "--effect", "hatch_spacing=8", "--effect", "hatch_opacity=0.5", "--effect",
        "hatch_ground=1", "--effect", "hatch_color=0.2,0,0")
    assert seen[(cli.FOLDER / "effect.png").read_bytes()] == ("--hatch", "1,8,0.5,1,0.2,0,0"), "by their names fields are others"
    help_text = cli.run("help", "effects").stdout
    for option in ("--edl STRENGTH[,RADIUS] ", "--hatch LEVELS[,SPACING,OPACITY,GROUND,R,G,B] ", "--fog START,END[,DENSITY,R,G,B] ",
                   "--focus DISTANCE,APERTURE ", "--paper GRAIN[,R,G,B] "):
        assert option in help_text, option
    every = [word for choice in effects[::2] for word in choice]
    cli.run(*base, *every)
    whole = cli.read_png("effect.png")
    cli.run(*base, *every, "--region", "30,20,77,63")
    assert cli.read_png("effect.png")[3] == [row[30:77] for row in whole[3][100 - 63:100 - 20]]
    for option, value, code in (("--edl", "1,2,3", 2), ("--toon", "2.5", 2), ("--fog", "3", 2), ("--focus", "2", 2),
                                ("--paper", "0.1,1", 2), ("--edl", "-1", 1), ("--toon", "1", 1), ("--fog", "5,5", 1),
                                ("--hatch", "4", 1), ("--focus", "0,1", 1), ("--hatch", "2,6,1,0,0.5", 2), ("--fog", "1,6,1,0,0", 2),
                                ("--effect", "hatch", 2), ("--effect", "hatch_levels=1.5", 2), ("--effect", "none=1", 2),
                                ("--effect", "fog_color=1", 2), ("--effect", "toon_bands=17", 1)):
        said = cli.run("render", "effects.ply", "-o", "y.png", option, value, code=code).stderr
        assert said.startswith("patina: ") and not (cli.FOLDER / "y.png").exists(), (option, value, said)


def test_several_files():
    cli.wall("left.ply", lambda x, z: (255, 0, 0))
    right = [(0.5 + x * 0.01, -1, z * 0.01) for x in range(40) for z in range(-20, 20)]
    cli.write_ply("right.ply", right, [(0, 255, 0)] * len(right))
    done = cli.run("render", "left.ply", "right.ply", "-o", "both.png", *cli.FRONT)
    assert str(120 * 120 + 1600) in done.stderr
    colors = {pixel for row in cli.read_png("both.png")[3] for pixel in row}
    assert (255, 0, 0) in colors and (0, 255, 0) in colors


def test_empty_cloud_is_background():
    cli.write_ply("void.ply", [])
    assert "warning: void.ply holds no points" in cli.run("render", "void.ply", "-o", "void.png", "--size", "16x16").stderr
    assert {pixel for row in cli.read_png("void.png")[3] for pixel in row} == {(63, 63, 63)}


def test_threads_batches_and_levels_agree():
    cli.ball("same.ply", 50000)
    base = ("render", "same.ply", "-o", "same.png", "--size", "301x203")
    cli.run(*base, "--device", "cpu", "--threads", "1")
    first = (cli.FOLDER / "same.png").read_bytes()
    for choice in (("--threads", "2"), ("--threads", "7"), ("--batch", "1"), ("--threads", "3", "--batch", "13"),
                   ("--device", "cpu-scalar")):
        cli.run(*base, *(() if "--device" in choice else ("--device", "cpu")), *choice)
        assert (cli.FOLDER / "same.png").read_bytes() == first, choice
