# SPDX-License-Identifier: GPL-3.0-or-later
"""What was fetched of addresses and of slow shares, kept on a disk as it came: a file for each part of a file that was asked for. Knows neither
Blender nor the library; both processes use it.

FOLDER/PLACE/about.json tells what PLACE is of and in which state it was; FOLDER/PLACE/VERSION/PART.kept holds a check sum and the bytes. Several
processes may share a folder: files come whole under their names, one that is torn is fetched again, and one that goes is as if it had
never been there.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import json
import os
import re
import shutil
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

ENDING = ".kept"
ABOUT = "about.json"
LEAST_FREE = 256 << 20  # bytes that others shall find on the disk
FORGOTTEN = 3600.0  # seconds after which a file that was never finished belongs to nobody
_MARK = b"PATINA01"
_SUM = 16  # bytes
_PLACE, _VERSION = re.compile("[0-9a-f]{32}"), re.compile("[0-9a-f]{16}")  # what folders are called: others are not looked into
_HALF = re.compile(r".+\.(kept|json)\.\d+-\d+\.part")
TRIES = 6  # to take a name that somebody looks at just now, which Windows then holds fast


class Shelf:
    """What is kept in a folder, of all places together at most so many bytes. From any thread. tell: of what goes wrong, once."""

    def __init__(self, folder: Path, most: int, tell: Callable[[str], None], least_free: int = LEAST_FREE) -> None:
        self._folder, self._most, self._tell, self._least_free = folder, most, tell, least_free
        self._lock = threading.Lock()
        self._off = False
        self._held: int | None = None  # bytes, as they were counted last
        self._new = 0  # since then
        self.last: list[Path] = []  # go last: without them nothing can be shown

    def take(self, path: Path, key: str) -> bytes | None:
        """None: it is not there, or torn."""
        try:
            raw = path.read_bytes()
        except OSError:
            return None
        data = raw[len(_MARK) + _SUM:]
        if raw[:len(_MARK)] != _MARK or raw[len(_MARK):len(_MARK) + _SUM] != _sum(key, data):
            with contextlib.suppress(OSError):
                path.unlink()
            return None
        with contextlib.suppress(OSError):
            os.utime(path)  # used just now
        return data

    def put(self, path: Path, key: str, data: bytes) -> None:
        """Where that cannot be, nothing more is kept."""
        if len(data) <= self._most and self.write(path, _MARK + _sum(key, data) + data):
            with self._lock:
                self._new += len(data) + len(_MARK) + _SUM
                if self._held is None or self._held + self._new > self._most or self._new > self._most // 16:  # others add to it too
                    self._tidy()

    def write(self, path: Path, raw: bytes) -> bool:
        if self._off:
            return False
        part = path.with_name(f"{path.name}.{os.getpid()}-{threading.get_ident()}.part")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            if shutil.disk_usage(path.parent).free < self._least_free + len(raw):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            part.write_bytes(raw)
            for left in reversed(range(TRIES)):
                try:
                    os.replace(part, path)
                    break
                except PermissionError:
                    if not left or os.name != "nt":
                        raise
                    time.sleep(0.015)
        except OSError as error:
            if isinstance(error, (FileNotFoundError, FileExistsError)) and self._folder.is_dir() and not path.parent.is_file():
                return False  # somebody clears it just now; of a folder that comes and goes while it is made Python says that it is there
            with contextlib.suppress(OSError):
                part.unlink()
            with self._lock:
                told, self._off = self._off, True
            if not told:
                self._tell(f"nothing more is kept in {self._folder} ({error.strerror or error}): pictures go on without it")
            return False
        return True

    def _tidy(self) -> None:
        for path in self.last:
            with contextlib.suppress(OSError):
                os.utime(path)
        found = sorted(files(self._folder), key=lambda item: item[2])
        self._held, self._new = sum(size for _, size, _ in found), 0
        goal = self._most - self._most // 16 if self._held > self._most else self._held  # room for a while: to look through all takes time
        for path, size, _ in found:
            if self._held <= goal:
                break
            with contextlib.suppress(OSError):  # another's, which Windows holds fast
                path.unlink(missing_ok=True)
                self._held -= size


def place_of(folder: Path, place: str) -> Path:
    """Where what is kept of a place lies."""
    return folder / hashlib.blake2b(place.encode("utf-8", "surrogateescape"), digest_size=16).hexdigest()


def about(own: Path) -> dict[str, Any] | None:
    """What is kept of a place: version, total, etag, modified, head. None: nothing, or nobody can tell."""
    try:
        told = json.loads((own / ABOUT).read_text("utf-8"))
        found = {name: told[name] for name in ("version", "total", "etag", "modified", "head")}
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    texts = [value for name, value in found.items() if name != "total"]
    right = all(isinstance(text, str) for text in texts) and _VERSION.fullmatch(found["version"]) is not None and isinstance(found["total"], (int, type(None)))
    return found if right else None


def holds(folder: Path, place: str) -> bool:
    """Whether something is kept of a place."""
    return about(place_of(folder, place)) is not None


def _sum(key: str, data: bytes) -> bytes:
    return hashlib.blake2b(key.encode() + b"\0" + data, digest_size=_SUM).digest()


def files(folder: Path) -> Iterator[tuple[Path, int, float]]:
    """Path, bytes and time of last use of all that is kept. What was never finished, and belongs to nobody any more, goes."""
    for place in _folders(folder, _PLACE):
        for version in _folders(place, _VERSION):
            with contextlib.suppress(OSError), os.scandir(version) as found:
                for entry in found:
                    with contextlib.suppress(OSError):
                        status = entry.stat()
                        if entry.name.endswith(ENDING):
                            yield Path(entry.path), status.st_size, status.st_mtime
                        elif _HALF.fullmatch(entry.name) and time.time() - status.st_mtime > FORGOTTEN:
                            os.unlink(entry.path)


def _folders(folder: Path, called: re.Pattern[str]) -> list[Path]:
    with contextlib.suppress(OSError), os.scandir(folder) as found:
        return [Path(entry.path) for entry in found if called.fullmatch(entry.name) and entry.is_dir(follow_symlinks=False)]
    return []


def clear(folder: Path) -> tuple[int, int]:
    """Deletes what is kept; how many files, and bytes, are gone. Whatever else lies there stays."""
    count = size = 0
    for path, held, _ in list(files(folder)):
        with contextlib.suppress(OSError):  # another Blender's, which Windows holds fast
            path.unlink()
            count, size = count + 1, size + held
    for place in _folders(folder, _PLACE):
        with contextlib.suppress(OSError):
            (place / ABOUT).unlink(missing_ok=True)
        for empty in [*_folders(place, _VERSION), place]:
            with contextlib.suppress(OSError):
                empty.rmdir()
    return count, size
