# SPDX-License-Identifier: GPL-3.0-or-later
"""Points that Blender holds: the vertices of a mesh, or a PointCloud. The one place that knows how the two differ.

PointCloud objects can be made of points from Blender 4.5 on. `PointCloud.resize` exists in 5.2 and not in 4.5 and 5.0: there Blender's own
conversion from a mesh makes them.
"""

from __future__ import annotations

import bpy
import numpy as np

TYPES = ('MESH', 'POINTCLOUD')  # of objects that may have points
HAS_CLOUDS = bpy.app.version >= (4, 5, 0)  # whether a PointCloud can be made of points, and edited
RESIZES = hasattr(bpy.types.PointCloud, "resize")
RADIUS, POSITION = "radius", "position"
MOST_SPHERES = 500_000  # of a PointCloud that Blender draws itself
SELECTION = (".select_vert", ".selection")  # attributes that conversion leaves behind

# Display radii are told from those of a file or an artist by the low 12 bits of their floats: these are a checksum of the others. They survive
# deletion, joining and saving; scaling or setting radii ends it.
_SUM_BITS, _SUM_FACTOR = np.uint32(0xFFF), np.uint32(2654435761)

_FILL = 1.4  # of the local spacing, a display radius: spheres of points that lie at random leave no gaps in which outlines would show
_IN_CELL = 16.0  # points of a cell that a spacing is counted in
_COUNTED = 1 << 21  # points, at most, that decide on the size of the cells
_LAYOUTS = {'FLOAT': "value", 'INT': "value", 'INT8': "value", 'BOOLEAN': "value", 'FLOAT_VECTOR': "vector", 'FLOAT_COLOR': "color",
            'BYTE_COLOR': "color_srgb", 'QUATERNION': "value", 'FLOAT2': "vector"}


def may_have_points(obj: bpy.types.Object | None) -> bool:
    return obj is not None and obj.type in TYPES


def is_cloud(obj: bpy.types.Object | None) -> bool:
    """Whether an object is points alone: a PointCloud, a mesh without faces, or the box of a linked file."""
    return may_have_points(obj) and (obj.type == 'POINTCLOUD' or bool(obj.patina.linked_file) or not len(obj.data.polygons))


def holds_points(obj: bpy.types.Object | None) -> bool:
    """Whether an object is points alone, and Blender holds them."""
    return is_cloud(obj) and not obj.patina.linked_file


def count_of(data: bpy.types.ID) -> int:
    return len(data.vertices if isinstance(data, bpy.types.Mesh) else data.points)


def corners(obj: bpy.types.Object) -> list[tuple[float, float, float]]:
    """The corners of an object's bounding box, in its own space. Blender's box of a PointCloud also holds the radii of the points, which
    may be for display alone: theirs is that of the places."""
    count = count_of(obj.data) if obj.type == 'POINTCLOUD' else 0
    if not count or POSITION not in obj.data.attributes:
        return [tuple(corner) for corner in obj.bound_box]
    places = np.empty(3 * count, np.float32)
    obj.data.attributes[POSITION].data.foreach_get("vector", places)
    places = places.reshape(-1, 3)
    places = places[np.isfinite(places).all(axis=1)]
    if not len(places):
        return [tuple(corner) for corner in obj.bound_box]
    box = places.min(axis=0).tolist(), places.max(axis=0).tolist()
    return [(box[i & 1][0], box[i >> 1 & 1][1], box[i >> 2][2]) for i in range(8)]


def changed(data: bpy.types.ID) -> None:
    """Has Blender draw and evaluate the data anew."""
    if isinstance(data, bpy.types.Mesh):
        data.update()
    else:
        data.update_tag()


def writable(data: bpy.types.ID, name: str, kind: str) -> bpy.types.Attribute:
    """The point attribute of that type with a value for each point: a new one where the name is free, or belongs to another domain or
    type. Blender 5.2 may store one value for all points: such an attribute is made anew, with that value."""
    count, known = count_of(data), data.attributes.get(name)
    if known and (known.domain, known.data_type) != ('POINT', kind):
        data.attributes.remove(known)
        known = None
    if known and len(known.data) == count:
        return known
    one = None
    if known:
        one = getattr(known.data[0], _LAYOUTS[kind]) if len(known.data) and kind in _LAYOUTS else None
        one = None if one is None else np.array(one).reshape(-1)
        data.attributes.remove(known)
    found = data.attributes.new(name, kind, 'POINT')
    if one is not None and len(found.data) == count:
        found.data.foreach_set(_LAYOUTS[kind], np.tile(one, count))
    return data.attributes[name]


