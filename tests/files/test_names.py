# SPDX-License-Identifier: GPL-3.0-or-later
"""Names, job files and notes that somebody else chose: right to left, with commands for terminals, of any bytes; broken, deep, huge, of wrong types.
Each is used as it is, or one message says what is wrong, and no message commands a terminal or turns the order of what is read.

    PATINA_LIBRARY=... PYTHONPATH=(laspy, lazrs, pye57) python tests/files/test_names.py [NAME ...]"""

import contextlib
import importlib.util
import io
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import unicodedata
from pathlib import Path
from unittest import mock

import numpy as np
from patina_modules import ROOT, imported
from runner import Skip, run_tests

exporters, library, reading, scans = imported(
    "write.exporters", "read.importers.library", "read.importers.reading", "read.importers.scans")
SCRATCH = Path(tempfile.mkdtemp(prefix="patina-names-"))
PATINA = str(Path(os.environ["PATINA_LIBRARY"]).parent / "patina")
PLY = "ply\nformat ascii 1.0\nelement vertex 30\nproperty float x\nproperty float y\nproperty float z\nend_header\n" + \
    "".join(f"{i % 5} {i // 5} 0\n" for i in range(30))
NAMES = ("\u05e2\u05e0\u05df", "\u0633\u062d\u0627\u0628", "\u202egnp", "a\u2066b\u2069", "\u200f", "\u061c", "a\nb", "\x1b[31mred\x1b]0;x\x07", "\x9b2J", "tab\tand\rback\b",
         " ", "  .", "'\"$`&|;*?", "%s%n%08x", "-o", "--help", "#", "~", "\\", "n" * 225, "\u00e9", "e\u0301", "\U0001F5FF", "\ud83d\udc4d", os.fsdecode(b"\xff\xfe\xc3"),
         "CON", "nul", "file:", "http:x", "a?b=c", "{}", "$(id)")


def is_calm(text: str) -> bool:
    """Whether a terminal shows it as it is."""
    return not any(unicodedata.category(letter) == "Cc" and letter != "\n" or letter in "\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069"
                   for letter in text)


def patina(*arguments):
    return subprocess.run([PATINA, *map(os.fsencode, map(str, arguments))], capture_output=True, encoding="utf-8", errors="surrogateescape", cwd=SCRATCH,
                          timeout=60, check=False)


def test_names_of_files():
    """The command line and the add-on's readers and writers take them all; a message about one is calm and on one line."""
    tried = 0
    for stem in NAMES:
        try:
            path = SCRATCH / f"{stem}.ply"
            path.write_text(PLY)
        except (OSError, UnicodeEncodeError):  # the disk has no such name
            continue
        for arguments in (("info", f"./{path.name}"), ("convert", f"./{path.name}", f"./{stem}.cloud"), ("analyse", f"./{path.name}", "-o", f"./{stem}-known.ply"),
                          ("render", f"./{path.name}", f"./{stem}.cloud", "-o", f"./{stem}.png", "--size", "20x20"), ("info", f"./{stem}.cloud")):
            done = patina(*arguments)
            assert done.returncode == 0, f"{stem!r}, {arguments[0]}: {done.returncode} {done.stderr}"
            assert is_calm(done.stdout + done.stderr), f"{stem!r}, {arguments[0]}: {done.stdout + done.stderr!r}"
        gone = patina("info", f"./{stem}.gone.ply")
        assert gone.returncode == 1 and len(gone.stderr.splitlines()) == 1 and is_calm(gone.stderr), f"{stem!r}: {gone.stderr!r}"
        assert len(library.read(path, reading.Filter(), reading.Progress()).positions) == 30, stem
        for ending in exporters.NEEDS:
            out = SCRATCH / f"{stem}-out.{ending}"
            try:
                exporters.write(out, exporters.Points(np.zeros((3, 3)), None, None, {}))
            except exporters.ExportError as error:
                assert "needs the Python package" in str(error) or ending == "e57" and not ascii_path(out), f"{stem!r}: {error}"
            else:
                assert out.is_file(), f"{stem!r}.{ending}"
        assert not list(SCRATCH.glob(".patina-export-*"))
        tried += 1
    assert tried > 20, tried
    print(f"{tried} names")


def ascii_path(path: Path) -> bool:
    return str(path).isascii()


def test_names_of_attributes_and_comments():
    """What a file says about itself is printed calmly, too."""
    evil = "\x1b]0;owned\x07\u202egnp\x9b2J"
    (SCRATCH / "evil.ply").write_text(PLY.replace("format ascii 1.0\n", f"format ascii 1.0\ncomment {evil}\nobj_info {evil}\n")
                                      .replace("property float z\n", f"property float z\nproperty float {evil}\n").replace(" 0\n", " 0 1\n"))
    (SCRATCH / "evil.csv").write_text(f"x,y,z,{evil}\n1,2,3,4\n2,3,4,5\n")
    (SCRATCH / "evil.conf").write_text(f"bmesh {evil}.ply 0 0 0 0 0 0 1\n")
    for name in ("evil.ply", "evil.csv", "evil.conf"):
        for arguments in (("info", name), ("convert", name, "evil.cloud"), ("render", name, "-o", "evil.png", "--size", "8x8", "--ramp", evil)):
            done = patina(*arguments)
            assert done.returncode in (0, 1, 2) and is_calm(done.stdout + done.stderr), f"{name}, {arguments[0]}: {done.stdout + done.stderr!r}"


