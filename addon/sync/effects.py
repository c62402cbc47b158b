# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's effects in image space, and the camera's depth of field."""

from __future__ import annotations

from dataclasses import dataclass, replace

import bpy

from .camera import Focus


@dataclass(frozen=True)
class Effects:
    """patina_effects; what is switched off has no strength."""

    edl_strength: float
    edl_radius: float
    obscurance_strength: float
    obscurance_radius: float
    toon_bands: int
    toon_softness: float
    hatch_levels: int
    hatch_spacing: float
    hatch_opacity: float
    hatch_ground: float
    hatch_color: tuple[float, float, float]
    fog_density: float
    fog_start: float
    fog_end: float
    fog_fixed: int
    fog_color: tuple[float, float, float]
    focus_aperture: float
    focus_distance: float
    paper_color: tuple[float, float, float]
    paper_grain: float
    exact: int = 1

    def through(self, focus: Focus | None) -> Effects:
        """With the depth of field of a view."""
        return replace(self, focus_aperture=focus.aperture if focus else 0.0,
                       focus_distance=focus.distance if focus else 0.0)

    def shrunk(self, factor: int) -> Effects:
        """For a picture of larger pixels, as far as lengths in pixels may become less."""
        return replace(self, edl_radius=max(self.edl_radius / factor, 1.0),
                       hatch_spacing=max(self.hatch_spacing / factor, 3.0))


def read(scene: bpy.types.Scene, focus: Focus | None, notices: list[str]) -> Effects:
    effects = scene.patina.effects
    fog = effects.use_fog
    if fog and effects.fog_end <= effects.fog_start:
        notices.append("fog is left out: its end is not beyond its start")
        fog = False
    return Effects(
        edl_strength=effects.edl_strength if effects.use_edl else 0.0,
        edl_radius=effects.edl_radius,
        obscurance_strength=effects.obscurance_strength if effects.use_obscurance else 0.0,
        obscurance_radius=effects.obscurance_radius,
        toon_bands=effects.toon_bands if effects.use_toon else 0,
        toon_softness=effects.toon_softness,
        hatch_levels=effects.hatch_levels if effects.use_hatch else 0,
        hatch_spacing=effects.hatch_spacing,
        hatch_opacity=effects.hatch_opacity,
        hatch_ground=effects.hatch_ground,
        hatch_color=tuple(effects.hatch_color),
        fog_density=effects.fog_density if fog else 0.0,
        fog_start=effects.fog_start,
        fog_end=effects.fog_end,
        fog_fixed=int(effects.fog_use_color),
        fog_color=tuple(effects.fog_color),
        focus_aperture=0.0,
        focus_distance=0.0,
        paper_color=tuple(effects.paper_color) if effects.use_paper else (1.0, 1.0, 1.0),
        paper_grain=effects.paper_grain if effects.use_paper else 0.0).through(focus)
