# SPDX-License-Identifier: GPL-3.0-or-later
"""Where files go: shared origins in any order of imports, units of coordinate systems, axes and scales; what is out of sight;
names that are no UTF-8."""

import os
import shutil
import struct
from pathlib import Path

import bpy
import check_linked  # noqa: F401  no test leaves files with the user
import numpy as np
from check_import import columns, import_ply, positions_of, values, write_ply
from harness import SCRATCH, add_points, check, check_close, failing_render, new_scene, points_of, render, reports, sphere
from mathutils import Vector
from patina.read.importers import crs, las, library
from patina.read.importers.reading import Filter, Progress
from patina.sync.points import origin

FAR_AWAY = (485432.0, 5428765.0, 312.0)
MATCHING = (485532.5, 5428700.0, 300.0)

PROJECTED = ('PROJCS["NAD83 / New York Long Island (ftUS)",GEOGCS["NAD83",DATUM["x",SPHEROID["GRS 1980",6378137,298.257222101]],'
             'PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]],PROJECTION["Lambert_Conformal_Conic_2SP"],'
             'UNIT["US survey foot",0.304800609601219],AXIS["X",EAST],AXIS["Y",NORTH]]')
METRES = 'PROJCS["WGS 84 / UTM zone 32N",GEOGCS["WGS 84",UNIT["degree",0.0174532925199433]],UNIT["metre",1]]'


def scans():
    """Two files of one survey, and one with coordinates of its own."""
    found = {"survey": FAR_AWAY, "street": MATCHING, "room": (0, 0, 0)}
    return {name: (write_ply(f"{name}.ply", columns(place, "f8", seed)), columns(place, "f8", seed))
            for seed, (name, place) in enumerate(found.items(), 40)}


def test_shared_origin_knows_no_order():
    """Whatever comes first: a room with coordinates of its own is at zero, and the survey keeps together near it."""
    found = scans()
    for link in (False, True):
        for order in ("survey street room", "room street survey", "street room survey", "room survey street"):
            scene = new_scene()
            objects = {name: import_ply(found[name][0], link=link)[0] for name in order.split()}
            bpy.context.view_layer.update()
            apart = objects["street"].matrix_world.translation - objects["survey"].matrix_world.translation
            away = np.array(objects["street"]["patina_origin"]) - np.array(objects["survey"]["patina_origin"])
            check_close(apart, away, 1e-3, f"{order}: the survey")
            check(objects["room"].matrix_world.translation.length < 1e-6, f"{order}: the room is "
                  f"{objects['room'].matrix_world.translation.length / 1000:.0f} km away")
            for name in ("survey", "street"):
                check(objects[name].matrix_world.translation.length < 1000, f"{order}: {name} is far from zero")
                if not link:
                    world = positions_of(objects[name]) + np.array(objects[name][origin.SHARED])
                    check_close(world, values(found[name][1], "x", "y", "z"), 1e-3, f"{order}: {name}")
            check(any(scene["patina_origin"]), "the scene has no origin")


def test_shared_origin_goes_with_its_last_scan():
    scene = new_scene()
    first, = import_ply(scans()["survey"][0])
    check(max(map(abs, scene["patina_origin"])) > 1e5, "no origin")
    bpy.data.objects.remove(first)
    away = write_ply("other_survey.ply", columns((2600000.0, 1200000.0, 500.0), "f8", 7))
    obj, = import_ply(away)
    bpy.context.view_layer.update()
    check(obj.matrix_world.translation.length < 10, f"{obj.matrix_world.translation}")
    check_close(scene["patina_origin"], obj["patina_origin"], 1e-6, "a new origin")


