# SPDX-License-Identifier: GPL-3.0-or-later
"""Statistics, plans and planes on the command line: tests that test_cli.py runs."""

import json
import os
import re
import signal
import subprocess
import time

import cli
from runs import Skip


def test_stats_of_opengl():
    """What a render asks of OpenGL: the same counts for each frame of one view, and as many bytes for as many points."""
    cli.ball("asked.ply")
    if subprocess.run([*cli.PATINA, "render", "asked.ply", "-o", "asked.png", "--size", "8x8", "--device", "gl-egl"], capture_output=True,
                      cwd=cli.FOLDER, timeout=300, check=False).returncode:
        raise Skip("there is no OpenGL device here")
    frames = [json.loads(cli.run("render", "asked.ply", "--stats", "json", "--repeat", "1", "--size", "64x48", "--device", "gl-egl").stdout)["gl"]
              for _ in range(2)]
    assert frames[0] == frames[1], frames
    counts = frames[0]
    assert set(counts) == {"dispatches", "empty", "barriers", "calls", "copies", "waits", "uploaded", "bytes"}, counts
    assert 0 < counts["dispatches"] <= counts["barriers"] <= counts["calls"] and counts["empty"] < counts["dispatches"], counts
    assert counts["waits"] >= 1 and counts["bytes"] > 20000 * 12, counts


def test_stats_of_passes():
    """What each pass asks for, which is no more than all of them do; a GPU has a time for each as well."""
    cli.ball("asked.ply")
    for device, kind in (("cpu", "cpu"), ("gl-egl", "gl")):
        done = subprocess.run([*cli.PATINA, "render", "asked.ply", "--stats", "json", "--repeat", "2", "--size", "64x48", "--device", device],
                              capture_output=True, text=True, cwd=cli.FOLDER, timeout=300, check=False, env={**os.environ, "PATINA_GL_AS": "hardware"})
        if done.returncode and kind == "gl":
            raise Skip("there is no OpenGL device here")
        stats = json.loads(done.stdout)
        assert {"scatter", "resolve", "fill", "tail"} <= stats["work"].keys() & stats["passes"].keys(), (device, stats["work"])
        assert "pixels" not in stats["passes"], stats["passes"]  # it is measured
        for name, total in stats[kind].items():
            asked = sum(one[name] for one in stats["work"].values())
            assert asked == total if name == "bytes" else asked <= total, (device, name, asked, total)
        assert all(one["bytes"] > 0 for one in stats["work"].values()), stats["work"]


def test_stats():
    cli.ball("stats.ply")
    done = cli.run("render", "stats.ply", "--stats", "json", "--repeat", "5", "--size", "320x200", "--device", "cpu")
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
        planes = json.loads(cli.run("render", "stats.ply", "--stats", "json", "--size", "320x200", "--device", "cpu", *more).stdout)["planes"]
        assert 320 * 200 * 16 < planes["held"] == planes["peak"], (more, planes)  # what was planned, and no more


def test_shadows():
    """A ball before a wall throws a shadow on it; kept shadows make the same picture; what does not fit is refused."""
    cli.ball("ball.ply", origin=(0, -1.6, 0))
    cli.wall("wall.ply", lambda x, z: (200, 200, 200))
    view = ("ball.ply", "wall.ply", "--lit", "--size", "64x64", "--look", "-6,-5,0,0,0,0", "--ortho", "6", "--sun", "0,0,4")
    cli.run("render", *view, "-o", "open.png")
    cli.run("render", *view, "-o", "dark.png", "--shadows", "--samples", "8")
    lit, dark = (sum(sum(sum(pixel) for pixel in row) for row in cli.read_png(name)[3]) for name in ("open.png", "dark.png"))
    assert dark < 0.96 * lit, (lit, dark)
    cli.run("render", *view, "--shadows", "--samples", "8", "--save-shadows", "kept")
    cli.run("render", *view, "-o", "kept.png", "--shadows", "--samples", "8", "--load-shadows", "kept")
    assert cli.read_png("kept.png") == cli.read_png("dark.png")
    refused = cli.run("render", *view, "-o", "x.png", "--shadows", "--samples", "9", "--load-shadows", "kept", code=1).stderr
    assert "stale" in refused and "8 samples" in refused, refused
    said = json.loads(cli.run("render", *view, "--shadows", "--shadow-error", "0.2", "--stats", "json").stdout)
    assert said["shadow_samples"] in (4, 8, 16, 32) and 0 < said["shadow_error"] <= 0.2, said
    assert "need --shadows" in cli.run("render", *view, "--save-shadows", "kept", code=2).stderr
    assert "no value" in cli.run("render", *view, "-o", "x.png", "--sun", "0,91", code=2).stderr


