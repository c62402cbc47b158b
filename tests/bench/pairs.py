# SPDX-License-Identifier: GPL-3.0-or-later
"""Pairs of frames, old and new in turns, so that what else the machine does troubles both alike.

    build/out/venv/bin/python tests/bench/pairs.py OLD NEW [--device cpu] [--pairs 200] [--minutes 11] [--only WORD ...] [--limit 1.02]
    build/bench --against OLD        # the same with this tree as NEW, in 11 minutes

OLD, NEW as for tests/scenes/compare_builds.py: each runs in a process of its own and waits while the other draws. A mode is a million
points of a torus at 1024 x 1024, the camera a degree further each pair; after two pairs that do not count, the median of each side, and
of the pairs' ratios with the interval that holds it with 95 percent (by order statistics); by the clock, and by the processor's time of
all threads, which other programs hardly change. --minutes is shared out among the modes: one whose share is spent has fewer pairs, at
least 20, and its row says so. Ends with 1 where such an interval lies above the limit as a whole.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from statistics import median
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scenes"))

import compare_builds  # noqa: E402
from looks import CUES  # noqa: E402

SUN = {"type": "LIGHT_TYPE.SUN", "power": 3.0, "direction": [0.4, 0.5, -1.0]}
POINTWISE = ("toon bands", "hatching", "fog", "paper")
MODES: dict[str, dict[str, Any]] = {
    "surface": {}, "as in the paper": {"settings": {"quality": "QUALITY.PAPER", "fill": "FILL.PAPER"}},
    "no filters": {"settings": {"fill": "FILL.OFF", "smooth": "SMOOTH.OFF", "antialias": "ANTIALIAS.OFF"}},
    "discs": {"settings": {"surface": "SURFACE.SPLATS"}}, "averaged": {"settings": {"average": 1}},
    "all passes": {"settings": {"passes": 0}}, "6 layers": {"settings": {"layers": 6}, "style": {"transparency": 0.5, "cull_back": 0}},
    "shadows kept": {"light": {"shadows": 1}},
    "5 shadow samples": {"settings": {"shadow_samples": 5, "shadow_lazy": 1}, "light": {"shadows": 1, "angle": 0.1}},
    "lines 8": {"lines": {"width": 8.0}},
    **{name: {"effects": effects} for name, effects in CUES.items()},
    "pointwise cues together": {"effects": {key: value for name in POINTWISE for key, value in CUES[name].items()}},
    "all cues together": {"effects": {key: value for effects in CUES.values() for key, value in effects.items()}},
}


LEAST = 20  # pairs of a mode, whatever they take


def case(name: str, size: int, cloud: str) -> dict[str, Any]:
    mode = MODES[name]
    return {"name": name, "size": [size, size], "clouds": [{"of": cloud, "lighting": "LIGHTING.LIT", "cull_back": 1} | mode.get("style", {})],
            "lights": [SUN | mode.get("light", {})], "settings": {"film_transparent": 1, "passes": 3} | mode.get("settings", {}),
            **{key: mode[key] for key in ("effects", "lines") if key in mode}}


def interval(values: list[float]) -> tuple[float, float]:
    """That holds the median of where they come from with 95 percent, whatever their distribution; the whole range of few values."""
    values, count = sorted(values), len(values)
    off = int(0.98 * count ** 0.5 + 1.0)
    return values[max(0, (count - 1) // 2 - off)], values[min(count - 1, count // 2 + off)]


def measured(old: compare_builds.Process, new: compare_builds.Process, asked: dict[str, Any], pairs: int,
             seconds: float = float("inf")) -> dict[str, Any]:
    """Medians of "ms" and "work" of both, their ratios with intervals, and how many "pairs" there were, fewer where these take longer than
    that, but LEAST; "error" where a side cannot do it."""
    end = time.monotonic() + seconds
    sides: tuple[list[dict[str, float]], ...] = ([], [])
    for pair in range(pairs + 2):
        if pair >= LEAST + 2 and time.monotonic() > end:
            break
        order = ((0, old), (1, new)) if pair % 2 else ((1, new), (0, old))
        for side, process in order:
            told = process.ask(time=asked, turn=float(pair))
            if "ms" not in told:
                return {"error": f"{('old', 'new')[side]}: {told}"}
            if pair >= 2:
                sides[side].append(told)
    found: dict[str, Any] = {"pairs": len(sides[0])}
    for what in ("ms", "work"):
        a, b = ([told[what] for told in side] for side in sides)
        ratios = [y / x for x, y in zip(a, b, strict=True)]
        found[what] = {"old": median(a), "new": median(b), "ratio": median(ratios), "interval": interval(ratios)}
    return found


def row(name: str, found: dict[str, Any], asked: int) -> str:
    if "error" in found:
        return f"| {name} | {found['error']} |"
    ms, work = found["ms"], found["work"]
    name += f" ({found['pairs']} pairs)" if found["pairs"] < asked else ""
    return (f"| {name} | {ms['old']:.2f} | {ms['new']:.2f} | {ms['ratio']:.3f} ({ms['interval'][0]:.3f} to {ms['interval'][1]:.3f}) | "
            f"{work['ratio']:.3f} ({work['interval'][0]:.3f} to {work['interval'][1]:.3f}) |")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--pairs", type=int, default=200)
    parser.add_argument("--minutes", type=float, default=float("inf"))
    parser.add_argument("--size", type=int, default=1024)
    parser.add_argument("--only", nargs="+", default=[], help="modes whose name contains one of these")
    parser.add_argument("--limit", type=float, default=1.02)
    given = parser.parse_args()
    old, new = (compare_builds.Process(compare_builds.located(name), given.device, given.threads) for name in (given.old, given.new))
    bad = False
    for process in (old, new):
        if "error" in process.first:
            sys.exit(f"pairs: {process.first['error']}")
    print(f"{new.first['device']}, {given.pairs} pairs\n\n| mode | old, ms | new, ms | new / old | of the processor's time |\n|---|---|---|---|---|")
    names, end = [name for name in MODES if not given.only or any(word in name for word in given.only)], time.monotonic() + 60 * given.minutes
    for i, name in enumerate(names):
        share = (end - time.monotonic()) / (len(names) - i)  # of what is left: what quick ones spare serves the slow
        found = measured(old, new, case(name, given.size, "million"), given.pairs, share)
        print(row(name, found, given.pairs), flush=True)
        bad |= "error" in found or found["ms"]["interval"][0] > given.limit
    old.close()
    new.close()
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
