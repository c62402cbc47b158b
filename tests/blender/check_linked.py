# SPDX-License-Identifier: GPL-3.0-or-later
"""Linked clouds: a box in Blender, the points in the library, the same picture."""

import os
import time
from pathlib import Path

import bpy
import numpy as np
from check_import import columns, import_ply, write_ply
from harness import SCRATCH, check, check_close, linear, new_scene, patina, points_of, render, reports, stats
from mathutils import Matrix
from patina import choices, native
from patina.read.importers import las, library
from patina.sync.points import built, cache, linked

bpy.utils.user_resource = lambda kind, path="", create=False: str(SCRATCH)  # no test leaves files with the user


def dense(name, count=20000, offset=(0, 0, -4), extra=None):
    rng = np.random.default_rng(4)
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    positions = directions + offset
    if extra:
        positions, directions = np.vstack([positions, extra]), np.vstack([directions, directions[:1]])
    data = [(axis, "f8", positions[:, i]) for i, axis in enumerate("xyz")]
    data += [(f"n{axis}", "f4", directions[:, i]) for i, axis in enumerate("xyz")]
    data += [(channel, "u1", (directions[:, i] * 100 + 128).astype(int)) for i, channel in
             enumerate(("red", "green", "blue"))]
    return write_ply(name, data)


def test_same_picture():
    path = dense("linked.ply")
    new_scene().camera.location.z = 5.0  # scans lie at zero
    import_ply(path)
    mesh = render()
    check((mesh["Combined"][..., 3] > 0).any(), "nothing is drawn")
    new_scene().camera.location.z = 5.0
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


def test_thinned():
    """A few points of a kept cloud, evenly chosen: each is one of the file, with its color and normal; all of them where few are there."""
    rng = np.random.default_rng(7)
    positions = np.unique(rng.integers(-999, 1000, (30_000, 3)), axis=0) / 1000.0  # far from where five digits are rounded
    rng.shuffle(positions)
    count = len(positions)
    normals = positions / np.linalg.norm(positions, axis=1)[:, None]
    rgb = rng.integers(1, 256, (count, 3))
    path = write_ply("thin.ply", [(axis, "f4", positions[:, i]) for i, axis in enumerate("xyz")]
                     + [(f"n{axis}", "f4", normals[:, i]) for i, axis in enumerate("xyz")]
                     + [(name, "u1", rgb[:, i]) for i, name in enumerate(("red", "green", "blue"))])
    new_scene()
    obj, = import_ply(path, link=True)
    source = linked.source_of(obj, 1, [])
    place, offset = linked.saved_cloud(source)
    known = {tuple(point): index for index, point in enumerate(np.round(positions, 5).tolist())}
    for most, wanted in ((2000, 2000), (100_000, count), (1, 1), (0, 0)):
        places, colors, normal, scalars = native.Cloud.start_thinning(place, offset, most).result()
        check(len(places) == len(colors) == len(normal) == len(scalars) == wanted, f"{len(places)} of {most}")
        at = [known.get(tuple(point), -1) for point in np.round(places.astype(np.float64) + linked.load(source).origin, 5).tolist()]
        check(min(at, default=0) >= 0 and len(set(at)) == wanted, f"{at.count(-1)} are none of the file's, of {wanted}")
        if wanted:
            check_close(colors, linear(rgb[at]), 2e-6, "colors")
            check((np.einsum("ij,ij->i", normal, normals[at]) > 0.9999).all() and np.isnan(scalars).all(), "normals, and no scalars")
        if wanted == 2000:
            octants = np.bincount((places > 0) @ (1, 2, 4), minlength=8)
            check(octants.min() > 200, f"in the octants {octants}")
    try:
        native.Cloud.start_thinning(path, offset, 10).result()
    except native.PatinaError as error:
        check("thin.ply" in str(error), str(error))
    else:
        check(False, "a PLY file was thinned")


def saved(name, like, origin=(0.0, 0.0, 0.0)):
    """A saved cloud of a file's points, as the command line makes it; so far away."""
    found = library.read(like, patina.read.importers.Filter(), patina.read.importers.Progress())
    path = SCRATCH / name
    origin = tuple(own + more for own, more in zip(found.origin, origin, strict=True))
    native.Cloud(found.positions, found.normals, found.colors, origin=origin).start_save(path).result()
    return path


