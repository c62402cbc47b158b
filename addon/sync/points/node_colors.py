# SPDX-License-Identifier: GPL-3.0-or-later
"""Colors and opacities of points that the node trees of their materials give."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator

import bpy
import numpy as np

from . import attributes, point_nodes, splats
from .point_nodes import NORMAL, POSITION, PointReader

BLOCK = 1 << 16  # points evaluated together: what nodes hold of them stays in the processor's cache
MOST_KEPT = 1 << 28  # bytes of evaluated colors that are kept for the next frame

# shader node → the input that is the color
_SHADERS = {'BSDF_PRINCIPLED': "Base Color", 'BSDF_DIFFUSE': "Color", 'EMISSION': "Color"}
_INNER = {'GROUP', 'MIX_SHADER', 'ADD_SHADER'}
_WHITE = (0.8, 0.8, 0.8)  # of points without a material
_AS_LINEAR = np.array([s / 12.92 if s <= 0.04045 else ((s + 0.055) / 1.055) ** 2.4 for s in np.arange(256) / 255], np.float32)

_kept: dict[bytes, tuple[np.ndarray, np.ndarray | None]] = {}  # by digest of all that they depend on, least recently used first


def forget() -> None:
    _kept.clear()


# ---- which materials count -----------------------------------------------------------------------------------------------


def materials_of(obj: bpy.types.Object) -> list[bpy.types.Material | None]:
    """Of the points, by their material index. Geometry Nodes may have set others than the object's slots have."""
    found, slots = list(getattr(obj.data, "materials", ())), obj.material_slots
    return [slot.material for slot in slots] if len(slots) == len(found) or not found else found


def used(obj: bpy.types.Object) -> bool:
    """Whether the points take their colors from the nodes of their materials: the user chose it, or the points have no color and a base
    color is linked. Reads names and links only."""
    group = obj.patina.colors
    if obj.patina.linked_file or group.source not in {'OWN', 'MATERIAL'} or getattr(obj.data, "polygons", None):
        return False
    if group.source == 'MATERIAL':
        return any(map(_has_nodes, materials_of(obj)))
    if obj.patina.color_attribute or splats.are(obj.data) or not any(map(is_linked, materials_of(obj))):
        return False
    return not attributes.have_colors(obj.data)


def is_linked(material: bpy.types.Material | None) -> bool:
    """Whether nodes give the color of the shader that the output shows."""
    node = _shader(material)
    if node is None or node.type in _INNER:
        return node is not None
    return any(not link.is_muted for link in node.inputs[_SHADERS[node.type]].links)


def is_emission(obj: bpy.types.Object) -> bool:
    """Whether the first shader of the points shines, so that light does not change its color."""
    node = next(filter(None, map(_shader, materials_of(obj))), None)
    return node is not None and node.type == 'EMISSION'


def identity(obj: bpy.types.Object) -> tuple:
    """What distinguishes clouds that share their data: their materials, and where they are if nodes use it. Empty: no nodes are used."""
    if not used(obj):
        return ()
    found = [material for material in materials_of(obj) if material]
    nodes = [node for material in found if _has_nodes(material) for node in _all_nodes(material.node_tree)]
    others = [node.object for node in nodes if node.type == 'TEX_COORD' and node.object]
    placed = [obj, *others] if others or any(node.type == 'NEW_GEOMETRY' for node in nodes) else []
    return (*(material.name_full for material in found), *(tuple(map(tuple, one.matrix_world)) for one in placed))


def images_of(obj: bpy.types.Object) -> list[bpy.types.Image]:
    """That nodes of the points' materials use."""
    if not used(obj):
        return []
    return [node.image for material in materials_of(obj) if _has_nodes(material) for node in _all_nodes(material.node_tree)
            if node.type in {'TEX_IMAGE', 'TEX_ENVIRONMENT'} and node.image]


def _all_nodes(tree: bpy.types.NodeTree, depth: int = 0) -> Iterator[bpy.types.Node]:
    for node in tree.nodes:
        yield node
        if node.type == 'GROUP' and node.node_tree and depth < 20:
            yield from _all_nodes(node.node_tree, depth + 1)


def _has_nodes(material: bpy.types.Material | None) -> bool:
    return material is not None and material.node_tree is not None and (bpy.app.version >= (5, 0, 0) or material.use_nodes)


def _output(material: bpy.types.Material) -> bpy.types.NodeSocket | None:
    output = material.node_tree.get_output_node('ALL') or material.node_tree.get_output_node('CYCLES')
    return output.inputs["Surface"] if output else None


def _shader(material: bpy.types.Material | None) -> bpy.types.Node | None:
    """The node that the output shows; None if it is no shader whose color can be evaluated."""
    socket = _output(material) if _has_nodes(material) else None
    for _ in range(100):
        links = [link for link in socket.links if not link.is_muted] if socket else []
        if not links:
            return None
        node = links[0].from_node
        if node.type != 'REROUTE':
            return node if node.type in _SHADERS or node.type in _INNER else None
        socket = node.inputs[0]
    return None


# ---- evaluation ----------------------------------------------------------------------------------------------------------


