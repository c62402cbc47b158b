# SPDX-License-Identifier: GPL-3.0-or-later
"""Bytes of a file, or of an address by HTTP(S) range requests. Knows neither Blender nor the library, and runs in a process of its own."""

from __future__ import annotations

import http.client
import re
import threading
import time
import urllib.error
import urllib.request

TIMEOUT = 20.0  # seconds without a byte
TRIES = 3
WAIT = 0.5  # seconds before the second one, twice as long before each further one


class SourceError(Exception):
    """The text is for the artist; who catches it says where."""


class Source:
    """read() from any thread."""

    name = ""

    def read(self, offset: int, size: int) -> bytes:
        raise NotImplementedError


class FileSource(Source):
    def __init__(self, path: str) -> None:
        self.name = path
        self._lock = threading.Lock()
        try:
            self._file = open(path, "rb")  # noqa: SIM115  for as long as the process runs
        except OSError as error:
            raise SourceError(f"cannot be read: {error.strerror}") from None

    def read(self, offset: int, size: int) -> bytes:
        try:
            with self._lock:
                self._file.seek(offset)
                data = self._file.read(size)
        except (OSError, OverflowError, ValueError) as error:
            raise SourceError(f"cannot be read: {error}") from None
        if len(data) != size:
            raise SourceError(f"ends before byte {offset + size:,}")
        return data


class WebSource(Source):
    """What a server does wrong is told once it has done so TRIES times."""

    def __init__(self, address: str, timeout: float = TIMEOUT, wait: float = WAIT) -> None:
        self.name = address
        self._timeout, self._wait = timeout, wait
        self._total: int | None = None  # bytes, as the server said first

    def read(self, offset: int, size: int) -> bytes:
        for attempt in range(TRIES):
            try:
                return self._fetch(offset, size)
            except _Final as error:
                raise SourceError(str(error)) from None
            except (SourceError, OSError, http.client.HTTPException, ValueError) as error:
                why = _sentence(error)
            if attempt + 1 < TRIES:
                time.sleep(self._wait * 2 ** attempt)
        raise SourceError(f"{why}, {TRIES} times")

    def _fetch(self, offset: int, size: int) -> bytes:
        last = offset + size - 1
        request = urllib.request.Request(self.name, headers={"Range": f"bytes={offset}-{last}", "Accept-Encoding": "identity",
                                                             "User-Agent": "Patina"})
        try:
            answer = urllib.request.urlopen(request, timeout=self._timeout)  # noqa: S310  http and https alone: source_of
        except urllib.error.HTTPError as error:
            code = error.code
            error.close()
            if code in {408, 425, 429} or code >= 500:
                raise SourceError(f"the server answers {code}") from None
            raise _Final(f"the server answers {code} {error.reason}") from None
        with answer:
            if answer.status != 206:
                raise _Final(f"the server sends no parts of files (it answers {answer.status} to a range)")
            self._check_range(answer.headers.get("Content-Range", ""), offset, last)
            data = answer.read(size + 1)
        if len(data) != size:
            raise SourceError(f"the server cut the connection after {len(data):,} of {size:,} bytes" if len(data) < size else
                              f"the server sent more than the {size:,} bytes that were asked for")
        return data

    def _check_range(self, told: str, offset: int, last: int) -> None:
        found = re.fullmatch(r"bytes (\d+)-(\d+)/(\d+|\*)", told.strip())
        if not found or (int(found[1]), int(found[2])) != (offset, last):
            raise SourceError(f"the server sent another part than was asked for ('{told[:60]}')")
        total = None if found[3] == "*" else int(found[3])
        if self._total is not None and total is not None and total != self._total:
            raise _Final("the file on the server has changed: open it again")
        self._total = self._total or total


class _Final(Exception):
    """Another try would not help."""


def _sentence(error: Exception) -> str:
    reason = getattr(error, "reason", error)
    if isinstance(reason, TimeoutError) or "timed out" in str(reason):
        return "the server does not answer in time"
    if isinstance(error, http.client.IncompleteRead):
        return f"the server cut the connection after {len(error.partial):,} bytes"
    if isinstance(reason, ConnectionError) or isinstance(error, http.client.HTTPException):
        return f"the connection broke off ({type(reason).__name__})"
    return str(getattr(reason, "strerror", None) or reason)


def is_address(place: str) -> bool:
    return place.lower().startswith(("http://", "https://"))


def source_of(place: str, timeout: float = TIMEOUT, wait: float = WAIT) -> Source:
    return WebSource(place, timeout, wait) if is_address(place) else FileSource(place)
