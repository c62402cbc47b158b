# SPDX-License-Identifier: GPL-3.0-or-later
"""What cases of the bench render: qualities and modes, by the names that rows have. Needs numpy alone."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[2] / "addon"), str(Path(__file__).resolve().parent)]

import stage as stages  # noqa: E402
from looks import CUES  # noqa: E402

import native  # noqa: E402  the add-on's binding, the only one there is

QUALITIES = {"refined": {"quality": 0, "fill": 0}, "paper": {"quality": 1, "fill": 1, "fill_iterations": 1},
             "unfilled": {"quality": 1, "fill": 2}, "splats": {"surface": 1},
             "analysed": {},  # the default once the library knows what every point is
             "averaged": {"average": 1},  # the same, means of the points about a surface
             "known discs": {"surface": 1, "depth": 1},  # the same as discs, their depth of the surface
             "final": {"pixel_samples": 16, "depth": 1}}  # the same, for final pictures
COLOR_AND_DEPTH, ALL_PASSES = 3, 0  # patina_settings.passes
LAYERS = 8  # rays through the nested tori meet up to eight surfaces


@dataclass(frozen=True)
class Mode:
    """What a mode asks for beyond lit surfaces: fields of patina_settings, patina_cloud_style, patina_light_desc,
    patina_effects and patina_lines."""

    settings: dict[str, Any] = field(default_factory=dict)
    style: dict[str, Any] = field(default_factory=dict)
    light: dict[str, Any] = field(default_factory=dict)
    effects: dict[str, Any] = field(default_factory=dict)
    still: bool = False  # lights that cast stay where they are, and their shadow textures are kept
    lines: dict[str, Any] = field(default_factory=dict)

    def missing(self) -> str:
        """The first field that the binding does not have yet, or ""."""
        for wanted, known in ((self.settings, native.abi.Settings), (self.style, native.abi.CloudStyle),
                              (self.light, native.abi.LightDesc), (self.effects, native.abi.Effects),
                              (self.lines, native.abi.Lines)):
            names = {name for name, *_ in known._fields_}
            for name in wanted:
                if name not in names:
                    return name
        return ""


# The papers' columns. A mode whose fields the library lacks is listed as not built yet.
MODES = {
    "surface": Mode(),
    "layers": Mode(settings={"layers": LAYERS}),
    "3 layers": Mode(settings={"layers": 3}, style={"transparency": 0.5}),
    "6 layers": Mode(settings={"layers": 6}, style={"transparency": 0.5}),
    "shadows kept": Mode(light={"shadows": 1}, still=True),
    "shadows 1": Mode(settings={"shadow_samples": 1, "shadow_lazy": 1}, light={"shadows": 1}),
    "shadows 5": Mode(settings={"shadow_samples": 5, "shadow_lazy": 1}, light={"shadows": 1, "angle": 0.1}),
    "shadows 10": Mode(settings={"shadow_samples": 10, "shadow_lazy": 1}, light={"shadows": 1, "angle": 0.1}),
    "lines 2": Mode(lines={"width": 2.0}),
    "lines 8": Mode(lines={"width": 8.0}),
    "lines 16": Mode(lines={"width": 16.0}),
}

MODES |= {name: Mode(effects=effects) for name, effects in CUES.items()}


def scene_of(cloud: native.Cloud, shown: stages.Stage, mode: Mode, size: tuple[int, int], turn: float,
             **settings: Any) -> native.Scene:
    """What a mode shows of a cloud, seen by the stage's camera after a turn of so many degrees. Lights that cast shadows turn too, unless
    the mode keeps them still. settings: of patina_settings; the mode's come first."""
    scene = native.Scene()
    scene.add_cloud(cloud, **{**shown.style, **mode.style})
    if mode.lines:
        scene.set_lines(**mode.lines)
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    for light in shown.lights:
        light = {**light, **mode.light}
        if mode.light and not mode.still:
            x, y, z = light["direction"]
            light["direction"] = [c * x - s * y, s * x + c * y, z]
        scene.add_light(**light)
    scene.set_settings(width=size[0], height=size[1], film_transparent=1, world_color=[0.05] * 3,
                       **{**settings, **mode.settings})
    scene.set_effects(**mode.effects)
    scene.set_camera(**shown.camera(turn).fields())
    return scene
