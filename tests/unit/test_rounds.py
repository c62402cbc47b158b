#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""A town of twenty million points under --memory: test_rounds.py PATINA TOWN. The same bytes, the memory that was asked for, and what
the command line tells of it. Needs Python's own library only."""
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from runs import Skip, run_tests  # noqa: E402

PATINA, TOWN = (str(Path(path).resolve()) for path in sys.argv[1:3])
FOLDER = Path()  # a temporary one, set by main
ACROSS, QUARTER = 7, 400_000  # quarters a side, points of each
CAP, LEAST_SAVED = 44, 200  # MB: what may be held; that a whole picture takes more
BESIDE, OPENGL, MAPS = 110, 300, 950  # MB: planes and the program; those of a light's map of 4096 x 4096, and shadow words
LOOK = "-60,-90,120,140,140,10,45"
STREET = "142,126,15,154,150,12,50"  # in the middle, along it: what it shows is a small part of what is in view


def run(*arguments, code=0):
    """What it prints, and the most memory that it held, MB."""
    with subprocess.Popen([PATINA, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=FOLDER) as child:
        out, err = child.stdout.read(), child.stderr.read()
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
    assert child.returncode == code, f"{arguments}: exit {child.returncode}, expected {code}: {err}{out}"
    return out + err, usage.ru_maxrss / 1024


def draw(name, *arguments, device="cpu", look=LOOK):
    """The picture's bytes, its statistics, and its peak."""
    text, peak = run("render", "town.cloud", "-o", name, "--device", device, "--size", "640x360", "--look", look,
                     "--repeat", 1, "--stats", "json", *arguments)
    return (FOLDER / name).read_bytes(), json.loads(text[text.index("{"):text.rindex("}") + 1])["mapped"], peak


def compare(what, beside, *arguments, device="cpu"):
    whole, fits, most = draw("whole.png", "--memory", "100G", *arguments, device=device)
    rounds, told, peak = draw("rounds.png", "--memory", f"{CAP}M", *arguments, device=device)
    print(f"  {what}: {most:.0f} MB whole, {peak:.0f} MB under {CAP}: {told}")
    assert whole == rounds, f"{what}: the bytes differ"
    assert fits["cap"] == 0 and fits["bytes"] > 19 * QUARTER * ACROSS**2, fits
    assert told["cap"] == CAP * 10**6 and told["held"] < 1.5 * CAP * 10**6, told
    assert told["read"] > CAP * 10**6, (told, fits)
    assert device != "cpu" or told["read"] <= fits["read"], (told, fits)  # without what is hidden
    assert peak < CAP + beside and peak < most - LEAST_SAVED, (peak, most)
    return told


def test_filled():
    assert compare("filled", BESIDE, "--surface", "fill")["rounds"] > 6


def test_shadows():
    assert compare("shadows", MAPS, "--surface", "fill", "--lit", "--shadows", "--samples", 1, "--cull")["rounds"] > 6


def test_street():
    """What houses hide is not read, whether or not points are left out for their trust."""
    whole, fits, _ = draw("whole.png", "--memory", "100G", "--surface", "fill", look=STREET)
    rounds, told, _ = draw("rounds.png", "--memory", f"{CAP}M", "--surface", "fill", look=STREET)
    print(f"  street: {told} of {fits}")
    assert whole == rounds, "the bytes differ"
    assert told["cap"] == CAP * 10**6 and fits["cap"] == 0 and told["read"] < 0.6 * fits["read"], (told, fits)


def test_plan():
    plan, _ = run("render", "town.cloud", "--dump-plan", "--memory", f"{CAP}M", "--size", "640x360", "--look", LOOK, "--device", "cpu")
    assert f"rounds of at most {CAP / 2:.1f} MB: clouds in files are larger than the {CAP:.1f} MB" in plan, plan
    assert any(line.lstrip().startswith("run  scatter") and " rounds for " in line for line in plan.splitlines()), plan
    plan, _ = run("render", "town.cloud", "--dump-plan", "--memory", "100G", "--size", "640x360", "--look", LOOK, "--device", "cpu")
    assert "rounds" not in plan, plan


def test_opengl():
    """Ranges of points instead of a copy of the cloud."""
    there = subprocess.run([PATINA, "render", "town.cloud", "-o", "small.png", "--size", "16x9", "--device", "gl-egl"], cwd=FOLDER,
                           capture_output=True, text=True, check=False)
    if there.returncode and "libEGL" in there.stderr:
        raise Skip(f"there is no OpenGL here: {there.stderr.strip()}")
    assert not there.returncode, there.stderr
    told = compare("OpenGL", OPENGL, "--surface", "fill", device="gl-egl")
    assert told["rounds"] > 6, told
    plan, _ = run("render", "town.cloud", "--dump-plan", "--memory", f"{CAP}M", "--size", "640x360", "--look", LOOK, "--device", "gl-egl")
    scatter = next(line for line in plan.splitlines() if line.lstrip().startswith("run  scatter"))
    assert f", in {told['rounds']} rounds for " in scatter, (scatter, told)
    assert f"rounds of at most {CAP / 2:.1f} MB: clouds are larger than the {CAP:.1f} MB" in plan, plan


def test_wrong_sizes():
    for size in ("", "2", "0G", "-1G", "2Q", "2GB", "nan", "1e40G", "10k"):
        text, _ = run("render", "town.cloud", "-o", "none.png", "--memory", size, code=2)
        assert f"'{size}' is no value for option '--memory'" in text, text


def main():
    global FOLDER
    with tempfile.TemporaryDirectory() as folder:
        FOLDER = Path(folder)
        subprocess.run([TOWN, FOLDER / "town.cloud", str(ACROSS), str(QUARTER)], check=True, stdout=subprocess.DEVNULL)
        sys.exit(run_tests(globals(), sys.argv[3:])[1] > 0)


if __name__ == "__main__":
    main()
