# SPDX-License-Identifier: GPL-3.0-or-later
"""A few points of each linked cloud: of a saved cloud read by native tasks beside Blender, of a file that is read as needed its coarsest
levels. A cloud that was not built yet has none: import or the first image builds it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np

from .. import jobs, native
from ..read.importers import Progress
from ..sync.analyses.scans_of import SCAN_ENDING
from ..sync.points import built, edits, kept, linked

TICK = 0.05  # seconds between two looks at the tasks

Points = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]  # positions, linear colors, normals (n, 3), scalars (n,); NaN: there are none


@dataclass(frozen=True)
class Place:
    """Where the points of an object are, and which of them are left out."""

    path: Path | None  # of a saved cloud; None: of a file that is read as needed
    offset: linked.Corner  # of positions
    source: linked.Source
    state: edits.EditState

    @property
    def key(self) -> tuple:
        return self.source.identity(), self.offset, self.state.packed, self.state.hidden


class _Streamed:
    """The coarsest points of a file that is read as needed. Has what is used of native.Task."""

    def __init__(self, source: linked.Source, most: int) -> None:
        self._steps: jobs.Steps[native.Cloud] | None = built.CACHE.obtain_linked(source, Progress())
        self._cloud: native.Cloud | None = None
        self._most = most

    def done(self) -> bool:
        """Goes on meanwhile. PatinaError where its head cannot be read."""
        if self._steps is not None:
            try:
                next(self._steps)
                return False
            except StopIteration as end:
                self._steps, self._cloud = None, end.value
        self._cloud.stream.advance()
        return self._cloud.stream.coarsest(self._most)

    def result(self) -> Points:
        return self._cloud.thinned(self._most)

    def close(self) -> None:
        if self._steps is not None:
            self._steps.close()


_tasks: dict[tuple, native.Task | _Streamed] = {}  # by what is read
_wake: list[Callable[[], None]] = []  # what to call once points have come


def place_of(obj: bpy.types.Object, frame: int) -> Place | None:
    """None: there is nothing to read, or not yet."""
    source = linked.source_of(obj, frame, [])
    if source is None:
        return None
    if source.streamed:
        return Place(None, linked.ZERO, source, edits.EditState())
    found = linked.saved_cloud(source)
    return Place(*found, source, edits.state_of(obj)) if found else None


def obtain(place: Place, most: int, arrived: Callable[[], None]) -> Points | None:
    """Up to so many points of a cloud, once they were read; none of a file that cannot be read. None: they are being read, and arrived()
    is called then."""
    key = (place.key, most)
    try:
        if key not in _tasks:
            _tasks[key] = native.Cloud.start_thinning(place.path, place.offset, most, _gone(place)) if place.path else _Streamed(place.source, most)
        if not _tasks[key].done():
            _wake[:] = [arrived]
            if not bpy.app.timers.is_registered(_look):
                bpy.app.timers.register(_look, first_interval=TICK, persistent=True)
            return None
        return _tasks.pop(key).result()
    except (native.PatinaError, OSError):  # the first image that wants the cloud says why
        _tasks.pop(key, None)
        if place.state.packed:  # which may be of another file; images show all of this one then
            return obtain(replace(place, state=replace(place.state, packed="")), most, arrived)
        empty = np.empty((0, 3))
        return empty, empty, empty, np.empty(0)


def _gone(place: Place) -> np.ndarray | None:
    """Bits of hidden and deleted points; None: there are none."""
    state = place.state
    if not state.packed and not state.hidden:
        return None
    numbers, scans = _scans(place.path)
    try:
        count = edits.unpacked(state.packed).count if state.packed else len(scans)
    except edits.Damaged:
        count = len(scans)
    return edits.gone_of(state, count, numbers, scans if len(scans) == count else None) if count else None


def _scans(path: Path) -> tuple[Sequence[int], np.ndarray]:
    """The numbers of a saved cloud's scans, and which of these each point is of; none if that is not known."""
    try:
        told = kept.read_notes(path.with_suffix(".json"))[3]
        scans = np.fromfile(path.with_suffix(SCAN_ENDING), np.uint16) if told else ()
    except (OSError, ValueError):
        return (), np.empty(0, np.uint16)
    return (told["numbers"], scans) if len(scans) and scans.max() < len(told["numbers"]) else ((), np.empty(0, np.uint16))


def _look() -> float | None:
    if not all([_has_ended(task) for task in _tasks.values()]):  # each goes on
        return TICK
    for arrived in _wake:
        arrived()
    _wake.clear()
    return None


def _has_ended(task: native.Task | _Streamed) -> bool:
    try:
        return task.done()
    except (native.PatinaError, OSError):
        return True  # which the next picture hears


def forget() -> None:
    """Waits for the tasks, which take milliseconds."""
    for task in _tasks.values():
        task.close()
    _tasks.clear()
    _wake.clear()
    if bpy.app.timers.is_registered(_look):
        bpy.app.timers.unregister(_look)
