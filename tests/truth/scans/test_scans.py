# SPDX-License-Identifier: GPL-3.0-or-later
"""The virtual scans against other ways to know them: rays against closed formulas, scanners against the statistics that
they are asked for, metrics against pictures made by hand."""

from __future__ import annotations

import hashlib
import sys
import unittest
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from truth.scans import exact, filters, metrics, scanner  # noqa: E402
from truth.scans import scenes as frozen  # noqa: E402
from truth.scans.campaign import Campaign, Instrument, Station  # noqa: E402
from truth.scans.scenes import Scene, Survey, View  # noqa: E402
from truth.scans.solids import GLASS, Solids, World  # noqa: E402

# Scenes, scanners, cameras and thresholds are frozen: whoever changes one changes every figure that was ever told.
FROZEN = "10103c5f5fceea75"


def frozen_sum() -> str:
    here = Path(__file__).resolve().parent
    digest = hashlib.sha256(repr(frozen.SCENES and [(one.name, one.survey, one.views, one.held_out, one.seed)
                                                    for one in frozen.SCENES]).encode())
    digest.update(repr((frozen.WIDTH, frozen.HEIGHT, frozen.FOV, frozen.SKY, frozen.STEP, metrics.NEAR, metrics.SHARE,
                        exact.REACH, exact.OBLIQUE)).encode())
    for name in ("places.py", "albedo.c"):
        digest.update(exact.meaning(here / name).encode())
    return digest.hexdigest()[:16]


def ball(radius: float = 1.0, segments: int = 400) -> World:
    s = Solids()
    s.part()
    s.blob((0.0, 0.0, 0.0), (radius,) * 3, s.material("plain", (0.5, 0.5, 0.5), grain=0.0), segments=segments)
    return s.world()


def floor(*boards: tuple[float, float, float, float, float, bool]) -> Solids:
    """Horizontal boards (x0, y0, x1, y1, z, thin), each a part, over a floor of 20 m at z = 0."""
    s = Solids()
    grey = s.material("plain", (0.5, 0.5, 0.5), grain=0.0)
    for x0, y0, x1, y1, z, thin in ((-10.0, -10.0, 10.0, 10.0, 0.0, False), *boards):
        s.part(thin)
        s.quads([(x0, y0, z)], [(x1, y0, z)], [(x1, y1, z)], [(x0, y1, z)], grey)
    return s


class Traced(unittest.TestCase):
    def test_sphere(self) -> None:
        random = np.random.default_rng(1)
        way = random.normal(size=(20_000, 3))
        way /= np.linalg.norm(way, axis=1)[:, None]
        origin = random.uniform(-2.0, 2.0, (20_000, 3))
        t, triangle = ball().rays.trace(origin, way)
        b, c = np.einsum("ij,ij->i", origin, way), np.einsum("ij,ij->i", origin, origin) - 1.0
        root = b * b - c
        with np.errstate(invalid="ignore"):
            near, far = -b - np.sqrt(root), -b + np.sqrt(root)
        wanted = np.where(near > 0.0, near, np.where(far > 0.0, far, np.inf))
        wanted[~(root > 0.0)] = np.inf
        clear = np.abs(root) > 0.01  # not at the outline, which facets cut short
        self.assertTrue((np.isinf(wanted) == np.isinf(t))[clear].all())
        both = clear & np.isfinite(t)
        self.assertGreater(both.sum(), 2500)
        self.assertLess(np.abs(t[both] - wanted[both]).max(), 2e-3)
        self.assertTrue((triangle[np.isinf(t)] == -1).all())

    def test_against_every_triangle(self) -> None:
        random = np.random.default_rng(2)
        s = Solids()
        s.part()
        s.triangles(random.uniform(-1.0, 1.0, (300, 1, 3)) + 0.2 * random.normal(size=(300, 3, 3)),
                    s.material("plain", (1, 1, 1)))
        world = s.world()
        origin, way = random.uniform(-2.0, 2.0, (3000, 3)), random.normal(size=(3000, 3))
        way[:300, 0] = 0.0  # along planes of boxes
        t, triangle = world.rays.trace(origin, way)
        best, which = np.full(3000, np.inf), np.full(3000, -1)
        for number, (a, b, c) in enumerate(world.corners):
            # t, u, v of o + t d = a + u (b - a) + v (c - a)
            system = np.stack([-way, np.broadcast_to(b - a, way.shape), np.broadcast_to(c - a, way.shape)], axis=2)
            x = np.linalg.solve(system, (origin - a)[..., None])[..., 0]
            hit = (x[:, 0] > 0.0) & (x[:, 1] >= 0.0) & (x[:, 2] >= 0.0) & (x[:, 1] + x[:, 2] <= 1.0) & (x[:, 0] < best)
            best[hit], which[hit] = x[hit, 0], number
        np.testing.assert_array_equal(triangle, which)
        np.testing.assert_allclose(t, best, rtol=1e-9)


