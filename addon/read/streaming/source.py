# SPDX-License-Identifier: GPL-3.0-or-later
"""Bytes of a file, or of an address by HTTP(S) range requests, and files of a folder, or of an address's. Knows neither Blender nor the
library, and runs in a process of its own."""

from __future__ import annotations

import contextlib
import hashlib
import http.client
import os
import re
import threading
import time
import urllib.error
import urllib.parse
from collections.abc import Iterator
from dataclasses import dataclass

import web
from address import is_address, is_ept, last_of
from web import Slow, SourceError, Unreachable

TIMEOUT = 10.0  # seconds without a byte, or for web.PACE bytes
TRIES = 3
WAIT = 0.5  # seconds before the second one, twice as long before each further one
HEAD = 589  # bytes of a file that are looked at first: the head of a COPC, and its record
MOST_WAIT = 30.0  # seconds that a server may ask to wait before the next try
MOST_BYTES = 1 << 26  # of a file that is read whole, if nobody says less
MEMORY = 1 << 30  # bytes that all workers together may take for nodes


class Budget:
    """Memory that several threads share. One that wants more waits for the others."""

    def __init__(self, total: int) -> None:
        self._total = self._left = total
        self._change = threading.Condition()

    @contextlib.contextmanager
    def of(self, size: int) -> Iterator[None]:
        """SourceError where it is more than all there is."""
        if size > self._total:
            raise SourceError(f"needs {size / 1e6:,.0f} MB of memory; at most {self._total / 1e6:,.0f} are taken for it")
        with self._change:
            self._change.wait_for(lambda: self._left >= size)
            self._left -= size
        try:
            yield
        finally:
            with self._change:
                self._left += size
                self._change.notify_all()


budget = Budget(MEMORY)


class Pace:
    """How long a tree may take to be read: by its pages and bytes. SourceError where it takes longer, or is larger than a tree."""

    def __init__(self, most_pages: int, most_bytes: int) -> None:
        self._began, self._pages, self._bytes = time.monotonic(), 0, 0
        self._most_pages, self._most_bytes = most_pages, most_bytes

    def add(self, size: int) -> None:
        """A page that was read."""
        self._pages += 1
        self._bytes += size
        seconds = time.monotonic() - self._began
        if self._pages > self._most_pages:
            raise SourceError(f"its octree is damaged: its hierarchy has more than {self._most_pages:,} pages")
        if self._bytes > self._most_bytes:
            raise SourceError(f"its octree is damaged: its hierarchy is larger than {self._most_bytes:,} bytes")
        if seconds > TREE_SECONDS + PAGE_SECONDS * self._pages + self._bytes / TREE_RATE:
            raise SourceError(f"reading its hierarchy was stopped, because it is too slow: {self._pages:,} pages in {seconds:.0f} seconds")


TREE_SECONDS, PAGE_SECONDS, TREE_RATE = 60.0, 0.5, 10_000.0  # of any tree, of each page, and bytes a second


class Resting(SourceError):
    """Nobody answered a while ago, and is not asked again yet."""


@dataclass(frozen=True)
class State:
    """What tells a version of a file from another; as far as it is known."""

    total: int | None = None  # bytes
    etag: str = ""
    modified: str = ""
    head: str = ""  # a hash of the first bytes

    def is_of(self, other: State) -> bool:
        """Whether both are of one version. Several servers of one address may each have ETags of their own, and the same dates."""
        if self.total != other.total and None not in {self.total, other.total} or self.head != other.head and self.head and other.head:
            return False
        pairs = [pair for pair in ((self.etag, other.etag), (self.modified, other.modified)) if all(pair)]
        return not pairs or any(own == their for own, their in pairs)


class Source:
    """Of one file: read(). Of a folder that ept.json tells of: file(). From any thread."""

    name = ""
    keeps = False  # some of it may be there though nobody answers
    settled = False  # what tells of its pages was read

    def read(self, offset: int, size: int) -> bytes:
        raise NotImplementedError

    def file(self, name: str, most: int = MOST_BYTES) -> bytes:
        raise NotImplementedError

    def look(self, known: State | None) -> tuple[State, str, bytes | None]:
        """Its state now, and the first that is read of it: what it is called, and its bytes; None: it is the known one."""
        raise NotImplementedError

    def forget(self, key: str = "") -> None:
        """What came was no good, of "OFFSET-SIZE" or a file; "": all of it. It is to be asked for again."""


