# SPDX-License-Identifier: GPL-3.0-or-later
"""GeoTIFFs of drawings: tests that test_cli.py runs. judge_raster.py reads them with rasterio, in the environment of build/setup; without it
these tests are skipped."""

import json
import math
import os
import subprocess
from pathlib import Path

import cli
from runs import Skip

FAR = (5000000.0, 4999000.0, 250.0)
SPACING, PIXEL = 0.005, 0.02
SIZE, INNER = (1.0, 0.6), (0.4, 0.24)  # of a board, and the corner that four colors share, from its lower left corner
JUDGES = Path(__file__).resolve().parents[2] / "build/out/judges" / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
COLORS = {(0, 0): (255, 0, 0), (1, 0): (0, 255, 0), (0, 1): (0, 0, 255), (1, 1): (255, 255, 0)}


def board(name, right, up, away=0.0):
    """A flat board of four colors, whose lower left corner is FAR. away: how far its right half is before the left one."""
    normal = [right[(k + 1) % 3] * up[(k + 2) % 3] - right[(k + 2) % 3] * up[(k + 1) % 3] for k in range(3)]
    points, colors = [], []
    for i in range(round(SIZE[0] / SPACING)):
        for j in range(round(SIZE[1] / SPACING)):
            x, y = (i + 0.5) * SPACING, (j + 0.5) * SPACING
            lift = away * (x > INNER[0])
            points.append(tuple(round(FAR[k] + x * right[k] + y * up[k] + lift * normal[k], 6) for k in range(3)))
            colors.append(COLORS[int(x > INNER[0]), int(y > INNER[1])])
    return cli.write_ply(name, points, colors, kind="double")


