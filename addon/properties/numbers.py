# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of what an object's points have numbers of."""

from __future__ import annotations

from bpy.types import Context, PropertyGroup


def attribute_names(self: PropertyGroup, _context: Context, _text: str) -> list[str]:
    """Of point attributes and vertex groups."""
    obj = self.id_data
    found = [item.name for item in getattr(obj.data, "attributes", ()) if item.domain == 'POINT']
    return found + [group.name for group in getattr(obj, "vertex_groups", ()) if group.name not in found]