def test_units_of_coordinate_systems():
    foot, us = crs.FOOT, crs.US_FOOT
    compound = f'COMPD_CS["both",{PROJECTED},VERT_CS["NAVD88",VERT_DATUM["x",2005],UNIT["metre",1],AXIS["Up",UP]]]'
    newer = ('BOUNDCRS[SOURCECRS[COMPOUNDCRS["x",PROJCRS["y",BASEGEOGCRS["z",DATUM["d",ELLIPSOID["e",6378137,298.25,'
             'LENGTHUNIT["metre",1]]],ANGLEUNIT["degree",0.017]],CONVERSION["c",METHOD["m"],PARAMETER["p",0,LENGTHUNIT["foot",0.3048]]],'
             'CS[Cartesian,2],AXIS["(E)",east],AXIS["(N)",north],LENGTHUNIT["foot",0.3048]],VERTCRS["h",VDATUM["v"],CS[vertical,1],'
             'AXIS["up",up,LENGTHUNIT["US survey foot",0.304800609601219]]]]],TARGETCRS[GEOGCRS["w"]]]')
    for text, keys, wanted in (
            (PROJECTED, {}, (us, us, False)), (METRES, {}, (1, 1, False)), (compound, {}, (us, 1, False)),
            (newer, {}, (foot, us, False)),
            ('GEOGCS["WGS 84",UNIT["degree",0.0174532925199433]]', {}, (1, 1, True)),
            ("NAD83 / Texas Central|NAVD88|", {1024: 1, 3076: 9003}, (us, us, False)),
            ("NAD83 / Texas Central (ftUS)|NAVD88 height (m)|", {1024: 1}, (us, us, False)),
            ("somewhere", {1024: 1, 3076: 32767, 3077: 0.9144, 4099: 9002}, (0.9144, foot, False)),
            ("somewhere|", {1024: 2}, (1, 1, True)),
            ("NAVD88 via Geoid09|", {1024: 1, 3072: 2229, 4097: 0, 4099: 9003}, (us, us, False)),  # of a file of a scanner's maker
            ("", {1024: 1, 3072: 2229}, (us, us, False)), ("", {1024: 1, 3072: 2913, 4096: 5703}, (foot, 1, False)),
            ("", {1024: 1, 3072: 26912, 4096: 6360}, (1, us, False)), ("", {1024: 1, 3072: 2229, 4096: 5103}, (us, us, False)),
            ("NAVD88 height (ftUS)|", {1024: 1, 3072: 32612, 4097: 0}, (1, us, False)),
            ("somewhere|", {1024: 1, 3072: 32767, 4099: 9003}, (us, us, False))):  # all that is told
        found = crs.units(text, keys)
        check(found is not None, f"nothing found in {text[:40]}")
        check_close((found.across, found.up), wanted[:2], 1e-9, text[:40])
        check(found.degrees == wanted[2], text[:40])
    for text in ("", "somewhere in metres", "PROJCS[\"somewhere\"]", "[[[", "UNIT", 'PROJCS["a' * 2000, "A[" * 5000, ")]"):
        check(crs.units(text, {}) is None, f"found something in {text[:20]}")


def test_units_for_people():
    for units, wanted in ((crs.Units(1.0, 1.0), "meters"), (crs.Units(crs.US_FOOT, crs.US_FOOT), "US survey feet"),
                          (crs.Units(1.0, crs.US_FOOT), "meters, heights in US survey feet"),
                          (crs.Units(crs.FOOT, 1.0), "feet, heights in meters"), (crs.Units(1.0, 1.0, True), "degrees"),
                          (crs.Units(1.0, crs.FOOT, True), "degrees, heights in feet")):
        check(str(units) == wanted, f"{units}, not {wanted}")


