# SPDX-License-Identifier: GPL-3.0-or-later
"""Batches of survey drawings: tests that test_cli.py runs."""

import json

import cli
import cli_drawings
import cli_sheets

FAR = cli_drawings.FAR
PLAN = f"plan:{FAR[2] + 0.25}"


def write(jobs, name="jobs.json"):
    (cli.FOLDER / name).write_text(jobs if isinstance(jobs, str) else json.dumps(jobs, ensure_ascii=False), encoding="utf-8")
    return name


def said(done):
    return [line.removeprefix("patina: ") for line in done.stderr.splitlines() if line]


def test_batch():
    """Every drawing is the same as alone, and a cloud is read once for all."""
    cli_drawings.room("room.ply")
    cli.write_ply("empty.ply", [])
    y = FAR[1] + 0.1
    section = f"section:{FAR[0] - 1},{y},{FAR[0] + 1},{y}"
    write([{"plane": PLAN, "scale": 20, "extent": [2, 1], "outputs": ["one.dxf", "one.svg"]},
           {"plane": section, "flat": True, "outputs": ["two.dxf"]},
           {"plane": PLAN, "extent": "1.2,0.8", "pixel": 5e-3, "depth": [0.5, 0.25], "output": "three.png"},
           {"plane": PLAN, "extent": [2, 1], "sheet": "A4", "title": {"title": "Halle \u00fc", "author": "A & B"}, "outputs": ["four.svg"]}])
    done = cli.run("draw", "room.ply", "empty.ply", "--batch", "jobs.json")
    lines = said(done)
    assert sum("empty.ply holds no points" in line for line in lines) == 1, "clouds are read once"
    assert any(line.startswith("drawing 1 of 4: one.dxf: 1:20, cut lines of 3.2 m") for line in lines), lines
    assert lines[-1] == "jobs.json: 4 of 4 drawings are written", lines
    cli.run("draw", "room.ply", "--plane", PLAN, "--scale=20", "--extent=2,1", "-o", "alone1.dxf", "-o", "alone1.svg")
    cli.run("draw", "room.ply", "--plane", section, "--flat", "-o", "alone2.dxf")
    cli.run("draw", "room.ply", "--plane", PLAN, "--extent=1.2,0.8", "--pixel=0.005", "--depth=0.5,0.25", "-o", "alone3.png")
    for one, other in (("one.dxf", "alone1.dxf"), ("one.svg", "alone1.svg"), ("two.dxf", "alone2.dxf"), ("three.png", "alone3.png")):
        assert (cli.FOLDER / one).read_bytes() == (cli.FOLDER / other).read_bytes(), one
    header, _, (room,) = cli_drawings.read_dxf("one.dxf")
    assert header["$INSUNITS"] == "6" and all(cli_drawings.from_walls(place) < 0.0015 for place in cli_drawings.world(room))
    header, _, flat = cli_drawings.read_dxf("two.dxf")
    assert header["$INSUNITS"] == "4" and len(flat) == 2, "a value of one drawing is not of the next"
    assert cli.read_png("three.png")[:2] == (240, 160)
    sheet = cli_sheets.read_svg("four.svg")
    assert sheet["size"] == [0, 0, 297, 210] and sheet["title"] == "Halle \u00fc", sheet["size"]


def test_batch_shares_options():
    """Options of the command are of all drawings, unless one says otherwise. What an output has no use for is left out."""
    cli_drawings.room("room.ply")
    write([{"plane": PLAN, "outputs": ["a.dxf"]}, {"plane": PLAN, "scale": 50, "outputs": ["b.svg"]},
           {"plane": PLAN, "flat": False, "outputs": ["c.dxf", "c.tif"]}])
    done = cli.run("draw", "room.ply", "--extent=2,1", "--scale=20", "--flat", "--mask", "--pixel=0.02", "--sheet=a4", "--title=author=A",
                   "--batch=jobs.json")
    assert "a.dxf: 1:20," in done.stderr and "b.svg: A4, 297 x 210 mm, 1:50," in done.stderr, done.stderr
    assert [cli_drawings.read_dxf(name)[0]["$INSUNITS"] for name in ("a.dxf", "c.dxf")] == ["4", "6"]
    assert (cli.FOLDER / "c-mask.tif").exists()


