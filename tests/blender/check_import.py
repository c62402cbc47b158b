# SPDX-License-Identifier: GPL-3.0-or-later
"""The PLY operator keeps what the file holds: positions, colours, normals, scalars, float64 origin."""

import bpy
import numpy as np
from harness import SCRATCH, check, check_close, drawn, linear, new_scene, points_of, render

COUNT = 500


def write_ply(name, columns, text=False, header_count=None):
    """A PLY file of (name, numpy type, values) columns; returns its path."""
    types = {"f4": "float", "f8": "double", "u1": "uchar", "u2": "ushort", "i4": "int"}
    rows = np.zeros(len(columns[0][2]), np.dtype([(column, "<" + kind) for column, kind, _ in columns]))
    for column, _, values in columns:
        rows[column] = values
    lines = ["ply", f"format {'ascii' if text else 'binary_little_endian'} 1.0",
             f"element vertex {header_count or len(rows)}"]
    lines += [f"property {types[kind]} {column}" for column, kind, _ in columns] + ["end_header", ""]
    path = SCRATCH / name
    body = ("\n".join(" ".join(repr(value) for value in row.tolist()) for row in rows) + "\n").encode() if text \
        else rows.tobytes()
    path.write_bytes("\n".join(lines).encode() + body)
    return path


