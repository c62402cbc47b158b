# SPDX-License-Identifier: GPL-3.0-or-later
"""Point files of many kinds in, PLY, LAS, LAZ, COPC and E57 out: what is kept, what is refused and how."""

import contextlib
import os
import struct
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import bpy
import numpy as np
from check_import import attribute_of, positions_of
from check_import import import_ply as import_points
from harness import REPOSITORY, SCRATCH, Skip, add_points, check, check_close, drawn, new_scene, points_of, render
from patina import native
from patina.read import importers, readers
from patina.read.importers import e57, e57_scans, las, las_header, pcd, reading, scans
from patina.sync.points import made, origin
from patina.write import exporters

DATA = REPOSITORY.parent / "shared/data"


def shared(name):
    path = DATA / name
    if not path.exists():
        raise Skip(f"there is no ../shared/data/{name}")
    return path


def with_laspy():
    try:
        import laspy  # noqa: F401
        import lazrs  # noqa: F401
    except ImportError:
        raise Skip("laspy and lazrs are not installed here") from None


def text_file(name, text):
    path = SCRATCH / name
    path.write_text(text)
    return path


def export(path, kind):
    bpy.ops.export_scene.patina_points(filepath=str(path), kind=kind, overwrite=True)


def fails(path, part, **options):
    try:
        import_points(path, **options)
    except RuntimeError as error:
        check(part in str(error), f"'{part}' is not in '{error}'")
    else:
        check(False, f"{path.name} was imported")


def test_text():
    """XYZ with colours, and CSV with names: columns are found, and drawn."""
    new_scene()
    obj, = import_points(text_file("a.xyz", "".join(f"{x / 9 - 1} {y / 9 - 1} -4 255 {x} 0\n" for x in range(18)
                                                     for y in range(18))))
    check(obj.data.attributes["Col"].data_type == 'BYTE_COLOR', "no byte colours")
    check(len(drawn(render())) > 200, "not drawn")
    obj, = import_points(text_file("b.csv", "x,y,z,intensity\n500000.5,4100000.25,7,3\n500001.5,4100000.25,7,4\n"))
    places = np.array(obj["patina_origin"]) + points_of(obj)
    check_close(places[0], (500000.5, 4100000.25, 7), 1e-3, "the first point")
    check_close(attribute_of(obj, "intensity", "value")[:, 0], (3, 4), 0, "intensity")


def test_what_is_wrong_is_told():
    """Bytes too many, and faces of points that are not there: warnings, with numbers."""
    head = "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty char x\nproperty char y\nproperty char z\n"
    faces = "element face 1\nproperty list uchar uchar vertex_indices\n"
    for name, body, text in (("long.ply", head.encode() + b"end_header\n" + bytes(10), "7 bytes follow behind byte"),
                             ("faces.ply", (head + faces).encode() + b"end_header\n" + bytes([0, 0, 0, 3, 0, 0, 9]), "names 9 of 1")):
        path = SCRATCH / name
        path.write_bytes(body)
        points = importers.reader(path).read(path, importers.Filter(), importers.Progress())
        check(len(points.warnings) == 1 and text in points.warnings[0], f"{points.warnings}")


def test_filters():
    new_scene()
    path = text_file("line.xyz", "".join(f"{i} 0 0\n" for i in range(100)))
    obj, = import_points(path, every=10)
    check_close(positions_of(obj)[:, 0], np.arange(0, 100, 10), 1e-6, "every tenth")
    obj, = import_points(path, use_box=True, box_min=(9.5, -1, -1), box_max=(14.5, 1, 1))
    check_close(positions_of(obj)[:, 0], np.arange(10, 15), 1e-6, "in the box")
    fails(path, "that the filters keep", use_box=True, box_min=(200, 0, 0), box_max=(201, 1, 1))


def test_las_round_trip():
    """What is exported as LAS comes back: positions to 0.1 mm, colours, class, intensity, GPS time, CRS."""
    new_scene()
    rng = np.random.default_rng(3)
    world = rng.uniform(0, 50, (2000, 3)) + (431234.0, 4581234.0, 2240.0)
    points = importers.PointFile(
        "scan", (world - (431000, 4581000, 2000)).astype(np.float32), None,
        np.concatenate([rng.integers(0, 256, (2000, 3)), np.full((2000, 1), 255)], 1).astype(np.uint8),
        {"intensity": rng.integers(0, 60000, 2000).astype(np.float32), "class": np.full(2000, 6, np.uint8),
         "user_data": rng.integers(0, 256, 2000).astype(np.uint8), "gps_time": np.arange(2000, dtype=np.float32)}, (431000.0, 4581000.0, 2000.0), 0,
        {"crs": "PROJCS[\"somewhere\"]", "gps_time_start": 3e8})
    given = replace(points, scalars=dict(points.scalars))
    obj = bpy.data.objects.new("scan", made.to_data(given, cloud=False))
    check(not len(given.positions) and given.colors is None and not given.scalars, "the mesh takes the arrays over")
    kinds = {name: obj.data.attributes[name].data_type for name in points.scalars}
    check(kinds == {"intensity": 'FLOAT', "class": 'INT8', "user_data": 'FLOAT', "gps_time": 'FLOAT'}, f"{kinds}")
    check(".select_vert" not in obj.data.attributes, "a byte a point for the selection")
    origin.place(obj, points.origin, origin.shared(bpy.context.scene, points.origin))
    bpy.context.scene.collection.objects.link(obj)
    obj.select_set(True)
    kept = points.positions.astype(np.float64) + points.origin
    kinds = [("las", 6e-5), ("ply", 1e-9)]
    with contextlib.suppress(Skip):
        with_laspy()
        kinds += [("laz", 6e-5), ("copc.laz", 6e-5)]
    for kind, tolerance in kinds:
        path = SCRATCH / f"trip.{kind}"
        export(path, kind.partition(".")[0].upper())
        back = importers.reader(path).read(path, importers.Filter(), importers.Progress())
        order = np.argsort(back.scalars["gps_time"])  # COPC has another
        check_close(back.positions[order].astype(np.float64) + back.origin, kept, tolerance + 4e-6, kind)
        check_close(back.colors[order], points.colors, 0, f"{kind} colours")
        for name in ("intensity", "class", "user_data"):
            check_close(back.scalars[name][order], points.scalars[name], 0, f"{kind} {name}")
    path = SCRATCH / "trip.las"
    back = las.read(path, importers.Filter(), importers.Progress())
    check(back.notes["crs"] == points.notes["crs"], f"CRS {back.notes}")
    check(back.notes["gps_time_start"] == 3e8, f"GPS time from {back.notes}")
    check_close(back.scalars["gps_time"], points.scalars["gps_time"], 0, "GPS time")
    check(any("2,000 points" in line for line in las.preview(path)), f"preview {las.preview(path)}")


