# SPDX-License-Identifier: GPL-3.0-or-later
"""What frames of OpenGL ask of a GPU, against limits: counts are the same on every driver, so a machine without a GPU checks them. Software
takes the ways of a GPU here.

    test_counts.py [--table]   --table: prints today's counts"""

from __future__ import annotations

import os
import sys
import unittest
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent))

import gpu  # noqa: E402

import native  # noqa: E402

os.environ["PATINA_GL_AS"] = "hardware"
POINTS, SIZE = 1_000_000, (1024, 1024)
# what → count → (limit, goal). A limit is what the code reaches, and a few percent, since math libraries round the points differently.
# A change that lowers a count lowers its limit here. The goals are those of the design. "calls": per dispatch; "bytes": megabytes.
LIMITS: dict[str, dict[str, tuple[float, float]]] = {
    "surface": {"dispatches": (20, 10), "empty": (0, 0), "calls": (16, 3), "copies": (2, 0), "waits": (2, 1), "bytes": (360, 110)},
    "6 layers": {"dispatches": (66, 50), "empty": (0, 0), "calls": (15, 3), "copies": (7, 0), "waits": (4, 1)},
    "shadows 10": {"dispatches": (104, 60), "empty": (0, 0), "calls": (18, 3), "copies": (28, 0), "waits": (13, 1)},
}


def counts(frame: native.Frame, subject: gpu.Subject, what: str) -> dict[str, float]:
    """Of a frame whose programs are compiled and whose cloud is uploaded."""
    for measured in (False, True):
        frame.measure(measured)
        frame.render(subject.scene(what, SIZE, 0.0))
    found: dict[str, Any] = frame.pass_stats()["gl"]
    return {**found, "calls": found["calls"] / found["dispatches"], "bytes": found["bytes"] / 1e6}


class Counts(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        try:
            cls.frame = native.Frame(native.Device("gl-egl"))
        except native.PatinaError as error:
            raise unittest.SkipTest(f"there is no OpenGL device here: {error}") from None
        cls.subject = gpu.Subject(POINTS)

    def test_limits(self) -> None:
        for what, limits in LIMITS.items():
            found = counts(self.frame, self.subject, what)
            print(f"{what}: " + ", ".join(f"{name} {found[name]:.4g} (at most {limit:g}, goal {goal:g})" for name, (limit, goal) in limits.items()))
            for name, (limit, goal) in limits.items():
                with self.subTest(what=what, count=name):
                    self.assertLessEqual(found[name], limit)
                    self.assertGreaterEqual(limit, goal, "a limit below the goal: the goal is reached, write it in both places")


if __name__ == "__main__":
    if "--table" in sys.argv:
        subject, frame = gpu.Subject(POINTS), native.Frame(native.Device("gl-egl"))
        for what in LIMITS:
            print(what, counts(frame, subject, what), flush=True)
        sys.exit(0)
    result = unittest.main(exit=False, verbosity=0).result
    failed, skipped = len(result.failures) + len(result.errors), len(result.skipped)
    print(f"{max(result.testsRun - failed - skipped, 0)} passed, {failed} failed, {skipped} skipped")
    sys.exit(1 if failed else 0)
