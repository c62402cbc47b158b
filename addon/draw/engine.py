# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine as Blender sees it: asks sync for the scene, render for the picture, passes to hand it over."""

from __future__ import annotations

import math
import traceback
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np

from .. import native, sync
from ..description.scene import SceneDescription
from ..read import streaming
from ..read.importers import told
from ..sync import losses
from ..sync.analyses import trust
from ..sync.points.kept import CHECKS
from ..sync.view import motion
from . import cryptomatte, graphics, passes, render, viewport

ROUNDS = 8  # of a picture whose lights want further points
BUILDING = 0.1  # share of the progress bar for reading the scene; the rest is the picture


class PatinaRenderEngine(bpy.types.RenderEngine):
    """Draws point clouds in image space."""

    bl_idname = "PATINA"
    bl_label = "Patina"
    bl_use_preview = False
    bl_use_postprocess = True
    bl_use_shading_nodes_custom = False
    bl_use_eevee_viewport = True  # Material Preview

    # No __init__: Blender 4.4+ demands *args and **kwargs there. Instances come and go with every render and change of
    # shading; what lasts is in sync.points.built.CACHE and render.device_for.
    _viewport: viewport.Viewport | None = None  # of an instance that draws a 3D view
    _moment, _moments = 0, 1  # of a final picture: which is under way, and how many
    _asked = 1  # samples of its pixels, all moments together; 0: noise decides

    def update_render_passes(self, scene: bpy.types.Scene | None = None,
                             renderlayer: bpy.types.ViewLayer | None = None) -> None:
        passes.register(self, scene, renderlayer)

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Renders one view layer. Failures become messages, never exceptions; then nothing is written."""
        try:
            with sync.points.built.CACHE.final_render():
                self._render(depsgraph)
        except native.PatinaCancelled:
            pass
        except Exception as error:
            self._fail(_text(error))

    def view_update(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """The scene that a 3D view shows has changed."""
        if self._viewport is None:
            self._viewport = viewport.Viewport(self)
        self._guard(lambda: self._viewport.update(context, depsgraph))

    def view_draw(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Draws the last finished picture; waits a moment for one of a new size, and never else."""
        if self._viewport:
            self._guard(lambda: self.update_stats("Patina", self._viewport.draw(context, depsgraph)))

    def _guard(self, work: Callable[[], None]) -> None:
        """A viewport shows what failed, and its last picture."""
        try:
            work()
        except Exception as error:
            self._viewport.message = _text(error)
            self.update_stats("Patina", self._viewport.message)

    def _render(self, depsgraph: bpy.types.Depsgraph) -> None:
        for eye in passes.eyes(depsgraph.scene_eval.render):
            self._render_eye(depsgraph, eye)

    def _render_eye(self, depsgraph: bpy.types.Depsgraph, eye: str) -> None:
        """One picture, the mean of its moments where motion is blurred."""
        frame, moments = depsgraph.scene_eval.frame_current_final, motion.moments(depsgraph.scene_eval)
        done, color, ms, told, ranks = 0, None, 0.0, set(), {}
        least = most = 0  # samples of a pixel
        self._asked = sum(moment.samples for moment in moments)
        data: tuple[SceneDescription, render.Picture] | None = None
        with passes.Shown(self, depsgraph.view_layer_eval, eye) as shown:
            show = None if bpy.app.background else shown.put
            try:
                for self._moment, moment in enumerate(moments):
                    self._moments = len(moments)
                    if len(moments) > 1:
                        self._go_to(frame + moment.offset)
                    try:
                        description, picture = self._render_moment(depsgraph, eye, moment, math.floor(frame), told,
                                                                   None if done else show)
                    except native.PatinaCancelled:
                        if not done:
                            raise
                        break  # those that there are stay
                    seen = picture.planes["COMBINED"]
                    done, color, ms = done + 1, seen if color is None else color + seen, ms + picture.stats["ms"]
                    most += picture.stats["pixel_samples"]
                    least += picture.stats.get("pixel_samples_least", picture.stats["pixel_samples"])
                    cryptomatte.gather(ranks, picture.ranks)
                    if moment.gives_data or not data:
                        data = description, picture
                    if show and 1 < done < len(moments):
                        show(description, {"COMBINED": color / np.float32(done)})
            finally:
                if len(moments) > 1:
                    self._go_to(frame)
            description, picture = data
            picture.planes["COMBINED"] = color / np.float32(done) if done > 1 else color
            layer, size = depsgraph.view_layer_eval, picture.planes["COMBINED"].shape[:2]
            picture.planes.update(cryptomatte.planes(ranks, (item.plane for item in passes.enabled(layer)), size, 1.0 / done))
            passes.write(self, layer, description, picture.planes, eye, shown)
        stopped = done < len(moments) or bool(picture.stats.get("pixel_pending"))
        summary = _summary(picture, ms, _kept(least, most, self._asked) if stopped else "")
        self._status(summary, 1.0)
        if stopped:  # the window of a picture that was ended says no more of it
            self._tell('INFO', summary)

    def _render_moment(self, depsgraph: bpy.types.Depsgraph, eye: str, moment: motion.Moment, frame: int, told: set[str],
                       show: Callable[..., None] | None) -> tuple[SceneDescription, render.Picture]:
        """The scene as it stands now. told: notices so far, each is reported once; show: as passes.Shown.put, if anybody looks."""
        description, picture = self._draw_moment(depsgraph, eye, moment, frame, show)
        # beside the picture, as a rule; where it was cut off nobody waits
        damaged = [] if picture.stats.get("pixel_pending") else CHECKS.finish(self._stopped)
        if damaged:
            sync.points.built.CACHE.drop(damaged)
            description, picture = self._draw_moment(depsgraph, eye, moment, frame, show)
        for notice in filter(None, (*description.notices, picture.notice)):
            if notice not in told:
                self._tell(losses.kind(notice), notice)
                told.add(notice)
        return description, picture

    def _draw_moment(self, depsgraph: bpy.types.Depsgraph, eye: str, moment: motion.Moment, frame: int,
                     show: Callable[..., None] | None) -> tuple[SceneDescription, render.Picture]:
        camera, place = self.camera_override or depsgraph.scene_eval.camera, None
        if eye and camera:
            self.active_view_set(eye)
            place = (self.camera_model_matrix(camera), self.camera_shift_x(camera))
        view = sync.final_view(camera, depsgraph, place)
        description = sync.describe(depsgraph, view, self._poll_reading, frame)
        losses.check(description.notices)
        description = render.shifted(description, moment.shift)
        description = replace(description, settings=replace(description.settings, pixel_samples=moment.samples,
                                                            pixel_noise=sync.settings.noise(depsgraph.scene_eval)))
        planes, tile_size = {item.plane for item in passes.enabled(depsgraph.view_layer_eval)}, depsgraph.scene_eval.patina.tile_size
        for stream in streaming.streams_of(item.cloud for item in description.clouds):
            stream.try_again()
        for _ in range(ROUNDS):
            render.await_points(description, self._poll_reading, tile_size)
            self._status("Rendering", BUILDING)
            picture = render.draw(description, planes, self._poll_drawing, tile_size, show and (lambda planes: show(description, planes)))
            if not render.wants_points(description):  # what lights see is known only then
                break
        lost = [losses.Loss(f"'{item.name}': {item.cloud.stream.message}") for item in description.clouds
                if item.cloud.stream and item.cloud.stream.message]
        losses.check(lost)
        told = [f"'{item.name}': {text}" for item in description.clouds if item.cloud.stream for text in item.cloud.stream.notes]
        told += trust.notices(description.clouds)
        for item in description.clouds:  # once told is enough
            item.cloud.renewed = ""
        return replace(description, notices=[*description.notices, *told, *lost]), picture

    def _go_to(self, frame: float) -> None:
        self.frame_set(math.floor(frame), frame - math.floor(frame))

    def _poll_reading(self, what: str, progress: float) -> bool:
        self._status(what, BUILDING * progress)
        return self._stopped()

    def _poll_drawing(self, progress: float) -> bool:
        share = (self._moment + progress) / self._moments
        self._status(f"Rendering, {share:.0%}" + (f" of {self._asked:,} samples" if self._asked > 1 else ""),
                     BUILDING + (1.0 - BUILDING) * progress)
        return self._stopped()

    def _progress(self, share: float) -> None:
        """Of the moment under way."""
        self.update_progress((self._moment + share) / self._moments)

    def _stopped(self) -> bool:
        return self.test_break()

    def _status(self, text: str, progress: float) -> None:
        self.update_stats("", text)
        self._progress(progress)

    def _tell(self, kind: str, text: str) -> None:
        self.report({kind}, told(f"Patina: {text}"))

    def _fail(self, text: str) -> None:
        self._tell('ERROR', text)
        if bpy.app.version < (4, 5, 0):  # later ones report it once more
            self.error_set(told(f"Patina: {text}"))


