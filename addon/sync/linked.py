# SPDX-License-Identifier: GPL-3.0-or-later
"""Linked clouds: objects that name a file which only the library reads. Blender holds a box.

A cloud is built at the first time and saved in Blender's folder of user data; later it is mapped from there.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

import bpy

from .. import importers, native

Corner = tuple[float, float, float]


@dataclass(frozen=True)
class Source:
    """A file as it is now, and where its cloud is kept."""

    path: Path
    kept: Path

    def identity(self) -> tuple:
        return ("linked", str(self.path), self.kept.name)


@dataclass(frozen=True)
class Linked:
    cloud: native.Cloud
    origin: Corner  # float64; the cloud is relative to it
    box: tuple[Corner, Corner]


def source_of(obj: bpy.types.Object) -> Source | None:
    """Of an evaluated object with a linked file; None and no more where the file is missing."""
    owner = obj.original
    return source(Path(bpy.path.abspath(obj.patina.linked_file, library=owner.library)))


def source(path: Path) -> Source | None:
    try:
        status = path.stat()
    except OSError:
        return None
    place = hashlib.blake2b(str(path.resolve()).encode("utf-8", "surrogateescape"), digest_size=12).hexdigest()
    state = hashlib.blake2b(f"{status.st_size} {status.st_mtime_ns}".encode(), digest_size=6).hexdigest()
    folder = bpy.utils.user_resource('DATAFILES', path="patina", create=True)
    return Source(path, Path(folder) / f"{place}-{state}.cloud")


def load(source: Source, progress: importers.Progress | None = None) -> Linked:
    """Maps the kept cloud, or builds and keeps it. Any thread. PatinaError when the file cannot be read."""
    notes = source.kept.with_suffix(".json")
    try:
        origin = tuple(json.loads(notes.read_text("utf-8"))["origin"])
        return _linked(native.Cloud.open(source.kept), origin)
    except (native.PatinaError, OSError, ValueError, KeyError):
        pass  # not there yet, of another version, or damaged: it is made anew
    progress = progress or importers.Progress()
    points = importers.reader(source.path).read(source.path, importers.Filter(), progress)
    points.scalars.clear()  # clouds have no use for them
    with progress.inner() as inner:
        cloud = native.Cloud(points.positions, points.normals, points.colors, inner)
    try:
        for old in source.kept.parent.glob(f"{source.kept.name.split('-')[0]}-*"):
            old.unlink()
        cloud.save(source.kept)
        notes.write_text(json.dumps({"origin": points.origin}), "utf-8")
        cloud = native.Cloud.open(source.kept)  # whose memory is the file's
    except (native.PatinaError, OSError):
        pass  # no room on the disk: it stays in memory
    return _linked(cloud, points.origin)


def _linked(cloud: native.Cloud, origin: Corner) -> Linked:
    return Linked(cloud, origin, cloud.box)


def box_mesh(name: str, box: tuple[Corner, Corner]) -> bpy.types.Mesh:
    """Eight corners and twelve edges."""
    corners = [tuple(box[i >> k & 1][k] for k in range(3)) for i in range(8)]
    edges = [(i, i | 1 << k) for i in range(8) for k in range(3) if not i >> k & 1]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, edges, [])
    return mesh
