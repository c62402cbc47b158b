# SPDX-License-Identifier: GPL-3.0-or-later
"""Described scene in, planes out. Final render and viewport share this; nothing here knows Blender."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from .. import jobs, memory, native
from ..description.scene import SceneDescription
from ..description.settings import DeviceChoice
from ..read import streaming
from ..sync.analyses.analyzing import ANALYSES
from ..sync.lighting.lights import of_headlight
from ..sync.points import edits, ranges, soft
from ..sync.points.colors import OWN, SCALAR
from . import backdrop, cryptomatte, histogram, mattes
from .pieces import LARGE_PICTURE, LEAST_TILE, PIXEL_BYTES, Canvas, Piece, Planes, tiles

# Pictures of several samples: milliseconds of them between two looks at whether somebody wants to see the picture; seconds between
# two that are shown, and how many times as long they last at least as showing one took.
STEP, SHOWN_EVERY, SHOWN_SHARE = 100.0, 0.25, 10.0
EXPECTED_SAMPLES = 16  # of a piece whose noise decides, for its progress

Show = Callable[[Planes], None]


@dataclass(frozen=True)
class Picture:
    planes: Planes
    stats: dict[str, Any]
    device: str
    notice: str = ""  # what the artist should know about how it came to be
    ranks: dict[str, cryptomatte.Ranks] = field(default_factory=dict)  # by kind of Cryptomatte


# The device outlives frames: starting threads or a GL context costs more than many a picture.
_device: tuple[DeviceChoice, native.Device] | None = None
_device_lock = threading.Lock()


def device_for(choice: DeviceChoice) -> native.Device:
    global _device
    with _device_lock:
        if _device is None or _device[0] != choice:
            _device = (choice, native.Device(choice.name, choice.threads, choice.mapped))
        return _device[1]


def forget_device() -> None:
    """Lets go of the device; frames that still use it keep it alive."""
    global _device
    with _device_lock:
        _device = None


def draw(description: SceneDescription, planes: Iterable[str], poll: Callable[[float], bool],
         tile_size: int = 0, show: Show | None = None) -> Picture:
    """Renders on a worker thread; poll(progress) is called on this one and returns True to cancel. show: is given what there is
    of a picture of several samples, on this thread too, all planes first and then those that changed. Cancelled once it is
    there, such a picture keeps the samples that it has: its stats tell how many are pending."""
    wanted = set(planes)
    kinds = [kind for kind in cryptomatte.KINDS if any(plane.startswith(f"{cryptomatte.PLANE} {kind}") for plane in wanted)]
    native_planes = {plane for plane in wanted if not plane.startswith(cryptomatte.PLANE)}
    if not kinds:
        return _draw_seen(description, native_planes, poll, tile_size, show)
    picture = _draw_seen(description, native_planes | {"NUMBERS"}, lambda share: poll(0.5 * share), tile_size, show)
    made = cryptomatte.plan(description, picture.planes["NUMBERS"] if _is_hard(description) else None)

    def part(number: int) -> Callable[[float], bool]:
        return lambda share: poll(0.5 + 0.5 * (number + share) / len(made.scenes))

    try:
        found = [_draw_seen(scene, ["COMBINED"], part(number), tile_size).planes["COMBINED"]
                 for number, scene in enumerate(made.scenes)]
    except native.PatinaCancelled:  # the picture itself stays
        return picture
    return replace(picture, ranks={kind: cryptomatte.ranks(made, found, kind) for kind in kinds} if found else {})


def _is_hard(description: SceneDescription) -> bool:
    """Whether nothing shows but the nearest surface, beside thin edges."""
    return description.effects.focus_aperture <= 0.0 and not any(
        item.style.transparency > 0.0 or item.cloud.has_opacities for item in description.clouds)


def _draw_seen(description: SceneDescription, planes: Iterable[str], poll: Callable[[float], bool], tile_size: int,
               show: Show | None = None) -> Picture:
    """With what lies behind, and what is held out."""
    wanted = list(planes)
    behind = backdrop.pixels(description, lambda: poll(0.0)) if description.behind else None
    if mattes.are_needed(description):
        parts = [(mattes.picture(description), wanted), *((other, ["COMBINED"]) for other in mattes.needed(description))]
    else:
        parts = [(description, wanted)]

    def finish(found: list[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
        color, *others = (planes["COMBINED"] for planes in found)
        if others:
            color = mattes.finish(color, description, others, behind)
        elif behind is not None:
            color = backdrop.over(color, behind)
        return found[0] | {"COMBINED": color}

    def within(device: native.Device, size: int, budget: int) -> Picture:
        whole = len(tiles(description.settings.region, size, budget)) == 1
        if whole and not description.panorama and description.settings.pixel_samples != 1:
            return _draw_samples(device, parts, finish, poll, show)
        return _draw_pieces(device, [(Canvas(item, size, budget), names) for item, names in parts], finish, poll, show)

    budget = (memory.for_planes() or LARGE_PICTURE * PIXEL_BYTES) // len(parts)
    return _on_device(description.device, poll, lambda device: _as_it_fits(device, tile_size, budget, within))


def _as_it_fits(device: native.Device, size: int, budget: int, within: Callable[[native.Device, int, int], Picture]) -> Picture:
    """Draws in tiles of this size (0: as the budget of bytes has them). Where the device refuses these as too large, in smaller ones: of half
    the budget each time."""
    while True:
        try:
            return within(device, size, budget)
        except MemoryError:  # numpy's: tiles fit, what they are joined to does not
            raise native.PatinaError("out of memory for the whole image: render a smaller one, or a border of it", native.MEMORY) from None
        except native.PatinaError as error:
            if error.code != native.TOO_LARGE or budget < LEAST_TILE ** 2 * PIXEL_BYTES:
                raise
        budget = min(budget, LARGE_PICTURE * PIXEL_BYTES, size * size * PIXEL_BYTES or budget) // 2
        size = 0


def _on_device(choice: DeviceChoice, poll: Callable[[float], bool], draw_on: Callable[[native.Device], Picture]) -> Picture:
    """Where the GPU fails in the middle of it (lost context, memory, a broken driver), or draws not even
    small tiles, the CPU draws the picture."""
    device = _open(choice, poll)
    try:
        return draw_on(device)
    except native.PatinaCancelled:
        raise
    except native.PatinaError as error:
        if not device.name.startswith("gl"):
            raise
        reason = str(error)  # the error itself would keep the whole picture alive
    forget_device()
    picture = draw_on(_open(replace(choice, name="cpu"), poll))
    notice = f"{device.label} failed, the processor drew this picture: {reason}"
    return replace(picture, notice=f"{notice}; {picture.notice}" if picture.notice else notice)


class _News:
    """What there is of a picture, from the worker that makes it to the thread that shows it."""

    def __init__(self, show: Show | None) -> None:
        self._show = show
        self._planes: Planes | None = None
        self._next = 0.0  # when somebody wants to see more

    def wanted(self) -> bool:
        """The worker asks."""
        return self._show is not None and self._planes is None and time.monotonic() >= self._next

    def bring(self, planes: Planes) -> None:
        """The worker's; afterwards it does not write into them."""
        self._planes = planes

    def show(self) -> None:
        """The other thread's, over and over."""
        if self._planes is None or self._show is None:
            return
        start = time.monotonic()
        self._show(self._planes)
        now = time.monotonic()
        self._next = now + max(SHOWN_EVERY, SHOWN_SHARE * (now - start))
        self._planes = None


