# SPDX-License-Identifier: GPL-3.0-or-later
"""GeoJSON of plans: tests that test_cli.py runs. judge_maps.py reads it with GDAL, in the environment of build/setup; without it that part is
skipped."""

import json
import math
import subprocess
from pathlib import Path

import cli
import cli_drawings
import cli_rasters
from cli_drawings import FAR
from runs import Skip

PLAN = f"plan:{FAR[2] + 0.25}"


def judge(path):
    """What GDAL reads: the code of the system, and for each line its layer and its vertices."""
    if not cli_rasters.JUDGES.exists():
        raise Skip("pyogrio is missing: build/setup installs it where it can")
    script = Path(__file__).resolve().parent / "judge_maps.py"
    done = subprocess.run([str(cli_rasters.JUDGES), str(script), str(cli.FOLDER / path)], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_geojson_of_a_plan():
    """The same vertices as in DXF, within 10 micrometers at coordinates of 5,000,000; a closed line ends where it begins."""
    cli_drawings.room("room.ply")
    cli.run("draw", "room.ply", "--plane", PLAN, "--scale=20", "--extent=2,1", "--crs=EPSG:25832", "-o", "plan.geojson", "-o", "plan.dxf")
    whole = json.loads((cli.FOLDER / "plan.geojson").read_text(encoding="ascii"))
    assert whole["crs"]["properties"]["name"] == "urn:ogc:def:crs:EPSG::25832"
    (feature,) = whole["features"]
    places = feature["geometry"]["coordinates"]
    assert feature["geometry"]["type"] == "LineString" and feature["properties"] == {"layer": "cut"}
    ((expected, closed),) = cli_drawings.read_polylines("plan.dxf", "cut")
    assert closed and places[0] == places[-1] and len(places) == len(expected) + 1
    assert all(math.dist(place, other) < 1e-5 for place, other in zip(places, expected, strict=False)), (places, expected)
    read = judge("plan.geojson")
    assert read["epsg"] == "EPSG:25832" and read["lines"] == [["cut", places]], read


def test_geojson_of_contours():
    """Each contour is at its height, in GeoJSON and in DXF, wherever the plane is."""
    cli_drawings.slope("slope.ply")
    cli.run("draw", "slope.ply", "--plane=plan:40", "--contours=0.2", "--scale=100", "--crs=EPSG:25832", "-o", "slope.geojson", "-o", "slope.dxf")
    lines = json.loads((cli.FOLDER / "slope.geojson").read_text(encoding="ascii"))["features"]
    drawn = [line for layer in ("contour", "contour-index") for line, _ in cli_drawings.read_polylines("slope.dxf", layer)]
    for vertices in [line["geometry"]["coordinates"] for line in lines] + drawn:
        assert all(abs(z - 30 - 0.2 * x) < 0.002 and abs(z / 0.2 - round(z / 0.2)) < 1e-6 for x, _, z in vertices), vertices
    assert len(lines) == len(drawn) == 9


def test_geojson_refused():
    """Before any work, and an earlier file stays."""
    cli_drawings.room("room.ply")
    turned = f"frame:{FAR[0]},{FAR[1]},{FAR[2]},1,0,0,0,1,0.1"
    for plane, crs, code, said in ((PLAN, (), 2, "add --crs EPSG:N"), ("elevation:0", ("--crs=EPSG:25832",), 2, "use --plane plan:Z"),
                                   (turned, ("--crs=EPSG:25832",), 1, "this plane is not horizontal")):
        (cli.FOLDER / "a.geojson").write_text("kept", encoding="ascii")
        done = cli.run("draw", "room.ply", "--plane", plane, *crs, "--extent=2,1", "-o", "a.geojson", code=code)
        assert said in done.stderr and (cli.FOLDER / "a.geojson").read_text(encoding="ascii") == "kept", done.stderr
