# SPDX-License-Identifier: GPL-3.0-or-later
"""Saved clouds and shadow files of 0.x, as old commits wrote them: compatibility/README.md.

    PATINA_LIBRARY=... python tests/files/test_compatibility.py [NAME ...]
"""

import gzip
import os
import subprocess
import tempfile
from pathlib import Path

from runner import run_tests

PATINA = str(Path(os.environ["PATINA_LIBRARY"]).resolve().parent / "patina")
FILES = Path(__file__).resolve().parent / "compatibility"
SCRATCH = Path(tempfile.mkdtemp(prefix="patina-compatibility-"))
SMALL = ("--size", "64x64", "--threads", "1", "--device", "cpu-scalar")
LIGHT = ("--analysis", "off", "--lit", "--sun", "-30,20", "--shadows")
OLDER = ("cloud-10.cloud", "cloud-13.cloud")


def run(*arguments, code=0):
    done = subprocess.run([PATINA, *map(str, arguments)], capture_output=True, text=True, cwd=SCRATCH, timeout=120, check=False)
    assert done.returncode == code, f"{arguments}: {done.returncode} in place of {code}: {done.stderr}"
    return done


def unpack():
    for path in FILES.glob("*.gz"):
        (SCRATCH / path.stem).write_bytes(gzip.decompress(path.read_bytes()))


def described(name):
    """What `patina info` says of a cloud's points: all but the size of the file, the analysis and the spacing, which depends on it."""
    lines = run("info", name).stdout.splitlines()
    return [line for line in lines if line.split()[0] in ("format", "points", "positions", "box", "columns")]


def test_older_clouds_are_analyzed_again():
    """They hold the same points. These get the kinds that they have today, and render with one warning."""
    run("convert", "relief.ply", "now.cloud")
    now = run("analyse", "now.cloud", "-o", "again.cloud").stdout
    assert "surface" in now and len(described("now.cloud")) >= 4, now
    for name in OLDER:
        assert described(name) == described("now.cloud"), name
        assert run("analyse", name, "-o", "then.cloud").stdout == now, name
        said = run("render", name, "-o", "then.png", *SMALL).stderr
        assert said.count("warning: ") == 1 and f"{name}: saved by an older version" in said and "600 points" in said, said
        assert "warning" not in run("render", "then.cloud", "-o", "then.png", *SMALL).stderr, "the new file needs no analysis"


def test_older_shadows_are_used():
    """The same image as with shadows that are computed today."""
    run("render", "bare-13.cloud", "-o", "now.png", *SMALL, *LIGHT)
    run("render", "bare-13.cloud", "-o", "then.png", *SMALL, *LIGHT, "--load-shadows", FILES / "bare-13.shadows")
    assert (SCRATCH / "then.png").read_bytes() == (SCRATCH / "now.png").read_bytes()
    run("render", "bare-13.cloud", "-o", "bare.png", *SMALL, *LIGHT[:-1])
    assert (SCRATCH / "bare.png").read_bytes() != (SCRATCH / "now.png").read_bytes(), "there are no shadows"


def test_a_form_that_is_not_read_is_named():
    said = run("render", "first-10.cloud", "-o", "first.png", *SMALL, code=1).stderr
    assert "first-10.cloud: a saved cloud of another version" in said, said


if __name__ == "__main__":
    unpack()
    run_tests(globals(), SCRATCH)
