# SPDX-License-Identifier: GPL-3.0-or-later
"""Files → points. One module a format reads."""

from __future__ import annotations

from collections.abc import Collection
from importlib import import_module
from pathlib import Path
from types import ModuleType

from ...jobs import Steps
from ...native import PatinaError
from .reading import Filter, Pieces, PointFile, Progress, name_of, regular, told

__all__ = ["FORMATS", "Filter", "Pieces", "PointFile", "Progress", "in_pieces", "name_of", "preview", "reader", "steps", "told"]

# ending → module with read(path, filter, progress), steps(path, filter, progress) and preview(path), loaded with its first file
FORMATS = {".ply": "library", ".xyz": "library", ".txt": "library", ".csv": "library", ".asc": "library", ".pts": "library",
           ".ptx": "library", ".las": "las", ".laz": "las", ".e57": "e57", ".pcd": "pcd", ".conf": "library",
           ".cloud": "saved"}
PACKED_SPLATS = {".spz", ".splat", ".ksplat", ".sog"}


def reader(path: Path) -> ModuleType:
    """The module for a file's ending; PatinaError names those there are."""
    name = FORMATS.get(path.suffix.lower())
    if path.suffix.lower() in PACKED_SPLATS:
        raise PatinaError(f"packed Gaussian splats ({path.suffix}) are not read: convert them to a PLY, as SuperSplat exports it", -5)
    if path.name.lower() == "ept.json":
        raise PatinaError("EPT folders can only be linked. Enable Link", -5)
    if name is None:
        raise PatinaError(f"'{path.suffix}' is none of {' '.join(FORMATS)}", -5)
    regular(path)  # raises where it is no file
    return import_module(f"{__name__}.{name}")


def steps(path: Path, wanted: Filter, progress: Progress) -> Steps[PointFile]:
    """A file's points, read in steps. PatinaError when it cannot be read."""
    return (yield from reader(path).steps(path, wanted, progress))


def in_pieces(path: Path, least: int, names: Collection[str], progress: Progress) -> Steps[Pieces | None]:
    """The points of a file of more than least, with those scalars that are named; None where there are not so many, or where the
    format is read whole. PatinaError when it cannot be read."""
    pieces = getattr(reader(path), "in_pieces", None)
    return (yield from pieces(path, least, names, progress)) if pieces else None


def preview(path: Path) -> list[str]:
    """What is inside, a few lines, without reading the points. Never raises."""
    try:
        return [told(line) for line in reader(path).preview(path)]
    except (PatinaError, OSError, ValueError) as error:
        return [told(error)]
