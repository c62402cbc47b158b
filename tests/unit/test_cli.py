#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line, from outside: test_cli.py PATH_OF_PATINA [NAME of a test ...]. Needs Python's own library only. Before the path there may be what
runs a program of another system: test_cli.py "wine build/out/windows-x64/patina.exe"."""
import json
import math
import os
import random
import re
import shlex
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import traceback
import zlib
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.append(str(Path(__file__).resolve().parents[2] / "build"))
import effects as table  # noqa: E402

_given = sys.argv[1] if len(sys.argv) > 1 else "build/out/release/patina"
*RUNNER, _PROGRAM = [_given] if Path(_given).exists() else shlex.split(_given)  # `wine patina.exe`
PATINA = [*RUNNER, str(Path(_PROGRAM).resolve())]
FOLDER = Path()  # a temporary one, set by main


def run(*arguments, code=0):
    done = subprocess.run([*PATINA, *map(str, arguments)], capture_output=True, text=True, cwd=FOLDER, timeout=300)
    assert done.returncode == code, f"{arguments}: exit {done.returncode}, expected {code}: {done.stderr}{done.stdout}"
    return done


def read_png(path):
    """(width, height, channels, rows from the top); 8-bit, not interlaced."""
    data = (FOLDER / path).read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, packed = 8, b""
    while at < len(data):
        (size,), kind = struct.unpack(">I", data[at:at + 4]), data[at + 4:at + 8]
        body = data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, depth, color = struct.unpack(">IIBB", body[:10])
        elif kind == b"IDAT":
            packed += body
        at += size + 12
    assert depth == 8 and color in (2, 6)
    channels = 3 if color == 2 else 4
    raw, stride, rows, above = zlib.decompress(packed), width * channels, [], bytes(width * channels)
    for y in range(height):
        kind, row = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        if kind == 1:
            for x in range(channels, stride):
                row[x] = (row[x] + row[x - channels]) & 255
        elif kind == 2:
            row = bytearray((value + b) & 255 for value, b in zip(row, above, strict=True))
        elif kind:
            for x in range(stride):
                a = row[x - channels] if x >= channels else 0
                b, c = above[x], above[x - channels] if x >= channels else 0
                p = a + b - c
                nearest = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
                row[x] = (row[x] + ((a + b) // 2 if kind == 3 else nearest)) & 255
        rows.append([tuple(row[x:x + channels]) for x in range(0, stride, channels)])
        above = row
    return width, height, channels, rows


def write_ply(name, points, colors=None, normals=None, kind="float"):
    with open(FOLDER / name, "w", encoding="ascii") as file:
        file.write(f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n")
        file.write("".join(f"property {kind} {axis}\n" for axis in "xyz"))
        if normals:
            file.write("".join(f"property float n{axis}\n" for axis in "xyz"))
        if colors:
            file.write("".join(f"property uchar {channel}\n" for channel in ("red", "green", "blue")))
        file.write("end_header\n")
        for i, point in enumerate(points):
            row = [*point, *(normals[i] if normals else ()), *(colors[i] if colors else ())]
            file.write(" ".join(map(str, row)) + "\n")
    return name


def wall(name, color, count=120, y=0.0):
    """A square of 2 x 2 in the plane y, upright, `color(x, z)`."""
    step = 2 / (count - 1)
    points = [(x * step - 1, y, z * step - 1) for x in range(count) for z in range(count)]
    return write_ply(name, points, [color(x, z) for x, _, z in points], [(0, -1, 0)] * len(points))


def ball(name, count=20000, origin=(0, 0, 0), kind="float", colors=None):
    points, normals = [], []
    for i in range(count):
        z, angle = 1 - (2 * i + 1) / count, i * math.pi * (3 - math.sqrt(5))
        r = math.sqrt(1 - z * z)
        normal = (r * math.cos(angle), r * math.sin(angle), z)
        normals.append(tuple(round(v, 6) for v in normal))
        points.append(tuple(v + o for v, o in zip(normal, origin)))
    return write_ply(name, points, colors, normals, kind)


FRONT = ("--look", "0,-6,0,0,0,0,30", "--size", "64x64")


# ---- analysis --------------------------------------------------------------------------------------------------------

def test_analyse_writes_columns():
    ball("analyse.ply", 3000, origin=(1000, 0, 0))
    done = run("analyse", "analyse.ply", "-o", "known.ply", "--neighbours", "12")
    counts = dict(line.split() for line in done.stdout.splitlines())
    assert int(counts["surface"]) > 2900, counts
    header, rows = (FOLDER / "known.ply").read_bytes().split(b"end_header\n")
    names = [line.split()[-1].decode() for line in header.splitlines() if line.startswith(b"property")]
    assert names == ["x", "y", "z", "nx", "ny", "nz", "spacing", "radius", "radius_minor", "sigma", "trust", "kind",
                     "seen_through"], names
    assert b"element vertex 3000" in header and len(rows) % 3000 == 0
    assert "points      3000" in run("info", "known.ply").stdout
    assert 0 <= int(counts["untrusted"]) < 10, counts
    run("analyse", "analyse.ply", "-o", "trusted.ply", "--neighbours", "12", "--trusted")
    assert f"points      {3000 - int(counts['untrusted'])}" in run("info", "trusted.ply").stdout
    for arguments in (["analyse"], ["analyse", "analyse.ply"], ["analyse", "analyse.ply", "-o", "x.ply", "--neighbours", "99"]):
        run(*arguments, code=2)


def test_analysis_is_timed_and_can_be_left_out():
    ball("timed.ply", 5000)
    on, off = (json.loads(run("render", "timed.ply", *FRONT, "--stats", "json", "--analysis", word).stdout) for word in ("on", "off"))
    assert on["analysis_ms"] > 0 and off["analysis_ms"] == 0


def two_stations(path):
    """A wall seen from two places, and a stray of the first before it. PTX."""
    lines = []
    for number, (sx, sy) in enumerate(((-0.8, 0.0), (0.8, 0.0))):
        columns, rows = 60, 40
        lines += [columns, rows, f"{sx} {sy} 0", "1 0 0", "0 1 0", "0 0 1", "1 0 0 0", "0 1 0 0", "0 0 1 0", f"{sx} {sy} 0 1"]
        for column in range(columns):
            for row in range(rows):
                a, e = math.radians(60 + column), math.radians(row - 20)
                x, y, z = 6 / math.tan(a), 6.0, 6 / math.sin(a) * math.tan(e)
                if number == 0 and column == 30 and row == 20:
                    x, y, z = 0.0, 4.0, 0.0
                lines.append(f"{x:.5f} {y:.5f} {z:.5f} 0.5 200 200 200")
    (FOLDER / path).write_text("\n".join(str(line) for line in lines) + "\n")


def test_free_space():
    two_stations("stations.ptx")
    counts = dict(line.split() for line in run("analyse", "stations.ptx", "-o", "seen.ply").stdout.splitlines())
    assert int(counts["seen_through"]) == 1, counts

    def at(*arguments):
        run("render", "stations.ptx", "-o", "seen.png", "--size", "64x64", "--look", "-0.8,0,0,-0.8,3,0,40", "--fill", "off", "--smooth",
            "off", "--antialias", "off", "--trust", "0", *arguments)  # the stray shows
        return [pixel[:3] for row in read_png("seen.png")[3] for pixel in row]

    off, shown, used = (at("--free-space", word) for word in ("off", "show", "use"))
    assert off != shown != used != off
    assert sum(pixel[0] > 200 and pixel[1] < 60 for pixel in shown) == 1 and not sum(pixel[1] < 60 < pixel[0] for pixel in used)
    assert at("--hide-kinds", "surface,border") != off and at("--trust", "1") != off
    ball("alone.ply", 1000)
    assert "stations" in run("render", "alone.ply", *FRONT, "-o", "x.png", "--free-space", "use", code=1).stderr
    for arguments in (["--free-space", "maybe"], ["--hide-kinds", "surface,cheese"], ["--hide-kinds", "stray"], ["--hide-kinds", ""], ["--trust", "2"],
                      ["--free-space", "use", "--analysis", "off"]):
        run("render", "alone.ply", *FRONT, "-o", "x.png", *arguments, code=2)


def test_passes():
    """A pass takes the colours' place where something is; the background stays."""
    two_stations("stations.ptx")
    view = ("--size", "96x64", "--look", "-0.8,0,0,-0.8,3,0,40", "--smooth", "off", "--antialias", "off")

    def at(*arguments):
        done = run("render", "stations.ptx", "-o", "pass.png", *view, *arguments)
        return done.stderr, [pixel for row in read_png("pass.png")[3] for pixel in row]

    _, color = at("--transparent")
    pictures = {}
    for name in ("depth", "normal", "source", "trust", "thickness"):
        said, pictures[name] = at("--transparent", "--pass", name)
        assert ("from" in said) == (name != "normal"), said
        assert [p[3] == 0 for p in pictures[name]] == [p[3] == 0 for p in color] and any(p[3] for p in color)
    assert "from 0 to 1" in at("--pass", "trust")[0]
    shown = [k for k, p in enumerate(color) if p[3]]
    assert len({tuple(pictures[name][k] for k in shown) for name in pictures}) == len(pictures)
    facing = sum(pictures["normal"][k][:3] == (128, 0, 128) for k in shown)  # a wall across y
    assert facing > len(shown) // 2, (facing, len(shown))
    narrow = at("--pass", "trust,0,0.01", "--ramp-colors", "grey")[1]
    assert sum(narrow[k] == (255, 255, 255) for k in shown) > len(shown) // 2
    for arguments in (["--pass", "cheese"], ["--pass", "trust,1,0"], ["--pass", "normal,0,1"], ["--pass", "trust,1"],
                      ["--pass", "thickness", "--analysis", "off"]):
        run("render", "stations.ptx", "-o", "x.png", *arguments, code=2)
    run("render", "stations.ptx", "--pass", "depth", "--repeat", "1", code=2)


