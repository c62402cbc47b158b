# SPDX-License-Identifier: GPL-3.0-or-later
"""What the artist did with single points of a linked cloud: which are selected, hidden and deleted; and with the scans of any: which are
hidden, and how their colors are graded.

Three bits a point, in file order, packed into a custom property of the object: so undo, saving, appending and render farms take them
along as anything else of an object, and no file can be lost. A scan of 30 million points takes some kilobytes to a few megabytes.
"""

from __future__ import annotations

import binascii
import hashlib
import struct
import threading
import weakref
import zlib
from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import bpy
import numpy as np

from ... import native
from ...description.points import EditState, Scan
from ...native import points
from ...native.points import Field, Grade, Mask
from . import node_colors

PROPERTY = "patina_points"  # of an object
PLANES = ("selected", "hidden", "deleted")
_MAGIC = b"PTP1"
_HEADER = struct.Struct("<4sQ16s")  # magic, points, digest of what follows
_LEVEL = 1  # of zlib: 30 million points in a tenth of a second, and runs are all there is
Handle = TypeVar("Handle", Mask, Grade, Field)

_KEPT = 4  # masks and grades of a cloud, and unpacked edits: those of the last undo steps come back at once

Bits = np.ndarray  # (count + 7) // 8 uint8, point i is bit i % 8 of byte i // 8
NEUTRAL: Scan = (1.0, 1.0, 1.0, 0.0)
MOST_BALANCED = 1 << 27  # points: balancing takes as much memory as colors do
ALL = -1  # the number of the one scan of a cloud that knows none


class Damaged(Exception):
    """The property does not hold what was written; the text is for the artist."""


@dataclass(frozen=True)
class Edits:
    """Of a cloud of `count` points. The planes are never written to."""

    count: int
    selected: Bits
    hidden: Bits
    deleted: Bits

    @cached_property
    def gone(self) -> Bits:
        """What is not drawn."""
        return self.hidden | self.deleted

    @cached_property
    def totals(self) -> dict[str, int]:
        return {name: _ones(getattr(self, name)) for name in PLANES}

    def packed(self) -> str:
        """In letters: from Blender 4.2 on bytes in a custom property end at the first zero."""
        body = zlib.compress(b"".join(getattr(self, name).tobytes() for name in PLANES), _LEVEL)
        return binascii.b2a_base64(_HEADER.pack(_MAGIC, self.count, _digest(self.count, body)) + body, newline=False).decode()