def las_file(name, positions, wkt="", keys=()):
    """LAS 1.2, point format 0, with a coordinate system as WKT or as GeoTIFF keys."""
    scale, offset = 0.001, np.floor(positions.min(axis=0))
    records = b""
    if wkt:
        records += struct.pack("<H16sHH32s", 0, b"LASF_Projection", 2112, len(wkt) + 1, b"") + wkt.encode() + b"\0"
    if keys:
        data = struct.pack("<4H", 1, 1, 0, len(keys)) + b"".join(struct.pack("<4H", key, 0, 1, value) for key, value in keys)
        records += struct.pack("<H16sHH32s", 0, b"LASF_Projection", 34735, len(data), b"") + data
    header = bytearray(227)
    header[0:4], header[24], header[25] = b"LASF", 1, 2
    struct.pack_into("<HIIBHI", header, 94, 227, 227 + len(records), bool(wkt) + bool(keys), 0, 20, len(positions))
    box = np.stack([positions.max(axis=0), positions.min(axis=0)], 1).ravel()
    struct.pack_into("<12d", header, 131, *(scale,) * 3, *offset, *box)
    body = np.zeros(len(positions), [("at", "<i4", 3), ("rest", "V8")])
    body["at"] = np.rint((positions - offset) / scale)
    path = SCRATCH / name
    path.write_bytes(bytes(header) + records + body.tobytes())
    return path


def test_feet_become_metres():
    rng = np.random.default_rng(3)
    for name, options in (("wkt", {"wkt": PROJECTED}), ("keys", {"keys": [(1024, 1), (3076, 9003)]}),
                          ("number", {"keys": [(1024, 1), (3072, 2229), (4099, 9003)]})):
        feet = rng.uniform(0, 300, (200, 3)) + (1000000.0, 200000.0, 50.0)
        path = las_file(f"feet_{name}.las", feet, **options)
        wanted = (feet - feet[0]) * crs.US_FOOT
        for link in (False, True):
            scene = new_scene()
            obj, = import_ply(path, link=link)
            bpy.context.view_layer.update()
            matrix = np.array(obj.matrix_world, np.float64)
            local = points_of(obj).astype(np.float64)
            if link:
                size = points_of(obj) @ matrix[:3, :3].T
                check_close(np.ptp(size, axis=0), np.ptp(wanted, axis=0), 1e-3, f"{name}: the box")
                continue
            places = local @ matrix[:3, :3].T + matrix[:3, 3]
            check_close(places - places[0], wanted, 2e-3, f"{name}: in metres")
            check_close(places + np.array(scene["patina_origin"]), feet * crs.US_FOOT, 2e-3, f"{name}: in the world")
            back = SCRATCH / "feet_back.ply"
            bpy.ops.export_scene.patina_points(overwrite=True, filepath=str(back), kind='PLY')
            points = library.read(back, Filter(), Progress())
            check_close(points.positions.astype(np.float64) + points.origin, feet, 2e-3, f"{name}: written as it came")
            obj.location.x += 10.0
            bpy.context.view_layer.update()
            bpy.ops.export_scene.patina_points(overwrite=True, filepath=str(back), kind='PLY')
            points = library.read(back, Filter(), Progress())
            check_close(points.positions.astype(np.float64) + points.origin, feet + (10 / crs.US_FOOT, 0, 0), 3e-2, f"{name}: moved")


def test_degrees_are_told():
    path = las_file("degrees.las", np.random.default_rng(2).uniform(0, 1, (50, 3)) + (8, 47, 400), keys=[(1024, 2)])
    points = las.read(path, Filter(), Progress())
    check(len(points.warnings) == 1 and "in degrees" in points.warnings[0], f"{points.warnings}")
    check("units: degrees" in las.preview(path), f"{las.preview(path)}")


def test_feet_lie_beside_metres():
    """Two files of one place, one in feet: they meet."""
    metres = np.random.default_rng(5).uniform(0, 50, (200, 3)) + (300000.0, 60000.0, 10.0)
    new_scene()
    first, = import_ply(las_file("in_metres.las", metres, wkt=METRES))
    second, = import_ply(las_file("in_feet.las", metres / crs.US_FOOT, wkt=PROJECTED))
    bpy.context.view_layer.update()
    places = [np.array([obj.matrix_world @ Vector(place) for place in points_of(obj)]) for obj in (first, second)]
    check_close(places[0], places[1], 5e-3, "places")


