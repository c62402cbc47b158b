# SPDX-License-Identifier: GPL-3.0-or-later
"""Points of a linked cloud: selected, hidden, deleted, restored. All change a custom property of the object (sync/points/edits.py) and
can be undone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, IntProperty
from bpy.types import Context, Event, Object, Operator

from .. import jobs, native
from ..native.points import pick
from ..read import importers
from ..sync import style_of
from ..sync.analyses.analyzing import ANALYSES
from ..sync.points import built, edits, files, linked, sequence
from ..sync.view import clips
from . import points_values, polls
from .points_values import HOW


def editable(obj: Object | None) -> str:
    """Why the points of an object cannot be edited; empty: they can."""
    if obj is None or not obj.patina.linked_file:
        return "the active object links no point file"
    if obj.library or obj.mode != 'OBJECT':
        return "the object belongs to another file" if obj.library else "only in Object Mode"
    path = files.path_of(obj)
    return "points of a sequence are others in every frame" if path and sequence.is_pattern(path) else ""


def cloud_of(obj: Object, context: Context) -> native.Cloud:
    """PatinaError where the file cannot be read, or not all of it is."""
    notices: list[str] = []
    source = linked.source_of(obj, context.scene.frame_current, notices)
    if source is None:
        raise native.PatinaError(notices[0] if notices else "the file is missing")
    if source.streamed:
        raise native.PatinaError("its points are read as needed. Use Linked File > Read Whole to read all of them")
    return jobs.finish(built.CACHE.obtain_linked(source, importers.Progress()))


def combine(how: str, old: np.ndarray, new: np.ndarray) -> np.ndarray:
    """Of two selections the one that `how` asks for. Both are edits.Bits, or bool."""
    return {'SET': lambda: new, 'ADD': lambda: old | new, 'SUB': lambda: old & ~new, 'AND': lambda: old & new}[how]()


def write(obj: Object, changed: edits.Edits) -> None:
    """Nothing at all where nothing is left of it."""
    if any(changed.totals.values()):
        obj[edits.PROPERTY] = changed.packed()
    elif edits.PROPERTY in obj:
        del obj[edits.PROPERTY]
    obj.update_tag()


def edits_of(operator: Operator, obj: Object, count: int) -> edits.Edits:
    """The edits of an object's cloud of so many points. If they are damaged, they are reset with a warning."""
    try:
        return edits.for_cloud(edits.packed_of(obj), count) or edits.none(count)
    except edits.Damaged as damaged:
        operator.report({'WARNING'}, f"Patina: '{obj.name}': {damaged}. The edits were reset")
        return edits.none(count)


class Editing:
    """Beside bpy.types.Operator: change() says what becomes of an object's points."""

    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return polls.allowed(cls, editable(context.object))

    def execute(self, context: Context) -> set[str]:
        obj = context.object
        try:
            with ANALYSES.drawing():
                cloud = cloud_of(obj, context)
                old = edits_of(self, obj, cloud.count)
                new = self.change(context, obj, cloud, old)
        except (native.PatinaError, OSError) as error:
            self.report({'ERROR'}, importers.told(f"Patina: '{obj.name}': {error}"))
            return {'CANCELLED'}
        if new is None:
            return {'CANCELLED'}
        write(obj, new)
        self.report({'INFO'}, ". ".join(filter(None, (self.came_back(old), said(new)))))
        return {'FINISHED'}

    def came_back(self, old: edits.Edits) -> str:
        """What an operator says first."""
        return ""

    def change(self, context: Context, obj: Object, cloud: native.Cloud, old: edits.Edits) -> edits.Edits | None:
        raise NotImplementedError


def said(now: edits.Edits) -> str:
    parts = [f"{total:,} {name}" for name, total in now.totals.items() if total]
    return f"Of {now.count:,} points {', '.join(parts)}" if parts else f"All {now.count:,} points shown, none selected"


def drawn_alone(context: Context, obj: Object, cloud: native.Cloud, work: Callable[[native.Scene], edits.Bits],
                clip: clips.Clip | None = None) -> edits.Bits:
    """work() on a scene of the object alone, without clips, or with one."""
    found = obj.evaluated_get(context.evaluated_depsgraph_get())
    style = replace(style_of(found, found.matrix_world), color_source=0, ramp=b"", clip_off=int(clip is None))
    with native.Scene() as scene:
        scene.add_cloud(cloud, mask=edits.mask_of(cloud, edits.state_of(obj)), **vars(style))
        if clip:
            scene.add_clip(**vars(clip))
        return work(scene)