class Scanned(unittest.TestCase):
    def test_noise_and_grid(self) -> None:
        """Within a ball of 5 m: every beam returns, off by the noise, in its cell of the grid."""
        survey = Survey("stations", ((0.0, 0.0, 0.0),), 1.0, noise=0.01, registration=0.0, drop=0.0, divergence=0.0)
        scan = scanner.scan(ball(5.0), survey)
        rows, columns = scan.shape[0]
        self.assertEqual(len(scan), rows * columns)
        off = np.linalg.norm(scan.position, axis=1) - np.linalg.norm(scan.true_position, axis=1)
        self.assertLess(abs(off.std() - 0.01), 2e-4)
        self.assertLess(abs(off.mean()), 2e-4)
        turn = np.degrees(np.arctan2(scan.true_position[:, 1], scan.true_position[:, 0])) % 360.0
        away = np.abs(turn - scan.column) % 360.0
        self.assertLess(np.minimum(away, 360.0 - away).max(), 1e-6)
        np.testing.assert_allclose(scan.interval, 5.0 * np.radians(1.0), rtol=1e-3)

    def test_dropped_returns_and_registration(self) -> None:
        survey = Survey("stations", ((0.0, 0.0, 0.0), (0.5, 0.0, 0.0)), 1.0, noise=0.0,
                        registration=0.05, drop=0.2, divergence=0.0)
        scan = scanner.scan(ball(5.0), survey)
        self.assertLess(abs(len(scan) / (2 * scan.shape[0].prod()) - 0.8), 0.01)
        for number in (0, 1):
            mine = scan.scan == number
            shift = (scan.position - scan.true_position)[mine]
            self.assertLess(shift.std(axis=0).max(), 0.003)  # rigid: but for the small turn, one shift
            self.assertGreater(np.linalg.norm(shift.mean(axis=0)), 0.005)

    def test_mixed_pixels_lie_at_edges_alone(self) -> None:
        world = floor((-1.0, -1.0, 1.0, 1.0, 0.5, False)).world()
        survey = Survey("stations", ((0.3, 0.2, 3.0),), 0.5, noise=0.0, registration=0.0, drop=0.0, divergence=0.004)
        scan = scanner.scan(world, survey)
        z = scan.position[:, 2]
        mixed = (z > 0.02) & (z < 0.48)
        self.assertGreater(mixed.sum(), 50)
        self.assertTrue((scan.surface[mixed] == -1).mean() > 0.9)
        edge = np.max(np.abs(scan.position[:, :2]), axis=1)  # the board's outline, or its shadow's
        self.assertTrue((edge[mixed] > 0.9).all())
        clean = scanner.scan(world, replace(survey, divergence=0.0))
        z = clean.position[:, 2]
        self.assertLess(((z > 0.02) & (z < 0.48)).sum(), 0.5 * mixed.sum())

    def test_the_other_patterns(self) -> None:
        world = floor((-1.0, -1.0, 1.0, 1.0, 0.5, False)).world()
        air = scanner.scan(world, Survey("airborne", (), 0.1, 0.02, 0.0, 0.0, area=(-5.0, -5.0, 5.0, 5.0)))
        self.assertLess(abs(len(air) / (100.0 / 0.01) - 1.0), 0.03)
        high = (air.position - air.true_position)[air.surface == 0, 2]
        self.assertLess(abs(high.std() - 0.02 * np.cos(np.radians(20.0))), 0.002)
        photos = scanner.scan(world, Survey("photos", ((0.0, -3.0, 3.0), (2.0, -3.0, 3.0)),
                                            noise=0.002, drop=0.1, count=20_000))
        self.assertGreater(len(photos), 4000)
        self.assertEqual(len(photos.stations), 0)