# ---- wrong use -----------------------------------------------------------------------------------------------------

def test_help_and_version():
    assert "patina render" in run("help").stdout
    assert run("--help").stdout == run("help").stdout
    assert "patina render" in run(code=2).stderr


def test_help_has_topics():
    """Each topic fits on a screen, the topics hold every option that the sources parse, and an option leads to its topic."""
    overview, everything = run("help").stdout, run("help", "all").stdout
    topics = re.findall(r"^  ([a-z]+) ", overview, re.M)
    assert len(topics) > 8, topics
    pages = {topic: run("help", topic).stdout for topic in topics}
    for topic, page in pages.items():
        assert 1 < len(page.splitlines()) <= 40 and page.startswith(f"{topic}: ") and page in everything, topic
    native = Path(__file__).resolve().parents[2] / "native"
    sources = [*native.glob("tools/*.c"), native / "include/patina/effects.def"]
    parsed = {name for path in sources for name in re.findall(r'"(--[a-z][a-z-]+)"', path.read_text(encoding="utf-8"))}
    assert len(parsed) > 80, parsed
    for name in parsed - {"--help", "--version"}:
        assert name in overview.split(), name
        shown = run("help", name).stdout
        found = [page for page in pages.values() if page in shown]
        assert found and all(re.search(rf"^  [^\n]{{0,34}}{name}(,| |$)", page, re.M) for page in found), (name, shown)
    assert run("help", "paint", code=2).stderr.startswith("patina: help: 'paint' is neither")


def test_values_behind_equals():
    ball("equals.ply", 500)
    run("render", "equals.ply", "-o", "apart.png", "--size", "40x30", "--sun", "-30,20", "--lit", "--effect", "edl_strength=1")
    run("render", "equals.ply", "--output=joined.png", "--size=40x30", "--sun=-30,20", "--lit", "--effect=edl_strength=1")
    assert (FOLDER / "apart.png").read_bytes() == (FOLDER / "joined.png").read_bytes()
    shutil.copy(FOLDER / "equals.ply", FOLDER / "--odd=name.ply")
    run("render", "-o", "odd.png", "--size=40x30", "--", "--odd=name.ply")
    run("analyse", "equals.ply", "-o", "equals-out.ply", "--neighbours=8")
    for arguments, said in ((["--lit=yes"], "'--lit' takes no value"), (["--size="], "'' is no value for option '--size'"),
                            (["--nonsense=1"], "there is no option '--nonsense'")):
        done = run("render", "equals.ply", "-o", "x.png", *arguments, code=2)
        assert said in done.stderr, done.stderr
    assert "'--grid' takes no value" in run("analyse", "equals.ply", "-o", "y.ply", "--grid=1", code=2).stderr
    assert not (FOLDER / "x.png").exists() and not (FOLDER / "y.ply").exists()


def test_version_is_of_the_sources():
    """Builds of one day are told apart, and the sources alone say how."""
    with tempfile.TemporaryDirectory() as folder:
        stamped = Path(folder) / "version.c"
        subprocess.run([sys.executable, Path(__file__).resolve().parents[2] / "build/stamp", stamped], check=True)
        version = re.search(r'pt_version\[\] = "(\d+\.\d+\.\d+\+[0-9a-f]{12})"', stamped.read_text(encoding="utf-8")).group(1)
    assert run("version").stdout == f"patina {version}\n", version


