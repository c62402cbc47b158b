# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the tests of a script, and counts them for build/test. Needs Python's own library only."""

import time
import traceback

from names import chosen


class Skip(Exception):
    """The reason why a test cannot run here."""


def run_tests(tests, words=(), before=lambda: None):
    """Runs the functions of tests, a dictionary by name, whose names begin with test_ and contain one of the words. before: is called before
    each. Prints a line for each, and the sums. Returns how many passed and how many failed."""
    passed = failed = skipped = 0
    for name in chosen([name for name, test in tests.items() if name.startswith("test_") and callable(test)], words):
        start = time.perf_counter()
        try:
            before()
            tests[name]()
        except Skip as reason:
            skipped += 1
            print(f"skip {name}: {reason}", flush=True)
        except Exception:
            failed += 1
            print(f"FAIL {name}\n{traceback.format_exc()}", flush=True)
        else:
            passed += 1
            print(f"ok {name} ({time.perf_counter() - start:.2f} s)", flush=True)
    print(f"{passed} passed, {failed} failed, {skipped} skipped", flush=True)
    return passed, failed
