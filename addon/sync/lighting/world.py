# SPDX-License-Identifier: GPL-3.0-or-later
"""The world: what is seen behind the points, and the light that comes from all around.

Light is nine weights a color of the irradiance by the surface's normal (Ramamoorthi and Hanrahan, An Efficient Representation for
Irradiance Environment Maps, SIGGRAPH 2001, Eq. 13). What shines out of a small spot, as the sun of a photographed sky, is too
sharp for these and casts shadows: it becomes a sun.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import bpy
import numpy as np

from ...description.view import Mist
from ..losses import Loss
from . import world_image
from .world_nodes import GRAY, Expression, Picture, Rays, Reader, picture_of

BLACK = (0.0, 0.0, 0.0)
WIDTH, HEIGHT = 512, 256  # of the map that light is gathered from
SEEN_WIDTH = 1024  # of the map that a 3D view shows, of worlds that are not one image
MOST_WIDTH = 4096  # of an image there

# A spot is a sun where it gives this share of the light that falls on a surface turned to it. It is searched for within CAP of
# the brightest place; what lies between CAP and RING is taken for the sky that it stands before.
SUN_SHARE = 0.1
CAP, RING = math.radians(5.0), math.radians(8.0)


@dataclass(frozen=True)
class Spot:
    """A sun that a world's picture holds."""

    color: tuple[float, float, float]  # W/m2
    toward: tuple[float, float, float]
    angle: float  # that its disc spans


