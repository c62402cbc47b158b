# SPDX-License-Identifier: GPL-3.0-or-later
"""compare_builds.py finds what differs, and its scenes show what their names say: no two are the same. tests/bench/pairs.py tells slow from
fast.

    test_builds.py LIBRARY
"""

from __future__ import annotations

import copy
import os
import sys
import tempfile
import unittest
import unittest.mock
from pathlib import Path
from typing import Any

sys.path[:0] = [str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parents[1] / "bench")]

import builds_cases  # noqa: E402
import compare_builds  # noqa: E402
import pairs  # noqa: E402

LIBRARY = ""
# What is drawn by another way and has to come out the same.
SAME = {"cloud saved and opened": "lit", "surface filled": "lit", "surface error target": "surface paper", "surface error target, coarse": "surface not filled",
        "layers with nothing to see": "cloud none", "scan, free space off": "scan", "effect edl as it begins": "effect eye-dome",
        "effect obscurance as it begins": "effect obscurance", "effect fog as it begins": "lit",  # behind all that is seen
        "scan, filled, free space": "scan, free space use"}  # the wide discs of strays, which differed, are left out for their trust


class Altered(compare_builds.Process):
    """A build that draws something else than it is asked, in the scenes of some name."""

    def __init__(self, name: str, **settings: Any) -> None:
        super().__init__(compare_builds.located(LIBRARY), "cpu")
        self.name, self.settings = name, settings

    def tell(self, **asked: Any) -> None:
        asked = copy.deepcopy(asked)
        case = asked.get("draw") or asked.get("time") or {}
        if case.get("name") == self.name:
            case.setdefault("settings", {}).update(self.settings)
        super().tell(**asked)


class Poisoned(compare_builds.Process):
    """A build that overwrites planes when their lifetimes begin and end."""

    def __init__(self, device: str) -> None:
        with unittest.mock.patch.dict(os.environ, PATINA_POISON_PLANES="1"):
            super().__init__(compare_builds.located(LIBRARY), device)


class Timed:
    """A build whose frames take known times: longer in the first two pairs, and in every later one."""

    def __init__(self, name: str, share: float, turns: list[tuple[str, float]]) -> None:
        self.name, self.share, self.turns = name, share, turns

    def ask(self, time: dict[str, Any], turn: float) -> dict[str, float]:
        self.turns.append((self.name, turn))
        longer = 1000.0 if turn < 2 and self.name == "old" else 0.5 + turn
        return {"ms": self.share * longer, "work": self.share ** 2 * longer * (4 / 3 if self.name == "new" else 1.0)}


class Builds(unittest.TestCase):
    def setUp(self) -> None:
        self.cases = builds_cases.cases()
        self.process = compare_builds.Process(compare_builds.located(LIBRARY), "cpu")
        self.addCleanup(self.process.close)

    def compared(self, other: compare_builds.Process, names: list[str]) -> tuple[tuple[int, int, int], list[str]]:
        self.addCleanup(other.close)
        lines: list[str] = []
        with tempfile.TemporaryDirectory() as folder:
            chosen = [case for case in self.cases if case["name"] in names]
            self.assertEqual(len(chosen), len(names))
            return compare_builds.compared(self.process, other, chosen, Path(folder), lines.append), lines

    def test_the_list(self) -> None:
        names = [case["name"] for case in self.cases]
        self.assertGreaterEqual(len(names), 80)
        self.assertEqual(len(set(names)), len(names))
        self.assertTrue(all(case["size"][0] <= 320 and case["size"][1] <= 240 for case in self.cases))

    def test_every_scene_is_another(self) -> None:
        known: dict[str, str] = {}
        pictures = {}
        for case in self.cases:
            told = self.process.ask(draw=case)
            self.assertFalse({"error", "unknown"} & set(told), (case["name"], told))
            pictures[case["name"]] = told
        for name, told in pictures.items():
            key = str(sorted((plane, value) for plane, value in told.items() if plane != "stats"))
            if known.setdefault(key, name) != name:
                self.assertEqual(SAME.get(name), known[key], name)

    def test_a_difference_is_found(self) -> None:
        counts, lines = self.compared(Altered("plain", world_color=[0.05, 0.06, 0.08000001]), ["plain", "film transparent", "light sun"])
        self.assertEqual(counts, (2, 1, 0))
        self.assertRegex(lines[0], r"^  DIFFER plain: COMBINED: \d+ of 76800 by \S+$")  # and nothing else

    def test_keys_are_compared(self) -> None:
        counts, lines = self.compared(Altered("light sun", strata=3), ["plain", "light sun"])
        self.assertEqual(counts, (1, 1, 0))
        self.assertIn("KEYS: ", lines[0])

    def test_planes_are_read_within_their_lifetimes(self) -> None:
        counts, lines = self.compared(Poisoned("cpu"), [case["name"] for case in self.cases])
        self.assertEqual(counts, (len(self.cases), 0, 0), lines)

    def test_what_fails_is_told(self) -> None:
        counts, lines = self.compared(Altered("plain", width=1 << 31), ["plain"])
        self.assertEqual(counts, (0, 1, 0))
        self.assertIn("FAILED plain: old drew it, new ", lines[0])
        counts, lines = self.compared(Altered("plain", nothing_like_it=1), ["plain"])
        self.assertEqual(counts, (0, 1, 0))
        self.assertIn("nothing_like_it", lines[0])

    def test_pairs(self) -> None:
        """Both draw by turns, who is first changing, the first two pairs do not count, and ratios are those of pairs: not of a clock's
        noise, which no test hangs on."""
        self.assertGreaterEqual(len(pairs.MODES), 12)
        self.assertEqual(pairs.interval(list(range(200))), (85, 114))
        asked, turns = pairs.case("all cues together", 200, "torus"), []
        found = pairs.measured(Timed("old", 2.0, turns), Timed("new", 3.0, turns), asked, 30)
        self.assertEqual(found["ms"], {"old": 34.0, "new": 51.0, "ratio": 1.5, "interval": (1.5, 1.5)})
        self.assertEqual(found["work"]["ratio"], 3.0)
        self.assertEqual(turns[:6], [("new", 0.0), ("old", 0.0), ("old", 1.0), ("new", 1.0), ("new", 2.0), ("old", 2.0)])
        self.assertEqual((len(turns), found["pairs"]), (2 * 32, 30))
        late = pairs.measured(Timed("old", 2.0, turns), Timed("new", 3.0, turns), asked, 30, 0.0)
        self.assertEqual(late["pairs"], pairs.LEAST)
        self.assertIn("late (20 pairs)", pairs.row("late", late, 30))
        other = compare_builds.Process(compare_builds.located(LIBRARY), "cpu")
        self.addCleanup(other.close)
        found = pairs.measured(self.process, other, asked, 3)
        self.assertGreater(min(found["ms"]["old"], found["ms"]["new"], found["work"]["old"], found["work"]["new"]), 0.0)
        self.assertRegex(pairs.measured(self.process, other, {**asked, "clouds": [{"of": "torus", "nothing_like_it": 1}]}, 1)["error"], "nothing_like_it")


if __name__ == "__main__":
    LIBRARY = sys.argv.pop(1)
    unittest.main()
