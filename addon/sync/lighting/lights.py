# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's lights as they are. Power means what it means to Cycles: W/m2 for suns, W for the others."""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy
from mathutils import Matrix, Vector

from ...description.lighting import Headlight, Light
from ...description.points import CloudItem
from ...description.view import Camera, View
from ...native.abi import LIGHTING
from .. import losses
from .world import Spot, World

TYPES = {'SUN': 1, 'POINT': 2, 'SPOT': 3, 'AREA': 4}  # patina_light_type
MOST = 32  # lights of a scene in the library
# Of an area light's power Cycles radiates pi / 4 in Blender 3.4, all of it in 4.2, 4.5 and 5.0: measured.
AREA_SHARE = math.pi / 4 if bpy.app.version < (4, 2, 0) else 1.0
SMALLEST = 1e-6  # stands for zero where zero would mean "default" to the library


def headlight(scene: bpy.types.Scene, view: View, notices: list[str]) -> Headlight | None:
    studio = scene.patina.studio
    if not studio.use_headlight or studio.headlight <= 0.0:
        return None
    if view.panorama:
        notices.append("the headlight is off: a panorama looks everywhere")
        return None
    return Headlight((1.0, 1.0, 1.0), studio.headlight)


def of_headlight(headlight: Headlight, camera: Camera) -> Light:
    """The headlight where the camera is: a sun."""
    back = Vector(camera.world_from_camera[2:11:4]).normalized()
    return _sun(headlight.color, headlight.power, -back, 0.0, False)


def missing(lights: Sequence[Light], headlight: Headlight | None, world: World) -> bool:
    """Whether lit points are black: there is no light, and the world is black."""
    return not lights and headlight is None and not any(world.color) and not any(world.light) and not any(world.plain_light or ())


def notice(items: Sequence[CloudItem], dark: bool) -> str:
    """What the artist reads if points are Lit and no light reaches them; "": all is well."""
    names = [f"'{item.name}'" for item in items if dark and item.style.lighting == LIGHTING["LIT"]]
    return f"no light reaches {', '.join(names)}: use Add Light in the Points panel, or set Lighting to Unlit" if names else ""


def collect(depsgraph: bpy.types.Depsgraph, notices: list[str], spot: Spot | None = None) -> list[Light]:
    """spot: the sun in the world's picture."""
    if depsgraph.scene_eval.patina.studio.use_light:
        return _studio(depsgraph.scene_eval)
    lights = []
    use_shadows = depsgraph.scene_eval.patina.use_shadows
    for instance in depsgraph.object_instances:
        obj = instance.object
        if obj.type != 'LIGHT' or not instance.show_self:
            continue
        color, power = _emission(obj.data)
        if power <= 0.0 or max(color) <= 0.0:  # zero would mean "default" to the library
            continue
        if not losses.is_placed(instance, notices):
            continue
        lights.append(_light(obj.data, instance.matrix_world, color, power, use_shadows))
    suns = [_sun(spot.color, 1.0, -Vector(spot.toward), spot.angle, use_shadows)] if spot else []
    most = MOST - len(suns) - depsgraph.scene_eval.patina.studio.use_headlight
    if len(lights) > most:
        notices.append(f"only the {most} strongest of {len(lights)} lights shine")
        lights = sorted(lights, key=lambda light: -light.power * max(light.color))[:most]
    return suns + lights


def _studio(scene: bpy.types.Scene) -> list[Light]:
    """The studio's light and the one that fills its shadows, as suns."""
    studio, lights = scene.patina.studio, []
    heading = 0.0
    if studio.follow_camera and scene.camera:
        right = scene.camera.matrix_world.col[0]  # level for most cameras, also for one that looks straight down
        heading = math.atan2(right.y, right.x)
    for azimuth, height, strength, shadows in (
            (studio.azimuth, studio.height, studio.strength, scene.patina.use_shadows),
            (studio.azimuth + math.radians(120), abs(studio.height) / 3, studio.strength * studio.fill, False)):
        if strength <= 0.0 or max(studio.color) <= 0.0:
            continue
        around = heading + azimuth
        toward = Vector((math.sin(around) * math.cos(height), -math.cos(around) * math.cos(height), math.sin(height)))
        lights.append(_sun(tuple(studio.color), strength, -toward, studio.angle, shadows))
    return lights


def _sun(color: tuple[float, float, float], power: float, direction: Vector, angle: float, shadows: bool) -> Light:
    return Light(
        type=TYPES['SUN'], color=color, power=power, position=(0.0, 0.0, 0.0), direction=tuple(direction),
        side=(0.0, 0.0, 0.0), angle=min(angle, math.pi), radius=0.0, size=(0.0, 0.0), shape=0, cone=0.0, blend=0.0, shadows=int(shadows))


def _light(data: bpy.types.Light, matrix: Matrix, color: tuple[float, float, float], power: float,
           use_shadows: bool) -> Light:
    kind = data.type
    return Light(
        type=TYPES[kind], color=color,
        power=power * AREA_SHARE if kind == 'AREA' else power,
        position=tuple(matrix.translation),
        direction=tuple(-matrix.col[2].xyz),
        side=tuple(matrix.col[0].xyz),
        angle=min(data.angle, math.pi) if kind == 'SUN' else 0.0,
        radius=data.shadow_soft_size if kind in {'POINT', 'SPOT'} else 0.0,
        size=_size(data, matrix) if kind == 'AREA' else (0.0, 0.0),
        shape=int(kind == 'AREA' and data.shape in {'DISK', 'ELLIPSE'}),
        cone=data.spot_size if kind == 'SPOT' else 0.0,
        blend=data.spot_blend if kind == 'SPOT' else 0.0,
        shadows=int(use_shadows and data.use_shadow))


def _size(data: bpy.types.Light, matrix: Matrix) -> tuple[float, float]:
    """Width and height; the object's scale counts."""
    height = data.size_y if data.shape in {'RECTANGLE', 'ELLIPSE'} else data.size
    return (max(data.size * matrix.col[0].xyz.length, SMALLEST), max(height * matrix.col[1].xyz.length, SMALLEST))


def _emission(light: bpy.types.Light) -> tuple[tuple[float, float, float], float]:
    """Colour and power, with the exposure and temperature that Blender 4.5 brought."""
    color = tuple(light.color)
    if getattr(light, "use_temperature", False):
        color = tuple(a * b for a, b in zip(color, light.temperature_color, strict=True))
    return color, light.energy * 2.0 ** getattr(light, "exposure", 0.0)
