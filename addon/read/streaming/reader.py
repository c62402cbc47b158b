# SPDX-License-Identifier: GPL-3.0-or-later
"""The process that reads and unpacks the pages of a COPC, or of a folder of EPT, beside Blender: python reader.py FOLDER. Blender must not run
Python on threads of its own while it goes on (jobs.py), nor wait for a disk or a server.

Each line of its input is JSON: first {"place", "scalar", "workers", "timeout", "wait", "keep", "offline"}, then {"pages": [...]}, which takes the
place of all that was asked for and is not yet begun. What it finds goes into the folder, each file whole or not at all: tree.json and tree.bin,
N.page with a page's columns one behind the other, N.bad with a sentence, N.note with one that the artist should know of, down with one where
nothing can be fetched any more, error with one that ends it. It ends with its input.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys
import threading
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parents[1] / "unpacking")]
import copc  # noqa: E402
import ept  # noqa: E402
from address import is_ept  # noqa: E402
from kept import kept  # noqa: E402
from limits import limit_memory  # noqa: E402
from source import MEMORY, Resting, SourceError, budget, source_of  # noqa: E402

MOST_FAILURES = 3  # pages in a row that cannot be fetched: then nothing else is tried until somebody asks again
MOST_WAITING = 64  # pages that lie there until Blender takes them
WAITING_BYTES = 1 << 29  # of these pages


class Reader:
    def __init__(self, folder: Path, wanted: dict) -> None:
        self._folder, self._scalar, self._notes = folder, wanted.get("scalar", ""), 0
        place, keep = wanted["place"], wanted.get("keep")
        self._source = source_of(place, wanted.get("timeout", 10.0), wanted.get("wait", 0.5), wanted.get("offline", ""))
        if keep:
            self._source = kept(self._source, keep["folder"], keep["bytes"], self._note)
        self._kind = ept if is_ept(place) else copc
        try:
            self._tree = self._kind.read_tree(self._source)
            with budget.of(self._kind.cost(self._tree, 0)):
                first = self._kind.fetch(self._tree, 0, self._source)
                self._kind.learn(self._tree, first, self._kind.unpack(self._tree, 0, first))
            del first
        except Exception as error:
            if not isinstance(error, (ImportError, MemoryError)):
                self._source.forget()
            raise
        self._source.settled = True
        self._scalar = self._scalar if self._kind.has_scalar(self._tree, self._scalar) else ""
        self._queue: list[int] = []
        self._done: set[int] = set()
        self._failures = 0
        self._change = threading.Condition()
        self._tell_tree()
        for _ in range(wanted.get("workers", 2)):
            threading.Thread(target=self._work, daemon=True).start()

    def _note(self, text: str) -> None:
        self._notes += 1
        self._put(f"{self._notes}.note", text.encode("utf-8", "replace"))

    def _tell_tree(self) -> None:
        tree = self._tree
        self._put("tree.bin", tree.cubes.astype("<f8").tobytes() + tree.gaps.astype("<f8").tobytes()
                  + tree.nodes["count"].astype("<u4").tobytes() + tree.parents.astype("<i4").tobytes()
                  + tree.nodes["size"].astype("<u4").tobytes())
        self._put("tree.json", json.dumps({
            "nodes": len(tree.nodes), "color": tree.color, "scalar": self._scalar, "origin": tree.origin.tolist(), "wkt": tree.wkt,
            "lower": (tree.lower - tree.origin).tolist(), "upper": (tree.upper - tree.origin).tolist()}).encode())

    def ask(self, pages: list[int]) -> None:
        with self._change:
            self._failures = 0
            self._queue = [page for page in pages if 0 <= page < len(self._tree.nodes) and page not in self._done]
            self._change.notify_all()

    def forget(self, pages: list[int]) -> None:
        """That were given back, and may be asked for again."""
        with self._change:
            self._done -= set(pages)

    def _next(self) -> int:
        with self._change:
            while True:
                if self._queue and self._has_room():
                    page = self._queue.pop(0)
                    self._done.add(page)
                    return page
                self._change.wait(0.01 if self._queue else None)

    def _has_room(self) -> bool:
        """Whether Blender has taken enough of what lies there."""
        count = size = 0
        with os.scandir(self._folder) as found:
            for entry in found:
                if entry.name.endswith(".page"):
                    with contextlib.suppress(FileNotFoundError):
                        count, size = count + 1, size + entry.stat().st_size
        return count < MOST_WAITING and size < WAITING_BYTES

    def _work(self) -> None:
        while True:
            page = self._next()
            try:
                self._give(page)
            except OSError:  # the folder is gone: so is Blender
                os._exit(1)

    def _give(self, page: int) -> None:
        try:
            with budget.of(self._kind.cost(self._tree, page)):
                self._unpack(page)
        except OSError:
            raise
        except SourceError as error:  # it needs more memory than there is
            self._lose(page, f"page {page}: {error}")
        except Exception as error:  # of a reader: who waits for the page is told
            self._lose(page, f"page {page}: {type(error).__name__}: {error}")

    def _lose(self, page: int, why: str) -> None:
        with self._change:
            self._done.discard(page)
        self._put(f"{page}.bad", why.encode("utf-8", "replace"))

    def _unpack(self, page: int) -> None:
        try:
            data = self._kind.fetch(self._tree, page, self._source)
        except SourceError as error:
            with self._change:
                self._failures += 1
                down = self._failures >= MOST_FAILURES and not self._source.keeps
                if down:
                    self._done.discard(page)
                    self._queue = []
            text = str(error) if isinstance(error, Resting) else f"page {page}: {error}"
            if down:
                self._put("down", text.encode("utf-8", "replace"))
            else:
                self._lose(page, text)
            return
        with self._change:
            self._failures = 0
        try:
            records = self._kind.unpack(self._tree, page, data)
            found = self._kind.columns(self._tree, page, records, self._scalar)
        except SourceError as error:
            self._source.forget(self._kind.key_of(self._tree, page))
            self._lose(page, f"page {page}: {error}")
            return
        self._put(f"{page}.page", b"".join(found[name].tobytes() for name in ("positions", "colors", "scalars", "classes")
                                           if name in found))

    def _put(self, name: str, data: bytes) -> None:
        part = self._folder / f"{name}.part"
        part.write_bytes(data)
        os.replace(part, self._folder / name)


def main() -> None:
    folder = Path(sys.argv[1])
    limit_memory(3 * MEMORY)
    try:
        reader = Reader(folder, json.loads(sys.stdin.readline()))
    except Exception as error:
        text = str(error) if isinstance(error, SourceError) else f"{type(error).__name__}: {error}"
        part = folder / "error.part"
        part.write_text(text, "utf-8")
        os.replace(part, folder / "error")
        return
    for line in sys.stdin:
        wish = json.loads(line)
        if "forget" in wish:
            reader.forget(wish["forget"])
        if "pages" in wish:
            reader.ask(wish["pages"])
    os._exit(0)  # workers may wait for a server


if __name__ == "__main__":
    main()
