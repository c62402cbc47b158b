# SPDX-License-Identifier: GPL-3.0-or-later
"""Saved clouds, as the command line makes them: linked, and drawn from where they lie. No points of them are read."""

from __future__ import annotations

from pathlib import Path

from ... import jobs, native
from .reading import Filter, PointFile, Progress


def is_saved(path: Path) -> bool:
    """By its name."""
    return path.suffix.lower() == ".cloud"


def preview(path: Path) -> list[str]:
    with native.Cloud.open(path) as cloud:
        holds = [name for name, there in (("colors", cloud.has_colors), ("normals", cloud.has_normals), ("scalars", cloud.has_scalars)) if there]
        return ["Saved cloud" + ", analyzed" * bool(cloud.has_shapes), f"{cloud.count:,} points", " ".join(holds)]


def read(path: Path, wanted: Filter, progress: Progress) -> PointFile:
    return jobs.finish(steps(path, wanted, progress))


def steps(path: Path, wanted: Filter, progress: Progress) -> jobs.Steps[PointFile]:
    raise native.PatinaError(f"{path.name}: the points of a saved cloud cannot be read back. Use the file that it was made from", -5)
    yield
