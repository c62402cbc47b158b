# SPDX-License-Identifier: GPL-3.0-or-later
"""The errors of virtual scanners against what they claim to be, and the flag of wrong samples against distances computed here."""

from __future__ import annotations

import json
import sys
import unittest
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from truth.scans import campaign, campaigns, scanner  # noqa: E402
from truth.scans.campaign import Campaign, Instrument, Passer, Station, Walk  # noqa: E402
from truth.scans.scanner import MIRRORED, MIXED, PANE, PASSER, RAIN, STRAY, SURFACE, Scan  # noqa: E402
from truth.scans.scenes import SCENES, Survey  # noqa: E402
from truth.scans.solids import GLASS, Solids, World  # noqa: E402

QUIET = Instrument(step=0.5, noise=0.0, strays=0.0, registration=0.0, reach=1000.0, highest=40.0)
TURNED = 2e-4 * 20.0  # metres: what a small turn moves at 20 m


def wall(s: Solids, y: float, material: int, half: float = 20.0, low: float = -20.0, high: float = 20.0, gloss: int = 0) -> None:
    s.part(gloss=gloss)
    s.quads([(-half, y, low)], [(half, y, low)], [(half, y, high)], [(-half, y, high)], material)


def shade(s: Solids, srgb: float) -> int:
    return s.material("plain", (srgb,) * 3, grain=0.0)


def boards(near: float = 0.5, far: float = 0.5) -> World:
    """Slats 0.2 m wide at y = 4.6, each 0.6 m, before a wall at y = 5; greys in sRGB."""
    s = Solids()
    wall(s, 5.0, shade(s, far))
    front = shade(s, near)
    s.part()
    for x in np.arange(-6.0, 6.0, 0.6):
        s.quads([(x, 4.6, -20)], [(x + 0.2, 4.6, -20)], [(x + 0.2, 4.6, 20)], [(x, 4.6, 20)], front)
    return s.world()


def scanned(world: World, *instruments: Instrument, seed: int = 1, **more: object) -> Scan:
    setups = tuple(Station((0.0, 0.0, 0.0), one, **more) for one in instruments)
    return campaign.scan(world, Campaign(setups), np.random.default_rng(seed))


def ahead(scan: Scan) -> np.ndarray:
    """Samples on beams within 60 degrees of +y."""
    return scan.beam[:, 1] > 0.5


