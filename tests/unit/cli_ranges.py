# SPDX-License-Identifier: GPL-3.0-or-later
"""Range images and scans on the command line: tests that test_cli.py runs."""

import json
import re

import cli


def test_info_of_saved_scans():
    """What the add-on's PLYs tell of scans; where a line lies, or points of a scan are scattered, all of it is left out, and a message says
    which scan it is; the points are there."""
    head = "ply\nformat ascii 1.0\n"
    body = "".join(f"property float {name}\n" for name in ("x", "y", "z", "scan")) + "end_header\n"
    pose = "0 -1 0 5 1 0 0 6 0 0 1 7"
    lines = [f"obj_info patina_scan 5 4 0.25 0 0 -1 at 5 6 7 {pose} the first one\n", f"obj_info patina_scan 0 0 0 0 0 0 nowhere 0 0 0 {pose}\n"]

    def told(lines, of):
        (cli.FOLDER / "saved.ply").write_text(head + "".join(lines) + f"element vertex {len(of)}\n" + body + "".join(f"{i} {i * i} 0 {s}\n" for i, s in enumerate(of)))
        done = cli.run("info", "saved.ply")
        assert f"points      {len(of)}" in done.stdout
        return done

    good = told(lines, [0, 0, 0, 1, 1]).stdout
    assert "scan 0      the first one, 3 points, grid 5 x 4, interval 0.25, from 5 6 7, looking 0.000 0.000 -1.000" in good, good
    assert re.search(r"scan 1 +(unnamed, )?2 points", good), good
    one = told(lines[:1], [0, 0])
    assert "scan 0      the first one, 2 points" in one.stdout
    wrong = {"2 0 0 0 0 2 0 0 0 0 9 0": "scan 0", "0 -1 0 5 1 0 0 6 0 0 1": "scan 0", "0 -1 0 5 1 0 0 6 0 0 nan 7": "scan 0"}
    for matrix, words in wrong.items():
        done = told([lines[0].replace(pose, matrix), lines[1]], [0, 0, 1])
        assert f"{words} is none" in done.stderr and "scan 0 " not in done.stdout, (done.stderr, done.stdout)
    for line in ("obj_info patina_scan 5 4 -1 0 0 -1 at 5 6 7", "obj_info patina_scan 5 4.5 1 0 0 -1 at 5 6 7", "obj_info patina_scan 5 4 1 0 0 -9 at 5 6 7",
                 "obj_info patina_scan 5 4 1 0 0 -1 here 5 6 7"):
        assert "scan 1 is none" in told([lines[0], f"{line} {pose} bad\n"], [0, 1]).stderr, line
    done = told(lines, [0, 1, 0, 1])
    assert "do not lie one behind the other" in done.stderr and "scan 0 " not in done.stdout, done.stderr
    assert "grid 5 x 4" in told(lines, [0, 9, 1]).stdout, "points of no scan are of none"
    assert "patina_scan" not in told(["obj_info patina_scan\n"], [0]).stderr


def facing_walls(name):
    """Two range images of a wall of 2 x 2: one looks to -z at the wall's place, the other, below it, to z."""
    grid = "".join(f"{u / 20 - 1} {v / 20 - 1} 0\n" for v in range(41) for u in range(41)) + "".join(f"1 {i}\n" for i in range(1681))
    (cli.FOLDER / f"{name}.ply").write_text(
        "ply\nformat ascii 1.0\nobj_info num_cols 41\nobj_info num_rows 41\nelement vertex 1681\nproperty float x\nproperty float y\n"
        "property float z\nelement range_grid 1681\nproperty list uchar int vertex_indices\nend_header\n" + grid)
    (cli.FOLDER / f"{name}.conf").write_text(f"bmesh {name}.ply 0 0 0 0 0 0 1\nbmesh {name}.ply 0 0 -1 0 1 0 0\n")
    return f"{name}.conf"


AS_RANGES = ("--size", "64x64", "--surface", "ranges", "--transparent")


def test_range_culling():
    """Scans that looked the other way are left out whole: of two walls, the one that a view from above cannot have seen, and with a
    turned view the other. Without directions there is a warning; without the mode, and beyond 180 degrees, a refusal."""
    walls = facing_walls("walls")

    def look(eye, *arguments):
        cli.run("render", walls, "-o", "culled.png", *AS_RANGES, "--look", f"{eye},0,0,0,30", "--pass", "depth,0,8", *arguments)
        return [pixel for row in cli.read_png("culled.png")[3] for pixel in row]

    above, culled = look("0.01,0,6"), look("0.01,0,6", "--range-culling", "90")
    assert above == culled and any(pixel[3] for pixel in above)
    below, culled = look("0.01,0,-6"), look("0.01,0,-6", "--range-culling", "90")
    assert below == culled != above, "from below the lower wall is the nearer one"
    beyond = look("0.01,0,-0.8"), look("0.01,0,-0.8", "--range-culling", "90")
    assert beyond[0] != beyond[1] and not any(pixel[3] for pixel in beyond[1]), "between the walls, the upper one is seen from behind"
    assert look("0.01,0,-0.8", "--range-culling", "180") == beyond[0]
    assert "in which direction" in cli.run("render", cli.ball("bare_ball.ply", 1000), "-o", "x.png", *AS_RANGES, "--range-culling", "90").stderr
    for wrong in (["--range-culling", "181"], ["--range-culling", "0"], ["--range-culling", "left"]):
        assert "--range-culling" in cli.run("render", walls, "-o", "x.png", *AS_RANGES, *wrong, code=2).stderr
    assert "--surface ranges" in cli.run("render", walls, "-o", "x.png", "--range-culling", "90", code=2).stderr


def test_layer_distance():
    """What lies nearer together than it is one layer: of two walls of glass a quarter of the light comes through, then half."""
    walls = facing_walls("glass")
    for surface in ("ranges", "fill"):
        shares = []
        for distance in ("0.2", "3"):
            cli.run("render", walls, "-o", "glass.png", *AS_RANGES, "--look", "0,0.01,6,0,0,0,10", "--surface", surface, "--opacity", "0.5", "--unlit",
                "--layer-distance", distance)
            shares.append(cli.read_png("glass.png")[3][32][32][3] / 255)
        assert abs(shares[0] - 0.75) < 0.01 and abs(shares[1] - 0.5) < 0.01, (surface, shares)
    assert "--layer-distance" in cli.run("render", walls, "-o", "x.png", "--layer-distance", "-1", code=2).stderr


def test_range_images_are_not_analysed():
    """Nothing asks for it, and with cells and gamma of one's own, or automatic ones, the picture is that with it; what hides points by
    their kinds, and trust, ask for it."""
    cli.ball("round.ply", 5000)

    def at(*arguments):
        told = json.loads(cli.run("render", "round.ply", "-o", "round.png", *cli.FRONT, "--surface", "ranges", "--stats", "json", *arguments).stdout)
        return cli.read_png("round.png")[3], told["analysis_ms"]

    bare, analysed = at(), at("--analysis", "on")
    assert not bare[1] and analysed[1] and bare[0] == analysed[0], (bare[1], analysed[1])
    assert at("--range-pixel", "3", "--range-gamma", "0.05")[0] == at("--range-pixel", "3", "--range-gamma", "0.05", "--analysis", "on")[0]
    assert at("--hide-kinds", "line")[1] and at("--trust", "0.5")[1] and at("--ramp", "trust")[1] and at("--pass", "trust")[1] and at("--soft", "base")[1] and not at("--cull")[1]
    assert json.loads(cli.run("render", "round.ply", *cli.FRONT, "--stats", "json").stdout)["analysis_ms"], "other surfaces are"