def test_batch_with_a_failure():
    """One message names the drawing; the others are written, and an older file of the bad one stays."""
    cli_drawings.room("room.ply")
    for name in ("low.dxf", "far.pdf"):
        (cli.FOLDER / name).write_text("kept", encoding="ascii")
    write([{"plane": PLAN, "extent": [2, 1], "outputs": ["good1.dxf"]}, {"plane": "plan:0", "outputs": ["low.dxf"]},
           {"plane": PLAN, "extent": [50, 50], "sheet": "A4", "outputs": ["far.pdf"]}, {"plane": PLAN, "outputs": ["no/such.dxf"]},
           {"plane": "frame:0,0,0,1,0,0,2,0,0", "outputs": ["parallel.dxf"]}, {"plane": PLAN, "extent": [2, 1], "outputs": ["good2.dxf"]}])
    lines = said(cli.run("draw", "room.ply", "--batch", "jobs.json", code=1))
    for i, what in ((2, "meets no surface"), (3, "1:50 needs 1016 x 1016 mm"), (4, "no/such.dxf: cannot be written"), (5, "zero or parallel")):
        told = [line for line in lines if line.startswith(f"drawing {i} of 6: ")]
        assert len(told) == 1 and what in told[0], (i, lines)
    assert lines[-1] == "jobs.json: 2 of 6 drawings are written" and len(lines) == 7, lines
    assert all((cli.FOLDER / name).read_text(encoding="ascii") == "kept" for name in ("low.dxf", "far.pdf"))
    assert (cli.FOLDER / "good1.dxf").read_bytes() == (cli.FOLDER / "good2.dxf").read_bytes() != b""
    assert not (cli.FOLDER / "parallel.dxf").exists()


def test_batch_of_bad_drawings():
    """Mistakes in the list are found before anything is read or written: the cloud does not even exist."""
    good = {"plane": PLAN, "outputs": ["never.dxf"]}
    for jobs, message in (
            ([good, {"plan": 3, "outputs": ["b.dxf"]}], 'jobs.json, line 1, drawing 2 of 2: there is no option "plan" of drawings'),
            ([{"plane": 3, "outputs": ["b.dxf"]}], '"plane" must be a text, not a number'),
            ([good | {"scale": [50]}], '"scale" must be a number, not a list'), ([good | {"scale": None}], '"scale" must be a number, not null'),
            ([good | {"flat": "yes"}], '"flat" must be true or false, not a text'), ([good | {"extent": 2}], '"extent" must be a list of numbers, not a number'),
            ([good | {"extent": [2, "1"]}], '"extent" must be a list of numbers'), ([good | {"extent": [2]}], "'2' is no value for \"extent\""),
            ([good | {"extent": [1] * 500}], "is no value for \"extent\""), ([good | {"scale": 0}], "'0' is no value for \"scale\": see 'patina help --scale'"),
            ([good | {"scale": "1e999"}], "'1e999' is no value"), ([good | {"plane": "plan:nan"}], "'plan:nan' is no value for \"plane\""),
            ([good | {"threads": 1.5}], "'1.5' is no value for \"threads\""), ([good | {"title": {"name": "x"}}], "'name' is no value for \"title\""),
            ([good | {"title": {"title": 3}}], '"title" must be an object of texts'), ([good | {"title": {"title": "x"}}], "add --sheet A1"),
            ([{"plane": PLAN, "outputs": "a.dxf"}], '"outputs" must be a list of texts, not a text'),
            ([{"plane": PLAN, "outputs": ["a.xyz"]}], "written as .dxf, .svg"), ([{"plane": PLAN, "outputs": [""]}], "'' is no value for \"outputs\": see 'patina help --output'"),
            ([{"plane": PLAN, "outputs": [f"{i}.dxf" for i in range(17)]}], "'16.dxf' is no value"),
            ([{"plane": PLAN}], '"outputs" is missing'), ([{"plane": PLAN, "outputs": []}], '"outputs" is missing'),
            ([{"outputs": ["a.dxf"]}], '"plane" is missing'), (["plan:1"], "a drawing must be an object"), ([good | {"mask": True}], "are of a GeoTIFF"),
            ([good, {"plane": PLAN, "outputs": [".//never.dxf"]}], "jobs.json: drawings 1 and 2 both write 'never.dxf'"),
            ([{"plane": PLAN, "outputs": ["a.dxf", "./a.dxf"]}], "drawing 1 writes 'a.dxf' twice"),
            ([{"plane": PLAN, "outputs": ["a.tif"], "mask": True}, {"plane": PLAN, "outputs": ["a-mask.tif"]}], "both write 'a-mask.tif'"),
            ([{"plane": PLAN, "outputs": ["a.tif"]}, {"plane": PLAN, "outputs": ["a.tiff"]}], "both write 'a.json'"),
            ([{"plane": PLAN, "outputs": ["jobs.tif"]}], "drawing 1 would replace this file"),
            ([], "must be a list of drawings, not an empty one"), (good, "must be a list of drawings, not an object"), ("3", "not a number"), ("null", "not null")):
        write(jobs)
        lines = said(cli.run("draw", "missing.ply", "--batch", "jobs.json", code=2))
        assert len(lines) == 1 and message in lines[0], (jobs, lines)
    write([{"plane": 1}, good, {"plane": 2}])
    lines = said(cli.run("draw", "missing.ply", "--batch", "jobs.json", code=2))
    assert [line.partition(":")[0] for line in lines] == ["jobs.json, line 1, drawing 1 of 3", "jobs.json, line 1, drawing 3 of 3"], lines
    assert "without --batch" in cli.run("draw", "a.ply", "--batch=jobs.json", "-o", "a.dxf", code=2).stderr
    assert "'missing.json' cannot be read" in cli.run("draw", "a.ply", "--batch=missing.json", code=2).stderr
    assert "cannot be read" in cli.run("draw", "a.ply", "--batch=.", code=2).stderr
    assert not (cli.FOLDER / "never.dxf").exists()