def _draw_samples(device: native.Device, parts: list[tuple[SceneDescription, list[str]]],
                  finish: Callable[[list[Planes]], Planes], poll: Callable[[float], bool], show: Show | None) -> Picture:
    """A picture of several samples, out of parts with the planes that each gives: the first sample of all of them, then the others
    by and by."""
    news, notice = _News(show), ""
    found: list[Planes] = []
    with ExitStack() as stack:  # frames are made and closed on this thread, so that poll never meets a dead handle
        frames = [stack.enter_context(native.Frame(device)) for _ in parts]

        def better(scenes: list[native.Scene]) -> None:
            while any(pending := [frame.stats()["pixel_pending"] for frame in frames]):
                for number, (frame, scene) in enumerate(zip(frames, scenes, strict=True)):
                    if pending[number]:
                        frame.refine(scene, STEP / len(frames))
                if news.wanted():
                    read()
                    news.bring({"COMBINED": finish(found)["COMBINED"]})

        def read() -> None:
            for number, frame in enumerate(frames):
                found[number] = found[number] | {"COMBINED": frame.read("COMBINED")}

        def work() -> None:
            nonlocal notice
            notice = _load_shadows(frames[0], parts[0][0])
            with ExitStack() as open_scenes:
                scenes = [open_scenes.enter_context(native.Scene()) for _ in parts]
                for frame, scene, (description, wanted) in zip(frames, scenes, parts, strict=True):
                    describe(scene, replace(description, settings=replace(description.settings, pixel_progressive=1)), wanted)
                    frame.render(scene)
                    found.append({name: _read(frame, name) for name in wanted})
                if show:
                    news.bring(finish(found))
                try:
                    better(scenes)
                except native.PatinaCancelled:  # what there is stays
                    pass
                read()

        def look() -> bool:
            news.show()
            return poll(sum(frame.progress() for frame in frames) / len(frames))

        with ANALYSES.drawing():
            jobs.run(work, lambda: [frame.cancel() for frame in frames], look)
        stats = [frame.stats() for frame in frames]
        return Picture(finish(found), stats[0] | {"ms": sum(each["ms"] for each in stats),
                                                  "pixel_pending": max(each["pixel_pending"] for each in stats)},
                       device.label, notice)


