# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes with faces → their triangles, or points evenly spread on them, with normals and their materials' base colours.

Either way meshes hide points and points hide meshes by the one rule of the picture: who is nearer.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import bpy
import numpy as np

from .. import native
from . import attributes, roles

WHITE = (0.8, 0.8, 0.8, 1.0)

# At the end of an identity: the object's faces are drawn; and may be painted in one color too.
TRIANGLES, BARE = "triangles", "triangles, bare too"

# The additive recurrence of the plastic number: each next point falls into the largest gap of those before it.
_STEP = np.array([0.7548776662466927, 0.5698402909980532])


@dataclass(frozen=True)
class MeshStyle:
    """patina_mesh_style."""

    world_from_object: tuple[float, ...]
    color: tuple[float, float, float]
    shadow_off: int


@dataclass(frozen=True)
class MeshItem:
    mesh: native.Mesh
    style: MeshStyle
    pass_index: int  # of the object
    role: str = roles.SEEN
    name: str = ""  # of the object
    asset: str = ""  # of its topmost parent


class MeshCache:
    """Meshes by the identity of the data they were made from; what the last picture did not use goes."""

    def __init__(self) -> None:
        self._entries: dict[tuple, tuple[bytes, native.Mesh]] = {}

    def obtain(self, identity: tuple, obj: bpy.types.Object) -> native.Mesh | None:
        """Of an evaluated object; None without faces. Content decides whether it is made anew."""
        with attributes.readable(obj) as mesh:
            arrays = triangles(obj, mesh)
        if arrays is None:
            return None
        digest = hashlib.blake2b(digest_size=16)
        for array in arrays:
            digest.update(b"" if array is None else array)
        known, mesh = self._entries.get(identity, (b"", None))
        if known != digest.digest():
            mesh = native.Mesh(*arrays)
            if identity[-1] == BARE and arrays[2] is not None:
                mesh.bare = native.Mesh(*arrays[:2], None)
            self._entries[identity] = (digest.digest(), mesh)
        return mesh

    def trim(self, used: set[tuple]) -> None:
        self._entries = {identity: entry for identity, entry in self._entries.items() if identity in used}

    def clear(self) -> None:
        self._entries = {}


CACHE = MeshCache()


def triangles(obj: bpy.types.Object, mesh: bpy.types.Mesh) -> tuple[np.ndarray, np.ndarray, np.ndarray | None] | None:
    """Positions (3 n, 3), normals (3 n, 3) and linear colours (3 n, 4) of the corners of an evaluated object's n triangles,
    float32; colours only where materials differ. None without faces. mesh: its readable data."""
    mesh.calc_loop_triangles()
    if not len(mesh.loop_triangles):
        return None
    corners = _get(mesh.loop_triangles, "vertices", 3, np.int32).reshape(-1)
    loops = _get(mesh.loop_triangles, "loops", 3, np.int32).reshape(-1)
    positions = _get(mesh.vertices, "co", 3, np.float32)[corners]
    if bpy.app.version >= (4, 1, 0):
        normals = _get(mesh.corner_normals, "vector", 3, np.float32)[loops]
    else:
        mesh.calc_normals_split()
        normals = _get(mesh.loops, "normal", 3, np.float32)[loops]
    palette = _palette(obj)
    colors = None
    if (palette != palette[0]).any():
        materials = _get(mesh.loop_triangles, "material_index", 1, np.int32)
        colors = np.repeat(palette[np.clip(materials, 0, len(palette) - 1)], 3, axis=0)
    return positions, normals, colors


def first_color(obj: bpy.types.Object) -> tuple[float, ...]:
    return tuple(map(float, _palette(obj)[0, :3]))


def _palette(obj: bpy.types.Object) -> np.ndarray:
    return np.array([base_color(slot.material) for slot in obj.material_slots] or [WHITE], np.float32)


def sample(obj: bpy.types.Object, mesh: bpy.types.Mesh, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Positions (n, 3), normals (n, 3) and linear colours (n, 4) of an evaluated object, float32; None without area. mesh: its
    readable data."""
    mesh.calc_loop_triangles()
    corners = _get(mesh.loop_triangles, "vertices", 3, np.int32)
    places = _get(mesh.vertices, "co", 3, np.float32)
    a, b, c = (places[corners[:, k]].astype(np.float64) for k in range(3))
    cross = np.cross(b - a, c - a)
    double_area = np.linalg.norm(cross, axis=1)
    total = double_area.sum()
    if not total > 0.0 or not np.isfinite(total):
        return None
    ends = np.cumsum(double_area)
    # points are dealt out along the list of triangles by area, so that each gets its share to within one
    triangle = np.minimum(np.searchsorted(ends, (np.arange(count) + 0.5) * (total / count)), len(ends) - 1)
    u, v = (np.arange(count)[:, None] * _STEP % 1.0).T
    over = u + v > 1.0
    u, v = np.where(over, 1.0 - u, u), np.where(over, 1.0 - v, v)
    weights = np.stack([1.0 - u - v, u, v], 1)
    positions = sum(weights[:, k, None] * corner[triangle] for k, corner in enumerate((a, b, c)))
    normals = cross[triangle] / double_area[triangle, None]
    smooth = _get(mesh.polygons, "use_smooth", 1, bool)[_get(mesh.loop_triangles, "polygon_index", 1, np.int32)][triangle]
    if smooth.any():
        own = _get(mesh.vertices, "normal", 3, np.float32)[corners[triangle[smooth]]]
        normals[smooth] = (weights[smooth, :, None] * own).sum(axis=1)
    materials = _get(mesh.loop_triangles, "material_index", 1, np.int32)[triangle]
    palette = _palette(obj)
    return (positions.astype(np.float32), normals.astype(np.float32),
            palette[np.clip(materials, 0, len(palette) - 1)])


def base_color(material: bpy.types.Material | None) -> tuple[float, ...]:
    """Of the Principled or Diffuse node, else the colour that the Solid viewport shows."""
    if material is None:
        return WHITE
    if material.node_tree and (bpy.app.version >= (5, 0, 0) or material.use_nodes):
        for node in material.node_tree.nodes:
            name = {'BSDF_PRINCIPLED': "Base Color", 'BSDF_DIFFUSE': "Color"}.get(node.type)
            if name and not node.inputs[name].is_linked:
                return tuple(node.inputs[name].default_value)
    return tuple(material.diffuse_color)


def _get(items: bpy.types.bpy_prop_collection, name: str, width: int, kind: type) -> np.ndarray:
    values = np.empty(len(items) * width, kind)
    items.foreach_get(name, values)
    return values.reshape(-1, width) if width > 1 else values
