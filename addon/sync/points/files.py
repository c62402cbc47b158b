# SPDX-License-Identifier: GPL-3.0-or-later
"""Which file an object links.

A Volume datablock holds it, for those of datablocks are the paths that Blender itself takes care of: it makes them relative
and absolute, maps them anew on Save As, finds them where they are missing, packs and unpacks them, and farms collect them.
Paths among an add-on's own properties get nothing of that. Volumes stand in no list of pictures, and Blender opens none that
no object shows. Object.patina.linked_file is how scripts see and say it; older versions saved it as a text.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import Any

import bpy
from bpy.app.handlers import persistent

from ... import whole
from ...read.importers.reading import told
from ...read.streaming.address import is_ept
from . import addresses, kept, sequence

_TEXT = "linked_file"
_unpacked: dict[tuple[int, int], Path] = {}  # of packed files, by place in memory and size


def assign(obj: bpy.types.Object, path: str) -> None:
    """The file, or pattern of files, that an object links from now on, absolute or as Blender writes relative ones; "": none."""
    group = obj.patina
    volume = group.linked_data
    group.address = path if addresses.is_address(path) else ""
    if group.address:
        path = ""
    if not path:
        group.linked_data = None
        _stored(obj).pop(_TEXT, None)
        return
    place = Path(bpy.path.abspath(path))
    files = sequence.files_of(place) if sequence.is_pattern(place) else {}
    first = files[min(files)] if files else place
    follows = bool(files) and sequence.pattern_of(first) == place
    if follows:
        path = path[:len(path) - len(place.name)] + first.name
    if volume is None or (volume.filepath, volume.is_sequence) != (path, follows):
        known = (item for item in bpy.data.volumes if (item.filepath, item.is_sequence, item.library) == (path, follows, None))
        own = volume if volume and not volume.library and volume.users == 1 else None
        volume = group.linked_data = next(known, own) or bpy.data.volumes.new(told(bpy.path.basename(path)))
        volume.filepath, volume.is_sequence = path, follows
    _stored(obj).pop(_TEXT, None)


def as_preferred(path: Path) -> str:
    """A path as the artist's preferences want new ones: relative to the file that is open, or absolute."""
    if not bpy.data.filepath or not bpy.context.preferences.filepaths.use_relative_paths:
        return str(path)
    try:
        return bpy.path.relpath(str(path))
    except ValueError:  # on another drive
        return str(path)


def path_of(obj: bpy.types.Object) -> Path | addresses.Address | None:
    """The file, pattern or address that an object links, absolute; of a packed one where it was put down. None: it links none."""
    original = obj.original
    volume = original.patina.linked_data
    if original.patina.address:
        return addresses.Address(original.patina.address)
    if volume is None:  # of an older version, and of a library
        text = text_of(original)
        return Path(bpy.path.abspath(text, library=original.library)) if text else None
    path = Path(bpy.path.abspath(volume.filepath, library=volume.library))
    if volume.packed_file and not volume.is_sequence and not is_ept(str(path)):  # of those Blender packs the first, and what tells of them
        return _put_down(volume.packed_file, path)
    return (sequence.pattern_of(path) or path) if volume.is_sequence else path


def _put_down(packed: bpy.types.PackedFile, path: Path) -> Path:
    """A packed file in the folder of caches, from which it is read. By its content, so that it lies there once."""
    key = (packed.as_pointer(), packed.size)
    known = _unpacked.get(key)
    if known is None or not known.is_file():
        data = packed.data
        name = hashlib.blake2b(data, digest_size=12).hexdigest()
        try:
            known = _written(kept.folder() / f"{name}-packed{path.suffix}", data)
        except OSError:  # a cache that is full, or gone
            known = _written(kept.temporary_folder() / f"{name}-packed{path.suffix}", data)
        _unpacked[key] = known
    return known


def _written(path: Path, data: bytes) -> Path:
    """The file, whole: half of it may be there, or it was damaged since."""
    if not path.is_file() or path.stat().st_size != len(data) or path.read_bytes() != data:
        whole.write(path, data)
        os.utime(path, (0, 0))  # what is made of it is good for every copy
    return path


def text_of(obj: bpy.types.Object) -> str:
    """What linked_file says."""
    volume = obj.patina.linked_data
    if obj.patina.address:
        return obj.patina.address
    if volume is None:
        return _stored(obj).get(_TEXT, "")
    if not volume.is_sequence:
        return volume.filepath
    path = Path(volume.filepath)
    return volume.filepath[:-len(path.name)] + (sequence.pattern_of(path) or path).name


def shown_text_of(obj: bpy.types.Object) -> str:
    """What linked_file says, as Blender takes it from Python."""
    return told(text_of(obj))


def _stored(obj: bpy.types.Object) -> Any:
    """What older versions saved, by property; like a dict."""
    return obj.patina if bpy.app.version < (5, 0, 0) else obj.patina.bl_system_properties_get() or {}


@persistent
def _renew(*_) -> None:
    """Once a file is loaded: objects of older versions get their volume."""
    for obj in bpy.data.objects:
        if obj.library is None and _stored(obj).get(_TEXT):
            assign(obj, text_of(obj))


@persistent
def _forget(*_) -> None:
    _unpacked.clear()
    addresses.forget()


_HANDLERS = ((bpy.app.handlers.load_pre, _forget), (bpy.app.handlers.load_post, _renew))


def register() -> None:
    for handlers, function in _HANDLERS:
        handlers.append(function)


def unregister() -> None:
    for handlers, function in _HANDLERS:
        handlers.remove(function)
    _unpacked.clear()
