# SPDX-License-Identifier: GPL-3.0-or-later
"""What the last picture took for automatic: shown beside the artist's own numbers, never read back."""

from __future__ import annotations

_layer_distances: dict[str, float] = {}


def keep(layer_distances: dict[str, float]) -> None:
    """By the full name of the object, world units."""
    _layer_distances.clear()
    _layer_distances.update(layer_distances)


def layer_distance(name: str) -> float | None:
    """Of the object with this full name; None when the last picture did not show it."""
    return _layer_distances.get(name)
