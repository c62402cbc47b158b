# SPDX-License-Identifier: GPL-3.0-or-later
"""The metrics bite: the exact picture scores as exact, and each kind of damage is worse on its own metric, the more so
the more of it there is."""

from __future__ import annotations

import sys
import unittest
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))

import metrics  # noqa: E402
from metrics import BEST_HIGH, Shown, errors  # noqa: E402
from truth import Scene, orbit, scenes  # noqa: E402

SIZE, SPACING = 160, 0.02
EXACT = scenes.build("torus").picture(orbit(), SIZE, SIZE)
PERFECT = Shown(EXACT.smooth, EXACT.depth, EXACT.normal)
RANDOM = np.random.default_rng(9)


def blurred(image: np.ndarray, times: int) -> np.ndarray:
    for _ in range(times):
        wide = np.pad(image, ((1, 1), (1, 1), (0, 0)), mode="edge")
        image = sum(wide[dy : dy + SIZE, dx : dx + SIZE] for dy in range(3) for dx in range(3)) / 9.0
    return image


def shifted(pixels: int) -> Shown:
    return Shown(*(np.roll(plane, pixels, axis=1) for plane in (PERFECT.rgba, PERFECT.depth, PERFECT.normal)))


def color_blurred(times: int) -> Shown:
    """Colours alone: premultiplied colour blurred, alpha kept."""
    rgba = EXACT.smooth.copy()
    inside = blurred(EXACT.smooth, times)
    rgba[..., :3] = inside[..., :3] / np.maximum(inside[..., 3:4], 1e-9) * rgba[..., 3:4]
    return replace(PERFECT, rgba=rgba)


def holed(share: float) -> Shown:
    open_ = np.random.default_rng(3).random((SIZE, SIZE)) < share
    return Shown(np.where(open_[..., None], 0.0, EXACT.smooth), np.where(open_, np.inf, EXACT.depth),
                 np.where(open_[..., None], 0.0, EXACT.normal))


def grown(pixels: int) -> Shown:
    rgba, depth = EXACT.rgba.copy(), EXACT.depth.copy()
    for _ in range(pixels):
        wide = np.pad(depth, 1, constant_values=np.inf)
        color = np.pad(rgba, ((1, 1), (1, 1), (0, 0)))
        for dy in range(3):
            for dx in range(3):
                fill = ~np.isfinite(depth) & np.isfinite(wide[dy : dy + SIZE, dx : dx + SIZE])
                depth[fill] = wide[dy : dy + SIZE, dx : dx + SIZE][fill]
                rgba[fill] = color[dy : dy + SIZE, dx : dx + SIZE][fill]
    return Shown(rgba, depth, EXACT.normal)


def deeper(spacings: float) -> Shown:
    return replace(PERFECT, depth=EXACT.depth + spacings * SPACING * RANDOM.normal(size=EXACT.depth.shape))


def leaning(degrees: float) -> Shown:
    turn = np.radians(degrees)
    across = np.cross(EXACT.normal, [0.3, 0.5, 0.81])
    across /= np.maximum(np.linalg.norm(across, axis=2)[..., None], 1e-9)
    return replace(PERFECT, normal=np.cos(turn) * EXACT.normal + np.sin(turn) * across)


