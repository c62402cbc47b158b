# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes with faces → their triangles, or points evenly spread on them, with normals and their materials' base colours or images.

Either way meshes hide points and points hide meshes by the one rule of the picture: who is nearer.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import bpy
import numpy as np

from ... import native
from ..points import attributes
from . import images

# At the end of an identity: the object's faces are drawn; and may be painted in one color too.
TRIANGLES, BARE = "triangles", "triangles, bare too"

# The additive recurrence of the plastic number: each next point falls into the largest gap of those before it.
_STEP = np.array([0.7548776662466927, 0.5698402909980532])


@dataclass(frozen=True)
class Part:
    """Faces of an object that one colour, colours of their own, or one image covers."""

    mesh: native.Mesh
    surface: images.Surface  # of the first material among them


@dataclass(frozen=True)
class Faces:
    """An object's faces."""

    parts: tuple[Part, ...]
    notices: tuple[str, ...]


class MeshCache:
    """Faces by the identity of the data they were made from; what the last picture did not use goes."""

    def __init__(self) -> None:
        self._entries: dict[tuple, tuple[bytes, Faces]] = {}

    def obtain(self, identity: tuple, obj: bpy.types.Object) -> Faces | None:
        """Of an evaluated object; None without faces. Content decides whether it is made anew."""
        notices: list[str] = []
        with attributes.readable(obj) as mesh:
            found = parts(obj, mesh, notices)
        if found is None:
            return None
        digest = hashlib.blake2b(digest_size=16)
        for arrays, surface in found:
            digest.update(repr(surface).encode())
            for array in arrays:
                digest.update(b"" if array is None else array)
        known, faces = self._entries.get(identity, (b"", None))
        if known != digest.digest():
            faces = Faces(tuple(_part(arrays, surface, identity[-1] == BARE) for arrays, surface in found), tuple(notices))
            self._entries[identity] = (digest.digest(), faces)
        return faces

    def trim(self, used: set[tuple]) -> None:
        self._entries = {identity: entry for identity, entry in self._entries.items() if identity in used}

    def clear(self) -> None:
        self._entries = {}


CACHE = MeshCache()

# positions (3 n, 3), normals (3 n, 3), linear colours (3 n, 4) or None, where on its image (3 n, 2) or None: of the corners of n
# triangles, float32
Arrays = tuple[np.ndarray, np.ndarray, "np.ndarray | None", "np.ndarray | None"]


def _part(arrays: Arrays, surface: images.Surface, bare: bool) -> Part:
    mesh = native.Mesh(*arrays)
    if bare and arrays[2] is not None:
        mesh.bare = native.Mesh(*arrays[:2], None)
    return Part(mesh, surface)


def parts(obj: bpy.types.Object, mesh: bpy.types.Mesh, notices: list[str]) -> list[tuple[Arrays, images.Surface]] | None:
    """The faces of an evaluated object: those of each material with an image or that shines, and all others together, with colours
    where these differ. None without faces. mesh: its readable data."""
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
    surfaces = [images.surface_of(slot.material, notices) for slot in obj.material_slots] or [images.Surface(images.WHITE)]
    materials = np.zeros(len(corners) // 3, np.int32)
    if len(surfaces) > 1:
        materials = np.clip(_get(mesh.loop_triangles, "material_index", 1, np.int32), 0, len(surfaces) - 1)
    apart = {index for index, surface in enumerate(surfaces) if surface.use or surface.unlit}
    plain = [index for index in range(len(surfaces)) if index not in apart]
    found = []
    for group in (plain, *([index] for index in sorted(apart))):
        of_group = np.isin(materials, group)
        if not of_group.any():
            continue
        chosen = np.repeat(of_group, 3)
        surface = surfaces[materials[of_group][0]]
        palette = np.array([one.color for one in surfaces], np.float32)
        colors = uv = None
        if (palette[group] != palette[group[0]]).any():
            colors = np.repeat(palette[materials[of_group]], 3, axis=0)
        if surface.use:
            uv = _uv(obj, mesh, surface.use, loops[chosen], notices)
        if surface.use and uv is None:
            surface = images.Surface(surface.color, surface.unlit)
        found.append(((positions[chosen], normals[chosen], colors, uv), surface))
    return found


def _uv(obj: bpy.types.Object, mesh: bpy.types.Mesh, use: images.ImageUse, loops: np.ndarray, notices: list[str]) -> np.ndarray | None:
    """(n, 2) float32 of these loops; None without such a map."""
    layer = mesh.uv_layers.get(use.uv_map) if use.uv_map else next((one for one in mesh.uv_layers if one.active_render), None)
    if layer is None:
        notices.append(f"'{obj.name}' has no UV map" + f" '{use.uv_map}'" * bool(use.uv_map) + " for its image")
        return None
    items, name = (layer.uv, "vector") if bpy.app.version >= (3, 5, 0) else (layer.data, "uv")
    uv = _get(items, name, 2, np.float32)[loops]
    place = np.float32(use.place).reshape(2, 3)
    return np.ascontiguousarray(uv @ place[:, :2].T + place[:, 2], np.float32)


def names_of(obj: bpy.types.Object) -> tuple[str, ...]:
    """Of an object's materials: objects may share faces and not these."""
    return tuple(slot.material.name_full if slot.material else "" for slot in obj.material_slots)


def base_color(material: bpy.types.Material | None) -> tuple[float, ...]:
    """Linear RGBA; of a material with an image the colour that the Solid viewport shows."""
    return images.surface_of(material, []).color


def _palette(obj: bpy.types.Object) -> np.ndarray:
    return np.array([base_color(slot.material) for slot in obj.material_slots] or [images.WHITE], np.float32)


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


def _get(items: bpy.types.bpy_prop_collection, name: str, width: int, kind: type) -> np.ndarray:
    values = np.empty(len(items) * width, kind)
    items.foreach_get(name, values)
    return values.reshape(-1, width) if width > 1 else values
