# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs what unpacks LAZ and E57 in a process of its own with a memory limit. A library that aborts, hangs or takes all memory on a
damaged file ends that process; the add-on reports a message. Knows no Blender.

The process writes points into slots of a file that both sides map, so that no array is copied through a pipe. main.py is the process's
program; it, laz.py, e57.py, e57_xml.py and limits.py import nothing of the add-on. e57_xml.py is also used on this side.
"""

from __future__ import annotations

import contextlib
import json
import mmap
import os
import select
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ... import native, whole
from .. import programs

SLOTS = 3  # one is written, one waits, one is read
SLOT = 64 << 20  # bytes at most
WAIT = 0.02  # seconds between two looks at the clock, the same as jobs.INTERVAL
NO_ANSWER = 60.0  # seconds without an answer after which the process is ended
LEAST_MEMORY = 1 << 30  # bytes that the process may always take


class Unpacker:
    """One process for one file. Use it with `with`, or close it."""

    def __init__(self, path: Path, kind: str, slot: int, memory: int, **order: Any) -> None:
        """slot: bytes of one answer. memory: bytes that the process may take beside LEAST_MEMORY. order: what the kind needs.
        PatinaError when the process does not start."""
        self._path, self._size, self._limit = path, max(slot, 1), LEAST_MEMORY + memory
        try:
            self._folder = whole.Folder("patina-unpack-")
        except OSError as error:
            raise self._fail(f"the folder for temporary files cannot be written: {error.strerror}", -3) from None
        self._process: subprocess.Popen[bytes] | None = None
        self._map: mmap.mmap | None = None
        self._text = b""
        self._asked = time.monotonic()
        try:
            self._map = self._slots(self._folder.path / "slots")
            here = Path(__file__).parent
            self._process = subprocess.Popen(
                [*programs.command(here / "main.py"), str(self._folder.path / "slots")],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=os.environ | {"OPENBLAS_NUM_THREADS": "1"})
        except OSError as error:
            self.close()
            raise self._fail(f"the process that unpacks it does not start: {error.strerror or error}", -3) from None
        self.tell({"kind": kind, "path": os.fsencode(path).decode("latin-1"), "slot": self._size, "slots": SLOTS, "limit": self._limit, **order})

    def _slots(self, path: Path) -> mmap.mmap:
        with open(path, "wb+") as file:
            size = SLOTS * self._size
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(file.fileno(), 0, size)  # else a full disk would end whoever touches the map
            else:
                file.truncate(size)
            return mmap.mmap(file.fileno(), size)

    def __enter__(self) -> Unpacker:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Ends the process, whatever it does."""
        if self._process:
            self._process.kill()
            self._process.wait()
            for pipe in (self._process.stdin, self._process.stdout):
                with contextlib.suppress(OSError):
                    pipe.close()
        if self._map:
            with contextlib.suppress(BufferError):
                self._map.close()
        self._folder.cleanup()

    def tell(self, words: dict[str, Any]) -> None:
        """Sends a line to the process."""
        self._asked = time.monotonic()
        with contextlib.suppress(OSError):  # it has ended, which the next answer shows
            self._process.stdin.write(json.dumps(words).encode() + b"\n")
            self._process.stdin.flush()

    def answers(self) -> Iterator[dict[str, Any] | None]:
        """The process's answers up to {"end": ...}; None about each WAIT seconds without one. PatinaError where it reports an error,
        ends, or does not answer."""
        while True:
            line, newline, rest = self._text.partition(b"\n")
            if newline:
                self._text, self._asked = rest, time.monotonic()
                answer = json.loads(line)
                if "error" in answer:
                    raise self._fail(answer["error"], answer.get("code", -4))
                yield answer
                if "end" in answer:
                    return
                continue
            found = self._read()
            if found is None:
                if time.monotonic() - self._asked > NO_ANSWER:
                    raise self._fail(f"unpacking was stopped, because it made no progress in {NO_ANSWER:.0f} seconds. The file may be damaged")
                yield None
            elif not found:
                raise self._fail(self._end())
            else:
                self._text += found

    def _read(self) -> bytes | None:
        """What the process has written; b"" once it has ended, None where there is nothing yet."""
        pipe = self._process.stdout.fileno()
        if sys.platform == "win32":
            import _winapi
            import msvcrt
            try:
                if not _winapi.PeekNamedPipe(msvcrt.get_osfhandle(pipe), 0)[0]:
                    time.sleep(0.002)
                    return None
            except OSError:
                return b""
        elif not select.select([pipe], [], [], WAIT)[0]:
            return None
        return os.read(pipe, 1 << 16)

    def _end(self) -> str:
        code = self._process.wait()
        how = f"signal {-code}" if code < 0 else f"status {code}"
        return (f"the process that unpacks it ended unexpectedly ({how}). The file may be damaged, or unpacking it may need more than "
                f"{self._limit / 1e6:,.0f} MB of memory")

    def take(self, slot: int, size: int) -> bytearray:
        """A copy of a slot's first bytes. The process may use the slot again."""
        with memoryview(self._map) as whole, whole[slot * self._size:slot * self._size + size] as part:
            found = bytearray(part)
        self.tell({"free": slot})
        return found

    def _fail(self, what: str, code: int = -4) -> native.PatinaError:
        return native.PatinaError(f"{self._path.name}: {what}", code)
