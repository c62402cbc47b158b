# SPDX-License-Identifier: GPL-3.0-or-later
"""Survey drawings of the command line: tests that test_cli.py runs. What it writes is read back with Python's own library alone."""

import math
import random
import re
import xml.etree.ElementTree as ElementTree

import cli

FAR = (5000000.0, 4999000.0, 250.0)  # the room's middle, on its floor
HALF, HEIGHT = (0.5, 0.3), 0.5
LAYERS = {"cut": 35, "cut-bridged": 35, "outline": 25, "crease": 9, "contour": 13, "contour-index": 25, "profile": 25, "frame": 70, "text": 13}


def room(name, origin=FAR):
    """Four walls, 1 m x 0.6 m, 0.5 m high, of random points with a noise of 1 mm."""
    dice, points = random.Random(4), []
    for axis, side in ((0, -1), (0, 1), (1, -1), (1, 1)):
        along = 1 - axis
        for _ in range(int(12000 * HALF[along] / 0.5)):
            place = [0.0, 0.0, dice.uniform(0, HEIGHT)]
            place[axis], place[along] = side * HALF[axis] + dice.gauss(0, 0.001), dice.uniform(-HALF[along], HALF[along])
            points.append(tuple(round(value + start, 5) for value, start in zip(place, origin, strict=True)))
    return cli.write_ply(name, points, kind="double")


def read_dxf(path):
    """(header variables, {layer: line weight}, [LWPOLYLINE as {code: [values]}])"""
    lines = (cli.FOLDER / path).read_text(encoding="utf-8").split("\n")
    pairs = [(int(code), value) for code, value in zip(lines[0::2], lines[1::2], strict=False)]
    assert pairs[-1] == (0, "EOF"), pairs[-1]
    header, layers, lines, kind, table = {}, {}, [], "", {}
    for i, (code, value) in enumerate(pairs):
        if code == 9:
            header[value] = pairs[i + 1][1]
        if code == 0:
            kind, table = value, {}
            if kind == "LWPOLYLINE":
                lines.append(table)
        table.setdefault(code, []).append(value)
        if kind == "LAYER" and code == 370:
            layers[table[2][0]] = int(value)
    handles = [value for code, value in pairs if code in (5, 105)]
    assert len(handles) == len(set(handles)), "a handle is not its own"
    return header, layers, lines


