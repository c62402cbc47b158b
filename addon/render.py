# SPDX-License-Identifier: GPL-3.0-or-later
"""Described scene in, planes out. Final render and viewport share this; nothing here knows Blender."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from . import backdrop, jobs, mattes, memory, native
from .sync import Camera, DeviceChoice, SceneDescription
from .sync.analyzing import ANALYSES
from .sync.colors import OWN, SCALAR

# Planes take some 130 bytes a pixel: 2 GB for a picture of that size. Larger ones are made in tiles, and smaller ones too
# where memory is short; the smaller the tiles, the more of the time goes into the band around each.
PIXEL_BYTES = 130
LARGE_PICTURE = 1 << 24  # pixels
LEAST_TILE, TILE_STEP = 512, 256  # pixels a side


@dataclass(frozen=True)
class Picture:
    planes: dict[str, np.ndarray]  # (height, width, channels) by plane name, row 0 at the bottom
    stats: dict[str, Any]
    device: str
    notice: str = ""  # what the artist should know about how it came to be


# The device outlives frames: starting threads or a GL context costs more than many a picture.
_device: tuple[DeviceChoice, native.Device] | None = None
_device_lock = threading.Lock()


def device_for(choice: DeviceChoice) -> native.Device:
    global _device
    with _device_lock:
        if _device is None or _device[0] != choice:
            _device = (choice, native.Device(choice.name, choice.threads))
        return _device[1]


def forget_device() -> None:
    """Lets go of the device; frames that still use it keep it alive."""
    global _device
    with _device_lock:
        _device = None


def draw(description: SceneDescription, planes: Iterable[str], poll: Callable[[float], bool],
         tile_size: int = 0) -> Picture:
    """Renders on a worker thread; poll(progress) is called on this one and returns True to cancel."""
    behind = backdrop.pixels(description, lambda: poll(0.0)) if description.behind else None
    if not mattes.are_needed(description):
        picture = _draw(description, planes, poll, tile_size)
        if behind is None:
            return picture
        return replace(picture, planes=picture.planes | {"COMBINED": backdrop.over(picture.planes["COMBINED"], behind)})
    others = mattes.needed(description)
    count = 1 + len(others)

    def part(number: int) -> Callable[[float], bool]:
        return lambda progress: poll((number + progress) / count)

    picture = _draw(mattes.picture(description), planes, part(0), tile_size)
    found = [_draw(other, ["COMBINED"], part(number), tile_size).planes["COMBINED"] for number, other in enumerate(others, 1)]
    return replace(picture, planes=picture.planes | {
        "COMBINED": mattes.finish(picture.planes["COMBINED"], description, found, behind)})


def _draw(description: SceneDescription, planes: Iterable[str], poll: Callable[[float], bool], tile_size: int) -> Picture:
    """Where the GPU fails in the middle of it (lost context, memory, a broken driver) the CPU draws the picture."""
    wanted = list(planes)
    device = _open(description.device, poll)
    try:
        return _draw_on(device, description, wanted, poll, tile_size)
    except native.PatinaCancelled:
        raise
    except native.PatinaError as error:
        if not device.name.startswith("gl"):
            raise
        reason = str(error)  # the error itself would keep the whole picture alive
    forget_device()
    picture = _draw_on(_open(replace(description.device, name="cpu"), poll), description, wanted, poll, tile_size)
    notice = f"{device.label} failed, the processor drew this picture: {reason}"
    return replace(picture, notice=f"{notice}; {picture.notice}" if picture.notice else notice)


def bake_shadows(description: SceneDescription, path: str) -> None:
    """Computes the scene's shadow textures and writes them to a file; PatinaError with the reason when it cannot."""
    _with_frame(description, lambda frame, scene: (frame.bake_shadows(scene), frame.save_shadows(path)))


def check_shadows(description: SceneDescription, path: str) -> None:
    """PatinaError with the reason unless the file's shadow textures are for this scene as it is."""
    _with_frame(description, lambda frame, scene: frame.load_shadows(scene, path))


def _with_frame(description: SceneDescription, work: Callable[[native.Frame, native.Scene], Any]) -> None:
    device = device_for(description.device)
    with native.Scene() as scene, native.Frame(device) as frame:
        describe(scene, description, [])
        with ANALYSES.drawing():
            jobs.run(lambda: work(frame, scene), frame.cancel, lambda: False)


def _load_shadows(frame: native.Frame, description: SceneDescription) -> str:
    """Takes baked shadows where they fit; else the reason why they are computed."""
    if not description.shadow_file:
        return ""
    try:
        with native.Scene() as scene:
            describe(scene, description, [])
            frame.load_shadows(scene, description.shadow_file)
    except native.PatinaError as error:
        return f"baked shadows are not used: {error}"
    return ""


def _open(choice: DeviceChoice, poll: Callable[[float], bool]) -> native.Device:
    return jobs.run(lambda: device_for(choice), lambda: None, lambda: poll(0.0))


