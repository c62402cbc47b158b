# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes files at random: bytes, numbers of a text, parts of JSON. The same seed gives the same changes."""

from __future__ import annotations

import copy
import json
import random
import re
import struct
from typing import Any

NUMBERS = (0, 1, -1, 2, 7, 255, 256, 65535, 65536, 2 ** 31 - 1, 2 ** 31, -2 ** 31, 2 ** 32 - 1, 2 ** 32, 2 ** 53, 2 ** 63 - 1, -2 ** 63, 2 ** 64 - 1)
FLOATS = (0.0, -0.0, 1.0, -1.0, 1e-310, 1e-30, 1e30, 3.5e38, 1e308, -1e308, float("inf"), float("-inf"), float("nan"))
WORDS = ("", "0", "-1", "1e9", "1e999", "nan", "inf", "-inf", "0x10", "9" * 30, "9" * 5000, "1_000", "1,5", "\u0661", "\u202e", "\0", "\x1b[31m", "a" * 3000,
         "../../x", "/", "true", "%s%n", "\ud800".encode("utf-8", "surrogatepass").decode("latin-1"))
VALUES = (None, True, False, 0, -1, 1, 2 ** 31, 2 ** 63, 2 ** 70, 10 ** 400, 1e308, -1e308, 0.5, float("nan"), float("inf"), "", "x", "x" * 3000, "\ud800", "\0", "#12",
          "#gggggg", "../../x", "/dev/zero", [], [[]], [0], [1, 2, 3], [None] * 3, ["x"] * 4, {}, {"x": 1}, [float("nan")] * 3)
_NUMBER = re.compile(rb"[-+]?[0-9]+(?:\.[0-9]*)?(?:[eE][-+]?[0-9]+)?")


def change(data: bytes, chance: random.Random, others: list[bytes], text: bool = False, head: int = 0) -> bytes:
    """data with a few changes. others: of which pieces are taken; head: bytes at the beginning that are changed as often as all others."""
    out = bytearray(data)
    for _ in range(chance.choice((1, 1, 1, 2, 3, 5))):
        if text and chance.random() < 0.7:
            out = bytearray(_in_text(bytes(out), chance))
        else:
            _in_bytes(out, chance, others, head)
    return bytes(out[:1 << 20])


def _in_bytes(out: bytearray, chance: random.Random, others: list[bytes], head: int) -> None:
    size = len(out)
    at = chance.randrange(max(1, min(size, head) if head and chance.random() < 0.5 else size))
    how = chance.randrange(8)
    if how == 0 and size:
        out[at] ^= 1 << chance.randrange(8)
    elif how == 1 and size:
        out[at] = chance.choice((0, 1, 127, 128, 255, chance.randrange(256)))
    elif how in (2, 3):
        kind = chance.choice(("<B", "<H", "<I", "<I", "<Q", "<f", "<d", ">I"))
        if kind in ("<f", "<d"):
            value = chance.choice(FLOATS)
            value = struct.pack("<d", value) if kind == "<d" else struct.pack("<f", min(max(value, -3e38), 3e38) if abs(value) < 1e309 else value)
        else:
            bits = 8 * struct.calcsize(kind)
            value = struct.pack(kind, chance.choice((*NUMBERS, size, size - at, at)) % (1 << bits))
        out[at:at + len(value)] = value
    elif how == 4:
        del out[at:at + chance.choice((1, 2, 4, 16, 100, size))]
    elif how == 5:
        piece = out[at:at + chance.choice((1, 4, 16, 200))]
        out[at:at] = piece * chance.choice((1, 2, 50))
    elif how == 6 and others:
        other = chance.choice(others)
        start = chance.randrange(max(1, len(other)))
        out[at:at + chance.choice((0, 4, 64))] = other[start:start + chance.choice((4, 64, 4096))]
    else:
        out[at:at] = bytes(chance.randrange(256) for _ in range(chance.choice((1, 2, 4, 8))))


def _in_text(data: bytes, chance: random.Random) -> bytes:
    how = chance.randrange(5)
    if how == 0:
        found = list(_NUMBER.finditer(data[:100_000]))
        if found:
            place = chance.choice(found)
            word = str(chance.choice((*NUMBERS, *FLOATS))) if chance.random() < 0.6 else chance.choice(WORDS)
            return data[:place.start()] + word.encode("utf-8", "replace") + data[place.end():]
    lines = data.split(b"\n")
    at = chance.randrange(len(lines))
    if how == 1:
        del lines[at]
    elif how == 2:
        lines[at:at] = [lines[chance.randrange(len(lines))]] * chance.choice((1, 2, 300))
    elif how == 3:
        words = lines[at].split(b" ")
        words[chance.randrange(len(words))] = chance.choice((*WORDS, *map(str, NUMBERS))).encode("utf-8", "replace")
        lines[at] = b" ".join(words)
    elif chance.random() < 0.2:
        lines[at] = lines[at].replace(b"1", b"9" * 5000, 1)  # more digits than Python reads
    else:
        other = chance.randrange(len(lines))
        lines[at], lines[other] = lines[other], lines[at]
    return b"\n".join(lines)


def change_json(value: Any, chance: random.Random) -> Any:
    """A copy in which a few parts are other ones, are missing, or are there under another name."""
    found = copy.deepcopy(value)
    for _ in range(chance.choice((1, 1, 2, 3))):
        found = _in_json(found, chance)
    return found


def _in_json(value: Any, chance: random.Random) -> Any:
    if not isinstance(value, (dict, list)) or not value or chance.random() < 0.05:
        return copy.deepcopy(chance.choice(VALUES))
    keys = list(value) if isinstance(value, dict) else range(len(value))
    key = chance.choice(keys)
    how = chance.random()
    if how < 0.1:
        del value[key]
    elif how < 0.2 and isinstance(value, dict):
        value[chance.choice(("x", "", "\0", *map(str, keys)))] = copy.deepcopy(value[key])
    elif isinstance(value[key], (dict, list)) and value[key] and how < 0.8:
        value[key] = _in_json(value[key], chance)
    else:
        value[key] = copy.deepcopy(chance.choice(VALUES))
    return value


def json_change(data: bytes, chance: random.Random, others: list[bytes]) -> bytes:
    """A text of JSON with changed values, which is now and then damaged too; any other text with a few changes."""
    try:
        text = json.dumps(change_json(json.loads(data), chance)).encode("utf-8", "surrogatepass")
    except (ValueError, RecursionError):
        return change(data, chance, others, text=True)
    return change(text, chance, others, text=True) if chance.random() < 0.15 else text