def test_batch_of_broken_json():
    """The message names the line."""
    for text, line, message in (
            ("", 1, "the file ends before a value"), ('[\n{"plane": "plan:1",\n}]', 3, "a , is before the end"), ("[\n\n1,\n]", 4, "a , is before the end"),
            ('[{"plane": "plan:1"}', 1, "a , or the ] of a list is missing"), ('[{"plane": "plan:1"', 1, "the } of an object is missing"),
            ("[{plane: 1}]", 1, 'a name in " is missing'), ('[{"plane" 1}]', 1, "a : is missing"), ('[{"plane":}]', 1, "a value is missing"),
            ("[{'plane': 1}]", 1, 'a name in " is missing'), ('["a\nb"]', 1, 'no " at its end'), ('["a', 1, 'no " at its end'), (r'["C:\plans"]', 1, r"write \\ for a backslash"),
            (r'["\u12g4"]', 1, "means nothing"), (r'["\ud800"]', 1, "means nothing"), (r'["\ud800\u0041"]', 1, "means nothing"), (r'["\u0000"]', 1, "means nothing"),
            ("[01]", 1, "a number is not written"), ("[-]", 1, "a number is not written"), ("[1.]", 1, "a number is not written"), ("[1e+]", 1, "a number is not written"),
            ("[+1]", 1, "a value is missing"), ("[NaN]", 1, "a value is missing"), ("[] []", 1, "there is more after the end"), ("[tru]", 1, "a value is missing"),
            ("[" * 1000, 1, "nested too deeply"), ("[1 2]", 1, "the ] of a list is missing")):
        write(text)
        lines = said(cli.run("draw", "missing.ply", "--batch", "jobs.json", code=2))
        assert len(lines) == 1 and lines[0].startswith(f"jobs.json, line {line}: ") and message in lines[0], (text, lines)
    for data in (b'["\xff"]', b'["a\0"]', "[]".encode("utf-16"), b'["\xed\xa0\x80"]'):
        (cli.FOLDER / "jobs.json").write_bytes(data)
        lines = said(cli.run("draw", "missing.ply", "--batch", "jobs.json", code=2))
        assert lines == ["jobs.json: the file is no text in UTF-8: save it as UTF-8"], (data, lines)
    write(" " * (4 << 20) + " ")
    assert "at most 4 MiB" in cli.run("draw", "missing.ply", "--batch", "jobs.json", code=2).stderr


def test_batch_texts():
    """Escapes, a byte order mark and all letters of Unicode, read back from the title of a sheet."""
    cli_drawings.room("room.ply")
    write("\ufeff\r\n\t[ {\"plane\": \"" + PLAN + r'''", "\u0065xtent": [2.0, 10E-1], "sheet": "A4", "title": {"title":
        "\u00fc \"q\" \\ \/ \u20ac \ud83d\ude00 ß"}, "outputs": ["t\u00e9.svg"] } ]''' + "\n")
    cli.run("draw", "room.ply", "--batch", "jobs.json")
    assert cli_sheets.read_svg("t\u00e9.svg")["title"] == "\u00fc \"q\" \\ / \u20ac \U0001f600 \u00df"
