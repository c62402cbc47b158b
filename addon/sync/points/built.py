# SPDX-License-Identifier: GPL-3.0-or-later
"""Clouds in the library, built once and kept while their content stays."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator

import numpy as np

from ... import native
from ...jobs import Steps
from ...read.importers import Progress
from ..analyses.analyzing import ANALYSES
from . import linked
from .content import PointArrays

# Clouds that the last picture did not use may stay up to this many bytes (24 a point): enough for the other view
# layers and scenes of a session, little beside what Blender itself holds for the same points.
IDLE_BYTES = 1 << 30


class Pending:
    """Points that were read and wait to be made a cloud of. Shared by descriptions of one viewport."""

    def __init__(self, name: str, identity: tuple, arrays: PointArrays | None) -> None:
        self.name = name
        self._identity = identity
        self._arrays: PointArrays | None = arrays
        self._cloud: native.Cloud | None = None
        self.analyzed = arrays is not None and arrays.analyzed  # in time; a linked one is before it is seen
        self.stations = arrays.stations if arrays else None

        self.lost = ""  # why there will be no cloud, or that of an earlier file

    @property
    def built(self) -> native.Cloud | None:
        return self._cloud

    def resolve(self, progress: native.Progress) -> Steps[native.Cloud | None]:
        """The cloud; built at the first call. No viewport may draw meanwhile. None where it is lost."""
        if self._cloud is None:
            self._cloud = yield from CACHE.obtain(self._identity, self._arrays, progress, recolor=True)
            self._arrays = None
        return self._cloud


class PendingLink(Pending):
    """A linked cloud that waits to be opened."""

    def __init__(self, name: str, source: linked.Source) -> None:
        super().__init__(name, source.identity(), None)
        self._source = source

    def forget(self, identities: list[tuple]) -> bool:
        """Lets its cloud go, where it is one of these."""
        if self._identity in identities:
            self._cloud, self.lost = None, ""
        return self._identity in identities

    def resolve(self, progress: native.Progress) -> Steps[native.Cloud | None]:
        if self._cloud is None and not self.lost:
            self._cloud, self.lost = yield from CACHE.obtain_readable(self.name, self._source, Progress(progress))
        return self._cloud


class CloudCache:
    """Clouds by the identity of the data they were built from. A scene that uses a cloud keeps it alive itself.
    For any thread; none waits for another one's building."""

    def __init__(self) -> None:
        self._entries: dict[tuple, tuple[tuple[int, ...], native.Cloud]] = {}  # least recently used first
        self._lock = threading.Lock()
        self._finals = 0

    @contextlib.contextmanager
    def final_render(self) -> Iterator[None]:
        """While one runs, clouds that it may have taken keep their colours."""
        with self._lock:
            self._finals += 1
        try:
            yield
        finally:
            with self._lock:
                self._finals -= 1

    def final(self) -> bool:
        return self._finals > 0

    def obtain(self, identity: tuple, arrays: PointArrays, progress: native.Progress | None = None,
               recolor: bool = False) -> Steps[native.Cloud]:
        """The cloud of these points: the one that is there, that one with new colours (recolor), or a new one."""
        fingerprint = yield from arrays.fingerprint()
        with self._lock:
            known, cloud = self._entries.pop(identity, ((), None))
            if fingerprint == known:
                self._entries[identity] = (known, cloud)
                _set_numbers(cloud, arrays)
                return cloud
            recolor = recolor and not self._finals and known[:1] == fingerprint[:1] and cloud not in ANALYSES
        if recolor:  # out of the cache: nobody takes it meanwhile
            task = cloud.start_colors(arrays.colors)
        else:
            cloud = None  # frees the old one before the new one is built
            task = native.Cloud.start(arrays.positions, arrays.normals, arrays.colors, arrays.opacities, progress, arrays.radii,
                                      arrays.scalars, arrays.classes)
        yield task
        cloud = task.result() or cloud
        if recolor:
            cloud.set_scalars(arrays.scalars)
            cloud.color_stamp += 1
        _set_numbers(cloud, arrays)
        self._keep(identity, fingerprint, cloud)
        return cloud

    def obtain_linked(self, source: linked.Source, progress: Progress) -> Steps[native.Cloud]:
        """The cloud of a linked file as it is now. One that is mapped is opened again once a picture lacked points of some file."""
        with self._lock:
            known, cloud = self._entries.pop(source.identity(), ((), None))
            if cloud and cloud.losses in (None, native.losses()):
                self._entries[source.identity()] = (known, cloud)
                return cloud
        cloud = (yield from linked.steps(source, progress)).cloud
        self._keep(source.identity(), (), cloud)
        return cloud

    def keep_streamed(self, source: linked.Source, cloud: native.Cloud) -> None:
        """Of a file that was opened just now, and is read as pictures want it: its head need not be read again."""
        if source.streamed:
            self._keep(source.identity(), (), cloud)

    def obtain_readable(self, name: str, source: linked.Source, progress: Progress) -> Steps[tuple[native.Cloud | None, str]]:
        """The same; where the file cannot be read that of the last one before it in its sequence that can, or None; and what to say."""
        failed: Exception | None = None
        shown: linked.Source | None = source
        while shown:
            try:
                cloud = yield from self.obtain_linked(shown, progress)
                return cloud, linked.loss(name, source, failed, shown) if failed else ""
            except (native.PatinaError, OSError) as error:
                said = linked.loss(name, source, failed or error)  # raises what is not the file's fault
                failed = failed or error
                shown = linked.before(shown)
        return None, said

    def drop(self, identities: list[tuple]) -> None:
        """Clouds that are no longer what they were built from."""
        with self._lock:
            for identity in identities:
                self._entries.pop(identity, None)

    def _keep(self, identity: tuple, fingerprint: tuple, cloud: native.Cloud) -> None:
        with self._lock:
            self._entries[identity] = (fingerprint, cloud)

    def trim(self, used: set[tuple]) -> None:
        with self._lock:
            idle = {identity: cloud.footprint for identity, (_, cloud) in self._entries.items() if identity not in used}
            total = sum(idle.values())
            for identity, size in idle.items():
                if total <= IDLE_BYTES:
                    break
                del self._entries[identity]
                total -= size

    def clear(self) -> None:
        with self._lock:
            self._entries.clear()

    def __len__(self) -> int:
        return len(self._entries)


def _set_numbers(cloud: native.Cloud, arrays: PointArrays) -> None:
    """Where they changed: fields are kept by their stamp."""
    if (arrays.numbers is None) != (cloud.numbers is None) or arrays.numbers is not None and not np.array_equal(arrays.numbers, cloud.numbers, equal_nan=True):
        cloud.numbers = arrays.numbers
        cloud.numbers_stamp += 1
    if arrays.scan_of is None and cloud.scan_of is None or (
            arrays.scans and cloud.scan_numbers == arrays.scans.numbers and np.array_equal(arrays.scan_of, cloud.scan_of)):
        return
    cloud.scan_of, cloud.scan_stamp = arrays.scan_of, cloud.scan_stamp + 1
    cloud.scan_name, cloud.scan_numbers = (arrays.scans.name, arrays.scans.numbers) if arrays.scans else ("", ())


CACHE = CloudCache()
