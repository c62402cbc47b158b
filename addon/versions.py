# SPDX-License-Identifier: GPL-3.0-or-later
"""What to tell an artist whose Blender is newer than those that Patina was tested in."""

from __future__ import annotations

import bpy

from . import tested


def notice() -> str:
    """Empty if this Blender, or a newer one, was tested."""
    if bpy.app.version[:2] <= tested.NEWEST:
        return ""
    newest, this = (".".join(map(str, version)) for version in (tested.NEWEST, bpy.app.version[:2]))
    return f"Patina was tested up to Blender {newest}, and not in {this}. If something fails, please report it with this version"


def tell() -> None:
    """Prints the notice to the console."""
    if found := notice():
        print(f"Patina: {found}.", flush=True)
