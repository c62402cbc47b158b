#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tiles, strips and parts by the command line: test_parts.py PATH_OF_PATINA. Every merged picture is held against the one that one
machine draws, byte by byte. Python's own library only."""
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from sites import run, write_site

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from runs import run_tests  # noqa: E402

PATINA = str(Path(sys.argv[1] if len(sys.argv) > 1 else "build/out/release/patina").resolve())
FOLDER = Path()
SMALL = ["site.cloud", "--size", "200x160"]


def patina(*arguments, code=0, env=None):
    return run(PATINA, *arguments, code=code, cwd=FOLDER, env=env)


def same(a, b):
    return (FOLDER / a).read_bytes() == (FOLDER / b).read_bytes()


def drop(*patterns):
    for pattern in patterns:
        for path in FOLDER.glob(pattern):
            path.unlink()


def scatter(arguments, of, stem="p", behind=()):
    return [(patina("scatter", *arguments, "--part", f"{k}/{of}", "-o", f"{stem}{k}.keys", *behind), f"{stem}{k}.keys")[1]
            for k in range(1, of + 1)]


def merged(arguments, of=3):
    """Rounds that it took; the picture is parts.png."""
    drop("*.keys", "*.next", "parts.png")
    keys, rounds = scatter(arguments, of), 1
    while True:
        done = subprocess.run([PATINA, "merge", *keys, "-o", "parts.png", "--next", "told.next"], cwd=FOLDER, capture_output=True, text=True,
                              timeout=300)
        if done.returncode != 3:
            assert done.returncode == 0, done.stderr
            return rounds
        rounds += 1
        assert f"round {rounds} is wanted" in done.stderr and not (FOLDER / "parts.png").exists(), done.stderr
        keys += scatter(arguments, of, f"round{rounds}-", ("--behind", "told.next"))


def check_parts(*arguments, least_rounds=1, most_rounds=1, of=3):
    patina("render", *arguments, "-o", "whole.png")
    rounds = merged(arguments, of)
    assert least_rounds <= rounds <= most_rounds, rounds
    assert same("whole.png", "parts.png"), arguments


# ---- tiles and strips --------------------------------------------------------------------------------------------------


def tiles(columns, rows, *arguments, skip=()):
    names = []
    for tile in range(1, columns * rows + 1):
        if tile not in skip:
            names.append(f"tile{tile}.png")
            patina("render", *arguments, "--tiles", f"{columns}x{rows}", "--tile", tile, "-o", names[-1])
    return names


def test_tiles_and_strips_are_the_whole():
    lit = [*SMALL, "--lit", "--shadows", "--surface", "splats"]
    for arguments in (SMALL, [*SMALL, "--transparent", "--opacity", "0.5"], lit):
        patina("render", *arguments, "-o", "whole.png")
        patina("merge", *tiles(3, 2, *arguments)[::-1], "-o", "tiles.png")
        assert same("whole.png", "tiles.png"), arguments
        patina("render", *arguments, "-o", "strips.png", "--strip", 33)
        assert same("whole.png", "strips.png"), arguments


