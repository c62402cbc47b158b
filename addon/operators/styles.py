# SPDX-License-Identifier: GPL-3.0-or-later
"""Apply, save, load and delete styles."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import EnumProperty, StringProperty
from bpy.types import Context, Event, Object, Operator
from bpy_extras.io_utils import ImportHelper

from .. import native, point_data, sync, whole
from ..draw import thumbnails
from ..styles import styles


def _points(context: Context) -> Object | None:
    """The object whose look a style takes: the active one, else the first with points."""
    active = context.view_layer.objects.active
    if active and point_data.is_cloud(active):
        return active
    return next((obj for obj in context.view_layer.objects if point_data.is_cloud(obj)), None)


def _picture(context: Context, path: Path, of_scene: bool) -> str:
    """Renders a style's thumbnail; the reason when there is none."""
    try:
        depsgraph = context.evaluated_depsgraph_get()
        pixels = thumbnails.of_scene(depsgraph) if of_scene else thumbnails.of_sample(depsgraph, _points(context))
        thumbnails.save(pixels, path)
    except (native.PatinaError, sync.CameraError, OSError) as error:
        return f"no thumbnail: {error}"
    return ""


class _StyleOperator:
    bl_options = {'REGISTER', 'UNDO'}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return context.scene.render.engine == 'PATINA'

    def execute(self, context: Context) -> set[str]:
        try:
            notices = self._work(context)
        except styles.StyleError as error:
            self.report({'ERROR'}, f"Patina: {error}")
            return {'CANCELLED'}
        for notice in notices:
            self.report({'WARNING'}, f"Patina: {notice}")
        return {'FINISHED'}


class PATINA_OT_apply_style(_StyleOperator, Operator):
    """Apply the style to the scene and its points"""

    bl_idname = "patina.apply_style"
    bl_label = "Apply Style"

    style: StringProperty(name="Style", description="File name of the style, without extension")

    def _work(self, context: Context) -> list[str]:
        found = styles.entry(self.style)
        notices = styles.apply_to_scene(context.scene, found.key)
        context.scene.patina.style.applied = found.key
        context.scene.patina.style.notice = "; ".join(notices)
        return notices


class PATINA_OT_save_style(_StyleOperator, Operator):
    """Save the look of the scene and of the active points as a style"""

    bl_idname = "patina.save_style"
    bl_label = "Save Style"

    name: StringProperty(name="Name", default="My Style", description="Replace an existing style of the same name")
    thumbnail: EnumProperty(
        name="Thumbnail", default='SAMPLE',
        description="Content of the preview image",
        items=(('SAMPLE', "Sample", "An urn in this style", 0), ('SCENE', "This Scene", "The center of the camera's view", 1)))

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and _points(context) is not None

    def invoke(self, context: Context, event: Event) -> set[str]:
        return context.window_manager.invoke_props_dialog(self)

    def _work(self, context: Context) -> list[str]:
        label = self.name.strip()
        key = bpy.path.clean_name(label).lower()
        if not label:
            raise styles.StyleError("a style needs a name")
        path = styles.own_folder(create=True) / f"{key}.json"
        styles.write(path, styles.taken(label, context.scene, _points(context)))
        context.scene.patina.style.applied = key
        custom = _points(context).patina.colors
        lost = custom.ramp == 'CUSTOM' and custom.source not in {'OWN', 'FIXED', 'MATERIAL'}
        notices = ["a ramp of your own is not kept in the style"] if lost else []
        return notices + list(filter(None, [_picture(context, path.with_suffix(".png"), self.thumbnail == 'SCENE')]))


class PATINA_OT_load_style(_StyleOperator, Operator, ImportHelper):
    """Load a style from a file, add it to your styles, and apply it"""

    bl_idname = "patina.load_style"
    bl_label = "Load Style"

    filename_ext = ".json"
    filter_glob: StringProperty(default="*.json", options={'HIDDEN'})

    def _work(self, context: Context) -> list[str]:
        source = Path(bpy.path.abspath(self.filepath))
        styles.read(source)  # before anything is copied
        path = styles.own_folder(create=True) / source.name
        try:
            for ending in (".json", ".png"):
                given = source.with_suffix(ending)
                if given.is_file() and given.resolve() != path.with_suffix(ending).resolve():
                    whole.copy(given, path.with_suffix(ending))
        except OSError as error:
            raise styles.StyleError(f"{path}: {error.strerror}") from None
        notices = styles.apply_to_scene(context.scene, path.stem)
        context.scene.patina.style.applied = path.stem
        if not path.with_suffix(".png").is_file() and _points(context):
            notices += list(filter(None, [_picture(context, path.with_suffix(".png"), False)]))
        return notices


class PATINA_OT_delete_style(_StyleOperator, Operator):
    """Delete the chosen style, if it is your own. The scene does not change"""

    bl_idname = "patina.delete_style"
    bl_label = "Delete Style"
    bl_options = {'REGISTER'}  # files are deleted for good

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and any(
            found.key == context.scene.patina.style.applied and found.own for found in styles.entries())

    def invoke(self, context: Context, event: Event) -> set[str]:
        return context.window_manager.invoke_confirm(self, event)

    def _work(self, context: Context) -> list[str]:
        found = styles.entry(context.scene.patina.style.applied)
        try:
            found.path.unlink()
            found.thumbnail.unlink(missing_ok=True)
        except OSError as error:
            raise styles.StyleError(f"{error.filename}: {error.strerror}") from None
        return []


_CLASSES = (PATINA_OT_apply_style, PATINA_OT_save_style, PATINA_OT_load_style, PATINA_OT_delete_style)

register, unregister = bpy.utils.register_classes_factory(_CLASSES)
