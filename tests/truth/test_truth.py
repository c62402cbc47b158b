# SPDX-License-Identifier: GPL-3.0-or-later
"""The truth against other ways to know it: closed formulas, and a walk along each ray in small steps."""

from __future__ import annotations

import sys
import unittest
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from truth import Light, Material, Scene, count_for, look, orbit, parallel, sample, scenes, visibility  # noqa: E402
from truth.shapes import Astroid, Knot  # noqa: E402
from truth.surfaces import Box, Gyroid, Rectangle, Saddle, Sphere, Torus, rotation, translation  # noqa: E402


def implicit(surface: object, p: np.ndarray) -> np.ndarray:
    """A function that changes its sign at the surface, written apart from surfaces.py; NaN outside its bounds."""
    x, y, z = p.T
    if isinstance(surface, Sphere):
        return np.sqrt(x * x + y * y + z * z) - surface.radius
    if isinstance(surface, Torus):
        return np.sqrt((np.sqrt(x * x + y * y) - surface.ring) ** 2 + z * z) - surface.tube
    if isinstance(surface, Box):
        return np.max(np.abs(p) - np.array(surface.half), axis=1)
    if isinstance(surface, Saddle):
        inside = (np.abs(x) <= surface.half) & (np.abs(y) <= surface.half)
        return np.where(inside, z - surface.bend * (x * x - y * y), np.nan)
    if isinstance(surface, Gyroid):
        a = 2.0 * np.pi * surface.waves
        value = np.sin(a * x) * np.cos(a * y) + np.sin(a * y) * np.cos(a * z) + np.sin(a * z) * np.cos(a * x)
        return np.where(x * x + y * y + z * z <= surface.radius**2, value - surface.level, np.nan)
    inside = (np.abs(x) <= 0.5 * surface.width) & (np.abs(y) <= 0.5 * surface.height)
    return np.where(inside, z, np.nan)


SURFACES = [Sphere(), Torus(), Torus(tube=0.1), Rectangle(), Box(half=(0.5, 0.7, 0.3)), Saddle(), Gyroid()]


class Surfaces(unittest.TestCase):
    def test_no_crossing_is_missed_and_none_is_made_up(self) -> None:
        random = np.random.default_rng(3)
        for surface in SURFACES:
            direction = random.normal(size=(400, 3))
            direction /= np.linalg.norm(direction, axis=1)[:, None]
            origin = 0.6 * random.normal(size=(400, 3)) - 3.0 * direction
            table = surface.crossings(origin, direction)
            step = np.linspace(0.0, 6.0, 24001)
            for o, d, t in zip(origin, direction, table):
                t = np.sort(t[~np.isnan(t)])
                t = t[(t > 0.0) & (t < 6.0)]
                value = implicit(surface, o + step[:, None] * d)
                with np.errstate(invalid="ignore"):
                    change = step[:-1][value[:-1] * value[1:] < 0.0]
                close = np.flatnonzero(np.diff(t) < 1e-3)  # pairs between two steps are seen by no walk
                if len(close) or len(t) != len(change):
                    for one in change:
                        self.assertLess(np.abs(t - one).min(), 3e-4, type(surface).__name__)
                    at = implicit(surface, o + t[:, None] * d)
                    self.assertTrue((np.abs(at[~np.isnan(at)]) < 1e-9).all())
                else:
                    np.testing.assert_allclose(t, change + 1.25e-4, atol=1.3e-4)

    def test_normals_are_gradients(self) -> None:
        random = np.random.default_rng(4)
        for surface in SURFACES:
            position, normal = surface.sample(2000, random)
            np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, atol=1e-12)
            if isinstance(surface, (Box, Rectangle)):
                continue
            step = 1e-6
            gradient = np.stack([implicit(surface, position + step * axis) - implicit(surface, position - step * axis)
                                 for axis in np.eye(3)], axis=1)
            gradient /= np.linalg.norm(gradient, axis=1)[:, None]
            known = ~np.isnan(gradient).any(axis=1)
            self.assertGreater(known.mean(), 0.99)
            np.testing.assert_allclose(gradient[known], normal[known], atol=1e-4)

    def test_samples_lie_on_the_surface_and_spread_by_area(self) -> None:
        random = np.random.default_rng(5)
        for surface in SURFACES:
            position, _ = surface.sample(40_000, random)
            value = implicit(surface, position * (1.0 - 1e-12))
            self.assertLess(np.nanmax(np.abs(value)), 1e-9)
            # lines meet a surface in proportion to its area, wherever it lies: halves hold what lines find there
            crossed, area = surface._crofton(200_000, random)
            self.assertLess(abs(area / surface.area - 1.0), 0.02, type(surface).__name__)
            for axis in np.array([[0.6, 0.64, 0.48], [0.8, -0.6, 0.0]]):
                share = (position @ axis > 0.2).mean(), (crossed @ axis > 0.2).mean()
                self.assertLess(abs(share[0] - share[1]), 0.012, type(surface).__name__)

    def test_placed_surfaces_turn_with_their_matrix(self) -> None:
        moved = Box(half=(0.5, 0.1, 0.2)).placed(translation(1.0, 0.0, 0.0), rotation("z", 90.0))
        t = moved.crossings(np.array([[0.0, 0.0, 0.0]]), np.array([[1.0, 0.0, 0.0]]))
        np.testing.assert_allclose(t, [[0.9, 1.1]], atol=1e-12)
        np.testing.assert_allclose(moved.normal(np.array([[0.9, 0.0, 0.0]])), [[-1.0, 0.0, 0.0]], atol=1e-12)


