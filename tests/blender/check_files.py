# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths of linked files go the ways of an image's: relative, mapped anew, found, packed."""

import os
import shutil
from pathlib import Path

import bpy
from check_import import import_ply
from check_linked import dense
from harness import SCRATCH, check, new_scene, render, reports
from patina.sync.points import files, linked


def places(name):
    """Two folders of their own, the first with a scan in a folder within."""
    base = SCRATCH / f"files_{name}"
    shutil.rmtree(base, ignore_errors=True)
    for folder in ("first/scans", "second"):
        (base / folder).mkdir(parents=True)
    scan = base / "first/scans/scan.ply"
    shutil.copyfile(dense("files.ply"), scan)
    return base, scan


def far_scene():
    """Whose camera sees a scan that lies at zero."""
    scene = new_scene()
    scene.camera.location.z = 5.0


def save(path):
    bpy.ops.wm.save_as_mainfile(filepath=str(path), relative_remap=True)


def test_linked_path_is_made_relative_and_absolute():
    base, scan = places("relative")
    far_scene()
    obj, = import_ply(scan, link=True)
    check(files.path_of(obj) == scan, f"{files.path_of(obj)}")
    save(base / "first/scene.blend")
    bpy.ops.file.make_paths_relative()
    check(obj.patina.linked_data.filepath == "//scans/scan.ply", obj.patina.linked_data.filepath)
    check(files.path_of(obj) == scan and "20,000" in drawn_points(), "and is drawn still")
    save(base / "first/scene.blend")
    check(obj.patina.linked_file == "//scans/scan.ply", f"what scripts see once it is saved: {obj.patina.linked_file}")
    bpy.ops.file.make_paths_absolute()
    check(obj.patina.linked_data.filepath == str(scan), obj.patina.linked_data.filepath)
    check(obj.patina.linked_file == str(scan), f"what scripts see at once: {obj.patina.linked_file}")


def drawn_points():
    from harness import stats
    render()
    check(not reports, f"{reports}")
    return stats[-1]


def test_a_moved_project_finds_its_scan():
    """File and scan go to another folder together, as to a farm or a colleague."""
    base, scan = places("moved")
    far_scene()
    import_ply(scan, link=True)
    save(base / "first/scene.blend")
    bpy.ops.file.make_paths_relative()
    save(base / "first/scene.blend")
    moved = base / "elsewhere"
    (base / "first").rename(moved)
    bpy.ops.wm.open_mainfile(filepath=str(moved / "scene.blend"))
    obj = bpy.data.objects["scan"]
    check(files.path_of(obj) == moved / "scans/scan.ply", f"{files.path_of(obj)}")
    check("20,000" in drawn_points(), "not drawn")


def test_save_as_elsewhere_maps_it_anew():
    base, scan = places("save_as")
    save(base / "first/scene.blend")
    far_scene()
    obj, = import_ply(scan, link=True)
    check(obj.patina.linked_file == "//scans/scan.ply", f"new ones are as the preferences say: {obj.patina.linked_file}")
    save(base / "second/scene.blend")
    check(obj.patina.linked_data.filepath == "//../first/scans/scan.ply", obj.patina.linked_data.filepath)
    bpy.ops.wm.open_mainfile(filepath=str(base / "second/scene.blend"))
    check(files.path_of(bpy.data.objects["scan"]).samefile(scan), "lost by opening it again")
    check("20,000" in drawn_points(), "not drawn")


def test_missing_scan_is_found():
    base, scan = places("found")
    far_scene()
    obj, = import_ply(scan, link=True)
    save(base / "first/scene.blend")
    (base / "second/deep").mkdir()
    scan.rename(base / "second/deep/scan.ply")
    render()
    check(any("scan.ply is missing" in text for _, text in reports), f"{reports}")
    bpy.ops.file.find_missing_files(directory=str(base / "second"))
    check(files.path_of(obj).samefile(base / "second/deep/scan.ply"), f"{files.path_of(obj)}")
    check(Path(bpy.path.abspath(obj.patina.linked_file)).samefile(base / "second/deep/scan.ply"), f"scripts see {obj.patina.linked_file}")
    check("20,000" in drawn_points(), "not drawn")


def test_packed_scan_needs_no_file():
    base, scan = places("packed")
    far_scene()
    obj, = import_ply(scan, link=True)
    whole = render()
    save(base / "first/scene.blend")
    bpy.ops.file.pack_all()
    save(base / "second/packed.blend")
    scan.unlink()
    for kept in linked.source(files.path_of(obj)).kept.parent.glob("*"):  # a farm's node has no cache either
        if kept.is_file() and (kept.suffix == ".cloud" or "packed" in kept.name):
            kept.unlink()
    bpy.ops.wm.open_mainfile(filepath=str(base / "second/packed.blend"))
    obj = bpy.data.objects["scan"]
    picture = render()
    check(not reports, f"{reports}")
    for name, pixels in whole.items():
        check((pixels == picture[name]).all(), f"{name} differs")
    bpy.ops.file.unpack_all(method='WRITE_ORIGINAL')
    check(scan.is_file() and files.path_of(obj).samefile(scan), "not put back")
    check(Path(os.path.normpath(bpy.path.abspath(obj.patina.linked_file))) == scan, f"scripts see {obj.patina.linked_file}")


