# SPDX-License-Identifier: GPL-3.0-or-later
"""Measurements: values and coordinates of a cube that is turned, scaled and far from zero; picking without a window; CSV, DXF, saving, undo."""

import csv
import io
import math
import os
import re
from unittest import mock

import bpy
import numpy as np
from harness import SCRATCH, Skip, add_points, check, check_close, new_scene
from mathutils import Matrix
from patina.description import measures as description
from patina.operators.view_surface import Surface
from patina.read import readers
from patina.sync import measures
from patina.sync.analyses import trust
from patina.sync.points import origin

EDGE, SCALE = 2.0, 1.5
FAR = (5_000_000.125, 5_400_000.25, 312.5)
TURN = Matrix.Rotation(0.5, 4, 'Z')
TOP = "-1 -1 1  1 -1 1  1 1 1  -1 1 1"  # the cube's upper face, in its own space


def cube(steps=41):
    """The faces of a cube of this edge around zero, (n, 3)."""
    line = np.linspace(-EDGE / 2, EDGE / 2, steps)
    grid = np.stack(np.meshgrid(line, line, line), -1).reshape(-1, 3)
    return grid[(np.abs(grid) > EDGE / 2 - 1e-6).any(axis=1)].astype(np.float32)


def scene_of_cube(far=True):
    """Turned, scaled, eight below the camera; its file's zero is far away. (scene, object)"""
    scene = new_scene(200, 160)
    scene.patina.fill = 'CLOSED'
    scene.unit_settings.system, scene.unit_settings.length_unit, scene.unit_settings.scale_length = 'METRIC', 'METERS', 1.0
    scene.unit_settings.system_rotation = 'DEGREES'
    obj = add_points(cube(), name="cube", matrix=Matrix.Translation((0.0, 0.0, -8.0)) @ TURN @ Matrix.Scale(SCALE, 4))
    if far:
        obj[origin.PROPERTY], obj[origin.SHARED] = list(FAR), list(FAR)
    bpy.context.view_layer.objects.active = obj
    bpy.context.view_layer.update()
    return scene, obj


def add(kind, coordinates, space='OBJECT', **more):
    check(bpy.ops.object.patina_add_measurement(kind=kind, coordinates=coordinates, space=space, **more) == {'FINISHED'}, kind)
    obj = bpy.context.object
    return measures.read(obj, obj.patina.measures.active)


def refused(words, call, **arguments):
    try:
        call(**arguments)
    except RuntimeError as error:
        check(re.search(words, str(error)), f"'{error}' does not say '{words}'")
    else:
        raise AssertionError(f"was not refused: {words}")


def path(places):
    return [{"name": "", "loc": place, "time": 0.0} for place in places]


def export(name, **options):
    place = SCRATCH / name
    bpy.ops.export_scene.patina_measurements(filepath=str(place), **options)
    return place


# ---- values ------------------------------------------------------------------------------------------------------------


def test_values_of_a_cube():
    """Against what is known of it: its scale counts, and its turn changes nothing. Matrices are float32."""
    scene, obj = scene_of_cube()
    edge = EDGE * SCALE
    found = add('DISTANCE', "-1 -1 -1 1 -1 -1 1 1 -1 1 1 1")
    check_close(found.values.legs, [edge] * 3, 1e-6, "legs")
    check_close(found.values.value, 3 * edge, 1e-6, "their sum")
    check(measures.value_text(found, scene) == "9.0000 m", measures.value_text(found, scene))
    found = add('HEIGHT', "-1 -1 1  1 1 -1")
    check_close((found.values.value, found.values.horizontal), (edge, edge * math.sqrt(2)), 1e-6, "height")
    found = add('ANGLE', "1 -1 -1  -1 -1 -1  1 1 1")
    check_close(found.values.value, math.acos(1 / math.sqrt(3)), 1e-6, "of an edge and a diagonal")
    check(measures.value_text(found, scene) == "54.74°", measures.value_text(found, scene))
    found = add('AREA', TOP)
    check_close((found.values.value, found.values.perimeter), (edge ** 2, 4 * edge), 2e-6, "area")
    check(measures.value_text(found, scene) == "9.0000 m², perimeter 12.0000 m", measures.value_text(found, scene))
    check(measures.details(found, scene) == [("Area", "9.0000 m²"), ("Perimeter", "12.0000 m")], f"{measures.details(found, scene)}")
    check(measures.details(measures.read(obj, 0), scene)[0] == ("Length", "9.0000 m") and len(measures.details(measures.read(obj, 0), scene)) == 4, "legs")
    # a hook is smaller than the polygon around it; a corner off the plane changes the perimeter, and the area little
    found = add('AREA', "-1 -1 1  1 -1 1  0 0 1  1 1 1  -1 1 1")
    check_close(found.values.value, edge ** 2 * 3 / 4, 2e-6, "a hook")
    check([entry.name for entry in obj.patina.measures.entries] == ["Distance 1", "Height 1", "Angle 1", "Area 1", "Area 2"], "names")
    obj.matrix_world = Matrix.Translation((1.0, 2.0, 3.0)) @ Matrix.Rotation(1.0, 4, 'X') @ Matrix.Scale(3.0, 4)
    bpy.context.view_layer.update()
    check_close(measures.read(obj, 0).values.value, 3 * EDGE * 3.0, 1e-5, "it follows its object")
    check(measures.read(obj, 1).values.value != edge, "the height is the world's")