class PATINA_OT_points_select_all(Editing, Operator):
    """Select or deselect all visible points of a linked cloud, or invert the selection"""

    bl_idname = "object.patina_points_select_all"
    bl_label = "Select All Points"

    action: EnumProperty(name="Action", items=(('SELECT', "All", "", 0), ('DESELECT', "None", "", 1), ('INVERT', "Invert", "", 2)))

    def change(self, context: Context, obj: Object, cloud: native.Cloud, old: edits.Edits) -> edits.Edits:
        if self.action == 'DESELECT':
            return replace(old, selected=np.zeros_like(old.selected))
        shown = drawn_alone(context, obj, cloud, lambda scene: pick(scene, 0, None))
        return replace(old, selected=shown if self.action == 'SELECT' else shown & ~old.selected)


def _clip_items(_self: Operator, context: Context | None) -> list[tuple]:
    names = [obj.name for obj in context.scene.objects if obj.patina.clip.shape != 'NONE'] if context else []
    _items[:] = [(name, name, "") for name in names] or [("", "None", "The scene has no clip")]
    return _items


_items: list[tuple] = []  # Blender keeps no reference to the texts


class PATINA_OT_points_select_by(Editing, Operator):
    """Select the points of a class, of a scan, inside the active clip box or plane, or whose attribute lies within a range"""

    bl_idname = "object.patina_points_select_by"
    bl_label = "Select Points By"

    by: EnumProperty(name="By", items=(('CLASS', "Class", "", 0), ('SCAN', "Scan", "", 1), ('CLIP', "Clip", "", 2), ('VALUE', "Value", "", 3)))
    how: EnumProperty(name="How", items=HOW)
    number: IntProperty(name="Number", min=0, max=65535, description="Number of the class, or of the scan as stored in the file")
    clip: EnumProperty(name="Clip", items=_clip_items, options={'SKIP_SAVE'})
    attribute: points_values.attribute_property()
    least: points_values.limit_property(*points_values.LEAST)
    most: points_values.limit_property(*points_values.MOST)

    def invoke(self, context: Context, _event: Event) -> set[str]:
        """Asks for a range that nobody gave."""
        if self.by != 'VALUE' or self.properties.is_property_set("least") or self.properties.is_property_set("most"):
            return self.execute(context)
        self.least, self.most = points_values.suggested(context.object, self.attribute)
        return context.window_manager.invoke_props_dialog(self, width=320)

    def draw(self, _context: Context) -> None:
        self.layout.use_property_split = True
        of = {'CLASS': ("number",), 'SCAN': ("number",), 'CLIP': ("clip",), 'VALUE': ("attribute", "least", "most")}
        for name in ("by", *of[self.by], "how"):
            self.layout.prop(self, name)

    def change(self, context: Context, obj: Object, cloud: native.Cloud, old: edits.Edits) -> edits.Edits:
        found = {'CLASS': self._of_class, 'SCAN': self._of_scan, 'CLIP': self._in_clip, 'VALUE': self._of_value}[self.by](context, obj, cloud)
        return replace(old, selected=combine(self.how, old.selected, found))

    def _of_class(self, context: Context, obj: Object, cloud: native.Cloud) -> edits.Bits:
        if self.number > 255 or not cloud.class_bits[self.number // 32] >> self.number % 32 & 1:
            raise native.PatinaError(f"no point is of class {self.number}")
        words = [0] * 8
        words[self.number // 32] = 1 << self.number % 32
        return drawn_alone(context, obj, cloud, lambda scene: pick(scene, 0, None, classes=words))

    def _of_scan(self, context: Context, obj: Object, cloud: native.Cloud) -> edits.Bits:
        scans = edits.scans_of(cloud)
        if scans is None or self.number not in cloud.scan_numbers:
            raise native.PatinaError(f"no point is of scan {self.number}" if cloud.scan_numbers else
                                     "the file does not store the scan of each point")
        found = edits.of_flags(scans == cloud.scan_numbers.index(self.number))
        return found & drawn_alone(context, obj, cloud, lambda scene: pick(scene, 0, None))

    def _of_value(self, context: Context, obj: Object, cloud: native.Cloud) -> edits.Bits:
        found = points_values.within(points_values.of_linked(obj, self.attribute, context.scene.frame_current), self.least, self.most)
        if len(found) != cloud.count:
            raise native.PatinaError(f"the file has {len(found):,} points now, and the cloud {cloud.count:,}. Render once, then select again")
        return edits.of_flags(found) & drawn_alone(context, obj, cloud, lambda scene: pick(scene, 0, None))

    def _in_clip(self, context: Context, obj: Object, cloud: native.Cloud) -> edits.Bits:
        found = context.scene.objects.get(self.clip)
        if found is None or found.patina.clip.shape == 'NONE':
            raise native.PatinaError("the scene has no such clip")
        clip = clips.of_object(found, found.evaluated_get(context.evaluated_depsgraph_get()).matrix_world)
        if found.patina.clip.shape == 'BOX':
            clip = replace(clip, cut=0)
        return drawn_alone(context, obj, cloud, lambda scene: pick(scene, 0, None), clip)


class PATINA_OT_points_hide(Editing, Operator):
    """Hide the selected points of a linked cloud in the viewport and in renders"""

    bl_idname = "object.patina_points_hide"
    bl_label = "Hide Selected Points"

    unselected: BoolProperty(name="Unselected", default=False, description="Hide the unselected points instead")

    def change(self, context: Context, obj: Object, cloud: native.Cloud, old: edits.Edits) -> edits.Edits | None:
        which = edits.every(old.count) & ~old.selected if self.unselected else old.selected
        if not which.any():
            self.report({'INFO'}, "No point is selected")
            return None
        return replace(old, hidden=old.hidden | which & ~old.deleted, selected=old.selected & ~which)


class PATINA_OT_points_reveal(Editing, Operator):
    """Reveal and select the hidden points of a linked cloud"""

    bl_idname = "object.patina_points_reveal"
    bl_label = "Reveal Hidden Points"

    select: BoolProperty(name="Select", default=True, description="Select the revealed points")

    def came_back(self, old: edits.Edits) -> str:
        return f"{old.totals['hidden']:,} shown again"

    def change(self, context: Context, obj: Object, cloud: native.Cloud, old: edits.Edits) -> edits.Edits:
        return replace(old, hidden=np.zeros_like(old.hidden), selected=old.hidden & ~old.deleted if self.select else old.selected)


class PATINA_OT_points_delete(Editing, Operator):
    """Delete the selected points of a linked cloud from renders and exports. The file is not changed"""

    bl_idname = "object.patina_points_delete"
    bl_label = "Delete Selected Points"

    def change(self, context: Context, obj: Object, cloud: native.Cloud, old: edits.Edits) -> edits.Edits | None:
        if not old.selected.any():
            self.report({'INFO'}, "No point is selected")
            return None
        return replace(old, deleted=old.deleted | old.selected, selected=np.zeros_like(old.selected))


class PATINA_OT_points_restore(Editing, Operator):
    """Restore and select the deleted points of a linked cloud"""

    bl_idname = "object.patina_points_restore"
    bl_label = "Restore Deleted Points"

    def came_back(self, old: edits.Edits) -> str:
        return f"{old.totals['deleted']:,} restored"

    def change(self, context: Context, obj: Object, cloud: native.Cloud, old: edits.Edits) -> edits.Edits:
        return replace(old, deleted=np.zeros_like(old.deleted), selected=old.deleted & ~old.hidden)


class PATINA_OT_points_forget(Operator):
    """Discard all edits: no point is hidden, deleted or selected"""

    bl_idname = "object.patina_points_forget"
    bl_label = "Forget All Edits"
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.object is not None and edits.PROPERTY in context.object and not context.object.library

    def execute(self, context: Context) -> set[str]:
        del context.object[edits.PROPERTY]
        context.object.update_tag()
        return {'FINISHED'}


_CLASSES = (PATINA_OT_points_select_all, PATINA_OT_points_select_by, PATINA_OT_points_hide, PATINA_OT_points_reveal,
            PATINA_OT_points_delete, PATINA_OT_points_restore, PATINA_OT_points_forget)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