class Shapes(unittest.TestCase):
    """Those that rays through triangles find."""

    def test_knot(self) -> None:
        """A walk along each line in small steps, by the distance to 20,000 places of the curve."""
        knot, random = Knot(), np.random.default_rng(6)
        s = np.linspace(0.0, 2.0 * np.pi, 20_001)
        x, y, z = np.sin(s) + 2 * np.sin(2 * s), np.cos(s) - 2 * np.cos(2 * s), -np.sin(3 * s)
        from scipy.spatial import cKDTree
        curve = cKDTree(0.4 * np.column_stack([x, y, z]))
        direction = random.normal(size=(60, 3))
        direction /= np.linalg.norm(direction, axis=1)[:, None]
        origin = 0.6 * random.normal(size=(60, 3)) - 3.0 * direction
        step = np.linspace(0.0, 6.0, 6001)
        for o, d, t in zip(origin, direction, knot.crossings(origin, direction)):
            value = curve.query(o + step[:, None] * d)[0] - 0.19
            change = step[:-1][value[:-1] * value[1:] < 0.0]
            t = t[~np.isnan(t)]
            np.testing.assert_allclose(curve.query(o + t[:, None] * d)[0], 0.19, atol=4e-7)
            for one in change:
                self.assertLess(np.abs(t - one).min(), 1.1e-3)
            self.assertIn(len(t) - len(change), (0, 2))  # a pair may lie within a step
        position, normal = knot.sample(3000, random)
        np.testing.assert_allclose(curve.query(position)[0], 0.19, atol=4e-7)
        np.testing.assert_allclose(curve.query(position + 0.01 * normal)[0], 0.2, atol=4e-7)

    def test_astroid(self) -> None:
        column, random = Astroid(), np.random.default_rng(7)
        position, normal = column.sample(20_000, random)
        within = np.sum(np.abs(position[:, :2] / 1.1) ** (2.0 / 3.0), axis=1)
        side = np.abs(position[:, 2]) < 0.6 - 1e-9
        np.testing.assert_allclose(within[side], 1.0, atol=1e-9)
        self.assertTrue((within[~side] < 1.0).all())
        area, caps = 12.0 * 1.1 * 0.6, 0.75 * np.pi * 1.1**2
        self.assertLess(abs(side.mean() - area / (area + caps)), 0.01)
        np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, atol=1e-12)
        away = np.sum(np.abs((position + 1e-4 * normal)[side, :2] / 1.1) ** (2.0 / 3.0), axis=1)
        self.assertTrue((away > 1.0).mean() > 0.99)
        # from above: where the line's place lies within the curve, it passes both caps, else nothing
        flat = random.uniform(-1.1, 1.1, (4000, 2))
        inside = np.sum(np.abs(flat / 1.1) ** (2.0 / 3.0), axis=1) - 1.0
        t = column.crossings(np.column_stack([flat, np.full(4000, 2.0)]), np.broadcast_to([0.0, 0.0, -1.0], (4000, 3)))
        clear = np.abs(inside) > 1e-4
        np.testing.assert_array_equal((~np.isnan(t)).sum(axis=1)[clear], np.where(inside < 0.0, 2, 0)[clear])

    def test_area(self) -> None:
        for shape in (Knot(), Astroid()):
            _, area = shape._crofton(100_000, np.random.default_rng(8))
            self.assertLess(abs(area / shape.area - 1.0), 0.015, type(shape).__name__)

    def test_rows(self) -> None:
        """Neighbours in a row lie a tenth as far apart as rows do."""
        from scipy.spatial import cKDTree
        points = sample(Scene((Rectangle(width=2.0, height=2.0),)), 20_000, "rows")
        self.assertLess(abs(len(points) / 20_000 - 1.0), 0.1)
        near = cKDTree(points.position).query(points.position, k=2)[0][:, 1]
        self.assertLess(np.median(near), 0.5 * points.spacing)


