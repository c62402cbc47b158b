# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of a picture is drawn while the view moves. Plain arithmetic: no Blender, no library."""

from __future__ import annotations

import math
from dataclasses import dataclass

STRATA = 6  # of a chunk's points: each holds as many points as all before it
WHOLE = 0  # strata: all
# Half the points do not take half the time, for they lie farther apart in memory and on screen; nor do fewer pixels, for some
# work is the same for any number. Measured with 10 million points from all to a 32nd, and 700,000 pixels to a 16th.
OF_HALF = 0.67  # of the time of all points
OF_PIXELS = 1.25  # the power of the pixel's width that their time goes by


@dataclass(frozen=True)
class Level:
    """A share of the points and of the pixels."""

    strata: int  # 1..6 of 6
    shrink: int  # one pixel for shrink x shrink

    def loss(self) -> float:
        """Halvings of points and of pixels together."""
        return STRATA - self.strata + 2.0 * math.log2(self.shrink)

    def seconds(self, points: float, pixels: float) -> float:
        """Predicted, from the time of all points and that of all pixels."""
        return points * OF_HALF ** (STRATA - self.strata) + pixels / self.shrink ** OF_PIXELS


FULL = Level(STRATA, 1)
_LEVELS = sorted((Level(strata, shrink) for strata in range(1, STRATA + 1) for shrink in (1, 2, 3, 4)),
                 key=lambda level: (level.loss(), level.shrink))
LEAST = _LEVELS[-1]

# A better level must fit into this share of the budget, so that two levels do not take turns.
CAUTION = 0.7
# What Blender takes beside a picture comes off the budget, to this share of it: where Blender alone takes longer, coarser
# pictures would hardly come sooner.
OURS = 0.25


class Pace:
    """Chooses the level that loses least within a budget, from how long the last pictures took, and how long after that
    they were seen."""

    def __init__(self, budget: float) -> None:
        self.budget = budget  # seconds from the begin of a picture until it is seen
        self.level = Level(4, 2)  # until something is known
        self._points = self._pixels = math.nan  # seconds that all points, all pixels take
        self._beside = 0.0  # seconds of the budget that Blender takes

    def note(self, level: Level, points: float, pixels: float) -> None:
        """A picture of that level took so many seconds for its points, and for its pixels."""
        points /= OF_HALF ** (STRATA - level.strata)
        pixels *= level.shrink ** OF_PIXELS
        known = not math.isnan(self._points)  # half of what was known: other programs make single pictures slow
        self._points = 0.5 * (self._points + points) if known else points
        self._pixels = 0.5 * (self._pixels + pixels) if known else pixels
        if self._fits(self.level, 1.0) and not any(
                self._fits(better, CAUTION) for better in _LEVELS if better.loss() < self.level.loss()):
            return
        self.level = next((level for level in _LEVELS if self._fits(level, CAUTION)), LEAST)

    def seen(self, beside: float) -> None:
        """A picture of a view that moves on was seen so many seconds later than its points and pixels explain."""
        self._beside = 0.5 * (self._beside + min(max(beside, 0.0), self.budget))  # one long pause is soon forgotten

    def _fits(self, level: Level, share: float) -> bool:
        ours = max(self.budget - self._beside, OURS * self.budget)
        return level.seconds(self._points, self._pixels) <= share * ours
