# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of points on the command line: tests that test_cli.py runs."""

import os
import random
import struct
import subprocess
import time

import cli


def test_tables_of_spreadsheets():
    """Decimals behind a comma, as half of Europe writes them, are no columns of their own."""
    (cli.FOLDER / "comma.csv").write_text("X;Y;Z\n2,051640;0,143959;-0,918971\n1,5;1;0\n")
    said = cli.run("info", "comma.csv").stdout
    assert "2.05164" in said and "1.5" in said and "column" not in said, said
    (cli.FOLDER / "lonlat.csv").write_text("id,lon,lat,elev\n1,2,3,4\n")
    assert "no columns x, y and z in its line of names: id, lon, lat, elev" in cli.run("info", "lonlat.csv", code=1).stderr


def test_missing_and_broken_files():
    (cli.FOLDER / "broken.ply").write_text("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
                                           "property float y\nproperty float z\nend_header\n1 2 3\n4 five 6\n7 8 9\n")
    for arguments in (["info"], ["render", "-o", "x.png"], ["convert", "x.ply"]):
        for name in ("nothing.ply", "broken.ply"):
            done = cli.run(arguments[0], name, *arguments[1:], code=1)
            assert name in done.stderr and not done.stdout, done.stderr
    assert "line" in cli.run("info", "broken.ply", code=1).stderr
    assert not (cli.FOLDER / "x.png").exists() and not (cli.FOLDER / "x.ply").exists()


def test_formats_of_the_add_on():
    """Files that only the add-on reads are told as such, not as broken ones."""
    for name, head, word in (("a.las", b"LASF" + bytes(300), "LAS, LAZ or COPC"), ("a.e57", b"ASTM-E57" + bytes(100), "E57"),
                             ("a.pcd", b"# .PCD v0.7\nVERSION 0.7\n", "PCD")):
        (cli.FOLDER / name).write_bytes(head)
        for arguments in (("info", name), ("render", name, "-o", "x.png"), ("convert", name, "x.ply")):
            error = cli.run(*arguments, code=1).stderr
            assert f"{name}: a file of format {word}, which Patina's add-on for Blender reads" in error, error
    error = cli.run("info", "https://host/site.copc.laz", code=1).stderr
    assert "https://host/site.copc.laz: an address, whose COPC Patina's add-on for Blender shows" in error, error


