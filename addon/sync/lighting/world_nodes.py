# SPDX-License-Identifier: GPL-3.0-or-later
"""A world's node tree → a function of directions that needs Blender no more.

Each socket becomes a function that takes rays and gives float32 values of n rows, or of one row where they are all alike, and of
one column (numbers) or three (colors and vectors). What a tree was read from is its key: equal keys, equal functions.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import bpy
import numpy as np

from .world_image import Image, angle, exact, read_image

Values = np.ndarray


@dataclass(frozen=True)
class Rays:
    """Looks into the world."""

    directions: np.ndarray  # (n, 3) float32, unit, away from the eye
    seen: bool  # by the camera; else they only light


Expression = Callable[[Rays], Values]

GRAY = np.array([0.2126, 0.7152, 0.0722], np.float32)  # of linear Rec. 709
_ROUNDS = {'FLOOR': np.floor, 'CEIL': np.ceil, 'ROUND': np.rint, 'TRUNC': np.trunc, 'FRACT': lambda a: a - np.floor(a)}
_ONE = {'SQRT': lambda a: np.sqrt(np.maximum(a, 0)), 'ABSOLUTE': np.abs, 'EXPONENT': exact(np.exp), 'SINE': exact(np.sin),
        'COSINE': exact(np.cos), 'TANGENT': exact(np.tan), 'ARCSINE': exact(lambda a: np.arcsin(np.clip(a, -1, 1))),
        'ARCCOSINE': exact(lambda a: np.arccos(np.clip(a, -1, 1))), 'ARCTANGENT': exact(np.arctan),
        'SIGN': np.sign, 'RADIANS': np.radians, 'DEGREES': np.degrees, **_ROUNDS}


def quotient(a: Values, b: Values) -> Values:
    return np.divide(a, b, out=np.zeros(np.broadcast_shapes(a.shape, b.shape), np.float32), where=b != 0)


def _power(a: Values, b: Values) -> Values:
    return np.where((a < 0) & (b != np.rint(b)), np.float32(0), exact(np.power)(a, b))


_TWO = {'ADD': np.add, 'SUBTRACT': np.subtract, 'MULTIPLY': np.multiply, 'DIVIDE': quotient, 'POWER': _power,
        'MINIMUM': np.minimum, 'MAXIMUM': np.maximum, 'LESS_THAN': lambda a, b: (a < b) * np.float32(1),
        'GREATER_THAN': lambda a, b: (a > b) * np.float32(1), 'ARCTAN2': angle,
        'MODULO': lambda a, b: np.where(b != 0, np.fmod(a, np.where(b != 0, b, 1)), 0)}
_BLENDS = {'MIX': lambda a, b: b, 'ADD': np.add, 'MULTIPLY': np.multiply, 'SUBTRACT': np.subtract,
           'SCREEN': lambda a, b: 1 - (1 - a) * (1 - b), 'DIVIDE': lambda a, b: np.where(b != 0, quotient(a, b), a),
           'DIFFERENCE': lambda a, b: np.abs(a - b), 'DARKEN': np.minimum, 'LIGHTEN': np.maximum}
_VECTORS = {'ADD': np.add, 'SUBTRACT': np.subtract, 'MULTIPLY': np.multiply, 'DIVIDE': quotient, 'MINIMUM': np.minimum,
            'MAXIMUM': np.maximum, 'DOT_PRODUCT': lambda a, b: (a * b).sum(1, keepdims=True), 'CROSS_PRODUCT': np.cross,
            'DISTANCE': lambda a, b: _length(a - b), 'LENGTH': lambda a, b: _length(a + 0 * b),
            'NORMALIZE': lambda a, b: unit(a), 'ABSOLUTE': lambda a, b: np.abs(a)}


def _length(a: Values) -> Values:
    return np.sqrt((a * a).sum(1, keepdims=True))


def unit(a: Values) -> Values:
    return quotient(a, _length(a))


def _turned(a: Values, turn: np.ndarray) -> Values:
    """Sum by sum: a product of matrices may round by how its rows lie in memory."""
    return a[:, 0:1] * turn[:, 0] + a[:, 1:2] * turn[:, 1] + a[:, 2:3] * turn[:, 2]


def _as(expression: Expression, kind: str, wanted: str) -> Expression:
    """Between kinds of sockets, as Blender converts: VALUE, VECTOR, RGBA."""
    kind, wanted = ('VALUE' if one in {'INT', 'BOOLEAN'} else one for one in (kind, wanted))
    if kind == wanted or {kind, wanted} <= {'VECTOR', 'RGBA', 'SHADER'}:
        return expression
    if wanted in {'VECTOR', 'RGBA'}:
        return lambda rays: np.repeat(expression(rays), 3, 1)
    if kind == 'RGBA':
        return lambda rays: expression(rays) @ GRAY[:, None]
    return lambda rays: expression(rays).mean(1, keepdims=True)


def constant(*values: float) -> Expression:
    row = np.array([values], np.float32)
    return lambda rays: row


@dataclass
class Reader:
    """Reads one tree. key: all that its functions depend on; unknown: names of nodes that are not known to Patina."""

    key: list = field(default_factory=list)
    unknown: list[str] = field(default_factory=list)
    images: list[Image] = field(default_factory=list)
    _groups: list[bpy.types.Node] = field(default_factory=list)  # that the reader is in
    _depth: int = 0

    def source(self, socket: bpy.types.NodeSocket) -> Expression | None:
        """What feeds a socket; None where nothing does, or what is not known."""
        links = [link for link in socket.links if not link.is_muted] if socket.is_linked else []
        if not links:
            return None
        start = links[0].from_socket
        self._depth += 1
        try:
            found = None if self._depth > 200 else self._output(start)
        finally:
            self._depth -= 1
        return _as(found, start.type, socket.type) if found else None

    def value(self, socket: bpy.types.NodeSocket) -> Expression:
        """The socket's source, or its own value."""
        found = self.source(socket)
        if found:
            return found
        default = getattr(socket, "default_value", 0.0)  # shaders have none: black
        values = tuple(default)[:3] if hasattr(default, "__len__") else (float(default),)
        self.key.append(values)
        return constant(*values) if socket.type != 'SHADER' else constant(0.0, 0.0, 0.0)

    def _output(self, socket: bpy.types.NodeSocket) -> Expression | None:
        node = socket.node
        self.key.append((node.bl_idname, socket.identifier, node.mute))
        if node.mute:
            inner = [link for link in node.internal_links if link.to_socket == socket]
            return _as(self.value(inner[0].from_socket), inner[0].from_socket.type, socket.type) if inner else constant(0.0, 0.0, 0.0)
        read = getattr(self, "_" + node.bl_idname, None)
        found = read(node, socket) if read else None
        if found is None and self._name(node) not in self.unknown:
            self.unknown.append(self._name(node))
        return found

    def _name(self, node: bpy.types.Node) -> str:
        """How unknown lists a node."""
        return node.name

    def _take(self, *values: object) -> None:
        self.key.append(values)

    # ---- wires

    def _NodeReroute(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression:
        return self.value(node.inputs[0])

    def _ShaderNodeGroup(self, node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression | None:
        output = next((one for one in node.node_tree.nodes if one.bl_idname == 'NodeGroupOutput' and one.is_active_output),
                      None) if node.node_tree else None
        inner = next((one for one in output.inputs if one.identifier == socket.identifier), None) if output else None
        if inner is None:
            return None
        self._groups.append(node)
        try:
            return self.value(inner)
        finally:
            self._groups.pop()

    def _NodeGroupInput(self, _node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression | None:
        if not self._groups:
            return None
        group = self._groups.pop()
        try:
            outer = next((one for one in group.inputs if one.identifier == socket.identifier), None)
            return self.value(outer) if outer else None
        finally:
            self._groups.append(group)

    # ---- shaders

    def picture(self, found: bpy.types.Image) -> Expression:
        """A world that is one image all around."""
        return self._shone(self.image(found, lambda rays: rays.directions), constant(1.0))

    def _ShaderNodeBackground(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression:
        return self._shone(self.value(node.inputs["Color"]), self.value(node.inputs["Strength"]))

    @staticmethod
    def _shone(color: Expression, strength: Expression) -> Expression:
        def shine(rays: Rays) -> Values:
            return np.maximum(color(rays) * strength(rays), 0)

        shine.parts = (color, strength)
        return shine

    _ShaderNodeEmission = _ShaderNodeBackground

    def _ShaderNodeMixShader(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression:
        share, a, b = (self.value(one) for one in node.inputs[:3])

        def mix(rays: Rays) -> Values:
            t = np.clip(share(rays), 0, 1)
            return a(rays) * (1 - t) + b(rays) * t

        mix.mixed = (share, a, b)
        return mix

    def _ShaderNodeAddShader(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression:
        a, b = (self.value(one) for one in node.inputs[:2])
        return lambda rays: a(rays) + b(rays)

    # ---- inputs

    def _ShaderNodeTexCoord(self, node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression | None:
        if socket.name == "Object" and node.object is None or socket.name == "Generated":
            return lambda rays: rays.directions
        if socket.name in {"Normal", "Reflection"}:
            return lambda rays: -rays.directions
        return None

    def _ShaderNodeNewGeometry(self, _node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression | None:
        if socket.name == "Position":
            return lambda rays: rays.directions
        return (lambda rays: -rays.directions) if socket.name in {"Normal", "True Normal", "Incoming"} else None

    def _ShaderNodeLightPath(self, _node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression:
        """A point is lit as by a matt reflection's ray."""
        if socket.name == "Is Camera Ray":
            return lambda rays: np.full((1, 1), rays.seen, np.float32)
        if socket.name in {"Is Diffuse Ray", "Is Reflection Ray", "Ray Depth", "Diffuse Depth"}:
            return lambda rays: np.full((1, 1), not rays.seen, np.float32)
        return constant(0.0)

    def _ShaderNodeRGB(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression:
        values = tuple(node.outputs[0].default_value)[:3]
        self._take(values)
        return constant(*values)

    def _ShaderNodeValue(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression:
        value = node.outputs[0].default_value
        self._take(value)
        return constant(value)

    # ---- textures

    def _place(self, node: bpy.types.Node) -> Expression:
        """Where a texture is asked: its vector, else the direction; turned by what the node itself has of a mapping."""
        place = self.source(node.inputs["Vector"]) or self._usual_place(node)
        mapping = node.texture_mapping
        euler, scale, move = mapping.rotation, tuple(mapping.scale), tuple(mapping.translation)
        self._take(tuple(euler), scale, move)
        if not (any(euler) or any(move) or scale != (1.0, 1.0, 1.0)):
            return place
        turn = np.array(euler.to_matrix(), np.float32)
        return lambda rays: _turned(place(rays) * np.float32(scale), turn) + np.float32(move)

    def _usual_place(self, _node: bpy.types.Node) -> Expression:
        """The coordinates of a texture whose Vector is not linked."""
        return lambda rays: rays.directions

    def _ShaderNodeTexEnvironment(self, node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression | None:
        if socket.name == "Alpha":
            return constant(1.0)
        return self.image(node.image, self._place(node), node.image_user, node.projection == 'MIRROR_BALL',
                          node.interpolation == 'Closest')

    def image(self, found: bpy.types.Image | None, place: Expression, user: bpy.types.ImageUser | None = None, ball: bool = False,
              closest: bool = False) -> Expression:
        """What an image shows at a place."""
        image = read_image(found, user)
        self._take(image.token, ball, closest)
        self.images.append(image)

        def look(rays: Rays) -> Values:
            return image.look(place(rays), ball=ball, closest=closest, fine=rays.seen)

        look.picture = (image, place, ball, closest)
        return look

    def _ShaderNodeTexGradient(self, node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression:
        place, kind = self._place(node), node.gradient_type
        self._take(kind)

        def gradient(rays: Rays) -> Values:
            x, y, _ = np.split(place(rays), 3, axis=1)
            if kind == 'RADIAL':
                t = angle(y, x) / np.float32(2 * math.pi) + np.float32(0.5)
            elif kind in {'SPHERICAL', 'QUADRATIC_SPHERE'}:
                t = np.maximum(np.float32(0.999999) - _length(place(rays)), 0)
                t = t * t if kind == 'QUADRATIC_SPHERE' else t
            elif kind == 'DIAGONAL':
                t = (x + y) * np.float32(0.5)
            else:
                t = np.clip(x, 0, 1) if kind == 'EASING' else np.maximum(x, 0) if kind == 'QUADRATIC' else x
                t = t * t * (3 - 2 * t) if kind == 'EASING' else t * t if kind == 'QUADRATIC' else t
            return np.clip(t, 0, 1)

        return gradient if socket.type == 'VALUE' else lambda rays: np.repeat(gradient(rays), 3, 1)

    # ---- vectors

    def _ShaderNodeMapping(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression:
        from mathutils import Euler
        kind = node.vector_type
        place = self.value(node.inputs["Vector"])
        scale = self.value(node.inputs["Scale"])
        move = self.value(node.inputs["Location"]) if kind in {'POINT', 'TEXTURE'} else constant(0.0, 0.0, 0.0)
        euler = self.value(node.inputs["Rotation"])
        self._take(kind)

        def mapped(rays: Rays) -> Values:  # a turn that differs by direction counts as that of the first
            turn = np.array(Euler(euler(rays)[0].tolist()).to_matrix(), np.float32)
            if kind == 'TEXTURE':
                return quotient(_turned(place(rays) - move(rays), turn.T), scale(rays))
            if kind == 'NORMAL':
                return unit(_turned(quotient(place(rays), scale(rays)), turn))
            return _turned(place(rays) * scale(rays), turn) + move(rays)

        return mapped

    def _ShaderNodeSeparateXYZ(self, node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression:
        vector, axis = self.value(node.inputs[0]), "XYZ".index(socket.name)
        return lambda rays: vector(rays)[:, axis:axis + 1]

    def _ShaderNodeCombineXYZ(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression:
        parts = [self.value(one) for one in node.inputs[:3]]
        return lambda rays: np.concatenate(np.broadcast_arrays(*(part(rays) for part in parts)), 1)

    def _ShaderNodeNormal(self, node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression:
        vector, way = self.value(node.inputs[0]), tuple(node.outputs[0].default_value)
        self._take(way)
        if socket.name == "Normal":
            return constant(*way)
        return lambda rays: unit(vector(rays)) @ np.array(way, np.float32)[:, None]

    def _ShaderNodeVectorMath(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression | None:
        kind = node.operation
        a, b = self.value(node.inputs[0]), self.value(node.inputs[1])
        self._take(kind)
        if kind == 'SCALE':
            scale = self.value(node.inputs["Scale"])
            return lambda rays: a(rays) * scale(rays)
        work = _VECTORS.get(kind) or (lambda x, y: _ROUNDS[kind](x)) if kind in _VECTORS or kind in _ROUNDS else None
        return (lambda rays: work(a(rays), b(rays)).astype(np.float32)) if work else None

    # ---- numbers and colors

    def _ShaderNodeMath(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression | None:
        kind, clamp = node.operation, node.use_clamp
        a, b, c = (self.value(one) for one in node.inputs[:3])
        self._take(kind, clamp)
        work = {'MULTIPLY_ADD': lambda x, y, z: x * y + z}.get(kind)
        if kind in _TWO:
            def work(x: Values, y: Values, _z: Values) -> Values:
                return _TWO[kind](x, y)
        elif kind in _ONE:
            def work(x: Values, _y: Values, _z: Values) -> Values:
                return _ONE[kind](x)
        if work is None:
            return None

        def done(rays: Rays) -> Values:
            with np.errstate(all='ignore'):
                out = np.nan_to_num(work(a(rays), b(rays), c(rays))).astype(np.float32)
            return np.clip(out, 0, 1) if clamp else out

        return done

    def _ShaderNodeValToRGB(self, node: bpy.types.Node, socket: bpy.types.NodeSocket) -> Expression:
        fac, ramp = self.value(node.inputs[0]), node.color_ramp
        self._take(ramp.interpolation, ramp.color_mode, ramp.hue_interpolation,
                   tuple((one.position, tuple(one.color)) for one in ramp.elements))
        entries = 4096 if ramp.interpolation == 'CONSTANT' else 1024
        table = np.array([ramp.evaluate(i / (entries - 1)) for i in range(entries)], np.float32)
        table = table[:, 3:] if socket.name == "Alpha" else table[:, :3]

        def look(rays: Rays) -> Values:
            at = np.clip(fac(rays)[:, 0], 0, 1) * np.float32(entries - 1)
            low = np.minimum(at.astype(np.int32), entries - 2)
            share = (at - low)[:, None]
            return table[low] * (1 - share) + table[low + 1] * share

        return look

    def _mix(self, kind: str, share: Expression, a: Expression, b: Expression, clamp: bool, within: bool) -> Expression | None:
        self._take(kind, clamp, within)
        blend = _BLENDS.get(kind)
        if blend is None:
            return None

        def mixed(rays: Rays) -> Values:
            t = np.clip(share(rays), 0, 1) if within else share(rays)
            first, second = a(rays), b(rays)
            out = first * (1 - t) + blend(first, second) * t
            if kind in {'DARKEN', 'LIGHTEN'}:
                out = blend(first, second * t + first * (1 - t))
            return np.clip(out, 0, 1) if clamp else out

        return mixed

    def _ShaderNodeMixRGB(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression | None:
        share, a, b = (self.value(one) for one in node.inputs[:3])
        return self._mix(node.blend_type, share, a, b, node.use_clamp, True)

    def _ShaderNodeMix(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression | None:
        """Blender 3.4's mix of numbers, vectors, or colors, with the inputs of all three."""
        if node.data_type not in {'FLOAT', 'VECTOR', 'RGBA'}:
            return None
        inputs = {one.identifier: one for one in node.inputs}
        uniform = node.data_type != 'VECTOR' or node.factor_mode == 'UNIFORM'
        ending = {'FLOAT': "Float", 'VECTOR': "Vector", 'RGBA': "Color"}[node.data_type]
        share = self.value(inputs["Factor_Float" if uniform else "Factor_Vector"])
        a, b = (self.value(inputs[f"{side}_{ending}"]) for side in "AB")
        colors = node.data_type == 'RGBA'
        return self._mix(node.blend_type if colors else 'MIX', share, a, b, colors and node.clamp_result, node.clamp_factor)

    def _ShaderNodeGamma(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression:
        color, gamma = self.value(node.inputs["Color"]), self.value(node.inputs["Gamma"])
        return lambda rays: np.where((c := color(rays)) > 0, exact(np.power)(np.maximum(c, 1e-30), gamma(rays)), c)

    def _ShaderNodeBrightContrast(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression:
        color, bright, contrast = (self.value(one) for one in node.inputs[:3])  # by number: Bright is Brightness in some versions
        return lambda rays: np.maximum((1 + contrast(rays)) * color(rays) + bright(rays) - np.float32(0.5) * contrast(rays), 0)

    def _ShaderNodeInvert(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression:
        share, color = self.value(node.inputs[0]), self.value(node.inputs[1])
        return lambda rays: (c := color(rays)) * (1 - share(rays)) + (1 - c) * share(rays)

    def _ShaderNodeRGBToBW(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression:
        color = self.value(node.inputs[0])
        return lambda rays: color(rays) @ GRAY[:, None]

    def _ShaderNodeHueSaturation(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression:
        parts = [self.value(node.inputs[at]) for at in (4, 0, 1, 2, 3)]  # by number: Fac is Factor in some versions

        def changed(rays: Rays) -> Values:
            color, hue, saturation, value, share = (part(rays) for part in parts)
            h, s, v = hsv(color)
            new = np.maximum(rgb((h + hue + np.float32(0.5)) % 1, np.clip(s * saturation, 0, 1), v * value), 0)
            return color * (1 - share) + new * share

        return changed

    def _ShaderNodeMapRange(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression | None:
        if getattr(node, "data_type", 'FLOAT') != 'FLOAT' or node.interpolation_type != 'LINEAR':
            return None
        value, low, high, first, last = (self.value(one) for one in node.inputs[:5])
        clamp = node.clamp
        self._take(clamp)

        def mapped(rays: Rays) -> Values:
            t = quotient(value(rays) - low(rays), high(rays) - low(rays))
            t = np.clip(t, 0, 1) if clamp else t
            return first(rays) + t * (last(rays) - first(rays))

        return mapped

    def _ShaderNodeClamp(self, node: bpy.types.Node, _socket: bpy.types.NodeSocket) -> Expression:
        value, low, high = (self.value(one) for one in node.inputs[:3])
        return lambda rays: np.minimum(np.maximum(value(rays), low(rays)), high(rays))


@dataclass(frozen=True, eq=False)
class Picture:
    """A world that is one image: its color in direction d is gain times the image's at turn d + move."""

    image: Image
    turn: np.ndarray  # (3, 3)
    move: np.ndarray  # (3,)
    gain: np.ndarray  # (3,)
    ball: bool
    closest: bool


def picture_of(expression: Expression) -> Picture | None:
    """What the camera sees of a world, where that is one image and no more."""
    directions = np.concatenate([np.eye(3), -np.eye(3), np.ones((1, 3)) / math.sqrt(3)]).astype(np.float32)
    rays = Rays(directions, True)
    if mixed := getattr(expression, "mixed", None):
        share = mixed[0](rays)
        return picture_of(mixed[1 + int(share[0, 0])]) if share.size == 1 and share[0, 0] in (0.0, 1.0) else None
    color, strength = getattr(expression, "parts", (None, None))
    known = getattr(color, "picture", None)
    gain = strength(rays) if known else np.empty((2, 0))
    if len(gain) != 1:
        return None
    image, place, ball, closest = known
    found = np.broadcast_to(place(rays), directions.shape).astype(np.float64)
    move = (found[:3] + found[3:6]).mean(0) / 2
    turn = (found[:3] - move).T
    if np.abs(directions @ turn.T + move - found).max() > 1e-4 * max(np.abs(found).max(), 1e-6):
        return None
    return Picture(image, turn, move, np.broadcast_to(gain, (1, 3))[0], ball, closest)


def hsv(color: Values) -> tuple[Values, Values, Values]:
    most, least = color.max(1, keepdims=True), color.min(1, keepdims=True)
    span = most - least
    r, g, b = np.split(color, 3, axis=1)
    hue = np.where(r == most, quotient(g - b, span), np.where(g == most, 2 + quotient(b - r, span), 4 + quotient(r - g, span)))
    return np.where(span > 0, hue / 6 % 1, 0).astype(np.float32), quotient(span, most), most


def rgb(h: Values, s: Values, v: Values) -> Values:
    way = np.clip(np.abs((h + np.float32([[0, 2 / 3, 1 / 3]])) % 1 * 6 - 3) - 1, 0, 1)
    return (v * (1 + s * (way - 1))).astype(np.float32)
