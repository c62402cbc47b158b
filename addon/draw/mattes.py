# SPDX-License-Identifier: GPL-3.0-or-later
"""Holdouts and shadow catchers, out of pictures more of the same scene: nothing here knows Blender.

In the picture itself both are drawn black, so they hide what lies behind and give no light of their own. A second picture tells
their share of each pixel, by the same filters: holdouts in red, catchers in green. Where there are catchers, two more show these
alone in white, with shadows and without: what is missing of the light is how dark the shadow is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..description.meshes import MeshItem
from ..description.points import CloudItem
from ..description.roles import CATCHER, HOLDOUT
from ..description.scene import SceneDescription
from ..native.abi import LIGHTING
from ..sync.points.colors import FIXED
from . import backdrop

NO_CAST, NO_SELF = 1, 4  # of patina_shadow_off
BLACK, WHITE = (0.0,) * 3, (1.0,) * 3
CHANNELS = RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)

Item = CloudItem | MeshItem


def are_needed(description: SceneDescription) -> bool:
    return any(item.role for item in (*description.clouds, *description.meshes))


def picture(description: SceneDescription) -> SceneDescription:
    """The scene with holdouts and catchers black."""
    return _painted(description, lambda item: _flat(item, BLACK) if item.role else item)


def needed(description: SceneDescription) -> list[SceneDescription]:
    """The other pictures that a picture needs; finish() takes their planes COMBINED in this order."""
    plain = _plain(description)
    colors = {HOLDOUT: RED, CATCHER: GREEN}
    found = [unlit(description, lambda item: colors.get(item.role, BLACK))]
    if any(item.role == CATCHER for item in (*description.clouds, *description.meshes)):
        lit = _painted(plain, lambda item: _lit(item) if item.role == CATCHER else _flat(item, BLACK))
        dark = [replace(light, shadows=0) for light in lit.lights]
        found += [lit, replace(lit, lights=dark)]
    return found


def finish(color: np.ndarray, description: SceneDescription, planes: list[np.ndarray],
           behind: np.ndarray | None = None) -> np.ndarray:
    """color (height, width, 4), premultiplied, of picture(): without holdouts, catchers as their shadows. planes: of needed().
    behind: (height, width, 3) of a world that lies behind all."""
    held, caught = planes[0][..., 0], planes[0][..., 1]
    shadow = np.zeros_like(caught)
    if len(planes) > 1:
        lit, all_light = (plane[..., :3].sum(axis=2) for plane in planes[1:])
        np.divide(lit, all_light, out=shadow, where=all_light > 0.0)
        shadow = np.where(all_light > 0.0, caught * (1.0 - np.clip(shadow, 0.0, 1.0)), 0.0)
    out = color.copy() if behind is None else backdrop.over(color, behind)
    settings = description.settings
    if settings.film_transparent and behind is None:
        out[..., 3] = np.clip(color[..., 3] - held - caught + shadow, 0.0, 1.0)
        out[..., :3] *= (held + caught < color[..., 3] - 1e-4)[..., None]  # effects may have coloured what is held out
    else:
        background = np.float32(settings.background if settings.own_background else settings.world_color) if behind is None else behind
        out[..., :3] += (caught - shadow)[..., None] * background
        out[..., 3] = np.clip(out[..., 3] - held, 0.0, 1.0)
        out[..., :3] *= (held < 1.0 - 1e-4)[..., None]
    return out


def unlit(description: SceneDescription, color_of: Callable[[Item], tuple[float, float, float]]) -> SceneDescription:
    """The scene with each thing in one color, without light, on a transparent film; by the same filters."""
    plain = _plain(description)
    dark = replace(plain, lights=[], headlight=None, settings=replace(plain.settings, world_color=WHITE, world_directed=0))
    return _painted(dark, lambda item: _flat(item, color_of(item)))


def _plain(description: SceneDescription) -> SceneDescription:
    plain = replace(description, lines=None, effects=description.effects.focus_alone(), shadow_file="", clips=[
        replace(clip, tint_strength=0.0) for clip in description.clips])
    return replace(plain, settings=replace(plain.settings, film_transparent=1))


def _painted(description: SceneDescription, paint: Callable[[Item], Item]) -> SceneDescription:
    return replace(description, clouds=[paint(item) for item in description.clouds],
                   meshes=[paint(item) for item in description.meshes])


def _flat(item: Item, color: tuple[float, float, float]) -> Item:
    if isinstance(item, MeshItem):
        texture = item.texture and item.texture.flat(color)
        style = replace(item.style, color=color, unlit=0, alpha=item.style.alpha if texture else 0)
        return replace(item, mesh=item.mesh.bare or item.mesh if texture is None else item.mesh, style=style, texture=texture)
    style = replace(item.style, lighting=LIGHTING["UNLIT"], color_source=FIXED, color=color, ramp=b"", exposure=0.0, contrast=1.0,
                    free_space=item.style.free_space & 2)  # what is only marked gets the color too
    return replace(item, style=style)


def _lit(item: Item) -> Item:
    white = _flat(item, WHITE)
    if isinstance(item, MeshItem):
        return replace(white, style=replace(white.style, shadow_off=white.style.shadow_off & ~2 | NO_CAST))  # nor on itself
    style = white.style
    return replace(white, style=replace(style, lighting=LIGHTING["LIT"], specular=0.0, shadow_off=style.shadow_off & ~2 | NO_SELF))
