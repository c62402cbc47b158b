# SPDX-License-Identifier: GPL-3.0-or-later
"""Where linked clouds are kept on the disk, and whether what is kept there is still what was written.

A kept cloud is mapped at once, and read whole beside by a native task; what is damaged is thrown away and built anew.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import threading
import time
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy

from ... import choices, jobs, native, whole

# Of what is kept of a scan: its place, its state then, what was asked for; and of packed files that were put down, their sum. Nothing else in the
# folder, which may be one of the artist's, is ours.
_OF_SCAN, _PACKED = re.compile(r"[0-9a-f]{24}-[0-9a-f]{12}-[0-9a-f]{8}\.(cloud|json|scan)"), re.compile(r"[0-9a-f]{24}-packed\..+")


def is_of_scan(path: Path) -> bool:
    """Whether a file has the name of a kept cloud, or of what belongs to one."""
    return _OF_SCAN.fullmatch(path.name) is not None


def is_packed(path: Path) -> bool:
    return _PACKED.fullmatch(path.name) is not None


def folder() -> Path:
    """Of all kept clouds: the artist's own, else Blender's of user data; without a home, as services and farms have none, the system's for temporary
    files, in a folder that is this user's alone."""
    known = choices.get()
    if known and known.cache_folder:
        chosen = Path(bpy.path.abspath(known.cache_folder))
        with contextlib.suppress(OSError):  # its disk is gone: clouds stay in memory, as where it is full
            chosen.mkdir(parents=True, exist_ok=True)
        return chosen
    own = bpy.utils.user_resource('DATAFILES', path="patina")
    with contextlib.suppress(OSError):  # where Blender is asked to make it, it prints a traceback
        if own:
            Path(own).mkdir(parents=True, exist_ok=True)
            if os.access(own, os.W_OK):
                return Path(own)
    return temporary_folder()


def temporary_folder() -> Path:
    """This user's own among the system's for temporary files. OSError, PermissionError where somebody else has its name."""
    import tempfile  # which few come to, at Blender's start nobody
    user = getattr(os, "getuid", lambda: "")()
    beside = Path(tempfile.gettempdir()) / f"patina-{user}"
    beside.mkdir(mode=0o700, exist_ok=True)
    if user != "" and beside.stat().st_uid != user:  # somebody else's
        raise PermissionError(f"{beside} belongs to another user")
    return beside


def beside(path: Path) -> Path:
    """Where clouds are kept that many machines share: a folder beside the scan. Nothing goes there but by Send to Farm."""
    return path.parent / ".patina"


def place_of(path: Path, name: str) -> Path:
    """Of a scan's kept cloud: one's own, else one that lies beside the scan."""
    own, shared = folder() / name, beside(path) / name
    with contextlib.suppress(OSError):
        if not own.is_file() and shared.is_file():
            return shared
    return own


def read_notes(path: Path) -> tuple[tuple[float, float, float], list[float], list[float], dict[str, Any] | None, str]:
    """Origin, scanners, units, scans and what is told of these, of a kept cloud. ValueError or OSError where they are not there as they were written."""
    try:
        notes = json.loads(path.read_text("utf-8"))
    except RecursionError:
        raise ValueError(f"{path} holds lists in lists") from None
    if not isinstance(notes, dict):
        raise ValueError(f"{path} holds no object")
    if notes.pop("sum", None) not in {None, _sum_of_notes(notes)}:  # None: of an older version
        raise ValueError(f"{path} is damaged")
    if notes.get("unsure"):
        raise ValueError(f"{path} is of a file that may have changed since, at the same second")
    origin, scanners = _numbers(notes.get("origin")), _numbers(notes.get("scanners") or [])
    units = _numbers(notes.get("units") or [1.0, 1.0])
    if len(origin) != 3 or len(scanners) % 3 or len(units) != 2:
        raise ValueError(f"{path} lacks what belongs to it")
    scans = notes.get("scans", False)
    if scans is not None and not (isinstance(scans, dict) and isinstance(scans.get("name"), str) and len(_numbers(scans.get("numbers"))) > 1):
        raise ValueError(f"{path} does not say of which scans its points are")
    told = notes.get("told", "")
    if not isinstance(told, str):
        raise ValueError(f"{path} does not tell of its scans")
    return tuple(origin), scanners, units, scans, told