def test_objects_share_a_file_and_part():
    base, scan = places("shared")
    other = base / "second/other.ply"
    shutil.copyfile(scan, other)
    far_scene()
    first, = import_ply(scan, link=True)
    second, = import_ply(scan, link=True)
    check(first.patina.linked_data == second.patina.linked_data, "one file is packed twice")
    second.patina.linked_file = str(other)
    check(files.path_of(first).samefile(scan) and files.path_of(second).samefile(other), "the other object's file changed too")
    second.patina.linked_file = ""
    check(files.path_of(second) is None and files.path_of(first).samefile(scan), "not let go")


def test_sequence_keeps_its_pattern():
    base, scan = places("sequence")
    for number in (3, 4):
        shutil.copyfile(scan, base / f"first/scans/step_{number:03}.ply")
    far_scene()
    bpy.ops.import_scene.patina_points(filepath=str(base / "first/scans/step_003.ply"), link=True, sequence=True)
    obj = bpy.context.view_layer.objects.active
    save(base / "first/scene.blend")
    bpy.ops.file.make_paths_relative()
    held = obj.patina.linked_data
    check((held.filepath, held.is_sequence) == ("//scans/step_003.ply", True), f"{held.filepath}")
    check(files.path_of(obj) == base / "first/scans/step_###.ply", f"{files.path_of(obj)}")
    check(obj.patina.linked_file == "//scans/step_###.ply", obj.patina.linked_file)


def test_files_of_older_versions():
    """Those have the path as text alone."""
    base, scan = places("older")
    far_scene()
    obj, = import_ply(scan, link=True)
    save(base / "first/scene.blend")
    obj.patina.property_unset("linked_data")
    old = obj.patina if bpy.app.version < (5, 0, 0) else obj.patina.bl_system_properties_get()
    old["linked_file"] = "//scans/scan.ply"
    check(files.path_of(obj) == scan and obj.patina.linked_file == "//scans/scan.ply", "a text alone is enough")
    save(base / "first/older.blend")
    bpy.ops.wm.open_mainfile(filepath=str(base / "first/older.blend"))
    obj = bpy.data.objects["scan"]
    held = obj.patina.linked_data
    check(held is not None and held.filepath == "//scans/scan.ply", "not brought to the present form")
    held.filepath = "//other.ply"
    check(obj.patina.linked_file == "//other.ply", "the old text still speaks")
    obj.patina.linked_file = ""
    check(obj.patina.linked_file == "" and files.path_of(obj) is None, "let go, the old text comes back")


def test_overridden_from_a_library():
    """An override links another file than its library's object, from then on."""
    base, scan = places("override")
    far_scene()
    import_ply(scan, link=True)
    save(base / "first/library.blend")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    save(base / "second/user.blend")
    with bpy.data.libraries.load(str(base / "first/library.blend"), link=True) as (_, wanted):
        wanted.objects = ["scan"]
    bpy.context.scene.collection.objects.link(obj := bpy.data.objects["scan"].override_create())
    obj.patina.linked_file = "//other.ply"
    save(base / "second/user.blend")
    bpy.ops.wm.open_mainfile(filepath=str(base / "second/user.blend"))
    found = {bool(item.library): item.patina.linked_file for item in bpy.data.objects}
    check(found[False] == "//other.ply" and found[True].endswith("scan.ply"), f"{found}")


def test_linked_from_a_library():
    """The path is relative to the library that holds the object."""
    base, scan = places("library")
    far_scene()
    import_ply(scan, link=True)
    save(base / "first/library.blend")
    bpy.ops.file.make_paths_relative()
    save(base / "first/library.blend")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    far_scene()
    save(base / "second/user.blend")
    with bpy.data.libraries.load(str(base / "first/library.blend"), link=True) as (_, wanted):
        wanted.objects = ["scan"]
    obj = bpy.data.objects["scan"]
    bpy.context.scene.collection.objects.link(obj)
    check(Path(os.path.normpath(files.path_of(obj))) == scan, f"{files.path_of(obj)}")
    check("20,000" in drawn_points(), "not drawn")


def test_leaves_no_file_open():
    """The tests that follow begin with an unsaved one."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    check(not bpy.data.filepath, bpy.data.filepath)
