# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of a picture is drawn while the view moves. Plain arithmetic: no Blender, no library."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

STRATA = 6  # of a chunk's points: each holds as many points as all before it
WHOLE = 0  # strata: all
# Half the points do not take half the time, for they lie farther apart in memory and on screen; and some work is the same for
# any number of pixels. Measured with 10 million points from all to a 32nd, and 700,000 pixels to a 16th.
OF_HALF = 0.73  # of the time of all points
FLAT = 0.0025  # seconds of the pixels' time


@dataclass(frozen=True)
class Level:
    """A share of the points and of the pixels."""

    strata: int  # 1..6 of 6
    shrink: int  # one pixel for shrink x shrink

    def loss(self) -> float:
        """Halvings of points and of pixels together."""
        return STRATA - self.strata + 2.0 * math.log2(self.shrink)

    def seconds(self, points: float, pixels: float) -> float:
        """Predicted, from the time of all points and that of all pixels without what is flat."""
        return points * OF_HALF ** (STRATA - self.strata) + FLAT + pixels / self.shrink ** 2


FULL = Level(STRATA, 1)
# Of clouds of many points, what adds less than so many pixels is left out where their files hold it in levels: of the first picture,
# of those while the view moves and of the second one at rest, of the whole one. The first reads 2 % of a town's points, the next 7 %.
MANY = 20_000_000
FIRST, MOVING, EXACT = 4.0, 1.0, 0.0


def next_detail(detail: float) -> float:
    """Of a view at rest, after a picture of that detail."""
    return MOVING if detail > MOVING else EXACT


_LEVELS = sorted((Level(strata, shrink) for strata in range(1, STRATA + 1) for shrink in (1, 2, 3, 4)),
                 key=lambda level: (level.loss(), level.shrink))
LEAST = _LEVELS[-1]

# A better level must fit into this share of the budget, so that two levels do not take turns.
CAUTION = 0.85
# Where Blender alone takes longer than the budget, a picture may come so much later than the least of them would: a coarser
# one would not be worth it.
LATER = 1.1


class Pace:
    """Chooses the level that loses least within a budget, from how long the last pictures took, and how long after that
    they were seen."""

    def __init__(self, budget: float) -> None:
        self.budget = budget  # seconds from a motion until its picture is seen
        self.level = Level(4, 2)  # until something is known
        # Of the last pictures, in seconds: what all points took; all pixels, without what is flat; and Blender, until the
        # picture was seen. Medians count, for other programs make single pictures slow.
        self._points, self._pixels, self._beside = (deque(maxlen=3) for _ in range(3))

    def note(self, level: Level, points: float, pixels: float) -> None:
        """A picture of that level took so many seconds for its points, and for its pixels."""
        self._points.append(points / OF_HALF ** (STRATA - level.strata))
        self._pixels.append(max(pixels - FLAT, 0.0) * level.shrink ** 2)
        now, most = _LEVELS.index(self.level), self._seconds_for_pictures()
        self.level = next((level for rank, level in enumerate(_LEVELS)
                           if self._seconds(level) <= most * (CAUTION if rank < now else 1.0)), LEAST)

    def seen(self, beside: float) -> None:
        """A picture of a view that moves on was seen so many seconds later, from its motion on, than its points and pixels
        explain."""
        self._beside.append(max(beside, 0.0))

    def _seconds(self, level: Level) -> float:
        return level.seconds(_median(self._points), _median(self._pixels))

    def _seconds_for_pictures(self) -> float:
        beside = _median(self._beside)
        return max(self.budget, LATER * (beside + self._seconds(LEAST))) - beside


def _median(values: deque[float]) -> float:
    """0 of none. Python's statistics would take 8 ms of Blender's start."""
    ranked, half = sorted(values), len(values) // 2
    if not ranked:
        return 0.0
    return ranked[half] if len(ranked) % 2 else (ranked[half - 1] + ranked[half]) / 2