def world(line):
    """Vertices of a LWPOLYLINE in the world, by the arbitrary axis algorithm of the DXF reference."""
    n = [float(line[code][0]) for code in (210, 220, 230)]
    start = (0, 1, 0) if abs(n[0]) < 1 / 64 and abs(n[1]) < 1 / 64 else (0, 0, 1)

    def cross(a, b):
        v = (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
        return [value / math.hypot(*v) for value in v]

    x = cross(start, n)
    y, lift = cross(n, x), float(line[38][0])
    return [tuple(float(u) * x[k] + float(v) * y[k] + lift * n[k] for k in range(3)) for u, v in zip(line[10], line[20], strict=True)]


def read_polylines(path, layer):
    """[(vertices in the world, whether closed)] of a layer: LWPOLYLINE entities, and POLYLINE entities with their VERTEX entities."""
    text = (cli.FOLDER / path).read_text(encoding="utf-8").split("\nENTITIES\n")[1].split("\n")
    lines, entity = [], {}
    for code, value in zip(map(int, text[0::2]), text[1::2], strict=False):
        if code == 0:
            entity = {0: [value]}
            if value in ("LWPOLYLINE", "POLYLINE"):
                lines.append((entity, []))
            elif value == "VERTEX":
                lines[-1][1].append(entity)
            elif value == "ENDSEC":
                break
        else:
            entity.setdefault(code, []).append(value)
    found = []
    for line, vertices in lines:
        places = [tuple(float(vertex[code][0]) for code in (10, 20, 30)) for vertex in vertices] if vertices else world(line)
        if line[8] == [layer]:
            found.append((places, int(line[70][0]) & 1))
    return found


def from_walls(place):
    """Distance of a place in plan from the nearest wall, in the plan of the room."""
    x, y = (abs(place[k] - FAR[k]) for k in range(2))
    sides = [(abs(x - HALF[0]), max(y - HALF[1], 0)), (abs(y - HALF[1]), max(x - HALF[0], 0))]
    return min(math.hypot(*side) for side in sides)


def test_draw_plan():
    """A plan far from the origin, at the true place to a millimeter; and flat, in millimeters of the sheet."""
    room("room.ply")
    done = cli.run("draw", "room.ply", "--plane", f"plan:{FAR[2] + 0.25}", "--scale", "20", "--extent=2,1", "-o", "plan.dxf", "-o", "plan.svg")
    told = re.search(r"plan.dxf: 1:20, cut lines of ([\d.]+) m, bridged 0 m, from", done.stderr)
    assert told and abs(float(told[1]) - 3.2) < 0.01, done.stderr
    header, layers, lines = read_dxf("plan.dxf")
    assert header["$ACADVER"] == "AC1032" and header["$INSUNITS"] == "6", header
    assert {name: layers[name] for name in LAYERS} == LAYERS, layers
    assert len(lines) == 1 and lines[0][8] == ["cut"] and lines[0][70] == ["1"], lines
    places = world(lines[0])
    assert len(places) == int(lines[0][90][0]) >= 4
    assert all(abs(place[2] - FAR[2] - 0.25) < 1e-6 and from_walls(place) < 0.0015 for place in places), places
    for corner in ((x, y) for x in (-0.5, 0.5) for y in (-0.3, 0.3)):
        assert min(math.dist(place[:2], (FAR[0] + corner[0], FAR[1] + corner[1])) for place in places) < 0.004, corner
    cli.run("draw", "room.ply", "--plane", f"plan:{FAR[2] + 0.25}", "--scale", "20", "--extent=2,1", "--flat", "-o", "flat.dxf")
    header, _, (flat,) = read_dxf("flat.dxf")
    assert header["$INSUNITS"] == "4" and 210 not in flat
    for x, y, place in zip(flat[10], flat[20], places, strict=True):
        assert math.dist((float(x), float(y)), (50 * (place[0] - FAR[0] + 1), 50 * (place[1] - FAR[1] + 0.5))) < 0.2  # the middle is the cloud's


def test_draw_svg():
    """At true scale: the room is 50 mm x 30 mm at 1:20."""
    room("room.ply")
    cli.run("draw", "room.ply", "--plane", f"plan:{FAR[2] + 0.25}", "--scale=20", "--extent=2,1", "--output=sheet.svg")
    root = ElementTree.parse(cli.FOLDER / "sheet.svg").getroot()
    assert (root.get("width"), root.get("height"), root.get("viewBox")) == ("100mm", "50mm", "0 0 100 50")
    groups = {group.get("id"): group for group in root if group.tag.endswith("}g")}
    assert {name: float(group.get("stroke-width")) for name, group in groups.items()} == {name: weight / 100 for name, weight in LAYERS.items()}
    assert groups["cut-bridged"].get("stroke-dasharray") and not groups["cut"].get("stroke-dasharray")
    (path,) = groups["cut"]
    assert path.get("d").endswith(" Z")
    places = [(float(x), float(y)) for x, y in re.findall(r"([-\d.e]+),([-\d.e]+)", path.get("d"))]
    for axis, size in ((0, 50), (1, 30)):
        span = max(place[axis] for place in places) - min(place[axis] for place in places)
        assert abs(span - size) < 0.15, (axis, span)


def test_draw_section():
    """A vertical section: its lines stand upright where the line of the section meets the walls."""
    room("room.ply")
    y = FAR[1] + 0.1
    cli.run("draw", "room.ply", "--plane", f"section:{FAR[0] - 1},{y},{FAR[0] + 1},{y}", "-o", "section.dxf")
    _, _, lines = read_dxf("section.dxf")
    assert len(lines) == 2 and all(line[70] == ["128"] for line in lines)
    for line, side in zip(sorted(lines, key=lambda line: world(line)[0][0]), (-0.5, 0.5), strict=True):
        assert [float(line[code][0]) for code in (210, 220, 230)] == [0, -1, 0]
        places = world(line)
        assert all(abs(place[0] - FAR[0] - side) < 0.001 and abs(place[1] - y) < 1e-6 for place in places), places
        heights = [place[2] - FAR[2] for place in places]
        assert min(heights) < 0.01 and max(heights) > HEIGHT - 0.015, heights  # two spacings


def test_draw_image():
    """The view of an elevation, cropped to its extent; strips make no difference to its size."""
    room("room.ply")
    cli.run("draw", "room.ply", "--plane=elevation:0", "--extent=1.2,0.8", "--scale=50", "--pixel=0.005", "-o", "view.png")
    width, height, channels, rows = cli.read_png("view.png")
    assert (width, height, channels) == (240, 160, 4)
    filled = [x for x, pixel in enumerate(rows[80]) if pixel[3]]
    assert abs(filled[0] - 20) <= 2 and abs(filled[-1] - 219) <= 2, (filled[0], filled[-1])
    column = [y for y, row in enumerate(rows) if row[120][3]]
    assert abs(column[0] - 30) <= 2 and abs(column[-1] - 129) <= 2, (column[0], column[-1])
    cut = f"--plane=section:{FAR[0]},{FAR[1] - 1},{FAR[0]},{FAR[1] + 1}"  # looks along -x; the near half of the room is cut away
    cli.run("draw", "room.ply", cut, "--extent=1,0.8", "--depth=0,0.2", "--pixel=0.005", "-o", "cut.png")
    _, _, _, rows = cli.read_png("cut.png")
    assert not rows[80][100][3] and any(pixel[3] for pixel in rows[80]), "the far wall is beyond the depth, the side walls are not"
    done = cli.run("draw", "room.ply", "--plane=elevation:0,5", "--pixel=0.01", "-o", "no_cut.dxf", "-o", "front.png", code=1)
    assert "meets no surface" in done.stderr and cli.read_png("front.png")[0] > 10, "an image needs no surface in the plane"
    assert not (cli.FOLDER / "no_cut.dxf").exists()


def slope(name):
    """Ground of 10 m x 6 m that rises by 1 : 5 from a height of 30 m."""
    dice = random.Random(6)
    ground = [(x, y, round(0.2 * x + 30, 5)) for x, y in ((round(dice.uniform(0, 10), 4), round(dice.uniform(0, 6), 4)) for _ in range(20000))]
    return cli.write_ply(name, ground)


def test_draw_contours():
    """Of a slope, as straight lines at heights of the world; the plane is above the ground and cuts nothing."""
    slope("slope.ply")
    done = cli.run("draw", "slope.ply", "--plane=plan:40", "--contours=0.2", "--scale=100", "-o", "slope.dxf")
    assert "contours of" in done.stderr and "cut lines" not in done.stderr, done.stderr
    _, _, lines = read_dxf("slope.dxf")
    assert len(lines) == 9 and sum(line[8] == ["contour-index"] for line in lines) == 1
    for line in lines:
        places = world(line)
        height = 0.2 * places[0][0] + 30
        assert abs(height / 0.2 - round(height / 0.2)) < 0.02 and all(abs(place[0] - places[0][0]) < 0.01 for place in places), places
        assert line[8] == ["contour-index" if round(height / 0.2) % 5 == 0 else "contour"]
        assert max(place[1] for place in places) - min(place[1] for place in places) > 5.5
    cli.run("draw", "slope.ply", "--plane=plan:40", "--contours=0", "-o", "slope.dxf", code=2)


def test_draw_wrong_use():
    room("room.ply")
    cli.write_ply("empty.ply", [])
    plan = f"plan:{FAR[2] + 0.25}"
    for arguments, code, said in (
            ((), 2, "no file given"), (("room.ply", "-o", "a.dxf"), 2, "no plane given"), (("room.ply", "--plane", plan), 2, "nothing to do"),
            (("room.ply", "--plane", "frame:0,0,nan,1,0,0,0,0,1", "-o", "a.dxf"), 2, "is no value for option '--plane'"),
            (("room.ply", "--plane", "section:1,2,1,2", "-o", "a.dxf"), 2, "is no value for option '--plane'"),
            (("room.ply", "--plane", "frame:0,0,0,1,0,0,2,0,0", "-o", "a.dxf"), 2, "zero or parallel"),
            (("room.ply", "--plane", plan, "--scale=0", "-o", "a.dxf"), 2, "'0' is no value for option '--scale'"),
            (("room.ply", "--plane", plan, "--extent=1", "-o", "a.dxf"), 2, "'1' is no value for option '--extent'"),
            (("room.ply", "--plane", plan, "-o", "a.xyz"), 2, "written as .dxf, .svg, .geojson, .pdf, .png or .tif"),
            (("room.ply", "--plane", plan, "--flat=1", "-o", "a.dxf"), 2, "takes no value"),
            (("room.ply", "--plane", plan, "--size", "3", "-o", "a.dxf"), 2, "there is no option '--size'"),
            (("room.ply", "--plane", "plan:0", "-o", "a.dxf"), 1, "meets no surface"),
            (("room.ply", "--plane", plan, "--pixel=1e-6", "-o", "a.png"), 1, "at most 65536"),
            (("empty.ply", "--plane", plan, "-o", "a.dxf"), 1, "no points"), (("room.ply", "--plane", plan, "-o", "no/a.dxf"), 1, "cannot be written"),
            (("missing.ply", "--plane", plan, "-o", "a.dxf"), 1, "missing.ply")):
        (cli.FOLDER / "a.dxf").write_text("kept", encoding="ascii")
        done = cli.run("draw", *arguments, code=code)
        assert said in done.stderr, (arguments, done.stderr)
        assert (cli.FOLDER / "a.dxf").read_text(encoding="ascii") == "kept" and not (cli.FOLDER / "a.png").exists()
