# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of meshes: their base colour, or the image on it, and Blender's images → textures of the library."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Euler, Matrix

from ... import native

WHITE = (0.8, 0.8, 0.8, 1.0)
PINK = (1.0, 0.0, 1.0)  # of an image that is missing, as Cycles has it
NONE, CLIP, BLEND = 0, 1, 2  # patina_alpha

# node type → its colour, its opacity, whether light changes it
_SHADERS = {'BSDF_PRINCIPLED': ("Base Color", "Alpha", True), 'BSDF_DIFFUSE': ("Color", "", True),
            'EMISSION': ("Color", "", False)}


@dataclass(frozen=True)
class ImageUse:
    """An image as a material shows it."""

    image: str  # its full name; empty: none was chosen
    uv_map: str  # empty: that which Blender renders
    place: tuple[float, ...]  # of the Mapping node before it: 2 x 3, row by row
    nearest: bool
    wrap: str  # of native.WRAPS
    alpha: int  # NONE, CLIP or BLEND
    alpha_least: float
    strength: float  # of the light that it shines with


@dataclass(frozen=True)
class Surface:
    """What a material looks like."""

    color: tuple[float, ...]  # linear RGBA
    unlit: bool = False
    use: ImageUse | None = None


def surface_of(material: bpy.types.Material | None, notices: list[str]) -> Surface:
    """Of the shader that the material's output shows; else of its first Principled or Diffuse node, else the colour that the Solid
    viewport shows. notices: what is not drawn as it is."""
    if material is None:
        return Surface(WHITE)
    if not material.node_tree or not (bpy.app.version >= (5, 0, 0) or material.use_nodes):
        return Surface(tuple(material.diffuse_color))
    node = _shader(material)
    if node is None:
        return Surface(tuple(material.diffuse_color))
    color_name, alpha_name, lit = _SHADERS[node.type]
    strength = 1.0 if lit else node.inputs["Strength"].default_value
    socket = _source(node.inputs[color_name])
    if socket is None:
        color = np.array(node.inputs[color_name].default_value)
        color[:3] *= strength
        return Surface(tuple(map(float, color)), not lit)
    if socket.node.type != 'TEX_IMAGE' or socket.name != "Color":
        _say(notices, f"'{material.name}': what a node {socket.node.bl_label} makes is not drawn: {color_name} is the viewport's color")
        return Surface(tuple(material.diffuse_color), not lit)
    place = _place(material, socket.node, notices)
    if place is None:
        return Surface(tuple(material.diffuse_color), not lit)
    opacity = _source(node.inputs[alpha_name]) if alpha_name else None
    if opacity is not None and (opacity.node != socket.node or opacity.name != "Alpha"):
        _say(notices, f"'{material.name}': {alpha_name} is of another node than the image, and left out")
        opacity = None
    texture = socket.node
    if texture.extension == 'MIRROR':
        _say(notices, f"'{material.name}': the image is repeated, not mirrored")
    return Surface(tuple(material.diffuse_color), not lit, ImageUse(
        texture.image.name_full if texture.image else "", *place, texture.interpolation == 'Closest',
        texture.extension if texture.extension in native.WRAPS else 'REPEAT',
        _alpha(material) if opacity is not None else NONE, _threshold(material), strength))


def names_in(material: bpy.types.Material) -> set[str]:
    """Full names of the images that its nodes have."""
    nodes = material.node_tree.nodes if material.node_tree else ()
    return {node.image.name_full for node in nodes if node.type == 'TEX_IMAGE' and node.image} | {""}


def _shader(material: bpy.types.Material) -> bpy.types.Node | None:
    output = material.node_tree.get_output_node('ALL') or material.node_tree.get_output_node('CYCLES')
    socket = _source(output.inputs["Surface"]) if output else None
    if socket and socket.node.type in _SHADERS:
        return socket.node
    nodes = [node for node in material.node_tree.nodes if node.type in {'BSDF_PRINCIPLED', 'BSDF_DIFFUSE'}]
    return nodes[0] if nodes else None


