# SPDX-License-Identifier: GPL-3.0-or-later
"""Clouds of an image: how each is drawn, what is hidden of it, and which points are soft."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from .. import native
from .roles import SEEN

_MISSING = {'ATTRIBUTE': "attribute '{name}'", 'LUMINANCE': "colors", 'CLASSES': "classes",
            'DISTANCE': "object at a place that is a number"}
Desc = tuple[tuple[str, Any], ...]  # of patina_field_desc
MOST_OF_FIELD = 2 ** 31 - 1  # points that the library makes a field of
Scan = tuple[float, ...]  # gain, gamma, saturation, temperature


@dataclass(frozen=True)
class Stations:
    places: np.ndarray  # (n, 3) float64
    of_points: np.ndarray | None  # (count, 1) uint16: which of them saw each point; None: the nearest
    grid: tuple[np.ndarray, np.ndarray] | None = None  # (count, 1) uint32: row and column of each
    by_grid: bool = False  # neighbors there tell surfaces, and where these end
    scan: np.ndarray | None = None  # of scans without a place: (count, 1) uint16, in whose grid each lies; None: all in one
    directions: np.ndarray | None = None  # (n, 3) float64, in which these looked

    @property
    def tells_free_space(self) -> bool:
        return self.of_points is not None and len(self.places) > 1


@dataclass(frozen=True)
class CloudStyle:
    """patina_cloud_style."""

    world_from_object: tuple[float, ...]
    lighting: int
    cull_back: int
    d_min: float
    color: tuple[float, float, float]
    ambient: float
    diffuse: float
    specular: float
    shininess: int
    transparency: float
    shadow_off: int
    color_source: int = 0  # PATINA_COLOR_OWN
    ramp: bytes = b""  # linear RGB, float32
    ramp_range: tuple[float, float] = (0.0, 0.0)  # equal: automatic
    exposure: float = 0.0
    contrast: float = 1.0
    hidden_classes: tuple[int, ...] = (0,) * 8
    clip_off: int = 0
    radius: float = 0.0
    largest_gap: float = 0.0
    free_space: int = 0
    least_trust: float = 0.0
    exact: int = 1  # black is black
    surface: int = 0  # as the settings; else PATINA_SURFACE_RANGES
    range_gamma: float = 0.0
    range_pixel: float = 0.0
    range_sharpness: float = 0.0
    range_cull: float = 0.0


@dataclass(frozen=True)
class EditState:
    """Which points of an object are hidden, and how its scans are graded; cheap to compare."""

    packed: str = ""
    grades: tuple[tuple[int, Scan], ...] = ()  # by the scans' numbers
    hidden: tuple[int, ...] = ()
    balanced: bool = False  # scans are brought to each other; this alone is no edit
    keeps_black: bool = False  # points without a color stay black; this alone is no edit

    def __bool__(self) -> bool:
        return bool(self.packed or self.grades or self.hidden)


@dataclass(frozen=True)
class Soft:
    """What a picture needs to know of one object's soft points; cheap to compare."""

    by: str
    name: str  # of the attribute
    style: tuple[tuple[str, Any], ...]  # of patina_cloud_style
    desc: Desc = ()
    placed: bool = True  # what a distance is measured to

    @property
    def hides(self) -> bool:
        """Whether points above the threshold are hidden, not soft."""
        return dict(self.style)["soft"] == native.abi.SOFT["HIDDEN"]

    def missing(self, cloud: native.Cloud) -> str:
        """What the cloud lacks for it, for the artist; "": nothing."""
        if cloud.stream and self.by != 'ALL':
            return "whole cloud, being read as needed (Linked File > Read Whole),"
        if cloud.count > MOST_OF_FIELD and self.by != 'ALL':
            return f"number a point, for it holds more than {MOST_OF_FIELD:,},"
        lacks = {'ATTRIBUTE': cloud.numbers is None and not cloud.has_scalars, 'LUMINANCE': not cloud.has_colors,
                 'CLASSES': not cloud.has_classes, 'DISTANCE': not self.placed}
        return _MISSING[self.by].format(name=self.name) if lacks.get(self.by) else ""


class AwaitedCloud(Protocol):
    """Points that wait to be made a cloud of."""

    @property
    def built(self) -> native.Cloud | None:
        """The cloud, once it is there."""


@dataclass(frozen=True)
class CloudItem:
    cloud: native.Cloud | AwaitedCloud
    style: CloudStyle
    pass_index: int  # of the object
    role: str = SEEN
    name: str = ""  # of the object
    asset: str = ""  # of its topmost parent
    edits: EditState = EditState()
    soft: Soft | None = None
    dotted: bool = False  # Blender's overlays draw its points too
    blender_depth: bool = False  # Blender draws its depth for overlays from 4.4 on
    told: str = ""  # of its scans, where they are drawn as range images: sync/points/ranges.py
    analyzed: bool = True  # where its points are to be analyzed at all: this picture needs it