def judge(*paths, places=()):
    """What rasterio reads: of each path its profile, and the pixels at places half a pixel beside each corner."""
    if not JUDGES.exists():
        raise Skip("rasterio is missing: build/setup installs it where it can")
    script = Path(__file__).resolve().parent / "judge_raster.py"
    done = subprocess.run([str(JUDGES), str(script)], input=json.dumps({"paths": [str(cli.FOLDER / path) for path in paths], "places": places}),
                          capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def corners(place):
    """(place, whether the board is there) half a pixel to each side of the board's corners. place: of coordinates on the board."""
    found = []
    for x in (0.0, INNER[0], SIZE[0]):
        for y in (0.0, INNER[1], SIZE[1]):
            for dx in (-0.5, 0.5):
                for dy in (-0.5, 0.5):
                    u, v = x + dx * PIXEL, y + dy * PIXEL
                    found.append((place(u, v), 0 < u < SIZE[0] and 0 < v < SIZE[1]))
    return found


def profiles(place):
    """Places of ten pixels to each side of where colors change: along the board's width, then along its height."""
    return [place(INNER[0] + (i + 0.5) * PIXEL, 0.11) for i in range(-10, 10)] + [place(0.21, INNER[1] + (i + 0.5) * PIXEL) for i in range(-10, 10)]


def check_colors(told, expected, most):
    """The board is where the corners expect it. Its colors change, red to green and red to blue, within half a pixel of where they do."""
    for values, (place, on) in zip(told["values"][:len(expected)], expected, strict=True):
        assert values[3] > 0 if on else values[3] < most / 2, (place, values)  # borders are smoothed
    for first, channel in ((0, 1), (20, 2)):
        lights = [[(value / most) ** 2.2 for value in values] for values in told["values"][len(expected) + first:][:20]]
        reds = sum(light[0] / (light[0] + light[channel]) for light in lights)
        assert abs(reds - 10) <= 0.5001 and lights[0][channel] < 0.01 < 0.1 < lights[0][0], (channel, reds, lights[0])


def draw(name, *options, **more):
    return cli.run("draw", "board.ply", f"--extent={SIZE[0] + 0.4},{SIZE[1] + 0.4}", f"--pixel={PIXEL}", "-o", name, *options, **more)


def test_geotiff_of_a_plan():
    """In the cloud's coordinate system, at coordinates around 5,000,000: every corner of the board is where it was, to half a pixel."""
    board("board.ply", (1, 0, 0), (0, 1, 0))
    draw("plan.tif", "--plane", f"plan:{FAR[2] + 0.1}", "--crs=EPSG:25832", "--mask", "--depth-map")
    expected, steps = (places(lambda u, v: (FAR[0] + u, FAR[1] + v)) for places in (corners, profiles))
    plan, depth, mask = judge("plan.tif", "plan-depth.tif", "plan-mask.tif", places=[place for place, _ in expected] + steps)
    assert plan["epsg"] == depth["epsg"] == mask["epsg"] == 25832 and plan["types"] == ["uint8"] * 4 and plan["area"] == "Area"
    assert depth["types"] == ["float32"] and math.isnan(depth["nodata"]) and mask["types"] == ["uint8"]
    check_colors(plan, expected, 255)
    for (distance,), (measured,), (_, on) in zip(depth["values"], mask["values"], expected, strict=False):
        assert measured == on and math.isnan(distance) != on, (distance, measured)
        assert not on or abs(distance + 0.1) < 1e-6, distance
    a, d, b, e, x, y = map(float, (cli.FOLDER / "plan.tfw").read_text(encoding="ascii").split())
    transform = plan["transform"]
    assert [a, b, d, e] == [transform[0], transform[1], transform[3], transform[4]]
    assert abs(x - transform[2] - a / 2) < 1e-9 and abs(y - transform[5] - e / 2) < 1e-9, "a world file tells the middle of the pixel"
    assert plan["prj"] == 25832
    draw("local.tif", "--plane", f"plan:{FAR[2] + 0.1}", "--bits=16")
    (local,) = judge("local.tif", places=[place for place, _ in expected] + steps)
    assert local["epsg"] is None and local["crs"].startswith('LOCAL_CS["Local coordinates') and local["types"] == ["uint16"] * 4
    assert local["transform"] == transform and not (cli.FOLDER / "local.prj").exists()
    check_colors(local, expected, 65535)


def test_geotiff_of_a_turned_plan():
    """Its rows are not along an axis of the coordinate system."""
    right, up = (0.8, 0.6, 0), (-0.6, 0.8, 0)
    board("board.ply", right, up)
    middle = [FAR[k] + SIZE[0] / 2 * right[k] + SIZE[1] / 2 * up[k] for k in range(3)]
    frame = ",".join(map(str, (*middle[:2], FAR[2] + 0.1, *right, *up)))
    draw("turned.tif", f"--plane=frame:{frame}", "--crs=EPSG:32632", "--mask")
    expected, steps = (places(lambda u, v: tuple(FAR[k] + u * right[k] + v * up[k] for k in range(2))) for places in (corners, profiles))
    turned, mask = judge("turned.tif", "turned-mask.tif", places=[place for place, _ in expected] + steps)
    assert turned["epsg"] == turned["prj"] == 32632
    check_colors(turned, expected, 255)
    for (measured,), (place, on) in zip(mask["values"], expected, strict=False):
        assert measured == on, (place, measured)


def test_geotiff_of_a_section():
    """On the plane: x is the distance from where the section begins, y the height. The sidecar leads back into the world."""
    right = (0.8, 0.6, 0)
    board("board.ply", right, (0, 0, 1), away=-0.25)
    begin = [FAR[k] - 0.2 * right[k] + 0.1 * (0.6, -0.8)[k] for k in range(2)]  # 0.1 before the board's left half
    end = [begin[k] + 1.4 * right[k] for k in range(2)]
    draw("wall.tif", "--plane", "section:" + ",".join(map(str, begin + end)), "--depth-map", "--crs=EPSG:25832")
    expected, steps = (places(lambda u, v: (u + 0.2, FAR[2] + v)) for places in (corners, profiles))
    wall, depth = judge("wall.tif", "wall-depth.tif", places=[place for place, _ in expected] + steps)
    assert wall["epsg"] is None and wall["crs"].startswith('LOCAL_CS["Coordinates on a plane')
    check_colors(wall, expected, 255)
    frame = json.loads((cli.FOLDER / "wall.json").read_text(encoding="utf-8"))
    assert frame["crs"] == "EPSG:25832" and frame["scale"] == 50
    for ((x, y), on), (distance,) in zip(expected, depth["values"], strict=False):
        place = [frame["origin"][k] + x * frame["right"][k] + y * frame["up"][k] for k in range(3)]
        u, v = x - 0.2, y - FAR[2]
        assert math.dist(place, (begin[0] + x * right[0], begin[1] + x * right[1], FAR[2] + v)) < 1e-6
        assert math.isnan(distance) != on, (x, y, distance)
        assert not on or abs(distance + 0.1 + 0.25 * (u > INNER[0])) < 1e-5, distance


def test_geotiff_wrong_use():
    """One message each, and a file from before stays."""
    board("board.ply", (1, 0, 0), (0, 1, 0))
    for options, code, said in ((["--crs=EPSG:4326"], 2, "is no value for option '--crs'"), (["--crs=25832"], 2, "is no value for option '--crs'"),
                                (["--bits=12"], 2, "is no value for option '--bits'"), (["--pixel=1e-6"], 1, "at most 65536")):
        (cli.FOLDER / "kept.tif").write_text("kept", encoding="ascii")
        done = cli.run("draw", "board.ply", "--plane=plan:250.1", "-o", "kept.tif", *options, code=code)
        assert said in done.stderr and len([line for line in done.stderr.splitlines() if line]) <= 2, done.stderr
        assert (cli.FOLDER / "kept.tif").read_text(encoding="ascii") == "kept" and not (cli.FOLDER / "kept.tfw").exists()
    for option in ("--mask", "--depth-map", "--bits=16"):
        assert "add -o OUT.tif" in cli.run("draw", "board.ply", "--plane=plan:250.1", "-o", "a.png", option, code=2).stderr
    assert "cannot be written" in cli.run("draw", "board.ply", "--plane=plan:250.1", "-o", "no/a.tif", code=1).stderr