def test_wrong_use_is_told():
    ball("use.ply", 100)
    for arguments in (["paint"], ["info"], ["info", "a", "b"], ["convert", "a"], ["render"], ["render", "use.ply"],
                      ["render", "use.ply", "-o"], ["render", "use.ply", "-o", "x.png", "--nonsense"],
                      ["render", "use.ply", "-o", "x.png", "--size", "10"],
                      ["render", "use.ply", "-o", "x.png", "--size", "0x5"],
                      ["render", "use.ply", "-o", "x.png", "--size", "10x10y"],
                      ["render", "use.ply", "-o", "x.png", "--size", "-1x10"],
                      ["render", "use.ply", "-o", "x.png", "--quality", "best"],
                      ["render", "use.ply", "-o", "x.png", "--fill", "close"],
                      ["render", "use.ply", "-o", "x.png", "--camera", "10"],
                      ["render", "use.ply", "-o", "x.png", "--camera", "10,95"],
                      ["render", "use.ply", "-o", "x.png", "--camera", "10,nan"],
                      ["render", "use.ply", "-o", "x.png", "--look", "1,1,1,1,1,1"],
                      ["render", "use.ply", "-o", "x.png", "--region", "5,5,5,9"],
                      ["render", "use.ply", "-o", "x.png", "--panorama", "64"],
                      ["render", "use.ply", "-o", "x.png", "--panorama", "64x32", "--eye", "1,2"],
                      ["render", "use.ply", "-o", "x.png", "--panorama", "64x32", "--repeat", "3"],
                      ["render", "use.ply", "-o", "x.png", "--threads", "-1"],
                      ["render", "use.ply", "-o", "x.png", "--repeat", "0"],
                      ["render", "use.ply", "-o", "x.png", "--stats", "xml"],
                      ["render", "use.ply", "-o", "x.png", "--opacity", "1.5"],
                      ["render", "use.ply", "-o", "x.png", "--opacity", "0.5,-1"],
                      ["render", "use.ply", "-o", "x.png", "--layers", "17"],
                      ["render", "use.ply", "-o", "x.png", "--lines", "0"],
                      ["render", "use.ply", "-o", "x.png", "--lines", "2,1.5"],
                      ["render", "use.ply", "-o", "x.png", "--line-color", "1,0,0"],
                      ["render", "use.ply", "-o", "x.png", "--lines", "2", "--line-source", "ink"],
                      ["render", "use.ply", "-o", "x.png", "--background", "1,1"]):
        done = run(*arguments, code=2)
        assert done.stderr.startswith("patina: ") and not done.stdout, arguments
    assert not (FOLDER / "x.png").exists()


def test_pictures_are_png():
    """Whoever asks for another kind of picture is told, before anything is drawn; a file called JPEG that holds a PNG is no answer."""
    ball("kind.ply", 100)
    for name in ("x.jpg", "x.JPEG", "x.exr", "folder.png/x.tif"):
        assert f"-o {name}: pictures are written as PNG" in run("render", "kind.ply", "-o", name, code=2).stderr
        assert not (FOLDER / name).exists()
    for name in ("x.PNG", "plain"):
        assert run("render", "kind.ply", "-o", name, "--size", "8x8") and (FOLDER / name).read_bytes()[1:4] == b"PNG"


def test_unknown_device():
    ball("device.ply", 100)
    assert "abacus" in run("render", "device.ply", "-o", "x.png", "--device", "abacus", code=1).stderr


# ---- info and convert ----------------------------------------------------------------------------------------------

def test_pixel_samples():
    """The mean of several samples has soft outlines; what the tool says it took, and what it refuses."""
    ball("soft.ply")
    run("render", "soft.ply", "-o", "one.png", "--size", "64x64", "--transparent")
    told = json.loads(run("render", "soft.ply", "-o", "many.png", "--size", "64x64", "--transparent", "--pixel-samples", "16",
                          "--stats", "json").stdout)
    assert told["points"], told
    one, many = ({pixel[3] for row in read_png(name)[3] for pixel in row} for name in ("one.png", "many.png"))
    assert len(many) > 2 * len(one), (one, many)
    for bad in ("0", "4097", "x"):
        assert run("render", "soft.ply", "-o", "no.png", "--pixel-samples", bad, code=2)


def test_soft():
    """A wall whose columns have rising numbers, left dark and of class 2, right bright and of class 6, before a green one: what is soft
    lets the green through, by every field; and the modes to compare with."""
    step = 2 / 119
    rows = ["x,y,z,red,green,blue,classification,rise"]
    rows += [f"{x * step - 1},0,{z * step - 1},{40 if x < 60 else 255},0,0,{2 if x < 60 else 6},{10 * x}" for x in range(120) for z in range(120)]
    (FOLDER / "soft.csv").write_text("\n".join(rows))
    wall("green.ply", lambda x, z: (0, 255, 0), y=0.5)
    view = ["--size", "64x64", "--look", "0,-3,0,0,0,0", "--unlit", "--background", "0,0,0", "-o", "soft.png"]
    style = ["--soft-opacity", "0.1", "--soft-radius", "0.03"]

    def at(*arguments):
        analysis = "on" if any("density" in word or "uncertainty" in word for word in arguments) else "off"
        run("render", "soft.csv", "green.ply", *view, "--analysis", analysis, *arguments)
        rows = read_png("soft.png")[3]
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
    assert "no attribute 'height'" in run("render", "soft.csv", *view, "--soft", "base", "--soft-field", "height", code=1).stderr
    for bad in (["--soft", "volume"], ["--soft-field", "rise"], ["--soft", "base", "--soft-threshold", "0.5"],
                ["--soft", "base", "--soft-field", "class:x"], ["--soft", "base", "--soft-field", "plane:0,0,0"],
                ["--soft", "base", "--soft-field", "axis:0,0,0,0,0,0"], ["--soft", "base", "--soft-field", "rise,1"],
                ["--soft", "base", "--soft-field", "rise", "--soft-threshold", "2"]):
        run("render", "soft.csv", *view, *bad, code=2)


