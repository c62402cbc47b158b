# SPDX-License-Identifier: GPL-3.0-or-later
"""Which file of a sequence shows at a frame. Plain: no Blender, no library.

The name holds number signs where the files' names hold digits: scan_####.ply is scan_0001.ply, scan_0002.ply and so on.
"""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path

_SIGNS = re.compile("#+")


def is_pattern(path: Path) -> bool:
    return "#" in path.name and not path.is_file()


def pattern_of(path: Path) -> Path | None:
    """The pattern that a file belongs to, by the last digits of its name; None without digits."""
    found = list(re.finditer(r"\d+", path.stem))
    if not found:
        return None
    first, end = found[-1].span()
    return path.with_name(f"{path.stem[:first]}{'#' * (end - first)}{path.stem[end:]}{path.suffix}")


def file_at(pattern: Path, frame: int, start: int, step: int, outside: str) -> tuple[Path | None, str]:
    """The file that shows at a frame, or None; and what the artist should know. A number that is missing between the first
    and the last shows the file before it, however the frame was reached."""
    files = files_of(pattern)
    if not files:
        return None, f"no file fits {pattern.name} in {pattern.parent}"
    numbers = sorted(files)
    count = numbers[-1] - numbers[0] + 1
    place = (frame - start) // step
    if outside == 'LOOP':
        place %= count
    elif outside == 'HIDE' and not 0 <= place < count:
        return None, ""
    wanted = numbers[0] + min(max(place, 0), count - 1)
    if wanted in files:
        return files[wanted], ""
    shown = files[max(number for number in numbers if number < wanted)]
    return shown, f"{_name(pattern, wanted)} is missing at frame {frame}, {shown.name} stays"


def before(pattern: Path, path: Path) -> Path | None:
    """The file of the next smaller number."""
    files = files_of(pattern)
    own = next((number for number, file in files.items() if file == path), 0)
    return files.get(max((number for number in files if number < own), default=None))


def files_of(pattern: Path) -> dict[int, Path]:
    """The files by number. The folder is looked through again when it changed."""
    try:
        return _listed(pattern, pattern.parent.stat().st_mtime_ns)
    except OSError:
        return {}


@lru_cache(maxsize=16)
def _listed(pattern: Path, _changed: int) -> dict[int, Path]:
    signs = _SIGNS.search(pattern.name)
    fits = re.compile(f"{re.escape(pattern.name[:signs.start()])}(\\d{{{len(signs[0])},}})"
                      f"{re.escape(pattern.name[signs.end():])}")
    found = ((fits.fullmatch(path.name), path) for path in pattern.parent.iterdir())
    return {int(match[1]): path for match, path in found if match}


def _name(pattern: Path, number: int) -> str:
    return _SIGNS.sub(lambda signs: f"{number:0{len(signs[0])}}", pattern.name, count=1)