def _draw_on(device: native.Device, description: SceneDescription, wanted: list[str], poll: Callable[[float], bool],
             tile_size: int) -> Picture:
    """Tile by tile: a tile's pixels are those of the whole picture (the library keeps a guard band around it), so tiles only
    save memory."""
    if description.panorama:
        return _draw_panorama(device, description, wanted, poll, tile_size)
    regions = tiles(description.settings.region, tile_size, memory.for_planes())
    if len(regions) > 1:  # all of them take from whole shadow textures
        description = replace(description, settings=replace(description.settings, shadow_lazy=0))
    x0, y0, x1, y1 = description.settings.region
    picture: dict[str, np.ndarray] = {}
    # The frame is made and closed on this thread, so that poll never meets a dead handle.
    with native.Frame(device) as frame:
        done, stats, notice = 0, {}, ""

        def work() -> None:
            nonlocal done, notice
            notice = _load_shadows(frame, description)
            for region in regions:
                tile = replace(description, settings=replace(description.settings, region=region))
                for name, pixels in _draw_tile(frame, tile, wanted, stats).items():
                    if len(regions) == 1:
                        picture[name] = pixels
                        continue
                    if name not in picture:
                        picture[name] = np.empty((y1 - y0, x1 - x0, pixels.shape[2]), pixels.dtype)
                    picture[name][region[1] - y0:region[3] - y0, region[0] - x0:region[2] - x0] = pixels
                done += 1

        with ANALYSES.drawing():
            jobs.run(work, frame.cancel, lambda: poll((done + frame.progress()) / len(regions)))
        return Picture(picture, stats, device.label, notice)


def _draw_panorama(device: native.Device, description: SceneDescription, wanted: list[str],
                   poll: Callable[[float], bool], tile_size: int) -> Picture:
    """Six pictures, joined."""
    panorama = native.Panorama(**asdict(description.panorama))
    faces: list[Picture] = []
    for face in range(panorama.FACES):
        camera, side = panorama.camera(face)
        settings = replace(description.settings, width=side, height=side, region=(0, 0, side, side))
        faces.append(_draw_on(device, replace(description, panorama=None, camera=Camera(**camera), settings=settings), wanted,
                              lambda share, face=face: poll((face + share) / panorama.FACES), tile_size))
    planes = {name: panorama.join(name, [face.planes[name] for face in faces]) for name in wanted}
    stats = faces[0].stats | {"ms": sum(face.stats["ms"] for face in faces),
                              "layers": max(face.stats["layers"] for face in faces)}
    return replace(faces[0], planes=planes, stats=stats)


def _draw_tile(frame: native.Frame, description: SceneDescription, wanted: list[str],
               stats: dict[str, Any]) -> dict[str, np.ndarray]:
    """Planes of one region. stats: milliseconds add up, the rest is of the last picture."""
    with native.Scene() as scene:
        describe(scene, description, wanted)
        frame.render(scene)
    before = stats.get("ms", 0.0)
    stats.update(frame.stats())
    stats["ms"] += before
    return {name: frame.read_keys() if name == "KEYS" else frame.read(name) for name in wanted}


def tiles(region: tuple[int, int, int, int], size: int, budget: int | None = None) -> list[tuple[int, int, int, int]]:
    """Regions that make up a region, rows from the bottom. size 0: one, unless the picture is large; budget: bytes for planes,
    None: as many as a large picture takes."""
    x0, y0, x1, y1 = region
    across, along = size or x1 - x0, size or y1 - y0
    most = LARGE_PICTURE if budget is None else min(LARGE_PICTURE, budget // PIXEL_BYTES)
    if not size and across * along > most:
        side = max(math.isqrt(most) // TILE_STEP * TILE_STEP, LEAST_TILE)
        across, along = (math.ceil(length / math.ceil(length / side)) for length in (across, along))  # none much smaller
    return [(x, y, min(x + across, x1), min(y + along, y1)) for y in range(y0, y1, along) for x in range(x0, x1, across)]


def shifted(description: SceneDescription, shift: tuple[float, float]) -> SceneDescription:
    """What the camera sees aside, in pixels to the right and up."""
    camera, settings = description.camera, description.settings
    x = shift[0] * (camera.right - camera.left) / settings.width
    y = shift[1] * (camera.top - camera.bottom) / settings.height
    return replace(description, camera=replace(camera, left=camera.left + x, right=camera.right + x, bottom=camera.bottom + y,
                                               top=camera.top + y))


def _bits(planes: Iterable[str]) -> int:
    return sum(1 << native.PLANES[name][0] for name in set(planes))


def describe(scene: native.Scene, description: SceneDescription, wanted: Iterable[str]) -> None:
    """Fills a native scene; the description's clouds must be built."""
    planes = {native.split_plane(plane) for plane in {"COMBINED", *wanted} - {"KEYS"}}
    settings = asdict(description.settings)
    settings["passes"] = _bits(name for name, layer in planes if not layer)
    settings["layer_passes"] = _bits(name for name, layer in planes if layer)
    settings["layers"] = max(settings["layers"], *(layer for _, layer in planes), 0)  # a pass wants its layer peeled
    scene.set_settings(**settings)
    scene.set_effects(**asdict(description.effects))
    scene.set_camera(**asdict(description.camera))
    if description.lines:
        scene.set_lines(**asdict(description.lines))
    headlight = [description.headlight.of(description.camera)] if description.headlight else []
    for light in [*description.lights, *headlight]:
        scene.add_light(**asdict(light))
    for clip in description.clips:
        scene.add_clip(**asdict(clip))
    for item in description.clouds:
        style = item.style
        if style.color_source == SCALAR and not item.cloud.has_scalars:  # a notice has said so
            style = replace(style, color_source=OWN)
        scene.add_cloud(item.cloud, **asdict(style))
    for item in description.meshes:
        scene.add_mesh(item.mesh, **asdict(item.style))