def test_units():
    scene, obj = scene_of_cube()
    found, settings = add('AREA', TOP), scene.unit_settings
    for system, unit, scale, length, area in (('METRIC', 'MILLIMETERS', 1.0, "12000.0 mm", "9000000 mm²"), ('METRIC', 'METERS', 0.5, "6.0000 m", "2.2500 m²"),
                                              ('IMPERIAL', 'FEET', 1.0, "39.3701 ft", "96.8752 ft²"), ('NONE', '', 1.0, "12.0000", "9.0000")):
        settings.system, settings.scale_length = system, scale
        if unit:
            settings.length_unit = unit
        text = measures.value_text(found, scene)
        check(text == f"{area}, perimeter {length}", text)
    settings.system, settings.length_unit = 'METRIC', 'ADAPTIVE'
    check(measures.texts(scene).length(0.25) == "25 cm", measures.texts(scene).length(0.25))
    settings.system_rotation = 'RADIANS'
    check(measures.texts(scene).angle(1.0) == "1.0000 rad", "radians")


def test_coordinates_keep_millimeters():
    """Of points at five million: file, scene and object coordinates are the same points, to a hundredth of a millimeter."""
    scene, obj = scene_of_cube()
    obj.matrix_world = Matrix()  # where its import put it
    bpy.context.view_layer.update()
    found = add('POINT', "5000000.875 5400000.751 312.001", space='FILE')
    check(measures.value_text(found, scene) == "5000000.8750, 5400000.7510, 312.0010", measures.value_text(found, scene))
    check_close(found.points[0], np.subtract((5000000.875, 5400000.751, 312.001), FAR), 1e-8, "scene")
    entry = obj.patina.measures.entries[0]
    check_close(measures.to_file(obj, scene, measures.unpacked(entry.places))[0], (5000000.875, 5400000.751, 312.001), 1e-8, "file")
    scene, obj = scene_of_cube()
    found = add('POINT', "1 1 1")
    turned = SCALE * (math.cos(0.5) - math.sin(0.5)), SCALE * (math.cos(0.5) + math.sin(0.5)), SCALE - 8.0
    check_close(found.points[0], turned, 1e-6, "turned and scaled, scene")
    check_close(measures.to_file(obj, scene, measures.to_local(obj, found.points))[0], np.add(FAR, turned), 1e-6, "and file")


# ---- picking -----------------------------------------------------------------------------------------------------------


def of_face():
    """Pixels of the image of the lower corners' places; the camera looks down on the upper face of the cube, 6.5 away."""
    focal = 200 * 50.0 / 36.0  # pixels
    return lambda x, y: (100 + focal * x / 6.5, 80 + focal * y / 6.5)


def test_picking_snaps_to_points():
    scene, obj = scene_of_cube()
    to_pixel = of_face()
    turned = (TURN @ Matrix.Scale(SCALE, 4)).to_3x3()
    with Surface(bpy.context) as surface:
        for local in ((0.5, 0.25, 1.0), (-0.4, 0.6, 1.0), (0.0, -0.75, 1.0)):
            world = np.array(turned @ Matrix.Translation(local).translation) + (0, 0, -8)
            pixel = np.array(to_pixel(world[0], world[1])) + (0.6, -0.7)
            hit = surface.at(pixel, 12.0)
            check(hit.snapped and hit.name == "cube", f"{hit}")
            check_close(hit.world, world, 2e-6, "the nearest point")
            plain = surface.at(pixel, 0.0)
            check(not plain.snapped, "snapped without being asked")
            check_close(plain.world, world + np.array((0.6, -0.7, 0)) * 6.5 / (200 * 50 / 36), 2e-3, "the surface under the mouse")
        check(surface.at((3.0, 3.0), 12.0) is None, "something where nothing is")
        check(surface.at((-5.0, 500.0), 0.0) is None, "outside")
    scene.camera.data.type, scene.camera.data.ortho_scale = 'ORTHO', 6.0
    bpy.context.view_layer.update()
    with Surface(bpy.context) as surface:
        check_close(surface.at((100.0, 80.0), 0.0).world, (0, 0, -6.5), 2e-3, "orthographic")