# ---- making ----------------------------------------------------------------------------------------------------------


def new(name: str, positions: np.ndarray, cloud: bool) -> bpy.types.ID:
    """A PointCloud or a mesh of these positions, (n, 3) float32. Where this Blender makes PointClouds of meshes alone, a mesh:
    see finished()."""
    if cloud and RESIZES:
        data = bpy.data.pointclouds.new(name)
        data.resize(len(positions))
        if len(positions):
            data.attributes[POSITION].data.foreach_set("vector", positions.reshape(-1))
        return data
    data = bpy.data.meshes.new(name)
    data.vertices.add(len(positions))
    data.vertices.foreach_set("co", positions.reshape(-1))
    return data


def finished(data: bpy.types.ID, cloud: bool) -> bpy.types.ID:
    """What new() made, once it has its attributes, as the kind that was asked for."""
    drop_selection(data)
    changed(data)
    if not cloud or isinstance(data, bpy.types.PointCloud):
        return data
    obj, properties = bpy.data.objects.new(data.name, data), dict(data.items())
    name, data.name = data.name, f"{data.name} mesh"
    bpy.context.scene.collection.objects.link(obj)
    try:
        convert([obj], 'POINTCLOUD')
        made = obj.data
    finally:
        bpy.data.objects.remove(obj)
    if isinstance(made, bpy.types.PointCloud):
        for key, value in properties.items():
            made[key] = value
        made.name = name
        if not data.users:
            bpy.data.meshes.remove(data)
        drop_selection(made)
        return made
    data.name = name
    return data  # Blender refused: the points are there all the same


def select_alone(context: bpy.types.Context, obj: bpy.types.Object) -> None:
    """Selects an object of the view layer and nothing else, and makes it active."""
    for other in context.selected_objects:
        other.select_set(False)
    obj.select_set(True)
    context.view_layer.objects.active = obj


def convert(objects: list[bpy.types.Object], kind: str) -> None:
    """Blender's own conversion of objects in the view layer, which are selected for it and nothing else. What was selected is again."""
    layer = bpy.context.view_layer
    layer.update()
    before, active = [obj for obj in layer.objects if obj and obj.select_get()], layer.objects.active
    for obj in before:
        obj.select_set(False)
    for obj in objects:
        obj.select_set(True)
    layer.objects.active = objects[0]
    try:
        bpy.ops.object.convert(target=kind)
    finally:
        for obj in objects:
            obj.select_set(False)
        for obj in before:
            obj.select_set(True)
        layer.objects.active = active


def drop_selection(data: bpy.types.ID) -> None:
    """Blender selects new points with a byte each, and some versions copy it."""
    for name in SELECTION:
        found = data.attributes.get(name)
        if found:
            data.attributes.remove(found)


# ---- radii that only Blender's own shading takes -----------------------------------------------------------------------


def add_display_radii(data: bpy.types.ID, positions: np.ndarray) -> None:
    """Gives a PointCloud without radii such as show it in Solid shading: spheres that fill the local spacing."""
    if isinstance(data, bpy.types.PointCloud) and RADIUS not in data.attributes and len(positions):
        radii = np.float32(_FILL) * local_spacing(positions)
        writable(data, RADIUS, 'FLOAT').data.foreach_set("value", marked(radii))


def spare_spheres(obj: bpy.types.Object) -> None:
    """Has Blender draw the box of a PointCloud of many points instead of a sphere for each: it draws them all for its overlays, over each
    engine's image too. A million points in Blender 5.2, overlays on: 3.7 s of the processor a redraw in software, 0.14 s with the box."""
    if obj.type == 'POINTCLOUD' and count_of(obj.data) > MOST_SPHERES and obj.display_type == 'TEXTURED':
        obj.display_type = 'BOUNDS'


def shows_spheres(obj: bpy.types.Object) -> bool:
    """Whether Blender draws a PointCloud as more than its box. In Edit Mode it draws the points."""
    return obj.display_type not in {'BOUNDS', 'WIRE'} or obj.mode == 'EDIT'


