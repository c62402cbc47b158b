# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines of .github/SECURITY.md that need no Blender; tests/blender/check_security.py has the others.

    PATINA_LIBRARY=... PYTHONPATH=(laspy, lazrs) python tests/files/test_security.py [NAME ...]
"""

import ast
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import test_hostile
from runner import Skip, run_tests

ROOT = Path(__file__).resolve().parents[2]
LIBRARY = Path(os.environ["PATINA_LIBRARY"]).resolve()
PROGRAM = LIBRARY.with_name("patina")
SCRATCH = Path(tempfile.mkdtemp(prefix="patina-security-"))
sys.path.insert(0, str(ROOT / "addon/farm"))
import slurm  # noqa: E402
import task  # noqa: E402


def test_each_line_has_a_test():
    """Of SECURITY.md: each line's test is there, and the tests are named there."""
    text = (ROOT / ".github/SECURITY.md").read_text("utf-8")
    rows = [line.split("|")[2] for line in text.splitlines() if line.startswith("| ") and "Test" not in line]
    own = {name.removeprefix("test_") for name, test in globals().items() if name.startswith("test_") and callable(test)}
    others = set(re.findall(r"^def test_(\w+)", (ROOT / "tests/blender/check_security.py").read_text("utf-8"), re.M))
    named = {name for row in rows for name in re.findall(r"`([\w./]+)`", row)}
    assert len(rows) > 10 and all("`" in row for row in rows), rows
    files = {name for name in named if "." in name or "/" in name}
    assert named - files == (own | others) - {"each_line_has_a_test"}, (named - files) ^ (own | others)
    assert all((ROOT / "tests/files" / name).is_file() or (ROOT / name).is_file() for name in files), files


