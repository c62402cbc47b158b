# SPDX-License-Identifier: GPL-3.0-or-later
"""Of the command line: trust, as an option, a ramp and a pass; what says how many points were left out, and that none is trusted."""

import json
import random

import cli

VIEW = ("--size", "64x64", "--smooth", "off", "--antialias", "off", "--fill", "off", "--unlit")


def strays(name, count, ball):
    """So many points at random far around a ball of points."""
    draw = random.Random(4)
    points = [tuple(draw.uniform(-3.0, 3.0) for _ in range(3)) for _ in range(count)]
    if ball:
        cli.ball("inner.ply", ball)
        points += [tuple(map(float, line.split()[:3])) for line in _rows("inner.ply")]
    return cli.write_ply(name, points)


def _rows(name):
    """The lines of points of an ASCII PLY, else those that convert writes."""
    text = (cli.FOLDER / name).read_bytes()
    head, _, body = text.partition(b"end_header\n")
    assert b"ascii" in head, head
    return body.decode().splitlines()


def test_ramp_of_trust():
    """It shows what the pass shows, with vectors and without; --hide-kinds stray is refused, for --trust leaves strays out."""
    strays("around.ply", 100, 3000)

    def at(*arguments):
        cli.run("render", "around.ply", "-o", "trust.png", *VIEW, "--trust", "0", *arguments)
        return cli.read_png("trust.png")[3]

    gray = ("--ramp-colors", "grey")
    wanted = at("--pass", "trust", *gray)
    assert len({pixel[0] for row in wanted for pixel in row}) > 4
    for device in ("cpu", "cpu-scalar"):
        assert at("--ramp", "trust", *gray, "--device", device) == wanted, device
    assert at("--ramp", "trust,0,0.5", *gray) != wanted
    assert "--ramp trust" in cli.run("render", "around.ply", "-o", "x.png", "--ramp", "trust", "--analysis", "off", code=2).stderr
    assert "--trust" in cli.run("render", "around.ply", "-o", "x.png", "--hide-kinds", "stray", code=2).stderr


def test_left_out_is_said():
    """In the report line and in the statistics."""
    strays("around.ply", 100, 3000)
    done = cli.run("render", "around.ply", "-o", "x.png", *VIEW, "--stats", "json")
    told = json.loads(done.stdout)
    assert 50 < told["untrusted"] < 200 and told["none_trusted"] == 0, told
    assert f"3100 points ({told['untrusted']} left out for their trust)" in done.stderr, done.stderr
    done = cli.run("render", "around.ply", "-o", "x.png", *VIEW, "--trust", "0", "--stats", "json")
    assert json.loads(done.stdout)["untrusted"] == 0 and "left out" not in done.stderr


def test_none_is_trusted():
    """All are drawn or written, and one warning says so."""
    strays("alone.ply", 60, 0)
    levels = [1.0 - ((15 - level) / 15) ** 2 for level in range(16)]
    drawn = {}
    for least in (0.0, *levels[1:]):
        done = cli.run("render", "alone.ply", "-o", "alone.png", *VIEW, "--trust", f"{least:.6f}", "--stats", "json")
        drawn[least] = (cli.read_png("alone.png")[3], json.loads(done.stdout), done.stderr.count("alone.ply: none of 60 points is trusted"))
    everything = drawn[0.0][0]
    none = [least for least in drawn if drawn[least][1]["none_trusted"]]
    assert none and drawn[1.0][1]["none_trusted"] in (0, 60), "no threshold leaves all of them out"
    for least, (picture, told, warnings) in drawn.items():
        assert warnings == (least in none) and told["none_trusted"] == 60 * (least in none), (least, told)
        assert (picture == everything) or least not in none, least
    assert not drawn[0.0][2]


def test_the_file_is_named():
    """Of two files, the warning names the one in which no point is trusted."""
    strays("alone.ply", 60, 0)
    cli.ball("whole.ply", 3000)
    done = cli.run("render", "whole.ply", "alone.ply", "-o", "x.png", *VIEW, "--trust", "1")
    warned = [line for line in done.stderr.splitlines() if "is trusted, so all of them are drawn" in line]
    assert len(warned) == 1 and "alone.ply: none of 60 points" in warned[0], done.stderr
