# SPDX-License-Identifier: GPL-3.0-or-later
"""The 3D viewport in Rendered mode.

Blender's thread reads the scene where it changed, asks for pictures and draws the last finished one. While the view
moves, pictures are made in a time budget (pace.py); when it rests, the whole one follows, which is the picture that a
final render would make. The long work is native tasks; a timer looks whether they are done and goes on. No Python runs
on another thread (jobs.py says why).
"""

from __future__ import annotations

import time
import weakref
from collections import deque
from dataclasses import replace

import bpy
import numpy as np

from .. import native, sync
from ..description.scene import SceneDescription
from ..description.settings import DeviceChoice
from ..description.view import Clip, View
from ..jobs import Pause, Steps
from ..native.points import highlight
from ..read import streaming
from ..sync.analyses import analysis, trust
from ..sync.analyses.analyzing import ANALYSES
from ..sync.points import edits
from ..sync.points.built import CACHE
from ..sync.points.kept import CHECKS
from . import backdrop, dots, graphics, mattes, overlays, pace, painting, render, sky
from .canvas import Canvas, redraw
from .pictures import Bettered, Shown, Wish

TICK = 0.008  # seconds between two looks at the tasks
STAY = 0.004  # seconds that a look lasts at most waiting for tasks that it started: many are short
REST = 0.12  # seconds without motion after which the whole picture is drawn
RESIZED = 0.25  # seconds that a redraw waits for the first picture, or that of a new size
ARRIVALS = 0.2  # seconds between two pictures of points that arrive
BETTER = 200.0  # milliseconds of further samples between two pictures of a view at rest

SELECTED = (1.0, 0.35, 0.02)  # linear, and its share of the pixel: of selected points
SELECTED_SHARE = 0.65


