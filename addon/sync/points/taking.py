# SPDX-License-Identifier: GPL-3.0-or-later
"""How images take the cloud of each object: a final one builds it now, a viewport when it draws."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace

import bpy

from ... import jobs, native
from ...read.importers import Progress
from ..analyses import analysis
from ..analyses.analyzing import ANALYSES
from ..objects import images, meshes
from . import linked, node_colors
from .built import CACHE, Pending, PendingLink
from .content import PointArrays, identity_of, radius_name, read

SMALL = 1 << 14  # points: fewer are worked on by one thread each, in the library too
AT_ONCE = 16  # small clouds
MOST_WAITING = 1 << 22  # points of small clouds that are held beside Blender's own

# What collect() asks for each object with points or faces: (object, identity, linked file, whether an analysis is needed) → its cloud or
# mesh, or None without.
Take = Callable[[bpy.types.Object, tuple, "linked.Source | None", bool], "native.Cloud | Pending | meshes.Faces | None"]


class TakingNow:
    """Of a final picture: builds each cloud, polling; content decides whether it is built anew. Large ones are built at once, each
    by all cores; small ones wait for settle(), where several are built beside each other: starting all cores for one takes
    longer than its work."""

    def __init__(self, poll: Callable[[str, float], bool], notices: list[str]) -> None:
        self._poll = poll
        self._notices = notices
        self._waiting: list[Soon] = []

    def __call__(self, obj: bpy.types.Object, identity: tuple, link: linked.Source | None, analyzed: bool
                 ) -> native.Cloud | Pending | meshes.Faces | None:
        name = obj.name
        progress = Progress()

        def stopped() -> bool:
            return self._poll(f"{progress.doing} of '{name}'", progress.value())

        def pause() -> None:
            if stopped():
                raise native.PatinaCancelled("cancelled", native.CANCELLED)

        if identity[-1] in {meshes.TRIANGLES, meshes.BARE}:
            pause()
            return meshes.CACHE.obtain(identity, obj)
        arrays = None if link else read(obj, self._notices, identity[0], identity[-1], pause)
        if arrays is None and link is None:
            return None
        if arrays and not analyzed:
            arrays = replace(arrays, analyzed=False)
        if arrays and len(arrays.positions) < SMALL:
            soon = Soon(name, identity, arrays, progress)
            self._waiting.append(soon)
            if sum(other.count for other in self._waiting) >= MOST_WAITING:
                self.settle()
            return soon

        def work() -> tuple[native.Cloud | None, str]:
            if link:
                return jobs.finish(CACHE.obtain_readable(name, link, progress))
            return _finished(identity, arrays, progress), ""

        cloud, lost = jobs.run(work, progress.cancel, stopped)
        if lost:
            self._notices.append(lost)
        if cloud is None:
            return None
        self._notice(name, cloud)
        if link and link.scalar and not cloud.has_scalars:
            self._notices.append(f"'{name}': its file has no attribute '{link.scalar}' to take as scalar")
        return cloud

    def settle(self) -> None:
        """Builds what waits."""
        waiting, self._waiting = self._waiting, []
        if not waiting:
            return
        what = f"Building '{waiting[0].name}'" if len(waiting) == 1 else f"Building {len(waiting)} small clouds"

        def cancel() -> None:
            for soon in waiting:
                soon.progress.cancel()

        def stopped() -> bool:
            return self._poll(what, sum(soon.built is not None for soon in waiting) / len(waiting))

        def work() -> None:
            from concurrent.futures import ThreadPoolExecutor  # 8 ms of Blender's start
            with ThreadPoolExecutor(min(os.cpu_count() or 1, AT_ONCE)) as pool:
                for _ in pool.map(Soon.build, waiting):
                    pass

        jobs.run(work, cancel, stopped)
        for soon in waiting:
            self._notice(soon.name, soon.built)

    def _notice(self, name: str, cloud: native.Cloud) -> None:
        if cloud.invalid_positions:
            self._notices.append(f"'{name}': {cloud.invalid_positions:,} points without a finite position left out")


class Soon(Pending):
    """A small cloud that waits for TakingNow.settle."""

    def __init__(self, name: str, identity: tuple, arrays: PointArrays, progress: Progress) -> None:
        super().__init__(name, identity, arrays)
        self.progress = progress
        self.count = len(arrays.positions)

    def build(self) -> None:
        """Any thread."""
        self._cloud = _finished(self._identity, self._arrays, self.progress)
        self._arrays = None


def of_object(obj: bpy.types.Object, surface: str, link: linked.Source | None, poll: Callable[[str, float], bool],
              notices: list[str]) -> native.Cloud | None:
    """The cloud of an object's own points, not evaluated, or of its linked file: the one that pictures have, or a new one. Analyzed where
    the object's pictures are."""
    identity = link.identity() if link else identity_of(obj, set(), radius_name(obj, surface), 0)
    taking = TakingNow(poll, notices)
    found = taking(obj, identity, link, True)
    taking.settle()
    return found.built if isinstance(found, Pending) else found


