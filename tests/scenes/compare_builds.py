# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether two builds give the same bytes: every scene of builds_cases.py is drawn by both, and every pass of every picture compared.

    build/out/venv/bin/python tests/scenes/compare_builds.py OLD NEW [--device cpu gl-egl ...] [--only WORD ...] [--keep FOLDER]

OLD, NEW: a library, beside or below the tree whose addon/native belongs to it, or such a tree, whose release build is meant. Each is
loaded in a process of its own with the binding of its own tree. Ends with 1 where a byte differs or NEW cannot draw what OLD can;
what OLD has no name for is only listed. --keep writes the planes that differ as FOLDER/SCENE.old.npz and .new.npz.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import builds_cases  # noqa: E402


def located(given: str) -> tuple[Path, Path]:
    """A library and the folder that holds its binding."""
    path = Path(given).resolve()
    library = path
    if path.is_dir():
        library = next((path / name for name in ("build/out/release/libpatina.so", "libpatina.so") if (path / name).is_file()), path)
    if not library.is_file():
        sys.exit(f"compare_builds: there is no library at {given}")
    for folder in library.parents:
        if (folder / "addon/native/__init__.py").is_file():
            return library, folder / "addon"
    sys.exit(f"compare_builds: no addon/native beside or above {library}")


class Process:
    """A build that does what it is asked; what it says first is in `first`."""

    def __init__(self, build: tuple[Path, Path], device: str, threads: int = 0) -> None:
        command = [sys.executable, HERE / "builds_side.py", *build, device, str(threads)]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.first = self.hear()

    def tell(self, **asked: Any) -> None:
        try:
            print(json.dumps(asked), file=self.process.stdin, flush=True)
        except BrokenPipeError:
            pass  # hear() says so

    def hear(self) -> dict[str, Any]:
        line = self.process.stdout.readline()
        return json.loads(line) if line else {"error": f"the process ended with {self.process.wait()}"}

    def ask(self, **asked: Any) -> dict[str, Any]:
        self.tell(**asked)
        return self.hear()

    def close(self) -> None:
        self.process.stdin.close()
        self.process.stdout.close()
        self.process.wait()


def differences(old: dict[str, str], new: dict[str, str]) -> list[str]:
    """Planes that are not the same, or that the new side lacks. What only the new one has is a pass that the old one does not know."""
    return [name for name in old if old[name] != new.get(name)]


def measured(old: Process, new: Process, folder: Path, name: str, planes: Iterable[str]) -> str:
    """By how much the planes drawn last differ, those that only one has left out."""
    files = []
    for side, process in (("old", old), ("new", new)):
        path = folder / f"{name.replace('/', '_')}.{side}.npz"
        process.ask(save=str(path))
        files.append(np.load(path))
    told = []
    for plane in planes:
        if any(plane not in file.files or file[plane].shape != files[0][plane].shape for file in files if plane in files[0].files):
            told.append(f"{plane}: only one has it, or its shape differs")
            continue
        if plane not in files[0].files:
            told.append(f"{plane}: only the new one has it")
            continue
        a, b = (file[plane] for file in files)
        unlike = (a != b) & ~((a != a) & (b != b))
        with np.errstate(all="ignore"):
            by = np.abs(a[unlike].astype(float) - b[unlike].astype(float)).max(initial=0.0)
        told.append(f"{plane}: {unlike.sum()} of {unlike.size} by {by:.3g}")
    return "; ".join(told)


def compared(old: Process, new: Process, cases: Iterable[dict[str, Any]], folder: Path, say=print) -> tuple[int, int, int]:
    """(same, differing, not known to the old one) of the cases."""
    same = differing = unknown = 0
    for case in cases:
        old.tell(draw=case)
        new.tell(draw=case)
        had, has = old.hear(), new.hear()
        if "unknown" in had:
            unknown += 1
            say(f"  new    {case['name']}: the old header has no {had['unknown']}")
        elif "error" in had or "error" in has or "unknown" in has:
            differing += 1
            say(f"  FAILED {case['name']}: old {had.get('error', 'drew it')}, new {has.get('error', has.get('unknown', 'drew it'))}")
        elif planes := differences(had, has):
            differing += 1
            say(f"  DIFFER {case['name']}: {measured(old, new, folder, case['name'], planes)}")
        else:
            same += 1
    return same, differing, unknown


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("--device", nargs="+", default=["cpu"])
    parser.add_argument("--only", nargs="+", default=[], help="scenes whose name contains one of these")
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--keep", type=Path)
    given = parser.parse_args()
    builds = [located(name) for name in (given.old, given.new)]
    cases = [case for case in builds_cases.cases() if not given.only or any(word in case["name"] for word in given.only)]
    bad = 0
    with tempfile.TemporaryDirectory() as throwaway:
        folder = given.keep or Path(throwaway)
        folder.mkdir(parents=True, exist_ok=True)
        for device in given.device:
            old, new = (Process(build, device, given.threads) for build in builds)
            if "error" in old.first and old.first == new.first:
                print(f"skip {device}: {old.first['error']}")
            elif "error" in old.first or "error" in new.first:
                bad += 1
                print(f"FAILED {device}: old {old.first}, new {new.first}")
            else:
                print(f"{device}: {new.first['device']}")
                same, differing, unknown = compared(old, new, cases, folder)
                bad += differing
                print(f"{device}: {same} scenes are the same, {differing} differ" + (f", {unknown} are new" if unknown else ""))
            old.close()
            new.close()
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
