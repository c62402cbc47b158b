# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that appear whole under their names or not at all, and folders for a while. What a process that was killed left of either, the next one
removes. Knows neither Blender nor the library, and needs no other module of the add-on.

A file is written beside its name, as NAME.PROCESS-NUMBER.part. Whoever writes it, or uses a folder, holds a lock on it: what nobody holds is
left over. Windows has no such locks, but deletes no file that somebody has open.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import re
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None

_LOCK = "lock"  # the file in a folder that its process holds
_OLD = 86400.0  # seconds after which what nobody changed is left over, where there is no lock: of older versions, and on disks that know none
_PART = re.compile(r"(.+?)(?:\.\d+(?:-\d+)?)?\.part[2-9]?(?:\.built|\.analysed|\.smaller)?")  # ours, the library's
_numbers = itertools.count()


def _hold(file: BinaryIO, path: Path, unknown: bool = True) -> bool:
    """Takes the lock of an open file. Whether it has it, and the file still has its name. unknown: the answer where the disk has no locks."""
    if fcntl is None:
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return unknown
    with contextlib.suppress(OSError):
        return os.path.samestat(os.fstat(file.fileno()), os.stat(path))
    return False


def _empty(folder: Path) -> None:
    """Deletes what a folder holds, except its lock. The lock goes last: a process that is killed meanwhile leaves a folder that the next one knows
    as left over. OSError."""
    for item in folder.iterdir():
        if item.is_dir() and not item.is_symlink():
            shutil.rmtree(item)
        elif item.name != _LOCK:
            item.unlink()


def _remove_unheld(path: Path, tree: Path | None = None) -> bool:
    """Deletes a file, and a folder that it is the lock of, unless somebody holds it."""
    try:
        with open(path, "rb+") as file:
            if not _hold(file, path, time.time() - os.fstat(file.fileno()).st_mtime > _OLD):
                return False
            if fcntl is not None:  # while we hold it, for its name may be taken again
                if tree:
                    _empty(tree)
                path.unlink()
        if fcntl is None:
            path.unlink()  # fails where somebody has it open
        if tree:
            shutil.rmtree(tree)
    except OSError:
        return False
    return True


@contextlib.contextmanager
def writing(path: Path) -> Iterator[BinaryIO]:
    """A binary file that takes the place of `path` when the block ends. If it fails, `path` stays as it is, and nothing is left. OSError."""
    while True:
        part = path.with_name(f"{path.name}.{os.getpid()}-{next(_numbers)}.part")
        file = open(part, "wb")
        if _hold(file, part):
            break
        file.close()  # somebody took it for left over
    try:
        yield file
        file.flush()
        if os.name == "nt":
            file.close()  # an open file cannot be renamed there
        os.replace(part, path)
    except BaseException:
        with contextlib.suppress(OSError):
            file.close()
        with contextlib.suppress(OSError):
            part.unlink()
        raise
    file.close()


def write(path: Path, data: bytes) -> None:
    with writing(path) as file:
        file.write(data)


def copy(source: Path, target: Path) -> None:
    """OSError."""
    with open(source, "rb") as found, writing(target) as file:
        shutil.copyfileobj(found, file, 1 << 22)


def remove_left(folder: Path, is_ours: Callable[[Path], bool]) -> int:
    """Deletes what was left beside files of a folder. is_ours: of the file that it was to become. How many are gone."""
    count = 0
    with contextlib.suppress(OSError):
        for name in os.listdir(folder):
            found = _PART.fullmatch(name)
            if found and is_ours(folder / found[1]):
                count += _remove_unheld(folder / name)
    return count


class Folder:
    """A temporary folder that goes with its owner; removes those of the same prefix that nobody holds."""

    def __init__(self, prefix: str, place: Path | None = None) -> None:
        """place: where; the system's for temporary files else. OSError."""
        where = Path(place or tempfile.gettempdir())
        remove_left_folders(where, prefix)
        while True:
            self._folder = tempfile.TemporaryDirectory(prefix=prefix, dir=where, ignore_cleanup_errors=True)
            lock = Path(self._folder.name) / _LOCK
            try:
                self._lock = open(lock, "wb")
            except FileNotFoundError:
                continue  # somebody took the empty folder for left over
            if _hold(self._lock, lock):
                break
            self.cleanup()  # somebody took it for left over
        self.path = lock.with_name("files")
        self.path.mkdir()

    def cleanup(self) -> None:
        with contextlib.suppress(OSError):
            _empty(Path(self._folder.name))
        self._lock.close()
        self._folder.cleanup()

    def __enter__(self) -> Path:
        return self.path

    def __exit__(self, *_: object) -> None:
        self.cleanup()


def remove_left_folders(where: Path, prefix: str) -> int:
    """How many are gone. Those of other users stay."""
    count = 0
    with contextlib.suppress(OSError):
        for name in os.listdir(where):
            folder = where / name
            if not name.startswith(prefix) or folder.is_symlink():
                continue
            with contextlib.suppress(OSError):
                status = folder.stat()
                if hasattr(os, "getuid") and status.st_uid != os.getuid():
                    continue
                if (folder / _LOCK).exists():
                    count += _remove_unheld(folder / _LOCK, folder)
                elif time.time() - status.st_mtime > _OLD:
                    shutil.rmtree(folder)
                    count += 1
                else:
                    folder.rmdir()  # its owner ended before it made the lock; one with files stays until it is old
                    count += 1
    return count