class _Columns:
    """Arrays of an object's points, read when a node uses them."""

    def __init__(self, data: bpy.types.ID, positions: np.ndarray, normals: np.ndarray | None) -> None:
        self._data, self._count = data, len(positions)
        self._positions, self._normals = positions, normals
        self.found: dict[str, np.ndarray | None] = {}

    def obtain(self, name: str) -> str:
        """Its number of components as text; empty: there is no such attribute."""
        if name not in self.found:
            self.found[name] = self._read(name)
        return "" if self.found[name] is None else str(self.found[name].shape[1])

    def _read(self, name: str) -> np.ndarray | None:
        if name in {POSITION, "position"}:
            return self._positions
        if name == NORMAL:
            return self._normals
        rgba = attributes.color_column(self._data, self._count, name)
        if rgba is not None and rgba.dtype == np.uint8:
            return np.concatenate((_AS_LINEAR[rgba[:, :3]], rgba[:, 3:] * np.float32(1 / 255)), 1)
        if rgba is not None:
            return rgba
        for width in (3, 2, 4):
            values = attributes.numbers(self._data, self._count, name, width)
            if values is not None:
                return values
        return attributes.scalars(self._data, self._count, name)


def read(obj: bpy.types.Object, data: bpy.types.ID, positions: np.ndarray, normals: np.ndarray | None, notices: list[str],
         pause: Callable[[], None]) -> tuple[np.ndarray, np.ndarray | None]:
    """Linear colors (n, 3), and opacities (n, 1) if a material has some, float32. Adds to notices what cannot be evaluated."""
    count, materials = len(positions), materials_of(obj)
    index = attributes.scalars(data, count, "material_index") if len(materials) > 1 else None
    numbers = np.zeros(count, np.int64) if index is None else np.clip(index[:, 0].astype(np.int64), 0, len(materials) - 1)
    present = [0] if index is None else np.unique(numbers).tolist()
    columns = _Columns(data, positions, normals)
    parts = [_of_material(obj, data, materials[number], columns, None if len(present) == 1 else numbers == number, notices, pause)
             for number in present]
    if len(parts) == 1:
        return parts[0]
    colors, opacities = np.empty((count, 3), np.float32), np.ones((count, 1), np.float32)
    for number, (color, opacity) in zip(present, parts):
        colors[numbers == number] = color
        opacities[numbers == number] = 1.0 if opacity is None else opacity
    return colors, opacities if any(opacity is not None for _, opacity in parts) else None


def reader_of(obj: bpy.types.Object, data: bpy.types.ID, columns: _Columns) -> PointReader:
    finite = columns._positions[np.isfinite(columns._positions).all(1)]
    box = (finite.min(0), finite.max(0)) if len(finite) else (np.zeros(3), np.ones(3))
    return PointReader(obtain=columns.obtain, to_world=np.array(obj.matrix_world), box=box, colors=attributes.color_name(data))


def _of_material(obj: bpy.types.Object, data: bpy.types.ID, material: bpy.types.Material | None, columns: _Columns,
                 part: np.ndarray | None, notices: list[str], pause: Callable[[], None]) -> tuple[np.ndarray, np.ndarray | None]:
    """Of all points, or of a part (n,) bool."""
    count = len(columns._positions) if part is None else int(part.sum())
    if not _has_nodes(material):
        return np.full((count, 3), material.diffuse_color[:3] if material else _WHITE, np.float32), None
    reader = reader_of(obj, data, columns)
    socket = _output(material)
    expression = reader.value(socket) if socket else point_nodes.constant(*_WHITE)
    if expression is None or socket and not socket.is_linked:
        expression = point_nodes.constant(*_WHITE)
    _say(notices, notice(material, reader.unknown))
    for name in reader.missing:
        _say(notices, f"Material '{material.name}': '{obj.name}' has no point attribute '{name}'. It counts as black.")
    for image in reader.images:
        if image.lost:
            _say(notices, f"Material '{material.name}': the image '{image.name}' cannot be read. Its points are pink.")
    taken = {name: values if part is None else values[part] for name, values in columns.found.items() if values is not None
             and any(name == key[0] for key in reader.key if key)}
    digest = _digest(reader.key, taken, count)
    if digest not in _kept:
        found = point_nodes.evaluate(expression, reader.opacity, taken, count, BLOCK, pause)
        if found[0].nbytes > MOST_KEPT:
            return found
        _kept[digest] = found
        while sum(colors.nbytes for colors, _ in _kept.values()) > MOST_KEPT:
            del _kept[next(iter(_kept))]
    _kept[digest] = _kept.pop(digest)
    return _kept[digest]


def _digest(key: list, columns: dict[str, np.ndarray], count: int) -> bytes:
    made = hashlib.blake2b(repr((count, key)).encode(), digest_size=16)
    for name, values in sorted(columns.items()):
        made.update(name.encode())
        made.update(np.ascontiguousarray(values))
    return made.digest()


def notice(material: bpy.types.Material, unknown: list[str]) -> str:
    """Names the nodes that cannot be evaluated; empty: all can be."""
    if not unknown:
        return ""
    if len(unknown) == 1:
        return f"Material '{material.name}': the node {unknown[0]} cannot be evaluated per point. Its default color is used."
    names = f"{', '.join(unknown[:-1])} and {unknown[-1]}"
    return f"Material '{material.name}': the nodes {names} cannot be evaluated per point. Their default colors are used."


def unknown_of(obj: bpy.types.Object, material: bpy.types.Material) -> str:
    """The notice for a material's panel, without reading points."""
    socket = _output(material) if _has_nodes(material) else None
    if socket is None or obj is None or not used(obj):
        return ""
    names = {item.name for item in obj.data.attributes if item.domain == 'POINT'} | {POSITION, "position"}
    if any(name in names for name in attributes.NORMAL_NAMES):
        names.add(NORMAL)
    reader = PointReader(obtain=lambda name: "3" if name in names else "", reads_images=False, colors=attributes.color_name(obj.data))
    reader.value(socket)
    return notice(material, reader.unknown)


def _say(notices: list[str], text: str) -> None:
    if text and text not in notices:
        notices.append(text)