def test_export_by_name():
    """A script's exp.las is LAS without more words; in the dialog the one of name and format decides that was changed."""
    new_scene()
    add_points(np.zeros((7, 3))).select_set(True)
    for name, options, written in (("named.las", {}, "named.las"), ("named.ply", {}, "named.ply"), ("plain", {}, "plain.ply"),
                                ("again.LAS", {"kind": 'LAS'}, "again.LAS")):
        bpy.ops.export_scene.patina_points(filepath=str(SCRATCH / name), **options)
        path = SCRATCH / written
        check(path.read_bytes()[:4] == (b"LASF" if written.lower().endswith("las") else b"ply\n"), f"{name}: {written}")
        path.unlink()
    from patina.operators.export_points import PATINA_OT_export_points as export_points
    dialog = SimpleNamespace(kind='PLY', _seen='PLY', filepath="/a/scan.ply", kind_of=lambda path: export_points.kind_of(None, path),
                             ending_of=lambda kind: export_points.ending_of(None, kind))
    for change, kind, name in (({}, 'PLY', "scan.ply"), ({"filepath": "/a/scan.las"}, 'LAS', "scan.las"), ({"kind": 'PLY'}, 'PLY', "scan.ply"),
                               ({"filepath": "/a/more"}, 'PLY', "more.ply"), ({"kind": 'LAS'}, 'LAS', "more.las"),
                               ({"kind": 'COPC'}, 'COPC', "more.copc.laz"), ({"kind": 'LAZ'}, 'LAZ', "more.laz"),
                               ({"filepath": "/a/b.copc.laz"}, 'COPC', "b.copc.laz")):
        vars(dialog).update(change)
        export_points.check(dialog, None)
        check((dialog.kind, dialog.filepath) == (kind, f"/a/{name}"), f"{change}: {dialog}")
        check(not export_points.check(dialog, None), f"{change}: it goes on and on")


def test_export_never_writes_another_format():
    """A script that names a format which cannot be written, or a file that exists, gets an error, and no file changes."""
    new_scene()
    add_points(np.zeros((7, 3))).select_set(True)
    there = SCRATCH / "there.ply"
    there.write_bytes(b"kept")
    needs = exporters.NEEDS
    exporters.NEEDS = {**needs, "e57": ("no_such_package",), "copc.laz": ("no_such_package",)}
    lacks, readers.lacks = readers.lacks, lambda *names: "no_such_package" in names
    try:
        for name, options, text in (("scan.xyz", {}, "points cannot be written as .xyz"), ("scan.copc.laz", {}, "COPC needs the Python package no_such_package"),
                                    ("scan.laz", {"kind": 'COPC'}, "Name the file .copc.laz"),
                                    ("scan.copc.laz", {"kind": 'LAZ'}, "does not fit the format LAZ"), ("scan.las", {"kind": 'PLY'}, "does not fit the format PLY"), ("there.ply", {}, "exists"),
                                    ("there", {}, "exists"), ("there.e57", {}, "no_such_package")):
            try:
                bpy.ops.export_scene.patina_points(filepath=str(SCRATCH / name), **options)
            except RuntimeError as error:
                check(text in str(error), f"{name}: {error}")
            else:
                check(False, f"{name} was written")
            check(name == "there.ply" or not (SCRATCH / name).exists(), f"{name} is there")
    finally:
        exporters.NEEDS, readers.lacks = needs, lacks
    check(there.read_bytes() == b"kept", "the file that existed was overwritten")
    check(not list(SCRATCH.glob(".patina-export-*")), "a temporary folder stayed")
    there.unlink()


