# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the tests of a script that may leave threads and folders behind."""

import os
import shutil
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
import runs  # noqa: E402
from runs import Skip  # noqa: E402

__all__ = ["Skip", "run_tests"]


def run_tests(tests, *scratch):
    """Runs the tests that the script's arguments name. Then removes the folders and ends the process, whatever threads are left."""
    passed, failed = runs.run_tests(tests, sys.argv[1:])
    for folder in scratch:
        shutil.rmtree(folder, ignore_errors=True)
    os._exit(1 if failed or not passed else 0)
