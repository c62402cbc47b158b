# SPDX-License-Identifier: GPL-3.0-or-later
"""The buttons of the preferences: readers of LAZ and E57, the caches, the manual."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import bpy
from bpy.props import BoolProperty, CollectionProperty, StringProperty
from bpy.types import Context, Event, Operator, OperatorFileListElement
from bpy_extras.io_utils import ImportHelper

from .. import choices, jobs, native
from ..read import importers, readers
from ..sync.points import built, cache, kept
from . import polls
from .steps import Stepped

PIP: list[str] | None = None  # in place of this Python's own
LOOK = 3.0  # seconds between two looks at how much is kept

_looked: list[tuple[float, tuple[int, int]]] = []  # when last, and what was there


class _Installing(Stepped):
    def _install(self, what: Iterator[str]) -> jobs.Steps[set[str]]:
        """Goes through what it does, and tells."""
        try:
            for doing in what:
                self._progress.doing = doing
                self._progress.step(self._progress.value())
                yield jobs.Pause()
        except readers.ReadersError as error:
            self.report({'ERROR'}, importers.told(f"Patina: {error}"))
            return {'CANCELLED'}
        except native.PatinaCancelled:
            self.report({'INFO'}, "Patina: installation canceled. Nothing was installed")
            return {'CANCELLED'}
        finally:
            what.close()
        lacking = readers.missing()
        if lacking:
            self.report({'WARNING'}, f"Patina: still missing: {', '.join(lacking)}. {readers.WITHOUT}")
        else:
            self.report({'INFO'}, "Installed the packages for LAZ, COPC, E57 and DXF")
        return {'FINISHED'}

    def execute(self, context: Context) -> set[str]:
        self._progress = importers.Progress()
        return self.begin(context, self._install(self._wheels()))


class PATINA_OT_install_readers(_Installing, Operator):
    """Download the missing packages for LAZ, COPC, E57 and DXF from PyPI into Patina's folder"""

    bl_idname = "patina.install_readers"
    bl_label = "Install Readers"
    bl_options = {'REGISTER', 'INTERNAL'}

    @classmethod
    def poll(cls, _context: Context) -> bool:
        return polls.allowed(cls, "" if getattr(bpy.app, "online_access", True) else
                             "Preferences > System > Network does not allow online access: install from files")  # Blender 4.2

    def invoke(self, context: Context, _event: Event) -> set[str]:
        self._invoked = True
        return self.execute(context)

    def _wheels(self) -> Iterator[str]:
        import tempfile
        with tempfile.TemporaryDirectory(prefix="patina-wheels-") as place:
            yield from readers.download(Path(place), PIP)
            yield from readers.install(Path(place).glob("*.whl"), choices.readers_folder())


class PATINA_OT_install_reader_files(_Installing, Operator, ImportHelper):
    """Install the packages for LAZ, COPC, E57 and DXF from wheel files (.whl), without a network"""

    bl_idname = "patina.install_reader_files"
    bl_label = "Install from Files..."
    bl_options = {'REGISTER', 'INTERNAL'}

    filter_glob: StringProperty(default="*.whl", options={'HIDDEN'})
    files: CollectionProperty(type=OperatorFileListElement, options={'HIDDEN', 'SKIP_SAVE'})
    directory: StringProperty(subtype='DIR_PATH', options={'HIDDEN', 'SKIP_SAVE'})

    def invoke(self, context: Context, event: Event) -> set[str]:
        self._invoked = True
        return super().invoke(context, event)

    def _wheels(self) -> Iterator[str]:
        """Those chosen; of a folder all that are in it."""
        chosen = [Path(self.directory) / item.name for item in self.files if item.name] or [Path(self.filepath)]
        found = [wheel for path in chosen for wheel in (path.glob("*.whl") if path.is_dir() else [path])]
        if not found:
            raise readers.ReadersError(f"there is no .whl in {chosen[0]}")
        yield from readers.install(found, choices.readers_folder())