def test_operator_by_pixels():
    """Two clicks on the face, without a window and whatever engine draws the scene: the distance of two points, not of two pixels."""
    scene, obj = scene_of_cube()
    scene.render.engine = 'BLENDER_WORKBENCH'
    to_pixel, turned = of_face(), (TURN @ Matrix.Scale(SCALE, 4)).to_3x3()
    pixels = []
    for x, y in ((-0.5, -0.5), (0.5, -0.5)):
        world = turned @ Matrix.Translation((x, y, 1.0)).translation
        pixels.append(to_pixel(world.x, world.y))
    check(bpy.ops.object.patina_measure(kind='DISTANCE', path=path(pixels)) == {'FINISHED'}, "not finished")
    found = measures.read(obj, 0)
    check_close(found.values.value, SCALE, 1e-6, "distance")
    check_close(measures.unpacked(obj.patina.measures.entries[0].places), [(-0.5, -0.5, 1), (0.5, -0.5, 1)], 1e-6, "in the cloud's own space")
    refused("no surface at pixel 2, 3", bpy.ops.object.patina_measure, kind='DISTANCE', path=path([pixels[0], (2.0, 3.0)]))
    refused("at least 2 points, not 1", bpy.ops.object.patina_measure, kind='DISTANCE', path=path(pixels[:1]))
    refused("needs points", bpy.ops.object.patina_measure, kind='DISTANCE', path=[])
    check(len(obj.patina.measures.entries) == 1, "what was refused is kept")
    bpy.data.objects.remove(obj)
    refused("no surface", bpy.ops.object.patina_measure, kind='POINT', path=path(pixels[:1]))


def test_untrusted_points_are_not_snapped_to():
    """Also where the view shows all points: analyzed strays before the wall are drawn then, and the tool goes by them."""
    scene = new_scene(200, 160)
    scene.patina.fill = 'CLOSED'
    side = np.linspace(-2, 2, 161)
    wall = np.stack(np.meshgrid(side, side, [-6.0]), -1).reshape(-1, 3)
    obj = add_points(np.concatenate([wall, [(0.0113, 0.0127, -5.0)]]), name="wall")
    bpy.context.view_layer.objects.active = obj
    bpy.context.view_layer.update()
    cloud = trust.analyzed_cloud(obj, scene)
    check(sum(cloud.trusts[:8]) == 1, f"one stray: {cloud.trusts}")
    stray = np.array((100, 80)) + np.array((0.0113, 0.0127)) / 5.0 * 200 * 50 / 36
    for least, depth in ((-1.0, -6.0), (0.0, -5.0)):  # automatic; all points
        obj.patina.least_trust = least
        bpy.context.view_layer.update()
        with Surface(bpy.context) as surface:
            hit = surface.at(stray, 12.0)
            check(hit and hit.snapped, f"least trust {least}: {hit}")
            check_close(hit.world, (0.025, 0.025, -6.0), 1e-6, "the nearest point of the wall")
            check_close(surface.at(stray, 0.0).world[2], depth, 1e-6, f"least trust {least}: what is shown there")


# ---- bad input ---------------------------------------------------------------------------------------------------------