def drop_display_radii(data: bpy.types.ID) -> None:
    """Takes those away again, and leaves radii of a file or an artist."""
    if are_for_display(data):
        data.attributes.remove(data.attributes[RADIUS])


def marked(radii: np.ndarray) -> np.ndarray:
    """Off by 0.1 % at most."""
    bits = np.ascontiguousarray(radii, np.float32).view(np.uint32)
    return (bits & ~_SUM_BITS | _checksum(bits)).view(np.float32)


def _checksum(bits: np.ndarray) -> np.ndarray:
    return (bits >> np.uint32(12)) * _SUM_FACTOR >> np.uint32(20)


def are_for_display(data: bpy.types.ID) -> bool:
    """Whether all radii of points are those that add_display_radii gave."""
    found = data.attributes.get(RADIUS)
    if found is None or found.data_type != 'FLOAT' or not len(found.data):
        return False
    values = np.empty(len(found.data), np.float32)
    found.data.foreach_get("value", values)
    bits = values.view(np.uint32)
    return bool((bits & _SUM_BITS == _checksum(bits)).all())


def local_spacing(positions: np.ndarray) -> np.ndarray:
    """(n,) float32: about how far apart the points of a surface lie around each, by how many share a cell of a grid."""
    finite = np.isfinite(positions).all(axis=1)
    if not finite.any():
        return np.ones(len(positions), np.float32)
    lower, upper = positions[finite].min(axis=0), positions[finite].max(axis=0)
    extent = float((upper - lower).max())
    if extent <= 0.0:
        return np.full(len(positions), 0.01, np.float32)
    few = positions[finite][::-(-int(finite.sum()) // _COUNTED)]
    cell = extent / max(np.sqrt(len(few) / _IN_CELL), 1.0)
    for _ in range(2):  # a square times how many cells of it are taken is the area
        cells, size = _cells(few, lower, cell)
        taken = np.count_nonzero(np.bincount(cells, minlength=size))
        cell = min(cell * float(np.sqrt(_IN_CELL * taken / len(few))), extent)
    cell *= float(np.sqrt(len(few) / finite.sum()))
    most = np.ones(len(positions), np.float32)
    for shift in (0.0, 0.5):  # a cell at the edge of a surface, or cut by it, holds few: one of another grid may not
        cells, size = _cells(positions, lower - np.float32(shift * cell), cell)
        np.maximum(most, np.bincount(cells, minlength=size)[cells], out=most, casting='unsafe')
    return np.float32(cell) / np.sqrt(most)


def _cells(positions: np.ndarray, lower: np.ndarray, cell: float) -> tuple[np.ndarray, int]:
    """(n,) int64, a number for the cell of each, below the second value. Few cells share a number: there are 32 times as many."""
    with np.errstate(invalid='ignore'):
        index = np.nan_to_num((positions - lower) * np.float32(1.0 / cell), posinf=0.0, neginf=0.0).astype(np.int64).astype(np.uint64)
    bits = np.uint64(max(len(positions) - 1, 1).bit_length() + 1)
    mixed = (index[:, 0] * np.uint64(73856093) ^ index[:, 1] * np.uint64(19349663) ^ index[:, 2] * np.uint64(83492791)) * np.uint64(0x9E3779B97F4A7C15)
    return (mixed >> (np.uint64(64) - bits)).astype(np.int64), 1 << int(bits)


# ---- colors in Blender's own shading -----------------------------------------------------------------------------------


def color_material(name: str) -> bpy.types.Material:
    """The material that shows a color attribute in Material Preview and in other engines. One for all clouds of a file."""
    for known in bpy.data.materials:
        if known.get("patina_attribute") == name and known.library is None:
            return known
    material = bpy.data.materials.new("Point Colors")
    material["patina_attribute"] = name
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    tree = material.node_tree
    surface = next((node for node in tree.nodes if node.bl_idname == 'ShaderNodeBsdfPrincipled'), None)
    attribute = tree.nodes.new('ShaderNodeAttribute')
    attribute.attribute_name = name
    attribute.location = (-260, 200)
    if surface:
        surface.inputs["Roughness"].default_value = 1.0
        tree.links.new(attribute.outputs["Color"], surface.inputs["Base Color"])
    return material
