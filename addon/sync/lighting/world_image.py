# SPDX-License-Identifier: GPL-3.0-or-later
"""Images of worlds: their pixels, scene-linear, looked up by direction as Cycles does."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import count

import bpy
import numpy as np

LIGHT_WIDTH = 512  # pixels of what lights: means of the finer ones, so that nothing small is missed
MISSING = np.array([[[1.0, 0.0, 1.0]]], np.float32)  # Blender's pink


@dataclass(frozen=True, eq=False)
class Image:
    name: str
    token: tuple  # equal tokens, equal pixels
    pixels: np.ndarray  # (height, width, 3) float32, row 0 at the bottom
    coarse: np.ndarray  # the same, LIGHT_WIDTH wide at most
    lost: bool = False

    def look(self, vectors: np.ndarray, ball: bool, closest: bool, fine: bool) -> np.ndarray:
        """(n, 3) of directions of any length; ball: a mirror ball's photograph, else all around."""
        return sample(self.pixels if fine else self.coarse, *(_ball if ball else around)(vectors), closest)


def around(vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places 0..1 in a picture all around: +x in its middle, -y at a quarter to the right of it, +z at the top. float32."""
    x, y, z = vectors[:, 0], vectors[:, 1], vectors[:, 2]
    level = np.sqrt(x * x + y * y)
    return (np.float32(0.5) - angle(y, x) * np.float32(0.5 / math.pi), angle(z, level) * np.float32(1.0 / math.pi) + np.float32(0.5))


def exact(function: Callable[..., np.ndarray]) -> Callable[..., np.ndarray]:
    """A function of float32 values by way of float64: numpy's own of float32 may round by where arrays lie in memory, and a tile
    would differ from the whole."""
    return lambda *values: function(*(value.astype(np.float64) for value in values)).astype(np.float32)


angle = exact(np.arctan2)


def _ball(vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    length = np.sqrt((vectors * vectors).sum(1, keepdims=True))
    x, y, z = (vectors / np.maximum(length, 1e-20)).T
    wide = 2.0 * np.sqrt(np.maximum(-0.5 * (y - 1.0), 1e-20))
    return 0.5 * (x / wide + 1.0), 0.5 * (z / wide + 1.0)


def sample(pixels: np.ndarray, u: np.ndarray, v: np.ndarray, closest: bool = False) -> np.ndarray:
    """Between the four pixels around, repeating both ways."""
    height, width = pixels.shape[:2]
    flat = pixels.reshape(-1, 3)
    x, y = u * np.float32(width), v * np.float32(height)
    if closest:
        return flat[np.floor(y).astype(np.int64) % height * width + np.floor(x).astype(np.int64) % width]
    x, y = x - np.float32(0.5), y - np.float32(0.5)
    left, low = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    s, t = (x - left).astype(np.float32)[:, None], (y - low).astype(np.float32)[:, None]
    x0, x1, y0, y1 = left % width, (left + 1) % width, low % height * width, (low + 1) % height * width
    below = flat[y0 + x0] * (1 - s) + flat[y0 + x1] * s
    above = flat[y1 + x0] * (1 - s) + flat[y1 + x1] * s
    return below * (1 - t) + above * t


_changes = count(1)
_known: dict[str, Image] = {}  # by name: the images of the last worlds


def forget(names: set[str] | None = None) -> None:
    """Images whose pixels changed; None: all."""
    for name in list(_known) if names is None else names:
        _known.pop(name, None)


def read_image(image: bpy.types.Image | None, user: bpy.types.ImageUser | None = None) -> Image:
    """An image's pixels as they are now. Kept until its file, size, or frame changes."""
    if image is None:
        return Image("", (), MISSING, MISSING, lost=True)
    image = image.original
    moving = image.source in {'SEQUENCE', 'MOVIE'}
    path = bpy.path.abspath(image.filepath, library=image.library) if image.source == 'FILE' else ""
    try:
        stamp = os.stat(path).st_mtime_ns if path and not image.packed_file else 0
    except OSError:
        stamp = 0
    token = (image.name_full, path, stamp, tuple(image.size), image.colorspace_settings.name, image.source,
             tuple(image.generated_color), image.generated_type, user.frame_current if moving and user else 0)
    known = _known.get(image.name_full)
    painted = image.is_dirty or moving  # then nothing but the pixels tells
    if known and known.token[:len(token)] == token and not painted:
        return known
    found = _read(image, token)
    if painted and known and np.array_equal(known.pixels, found.pixels):
        return known
    if painted:
        found = replace(found, token=(*token, next(_changes)))
    _known[image.name_full] = found
    return found


def _read(image: bpy.types.Image, token: tuple) -> Image:
    width, height = image.size
    values = np.empty(width * height * image.channels, np.float32)
    if not values.size or len(image.pixels) != values.size:
        return Image(image.name, token, MISSING, MISSING, lost=True)
    image.pixels.foreach_get(values)
    values = values.reshape(height, width, image.channels)
    pixels = np.ascontiguousarray(values[..., :3] if image.channels >= 3 else np.repeat(values[..., :1], 3, 2))
    if not image.is_float and not _is_data(image):  # bytes are as they are stored
        pixels = np.where(pixels <= 0.04045, pixels / np.float32(12.92), ((pixels + np.float32(0.055)) / np.float32(1.055)) ** 2.4)
    pixels = np.nan_to_num(pixels.astype(np.float32, copy=False), posinf=65504.0, neginf=0.0)
    return Image(image.name, token, pixels, _coarse(pixels))


def _is_data(image: bpy.types.Image) -> bool:
    settings = image.colorspace_settings
    return getattr(settings, "is_data", False) or settings.name in {'Linear', 'Raw', 'Non-Color', 'Linear Rec.709'}


def _coarse(pixels: np.ndarray) -> np.ndarray:
    step = max(pixels.shape[1] // LIGHT_WIDTH, 1)
    return pixels if step == 1 or pixels.shape[0] < step else means(pixels, step)


def means(pixels: np.ndarray, step: int) -> np.ndarray:
    """One pixel for step x step."""
    height, width = pixels.shape[:2]
    blocks = pixels[:height // step * step, :width // step * step]
    parts = blocks.reshape(height // step, step, width // step, step, 3)
    return np.ascontiguousarray(parts.mean((1, 3), dtype=np.float64), np.float32)
