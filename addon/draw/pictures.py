# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of a viewport: those that it wishes for, those that it shows, and those whose samples still come."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .. import native
from ..description.points import CloudItem
from ..description.scene import SceneDescription
from ..description.view import Clip, View
from ..read import streaming
from ..sync import World
from . import mattes, pace


@dataclass(frozen=True)
class Wish:
    """A picture that the viewport would like to have."""

    scene: SceneDescription
    view: View
    level: pace.Level
    asked: float  # when
    clips: tuple[Clip, ...] = ()  # of the scene's, those of the view itself: they cut what Blender draws too
    detail: float = pace.EXACT

    def whole(self) -> bool:
        """Whether it is what a final render would make."""
        return self.level == pace.FULL and self.detail == pace.EXACT

    def description(self, clouds: list[CloudItem]) -> SceneDescription:
        shrink = self.level.shrink
        x0, y0, x1, y1 = self.view.region
        settings = replace(
            self.scene.settings, width=-(-self.view.width // shrink), height=-(-self.view.height // shrink),
            region=(x0 // shrink, y0 // shrink, -(-x1 // shrink), -(-y1 // shrink)),
            strata=pace.WHOLE if self.level.strata == pace.STRATA else self.level.strata,
            average=self.scene.settings.average if self.level.strata == pace.STRATA else 0,
            detail=self.detail,
            shadow_lazy=0, shadow_progressive=1,  # one sample after a change of lights, refined at rest
            pixel_samples=self.scene.settings.pixel_samples if self.whole() else 1, pixel_progressive=1)
        lines = self.scene.lines
        if lines and not lines.world:
            lines = replace(lines, width=lines.width / shrink)
        return replace(self.scene, clouds=clouds, camera=self.view.camera, settings=settings, lines=lines,
                       effects=self.scene.effects.through(self.view.focus).shrunk(shrink))


@dataclass(frozen=True)
class Shown:
    """A finished picture."""

    wish: Wish
    clouds: list[CloudItem]  # built
    color: np.ndarray  # (height, width, 4), premultiplied, scene-linear; the next picture but one overwrites it
    depth: np.ndarray  # (height, width, 1), linear z; nearer where points lie that the picture leaves out and Blender draws
    hiding: np.ndarray | None  # the same, far away where Blender draws a depth of its own; behind it overlays are hidden. None: nowhere
    behind: World | None  # what lies behind it
    pixel: float  # its width, at distance 1 in perspective
    place: tuple[float, float, float, float]  # of the viewport that it covers, 0..1
    stats: dict[str, Any]
    passes: dict[str, Any]
    device: str
    first: bool = True  # of its wish

    def status(self, streams: list[streaming.Stream]) -> str:
        """A line about the picture, what is still to come of points that are read as they are wanted, and what failed."""
        stats = self.stats
        if self.wish.detail > pace.EXACT and stats["points_scattered"] < stats["points"]:
            return f"{stats['points_scattered']:,} of {stats['points']:,} points, what else is in view is on its way"
        samples = f", {stats['pixel_samples']} samples" if stats["pixel_samples"] > 1 else ""
        coming = [stream.outlook() for stream in streams]
        points, size = sum(one.points for one in coming), sum(one.megabytes for one in coming)
        said = next((f". {text}" for stream in streams for text in [stream.message, *stream.notes] if text), "")
        on_their_way = f", {points:,} points on their way ({size:,.1f} MB)" if points else ""
        return f"{stats['points']:,} points, {stats['ms']:.0f} ms, {self.device}{samples}{on_their_way}{said}"


@dataclass
class Bettered:
    """A picture whose samples are still coming."""

    wish: Wish
    parts: list[tuple[native.Frame, SceneDescription]]  # those that make it: one, or more with mattes
    colors: list[np.ndarray]  # of each part
    description: SceneDescription
    behind: np.ndarray | None  # what mattes stand before

    def picture(self) -> np.ndarray:
        if len(self.colors) == 1:
            return self.colors[0]
        return mattes.finish(self.colors[0], self.description, self.colors[1:], self.behind)