@dataclass(frozen=True, eq=False)
class World:
    """Equal only to itself: as long as nothing changes, reading gives the same one."""

    color: tuple[float, float, float]  # seen, or the mean of what is
    light: tuple[float, ...] = ()  # patina_settings.world_light, 27; empty: `color` from all around
    spot: Spot | None = None
    behind: Expression | None = None  # what is seen, by direction; None: `color`
    plain_light: tuple[float, float, float] | None = None  # from all around, where it is not what is seen

    def seen(self, directions: np.ndarray) -> np.ndarray:
        """(n, 3) float32 of unit directions (n, 3) away from the eye."""
        values = self.behind(Rays(directions, True)) if self.behind else np.array([self.color])
        return np.broadcast_to(values, directions.shape).astype(np.float32, copy=False)

    def picture(self) -> Picture:
        """What is seen, as one picture for the graphics processor: the world's own image, or one of it all around."""
        known = picture_of(self.behind)
        if known:
            pixels = known.image.pixels
            step = -(-pixels.shape[1] // MOST_WIDTH)
            return known if step == 1 else replace(known, image=replace(known.image, pixels=world_image.means(pixels, step)))
        directions, _ = _sphere(SEEN_WIDTH, SEEN_WIDTH // 2)
        pixels = self.seen(directions).reshape(SEEN_WIDTH // 2, SEEN_WIDTH, 3)
        return Picture(world_image.Image("", (), pixels, pixels), np.eye(3), np.zeros(3), np.ones(3), False, False)

    @property
    def ambient(self) -> tuple[float, float, float]:
        return self.plain_light or self.color


NONE = World(BLACK)
_known: dict[tuple, World] = {}  # the last one of each scene's world


def read(world: bpy.types.World | None, notices: list[str]) -> World:
    """Its node tree, or the plain color of a world without nodes."""
    if world is None:
        return NONE
    # Worlds always have nodes from Blender 5.0 on, where asking warns.
    if not world.node_tree or (bpy.app.version < (5, 0, 0) and not world.use_nodes):
        return World(tuple(world.color))
    output = world.node_tree.get_output_node('CYCLES') or world.node_tree.get_output_node('ALL')
    if output is None:
        return NONE
    reader = Reader()
    baked = world.patina.picture if world.patina.use_picture else None
    expression = reader.picture(baked) if baked else reader.value(output.inputs["Surface"])
    if reader.unknown:
        notices.append(f"the world's nodes are drawn without what is not known to Patina: "
                       f"{', '.join(repr(name) for name in reader.unknown[:3])}"
                       f"{f' and {len(reader.unknown) - 3} more' if len(reader.unknown) > 3 else ''}. "
                       "World Properties > Baked Picture > Bake World makes a picture of them")
    for image in reader.images:
        if image.lost:
            notices.append(Loss(f"the world's image '{image.name}' cannot be read: the world is pink there"))
    key = (world.original.name_full, tuple(map(repr, reader.key)))
    known = _known.get(key[:1])
    if known and known[0] == key:
        return known[1]
    found = _world(expression)
    _known[key[:1]] = (key, found)
    return found


def forget() -> None:
    _known.clear()
    world_image.forget()


def follow(depsgraph: bpy.types.Depsgraph) -> None:
    """Images that Blender says have changed are read again."""
    for update in depsgraph.updates:
        if isinstance(update.id, bpy.types.Image):
            world_image.forget({update.id.original.name_full})
            _known.clear()


def _world(expression: Expression) -> World:
    directions, weights = _sphere()
    with np.errstate(all='ignore'):
        seen, light = (np.nan_to_num(expression(Rays(directions, way)).astype(np.float32), posinf=65504.0)
                       for way in (True, False))
    if len(seen) == 1 and len(light) == 1:
        color, ambient = (tuple(map(float, np.broadcast_to(values, (1, 3))[0])) for values in (seen, light))
        return World(color, plain_light=None if ambient == color else ambient)
    light = np.broadcast_to(light, directions.shape)
    mean = tuple(map(float, (np.broadcast_to(seen, directions.shape) * weights).sum(0) / (4 * math.pi)))
    spot, rest = _take_spot(light.astype(np.float32), directions, weights)
    return World(mean, tuple(_weights(rest, directions, weights)), spot, expression)


def _sphere(width: int = WIDTH, height: int = HEIGHT) -> tuple[np.ndarray, np.ndarray]:
    """Middles of a picture's pixels all around, row by row from below, and their solid angles (n, 1), float32."""
    u, v = (np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height
    angle, up = np.meshgrid((0.5 - u) * 2 * math.pi, (v - 0.5) * math.pi)
    ring = np.cos(up)
    directions = np.stack([ring * np.cos(angle), ring * np.sin(angle), np.sin(up)], 2).reshape(-1, 3)
    edges = np.sin((np.arange(height + 1) / height - 0.5) * math.pi)
    weights = np.repeat(np.diff(edges) * 2 * math.pi / width, width)[:, None]
    return directions.astype(np.float32), weights.astype(np.float32)


def _weights(light: np.ndarray, directions: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Nine of red, nine of green, nine of blue."""
    x, y, z = directions.astype(np.float64).T
    basis = np.stack([np.ones_like(x), x, y, z, x * y, y * z, z * x, x * x - y * y, 3 * z * z - 1])
    # of each function: its share of the cosine lobe over pi, times one over its square's integral
    scales = np.array([1, *[2 / 3 * 3] * 3, *[15 / 4] * 3, 15 / 16, 5 / 16]) / (4 * math.pi)
    return ((basis * scales[:, None]) @ (light.astype(np.float64) * weights)).T.reshape(-1)


def _take_spot(light: np.ndarray, directions: np.ndarray, weights: np.ndarray) -> tuple[Spot | None, np.ndarray]:
    """The sun of a sky, and the light without it."""
    gray = light @ GRAY
    toward = directions[int(gray.argmax())].astype(np.float64)
    for _ in range(2):  # about its middle
        cosine = directions @ toward.astype(np.float32)
        near = cosine > math.cos(CAP)
        around = (cosine > math.cos(RING)) & ~near
        sky = np.median(light[around], axis=0) if around.any() else np.zeros(3, np.float32)
        excess = np.maximum(light[near] - sky, 0) * weights[near]
        share = excess @ GRAY
        if not share.sum() > 0:
            return None, light
        toward = (directions[near] * share[:, None]).sum(0).astype(np.float64)
        toward /= np.linalg.norm(toward)
    whole = float((np.maximum(directions @ toward.astype(np.float32), 0) * gray * weights[:, 0]).sum())
    if share.sum() < SUN_SHARE * whole:
        return None, light
    off = np.linalg.norm(directions[near] - toward, axis=1)
    pixel = math.pi / HEIGHT  # a place is known to within one: its own width is no part of the disc's
    spread = max(2 * float((off * off * share).sum() / share.sum()) - pixel * pixel / 3, 0.0)  # radius squared of an even disc
    rest = light.copy()
    rest[near] = np.minimum(light[near], sky)
    return Spot(tuple(map(float, excess.sum(0))), tuple(map(float, toward)), 2 * math.sqrt(spread)), rest


def mist(world: bpy.types.World | None) -> Mist | None:
    if world is None:
        return None
    settings = world.mist_settings
    return Mist(settings.start, settings.depth, settings.falloff)
