# SPDX-License-Identifier: GPL-3.0-or-later
"""Gradient noise as Blender's textures use it, for arrays of places.

Ken Perlin, "Improving Noise" (2002), with the quintic fade. The gradients are chosen by the final and mix steps of Bob Jenkins' hash
lookup3 (2006, public domain) over the cell's integer coordinates. Octaves are summed and scaled to 0 to 1.
"""

from __future__ import annotations

import numpy as np

Values = np.ndarray
_MOST_OCTAVES = 15
_HEIGHT = {1: 0.25, 2: 0.6616, 3: 0.9820, 4: 0.8344}  # by dimensions: scales the noise to about -1 to 1
# gradient choice by dimensions: bits of the hash that count, then for each summand the bit of its sign
_BITS = {2: (7, (1, 2)), 3: (15, (1, 2)), 4: (31, (1, 2, 4))}
# lookup3: (changed, other, rotation)
_FINAL = ((2, 1, 14), (0, 2, 11), (1, 0, 25), (2, 1, 16), (0, 2, 4), (1, 0, 14), (2, 1, 24))
_MIX = ((0, 2, 4, 1), (1, 0, 6, 2), (2, 1, 8, 0), (0, 2, 16, 1), (1, 0, 19, 2), (2, 1, 4, 0))  # and what grows by the other two's sum


def _rotated(word: Values, bits: int) -> Values:
    return word << np.uint32(bits) | word >> np.uint32(32 - bits)


def hashed(keys: list[Values]) -> Values:
    """uint32 of one to four uint32 arrays."""
    with np.errstate(over='ignore'):
        words = [np.zeros_like(keys[0]) + np.uint32((0xDEADBEEF + 4 * len(keys) + 13) & 0xFFFFFFFF) for _ in range(3)]
        for at, key in enumerate(keys[:3]):
            words[at] = words[at] + key
        if len(keys) == 4:
            for at, other, bits, grown in _MIX:
                words[at] = words[at] - words[other] ^ _rotated(words[other], bits)
                words[other] = words[other] + words[grown]
            words[0] = words[0] + keys[3]
        for at, other, bits in _FINAL:
            words[at] = (words[at] ^ words[other]) - _rotated(words[other], bits)
    return words[2]


def offset(seed: int, dimensions: int) -> Values:
    """(1, dimensions), 100 to 200: where the noise of a second component is read, so that it differs from the first."""
    keys = [np.float32([number]).view(np.uint32) for number in range(dimensions)]
    first = np.float32([seed]).view(np.uint32)
    if dimensions == 1:
        shares = [hashed([first])]
    else:
        shares = [hashed([first, key]) for key in keys]
    return np.float32(100) + np.stack(shares, 1).astype(np.float32) * np.float32(1 / 4294967295) * np.float32(100)


def _slope(key: Values, inner: list[Values]) -> Values:
    """The product of a cell corner's gradient with the distance from the corner."""
    if len(inner) == 1:
        size = (key & np.uint32(7)).astype(np.float32) + np.float32(1)
        return np.where(key & np.uint32(8), -size, size) * inner[0]
    mask, signs = _BITS[len(inner)]
    key = key & np.uint32(mask)
    if len(inner) == 2:
        x, y = inner
        low = key < 4
        parts = [np.where(low, x, y), np.float32(2) * np.where(low, y, x)]
    elif len(inner) == 3:
        x, y, z = inner
        parts = [np.where(key < 8, x, y), np.where(key < 4, y, np.where((key == 12) | (key == 14), x, z))]
    else:
        x, y, z, w = inner
        parts = [np.where(key < 24, x, y), np.where(key < 16, y, z), np.where(key < 8, z, w)]
    return sum(np.where(key & np.uint32(bit), -part, part) for bit, part in zip(signs, parts, strict=True))


def noise(places: Values) -> Values:
    """(n, 1) float32 of places (n, 1 to 4): about -1 to 1."""
    places = np.clip(np.nan_to_num(places), -2e9, 2e9).astype(np.float32)
    cells = np.floor(places)
    inner = places - cells
    cells = cells.astype(np.int64).astype(np.uint32)
    fade = inner * inner * inner * (inner * (inner * 6 - 15) + 10)
    dimensions = places.shape[1]
    corners = []
    for corner in range(1 << dimensions):
        steps = [corner >> axis & 1 for axis in range(dimensions)]
        key = hashed([cells[:, axis] + np.uint32(step) for axis, step in enumerate(steps)])
        corners.append(_slope(key, [inner[:, axis] - np.float32(step) for axis, step in enumerate(steps)]))
    for axis in range(dimensions):
        corners = [a + fade[:, axis] * (b - a) for a, b in zip(corners[::2], corners[1::2], strict=True)]
    return (corners[0] * np.float32(_HEIGHT[dimensions]))[:, None].astype(np.float32)


def octaves(places: Values, detail: Values, roughness: Values, lacunarity: Values | float = 2.0, normalized: bool = True) -> Values:
    """(n, 1): detail + 1 octaves of noise, the last one in part. Each is lacunarity times finer and roughness times as high as the one
    before. normalized: 0 to 1, else about 0."""
    detail = np.clip(np.nan_to_num(detail), 0, _MOST_OCTAVES)
    total, most, height, found = np.float32(0), np.float32(0), np.float32(1), np.float32(0)
    for step in range(int(np.ceil(detail.max())) + 1):
        total, most = total + noise(places) * height, most + height
        value = np.float32(0.5) * total / most + np.float32(0.5) if normalized else total
        found = found + np.clip(detail - (step - 1), 0, 1) * (value - found)
        height, places = height * roughness, places * np.float32(lacunarity)
    return found
