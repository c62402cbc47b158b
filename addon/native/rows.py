# SPDX-License-Identifier: GPL-3.0-or-later
"""Files whose points come in windows."""

from __future__ import annotations

import os
from collections.abc import Iterator
from ctypes import byref
from pathlib import Path

from . import abi
from .files import File
from .handles import Handle, Progress, handle_of


class Rows(Handle):
    """whole: why the file is read whole, "": it comes in windows; count of points is not known where it is."""

    _kind = "rows"

    def __init__(self, path: Path, progress: Progress | None = None) -> None:
        super().__init__(os.fsencode(path), handle_of(progress), create="patina_rows_open", keep=progress)
        info = abi.RowsInfo()
        self._call("get_info", byref(info))
        self.count = info.count
        self.whole = info.whole.decode()

    def windows(self, most: int) -> Iterator[File]:
        """The next ones, of so many points at most; each goes when it has been looked at."""
        while file := File.of_rows(self, most):
            with file:
                yield file