def await_points(description: SceneDescription, poll: Callable[[str, float], bool], tile_size: int = 0) -> None:
    """Of clouds whose points are read as they are wanted: waits for all that the picture shows. poll(what, share) on this thread;
    PatinaCancelled where it returns True."""
    streams = streaming.streams_of(item.cloud for item in description.clouds)
    if not streams:
        return
    device, most = device_for(description.device), 0
    canvas = Canvas(description, tile_size, None)
    with native.Frame(device) as frame:
        while True:
            for piece in canvas.pieces:
                with native.Scene() as scene:
                    describe(scene, piece.description, ["COMBINED"])
                    frame.plan(scene)
            if not wants_points(description, memory.free()):
                return
            while any(stream.busy for stream in streams):
                for stream in streams:
                    stream.advance()
                coming = [stream.outlook() for stream in streams]
                points, size = (sum(getattr(one, name) for one in coming) for name in ("points", "megabytes"))
                most = max(most, points)
                if poll(f"Fetching {points:,} points, {size:,.1f} MB", 1.0 - points / max(most, 1)):
                    raise native.PatinaCancelled("cancelled", native.CANCELLED)
                time.sleep(jobs.INTERVAL / 4)


def wants_points(description: SceneDescription, room: int | None = None) -> bool:
    """Whether pictures since the last call wanted points that are not there, and may come. PatinaError where these take more than room."""
    found = False
    for stream in streaming.streams_of(item.cloud for item in description.clouds):
        size = stream.wish(0.0, room)
        room = None if room is None else room - size
        found |= stream.busy
    return found


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


class _Pieces:
    """A picture drawn piece by piece, out of parts with the planes that each gives. Its methods, but for look(), are for the worker."""

    def __init__(self, parts: list[tuple[Canvas, list[str]]], frames: list[native.Frame], finish: Callable[[list[Planes]], Planes],
                 news: _News) -> None:
        self._parts, self._frames, self._finish, self._news = parts, frames, finish, news
        self.stats: list[dict[str, Any]] = [{} for _ in parts]
        self.taken = [1] * len(parts[0][0].pieces)  # samples by piece, where they come by and by
        self._frame, self._done, self._each = frames[0], 0.0, 1.0  # under way; the share that is done, and that of each step

    def progress(self) -> float:
        """From any thread."""
        return min(self._done + self._each * self._frame.progress(), 1.0)

    def planes(self) -> Planes:
        return self._finish([canvas.planes(wanted) for canvas, wanted in self._parts])

    def draw(self, share: float, refined: bool, **settings: Any) -> None:
        """All pieces, by the description's settings but for some. share: of the progress. refined: a piece's samples come by and by, into
        planes that are there; PatinaCancelled leaves those that it has."""
        count = len(self._parts[0][0].pieces)
        self._each = share / (count * len(self._parts))
        for number in range(count):
            for (canvas, wanted), self._frame, stats in zip(self._parts, self._frames, self.stats, strict=True):
                piece = canvas.pieces[number]
                drawn = replace(piece.description, settings=replace(piece.description.settings, pixel_progressive=int(refined), **settings))
                with native.Scene() as scene:
                    describe(scene, drawn, wanted)
                    self._frame.render(scene)
                    if refined:
                        try:
                            self._better(scene, canvas, piece)
                        finally:
                            self.taken[number] = self._frame.stats()["pixel_samples"]
                    else:
                        canvas.put(piece, {name: _read(self._frame, name) for name in wanted})
                self._count(stats, canvas.pieces[0].face != piece.face)
                self._done += self._each

    def _better(self, scene: native.Scene, canvas: Canvas, piece: Piece) -> None:
        frame = self._frame
        try:
            while frame.stats()["pixel_pending"]:
                frame.refine(scene, STEP)
                if self._news.wanted():
                    canvas.put(piece, {"COMBINED": frame.read("COMBINED")})
                    self._news.bring({"COMBINED": self._finish([each.planes(["COMBINED"]) for each, _ in self._parts])["COMBINED"]})
        finally:
            canvas.put(piece, {"COMBINED": frame.read("COMBINED")})

    def _count(self, stats: dict[str, Any], among_faces: bool) -> None:
        """Milliseconds add up, layers and samples are the most; the rest is of the last piece, of panoramas of the first face."""
        now = self._frame.stats()
        most = {name: max(now[name], stats.get(name, 0)) for name in ("layers", "pixel_samples")}
        ms = now["ms"] + stats.get("ms", 0.0)
        stats.update(most if among_faces else now | most)
        stats["ms"] = ms


