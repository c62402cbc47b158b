# SPDX-License-Identifier: GPL-3.0-or-later
"""More samples of a pixel never make a picture worse: 1 to 64, on every shape of the independent check and a sphere, at
densities that fill and that are averaged, and as discs."""

from __future__ import annotations

import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import metrics  # noqa: E402
import stage  # noqa: E402
from modes import MODES, scene_of  # noqa: E402

import native  # noqa: E402

SIZE, SAMPLES = 192, (1, 2, 4, 8, 16, 32, 64)
BLUR = 0.5  # dB that a mean of two may lose to one picture: it is as wide again
# Where a surface ends in an edge without an angle, filling and anti-aliasing by a whole pixel make up for each other, by chance.
SHARP = {"astroid": 2.5}


class Samples(unittest.TestCase):
    def setUp(self) -> None:
        self.frame = native.Frame(native.Device("cpu", 0))

    def decibels(self, shape: str, density: float, **settings: int) -> list[float]:
        shown = stage.stage_of({"surface": shape, "points": stage.density_count(shape, density, SIZE)})
        cloud = native.Cloud(shown.position, shown.normal, shown.color)
        if not settings:
            cloud.analyse()
        exact, found = shown.exact(0.0, SIZE, SIZE), []
        for samples in SAMPLES:
            with scene_of(cloud, shown, MODES["surface"], (SIZE, SIZE), 0.0, passes=1, pixel_samples=samples, **settings) as scene:
                self.frame.render(scene)
            found.append(metrics.seen(exact, metrics.Shown(self.frame.read("COMBINED")))["color_psnr"])
        print(f"  {shape:8} {density:4} points a pixel{' ' * bool(settings)}{settings or ''}: " +
              ", ".join(f"{value:.1f}" for value in found) + " dB")
        return found

    def test_never_worse(self) -> None:
        for surface in ("sphere", *stage.scenes.SHAPES):
            for density in (1.0, 4.0):
                found = self.decibels(surface, density)
                for i in range(1, len(found)):
                    self.assertGreater(found[i], max(found[:i]) - SHARP.get(surface, BLUR), (surface, density, SAMPLES[i]))

    def test_sixteen(self) -> None:
        self.assertGreater(self.decibels("sphere", 4.0)[SAMPLES.index(16)], 41.0)
        found = self.decibels("sphere", 4.0, surface=1)
        self.assertGreater(found[SAMPLES.index(16)], 47.0)
        self.assertEqual(max(found), found[-1])


if __name__ == "__main__":
    unittest.main()