def _source(socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """The output that an input is linked to, through reroutes."""
    for _ in range(100):
        links = [link for link in socket.links if not link.is_muted]
        if not links:
            return None
        source = links[0].from_socket
        if source.node.type != 'REROUTE':
            return source
        socket = source.node.inputs[0]
    return None


def _place(material: bpy.types.Material, node: bpy.types.Node, notices: list[str]) -> tuple[str, tuple[float, ...]] | None:
    """The UV map, and what a Mapping node does to it; None where an image lies on something else."""
    matrix = Matrix()
    socket = _source(node.inputs["Vector"])
    if socket is not None and socket.node.type == 'MAPPING':
        mapping = socket.node
        if mapping.vector_type != 'POINT' or any(_source(mapping.inputs[name]) for name in ("Location", "Rotation", "Scale")):
            _say(notices, f"'{material.name}': its Mapping node is of another kind than fixed points, and left out")
        else:
            values = [mapping.inputs[name].default_value for name in ("Location", "Rotation", "Scale")]
            matrix = Matrix.LocRotScale(values[0], Euler(values[1]), values[2])
        socket = _source(mapping.inputs["Vector"])
    if node.projection != 'FLAT' or socket is not None and not (
            socket.node.type == 'UVMAP' or socket.node.type == 'TEX_COORD' and socket.name == "UV"):
        _say(notices, f"'{material.name}': images are drawn on UV maps only, this one is not")
        return None
    name = socket.node.uv_map if socket is not None and socket.node.type == 'UVMAP' else ""
    return name, (*matrix[0][:2], matrix[0][3], *matrix[1][:2], matrix[1][3])


def _alpha(material: bpy.types.Material) -> int:
    if bpy.app.version >= (4, 2, 0):
        return BLEND
    return {'OPAQUE': NONE, 'CLIP': CLIP}.get(material.blend_method, BLEND)


def _threshold(material: bpy.types.Material) -> float:
    return max(getattr(material, "alpha_threshold", 0.5), 1e-3)


def _say(notices: list[str], text: str) -> None:
    if text not in notices:
        notices.append(text)


# ---- images ----------------------------------------------------------------------------------------------------------------


class Texture:
    """A texture, and the same shape in one colour for holdouts and catchers."""

    def __init__(self, pixels: np.ndarray, raw: bool, use: ImageUse) -> None:
        self._use = use
        self.native = native.Texture(pixels, raw, use.nearest, use.wrap)
        self._opacity = _as_byte(pixels[..., 3]) if use.alpha else None
        self._flat: dict[tuple[float, ...], Texture] = {}

    def flat(self, color: tuple[float, ...]) -> Texture | None:
        """None where the opacity does nothing."""
        if self._opacity is None:
            return None
        if color not in self._flat:
            pixels = np.empty((*self._opacity.shape, 4), np.uint8)
            pixels[..., :3] = _as_byte(np.float32(color))
            pixels[..., 3] = self._opacity
            self._flat[color] = Texture(pixels, True, self._use)
        return self._flat[color]


def _as_byte(values: np.ndarray) -> np.ndarray:
    return values if values.dtype == np.uint8 else np.rint(np.clip(values, 0.0, 1.0) * 255.0).astype(np.uint8)


class TextureCache:
    """Textures by image and use; content decides whether one is made anew. What the last picture did not use goes."""

    def __init__(self) -> None:
        self._entries: dict[ImageUse, tuple[tuple | None, bytes, Texture]] = {}
        self._used: set[ImageUse] = set()
        self._fresh: set[str] = set()  # images that Blender has not said to have changed since they were read

    def forget(self, names: set[str]) -> None:
        """Full names of images that changed."""
        self._fresh -= names

    def obtain(self, use: ImageUse, notices: list[str], trusting: bool = False) -> Texture:
        """trusting: only images of which Blender said that they changed are looked at."""
        self._used.add(use)
        known = self._entries.get(use)
        if known and trusting and use.image in self._fresh:
            return known[2]
        image = bpy.data.images.get(use.image) if use.image else None  # of linked libraries too: full names are no keys
        if use.image and image is None:
            image = next((one for one in bpy.data.images if one.name_full == use.image), None)
        state = _state(image)
        if not known or state is None or known[0] != state:
            pixels, raw = _read(image, use, notices)
            digest = hashlib.blake2b(pixels, digest_size=16).digest()
            texture = known[2] if known and known[1] == digest else Texture(pixels, raw, use)
            self._entries[use] = known = (state, digest, texture)
        self._fresh.add(use.image)
        return known[2]

    def trim(self) -> None:
        """After a picture."""
        self._entries = {use: entry for use, entry in self._entries.items() if use in self._used}
        self._used = set()

    def clear(self) -> None:
        self.__init__()


CACHE = TextureCache()


def _state(image: bpy.types.Image | None) -> tuple | None:
    """What changes when an image's file does; None: only its pixels tell."""
    if image is None or image.is_dirty or image.source != 'FILE' or image.packed_file:
        return None
    path = bpy.path.abspath(image.filepath, library=image.library)
    try:
        found = os.stat(path)
    except OSError:
        return None
    return (path, found.st_mtime_ns, found.st_size, tuple(image.size), image.colorspace_settings.name, image.alpha_mode)


def _read(image: bpy.types.Image | None, use: ImageUse, notices: list[str]) -> tuple[np.ndarray, bool]:
    """(height, width, 4), uint8 or linear float32, straight, rows from the bottom; whether bytes are linear."""
    width, height = image.size if image else (0, 0)
    if image is None or not width * height or image.channels < 1:
        _say(notices, f"image '{image.name}' is missing: drawn pink" if image else "a material has no image chosen: drawn pink")
        return np.float32([[(*PINK, 1.0)]]), True
    if image.source in {'TILED', 'SEQUENCE', 'MOVIE'}:
        _say(notices, f"image '{image.name}': of tiles and movies only what Blender shows first is drawn")
    pixels = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    pixels = _four_channels(pixels.reshape(height, width, image.channels))
    raw = image.is_float or image.colorspace_settings.name != "sRGB"
    return _colored(pixels, image, use, raw)


def _four_channels(pixels: np.ndarray) -> np.ndarray:
    if pixels.shape[2] == 4:
        return pixels
    out = np.ones((*pixels.shape[:2], 4), np.float32)
    out[..., :3] = pixels[..., :3] if pixels.shape[2] == 3 else pixels[..., :1]
    if pixels.shape[2] == 2:
        out[..., 3] = pixels[..., 1]
    return out


def _colored(pixels: np.ndarray, image: bpy.types.Image, use: ImageUse, raw: bool) -> tuple[np.ndarray, bool]:
    if image.alpha_mode == 'NONE':
        pixels[..., 3] = 1.0
    opaque = bool((pixels[..., 3] == 1.0).all())
    own = image.alpha_mode == 'CHANNEL_PACKED'  # the opacity has nothing to do with the colours
    associated = image.is_float and image.alpha_mode != 'STRAIGHT' and not own
    shown = use.alpha != NONE
    if not shown and not image.is_float and not own:  # as Cycles: what is transparent is black, by the bytes' codes
        pixels[..., :3] *= pixels[..., 3:]
        opaque = True
    if opaque or own and not shown or not image.is_float and shown:
        pixels[..., 3] = pixels[..., 3] if shown else 1.0
        if not image.is_float and use.strength == 1.0:
            return _as_byte(pixels), raw
    linear = pixels if raw else np.concatenate((_linear(pixels[..., :3]), pixels[..., 3:]), axis=2)
    if not opaque and associated and shown:
        np.divide(linear[..., :3], linear[..., 3:], out=linear[..., :3], where=linear[..., 3:] > 0.0)
    if not opaque and not associated and not own and not shown:
        linear[..., :3] *= linear[..., 3:]
    linear[..., :3] *= use.strength
    if not shown:
        linear[..., 3] = 1.0
    return np.ascontiguousarray(linear, np.float32), True


def _linear(color: np.ndarray) -> np.ndarray:
    return np.where(color <= 0.04045, color / 12.92, ((np.maximum(color, 0.04045) + 0.055) / 1.055) ** 2.4).astype(np.float32)
