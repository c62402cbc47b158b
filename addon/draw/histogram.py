# SPDX-License-Identifier: GPL-3.0-or-later
"""Histograms of the numbers by which points are soft, and of their trust, with the threshold in them.

Pictures tell which fields and clouds they were made with; the library counts a field's numbers and levels of trust as it makes them, so
that a panel's histogram costs nothing, however many points there are. Blender has no widget for one: it is painted into an icon, by a timer and never while a
panel draws, when the field or what the panel says of it has changed."""

from __future__ import annotations

import threading
import weakref
from collections.abc import Callable
from dataclasses import dataclass

import bpy
import bpy.utils.previews
import numpy as np

from .. import native
from ..description.points import Soft
from ..native.points import Field
from ..sync.analyses import trust
from ..sync.points.colors import class_bits

SIZE, WIDE = 256, 4  # pixels a side; of a bar, which is of as many bins: one of painted points, all at 0 or 1, is to be seen
_PAPER, _HARD, _SOFT, _LEADS, _LINE, _LEFT_OUT = ((*color, 1.0) for color in (
    (0.11, 0.11, 0.11), (0.55, 0.55, 0.55), (0.33, 0.62, 0.95), (0.16, 0.20, 0.26), (1.0, 0.72, 0.25), (0.85, 0.36, 0.30)))


@dataclass(frozen=True)
class Known:
    """Of the field that an object was drawn with last."""

    soft: Soft
    field: weakref.ref[Field]
    counts: np.ndarray  # (256,) points
    range: tuple[float, float]  # numbers that are 0 and 1
    stamp: int

    def share(self, threshold: float) -> float:
        """Of the points that are soft, to a 256th of the range."""
        above = np.arange(len(self.counts)) + 0.5 > threshold * len(self.counts)
        return float(self.counts[above].sum() / max(self.counts.sum(), 1))

    def number(self, value: float) -> float:
        """What of the field's own numbers is so much of 0 to 1."""
        return self.range[0] + value * (self.range[1] - self.range[0])


@dataclass(frozen=True)
class Trusts:
    """Of the trust of the points that an object was drawn with last."""

    cloud: weakref.ref[native.Cloud]
    counts: np.ndarray  # (16,) points of each level
    stamp: int


Key = tuple[float, ...]  # what a picture is of
Paint = Callable[[], np.ndarray]

_known: dict[str, Known] = {}  # by the objects' names
_trusts: dict[str, Trusts] = {}  # likewise
_asked: set[str] = set()  # whose histograms panels have shown, or would have
_wanted: dict[str, tuple[Key, Paint]] = {}  # by the pictures' titles
_painted: dict[str, Key] = {}
_previews: bpy.utils.previews.ImagePreviewCollection | None = None
_stamps = 0


def note(name: str, soft: Soft, field: Field | None) -> None:
    """A picture draws an object's points by this field; None: all are soft."""
    global _stamps
    if field is None:
        _known.pop(name, None)
    elif name not in _known or _known[name].field() is not field or _known[name].soft != soft:
        _stamps += 1
        _known[name] = Known(soft, weakref.ref(field), field.histogram, field.range, _stamps)
        if name in _asked and threading.current_thread() is threading.main_thread():
            _wake()


def of(obj: bpy.types.Object) -> Known | None:
    """None where no picture has shown the points by what the panel says."""
    _asked.add(obj.name)
    found, group = _known.get(obj.name), obj.patina.soft
    if found is None or found.soft.by != group.by or group.by == 'ATTRIBUTE' and found.soft.name != group.attribute:
        return None
    said = dict(found.soft.desc)
    same = (said["invert"] == group.invert
            and said.get("range") == ((group.range_min, group.range_max) if group.use_range else None)
            and (group.by != 'CLASSES' or said["classes"] == class_bits(group.classes)))
    return found if same else None


def icon(obj: bpy.types.Object, known: Known) -> int:
    """Blender's number of the last picture of it; 0: none yet. A newer one is on its way where one is needed."""
    group = obj.patina.soft
    threshold, transition = group.threshold, group.transition
    return _icon(_title(obj.name), (known.stamp, threshold, transition), lambda: picture(known.counts, threshold, transition))


def _icon(title: str, key: Key, make: Paint) -> int:
    if _painted.get(title) != key:
        _wanted[title] = (key, make)
        _wake()
    found = _previews.get(title) if _previews and title in _painted else None
    return found.icon_id if found else 0


# ---- trust -------------------------------------------------------------------------------------------------------------