class Flagged(unittest.TestCase):
    def test_nearest_part_against_many_places(self) -> None:
        """Distances from triangles against the nearest of 5000 places on each."""
        random = np.random.default_rng(3)
        s = Solids()
        grey = shade(s, 0.5)
        for _ in range(6):
            s.part()
            s.triangles(random.uniform(-1.0, 1.0, (2, 3, 3)), grey)
        world = s.world()
        place, parts = random.uniform(-1.5, 1.5, (200, 3)), np.full((200, 3), -1, np.int32)
        parts[:, 0], parts[::2, 2] = random.integers(0, 6, 200), random.integers(0, 6, 100)
        got = world.off(place, parts, np.full(200, 1e3))
        a, b = np.sqrt(random.random(5000)), random.random(5000)
        weight = np.column_stack([1 - a, a * (1 - b), a * b])
        edge = np.linspace(0.0, 1.0, 400)
        weight = np.concatenate([weight, *(np.roll(np.column_stack([edge, 1 - edge, 0 * edge]), k, 1) for k in range(3))])
        for i in range(200):
            mine = np.isin(world.surface, parts[i][parts[i] >= 0])
            spots = np.einsum("wk,tka->twa", weight, world.corners[mine]).reshape(-1, 3)
            least = np.linalg.norm(spots - place[i], axis=1).min()
            self.assertLess(got[i], least + 1e-9)
            self.assertGreater(got[i], least - 0.03)
        near = world.off(place, parts, np.full(200, 0.1))
        np.testing.assert_array_equal(near, np.minimum(got, 0.1))
        self.assertTrue((world.off(place, np.full((200, 3), -1, np.int32), np.full(200, 7.0)) == 7.0).all())

    def test_flag_against_distances_from_slats(self) -> None:
        """off and wrong, for samples of slats before a wall: distances of rectangles, computed here."""
        noise = 0.008
        scan = scanned(boards(), replace(QUIET, noise=noise, divergence=0.002, pulse=5.0))
        mine = ahead(scan) & (np.abs(scan.position[:, 0]) < 5.0)
        x, y = scan.position[mine, 0], scan.position[mine, 1]
        within = np.mod(x + 6.0, 0.6)
        aside = np.where(within < 0.2, 0.0, np.minimum(within - 0.2, 0.6 - within))
        slat, back = np.hypot(aside, y - 4.6), np.abs(y - 5.0)
        # a beam in the middle of a gap or of a slat meets one surface; at edges it meets both
        wanted = np.where(scan.cause[mine] == MIXED, np.minimum(slat, back), np.where(scan.surface[mine] == 0, back, slat))
        clear = scan.surface[mine] >= 0
        off = scan.off[mine]
        self.assertGreater((scan.cause[mine] == MIXED).sum(), 300)
        mixed = scan.cause[mine] == MIXED
        np.testing.assert_allclose(off[mixed], wanted[mixed], atol=TURNED)
        both = np.minimum(slat, back)[clear]
        self.assertTrue((off[clear] > both - TURNED).all() and (off[clear] < wanted[clear] + TURNED).all())
        limit = max(0.02, 3.0 * noise)
        sure = np.abs(off - limit) > 1e-6
        np.testing.assert_array_equal(scan.wrong[mine][sure], (off > limit)[sure])
        self.assertTrue((scan.sigma == np.float32(noise)).all())

    def test_old_scanners_flag_too(self) -> None:
        """Mixed pixels of the frozen scanners, whose scans stay as they are; and nothing wrong on a wall alone."""
        survey = Survey("stations", ((0.0, 0.0, 0.0),), 0.5, noise=0.002, registration=0.0, drop=0.0, divergence=0.004)
        scan = scanner.scan(boards(), survey)
        mine = ahead(scan) & (np.abs(scan.position[:, 0]) < 5.0)
        y = scan.position[mine, 1]
        between = (y > 4.6 + 0.021 + TURNED) & (y < 5.0 - 0.021 - TURNED)
        self.assertGreater(between.sum(), 100)
        self.assertTrue((scan.wrong[mine][between & (scan.cause[mine] == MIXED)]).mean() > 0.9)
        s = Solids()
        wall(s, 5.0, shade(s, 0.5))
        scan = scanner.scan(s.world(), survey)
        self.assertFalse(scan.wrong[ahead(scan)].any())