def test_soft_shadows():
    """A soft ball over a floor dims it under a sun, and less than a solid one; without shadows it does not."""
    rows = [f"{x / 30 - 2},{y / 30 - 2},-1,200,200,200" for x in range(120) for y in range(120)]
    (FOLDER / "floor.csv").write_text("x,y,z,red,green,blue\n" + "\n".join(rows))
    ball("over.ply", count=4000)
    view = ["--size", "64x64", "--look", "0,-3,9,0,0,-1", "--lit", "--sun", "90,60", "-o", "shade.png"]

    def light(*arguments):
        run("render", "floor.csv", "over.ply", *view, *arguments)
        return sum(sum(pixel[:3]) for row in read_png("shade.png")[3] for pixel in row)

    style = ["--soft-opacity", "0.1", "--soft-radius", "0.1"]
    bare, soft, solid = light("--soft", "base,2", *style), light("--soft", "base,2", *style, "--shadows"), light("--shadows")
    denser = light("--soft", "base,2", "--soft-radius", "0.1", "--soft-opacity", "0.4", "--shadows")
    assert soft < 0.995 * bare and denser < soft, (bare, soft, denser, solid)
    assert "run  dim" in run("render", "floor.csv", "over.ply", *view, "--soft", "base,2", "--shadows", "--dump-plan").stdout
    assert "run  dim" not in run("render", "floor.csv", "over.ply", *view, "--shadows", "--dump-plan").stdout


def test_noise():
    """Samples end where the picture is as good as was asked for; the planes beside it are of one sample."""
    ball("noisy.ply")
    (FOLDER / "noisy").mkdir()
    taken = []
    for noise, *most in (("0.03",), ("0.01",), ("0.001", "--pixel-samples", "36")):
        told = json.loads(run("render", "noisy.ply", "-o", "noisy.png", "--size", "64x64", "--transparent", "--noise", noise, *most,
                              "--dump-planes", "noisy", "--stats", "json").stdout)
        assert 0 < told["pixel_error"] <= float(noise) or told["pixel_samples"] == 36, told
        taken.append(told["pixel_samples"])
    assert 4 <= taken[0] < taken[1] <= 256 and taken[2] == 36, taken
    files = {path.name: path.stat().st_size for path in (FOLDER / "noisy").iterdir()}
    assert files["DEPTH_0.raw"] == 64 * 64 * 4 and "KEYS_0.raw" in files, files
    assert "FROM_0.raw" not in files, files  # it would be of the last of the finer pictures
    for bad in ("0", "1.5", "x"):
        assert run("render", "noisy.ply", "-o", "no.png", "--noise", bad, code=2)


def test_average():
    """Of many points a pixel, in colours at random, the mean shows: grey, where one of them would be as colourful as it is."""
    dice = random.Random(3)
    rows = [(dice.uniform(-1, 1), dice.uniform(-1, 1), 0.0, *(255 * dice.randrange(2) for _ in range(3))) for _ in range(20000)]
    with open(FOLDER / "dice.ply", "w") as file:
        file.write("ply\nformat ascii 1.0\nelement vertex 20000\nproperty float x\nproperty float y\nproperty float z\n"
                   "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n")
        file.writelines(" ".join(map(str, row)) + "\n" for row in rows)
    spread = []
    for more in ((), ("--average",)):
        run("render", "dice.ply", "-o", "dice.png", "--size", "40x40", "--look", "0,0,5,0,0,0,30", "--unlit", *more)
        values = [value for row in read_png("dice.png")[3][10:30] for pixel in row[10:30] for value in pixel]
        middle = sum(values) / len(values)
        spread.append((sum((value - middle) ** 2 for value in values) / len(values)) ** 0.5)
    assert spread[1] < 0.5 * spread[0], spread
    plan = run("render", "dice.ply", "-o", "dice.png", "--size", "40x40", "--average", "--dump-plan")
    assert "run  average" in plan.stdout + plan.stderr, plan


def test_default_picture():
    ball("default.ply")
    assert "default.png" in run("render", "default.ply", "-o", "default.png").stderr
    width, height, channels, rows = read_png("default.png")
    assert (width, height, channels) == (1024, 1024, 3)
    assert rows[0][0] == (63, 63, 63)  # linear 0.05
    covered = sum(pixel != (63, 63, 63) for row in rows for pixel in row) / (width * height)
    assert 0.2 < covered < 0.9, covered  # framed
    middle = rows[512][512]
    assert max(middle) > 100, middle  # lit


def test_colors_are_kept_and_rows_are_upright():
    wall("wall.ply", lambda x, z: (200, 30, 60) if z > 0 else (10, 120, 255))
    run("render", "wall.ply", "-o", "wall.png", *FRONT, "--smooth", "off")
    width, height, channels, rows = read_png("wall.png")
    assert (width, height, channels) == (64, 64, 3)
    assert rows[20][32] == (200, 30, 60) and rows[43][32] == (10, 120, 255), (rows[20][32], rows[43][32])
    run("render", "wall.ply", "-o", "lit.png", *FRONT, "--smooth", "off", "--lit")
    assert read_png("lit.png")[3][20][32] != (200, 30, 60)


def test_headlight():
    """A wall is brightest where it faces the camera, wherever that is."""
    wall("head.ply", lambda x, z: (128, 128, 128))
    seen = {}
    for turn in (0, 60, -60):
        x, y = 6 * math.sin(math.radians(turn)), -6 * math.cos(math.radians(turn))
        run("render", "head.ply", "-o", "head.png", "--look", f"{x},{y},0,0,0,0,30", "--size", "64x64", "--smooth", "off", "--lit",
            "--headlight", "--background", "0,0,0")
        seen[turn] = read_png("head.png")[3][32][32][0]
    assert abs(seen[0] - 125) <= 2 and abs(seen[60] - 91) <= 3 and abs(seen[60] - seen[-60]) <= 1, seen
    run("render", "head.ply", "-o", "x.png", "--headlight", "--shadows", code=2)


def test_largest_gap():
    wall("gap.ply", lambda x, z: (200, 30, 60), count=12)
    for name, options in (("wide", ("--radius", "0.2")), ("narrow", ("--radius", "0.05")),
                          ("limited", ("--radius", "0.2", "--largest-gap", "0.1"))):
        run("render", "gap.ply", "-o", f"{name}.png", *FRONT, "--surface", "splats", *options)
    assert read_png("limited.png") == read_png("narrow.png") != read_png("wide.png")


def test_transparent_film_is_not_premultiplied():
    wall("film.ply", lambda x, z: (200, 100, 50))
    run("render", "film.ply", "-o", "film.png", *FRONT, "--transparent")
    _, _, channels, rows = read_png("film.png")
    assert channels == 4 and rows[0][0][3] == 0 and rows[32][32] == (200, 100, 50, 255)
    partial = [pixel for row in rows for pixel in row if 0 < pixel[3] < 255]
    for pixel in partial:  # an edge is as orange as the middle
        assert all(abs(a - b) <= 3 for a, b in zip(pixel, (200, 100, 50))), pixel


