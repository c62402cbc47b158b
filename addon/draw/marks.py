# SPDX-License-Identifier: GPL-3.0-or-later
"""Paints legends, scale bar, north arrow and titles with numpy alone: the same pixels in the viewport, in renders and in background.

Images are (height, width, 4) float32, linear and premultiplied, the lowest row first."""

from __future__ import annotations

import io
import math
import zipfile
from functools import lru_cache
from pathlib import Path

import numpy as np

from ..description.marks import Legend, Marks, Strokes

TEXT = 1.0 / 38.0  # of the image's shorter side: the height of text
LEAST = 11.0  # pixels: text is never smaller
_INK, _PAPER = (0.95, 0.95, 0.95), (0.012, 0.012, 0.012)
_LINE = (1.0, 0.57, 0.022)  # of measurements, as in the viewport
_VEIL = 0.62  # opacity of the panel behind text


def _arrays(path: Path) -> dict[str, np.ndarray]:
    """The arrays of an .npz file. Objects that would have to be unpickled are refused."""
    with zipfile.ZipFile(path) as archive:
        return {Path(name).stem: np.lib.format.read_array(io.BytesIO(archive.read(name))) for name in archive.namelist()}


class _Glyphs:
    def __init__(self) -> None:
        kept = _arrays(Path(__file__).with_name("glyphs.npz"))
        self.places = {letter: number for number, letter in enumerate(str(kept["text"]))}
        self.advances, self.starts = kept["advances"], kept["starts"]
        self.pixels = kept["pixels"].astype(np.float32) / 255.0
        self.size, self.height, self.base, self.pad = (int(value) for value in kept["metrics"])


@lru_cache(maxsize=1)
def _glyphs() -> _Glyphs:
    return _Glyphs()


@lru_cache(maxsize=256)
def line(text: str, size: float) -> np.ndarray:
    """(h, w) float32: how much of each pixel a line of text covers. size: of the font, in pixels. Letters outside of Latin-1 become ?"""
    glyphs = _glyphs()
    numbers = [glyphs.places.get(letter, glyphs.places["?"]) for letter in text]
    width = int(math.ceil(sum(glyphs.advances[number] for number in numbers))) + 2 * glyphs.pad + 2
    out, pen = np.zeros((glyphs.height, width), np.float32), 0.0
    for number in numbers:
        glyph = glyphs.pixels[:, glyphs.starts[number]:glyphs.starts[number + 1]]
        at = round(pen)
        part = out[:, at:at + glyph.shape[1]]
        np.maximum(part, glyph[:, :part.shape[1]], out=part)
        pen += float(glyphs.advances[number])
    return _scaled(_scaled(out, size / glyphs.size).T, size / glyphs.size).T


def _scaled(values: np.ndarray, factor: float) -> np.ndarray:
    """Rows of another number: each is the mean of those that it covers."""
    count = max(round(len(values) * factor), 1)
    edges = np.linspace(0.0, len(values), count + 1)
    sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, 0, dtype=np.float64)])
    low = np.minimum(edges.astype(int), len(values) - 1)
    at = sums[low] + (edges - low)[:, None] * (sums[low + 1] - sums[low])
    return (np.diff(at, axis=0) * (count / len(values))).astype(np.float32)


