# SPDX-License-Identifier: GPL-3.0-or-later
"""Linked clouds: a box in Blender, the points in the library, the same picture."""

import os
import time

import bpy
import numpy as np
from check_import import columns, import_ply, write_ply
from harness import SCRATCH, check, check_close, new_scene, patina, render, reports, stats
from patina.importers import las, library
from patina.sync import linked

bpy.utils.user_resource = lambda kind, path="", create=False: str(SCRATCH)  # no test leaves files with the user


def dense(name, count=20000, offset=(0, 0, -4)):
    rng = np.random.default_rng(4)
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    positions = directions + offset
    data = [(axis, "f8", positions[:, i]) for i, axis in enumerate("xyz")]
    data += [(f"n{axis}", "f4", directions[:, i]) for i, axis in enumerate("xyz")]
    data += [(channel, "u1", (directions[:, i] * 100 + 128).astype(int)) for i, channel in
             enumerate(("red", "green", "blue"))]
    return write_ply(name, data)


def test_same_picture():
    path = dense("linked.ply")
    new_scene()
    import_ply(path)
    mesh = render()
    new_scene()
    obj, = import_ply(path, link=True)
    check(len(obj.data.vertices) == 8 and len(obj.data.edges) == 12, "not a box")
    link = render()
    check("20,000 points" in stats[-1], stats[-1])
    for name, pixels in mesh.items():
        check((pixels == link[name]).all(), f"{name} differs")


def test_opens_from_its_cache():
    count = 100000
    path = dense("cached.ply", count)
    first = linked.load(linked.source(path))
    read, library.steps = library.steps, lambda *arguments: 1 / 0
    start = time.perf_counter()
    try:
        again = linked.load(linked.source(path))
    finally:
        library.steps = read
    print(f"  opened again in {time.perf_counter() - start:.3f} s, {again.cloud.bytes / count:.2f} bytes a point in memory")
    check(again.cloud.count == first.cloud.count and again.box == first.box, "another cloud")
    check(again.cloud.bytes < count, f"{again.cloud.bytes} bytes of memory")
    linked.source(path).kept.write_bytes(b"patina\n\x1a" + bytes(1000))
    check(linked.load(linked.source(path)).cloud.count == count, "a damaged cache is built anew")
    os.utime(path, (1, 1))
    linked.load(linked.source(path))
    kept = list(SCRATCH.glob(linked.source(path).kept.name.split("-")[0] + "-*.cloud"))
    check(len(kept) == 1, f"old caches stay: {kept}")


def test_missing_file():
    path = dense("gone.ply")
    new_scene()
    import_ply(path, link=True)
    path.unlink()
    render()
    check(any("gone.ply is missing" in text for _, text in reports), f"{reports}")


def test_to_mesh_and_back():
    path = write_ply("convert.ply", columns((485432.0, 5428765.0, 312.0), "f8"))
    new_scene()
    obj, = import_ply(path, link=True)
    place = np.array(obj["patina_origin"])
    bpy.ops.object.patina_linked_to_mesh()
    check(len(obj.data.vertices) == 500 and not obj.patina.linked_file, "not a mesh")
    before = np.array([vertex.co for vertex in obj.data.vertices]) + place
    bpy.ops.object.patina_mesh_to_linked(filepath=str(SCRATCH / "back.ply"))
    check(len(obj.data.vertices) == 8 and obj.patina.linked_file.endswith("back.ply"), "not linked")
    file = library.read(SCRATCH / "back.ply", patina.importers.Filter(), patina.importers.Progress())
    check_close(file.positions.astype(np.float64) + file.origin, before, 1e-4, "positions")
    check("intensity" in file.scalars and file.normals is not None and file.colors is not None, f"{list(file.scalars)}")


def test_cancel_while_reading():
    """A wish to stop reaches the reader of a linked file, which leaves nothing half behind."""
    path = dense("slow.ply", 200000)
    progress = patina.importers.Progress()
    progress.cancel()
    try:
        linked.load(linked.source(path), progress)
    except patina.importers.PatinaError as error:
        check(error.code == -7, str(error))
    else:
        check(False, "a cancelled file was read")
    check(not linked.source(path).kept.exists(), "half a cloud was kept")
    check(linked.load(linked.source(path)).cloud.count == 200000, "the next time it is read")


def test_reading_in_steps():
    """A file that changed is read in tasks, or in short pieces: nobody waits for it, and who loses interest just stops."""
    path = dense("steps.ply", 50000)
    kinds = [type(step).__name__ for step in linked.steps(linked.source(path), patina.importers.Progress())]
    check(kinds == ["Task"] * 4, f"PLY: {kinds}")  # open, build, analyze, save
    import_ply(path)
    points = SCRATCH / "steps.las"
    bpy.ops.export_scene.patina_points(filepath=str(points), kind='LAS')
    piece, las.SMALL_PIECE = las.SMALL_PIECE, 10000
    try:
        kinds = [type(step).__name__ for step in linked.steps(linked.source(points), patina.importers.Progress())]
        check(kinds == ["Pause"] * 5 + ["Task"] * 3, f"LAS: {kinds}")
        os.utime(points, (1, 1))
        given_up = linked.steps(linked.source(points), patina.importers.Progress())
        next(given_up)
        given_up.close()
    finally:
        las.SMALL_PIECE = piece
    check(not linked.source(points).kept.exists(), "half a cloud was kept")
    check(linked.load(linked.source(points)).cloud.count == 50000, "the next time it is read")
