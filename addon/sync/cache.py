# SPDX-License-Identifier: GPL-3.0-or-later
"""What is in the folder of caches: clouds of linked files, and packed files put down to be read. All can be made anew."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from . import kept

_KEPT = ("*.cloud", "*.json", "*.scan", "*-packed.*")


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
    place = kept.folder()
    return (path for pattern in _KEPT for path in place.glob(pattern) if path.is_file())
