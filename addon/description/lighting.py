# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights of an image."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Light:
    """patina_light_desc."""

    type: int
    color: tuple[float, float, float]
    power: float
    position: tuple[float, float, float]
    direction: tuple[float, float, float]  # the way the light travels
    side: tuple[float, float, float]
    angle: float
    radius: float
    size: tuple[float, float]
    shape: int
    cone: float
    blend: float
    shadows: int


@dataclass(frozen=True)
class Headlight:
    """Goes where the camera goes."""

    color: tuple[float, float, float]
    power: float
