# SPDX-License-Identifier: GPL-3.0-or-later
"""Sun and point lights. Power means what it means in Blender: W/m2 for suns, W for points."""

from __future__ import annotations

from dataclasses import dataclass

import bpy

SUN, POINT = 1, 2  # patina_light_type
MOST = 32  # lights of a scene in the library


@dataclass(frozen=True)
class Light:
    """patina_light_desc."""

    type: int
    color: tuple[float, float, float]
    power: float
    position: tuple[float, float, float]
    direction: tuple[float, float, float]  # the way a sun's light travels


def collect(depsgraph: bpy.types.Depsgraph, notices: list[str]) -> list[Light]:
    lights = []
    left_out = set()
    for instance in depsgraph.object_instances:
        obj = instance.object
        if obj.type != 'LIGHT' or not instance.show_self:
            continue
        data = obj.data
        if data.type not in {'SUN', 'POINT'}:
            left_out.add(obj.name)
            continue
        color, power = _emission(data)
        if power <= 0.0 or max(color) <= 0.0:  # zero would mean "default" to the library
            continue
        matrix = instance.matrix_world
        lights.append(Light(
            type=SUN if data.type == 'SUN' else POINT,
            color=color, power=power,
            position=tuple(matrix.translation),
            direction=tuple(-matrix.col[2].xyz)))
    if len(lights) > MOST:
        notices.append(f"only the {MOST} strongest of {len(lights)} lights shine")
        lights = sorted(lights, key=lambda light: -light.power * max(light.color))[:MOST]
    if left_out:
        names = ", ".join(f"'{name}'" for name in sorted(left_out))
        notices.append(f"only sun and point lights shine yet, not {names}")
    return lights


def _emission(light: bpy.types.Light) -> tuple[tuple[float, float, float], float]:
    """Colour and power, with the exposure and temperature that Blender 4.5 brought."""
    color = tuple(light.color)
    if getattr(light, "use_temperature", False):
        color = tuple(a * b for a, b in zip(color, light.temperature_color, strict=True))
    return color, light.energy * 2.0 ** getattr(light, "exposure", 0.0)