class FileSource(Source):
    def __init__(self, path: str) -> None:
        self.name = path
        self._lock = threading.Lock()
        if os.path.exists(path) and not os.path.isfile(path):
            raise SourceError("is no file")  # a named pipe would wait for who writes into it
        try:
            self._file = open(path, "rb")  # noqa: SIM115  for as long as the process runs
        except OSError as error:
            raise SourceError(f"cannot be read: {error.strerror}") from None

    def read(self, offset: int, size: int) -> bytes:
        if size < 0 or offset < 0 or offset + size > os.fstat(self._file.fileno()).st_size:
            raise SourceError(f"cannot be read: ends before byte {offset + size:,}")
        try:
            with self._lock:
                self._file.seek(offset)
                data = self._file.read(size)
        except (OSError, OverflowError, ValueError) as error:
            raise SourceError(f"cannot be read: {error}") from None
        if len(data) != size:
            raise SourceError(f"ends before byte {offset + size:,}")
        return data

    def look(self, known: State | None) -> tuple[State, str, bytes | None]:
        status = os.fstat(self._file.fileno())
        return State(status.st_size, "", str(status.st_mtime_ns)), "", None


class FolderSource(Source):
    def __init__(self, path: str) -> None:
        self.name = path
        self._folder = os.path.dirname(path)

    def file(self, name: str, most: int = MOST_BYTES) -> bytes:
        path = os.path.join(self._folder, name)
        if os.path.exists(path) and not os.path.isfile(path):
            raise SourceError(f"{name} is no file")  # a named pipe would wait for who writes into it
        try:
            with open(path, "rb") as file:
                size = os.fstat(file.fileno()).st_size
                if size > most:
                    raise SourceError(f"{name} is larger than {most:,} bytes")
                return file.read(size)  # Python allocates as much as is asked for
        except OSError as error:
            raise SourceError(f"{name} cannot be read: {error.strerror}") from None

    def look(self, known: State | None) -> tuple[State, str, bytes | None]:
        try:
            status = os.stat(self.name)
        except OSError as error:
            raise SourceError(f"cannot be read: {error.strerror}") from None
        return State(status.st_size, "", str(status.st_mtime_ns)), "", None


class _Web(Source):
    """What a server does wrong is told once it has done so TRIES times."""

    def __init__(self, address: str, timeout: float = TIMEOUT, wait: float = WAIT) -> None:
        self.name = address
        self._timeout, self._wait = timeout, wait

    def _get(self, address: str, part: tuple[int, int] | None, most: int, known: State | None = None) -> tuple[State, bytes | None]:
        """A part of what lies there, (first, last), or all; None in its place: it is as it is known."""
        for attempt in range(TRIES):
            wait = self._wait * 2 ** attempt
            try:
                return self._fetch(address, part, most, known)
            except web.Refused as error:
                raise SourceError(str(error)) from None
            except Slow:  # another try would take as long
                raise
            except web.Busy as error:
                why, kind = str(error), Unreachable
                if (error.wait or 0.0) > MOST_WAIT:
                    raise Unreachable(why) from None
                wait = max(wait, error.wait or 0.0)
            except (SourceError, OSError, http.client.HTTPException, ValueError) as error:
                why = _sentence(error)
                kind = Unreachable if isinstance(error, (Unreachable, OSError, http.client.HTTPException)) else SourceError
            if attempt + 1 < TRIES:
                time.sleep(wait)
        raise kind(f"{why}, {TRIES} times")

    def _fetch(self, address: str, part: tuple[int, int] | None, most: int, known: State | None) -> tuple[State, bytes | None]:
        headers = {"Accept-Encoding": "identity", "User-Agent": "Patina"}
        if part:
            headers["Range"] = f"bytes={part[0]}-{part[1]}"
        if known and known.etag:
            headers["If-None-Match"] = known.etag
        if known and known.modified:
            headers["If-Modified-Since"] = known.modified
        try:
            answer = web.fetch(address, headers, most, self._timeout)
        except urllib.error.HTTPError as error:  # 304
            if known:
                return known, None
            raise web.Refused(f"the server answers {error.code}, which was not asked for") from None
        total = None
        if part:
            if answer.status != 206:
                raise web.Refused(f"the server sends no parts of files (it answers {answer.status} to a range)")
            total = _total(answer.headers.get("Content-Range", ""), *part)
        data, told = answer.data, answer.headers.get("Content-Length", "")
        state = State(total, answer.headers.get("ETag", ""), answer.headers.get("Last-Modified", ""))
        size = part[1] - part[0] + 1 if part else int(told) if told.isascii() and told.isdigit() and len(told) < 19 else len(data)
        if not part and size > most:
            raise web.Refused(f"what the server sends is larger than {most:,} bytes")
        if len(data) != size:
            raise SourceError(f"the server cut the connection after {len(data):,} of {size:,} bytes" if len(data) < size else
                              f"the server sent more than the {size:,} bytes that were asked for")
        return state, data