class Pictures(unittest.TestCase):
    def test_coverage_of_a_sphere(self) -> None:
        scene = Scene((Sphere(),))
        flat = scene.picture(parallel(orbit(), 3.6), 200, 200, antialias=16)
        pixel = parallel(orbit(), 3.6).pixel(200, 1.0)
        self.assertLess(abs(flat.smooth[..., 3].sum() * pixel**2 / np.pi - 1.0), 2e-5)
        # in perspective, from a distance e, the outline is the circle of radius 1 / sqrt(e^2 - 1) at distance 1
        seen = scene.picture(orbit(), 200, 200, antialias=16)
        pixel = orbit().pixel(200, 1.0)
        self.assertLess(abs(seen.smooth[..., 3].sum() * pixel**2 * (3.6**2 - 1.0) / np.pi - 1.0), 2e-5)

    def test_depth_and_projection_agree(self) -> None:
        for camera in (orbit(20.0), parallel(orbit(70.0), 3.6), look((2.0, 1.0, 3.0), (0.0, 0.0, 0.0))):
            scene = scenes.build("corner")
            picture = scene.picture(camera, 40, 30, antialias=0)
            rows, columns = np.nonzero(np.isfinite(picture.depth))
            origin, direction = camera.rays(columns + 0.5, rows + 0.5, 40, 30)
            point = origin + picture.depth[rows, columns][:, None] * direction
            expected = np.stack([columns + 0.5, rows + 0.5, picture.depth[rows, columns]], 1)
            np.testing.assert_allclose(camera.project(point, 40, 30), expected, atol=1e-9)

    def test_layers_of_three_tori(self) -> None:
        """Straight down on the tubes: outer, middle, inner, then the inner torus is opaque."""
        scene = scenes.build("tori")
        origin, direction = np.array([[1.0, 0.0, 3.0]]), np.array([[0.0, 0.0, -1.0]])
        t, owner = scene.crossings(origin, direction)
        np.testing.assert_allclose(t[0, :6], [2.6, 2.75, 2.9, 3.1, 3.25, 3.4], atol=1e-12)
        self.assertEqual(owner[0, :6].tolist(), [2, 1, 0, 0, 1, 2])
        picture = scene.picture(look((1.0, 0.0, 3.0), (1.0, 0.0, 0.0), fov=0.1), 1, 1, layers=8, antialias=0)
        np.testing.assert_allclose(picture.layer_transmittance[:, 0, 0], [0.7, 0.35] + [0.0] * 6, atol=1e-12)
        np.testing.assert_allclose(picture.layer_depth[:3, 0, 0], [2.6, 2.75, 2.9], atol=1e-9)
        np.testing.assert_allclose(picture.rgba[0, 0], np.append(
            0.3 * picture.layer_color[0, 0, 0] + 0.35 * picture.layer_color[1, 0, 0]
            + 0.35 * picture.layer_color[2, 0, 0], 1.0))

    def test_phong(self) -> None:
        """A plane that faces sun and eye: albedo (k_a world + (k_d + k_s) E / pi)."""
        light = Light(power=2.0, towards=np.array([0.0, 0.0, 1.0]))
        scene = Scene((Rectangle(),), (light,), world=0.1, material=Material(0.5, 0.7, 0.4, 8),
                      albedo=lambda surface, position: np.full(position.shape, 0.6))
        picture = scene.picture(look((0.0, 0.0, 2.0), (0.0, 0.0, 0.0), fov=0.01), 1, 1, antialias=0)
        np.testing.assert_allclose(picture.color[0, 0], 0.6 * (0.05 + 1.1 * 2.0 / np.pi), rtol=1e-6)
        tilted = Light(power=2.0, towards=np.array([np.sin(0.3), 0.0, np.cos(0.3)]))
        scene = Scene((Rectangle(),), (tilted,), world=0.0, material=Material(0.0, 0.0, 1.0, 8),
                      albedo=lambda surface, position: np.ones(position.shape))
        picture = scene.picture(look((0.0, 0.0, 2.0), (0.0, 0.0, 0.0), fov=0.01), 1, 1, antialias=0)
        np.testing.assert_allclose(picture.color[0, 0], np.cos(0.3) ** 8 * 2.0 / np.pi, rtol=1e-4)