class _Sheet:
    def __init__(self, width: int, height: int, size: float) -> None:
        self.pixels = np.zeros((height, width, 4), np.float32)
        self.width, self.height, self.size = width, height, size

    def blend(self, x: int, y: int, cover: np.ndarray, color: tuple[float, ...] | np.ndarray) -> None:
        """Lays a color over the part of the sheet whose lower left corner is x, y."""
        x0, y0 = max(x, 0), max(y, 0)
        x1, y1 = min(x + cover.shape[1], self.width), min(y + cover.shape[0], self.height)
        if x0 >= x1 or y0 >= y1:
            return
        cut = (slice(y0 - y, y1 - y), slice(x0 - x, x1 - x))
        alpha = cover[cut][..., None]
        color = np.broadcast_to(np.asarray(color, np.float32), (*cover.shape, 3))[cut]
        part = self.pixels[y0:y1, x0:x1]
        part *= 1.0 - alpha
        part += np.concatenate([color * alpha, alpha], 2)

    def box(self, x: float, y: float, width: float, height: float, color: tuple[float, ...], opacity: float = 1.0) -> None:
        self.blend(round(x), round(y), np.full((max(round(height), 1), max(round(width), 1)), opacity, np.float32), color)

    def write(self, x: float, middle: float, text: str) -> None:
        """Writes a line whose middle is so high, from x on."""
        cover = line(text, self.size)
        self.blend(round(x - self.size * 0.1), round(middle - 0.5 * cover.shape[0]), cover, _INK)

    def segment(self, x0: float, y0: float, x1: float, y1: float, width: float, color: tuple[float, ...], opacity: float = 1.0) -> None:
        """A line with round ends, from pixel to pixel."""
        reach = 0.5 * width + 1.0
        left, right = (int(np.clip(side, 0, self.width)) for side in (min(x0, x1) - reach, max(x0, x1) + reach + 1.0))
        low, high = (int(np.clip(side, 0, self.height)) for side in (min(y0, y1) - reach, max(y0, y1) + reach + 1.0))
        if left >= right or low >= high:
            return
        x, y = np.meshgrid(np.arange(left, right, dtype=np.float32) + 0.5 - x0, np.arange(low, high, dtype=np.float32) + 0.5 - y0)
        way = np.array((x1 - x0, y1 - y0))
        share = np.clip((x * way[0] + y * way[1]) / max(float(way @ way), 1e-12), 0.0, 1.0)
        cover = np.clip(0.5 * width + 0.5 - np.hypot(x - share * way[0], y - share * way[1]), 0.0, 1.0)
        self.blend(left, low, (opacity * cover).astype(np.float32), color)

    def wide(self, texts: list[str]) -> float:
        return max((line(text, self.size).shape[1] for text in texts), default=0) - 0.2 * self.size


def paint(marks: Marks, width: int, height: int, full: int = 0) -> np.ndarray:
    """The image that lies over one of this size; where it shows nothing it is 0. full: width of the image that this is a part of, in
    pixels; 0: it is no part."""
    size = max(min(width, height) * TEXT, LEAST) * marks.size
    sheet = _Sheet(width, height, size)
    if marks.strokes:
        _strokes(sheet, marks.strokes)
    margin, top = size, height - size
    for legend in marks.legends:
        top = _legend(sheet, legend, width - margin, top) - 0.6 * size
    if marks.titles:
        _titles(sheet, marks.titles, margin)
    if marks.bar:
        _bar(sheet, marks.bar.share * (full or width), marks.bar.text, margin)
    if marks.north is not None:
        _arrow(sheet, marks.north, margin + 1.8 * size, margin + 5.1 * size)  # above the bar; Blender's tools are at the upper left
    return sheet.pixels


def over(marks: Marks, pixels: np.ndarray, full: int = 0) -> np.ndarray:
    """The image with the marks burned in; a new array. full: as in paint()."""
    ink = paint(marks, pixels.shape[1], pixels.shape[0], full)
    return ink + pixels * (1.0 - ink[..., 3:])


def _strokes(sheet: _Sheet, strokes: Strokes) -> None:
    """Measurements: lines and points with a dark border, and values above and to the right of their places."""
    size = sheet.size
    thin = max(size / 8.0, 1.5)
    for width, color, opacity in ((2.2 * thin, _PAPER, 0.75), (thin, _LINE, 1.0)):
        for segment in strokes.segments:
            sheet.segment(*segment, width, color, opacity)
    for x, y in strokes.dots:
        sheet.segment(x, y, x, y, 4.2 * thin, _PAPER, 0.75)
        sheet.segment(x, y, x, y, 3.0 * thin, _LINE)
    for x, y, text in strokes.labels:
        sheet.box(x + 0.4 * size, y + 0.4 * size, sheet.wide([text]) + 0.6 * size, 1.5 * size, _PAPER, _VEIL)
        sheet.write(x + 0.7 * size, y + 1.15 * size, text)


