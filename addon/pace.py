# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of a picture is drawn while the view moves. Plain arithmetic: no Blender, no library."""

from __future__ import annotations

import math
from dataclasses import dataclass

STRATA = 6  # of a chunk's points: each holds as many points as all before it
WHOLE = 0  # strata: all


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
        return points * 2.0 ** (self.strata - STRATA) + pixels / self.shrink ** 2


FULL = Level(STRATA, 1)
_LEVELS = sorted((Level(strata, shrink) for strata in range(1, STRATA + 1) for shrink in (1, 2, 3, 4)),
                 key=lambda level: (level.loss(), level.shrink))
LEAST = _LEVELS[-1]

# A better level must fit into this share of the budget, so that two levels do not take turns.
CAUTION = 0.7


class Pace:
    """Chooses the level that loses least within a budget, from how long the last pictures took."""

    def __init__(self, budget: float) -> None:
        self.budget = budget  # seconds a picture
        self.level = Level(4, 2)  # until something is known
        self._points = self._pixels = math.nan  # seconds that all points, all pixels take

    def note(self, level: Level, points: float, pixels: float) -> None:
        """A picture of that level took so many seconds for its points, and for its pixels."""
        points *= 2.0 ** (STRATA - level.strata)
        pixels *= level.shrink ** 2
        known = not math.isnan(self._points)  # half of what was known: other programs make single pictures slow
        self._points = 0.5 * (self._points + points) if known else points
        self._pixels = 0.5 * (self._pixels + pixels) if known else pixels
        if self._fits(self.level, 1.0) and not any(
                self._fits(better, CAUTION) for better in _LEVELS if better.loss() < self.level.loss()):
            return
        self.level = next((level for level in _LEVELS if self._fits(level, CAUTION)), LEAST)

    def _fits(self, level: Level, share: float) -> bool:
        return level.seconds(self._points, self._pixels) <= share * self.budget
