# SPDX-License-Identifier: GPL-3.0-or-later
"""The trees against probabilities that are known, the C file against the trees, features against loops, and what may be trained on."""

from __future__ import annotations

import ctypes
import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from truth.scans import campaigns  # noqa: E402
from truth.trust import boost, constants, features, report, samples, train  # noqa: E402

JUDGE = """#include <stdint.h>
struct node { float most; int16_t value; uint16_t feature; };
#include "constants.h"
void judge(const float *x, int64_t n, int64_t width, int32_t *score, int32_t *early)
{
    for (int64_t i = 0; i < n; i++, x += width) {
        score[i] = early[i] = FIRST_SCORE;
        for (int t = 0; t < TREES; t++) {
            const struct node *node = nodes + roots[t];
            while (node->feature != 0xFFFF)
                node += x[node->feature] <= node->most ? 1 : node->value;
            score[i] += node->value;
            early[i] += t < SURE_AFTER ? node->value : 0;
        }
    }
}
int32_t sure(void) { return SURE_SCORE; }
const int32_t *least(void) { return least_scores; }
"""


def made(count: int = 20_000, seed: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Values, whether right, and the probability of that: two features matter, by their product and a step."""
    random = np.random.default_rng(seed)
    values = random.normal(size=(count, 5)).astype(np.float32)
    p = 1.0 / (1.0 + np.exp(-(2.0 * values[:, 0] * values[:, 1] + 1.5 * (values[:, 2] > 0.3) + 0.5)))
    return values, random.random(count) < p, p


class Trees(unittest.TestCase):
    def test_learns_and_is_calibrated(self) -> None:
        """On samples that it has not seen: nearly as good as the true probability, and trust is how often they are right."""
        values, right, _ = made()
        forest = boost.train(values, right, np.ones(len(right), int), 80)
        seen, true, p = made(seed=2)
        score = forest.score(boost.binned(seen, forest.edges))
        self.assertGreater(boost.auc(score, true), boost.auc(p, true) - 0.02)
        calibration = boost.calibrate(score, true, np.ones(len(true)))
        fresh, again, _ = made(seed=3)
        level = calibration.level(forest.score(boost.binned(fresh, forest.edges)))
        for low, high in ((0, 3), (3, 6), (6, 9), (9, 12)):
            some = (level >= low) & (level < high)
            self.assertGreater(some.sum(), 200)
            self.assertLess(abs(again[some].mean() - boost.TRUST[level[some]].mean()), 0.06)
        self.assertTrue((np.diff(calibration.least) >= 0).all())

    def test_weights_of_calibration(self) -> None:
        """Wrong samples that stand for many lower the trust to their true share."""
        score, right = np.zeros(1000, np.int32), np.arange(1000) < 500
        for weight, trust in ((99.0, 0.99), (1.0, 0.5)):
            calibration = boost.calibrate(score, right, np.where(right, weight, 1.0))
            got = calibration.trust(np.zeros(1, np.int32))[0]
            self.assertEqual(got, boost.TRUST[np.abs(boost.TRUST - trust).argmin()])

    def test_rising_steps(self) -> None:
        middle, value = boost.isotonic(np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 1.0, 0.0, 1.0]), np.ones(4))
        np.testing.assert_allclose(middle, [0.0, 1.5, 3.0])
        np.testing.assert_allclose(value, [0.0, 0.5, 1.0])

    def test_area_against_all_pairs(self) -> None:
        random = np.random.default_rng(4)
        score, right = random.integers(0, 20, 300), random.random(300) < 0.4
        weight = random.random(300)
        a, b = score[right][:, None], score[~right][None]
        pair = weight[right][:, None] * weight[~right][None]
        wanted = (pair * ((a > b) + 0.5 * (a == b))).sum() / pair.sum()
        self.assertAlmostEqual(boost.auc(score, right, weight), wanted, places=12)

    def test_numbers_that_are_none(self) -> None:
        edges = boost.thresholds(np.arange(100, dtype=np.float32)[:, None])
        bins = boost.binned(np.array([[np.nan], [-np.inf], [np.inf], [50.0]], np.float32), edges)
        self.assertEqual(bins[0, 0], boost.BINS - 1)
        self.assertEqual(bins[1, 0], 0)
        self.assertEqual(bins[2, 0], boost.BINS - 1)
        self.assertEqual(bins[3, 0], int((edges[0] <= 50.0).sum()))


class Written(unittest.TestCase):
    def test_same_bytes_and_the_same_answers_in_c(self) -> None:
        values, right, _ = made(8000)
        values[::7, 3] = np.nan
        values[:, 4] = np.floor(values[:, 4])  # few values
        one = np.ones(len(right), int)
        forest = boost.train(values, right, one, 20)
        bins = boost.binned(values, forest.edges)
        score = forest.score(bins)
        calibration = boost.calibrate(score, right, np.ones(len(right)))
        calibration.after, calibration.sure = 5, 700
        names = ["a", "b", "c", "d", "e"]
        text = train.as_c(forest, calibration, 13, names, ["hall"], "2026-01-01", "abc1")
        second = boost.train(values.copy(), right.copy(), one, 20)
        self.assertEqual(text, train.as_c(second, calibration, 13, names, ["hall"], "2026-01-01", "abc1"))
        self.assertEqual(train.told(text), (train.made_from(names, ["hall"]), "2026-01-01", names, ["hall"]))
        self.assertNotEqual(train.made_from(names, ["hall"]), train.made_from(names, ["ruin"]))
        self.assertNotEqual(train.made_from(names, ["hall"]), train.made_from(names[1:], ["hall"]))
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "constants.h").write_text(text)
            (Path(folder) / "judge.c").write_text(JUDGE)
            path = Path(folder) / "judge.so"
            subprocess.run([os.environ.get("CC", "cc"), "-std=c11", "-Wall", "-Werror", "-O2", "-fPIC", "-shared", "-o", str(path),
                            str(Path(folder) / "judge.c")], check=True)
            library = ctypes.CDLL(str(path))
            got, early = np.empty(len(values), np.int32), np.empty(len(values), np.int32)
            library.judge(*(x.ctypes.data_as(ctypes.c_void_p) if isinstance(x, np.ndarray) else ctypes.c_int64(x)
                            for x in (values, len(values), values.shape[1], got, early)))
            library.least.restype = ctypes.POINTER(ctypes.c_int32)
            self.assertEqual(library.sure(), 700)
            self.assertEqual([library.least()[k] for k in range(boost.LEVELS - 1)], calibration.least.tolist())
        np.testing.assert_array_equal(got, score)
        np.testing.assert_array_equal(early, forest.score(bins, 5))
        self.assertLess(train.size_of(forest), train.MOST_BYTES)
        model = constants.read(text)  # the same, read back
        np.testing.assert_array_equal(model.score(values), score)
        np.testing.assert_array_equal(model.score(values, 5), early)
        self.assertEqual((model.calibration.least.tolist(), model.calibration.after, model.calibration.sure, model.limit),
                         (calibration.least.tolist(), 5, 700, 13))
        self.assertEqual(train.features_of(text), "abc1")

    def test_check_notices_other_features(self) -> None:
        """A file with today's sum passes; one with another sum, with none, or of other scenes does not."""
        native = constants.library()
        if native is None:
            print("skip test_check_notices_other_features: no library")
            self.skipTest("no library")
        text = re.sub(r"^// Features' sum: .*\n", "", constants.CONSTANTS.read_text(), flags=re.M)
        self.assertIn("was not written", train.complaint(text))
        now, head = constants.sum_of_features(native), "// Features:"
        self.assertEqual(train.complaint(text.replace(head, f"// Features' sum: {now}\n{head}")), "")
        self.assertIn("other features", train.complaint(text.replace(head, f"// Features' sum: {now[::-1]}x\n{head}")))
        self.assertIn("other scenes", train.complaint(re.sub("// Sum: ....", "// Sum: 0000", text)))

    def test_levels_in_force_are_those_of_the_library(self) -> None:
        native = constants.library()
        if native is None:
            print("skip test_levels_in_force_are_those_of_the_library: no library")
            self.skipTest("no library")
        position, _ = constants.fixed_cloud()
        cloud = native.Cloud(position, None, None)
        values = np.zeros((len(position), native.abi.TRUST_FEATURES), np.float32)
        cloud.analyse(trust_features=values)
        levels = constants.read(constants.CONSTANTS.read_text()).level(values)
        self.assertEqual(np.bincount(levels, minlength=boost.LEVELS).tolist(), list(cloud.trusts))
        self.assertGreater(len(set(levels)), 8)

    def test_constants_are_of_today(self) -> None:
        """What the library was built with was made from today's scenes, scanners, trainer and features: what train.py --check says."""
        text = constants.CONSTANTS.read_text() if constants.CONSTANTS.is_file() else ""
        if "tests/truth/trust/train.py" not in text:
            print(f"skip test_constants_are_of_today: {constants.CONSTANTS} was not written by train.py")
            self.skipTest("not written by train.py")
        sum_, _, names, scenes = train.told(text)
        self.assertEqual(samples.checked(scenes), scenes)
        self.assertEqual(names, train.names_of_features("library"))
        self.assertEqual(sum_, train.made_from(names, scenes), "train again: tests/truth/trust/train.py")
        if constants.library() is not None:
            self.assertEqual(train.complaint(text), "", "train again: tests/truth/trust/train.py")

    def test_default_threshold(self) -> None:
        """Of each scene at most a hundredth of the right samples lies below, and of one more than that if it were one higher."""
        random = np.random.default_rng(5)
        all_, scores = {}, {}
        for name, shift in (("one", 0), ("two", -300)):
            right = random.random(6000) < 0.9
            scores[name] = (random.normal(scale=500, size=6000) + 1500 * right + shift).astype(np.int32)
            all_[name] = samples.Samples(np.zeros((6000, 1), np.float32), right, np.ones(6000), np.zeros(6000, np.uint8),
                                         np.zeros(6000))
        calibration = train.calibrated(all_, scores)
        limit = train.threshold(all_, scores, calibration)
        below = [[(calibration.level(scores[name])[all_[name].right] < level).mean() for name in scores]
                 for level in (limit, limit + 1)]
        self.assertLessEqual(max(below[0]), train.LOST)
        self.assertGreater(max(below[1]), train.LOST)


class Judged(unittest.TestCase):
    def test_features_against_loops(self) -> None:
        """Of some points of a wavy sheet with strays, every feature written again as a sentence says it."""
        random = np.random.default_rng(6)
        p = random.uniform(0.0, 1.0, (400, 3))
        p[:, 2] = 0.03 * np.sin(6.0 * p[:, 0])
        p[:10, 2] += random.uniform(0.1, 0.3, 10)
        some = np.array([0, 5, 9, 50, 200, 399])
        got = dict(zip(features.NAMES, features.features(p, some).T))
        apart = np.linalg.norm(p[:, None] - p[None], axis=2)
        order = np.argsort(apart + np.where(np.eye(400, dtype=bool), -1.0, 0.0), axis=1)[:, 1:]

        def d(i: int, k: int) -> float:
            return float(apart[i, order[i, k - 1]])

        def plane(i: int, k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            near = p[order[i, :k]]
            value, vector = np.linalg.eigh(np.cov(near.T, bias=True))
            return near.mean(axis=0), vector[:, 0], np.maximum(value, (1e-9 * np.ptp(p, axis=0).max()) ** 2)

        for number, i in enumerate(some):
            for k in features.SIZES:
                near = order[i, :k]
                theirs = [d(j, k) for j in near]
                c, n, value = plane(i, k)
                off = abs((p[i] - c) @ n)
                for name, wanted in (("own_mean", d(i, k) / np.mean(theirs)), ("own_min", d(i, k) / min(theirs)),
                                     ("flat", value[0] / value[1]), ("line", value[1] / value[2]), ("off_d", off / d(i, k)),
                                     ("off_rms", off / np.sqrt(value[0])), ("mean_d", np.linalg.norm(p[i] - c) / d(i, k)),
                                     ("mutual", sum(d(j, k) >= apart[i, j] for j in near))):
                    np.testing.assert_allclose(got[f"{name}_{k}"][number], wanted, rtol=2e-4, atol=1e-5, err_msg=f"{name}_{k}")
            near = order[i, :12]
            mine = plane(i, 12)[1]
            away = [abs((p[i] - plane(j, 12)[0]) @ plane(j, 12)[1]) for j in near]
            rms = [min(a / np.sqrt(plane(j, 12)[2][0]), features.MOST_RMS) for a, j in zip(away, near)]
            second = np.mean([d(h, 12) for j in near for h in order[j, :6]])
            for name, wanted in (("d1_d6", d(i, 1) / d(i, 6)), ("d6_d24", d(i, 6) / d(i, 24)), ("second", d(i, 12) / second),
                                 ("bend_6", np.mean([abs(mine @ plane(j, 12)[1]) for j in near[:6]])),
                                 ("bend_12", np.mean([abs(mine @ plane(j, 12)[1]) for j in near])),
                                 ("theirs_d", np.mean([a / d(j, 12) for a, j in zip(away, near)])),
                                 ("theirs_rms", np.mean(rms)), ("theirs_min", min(rms))):
                np.testing.assert_allclose(got[name][number], wanted, rtol=2e-4, atol=1e-5, err_msg=name)

    def test_few_and_coincident_points(self) -> None:
        random = np.random.default_rng(7)
        for p in (np.zeros((1, 3)), np.zeros((2, 3)), random.random((7, 3)), np.zeros((60, 3)),
                  np.repeat(random.random((4, 3)), 30, axis=0), np.linspace(0.0, 1.0, 90)[:, None] * np.ones((1, 3))):
            got = features.features(p)
            self.assertEqual(got.shape, (len(p), len(features.NAMES)))
            self.assertTrue(np.isfinite(got).all())

    def test_tables_by_hand(self) -> None:
        right = np.arange(1000) >= 100
        one = samples.Samples(np.zeros((1000, 1), np.float32), right, np.ones(1000), np.where(right, 0, 1).astype(np.uint8),
                              np.where(right, 0.0, 0.1))
        score = np.where(right, 100, np.where(np.arange(1000) < 60, 0, 100)).astype(np.int32)  # 60 of 100 are told apart
        self.assertEqual(report.found(one, score, 0.01).sum(), 60)
        row = report.scene_row("s", one, score, np.where(score > 50, 15, 3), 13)
        self.assertEqual(row[1:], ["10.0", "0.800", "60.0", "60.0", "60.0", "0.0", "100.0", "60.0"])


class Allowed(unittest.TestCase):
    def test_what_is_held_out_is_refused(self) -> None:
        names = [one.name for one in campaigns.group("trained")]
        self.assertEqual(samples.checked(names), names)
        for name in campaigns.SPLIT["held out"]:
            with self.assertRaises(ValueError):
                samples.checked([*names, name])

    def test_groups_part_worlds(self) -> None:
        names = [one.name for one in campaigns.ALL if not one.held_out]
        parts = samples.groups(names)
        self.assertEqual(sorted(name for part in parts for name in part), sorted(names))
        for part in parts:
            self.assertTrue(part)
        group = {name: k for k, part in enumerate(parts) for name in part}
        for name in names:
            if f"{name}-errors" in group:
                self.assertEqual(group[name], group[f"{name}-errors"])

    def test_features_of_a_folder(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            values = np.arange(12, dtype=np.float32).reshape(4, 3)
            values.tofile(Path(folder) / "hall.f32")
            np.testing.assert_array_equal(samples.read(Path(folder), "hall", 4, 3), values)
            with self.assertRaises(ValueError):
                samples.read(Path(folder), "hall", 5, 3)


if __name__ == "__main__":
    result = unittest.main(exit=False, verbosity=0).result
    failed, skipped = len(result.failures) + len(result.errors), len(result.skipped)
    print(f"{result.testsRun - failed - skipped} passed, {failed} failed, {skipped} skipped")
    sys.exit(1 if failed else 0)
