# SPDX-License-Identifier: GPL-3.0-or-later
"""Addresses in place of linked files. Nothing is fetched unless the artist opens the address, in this session, and Blender allows online access."""

from __future__ import annotations

from pathlib import Path

import bpy

from .. import native, preferences
from ..streaming.source import is_address

LARGE = 20_000_000  # points: from here on a COPC is read as it is wanted, where nobody chose

_opened: set[str] = set()


class Address(str):
    """Has the parts of a path that are asked for where either may be."""

    @property
    def name(self) -> str:
        return self.rstrip("/").rpartition("/")[2].partition("?")[0] or self

    @property
    def stem(self) -> str:
        return self.name.partition(".")[0]

    def is_file(self) -> bool:
        return False


def open_once(address: str) -> None:
    """The artist opens it."""
    _opened.add(address)


def check(address: str) -> None:
    """PatinaError with a sentence where nothing may be fetched from there."""
    if not is_address(address):
        raise native.PatinaError("only http and https addresses are read", -5)
    if not online():
        raise native.PatinaError("Blender may not go online: Preferences > System > Network > Allow Online Access"
                                 if hasattr(bpy.app, "online_access") else
                                 "the add-on may not go online: Allow Online Access in its preferences", -5)
    if address not in _opened and not bpy.app.background:
        raise native.PatinaError("nothing is fetched from an address of a file that was opened: Open Address, beside it, does", -5)


def online() -> bool:
    if hasattr(bpy.app, "online_access"):  # Blender 4.2
        return bool(bpy.app.online_access)
    known = preferences.get()
    return bool(known and known.online)


def is_streamed(path: Path, how: str) -> bool:
    """Whether a linked file is a COPC, and to be read as it is wanted. how: 'AUTO' or 'ON'."""
    from ..importers.las import is_copc  # which is loaded with its first file
    try:
        points = is_copc(path)
    except OSError:
        return False
    return points is not None and (how == 'ON' or points >= LARGE)


def forget() -> None:
    """Another file is opened."""
    _opened.clear()