class WebSource(_Web):
    """One file on a server, of which parts are asked for."""

    _state: State | None = None  # as the server said first

    def read(self, offset: int, size: int) -> bytes:
        state, data = self._get(self.name, (offset, offset + size - 1), size)
        if self._state and not self._state.is_of(state):
            raise SourceError("the file on the server has changed: open it again")
        self._state = self._state or state
        return data

    def look(self, known: State | None) -> tuple[State, str, bytes | None]:
        self._state = known  # where nobody answers, what comes later is held against it
        state, data = self._get(self.name, (0, HEAD - 1), HEAD, known)
        self._state = state
        return (state if data is None else State(state.total, state.etag, state.modified, _hash(data))), f"0-{HEAD}", data


class WebFolder(_Web):
    """Files on a server, beside the one that tells of them."""

    def file(self, name: str, most: int = MOST_BYTES) -> bytes:
        place = urllib.parse.urlsplit(self.name)
        path = place.path.rpartition("/")[0] + "/" + name
        try:
            return self._get(urllib.parse.urlunsplit(place._replace(path=path, fragment="")), None, most)[1]
        except SourceError as error:
            raise type(error)(f"{name}: {error}") from None

    def look(self, known: State | None) -> tuple[State, str, bytes | None]:
        state, data = self._get(self.name, None, MOST_BYTES, known)
        return (state if data is None else State(len(data), state.etag, state.modified, _hash(data))), last_of(self.name), data


class Nowhere(Source):
    """Where nothing may be asked for, and why."""

    def __init__(self, place: str, why: str) -> None:
        self.name, self._why = place, why

    def read(self, offset: int, size: int) -> bytes:
        raise SourceError(self._why)

    def file(self, name: str, most: int = MOST_BYTES) -> bytes:
        raise SourceError(self._why)

    def look(self, known: State | None) -> tuple[State, str, bytes | None]:
        raise Unreachable(self._why)


def _total(told: str, first: int, last: int) -> int | None:
    """Of the file that a part is of, by its Content-Range."""
    found = re.fullmatch(r"bytes ([0-9]{1,18})-([0-9]{1,18})/([0-9]{1,18}|\*)", told[:100].strip())
    if not found or (int(found[1]), int(found[2])) != (first, last):
        raise SourceError(f"the server sent a different part than requested ('{web._plain(told)}')")
    return None if found[3] == "*" else int(found[3])


def _hash(data: bytes) -> str:
    return hashlib.blake2b(data, digest_size=16).hexdigest()


def _sentence(error: Exception) -> str:
    reason = getattr(error, "reason", error)
    if isinstance(reason, TimeoutError) or "timed out" in str(reason):
        return "the server does not answer in time"
    if isinstance(error, http.client.IncompleteRead):
        return f"the server cut the connection after {len(error.partial):,} bytes"
    if isinstance(reason, ConnectionError) or isinstance(error, http.client.HTTPException):
        return f"the connection broke off ({type(reason).__name__})"
    return str(getattr(reason, "strerror", None) or reason)


def source_of(place: str, timeout: float = TIMEOUT, wait: float = WAIT, offline: str = "") -> Source:
    """offline: why nothing may be fetched."""
    if is_address(place):
        if offline:
            return Nowhere(place, offline)
        return (WebFolder if is_ept(place) else WebSource)(place, timeout, wait)
    return (FolderSource if is_ept(place) else FileSource)(place)