def test_tiles_are_named_where_they_are_wrong():
    names = tiles(2, 2, *SMALL, skip=[3])
    assert "tile 3 of 2x2 is missing" in patina("merge", *names, "-o", "no.png", code=1)
    patina("render", *SMALL, "--unlit", "--camera", "10,20", "--tiles", "2x2", "--tile", 3, "-o", "other.png")
    assert "'other.png' and 'tile1.png' are of different pictures" in patina("merge", *names, "other.png", "-o", "no.png", code=1)
    patina("render", *SMALL, "-o", "plain.png")
    assert "'plain.png' is no tile" in patina("merge", *names, "plain.png", "-o", "no.png", code=1)
    assert "both tile 1" in patina("merge", *names, "tile1.png", "-o", "no.png", code=1)
    patina("render", *SMALL, "--tiles", "2x2", "--tile", 3, "-o", "tile3.png")
    whole = (FOLDER / "tile3.png").read_bytes()
    (FOLDER / "tile3.png").write_bytes(whole[:len(whole) // 2])
    assert "'tile3.png' is damaged" in patina("merge", *names, "tile3.png", "-o", "no.png", code=1)
    (FOLDER / "tile3.png").write_bytes(b"")
    assert "tile3.png" in patina("merge", *names, "tile3.png", "-o", "no.png", code=1)
    assert "nowhere.png" in patina("merge", *names, "nowhere.png", "-o", "no.png", code=1)
    assert not (FOLDER / "no.png").exists()


def test_what_tiles_cannot_know_is_refused():
    for wrong in (["--tile", 1], ["--tiles", "2x2"], ["--tiles", "2x2", "--tile", 5], ["--tiles", "0x2", "--tile", 1],
                  ["--tiles", "2x2", "--tile", 1, "--noise", "0.01"], ["--tiles", "2x2", "--tile", 1, "--pass", "depth"],
                  ["--tiles", "2x2", "--tile", 1, "--panorama", "64x32"], ["--tiles", "2x2", "--tile", 1, "--region", "0,0,5,5"],
                  ["--tiles", "300x2", "--tile", 1], ["--strip", 0], ["--part", "1/2"], ["--tiles", "2x2x", "--tile", 1]):
        patina("render", *SMALL, *wrong, "-o", "no.png", code=2)
    assert not (FOLDER / "no.png").exists()


# ---- parts -------------------------------------------------------------------------------------------------------------


def test_parts_are_the_whole():
    check_parts(*SMALL, of=4)
    check_parts("site.ply", *SMALL[1:])
    check_parts(*SMALL, "--ortho", "3", "--lines", "2", "--ramp", "height")
    check_parts(*SMALL, "--fill", "off", "--smooth", "off", "--antialias", "off", of=1)
    check_parts(*SMALL, "--clip-box", "-1,-1,-1,1,1,1", "--clip-tint", "1,0,0,0.1", "--hide-kinds", "volume", "--ramp", "trust")
    check_parts("site.cloud", "--size", "900x700", "--lit")  # some points are discs
    check_parts(*SMALL, "--average", "--camera", "200,5")
    check_parts(*SMALL, "--look", "0,0,9,0,0,20", of=2)  # nothing is in view


def test_discs():
    check_parts(*SMALL, "--surface", "splats", of=4)
    check_parts(*SMALL, "--surface", "splats", "--lit", "--shadows", "--sun", "40,30,5", "--samples", "3")


def test_shadows():
    check_parts(*SMALL, "--lit", "--shadows", "--sun", "40,30", of=4)
    check_parts(*SMALL, "--lit", "--shadows", "--sun", "40,30,10", "--samples", "5")
    (FOLDER / "tri.obj").write_text("v -1 -1 0\nv 1 -1 0\nv 0 1 0.5\nf 1 2 3\n", encoding="ascii")
    check_parts(*SMALL, "--lit", "--shadows", "--mesh", "tri.obj")


def test_layers_take_a_round_each():
    check_parts(*SMALL, "--opacity", "0.5", least_rounds=3, most_rounds=8)
    check_parts(*SMALL, "--opacity", "0.5", "--layers", "2", least_rounds=2, most_rounds=2)
    check_parts("site.ply", *SMALL, "--opacity", "1,0.4", "--lit", "--shadows", least_rounds=1, most_rounds=8)
    check_parts(*SMALL, "--opacity", "0.6", "--surface", "splats", "--clip-box", "-1,-1,-1,1,1,1", least_rounds=2, most_rounds=8)


def test_no_plane_is_read_before_it_is_written():
    arguments = [*SMALL, "--lit", "--shadows", "--opacity", "0.5", "--layers", "2"]
    env = dict(os.environ, PATINA_POISON_PLANES="1")
    patina("render", *arguments, "-o", "whole.png")
    drop("*.keys")
    keys = []
    for part in (1, 2):
        patina("scatter", *arguments, "--part", f"{part}/2", "-o", f"p{part}.keys", env=env)
        keys.append(f"p{part}.keys")
    patina("merge", *keys, "-o", "parts.png", "--next", "told.next", env=env, code=3)
    for part in (1, 2):
        patina("scatter", *arguments, "--part", f"{part}/2", "-o", f"q{part}.keys", "--behind", "told.next", env=env)
        keys.append(f"q{part}.keys")
    patina("merge", *keys, "-o", "parts.png", env=env)
    assert same("whole.png", "parts.png")


def test_a_part_again_has_the_same_bytes():
    for device in ("cpu", "cpu-scalar"):
        patina("scatter", *SMALL, "--lit", "--shadows", "--part", "2/3", "--device", device, "--threads", 1 + (device == "cpu"), "-o", f"{device}.keys")
    assert same("cpu.keys", "cpu-scalar.keys")


def test_parts_are_named_where_they_are_wrong():
    drop("*.keys", "*.next")
    keys = scatter(SMALL, 3)

    def refused(files, *words):
        told = patina("merge", *files, "-o", "no.png", code=1)
        assert all(word in told for word in words) and len(told.splitlines()) == 1, told

    refused(keys[:2], "part 3 of 3 of round 1 is missing")
    refused(keys[1:], "part 1 of 3 of round 1 is missing")
    refused([*keys, keys[1]], "both part 2 of 3")
    patina("scatter", *SMALL, "--camera", "10,20", "--part", "2/3", "-o", "other.keys")
    refused([keys[0], "other.keys", keys[2]], "other.keys", "of different pictures")
    patina("scatter", *SMALL, "--part", "2/4", "-o", "four.keys")
    refused([keys[0], "four.keys", keys[2]], "four.keys", "part 2 of 4")
    refused([*keys, "nowhere.keys"], "nowhere.keys", "cannot be opened")
    refused([*keys, "site.ply"], "site.ply", "no file of keys")
    whole = (FOLDER / keys[1]).read_bytes()
    for cut in (0, 5, 50, 112, 500, len(whole) - 1):
        (FOLDER / keys[1]).write_bytes(whole[:cut])
        refused(keys, keys[1])
    (FOLDER / keys[1]).write_bytes(whole + b"x")
    refused(keys, keys[1], "bytes")
    for at in list(range(0, 112, 5)) + [130, 400, len(whole) // 2, len(whole) - 3]:
        (FOLDER / keys[1]).write_bytes(whole[:at] + bytes([whole[at] ^ 0x55]) + whole[at + 1:])
        refused(keys, keys[1])
    (FOLDER / keys[1]).write_bytes(whole)
    shutil.copy(FOLDER / "site.cloud", FOLDER / "kept.cloud")
    try:  # the cloud is another by now
        write_site(FOLDER / "changed.ply", 20000, 5)
        patina("convert", "changed.ply", "site.cloud")
        refused(keys, "of another picture")
        (FOLDER / "site.cloud").unlink()
        refused(keys, "site.cloud")
    finally:
        shutil.copy(FOLDER / "kept.cloud", FOLDER / "site.cloud")
    patina("merge", *keys, "-o", "parts.png")
    assert not (FOLDER / "no.png").exists()


def test_rounds_are_named_where_they_are_wrong():
    drop("*.keys", "*.next")
    arguments = [*SMALL, "--opacity", "0.5"]
    keys = scatter(arguments, 2)
    assert "round 2 are missing" in patina("merge", *keys, "-o", "no.png", code=1)
    patina("merge", *keys, "-o", "no.png", "--next", "told.next", code=3)
    second = scatter(arguments, 2, "second", ("--behind", "told.next"))
    assert "part 2 of 2 of round 2 is missing" in patina("merge", *keys, second[0], "-o", "no.png", code=1)
    assert "not what a merge left" in patina("scatter", *arguments, "--part", "1/2", "--behind", keys[0], "-o", "no.keys", code=1)
    assert "another picture" in patina("scatter", *SMALL, "--opacity", "0.4", "--part", "1/2", "--behind", "told.next", "-o", "no.keys", code=1)
    assert "what a round is told" in patina("merge", "told.next", "-o", "no.png", code=1)
    other = scatter([*arguments, "--threads", "1"], 2, "again")  # the same keys under other names: the rounds may follow on them
    patina("merge", *other, *second, "-o", "no.png", "--next", "x.next", code=3)
    third = scatter(arguments, 2, "third", ("--behind", "x.next"))
    assert "part 1 of 2 of round 2 is missing" in patina("merge", *keys, *third, "-o", "no.png", code=1)
    (FOLDER / "cut.next").write_bytes((FOLDER / "told.next").read_bytes()[:-9])
    assert "cut.next" in patina("scatter", *arguments, "--part", "1/2", "--behind", "cut.next", "-o", "no.keys", code=1)
    assert not (FOLDER / "no.png").exists() and not (FOLDER / "no.keys").exists()


def test_what_is_not_divided_is_refused():
    for word, arguments in (("range images", [*SMALL, "--surface", "ranges"]), ("soft points", [*SMALL, "--soft", "base"]),
                            ("samples of pixels", [*SMALL, "--pixel-samples", "4"])):
        told = patina("scatter", *arguments, "--part", "1/2", "-o", "no.keys", code=1)
        assert word in told and "not scattered in parts" in told, told
    for wrong in ([], ["--part", "0/2"], ["--part", "3/2"], ["--part", "2"], ["--part", "1/2", "--tiles", "2x2", "--tile", 1],
                  ["--part", "1/2", "--repeat", 2], ["--part", "1/2", "--noise", "0.1"], ["--part", "1/2", "--strip", 9]):
        patina("scatter", *SMALL, *wrong, "-o", "no.keys", code=2)
    patina("merge", "-o", "no.png", code=2)
    patina("merge", "x.keys", code=2)
    assert not (FOLDER / "no.keys").exists()


def test_a_part_reads_its_share_alone():
    """Of a saved cloud: pages of positions that the process touched, as the system counts them."""
    write_site(FOLDER / "large.ply", 200000, 9)
    patina("convert", "large.ply", "large.cloud")
    arguments = ["large.cloud", "--size", "64x64", "--fill", "off", "--threads", "1", "--device", "cpu-scalar"]
    counted = "import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True, stderr=subprocess.DEVNULL); " \
              "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_minflt)"
    faults = [int(run(sys.executable, "-c", counted, PATINA, "scatter", *arguments, "--part", f"1/{of}", "-o", "x.keys", cwd=FOLDER))
              for of in (1, 20)]
    assert faults[1] < faults[0], faults


def main():
    global FOLDER
    with tempfile.TemporaryDirectory() as folder:
        FOLDER = Path(folder)
        write_site(FOLDER / "site.ply")
        patina("convert", "site.ply", "site.cloud")
        return run_tests(globals())[1] != 0


if __name__ == "__main__":
    sys.exit(main())
