# SPDX-License-Identifier: GPL-3.0-or-later
"""Analysis, free space and passes on the command line: tests that test_cli.py runs."""

import json
import math

import cli


def test_analyse_writes_columns():
    cli.ball("analyse.ply", 3000, origin=(1000, 0, 0))
    done = cli.run("analyse", "analyse.ply", "-o", "known.ply", "--neighbours", "12")
    counts = dict(line.split() for line in done.stdout.splitlines())
    assert int(counts["surface"]) > 2900, counts
    header, rows = (cli.FOLDER / "known.ply").read_bytes().split(b"end_header\n")
    names = [line.split()[-1].decode() for line in header.splitlines() if line.startswith(b"property")]
    assert names == ["x", "y", "z", "nx", "ny", "nz", "spacing", "radius", "radius_minor", "sigma", "trust", "kind",
                     "seen_through"], names
    assert b"element vertex 3000" in header and len(rows) % 3000 == 0
    assert "points      3000" in cli.run("info", "known.ply").stdout
    assert 0 <= int(counts["untrusted"]) < 10, counts
    cli.run("analyse", "analyse.ply", "-o", "trusted.ply", "--neighbours", "12", "--trusted")
    assert f"points      {3000 - int(counts['untrusted'])}" in cli.run("info", "trusted.ply").stdout
    for arguments in (["analyse"], ["analyse", "analyse.ply"], ["analyse", "analyse.ply", "-o", "x.ply", "--neighbours", "99"]):
        cli.run(*arguments, code=2)


def test_analysis_is_timed_and_can_be_left_out():
    cli.ball("timed.ply", 5000)
    on, off = (json.loads(cli.run("render", "timed.ply", *cli.FRONT, "--stats", "json", "--analysis", word).stdout) for word in ("on", "off"))
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
    (cli.FOLDER / path).write_text("\n".join(str(line) for line in lines) + "\n")


def test_free_space():
    two_stations("stations.ptx")
    counts = dict(line.split() for line in cli.run("analyse", "stations.ptx", "-o", "seen.ply").stdout.splitlines())
    assert int(counts["seen_through"]) == 1, counts

    def at(*arguments):
        cli.run("render", "stations.ptx", "-o", "seen.png", "--size", "64x64", "--look", "-0.8,0,0,-0.8,3,0,40", "--fill", "off", "--smooth",
            "off", "--antialias", "off", "--trust", "0", *arguments)  # the stray shows
        return [pixel[:3] for row in cli.read_png("seen.png")[3] for pixel in row]

    off, shown, used = (at("--free-space", word) for word in ("off", "show", "use"))
    assert off != shown != used != off
    assert sum(pixel[0] > 200 and pixel[1] < 60 for pixel in shown) == 1 and not sum(pixel[1] < 60 < pixel[0] for pixel in used)
    assert at("--hide-kinds", "surface,border") != off and at("--trust", "1") != off
    cli.ball("alone.ply", 1000)
    assert "stations" in cli.run("render", "alone.ply", *cli.FRONT, "-o", "x.png", "--free-space", "use", code=1).stderr
    for arguments in (["--free-space", "maybe"], ["--hide-kinds", "surface,cheese"], ["--hide-kinds", "stray"], ["--hide-kinds", ""], ["--trust", "2"],
                      ["--free-space", "use", "--analysis", "off"]):
        cli.run("render", "alone.ply", *cli.FRONT, "-o", "x.png", *arguments, code=2)


def test_passes():
    """A pass takes the colours' place where something is; the background stays."""
    two_stations("stations.ptx")
    view = ("--size", "96x64", "--look", "-0.8,0,0,-0.8,3,0,40", "--smooth", "off", "--antialias", "off")

    def at(*arguments):
        done = cli.run("render", "stations.ptx", "-o", "pass.png", *view, *arguments)
        return done.stderr, [pixel for row in cli.read_png("pass.png")[3] for pixel in row]

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
        cli.run("render", "stations.ptx", "-o", "x.png", *arguments, code=2)
    cli.run("render", "stations.ptx", "--pass", "depth", "--repeat", "1", code=2)