class Seen(unittest.TestCase):
    SCENE = Scene("test", lambda: floor((-1.0, -1.0, 1.0, 1.0, 0.5, False)), Survey(
        "stations", ((0.0, 0.0, 3.0),), 0.5, noise=0.0, registration=0.0, drop=0.0, divergence=0.0),
                  (View((0.0, -3.0, 6.0), (0.0, 0.0, 0.0)),))

    def test_what_was_scanned(self) -> None:
        """From above a board, the floor beneath and behind its shadow was not scanned, nor anything right under the tripod."""
        world = self.SCENE.make().world()
        scan = scanner.scan(world, self.SCENE.survey)
        seen = exact.camera(self.SCENE.views[0], width=120, height=80)
        shown = exact.picture(world, scan, self.SCENE, seen, width=120, height=80)
        y, x = np.mgrid[0:80, 0:120]
        origin, way = seen.rays(x.ravel() + 0.5, y.ravel() + 0.5, 120, 80)
        place = (origin + shown.middle.ravel()[:, None] * way).reshape(80, 120, 3)
        reach = np.max(np.abs(place[..., :2]), axis=2)
        on_board = shown.surface == 1
        np.testing.assert_allclose(place[on_board][:, 2], 0.5, atol=1e-6)
        # the shadow of the board on the floor reaches to 3 / 2.5; within the tripod's cone nothing returns
        cone = np.hypot(place[..., 0], place[..., 1]) / (3.0 - place[..., 2])
        blind = 1.0 / np.tan(np.radians(-scanner.LOWEST))
        self.assertTrue(shown.scanned[(shown.surface == 0) & (reach > 1.25) & (reach < 6.0) & (cone > blind + 0.01)].all())
        self.assertFalse(shown.scanned[(shown.surface == 0) & (reach < 1.1)].any())
        self.assertFalse(shown.scanned[on_board & (cone < blind - 0.05)].any())
        self.assertTrue(shown.scanned[on_board & (cone > blind + 0.01)].all())

    def test_what_was_scanned_from_the_air(self) -> None:
        """Two strips look 20 degrees to either side: beneath a board all but its borders stays dark; so do borders of the area."""
        survey = Survey("airborne", (), 0.05, 0.0, 0.0, 0.0, 0.0, area=(-4.0, -4.0, 4.0, 4.0))
        scene = replace(self.SCENE, survey=survey, views=(View((0.0, -5.0, 0.4), (0.0, 0.0, 0.1)),))
        world = scene.make().world()
        seen = exact.camera(scene.views[0], width=120, height=80)
        shown = exact.picture(world, scanner.scan(world, survey), scene, seen, width=120, height=80)
        y, x = np.mgrid[0:80, 0:120]
        origin, way = seen.rays(x.ravel() + 0.5, y.ravel() + 0.5, 120, 80)
        place = (origin + shown.middle.ravel()[:, None] * way).reshape(80, 120, 3)
        floor_ = shown.surface == 0
        reach = np.max(np.abs(place[..., :2]), axis=2)
        lit = 1.0 - 0.5 * np.tan(np.radians(20.0))
        self.assertTrue(shown.scanned[floor_ & (reach > 1.1) & (reach < 3.9)].all())
        dark = floor_ & (np.abs(place[..., 0]) < lit - 0.2) & (np.abs(place[..., 1]) < 0.7)
        self.assertGreater(dark.sum(), 20)
        self.assertFalse(shown.scanned[dark].any())
        self.assertFalse(shown.scanned[floor_ & (reach > 4.2)].any())
        self.assertLess(np.abs(shown.ceiling[shown.scanned].astype(int) - 128).max(), 10)

    def test_what_was_photographed_and_what_a_campaign_scanned(self) -> None:
        """Samples without a grid that the picture may use: the board and the floor around it were seen; behind a pane, which is
        nearest, the picture shows what is behind."""
        photos = Survey("photos", ((0.0, -3.0, 3.0), (2.0, -3.0, 3.0)), noise=0.0005, drop=0.1, count=60_000)
        station = Campaign((Station((0.0, 0.0, 3.0), Instrument(0.5, strays=0.0, registration=0.0, lowest=-80.0, highest=0.0)),))
        solids = self.SCENE.make()
        solids.part(gloss=GLASS)
        solids.quads([(-9, -4.0, -1)], [(9, -4.0, -1)], [(9, -4.0, 9)], [(-9, -4.0, 9)], 0)
        for survey, eye, world in ((photos, -3.0, self.SCENE.make().world()), (station, -3.0, self.SCENE.make().world()),
                                   (station, -6.0, solids.world())):
            scene = replace(self.SCENE, survey=survey, views=(View((0.0, eye, 6.0), (0.0, 0.0, 0.0)),))
            seen = exact.camera(scene.views[0], width=60, height=40)
            shown = exact.picture(world, scanner.scan(world, survey), scene, seen, width=60, height=40)
            board = shown.surface == 1
            self.assertGreater(board.sum(), 20)
            self.assertGreater(shown.scanned[board].mean(), 0.8)
            self.assertEqual(bool((shown.near[board] < shown.middle[board] - 1.0).all()), eye < -4.0)

    def test_metrics_of_pictures_by_hand(self) -> None:
        shape = 100, 200
        depth = np.full(shape, 4.0, np.float32)
        depth[80:] = np.inf
        scanned = np.isfinite(depth)
        scanned[:, :50] = False
        thin = np.zeros(shape, bool)
        thin[10:30, 100:110] = True
        color = np.full((*shape, 3), 0.2, np.float32)
        truth = exact.Exact(depth, depth, depth, color, np.where(np.isfinite(depth), 0, -1), np.isinf(depth), thin, scanned,
                            np.full((*shape, 3), np.rint(255 * float(metrics.srgb(np.float32(0.2)))), np.uint8))
        right = metrics.measure(truth, color, depth)
        self.assertEqual([right[name] for name in ("false", "lost", "sky", "outline", "hiding")], [0.0] * 5)
        self.assertEqual((right["thin"], right["invented"]), (1.0, 1.0))
        self.assertGreater(right["psnr"], 80.0)
        wrong = depth.copy()
        wrong[0:20, 60:90] = 3.0   # 600 of 12,000 scanned pixels
        wrong[0:10, 150:190] = np.inf  # 400
        wrong[10:20, 150:180] = 4.06   # 300, farther by more than 5 cm and 1 %
        wrong[20:30, 150:180] = 4.045  # not by 5 cm
        wrong[10:20, 100:110] = 3.9  # half of what is thin, and 100 of the scanned
        wrong[0:20, 0:25] = 1.0  # 500 of 4,000 that were not scanned
        wrong[30:40, 0:25] = np.inf  # 250 of them
        wrong[90:, :] = 50.0  # half of the sky
        told = metrics.measure(truth, color, wrong)
        np.testing.assert_allclose([told[name] for name in ("false", "lost", "sky", "thin", "hiding", "invented")],
                                   [700 / 12000, 700 / 12000, 0.5, 0.5, 500 / 4000, 3750 / 4000])
        darker = color.copy()
        darker[:, 100:] *= 0.5
        square = np.mean(np.square((metrics.srgb(darker) - metrics.srgb(color))[scanned]))
        self.assertAlmostEqual(metrics.measure(truth, darker, depth)["psnr"], -10.0 * np.log10(square), places=4)
        self.assertEqual(metrics.flicker((truth, truth), (color, color)), 0.0)

    def test_width_of_thin_parts(self) -> None:
        """A bar of 10 pixels before a wall and the sky: drawn 4 pixels wider on each side, then with something else beside it."""
        truth = np.full((100, 100), 10.0, np.float32)
        truth[80:] = np.inf
        truth[:, 40:50] = 5.0
        thin = truth == 5.0
        black = np.zeros((100, 100, 3), np.float32)
        one = exact.Exact(truth, truth, truth, black, np.zeros((100, 100)), np.isinf(truth), thin, np.isfinite(truth),
                          black.astype(np.uint8))
        self.assertEqual(metrics.measure(one, black, truth)["width"], 1.0)
        wide = truth.copy()
        wide[:, 36:54] = 5.0
        self.assertAlmostEqual(metrics.measure(one, black, wide)["width"], 1.8)
        wide[:, 36:40] = 7.0  # not at the bar's depth
        wide[:50, 40:50] = 10.0  # lost: half of the bar, and what is drawn beside it stays
        self.assertAlmostEqual(metrics.measure(one, black, wide)["width"], (500 + 400) / 500)
        self.assertTrue(np.isnan(metrics.measure(one, black, np.full_like(truth, np.inf))["width"]))

    def test_outline(self) -> None:
        """A square that is drawn three pixels wider."""
        truth, drawn = np.full((100, 100), 10.0, np.float32), np.full((100, 100), 10.0, np.float32)
        truth[30:70, 30:70], drawn[27:73, 27:73] = 5.0, 5.0
        black = np.zeros((100, 100, 3), np.float32)
        nowhere, everywhere = np.zeros((100, 100), bool), np.ones((100, 100), bool)
        one = exact.Exact(truth, truth, truth, black, np.zeros((100, 100)),
                          nowhere, nowhere, everywhere, black.astype(np.uint8))
        self.assertAlmostEqual(metrics.measure(one, black, drawn)["outline"], 3.0, places=6)
        self.assertEqual(metrics.measure(one, black, truth)["outline"], 0.0)


