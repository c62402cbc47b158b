# SPDX-License-Identifier: GPL-3.0-or-later
"""All that an image shows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from .lighting import Headlight, Light
from .marks import Marks
from .meshes import MeshItem
from .points import CloudItem
from .settings import DeviceChoice, Effects, Lines, Settings
from .view import Camera, Clip, Mist, Panorama


class Surroundings(Protocol):
    """What is seen behind all, by direction."""

    def seen(self, directions: np.ndarray) -> np.ndarray:
        """(n, 3) float32, linear, of unit directions (n, 3) away from the eye."""


@dataclass(frozen=True)
class SceneDescription:
    clouds: list[CloudItem]
    meshes: list[MeshItem]
    clips: list[Clip]
    lights: list[Light]
    headlight: Headlight | None
    lines: Lines | None
    camera: Camera
    panorama: Panorama | None  # all around from where the camera stands
    settings: Settings
    effects: Effects
    device: DeviceChoice
    mist: Mist | None
    behind: Surroundings | None  # what is seen behind all, by direction; None: the settings' background, or a transparent film
    shadow_file: str  # baked shadow textures; empty: none
    notices: list[str]  # what the artist should know about things left out, a sentence each
    marks: Marks | None = None  # written over the image