def _kept(least: int, most: int, asked: int) -> str:
    """What a picture that was ended has. asked: 0 where noise was to decide."""
    taken = f"{most:,}" if least == most else f"{least:,} to {most:,}"
    return f"{taken} of {asked:,} samples, stopped" if asked else f"{taken} sample{'s' * (most != 1)}, stopped"


def _summary(picture: render.Picture, ms: float, kept: str) -> str:
    """The line above a final picture; kept: of one that was ended."""
    stats, parts = picture.stats, []
    if stats["untrusted"]:
        parts.append(f"{stats['untrusted']:,} left out for their trust")
    if stats["layers"] > 1:
        parts.append(f"{stats['layers']} layers")
    if kept:
        parts.append(kept)
    elif stats["pixel_samples"] > 1:
        parts.append(f"{stats['pixel_samples']} samples")
    return ", ".join([f"{stats['points']:,} points, {ms:.1f} ms, {picture.device}", *parts])


def _text(error: Exception) -> str:
    """A sentence for the artist; a bug of ours must not reach Blender's console as a traceback."""
    if isinstance(error, (native.PatinaError, sync.CameraError, graphics.GraphicsError)):
        return str(error)
    where = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} ({Path(where.filename).name}:{where.lineno})"


def register() -> None:
    bpy.utils.register_class(PatinaRenderEngine)


def unregister() -> None:
    bpy.utils.unregister_class(PatinaRenderEngine)