class Viewport:
    """One 3D view region."""

    def __init__(self, engine: bpy.types.RenderEngine) -> None:
        self._engine = weakref.ref(engine, lambda _: _wake())  # anywhere in Python's work: the timer closes
        self.area = 0  # where it is, to find its statistics
        self._region = 0  # of the area
        self.message = ""  # what went wrong last
        self.notices: list[str] = []
        self._lost: tuple[DeviceChoice, str] | None = None  # a device that failed, and what to say of it
        self.shown: Shown | None = None
        self.pictures = 0  # finished so far
        self.trusted = sync.Trusted()
        self.pace = pace.Pace(0.05)
        self._scene: SceneDescription | None = None
        self._view: View | None = None
        self._moved = 0.0  # when
        self._local = False  # in local view
        self._clips: list[Clip] = []  # of the view
        self._last: Wish | None = None  # that was asked for
        self._many = False  # points: pictures begin with what shows most of them
        self._wanted: Wish | None = None
        self._working: Wish | None = None
        self._steps: Steps[Shown] | None = None  # of the work
        self._task: native.Task | Pause | None = None  # the step under way
        self._progress: native.Progress | None = None  # while clouds are made
        self._rendering: native.Frame | None = None  # that is drawn
        self._spare: list[np.ndarray] = []  # planes of the picture before the one that is shown
        self._fresh = False  # points have come that no picture shows yet
        self._fetched = 0.0  # when the last picture for such was asked for
        self._closed = False
        self._news = False
        self._frame: tuple[native.Device, native.Frame] | None = None
        self._others: list[tuple[native.Device, native.Frame]] = []  # for mattes
        self._dots: tuple[native.Device, native.Frame] | None = None  # for what the picture leaves out
        self.measures = False  # the statistics show the time of each pass
        self._bettered: Bettered | None = None  # what is shown, while samples of it are pending
        self.canvas = Canvas()
        _VIEWPORTS.add(self)

    def engine(self) -> bpy.types.RenderEngine | None:
        """The engine that this draws for. None if Blender has freed it, also while Python still refers to it."""
        found = self._engine()
        try:
            if found is not None:
                found.is_preview  # noqa: B018  raises ReferenceError if freed
            return found
        except ReferenceError:
            return None

    def update(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """The scene changed."""
        self.trusted.forget(sync.changed_owners(depsgraph) if self._scene else None)
        sync.lighting.world.follow(depsgraph)
        view = self._read_view(context)
        scene = sync.describe_viewport(depsgraph, view, self.trusted, context.space_data)
        lost = {item.cloud.lost: None for item in scene.clouds if item.cloud.lost}  # each once
        self.notices = [*scene.notices, *lost, *([self._lost[1]] if self._lost and self._lost[0] == scene.device else [])]
        self.pace.budget = depsgraph.scene.patina.navigation_ms / 1000.0
        self._scene = scene
        self._view, self._clips = view, sync.view_clips(context.region_data)
        self.canvas.choose(overlays.selected_vertices(context, depsgraph))
        self._local = context.space_data.local_view is not None
        self._moved = time.monotonic()
        self._ask(self.pace.level, pace.MOVING if self._many else pace.EXACT)

    def draw(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> str:
        """Draws the last picture, asks for another one if the view moved. Returns a line of status."""
        self.area = context.area.as_pointer() if context.area else 0
        self._region = context.region.as_pointer()
        if self._scene and self._local != (context.space_data.local_view is not None):  # Blender says nothing of it
            self.update(context, depsgraph)
        view = self._read_view(context)
        clips = sync.view_clips(context.region_data)
        if self._scene and (view != self._view or clips != self._clips):
            self._view, self._clips = view, clips
            self._moved = time.monotonic()
            self._ask(self.pace.level, pace.MOVING if self._many else pace.EXACT)
        self._await_size()
        if self.shown:
            self._draw_picture(context)
            self.canvas.draw_marks(context, sync.view_marks(context.scene, view, self.shown.clouds))
        return self._status()

    def _await_size(self) -> None:
        """A picture of another size would be stretched, and Blender's dots stand beside it: a moment is given to the next one."""
        until = time.monotonic() + RESIZED
        while _TURNS and self._view and time.monotonic() < until:
            seen = self.shown.wish.view if self.shown else None
            if seen and (seen.width, seen.height) == (self._view.width, self._view.height):
                break
            _work(until)

    def tick(self) -> bool:
        """Called by the timer. Whether it has to come again."""
        engine = self.engine()
        if engine is None:
            self.close()
            return False
        news, self._news = self._news, False
        idle = not self._working and not self._wanted
        due = self._last is not None and not self._last.whole()
        if due and idle and time.monotonic() - self._moved > REST:
            self._ask(pace.FULL, pace.next_detail(self._last.detail))
        if news and not redraw(self.area, self._region, panels=not due):
            engine.tag_redraw()
        return not idle or due or news

    def close(self) -> None:
        """Ends the work soon and for good."""
        self._closed, self._wanted, self._working = True, None, None
        if self._rendering:
            self._rendering.cancel()
        if self._progress:
            self._progress.cancel()
        if self._task:
            ANALYSES.end_frame(self._task, close=True)  # before what it uses
        if self._steps:
            self._steps.close()
        self._others = []
        self.canvas.clear()  # here, for textures go on Blender's thread
        self._frame = self._dots = self._steps = self._task = self._bettered = None
        ANALYSES.wish(self, [])
        _VIEWPORTS.discard(self)
        if self in _TURNS:
            _TURNS.remove(self)

    def _read_view(self, context: bpy.types.Context) -> View:
        return sync.viewport_view(context.region, context.space_data, context.region_data, context.scene)

    def _ask(self, level: pace.Level, detail: float = pace.EXACT) -> None:
        if self._closed:
            return
        scene = replace(self._scene, clips=[*self._scene.clips, *self._clips])
        self._wanted = self._last = Wish(scene, self._view, level, time.monotonic(), tuple(self._clips), detail)
        # a quick picture of the moment before is worth its end, a whole one is not
        if self._rendering and self._working.whole():
            self._rendering.cancel()
        if self not in _TURNS:
            _TURNS.append(self)
        _work(0.0)  # so that it goes on while Blender draws
        _wake()

    def _status(self) -> str:
        if self.message:
            return self.message
        working = self._working
        if working and any(isinstance(item.cloud, sync.Pending) and not (item.cloud.built or item.cloud.lost) for item in
                           working.scene.clouds):
            return "Reading points"
        if not self.shown:
            return ""
        under_way = [item.cloud for item in self.shown.clouds if item.cloud in ANALYSES]
        if under_way:
            return analysis.label(under_way[0])
        return self.shown.status(self._streams())

    def _draw_picture(self, context: bpy.types.Context) -> None:
        if not self.canvas.draws(self.shown) and self.shown.wish.view != self._view and self.shown.first:  # it moves on
            self.pace.seen(time.monotonic() - self.shown.wish.asked - self.shown.stats["ms"] / 1000.0)
        self.canvas.draw(context, self.shown, lambda: self._finish_overlays(bpy.context))

    def _finish_overlays(self, context: bpy.types.Context) -> None:
        if self._closed:
            return
        try:
            self.canvas.finish_overlays(context)
        except graphics.GraphicsError as error:
            self.message = str(error)

    # ---- the work

    def advance(self, until: float) -> bool:
        """Goes on with the wanted picture, waiting for short tasks until then. Whether it has come to its end."""
        if self._task and not self._task.done():
            return False
        if self._steps is None:
            self._working, self._wanted = self._wanted, None
            self._steps = self._render(self._working)
        wish, shown, message, cancelled = self._working, None, "", False
        try:
            while True:
                self._task = next(self._steps)
                while not self._task.done():
                    if time.monotonic() > until:
                        return False
                    time.sleep(0.0002)
        except StopIteration as end:
            shown = end.value
        except native.PatinaCancelled:
            message, cancelled = self.message, True
        except Exception as error:  # shown in the viewport; the last good picture stays
            message = str(error) or type(error).__name__
        self._working = self._steps = self._task = None
        self.message = message
        self._news = True
        if cancelled and not self._wanted:
            self._wanted = wish  # the cancel was meant for the picture before
        if shown:
            last, self.shown = self.shown, shown
            self._spare = [last.color, last.depth] if last and last.depth is not shown.depth else []
            self.pictures += 1
            self._wish_analyses()
            self._wish_points()
            if (shown.stats["shadow_pending"] or self._bettered) and not self._wanted:
                self._wanted = shown.wish  # more samples of soft shadows, or of pixels
        return True

    def _wish_analyses(self) -> None:
        pending = [item.cloud for item in self.shown.wish.scene.clouds if item.analyzed and item.cloud.analyzed]
        ANALYSES.wish(self, [(cloud.built, cloud.stations) for cloud in pending])

    def _streams(self) -> list[streaming.Stream]:
        return streaming.streams_of(item.cloud for item in self.shown.clouds) if self.shown else []

    def _wish_points(self) -> None:
        if not CACHE.final():  # a final picture's come first
            for stream in self._streams():
                stream.wish(streaming.AT_REST)

    def fetch(self) -> bool:
        """Takes what has come of points that are read as they are wanted, and draws them now and then. Whether more is to come."""
        streams, news = self._streams(), False
        for stream in streams:
            news |= stream.advance()
            new = [text for text in [*stream.notes, stream.message] if text and text not in self.notices]
            if new:
                self.notices = [*self.notices, *new]
                self._news = True
        self._fresh |= news
        busy, now = any(stream.busy for stream in streams), time.monotonic()
        if self._fresh and not self._working and not self._wanted and (now - self._fetched > ARRIVALS or not busy):
            self._fresh, self._fetched = False, now
            self._ask(self._last.level)
        return busy or self._fresh

    def analyzed(self, clouds: list[native.Cloud]) -> None:
        """Of these clouds all is known now: what it shows of them is drawn again."""
        if self._last and self.shown and any(item.cloud in clouds for item in self.shown.clouds):
            self._ask(self._last.level)

    def rebuild(self, identities: list[tuple]) -> None:
        """Of linked clouds whose kept files were damaged."""
        links = [item.cloud for item in (self._scene.clouds if self._scene else ()) if isinstance(item.cloud, sync.PendingLink)]
        if any([link.forget(identities) for link in links]):
            self._ask(self._last.level)

    def wants(self) -> bool:
        return self._wanted is not None

    def _render(self, wish: Wish) -> Steps[Shown]:
        bettered, self._bettered = self._bettered, None
        if bettered and bettered.wish is wish:
            try:
                return (yield from self._better(bettered))
            except native.PatinaCancelled:
                raise
            except native.PatinaError:
                pass  # the device failed: the whole picture anew, on another one if need be
        with native.Progress() as self._progress:
            try:
                clouds = []
                for item in wish.scene.clouds:
                    cloud = yield from item.cloud.resolve(self._progress)
                    if cloud:
                        clouds.append(replace(item, cloud=cloud))
                        said = edits.notice(item.name, item.edits, cloud)
                        if said and said not in self.notices:
                            self.notices = [*self.notices, said]
                        told = [text for text in trust.notices(clouds[-1:]) if text not in self.notices]
                        self.notices = [*self.notices, *told]
                    if item.cloud.lost and item.cloud.lost not in self.notices:
                        self.notices = [*self.notices, item.cloud.lost]
            finally:
                self._progress = None
        self._many = sum(item.cloud.count for item in clouds) >= pace.MANY
        if self._many and not self.shown:
            first = replace(wish, detail=pace.FIRST)
            self._working, self._last = first, first if self._last is wish else self._last
            wish = first
        if self._wanted and wish.whole():
            raise native.PatinaCancelled("a newer picture is wanted", native.CANCELLED)
        description = wish.description(clouds)
        if not self._lost or self._lost[0] != description.device:
            try:
                return (yield from self._render_on(render.device_for(description.device), wish, description))
            except native.PatinaCancelled:
                raise
            except native.PatinaError as error:
                if not self._frame or not self._frame[0].name.startswith("gl"):
                    raise
                self._lose_device(description.device, str(error))
        device = render.device_for(replace(description.device, name="cpu"))
        return (yield from self._render_on(device, wish, description))

    def _lose_device(self, choice: DeviceChoice, reason: str) -> None:
        """From now on the processor draws, until another device is asked for."""
        self._lost = (choice, f"{self._frame[0].label} failed, the processor draws: {reason}")
        self.notices = [*self.notices, self._lost[1]]
        self._frame, self._dots, self._others = None, None, []
        render.forget_device()

    def _render_on(self, device: native.Device, wish: Wish, description: SceneDescription) -> Steps[Shown]:
        if self._frame is None or self._frame[0] is not device:
            self._frame = (device, native.Frame(device))
        frame, settings = self._frame[1], description.settings
        frame.measure(self.measures)
        x0, y0, x1, y1 = settings.region
        parts, spare = [(frame, description)], self._spare
        if mattes.are_needed(description):
            others = mattes.needed(description)
            self._others = self._others if len(self._others) == len(others) and self._others[0][0] is device else [
                (device, native.Frame(device)) for _ in others]
            parts = [(frame, mattes.picture(description)), *((beside, other) for (_, beside), other in zip(
                self._others, others, strict=True))]
            spare = []
        else:
            self._others = []
        color, depth = yield from self._draw_frame(*parts[0], ("COMBINED", "DEPTH"), spare, selected=True)
        colors = [color]
        for beside, other in parts[1:]:
            colors += yield from self._draw_frame(beside, other, ("COMBINED",), [])
        hiding = overlays.without_own(frame, description, depth)
        if hiding is not None:
            untrusted = any(part.stats()["untrusted"] for part, _ in parts)
            yield from self._hide_dots(device, dots.left_out(description, wish.clips, untrusted), hiding)
        stats, passes = frame.stats(), frame.pass_stats()
        points = passes["passes"].get("scatter", 0.0) / 1000.0
        if not self._many or wish.detail == pace.MOVING:  # that of others says nothing of pictures while the view moves
            self.pace.note(wish.level, points, max(stats["ms"] / 1000.0 - points, 1e-4))
        behind = backdrop.pixels(description) if self._others and description.behind else None  # which is in the picture then
        bettered = Bettered(wish, parts, colors, description, behind)
        self._keep_bettering(bettered)
        return Shown(wish, description.clouds, bettered.picture(), depth, hiding, None if self._others else description.behind,
                     (wish.view.camera.right - wish.view.camera.left) / settings.width,
                     (x0 / settings.width, y0 / settings.height, x1 / settings.width, y1 / settings.height),
                     stats, passes, device.label)

    def _hide_dots(self, device: native.Device, left_out: SceneDescription | None, depth: np.ndarray) -> Steps[None]:
        """Of points that Blender draws though the picture leaves them out: depth becomes theirs where it is nearer."""
        if left_out is None:
            self._dots = None
            return
        if self._dots is None or self._dots[0] is not device:
            self._dots = (device, native.Frame(device))
        try:
            found, = yield from self._draw_frame(self._dots[1], left_out, ("DEPTH",), [])
        except native.PatinaCancelled:  # the picture itself is there
            return
        np.minimum(depth, found, out=depth)

    def _keep_bettering(self, bettered: Bettered) -> None:
        """Where samples are pending."""
        self._bettered = bettered if any(frame.stats()["pixel_pending"] for frame, _ in bettered.parts) else None

    def _better(self, bettered: Bettered) -> Steps[Shown]:
        """What is shown, by further samples. One that is cut off is given up: something else is wanted then."""
        colors = []
        for (frame, description), color in zip(bettered.parts, bettered.colors, strict=True):
            if frame.stats()["pixel_pending"]:
                color, = yield from self._draw_frame(frame, description, ("COMBINED",), [], BETTER / len(bettered.parts),
                                                     selected=frame is bettered.parts[0][0])
            colors.append(color)
        bettered = replace(bettered, colors=colors)
        self._keep_bettering(bettered)
        frame = bettered.parts[0][0]
        return replace(self.shown, color=bettered.picture(), stats=frame.stats(), passes=frame.pass_stats(), first=False)

    def _draw_frame(self, frame: native.Frame, description: SceneDescription, planes: tuple[str, ...],
                    spare: list[np.ndarray], better_ms: float | None = None,
                    selected: bool = False) -> Steps[list[np.ndarray]]:
        """selected: selected points are to be seen as such in the first plane."""
        x0, y0, x1, y1 = description.settings.region
        with native.Scene() as scene:
            render.describe(scene, description, planes)

            def start() -> native.Task:
                return frame.start(scene, planes, y1 - y0, x1 - x0, spare, better_ms)

            while (task := ANALYSES.begin_frame(start)) is None:
                yield Pause()
            self._rendering = frame
            try:
                yield task
                ANALYSES.end_frame(task)
                found = task.result()
                if selected and any(edits.has_selection(item.cloud, item.edits) for item in description.clouds):
                    highlight(frame, scene, found[0], SELECTED, SELECTED_SHARE)
                return found
            finally:
                self._rendering = None
                if not task.done():
                    frame.cancel()
                ANALYSES.end_frame(task, close=True)  # before its scene, and before an analysis may change the clouds


_VIEWPORTS: set[Viewport] = set()
# Those with something to do; the first one works. One at a time: frames of a device take turns anyway, and clouds may
# only get new colours while no picture of them is drawn.
_TURNS: deque[Viewport] = deque()


def of_area(area: bpy.types.Area) -> Viewport | None:
    """The viewport that draws in an area, for its statistics; of a quad view's, and of what was there before, one that shows a picture."""
    place = area.as_pointer() if area else 0
    found = [viewport for viewport in _VIEWPORTS if viewport.area == place and viewport.engine()]
    return next((viewport for viewport in found if viewport.shown), found[0] if found else None)


def forget_points() -> None:
    """After undo: what was read may be of another state."""
    for viewport in _VIEWPORTS:
        viewport.trusted.forget()


def close_all() -> None:
    for viewport in list(_VIEWPORTS):
        viewport.close()
    ANALYSES.clear()
    CHECKS.clear()
    painting.forget()
    sky.forget()
    sync.lighting.world.forget()


def _work(until: float) -> None:
    """Goes on with the pictures whose turn it is, and waits for short tasks until then."""
    while _TURNS and _TURNS[0].advance(until):
        viewport = _TURNS.popleft()
        if viewport.wants():
            _TURNS.append(viewport)  # and begin at once: Blender may be long in coming back


def _tick() -> float | None:
    _work(time.monotonic() + STAY)
    changed = ANALYSES.advance(CACHE.final())
    damaged = CHECKS.take_damaged() if _VIEWPORTS and not CACHE.final() else []  # a final picture looks itself
    CACHE.drop(damaged)
    again = ANALYSES.busy() or CHECKS.busy()
    for viewport in list(_VIEWPORTS):
        if changed:
            viewport.analyzed(changed)
        if damaged:
            viewport.rebuild(damaged)
        again |= viewport.fetch()
        again |= viewport.tick()
    return TICK if again else None


def _wake() -> None:
    if not bpy.app.timers.is_registered(_tick):
        bpy.app.timers.register(_tick, first_interval=TICK, persistent=True)