def test_bad_input():
    scene, obj = scene_of_cube()
    call = bpy.ops.object.patina_add_measurement
    for words, kind, coordinates in (("at least 2 points, not 1", 'DISTANCE', "1 2 3"), ("at least 3 points, not 2", 'AREA', "1 2 3 4 5 6"),
                                     ("not a finite number", 'POINT', "nan 2 3"), ("not a finite number", 'DISTANCE', "1 2 3 inf 0 0"),
                                     ("are numbers", 'POINT', "1 2 three"), ("these are 4 numbers", 'POINT', "1 2 3 4"),
                                     ("these are 0 numbers", 'POINT', ""), ("needs 2 points, not 3", 'HEIGHT', "1 2 3 4 5 6 7 8 9"),
                                     ("three different points", 'ANGLE', "1 2 3 1 2 3 7 8 9")):
        refused(words, call, kind=kind, coordinates=coordinates, space='OBJECT')
    check(not len(obj.patina.measures.entries), "what was refused is kept")
    refused("has no measurements", export, name="none.csv")
    check(not (SCRATCH / "none.csv").exists(), "a file of nothing")
    refused("no measurement to choose", bpy.ops.object.patina_remove_measurement)
    add('DISTANCE', "0 0 0 1 1 1")
    obj.patina.measures.entries[0].places = "broken"
    check(not list(measures.shown(bpy.context.view_layer)), "damaged ones are not drawn")
    refused("Distance 1: Coordinates are numbers", export, name="none.csv")
    obj.patina.measures.entries[0].places = "0 0 0 1 1 1"
    obj.scale = (0.0, 0.0, 0.0)
    bpy.context.view_layer.update()
    refused("scale is 0", export, name="none.csv")
    refused("scale is 0", call, kind='POINT', coordinates="1 2 3", space='SCENE')
    obj.scale = (1.0, 1.0, 1.0)
    bpy.context.view_layer.update()
    refused("cannot be written as .txt", export, name="none.txt")
    refused("does not fit the format DXF", export, name="none.csv", kind='DXF')
    check(not any((SCRATCH / name).exists() for name in ("none.csv", "none.txt", "none.dxf")), "a file is there")


# ---- files -------------------------------------------------------------------------------------------------------------


def all_kinds():
    scene, obj = scene_of_cube()
    obj.matrix_world = Matrix()
    bpy.context.view_layer.update()
    for kind, places in (('DISTANCE', "-1 -1 1 1 -1 1 1 1 1"), ('HEIGHT', "-1 -1 1  1 1 -1"), ('ANGLE', "1 -1 1 -1 -1 1 -1 1 1"), ('AREA', TOP),
                         ('POINT', "0.123 0.25 1")):
        add(kind, places, title="Größe, \"m\"" if kind == 'AREA' else "")
    return scene, obj


def test_table():
    scene, obj = all_kinds()
    place = export("table.csv")
    text = place.read_bytes().decode("utf-8")
    rows = list(csv.DictReader(io.StringIO(text)))
    check([(row["name"], row["kind"], row["object"], row["unit"]) for row in rows] == [
        ("Distance 1", "distance", "cube", "m"), ("Height 1", "height", "cube", "m"), ("Angle 1", "angle", "cube", "deg"),
        ("Größe, \"m\"", "area", "cube", "m2"), ("Point 1", "point", "cube", "")], f"{rows}")
    check_close([float(row["value"]) for row in rows[:4]], (4.0, 2.0, 90.0, 4.0), 1e-12, "values")
    check_close([float(leg) for leg in rows[0]["legs"].split()], (2.0, 2.0), 0.0, "legs")
    check_close((float(rows[1]["horizontal"]), float(rows[3]["perimeter"])), (math.sqrt(8), 8.0), 1e-12, "others")
    point = rows[4]
    check([float(point[f"file_{axis}1"]) for axis in "xyz"] == [FAR[0] + 0.123, FAR[1] + 0.25, FAR[2] + 1.0], "file coordinates to the last bit")
    check([float(point[f"{axis}1"]) for axis in "xyz"] == [0.123, 0.25, 1.0] and not point["x2"], "scene coordinates")
    refused("exists", export, name="table.csv")
    check(place.read_bytes().decode("utf-8") == text, "the file changed")
    obj.patina.measures.entries[0].hide = True
    export("table.csv", overwrite=True)
    check(place.read_bytes().decode("utf-8") == text, "hidden ones are exported too")
    obj.select_set(False)
    refused("No selected object", export, name="other.csv", selected=True)
    check(not list(SCRATCH.glob("*.part")), "half a file is left")


