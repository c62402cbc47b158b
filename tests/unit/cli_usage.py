# SPDX-License-Identifier: GPL-3.0-or-later
"""Help, wrong use and messages of the command line: tests that test_cli.py runs."""

import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import cli


def test_help_and_version():
    assert "patina render" in cli.run("help").stdout
    assert cli.run("--help").stdout == cli.run("help").stdout
    assert "patina render" in cli.run(code=2).stderr


def test_help_has_topics():
    """Each topic fits on a screen, the topics hold every option that the sources parse, and an option leads to its topic."""
    overview, everything = cli.run("help").stdout, cli.run("help", "all").stdout
    topics = re.findall(r"^  ([a-z]+) ", overview, re.M)
    assert len(topics) > 8, topics
    pages = {topic: cli.run("help", topic).stdout for topic in topics}
    for topic, page in pages.items():
        assert 1 < len(page.splitlines()) <= 40 and page.startswith(f"{topic}: ") and page in everything, topic
    native = Path(__file__).resolve().parents[2] / "native"
    sources = [*native.glob("tools/*.c"), native / "include/patina/effects.def"]
    parsed = {name for path in sources for name in re.findall(r'"(--[a-z][a-z-]+)"', path.read_text(encoding="utf-8"))}
    assert len(parsed) > 80, parsed
    for name in parsed - {"--help", "--version"}:
        assert name in overview.split(), name
        shown = cli.run("help", name).stdout
        found = [page for page in pages.values() if page in shown]
        assert found and all(re.search(rf"^  [^\n]{{0,34}}{name}(,| |$)", page, re.M) for page in found), (name, shown)
    assert cli.run("help", "paint", code=2).stderr.startswith("patina: help: 'paint' is neither")


def test_values_behind_equals():
    cli.ball("equals.ply", 500)
    cli.run("render", "equals.ply", "-o", "apart.png", "--size", "40x30", "--sun", "-30,20", "--lit", "--effect", "edl_strength=1")
    cli.run("render", "equals.ply", "--output=joined.png", "--size=40x30", "--sun=-30,20", "--lit", "--effect=edl_strength=1")
    assert (cli.FOLDER / "apart.png").read_bytes() == (cli.FOLDER / "joined.png").read_bytes()
    shutil.copy(cli.FOLDER / "equals.ply", cli.FOLDER / "--odd=name.ply")
    cli.run("render", "-o", "odd.png", "--size=40x30", "--", "--odd=name.ply")
    cli.run("analyse", "equals.ply", "-o", "equals-out.ply", "--neighbours=8")
    for arguments, said in ((["--lit=yes"], "'--lit' takes no value"), (["--size="], "'' is no value for option '--size': see 'patina help --size'"),
                            (["--nonsense=1"], "there is no option '--nonsense'")):
        done = cli.run("render", "equals.ply", "-o", "x.png", *arguments, code=2)
        assert said in done.stderr, done.stderr
    assert "'--grid' takes no value" in cli.run("analyse", "equals.ply", "-o", "y.ply", "--grid=1", code=2).stderr
    assert not (cli.FOLDER / "x.png").exists() and not (cli.FOLDER / "y.ply").exists()


def test_version_is_of_the_sources():
    """Builds of one day are told apart, and the sources alone say how."""
    with tempfile.TemporaryDirectory() as folder:
        stamped = Path(folder) / "version.c"
        subprocess.run([sys.executable, Path(__file__).resolve().parents[2] / "build/stamp", stamped], check=True)
        version = re.search(r'pt_version\[\] = "(\d+\.\d+\.\d+\+[0-9a-f]{12})"', stamped.read_text(encoding="utf-8")).group(1)
    assert cli.run("version").stdout == f"patina {version}\n", version


def test_wrong_use_is_told():
    cli.ball("use.ply", 100)
    for arguments in (["paint"], ["info"], ["info", "a", "b"], ["convert", "a"], ["render"], ["render", "use.ply"],
                      ["render", "use.ply", "-o"], ["render", "use.ply", "-o", "x.png", "--nonsense"],
                      ["render", "use.ply", "-o", "x.png", "--size", "10"],
                      ["render", "use.ply", "-o", "x.png", "--size", "0x5"],
                      ["render", "use.ply", "-o", "x.png", "--size", "10x10y"],
                      ["render", "use.ply", "-o", "x.png", "--size", "-1x10"],
                      ["render", "use.ply", "-o", "x.png", "--quality", "best"],
                      ["render", "use.ply", "-o", "x.png", "--fill", "close"],
                      ["render", "use.ply", "-o", "x.png", "--camera", "10"],
                      ["render", "use.ply", "-o", "x.png", "--camera", "10,95"],
                      ["render", "use.ply", "-o", "x.png", "--camera", "10,nan"],
                      ["render", "use.ply", "-o", "x.png", "--look", "1,1,1,1,1,1"],
                      ["render", "use.ply", "-o", "x.png", "--region", "5,5,5,9"],
                      ["render", "use.ply", "-o", "x.png", "--panorama", "64"],
                      ["render", "use.ply", "-o", "x.png", "--panorama", "64x32", "--eye", "1,2"],
                      ["render", "use.ply", "-o", "x.png", "--panorama", "64x32", "--repeat", "3"],
                      ["render", "use.ply", "-o", "x.png", "--threads", "-1"],
                      ["render", "use.ply", "-o", "x.png", "--repeat", "0"],
                      ["render", "use.ply", "-o", "x.png", "--stats", "xml"],
                      ["render", "use.ply", "-o", "x.png", "--opacity", "1.5"],
                      ["render", "use.ply", "-o", "x.png", "--opacity", "0.5,-1"],
                      ["render", "use.ply", "-o", "x.png", "--layers", "17"],
                      ["render", "use.ply", "-o", "x.png", "--lines", "0"],
                      ["render", "use.ply", "-o", "x.png", "--lines", "2,1.5"],
                      ["render", "use.ply", "-o", "x.png", "--line-color", "1,0,0"],
                      ["render", "use.ply", "-o", "x.png", "--lines", "2", "--line-source", "ink"],
                      ["render", "use.ply", "-o", "x.png", "--background", "1,1"]):
        done = cli.run(*arguments, code=2)
        assert done.stderr.startswith("patina: ") and not done.stdout, arguments
    assert not (cli.FOLDER / "x.png").exists()


def test_pictures_are_png():
    """Whoever asks for another kind of picture is told, before anything is drawn; a file called JPEG that holds a PNG is no answer."""
    cli.ball("kind.ply", 100)
    for name in ("x.jpg", "x.JPEG", "x.exr", "folder.png/x.tif"):
        assert f"-o {name}: pictures are written as PNG" in cli.run("render", "kind.ply", "-o", name, code=2).stderr
        assert not (cli.FOLDER / name).exists()
    for name in ("x.PNG", "plain"):
        assert cli.run("render", "kind.ply", "-o", name, "--size", "8x8") and (cli.FOLDER / name).read_bytes()[1:4] == b"PNG"


def test_unknown_device():
    cli.ball("device.ply", 100)
    assert "abacus" in cli.run("render", "device.ply", "-o", "x.png", "--device", "abacus", code=1).stderr