def test_opacity_of_each_file():
    wall("glass.ply", lambda x, z: (200, 100, 50))
    wall("behind.ply", lambda x, z: (10, 120, 255), y=2.0)
    view = (*FRONT, "--transparent")
    seen = {}
    for opacity, alpha in (("0.5,1", 255), ("0.5", 191), ("0,1", 255), ("1,0.3", 255)):
        run("render", "glass.ply", "behind.ply", "-o", "glass.png", *view, "--opacity", opacity)
        pixel = read_png("glass.png")[3][32][32]
        assert abs(pixel[3] - alpha) <= 1, (opacity, pixel)
        seen[opacity] = pixel[:3]
    assert seen["0,1"] == (10, 120, 255) and seen["1,0.3"] == (200, 100, 50), seen
    assert seen["0.5,1"] not in (seen["0,1"], seen["1,0.3"])
    run("render", "glass.ply", "behind.ply", "-o", "glass.png", *view, "--opacity", "0.5,1", "--layers", "1")
    assert abs(read_png("glass.png")[3][32][32][3] - 128) <= 1
    stats = json.loads(run("render", "glass.ply", "behind.ply", *view, "--opacity", "0.5,1", "--stats", "json").stdout)
    assert stats["layers"] == 2, stats


def test_lines():
    wall("red.ply", lambda x, z: (255, 0, 0))
    shown = {}
    for name, options in (("plain", []), ("black", ["--lines", "4"]), ("half", ["--lines", "4,0,0.5"]),
                          ("alone", ["--lines", "4", "--line-surface", "none"]),
                          ("blue", ["--lines", "4,0,1", "--line-color", "0,0,1", "--line-surface", "paper"])):
        run("render", "red.ply", "-o", "lines.png", *FRONT, "--ortho", "4", "--transparent", *options)
        shown[name] = read_png("lines.png")[3]
    row = len(shown["plain"]) // 2
    edge = next(x for x, pixel in enumerate(shown["plain"][row]) if pixel[3] == 255)  # the wall's left side
    at = {name: (rows[row][edge - 3], rows[row][row]) for name, rows in shown.items()}
    assert at["plain"][0][3] == 0 and at["plain"][1] == (255, 0, 0, 255), at
    assert at["black"] == ((0, 0, 0, 255), (255, 0, 0, 255)), at
    assert abs(at["half"][0][3] - 128) <= 1 and at["half"][1] == (255, 0, 0, 255), at
    assert at["alone"][0] == (0, 0, 0, 255) and at["alone"][1][3] == 0, at
    assert at["blue"] == ((0, 0, 255, 255), (255, 255, 255, 255)), at


def test_a_mesh_hides_and_is_hidden():
    wall("behind.ply", lambda x, z: (0, 255, 0), y=1.0)
    wall("before.ply", lambda x, z: (0, 0, 255), y=-1.0)
    (FOLDER / "square.obj").write_text("v -0.5 0 -0.5\nv 0.5 0 -0.5\nv 0.5 0 0.5\nv -0.5 0 0.5\nvn 0 1 0\nf 1//1 2//1 3//1 -1//1\n")
    view = ("--size", "64x64", "--ortho", "4", "--look", "0,-5,0,0,0,0")
    for cloud, middle in (("behind.ply", "mesh"), ("before.ply", "points")):
        run("render", cloud, "--mesh", "square.obj", "-o", "mesh.png", *view)
        rows = read_png("mesh.png")[3]
        r, g, b = rows[32][32]
        assert (max(r, g, b) - min(r, g, b) <= 1 and r > 20) if middle == "mesh" else (r, g, b) == (0, 0, 255), (cloud, rows[32][32])
        assert rows[32][20] == ((0, 255, 0) if middle == "mesh" else (0, 0, 255)), (cloud, rows[32][20])
    run("render", "--mesh", "square.obj", "-o", "mesh.png", *view)  # no points at all
    (FOLDER / "bad.obj").write_text("v 0 0 0\nf 1 2 3\n")
    assert "line 2" in run("render", "--mesh", "bad.obj", "-o", "mesh.png", code=1).stderr


def test_background():
    ball("background.ply", 500)
    run("render", "background.ply", "-o", "background.png", "--size", "32x32", "--background", "1,0.2140411,0")
    assert read_png("background.png")[3][0][0] == (255, 127, 0)
    lit = [read_png("background.png")[3][16][16]]
    run("render", "background.ply", "-o", "background.png", "--size", "32x32", "--background", "1,0.2140411,0", "--ambient",
        "0,0,0.5", "--lit")
    assert read_png("background.png")[3][0][0] == (255, 127, 0)
    lit.append(read_png("background.png")[3][16][16])
    assert lit[1][2] > lit[0][2] + 50, lit  # blue light in front of an orange background


def test_ortho_width():
    wall("ortho.ply", lambda x, z: (255, 255, 255))
    run("render", "ortho.ply", "-o", "ortho.png", "--look", "0,-6,0,0,0,0", "--ortho", "4", "--size", "80x40",
        "--background", "0,0,0", "--antialias", "off")
    rows = read_png("ortho.png")[3]
    wide = sum(pixel == (255, 255, 255) for pixel in rows[20])
    assert abs(wide - 40) <= 2, wide  # 2 of 4 units in 80 pixels
    assert all(pixel == (255, 255, 255) for pixel in rows[0][30:50])  # 2 units high


def test_panorama():
    """Points ahead (north), to the right, behind and above of an eye stand where a compass says."""
    size = ("--panorama", "128x64", "--eye", "5,6,7", "--antialias", "off", "--fill", "off", "--smooth", "off")
    for place, (x, y) in (((5, 9, 7), (64, 32)), ((8, 6, 7), (96, 32)), ((5, 3, 7), (0, 32)), ((5, 9, 10), (64, 16))):
        write_ply("around.ply", [place] * 4, [(255, 0, 0)] * 4)
        run("render", "around.ply", "-o", "around.png", *size)
        rows = read_png("around.png")[3]
        assert len(rows) == 64 and len(rows[0]) == 128
        red = [(column, row) for row, pixels in enumerate(rows) for column, pixel in enumerate(pixels) if pixel[0] > pixel[1] + 40]
        assert red and all(abs((column - x + 64) % 128 - 64) <= 1 and abs(row - y) <= 1 for column, row in red), (place, red)
    run("render", "around.ply", "-o", "part.png", *size, "--region", "60,40,70,50")
    assert read_png("part.png")[3] == [row[60:70] for row in rows[64 - 50:64 - 40]]