def test_import_by_unit_scale_and_axis():
    data = columns(seed=8)
    path = write_ply("axis.ply", data)
    given = values(data, "x", "y", "z")
    for options, wanted in (({"unit": 'MILLIMETERS'}, given * 0.001), ({"scale": 3.0}, given * 3.0),
                            ({"unit": 'FEET', "scale": 2.0}, given * 0.6096),
                            ({"up_axis": 'Y'}, given[:, [0, 2, 1]] * (1, -1, 1)),
                            ({"up_axis": 'NEGATIVE_Y'}, given[:, [0, 2, 1]] * (1, 1, -1))):
        for link in (False, True):
            new_scene()
            obj, = import_ply(path, link=link, **options)
            bpy.context.view_layer.update()
            places = np.array([obj.matrix_world @ Vector(place) for place in points_of(obj)])
            if link:
                check_close((places.min(axis=0), places.max(axis=0)), (wanted.min(axis=0), wanted.max(axis=0)), 1e-5, f"{options}: box")
            else:
                check_close(places, wanted, 1e-5, f"{options}")


def test_beyond_clip_end_is_told():
    scene = new_scene()
    add_points(*sphere(500, center=(0, 0, -500))[:2])
    for clip_start, clip_end, place, wanted in (
            (0.1, 100, 0, "beyond Clip End, 100"), (0.1, 1000, 0, ""), (600, 1000, 0, "before Clip Start, 600"),
            (0.1, 500, 0, ""), (0.1, 100, -600, "behind the camera")):
        scene.camera.data.clip_start, scene.camera.data.clip_end = clip_start, clip_end
        scene.camera.location.z = place
        picture = render()
        said = [text for _, text in reports]
        check(any(wanted in text for text in said) if wanted else not said, f"{clip_start} to {clip_end}: {said}")
        check(picture["Combined"][..., 3].any() == (not wanted), "the picture")
    scene.camera.location.z = 0
    for kind in ('ORTHO', 'PANO'):
        scene.camera.data.type = kind
        scene.camera.data.clip_start, scene.camera.data.clip_end = 0.1, 100
        render()
        check(any("beyond Clip End" in text for _, text in reports), f"{kind}: {reports}")
        scene.camera.data.clip_end = 1000
        render()
        check(not reports, f"{kind}: {reports}")


def test_cameras_that_see_nothing():
    scene = new_scene()
    add_points(*sphere(500)[:2])
    camera = scene.camera
    for kind, change, wanted in (
            ('ORTHO', lambda: setattr(camera.data, "ortho_scale", 0.0), "its orthographic scale is 0"),
            ('PERSP', lambda: setattr(camera.data, "angle", 0.0), "its field of view is 0"),
            ('PERSP', lambda: setattr(camera, "scale", (0, 0, 0)), "its scale is 0"),
            ('PERSP', lambda: setattr(camera.data, "clip_start", 2e6), "is not beyond Clip Start")):
        camera.data.type, camera.data.ortho_scale, camera.data.lens = kind, 5.0, 50.0
        camera.scale, camera.data.clip_start = (1, 1, 1), 0.1
        render()
        change()
        text = failing_render()
        check(wanted in text and "Error:" not in text.replace("Error: Patina:", ""), text)


def test_names_that_are_no_text():
    """A name in another encoding than UTF-8 reads, links and draws, and failures can say it."""
    raw = os.fsencode(SCRATCH) + b"/caf\xe9.ply"
    shutil.copyfile(write_ply("cafe.ply", columns((0, 0, -4), seed=9)), raw)
    path = Path(os.fsdecode(raw))
    for link in (False, True):
        new_scene()
        obj, = import_ply(path, link=link)
        check(obj.name.startswith("caf"), repr(obj.name))
        picture = render()
        check(not reports and picture["Combined"][..., 3].any(), f"{reports}")
    os.unlink(raw)
    render()
    check(any("is missing" in text for _, text in reports), f"{reports}")
    Path(path).write_bytes(b"ply\nformat nothing\n")
    for link in (False, True):
        try:
            import_ply(path, link=link)
        except RuntimeError as error:
            check("Patina:" in str(error) and "Traceback" not in str(error), str(error))
        else:
            check(False, "a damaged file was read")
    os.unlink(raw)
