# SPDX-License-Identifier: GPL-3.0-or-later
"""A source of which a shelf keeps what came. Knows neither Blender nor the library, and runs in the process that reads."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import shelf
from source import MOST_BYTES, Resting, Source, SourceError, State, Unreachable

MOST_FAILURES, REST = 3, 60.0  # parts in a row that could not be fetched; seconds for which nobody is asked then


class Kept(Source):
    """What is there of another version than the file's own is thrown away."""

    keeps = True

    def __init__(self, source: Source, keep: shelf.Shelf, folder: Path) -> None:
        """SourceError where nobody answers and nothing is kept of it."""
        self.name, self.away = source.name, ""  # away: why nobody could be asked whether it is still the same
        self._source, self._shelf = source, keep
        self._failures, self._rests_until, self._why = 0, 0.0, ""
        own = shelf.place_of(folder, source.name)
        told = shelf.about(own)
        version = told.pop("version") if told else ""
        known = State(**told) if told else None
        key = data = None
        try:
            state, key, data = source.look(known)
        except Unreachable as error:
            if known is None:
                raise
            state, self.away = known, str(error)
        if known is None or not known.is_of(state):
            old, version = version, os.urandom(8).hex()
            keep.write(own / shelf.ABOUT, json.dumps({"place": source.name.partition("?")[0], "version": version, **asdict(state)}).encode())
            if old:
                shutil.rmtree(own / old, ignore_errors=True)
        self._own = own / version
        if data is not None:
            self._put(key, data)

    def read(self, offset: int, size: int) -> bytes:
        return self._get(f"{offset}-{size}", lambda: self._source.read(offset, size))

    def file(self, name: str, most: int = MOST_BYTES) -> bytes:
        return self._get(name, lambda: self._source.file(name, most))

    def forget(self, key: str = "") -> None:
        if key:
            with contextlib.suppress(OSError):
                self._path(key).unlink()
        elif not self.away and not self._failures:  # what is kept may be as good as ever
            shutil.rmtree(self._own, ignore_errors=True)

    def _get(self, key: str, fetch: Callable[[], bytes]) -> bytes:
        if not self.settled:
            self._shelf.last.append(self._path(key))
        data = self._shelf.take(self._path(key), key)
        if data is None:
            if time.monotonic() < self._rests_until:
                raise Resting(self._why)
            try:
                data = fetch()
            except SourceError as error:
                self._why = f"{error}, and the cache does not hold it" if self.away else str(error)
                self._failures += 1
                if self._failures >= MOST_FAILURES:
                    self._rests_until = time.monotonic() + REST
                raise type(error)(self._why) from None
            self._failures = 0
            self._put(key, data)
        return data

    def _put(self, key: str, data: bytes) -> None:
        self._shelf.put(self._path(key), key, data)

    def _path(self, key: str) -> Path:
        return self._own / (key.replace("/", "_") + shelf.ENDING)


def kept(source: Source, folder: str, most: int, tell: Callable[[str], None]) -> Source:
    """The source with a shelf in a folder, of at most so many bytes. tell: of what the artist should know."""
    found = Kept(source, shelf.Shelf(Path(folder), most, tell), Path(folder))
    if found.away:
        tell(f"shown is what the cache holds: {found.away}")
    return found