def test_look_turns_with_its_target():
    write_ply("point.ply", [(3, 1, 2)] * 4, [(255, 0, 0)] * 4)
    for look in ("0,0,0,3,1,2", "3,1,9,3,1,2", "3,1,-9,3,1,2"):
        run("render", "point.ply", "-o", "point.png", "--look", look, "--size", "33x33", "--antialias", "off")
        rows = read_png("point.png")[3]
        red = [(x, y) for y, row in enumerate(rows) for x, pixel in enumerate(row) if pixel[0] > 200]
        assert red and all(abs(x - 16) <= 1 and abs(y - 16) <= 1 for x, y in red), (look, red)


def test_region_is_a_crop():
    ball("region.ply")
    view = ("--size", "90x70", "--camera", "20,30")
    run("render", "region.ply", "-o", "whole.png", *view)
    run("render", "region.ply", "-o", "part.png", *view, "--region", "31,12,66,57")
    whole, part = read_png("whole.png"), read_png("part.png")
    assert part[:2] == (35, 45)
    assert part[3] == [row[31:66] for row in whole[3][70 - 57:70 - 12]]


def test_choices_change_the_picture():
    ball("choices.ply", 3000)
    seen = {}
    base = ("render", "choices.ply", "-o", "choice.png", "--size", "200x200")
    for choice in ((), ("--quality", "paper"), ("--fill", "off"), ("--fill", "paper"), ("--smooth", "off"),
                   ("--smooth", "box"), ("--antialias", "off"), ("--unlit",), ("--camera", "80,10"),
                   ("--camera", "30,40,20"), ("--ortho", "3"), ("--fill", "paper", "--iterations", "3")):
        run(*base, *choice)
        picture = (FOLDER / "choice.png").read_bytes()
        assert picture not in seen, (choice, seen[picture])
        seen[picture] = choice


def test_effects():
    """Each effect changes the picture in its own way; a region is a crop with all of them; what cannot be is refused."""
    ball("effects.ply", 3000)
    base = ("render", "effects.ply", "-o", "effect.png", "--size", "120x100", "--lit")
    effects = (("--edl", "1"), ("--edl", "1,4"), ("--obscurance", "2,0.5"), ("--toon", "3,0.2"), ("--hatch", "2"),
               ("--hatch", "1,8,0.5,1,0.2,0,0"), ("--fog", "1,6"), ("--fog", "1,6,0.5,0.9,0.1,0.1"), ("--focus", "2,0.3"),
               ("--paper", "0.4"), ("--paper", "0.1,0.9,0.8,0.6"))
    seen = {}
    for effect in table.read():  # those that no choice shows: as Blender begins them
        if effect["panel"] != "CAMERA" and not any(choice[0] == f"--{effect['name']}" for choice in effects):
            begun = {field["name"]: field["start"] for field in effect["fields"] if "start" in field}
            effects += tuple(word for name, value in begun.items() for word in
                             ("--effect", f"{name}={','.join(map(str, value)) if isinstance(value, tuple) else value}")),
    assert any("contour_width=1" in choice for choice in effects)
    for choice in ((), *effects):
        run(*base, *choice)
        picture = (FOLDER / "effect.png").read_bytes()
        assert picture not in seen, (choice, seen[picture])
        seen[picture] = choice
    run(*base, "--effect", "hatch_levels=1", "--effect", "hatch_spacing=8", "--effect", "hatch_opacity=0.5", "--effect",
        "hatch_ground=1", "--effect", "hatch_color=0.2,0,0")
    assert seen[(FOLDER / "effect.png").read_bytes()] == ("--hatch", "1,8,0.5,1,0.2,0,0"), "by their names fields are others"
    help_text = run("help", "effects").stdout
    for option in ("--edl STRENGTH[,RADIUS] ", "--hatch LEVELS[,SPACING,OPACITY,GROUND,R,G,B] ", "--fog START,END[,DENSITY,R,G,B] ",
                   "--focus DISTANCE,APERTURE ", "--paper GRAIN[,R,G,B] "):
        assert option in help_text, option
    every = [word for choice in effects[::2] for word in choice]
    run(*base, *every)
    whole = read_png("effect.png")
    run(*base, *every, "--region", "30,20,77,63")
    assert read_png("effect.png")[3] == [row[30:77] for row in whole[3][100 - 63:100 - 20]]
    for option, value, code in (("--edl", "1,2,3", 2), ("--toon", "2.5", 2), ("--fog", "3", 2), ("--focus", "2", 2),
                                ("--paper", "0.1,1", 2), ("--edl", "-1", 1), ("--toon", "1", 1), ("--fog", "5,5", 1),
                                ("--hatch", "4", 1), ("--focus", "0,1", 1), ("--hatch", "2,6,1,0,0.5", 2), ("--fog", "1,6,1,0,0", 2),
                                ("--effect", "hatch", 2), ("--effect", "hatch_levels=1.5", 2), ("--effect", "none=1", 2),
                                ("--effect", "fog_color=1", 2), ("--effect", "toon_bands=17", 1)):
        said = run("render", "effects.ply", "-o", "y.png", option, value, code=code).stderr
        assert said.startswith("patina: ") and not (FOLDER / "y.png").exists(), (option, value, said)


def test_several_files():
    wall("left.ply", lambda x, z: (255, 0, 0))
    right = [(0.5 + x * 0.01, -1, z * 0.01) for x in range(40) for z in range(-20, 20)]
    write_ply("right.ply", right, [(0, 255, 0)] * len(right))
    done = run("render", "left.ply", "right.ply", "-o", "both.png", *FRONT)
    assert str(120 * 120 + 1600) in done.stderr
    colors = {pixel for row in read_png("both.png")[3] for pixel in row}
    assert (255, 0, 0) in colors and (0, 255, 0) in colors


def test_empty_cloud_is_background():
    write_ply("void.ply", [])
    assert "warning: void.ply holds no points" in run("render", "void.ply", "-o", "void.png", "--size", "16x16").stderr
    assert {pixel for row in read_png("void.png")[3] for pixel in row} == {(63, 63, 63)}


def test_threads_batches_and_levels_agree():
    ball("same.ply", 50000)
    base = ("render", "same.ply", "-o", "same.png", "--size", "301x203")
    run(*base, "--device", "cpu", "--threads", "1")
    first = (FOLDER / "same.png").read_bytes()
    for choice in (("--threads", "2"), ("--threads", "7"), ("--batch", "1"), ("--threads", "3", "--batch", "13"),
                   ("--device", "cpu-scalar")):
        run(*base, *(() if "--device" in choice else ("--device", "cpu")), *choice)
        assert (FOLDER / "same.png").read_bytes() == first, choice