class Errors(unittest.TestCase):
    def test_mixed_pixels_lie_anywhere_between(self) -> None:
        """Their shares of the way are spread over all of it; surfaces that return more draw them nearer; two surfaces farther
        apart than the pulse never mix."""
        wide = replace(QUIET, divergence=0.003, pulse=5.0)

        def shares(world: World, instrument: Instrument) -> np.ndarray:
            scan = scanned(world, instrument)
            mine = ahead(scan) & (scan.cause == MIXED) & (np.abs(scan.position[:, 0]) < 5.0)
            return (scan.position[mine, 1] - 4.6) / 0.4

        even = shares(boards(), wide)
        counts = np.histogram(even, np.linspace(0.05, 0.95, 7))[0]
        self.assertGreater(counts.sum(), 300)
        self.assertGreater(counts.min(), 0.08 * counts.sum())
        self.assertGreater(np.median(shares(boards(0.3, 0.9), wide)), np.median(even) + 0.1)
        self.assertLess(np.median(shares(boards(0.9, 0.3), wide)), np.median(even) - 0.1)
        apart = shares(boards(), replace(wide, pulse=0.3))  # beside an edge, but at a surface's distance
        self.assertFalse(((apart > 0.05) & (apart < 0.95)).any())
        kept = len(shares(boards(), replace(wide, filters=0.5))) / len(even)
        self.assertLess(abs(kept - 0.5), 0.06)

    def test_noise_grows_with_incidence_and_darkness(self) -> None:
        """Range errors on a wall by 1 / cos, and by the root of the albedo."""
        noise = 0.004
        for grey in (0.3, 0.6, 0.95):
            s = Solids()
            wall(s, 5.0, shade(s, grey))
            scan = scanned(s.world(), replace(QUIET, noise=noise, divergence=1e-6, aperture=0.0))
            albedo = grey / 12.92 if grey < 0.04 else ((grey + 0.055) / 1.055) ** 2.4
            mine = scan.cause == SURFACE
            range_ = np.linalg.norm(scan.position, axis=1) * np.sign(scan.position[:, 1])
            error = range_ - 5.0 / scan.beam[:, 1]
            for low, high in ((0.2, 0.25), (0.5, 0.55), (0.9, 0.95)):
                some = mine & (scan.beam[:, 1] > low) & (scan.beam[:, 1] < high)
                if grey == 0.3 and low == 0.2:
                    continue  # the flag takes away the tail
                wanted = noise / np.sqrt(np.mean(scan.beam[some, 1]) ** 2) * np.sqrt(0.18 / albedo)
                self.assertLess(abs(error[some].std() / wanted - 1.0), 0.06, (grey, low))

    def test_glass(self) -> None:
        """A pane at y = 3 before a wall at y = 5 and a wall at y = -4: squarely it returns itself, else what is behind; without a
        wall behind it shows the one in the scanner's back as if at y = 10."""
        for behind in (True, False):
            s = Solids()
            grey = shade(s, 0.6)
            wall(s, 3.0, grey, gloss=GLASS)
            wall(s, -4.0, grey)
            if behind:
                wall(s, 5.0, grey)
            scan = scanned(s.world(), replace(QUIET, reach=2000.0))
            mine = scan.beam[:, 1] > 0.3
            y, cause = scan.position[mine, 1], scan.cause[mine]
            square = scan.beam[mine, 1] > 0.998
            near = np.abs(y - 3.0) < TURNED
            self.assertTrue(near[square & (cause == PANE)].mean() > 0.9)
            self.assertGreater((square & near).sum(), 10)
            self.assertFalse(scan.wrong[mine][cause == PANE].any())
            oblique = scan.beam[mine, 1] < 0.97
            if behind:
                self.assertGreater((np.abs(y[oblique] - 5.0) < 4 * TURNED).mean(), 0.9)
            else:
                ghosts = cause == MIRRORED
                self.assertGreater((ghosts & oblique).sum(), 100)
                self.assertLess(np.abs(y[ghosts] - 10.0).max(), 8 * TURNED)
                self.assertTrue(scan.wrong[mine][ghosts].all())

    def test_strays_and_rain(self) -> None:
        """As many as they should be: strays anywhere on the beam, rain within its reach."""
        s = Solids()
        wall(s, 30.0, shade(s, 0.6), half=200.0, low=-200.0, high=200.0)
        scan = scanned(s.world(), replace(QUIET, strays=0.02, rain=0.01))
        mine = scan.beam[:, 1] > 0.7
        reach = np.linalg.norm(scan.position, axis=1)
        far = 30.0 / np.maximum(scan.beam[:, 1], 0.1)
        for cause, share, most in ((STRAY, 0.02, far), (RAIN, 0.01, np.full(len(scan), campaign.DROPS))):
            some = mine & (scan.cause == cause)
            self.assertLess(abs(some.sum() / mine.sum() / share - 1.0), 0.15)
            along = (reach[some] - campaign.NEAREST) / (most[some] - campaign.NEAREST)
            quarter = np.histogram(along, 4, (0.0, 1.0))[0] / some.sum()
            self.assertLess(np.abs(quarter - 0.25).max(), 0.06)
        self.assertTrue(scan.wrong[mine & (scan.cause == RAIN)].all())

    def test_who_walks_by_is_in_one_scan(self) -> None:
        s = Solids()
        wall(s, 6.0, shade(s, 0.6))
        passer = Passer((-0.5, 3.0, -1.5), (0.5, 3.0, -1.5), 0.15, 0.35)
        setups = Station((0.0, 0.0, 0.0), QUIET, (passer,)), Station((0.0, 0.0, 0.0), QUIET)
        scan = campaign.scan(s.world(), Campaign(setups), np.random.default_rng(1))
        mine = scan.cause == PASSER
        self.assertGreater(mine.sum(), 200)
        self.assertTrue((scan.scan[mine] == 0).all() and scan.wrong[mine].all())
        self.assertLess(np.abs(scan.position[mine, 1] - 3.0).max(), 0.3)
        self.assertTrue(((scan.position[mine, 2] > -1.6) & (scan.position[mine, 2] < 0.4)).all())

    def test_registration_drift_and_reach(self) -> None:
        """Shifts are of the size that is asked for, and make nothing wrong; a station of little reach sees little."""
        s = Solids()
        for y in (-8.0, 8.0):
            wall(s, y, shade(s, 0.6), half=40.0)
        world = s.world()
        moved = [scanned(world, replace(QUIET, step=4.0, registration=0.05), seed=seed) for seed in range(40)]
        sizes = np.array([one.shift.mean() for one in moved])
        self.assertLess(abs(np.sqrt(np.mean(sizes**2)) - 0.05), 0.012)
        self.assertFalse(any(one.wrong.any() for one in moved))
        walk = Walk(((-5.0, 0.0, 0.0), (5.0, 0.0, 0.0)), replace(QUIET, drift=0.03), 20_000)
        scan = campaign.scan(world, Campaign((), (walk,)), np.random.default_rng(1))
        self.assertLess(abs(np.sqrt(np.mean(scan.shift**2)) - 0.03), 0.004)
        self.assertFalse(scan.wrong[np.linalg.norm(scan.position, axis=1) < 15.0].any())
        off = np.abs(np.abs(scan.position[:, 1]) - 8.0)
        self.assertGreater(np.quantile(off, 0.9), 0.01)  # the drift is in the positions
        self.assertLess(off.max(), 0.15)
        reach = np.linalg.norm(scanned(world, replace(QUIET, reach=14.0)).position, axis=1)
        self.assertLess(np.quantile(reach, 0.99), 14.0)
        self.assertGreater(np.linalg.norm(scanned(world, QUIET).position, axis=1).max(), 25.0)