def _check_memory(parts: list[tuple[Canvas, list[str]]]) -> None:
    """Raises PatinaError where the finished planes are larger than the memory that is free."""
    needed, free = sum(canvas.bytes(wanted) for canvas, wanted in parts), memory.free()
    if free is not None and needed > free:
        what = "panorama, with its six faces," if parts[0][0].pieces[-1].face else "whole image"
        raise native.PatinaError(f"the {what} needs {needed >> 20} MB of memory, and {free >> 20} MB are free: render a smaller one", native.MEMORY)


def _draw_pieces(device: native.Device, parts: list[tuple[Canvas, list[str]]], finish: Callable[[list[Planes]], Planes],
                 poll: Callable[[float], bool], show: Show | None) -> Picture:
    """Tiles, and faces of panoramas. Of several samples, where somebody looks, first one of each piece and then, piece by piece, the
    others; cancelled then, it keeps what it has."""
    _check_memory(parts)
    first = parts[0][0].pieces[0].description
    samples, news, notice, cut_off = first.settings.pixel_samples, _News(show), "", False
    with ExitStack() as stack:  # frames are made and closed on this thread, so that poll never meets a dead handle
        frames = [stack.enter_context(native.Frame(device)) for _ in parts]
        drawing = _Pieces(parts, frames, finish, news)

        def work() -> None:
            nonlocal notice, cut_off
            notice = _load_shadows(frames[0], first)
            if show is None or samples == 1:
                drawing.draw(1.0, False)
                return
            share = 1.0 / (1 + (samples or EXPECTED_SAMPLES))
            drawing.draw(share, False, pixel_samples=1, pixel_noise=0.0)
            news.bring(drawing.planes())
            try:
                drawing.draw(1.0 - share, True)
            except native.PatinaCancelled:
                cut_off = True

        def look() -> bool:
            news.show()
            return poll(drawing.progress())

        with ANALYSES.drawing():
            jobs.run(work, lambda: [frame.cancel() for frame in frames], look)
        stats = drawing.stats[0] | {"ms": sum(each["ms"] for each in drawing.stats), "pixel_pending": int(cut_off)}
        if cut_off:
            stats |= {"pixel_samples": max(drawing.taken), "pixel_samples_least": min(drawing.taken)}
        return Picture(drawing.planes(), stats, device.label, notice)


def _read(frame: native.Frame, name: str) -> np.ndarray:
    return frame.read_numbers() if name == "NUMBERS" else frame.read(name)


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
    planes = {native.split_plane(plane) for plane in {"COMBINED", *wanted} - {"NUMBERS"}}
    settings = asdict(description.settings)
    settings["passes"] = _bits(name for name, layer in planes if not layer)
    settings["layer_passes"] = _bits(name for name, layer in planes if layer)
    settings["layers"] = max(settings["layers"], *(layer for _, layer in planes), 0)  # a pass wants its layer peeled
    scene.set_settings(**settings)
    scene.set_effects(**asdict(description.effects))
    scene.set_camera(**asdict(description.camera))
    if description.lines:
        scene.set_lines(**asdict(description.lines))
    headlight = [of_headlight(description.headlight, description.camera)] if description.headlight else []
    for light in [*description.lights, *headlight]:
        scene.add_light(**asdict(light))
    for clip in description.clips:
        scene.add_clip(**asdict(clip))
    as_ranges = native.abi.SURFACE["RANGES"]
    for item in description.clouds:
        style = item.style
        if style.color_source == SCALAR and not item.cloud.has_scalars:  # a notice has said so
            style = replace(style, color_source=OWN)
        softened = item.soft if item.soft and not item.soft.missing(item.cloud) else None  # a notice has said so
        parted = soft.field_of(item.cloud, softened) if softened else None
        if softened:
            histogram.note(item.name, softened, parted)
        histogram.note_trust(item.name, item.cloud)
        scene.add_cloud(item.cloud, mask=edits.mask_of(item.cloud, item.edits), grade=edits.grade_of(item.cloud, item.edits),
                        field=parted,
                        scans=ranges.scans_of(item.cloud, item.told, as_ranges in (style.surface, description.settings.surface)),
                        **asdict(style),
                        **(dict(softened.style) if softened else {}))
    for item in description.meshes:
        scene.add_mesh(item.mesh, item.texture and item.texture.native, **asdict(item.style))