def test_saved_clouds_are_linked():
    """As they are: nothing is built, analyzed or kept, and the file stays as it is."""
    scan, path = dense("scan.ply"), SCRATCH / "site.cloud"
    new_scene()
    import_ply(scan, link=True)
    of_scan = render()
    path.write_bytes(linked.source(scan).kept.read_bytes())
    state, before = path.stat(), set(SCRATCH.iterdir())
    new_scene()
    import_ply(path, link=True)
    of_cloud = render()
    for name, pixels in of_scan.items():
        check((pixels == of_cloud[name]).all(), f"{name} differs")
    now = path.stat()
    check((now.st_mtime_ns, now.st_size, now.st_ino) == (state.st_mtime_ns, state.st_size, state.st_ino) and set(SCRATCH.iterdir()) == before, f"{set(SCRATCH.iterdir()) - before}")
    check(linked.share(linked.source(path)) and not (SCRATCH / ".patina").exists(), "it is copied beside itself")
    saved("site.cloud", dense("other.ply", 300))  # in its place
    again = render()
    check("300 points" in stats[-1] and (again["Combined"] != of_cloud["Combined"]).any(), stats[-1])


def test_saved_clouds_far_away():
    """Of a survey's coordinates the object remembers the origin, and the picture is that of points near zero, but for float64's roundings."""
    scan, far = dense("survey.ply"), (485432.0, 5428765.0, 312.0)
    pictures = []
    for name, origin in (("near.cloud", (0.0, 0.0, 0.0)), ("far.cloud", far)):
        new_scene()
        obj, = import_ply(saved(name, scan, origin), link=True, origin='SHARED')
        place = np.array(obj["patina_origin"]) if "patina_origin" in obj else np.zeros(3)
        corners = np.array([vertex.co for vertex in obj.data.vertices])
        check_close(corners.min(0) + place, np.array([-1.0, -1.0, -5.0]) + origin, 2e-2, "the box")
        check((place != 0).all() == (origin == far), f"{place}")
        obj.matrix_world = Matrix.Translation(place - origin)
        obj.patina.analysis = 'OFF'
        pictures.append(render())
    off = np.abs(pictures[0]["Combined"] - pictures[1]["Combined"]).max(axis=-1)
    check((pictures[0]["Combined"][..., 3] > 0).mean() > 0.05 and (off > 0.02).mean() < 0.002, f"{(off > 0.02).mean():.4f} of the pixels differ")


def test_saved_clouds_that_are_none():
    good = saved("good.cloud", dense("good.ply", 100)).read_bytes()
    for name, data, told in (("cut", good[:5000], "cut short"), ("text", b"x y z", "not a saved cloud"), ("empty", b"", "not a saved cloud")):
        path = SCRATCH / f"{name}.cloud"
        path.write_bytes(data)
        new_scene()
        try:
            import_ply(path, link=True)
        except RuntimeError as error:
            check(told in str(error), str(error))
        else:
            raise AssertionError(f"{name} is linked")
        check(path.read_bytes() == data, f"{name} is thrown away")
    obj, = import_ply(SCRATCH / "good.cloud")  # which links it, whatever is asked for
    check(obj.patina.linked_file.endswith("good.cloud"), "it is not linked")
    try:
        bpy.ops.export_scene.patina_points(filepath=str(SCRATCH / "out.ply"))
    except RuntimeError as error:
        check("cannot be read back. Use the file that it was made from" in str(error), str(error))
    else:
        raise AssertionError("its points were exported")
    check("100 points" in patina.read.importers.preview(SCRATCH / "good.cloud")[1], "the file dialog's preview")


def test_saved_clouds_among_kept_ones():
    """The folder of what is kept may be one that the artist has such files in: they are not ours to let go."""
    good = saved("town.cloud", dense("good.ply", 100))
    beside = [good, SCRATCH / "town.json", SCRATCH / "town.scan", SCRATCH / "town-packed.cloud"]
    for path in beside[1:]:
        path.write_text("{}")
    most, choices.cache_bytes = choices.cache_bytes, lambda: 0
    try:
        for name in ("first.ply", "second.ply"):
            linked.load(linked.source(dense(name, 5000)))
    finally:
        choices.cache_bytes = most
    check(not linked.source(SCRATCH / "first.ply").kept.exists() and linked.source(SCRATCH / "second.ply").kept.exists(), "nothing is let go")
    cache.clear()
    check(not linked.source(SCRATCH / "second.ply").kept.exists() and all(path.exists() for path in beside), f"{list(map(Path.exists, beside))}")


def test_saved_clouds_among_other_files():
    """Each comes as it can: Sequence, which belongs to Link, counts for none of them."""
    paths = [saved("town_1.cloud", dense("good.ply", 100)), saved("town_2.cloud", dense("good.ply", 200)), dense("mesh.ply", 300)]
    new_scene()
    objects = import_ply(*paths, sequence=True)
    check([(bool(obj.patina.linked_file), len(points_of(obj))) for obj in objects] == [(False, 300), (True, 8), (True, 8)],
          f"{[(obj.name, obj.patina.linked_file) for obj in objects]}")
    check([Path(obj.patina.linked_file).name for obj in objects[1:]] == ["town_1.cloud", "town_2.cloud"], "other files")


