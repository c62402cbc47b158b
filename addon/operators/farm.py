# SPDX-License-Identifier: GPL-3.0-or-later
"""Render > Send to Farm...: a job's folder with the scene in it, which a farm's Blenders draw. What the folder holds says farm/job.py.

What writes it is imported by who sends: with Python's sockets and processes it would take 10 ms of Blender's start."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty
from bpy.types import Context, Operator, Scene

from ..draw.engine import PatinaRenderEngine
from ..sync.points import files, linked, sequence
from ..sync.view import combination

MOVIES = {'FFMPEG', 'AVI_JPEG', 'AVI_RAW'}
PLAIN = {'R_LAYERS', 'COMPOSITE', 'GROUP_OUTPUT', 'GROUP_INPUT', 'VIEWER'}  # nodes that change no pixel
LAYERED = {'OPEN_EXR_MULTILAYER', 'MULTILAYER'}


class Refused(Exception):
    """What of the scene no farm can draw; the text is for the artist."""


class PATINA_OT_send_to_farm(Operator):
    """Write a folder with the scene and scripts for Slurm, Open Job Description or Flamenco, which render its frames or the tiles of one large still"""

    bl_idname = "render.patina_farm"
    bl_label = "Send to Farm"
    bl_options = {'REGISTER'}

    directory: StringProperty(subtype='DIR_PATH', options={'SKIP_SAVE'}, description="Folder of the job. All machines must reach it under the same "
                                                                                     "path")
    filter_folder: BoolProperty(default=True, options={'HIDDEN'})
    kind: EnumProperty(name="Tasks", items=(('FRAMES', "Frames", "The frames of the animation, one task per frame", 0),
                                            ('TILES', "Tiles", "The image of this frame, one task per tile", 1)))
    columns: IntProperty(name="Columns", default=4, min=1, max=256, description="Number of tiles per row")
    rows: IntProperty(name="Rows", default=4, min=1, max=256, description="Number of rows of tiles")
    share: BoolProperty(name="Share Built Clouds", default=True,
                        description="Store the caches of linked scans next to the scans, in a folder named .patina, so that no machine builds them "
                                    "again")
    command: StringProperty(options={'HIDDEN', 'SKIP_SAVE'}, description="How to submit the job to Slurm once the folder is written")

    def invoke(self, context: Context, event: bpy.types.Event) -> set[str]:
        if not self.directory:
            place = Path(bpy.data.filepath or Path.home() / "untitled.blend")
            self.directory = str(place.with_name(f"{place.stem}-farm")) + "/"
        context.window_manager.fileselect_add(self)
        return {'RUNNING_MODAL'}

    def draw(self, context: Context) -> None:
        self.layout.use_property_split = True
        self.layout.prop(self, "kind")
        if self.kind == 'TILES':
            self.layout.prop(self, "columns")
            self.layout.prop(self, "rows")
        self.layout.prop(self, "share")

    def execute(self, context: Context) -> set[str]:
        import shlex

        from ..farm import job, task
        folder = Path(bpy.path.abspath(self.directory)).absolute()
        try:
            described = describe(context.scene, self.kind.lower(), (self.columns, self.rows))
            folder.mkdir(parents=True, exist_ok=True)
            bpy.ops.wm.save_as_mainfile(filepath=str(folder / "scene.blend"), copy=True, relative_remap=True)
            described["files"][str(folder / "scene.blend")] = task.look_of(folder / "scene.blend")
            job.write(folder, described)
            if self.share:
                _share(context.scene)
        except (Refused, RuntimeError) as error:
            self.report({'ERROR'}, f"Patina: {error}")
            return {'CANCELLED'}
        except OSError as error:
            self.report({'ERROR'}, f"Patina: {error.filename or folder} cannot be written: {error.strerror}")
            return {'CANCELLED'}
        self.command = f"python3 {shlex.quote(str(folder / 'slurm.py'))}"
        context.window_manager.clipboard = self.command
        self.report({'INFO'}, f"Wrote the job. Slurm: {self.command} (in the clipboard); for others see {folder / 'README.txt'}")
        return {'FINISHED'}


def describe(scene: Scene, kind: str, tiles: tuple[int, int]) -> dict[str, Any]:
    """The scene as task.py reads it. Refused where no farm can draw it so."""
    render, settings = scene.render, scene.render.image_settings
    if scene.camera is None:
        raise Refused("the scene has no camera")
    if settings.file_format in MOVIES:
        raise Refused("a film is no picture: choose an image format for the output, and make the film of the frames")
    if not bpy.data.filepath and render.filepath.startswith("//"):
        raise Refused("the output lies beside a file that was never saved: save it, or give the output a whole path")
    numbers = list(range(scene.frame_start, scene.frame_end + 1, scene.frame_step))
    if kind == "tiles":
        _check_tiles(scene, tiles)
    described = {"name": Path(bpy.data.filepath or "untitled").stem, "kind": kind, "by": "blender", "program": bpy.app.binary_path or "blender",
                 "version": f"Blender {bpy.app.version_string}", "addon": _version(), "scene": scene.name, "directory": str(Path.home()),
                 "output": _output(scene, kind), "files": _files()}
    return {**described, **({"frames": numbers} if kind == "frames" else {"tiles": list(tiles), "frame": scene.frame_current})}


def _check_tiles(scene: Scene, tiles: tuple[int, int]) -> None:
    render = scene.render
    size = [int(each * render.resolution_percentage / 100) for each in (render.resolution_x, render.resolution_y)]
    if render.use_border:
        raise Refused("tiles are of the whole picture: switch off Render Region")
    if render.image_settings.file_format in LAYERED:
        raise Refused("tiles make a picture without passes: choose another image format than multilayer EXR")
    if render.use_multiview:
        raise Refused("tiles make a picture for one eye: switch off Stereoscopy")
    if render.use_compositing and any(node.type not in PLAIN for tree in combination.trees_of(scene) for node in tree.nodes):
        raise Refused("compositing looks at the whole picture: composite the merged one")
    if scene.render.engine == PatinaRenderEngine.bl_idname and scene.patina.noise > 0.0:
        raise Refused("a noise threshold ends at other samples in each tile: switch it off")
    if min(side // count for side, count in zip(size, tiles)) < 4:
        raise Refused(f"tiles of {size[0] // tiles[0]} x {size[1] // tiles[1]} pixels are too small: fewer columns and rows")


def _version() -> list[int]:
    version = sys.modules[__package__.rpartition(".")[0]].bl_info["version"]
    return [int(part) for part in (version.split(".") if isinstance(version, str) else version)]  # a text where Blender took it from the manifest


def _output(scene: Scene, kind: str) -> str:
    """The picture's path; of frames with # for the number, as Blender would write it."""
    render = scene.render
    path = bpy.path.abspath(render.filepath) if render.filepath else str(Path.home())
    if path.endswith(("/", "\\")) or not Path(path).name or Path(path).is_dir():
        path = str(Path(path, "####" if kind == "frames" else "picture"))
    place = Path(path).absolute()
    ending = render.file_extension
    name = place.name if place.name.lower().endswith(ending) or not render.use_file_extension else place.name + ending
    if kind == "frames" and "#" not in name:
        stem = name[:-len(ending)] if name.lower().endswith(ending) else name
        name = f"{stem}####{name[len(stem):]}"
    return str(place.with_name(name if kind == "frames" else name.replace("#", "")))