class Bite(unittest.TestCase):
    def worse(self, name: str, better: dict[str, float], other: dict[str, float]) -> None:
        difference = other[name] - better[name]
        self.assertGreater(-difference if name in BEST_HIGH else difference, 1e-9, f"{name}: {better} {other}")

    def ladder(self, damage, strengths: tuple, own: tuple[str, ...], untouched: tuple[str, ...]) -> None:
        """Each stronger damage is worse on its own metrics, and leaves the others as they were."""
        none = errors(EXACT, PERFECT, SPACING)
        before = none
        for strength in strengths:
            now = errors(EXACT, damage(strength), SPACING)
            for name in own:
                self.worse(name, before, now)
            for name in untouched:
                self.assertAlmostEqual(none[name], now[name], 9, f"{damage.__name__} {strength}: {name}")
            before = now

    def test_the_truth_is_exact(self) -> None:
        result = errors(EXACT, PERFECT, SPACING)
        self.assertEqual(result["coverage_iou"], 1.0)
        self.assertEqual(result["color_psnr"], 120.0)
        self.assertAlmostEqual(result["color_ssim"], 1.0, 12)
        for name in ("false_holes", "false_growth", "alpha_rms", "depth_rms_spacings", "depth_p999_spacings"):
            self.assertEqual(result[name], 0.0)
        self.assertLess(result["normal_p99_degrees"], 1e-5)
        self.assertTrue(set(result) <= set(metrics.MEANING))

    def test_shifted(self) -> None:
        self.ladder(shifted, (1, 2, 4), ("coverage_iou", "alpha_rms", "depth_rms_spacings", "normal_mean_degrees",
                                         "color_psnr", "color_ssim", "color_rms"), ())

    def test_blurred(self) -> None:
        self.ladder(color_blurred, (1, 3, 8), ("color_psnr", "color_rms"),
                    ("coverage_iou", "alpha_rms", "depth_rms_spacings", "normal_mean_degrees"))
        fine = (np.indices((SIZE, SIZE)).sum(axis=0) % 2)[..., None] * 0.4 + 0.6  # detail that a blur takes away
        detailed = replace(EXACT, smooth=EXACT.smooth * [1.0, 1.0, 1.0, 1.0] * np.concatenate(
            [np.repeat(fine, 3, axis=2), np.ones_like(fine)], axis=2))
        sharp = metrics.seen(detailed, Shown(detailed.smooth))["color_ssim"]
        soft = metrics.seen(detailed, Shown(blurred(detailed.smooth, 1)))["color_ssim"]
        self.assertGreater(sharp - soft, 0.2)

    def test_holed(self) -> None:
        self.ladder(holed, (0.001, 0.01, 0.1),
                    ("coverage_iou", "false_holes", "inner_holes", "color_psnr", "color_ssim"),
                    ("false_growth", "depth_rms_spacings"))

    def test_grown(self) -> None:
        self.ladder(grown, (1, 2, 4), ("coverage_iou", "false_growth", "color_psnr"),
                    ("false_holes", "depth_rms_spacings"))
        self.assertGreater(errors(EXACT, grown(3), SPACING)["outer_growth"], 0.01)
        self.assertEqual(errors(EXACT, grown(1), SPACING)["outer_growth"], 0.0)

    def test_depth_and_normals(self) -> None:
        self.ladder(deeper, (0.1, 0.5, 2.0), ("depth_rms_spacings", "depth_p999_spacings"),
                    ("coverage_iou", "color_psnr"))
        self.assertAlmostEqual(errors(EXACT, deeper(0.5), SPACING)["depth_rms_spacings"], 0.5, 1)
        self.ladder(leaning, (0.1, 1.0, 10.0), ("normal_mean_degrees", "normal_p99_degrees"), ("coverage_iou",))
        self.assertAlmostEqual(errors(EXACT, leaning(5.0), SPACING)["normal_mean_degrees"], 5.0, 6)

    def test_transmittance(self) -> None:
        scene = scenes.build("tori")
        clear = Scene(scene.surfaces[1:], scene.lights)
        exact = clear.picture(orbit(), 64, 64, layers=8, antialias=0)
        own = Shown(exact.rgba, exact.depth, exact.normal)
        self.assertLess(errors(exact, own, SPACING)["transmittance_rms"], 1e-12)
        last = 0.0
        for layers in (4, 2, 1):  # cut too early: too much shows through
            cut = clear.picture(orbit(), 64, 64, layers=layers, antialias=0).rgba
            now = errors(exact, replace(own, rgba=cut), SPACING)["transmittance_rms"]
            self.assertGreater(now, last)
            last = now

    def test_shadow(self) -> None:
        scene = scenes.build("shadow")
        exact = scene.picture(orbit(), 96, 96, antialias=0, shadow_samples=1)
        bare = scene.picture(orbit(), 96, 96, antialias=0)
        dark = Scene(scene.surfaces, ()).picture(orbit(), 96, 96, antialias=0).color
        none = metrics.shadow(exact, bare, dark, Shown(exact.rgba, exact.depth))["shadow_rms"]
        moved = metrics.shadow(exact, bare, dark, Shown(np.concatenate(
            [dark + np.roll(exact.lit, 2, axis=1) * (bare.color - dark), exact.rgba[..., 3:]], axis=2), exact.depth))
        missing = metrics.shadow(exact, bare, dark, Shown(bare.rgba, bare.depth))
        self.assertLess(none, 1e-6)
        self.assertGreater(moved["shadow_rms"], 0.01)
        self.assertGreater(missing["shadow_rms"], moved["shadow_rms"])

    def test_steadiness(self) -> None:
        def turn(noise: float, bias: float, name: str = "temporal_variance") -> float:
            steady, random = metrics.Steadiness(), np.random.default_rng(2)
            for azimuth in (0.0, 0.2, 0.4, 0.6):
                exact = scenes.build("sphere").picture(orbit(azimuth), 48, 48)
                steady.add(exact, Shown(exact.smooth + bias + noise * random.normal(size=exact.smooth.shape)))
            return steady.result()[name]

        self.assertLess(turn(0.0, 0.1), 1e-15)  # a constant error does not flicker
        self.assertAlmostEqual(turn(0.02, 0.0), 0.0004 * 0.75, 4)
        self.assertGreater(turn(0.04, 0.0), 3.0 * turn(0.02, 0.0))
        for name in ("flicker_inside", "flicker_edges"):
            self.assertLess(turn(0.0, 0.0, name), 1e-9)
            self.assertGreater(turn(0.02, 0.0, name), 1.0)


if __name__ == "__main__":
    result = unittest.main(exit=False, verbosity=0).result
    failed, skipped = len(result.failures) + len(result.errors), len(result.skipped)
    print(f"{result.testsRun - failed - skipped} passed, {failed} failed, {skipped} skipped")
    sys.exit(1 if failed else 0)