def test_e57_round_trip():
    """What is exported as E57 comes back: scans with their stations, positions, colors and intensity."""
    try:
        import pye57  # noqa: F401
    except ImportError:
        raise Skip("pye57 is not installed here") from None
    rng = np.random.default_rng(5)
    origin = np.array((5000000.0, 4000000.0, 200.0))
    positions = origin + rng.uniform(-20, 20, (500, 3))
    colors = rng.integers(0, 256, (500, 3)).astype(np.uint8)
    scalars = {"intensity": rng.uniform(0, 1, 500).astype(np.float32), "scan": (np.arange(500) % 2).astype(np.float32)}
    pose = (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    two = [scans.Scan(f"Station {i}", 250, scans.UNKNOWN, 0.0, pose, (0, 0)) for i in range(2)]
    stations = np.stack([origin, origin + (3.5, -2.0, 1.0)])
    path = SCRATCH / "trip.e57"
    left = exporters.write(path, exporters.Points(positions, None, colors, scalars, scans=two, stations=stations))
    check(left == [], f"left out: {left}")
    back = importers.reader(path).read(path, importers.Filter(), importers.Progress())
    order = np.argsort(scalars["scan"], kind="stable")
    check_close(back.positions.astype(np.float64) + back.origin, positions[order], 1e-5, "positions")
    check_close(back.colors[:, :3], colors[order], 0, "colors")
    check_close(back.scalars["intensity"], scalars["intensity"][order], 1e-6, "intensity")
    check_close(np.array(back.notes["scanners"]).reshape(-1, 3) + back.origin, stations, 1e-5, "stations")


def test_export_leaves_faces_out():
    """The start scene's cube is selected, and no scan; alone it is what is meant."""
    new_scene()
    add_points(np.zeros((7, 3))).select_set(True)
    mesh = bpy.data.meshes.new("faces")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    bpy.context.scene.collection.objects.link(faces := bpy.data.objects.new("faces", mesh))
    faces.select_set(True)
    path = SCRATCH / "faces_out.ply"
    for count in (7, 3):
        bpy.ops.export_scene.patina_points(filepath=str(path), overwrite=True)
        found = importers.reader(path).read(path, importers.Filter(), importers.Progress())
        check(len(found.positions) == count, f"{len(found.positions)} points, not {count}")
        bpy.data.objects["points"].select_set(False)


def las_file(name, form, fields, rows, extras=(), behind=False):
    """A LAS 1.4 file of records with these fields, in millimetres, and extra dimensions in VLRs, or behind the points."""
    rows = np.array(rows, fields)
    body = b"".join(extras)
    # an extended record's length has eight bytes
    record = (b"\0\0LASF_Spec" + bytes(7) + struct.pack("<HQ" if behind else "<HH", 4, len(body)) + bytes(32) + body
              if body else b"")
    head = bytearray(375)
    head[:4], head[24:26] = b"LASF", b"\x01\x04"
    offset = 375 if behind else 375 + len(record)
    struct.pack_into("<HIIBHI", head, 94, 375, offset, int(bool(record) and not behind), form, rows.dtype.itemsize, 0)
    struct.pack_into("<12d", head, 131, 0.001, 0.001, 0.001, 0, 0, 0, 9, 0, 9, 0, 9, 0)
    struct.pack_into("<QI", head, 235, offset + rows.nbytes, int(bool(record) and behind))
    struct.pack_into("<Q", head, 247, len(rows))
    path = SCRATCH / name
    path.write_bytes(bytes(head) + (rows.tobytes() + record if behind else record + rows.tobytes()))
    return path


def extra_record(name, kind, options=0, no_data=b"", scale=0.0, offset=0.0):
    return struct.pack("<2xBB32s4x24s48x3d3d32x", kind, options, name.encode(), no_data, scale, 0, 0, offset, 0, 0)


def read_las(path):
    return las.read(path, importers.Filter(), importers.Progress())


def test_las_extra_dimensions():
    """CloudCompare's scalar fields: their types, scale and offset, no-data; in a record before the points or behind them."""
    extras = [extra_record("Curvature", 9), extra_record("height", 3, 8 | 16, scale=0.01, offset=100.0),
              extra_record("depth", 6, 1, struct.pack("<q", -9999)), extra_record("", 0, 3), extra_record("class", 1),
              extra_record("pair", 14), extra_record("NormalX", 9), extra_record("NormalY", 9), extra_record("NormalZ", 9)]
    more = [("curvature", "<f4"), ("height", "<u2"), ("depth", "<i4"), ("unknown", "V3"), ("second", "u1"), ("pair", "<i2", 2),
            ("n", "<f4", 3)]
    rows = [(1000 * i, 0, 0, 7, 0, 0, 2, 0, 0, 0, 5.0, 0.5 * i, 10 * i, -9999 if i == 1 else i, b"abc", 40 + i, (i, -i), (0, 0, 1))
            for i in range(3)]
    for behind in (False, True):
        points = read_las(las_file("extra.las", 6, las_header._NEW + more, rows, extras, behind))
        found = points.scalars
        check_close(points.positions, [(0, 0, 0), (1, 0, 0), (2, 0, 0)], 1e-6, "positions")
        check_close(found["Curvature"], (0, 0.5, 1), 0, "a float")
        check_close(found["height"], (100, 100.1, 100.2), 1e-4, "scale and offset")
        check(np.isnan(found["depth"][1]) and found["depth"][2] == 2, f"no-data: {found['depth']}")
        check_close(found["class"], (2, 2, 2), 0, "the class is the format's own")
        check_close(found["extra class"], (40, 41, 42), 0, "and the other stays beside it")
        check_close(found["pair 1"], (0, -1, -2), 0, "the second of a pair")
        check_close(points.normals, [(0, 0, 1)] * 3, 0, "normals")
    points = read_las(las_file("plain.las", 6, las_header._NEW + more, rows))  # nobody says what the bytes are
    check(not {"Curvature", "height"} & points.scalars.keys(), f"{points.scalars.keys()}")


def test_las_infrared():
    """Point formats 8 and 10, of which the latter has a waveform behind it."""
    for form in (8, 10):
        fields = las_header._NEW + las_header._RGB + [("nir", "<u2")] + [("wave", "V29")] * (form == 10)
        row = (1, 2, 3, 0, 0, 0, 2, 0, 0, 0, 5.0, 10, 20, 30, 777) + (b"w" * 29,) * (form == 10)
        points = read_las(las_file("nir.las", form, fields, [row] * 2))
        check_close(points.scalars["nir"], (777, 777), 0, f"format {form}")
        check_close(points.colors[0], (10, 20, 30, 255), 0, "colour")


def test_las_absurd_times():
    """A time that cannot be one is none; the others keep their range."""
    times = (300000.5, np.nan, 300002.5, np.inf, -1e300, 1e300)
    points = read_las(las_file("times.las", 6, las_header._NEW, [(1, 2, 3, 0, 0, 0, 2, 0, 0, 0, time) for time in times]))
    check(points.notes["gps_time_start"] == 300000.5, f"{points.notes}")
    found = points.scalars["gps_time"]
    check_close(found[[0, 2]], (0, 2), 1e-6, "times")
    check(np.isnan(found[[1, 3, 4, 5]]).all(), f"{found}")


def test_real_extra_dimensions():
    """LAS and LAZ of laspy's own tests, against laspy; format 10, too."""
    with_laspy()
    import laspy
    for name in ("extrabytes.las", "extra.laz"):
        path = shared(f"formats/las/laspy/{name}")
        points, wanted = read_las(path), laspy.read(str(path))
        for dimension in ("Intensity", "Time"):
            check_close(points.scalars[dimension], np.asarray(wanted[dimension]).astype(np.float32), 0, f"{name}: {dimension}")
        check_close(points.scalars["Flags 1"], np.asarray(wanted["Flags"])[:, 1], 0, "Flags")
        check_close(points.scalars["Colors 1"], np.asarray(wanted["Colors"])[:, 1].astype(np.float32), 0, "Colors")
    path = shared("formats/las/laspy/fullwave.laz")
    points, wanted = read_las(path), laspy.read(str(path))
    if np.asarray(wanted.nir).any():
        check_close(points.scalars["nir"], np.asarray(wanted.nir).astype(np.float32), 0, "nir")
    check(read_las(shared("formats/las/pdal/gps-time-nan.las")).notes["gps_time_start"] < 1e12, "times")


def test_las_refuses():
    new_scene()
    bad = SCRATCH / "bad.las"
    bad.write_bytes(b"LASX" + bytes(400))
    fails(bad, "not a LAS file")
    head = bytearray(np.zeros(400, np.uint8).tobytes())
    head[:4], head[24:26] = b"LASF", b"\x01\x02"
    struct.pack_into("<HIIBHI", head, 94, 227, 227, 0, 3, 34, 1000)
    bad.write_bytes(bytes(head))
    fails(bad, "of 1,000 points")


def test_real_las():
    path = shared("lidar/autzen_trim.las")
    new_scene()
    obj, = import_points(path)
    check(len(points_of(obj)) == 110000, f"{len(points_of(obj))} points")
    check(obj.data.attributes["Col"].data_type == 'BYTE_COLOR', "8-bit colours in 16 bits stay bytes")
    check({"intensity", "gps_time", "return_number"} <= set(obj.data.attributes.keys()), f"{obj.data.attributes.keys()}")
    header = las_header.read_header(path)
    places = np.array(obj["patina_origin"]) + positions_of(obj) - np.array(obj.matrix_world.translation)
    check_close(places.min(axis=0), header.lower, 0.01, "lower corner")
    check_close(places.max(axis=0), header.upper, 0.01, "upper corner")


def test_colors_of_sixteen_bits():
    """Bytes where 8 bits were stored as 16, in each of the three ways; else linear floats. Longer than a piece too."""
    low = np.random.default_rng(2).integers(0, 256, (reading.PIECE + 5, 3)).astype(np.uint16)
    for rgb in (low, low << 8, low * 257):
        check(np.array_equal(reading.colors_of(rgb)[:, :3], low), f"bytes of {rgb[0]}")
    odd = low * 257
    odd[-1] = (256, 30000, 65535)
    colors = reading.colors_of(odd)
    check(colors.dtype == np.float32 and (colors[:, 3] == 1).all(), f"{colors.dtype}")
    check_close(colors[-1, :3], ((256 / 65535) / 12.92, ((30000 / 65535 + 0.055) / 1.055) ** 2.4, 1), 1e-6, "linear")
    check(reading.colors_of(low[:0]).shape == (0, 4), "no points")


def test_las_that_is_larger_than_memory():
    """A packed file may claim any number of points: a message, not a dead Blender."""
    with_laspy()
    new_scene()
    head = bytearray(shared("lidar/autzen_trim.laz").read_bytes())
    struct.pack_into("<I", head, 107, 0xFFFFFFFF)
    path = SCRATCH / "huge.laz"
    path.write_bytes(bytes(head))
    fails(path, "huge.laz:")


def test_laz_that_is_broken():
    """Files of others' tests at which lazrs panics, are told like others."""
    with_laspy()
    shared("formats/laz/pdal")
    for path in sorted((DATA / "formats").glob("la*/*/*.laz")):
        try:
            read_las(path)
        except importers.PatinaError as error:
            check(path.name in str(error), str(error))


def test_laz_is_las():
    with_laspy()
    packed, plain = shared("lidar/autzen_trim.laz"), shared("lidar/autzen_trim.las")
    a, b = (las.read(path, importers.Filter(every=7), importers.Progress()) for path in (packed, plain))
    check_close(a.positions.astype(np.float64) + a.origin, b.positions.astype(np.float64) + b.origin, 0, "positions")
    check_close(a.colors, b.colors, 0, "colours")


def test_missing_packages_are_a_sentence():
    """Without lazrs and pye57, LAZ and E57 say what to do."""
    new_scene()
    head = bytearray(400)
    head[:4], head[24:26] = b"LASF", b"\x01\x02"
    struct.pack_into("<HIIBHI", head, 94, 227, 227, 0, 3 | 0x80, 34, 10)
    struct.pack_into("<3d", head, 131, 0.001, 0.001, 0.001)
    path = SCRATCH / "packed.laz"
    path.write_bytes(bytes(head))
    with mock.patch.object(readers, "missing", lambda: ["lazrs", "pye57"]):
        fails(path, "Install Readers")
        printed = SCRATCH / "printed.txt"
        sys.stdout.flush()
        before = os.dup(1)
        os.dup2(os.open(printed, os.O_CREAT | os.O_WRONLY | os.O_TRUNC), 1)
        try:
            fails(path, "Install Readers", link=True)
        finally:
            sys.stdout.flush()
            os.dup2(before, 1)
        check("Linked" not in printed.read_text(), f"the error, and after it: {printed.read_text()}")
        try:
            e57.read(Path("a.e57"), importers.Filter(), importers.Progress())
        except importers.PatinaError as error:
            check("pye57" in str(error), str(error))
        else:
            check(False, "an E57 file was read without pye57")


def test_pcd():
    new_scene()
    colors = np.array([0x00FF8001, 0x00000102], np.uint32).view(np.float32)
    rows = np.zeros(3, [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<f4")])
    rows["x"], rows["y"], rows["rgb"] = [1, 2, np.nan], [3, 4, 0], [*colors, 0]
    header = "VERSION .7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 3\nHEIGHT 1\nPOINTS 3\nDATA "
    literal = b"".join(rows[name].tobytes() for name in rows.dtype.names)
    packed = b"".join(bytes([len(literal[i:i + 32]) - 1]) + literal[i:i + 32] for i in range(0, len(literal), 32))
    compressed = struct.pack("<II", len(packed), len(literal)) + packed
    text = "1 3 0 %r\n2 4 0 %r\nnan 0 0 0\n" % tuple(float(value) for value in colors)
    for form, body in (("binary", rows.tobytes()), ("binary_compressed", compressed), ("ascii", text.encode())):
        path = SCRATCH / f"{form}.pcd"
        path.write_bytes(header.encode() + form.encode() + b"\n" + body)
        obj, = import_points(path)
        check_close(positions_of(obj), [(1, 3, 0), (2, 4, 0)], 0, form)
        check_close(attribute_of(obj, "Col", "color_srgb", 4) * 255, [(255, 128, 1, 255), (0, 1, 2, 255)], 1e-3, form)


def test_organised_pcd():
    """A picture of points has rows and columns, a sensor and normals towards it; not one without a second row."""
    head = "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {}\nHEIGHT {}\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 12\nDATA ascii\n"
    rows = "".join("nan nan nan\n" if (u, v) == (1, 1) else f"{u} {v} 9\n" for v in range(3) for u in range(4))
    points = pcd.read(text_file("grid.pcd", head.format(4, 3) + rows), importers.Filter(), importers.Progress())
    check_close(points.scalars["column"], [0, 1, 2, 3, 0, 2, 3, 0, 1, 2, 3], 0, "columns")
    check_close(points.scalars["row"], [0] * 4 + [1] * 3 + [2] * 4, 0, "rows")
    check_close(points.normals, [(0, 0, -1)] * 11, 1e-5, "normals")
    check_close(points.notes["scanners"], (0, 0, 0), 0, "sensor")
    points = pcd.read(text_file("line.pcd", head.format(12, 1) + rows), importers.Filter(), importers.Progress())
    check(points.normals is None and not points.scalars and not points.notes, "a row of points is no grid")


def test_real_pcd():
    path = shared("lidar/samp11-utm.pcd") if (DATA / "lidar/samp11-utm.pcd").exists() else None
    path = path or next(iter(sorted((DATA / "lidar").glob("samp11*.pcd"))), None)
    if path is None:
        raise Skip("there is no ../shared/data/lidar/samp11*.pcd")
    points = importers.reader(path).read(path, importers.Filter(), importers.Progress())
    check(len(points.positions) == 38010, f"{len(points.positions)} points")
    check(any(points.origin), "UTM coordinates without an origin")


def test_conf():
    """Scans of a .conf lie in their places: the bunny's overlap within 4 mm."""
    path = shared("stanford/bunny_range/bun.conf")
    points = importers.reader(path).read(path, importers.Filter(every=20), importers.Progress())
    whole = importers.reader(shared("stanford/bunny/bun_zipper.ply")).read(
        shared("stanford/bunny/bun_zipper.ply"), importers.Filter(), importers.Progress())
    check(len(set(points.scalars["scan"].tolist())) == 10, "ten scans")
    places = points.positions.astype(np.float64) + points.origin
    surface = whole.positions.astype(np.float64) + whole.origin
    far = [np.sqrt(((surface - place) ** 2).sum(axis=1).min()) for place in places[::40]]
    check(np.mean(np.array(far) < 0.004) > 0.95, f"{np.mean(np.array(far) < 0.004):.0%} within 4 mm")


def test_places_of_points():
    """Row, column and scan of each point come as attributes, the scanners' places with the data; grids give normals."""
    new_scene()
    head = "3\n2\n{0} 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n{0} 0 0 1\n"
    wall = "".join(f"{u} 5 {v} 0.5\n" for u in range(3) for v in range(2))
    obj, = import_points(text_file("two.ptx", head.format(10) + wall + head.format(20) + wall))
    for name, wanted in (("scan", [0] * 6 + [1] * 6), ("column", [0, 0, 1, 1, 2, 2] * 2), ("row", [0, 1] * 6)):
        check_close(attribute_of(obj, name, "value")[:, 0], wanted, 0, name)
    check_close(attribute_of(obj, "Normal", "vector", 3), [(0, -1, 0)] * 12, 1e-6, "normals towards the scanner")
    check_close(np.array(obj.data["patina_scanners"]), (10, 0, 0, 20, 0, 0), 1e-6, "scanners")


def test_conf_has_grids():
    path = shared("stanford/bunny_range/bun.conf")
    points = importers.reader(path).read(path, importers.Filter(every=20), importers.Progress())
    check({"scan", "row", "column"} <= points.scalars.keys(), f"{points.scalars.keys()}")
    check(0 < points.scalars["row"].max() < 400 and 400 < points.scalars["column"].max() < 512, "512 by 400 cells")
    good = (points.normals ** 2).sum(axis=1) > 0.99
    check(good.mean() > 0.99, f"{good.mean():.1%} have normals")


def test_unknown_ending():
    new_scene()
    fails(text_file("a.abc", "1 2 3\n"), "is none of .ply")


def test_previews():
    """A few lines on every file, broken ones too."""
    path = text_file("p.xyz", "1 2 3\n")
    check(any("text" in line for line in importers.preview(path)), f"{importers.preview(path)}")
    check(len(importers.preview(SCRATCH / "none.las")) == 1, "a missing file")
    bad = SCRATCH / "short.las"
    bad.write_bytes(b"LA")
    check("not a LAS file" in importers.preview(bad)[0], f"{importers.preview(bad)}")


def check_in_steps(path):
    """Read in steps a file is what it is read at once; in between there is time for Blender, progress goes on, and a cancel
    ends it."""
    whole = importers.reader(path).read(path, importers.Filter(), importers.Progress())
    progress, shares, steps = importers.Progress(), [], None
    steps = importers.steps(path, importers.Filter(), progress)
    try:
        while True:
            task = next(steps)
            while not task.done():
                pass
            shares.append(progress.value())
    except StopIteration as end:
        found = end.value
    check(len(shares) >= 3, f"{path.name}: {len(shares)} steps")
    check(shares == sorted(shares) and shares[0] < 0.5 and shares[-1] <= 1.0, f"{path.name}: progress {shares}")
    check_close(found.positions, whole.positions, 0, f"{path.name} in steps")
    check(found.scalars.keys() == whole.scalars.keys() and (found.colors is None) == (whole.colors is None), "other columns")
    steps = importers.steps(path, importers.Filter(), progress := importers.Progress())
    next(steps)
    progress.cancel()
    try:
        for task in steps:
            while not task.done():
                pass
    except importers.PatinaError as error:
        check(isinstance(error, native.PatinaCancelled), f"{path.name}: {error}")
    else:
        check(False, f"{path.name} was read in spite of a cancel")
    return found


def test_pcd_in_steps():
    places = np.repeat(np.random.default_rng(6).uniform(0, 9, (1500, 3)).astype(np.float32), 2, axis=0)
    header = ("VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 3000\nHEIGHT 1\nPOINTS 3000\nDATA ")
    text = "".join("%r %r %r\n" % tuple(map(float, row)) for row in places).encode()
    plain = places.T.tobytes()  # each number twice: the second is a copy of four bytes from four bytes back
    packed = b"".join(b"\x03" + plain[i:i + 4] + b"\x40\x03" for i in range(0, len(plain), 8))
    sizes, pcd.TEXT_PIECE, pcd.COPIES = (pcd.TEXT_PIECE, pcd.COPIES), 20000, 500
    try:
        for form, body in (("ascii", text), ("binary_compressed", struct.pack("<II", len(packed), len(plain)) + packed)):
            path = SCRATCH / f"steps_{form}.pcd"
            path.write_bytes(header.encode() + form.encode() + b"\n" + body)
            check_close(check_in_steps(path).positions, places, 1e-6, form)
    finally:
        pcd.TEXT_PIECE, pcd.COPIES = sizes


def test_conf_is_cancelled():
    """Read by the library, beside Blender; a cancel ends it."""
    progress = importers.Progress()
    steps = importers.steps(shared("stanford/bunny_range/bun.conf"), importers.Filter(), progress)
    task = next(steps)
    progress.cancel()
    try:
        while not task.done():
            pass
        next(steps)
    except importers.PatinaError as error:
        check(isinstance(error, native.PatinaCancelled), f"{error}")
    else:
        check(False, "it was read in spite of a cancel")


def range_image(name, z, columns=6, rows=4, count=None):
    """A PLY with a scanner's grid, 0.1 apart, in a plane across z."""
    places = [(column * 0.1, row * 0.1, z) for row in range(rows) for column in range(columns)][:count]
    lines = ["ply", "format ascii 1.0", f"obj_info num_cols {columns}", f"obj_info num_rows {rows}", f"element vertex {len(places)}",
             "property float x", "property float y", "property float z", f"element range_grid {columns * rows}",
             "property list uchar int vertex_indices", "end_header", *("%g %g %g" % place for place in places),
             *(f"1 {i}" if i < len(places) else "0" for i in range(columns * rows))]
    return text_file(name, "\n".join(lines) + "\n")


def test_conf_tells_scans():
    """What is known of each scan goes with the points; what is wrong with one is said, by its name."""
    range_image("a.ply", 2.0)
    range_image("none.ply", 2.0, count=0)
    path = text_file("set.conf", "camera 0 0 0 0 0 0 1\nmesh all_cybcyl 0 0 0 0 0 0 1\nbmesh a.ply 0 0 0 0 0 0 1\nbmesh lost.ply 0 0 0 0 0 0 1"
                     "\nbmesh none.ply 0 0 0 0 0 0 1\nbmesh a.ply 0 0 0 0 0 0 0\nbmesh a.ply 9 0 0 0 1 0 0\n")
    points = importers.reader(path).read(path, importers.Filter(), importers.Progress())
    first, second = scans.unpacked(points.notes["scans"])
    check((first.name, first.count) == ("a.ply", 24) and abs(first.interval - 0.1) < 1e-6, f"{first}")
    check_close(first.direction, (0, 0, -1), 1e-6, "first")
    check_close(second.direction, (0, 0, 1), 1e-6, "second")
    check_close(points.scalars["scan"], [0] * 24 + [1] * 24, 0, "scan")
    said = "\n".join(points.warnings)
    for words in ("mesh all_cybcyl is left out", "scan lost.ply is left out", "scan none.ply is left out: it has no points",
                  "scan a.ply is left out: its quaternion 0 0 0 0"):
        check(words in said, said)
    check(importers.preview(path)[0] == "5 scans", f"{importers.preview(path)}")


def test_e57_scans():
    """Directions and intervals of scans with a grid; bad poses, cells that are taken twice, scans of one point and of none are told,
    and the others are there."""
    cells = [(row, column) for column in range(6) for row in range(5)]
    wall = places(*((column * 0.1, 3, row * 0.1) for row, column in cells))
    def grid(cells):
        return {"rowIndex": ("integer", (-9, 9), [row for row, _ in cells]), "columnIndex": ("integer", (0, 9), [c for _, c in cells])}
    good, none = (1, 0, 0, 0), (0, 0, 0, 0)
    path = e57_file("scans.e57", wall | grid(cells) | {"pose": (good, (50, 0, 0))}, wall | grid(cells) | {"pose": (none, (0, 0, 0))},
                    wall | grid([(0, 0), *cells[1:-1], (0, 0)]) | {"pose": (good, (0, 0, 0))},
                    places(), places((1, 2, 3)), wall | grid([(-1, 0), *cells[1:]]),
                    wall | grid(cells) | {"pose": ((2, 0, 0, 0), (0, 7, 0))})
    points = e57.read(path, importers.Filter(), importers.Progress())
    found = scans.unpacked(points.notes["scans"])
    check([scan.count for scan in found] == [30, 0, 30, 0, 1, 30, 30], f"{found}")
    check(abs(found[0].interval - 0.1) < 1e-6 and found[0].direction[1] > 0.9, f"{found[0]}")
    check_close(sorted(set(points.scalars["scan"].tolist())), (0, 2, 4, 5, 6), 0, "scans")
    last = points.positions[points.scalars["scan"] == 6] + np.array(points.origin)
    check_close(last[:, 1], [10] * 30, 1e-4, "a quaternion of length 2 turns all the same")
    said = "\n".join(points.warnings)
    for words in ("scan 1 is left out: its quaternion 0 0 0 0", "scan 2: 1 points lie in cells", "scan 3 has no points", "scan 4 has one point",
                  "scan 5: 1 points lie in no cell", "scan 6: its quaternion is of length 2"):
        check(words in said, said)


def test_e57_in_steps():
    """Also what pye57 itself makes of a file, spherical or not, with a pose or without."""
    try:
        import pye57
    except ImportError:
        raise Skip("pye57 is not installed here") from None
    size, e57_scans.SMALL_PIECE = e57_scans.SMALL_PIECE, 500
    try:
        for name in ("libE57Format/bunnyDouble.e57", "libE57Format/ColouredCubeFloat.e57", "pdal/A_B.e57",
                     "pye57/translationWithoutRotation.e57"):
            path = shared(f"formats/e57/{name}")
            points = check_in_steps(path) if name.startswith("libE57Format/bunny") else \
                e57.read(path, importers.Filter(), importers.Progress())
            file = pye57.E57(str(path))
            scans = [file.read_scan(index, ignore_missing_fields=True) for index in range(file.scan_count)]
            wanted = np.concatenate([np.stack([scan[f"cartesian{axis}"] for axis in "XYZ"], 1) for scan in scans])
            file.close()
            check_close(points.positions.astype(np.float64) + points.origin, wanted, 2e-4, name)
    finally:
        e57_scans.SMALL_PIECE = size


def e57_file(name, *scans):
    """Each scan: {field: (node of libe57, its limits, values)}, and perhaps "pose": (rotation, translation), "limits": {...}."""
    try:
        import pye57
        from pye57 import libe57
    except ImportError:
        raise Skip("pye57 is not installed here") from None
    path = SCRATCH / name
    path.unlink(missing_ok=True)
    file = pye57.E57(str(path), mode="w")
    image = file.image_file
    image.extensionsAdd("nor", "http://www.libe57.org/E57_NOR_surface_normals.txt")
    image.extensionsAdd("las", "http://www.astm.org/COMMIT/E57/2010-las-v1.0")
    for scan in scans:
        node, prototype = libe57.StructureNode(image), libe57.StructureNode(image)
        node.set("guid", libe57.StringNode(image, "{a}"))
        if "pose" in scan:
            pose = libe57.StructureNode(image)
            node.set("pose", pose)
            for part, names, values in zip(("rotation", "translation"), ("wxyz", "xyz"), scan.pop("pose"), strict=True):
                inner = libe57.StructureNode(image)
                pose.set(part, inner)
                for axis, value in zip(names, values, strict=True):
                    inner.set(axis, libe57.FloatNode(image, value))
        if "limits" in scan:
            limits = libe57.StructureNode(image)
            node.set("colorLimits", limits)
            for key, value in scan.pop("limits").items():
                limits.set(key, libe57.IntegerNode(image, value))
        buffers = libe57.VectorSourceDestBuffer()
        for field, (kind, limits, values) in scan.items():
            integer = kind == "integer"
            prototype.set(field, libe57.IntegerNode(image, limits[0], *limits) if integer else
                          libe57.FloatNode(image, 0.0, libe57.E57_DOUBLE, -1e9, 1e9))
            scan[field] = np.array(values, np.float64)  # pye57 takes int64 for int32
            buffers.append(libe57.SourceDestBuffer(image, field, scan[field], len(values), True, True))
        points = libe57.CompressedVectorNode(image, prototype, libe57.VectorNode(image, True))
        node.set("points", points)
        file.data3d.append(node)
        writer = points.writer(buffers)
        if len(values):
            writer.write(len(values))
        writer.close()
    file.close()
    return path


def places(*points):
    return {f"cartesian{axis}": ("float", (), [point[k] for point in points]) for k, axis in enumerate("XYZ")}


def test_e57_fields():
    """All that a scan declares: normals, which turn with its pose, classes, grid; an empty scan between others."""
    turn = ((np.sqrt(0.5), 0, 0, np.sqrt(0.5)), (100.0, 0.0, 7.0))  # x becomes y
    normals = {"nor:normalX": ("float", (), (1, 0)), "nor:normalY": ("float", (), (0, 0)), "nor:normalZ": ("float", (), (0, 1))}
    more = {"rowIndex": ("integer", (0, 200000), (70000, 3)), "columnIndex": ("integer", (0, 9), (4, 5)),
            "las:classification": ("integer", (0, 255), (6, 2)), "las:odd": ("float", (), (0.5, -2.5))}
    path = e57_file("fields.e57", places((1, 0, 0), (2, 0, 0)) | normals | more | {"pose": turn}, places(),
                    places((9, 9, 9)))
    points = e57.read(path, importers.Filter(), importers.Progress())
    check_close(points.positions + np.array(points.origin), [(100, 1, 7), (100, 2, 7), (9, 9, 9)], 1e-5, "positions")
    check_close(points.normals, [(0, 1, 0), (0, 0, 1), (0, 0, 0)], 1e-6, "normals")
    for name, wanted in (("row", (70000, 3, 0)), ("column", (4, 5, 0)), ("class", (6, 2, 0)), ("odd", (0.5, -2.5, 0)),
                         ("scan", (0, 0, 2))):
        check_close(points.scalars[name], wanted, 0, name)
    stations = np.array(points.notes["scanners"]).reshape(-1, 3)
    check_close(stations[0] + points.origin, (100, 0, 7), 1e-6, "the first station")
    check(np.isnan(stations[1:]).all(), f"a scan of points alone has no station: {stations}")


def test_e57_grid():
    """Two scans of a wall: the one with a grid gets normals towards its scanner, with an empty cell and a step in depth."""
    cells = [(row, column) for column in range(6) for row in range(5) if (row, column) != (2, 2)]
    wall = places(*((column * 0.1, 3 if column < 3 else 5, row * 0.1) for row, column in cells))
    grid = {"rowIndex": ("integer", (0, 9), [row for row, _ in cells]), "columnIndex": ("integer", (0, 9), [c for _, c in cells])}
    path = e57_file("grid.e57", wall | {"pose": ((1, 0, 0, 0), (5e5, 0, 0))}, wall | grid | {"pose": ((1, 0, 0, 0), (5e5, 9, 0))})
    points = e57.read(path, importers.Filter(), importers.Progress())
    check(not points.normals[:len(cells)].any(), "a scan without a grid has none")
    check_close(points.normals[len(cells):], [(0, -1, 0)] * len(cells), 1e-4, "normals")
    check(e57.read(path, importers.Filter(every=2), importers.Progress()).normals is None, "a thinned grid is none")


def test_e57_colors():
    """Of 8 bits, of 16, and within declared limits; side by side in one file."""
    def colors(limits, *rgb):
        return {f"color{name}": ("integer", limits, [color[k] for color in rgb]) for k, name in enumerate(("Red", "Green", "Blue"))}
    limits = {f"color{name}{end}": value for name in ("Red", "Green", "Blue") for end, value in (("Minimum", 0), ("Maximum", 1023))}
    deep = places((1, 0, 0), (2, 0, 0)) | colors((0, 65535), (65535, 256, 0), (1000, 30000, 7))
    points = e57.read(e57_file("deep.e57", deep), importers.Filter(), importers.Progress())
    check(points.colors.dtype == np.float32, "16 bits were cut to 8")
    check_close(points.colors[0], (1, 256 / 65535 / 12.92, 0, 1), 1e-6, "16 bits")
    points = e57.read(e57_file("both.e57", places((1, 0, 0)) | colors((0, 255), (255, 128, 1)),
                               places((2, 0, 0)) | colors((0, 65535), (1023, 0, 1023)) | {"limits": limits}),
                      importers.Filter(), importers.Progress())
    check_close(points.colors, [(255, 128, 1, 255), (255, 0, 255, 255)], 0, "bytes")


def test_real_e57():
    """Others' test files: what opens, and a sentence for the rest."""
    e57_file("any.e57", places((0, 0, 0)))
    shared("formats/e57")
    counts = {"ColourRepresentation.e57": 153, "A_B_different_dims.e57": 2, "testWithNormals.e57": 2, "ZeroPoints.e57": 0,
              "ZeroPointsInvalid.e57": 0, "bunnyInt32.e57": 30571}
    for path in sorted((DATA / "formats/e57").glob("*/*.e57")):
        try:
            points = e57.read(path, importers.Filter(), importers.Progress())
        except importers.PatinaError as error:
            check(path.name not in counts and path.name in str(error), str(error))
            continue
        check(len(points.positions) == counts.get(path.name, len(points.positions)), f"{path.name}: {len(points.positions)}")
        check((points.normals is not None) == (path.name == "testWithNormals.e57"), f"{path.name}: normals")


def test_cancel():
    path = SCRATCH / "long.las"
    head = bytearray(227)
    head[:4], head[24:26] = b"LASF", b"\x01\x02"
    struct.pack_into("<HIIBHI", head, 94, 227, 227, 0, 0, 20, 10)
    struct.pack_into("<12d", head, 131, 1, 1, 1, 0, 0, 0, 1, 0, 1, 0, 1, 0)
    path.write_bytes(bytes(head) + bytes(200))
    progress = importers.Progress()
    progress.cancel()
    try:
        las.read(path, importers.Filter(), progress)
    except importers.PatinaError as error:
        check(error.code == -7, str(error))
    else:
        check(False, "a cancelled import went on")
