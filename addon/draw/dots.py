# SPDX-License-Identifier: GPL-3.0-or-later
"""Points that a picture leaves out, and that Blender's overlays draw as dots all the same: the vertices of meshes. Where they lie is a
picture of its own, of depths alone, behind which overlays hide. Nothing here knows Blender."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ..description.points import CloudItem, CloudStyle
from ..description.scene import SceneDescription
from ..description.view import Clip

PAPER, OPEN, MEASURED = 1, 2, 0  # PATINA_QUALITY_PAPER, PATINA_FILL_OFF, PATINA_SURFACE_AUTO
SEEN_THROUGH = 2  # PATINA_FREE_SPACE_USE: such points are left out


def left_out(description: SceneDescription, own: Sequence[Clip], untrusted: bool) -> SceneDescription | None:
    """The points of those clouds that are not drawn whole, without anything that is for their colors; None where all are. own: clips
    that cut Blender's dots as well. untrusted: the picture left out points for their trust."""
    cut = len(description.clips) > len(own)
    clouds = [CloudItem(item.cloud, _whole(item.style), 0, name=item.name) for item in description.clouds
              if item.dotted and (item.soft or item.edits.hidden or _leaves_out(item.style, cut, untrusted))]
    if not clouds:
        return None
    settings = replace(description.settings, quality=PAPER, fill=OPEN, surface=MEASURED, smooth=0, antialias=0, layers=1, average=0,
                       pixel_samples=1, pixel_progressive=0, pixel_noise=0.0, film_transparent=1)
    return replace(description, clouds=clouds, meshes=[], clips=list(own), lights=[], headlight=None, lines=None, behind=None,
                   effects=description.effects.focus_alone().through(None), settings=settings, shadow_file="", notices=[])


def _leaves_out(style: CloudStyle, cut: bool, untrusted: bool) -> bool:
    return bool(cut and not style.clip_off or any(style.hidden_classes) or untrusted and style.least_trust >= 0.0
                or style.free_space == SEEN_THROUGH)


def _whole(style: CloudStyle) -> CloudStyle:
    return replace(style, hidden_classes=(0,) * 8, least_trust=-1.0, free_space=0, clip_off=0, cull_back=0,
                   transparency=0.0, surface=0)
