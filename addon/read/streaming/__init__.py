# SPDX-License-Identifier: GPL-3.0-or-later
"""COPC and EPT without conversion: clouds whose pages are read as pictures want them. reader.py reads, in a process of its own; here its pages are
looked for and handed to the library, without waiting. Knows no Blender.

address.py, copc.py, ept.py, source.py, kept.py and reader.py are that process's and import nothing of the add-on's.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import threading
import time
import weakref
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ... import jobs, memory, native, whole
from .. import programs

MOST_TASKS = 24  # pages that are handed in at once: where drawing is slow, Blender looks but a few times a second
ROOM = 4096  # pages that are asked for at once
AT_REST = 1.0  # pixels: the viewport wants pages whose parents' points lie wider apart
POLL = 0.001  # seconds between two looks for the head of a file
MEMORY_SHARE = 0.5  # of what is free, for points that arrived

# How the process that reads waits for servers; tests are in a hurry.
TIMEOUT, WAIT = 10.0, 0.5


@dataclass(frozen=True)
class Outlook:
    """What is on its way."""

    points: int
    megabytes: float  # as they lie in the file


@dataclass(frozen=True)
class Keep:
    """Where what is read is kept, and how many bytes all of it may take."""

    folder: Path
    bytes: int


class Stream:
    """The pages of one cloud. One call at a time."""

    def __init__(self, place: str, scalar: str = "", keep: Keep | None = None, offline: str = "") -> None:
        """offline: why nothing may be fetched; then what is kept is all there is."""
        self.place = place
        self._cloud: weakref.ref[native.Cloud] | None = None  # which keeps this one
        self.origin = (0.0, 0.0, 0.0)
        self.wkt = ""
        self.message = ""  # what went wrong last, with the address and the page
        self.notes: list[str] = []  # what the artist should know beside, with the address: nothing lacks for it
        self.arrived = 0  # pages so far
        self.has_scalar = False
        self._lock = threading.RLock()  # a final picture's thread, and Blender's
        try:
            self._folder = whole.Folder("patina-pages-")
        except OSError as error:
            raise native.PatinaError(f"{place}: the folder for temporary files cannot be written: {error.strerror}", -3) from None
        self._place = self._folder.path
        self._asked: dict[int, None] = {}  # pages in the order of their being wanted
        self._tasks: list[tuple[int, native.Task]] = []
        self._bad: set[int] = set()
        self._offline = bool(offline)
        self._down = False  # nothing can be fetched: until somebody tries again
        self._returned = self._seen = 0
        self._here: set[int] = set()
        try:
            self._process = subprocess.Popen([*programs.command(Path(__file__).with_name("reader.py")), str(self._place)],
                                             stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        except OSError as error:
            raise native.PatinaError(f"{place}: the reading process does not start: {error.strerror}", -3) from None
        self._finalizer = weakref.finalize(self, _finish, self._process, self._folder)
        self._say({"place": place, "scalar": scalar, "workers": min(os.cpu_count() or 1, 8), "timeout": TIMEOUT, "wait": WAIT,
                   "keep": keep and {"folder": str(keep.folder), "bytes": keep.bytes}, "offline": offline})

    def close(self) -> None:
        self._finalizer()

    @property
    def cloud(self) -> native.Cloud:
        return self._cloud()

    # ---- its head

    def steps(self, stopped) -> jobs.Steps[native.Cloud]:
        """The cloud, once the tree of its pages is known. stopped: raises where nobody waits any more."""
        while not (self._place / "tree.json").exists():
            stopped()
            error = self._place / "error"
            if error.exists():
                raise native.PatinaError(f"{self.place}: {error.read_text('utf-8')}", -4)
            if self._process.poll() is not None and not error.exists():
                raise native.PatinaError(f"{self.place}: the process that reads it has ended ({self._process.returncode})", -10)
            time.sleep(POLL)
            yield jobs.Pause()
        return self._begin(json.loads((self._place / "tree.json").read_text("utf-8")))

    def _begin(self, told: dict) -> native.Cloud:
        count = told["nodes"]
        raw = (self._place / "tree.bin").read_bytes()
        parts, at = [], 0
        for kind, width in (("<f8", 6), ("<f8", 1), ("<u4", 1), ("<i4", 1), ("<u4", 1)):
            parts.append(np.frombuffer(raw, kind, count * width, at))
            at += parts[-1].nbytes
        boxes, gaps, self._counts, parents, self._sizes = parts
        self._coarse_first = np.argsort(-gaps, kind="stable")
        self._color = {"low": "uint8", "high": "uint8", "wide": "uint16"}.get(told["color"], "")
        self.has_scalar = bool(told["scalar"])
        self.origin, self.wkt = tuple(told["origin"]), told["wkt"]
        left = memory.free()
        cloud = native.Cloud.begin(boxes.reshape(-1, 6), gaps, self._counts, parents, self._color, self.has_scalar, True,
                                        (told["lower"], told["upper"]), int(MEMORY_SHARE * left) if left else 0)
        cloud.stream, self._cloud = self, weakref.ref(cloud)
        for name in os.listdir(self._place):
            self._note(name)
        return cloud

    # ---- its pages

    def wish(self, least_px: float, room: int | None = None) -> int:
        """Asks for what pictures wanted since the last call, in place of what was asked for before: the first of it, where it is much.
        PatinaError, and nothing is asked for, where all of it takes more memory than room, in bytes; returns how much that is (0 without room)."""
        with self._lock:
            if self._down:
                return 0
            self._notice_returned()
            found = self.cloud.wanted(least_px, ROOM)
            size = self._size_of_wanted() if room is not None else 0
            if room is not None and size > room:
                self._asked = {}
                self._say({"pages": []})
                raise native.PatinaError(f"{self.place}: the picture shows points that are not there yet and take {size / 1e9:,.1f} GB of memory, "
                                         f"where {room / 1e9:,.1f} are free. Look at less of it, or choose Linked File > Read Whole, which draws "
                                         "from the disk", native.MEMORY)
            coming = {page for page, _ in self._tasks}
            wanted = {page: None for page in found if page not in self._bad and page not in coming}
            if list(wanted) != list(self._asked):
                self._asked = wanted
                self._say({"pages": list(wanted)})
            return size

    def coarsest(self, points: int) -> bool:
        """Asks for the coarsest pages, beside what pictures want: as many as hold so many points. Whether they are there, or cannot come."""
        with self._lock:
            self._notice_returned()
            reach = int(np.searchsorted(np.cumsum(self._counts[self._coarse_first], dtype=np.int64), points)) + 1
            coming = {page for page, _ in self._tasks}
            lacking = [page for page in self._coarse_first[:reach].tolist() if page not in self._here and page not in self._bad]
            new = {page: None for page in lacking if page not in self._asked and page not in coming}
            if new and not self._down:
                self._asked = {**new, **self._asked}
                self._say({"pages": list(self._asked)})
            return self._down or not lacking

    def _size_of_wanted(self) -> int:
        """Bytes; 0 where nothing is fetched. What is there already may be given back for it."""
        pages = self.cloud.pages()
        lacking = pages["wanted"] - sum(int(self._counts[page]) for page in self._bad)
        each = 21 + {"uint8": 3, "uint16": 12}.get(self._color, 0) + 4 * self.has_scalar
        return 0 if self._offline else max(lacking - pages["arrived"], 0) * each

    def _notice_returned(self) -> None:
        """Pages that the library gave back may come again."""
        returned = self.cloud.pages()["returned"]
        if returned != self._returned:
            self._returned = returned
            self._say({"forget": sorted(self._here)})  # those that are there are not asked for
            self._here.clear()

    def advance(self) -> bool:
        """Hands in what has come. Whether a picture would show more now."""
        with self._lock:
            for task in [item for item in self._tasks if item[1].done()]:
                self._tasks.remove(task)
                self._end(*task)
            for name in sorted(os.listdir(self._place), key=self._rank):
                page, _, kind = name.partition(".")
                if name == "down":
                    self.message = f"{self.place}: {(self._place / name).read_text('utf-8')}"
                    (self._place / name).unlink()
                    self._asked, self._down = {}, True
                if not page.isdigit():
                    continue
                self._note(name)
                if kind == "bad":
                    self._lose(int(page), (self._place / name).read_text("utf-8"))
                    (self._place / name).unlink()
                elif kind == "page" and len(self._tasks) < MOST_TASKS and not any(int(page) == other for other, _ in self._tasks):
                    self._hand_in(int(page))
            if self._asked and not self._tasks and self._process.poll() is not None:
                self.message = f"{self.place}: the process that reads it has ended"
                self._asked = {}
            news, self._seen = self.arrived != self._seen, self.arrived
            return news

    def _note(self, name: str) -> None:
        if name.endswith(".note"):
            self.notes.append(f"{self.place}: {(self._place / name).read_text('utf-8')}")
            (self._place / name).unlink()

    def _rank(self, name: str) -> int:
        page = name.partition(".")[0]
        return int(page) if page.isdigit() else 0

    def _hand_in(self, page: int) -> None:
        path = self._place / f"{page}.page"
        raw = path.read_bytes()
        path.unlink()
        count, at, found = int(self._counts[page]), 0, {}
        for name, kind, width in (("positions", "float32", 3), ("colors", self._color, 3), ("scalars", "float32" * self.has_scalar, 1),
                                  ("classes", "uint8", 1)):
            if kind:
                found[name] = np.frombuffer(raw, kind, count * width, at).reshape(count, width)
                at += found[name].nbytes
        self._tasks.append((page, self.cloud.start_page(page, found["positions"], found.get("colors"), found.get("scalars"),
                                                        found["classes"])))

    def _end(self, page: int, task: native.Task) -> None:
        self._asked.pop(page, None)
        try:
            task.result()
            self._here.add(page)
            self.arrived += 1
        except native.PatinaError as error:
            if "there already" not in str(error):
                self._lose(page, str(error))

    def _lose(self, page: int, why: str) -> None:
        self._asked.pop(page, None)
        self._bad.add(page)
        self.message = f"{self.place}: {why}"

    @property
    def busy(self) -> bool:
        return bool(self._asked or self._tasks)

    def try_again(self) -> None:
        """What could not be read may be asked for once more."""
        with self._lock:
            self._bad.clear()
            self._down, self.message = False, ""

    def outlook(self) -> Outlook:
        with self._lock:
            pages = list({**self._asked, **{page: None for page, _ in self._tasks}})
            return Outlook(int(self._counts[pages].sum()) if pages else 0, float(self._sizes[pages].sum()) / 1e6 if pages else 0.0)

    def _say(self, words: dict) -> None:
        with contextlib.suppress(OSError):  # it has ended, which others tell
            self._process.stdin.write(json.dumps(words).encode() + b"\n")
            self._process.stdin.flush()


def _finish(process: subprocess.Popen, folder: whole.Folder) -> None:
    with contextlib.suppress(OSError):
        process.stdin.close()
    try:
        process.wait(0.1)  # it may read from a server; what it leaves half-written nobody takes
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    folder.cleanup()


def streams_of(clouds: Iterator[native.Cloud]) -> list[Stream]:
    """Each once."""
    found: list[Stream] = []
    for cloud in clouds:
        stream = getattr(cloud, "stream", None)
        if stream is not None and not any(stream is other for other in found):
            found.append(stream)
    return found