def test_sources_evaluate_nothing():
    """No text becomes code, none goes through a shell, and nothing is unpickled. Programs are started in four known places."""
    starts = set()
    for path in sorted((ROOT / "addon").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            place = f"{path.relative_to(ROOT)}:{getattr(node, 'lineno', 0)}"
            if isinstance(node, (ast.Import, ast.ImportFrom)):
                names = {alias.name.split(".")[0] for alias in node.names} | {str(getattr(node, "module", "")).split(".")[0]}
                assert "runpy" not in names or path.name == "starter.py", place  # which starts the add-on's own scripts
                assert not names & {"pickle", "marshal", "shelve", "dill", "yaml", "pty", "code"}, place
            if not isinstance(node, ast.Call):
                continue
            name = ast.unparse(node.func)
            assert name not in {"eval", "exec", "compile", "__import__", "os.system", "os.popen", "os.startfile", "np.load", "numpy.load",
                                "driver_namespace"}, f"{place}: {name}"
            assert not any(word.arg == "shell" or word.arg == "allow_pickle" for word in node.keywords), place
            if name.startswith("subprocess."):
                starts.add(str(path.relative_to(ROOT / "addon")))
    assert starts == {"farm/slurm.py", "farm/task.py", "read/readers.py", "read/streaming/__init__.py", "read/unpacking/__init__.py"}, starts


def imported(binary):
    if not shutil.which("nm"):
        raise Skip("nm is not installed, which lists what a library calls")
    told = subprocess.run(["nm", "-D", "--undefined-only", binary], capture_output=True, text=True, check=True).stdout
    return {line.split()[-1].partition("@")[0] for line in told.splitlines() if line.strip()}


def test_library_reaches_for_nothing():
    """No function of the C library that opens connections or starts programs; what is loaded are the names of OpenGL drivers."""
    wrong = {"socket", "connect", "bind", "listen", "getaddrinfo", "gethostbyname", "system", "popen", "fork", "vfork", "execve", "execv", "execvp", "execl",
             "execlp", "posix_spawn", "posix_spawnp"}
    for binary in (LIBRARY, PROGRAM):
        assert not imported(binary) & wrong, f"{binary.name}: {imported(binary) & wrong}"
    loads = {path.name for path in (ROOT / "native").rglob("*.c") if re.search(r"\b(dlopen|LoadLibrary\w*)\s*\(", path.read_text("utf-8"))}
    assert loads == {"platform_posix.c", "platform_windows.c"}, loads
    uses = {path.name for path in (ROOT / "native").rglob("*.c") if "pt_library_open(" in path.read_text("utf-8")} - loads
    assert uses <= {"context_egl.c", "context_osmesa.c", "context_wgl.c"}, uses


def test_command_line_writes_its_output_alone():
    folder = SCRATCH / "cli"
    (folder / "inside").mkdir(parents=True)
    rows = "".join(f"{i % 7} {i % 11} {i % 13}\n" for i in range(100))
    (folder / "inside/a.ply").write_text(f"ply\nformat ascii 1.0\nelement vertex 100\nproperty float x\nproperty float y\nproperty float z\nend_header\n{rows}")
    for words, made in (("info a.ply", set()), ("render a.ply -o a.png --size 32x24", {"a.png"}), ("convert a.ply b.ply", {"b.ply"}),
                        ("convert a.ply c.cloud", {"c.cloud"}), ("render c.cloud -o d.png --size 32x24 --lit --shadows", {"d.png"}),
                        ("scatter a.ply -o e.keys --size 32x24 --part 1/1", {"e.keys"}), ("merge e.keys -o f.png", {"f.png"}),
                        ("analyse a.ply -o g.ply", {"g.ply"})):
        before = {path for path in folder.rglob("*")}
        home = folder / "home"
        home.mkdir(exist_ok=True)
        done = subprocess.run([PROGRAM, *words.split(), *(["--device", "cpu"] if "render" in words else [])], cwd=folder / "inside",
                              env={**os.environ, "HOME": str(home), "TMPDIR": str(home)}, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{words}: {done.stderr}"
        new = {path.name for path in folder.rglob("*")} - {path.name for path in before} - {"home"}
        assert new == made, f"{words}: {new}"


def test_decoders_have_a_process():
    """Of LAZ and E57: nothing of these packages is loaded where the add-on runs, and the process has a limit."""
    test_hostile.needs("lazrs")
    script = (f"import sys; sys.path.insert(0, {str(ROOT / 'tests/files')!r}); sys.dont_write_bytecode = True\n"
              "import test_hostile as t; p = t.read(t.written('a.laz', t.laz_bytes())); print(len(p.positions))\n"
              "import lazrs, importlib; sys.modules.pop('lazrs')\n"
              "p = t.read(t.SCRATCH / 'a.laz'); print(len(p.positions), 'lazrs' in sys.modules); import shutil; shutil.rmtree(t.SCRATCH)\n")
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.stdout.split() == ["1000", "1000", "False"], done.stdout + done.stderr
    limits = (ROOT / "addon/read/unpacking/limits.py").read_text("utf-8")
    assert "RLIMIT_AS" in limits and "limit_memory(" in (ROOT / "addon/read/unpacking/main.py").read_text("utf-8")
    assert "limit_memory(" in (ROOT / "addon/read/streaming/reader.py").read_text("utf-8")


JOB = {"patina_job": 1, "rounds": 1, "arguments": ["a.ply"], "files": {}, "name": "tower", "kind": "tiles", "by": "patina", "program": "patina",
       "version": "1", "directory": ".", "output": "tower.png", "tiles": [2, 2], "convert": []}


def test_job_files_are_checked():
    """A job file that is data alone ends up in scripts for Slurm and in arguments of programs."""
    folder = SCRATCH / "job"
    folder.mkdir()
    kept, task.FOLDER, slurm.FOLDER = (task.FOLDER, slurm.FOLDER), folder, folder
    frames = {"kind": "frames", "frames": [1], "options": [[]]}
    cases = ({"name": "x\ntouch it-ran"}, {"name": 5}, {"name": "x\u2028y"}, {"program": "a\nb"}, {"directory": None}, {"output": "../.bashrc"}, {"tiles": ["1", 1]},
             {"tiles": [1 << 40, 1]}, {"rounds": -1}, {"kind": "frames\n"}, {"by": "sh"}, {"arguments": ["a.ply", "-o", "/etc/x"]},
             {"arguments": ["a.ply", "--dump-planes=/etc"]}, {"arguments": "a.ply"}, {"convert": [["a.ply", "/etc/x.cloud"]]},
             {"convert": [["a.ply", "../x.cloud"]]}, {"convert": [["a.ply", "clouds/x.sh"]]}, {"files": [1]}, {"patina_job": 2},
             frames | {"frames": ["1\ntouch it-ran"]}, frames | {"frames": []}, frames | {"options": [["--save-shadows", "/etc/x"]]}, frames | {"options": []},
             {"kind": "parts"}, {"kind": "parts", "parts": "3\ntouch it-ran"})
    try:
        for change in ({}, frames, {"convert": [["a.ply", str(folder / "clouds/1-a.cloud")]]}, {"name": "a; b $(c) 'd'"}):
            (folder / "job.json").write_text(json.dumps(JOB | change))
            task.read_job()
            sys.argv = ["slurm.py", "--dry"]
            assert slurm.main() == 0
            for script in (folder / "slurm").glob("*.sh"):
                done = subprocess.run(["sh", "-n", script], capture_output=True, text=True, check=False)
                assert done.returncode == 0, done.stderr
        for change in cases:
            shutil.rmtree(folder / "slurm", ignore_errors=True)
            (folder / "job.json").write_text(json.dumps(JOB | change))
            sys.argv = ["slurm.py", "--dry"]
            assert slurm.main() == 1, change
            sys.argv = ["task.py", "check"]
            assert task.main() == 1, change
            assert not (folder / "slurm").exists(), change
    finally:
        task.FOLDER, slurm.FOLDER = kept


if __name__ == "__main__":
    run_tests(globals(), SCRATCH, test_hostile.SCRATCH)