def _finished(identity: tuple, arrays: PointArrays, progress: Progress) -> native.Cloud:
    """The cloud of these points, analyzed where that is wanted."""
    with progress.inner() as inner:
        cloud = jobs.finish(CACHE.obtain(identity, arrays, inner))
    if arrays.analyzed and not cloud.has_shapes:
        progress.doing = analysis.label(cloud)
        ANALYSES.finish(cloud, arrays.stations, progress.follow)
    return cloud


class Trusted:
    """Clouds of a viewport, read again only after Blender said that their data changed."""

    def __init__(self) -> None:
        self._known: dict[tuple, tuple[Pending | meshes.Faces | None, list[str]]] = {}
        self._used: set[tuple] = set()
        self.reads = 0  # how often points were read, for tests

    def forget(self, owners: set[tuple[str, str]] | None = None) -> None:
        """Data that changed, as (type name, full name) of object, data or material; None: all."""
        self._known = {} if owners is None else {
            identity: known for identity, known in self._known.items() if not owners.intersection(identity[-1])}

    def take(self, notices: list[str]) -> Take:
        self._known = {key: known for key, known in self._known.items() if key in self._used}  # objects go
        self._used = set()

        def take(obj: bpy.types.Object, identity: tuple, link: linked.Source | None, analyzed: bool) -> Pending | meshes.Faces | None:
            owners = {item: None for item in (obj, obj.data, *(slot.material for slot in obj.material_slots),
                                              *getattr(obj.data, "materials", ()), *node_colors.images_of(obj)) if item}  # each once
            key = (*identity, tuple((_kind(owner), owner.original.name_full) for owner in owners))
            self._used.add(key)
            if key not in self._known:
                said: list[str] = []
                if link:
                    self._known[key] = (PendingLink(obj.name, link), said)
                elif identity[-1] in {meshes.TRIANGLES, meshes.BARE}:
                    self.reads += 1
                    self._known[key] = (meshes.CACHE.obtain(identity, obj), said)
                else:
                    self.reads += 1
                    arrays = read(obj, said, identity[0], identity[-1])
                    self._known[key] = (Pending(obj.name, identity, arrays) if arrays else None, said)
            pending, said = self._known[key]
            notices.extend(text for text in said if text not in notices)  # materials are shared
            return pending

        return take


def _kind(item: bpy.types.ID) -> str:
    return type(item.original).__name__


def changed_owners(depsgraph: bpy.types.Depsgraph) -> set[tuple[str, str]]:
    """Objects and data whose points Blender says have changed, for Trusted.forget."""
    owners = set()
    for update in depsgraph.updates:
        item = update.id.original
        if isinstance(item, bpy.types.Material):  # all that Blender says where an image was loaded anew
            images.CACHE.forget(images.names_in(item))
        if isinstance(item, bpy.types.Object):
            if update.is_updated_geometry:
                owners.add((_kind(item), item.name_full))
        elif isinstance(item, bpy.types.Image):
            images.CACHE.forget({item.name_full})
            owners.add((_kind(item), item.name_full))
        elif update.is_updated_geometry or isinstance(item, (bpy.types.Mesh, bpy.types.PointCloud, bpy.types.Material)):
            owners.add((_kind(item), item.name_full))
    return owners
