# SPDX-License-Identifier: GPL-3.0-or-later
"""What holds for all files of an artist: caches, device, memory, readers of other formats."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty
from bpy.types import AddonPreferences, Context

from . import choices, memory, versions
from .choices import CACHE_GIGA, GIGA, PAGES_GIGA, PREVIEW_POINTS
from .operators import preferences as operators
from .properties.automatic import switch
from .read import readers
from .ui import rows


def _use(group: AddonPreferences, _context: Context) -> None:
    memory.limit = GIGA * group.memory_limit


class PatinaPreferences(AddonPreferences):
    bl_idname = __package__

    cache_folder: StringProperty(
        name="Cache Folder", subtype='DIR_PATH',
        description="Folder of the caches of linked clouds, which open instantly the next time. Empty: Blender's user data folder")
    cache_limit: IntProperty(
        name="Cache Size", default=CACHE_GIGA, min=1, soft_max=1024, max=1 << 20,
        description="Largest size of the caches, in gigabytes. The least recently used ones are deleted first")
    keep_pages: EnumProperty(
        name="Keep Fetched Points", default='OFF',
        description="Cache the downloaded parts of COPC and EPT clouds on this disk",
        items=(
            ('OFF', "Off", "Download again in each session", 0),
            ('ADDRESSES', "Of Addresses", "Cache what comes from servers", 1),
            ('ALL', "Of Addresses and Files", "Also cache what is read from linked files, for slow network drives", 2)))
    pages_folder: StringProperty(
        name="Folder", subtype='DIR_PATH',
        description="Folder of downloaded points. Empty: a folder in the cache folder")
    pages_limit: IntProperty(
        name="Size", default=PAGES_GIGA, min=1, soft_max=1024, max=1 << 20,
        description="Largest size of the downloaded points, in gigabytes. The least recently used ones are deleted first")
    device: EnumProperty(
        name="Device", default='AUTO', description="Device for scenes whose own device is Automatic",
        items=(
            ('AUTO', "Automatic", "The GPU if there is one, otherwise the processor", 0),
            ('CPU', "Processor", "SIMD code on the processor. Gives the same pixels on each machine", 1),
            ('GL', "OpenGL", "OpenGL 4.3 compute shaders", 3)))
    threads: IntProperty(
        name="Threads", default=0, min=0, max=1024,
        description="Number of processor threads for scenes that do not set their own")
    use_threads: switch("threads", 4, "Use a fixed number of threads. Disabled: Blender's own setting")
    memory_limit: IntProperty(
        name="Memory", default=0, min=0, soft_max=256, max=1 << 20, update=_use,
        description="Memory for a final render, in gigabytes. Larger renders are split into tiles")
    use_memory_limit: switch("memory_limit", 4, "Use a fixed limit. Disabled: half of the free memory", "Set Memory")
    cloud_limit: IntProperty(
        name="Linked Clouds", default=0, min=0, soft_max=256, max=1 << 20,
        description="Memory for linked clouds, in gigabytes. Larger clouds are read in several rounds, with the same result")
    use_cloud_limit: switch("cloud_limit", 4, "Use a fixed limit. Disabled: a third of the free memory", "Set Linked Clouds")

    preview_points: IntProperty(
        name="Points in Solid", default=PREVIEW_POINTS, min=0, soft_max=1_000_000, max=100_000_000,
        description="Points of each cloud that Wireframe, Solid and Material Preview shading show in their colors; 0 shows none. Renders "
                    "draw all points")
    online: BoolProperty(
        name="Allow Online Access", default=False,
        description="Allow downloads from addresses that you open. In Blender 4.2 and later, Blender's own setting under System applies")

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        if untested := versions.notice():
            rows.sentence(context, layout, untested, 'INFO')
        column = layout.column()
        column.label(text="Caches")
        column.prop(self, "cache_folder")
        column.prop(self, "cache_limit", text="Size (GB)")
        column.label(text=operators.cache_text())
        column = layout.column()
        column.prop(self, "keep_pages")
        count, size = operators.pages_held()
        if self.keep_pages != 'OFF':
            column.prop(self, "pages_folder")
            column.prop(self, "pages_limit", text="Size (GB)")
        if self.keep_pages != 'OFF' or count:
            column.label(text=f"{count:,} parts of files kept, {size / 1e9:.2f} GB")
        column.operator("patina.remove_caches")
        column = layout.column()
        column.label(text="Defaults")
        column.prop(self, "device")
        rows.automatic(column, self, "threads")
        rows.automatic(column, self, "memory_limit", text="Memory (GB)")
        rows.automatic(column, self, "cloud_limit", text="Linked Clouds (GB)")
        column.prop(self, "preview_points")
        if not hasattr(bpy.app, "online_access"):
            column.prop(self, "online")
        column = layout.column()
        column.label(text="Formats")
        for line, there in readers.status():
            column.label(text=line, icon='CHECKMARK' if there else 'INFO')
        if readers.missing():
            row = column.row()
            row.operator("patina.install_readers")
            row.operator("patina.install_reader_files")
        layout.operator("patina.open_manual", icon='HELP')


def register() -> None:
    bpy.utils.register_class(PatinaPreferences)
    readers.look_in(Path(__file__).parent / "packages")  # of the zip for Blender 3.4 to 4.1; later ones install wheels
    readers.look_in(choices.readers_folder())
    known = choices.get()
    if known:
        _use(known, bpy.context)


def unregister() -> None:
    readers.look_no_more_in(choices.readers_folder())
    readers.look_no_more_in(Path(__file__).parent / "packages")
    bpy.utils.unregister_class(PatinaPreferences)
    memory.limit = 0
