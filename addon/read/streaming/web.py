# SPDX-License-Identifier: GPL-3.0-or-later
"""One HTTP(S) request, with limits: its bytes, its redirects, and its time by progress. Imports nothing of the add-on, and runs in the process
that streams.

A socket's timeout alone bounds no request: a server may send a byte now and then, or "100 Continue" for ever. A thread watches all requests,
and shuts a connection down that gets less than PACE bytes in each timeout (10 s: 2 kB/s) after the first three.
"""

from __future__ import annotations

import contextlib
import email.utils
import http.client
import socket
import threading
import time
import urllib.error
import urllib.parse
import urllib.request
from dataclasses import dataclass, field
from email.message import Message
from typing import Any

REDIRECTS = 5
PACE = 20_000  # bytes for which a request may take another timeout
LOOK = 0.05  # seconds between two looks at the requests
TIMEOUTS = 3  # that a request may take before its first PACE bytes are there
PIECE = 1 << 16


class SourceError(Exception):
    """The text is for the artist; who catches it says where. What a file or a server says in it is no more than text: without control characters."""

    def __init__(self, text: str = "") -> None:
        super().__init__("".join(letter if letter.isprintable() or letter in " \u00a0" else "?" for letter in text[:1000]))


class Unreachable(SourceError):
    """Nobody answers: the file may be as it was."""


class Slow(Unreachable):
    """What arrives arrives too slowly: another try would take as long."""


class Refused(Exception):
    """Another try would not help."""


@dataclass
class Answer:
    status: int
    headers: Message
    data: bytes


class Busy(Exception):
    """The server cannot answer now. wait: seconds that it asks for, if it does."""

    def __init__(self, text: str, wait: float | None) -> None:
        super().__init__(text)
        self.wait = wait


@dataclass
class _Request:
    timeout: float
    began: float = field(default_factory=time.monotonic)
    received: int = 0
    late: bool = False
    sockets: list[socket.socket] = field(default_factory=list)  # copies, which end the connection in each of its states


class _Watch:
    def __init__(self) -> None:
        self._change = threading.Condition()
        self._requests: list[_Request] = []
        self._thread: threading.Thread | None = None

    @contextlib.contextmanager
    def over(self, request: _Request):
        with self._change:
            self._requests.append(request)
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, daemon=True)
                self._thread.start()
            self._change.notify()
        _now.request = request
        try:
            yield
        finally:
            _now.request = None
            with self._change:
                self._requests.remove(request)
                for copy in request.sockets:
                    copy.close()

    def _run(self) -> None:
        while True:
            with self._change:
                while not self._requests:
                    self._change.wait()
                for request in self._requests:
                    if time.monotonic() - request.began > request.timeout * (TIMEOUTS + request.received / PACE):
                        request.late = True
                        for copy in request.sockets:
                            with contextlib.suppress(OSError):
                                copy.shutdown(socket.SHUT_RDWR)
            time.sleep(LOOK)


_now = threading.local()  # the request of a thread
_watch = _Watch()


def _connect(*arguments: Any, **options: Any) -> socket.socket:
    found = socket.create_connection(*arguments, **options)
    request = getattr(_now, "request", None)
    if request is not None:
        request.sockets.append(found.dup())
    return found


class _Connection(http.client.HTTPConnection):
    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._create_connection = _connect


class _SafeConnection(http.client.HTTPSConnection):
    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._create_connection = _connect


class _Http(urllib.request.HTTPHandler):
    def http_open(self, request: urllib.request.Request) -> http.client.HTTPResponse:
        return self.do_open(_Connection, request)


class _Https(urllib.request.HTTPSHandler):
    def https_open(self, request: urllib.request.Request) -> http.client.HTTPResponse:
        return self.do_open(_SafeConnection, request, context=self._context)


def _opener() -> urllib.request.OpenerDirector:
    """HTTP and HTTPS, through proxies; no other scheme, and no redirects, whose bodies urllib reads without a limit."""
    found = urllib.request.OpenerDirector()
    for handler in (urllib.request.ProxyHandler, _Http, _Https, urllib.request.HTTPDefaultErrorHandler, urllib.request.HTTPErrorProcessor):
        found.add_handler(handler())
    return found


def fetch(address: str, headers: dict[str, str], most: int, timeout: float) -> Answer:
    """What a server answers: its first most + 1 bytes. Raises Refused, Busy, Slow, urllib.error.HTTPError for 304, OSError and HTTPException."""
    request = _Request(timeout)
    with _watch.over(request):
        try:
            return _follow(address, headers, most, timeout, request)
        except (OSError, http.client.HTTPException, ValueError) as error:
            reason = getattr(error, "reason", error)
            if request.late:
                raise _slow(request) from None
            if isinstance(reason, TimeoutError) or "timed out" in str(reason):
                raise Unreachable("the server does not answer in time") from None
            raise


def _slow(request: _Request) -> Slow:
    seconds = time.monotonic() - request.began
    return Slow(f"the server is too slow: {request.received:,} bytes in {seconds:.0f} seconds" if request.received else
                "the server does not answer in time")


def _follow(address: str, headers: dict[str, str], most: int, timeout: float, request: _Request) -> Answer:
    opener = _opener()
    for _ in range(REDIRECTS + 1):
        try:
            answer = opener.open(urllib.request.Request(address, headers=headers), timeout=timeout)  # noqa: S310  http and https alone
        except urllib.error.HTTPError as error:
            with error:
                address = _next(address, error)
            continue
        if answer is None:
            raise Refused(f"'{address.partition(':')[0][:20]}' is no scheme that is opened")
        with answer:
            packed = answer.headers.get("Content-Encoding", "").strip().lower()
            if packed not in {"", "identity"}:
                raise Refused(f"the server sends its answer packed as '{_plain(packed)}', which was not asked for")
            pieces = []
            while request.received <= most:
                piece = answer.read1(min(PIECE, most + 1 - request.received))
                if not piece:
                    break
                pieces.append(piece)
                request.received += len(piece)
            if request.late:
                raise _slow(request)
            return Answer(answer.status, answer.headers, b"".join(pieces))
    raise Refused(f"the server leads from one address to the next, more than {REDIRECTS} times")


def _next(address: str, error: urllib.error.HTTPError) -> str:
    """Where an answer leads. Raises what it says in all other cases."""
    code, place = error.code, error.headers.get("Location", "")
    if code == 304:
        raise error
    if code in {301, 302, 303, 307, 308} and place:
        found = urllib.parse.urljoin(address, place)
        if not found.lower().startswith(("http://", "https://")):
            raise Refused(f"the server leads to an address of '{_plain(found.partition(':')[0])}', which is not opened")
        return found
    if code in {408, 425, 429} or code >= 500:
        wait = _wait(error.headers.get("Retry-After", ""))
        raise Busy(f"the server answers {code}" + (f" and asks to wait {wait:,.0f} seconds" if wait else ""), wait)
    raise Refused(f"the server answers {code} {_plain(str(error.reason))}")


def _wait(text: str) -> float | None:
    """Seconds, of a number or a date."""
    text = text.strip()
    if text.isascii() and text.isdigit():
        return float(text) if len(text) < 10 else 1e9
    with contextlib.suppress(TypeError, ValueError, OverflowError):
        return max(0.0, email.utils.parsedate_to_datetime(text).timestamp() - time.time())
    return None


def _plain(text: str) -> str:
    """A server's words: short, and without control characters."""
    return "".join(letter if letter.isprintable() else "?" for letter in text[:60])
