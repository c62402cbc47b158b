# SPDX-License-Identifier: GPL-3.0-or-later
"""What somebody tripped over who was told nothing: first files, first buttons, first keys. Windows: check_newcomer.py."""

import bpy
import check_linked  # noqa: F401  no test leaves files with the user
import numpy as np
from check_edits import ROWS, chosen, right_half, scene_with_wall, select
from check_import import columns, import_ply, write_ply
from check_panorama import stage
from check_points import mesh_to_points
from harness import SCRATCH, Skip, add_points, check, check_close, new_scene, patina, points_of, render, reports, sphere
from patina.operators import points_keys
from patina.read.importers import crs, library

LAMBERT = ('PROJCS["NAD_1983_HARN_Lambert_Conformal_Conic",GEOGCS["GCS_North_American_1983_HARN",UNIT["Degree",0.0174532925199433],'
           'AUTHORITY["EPSG","4152"]],UNIT["Foot",0.3048],AUTHORITY["EPSG","2993"]]')


def test_what_is_not_finite_is_left_out():
    """Imported, it made Blender's boxes infinite."""
    new_scene()
    data = columns((0, 0, 0))
    data[0][2][3], data[1][2][5], data[2][2][9] = np.nan, np.inf, -np.inf
    for kind, options in (("mesh", {}), ("linked", {"link": True})):
        obj, = import_ply(write_ply(f"holes_{kind}.ply", data), **options)
        bpy.context.view_layer.update()
        box = np.ptp(points_of(obj), axis=0) if obj.type == 'POINTCLOUD' else np.array(obj.dimensions)  # Blender's has the radii with it
        check(np.isfinite(np.array(obj.dimensions)).all() and max(box) < 2.1, f"{kind}: {box}")
        if not options:
            check(len(points_of(obj)) == len(data[0][2]) - 3, f"{len(points_of(obj))} vertices")
            check(len(obj.data.attributes["intensity"].data) == len(points_of(obj)), "attributes are as many")


def test_import_selects_the_points_alone():
    new_scene()
    path = write_ply("alone.ply", columns())
    for options in ({}, {"link": True}):
        bpy.context.scene.camera.select_set(True)
        obj, = import_ply(path, **options)
        check(bpy.context.selected_objects == [obj], f"{options}: {[other.name for other in bpy.context.selected_objects]} are selected")


def test_import_of_a_folder():
    """A dialog where no file was chosen."""
    try:
        bpy.ops.import_scene.patina_points(filepath=f"{SCRATCH}/")
    except RuntimeError as error:
        check("choose a file" in str(error), str(error))
    else:
        raise AssertionError("a folder was imported")


def test_coordinate_systems_by_name():
    check(crs.name(LAMBERT) == "NAD 1983 HARN Lambert Conformal Conic (EPSG 2993)", crs.name(LAMBERT))
    check(crs.name('COMPD_CS["UTM 32 + height",PROJCS["WGS 84 / UTM zone 32N",UNIT["metre",1]],VERT_CS["h",UNIT["metre",1]]]')
          == "UTM 32 + height", "a compound")
    check(crs.name("NAD83 / UTM zone 12N|NAVD88|") == "NAD83 / UTM zone 12N NAVD88", "words")
    check(crs.name("") == "" and crs.name("PROJCS[") == "PROJCS[", "nothing, and what is broken")


def test_frame_points_of_nodes_and_of_all():
    """Points that Geometry Nodes made; with nothing selected, all that is points; without any, what there is."""
    scene = new_scene(160, 120)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=1.0, location=(30, 5, -7))
    obj = bpy.context.object
    mesh_to_points(obj)
    for selected in (True, False):
        obj.select_set(selected)
        scene.camera.location = (0, 0, 0)
        bpy.context.view_layer.update()
        check(bpy.ops.object.patina_frame_points() == {'FINISHED'}, f"selected {selected}")
        bpy.context.view_layer.update()
        away = np.array(scene.camera.matrix_world.translation) - (30, 5, -7)
        check(abs(away[:2]).max() < 0.2 and 1 < away[2] < 10, f"selected {selected}: {away} from the middle")
    cloud = add_points(sphere(500, 1.0, (-30, 0, 0))[0])
    cube = bpy.data.objects.new("faces", obj.data)
    scene.collection.objects.link(cube)
    cube.location = (0, 500, 0)
    bpy.data.objects.remove(obj)
    check(bpy.ops.object.patina_frame_points() == {'FINISHED'}, "all points")
    check(abs(scene.camera.location.x + 30) < 0.2 and abs(scene.camera.location.y) < 0.2, f"{scene.camera.location[:]}: faces do not count")
    bpy.data.objects.remove(cloud)
    check(bpy.ops.object.patina_frame_points() == {'FINISHED'} and abs(scene.camera.location.y - 500) < 0.2, "faces, where there is no point")