def test_drawing():
    scene, obj = all_kinds()
    lacking = [name for name in readers.missing() if readers.PACKAGES[name] == "DXF"]
    if lacking:
        refused(f"DXF needs the Python package.*{lacking[0]}", export, name="lines.dxf")
        check(not (SCRATCH / "lines.dxf").exists(), "a file is there")
        raise Skip(f"DXF needs {', '.join(lacking)}, which this Python has not")
    with mock.patch.dict(os.environ, {"XDG_CACHE_HOME": str(SCRATCH)}):  # where it keeps which fonts there are
        readers.load("ezdxf")
    import ezdxf
    place = export("lines.dxf")
    document = ezdxf.readfile(place)
    check(document.dxfversion == "AC1032" and not document.audit().has_errors, f"{document.dxfversion}")
    check(document.header["$INSUNITS"] == 6, "meters")
    found = list(document.modelspace())
    check({entity.dxf.layer for entity in found} == {"measure"}, "one layer")
    kinds = sorted(entity.dxftype() for entity in found)
    check(kinds == sorted(["POLYLINE"] * 5 + ["POINT"] + ["TEXT"] * 8), f"{kinds}")
    lines = [entity for entity in found if entity.dxftype() == "POLYLINE"]
    check([line.is_closed for line in lines] == [False, False, False, False, True], "the area is closed")
    check_close([tuple(vertex.dxf.location) for vertex in lines[0].vertices],
                np.add(FAR, [(-1, -1, 1), (1, -1, 1), (1, 1, 1)]), 1e-9, "file coordinates")
    texts = [entity.dxf.text for entity in found if entity.dxftype() == "TEXT"]
    check({"2.0000 m", "Total 4.0000 m", "90.00°", "4.0000 m², perimeter 8.0000 m"} <= set(texts), f"{texts}")
    export("scene.dxf", space='SCENE')
    line = next(entity for entity in ezdxf.readfile(SCRATCH / "scene.dxf").modelspace() if entity.dxftype() == "POLYLINE")
    check_close(tuple(line.vertices[0].dxf.location), (-1, -1, 1), 0.0, "scene coordinates")
    refused("exists", export, name="lines.dxf")


# ---- Blender's own -----------------------------------------------------------------------------------------------------


def test_kept_by_files_copies_and_undo():
    scene, obj = all_kinds()
    want = [(entry.name, entry.kind, entry.places) for entry in obj.patina.measures.entries]

    def kept(name="cube"):
        return [(entry.name, entry.kind, entry.places) for entry in bpy.data.objects[name].patina.measures.entries]

    copy = obj.copy()
    scene.collection.objects.link(copy)
    check(kept(copy.name) == want, "a copy has them")
    bpy.data.objects.remove(copy)
    bpy.context.preferences.edit.use_global_undo = True
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.object.patina_remove_measurement(index=0)
    bpy.ops.ed.undo_push(message="removed")
    check(kept() == want[1:], "removed")
    bpy.ops.ed.undo()
    check(kept() == want, "undo brings it back")
    place = str(SCRATCH / "measured.blend")
    bpy.ops.wm.save_as_mainfile(filepath=place, copy=True)
    new_scene()
    bpy.ops.wm.open_mainfile(filepath=place)
    check(kept() == want, "saved and loaded")
    found = measures.read(bpy.data.objects["cube"], 3)
    check_close(found.values.value, 4.0, 1e-12, "its area")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


def test_copy_value():
    scene, obj = all_kinds()
    bpy.ops.object.patina_copy_measurement(index=3)
    if bpy.app.background and not bpy.context.window_manager.clipboard:
        raise Skip("there is no clipboard in the background")
    check(bpy.context.window_manager.clipboard == "4.0000 m², perimeter 8.0000 m", bpy.context.window_manager.clipboard)


def test_figures():
    """What is drawn: legs and a corner of a height, an arc between the sides, a closed polygon."""
    texts = description.Texts("{:.1f}".format, "{:.1f}".format, "{:.2f}".format)

    def of(kind, places):
        points = np.array(places, float)
        return description.figure(kind, points, description.values(kind, points), texts, "here")

    height = of('HEIGHT', [(3, 4, 5), (0, 0, 1)])
    check_close(height.lines[0], [(0, 0, 1), (0, 0, 5), (3, 4, 5)], 0, "up, then across")
    check([text for _, text in height.labels] == ["4.0", "5.0"], "its labels")
    arc = of('ANGLE', [(2, 0, 0), (0, 0, 0), (0, 4, 0)]).lines[1]
    check_close(np.linalg.norm(arc, axis=1), np.full(len(arc), 0.5), 1e-12, "radius")
    check_close(arc[[0, -1]], [(0.5, 0, 0), (0, 0.5, 0)], 1e-12, "from side to side")
    check(np.isfinite(of('ANGLE', [(2, 0, 0), (0, 0, 0), (-1, 0, 0)]).lines[1]).all(), "a straight angle")
    area = of('AREA', [(0, 0, 0), (1, 0, 0), (0, 1, 0)])
    check(area.closed and len(area.lines[0]) == 4 and area.labels[0][1] == "0.5, perimeter 3.4", f"{area}")
    check(of('POINT', [(1, 2, 3)]).labels[0][1] == "here", "coordinates")