def test_bytes_too_many_are_told():
    (cli.FOLDER / "long.ply").write_bytes(b"ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                                          b"property float z\nend_header\n" + bytes(12 + 7))
    for arguments in (("info", "long.ply"), ("render", "long.ply", "-o", "x.png"), ("convert", "long.ply", "x.ply")):
        assert "warning: long.ply: 7 bytes follow behind byte" in cli.run(*arguments).stderr, arguments


def test_unwritable_output():
    cli.ball("unwritable.ply", 100)
    assert "no/such" in cli.run("render", "unwritable.ply", "-o", "no/such/x.png", code=1).stderr
    cli.run("convert", "unwritable.ply", "no/such/x.ply", code=1)


def test_named_pipes_are_no_files():
    """A pipe that nobody writes into must not hang a command."""
    if os.name == "nt":
        return
    for name in ("pipe.ply", "pipe.xyz", "pipe.cloud"):
        os.mkfifo(cli.FOLDER / name)
        for command in (("info", name), ("render", name, "-o", "pipe.png"), ("convert", name, "out.ply")):
            assert "is a device or pipe, not a file" in cli.run(*command, code=1).stderr, command


def test_names_cannot_command_a_terminal():
    """Control characters and marks of direction in names are shown as question marks."""
    evil = "a\x1b[31m\x07\x7f\u009b\u202eb"
    (cli.FOLDER / "evil.csv").write_text(f"x,y,z,{evil}\n1,2,3,4\n", encoding="utf-8")
    (cli.FOLDER / "evil.ply").write_text(f"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
                                         f"property float {evil}\nend_header\n1 2 3 4\n", encoding="utf-8")
    for name in ("evil.csv", "evil.ply"):
        done = cli.run("info", name)
        assert "attribute   a?[31m" in done.stdout and not set("\x1b\x07\x7f\u009b\u202e") & set(done.stdout + done.stderr), ascii(done.stdout)
    done = cli.run("info", f"{evil}.ply", code=1)
    assert not set("\x1b\x07\x7f\u009b\u202e") & set(done.stderr), ascii(done.stderr)


def test_info():
    text = cli.run("info", cli.ball("info.ply", 5000)).stdout
    lines = {line.split()[0]: line.split()[1:] for line in text.splitlines() if line.strip() and line[0] != " "}
    assert lines["points"] == ["5000"] and lines["format"] == ["PLY", "ascii"] and lines["normals"] == ["yes"]
    assert lines["colours"] == ["no"]
    assert 0.01 < float(lines["spacing"][0]) < 0.2  # sqrt(4 pi / 5000) = 0.05


def test_info_tells_scans():
    """Of a .conf each scan with its file, points, interval and direction; it renders and converts as one cloud."""
    grid = "".join(f"{u * 0.1} {v * 0.1} 2\n" for v in range(4) for u in range(5)) + "".join(f"1 {i}\n" for i in range(20))
    head = ("ply\nformat ascii 1.0\nobj_info num_cols 5\nobj_info num_rows 4\nelement vertex 20\nproperty float x\nproperty float y\n"
            "property float z\nelement range_grid 20\nproperty list uchar int vertex_indices\nend_header\n")
    (cli.FOLDER / "front.ply").write_text(head + grid)
    (cli.FOLDER / "both.conf").write_text("mesh whole_cybcyl 0 0 0 0 0 0 1\nbmesh front.ply 0 0 0 0 0 0 1\nbmesh lost.ply 0 0 0 0 0 0 1\n"
                                      "bmesh front.ply 9 0 0 0 0.70710678 0 0.70710678\n")
    done = cli.run("info", "both.conf")
    assert "scan 0      front.ply, 20 points, grid 5 x 4, interval 0.1, looking 0.000 0.000 -1.000" in done.stdout.replace("-0.000", "0.000")
    assert "scan 1      front.ply, 20 points, grid 5 x 4, interval 0.1, looking 1.000" in done.stdout, done.stdout
    assert "scan lost.ply is left out" in done.stderr and "mesh whole_cybcyl is left out" in done.stderr, done.stderr
    cli.run("convert", "both.conf", "both.ply")
    assert "points      40" in cli.run("info", "both.ply").stdout
    cli.run("render", "both.conf", "-o", "both.png", "--size", "32x32")


def test_info_of_an_empty_cloud():
    assert "points      0" in cli.run("info", cli.write_ply("empty.ply", [])).stdout


def test_convert_keeps_the_cloud():
    generator = random.Random(1)
    colors = [tuple(generator.randrange(256) for _ in range(3)) for _ in range(3000)]
    cli.ball("ascii.ply", 3000, colors=colors)
    cli.run("convert", "ascii.ply", "binary.ply")
    before, after = cli.run("info", "ascii.ply").stdout.splitlines(), cli.run("info", "binary.ply").stdout.splitlines()
    assert after[0].endswith("binary_little_endian") and before[1:] == after[1:]
    for name in ("ascii", "binary"):
        cli.run("render", f"{name}.ply", "-o", f"{name}.png", "--size", "100x80")
    assert (cli.FOLDER / "ascii.png").read_bytes() == (cli.FOLDER / "binary.png").read_bytes()


def test_convert_keeps_a_survey_origin():
    cli.ball("survey.ply", 2000, (451234.5, 5012345.25, 1200), "double")
    cli.run("convert", "survey.ply", "survey2.ply")
    a, b = cli.run("info", "survey.ply").stdout.splitlines(), cli.run("info", "survey2.ply").stdout.splitlines()
    assert [line for line in a if line.startswith("origin")]
    same = ("points", "box", "size", "normals")
    assert [line for line in a if line.startswith(same)] == [line for line in b if line.startswith(same)]


# ---- pictures ------------------------------------------------------------------------------------------------------


def binary(name, count, form="<fff", row=lambda i: (i % 211 * 0.01, i // 211 * 0.01, 0.3 * random.random()), said=None, end=b""):
    """A PLY of x, y, z and, where the row has more, heat; said: the rows that its header declares."""
    random.seed(5)
    words = {"f": "float", "d": "double"}
    names = "".join(f"property {words[kind]} {column}\n" for kind, column in zip(form[1:], ("x", "y", "z", "heat"), strict=False))
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {said or count}\n{names}end_header\n"
    (cli.FOLDER / name).write_bytes(head.encode() + b"".join(struct.pack(form, *row(i)) for i in range(count)) + end)
    return name


def left(*names):
    """What lies in the folder beside these, of the builds of `out`."""
    return sorted(path.name for path in cli.FOLDER.glob("*out.cloud*") if path.name not in names)


def packs(plain):
    """b.ply smaller, at one go or from what was saved: what it may be off by is told, and tiny."""
    said = cli.run("convert", "b.ply", "small.cloud", "--pack", "on").stderr
    off = float(said.split("packing moved positions by ")[1].split()[0])
    assert 0 < off < 3e-6, said
    told = cli.run("info", "small.cloud").stdout
    assert f"positions   packed, which moved them by {off:.3g} at most" in told and "points      15000\n" in told and "analysed    yes" in told, told
    small = (cli.FOLDER / "small.cloud").read_bytes()
    cli.run("convert", "out.cloud", "again.cloud", "--pack", "on")
    assert (cli.FOLDER / "again.cloud").read_bytes() == small
    cli.run("convert", "small.cloud", "again.cloud")
    assert (cli.FOLDER / "again.cloud").read_bytes() == small, "it stays packed"
    cli.run("convert", "small.cloud", "small.cloud", "--order", "drop")
    told = cli.run("info", "small.cloud").stdout
    assert "points      15000, numbered as they lie" in told and "packed, which" in told, told
    sizes = len(plain), len(small), (cli.FOLDER / "small.cloud").stat().st_size
    assert sizes[0] > sizes[1] > sizes[2], sizes
    cli.run("render", "small.cloud", "-o", "small.png", "--size", "64x64")
    assert "float32" in cli.run("info", "out.cloud").stdout
    cli.run("convert", "bare.cloud", "bare2.cloud", "--analysis", "off", "--order", "drop")
    assert "analysed    no" in cli.run("info", "bare2.cloud").stdout
    left = [path.name for path in cli.FOLDER.iterdir() if path.suffix in (".built", ".analysed", ".smaller")]
    assert not left, left


def test_convert_to_a_cloud():
    """The same bytes whatever memory it may take, from text and bytes alike, with an attribute or analysis or not; it renders as its file."""
    places = [(i % 150 * 0.01, i // 150 * 0.01, 0.1 * (i % 7)) for i in range(15000)]
    binary("b.ply", 15000, "<ffff", lambda i: (*places[i], i % 10))
    rows = "".join(f"{struct.unpack('f', struct.pack('f', x))[0]!r} {struct.unpack('f', struct.pack('f', y))[0]!r} "
                   f"{struct.unpack('f', struct.pack('f', z))[0]!r} {i % 10}\n" for i, (x, y, z) in enumerate(places))
    (cli.FOLDER / "a.ply").write_text("ply\nformat ascii 1.0\nelement vertex 15000\nproperty float x\nproperty float y\nproperty float z\n"
                                      f"property float heat\nend_header\n{rows}")
    (cli.FOLDER / "t.csv").write_text("x,y,z,heat\n" + rows.replace(" ", ","))
    for options in ([], ["--analysis", "off"], ["--attribute", "heat", "--analysis", "on"]):
        found = []
        for name, more in (("b.ply", []), ("b.ply", ["--memory", "64M"]), ("a.ply", []), ("t.csv", [])):
            said = cli.run("convert", name, "out.cloud", *options, *more).stderr
            assert ("t.csv is read whole: what the columns of a text hold" in said) == (name == "t.csv"), said
            found.append((cli.FOLDER / "out.cloud").read_bytes())
        assert all(one == found[0] for one in found), [len(one) for one in found]
        assert not left("out.cloud"), left("out.cloud")
        cli.run("render", "out.cloud", "-o", "cloud.png", "--size", "64x64")
        cli.run("render", "b.ply", "-o", "file.png", "--size", "64x64")
        assert (cli.FOLDER / "cloud.png").read_bytes() == (cli.FOLDER / "file.png").read_bytes(), options
    cli.run("render", "out.cloud", "-o", "cloud.png", "--ramp", "heat")
    assert "no attribute 'cold'" in cli.run("convert", "b.ply", "no.cloud", "--attribute", "cold", code=1).stderr
    assert not cli.run("convert", "b.ply", "out.cloud", "--memory", "1M").stderr
    wanted = (cli.FOLDER / "out.cloud").read_bytes()
    cli.run("convert", "b.ply", "bare.cloud", "--analysis", "off")
    cli.run("convert", "bare.cloud", "again.cloud")
    assert (cli.FOLDER / "again.cloud").read_bytes() == wanted, "a saved cloud is analysed"
    cli.run("convert", "out.cloud", "again.cloud")
    assert (cli.FOLDER / "again.cloud").read_bytes() == wanted, "an analysed cloud stays as it is"
    packs(wanted)
    assert "a saved cloud" in cli.run("convert", "bare.cloud", "no.cloud", "--attribute", "heat", code=2).stderr
    for bad in (["--memory", "x"], ["--analysis", "grid"], ["--analysis", "auto"], ["--memory"], ["--colour", "1"], ["--pack", "yes"], ["--order", "on"]):
        cli.run("convert", "b.ply", "no.cloud", *bad, code=2)
    assert "goes into a .cloud" in cli.run("convert", "b.ply", "no.ply", "--memory", "1G", code=2).stderr
    assert not (cli.FOLDER / "no.cloud").exists() and not (cli.FOLDER / "no.ply").exists()


def test_convert_bad_files():
    """Cut short in the middle, rows of NaN, rows too many, a text whose middle is no number: one message each, and no file by that name
    but the one from before."""
    before = b"what was there"
    out = cli.FOLDER / "out.cloud"
    for name, words, code in ((binary("cut.ply", 3000, said=9000), "cut short: element vertex declares 9000 rows", 1),
                              (binary("one.ply", 1, said=4000000000), "declares 4000000000 rows", 1),
                              ("none.ply", "none.ply: cannot be read", 1)):
        out.write_bytes(before)
        said = cli.run("convert", name, "out.cloud", code=code).stderr
        assert words in said and name in said and len(said.splitlines()) == 1, said
        assert out.read_bytes() == before and not left("out.cloud"), left("out.cloud")
    (cli.FOLDER / "word.ply").write_text("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                                         "end_header\n1 2 3\n4 five 6\n7 8 9\n")
    assert "line 9: 'five' is not a number" in cli.run("convert", "word.ply", "out.cloud", code=1).stderr
    assert out.read_bytes() == before
    (cli.FOLDER / "signed.ply").write_text("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                                           "property char red\nproperty char green\nproperty char blue\nend_header\n"
                                           "1 2 3 200 -1 7\n4 5 6 128 0 255\n7 8 9 1 2 3\n")
    cli.run("convert", "signed.ply", "signed.cloud")  # bytes that a writer called signed
    nowhere = binary("nan.ply", 5000, row=lambda i: (i % 50, i // 50, float("nan") if i % 100 == 3 else 0.0))
    assert "50 points of nan.ply are nowhere" in cli.run("convert", nowhere, "out.cloud").stderr
    assert "warning: more.ply: 7 bytes follow behind" in cli.run("convert", binary("more.ply", 5000, end=b"1234567"), "out.cloud").stderr
    said = cli.run("convert", binary("far.ply", 1), "no/such/out.cloud", code=1).stderr
    assert "no/such/out.cloud" in said, said


def test_convert_is_killed():
    """At any moment: what was there before stays, and the next run makes the whole file."""
    binary("long.ply", 25000)
    out = cli.FOLDER / "out.cloud"
    begin = time.monotonic()
    cli.run("convert", "long.ply", "out.cloud")
    takes, wanted = time.monotonic() - begin, out.read_bytes()
    out.write_bytes(b"before")
    for i in range(8):
        process = subprocess.Popen([*cli.PATINA, "convert", "long.ply", "out.cloud"], cwd=cli.FOLDER, stderr=subprocess.DEVNULL)
        time.sleep(takes * (i + 0.5) / 8)
        process.kill()
        process.wait()
        assert out.read_bytes() in (b"before", wanted), i
    cli.run("convert", "long.ply", "out.cloud")
    assert out.read_bytes() == wanted and not left("out.cloud"), left("out.cloud")


def test_a_file_that_is_cut_short_meanwhile():
    """The picture lacks its points, one line names the file, and the exit status says so."""
    cloud = cli.FOLDER / "cut.cloud"
    cli.run("convert", cli.ball("cut.ply", 60000), cloud.name)
    whole = cloud.read_bytes()
    drawing = subprocess.Popen([*cli.PATINA, "render", cloud.name, "-o", "cut.png", "--size", "64x64", "--device", "cpu", "--repeat", "60"],
                               cwd=cli.FOLDER, stderr=subprocess.PIPE, text=True)
    for line in drawing.stderr:
        if "cut.png" in line:  # the first picture is done
            os.truncate(cloud, len(whole) // 2)
            break
    said = drawing.stderr.read()
    assert drawing.wait(120) == 1, (drawing.returncode, said)
    named = [line for line in said.splitlines() if "cut.cloud" in line]
    assert len(named) == 1 and "cannot be read any more" in named[0], said
    cloud.write_bytes(whole)
    cli.run("render", cloud.name, "-o", "cut.png", "--size", "64x64")
