# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the tests of a script, each by its name."""

import os
import shutil
import sys
import time
import traceback
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from names import chosen  # noqa: E402


class Skip(Exception):
    pass


def run_tests(tests, *scratch):
    """Runs the functions of tests, a dictionary by name, whose names begin with test_ and contain one of the script's arguments. Then removes
    the folders and ends the process, whatever threads are left."""
    passed = failed = skipped = 0
    for name in chosen([name for name, test in tests.items() if name.startswith("test_") and callable(test)], sys.argv[1:]):
        test = tests[name]
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
