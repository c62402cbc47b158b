# SPDX-License-Identifier: GPL-3.0-or-later
"""Distances between clouds and heights above ground on the command line: tests that test_cli.py runs."""

import math
import random
import struct

import cli


def columns(name):
    """{property: values} of a binary PLY that the command line wrote."""
    header, rows = (cli.FOLDER / name).read_bytes().split(b"end_header\n")
    properties = [line.split()[1:] for line in header.decode().splitlines() if line.startswith("property")]
    row = struct.Struct("<" + "".join({"float": "f", "double": "d", "uchar": "B"}[kind] for kind, _ in properties))
    assert len(rows) % row.size == 0
    return dict(zip([name for _, name in properties], zip(*row.iter_unpack(rows), strict=True), strict=True))


def plane(name, height, origin=(0, 0, 0), side=60):
    chance = random.Random(height)
    points = [(x / side + origin[0], y / side + origin[1], height + chance.gauss(0, 0.002) + origin[2]) for x in range(side) for y in range(side)]
    return cli.write_ply(name, points, [(10, 20, 30)] * len(points), kind="double")


def test_distance():
    for origin in ((0, 0, 0), (500000, 5000000, 300)):
        plane("one.ply", 0.0, origin), plane("two.ply", 0.04, origin)
        done = cli.run("distance", "one.ply", "two.ply", "-o", "far.ply", "--registration-error", "0.001")
        found = columns("far.ply")
        assert list(found)[:3] == ["x", "y", "z"] and list(found)[-2:] == ["m3c2_distance", "m3c2_interval"], list(found)
        assert found["red"][0] == 10 and len(found["x"]) == 3600 and min(found["x"]) == origin[0]
        known = [value for value in found["m3c2_distance"] if math.isfinite(value)]
        assert len(known) == 3600 and abs(sum(known) / 3600 - 0.04) < 2e-4, sum(known) / len(known)
        assert all(1.96e-3 < value < 5e-3 for value in found["m3c2_interval"]), max(found["m3c2_interval"])
        assert "measured     3600 of 3600 points" in done.stdout and "significant  3600" in done.stdout, done.stdout
    cli.run("distance", "far.ply", "two.ply", "-o", "far.ply", "--depth", "0.01")  # replaces its columns
    found = columns("far.ply")
    assert len(found) == 9 and all(math.isnan(value) for value in found["m3c2_distance"]), list(found)
    assert "m3c2_distance" in cli.run("info", "far.ply").stdout
    for arguments in (["one.ply", "-o", "x.ply"], ["one.ply", "two.ply"], ["one.ply", "two.ply", "one.ply", "-o", "x.ply"],
                      ["one.ply", "two.ply", "-o", "x.ply", "--cylinder", "-1"], ["one.ply", "two.ply", "-o", "x.ply", "--cell", "1"]):
        cli.run("distance", *arguments, code=2)
    assert "nothing.ply" in cli.run("distance", "one.ply", "nothing.ply", "-o", "never.ply", code=1).stderr
    cli.write_ply("empty.ply", [])
    assert "empty.ply: no points" in cli.run("distance", "one.ply", "empty.ply", "-o", "never.ply", code=1).stderr
    assert not (cli.FOLDER / "never.ply").exists()


def test_ground():
    chance, points, above = random.Random(3), [], []
    for _ in range(20000):
        x, y = chance.uniform(0, 60), chance.uniform(0, 60)
        above.append(5.0 if 20 < x < 32 and 20 < y < 34 else 0.0)
        points.append((x + 500000, y, 0.3 * x + above[-1]))
    cli.write_ply("site.ply", points, kind="double")
    done = cli.run("ground", "site.ply", "-o", "above.ply", "--cell", "1", "--threshold", "0.5")
    found = columns("above.ply")["height_above_ground"]
    assert all(abs(a - b) < 0.6 for a, b in zip(found, above, strict=True)), max(abs(a - b) for a, b in zip(found, above, strict=True))
    assert f"ground       {above.count(0.0)} of 20000 points" in done.stdout, done.stdout
    assert "2^26" in cli.run("ground", "site.ply", "-o", "x.ply", "--cell", "0.001", code=1).stderr
    for arguments in (["-o", "x.ply"], ["site.ply"], ["site.ply", "-o", "x.ply", "--cell"]):
        cli.run("ground", *arguments, code=2)
