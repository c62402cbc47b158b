# SPDX-License-Identifier: GPL-3.0-or-later
"""How much memory a picture may take. Nothing here knows Blender."""

from __future__ import annotations

import re
from pathlib import Path

SHARE = 0.5  # of what is free: Blender, the points and the finished picture want some too

limit = 0  # bytes, that the artist allows; 0: by what is free


def free() -> int | None:
    """Bytes that this process may still take, by the machine and by its control group; None where nobody tells."""
    found = [_available(), _group_left()]
    return min((size for size in found if size is not None), default=None)


def for_planes() -> int | None:
    """Bytes that the planes of a picture that is drawn may take; None where nobody tells what is free."""
    if limit:
        return limit
    left = free()
    return None if left is None else int(SHARE * left)


def _available() -> int | None:
    try:
        with open("/proc/meminfo", encoding="ascii") as lines:
            return next((1024 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable:")), None)
    except (OSError, ValueError):
        return None


def _group_left() -> int | None:
    """Of a container or a farm's job (cgroup v2)."""
    try:
        place = Path("/sys/fs/cgroup") / Path("/proc/self/cgroup").read_text("ascii").rpartition("::/")[2].strip()
        most, used = ((place / name).read_text("ascii").strip() for name in ("memory.max", "memory.current"))
        files = re.search(r"^inactive_file (\d+)$", (place / "memory.stat").read_text("ascii"), re.MULTILINE)  # kept of files, and given up at need
        return None if most == "max" else max(int(most) - int(used) + (int(files[1]) if files else 0), 0)
    except (OSError, ValueError):
        return None
