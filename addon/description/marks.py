# SPDX-License-Identifier: GPL-3.0-or-later
"""What is written over an image: legends, scale bar, north arrow and titles."""

from __future__ import annotations

from dataclasses import dataclass

Color = tuple[float, float, float]  # linear


@dataclass(frozen=True)
class Legend:
    """The colors of one object's points, as a ramp with ticks, or as a list of named colors."""

    title: str  # with the unit
    ramp: bytes = b""  # linear RGB, float32, from the smallest value to the largest
    ticks: tuple[tuple[float, str], ...] = ()  # place from 0 to 1, value
    swatches: tuple[tuple[Color, str], ...] = ()


@dataclass(frozen=True)
class Bar:
    """A scale bar."""

    share: float  # of the full image's width
    text: str


@dataclass(frozen=True)
class Strokes:
    """Measurements: segments, points and values, in pixels of the image from its bottom left."""

    segments: tuple[tuple[float, float, float, float], ...]  # both ends
    dots: tuple[tuple[float, float], ...]  # measured points
    labels: tuple[tuple[float, float, str], ...]


@dataclass(frozen=True)
class Marks:
    legends: tuple[Legend, ...] = ()
    bar: Bar | None = None
    north: float | None = None  # angle of the arrow in the image, counterclockwise from the right, in radians
    titles: tuple[str, ...] = ()
    size: float = 1.0  # factor of the text's size
    burn: bool = False  # into the image
    strokes: Strokes | None = None
