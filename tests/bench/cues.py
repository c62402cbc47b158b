# SPDX-License-Identifier: GPL-3.0-or-later
"""What each depth cue or means of drawing costs on a million points at 1024 x 1024: its own passes, and how much longer the picture takes.

    build/out/venv/bin/python tests/bench/cues.py [--library FILE] [--device cpu] [--rounds 60] [--only WORD ...]

A round draws four pictures: with the cue and without, each as it is drawn, and with every pass alone (a picture whose layers are kept runs
none of them as one). Own passes: what the cue adds to the latter, for all together the sum of theirs. The camera turns a degree a round, the order is turned about; medians of
the processor's time of all threads, which other programs hardly change. *Beyond them*: what a picture takes longer than its cue's own
passes, of the plain picture, with the interval that holds the median with 95 percent. Ends with 1 where such an interval lies above a
twentieth as a whole, or above a fifth for all cues together.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path
from statistics import median
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent), str(HERE.parent / "scenes"), str(HERE.parents[1] / "addon")]

from looks import CUES  # noqa: E402
from pairs import case, interval  # noqa: E402

CLIP = {"shape": "CLIP_SHAPE.PLANE", "world_from_clip": [1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0, 0.45, 0, 0, 0, 1.0]}
TINTED = CLIP | {"tint": [1.0, 0.2, 0.1], "tint_strength": 0.8, "tint_width": 0.5}
COSTS: dict[str, dict[str, Any]] = {
    **{name: {"effects": effects} for name, effects in CUES.items()},
    "contour lines": {"effects": {"contour_opacity": 1.0}},
    "tinted cuts": {"clips": [TINTED], "without": [CLIP]},  # a cut alone is no cue
    "lines of 2 pixels": {"lines": {"width": 2.0}},
}
ALL, WARM_UP = "all of these together", 3
LIMIT, LIMIT_OF_ALL = 0.05, 0.2
COSTS[ALL] = {"effects": {key: value for cost in COSTS.values() for key, value in cost.get("effects", {}).items()},
              "lines": {"width": 2.0}}  # of the same points: nothing is cut
ALONE = {"layers": 1, "layer_passes": 1}  # settings with which no passes run as one
PICTURES = ("plain", "with", "plain alone", "with alone")


def pictures(name: str, size: int, cloud: str) -> dict[str, dict[str, Any]]:
    """The four pictures of a round, as builds_cases.py writes them."""
    plain, cost = case("surface", size, cloud), COSTS[name]
    plain |= {"clips": cost.get("without", [])}
    whole = plain | {key: cost[key] for key in ("effects", "clips", "lines") if key in cost}
    return {"plain": plain, "with": whole, **{f"{kind} alone": one | {"settings": one["settings"] | ALONE}
                                              for kind, one in (("plain", plain), ("with", whole))}}


def rounds(side: Any, name: str, count: int, size: int, cloud: str) -> dict[str, list[float]]:
    """Milliseconds of the processor's time of each picture, by round."""
    import native

    asked = pictures(name, size, cloud)
    frames = {kind: native.Frame(side.device) for kind in PICTURES}
    found: dict[str, list[float]] = {kind: [] for kind in PICTURES}
    for turn in range(count + WARM_UP):
        for kind in PICTURES if turn % 2 else PICTURES[::-1]:
            scene = side.scene(asked[kind], float(turn))
            busy = time.process_time()
            frames[kind].render(scene)
            if turn >= WARM_UP:
                found[kind].append(1e3 * (time.process_time() - busy))
    return found


def measure(device: str = "cpu", count: int = 60, only: list[str] | None = None, size: int = 1024, cloud: str = "million", threads: int = 0
            ) -> list[dict[str, Any]]:
    """A row a cue: "plain", "own" and "more", milliseconds; "beyond", of the plain picture, with its "interval"; "limit"."""
    import builds_side  # which binds the library, as native does

    side = builds_side.Side(device, threads)
    rows: list[dict[str, Any]] = []
    for name in COSTS:
        if only and not any(word in name for word in only):
            continue
        found = rounds(side, name, count, size, cloud)
        plain, shown, plain_alone, shown_alone = (found[kind] for kind in PICTURES)
        own = median(b - a for a, b in zip(plain_alone, shown_alone, strict=True))
        passes = sum(row["own"] for row in rows if "clips" not in COSTS[row["name"]]) if name == ALL and not only else own
        beyond = [(b - a - passes) / a for a, b in zip(plain, shown, strict=True)]
        rows.append({"name": name, "plain": median(plain), "own": passes, "more": median(b - a for a, b in zip(plain, shown, strict=True)),
                     "beyond": median(beyond), "interval": interval(beyond), "limit": LIMIT_OF_ALL if name == ALL else LIMIT})
        print(f"cues: {name}: {rows[-1]['beyond']:+.3f} beyond its own passes", file=sys.stderr)
    return rows


def table(rows: list[dict[str, Any]]) -> str:
    lines = ["| what | plain picture, ms | its own passes, ms | picture, ms more | beyond them | at most |", "|---|---|---|---|---|---|"]
    for row in rows:
        low, high = row["interval"]
        lines.append(f"| {row['name']} | {row['plain']:.1f} | {row['own']:.1f} | {row['more']:.1f} | "
                     f"{row['beyond']:+.3f} ({low:+.3f} to {high:+.3f}) | {row['limit']:.2f} |")
    return "\n".join(lines)


def text(quick: bool, library: Path, device: str = "cpu") -> str:
    os.environ["PATINA_LIBRARY"] = str(library)
    return table(measure(device, 10 if quick else 60))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--library", type=Path, default=HERE.parents[1] / "build/out/release/libpatina.so")
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--rounds", type=int, default=60)
    parser.add_argument("--only", nargs="+", help="rows whose name contains one of these")
    given = parser.parse_args()
    os.environ["PATINA_LIBRARY"] = str(given.library)
    rows = measure(given.device, given.rounds, given.only, threads=given.threads)
    print(table(rows))
    return int(any(row["interval"][0] > row["limit"] for row in rows))


if __name__ == "__main__":
    sys.exit(main())