def write_notes(path: Path, notes: dict[str, Any], scan_file: Path | None) -> None:
    """With check sums, of the file too that says of which scan each point is. OSError."""
    notes = json.loads(json.dumps(notes)) | ({"scan_sum": _sum_of_file(scan_file)} if scan_file else {})
    whole.write(path, json.dumps(notes | {"sum": _sum_of_notes(notes)}).encode())


def check_scan_file(path: Path, scan_file: Path, count: int) -> None:
    """Whether that file is the one that the notes in `path` were written with. ValueError where not, OSError."""
    wanted = json.loads(path.read_text("utf-8")).get("scan_sum")
    if scan_file.stat().st_size != 2 * count or wanted not in {None, _sum_of_file(scan_file)}:  # None: of an older version
        raise ValueError(f"{scan_file} is damaged")


def _sum_of_notes(notes: dict[str, Any]) -> int:
    return zlib.crc32(json.dumps(notes, sort_keys=True).encode())


def _sum_of_file(path: Path) -> int:
    found = 0
    with open(path, "rb") as file:
        while data := file.read(1 << 22):
            found = zlib.crc32(data, found)
    return found


def is_unsure(path: Path) -> bool:
    """Whether a file may change now without another time: it has times of whole seconds, and was written just now."""
    try:
        changed = path.stat().st_mtime_ns
    except OSError:
        return False
    return changed % 1_000_000_000 == 0 and abs(time.time() - changed / 1e9) <= 2.0


def remove_left(place: Path) -> None:
    """What processes that were killed left half-written."""
    whole.remove_left(place, lambda path: is_of_scan(path) or is_packed(path))


def _numbers(values: Any) -> list[float]:
    if not isinstance(values, list) or not all(type(value) in {int, float} for value in values):
        raise ValueError("numbers were expected")
    try:
        return [float(value) for value in values]
    except OverflowError:
        raise ValueError("numbers were expected that a float can hold") from None


class Checks:
    """Tasks that read kept clouds. Any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._tasks: dict[tuple, tuple[Path, native.Task, native.Progress]] = {}  # by the cloud's identity
        self._seen: dict[tuple, int] = {}  # which file of a name was found good: its inode
        self._damaged: dict[str, list[tuple]] = {"views": [], "finals": []}  # found, and not yet told to them

    def start(self, identity: tuple, path: Path) -> None:
        """Begins to look at the file of a cloud that was just opened, once a session."""
        with self._lock:
            if identity in self._tasks or self._seen.get(identity) == path.stat().st_ino:
                return
            progress = native.Progress()
            self._tasks[identity] = (path, native.Cloud.start_verifying(path, progress), progress)

    def busy(self) -> bool:
        return bool(self._tasks)

    def take_damaged(self, who: str = "views") -> list[tuple]:
        """The identities of clouds found damaged since the last time; their files are gone."""
        with self._lock:
            self._look()
            found, self._damaged[who] = self._damaged[who], []
        return found

    def finish(self, stopped: Callable[[], bool]) -> list[tuple]:
        """The same for a final picture, of all that are under way, waiting for them."""
        while any(not task.done() for _, task, _ in list(self._tasks.values())):
            if stopped():
                raise native.PatinaCancelled("cancelled", native.CANCELLED)
            time.sleep(jobs.INTERVAL)
        return self.take_damaged("finals")

    def _look(self) -> None:
        for identity, (path, task, _) in list(self._tasks.items()):
            if not task.done():
                continue
            del self._tasks[identity]
            try:
                task.result()
                self._seen[identity] = path.stat().st_ino
            except native.PatinaError as error:
                if error.code == native.FORMAT:
                    path.unlink(missing_ok=True)
                    for found in self._damaged.values():
                        found.append(identity)
            except OSError:  # somebody threw it away meanwhile
                pass

    def clear(self) -> None:
        with self._lock:
            for _, task, progress in self._tasks.values():
                progress.cancel()
                task.close()
            self._tasks.clear()


CHECKS = Checks()
