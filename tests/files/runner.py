# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the tests of a script, each by its name."""

import os
import shutil
import sys
import time
import traceback
from pathlib import Path


class Skip(Exception):
    pass


def run_tests(tests, *scratch):
    """tests: what the script's names mean; those that begin with test_ run, or which the arguments are a part of. Then removes the folders
    and ends the process, whatever threads are left."""
    passed = failed = skipped = 0
    for name, test in list(tests.items()):
        if not name.startswith("test_") or not callable(test) or sys.argv[1:] and not any(word in name for word in sys.argv[1:]):
            continue
        start = time.perf_counter()
        try:
            test()
        except Skip as reason:
            skipped += 1
            print(f"skip {name}: {reason}", flush=True)
        except Exception as error:
            failed += 1
            where = traceback.extract_tb(error.__traceback__)[-1]
            print(f"FAIL {name}: {type(error).__name__}: {error} ({Path(where.filename).name}:{where.lineno})", flush=True)
        else:
            passed += 1
            print(f"ok {name} ({time.perf_counter() - start:.2f} s)", flush=True)
    for folder in scratch:
        shutil.rmtree(folder, ignore_errors=True)
    print(f"{passed} passed, {failed} failed, {skipped} skipped", flush=True)
    os._exit(1 if failed or not passed else 0)
