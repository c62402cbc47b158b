# SPDX-License-Identifier: GPL-3.0-or-later
"""The process that unpacks one file: main.py SLOTS. Its first line of input is JSON: kind, path, slot (bytes), slots, limit (bytes of
memory), and what the kind needs. Each answer is a line of JSON: {"slot", "count"} once a slot is written, {"end"}, or {"error"}. The
other side sends {"free": slot} back. It ends with its input.
"""

from __future__ import annotations

import json
import mmap
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent))
from limits import limit_memory  # noqa: E402


class Channel:
    def __init__(self, path: str, slot: int, slots: int) -> None:
        with open(path, "rb+") as file:
            self._map = memoryview(mmap.mmap(file.fileno(), slot * slots))
        self._size, self._free = slot, list(range(slots))

    def slot(self) -> tuple[int, memoryview]:
        """A free slot and its memory; waits for one."""
        while not self._free:
            words = self.listen()
            self._free.append(words["free"])
        slot = self._free.pop()
        return slot, self._map[slot * self._size:(slot + 1) * self._size]

    def listen(self) -> dict[str, Any]:
        """The next line of input; frees slots on the way if the caller waits for something else."""
        line = sys.stdin.buffer.readline()
        if not line:
            os._exit(0)
        return json.loads(line)

    def orders(self) -> Iterator[dict[str, Any]]:
        """Lines of input that are no returned slots."""
        while True:
            words = self.listen()
            if "free" in words:
                self._free.append(words["free"])
            else:
                yield words

    def say(self, words: dict[str, Any]) -> None:
        sys.stdout.buffer.write(json.dumps(words).encode() + b"\n")
        sys.stdout.buffer.flush()


def run(kind: str) -> Callable[[str, dict[str, Any], Channel], None]:
    if kind == "laz":
        import laz
        return laz.run
    import e57
    return e57.run


def main() -> None:
    order = json.loads(sys.stdin.buffer.readline())
    path = os.fsdecode(order["path"].encode("latin-1"))
    channel = Channel(sys.argv[1], order["slot"], order["slots"])
    try:
        work = run(order["kind"])
        limit_memory(order["limit"])
        work(path, order, channel)
    except ImportError as error:
        channel.say({"error": f"cannot be unpacked: {error}", "code": -5})
    except MemoryError:
        channel.say({"error": f"unpacking it needs more than {order['limit'] / 1e6:,.0f} MB of memory. The file may be damaged", "code": -2})
    except BaseException as error:  # also what lazrs has not thought of, which is none of Exception's kinds
        text = next(iter(str(error).strip().splitlines()), type(error).__name__)[:300]
        channel.say({"error": f"cannot be unpacked: {text}"})
    os._exit(0)


if __name__ == "__main__":
    main()