def test_saved_clouds_that_are_replaced():
    """By one whose box begins elsewhere: its points lie where they lay in the survey. By one of elsewhere: near its own origin."""
    near, far = dense("near.ply"), (485432.0, 5428765.0, 312.0)
    new_scene()
    obj, = import_ply(saved("again.cloud", near, far), link=True)
    obj.patina.analysis = 'OFF'
    obj.matrix_world = Matrix.Translation(np.array(obj["patina_origin"]) - far)
    first = render()
    saved("again.cloud", dense("wider.ply", extra=(-1.7, 0.0, -4.0)), far)
    second = render()
    check("20,001 points" in stats[-1], stats[-1])
    off = np.abs(first["Combined"] - second["Combined"]).max(axis=-1)
    check((off > 0.02).mean() < 0.01, f"{(off > 0.02).mean():.4f} of the pixels differ")
    obj.matrix_world = Matrix.Identity(4)
    saved("again.cloud", near)
    check((render()["Combined"][..., 3] > 0).mean() > 0.05, "a cloud of elsewhere is not seen")


def test_file_that_is_cut_short():
    """A linked cloud whose file is cut short while it is drawn: the rest is drawn, Blender goes on, and all of it is drawn once the file is
    back, with the time stamp that it had."""
    new_scene()
    path = saved("cut.cloud", dense("cut.ply", 60000))
    import_ply(path, link=True)
    built.CACHE.clear()
    first, (cloud,) = render(), [cloud for _, cloud in built.CACHE._entries.values()]
    whole, status, before = path.read_bytes(), path.stat(), native.losses()
    os.truncate(path, len(whole) // 3)
    with native.Device("cpu") as device, native.Scene() as scene, native.Frame(device) as frame:
        scene.add_cloud(cloud)
        scene.set_camera(world_from_camera=(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1), left=-.5, right=.5, bottom=-.5, top=.5,
                         near_clip=.1, far_clip=100)
        scene.set_settings(width=160, height=120)
        frame.render(scene)
        check(frame.stats()["points_lost"] > 0 and native.losses() > before, "points are lost")
    lines = [text for _, text in native.log_lines() if "cut.cloud" in text]
    check(len(lines) == 1, f"one line names the file: {lines}")
    path.write_bytes(whole)
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))
    check((render()["Combined"] == first["Combined"]).all(), "drawn as before once it is back")


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
    file = library.read(SCRATCH / "back.ply", patina.read.importers.Filter(), patina.read.importers.Progress())
    check_close(file.positions.astype(np.float64) + file.origin, before, 1e-4, "positions")
    check("intensity" in file.scalars and file.normals is not None and file.colors is not None, f"{list(file.scalars)}")


def test_cancel_while_reading():
    """A wish to stop reaches the reader of a linked file, which leaves nothing half behind."""
    path = dense("slow.ply", 200000)
    progress = patina.read.importers.Progress()
    progress.cancel()
    try:
        linked.load(linked.source(path), progress)
    except patina.read.importers.PatinaError as error:
        check(error.code == -7, str(error))
    else:
        check(False, "a cancelled file was read")
    check(not linked.source(path).kept.exists(), "half a cloud was kept")
    check(linked.load(linked.source(path)).cloud.count == 200000, "the next time it is read")


def test_reading_in_steps():
    """A file that changed is read in tasks, or in short pieces: nobody waits for it, and who loses interest just stops."""
    path = dense("steps.ply", 50000)
    kinds = [type(step).__name__ for step in linked.steps(linked.source(path), patina.read.importers.Progress())]
    check(kinds == ["Task"] * 4, f"PLY: {kinds}")  # open, build, analyze, save
    import_ply(path)
    points = SCRATCH / "steps.las"
    bpy.ops.export_scene.patina_points(overwrite=True, filepath=str(points), kind='LAS')
    piece, las.SMALL_PIECE = las.SMALL_PIECE, 10000
    try:
        kinds = [type(step).__name__ for step in linked.steps(linked.source(points), patina.read.importers.Progress())]
        check(kinds == ["Pause"] * 5 + ["Task"] * 3, f"LAS: {kinds}")
        os.utime(points, (1, 1))
        given_up = linked.steps(linked.source(points), patina.read.importers.Progress())
        next(given_up)
        given_up.close()
    finally:
        las.SMALL_PIECE = piece
    check(not linked.source(points).kept.exists(), "half a cloud was kept")
    check(linked.load(linked.source(points)).cloud.count == 50000, "the next time it is read")