def none(count: int) -> Edits:
    return Edits(count, *(np.zeros((count + 7) // 8, np.uint8) for _ in PLANES))


def every(count: int) -> Bits:
    """All points, and no bit behind them."""
    bits = np.full((count + 7) // 8, 255, np.uint8)
    if count % 8:
        bits[-1] = (1 << count % 8) - 1
    return bits


def of_flags(flags: np.ndarray) -> Bits:
    """(count,) bool → bits."""
    return np.packbits(flags, bitorder='little')


def flags(bits: Bits, count: int) -> np.ndarray:
    """(count,) bool."""
    return np.unpackbits(bits, count=count, bitorder='little').view(bool)


def _ones(bits: Bits) -> int:
    return int(_ONES[bits].sum(dtype=np.int64))


_ONES = np.array([bin(value).count("1") for value in range(256)], np.uint8)


def _digest(count: int, body: bytes) -> bytes:
    return hashlib.blake2b(struct.pack("<Q", count) + body, digest_size=16).digest()


# ---- the property ----------------------------------------------------------------------------------------------------


def packed_of(obj: bpy.types.Object) -> str:
    """What the property holds; "": nothing."""
    value = obj.get(PROPERTY, "")
    return value if isinstance(value, str) else "?"


def state_of(obj: bpy.types.Object) -> EditState:
    """Of an object with points, evaluated or not."""
    group = obj.patina.points
    grades = tuple((number_of(item), graded) for item in group.scans if (graded := grade_of_item(item)) != NEUTRAL)
    solo = any(item.solo for item in group.scans)
    hidden = tuple(number_of(item) for item in group.scans if item.hide or solo and not item.solo)
    balanced = group.use_balance and obj.patina.colors.source == 'OWN' and not node_colors.used(obj)
    return EditState(packed_of(obj) if obj.patina.linked_file else "", grades, hidden, balanced, not group.use_lent_colors or node_colors.used(obj))


def number_of(item: bpy.types.PropertyGroup) -> int:
    """Of a listed scan; ALL of all points. Lists of older files have names alone."""
    last = item.name.rpartition(" ")[2]
    return item.number if item.number >= 0 or not last.isdigit() else int(last)


def grade_of_item(item: bpy.types.PropertyGroup) -> Scan:
    return (item.gain, item.gamma, item.saturation, item.temperature)


def unpacked(packed: str) -> Edits | None:
    """None where there are none. Damaged."""
    if not packed:
        return None
    with _lock:
        if packed in _unpacked:  # to the last letter
            _unpacked.move_to_end(packed)
            return _unpacked[packed]
    found = _unpack(packed)
    with _lock:
        _unpacked[packed] = found
        while len(_unpacked) > 2 * _KEPT:
            _unpacked.popitem(last=False)
    return found


def _unpack(packed: str) -> Edits:
    try:
        data = binascii.a2b_base64(packed.encode())
    except (binascii.Error, UnicodeEncodeError):
        data = b""
    if len(data) < _HEADER.size or data[:4] != _MAGIC:
        raise Damaged("its hidden and selected points are damaged")
    _, count, digest = _HEADER.unpack_from(data)
    body, size = data[_HEADER.size:], (count + 7) // 8
    if digest != _digest(count, body):
        raise Damaged("its hidden and selected points are damaged")
    try:
        reader = zlib.decompressobj()
        data = reader.decompress(body, 3 * size + 1)  # a lying count takes no more memory than it says
    except (zlib.error, OverflowError, MemoryError):
        raise Damaged("its hidden and selected points are damaged") from None
    if len(data) != 3 * size:
        raise Damaged("its hidden and selected points are damaged")
    planes = np.frombuffer(data, np.uint8).reshape(3, size) if size else np.zeros((3, 0), np.uint8)
    return Edits(count, *planes)


def for_cloud(packed: str, count: int) -> Edits | None:
    """The edits of a cloud of so many points; None where there are none. Damaged where they are of another one."""
    found = unpacked(packed)
    if found and found.count != count:
        raise Damaged(f"its hidden and selected points are of a file of {found.count:,} points, and this one has {count:,}")
    return found


def notice(name: str, state: EditState, cloud: native.Cloud) -> str:
    """What is wrong with an object's edits, for the artist; then the cloud is shown whole."""
    if cloud.stream and state:
        return f"'{name}': its points are read as needed, and neither hidden nor graded: Linked File > Read Whole does that"
    try:
        for_cloud(state.packed, cloud.count)
    except Damaged as damaged:
        return f"'{name}': {damaged}: all are shown. Forget All Edits in the sidebar, Patina > Points of the Scan, ends this message"
    return ""


# ---- the library's handles -------------------------------------------------------------------------------------------

_lock = threading.Lock()
_unpacked: OrderedDict[str, Edits] = OrderedDict()
_handles: weakref.WeakKeyDictionary[native.Cloud, dict[tuple, Mask | Grade | Field]] = weakref.WeakKeyDictionary()
_scans: weakref.WeakKeyDictionary[native.Cloud, np.ndarray | None] = weakref.WeakKeyDictionary()
_gains: weakref.WeakKeyDictionary[native.Cloud, tuple[tuple, np.ndarray]] = weakref.WeakKeyDictionary()


def mask_of(cloud: native.Cloud, state: EditState) -> Mask | None:
    """Any thread."""
    if cloud.stream:  # a notice has said so
        return None
    found = _readable(state, cloud.count)
    scans = scans_of(cloud) if any(number in state.hidden for number in cloud.scan_numbers) else None
    everything = ALL in state.hidden and not cloud.scan_numbers
    if not found and scans is None and not everything:
        return None

    def make() -> Mask:
        return Mask(cloud, gone_of(state, cloud.count, cloud.scan_numbers, scans), found.selected if found else None)

    return keep(cloud, ("mask", state.packed, state.hidden, cloud.scan_stamp), make)


def _readable(state: EditState, count: int) -> Edits | None:
    """None if there are none, or if they are damaged."""
    try:
        return for_cloud(state.packed, count)
    except Damaged:
        return None


def gone_of(state: EditState, count: int, numbers: Sequence[int], scans: np.ndarray | None) -> Bits | None:
    """The points of a cloud that are hidden or deleted; None: none. numbers: of its scans. scans: (count,) which of these each point is
    of, or None."""
    found = _readable(state, count)
    gone = found.gone if found else None
    hidden = [number in state.hidden for number in numbers]
    if ALL in state.hidden and not numbers:
        return every(count)
    if any(hidden) and scans is not None:
        bits = of_flags(np.array(hidden)[scans])
        gone = bits if gone is None else gone | bits
    return gone


def has_selection(cloud: native.Cloud, state: EditState) -> bool:
    found = _readable(state, cloud.count)
    return found is not None and found.totals["selected"] > 0


def grade_of(cloud: native.Cloud, state: EditState) -> Grade | None:
    """Any thread. None where there is nothing to grade."""
    balanced = state.balanced and 1 < len(cloud.scan_numbers) and cloud.count <= MOST_BALANCED
    keeps_black = state.keeps_black and cloud.uncolored > 0
    if not (state.grades or balanced or keeps_black) or not cloud.has_colors or cloud.stream:
        return None
    scans, known = scans_of(cloud), dict(state.grades)
    if cloud.scan_file and scans is None and not keeps_black:
        return None
    grades = [known.get(number, NEUTRAL) for number in cloud.scan_numbers] if scans is not None else [known.get(ALL, NEUTRAL)]
    gains = gains_of(cloud) if balanced and scans is not None else np.ones((len(grades), 3), np.float32)
    if all(grade == NEUTRAL for grade in grades) and (gains == 1.0).all() and not keeps_black:
        return None
    return keep(cloud, ("grade", tuple(grades), gains.tobytes(), keeps_black, *_state_of(cloud)),
                lambda: Grade(cloud, scans, grades, gains, keeps_black))


def _state_of(cloud: native.Cloud) -> tuple:
    """What grades and gains follow from: an analysis gives points colors, and leaves out points that are not trusted."""
    return cloud.scan_stamp, cloud.color_stamp, cloud.has_shapes


def gains_of(cloud: native.Cloud) -> np.ndarray:
    """(scans, 3): what multiplies the light of each so that scans agree where they overlap. Any thread. A second for a large cloud, once."""
    with _lock:
        stamp, gains = _gains.get(cloud, (None, None))
    if stamp != _state_of(cloud):
        stamp, gains = _state_of(cloud), points.gains(cloud, scans_of(cloud), len(cloud.scan_numbers))
        with _lock:
            _gains[cloud] = (stamp, gains)
    return gains


def scans_of(cloud: native.Cloud) -> np.ndarray | None:
    """(count,) uint16, which of its scans each point of a cloud is of; None where that is not known, or there is one."""
    if cloud.scan_of is not None:
        return cloud.scan_of
    with _lock:
        if cloud in _scans:
            return _scans[cloud]
    try:
        found = np.fromfile(cloud.scan_file, np.uint16) if cloud.scan_file else None
    except OSError:
        found = None
    if found is not None and len(found) != cloud.count:
        found = None
    with _lock:
        _scans[cloud] = found
    return found


def keep(cloud: native.Cloud, key: tuple, make: Callable[[], Handle]) -> Handle:
    """The one that is there, or a new one in place of the oldest of its kind."""
    with _lock:
        known = _handles.setdefault(cloud, {})
        if key in known:
            return known[key]
    made = make()
    with _lock:
        known[key] = made
        same = [other for other in known if other[0] == key[0]]
        for other in same[:-_KEPT if key[0] == "mask" else -1]:
            del known[other]
    return made
