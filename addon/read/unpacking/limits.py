# SPDX-License-Identifier: GPL-3.0-or-later
"""The memory limit of a process that reads strangers' files. Imports nothing of the add-on."""

from __future__ import annotations

import contextlib
import sys


def limit_memory(size: int) -> None:
    """Limits this process to so many bytes of heap and private memory: asking for more fails at once. Linux counts all of it; macOS
    takes the limit but does not hold it strictly; Windows has none here."""
    try:
        import resource
    except ImportError:
        return
    kind = resource.RLIMIT_DATA if sys.platform.startswith("linux") else resource.RLIMIT_AS
    with contextlib.suppress(ValueError, OSError):
        hard = resource.getrlimit(kind)[1]
        resource.setrlimit(kind, (size if hard == resource.RLIM_INFINITY else min(size, hard), hard))
