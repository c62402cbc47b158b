# SPDX-License-Identifier: GPL-3.0-or-later
"""PLY files through the library's reader."""

from __future__ import annotations

from pathlib import Path

from .. import native
from . import PointFile


def read(path: Path, progress: native.Progress | None = None) -> PointFile:
    """Reads a file whole. Touches no Blender API: may run on any thread. PatinaError when it cannot be read."""
    with native.File(str(path), progress) as file:
        return PointFile(
            name=path.stem,
            positions=file.positions(),
            normals=file.normals(),
            colors=file.colors(),
            scalars={name: file.attribute(index) for index, name in enumerate(file.attributes)},
            origin=file.origin,
            invalid=file.invalid_positions)