def _paths_of(used: bool) -> set[Path]:
    """Of volumes (linked clouds are some) and images, of those that something uses or of those that nothing does."""
    return {Path(bpy.path.abspath(item.filepath, library=item.library)) for item in (*bpy.data.volumes, *bpy.data.images)
            if bool(item.users) == used and item.filepath}


def _files() -> dict[str, list]:
    """What of the disk the scene is made of. Refused where something is missing."""
    from ..farm import task
    found = {}
    places = {Path(bpy.path.abspath(path)) for path in bpy.utils.blend_paths(absolute=True, packed=False)}
    places -= _paths_of(used=False) - _paths_of(used=True)  # nor what is left of objects that are gone, until Blender begins anew
    places |= {place for place in map(files.path_of, bpy.data.objects) if place is not None}
    for place in sorted(places):
        if sequence.is_pattern(place) or place.is_dir():
            continue  # which of its files a frame shows, that frame says
        try:
            found[str(place)] = task.look_of(place)
        except OSError as error:
            raise Refused(f"{place} cannot be read: {error.strerror}") from error
    return found


def _share(scene: Scene) -> None:
    for obj in scene.objects:
        source = linked.source_of(obj, scene.frame_current, []) if obj.patina.linked_file else None
        if source is not None:
            linked.share(source)


def _menu(self: bpy.types.Menu, context: Context) -> None:
    if context.engine == PatinaRenderEngine.bl_idname:
        self.layout.operator(PATINA_OT_send_to_farm.bl_idname, text="Send to Farm...")


def register() -> None:
    bpy.utils.register_class(PATINA_OT_send_to_farm)
    bpy.types.TOPBAR_MT_render.append(_menu)


def unregister() -> None:
    bpy.types.TOPBAR_MT_render.remove(_menu)
    bpy.utils.unregister_class(PATINA_OT_send_to_farm)
