# SPDX-License-Identifier: GPL-3.0-or-later
"""Scans of a cloud, imported and linked: listed by name, hidden, solo, graded, balanced, saved; stations as empties."""

import bpy
import numpy as np
from check_formats import range_image, text_file
from check_import import import_ply, write_ply
from harness import SCRATCH, check, check_close, drawn, new_scene, render
from patina import point_data
from patina.operators import stations

PTX = "3\n2\n{0} 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n{0} 0 0 1\n"
WALL = "".join(f"{u / 4} 5 {v / 4} 0.5\n" for u in range(3) for v in range(2))


def pair(link, name="pair"):
    """A .conf of two range images, the first at the picture's left, the second at its right."""
    scene = new_scene(64, 64)
    scene.camera.data.type, scene.camera.data.ortho_scale = 'ORTHO', 2.5
    range_image("left.ply", -4.0, 10, 10)
    range_image("right.ply", -4.0, 8, 10)
    path = text_file(f"{name}.conf", "bmesh left.ply -1.1 -0.5 0 0 0 0 1\nbmesh right.ply 0.2 -0.5 0 0 0 0 1\n")
    obj, = import_ply(path, link=link)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.patina_scans_list()
    return obj


def sides():
    """How many pixels are drawn at the left and at the right."""
    columns = np.array([column for _, column in drawn(render())])
    return int((columns < 32).sum()), int((columns >= 32).sum())


def check_hiding(link):
    obj = pair(link)
    scans = obj.patina.points.scans
    check([scan.name for scan in scans] == ["left.ply", "right.ply"], f"{[scan.name for scan in scans]}")
    check([scan.count for scan in scans] == ["100", "80"], f"{[scan.count for scan in scans]}")
    whole = sides()
    check(min(whole) > 60, f"{whole}")
    scans[0].hide = True
    check(sides() == (0, whole[1]), "the left one is hidden")
    scans[0].hide, scans[0].solo = False, True
    check(sides() == (whole[0], 0), "the left one alone")
    scans[1].solo = True
    check(sides() == whole, "both are solo")
    scans[1].hide = True
    check(sides() == (whole[0], 0), "what is hidden is not drawn, solo or not")
    bpy.ops.object.patina_scans_list()
    check(obj.patina.points.scans[1].hide and obj.patina.points.scans[0].solo, "listed again they keep what they are")
    path = SCRATCH / f"scans_{link}.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    check(sides() == (whole[0], 0), "saved and opened")
    bpy.context.view_layer.objects.active = bpy.data.objects["pair"]
    bpy.ops.object.patina_scans_reset()
    check(sides() == whole, "all is back")


def test_scans_are_hidden():
    check_hiding(False)


def test_scans_of_links_are_hidden():
    check_hiding(True)


def test_color_by_scan():
    """Of imported points too."""
    obj = pair(False)
    bpy.ops.object.patina_scans_color()
    check(obj.patina.colors.scalar == "scan", obj.patina.colors.scalar)
    picture = render()["Combined"]
    left, right = picture[:, :32][picture[:, :32, 3] > 0], picture[:, 32:][picture[:, 32:, 3] > 0]
    check(np.ptp(left[:, :3], axis=0).max() < 1e-3 and np.abs(left[0] - right[0]).max() > 0.3, f"{left[0]} {right[0]}")


def test_scans_of_one():
    """Points that are of no scan are one, which can be hidden too; other attributes are none."""
    scene = new_scene(64, 64)
    scene.camera.data.type, scene.camera.data.ortho_scale = 'ORTHO', 2.5
    obj, = import_ply(range_image("one.ply", -4.0, 10, 10))
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.patina_scans_list()
    item, = obj.patina.points.scans
    check(item.number == -1 and len(drawn(render())) > 60, f"{item.name} {item.number}")
    item.hide = True
    check(not drawn(render()), "all is hidden")


