# SPDX-License-Identifier: GPL-3.0-or-later
"""What owns a handle of the library: devices, tasks, progress."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from ctypes import byref, c_void_p
from typing import Any

from . import abi, devices
from .loader import PatinaError, check, library

_losses = [0]  # pictures that lacked points of files that cannot be read any more


def losses() -> int:
    """Grows whenever a picture lacked such points: clouds that were opened before may be such files."""
    return _losses[0]


def note_losses(points: int) -> None:
    """A picture lacked so many points of such files."""
    _losses[0] += points > 0


def destroy(destroy: Callable[[c_void_p], None], handle: c_void_p, _keep: Any) -> None:
    destroy(handle)


class Handle:
    """Owns a native handle until close(), the end of a `with`, or the last reference. `keep` lives as long."""

    _kind = ""

    def __init__(self, *arguments: Any, blame: tuple[c_void_p, ...] = (), create: str = "", keep: Any = None) -> None:
        lib = library()
        handle = c_void_p()
        check(getattr(lib, create or f"patina_{self._kind}_create")(*arguments, byref(handle)), *blame)
        self._handle = handle
        self._finalizer = weakref.finalize(self, destroy, getattr(lib, f"patina_{self._kind}_destroy"), handle, keep)

    def close(self) -> None:
        self._finalizer()

    def __enter__(self):
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()

    def _call(self, name: str, *arguments: Any) -> None:
        if not self._finalizer.alive:
            raise PatinaError(f"this {self._kind} is closed")
        check(getattr(library(), f"patina_{self._kind}_{name}")(self._handle, *arguments), self._handle)


class Progress(Handle):
    """Of a long call that has no frame; value() and cancel() may be called while it runs."""

    _kind = "progress"

    def cancel(self) -> None:
        library().patina_progress_cancel(self._handle)

    def value(self) -> float:
        return library().patina_progress_value(self._handle)


class Task(Handle):
    """A call that runs on a native thread; what it uses stays alive until it ends. close() waits for it."""

    _kind = "task"

    def __init__(self, call: str, *arguments: Any, keep: tuple,
                 finish: Callable[[Task], Any] = lambda task: None) -> None:
        super().__init__(*arguments, create=f"patina_task_{call}", keep=keep)
        self._finish = finish

    def done(self) -> bool:
        return not self._finalizer.alive or bool(library().patina_task_done(self._handle))

    def result(self) -> Any:
        """Waits; raises what the call would have raised, else gives its result. Once: then the task is closed."""
        try:
            self._call("wait")
            return self._finish(self)
        finally:
            self.close()


def handle_of(progress: Progress | None) -> c_void_p | None:
    return progress._handle if progress else None


class Device(Handle):
    _kind = "device"

    def __init__(self, name: str = "auto", threads: int = 0, mapped: int = 0) -> None:
        """mapped: bytes that a picture holds of mapped clouds at a time; 0: a third of what is free."""
        super().__init__(byref(abi.DeviceDesc(name=name.encode(), threads=threads, mapped_cap=mapped)))
        info = abi.DeviceInfo()
        self._call("get_info", byref(info))
        self.name = info.name.decode()
        self.description = info.description.decode("utf-8", "replace")
        self.hardware = bool(info.hardware)
        self.label = devices.label(self.name, self.description, self.hardware)  # for people