class Listed(unittest.TestCase):
    def test_split_names_each_scene_once(self) -> None:
        text = (Path(campaigns.__file__).parent / "split.json").read_text()
        split = json.loads(text)
        names = [one.name for one in campaigns.ALL]
        self.assertEqual(sorted(split["tuning"] + split["held out"]), sorted(names))
        self.assertGreaterEqual(3 * len(split["held out"]), len(names))
        for one in campaigns.ALL:
            self.assertEqual(one.held_out, one.name in split["held out"], one.name)
            self.assertEqual(len(one.views), 8)
        worlds = {one.make: one.held_out for one in SCENES}
        for one in campaigns.CAMPAIGNS:  # no world is on both sides
            self.assertEqual(worlds.setdefault(one.make, one.held_out), one.held_out)

    def test_scans_are_determined(self) -> None:
        """The same bytes again, of a thin scan of a scene with glass, walks, strays; other bytes by another seed."""
        scene = campaigns.named("hall")
        world = scene.make().world()
        rough = Campaign(tuple(replace(one, instrument=replace(one.instrument, step=3.0)) for one in scene.survey.setups),
                         (Walk(((2.0, 2.0, 1.4), (9.0, 4.0, 1.4)), campaigns.HANDHELD, 4000),))
        first, again, other = (scanner.scan(world, rough, seed) for seed in (5, 5, 6))
        for name in first.__dataclass_fields__:
            self.assertEqual(getattr(first, name).tobytes(), getattr(again, name).tobytes(), name)
        self.assertNotEqual(first.position.tobytes(), other.position.tobytes())
        self.assertTrue(np.isfinite(first.position).all() and np.isfinite(first.off).all())


if __name__ == "__main__":
    result = unittest.main(exit=False, verbosity=0).result
    failed, skipped = len(result.failures) + len(result.errors), len(result.skipped)
    print(f"{result.testsRun - failed - skipped} passed, {failed} failed, {skipped} skipped")
    sys.exit(1 if failed else 0)