def colored_pair(name="colors.ply", gains=((1, 1, 1), (1, 1, 1)), link=False, count=60):
    """A wall of points twice, of scans 0 and 5, with the same pattern of colors times the gains; the second begins in its middle."""
    y, x = (values.reshape(-1) for values in np.mgrid[:count, :count])
    places, colors, scan = [], [], []
    for index, (first, gain) in enumerate(zip((0, count // 2), gains, strict=True)):
        u, v = (x + first + 0.3 * index) / count * 1.4 - 1, (y + 0.4 * index) / count * 1.4 - 0.7
        light = 0.2 + 0.1 * np.stack([np.sin(5 * u + k) * np.cos(7 * v - k) for k in range(3)], 1)
        linear = light * gain
        places.append(np.stack([u, v, np.full_like(u, -4.0)], 1))
        colors.append(np.rint(255 * np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055)))
        scan.append(np.full(len(u), 5 * index))
    places, colors, scan = map(np.concatenate, (places, colors, scan))
    path = write_ply(name, [(axis, "f4", places[:, k]) for k, axis in enumerate("xyz")]
                     + [(axis, "u1", colors[:, k]) for k, axis in enumerate(("red", "green", "blue"))] + [("scan", "u1", scan)])
    scene = new_scene(64, 64)
    scene.camera.data.type, scene.camera.data.ortho_scale = 'ORTHO', 3.0
    obj, = import_ply(path, link=link)
    bpy.context.view_layer.objects.active = obj
    return obj


def test_meshes_are_graded():
    """One scan of imported points; colors that change afterwards are graded anew."""
    obj = colored_pair()
    bpy.ops.object.patina_scans_list()
    before = render()["Combined"]
    lit = before[..., 3] > 0
    right = lit & (np.arange(64) >= 48)
    left = lit & (np.arange(64) < 24)
    obj.patina.points.scans[1].gain = 0.5
    check(obj.patina.points.scans[1].name == "Scan 5", obj.patina.points.scans[1].name)
    after = render()["Combined"]
    check(right.sum() > 100 and left.sum() > 100 and (after[left] == before[left]).all(), "scan 0 stays")
    check_close(after[right][:, :3], 0.5 * before[right][:, :3], 0.005, "half as bright")
    colors = obj.data.attributes["Col"].data
    colors.foreach_set("color_srgb", np.tile(np.float32((1, 1, 1, 1)), len(colors)))
    point_data.changed(obj.data)
    check_close(render()["Combined"][right][:, :3], np.full((right.sum(), 3), 0.5), 0.005, "of new colors")


def test_stations():
    """An empty where each scanner stood, a child of the points; shown once."""
    new_scene()
    path = text_file("stations.ptx", PTX.format(10) + WALL + PTX.format(20) + WALL)
    for link in (False, True):
        before = set(bpy.data.objects)
        bpy.ops.import_scene.patina_points(filepath=str(path), link=link)
        new = set(bpy.data.objects) - before
        obj, = (item for item in new if item.type in point_data.TYPES)
        empties = sorted((item for item in new if item.type == 'EMPTY'), key=lambda item: item["patina_station"])
        check([item.parent for item in empties] == [obj, obj], f"{new}")
        bpy.context.view_layer.update()
        check_close([item.matrix_world.translation for item in empties], [(10, 0, 0), (20, 0, 0)], 1e-5, "places")
        check(obj.select_get() and not any(item.select_get() for item in empties), "the points alone are selected")
        bpy.context.view_layer.objects.active = obj
        check(not bpy.ops.object.patina_add_stations.poll(), "all are there")
        bpy.data.objects.remove(empties[0])
        bpy.ops.object.patina_add_stations()
        check(sorted(child["patina_station"] for child in obj.children) == [0, 1], "the lost one is back")
    bpy.ops.object.patina_linked_to_mesh()
    check(len(obj.children) == 2 and not bpy.ops.object.patina_add_stations.poll(), "converted they stay, once")
    other, = import_ply(path, stations=False)
    check(not other.children, "not where they are not wanted")


def test_many_stations_come_in_parts():
    """Thousands of scans: Blender would take half a minute for their empties, so the import adds the first of them."""
    new_scene()
    path = text_file("many.ptx", "".join(PTX.format(10 * i) + WALL for i in range(1, 6)))
    most, stations.MOST = stations.MOST, 2
    try:
        obj, = import_ply(path)
        for wanted in ([0, 1], [0, 1, 2, 3], [0, 1, 2, 3, 4]):
            check(sorted(child["patina_station"] for child in obj.children) == wanted, f"{[child.name for child in obj.children]}")
            bpy.context.view_layer.objects.active = obj
            if len(wanted) < 5:
                bpy.ops.object.patina_add_stations()
    finally:
        stations.MOST = most


def overlap(count, rng, outliers=0.1):
    """Scans of a bumpy wall, each overlapping the next by half, of one pattern of light; a share of it differs, as what moved."""
    places, light, of = [], [], []
    for scan in range(count):
        u, v = rng.uniform(0, 2, 20000) + scan, rng.uniform(0, 2, 20000)
        places.append(np.stack([u, v, 0.1 * np.sin(3 * u) * np.cos(2 * v)], 1))
        seen = 0.25 + 0.15 * np.stack([np.sin(4 * u + k) * np.cos(5 * v - k) for k in range(3)], 1)
        moved = (np.abs(v - 0.3) < outliers) & (scan % 2 == 1)
        light.append(np.where(moved[:, None], 0.9 - seen, seen) * rng.normal(1, 0.05, (20000, 1)))
        of.append(np.full(20000, scan))
    return np.concatenate(places), np.concatenate(light), np.concatenate(of)


def test_known_gains_are_found():
    """Of four scans in a row, with noise and things that moved, within 2 %; their mean is 1, and a scan apart is left."""
    from patina import native
    from patina.native.points import gains
    rng = np.random.default_rng(24)
    places, light, of = overlap(4, rng)
    known = np.array([(1, 1, 1), (0.6, 0.7, 0.8), (1.2, 1.0, 0.9), (0.9, 1.3, 1.1)])
    apart = places[of == 0] + (0, 100, 0)
    every = np.concatenate([places, apart]).astype(np.float32)
    exposed = np.concatenate([light * known[of], 0.5 * light[of == 0]]).astype(np.float32)
    scans = np.concatenate([of, np.full(len(apart), 4)]).astype(np.uint16)
    found = gains(native.Cloud(every, None, exposed), scans, 5)
    check_close(found[4], (1, 1, 1), 1e-9, "apart")
    left = found[:4] * known
    check_close(left / left[0], np.ones((4, 3)), 0.02, "what is left of the gains")
    check_close(found[:4].mean(axis=0), (1, 1, 1), 1e-5, "the mean")
    try:
        gains(native.Cloud(every, None, None), scans, 5)
    except native.PatinaError as error:
        check("no colors" in str(error), str(error))
    else:
        check(False, "gains of no colors")


def check_balance(link):
    """In the image: both halves of a wall that was photographed twice are as bright by default, as listing or not the scans."""
    known = np.array(((1, 1, 1), (0.6, 0.8, 1.3)))
    obj = colored_pair(f"balance_{link}.ply", known, link)
    group = obj.patina.points
    check(group.use_balance, "it is on")
    after = render()["Combined"]
    group.use_balance = False
    before = render()["Combined"]
    group.use_balance = True
    check((render()["Combined"] == after).all(), "on again")
    lit = before[..., 3] > 0
    right, left = lit & (np.arange(64) >= 48), lit & (np.arange(64) < 24)
    gains = [np.median(after[side][:, :3] / before[side][:, :3], axis=0) for side in (left, right)]
    check_close(gains[1] * known[1] / gains[0], (1, 1, 1), 0.02, "gains")
    check_close(np.mean(gains, axis=0), (1, 1, 1), 0.02, "the mean")
    for side, gain in zip((left, right), gains, strict=True):
        check_close(after[side][:, :3], before[side][:, :3] * gain, 0.01, "one gain for all of a scan")
    bpy.ops.object.patina_scans_list()
    check((render()["Combined"] == after).all(), "listed")
    group.scans[1].gain = 0.5
    half = render()["Combined"]
    check_close(half[right][:, :3], 0.5 * after[right][:, :3], 0.01, "graded on top")
    obj.patina.colors.source = 'FIXED'
    fixed = render()["Combined"]
    group.use_balance = False
    check((render()["Combined"] == fixed).all(), "nothing to balance of one color")


def test_balance():
    check_balance(False)


def test_balance_of_links():
    check_balance(True)


def test_scans_without_colors():
    """They have nothing to balance, and are drawn."""
    obj = pair(False)
    check(obj.patina.points.use_balance and len(drawn(render())) > 60, "drawn")


def test_range_images():
    """The mode for one object and for the scene; culling leaves scans out that looked the other way; settings reach the picture."""
    obj = pair(False, "ranges")
    group = obj.patina.ranges
    whole = sides()
    group.use = True
    ranged = render()["Combined"]
    check(min(sides()) > 0.8 * min(whole), f"{sides()} of {whole}")
    group.use = False
    bpy.context.scene.patina.surface = 'RANGES'
    check((render()["Combined"] == ranged).all(), "the scene's mode is the object's")
    group.use_cull = True
    check((render()["Combined"] == ranged).all(), "scans that looked as the view does stay")
    bpy.context.scene.camera.location.z, bpy.context.scene.camera.rotation_euler.y = -8.0, np.pi
    check(not drawn(render()), "from behind all are left out")
    group.use_cull = False
    check(drawn(render()), "without culling they are there")
    for name, value in (("pixel", 12.0), ("gamma", 0.5), ("sharpness", 0.6)):
        setattr(group, name, value)
        check(drawn(render()), f"{name} {value}")
    bpy.context.scene.camera.location.z, bpy.context.scene.camera.rotation_euler.y = 0.0, 0.0
    range_image("behind.ply", -6.0, 10, 10)
    group.use_cull, group.use_pixel, group.use_gamma, group.use_sharpness = False, False, False, False
    behind, = import_ply(text_file("walls.conf", "bmesh left.ply -0.5 -0.5 0 0 0 0 1\nbmesh behind.ply -0.5 -0.5 0 0 0 0 1\n"))
    obj.hide_render, behind.patina.opacity = True, 0.5
    shares = []
    for behind.patina.d_min in (0.0, 0.2, 5.0):
        shares.append(float(np.median([alpha for alpha in render()["Combined"][..., 3].flat if alpha > 0])))
    check_close(shares, (0.75, 0.75, 0.5), 0.02, "a layer distance beyond the way between two walls makes one layer of them")
    obj.hide_render = False
    bpy.data.objects.remove(behind)
    group.pixel, group.sharpness = 0.3, 0.1  # below what the library takes
    check(drawn(render()), "clamped")


def ptx_scan(place, columns, rows, cells=None, turn="1 0 0 0\n0 1 0 0\n0 0 1 0\n", wall=5.0):
    """One scan: a wall across y, from -1 to 1, cells 0.125 apart of which one in a corner has no return. cells: how many are there."""
    lines = [f"{-1 + 0.125 * u:g} {wall} {-1 + 0.125 * v:g} 0.5" for u in range(columns) for v in range(rows)]
    lines[0] = "0 0 0 0.5"
    x, y, z = place
    return f"{columns}\n{rows}\n{x} {y} {z}\n1 0 0\n0 1 0\n0 0 1\n{turn}{x} {y} {z} 1\n" + "\n".join(lines[:cells]) + "\n"


def test_ptx_is_range_images():
    """Two scans, each with its grid, are one object with the scans as an attribute and stations as empties; it renders as range images,
    whose normals need no analysis, linked too; each scan is hidden, and left out by its direction."""
    path = text_file("grids.ptx", ptx_scan((0, 0, 0), 17, 17) + ptx_scan((1, -1, 0), 13, 17, wall=6.0625))
    for link in (False, True):
        scene = new_scene(64, 64)
        scene.camera.rotation_euler.x, scene.camera.data.type, scene.camera.data.ortho_scale = np.pi / 2, 'ORTHO', 3.5
        bpy.ops.import_scene.patina_points(filepath=str(path), link=link)
        obj, = (item for item in bpy.data.objects if item.type in point_data.TYPES)
        known, _ = told_of(obj)
        check([(scan.grid, scan.count) for scan in known] == [((17, 17), 288), ((13, 17), 220)], f"{known}")
        check_close([scan.interval for scan in known], [0.125, 0.125], 0.01, "intervals")
        check(all(scan.direction[1] > 0.9 for scan in known), f"{known}")
        empties = sorted((item for item in bpy.data.objects if item.type == 'EMPTY'), key=lambda item: item["patina_station"])
        check([item.parent for item in empties] == [obj, obj], f"{empties}")
        bpy.context.view_layer.update()
        check_close([item.matrix_world.translation for item in empties], [(0, 0, 0), (1, -1, 0)], 1e-5, "stations")
        if not link:
            scan = np.zeros(point_data.count_of(obj.data), np.int32)
            obj.data.attributes["scan"].data.foreach_get("value", scan)
            check(np.bincount(scan).tolist() == [288, 220], f"{np.bincount(scan)}")
        bpy.context.view_layer.objects.active = obj
        bpy.ops.object.patina_scans_list()
        obj.patina.ranges.use = True
        picture = render()
        shown = picture["Combined"][..., 3] > 0
        check(shown.sum() > 1300 and shown[32, 20:50].all(), f"{shown.sum()}: no pixel of the walls is open")
        first, second = obj.patina.points.scans
        first.hide = True
        alone = len(drawn(render()))
        check(0.55 * shown.sum() < alone < 0.95 * shown.sum(), f"{alone} of {shown.sum()}: the narrower one alone")
        first.hide, obj.patina.ranges.use_cull = False, True
        check(len(drawn(render())) == shown.sum(), "both looked as the view does")
        scene.camera.location.y, scene.camera.rotation_euler.z = 12.0, np.pi
        check(not drawn(render()), "from behind both are culled")


def test_bad_scans_of_ptx():
    """A matrix that is no rotation, a scan of no points, of one, and one that ends before its grid does are named, and the others shown."""
    from patina.read import importers
    from patina.read.importers import scans
    bent = "1 0 0 0\n0 3 0 0\n0 0 0 0\n"
    lone = ptx_scan((0, 0, 0), 1, 2)
    path = text_file("bad.ptx", ptx_scan((0, 0, 0), 17, 17) + ptx_scan((3, 0, 0), 4, 4, turn=bent) + ptx_scan((4, 0, 0), 1, 1) + lone +
                     ptx_scan((0, 0, 0), 17, 17, cells=200))
    points = importers.reader(path).read(path, importers.Filter(), importers.Progress())
    said = "\n".join(points.warnings)
    for words in ("scan 1 is left out: its matrix is none of a pose", "scan 2 has no points", "scan 3 has one point",
                  "scan 4 ends 89 cells before its grid of 17 x 17 does"):
        check(words in said, said)
    check([scan.count for scan in scans.unpacked(points.notes["scans"])] == [288, 0, 0, 1, 199], f"{points.notes['scans']}")
    scene = new_scene(64, 64)
    scene.camera.rotation_euler.x, scene.camera.data.type, scene.camera.data.ortho_scale = np.pi / 2, 'ORTHO', 3.5
    obj, = import_ply(path)
    obj.patina.ranges.use = True
    check(len(drawn(render())) > 1200, "the good ones are shown")


def told_of(obj):
    from patina.read.importers import scans
    return scans.unpacked(obj.data.get("patina_scans")), np.array(obj.data.get("patina_scanners", [])).reshape(-1, 3)


def check_told(got, wanted, what):
    """Names, poses, directions, intervals, grids and counts, and where the scanners stood."""
    (scans, stations), (before, stood) = got, wanted
    check([(scan.name, scan.count, scan.grid) for scan in scans] == [(scan.name, scan.count, scan.grid) for scan in before], f"{what}: {scans}")
    for scan, was in zip(scans, before, strict=True):
        check_close(scan.pose, was.pose, 1e-9, f"{what}: poses")
        check_close(scan.direction, was.direction, 1e-9, f"{what}: directions")
        check_close(scan.interval, was.interval, 1e-9, f"{what}: intervals")
    check(stations.shape == stood.shape, f"{what}: {stations} {stood}")
    if len(stood):
        check_close(stations, stood, 1e-4, f"{what}: stations")


def test_scans_survive_linking():
    """Converted to a linked cloud, saved, opened again without what was kept, and converted back, scans keep numbers, names, poses,
    directions, intervals and grids; they are listed and culled as before, and stations come with an import of the written file."""
    from patina.sync.points import built, linked
    obj = pair(False, "survive")
    group = obj.patina.ranges
    group.use, group.use_cull = True, True
    known, whole = told_of(obj), sides()
    check(len(known[0]) == 2 and any(known[0][0].direction) and known[0][0].interval > 0.09 and known[0][1].pose[3] == 0.2, f"{known}")
    path = SCRATCH / "survive.ply"
    bpy.ops.object.patina_mesh_to_linked(filepath=str(path))
    check(obj.patina.linked_file.endswith("survive.ply") and len(obj.data.vertices) == 8, "linked")
    check_told(told_of(obj), known, "linked")
    check(sides() == whole, f"{sides()} of {whole}")
    bpy.ops.object.patina_scans_list()
    check([scan.name for scan in obj.patina.points.scans] == ["left.ply", "right.ply"], "listed")
    blend = SCRATCH / "survive.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    for kept in linked.source(path).kept.parent.glob(linked.source(path).kept.name.split("-")[0] + "*"):
        kept.unlink()
    built.CACHE.clear()
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    obj = bpy.data.objects["survive"]
    bpy.context.view_layer.objects.active = obj
    check(sides() == whole, "opened again")
    obj.patina.points.scans[0].hide = True
    check(sides() == (0, whole[1]), "one is hidden")
    obj.patina.points.scans[0].hide = False
    camera = bpy.context.scene.camera
    camera.location.z, camera.rotation_euler.y = -8.0, np.pi
    check(not drawn(render()), "from behind both are culled")
    bpy.ops.object.patina_linked_to_mesh()
    check_told(told_of(obj), known, "converted back")
    check(not drawn(render()), "culled as before")


def test_stations_survive_linking():
    """Of a PTX, moved and scaled: its scanners, as empties, of the linked file that was written of it."""
    new_scene()
    path = text_file("survive.ptx", PTX.format(10) + WALL + PTX.format(20) + WALL)
    obj, = import_ply(path)
    known = told_of(obj)
    check(len(known[1]) == 2 and np.allclose(known[0][1].pose, (1, 0, 0, 20, 0, 1, 0, 0, 0, 0, 1, 0)), f"{known}")
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.patina_mesh_to_linked(filepath=str(SCRATCH / "survive_ptx.ply"))
    check_told(told_of(obj), known, "linked")
    check(len(obj.children) == 2 and not bpy.ops.object.patina_add_stations.poll(), "its empties stay")
    obj.location.x = 100.0
    bpy.context.view_layer.update()
    bpy.ops.export_scene.patina_points(overwrite=True, filepath=str(SCRATCH / "moved.ply"))
    for link in (False, True):
        before = set(bpy.data.objects)
        bpy.ops.import_scene.patina_points(filepath=str(SCRATCH / "moved.ply"), link=link)
        new = set(bpy.data.objects) - before
        empties = sorted((item for item in new if item.type == 'EMPTY'), key=lambda item: item["patina_station"])
        bpy.context.view_layer.update()
        check_close([item.matrix_world.translation for item in empties], [(110, 0, 0), (120, 0, 0)], 1e-3, "places")
        own, = (item for item in new if item.type in point_data.TYPES)
        check_close(told_of(own)[0][1].pose, (1, 0, 0, 120, 0, 1, 0, 0, 0, 0, 1, 0), 1e-3, "poses move too")
