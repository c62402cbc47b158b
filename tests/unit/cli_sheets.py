# SPDX-License-Identifier: GPL-3.0-or-later
"""Sheets of survey drawings, as PDF and SVG: tests that test_cli.py runs. judge_page.py reads PDFs with pypdf, in the environment of
build/setup; without it the tests of PDFs are skipped. Lengths are measured on paper at 100 %."""

import base64
import hashlib
import json
import re
import struct
import subprocess
import xml.etree.ElementTree as ElementTree
import zlib
from pathlib import Path

import cli
import cli_drawings
import cli_rasters
from runs import Skip

FAR = cli_drawings.FAR
NEAR = 0.1  # millimeters of paper
PLAN = ("--plane", f"plan:{FAR[2] + 0.25}", "--scale=50", "--extent=2,1")
A4 = [20, 10, 287, 200]  # the frame: left, bottom, right, top


def judge(*paths):
    if not cli_rasters.JUDGES.exists():
        raise Skip("pypdf is missing: build/setup installs it where it can")
    script = Path(__file__).resolve().parent / "judge_page.py"
    done = subprocess.run([str(cli_rasters.JUDGES), str(script)], input=json.dumps([str(cli.FOLDER / path) for path in paths]),
                          capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def read_svg(path):
    """The same of an SVG, by its own numbers."""
    root = ElementTree.parse(cli.FOLDER / path).getroot()
    width, height = (float(root.get(name).removesuffix("mm")) for name in ("width", "height"))
    assert [float(value) for value in root.get("viewBox").split()] == [0, 0, width, height]
    told = {"size": [0, 0, width, height], "title": root[0].text, "paths": [], "image": None}
    for group in root.findall("{*}g"):
        for shape in group.findall("{*}path"):
            points = [[float(x), height - float(y)] for x, y in re.findall(r"([-\d.]+),([-\d.]+)", shape.get("d"))]
            told["paths"].append({"layer": group.get("id"), "width": float(shape.get("stroke-width", group.get("stroke-width"))),
                                  "closed": shape.get("d").endswith("Z"), "filled": shape.get("fill") is not None, "points": points})
        for image in group.findall("{*}image"):
            x, y, wide, high = (float(image.get(name)) for name in ("x", "y", "width", "height"))
            link = image.get("{http://www.w3.org/1999/xlink}href")
            pixels, rows = read_png(base64.b64decode(link.removeprefix("data:image/png;base64,"), validate=True))
            told["image"] = {"corner": [x, height - y - high], "size": [wide, high], "pixels": pixels,
                             "digest": hashlib.sha256(rows).hexdigest()}
    return told


def read_png(data):
    """Size and rows of an RGB PNG whose rows have the filter Sub."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, chunks = 8, []
    while at < len(data):
        (size,) = struct.unpack(">I", data[at:at + 4])
        kind, body = data[at + 4:at + 8], data[at + 8:at + 8 + size]
        assert zlib.crc32(kind + body) == struct.unpack(">I", data[at + 8 + size:at + 12 + size])[0], kind
        chunks.append((kind, body))
        at += 12 + size
    assert [kind for kind, _ in chunks] == [b"IHDR", b"sRGB", b"IDAT", b"IEND"], chunks
    width, height, *rest = struct.unpack(">IIBBBBB", chunks[0][1])
    assert rest == [8, 2, 0, 0, 0], rest
    packed, rows = zlib.decompress(chunks[2][1]), bytearray()
    assert len(packed) == height * (3 * width + 1)
    for y in range(height):
        row = packed[y * (3 * width + 1):(y + 1) * (3 * width + 1)]
        assert row[0] == 1
        out = bytearray(row[1:])
        for i in range(3, len(out)):
            out[i] = (out[i] + out[i - 3]) & 255
        rows += out
    return [width, height], bytes(rows)


def box(points):
    return [min(p[0] for p in points), min(p[1] for p in points), max(p[0] for p in points), max(p[1] for p in points)]


def near(a, b, most=NEAR):
    return len(a) == len(b) and all(abs(x - y) <= most for x, y in zip(a, b, strict=True))


def check_sheet(told):
    """An upright room of 1 m x 0.6 m on A4 at 1:50."""
    assert near(told["size"], [0, 0, 297, 210], 1e-3) and told["title"] == "Südliche Halle", (told["size"], told["title"])
    frame, block = (box(path["points"]) for path in told["paths"] if path["layer"] == "frame")
    assert near(frame, A4, 1e-3) and near(block, [107, 10, 287, 70], 1e-3), (frame, block)
    (cut,) = (path for path in told["paths"] if path["layer"] == "cut")
    assert cut["closed"] and not cut["filled"] and abs(cut["width"] - 0.35) < 1e-6
    walls = box(cut["points"])
    assert abs(walls[2] - walls[0] - 20) < NEAR and abs(walls[3] - walls[1] - 12) < NEAR, walls
    (extent,) = (box(path["points"]) for path in told["paths"] if path["layer"] == "text" and path["closed"]
                 and near([b - a for a, b in zip(box(path["points"])[:2], box(path["points"])[2:], strict=True)], [40, 20], 1e-3))
    middle = [(extent[k] + extent[k + 2]) / 2 for k in range(2)]
    assert near([(walls[k] + walls[k + 2]) / 2 for k in range(2)], middle), (walls, middle)
    assert near(middle, [(A4[0] + A4[2]) / 2, (70 + A4[3]) / 2], 1e-3), "above the title block"
    for path in told["paths"]:
        assert all(A4[0] - 1e-6 <= x <= A4[2] + 1e-6 and A4[1] - 1e-6 <= y <= A4[3] + 1e-6 for x, y in path["points"]), path
    image = told["image"]
    assert near([image["corner"][k] + image["size"][k] / 2 for k in range(2)], middle, 1e-3), image
    assert all(size - pixels * 25e-2 / 3 < 1e-3 for size, pixels in zip(image["size"], image["pixels"], strict=True)), image
    # 5,000,000 is where the room's middle is, and coordinates are every 2 m: ticks inwards, and their numbers below.
    lines = [path["points"] for path in told["paths"] if path["layer"] == "text" and len(path["points"]) == 2]
    ticks = [points for points in lines if near(points[0], [middle[0], extent[1]])]
    assert len(ticks) == 1 and near(ticks[0][1], [middle[0], extent[1] + 3]), ticks


def draw_room():
    cli_drawings.room("room.ply")
    return cli.run("draw", "room.ply", *PLAN, "--sheet=a4", "--title", "title=Südliche Halle", "--title=author=A & B",
                   "-o", "sheet.pdf", "-o", "sheet.svg", "-o", "plan.dxf")


def test_sheet_svg():
    done = draw_room()
    assert "sheet.svg: A4, 297 x 210 mm, 1:50, an image of 480x240 pixels" in done.stderr, done.stderr
    assert "plan.dxf: 1:50, cut lines" in done.stderr, done.stderr
    check_sheet(read_svg("sheet.svg"))
    _, _, (line,) = cli_drawings.read_dxf("plan.dxf")
    (cut,) = (path for path in read_svg("sheet.svg")["paths"] if path["layer"] == "cut")
    assert len(line[10]) == len(cut["points"]), "the outputs of a call share one cut"


def test_sheet_pdf():
    """An independent reader finds each line where the SVG has it, and the same pixels."""
    draw_room()
    (told,), svg = judge("sheet.pdf"), read_svg("sheet.svg")
    check_sheet(told)
    assert len(told["paths"]) == len(svg["paths"])
    for one, other in zip(told["paths"], svg["paths"], strict=True):
        assert [one[key] for key in ("layer", "closed", "filled")] == [other[key] for key in ("layer", "closed", "filled")], (one, other)
        assert one["filled"] or abs(one["width"] - other["width"]) < 1e-6
        assert all(near(a, b, 1e-3) for a, b in zip(one["points"], other["points"], strict=True)), (one, other)
    assert told["image"]["digest"] == svg["image"]["digest"] and told["image"]["pixels"] == svg["image"]["pixels"]


def test_bare_pdf():
    """Without a sheet the page is the drawing, and its image is in place: colors of a board change where they do, to 0.1 mm of paper."""
    cli_rasters.board("board.ply", (1, 0, 0), (0, 1, 0))
    cli.run("draw", "board.ply", "--plane", f"plan:{FAR[2] + 0.1}", "--extent=1.4,1", "--pixel=0.005", "-o", "bare.pdf")
    (told,) = judge("bare.pdf")
    assert near(told["size"], [0, 0, 28, 20], 1e-3) and not told["paths"], told["size"]
    image = told["image"]
    assert near([*image["corner"], *image["size"]], [0, 0, 28, 20], 1e-3) and image["pixels"] == [280, 200]
    data = bytes.fromhex(image["bytes"])

    def colors(x, y):  # from the lower left
        at = 3 * ((199 - y) * 280 + x)
        return data[at:at + 3]

    def changes(line, channel):
        """Where red gives way to another color along a line of pixels, in millimeters."""
        lights = [[(value / 255) ** 2.2 for value in color] for color in line]
        return sum(light[0] / (light[0] + light[channel]) for light in lights) / 10

    left, bottom = 4, 4  # of the board on paper
    across = changes([colors(x, 62) for x in range(80, 160)], 1)  # from 4 mm on the board on
    upwards = changes([colors(82, y) for y in range(60, 120)], 2)  # from 2 mm on
    assert abs(8 + across - left - 8) < NEAR and abs(6 + upwards - bottom - 4.8) < NEAR, (across, upwards)
    assert colors(36, 60) == colors(60, 36) == b"\xff\xff\xff" and colors(44, 60) != b"\xff\xff\xff" != colors(60, 44)


def test_sheet_wrong_use():
    """One message each, and a file from before stays."""
    cli_drawings.room("room.ply")
    plan = f"--plane=plan:{FAR[2] + 0.25}"
    for options, code, said in (
            (("--sheet=A5",), 2, "--sheet A5: sheets are A0, A1, A2, A3, A4 and Letter"),
            (("--title=name=x", "--sheet=A1"), 2, "is no value for option '--title'"),
            (("--title=title=x",), 2, "add --sheet A1"),
            (("--sheet=A1", "--extent=50,30"), 1, "1:50 needs 1016 x 616 mm with its coordinates; A1 has 811 x 574, "
                                                  "of which the title block takes 180 x 60: use A0 or 1:100"),
            (("--sheet=A0", "--extent=50,50"), 1, "use 1:100"), (("--extent=300,3",), 1, "a PDF has at most 5080 x 5080")):
        (cli.FOLDER / "kept.pdf").write_text("kept", encoding="ascii")
        done = cli.run("draw", "room.ply", plan, "-o", "kept.pdf", *options, code=code)
        assert said in done.stderr and len([line for line in done.stderr.splitlines() if line]) <= 2, done.stderr
        assert (cli.FOLDER / "kept.pdf").read_text(encoding="ascii") == "kept"
    assert "add -o OUT.pdf" in cli.run("draw", "room.ply", plan, "--sheet=A1", "-o", "a.dxf", code=2).stderr
    assert "cannot be written" in cli.run("draw", "room.ply", *PLAN, "-o", "no/a.pdf", code=1).stderr