# ---- numbers -------------------------------------------------------------------------------------------------------

def test_stats_of_opengl():
    """What a render asks of OpenGL: the same counts for each frame of one view, and as many bytes for as many points."""
    ball("asked.ply")
    if subprocess.run([*PATINA, "render", "asked.ply", "-o", "asked.png", "--size", "8x8", "--device", "gl-egl"], capture_output=True,
                      cwd=FOLDER, timeout=300, check=False).returncode:
        print("skip stats_of_opengl: there is no OpenGL device here")
        return
    frames = [json.loads(run("render", "asked.ply", "--stats", "json", "--repeat", "1", "--size", "64x48", "--device", "gl-egl").stdout)["gl"]
              for _ in range(2)]
    assert frames[0] == frames[1], frames
    counts = frames[0]
    assert set(counts) == {"dispatches", "empty", "barriers", "calls", "copies", "waits", "uploaded", "bytes"}, counts
    assert 0 < counts["dispatches"] <= counts["barriers"] <= counts["calls"] and counts["empty"] < counts["dispatches"], counts
    assert counts["waits"] >= 1 and counts["bytes"] > 20000 * 12, counts


def test_stats_of_passes():
    """What each pass asks for, which is no more than all of them do; a GPU has a time for each as well."""
    ball("asked.ply")
    for device, kind in (("cpu", "cpu"), ("gl-egl", "gl")):
        done = subprocess.run([*PATINA, "render", "asked.ply", "--stats", "json", "--repeat", "2", "--size", "64x48", "--device", device],
                              capture_output=True, text=True, cwd=FOLDER, timeout=300, check=False, env={**os.environ, "PATINA_GL_AS": "hardware"})
        if done.returncode and kind == "gl":
            print("skip stats_of_passes: there is no OpenGL device here")
            return
        stats = json.loads(done.stdout)
        assert {"scatter", "resolve", "fill", "tail"} <= stats["work"].keys() & stats["passes"].keys(), (device, stats["work"])
        assert "pixels" not in stats["passes"], stats["passes"]  # it is measured
        for name, total in stats[kind].items():
            asked = sum(one[name] for one in stats["work"].values())
            assert asked == total if name == "bytes" else asked <= total, (device, name, asked, total)
        assert all(one["bytes"] > 0 for one in stats["work"].values()), stats["work"]


def test_stats():
    ball("stats.ply")
    done = run("render", "stats.ply", "--stats", "json", "--repeat", "5", "--size", "320x200", "--device", "cpu")
    stats = json.loads(done.stdout)
    assert {"device", "points", "width", "height", "ms_median", "ms_min", "ms_max", "passes", "skipped",
            "peak_mb"} <= stats.keys()
    assert stats["points"] == 20000 and (stats["width"], stats["height"]) == (320, 200)
    assert stats["device"].startswith("cpu") and stats["peak_mb"] > 1
    assert 0 < stats["ms_min"] <= stats["ms_median"] <= stats["ms_max"]
    assert stats["passes"] and all(isinstance(ms, float) and ms >= 0 for ms in stats["passes"].values())
    assert "scatter" in stats["passes"]
    assert "gl" not in stats and stats["cpu"]["barriers"] > 0 and stats["cpu"]["bytes"] > 20000 * 12, stats["cpu"]
    assert sum(stats["passes"].values()) < 3 * stats["ms_max"] + 1
    assert all(isinstance(reason, str) and reason for reason in stats["skipped"].values())
    assert 320 * 200 * 16 < stats["planes"]["peak"] <= stats["planes"]["held"], stats["planes"]  # the camera turns: bins of discs vary
    for more in (["--repeat", "1"], ["--repeat", "5", "--surface", "fill"]):
        planes = json.loads(run("render", "stats.ply", "--stats", "json", "--size", "320x200", "--device", "cpu", *more).stdout)["planes"]
        assert 320 * 200 * 16 < planes["held"] == planes["peak"], (more, planes)  # what was planned, and no more


def test_shadows():
    """A ball before a wall throws a shadow on it; kept shadows make the same picture; what does not fit is refused."""
    ball("ball.ply", origin=(0, -1.6, 0))
    wall("wall.ply", lambda x, z: (200, 200, 200))
    view = ("ball.ply", "wall.ply", "--lit", "--size", "64x64", "--look", "-6,-5,0,0,0,0", "--ortho", "6", "--sun", "0,0,4")
    run("render", *view, "-o", "open.png")
    run("render", *view, "-o", "dark.png", "--shadows", "--samples", "8")
    lit, dark = (sum(sum(sum(pixel) for pixel in row) for row in read_png(name)[3]) for name in ("open.png", "dark.png"))
    assert dark < 0.96 * lit, (lit, dark)
    run("render", *view, "--shadows", "--samples", "8", "--save-shadows", "kept")
    run("render", *view, "-o", "kept.png", "--shadows", "--samples", "8", "--load-shadows", "kept")
    assert read_png("kept.png") == read_png("dark.png")
    refused = run("render", *view, "-o", "x.png", "--shadows", "--samples", "9", "--load-shadows", "kept", code=1).stderr
    assert "stale" in refused and "8 samples" in refused, refused
    said = json.loads(run("render", *view, "--shadows", "--shadow-error", "0.2", "--stats", "json").stdout)
    assert said["shadow_samples"] in (4, 8, 16, 32) and 0 < said["shadow_error"] <= 0.2, said
    assert "need --shadows" in run("render", *view, "--save-shadows", "kept", code=2).stderr
    assert "no value" in run("render", *view, "-o", "x.png", "--sun", "0,91", code=2).stderr


