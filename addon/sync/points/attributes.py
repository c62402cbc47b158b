# SPDX-License-Identifier: GPL-3.0-or-later
"""Point attributes of meshes and point clouds → numpy arrays in the layouts that the library takes."""

from __future__ import annotations

import contextlib
import ctypes
from collections.abc import Callable, Iterator

import bpy
import numpy as np

from ... import point_data

# Names looked for, in this order, when the artist names none.
NORMAL_NAMES = ("normal", "Normal", "normals", "Normals", "nor", "N")
CLASS_NAMES = ("class", "classification", "Classification", "scalar_Classification", "scalar_classification")
INTENSITY_NAMES = ("intensity", "reflectance", "amplitude", "grey", "gray", "scalar_intensity")  # whatever their case
HEIGHT_NAME = "height_above_ground"
COLOR_NAMES = ("Col", "Color", "color", "Cd", "rgb", "RGB")

BLOCK = 1 << 19  # points between two looks at what the artist wants

# data_type → property of an element, components
_LAYOUTS = {'FLOAT': ("value", 1), 'BOOLEAN': ("value", 1), 'FLOAT_VECTOR': ("vector", 3), 'FLOAT_COLOR': ("color", 4),
            'BYTE_COLOR': ("color_srgb", 4), 'INT': ("value", 1), 'INT8': ("value", 1), 'QUATERNION': ("value", 4),
            'FLOAT2': ("vector", 2), 'FLOAT4': ("vector", 4)}  # the last from Blender 5.2 on
_NUMBERS = {'FLOAT', 'INT', 'INT8', 'BOOLEAN'}
# data_type → element, components, what Blender shows of one
_BYTES = {'BYTE_COLOR': (np.uint8, 4, lambda item: np.rint(np.float32(255) * np.array(item.color_srgb, np.float32))),
          'INT8': (np.int8, 1, lambda item: [item.value])}


def finish_edits(obj: bpy.types.Object) -> None:
    """Has an evaluated object's points and faces counted rightly: in Edit Mode Blender keeps a mesh in another structure, and
    its arrays are empty until somebody asked for a copy."""
    if _edited(obj) and not len(obj.data.vertices):
        obj.to_mesh()
        obj.to_mesh_clear()


@contextlib.contextmanager
def readable(obj: bpy.types.Object) -> Iterator[bpy.types.ID]:
    """An evaluated object's data to read points, faces and attributes from: of one in Edit Mode a copy, for the attributes of
    its own data are the edited ones, which cannot be read. Holds within the `with`."""
    if not _edited(obj):
        yield obj.data
        return
    try:
        yield obj.to_mesh()
    finally:
        obj.to_mesh_clear()


def _edited(obj: bpy.types.Object) -> bool:
    return obj.type == 'MESH' and obj.data.is_editmode


def positions(data: bpy.types.ID, count: int) -> np.ndarray | None:
    """(count, 3) float32. Blender before 3.5 has no position attribute on meshes."""
    attribute = _find(data, "position", {'FLOAT_VECTOR'})
    if attribute:
        return _values(attribute, count)
    if not isinstance(data, bpy.types.Mesh):
        return None
    values = np.empty(count * 3, np.float32)
    data.vertices.foreach_get("co", values)
    return values.reshape(count, 3)


def normals(data: bpy.types.ID, count: int, name: str) -> np.ndarray | None:
    """(count, 3) float32 of the named attribute, or of the first usual name."""
    for candidate in (name,) if name else NORMAL_NAMES:
        attribute = _find(data, candidate, {'FLOAT_VECTOR'})
        if attribute:
            return _values(attribute, count)
    return None


def colors(data: bpy.types.ID, count: int, name: str, pause: Callable[[], None] = lambda: None) -> np.ndarray | None:
    """Of the named attribute, or of the one Blender would render, or of a usual name.

    Byte colours stay 8-bit sRGB (uint8); float colours are linear. A plain vector counts only when named. Normals of -1 to 1 become
    colors of 0 to 1. pause() is called
    during long steps and may raise.
    """
    if name:
        attribute = _find(data, name, {'FLOAT_VECTOR', 'FLOAT_COLOR', 'BYTE_COLOR'})
    else:
        attribute = next(_color_candidates(data), None)
    if attribute is None:
        return None
    if name in NORMAL_NAMES and attribute.data_type == 'FLOAT_VECTOR':
        values = _values(attribute, count)
        return None if values is None else np.float32(0.5) * values + np.float32(0.5)
    if attribute.data_type != 'BYTE_COLOR':
        return _values(attribute, count)
    values = _in_place(attribute, count, pause)
    return _bytes(_values(attribute, count), pause) if values is None else values