class Shadows(unittest.TestCase):
    def test_hard_shadow_of_a_sphere(self) -> None:
        sun = Light(power=1.0, towards=np.array([0.0, 0.0, 1.0]))
        scene = Scene((Rectangle(width=4.0, height=4.0), Sphere(radius=0.5).placed(translation(0.0, 0.0, 1.0))), (sun,))
        x = np.linspace(-1.0, 1.0, 400)
        m = visibility(scene, sun, np.stack([x, np.zeros_like(x), np.zeros_like(x)], axis=1))
        np.testing.assert_array_equal(m, np.abs(x) > 0.5)

    def test_soft_shadow_of_an_edge(self) -> None:
        """Over a half plane at height 1 the sun's disc, seen from x, is cut by a chord: its area is known."""
        angle = 0.2
        sun = Light(power=1.0, towards=np.array([0.0, 0.0, 1.0]), angle=angle)
        roof = Rectangle(width=10.0, height=10.0).placed(translation(5.0, 0.0, 1.0))
        scene = Scene((Rectangle(width=4.0, height=4.0), roof), (sun,))
        x = np.linspace(-0.15, 0.15, 31)
        m = visibility(scene, sun, np.stack([x, np.zeros_like(x), np.zeros_like(x)], axis=1), 4096)
        s = np.clip(-x / np.tan(0.5 * angle), -1.0, 1.0)
        np.testing.assert_allclose(m, 0.5 + (np.arcsin(s) + s * np.sqrt(1.0 - s * s)) / np.pi, atol=2e-3)

    def test_area_light_and_transparent_blocker(self) -> None:
        """A square light at height 2, a half plane of opacity 0.4 at height 1: linear penumbra, 0.6 at its darkest."""
        light = Light(power=1.0, position=np.array([0.0, 0.0, 2.0]),
                      across=(np.array([0.3, 0.0, 0.0]), np.array([0.0, 0.3, 0.0])))
        roof = Rectangle(width=10.0, height=10.0, opacity=0.4).placed(translation(5.0, 0.0, 1.0))
        scene = Scene((Rectangle(width=4.0, height=4.0), roof), (light,))
        x = np.linspace(-0.5, 0.5, 21)
        m = visibility(scene, light, np.stack([x, np.zeros_like(x), np.zeros_like(x)], axis=1), 4096)
        np.testing.assert_allclose(m, 1.0 - 0.4 * np.clip(0.5 + x / 0.6, 0.0, 1.0), atol=0.007)


class Samples(unittest.TestCase):
    def test_density(self) -> None:
        """count_for: on a plane that faces the camera, so many points fall into a pixel."""
        scene = Scene((Rectangle(width=4.0, height=4.0),))
        camera = look((0.0, 0.0, 3.6), (0.0, 0.0, 0.0))
        points = sample(scene, count_for(scene, 5.0, camera.pixel(100, 3.6)), "random")
        at = camera.project(points.position.astype(np.float64), 100, 100)
        self.assertLess(abs(((at[:, :2] > 0.0) & (at[:, :2] < 100.0)).all(axis=1).sum() / 5e4 - 1.0), 0.02)

    def test_patterns_and_noise(self) -> None:
        from scipy.spatial import cKDTree
        scene = scenes.build("torus")
        least = {}
        for pattern in ("random", "blue", "scan"):
            points = sample(scene, 20_000, pattern)
            self.assertLess(abs(len(points) / 20_000 - 1.0), 0.05, pattern)
            self.assertLess(np.abs(implicit(Torus(), points.position.astype(np.float64))).max(), 1e-6)
            distance = cKDTree(points.position).query(points.position, k=2)[0][:, 1]
            least[pattern] = np.quantile(distance, 0.01) / points.spacing
        self.assertLess(least["random"], 0.1)
        self.assertGreater(least["blue"], 0.66)
        noisy = sample(scene, 20_000, "random", noise=0.5)
        off = implicit(Torus(), noisy.position.astype(np.float64)) / noisy.spacing
        self.assertLess(abs(off.std() - 0.5), 0.02)
        self.assertLess(abs(off.mean()), 0.02)


if __name__ == "__main__":
    result = unittest.main(exit=False, verbosity=0).result
    failed, skipped = len(result.failures) + len(result.errors), len(result.skipped)
    print(f"{result.testsRun - failed - skipped} passed, {failed} failed, {skipped} skipped")
    sys.exit(1 if failed else 0)