def test_keys_of_points():
    """H, X and Alt H are Blender's own unless points of the active object are selected, or hidden."""
    obj = scene_with_wall("keys.ply")
    hide, reveal, delete = (getattr(bpy.ops.object, f"patina_points_key_{name}") for name in ("hide", "reveal", "delete"))
    obj.select_set(True)
    check(not hide.poll() and not reveal.poll() and not delete.poll(), "nothing of it is selected")
    select(right_half())
    check(hide.poll() and delete.poll() and not reveal.poll(), "selected")
    obj.select_set(False)
    check(not hide.poll() and not delete.poll(), "the object is not selected")
    obj.select_set(True)
    check(hide() == {'FINISHED'} and chosen(obj, "hidden").sum() == ROWS * ROWS // 2 and not obj.hide_get(), "points are hidden")
    check(reveal.poll(), "hidden points")
    other = add_points([(0, 0, 0)])
    other.hide_set(True)
    check(not reveal.poll(), "Blender's key brings the hidden object back first")
    other.hide_set(False)
    check(reveal() == {'FINISHED'} and not chosen(obj, "hidden").any(), "revealed")
    check(delete() == {'FINISHED'} and chosen(obj, "deleted").sum() == ROWS * ROWS // 2 and obj.name in bpy.data.objects, "deleted")
    names = {name for name, _, _ in points_keys.KEYS}
    check(all(hasattr(bpy.ops.object, name.partition(".")[2]) for name in names), "the keys' operators")


def test_other_panoramas_are_named():
    """Fisheyes chosen for Cycles are named. What Cycles has before anybody chooses is not."""
    scene = stage()
    add_points([(0, 0, 0)])
    data = scene.camera.data if hasattr(scene.camera.data, "panorama_type") else getattr(scene.camera.data, "cycles", None)
    if data is None:
        raise Skip("this Blender came without Cycles")
    for kind, said in (('FISHEYE_EQUIDISTANT', True), ('FISHEYE_EQUISOLID', False), ('EQUIRECTANGULAR', False)):
        data.panorama_type = kind
        render()
        check(any("equirectangular" in text for _, text in reports) == said, f"{kind}: {reports}")


def test_the_box_of_disc_radius_closes_random_gaps():
    """A closed ball of points spread at random has gaps wider than its discs; one click closes them, and its outline stays."""
    random = np.random.default_rng(1)
    for count, most in ((1000, 1.04), (3000, 1.02)):
        scene = new_scene(320, 240)
        scene.patina.fill, scene.patina.surface = 'CLOSED', 'AUTO'
        bpy.context.view_layer.use_pass_z = True
        away = random.normal(size=(count, 3))
        obj = add_points(away / np.linalg.norm(away, axis=1, keepdims=True) + (0, 0, -4))
        obj.patina.lighting = 'UNLIT'
        through, drawn = [], []
        for ticked in (False, True):
            obj.patina.use_radius = ticked
            depth = render()["Depth"].reshape(240, 320)
            middle = np.hypot(*(np.mgrid[:240, :320] - np.array([119.5, 159.5])[:, None, None])) < 95
            through.append(int((middle & (depth > 4.2)).sum()))
            drawn.append(int((depth < 1e9).sum()))
        check(through[0] > 50 and through[1] == 0, f"{count} points: {through} pixels show the far side, or what lies behind")
        check(drawn[1] < most * drawn[0], f"{count} points: {drawn} pixels")


def test_columns_of_words_are_left_out():
    """Names of points, notes: what a total station or a spreadsheet writes. A line says what was left out."""
    new_scene()
    for name, text, column in (("excel.csv", "\ufeffPunkt;X;Y;Z;Note\r\nP 1;1,5;2;3;\r\nP 2;4;5;6;\"a; tree\"\r\n", "'Punkt'"),
                               ("station.txt", "P1 1.5 2 3\nP2 4 5 6\n", "column 1")):
        (SCRATCH / name).write_text(text, encoding="utf-8")
        found = library.read(SCRATCH / name, patina.read.importers.Filter(), patina.read.importers.Progress())
        check_close(found.positions + np.array(found.origin), [(1.5, 2, 3), (4, 5, 6)], 1e-5, name)
        check(not found.scalars and any(column in warning and "left out" in warning for warning in found.warnings), f"{found.warnings}")
        obj, = import_ply(SCRATCH / name)
        check(len(points_of(obj)) == 2, name)
    (SCRATCH / "words.csv").write_text("X,Y,Z\n1,2,3\n4,five,6\n")
    try:
        import_ply(SCRATCH / "words.csv")
    except RuntimeError as error:
        check("line 3: column 'Y' holds a word, 'five'" in str(error) and "correct it" in str(error), str(error))
    else:
        raise AssertionError("a word as a coordinate")


def test_tables_of_spreadsheets():
    """A table with decimal commas was a diagonal line of 1 to 999,414, a first row of NaN "not a PLY file"."""
    new_scene()
    rows = np.random.default_rng(5).uniform(-2, 2, (200, 3)).round(4)
    comma = "\n".join(";".join(f"{value:.4f}".replace(".", ",") for value in row) for row in rows)
    tables = {"comma.csv": f"X;Y;Z\n{comma}\n", "plain.txt": comma.replace(";", "  "),
              "quoted.csv": "x,y,z,Wert\n" + "".join(f'"{x}","{y}","{z}",\n' for x, y, z in rows),
              "nan.xyz": "nan nan nan\n" + "".join(f"{x} {y} {z}\n" for x, y, z in rows)}
    for name, text in tables.items():
        (SCRATCH / name).write_text(text)
        obj, = import_ply(SCRATCH / name)
        found = points_of(obj)
        check_close(found, rows, 1e-5, name)
    for name, text, word in (("lonlat.csv", "id,lon,lat,elev\n1,2,3,4\n", "no columns x, y and z in its line of names: id, lon, lat, elev"),
                             ("both.csv", "x;y;z\n1.5;2;3\n1,5;2;3\n", "decimals behind a comma")):
        (SCRATCH / name).write_text(text)
        try:
            import_ply(SCRATCH / name)
        except RuntimeError as error:
            check(word in str(error), str(error))
        else:
            raise AssertionError(f"{name} was imported")