def columns(offset=(0, 0, 0), kind="f4", seed=0):
    rng = np.random.default_rng(seed)
    positions = rng.uniform(-1, 1, (COUNT, 3)) + offset
    normals = rng.normal(size=(COUNT, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    data = [(axis, kind, positions[:, i]) for i, axis in enumerate("xyz")]
    data += [(f"n{axis}", "f4", normals[:, i]) for i, axis in enumerate("xyz")]
    data += [(channel, "u1", rng.integers(0, 256, COUNT)) for channel in ("red", "green", "blue")]
    data += [("intensity", "f4", rng.uniform(0, 1, COUNT)), ("class", "u1", rng.integers(0, 20, COUNT))]
    return data


def values(data, *names):
    table = {name: column for name, _, column in data}
    return np.stack([np.asarray(table[name], np.float64) for name in names], 1)


def import_ply(*paths, **options):
    """Imports and returns the new objects, but for the stations."""
    before = set(bpy.data.objects)
    if len(paths) == 1:
        bpy.ops.import_scene.patina_points(filepath=str(paths[0]), **options)
    else:
        bpy.ops.import_scene.patina_points(directory=str(paths[0].parent), files=[{"name": path.name} for path in paths],
                                        **options)
    return sorted((obj for obj in set(bpy.data.objects) - before if obj.type != 'EMPTY'), key=lambda obj: obj.name)


def positions_of(obj):
    bpy.context.view_layer.update()
    flat = points_of(obj).reshape(-1)
    return flat.reshape(-1, 3).astype(np.float64) + np.array(obj.matrix_world.translation)


def attribute_of(obj, name, key, components=1):
    attribute = obj.data.attributes[name]
    flat = np.empty(len(attribute.data) * components, np.float32)
    attribute.data.foreach_get(key, flat)
    return flat.reshape(-1, components)


def check_attributes(obj, data):
    color = obj.data.attributes["Col"]
    check((color.data_type, color.domain) == ('BYTE_COLOR', 'POINT'), "8-bit colours stay 8-bit")
    rgb = attribute_of(obj, "Col", "color_srgb", 4)
    check(np.array_equal(np.rint(rgb[:, :3] * 255), values(data, "red", "green", "blue")), "colours")
    check((rgb[:, 3] == 1).all(), "alpha of files without one")
    if obj.type == 'MESH':  # a PointCloud has none that is active
        check(obj.data.color_attributes.active_color.name == "Col", "active colour")
    check_close(attribute_of(obj, "Normal", "vector", 3), values(data, "nx", "ny", "nz"), 1e-6, "normals")
    check_close(attribute_of(obj, "intensity", "value"), values(data, "intensity"), 1e-7, "intensity")
    check_close(attribute_of(obj, "class", "value"), values(data, "class"), 0, "class")


def test_binary():
    new_scene()
    data = columns()
    obj, = import_ply(write_ply("statue.ply", data))
    check(obj.name == "statue" and obj.select_get() and bpy.context.view_layer.objects.active == obj, "its object")
    check_close(positions_of(obj), values(data, "x", "y", "z"), 1e-7, "positions")
    check(list(obj["patina_origin"]) == [0, 0, 0] and obj.patina.lighting == 'AUTO', "its origin and lighting")
    check_attributes(obj, data)


def test_ascii():
    new_scene()
    data = columns(seed=1)
    obj, = import_ply(write_ply("text.ply", data, text=True))
    check_close(positions_of(obj), values(data, "x", "y", "z"), 1e-6, "positions")
    check_attributes(obj, data)


def test_origin():
    """UTM coordinates with millimetres: object near zero, origin in float64, sum exact to float32 of the extent."""
    scene = new_scene()
    data = columns((485432.125, 5428765.5, 312.25), "f8")
    obj, = import_ply(write_ply("utm.ply", data))
    origin = obj["patina_origin"]
    check(origin.typecode == 'd' and scene["patina_origin"].typecode == 'd', "origins are float64")
    check(list(origin) == list(scene["patina_origin"]), "scene and object agree")
    check(np.abs(positions_of(obj)).max() < 2000, "the object is near zero")
    check_close(positions_of(obj) + np.array(origin), values(data, "x", "y", "z"), 1e-4, "world positions")
    check_attributes(obj, data)


def test_several_files_share_an_origin():
    scene = new_scene()
    first = columns((485432.0, 5428765.0, 312.0), "f8", 2)
    second = columns((485532.5, 5428700.0, 300.0), "f8", 3)
    objects = import_ply(write_ply("a.ply", first), write_ply("b.ply", second))
    check([obj.name for obj in objects] == ["a", "b"], f"{objects}")
    third = columns((485300.0, 5428800.0, 320.0), "f8", 4)
    objects += import_ply(write_ply("c.ply", third))
    origin = np.array(scene["patina_origin"])
    for obj, data in zip(objects, (first, second, third)):
        check_close(positions_of(obj) + origin, values(data, "x", "y", "z"), 1e-3, f"place of {obj.name}")


def test_own_origin():
    scene = new_scene()
    obj, = import_ply(write_ply("own.ply", columns((485432.0, 5428765.0, 312.0), "f8")), origin='OWN')
    check(tuple(obj.location) == (0, 0, 0) and "patina_origin" not in scene, "left near zero")
    check(any(obj["patina_origin"]), "but remembers its origin")


def test_float_colors():
    new_scene()
    data = columns()[:3] + [(channel, "f4", np.linspace(0, 1, COUNT)) for channel in ("red", "green", "blue")]
    obj, = import_ply(write_ply("float.ply", data))
    check(obj.data.attributes["Col"].data_type == 'FLOAT_COLOR', "float colours stay float")
    check_close(attribute_of(obj, "Col", "color", 4)[:, 1], np.linspace(0, 1, COUNT), 1e-6, "linear colours")


def test_sixteen_bit_colors():
    new_scene()
    ramp = np.arange(COUNT) * 131
    data = columns()[:3] + [(channel, "u2", ramp) for channel in ("red", "green", "blue")]
    obj, = import_ply(write_ply("deep.ply", data))
    check_close(attribute_of(obj, "Col", "color", 4)[:, 2], linear(ramp / 257), 1e-5, "16-bit colours")


def test_bare_positions():
    new_scene()
    data = columns()[:3]
    obj, = import_ply(write_ply("bare.ply", data))
    check("Col" not in obj.data.attributes and "Normal" not in obj.data.attributes, "no invented attributes")


def test_awkward_scalar_names():
    """Names that Blender reserves (by version) or that clash survive under another name."""
    new_scene()
    names = ("id", "normal", "Col", "radius", "crease", "position", ".select_vert")
    data = columns()[:3] + [(name, "f4", np.full(COUNT, index + 1)) for index, name in enumerate(names)]
    obj, = import_ply(write_ply("names.ply", data))
    for index, name in enumerate(names):
        found = [attribute for attribute in (name, f"file_{name}") if attribute in obj.data.attributes
                 and obj.data.attributes[attribute].data_type == 'FLOAT'
                 and (attribute_of(obj, attribute, "value") == index + 1).all()]
        check(found, f"scalar '{name}' is lost among {list(obj.data.attributes.keys())}")
    check_close(positions_of(obj), values(data, "x", "y", "z"), 1e-7, "positions")


def test_broken_files():
    new_scene()
    truncated = write_ply("truncated.ply", columns())
    truncated.write_bytes(truncated.read_bytes()[:-1000])
    for path, part in ((truncated, "truncated.ply"), (SCRATCH / "absent.ply", "absent.ply"),
                       (write_ply("lying.ply", columns(), header_count=10 ** 18), "lying.ply")):
        try:
            import_ply(path)
        except RuntimeError as error:
            check(part in str(error) and "Traceback" not in str(error), str(error))
        else:
            check(False, f"{part} was imported")
    check(not bpy.data.meshes, "meshes of broken files")


def test_import_then_render():
    scene = new_scene()
    obj, = import_ply(write_ply("drawn.ply", columns()))
    obj.location.z = -4
    check(len(drawn(render())) > 100, "imported points drawn")
    check("Patina" not in scene.name, "scene untouched")