def _in_place(attribute: bpy.types.Attribute, count: int, pause: Callable[[], None] = lambda: None) -> np.ndarray | None:
    """(count, components) of bytes, copied from where Blender keeps them: it hands these out converted only, one after another,
    25 to 60 times slower, and nothing can stop it meanwhile. None for other types, or where they lie in another way."""
    items, kind = attribute.data, attribute.data_type
    if kind not in _BYTES or count < 2 or len(items) != count:
        return None
    number, components, shown = _BYTES[kind]
    begin, size = items[0].as_pointer(), components * count
    if items[count - 1].as_pointer() - begin != size - components:
        return None
    kept = np.frombuffer((ctypes.c_char * size).from_address(begin), number).reshape(count, components)
    if any(not np.array_equal(shown(items[index]), kept[index]) for index in (0, count // 2, count - 1)):
        return None
    out = np.empty((count, components), number)
    for start in range(0, count, BLOCK):
        pause()
        out[start:start + BLOCK] = kept[start:start + BLOCK]
    return out


def _bytes(values: np.ndarray | None, pause: Callable[[], None]) -> np.ndarray | None:
    """Exact: Blender hands out byte / 255. In place, block by block."""
    if values is None:
        return None
    out = np.empty(values.shape, np.uint8)
    for start in range(0, len(values), BLOCK):
        pause()
        block = values[start:start + BLOCK]
        np.rint(np.multiply(block, np.float32(255), out=block), out=block)
        out[start:start + BLOCK] = block
    return out


def opacities(data: bpy.types.ID, count: int, name: str) -> np.ndarray | None:
    """(count, 1) float32 of the named attribute; the alpha of a colour attribute."""
    attribute = _find(data, name, {'FLOAT', 'BOOLEAN', 'FLOAT_COLOR', 'BYTE_COLOR'}) if name else None
    values = _values(attribute, count) if attribute else None
    return None if values is None else np.ascontiguousarray(values[:, -1:])


def colored(rgb: np.ndarray) -> np.ndarray:
    """(count,) bool: whose color is a number, and not black as nothing else in a photograph."""
    return (rgb[:, :3] > 0).any(axis=1) & ~np.isnan(rgb[:, :3]).any(axis=1)


def constant(rgb: np.ndarray) -> np.ndarray | None:
    """(3,): the color that all points share. None: there are several, or no numbers."""
    first = rgb[0, :3] if len(rgb) else None
    if first is None or (rgb[::max(1, len(rgb) // 1000), :3] != first).any() or (rgb[:, :3] != first).any():
        return None
    return first.copy()


def without_uncolored(values: np.ndarray | None, rgb: np.ndarray | None) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Opacities that leave out points without a color, and the colors. Where no point has one, nobody is left out: the cloud has no colors."""
    has = None if rgb is None else colored(rgb)
    if has is None or not has.any():
        return values, None
    return only(values, has), rgb


def only(values: np.ndarray | None, shown: np.ndarray) -> np.ndarray:
    """(count, 1) float32 opacities that leave out all others."""
    column = shown.astype(np.float32).reshape(-1, 1)
    return column if values is None else values * column


def scalars(data: bpy.types.ID, count: int, name: str) -> np.ndarray | None:
    """(count, 1) float32 of the named attribute."""
    attribute = _find(data, name, _NUMBERS) if name else None
    return _values(attribute, count) if attribute else None


def intensity_name(data: bpy.types.ID) -> str:
    """The attribute that holds how bright the scanner saw the points; "": none."""
    names = {attribute.name.lower(): attribute.name for attribute in data.attributes if attribute.data_type in {'FLOAT', 'INT', 'INT8'}}
    return next((names[name] for name in INTENSITY_NAMES if name in names), "")


def numbers(data: bpy.types.ID, count: int, name: str, width: int) -> np.ndarray | None:
    """(count, width) float32 of the named attribute, where it has so many components; of a color its first three."""
    attribute = _find(data, name, set(_LAYOUTS))
    values = _values(attribute, count) if attribute else None
    if values is not None and values.shape[1] == 4 and width == 3 and attribute.data_type != 'QUATERNION':
        values = values[:, :3]
    return values if values is not None and values.shape[1] == width else None


def classes(data: bpy.types.ID, count: int, name: str) -> np.ndarray | None:
    """(count, 1) uint8 of the named attribute, or of the first usual name; 0 for what is no class."""
    for candidate in (name,) if name else CLASS_NAMES:
        values = scalars(data, count, candidate)
        if values is not None:
            return as_classes(values)
    return None


def missing(scene: bpy.types.Scene) -> frozenset[str]:
    """What no cloud of a scene has: "classes", "a height above ground", "an analysis". Empty without clouds. Linked files and modifiers may
    bring classes and heights. Reads names of attributes only."""
    clouds = [obj for obj in scene.objects if point_data.is_cloud(obj)]
    found = {"classes": any(map(_may_have_classes, clouds)),
             "a height above ground": any(obj.patina.linked_file or obj.modifiers or _find(obj.data, HEIGHT_NAME, _NUMBERS) for obj in clouds),
             "an analysis": any(obj.patina.analysis != 'OFF' for obj in clouds)}
    return frozenset(name for name, there in found.items() if clouds and not there)


def _may_have_classes(obj: bpy.types.Object) -> bool:
    if obj.patina.linked_file or obj.modifiers:
        return True
    name = obj.patina.colors.class_attribute
    return any(_find(obj.data, candidate, _NUMBERS) for candidate in ((name,) if name else CLASS_NAMES))


def as_classes(values: np.ndarray) -> np.ndarray:
    return np.where((values >= 0) & (values <= 255), values, 0).astype(np.uint8)


def weights(obj: bpy.types.Object, data: bpy.types.ID, count: int, name: str,
            pause: Callable[[], None] = lambda: None) -> np.ndarray | None:
    """(count, 1) float32 of an evaluated mesh object's vertex group; 0 for vertices that are not in it. pause() is called during
    long steps and may raise."""
    group = obj.vertex_groups.get(name) if name and obj.type == 'MESH' else None
    if group is None:
        return None
    index, values = group.index, np.zeros((count, 1), np.float32)
    for at, vertex in enumerate(data.vertices):
        if at % BLOCK == 0:
            pause()
        for item in vertex.groups:
            if item.group == index:
                values[at] = item.weight
                break
    return values


def color_column(data: bpy.types.ID, count: int, name: str) -> np.ndarray | None:
    """(count, 4) of the named color attribute: uint8 sRGB, or linear float32."""
    return colors(data, count, name) if name and _find(data, name, {'FLOAT_COLOR', 'BYTE_COLOR'}) else None


def color_name(data: bpy.types.ID) -> str:
    """The color attribute that counts if none is named; empty: there is none."""
    found = next(_color_candidates(data), None)
    return found.name if found else ""


def have_colors(data: bpy.types.ID) -> bool:
    return next(_color_candidates(data), None) is not None


def _color_candidates(data: bpy.types.ID) -> Iterator[bpy.types.Attribute]:
    group = data.color_attributes
    for index in (getattr(group, "render_color_index", -1), getattr(group, "active_color_index", -1)):
        if 0 <= index < len(group) and group[index].domain == 'POINT':
            yield group[index]
    for name in (*COLOR_NAMES, *(attribute.name for attribute in group)):
        attribute = _find(data, name, {'FLOAT_COLOR', 'BYTE_COLOR'})
        if attribute:
            yield attribute


def _find(data: bpy.types.ID, name: str, types: set[str]) -> bpy.types.Attribute | None:
    attribute = data.attributes.get(name)
    if attribute and attribute.domain == 'POINT' and attribute.data_type in types:
        return attribute
    return None


def _values(attribute: bpy.types.Attribute, count: int) -> np.ndarray | None:
    """(count, components) float32; None when the attribute does not fit the points."""
    key, components = _LAYOUTS[attribute.data_type]
    length = len(attribute.data)
    if length != count and length != 1:  # Blender 5.2 may store one value for all points
        return None
    kept = _in_place(attribute, count) if attribute.data_type == 'INT8' else None
    if kept is not None:
        return kept.astype(np.float32)
    whole = attribute.data_type in {'INT', 'INT8'}  # Blender converts none on the way
    values = np.empty(length * components, np.int32 if whole else np.float32)
    attribute.data.foreach_get(key, values)
    values = values.astype(np.float32, copy=False)
    values = values.reshape(length, components)
    return values if length == count else np.repeat(values, count, axis=0)
