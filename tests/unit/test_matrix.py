# SPDX-License-Identifier: GPL-3.0-or-later
"""build/matrix claims nothing that was not run: python3 tests/unit/test_matrix.py"""

import json
import sys
import tempfile
import unittest
from pathlib import Path

from scripts import run, script

matrix = script("matrix")


def setting(blender="5.2.2 LTS", graphics="none", run="background tests", part=(1, 1), whole=True):
    said = {"blender": blender, "graphics": graphics, "system": "Debian, x86_64", "run": run, "part": list(part), "whole": whole}
    return f"setting: {json.dumps(said)}\n"


class Matrix(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.logs, self.before = Path(folder.name), matrix.LOGS
        matrix.LOGS = self.logs
        self.addCleanup(setattr, matrix, "LOGS", self.before)

    def of(self, text, name="a.log"):
        path = self.logs / name
        path.write_text(text)
        return matrix.of_blender(path)

    def test_a_run(self):
        run = self.of(setting() + "ok a\n3 passed, 1 failed, 2 skipped\n")
        self.assertEqual([run[name] for name in matrix.SUMS], [3, 1, 2])
        self.assertRegex(run["date"], r"^\d{4}-\d\d-\d\d$")

    def test_what_is_added_to_a_log_counts(self):
        run = self.of(setting() + "3 passed, 0 failed, 2 skipped\n0 passed, 1 failed, 0 skipped\n")
        self.assertEqual([run[name] for name in matrix.SUMS], [3, 1, 2])

    def test_a_crash_is_a_failure(self):
        run = self.of(setting() + "ok a\nFAIL b: why\n")
        self.assertEqual([run[name] for name in matrix.SUMS], [1, 2, 0])

    def test_named_tests_and_other_logs_are_left_out(self):
        self.assertIsNone(self.of(setting(whole=False) + "3 passed, 0 failed, 0 skipped\n"))
        self.assertIsNone(self.of("3 passed, 0 failed, 0 skipped\n"))

    def test_parts(self):
        parts = [self.of(setting(part=(part, 2)) + f"{part} passed, 0 failed, 0 skipped\n") for part in (1, 2)]
        self.assertEqual(matrix.joined(parts)[0]["passed"], 3)
        self.assertEqual(matrix.joined(parts[:1]), [])

    def test_the_newest_run_stays(self):
        old, new = ([self.of(setting() + f"{count} passed, 0 failed, 0 skipped\n")] for count in (1, 2))
        other = [self.of(setting("4.3.2") + "5 passed, 0 failed, 0 skipped\n")]
        self.assertEqual([row["passed"] for row in matrix.merged(old + other, new)], [5, 2])

    def test_newest_version(self):
        rows = [self.of(setting(version) + f"{passed} passed, 0 failed, 0 skipped\n") for version, passed in
                (("3.4.1", 5), ("5.2.2 LTS", 5), ("5.10.0", 1), ("6.0.0", 0))]
        self.assertIn("NEWEST = (5, 10)", matrix.tested(rows))

    def test_the_library_counts_if_all_of_it_ran(self):
        (self.logs / "release-unit-a.count").write_text("4 0 1 0 release/unit/a\n")
        (self.logs / "release-cli.count").write_text("2 1 0 1 release/cli\n")
        for words, found in (("", [[6, 1, 1]]), ("unit", [])):
            (self.logs / "words").write_text(f"{words}\nDebian, x86_64\n")
            self.assertEqual([[row[name] for name in matrix.SUMS] for row in matrix.of_others()], found)

    def test_the_commit_is_told(self):
        self.assertEqual(matrix.commit(), "–")
        (self.logs / "words").write_text("\nDebian, x86_64\n1234abcd+\n")
        row = self.of(setting() + "1 passed, 0 failed, 0 skipped\n")
        self.assertIn("| 1234abcd+ |", matrix.table([row | {"commit": matrix.commit()}]))
        self.assertTrue(matrix.table([row]).endswith("| – |"), "of a result that names none")

    def test_pages(self):
        text = f"before\n{matrix.BEGIN}\nold\n{matrix.END}\nafter\n"
        rows = [self.of(setting() + "3 passed, 0 failed, 2 skipped\n")]
        found = matrix.page(text, rows, "a page")
        self.assertTrue(found.startswith("before\n") and found.endswith(f"{matrix.END}\nafter\n") and "old" not in found, found)
        self.assertIn("| 5.2.2 LTS | – | Debian, x86_64 | background tests | 3 | 0 | 2 |", found)
        self.assertEqual(matrix.page(found, rows, "a page"), found)


if __name__ == "__main__":
    sys.exit(run())