def _legend(sheet: _Sheet, legend: Legend, right: float, top: float) -> float:
    """Returns its lower edge. top: its upper one; right: its right one."""
    size, gap = sheet.size, 0.5 * sheet.size
    if legend.swatches:
        texts, tall = [text for _, text in legend.swatches], 1.4 * size * len(legend.swatches)
    else:
        texts, tall = [text for _, text in legend.ticks], min(10.0 * size, 0.45 * sheet.height)
    wide = max(1.6 * size + sheet.wide(texts), sheet.wide([legend.title])) + 2.0 * gap
    high = tall + 2.6 * size
    left, bottom = right - wide, top - high
    sheet.box(left, bottom, wide, high, _PAPER, _VEIL)
    sheet.write(left + gap, top - size, legend.title)
    low = bottom + 0.6 * size
    if legend.swatches:
        for number, (color, text) in enumerate(legend.swatches):
            middle = low + tall - 1.4 * size * (number + 0.5)
            sheet.box(left + gap, middle - 0.5 * size, size, size, color)
            sheet.write(left + gap + 1.6 * size, middle, text)
        return bottom
    colors = np.frombuffer(legend.ramp, np.float32).reshape(-1, 3)
    rows = np.linspace(0.0, len(colors) - 1.0, max(round(tall), 2))
    column = np.stack([np.interp(rows, np.arange(len(colors)), colors[:, i]) for i in range(3)], 1)
    sheet.blend(round(left + gap), round(low), np.ones((len(rows), round(size)), np.float32), column[:, None, :])
    for place, text in legend.ticks:
        middle = low + place * tall
        sheet.box(left + gap + size, middle - 0.5, 0.3 * size, max(size / 14.0, 1.0), _INK)
        sheet.write(left + gap + 1.6 * size, middle, text)
    return bottom


def _titles(sheet: _Sheet, titles: tuple[str, ...], margin: float) -> None:
    size = sheet.size
    wide, high = sheet.wide(list(titles)) + size, 1.4 * size * len(titles) + 0.4 * size
    left = sheet.width - margin - wide
    sheet.box(left, margin, wide, high, _PAPER, _VEIL)
    for number, text in enumerate(titles):
        sheet.write(left + 0.5 * size, margin + high - 0.2 * size - 1.4 * size * (number + 0.5), text)


def _bar(sheet: _Sheet, length: float, text: str, margin: float) -> None:
    """Four parts, dark and light; the first begins at the panel's left margin."""
    size = sheet.size
    wide, high = max(length, sheet.wide([text])) + size, 2.7 * size
    sheet.box(margin, margin, wide, high, _PAPER, _VEIL)
    left = margin + 0.5 * size
    thick = max(size / 14.0, 1.0)
    sheet.box(left, margin + 0.5 * size, length, 0.5 * size, _INK)
    for part in (0, 2):
        start = round(left + part * length / 4.0 + thick)
        sheet.box(start, margin + 0.5 * size + thick, round(left + (part + 1) * length / 4.0) - start, 0.5 * size - 2.0 * thick, _PAPER)
    sheet.write(left, margin + 1.8 * size, text)


def _arrow(sheet: _Sheet, angle: float, x: float, y: float) -> None:
    """A needle about x, y, and the letter N beside its point."""
    size, side = sheet.size, 1.8 * sheet.size
    sheet.box(x - side, y - side, 2.0 * side, 2.0 * side, _PAPER, _VEIL)
    count = 4 * round(2.0 * side)
    across, up = np.meshgrid((np.arange(count) + 0.5) / 4.0 - side, (np.arange(count) + 0.5) / 4.0 - side)
    along, aside = across * math.cos(angle) + up * math.sin(angle), up * math.cos(angle) - across * math.sin(angle)
    tip, tail = 0.75 * size, -1.45 * size
    inside = (along < tip) & (along > tail) & (np.abs(aside) < 0.55 * size * (tip - along) / (tip - tail))
    cover = inside.reshape(count // 4, 4, count // 4, 4).mean((1, 3), dtype=np.float32)
    sheet.blend(round(x - side), round(y - side), cover, _INK)
    letter = line("N", size)
    place = 1.25 * size
    sheet.blend(round(x + place * math.cos(angle) - 0.5 * letter.shape[1]), round(y + place * math.sin(angle) - 0.5 * letter.shape[0]), letter, _INK)