class PATINA_OT_remove_caches(Operator):
    """List what Patina has stored on this disk, and delete it. Caches are rebuilt or downloaded again when needed"""

    bl_idname = "patina.remove_caches"
    bl_label = "Remove Caches..."
    bl_options = {'REGISTER', 'INTERNAL'}

    clouds: BoolProperty(name="Linked Clouds", default=True, options={'SKIP_SAVE'}, description="Caches of linked files. They are rebuilt when needed")
    points: BoolProperty(name="Downloaded Points", default=True, options={'SKIP_SAVE'},
                         description="Downloaded parts of COPC and EPT clouds. They are downloaded again when needed")
    packages: BoolProperty(name="Installed Readers", default=False, options={'SKIP_SAVE'},
                           description="Packages that Install Readers has put into Patina's folder. Delete them before you uninstall Patina")

    def invoke(self, context: Context, _event: Event) -> set[str]:
        self._stored = _stored()
        return context.window_manager.invoke_props_dialog(self, width=500)

    def draw(self, _context: Context) -> None:
        for name, (folder, count, size) in self._stored.items():
            box = self.layout.box()
            row = box.row()
            row.prop(self, name)
            row.label(text=f"{count:,} file{'s' * (count != 1)}, {size / 1e9:.2f} GB")
            box.label(text=str(folder))

    def execute(self, _context: Context) -> set[str]:
        deleted = []
        if self.clouds:
            built.CACHE.clear()  # maps some of them
            deleted.append(cache.clear())
        if self.points:
            deleted.append(cache.clear_pages())
            _looked.clear()
        if self.packages:
            deleted.append(readers.remove(choices.readers_folder().parent))
        count, size = (sum(column) for column in zip(*deleted, strict=True)) if deleted else (0, 0)
        self.report({'INFO'}, f"Deleted {count:,} file{'s' * (count != 1)}, {size / 1e9:.2f} GB")
        return {'FINISHED'}


def _stored() -> dict[str, tuple[Path, int, int]]:
    """By property of the operator: the folder, how many files of Patina it holds, and their bytes."""
    packages = choices.readers_folder().parent
    return {"clouds": (kept.folder(), *cache.held()), "points": (cache.pages_folder(), *cache.pages_held()), "packages": (packages, *readers.held(packages))}


class PATINA_OT_open_manual(Operator):
    """Open the user manual"""

    bl_idname = "patina.open_manual"
    bl_label = "Manual"
    bl_options = {'REGISTER', 'INTERNAL'}

    def execute(self, _context: Context) -> set[str]:
        path = manual()
        if path is None:
            self.report({'ERROR'}, "Patina: the manual is missing")
            return {'CANCELLED'}
        bpy.ops.wm.path_open(filepath=str(path))
        return {'FINISHED'}


def manual() -> Path | None:
    """The page in the zip, else what it is made of, in a checkout."""
    own = Path(__file__).resolve().parents[1]
    return next((path for path in (own / "manual/index.html", own / "README.md") if path.is_file()), None)


def cache_text() -> str:
    count, size = cache.held()
    return f"{count} kept, {size / 1e9:.2f} GB"


def pages_held() -> tuple[int, int]:
    """Parts of files that are kept, and their bytes; looked up now and then, for panels are drawn often."""
    if not _looked or time.monotonic() > _looked[0][0]:
        began = time.monotonic()
        found = cache.pages_held()
        now = time.monotonic()
        _looked[:] = [(now + max(LOOK, 50.0 * (now - began)), found)]  # a slow disk is asked seldom
    return _looked[0][1]


def draw_help(menu: bpy.types.Menu, _context: Context) -> None:
    menu.layout.separator()
    menu.layout.operator("patina.open_manual", text="Patina Manual", icon='HELP')


_CLASSES = (PATINA_OT_install_readers, PATINA_OT_install_reader_files, PATINA_OT_remove_caches, PATINA_OT_open_manual)

_register_classes, _unregister_classes = bpy.utils.register_classes_factory(_CLASSES)


def register() -> None:
    _register_classes()
    bpy.types.TOPBAR_MT_help.append(draw_help)


def unregister() -> None:
    bpy.types.TOPBAR_MT_help.remove(draw_help)
    _unregister_classes()
