# SPDX-License-Identifier: GPL-3.0-or-later
"""Addresses in place of linked files. Nothing is fetched unless the artist opens the address, in this session, and Blender allows online access."""

from __future__ import annotations

from pathlib import Path

import bpy

from ... import choices, native
from ...read.streaming.address import is_address, is_ept

LARGE = 20_000_000  # points: from here on a COPC is read as it is wanted, where nobody chose

_opened: set[str] = set()


class Address(str):
    """Has the parts of a path that are asked for where either may be."""

    @property
    def name(self) -> str:
        path = self.partition("?")[0].rstrip("/")
        return (path.removesuffix("/ept.json") if is_ept(self) else path).rpartition("/")[2] or self

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
    why = refusal(address)
    if why:
        raise native.PatinaError(why, -5)


def refusal(address: str) -> str:
    """Why nothing may be fetched from there; "" where it may."""
    if not is_address(address):
        return "only http and https addresses are read"
    if not online():
        return ("Blender may not go online: Preferences > System > Network > Allow Online Access" if hasattr(bpy.app, "online_access") else
                "the add-on may not go online: Allow Online Access in its preferences")
    if address not in _opened and not bpy.app.background:
        return "nothing is fetched from an address of a file that was opened: Open Address, beside it, does"
    return ""


def online() -> bool:
    if hasattr(bpy.app, "online_access"):  # Blender 4.2
        return bool(bpy.app.online_access)
    known = choices.get()
    return bool(known and known.online)


def is_streamed(path: Path, how: str) -> bool:
    """Whether a linked file is to be read as it is wanted: folders of EPT always, a COPC by how: 'AUTO', 'ON' or 'OFF'."""
    if is_ept(str(path)):
        return path.is_file()
    if how == 'OFF':
        return False
    from ...read.importers.las_header import is_copc  # which is loaded with its first file
    try:
        points = is_copc(path)
    except OSError:
        return False
    return points is not None and (how == 'ON' or points >= LARGE)


def forget() -> None:
    """Another file is opened."""
    _opened.clear()
