# SPDX-License-Identifier: GPL-3.0-or-later
"""What the artist chose in the add-on's preferences, as values. Defaults hold where the add-on is not enabled."""

from __future__ import annotations

from pathlib import Path

import bpy

from .read import readers

GIGA = 1 << 30
CACHE_GIGA = 32  # of clouds on the disk, 23 bytes a point: a sequence has many
PAGES_GIGA = 8  # of fetched parts of files, some 10 bytes a point
PREVIEW_POINTS = 50_000  # of each cloud, in Solid shading and the like


def get() -> bpy.types.AddonPreferences | None:
    """The preferences (preferences.py has their properties). None where the add-on is not enabled in Blender's, as in tests."""
    addon = bpy.context.preferences.addons.get(__package__)
    return addon.preferences if addon else None


def readers_folder() -> Path:
    """Folder of the installed packages that read LAZ and E57, for this Blender's Python."""
    return Path(bpy.utils.user_resource('SCRIPTS', path="addons")) / "patina-readers" / readers.TAG


def cache_bytes() -> int:
    """How much the caches may take."""
    known = get()
    return GIGA * (known.cache_limit if known else CACHE_GIGA)


def cloud_bytes() -> int:
    """How much a picture may hold of linked clouds at a time; 0: by what is free."""
    known = get()
    return GIGA * known.cloud_limit if known else 0


def preview_points() -> int:
    """How many points of each cloud Solid and Material Preview shading show."""
    known = get()
    return known.preview_points if known else PREVIEW_POINTS
