# SPDX-License-Identifier: GPL-3.0-or-later
"""What a farm's Blender does of a job: blender -b scene.blend --python in_blender.py -- frame N PATH | tile N COLUMNS ROWS PATH | merge COLUMNS ROWS PATH TILES...

Lies in the job's folder. A frame is written as F12 with Save writes it; a tile is a border of it in linear floats, which merging puts together and saves as the scene says. Whole or not at all."""
import importlib
import json
import os
import sys
from pathlib import Path

import addon_utils
import bpy
import numpy as np

FOLDER = Path(__file__).resolve().parent


def fail(text: str) -> None:
    print(f"patina job: {text}", file=sys.stderr, flush=True)
    sys.stderr.flush()
    os._exit(1)  # Blender ends with 0 whatever a script's SystemExit says in some versions


def enable(version: list) -> None:
    """Patina itself, of the job's version: as it is installed, or from the folder that PATINA_ADDON names."""
    place = os.environ.get("PATINA_ADDON")
    if place:
        sys.path.insert(0, str(Path(place).parent))
        module = importlib.import_module(Path(place).name)
        if not hasattr(bpy.types.Scene, "patina"):
            module.register()
    else:
        module = next((each for each in addon_utils.modules() if addon_utils.module_bl_info(each).get("name") == "Patina"), None)
        if module is None:
            fail("the Patina add-on is not installed in this Blender")
        if not addon_utils.check(module.__name__)[1]:
            addon_utils.enable(module.__name__)
    found = (getattr(module, "bl_info", None) or addon_utils.module_bl_info(module)).get("version", ())
    found = [int(part) for part in (found.split(".") if isinstance(found, str) else found)]  # a text where Blender took it from the manifest
    if found != version:
        fail(f"the job was made with Patina {'.'.join(map(str, version))}; here is {'.'.join(map(str, found))}")


def render_to(scene: bpy.types.Scene, path: Path) -> None:
    """write_still, and into its place. Blender's own name for it has no ending: Patina's frames keep theirs."""
    beside = path.with_name(f".{path.stem}-{os.getpid()}{path.suffix}")
    scene.render.filepath, scene.render.use_file_extension, scene.render.use_overwrite = str(beside), False, True
    if bpy.ops.render.render(write_still=True) != {'FINISHED'} or not beside.is_file():
        beside.unlink(missing_ok=True)
        fail(f"Blender drew no picture for {path}")
    os.replace(beside, path)


def frame(scene: bpy.types.Scene, number: str, path: str) -> None:
    scene.frame_set(int(number))
    render_to(scene, Path(path))


def size_of(scene: bpy.types.Scene) -> tuple:
    render = scene.render
    return int(render.resolution_x * render.resolution_percentage / 100), int(render.resolution_y * render.resolution_percentage / 100)


def cut(size: int, count: int, i: int) -> tuple:
    return size * i // count, size * (i + 1) // count


def place_of(scene: bpy.types.Scene, number: int, columns: int, rows: int) -> tuple:
    """Left, bottom, right, top of a tile: from 1 on, from the top left, row by row."""
    width, height = size_of(scene)
    left, right = cut(width, columns, (number - 1) % columns)
    top, bottom = cut(height, rows, (number - 1) // columns)
    return left, height - bottom, right, height - top


def tile(scene: bpy.types.Scene, number: str, columns: str, rows: str, path: str) -> None:
    width, height = size_of(scene)
    left, bottom, right, top = place_of(scene, int(number), int(columns), int(rows))
    render = scene.render
    render.use_border = render.use_crop_to_border = True
    # half a pixel within: Blender rounds down what floats have made of a share
    render.border_min_x, render.border_max_x = (left + 0.25) / width, (right + 0.25) / width
    render.border_min_y, render.border_max_y = (bottom + 0.25) / height, (top + 0.25) / height
    render.use_compositing = render.use_sequencer = False  # these look at the whole
    settings = render.image_settings
    if hasattr(settings, "media_type"):  # from 5.0 on
        settings.media_type = 'IMAGE'
    settings.file_format, settings.color_mode, settings.color_depth, settings.exr_codec = 'OPEN_EXR', 'RGBA', '32', 'ZIP'
    render_to(scene, Path(path))
    found = read(Path(path)).shape[:2]
    if found != (top - bottom, right - left):
        Path(path).unlink()
        fail(f"tile {number} is {found[1]} x {found[0]} pixels; {right - left} x {top - bottom} were asked for")


def read(path: Path) -> np.ndarray:
    """Rows from the bottom, linear RGBA, as it stands in the file."""
    image = bpy.data.images.load(str(path))
    try:
        if not image.size[0]:
            fail(f"{path} is damaged")
        image.colorspace_settings.is_data = True
        image.alpha_mode = 'PREMUL'
        pixels = np.empty(image.size[0] * image.size[1] * 4, np.float32)
        image.pixels.foreach_get(pixels)
        return pixels.reshape(image.size[1], image.size[0], 4)
    finally:
        bpy.data.images.remove(image)


def merge(scene: bpy.types.Scene, columns: str, rows: str, path: str, *tiles: str) -> None:
    width, height = size_of(scene)
    picture = np.empty((height, width, 4), np.float32)
    for number, name in enumerate(tiles, 1):
        left, bottom, right, top = place_of(scene, number, int(columns), int(rows))
        pixels = read(Path(name))
        if pixels.shape[:2] != (top - bottom, right - left):
            fail(f"{name} is {pixels.shape[1]} x {pixels.shape[0]} pixels; tile {number} has {right - left} x {top - bottom}: draw it anew")
        picture[bottom:top, left:right] = pixels
    image = bpy.data.images.new("Patina", width, height, alpha=True, float_buffer=True)
    image.alpha_mode = 'PREMUL'
    image.pixels.foreach_set(picture.ravel())
    target = Path(path)
    beside = target.with_name(f".{target.stem}-{os.getpid()}{target.suffix}")
    image.save_render(str(beside), scene=scene)
    if not beside.is_file():
        fail(f"{path} cannot be written")
    os.replace(beside, target)


def main() -> None:
    job = json.loads((FOLDER / "job.json").read_text("utf-8"))
    kind, *arguments = [word for word in sys.argv[sys.argv.index("--") + 1:] if not word.startswith("--patina-")]
    enable(job["addon"])
    scene = bpy.data.scenes.get(job["scene"])
    if scene is None:
        fail(f"scene.blend has no scene '{job['scene']}'")
    bpy.context.window.scene = scene
    if kind != "frame":
        scene.frame_set(job["frame"])
    {"frame": frame, "tile": tile, "merge": merge}[kind](scene, *arguments)


try:
    main()
except Exception as error:
    import traceback
    traceback.print_exc()
    fail(str(error))