def test_colors_and_clips():
    """A wall whose left half is of class 2, the right of class 6: ramps, hidden classes, boxes."""
    step = 2 / 119
    rows = ["x,y,z,classification,rise"]
    rows += [f"{x * step - 1},0,{z * step - 1},{2 if x < 60 else 6},{10 * z}" for x in range(120) for z in range(120)]
    (cli.FOLDER / "wall.csv").write_text("\n".join(rows))
    view = ["--size", "64x64", "--look", "0,-3,0,0,0,0", "--unlit", "--background", "0,0,0", "--analysis", "off", "-o", "c.png"]
    left, right = (16, 32), (48, 32)

    def at(*arguments):
        cli.run("render", "wall.csv", *view, *arguments)
        rows = cli.read_png("c.png")[3]
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
    rows = cli.read_png("c.png")[3]
    assert rows[10][32][0] > 200 > 128 > rows[54][32][0], "by an attribute, brighter upwards"
    assert at("--color", "0.18,0.18,0.18", "--exposure", "1", "--contrast", "2") == at("--color", "0.72,0.72,0.72")
    along = ["--effect", "contour_source=attribute", "--contour", "600,2,1"]  # at 600, in the middle
    at("--color", "1,1,1", "--attribute", "rise", *along)
    rows = cli.read_png("c.png")[3]
    dark = [y for y in range(9, 55) if rows[y][32][0] < 100]
    assert dark and all(abs(y - 31.5) < 2.5 for y in dark), f"lines along an attribute on rows {dark}"
    drawn = cli.read_png("c.png")
    at("--ramp", "rise,-2,-1", "--ramp-colors", "grey", *along)
    assert cli.read_png("c.png")[3] == drawn[3], "along the ramp's attribute"
    refused = cli.run("render", "wall.csv", *view, "--ramp", "rise", "--attribute", "classification", *along, code=1).stderr
    assert "both are of one attribute" in refused, refused
    for arguments in (["--ramp", "nothing"], ["--ramp", "height", "--ramp-colors", "plaid"], ["--attribute", "nothing"]):
        assert "there is no" in cli.run("render", "wall.csv", *view, *arguments, code=1).stderr
    for arguments in (["--contrast", "-1"], ["--hide-classes", "2,x"], ["--clip-box", "1,2,3"], ["--clip-tint", "1,0,0,0"],
                      ["--ramp", "height,1"], ["--exposure", "99"]):
        cli.run("render", "wall.csv", *view, *arguments, code=2)


def test_skipped_passes_have_reasons():
    cli.ball("skipped.ply", 500)
    stats = json.loads(cli.run("render", "skipped.ply", "--stats", "json", "--smooth", "off", "--antialias", "off").stdout)
    assert {"smooth", "antialias"} <= stats["skipped"].keys(), stats


def test_plan():
    cli.ball("plan.ply", 500)
    text = cli.run("render", "plan.ply", "--dump-plan").stdout
    assert "scatter" in text and len(text.splitlines()) > 3
    text = cli.run("render", "plan.ply", "--dump-plan", "--shadows", "--opacity", "0.5", "--layers", "3").stdout
    lines = [line.split(None, 1)[0] + " " + line.split()[1] for line in text.splitlines()]
    for expected in ("fill KEYS", "loop samples", "loop faces", "plan map", "run scatter", "run shadow_test", "loop layers", "layer 2:",
                     "read TILES", "run peel", "layer 3:", "run compose"):
        assert expected in lines, (expected, text)
    assert re.search(r"memory [\d.]+ MB of planes at most: \d+ of them share \d+ slabs\n  slab [\d.]+ MB: [A-Z_]+ \d \(\d+ to \d+\)", text), text
    assert "at most 2, until a layer is empty" in text, text
    done = cli.run("render", "plan.ply", "--dump-plan", "--stats", "json")
    json.loads(done.stdout)
    assert "scatter" in done.stderr


def test_planes():
    cli.ball("planes.ply", 500)
    (cli.FOLDER / "planes").mkdir()
    cli.run("render", "planes.ply", "--dump-planes", "planes", "--size", "40x30")
    files = sorted(path.name for path in (cli.FOLDER / "planes").iterdir())
    assert any(name.endswith(".txt") for name in files) and len(files) >= 4, files
    assert {"KEYS_0.raw", "FROM_0.raw", "NORMAL_0.raw", "DEFF_0.raw", "COMBINED_0.raw"} <= set(files), files
    assert "Check that its folder exists" in cli.run("render", "planes.ply", "--dump-planes", "no/such/folder", code=1).stderr
    found = []
    for number, (device, threads) in enumerate((("cpu", 1), ("cpu", 3), ("cpu-scalar", 2))):  # of discs: nothing of how threads came by
        folder = cli.FOLDER / f"discs-{number}"
        folder.mkdir()
        cli.run("render", "planes.ply", "--surface", "splats", "--opacity", "0.5", "--dump-planes", folder.name, "--size", "40x30", "--device", device,
            "--threads", threads)
        found.append({path.name: path.read_bytes() for path in folder.iterdir()})
    differ = [name for name in found[0].keys() | found[1].keys() | found[2].keys() if len({one.get(name) for one in found}) > 1]
    assert "KEYS_0.raw" in found[0] and not differ, differ


def test_interrupt():
    cli.ball("interrupt.ply")
    process = subprocess.Popen([*cli.PATINA, "render", "interrupt.ply", "--repeat", "100000"], cwd=cli.FOLDER,
                               stderr=subprocess.PIPE)
    time.sleep(1)
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=60)
    assert process.returncode == 130 and b"cancelled" in error, (process.returncode, error)
