# SPDX-License-Identifier: GPL-3.0-or-later
"""H, Alt H, X and Del in Object Mode mean points while some of the active object's are selected, or hidden, whatever tool is active;
else what they mean in Blender."""

from __future__ import annotations

import bpy
from bpy.types import Context, Object, Operator

from ..sync.points import edits
from . import points

KEYS = (("object.patina_points_key_hide", 'H', {}), ("object.patina_points_key_reveal", 'H', {"alt": True}),
        ("object.patina_points_key_delete", 'X', {}), ("object.patina_points_key_delete", 'DEL', {}))

_added: list[tuple[bpy.types.KeyMap, bpy.types.KeyMapItem]] = []


def _has(obj: Object | None, which: str) -> bool:
    """Whether points of a linked cloud are `selected` or `hidden`."""
    if points.editable(obj) or not obj.select_get():
        return False
    packed = edits.packed_of(obj)
    try:
        return bool(packed) and edits.unpacked(packed).totals[which] > 0
    except edits.Damaged:
        return False


class _Key:
    """Beside bpy.types.Operator. which: points that there have to be."""

    bl_options = {'UNDO', 'INTERNAL'}
    which = "selected"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return _has(context.object, cls.which)


class PATINA_OT_points_key_hide(_Key, Operator):
    """Hide the selected points of a linked cloud"""

    bl_idname = "object.patina_points_key_hide"
    bl_label = "Hide Selected Points"

    def execute(self, _context: Context) -> set[str]:
        return bpy.ops.object.patina_points_hide(unselected=False)


class PATINA_OT_points_key_reveal(_Key, Operator):
    """Reveal the hidden points of a linked cloud, if no hidden object would be revealed by the same key"""

    bl_idname = "object.patina_points_key_reveal"
    bl_label = "Reveal Hidden Points"
    which = "hidden"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and not any(obj.hide_get() for obj in context.view_layer.objects)

    def execute(self, _context: Context) -> set[str]:
        return bpy.ops.object.patina_points_reveal()


class PATINA_OT_points_key_delete(_Key, Operator):
    """Delete the selected points of a linked cloud"""

    bl_idname = "object.patina_points_key_delete"
    bl_label = "Delete Selected Points"

    def execute(self, _context: Context) -> set[str]:
        return bpy.ops.object.patina_points_delete()


_register, _unregister = bpy.utils.register_classes_factory(
    (PATINA_OT_points_key_hide, PATINA_OT_points_key_reveal, PATINA_OT_points_key_delete))


def register() -> None:
    _register()
    config = bpy.context.window_manager.keyconfigs.addon
    if config is None:  # in background
        return
    keymap = config.keymaps.new(name="Object Mode", space_type='EMPTY')
    for name, key, held in KEYS:
        _added.append((keymap, keymap.keymap_items.new(name, key, 'PRESS', **held)))


def unregister() -> None:
    for keymap, item in _added:
        keymap.keymap_items.remove(item)
    _added.clear()
    _unregister()
