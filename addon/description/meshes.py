# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of an image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from .. import native
from .roles import SEEN


@dataclass(frozen=True)
class MeshStyle:
    """patina_mesh_style."""

    world_from_object: tuple[float, ...]
    color: tuple[float, float, float]
    shadow_off: int
    unlit: int = 0
    alpha: int = 0  # PATINA_ALPHA_NONE
    alpha_least: float = 0.0
    exact: int = 1


@dataclass(frozen=True)
class MeshItem:
    mesh: native.Mesh
    style: MeshStyle
    pass_index: int  # of the object
    role: str = SEEN
    name: str = ""  # of the object
    asset: str = ""  # of its topmost parent
    texture: MeshTexture | None = None


class MeshTexture(Protocol):
    """An image on a mesh."""

    native: native.Texture

    def flat(self, color: tuple[float, ...]) -> MeshTexture | None:
        """The same shape in one color, for holdouts and catchers; None where the opacity does nothing."""