class Filtered(unittest.TestCase):
    def test_against_loops(self) -> None:
        """CloudCompare's filters against plain loops over a rough wall with strays, and what coincides or is too little."""
        random = np.random.default_rng(3)
        wall = np.concatenate([random.uniform(0, 1, (400, 3)) * (1, 1, 0.01), random.uniform(0, 1, (12, 3)) * (1, 1, 1) + (0, 0, 0.2)])
        away = np.linalg.norm(wall[:, None] - wall, axis=2)
        near = np.argsort(away, axis=1)[:, 1:7]
        mean = np.take_along_axis(away, near, 1).mean(axis=1)
        np.testing.assert_array_equal(filters.sor(wall), mean <= mean.mean() + mean.std())
        self.assertFalse(filters.sor(wall)[400:].any())
        flat = []
        for point, which in zip(wall, near):
            middle = wall[which].mean(axis=0)
            normal = np.linalg.svd(wall[which] - middle)[2][2]
            flat.append(abs((point - middle) @ normal) <= np.sqrt((((wall[which] - middle) @ normal) ** 2).mean()))
        np.testing.assert_array_equal(filters.noise(wall), flat)
        self.assertTrue(0.3 < np.mean(flat) < 0.9)
        self.assertTrue(filters.sor(np.zeros((9, 3))).all() and filters.sor(np.zeros((1, 3))).all())
        self.assertTrue(filters.noise(np.zeros((9, 3))).all() and not filters.noise(np.eye(3)).any())


class Frozen(unittest.TestCase):
    def test_nothing_has_changed(self) -> None:
        self.assertEqual(frozen_sum(), FROZEN, "scenes, cameras and thresholds are frozen")

    def test_a_third_is_held_out_and_each_has_eight_cameras(self) -> None:
        self.assertGreaterEqual(3 * sum(one.held_out for one in frozen.SCENES), len(frozen.SCENES))
        self.assertTrue(all(len(one.views) == 8 for one in frozen.SCENES))


if __name__ == "__main__":
    result = unittest.main(exit=False, verbosity=0).result
    failed, skipped = len(result.failures) + len(result.errors), len(result.skipped)
    print(f"{result.testsRun - failed - skipped} passed, {failed} failed, {skipped} skipped")
    sys.exit(1 if failed else 0)
