# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs a long native call off the thread that talks to Blender.

The worker never touches Blender's API; the calling thread polls, shows progress and cancels. Only for operators, which
Blender waits for, and final renders, which Blender itself runs on a thread with Python. Beside a Blender that goes on,
Python on a thread of ours makes it crash: some of its code takes "Python runs somewhere" for "I hold Python's lock".
There, work is made of steps: a generator that yields each native task and goes on when it is done, and pauses where Python
itself works for long.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Generator
from typing import TypeVar

from .native import Task

T = TypeVar("T")



class Pause:
    """What a step of Python's own work yields in place of a task: who drives the steps may look at the clock."""

    _seen = False

    def done(self) -> bool:
        seen, self._seen = self._seen, True
        return seen

    def close(self) -> None:
        """As a task's."""


# Work made of steps, which gives a T
Steps = Generator["Task | Pause", None, T]

# Seconds between two polls: a tenth of the 0.2 s within which a cancel shall show, and no load on a farm node.
INTERVAL = 0.02


def run(work: Callable[[], T], cancel: Callable[[], None], poll: Callable[[], bool]) -> T:
    """Calls work() on a worker thread and returns its result or raises its exception.

    Meanwhile poll() is called on this thread; once it returned True, cancel() is called until the worker has ended: between two of
    its steps it hears nothing, and the next one begins anew. An exception out of poll() cancels too, and is raised then.
    """
    outcome: list[T] = []
    failure: list[BaseException] = []
    done = threading.Event()

    def target() -> None:
        try:
            outcome.append(work())
        except BaseException as error:  # handed to the calling thread
            failure.append(error)
        finally:
            done.set()

    worker = threading.Thread(target=target, name="patina", daemon=True)
    worker.start()
    try:
        while not done.wait(INTERVAL):
            if poll():
                break
    finally:
        while not done.is_set():
            cancel()
            done.wait(INTERVAL)
        worker.join()
    if failure:
        try:
            raise failure[0]
        finally:
            failure.clear()  # else error, traceback and this list keep each other, and the caller's arrays, alive
    return outcome[0]


def finish(steps: Steps[T]) -> T:
    """Goes through all steps, waiting."""
    try:
        while True:
            next(steps)  # which waits for the task of the step before
    except StopIteration as end:
        return end.value
