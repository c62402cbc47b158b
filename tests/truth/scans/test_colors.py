# SPDX-License-Identifier: GPL-3.0-or-later
"""Images of virtual scans whose colors have faults, against the exact view: balanced scans and lent colors are near the truth again."""

from __future__ import annotations

import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from truth.scans import colors  # noqa: E402


class Colors(unittest.TestCase):
    def test_three_scenes(self) -> None:
        for name in ("room", "facade", "columns"):
            found = colors.measured(name, 5.0)
            print(name, {key: round(value, 2) for key, value in found.items()})
            with self.subTest(name):
                self.assertLess(found["exposed"], found["own colors"] - 2.0)
                self.assertGreater(found["balanced"], found["own colors"] - 1.0)
                self.assertLess(found["uncolored"], found["own colors"] - 0.5)
                self.assertGreater(found["lent"], found["own colors"] - 0.2)


if __name__ == "__main__":
    unittest.main()