def note_trust(name: str, cloud: native.Cloud) -> None:
    """A picture draws an object's points with this cloud."""
    global _stamps
    known = _trusts.get(name)
    if not cloud.has_shapes:
        _trusts.pop(name, None)
    elif known is None or known.cloud() is not cloud or tuple(known.counts) != cloud.trusts:
        _stamps += 1
        _trusts[name] = Trusts(weakref.ref(cloud), np.array(cloud.trusts, np.int64), _stamps)
        if name in _asked and threading.current_thread() is threading.main_thread():
            _wake()


def trust_of(obj: bpy.types.Object) -> Trusts | None:
    """None where no picture has shown the object's points analyzed."""
    _asked.add(obj.name)
    found = _trusts.get(obj.name)
    return found if found and found.cloud() else None


def automatic_trust(name: str) -> float:
    """The threshold that Patina chooses for an object, as far as a picture has told it."""
    found = _trusts.get(name)
    cloud = found.cloud() if found else None
    return cloud.trust_default if cloud else trust.DEFAULT


def trust_icon(obj: bpy.types.Object, known: Trusts, level: int) -> int:
    """As icon(). level: the first that is drawn."""
    return _icon(_trust_title(obj.name), (known.stamp, level), lambda: trust_picture(known.counts, level))


def trust_picture(counts: np.ndarray, level: int) -> np.ndarray:
    """As picture(): a bar for each level of trust, the lowest left. Points of levels before the line are left out."""
    wide = SIZE // trust.LEVELS
    heights = np.sqrt(counts / max(counts.max(), 1)) * (SIZE - 8)
    heights = np.where(counts > 0, np.maximum(heights, 2.0), 0.0).repeat(wide)
    column = np.arange(SIZE)
    pixels = np.empty((SIZE, SIZE, 4), np.float32)
    pixels[:] = _PAPER
    bars = (np.arange(SIZE)[:, None] < heights[None, :]) & (column % wide < wide - 1)[None, :]
    pixels[:] = np.where(bars[..., None], np.where((column >= level * wide)[None, :, None], _SOFT, _LEFT_OUT), pixels)
    pixels[:, max(level * wide - 1, 0):level * wide + 1] = _LINE
    return pixels


def _trust_title(name: str) -> str:
    return f"trust {name}"


# ---- pictures ----------------------------------------------------------------------------------------------------------


def picture(counts: np.ndarray, threshold: float, transition: float) -> np.ndarray:
    """(SIZE, SIZE, 4) float32, sRGB, the lowest row first. Heights are square roots, so that few points among many are seen."""
    counts = counts.reshape(-1, WIDE).sum(1).repeat(WIDE)
    heights = np.sqrt(counts / max(counts.max(), 1)) * (SIZE - 8)
    column = np.arange(SIZE)
    value = (column + 0.5) / SIZE
    leads = (value > threshold) & (value < threshold + transition)
    pixels = np.empty((SIZE, SIZE, 4), np.float32)
    pixels[:] = np.where(leads[None, :, None], _LEADS, _PAPER)
    bars = np.arange(SIZE)[:, None] < np.where(counts > 0, np.maximum(heights, 2.0), 0.0)[None, :]
    pixels[:] = np.where(bars[..., None], np.where((value > threshold)[None, :, None], _SOFT, _HARD), pixels)
    line = min(int(threshold * SIZE), SIZE - 1)
    pixels[:, max(line - 1, 0):line + 1] = _LINE
    return pixels


def paint() -> bool:
    """Paints what panels have asked for. Whether there was something."""
    global _previews
    wanted = dict(_wanted)
    _wanted.clear()
    for title, (key, make) in wanted.items():
        if _previews is None:
            _previews = bpy.utils.previews.new()
        found = _previews.get(title) or _previews.new(title)
        found.image_size = (SIZE, SIZE)
        found.image_pixels_float.foreach_set(make().reshape(-1))
        _painted[title] = key
    return bool(wanted)


def _title(name: str) -> str:
    return f"soft {name}"


def pixels(obj: bpy.types.Object, title: Callable[[str], str] = _title) -> np.ndarray:
    """What the icon shows, as picture() gives it; of trust with _trust_title."""
    found = np.empty(SIZE * SIZE * 4, np.float32)
    _previews[title(obj.name)].image_pixels_float.foreach_get(found)
    return found.reshape(SIZE, SIZE, 4)


def _tick() -> None:
    """Panels are drawn anew: one whose object is known by another field asks for its picture then."""
    paint()
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == 'PROPERTIES':
                area.tag_redraw()


def _wake() -> None:
    if not bpy.app.background and not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick)


def forget() -> None:
    global _previews
    for kept in (_known, _trusts, _asked, _wanted, _painted):
        kept.clear()
    if _previews is not None:
        bpy.utils.previews.remove(_previews)
        _previews = None
