# SPDX-License-Identifier: GPL-3.0-or-later
"""Expected errors hold on shapes that the curves were not measured on, and a target that can be met is met."""

from __future__ import annotations

import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import curves  # noqa: E402

import native  # noqa: E402

FACTOR = 2.0  # other shapes have more outline or less; the figures say what was found, and how far a gyroid is off


class Expected(unittest.TestCase):
    def setUp(self) -> None:
        self.frame = native.Frame(native.Device("cpu", 0))

    def test_other_shapes(self) -> None:
        for surface in ("corner", "saddle"):
            for density in (4.0, 1.0, 0.3):
                stats, found = curves.rendered(self.frame, surface, density)
                expected = stats["expected"]
                print(f"  {surface:7} {density:4} points a pixel, spacing {stats['spacing_px']:.2f} pixels: colour "
                      f"{found['color']:.4f} (expected {expected['color']:.4f}), coverage {found['coverage']:.4f} "
                      f"({expected['coverage']:.4f}), depth {found['depth']:.2f} ({expected['depth']:.2f}), normals "
                      f"{found['normal']:.2f} ({expected['normal']:.2f})")
                self.assertLess(found["color"], FACTOR * expected["color"], (surface, density))

    def test_doubt_is_honest(self) -> None:
        """Shapes, patterns and noise that nothing was measured on stay within the doubt."""
        for surface, more in (("astroid", {}), ("sphere", {"noise": 1.0}), ("sphere", {"pattern": "rows"}), ("sphere", {"strays": 0.001})):
            for settings in ({"surface": 2}, {"surface": 1}):
                stats, found = curves.rendered(self.frame, surface, 1.0, shape=more, **settings)
                expected = stats["expected"]
                print(f"  {surface:7} {more or ''} {'discs' if settings['surface'] == 1 else 'filling'}: colour {found['color']:.4f}, "
                      f"{found['color'] / expected['color']:.1f} times what is expected, doubt {expected['doubt']:.0f}")
                self.assertLess(found["color"], expected["doubt"] * expected["color"], (surface, more))

    def test_targets_are_met(self) -> None:
        costs = []
        for target in (0.1, 0.02):
            for density in (15.0, 4.0, 1.0):
                stats, found = curves.rendered(self.frame, "torus", density, error_target=target)
                self.assertLessEqual(stats["expected"]["color"], target)
                self.assertLess(found["color"], 1.25 * target, (target, density))
                costs.append(len([name for name in self.frame.pass_stats()["passes"] if name in ("pull", "fill", "push")]))
        self.assertEqual(costs[0], 0)  # dense points and a coarse target: nothing is filled
        self.assertGreater(costs[-1], 0)


if __name__ == "__main__":
    unittest.main()
