# SPDX-License-Identifier: GPL-3.0-or-later
"""Textures by formula for points: Checker, Wave, Magic and Noise. The Blender manual describes their inputs."""

from __future__ import annotations

import math

import bpy
import numpy as np

from ..lighting.world_image import exact
from ..lighting.world_nodes import Expression, Reader, Values, constant
from . import perlin

_sin, _cos = exact(np.sin), exact(np.cos)
_AXES = {'1D': 1, '2D': 2, '3D': 3, '4D': 4}

# Magic: turns after the first, as (changed coordinate, function, sign of the result, signs of x, y and z)
_TURNS = ((1, _cos, -1, (1, -1, 1)), (0, _cos, 1, (1, -1, -1)), (2, _sin, 1, (-1, -1, -1)), (0, _cos, -1, (-1, 1, -1)),
          (1, _sin, -1, (-1, 1, 1)), (1, _cos, -1, (-1, 1, 1)), (0, _cos, 1, (1, 1, 1)), (2, _sin, 1, (1, 1, -1)),
          (0, _cos, -1, (-1, -1, 1)), (1, _sin, -1, (1, -1, 1)))


def _inside(places: Values) -> Values:
    """Moved off whole numbers, so that rounding flips no cell on a plane at one."""
    return (places + np.float32(1e-6)) * np.float32(0.999999)


def _magic(places: Values, distortion: Values, depth: int) -> Values:
    """(n, 3) colors."""
    x, y, z = (places[:, axis:axis + 1] for axis in range(3))
    five = np.float32(5)
    at = [_sin((x + y + z) * five), _cos((-x + y - z) * five), -_cos((-x - y + z) * five)]
    if depth > 0:
        at = [one * distortion for one in at]
    for axis, function, sign, signs in _TURNS[:depth]:
        at[axis] = np.float32(sign) * function(sum(np.float32(factor) * one for factor, one in zip(signs, at, strict=True))) * distortion
    twice = distortion * 2
    found = np.concatenate(np.broadcast_arrays(*at), 1)
    return np.float32(0.5) - np.where(twice != 0, found / np.where(twice != 0, twice, np.float32(1)), found)


class PatternReader(Reader):
    """Each output of a texture becomes a function of points."""

    def _values(self, node: bpy.types.Node, *names: str) -> list[Expression]:
        return [self.value(node.inputs[name]) for name in names]

    def _ShaderNodeTexChecker(self, node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression:
        place, scale, first, second = self._place(node), *self._values(node, "Scale", "Color1", "Color2")

        def look(points: object) -> Values:
            cells = np.floor(_inside(place(points) * scale(points)))
            odd = np.nan_to_num(cells).sum(1, keepdims=True) % 2 == 1
            return odd if socket.type == 'VALUE' else np.where(odd, first(points), second(points))

        return look

    def _ShaderNodeTexWave(self, node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression:
        rings, profile = node.wave_type == 'RINGS', node.wave_profile
        direction = node.rings_direction if rings else node.bands_direction
        self._take(rings, profile, direction)
        place = self._place(node)
        scale, distortion, detail, finer, roughness, phase = self._values(
            node, "Scale", "Distortion", "Detail", "Detail Scale", "Detail Roughness", "Phase Offset")
        axis = "XYZ".find(direction)  # -1: all

        def wave(points: object) -> Values:
            at = _inside(place(points) * scale(points))
            if not rings:
                n = at[:, axis:axis + 1] * np.float32(20) if axis >= 0 else at.sum(1, keepdims=True) * np.float32(10)
            else:
                flat = at if axis < 0 else np.delete(at, axis, 1)
                n = np.sqrt((flat * flat).sum(1, keepdims=True)) * np.float32(20)
            n = n + phase(points)
            strength = distortion(points)
            if strength.any():
                n = n + strength * (perlin.octaves(at * finer(points), detail(points), _roughness(roughness(points))) * 2 - 1)
            if profile == 'SIN':
                return np.float32(0.5) + np.float32(0.5) * _sin(n - np.float32(math.pi / 2))
            n = n / np.float32(2 * math.pi)
            return n - np.floor(n) if profile == 'SAW' else np.abs(n - np.floor(n + np.float32(0.5))) * 2

        return wave if socket.type == 'VALUE' else lambda points: np.repeat(wave(points), 3, 1)

    def _ShaderNodeTexMagic(self, node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression:
        place, depth, scale, distortion = self._place(node), node.turbulence_depth, *self._values(node, "Scale", "Distortion")
        self._take(depth)

        def look(points: object) -> Values:
            color = _magic(place(points) * scale(points), distortion(points), depth)
            return color.mean(1, keepdims=True) if socket.type == 'VALUE' else color

        return look

    def _ShaderNodeTexNoise(self, node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression | None:
        if getattr(node, "noise_type", 'FBM') != 'FBM':
            return None
        axes, normalized = _AXES[node.noise_dimensions], getattr(node, "normalize", True)
        self._take(axes, normalized)
        place = self._place(node) if axes > 1 else None
        fourth = self.value(node.inputs["W"]) if axes in {1, 4} else None
        scale, detail, roughness, distortion = self._values(node, "Scale", "Detail", "Roughness", "Distortion")
        lacunarity = self.value(node.inputs["Lacunarity"]) if "Lacunarity" in node.inputs else constant(2.0)
        whole = socket.type == 'VALUE'

        def look(points: object) -> Values:
            parts = ([place(points)[:, :min(axes, 3)]] if place else []) + ([fourth(points)] if fourth else [])
            rows = max(len(part) for part in parts)
            at = np.concatenate([np.broadcast_to(part, (rows, part.shape[1])) for part in parts], 1) * scale(points)
            strength = distortion(points)
            if strength.any():
                at = at + np.concatenate([perlin.noise(at + perlin.offset(axis, axes)) for axis in range(axes)], 1) * strength
            places = [at] + ([] if whole else [at + perlin.offset(seed, axes) for seed in (axes, axes + 1)])
            return np.concatenate([perlin.octaves(one, detail(points), _roughness(roughness(points)), lacunarity(points), normalized)
                                   for one in places], 1)

        return look


def _roughness(values: Values) -> Values:
    """Blender before 4.0 has none above 1."""
    return np.maximum(values, 0) if bpy.app.version >= (4, 0, 0) else np.clip(values, 0, 1)
