# SPDX-License-Identifier: GPL-3.0-or-later
"""Clouds that are analyzed: beside a Blender that goes on, for viewports, and before a final picture, which waits.

An analysis takes nothing from pictures until it is applied; that changes the cloud, and no picture of it may be drawn then.
What is found stays with the cloud.
"""

from __future__ import annotations

import contextlib
import os
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ... import choices, jobs, native
from ...description.points import Stations
from ...native import building
from ...read.importers import Progress
from .analysis import label

# Half the cores, so that the view stays quick meanwhile.
BESIDE = max(1, (os.cpu_count() or 2) // 2)


@dataclass
class _Job:
    cloud: native.Cloud
    progress: native.Progress
    task: native.Task
    claimed: bool = False  # a final picture waits for it, and applies it


Wish = tuple[native.Cloud, "Stations | None"]


class Analyses:
    """wish() and advance() on Blender's thread, the others on any."""

    def __init__(self) -> None:
        self._lock = threading.Condition()
        self._wishes: dict[object, list[Wish]] = {}
        self._jobs: dict[native.Cloud, _Job] = {}
        self._ending: list[native.Task] = []  # cancelled
        self._failed: weakref.WeakSet[native.Cloud] = weakref.WeakSet()
        self._frames: set[native.Task] = set()  # pictures that viewports have under way
        self._drawing = 0  # other pictures
        self._changing = False

    # ---- pictures, which an analysis that is applied must not meet

    def begin_frame(self, start: Callable[[], native.Task]) -> native.Task | None:
        """The task of a viewport's picture; None where it has to wait."""
        with self._lock:
            if self._changing:
                return None
            task = start()
            self._frames.add(task)
            return task

    def end_frame(self, task: native.Task | jobs.Pause, close: bool = False) -> None:
        with self._lock:
            self._frames.discard(task)
            if close:
                task.close()

    def await_frames(self) -> None:
        """On Blender's thread, where no viewport begins a picture meanwhile: waits until none is under way, for colors of clouds may
        change then."""
        while True:
            with self._lock:
                if all(task.done() for task in self._frames):
                    return
            time.sleep(0.002)

    @contextlib.contextmanager
    def drawing(self) -> Iterator[None]:
        with self._lock:
            self._lock.wait_for(lambda: not self._changing)
            self._drawing += 1
        try:
            yield
        finally:
            with self._lock:
                self._drawing -= 1

    def _quiet(self) -> bool:
        return not self._drawing and all(task.done() for task in self._frames)

    # ---- viewports

    def wish(self, who: object, clouds: list[Wish]) -> None:
        """What a viewport shows and has not been analyzed yet, in place of what it wished before."""
        self._wishes.pop(who, None)
        clouds = [(cloud, stations) for cloud, stations in clouds if not cloud.has_shapes and cloud not in self._failed]
        if clouds:
            self._wishes[who] = clouds

    def busy(self) -> bool:
        return bool(self._wishes or self._jobs or self._ending)

    def __contains__(self, cloud: native.Cloud) -> bool:
        with self._lock:
            return cloud in self._jobs

    def progress(self, cloud: native.Cloud) -> float | None:
        """Of one that is under way."""
        job = self._jobs.get(cloud)
        return job.progress.value() if job else None

    def advance(self, final: bool) -> list[native.Cloud]:
        """Starts what is wished, lets go of what is not, applies what is done; final: not now, for a final picture is made.
        The clouds that are changed."""
        with self._lock:
            self._ending = [task for task in self._ending if not _closed(task)]
            wished = {cloud: stations for clouds in self._wishes.values() for cloud, stations in clouds}
            for job in [job for job in self._jobs.values() if not job.claimed and job.cloud not in wished]:
                self._cancel(job)
            finished = [cloud for cloud in wished if cloud.has_shapes]  # by a final picture
            for cloud in finished:
                self._forget_wish(cloud)
            job = next((job for job in self._jobs.values() if not job.claimed), None)
            if job is None:
                for cloud, stations in wished.items():
                    if cloud not in self._jobs and not cloud.has_shapes:
                        self._start(cloud, stations, BESIDE)
                        break
            if finished or job is None:
                return finished
            if not job.task.done() or final or self._changing or not self._quiet():
                return []
            del self._jobs[job.cloud]
            self._forget_wish(job.cloud)
            try:
                job.task.result()
            except native.PatinaError:  # without it the picture is as it was
                self._failed.add(job.cloud)
                return []
            return [job.cloud]

    def clear(self) -> None:
        """Ends all that no final picture waits for."""
        self._wishes = {}
        with self._lock:
            for job in [job for job in self._jobs.values() if not job.claimed]:
                self._cancel(job)
            for task in self._ending:
                task.close()
            self._ending = []

    def _start(self, cloud: native.Cloud, stations: Stations | None, threads: int) -> _Job:
        progress = native.Progress()
        job = _Job(cloud, progress, start(cloud, stations, progress, threads))
        self._jobs[cloud] = job
        return job

    def _cancel(self, job: _Job) -> None:
        job.progress.cancel()
        self._ending.append(job.task)
        del self._jobs[job.cloud]

    def _forget_wish(self, cloud: native.Cloud) -> None:
        kept = {who: [wish for wish in clouds if wish[0] is not cloud] for who, clouds in self._wishes.items()}
        self._wishes = {who: clouds for who, clouds in kept.items() if clouds}

    # ---- final pictures

    def finish(self, cloud: native.Cloud, stations: Stations | None, took: Callable[[native.Progress], None]) -> None:
        """Waits for a cloud's analysis, of a viewport's beginning or its own, and applies it. took: gets what tells its
        progress and cancels it."""
        with self._lock:
            known = self._jobs.get(cloud)
            if known and known.claimed:
                self._lock.wait_for(lambda: cloud not in self._jobs)
            if cloud.has_shapes:
                return
            job = self._jobs.get(cloud) or self._start(cloud, stations, 0)
            job.claimed = True  # from now on nobody else ends it, closes its task or applies it: it is read without the lock
        changing = False
        try:
            took(job.progress)
            begun = time.monotonic()
            while not job.task.done():  # an eighth longer than it takes, at most: a small cloud is done in milliseconds
                time.sleep(min(max((time.monotonic() - begun) / 8.0, 0.0005), jobs.INTERVAL))
            with self._lock:
                self._lock.wait_for(lambda: not self._changing)
                self._changing = changing = True
            while not self._is_quiet():
                time.sleep(0.002)
            job.task.result()
        finally:
            job.task.close()
            with self._lock:
                self._changing &= not changing  # it may be another thread's
                self._jobs.pop(cloud, None)
                self._lock.notify_all()

    def _is_quiet(self) -> bool:
        with self._lock:
            return self._quiet()


def start(cloud: native.Cloud, stations: Stations | None, progress: native.Progress, threads: int = 0) -> native.Task:
    return cloud.start_analysis(progress=progress, threads=threads, **_given(stations))


def on_disk(cloud: native.Cloud, stations: Stations | None, path: Path, to: Path, progress: Progress) -> jobs.Steps[None]:
    """Analyzes the saved cloud in path, which cloud maps, to another file: with the memory that pictures may hold of linked clouds."""
    progress.doing = f"{label(cloud)} on the disk"
    with progress.inner() as inner:
        task = building.start_analysis(cloud, path, to, choices.cloud_bytes(), inner, **_given(stations))
    try:
        yield task
        task.result()
    except GeneratorExit:  # nobody wants it any more
        inner.cancel()
        raise
    finally:
        task.close()


def _given(stations: Stations | None) -> dict[str, Any]:
    """As the library's calls take it."""
    if stations is None:
        return {}
    return {"stations": stations.places if len(stations.places) else None, "station": stations.of_points,
            "free_space": stations.tells_free_space, "grid": stations.grid, "by_grid": stations.by_grid, "scan": stations.scan,
            "directions": stations.directions}


def _closed(task: native.Task) -> bool:
    if task.done():
        task.close()
        return True
    return False


ANALYSES = Analyses()
