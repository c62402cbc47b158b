# SPDX-License-Identifier: GPL-3.0-or-later
"""What is in the folder of caches: clouds of linked files, and packed files put down to be read; and what was fetched of addresses. All
can be made or fetched anew."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import bpy

from ... import choices
from ...read import streaming
from ...read.streaming import shelf
from ...read.streaming.address import is_address
from . import kept


def held() -> tuple[int, int]:
    """Clouds and packed files in it, and the bytes of all."""
    return sum(path.suffix not in {".json", ".scan"} for path in _files()), sum(path.stat().st_size for path in _files())


def clear() -> tuple[int, int]:
    """Deletes them; how many files, and bytes, are gone."""
    count = size = 0
    for path in _files():
        try:
            held_bytes = path.stat().st_size
            path.unlink()
        except OSError:  # another Blender's, which Windows holds fast
            continue
        count, size = count + 1, size + held_bytes
    return count, size


def _files() -> Iterator[Path]:
    return (path for path in kept.folder().iterdir() if (kept.is_of_scan(path) or kept.is_packed(path)) and path.is_file())


def keep_of(place: str) -> streaming.Keep | None:
    """Where what is fetched of a path or an address is kept; None where the artist does not want that."""
    known = choices.get()
    if not known or known.keep_pages == 'OFF' or known.keep_pages == 'ADDRESSES' and not is_address(place):
        return None
    return streaming.Keep(pages_folder(), choices.GIGA * known.pages_limit)


def pages_folder() -> Path:
    """Of what was fetched. It need not be there."""
    known = choices.get()
    return Path(bpy.path.abspath(known.pages_folder)) if known and known.pages_folder else kept.folder() / "pages"


def pages_held() -> tuple[int, int]:
    """How many parts of files, and bytes, are kept."""
    sizes = [size for _, size, _ in shelf.files(pages_folder())]
    return len(sizes), sum(sizes)


def clear_pages() -> tuple[int, int]:
    """Deletes them; how many, and bytes, are gone."""
    return shelf.clear(pages_folder())