def test_colors_and_clips():
    """A wall whose left half is of class 2, the right of class 6: ramps, hidden classes, boxes."""
    step = 2 / 119
    rows = ["x,y,z,classification,rise"]
    rows += [f"{x * step - 1},0,{z * step - 1},{2 if x < 60 else 6},{10 * z}" for x in range(120) for z in range(120)]
    (FOLDER / "wall.csv").write_text("\n".join(rows))
    view = ["--size", "64x64", "--look", "0,-3,0,0,0,0", "--unlit", "--background", "0,0,0", "--analysis", "off", "-o", "c.png"]
    left, right = (16, 32), (48, 32)

    def at(*arguments):
        run("render", "wall.csv", *view, *arguments)
        rows = read_png("c.png")[3]
        return [rows[y][x] for x, y in (left, right)]

    assert at("--color", "1,0,0") == [(255, 0, 0)] * 2
    ground, building = at("--ramp", "classification", "--ramp-colors", "classes")
    assert ground == (0xA9, 0x79, 0x4A) and building == (0xD9, 0x66, 0x3B), (ground, building)
    assert at("--color", "1,0,0", "--hide-classes", "2,7") == [(0, 0, 0), (255, 0, 0)]
    assert at("--color", "1,0,0", "--clip-box", "-1,-1,-1,-0.1,1,1") == [(255, 0, 0), (0, 0, 0)]
    assert at("--color", "1,0,0", "--cut-box", "-1,-1,-1,-0.1,1,1") == [(0, 0, 0), (255, 0, 0)]
    tinted = at("--color", "1,0,0", "--cut-box", "-1,-1,-1,-0.1,1,1", "--clip-tint", "0,0,1,5")
    assert tinted == [(0, 0, 0), (0, 0, 255)], tinted
    at("--ramp", "rise,0,1190", "--ramp-colors", "grey")
    rows = read_png("c.png")[3]
    assert rows[10][32][0] > 200 > 128 > rows[54][32][0], "by an attribute, brighter upwards"
    assert at("--color", "0.18,0.18,0.18", "--exposure", "1", "--contrast", "2") == at("--color", "0.72,0.72,0.72")
    along = ["--effect", "contour_source=attribute", "--contour", "600,2,1"]  # at 600, in the middle
    at("--color", "1,1,1", "--attribute", "rise", *along)
    rows = read_png("c.png")[3]
    dark = [y for y in range(9, 55) if rows[y][32][0] < 100]
    assert dark and all(abs(y - 31.5) < 2.5 for y in dark), f"lines along an attribute on rows {dark}"
    drawn = read_png("c.png")
    at("--ramp", "rise,-2,-1", "--ramp-colors", "grey", *along)
    assert read_png("c.png")[3] == drawn[3], "along the ramp's attribute"
    refused = run("render", "wall.csv", *view, "--ramp", "rise", "--attribute", "classification", *along, code=1).stderr
    assert "both are of one attribute" in refused, refused
    for arguments in (["--ramp", "nothing"], ["--ramp", "height", "--ramp-colors", "plaid"], ["--attribute", "nothing"]):
        assert "there is no" in run("render", "wall.csv", *view, *arguments, code=1).stderr
    for arguments in (["--contrast", "-1"], ["--hide-classes", "2,x"], ["--clip-box", "1,2,3"], ["--clip-tint", "1,0,0,0"],
                      ["--ramp", "height,1"], ["--exposure", "99"]):
        run("render", "wall.csv", *view, *arguments, code=2)


def test_skipped_passes_have_reasons():
    ball("skipped.ply", 500)
    stats = json.loads(run("render", "skipped.ply", "--stats", "json", "--smooth", "off", "--antialias", "off").stdout)
    assert {"smooth", "antialias"} <= stats["skipped"].keys(), stats


def test_plan():
    ball("plan.ply", 500)
    text = run("render", "plan.ply", "--dump-plan").stdout
    assert "scatter" in text and len(text.splitlines()) > 3
    text = run("render", "plan.ply", "--dump-plan", "--shadows", "--opacity", "0.5", "--layers", "3").stdout
    lines = [line.split(None, 1)[0] + " " + line.split()[1] for line in text.splitlines()]
    for expected in ("fill KEYS", "loop samples", "loop faces", "plan map", "run scatter", "run shadow_test", "loop layers", "layer 2:",
                     "read TILES", "run peel", "layer 3:", "run compose"):
        assert expected in lines, (expected, text)
    assert re.search(r"memory [\d.]+ MB of planes at most: \d+ of them share \d+ slabs\n  slab [\d.]+ MB: [A-Z_]+ \d \(\d+ to \d+\)", text), text
    assert "at most 2, until a layer is empty" in text, text
    done = run("render", "plan.ply", "--dump-plan", "--stats", "json")
    json.loads(done.stdout)
    assert "scatter" in done.stderr


def test_planes():
    ball("planes.ply", 500)
    (FOLDER / "planes").mkdir()
    run("render", "planes.ply", "--dump-planes", "planes", "--size", "40x30")
    files = sorted(path.name for path in (FOLDER / "planes").iterdir())
    assert any(name.endswith(".txt") for name in files) and len(files) >= 4, files
    assert {"KEYS_0.raw", "FROM_0.raw", "NORMAL_0.raw", "DEFF_0.raw", "COMBINED_0.raw"} <= set(files), files
    run("render", "planes.ply", "--dump-planes", "no/such/folder", code=1)
    found = []
    for number, (device, threads) in enumerate((("cpu", 1), ("cpu", 3), ("cpu-scalar", 2))):  # of discs: nothing of how threads came by
        folder = FOLDER / f"discs-{number}"
        folder.mkdir()
        run("render", "planes.ply", "--surface", "splats", "--opacity", "0.5", "--dump-planes", folder.name, "--size", "40x30", "--device", device,
            "--threads", threads)
        found.append({path.name: path.read_bytes() for path in folder.iterdir()})
    differ = [name for name in found[0].keys() | found[1].keys() | found[2].keys() if len({one.get(name) for one in found}) > 1]
    assert "KEYS_0.raw" in found[0] and not differ, differ


def test_interrupt():
    ball("interrupt.ply")
    process = subprocess.Popen([*PATINA, "render", "interrupt.ply", "--repeat", "100000"], cwd=FOLDER,
                               stderr=subprocess.PIPE)
    time.sleep(1)
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=60)
    assert process.returncode == 130 and b"cancelled" in error, (process.returncode, error)


def main():
    global FOLDER
    passed, failed = 0, 0
    import cli_files  # which ask this script for its helpers
    import cli_ranges
    import cli_trust
    tests = [(name, test) for name, test in {**globals(), **vars(cli_files), **vars(cli_ranges), **vars(cli_trust)}.items() if name.startswith("test_")]
    wanted = sys.argv[2:]
    with tempfile.TemporaryDirectory() as folder:
        FOLDER = Path(folder)
        for name, test in tests:
            if wanted and name not in wanted:
                continue
            try:
                test()
                passed += 1
            except Exception:  # a test's failure is one line of the sum, whatever it is
                print(f"FAILED {name}")
                traceback.print_exc(file=sys.stdout)
                failed += 1
    print(f"{passed} passed, {failed} failed, 0 skipped")
    return 1 if failed else 0


if __name__ == "__main__":
    os.environ.pop("PATINA_SHADER_DIR", None)
    sys.exit(main())