def test_pipe_as_cloud():
    """A named pipe is no file, whatever it is called; nothing waits for who writes into it."""
    if os.name == "nt":
        raise Skip("Windows has no named pipes among files")
    for ending in ("ply", "xyz", "cloud", "ptx", "conf"):
        os.mkfifo(SCRATCH / f"pipe.{ending}")
        for arguments in (("info", f"pipe.{ending}"), ("convert", f"pipe.{ending}", "x.cloud"), ("render", f"pipe.{ending}", "-o", "x.png")):
            done = patina(*arguments)
            assert done.returncode == 1 and f"pipe.{ending}" in done.stderr and "not a file" in done.stderr, f"{arguments}: {done.stderr}"


# ---- files of jobs

JOB = {"patina_job": 1, "kind": "tiles", "name": "x", "by": "patina", "program": PATINA, "version": "", "directory": str(SCRATCH), "output": "x.png", "rounds": 1,
       "arguments": ["scan.ply"], "files": {}, "tiles": [2, 2], "convert": []}


def task(folder, *words, script="task.py"):
    return subprocess.run([sys.executable, folder / script, *map(str, words)], capture_output=True, text=True, timeout=60, check=False)


def test_job_files():
    """Of whatever somebody wrote there the task says in one line what is wrong, and ends with 1."""
    folder = SCRATCH / "job"
    folder.mkdir()
    for name in ("task.py", "slurm.py"):
        shutil.copy(ROOT / "addon/farm" / name, folder)
    version = subprocess.run([PATINA, "--version"], capture_output=True, text=True, check=True).stdout.splitlines()[0]
    good = {**JOB, "version": version}
    cases = ["", "{", "[]", "null", "7", '"text"', "[" * 100_000, "9" * 5000, "\0", '{"patina_job": 2}', '{"patina_job": 1}', "{" + '"a": {' * 50_000,
             '{"patina_job": ' + "1" * 10_000 + "}"]
    for key in good:
        if key != "patina_job":
            for value in (None, 7, -1, 1e400, [], {}, "", [[]], [None], {"a": None}, True, ["\0"], "\0", [1 << 70], [-1, -1], "x" * 100_000):
                cases.append(json.dumps({**good, key: value}))
            cases.append(json.dumps({name: value for name, value in good.items() if name != key}))
    cases += [json.dumps({**good, "kind": "frames", "frames": frames, "options": options}) for frames, options in
              (([1], []), ([1], [7]), ([1], [["\0"]]), (["1"], [[]]), ([1.5], [[]]), ([1 << 40], [[]]), (7, []), ([1], None))]
    cases += [json.dumps({**good, "kind": "parts", "parts": parts}) for parts in (0, -1, "2", 1 << 40, [2], None, 1.5)]
    path = folder / "job.json"
    wrong = 0
    spec = importlib.util.spec_from_file_location("task", folder / "task.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for text in cases:
        path.write_bytes(text.encode("utf-8", "surrogatepass"))
        out, said = io.StringIO(), io.StringIO()
        with mock.patch.object(sys, "argv", ["task.py", "check"]), contextlib.redirect_stdout(out), contextlib.redirect_stderr(said):
            code = module.main()
        assert code in (0, 1) and len(said.getvalue().splitlines()) == code, f"{text[:200]}: {code} {said.getvalue()[:500]}"
        wrong += code
    assert wrong > len(cases) // 2, (wrong, len(cases))
    path.write_text("[" * 100_000)
    slurm = task(folder, "--dry", script="slurm.py")
    assert slurm.returncode == 1 and "Traceback" not in slurm.stderr and "job.json is damaged" in slurm.stderr, slurm.stderr
    if os.name != "nt":
        path.unlink()
        os.mkfifo(path)
        began = time.monotonic()
        assert "is no file" in task(folder, "check").stderr and time.monotonic() - began < 20
        path.unlink()
    assert "cannot be read" in task(folder, "check").stderr
    path.write_text(json.dumps(good))
    assert task(folder, "check").returncode == 0
    print(f"{len(cases)} job files, {wrong} refused")


def test_scans_of_properties():
    """What a .blend says of a cloud's scans is that, or nothing."""
    good = scans.packed([scans.Scan("a", 3, (0.0, 0.0, 1.0), 0.1)])
    assert len(scans.unpacked(good)) == 1
    for text in (None, 7, "", "[", "[" * 100_000, "9" * 5000, "{}", "[1]", "[[]]", good.replace("3", "1e999"), good.replace("3", "-3"), good.replace("0.1", '"x"'),
                 good.replace('"a"', "NaN").replace("3", "NaN"), good.replace("3", "null")):
        assert scans.unpacked(text) == [], repr(text)[:60]


if __name__ == "__main__":
    run_tests(globals(), SCRATCH)
