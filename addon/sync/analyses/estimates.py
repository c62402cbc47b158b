# SPDX-License-Identifier: GPL-3.0-or-later
"""What the last picture took for automatic, and how close the points of it and of drawings are: shown beside the artist's own numbers, never
read back."""

from __future__ import annotations

_layer_distances: dict[str, float] = {}
_spacings: dict[str, float] = {}
_drawn: dict[str, tuple[float, float]] = {}


def keep(layer_distances: dict[str, float], spacings: dict[str, float]) -> None:
    """By the full name of the object, world units."""
    for known, given in ((_layer_distances, layer_distances), (_spacings, spacings)):
        known.clear()
        known.update(given)


def layer_distance(name: str) -> float | None:
    """Of the object with this full name; None when the last picture did not show it."""
    return _layer_distances.get(name)


def keep_drawn(name: str, spacing: float, sigma: float) -> None:
    """Of the points that the cut lines of the drawing with this full name went through, world units."""
    _drawn[name] = (spacing, sigma)


def of_drawing(name: str) -> tuple[float, float]:
    """Spacing and noise of its points, world units: where it was cut last, else the least spacing of the last picture's clouds; 0: not known."""
    return _drawn.get(name) or (min((value for value in _spacings.values() if value > 0.0), default=0.0), 0.0)
