# SPDX-License-Identifier: GPL-3.0-or-later
"""A material's node tree → functions that give the base color and the opacity of points.

The reader of world nodes does the nodes that both share. Here are the inputs that points have, images, and the nodes that worlds do
not need. Each output of a node is evaluated once per block of points.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import bpy
import numpy as np

from ..lighting import world_image, world_nodes
from ..lighting.world_nodes import Expression, Values, constant
from .point_patterns import PatternReader

POSITION, NORMAL = "\0position", "\0normal"  # columns beside those of attributes
_MODES = {'RGB': (lambda color: color, lambda color: color),
          'HSV': (lambda color: np.concatenate(world_nodes.hsv(color), 1), lambda parts: world_nodes.rgb(*np.split(parts, 3, axis=1)))}


@dataclass
class Points:
    """A block of points. seen: nodes see camera rays."""

    columns: dict[str, Values]  # (n, 1..4) float32
    seen: bool = True
    _kept: dict[int, Values] = field(default_factory=dict)

    def once(self, number: int, expression: Expression) -> Values:
        if number not in self._kept:
            self._kept[number] = np.asarray(expression(self), np.float32)
        return self._kept[number]


def _wrapped(a: Values, low: Values, high: Values) -> Values:
    span = high - low
    return np.where(span != 0, a - span * np.floor(_ratio(a - low, span)), low)


def _ratio(a: Values, b: Values) -> Values:
    return world_nodes.quotient(np.asarray(a, np.float32), np.asarray(b, np.float32))


def _smooth_least(a: Values, b: Values, width: Values) -> Values:
    h = np.maximum(width - np.abs(a - b), 0) * _ratio(np.float32(1), width)
    return np.minimum(a, b) - h * h * h * width / 6


_MATH = {'LOGARITHM': lambda a, b, c: np.where((a > 0) & (b > 0), _ratio(np.log(np.maximum(a, 1e-30)), np.log(np.maximum(b, 1e-30))), 0),
         'INVERSE_SQRT': lambda a, b, c: np.where(a > 0, 1 / np.sqrt(np.maximum(a, 1e-30)), 0),
         'COMPARE': lambda a, b, c: np.abs(a - b) <= np.maximum(c, 1.1920929e-7),
         'SMOOTH_MIN': _smooth_least, 'SMOOTH_MAX': lambda a, b, c: -_smooth_least(-a, -b, c),
         'WRAP': lambda a, b, c: _wrapped(a, c, b),
         'SNAP': lambda a, b, c: np.floor(_ratio(a, b)) * b,
         'PINGPONG': lambda a, b, c: np.abs(((t := _ratio(a - b, b * 2)) - np.floor(t)) * b * 2 - b),
         'FLOORED_MODULO': lambda a, b, c: np.where(b != 0, a - np.floor(_ratio(a, b)) * b, 0),
         'SINH': lambda a, b, c: np.sinh(a), 'COSH': lambda a, b, c: np.cosh(a), 'TANH': lambda a, b, c: np.tanh(a)}
_STEPS = {'LINEAR': lambda t, n: t, 'STEPPED': lambda t, n: np.where(n > 0, _ratio(np.floor(t * (n + 1)), n), 0),
          'SMOOTHSTEP': lambda t, n: (t := np.clip(t, 0, 1)) * t * (3 - 2 * t),
          'SMOOTHERSTEP': lambda t, n: (t := np.clip(t, 0, 1)) * t * t * (t * (t * 6 - 15) + 10)}


def turned(places: Values, euler: Values, back: bool = False) -> Values:
    """Rotated by an XYZ Euler angle, of all points or of each; back: the other way around."""
    for axis in (2, 1, 0) if back else (0, 1, 2):
        angle = -euler[:, axis] if back else euler[:, axis]
        if not angle.any():
            continue
        s, c = np.sin(angle), np.cos(angle)
        a, b = (axis + 1) % 3, (axis + 2) % 3
        rows = [places[:, 0], places[:, 1], places[:, 2]]
        rows[a], rows[b] = c * rows[a] - s * rows[b], s * rows[a] + c * rows[b]
        places = np.stack(np.broadcast_arrays(*rows), 1)
    return places


@dataclass
class PointReader(PatternReader):
    """obtain(name): whether the column of an attribute could be read, and its data type; empty: there is none. to_world: of the object.
    box: lowest and highest corner of the points."""

    obtain: Callable[[str], str] = lambda name: ""
    to_world: np.ndarray = field(default_factory=lambda: np.eye(4))
    box: tuple[np.ndarray, np.ndarray] = (np.zeros(3), np.ones(3))
    reads_images: bool = True  # else any image is black: only what cannot be evaluated is wanted
    colors: str = ""  # the color attribute that Blender renders
    missing: list[str] = field(default_factory=list)  # attributes that are named and not there
    opacity: Expression | None = None  # of the Principled BSDF that was read last
    _outputs: dict[tuple, Expression | None] = field(default_factory=dict)

    def _output(self, socket: bpy.types.NodeSocket) -> Expression | None:
        place = (*(group.as_pointer() for group in self._groups), socket.node.as_pointer(), socket.identifier)
        if place in self._outputs:  # None: a cycle, or what cannot be evaluated
            return self._outputs[place]
        self._outputs[place], number = None, len(self._outputs)
        found = super()._output(socket)
        self._outputs[place] = once = (lambda points: points.once(number, found)) if found else None
        return once

    def _name(self, node: bpy.types.Node) -> str:
        return f"'{node.name}' ({node.bl_label})"

    # ---- shaders: their color

    def _ShaderNodeBsdfPrincipled(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression:
        alpha = node.inputs["Alpha"]
        if alpha.is_linked or alpha.default_value != 1.0:
            self.opacity = self.value(alpha)
        return self.value(node.inputs["Base Color"])

    def _ShaderNodeBsdfDiffuse(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression:
        return self.value(node.inputs["Color"])

    # ---- inputs

    def _column(self, name: str) -> Expression | None:
        kind = self.obtain(name)
        self._take(name, kind)
        return (lambda points: points.columns[name]) if kind else None

    def _attribute(self, name: str, output: str) -> Expression:
        """As Cycles converts: a number is gray, Fac of a vector its mean; what is missing is black."""
        column = self._column(name)
        if column is None:
            if name not in self.missing:
                self.missing.append(name)
            return constant(0.0) if output in {"Fac", "Factor", "Alpha"} else constant(0.0, 0.0, 0.0)

        def give(points: Points) -> Values:
            values = column(points)
            width = values.shape[1]
            if output == "Alpha":
                return values[:, 3:] if width == 4 else np.ones((1, 1), np.float32)
            if output in {"Fac", "Factor"}:
                return values[:, :3].mean(1, keepdims=True)
            if width == 2:
                return np.pad(values, ((0, 0), (0, 1)))
            return np.repeat(values, 3, 1) if width == 1 else values[:, :3]

        return give

    def _ShaderNodeAttribute(self, node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression | None:
        return self._attribute(node.attribute_name, socket.name) if node.attribute_type == 'GEOMETRY' else None

    def _ShaderNodeVertexColor(self, node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression:
        return self._attribute(node.layer_name or self.colors, socket.name)

    def _uv(self, name: str) -> Expression | None:
        for known in (name,) if name else ("UVMap", "uv", "UV", "st", "UVTex"):
            if self.obtain(known):
                return self._attribute(known, "Vector")
        return None

    def _ShaderNodeUVMap(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression | None:
        return None if node.from_instancer else self._uv(node.uv_map)

    def _generated(self) -> Expression:
        place = self._column(POSITION)
        low, size = self.box[0].astype(np.float32), (self.box[1] - self.box[0]).astype(np.float32)
        self._take(low.tolist(), size.tolist())
        flat = size <= 0
        return lambda points: np.where(flat, np.float32(0.5), (place(points) - low) / np.where(flat, np.float32(1), size))

    def _moved(self, name: str, matrix: np.ndarray) -> Expression | None:
        """Positions, or normals of the object, in another space."""
        column = self._column(name)
        if column is None:
            return None
        self._take(matrix.tolist())
        if name == POSITION:
            return lambda points: (points.columns[name] @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.float32)
        turn = np.linalg.pinv(matrix[:3, :3])
        return lambda points: world_nodes.unit((points.columns[name] @ turn).astype(np.float32))

    def _ShaderNodeTexCoord(self, node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression | None:
        if socket.name == "Object" and node.object:
            return self._moved(POSITION, np.linalg.pinv(np.array(node.object.matrix_world)) @ self.to_world)
        if node.from_instancer:
            return None
        return {"Object": lambda: self._column(POSITION), "Generated": self._generated, "Normal": lambda: self._column(NORMAL),
                "UV": lambda: self._uv("")}.get(socket.name, lambda: None)()

    def _ShaderNodeNewGeometry(self, _node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression | None:
        if socket.name == "Position":
            return self._moved(POSITION, self.to_world)
        if socket.name == "Backfacing":
            return constant(0.0)
        return self._moved(NORMAL, self.to_world) if socket.name in {"Normal", "True Normal"} else None

    # ---- textures

    def _usual_place(self, _node: bpy.types.Node) -> Expression:
        return self._generated()

    def _ShaderNodeTexEnvironment(self, node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression | None:
        return super()._ShaderNodeTexEnvironment(node, socket) if node.inputs["Vector"].is_linked else None

    def _ShaderNodeTexImage(self, node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression | None:
        linked = any(not link.is_muted for link in node.inputs["Vector"].links)
        uv = None if linked else self._uv("")
        if node.projection != 'FLAT' or not linked and uv is None:
            return None
        place = self._place(node) if linked else uv
        if not self.reads_images:
            return constant(0.0) if socket.name == "Alpha" else constant(0.0, 0.0, 0.0)
        image = world_image.read_image(node.image, node.image_user)
        self.images.append(image)
        self._take(image.token, node.extension, node.interpolation)
        pixels, extension, closest = image.pixels, node.extension, node.interpolation == 'Closest'
        if socket.name == "Alpha":
            pixels = _alpha(node.image, image)
        height, width = pixels.shape[:2]

        def look(points: Points) -> Values:
            u, v = (np.nan_to_num(column) for column in place(points)[:, :2].T)
            outside = (u < 0) | (u > 1) | (v < 0) | (v > 1)
            if extension == 'MIRROR':
                u, v = (1 - np.abs(axis % 2 - 1) for axis in (u, v))
            if extension != 'REPEAT':
                u, v = (np.clip(axis, 0.5 / size, 1 - 0.5 / size).astype(np.float32) for axis, size in ((u, width), (v, height)))
            found = world_image.sample(pixels, u, v, closest)
            if extension == 'CLIP':
                found = np.where(outside[:, None], np.float32(0), found)
            return found[:, :1] if socket.name == "Alpha" else found

        return look

    # ---- vectors

    def _ShaderNodeMapping(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression:
        kind = node.vector_type
        self._take(kind)
        place, euler, scale = (self.value(node.inputs[name]) for name in ("Vector", "Rotation", "Scale"))
        move = self.value(node.inputs["Location"]) if kind in {'POINT', 'TEXTURE'} else constant(0.0, 0.0, 0.0)

        def mapped(points: Points) -> Values:
            if kind == 'TEXTURE':
                return _ratio(turned(place(points) - move(points), euler(points), back=True), scale(points))
            if kind == 'NORMAL':
                return world_nodes.unit(turned(_ratio(place(points), scale(points)), euler(points)))
            return turned(place(points) * scale(points), euler(points)) + move(points)

        return mapped

    # ---- numbers and colors

    def _ShaderNodeMath(self, node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression | None:
        work, clamp = _MATH.get(node.operation), node.use_clamp
        if work is None:
            return super()._ShaderNodeMath(node, socket)
        self._take(node.operation, clamp)
        parts = [self.value(one) for one in node.inputs[:3]]

        def done(points: Points) -> Values:
            out = np.nan_to_num(work(*(part(points) for part in parts)).astype(np.float32))
            return np.clip(out, 0, 1) if clamp else out

        return done

    def _ShaderNodeMapRange(self, node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression | None:
        kind = node.interpolation_type
        if getattr(node, "data_type", 'FLOAT') != 'FLOAT':
            return None
        value, low, high, first, last, steps = (self.value(one) for one in node.inputs[:6])
        clamp = node.clamp and kind in {'LINEAR', 'STEPPED'}
        self._take(kind, clamp)

        def mapped(points: Points) -> Values:
            t = _STEPS[kind](_ratio(value(points) - low(points), high(points) - low(points)), steps(points))
            t = np.clip(t, 0, 1) if clamp else t
            return first(points) + t * (last(points) - first(points))

        return mapped

    def _ShaderNodeValToRGB(self, node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression:
        ramp = node.color_ramp
        exact = ramp.color_mode == 'RGB' and ramp.interpolation in {'LINEAR', 'CONSTANT'}
        if not exact:
            return super()._ShaderNodeValToRGB(node, socket)
        fac, constant_steps = self.value(node.inputs[0]), ramp.interpolation == 'CONSTANT'
        stops = sorted(ramp.elements, key=lambda one: one.position)
        places, colors = np.float32([one.position for one in stops]), np.float32([tuple(one.color) for one in stops])
        colors = colors[:, 3:] if socket.name == "Alpha" else colors[:, :3]
        self._take(constant_steps, places.tolist(), colors.tolist())

        def look(points: Points) -> Values:
            at = np.nan_to_num(fac(points)[:, 0])
            if constant_steps:
                return colors[np.maximum(np.searchsorted(places, at, side='right') - 1, 0)]
            return np.stack([np.interp(at, places, channel) for channel in colors.T], 1).astype(np.float32)

        return look

    def _curves(self, node: bpy.types.Node, color: Expression, order: tuple[tuple[int, ...], ...]) -> Expression | None:
        """order: of each channel the curves that are applied one after the other."""
        mapping, share = node.mapping, self.value(node.inputs[0])
        if tuple(mapping.black_level) != (0.0, 0.0, 0.0) or tuple(mapping.white_level) != (1.0, 1.0, 1.0):
            return None
        mapping.initialize()
        low = min(0.0, *(point.location[0] for curve in mapping.curves for point in curve.points))
        high = max(1.0, *(point.location[0] for curve in mapping.curves for point in curve.points))
        places = np.linspace(low, high, 2049)
        tables = [np.array([mapping.evaluate(curve, float(place)) for place in places]) for curve in mapping.curves]
        self._take(low, high, mapping.extend, [hash(table.tobytes()) for table in tables])
        beyond = mapping.extend == 'EXTRAPOLATED'

        def through(table: Values, x: Values) -> Values:
            found = np.interp(x, places, table)
            if beyond:
                step = places[1] - places[0]
                found = np.where(x < low, table[0] + (x - low) * (table[1] - table[0]) / step, found)
                found = np.where(x > high, table[-1] + (x - high) * (table[-1] - table[-2]) / step, found)
            return found

        def look(points: Points) -> Values:
            before = color(points)
            channels = []
            for number, curves in enumerate(order):
                values = np.nan_to_num(before[:, number])
                for curve in curves:
                    values = through(tables[curve], values)
                channels.append(values)
            return before + share(points) * (np.stack(channels, 1).astype(np.float32) - before)

        return look

    def _ShaderNodeRGBCurve(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression | None:
        if node.mapping.tone != 'STANDARD':
            return None
        return self._curves(node, self.value(node.inputs["Color"]), ((3, 0), (3, 1), (3, 2)))

    def _ShaderNodeFloatCurve(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression | None:
        return self._curves(node, self.value(node.inputs["Value"]), ((0,),))

    def _separated(self, node: bpy.types.Node, socket: bpy.types.NodeSocket, mode: str) -> Expression | None:
        self._take(mode)
        color, at = self.value(node.inputs[0]), list(node.outputs).index(socket)
        return (lambda points: _MODES[mode][0](color(points))[:, at:at + 1]) if mode in _MODES else None

    def _combined(self, node: bpy.types.Node, mode: str) -> Expression | None:
        self._take(mode)
        parts = [self.value(one) for one in node.inputs[:3]]
        if mode not in _MODES:
            return None
        return lambda points: _MODES[mode][1](np.concatenate(np.broadcast_arrays(*(part(points) for part in parts)), 1))

    def _ShaderNodeSeparateColor(self, node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression | None:
        return self._separated(node, socket, node.mode)

    def _ShaderNodeCombineColor(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression | None:
        return self._combined(node, node.mode)

    # of files before Blender 3.3

    def _ShaderNodeSeparateRGB(self, node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression | None:
        return self._separated(node, socket, 'RGB')

    def _ShaderNodeSeparateHSV(self, node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression | None:
        return self._separated(node, socket, 'HSV')

    def _ShaderNodeCombineRGB(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression | None:
        return self._combined(node, 'RGB')

    def _ShaderNodeCombineHSV(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression | None:
        return self._combined(node, 'HSV')


def _alpha(image: bpy.types.Image | None, read: world_image.Image) -> np.ndarray:
    """(height, width, 3) of an image's opacity."""
    if image is None or read.lost or image.channels != 4:
        return np.ones_like(read.pixels)
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    return np.repeat(values.reshape(*read.pixels.shape[:2], 4)[..., 3:], 3, 2)


def evaluate(expression: Expression, opacity: Expression | None, columns: dict[str, Values], count: int, block: int,
             pause: Callable[[], None]) -> tuple[np.ndarray, np.ndarray | None]:
    """Colors (count, 3) and opacities (count, 1), finite float32. pause() is called between blocks and may raise."""
    colors = np.empty((count, 3), np.float32)
    opacities = None if opacity is None else np.empty((count, 1), np.float32)
    for start in range(0, count, block):
        pause()
        points = Points({name: values[start:start + block] for name, values in columns.items()})
        with np.errstate(all='ignore'):
            found = np.nan_to_num(expression(points), posinf=65504.0, neginf=0.0)
            colors[start:start + block] = np.maximum(found, 0)
            if opacity:
                opacities[start:start + block] = np.clip(np.nan_to_num(opacity(points)), 0, 1)
    return colors, opacities
