# SPDX-License-Identifier: GPL-3.0-or-later
"""Clouds at addresses: COPC and EPT on a server, of which pictures fetch the points that they show."""

from __future__ import annotations

import bpy
from bpy.props import StringProperty
from bpy.types import Context, Operator

from .. import jobs, native
from ..read import importers
from ..styles import styles
from ..sync.points import addresses, built, files, linked, origin
from .steps import Stepped


class PATINA_OT_import_address(Stepped, Operator):
    """Show a COPC or EPT cloud from a server. Only the points that a view shows are downloaded"""

    bl_idname = "import_scene.patina_address"
    bl_label = "Open Point Cloud Address"
    bl_options = {'REGISTER', 'UNDO'}

    address: StringProperty(name="Address", description="Address of a COPC file (.copc.laz) or of an ept.json file, starting with https:// or "
                                                        "http://",
                            options={'SKIP_SAVE'})

    def invoke(self, context: Context, _event: bpy.types.Event) -> set[str]:
        return context.window_manager.invoke_props_dialog(self, width=500)

    def execute(self, context: Context) -> set[str]:
        address = addresses.Address(self.address.strip())
        addresses.open_once(address)
        self._progress = importers.Progress()
        return self.begin(context, self._open(context, address))

    def _open(self, context: Context, address: addresses.Address) -> jobs.Steps[set[str]]:
        try:
            source = linked.source(address)
            found = yield from linked.steps(source, self._progress)
            built.CACHE.keep_streamed(source, found.cloud)
        except native.PatinaCancelled:
            return {'CANCELLED'}
        except native.PatinaError as error:
            text = str(error)
            self.report({'ERROR'}, importers.told(f"Patina: {text if address in text else f'{address}: {text}'}"))
            return {'CANCELLED'}
        name = importers.told(address.stem)
        obj = bpy.data.objects.new(name, linked.box_mesh(name, found.box, found))
        files.assign(obj, address)
        turn = None if found.units == (1.0, 1.0) else origin.axes('Z', *found.units)
        warning = origin.place(obj, found.origin, origin.shared(context.scene, found.origin, turn), turn)
        if warning:
            self.report({'WARNING'}, importers.told(f"Patina: {warning}"))
        context.collection.objects.link(obj)
        styles.dress(context.scene, obj)
        context.view_layer.objects.active = obj
        count = found.cloud.count
        self.report({'INFO'}, f"Opened {count:,} point{'s' * (count != 1)}. They are downloaded as views show them")
        return {'FINISHED'}


class PATINA_OT_open_address(Operator):
    """Read this object's points from its address, until another file is opened"""

    bl_idname = "object.patina_open_address"
    bl_label = "Open Address"
    bl_options = {'REGISTER'}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.object is not None and bool(context.object.patina.address)

    def execute(self, context: Context) -> set[str]:
        addresses.open_once(context.object.patina.address)
        context.object.data.update_tag()
        return {'FINISHED'}


def _menu(self: bpy.types.Menu, _context: Context) -> None:
    self.layout.operator(PATINA_OT_import_address.bl_idname, text="Point Cloud from Address (COPC, EPT)...")


_CLASSES = (PATINA_OT_import_address, PATINA_OT_open_address)


def register() -> None:
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.TOPBAR_MT_file_import.append(_menu)


def unregister() -> None:
    bpy.types.TOPBAR_MT_file_import.remove(_menu)
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
