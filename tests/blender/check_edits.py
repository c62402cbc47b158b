# SPDX-License-Identifier: GPL-3.0-or-later
"""Single points of linked clouds: selected, hidden, deleted, restored, graded; in pictures, exports, files and undo."""

import bpy
import numpy as np
from check_import import import_ply, write_ply
from check_linked import dense
from harness import SCRATCH, check, check_close, drawn, new_scene, patina, render, reports
from patina.read.importers import library
from patina.sync.points import edits

ROWS = 60  # of a wall of points, ROWS x ROWS


def wall(name="wall.ply", extra=(), offset=(0.0, 0.0, -4.0), color=(200, 100, 50)):
    """Points on a plane across the view, numbered row by row from the bottom left; class 2 at the left and 6 at the right, of scans 0
    (below) and 3."""
    y, x = np.divmod(np.arange(ROWS * ROWS), ROWS)
    columns = [("x", "f4", (x + 0.5) / ROWS * 2 - 1 + offset[0]), ("y", "f4", (y + 0.5) / ROWS * 2 - 1 + offset[1]),
               ("z", "f4", np.full(ROWS * ROWS, offset[2])),
               *((name, "u1", np.full(ROWS * ROWS, value)) for name, value in zip(("red", "green", "blue"), color, strict=True)),
               ("classification", "u1", np.where(x < ROWS // 2, 2, 6)), ("scan", "u1", np.where(y < ROWS // 2, 0, 3))]
    return write_ply(name, [*columns, *extra])


def scene_with_wall(name="wall.ply", **options):
    scene = new_scene(100, 100)
    scene.camera.data.type, scene.camera.data.ortho_scale = 'ORTHO', 2.5
    obj, = import_ply(wall(name, **options), link=True)
    bpy.context.view_layer.objects.active = obj
    return obj


def edited(obj):
    return edits.for_cloud(edits.packed_of(obj), ROWS * ROWS) or edits.none(ROWS * ROWS)


def chosen(obj, plane="selected"):
    """(rows, columns) bool."""
    return edits.flags(getattr(edited(obj), plane), ROWS * ROWS).reshape(ROWS, ROWS)


def select(corners, **options):
    """Corners in pixels of the final picture."""
    return bpy.ops.object.patina_points_select(path=[{"name": "", "loc": corner, "time": 0.0} for corner in corners], **options)


def right_half():
    """From the picture's middle on."""
    return ((50, -5), (200, 200))


def test_hide_and_restore():
    obj = scene_with_wall()
    whole = drawn(render())
    select(right_half())
    check((chosen(obj) == (np.arange(ROWS) >= ROWS // 2)).all(), f"{chosen(obj).sum()} points are selected")
    check(drawn(render()) == whole, "what is selected is drawn as before")
    bpy.ops.object.patina_points_hide()
    check(not chosen(obj).any() and chosen(obj, "hidden").sum() == ROWS * ROWS // 2, "hidden")
    left = drawn(render())
    check(left and max(column for _, column in left) < 50 and len(left) > 0.4 * len(whole), f"{len(left)} of {len(whole)} pixels")
    bpy.ops.object.patina_points_select_all(action='SELECT')
    check((chosen(obj) == (np.arange(ROWS) < ROWS // 2)).all(), "hidden points are not selected")
    bpy.ops.object.patina_points_delete()
    check(not drawn(render()), "all is hidden or deleted")
    bpy.ops.object.patina_points_reveal()
    right = drawn(render())
    check(right and min(column for _, column in right) >= 50, "what was hidden is back, what was deleted not")
    bpy.ops.object.patina_points_restore()
    check(drawn(render()) == whole, "all is back")
    bpy.ops.object.patina_points_select_all(action='DESELECT')
    check(edits.PROPERTY not in obj, "nothing is left behind")


def test_select_mesh_by_value():
    """In Object and Edit Mode the same points of a mesh are selected, by an attribute or by height; hidden ones never."""
    new_scene()
    # of one color, it would be colored by its intensity, which an empty attribute would mean then
    obj, = import_ply(wall("values.ply", [("intensity", "f4", np.arange(ROWS * ROWS))], color=(np.arange(ROWS * ROWS) % 200, 100, 50)))
    obj.rotation_euler = (np.pi / 2, 0, 0)  # rows are heights now
    bpy.context.view_layer.objects.active = obj
    if obj.type != 'MESH':
        check(not bpy.ops.mesh.patina_select_by_value.poll(), "a point cloud")
        bpy.ops.object.patina_to_mesh()
    bpy.context.view_layer.update()
    number = np.arange(ROWS * ROWS)

    def found():
        flags = np.zeros(ROWS * ROWS, bool)
        obj.data.vertices.foreach_get("select", flags)
        return flags

    for mode in ('OBJECT', 'EDIT'):
        for options, wanted in (({"attribute": "intensity", "least": 100, "most": 199.5}, (number >= 100) & (number < 200)),
                                ({"least": 0.0, "most": 2.0, "how": 'ADD'}, (number >= 100) & (number < 200) | (number >= ROWS * ROWS // 2)),
                                ({"attribute": "intensity", "least": 150, "most": 1e9, "how": 'SUB'}, (number >= 100) & (number < 150)),
                                ({"attribute": "intensity", "least": 120, "most": 1e9, "how": 'AND'}, (number >= 120) & (number < 150))):
            bpy.ops.object.mode_set(mode=mode)
            check(bpy.ops.mesh.patina_select_by_value(**options) == {'FINISHED'} and obj.mode == mode, f"{mode} {options}")
            bpy.ops.object.mode_set(mode='OBJECT')
            check((found() == wanted).all(), f"{mode} {options}: {found().sum()} points, not {wanted.sum()}")
    bpy.ops.object.mode_set(mode='EDIT')
    bpy.ops.mesh.hide()  # those that are selected
    bpy.ops.mesh.patina_select_by_value(attribute="intensity", least=100, most=199)
    bpy.ops.object.mode_set(mode='OBJECT')
    check((found() == (number >= 100) & (number < 200) & ~((number >= 120) & (number < 150))).all(), "hidden points were selected")
    for options, wanted in (({"attribute": "heat"}, "has no attribute 'heat'"), ({"least": 3.0, "most": 1.0}, "is greater than")):
        try:
            bpy.ops.mesh.patina_select_by_value(**options)
        except RuntimeError as error:
            check(wanted in str(error), str(error))
        else:
            check(False, f"{options}")


def test_ways_to_select():
    obj = scene_with_wall()
    select(right_half())
    lasso = [(50 + 30 * np.cos(a), 50 + 30 * np.sin(a)) for a in np.linspace(0, 2 * np.pi, 60)]
    select(lasso, shape='LASSO', how='SUB')
    place = (np.arange(ROWS) + 0.5) / ROWS * 80 + 10  # pixels
    disc = np.hypot(place[None] - 50, place[:, None] - 50) < 30
    right = np.broadcast_to(place[None] > 50, disc.shape)
    off = (chosen(obj) != (right & ~disc)).sum()
    check(off < 12, f"{off} points differ from a half without a disc")  # a polygon is no circle
    select(lasso, shape='LASSO', how='ADD')
    check((chosen(obj) != (right | disc)).sum() < 12, "added")
    select(((-5, -5), (200, 50)), how='AND')
    check((chosen(obj)[ROWS // 2:]).sum() == 0 and chosen(obj).sum() > 1000, "the lower half of it")
    bpy.ops.object.patina_points_select_all(action='INVERT')
    check((chosen(obj)[ROWS // 2:]).all(), "inverted")
    bpy.ops.object.patina_points_select_by(by='CLASS', number=6)
    check((chosen(obj) == (np.arange(ROWS) >= ROWS // 2)).all(), "class 6")
    bpy.ops.object.patina_points_select_by(by='SCAN', number=3, how='AND')
    check(chosen(obj).sum() == ROWS * ROWS // 4 and chosen(obj)[ROWS // 2:, ROWS // 2:].all(), "scan 3 of it")
    bpy.ops.object.patina_points_select_by(by='VALUE', attribute="scan", least=1, most=3)
    check((chosen(obj) == (np.arange(ROWS) >= ROWS // 2)[:, None]).all(), "scans from 1 to 3")
    bpy.ops.object.patina_points_select_by(by='VALUE', least=-0.5, most=0.5, how='AND')  # the height, which is the world's z
    check(not chosen(obj).any(), "heights about 0, of a wall at -4")
    obj.patina.colors.source, obj.patina.colors.scalar = 'SCALAR', "classification"
    bpy.ops.object.patina_points_select_by(by='VALUE', least=2, most=5)
    check((chosen(obj) == (np.arange(ROWS) < ROWS // 2)).all(), "what colors the points")
    obj.patina.colors.source = 'OWN'
    box = bpy.data.objects.new("box", None)
    box.location, box.scale = (-0.5, 0.5, -4.0), (0.24, 0.24, 1.0)
    box.patina.clip.shape, box.patina.clip.cut = 'BOX', True
    bpy.context.scene.collection.objects.link(box)
    bpy.context.view_layer.update()
    bpy.ops.object.patina_points_select_by(by='CLIP', clip="box")
    x = (np.arange(ROWS) + 0.5) / ROWS * 2 - 1
    inside = (abs(x[None] + 0.5) < 0.24) & (abs(x[:, None] - 0.5) < 0.24)
    check((chosen(obj) == inside).all(), f"{chosen(obj).sum()} within the box, not {inside.sum()}")
    for options, wanted in (({"by": 'CLASS', "number": 9}, "no point is of"), ({"by": 'SCAN', "number": 7}, "no point is of"),
                            ({"by": 'VALUE', "attribute": "heat"}, "no attribute 'heat'. It has: "),
                            ({"by": 'VALUE', "attribute": "scan", "least": 3, "most": 1}, "is greater than")):
        try:
            bpy.ops.object.patina_points_select_by(**options)
        except RuntimeError as error:
            check(wanted in str(error), str(error))
        else:
            check(False, f"{options}")


def test_visible_or_through():
    """Of two walls behind each other only the nearer is selected, unless through."""
    obj = scene_with_wall()
    behind, = import_ply(wall("behind.ply", offset=(0.0, 0.0, -6.0)), link=True)
    bpy.context.scene.patina.fill = 'CLOSED'
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    behind.select_set(True)
    select(right_half())
    check(chosen(obj).sum() == ROWS * ROWS // 2 and not chosen(behind).any(), "the nearer alone")
    obj.patina.soft.use = True
    select(right_half())
    check(chosen(obj).sum() == ROWS * ROWS // 2 and not chosen(behind).any(), "soft points as well")
    obj.patina.soft.use = False
    bpy.context.scene.patina.surface = 'RANGES'
    select(right_half())
    check(chosen(obj).sum() == ROWS * ROWS // 2 and not chosen(behind).any(), "single points of range images")
    bpy.context.scene.patina.surface = 'AUTO'
    select(right_half(), through=True)
    check(chosen(obj).sum() == chosen(behind).sum() == ROWS * ROWS // 2, "both")
    bpy.ops.object.patina_points_hide()  # of the active one
    check(chosen(obj, "hidden").any() and not chosen(behind, "hidden").any(), "the active one's")
    select(right_half())
    check(chosen(behind)[:, 33:].all() and not chosen(obj).any(), f"through where the nearer is hidden: {chosen(behind).sum()}")


def test_undo():
    obj = scene_with_wall()
    bpy.ops.ed.undo_push(message="before")
    select(right_half())
    bpy.ops.ed.undo_push(message="select")
    bpy.ops.object.patina_points_hide()
    bpy.ops.ed.undo_push(message="hide")
    half = len(drawn(render()))
    bpy.ops.ed.undo()
    obj = bpy.context.view_layer.objects.active
    check(chosen(obj).sum() == ROWS * ROWS // 2 and not chosen(obj, "hidden").any(), "hiding is undone")
    check(len(drawn(render())) > 1.8 * half, "and seen")
    bpy.ops.ed.undo()
    check(edits.PROPERTY not in bpy.context.view_layer.objects.active, "selecting is undone")
    bpy.ops.ed.redo()
    bpy.ops.ed.redo()
    check(len(drawn(render())) == half, "done again")


def test_saved_and_loaded():
    scene_with_wall()
    select(right_half())
    bpy.ops.object.patina_points_delete()
    before = render()
    path = SCRATCH / "edited.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(str(path)) as (source, target):
        target.scenes = source.scenes
    bpy.context.window.scene = target.scenes[0]
    after = render()
    for name, pixels in before.items():
        check((pixels == after[name]).all(), f"{name} differs")
    check(len(drawn(after)) > 1000, "an empty picture")


def test_many_points_in_little_room():
    """What is saved of a region of a large scan, and of points at random."""
    count = 3_000_000
    rows = edits.none(count)
    flags = np.zeros(count, bool)
    flags.reshape(1000, 3000)[200:700, 500:2500] = True
    region = edits.Edits(count, rows.selected, edits.of_flags(flags), rows.deleted).packed()
    check(len(region) < 25000, f"{len(region)} bytes for a region")
    found = edits.unpacked(region)
    check((edits.flags(found.hidden, count) == flags).all() and found.totals["hidden"] == 1_000_000, "as it was")
    flags = np.random.default_rng(3).random(count) < 0.5
    noise = edits.Edits(count, edits.of_flags(flags), rows.hidden, rows.deleted).packed()
    check(len(noise) < 1.02 * count / 6 + 10000, f"{len(noise)} bytes at random")


def test_damaged_edits():
    """One message, and the cloud is shown whole: nothing of it is believed."""
    obj = scene_with_wall()
    whole = drawn(render())
    select(right_half())
    bpy.ops.object.patina_points_hide()
    good = str(obj[edits.PROPERTY])
    rng = np.random.default_rng(1)
    flipped = []
    for place in (8, *rng.integers(8, len(good) - 4, 6)):
        flipped.append(f"{good[:place]}{'A' if good[place] != 'A' else 'B'}{good[place + 1:]}")
    other = edits.Edits(100, *(np.full(13, 255, np.uint8),) * 3).packed()
    wrong = [good[:-3], good[:-4], good[:20], "UFRQMQ==", "x", "A" * 80, "\u00e4" * 80, other, *flipped, 3.0, [1, 2, 3]]
    for data in wrong:
        obj[edits.PROPERTY] = data
        check(drawn(render()) == whole, f"{data}: not whole")
        said = [text for _, text in reports if obj.name in text]
        check(len(said) == 1 and "all are shown" in said[0], f"{data}: {reports}")
    obj[edits.PROPERTY] = other
    render()
    check("of a file of 100 points, and this one has 3,600" in reports[0][1], f"{reports}")
    obj[edits.PROPERTY] = good[:-1]
    bpy.ops.object.patina_points_select_all(action='SELECT')  # begins anew
    check(chosen(obj).all(), "begun anew")
    obj[edits.PROPERTY] = good
    check(drawn(render()) < whole and not reports, "the good one is good")
    bpy.ops.object.patina_points_forget()
    check(drawn(render()) == whole, "forgotten")


def test_export_and_conversion():
    """What is deleted is not exported; what is only hidden is."""
    obj = scene_with_wall("export.ply", offset=(485432.0, 5428765.0, 312.0))
    bpy.ops.object.patina_points_select_by(by='CLASS', number=6)
    bpy.ops.object.patina_points_delete()
    bpy.ops.object.patina_points_select_by(by='SCAN', number=3)
    bpy.ops.object.patina_points_hide()
    obj.select_set(True)
    path = SCRATCH / "exported.ply"
    bpy.ops.export_scene.patina_points(overwrite=True, filepath=str(path))
    file = library.read(path, patina.read.importers.Filter(), patina.read.importers.Progress())
    source = library.read(SCRATCH / "export.ply", patina.read.importers.Filter(), patina.read.importers.Progress())
    left = source.scalars["classification"] == 2
    check(len(file.positions) == left.sum() == ROWS * ROWS // 2, f"{len(file.positions)} points")
    check_close(file.positions.astype(np.float64) + file.origin, source.positions[left].astype(np.float64) + source.origin, 1e-3, "places")
    check((file.colors[:, :3] == (200, 100, 50)).all() and (file.scalars["scan"] == source.scalars["scan"][left]).all(), "columns")
    bpy.ops.object.patina_linked_to_mesh()
    check(len(obj.data.vertices) == ROWS * ROWS // 2 and edits.PROPERTY not in obj, f"{len(obj.data.vertices)} vertices")


def test_grades():
    """Gain, gamma, saturation and temperature of one scan; the other stays as it is."""
    obj = scene_with_wall()
    before = render()["Combined"]
    bpy.ops.object.patina_scans_list()
    scans = obj.patina.points.scans
    check([scan.name for scan in scans] == ["Scan 0", "Scan 3"], f"{[scan.name for scan in scans]}")
    scans[1].gain = 0.5
    after = render()["Combined"]
    lit = before[..., 3] > 0
    up, down = lit & (np.arange(100)[:, None] >= 50), lit & (np.arange(100)[:, None] < 50)
    check(up.sum() > 1000 and (after[down] == before[down]).all(), "scan 0 stays")
    check_close(after[up][:, :3], 0.5 * before[up][:, :3], 0.004, "half as bright")
    scans[1].gain, scans[1].saturation = 1.0, 0.0
    grey = render()["Combined"][up][:, :3]
    check_close(grey, (before[up][:, :3] @ np.float32([0.2126, 0.7152, 0.0722]))[:, None].repeat(3, 1), 0.004, "grey")
    scans[1].saturation, scans[1].temperature = 1.0, 1.0
    warm = render()["Combined"][up][0]
    check(warm[0] > 1.05 * before[up][0][0] and warm[2] < 0.9 * before[up][0][2], f"{warm}")
    scans[1].temperature, scans[1].gamma = 0.0, 2.0
    check_close(render()["Combined"][up][:, :3], np.sqrt(before[up][:, :3]), 0.005, "gamma")
    bpy.ops.object.patina_scans_reset()
    check((render()["Combined"] == before).all(), "as before")
    bpy.ops.object.patina_scans_color()
    colored = render()["Combined"]
    check(np.abs(colored[up][0] - colored[down][0]).max() > 0.3 and np.ptp(colored[up][:, :3], axis=0).max() < 1e-3, f"a color for each scan: {colored[up][0]}, {colored[down][0]}")


def test_scans_of_old_and_damaged_caches():
    """A cache that does not say of which scans its points are is made anew."""
    obj = scene_with_wall("scans.ply")
    place = patina.sync.points.linked.source_of(obj, 1, []).kept
    for damage in (lambda: place.with_suffix(".scan").unlink(), lambda: place.with_suffix(".scan").write_bytes(b"12"),
                   lambda: place.with_suffix(".json").write_text('{"origin": [0, 0, 0], "scanners": []}')):
        damage()
        patina.built.CACHE.clear()
        bpy.ops.object.patina_points_select_by(by='SCAN', number=3)
        check(chosen(obj).sum() == ROWS * ROWS // 2, "scan 3")
    other, = import_ply(dense("one.ply", 500), link=True)
    bpy.context.view_layer.objects.active = other
    for operator, words in ((bpy.ops.object.patina_scans_color, "one scan only"),
                            (lambda: bpy.ops.object.patina_points_select_by(by='SCAN', number=0), "does not store the scan of each point")):
        try:
            operator()
        except RuntimeError as error:
            check(words in str(error), str(error))
        else:
            check(False, "a file without scans")


def test_refusals():
    """Sequences, other objects, a missing file."""
    new_scene()
    for operator in (bpy.ops.object.patina_points_hide, bpy.ops.object.patina_points_select):
        try:
            operator()
        except RuntimeError as error:
            check("links no point file" in str(error), f"without an object: {error}")
        else:
            check(False, f"{operator} without an object")
    obj = scene_with_wall("gone_wall.ply")
    check(bpy.ops.object.patina_points_hide.poll(), "a linked cloud")
    check(bpy.ops.object.patina_points_hide() == {'CANCELLED'}, "nothing is selected")
    wall("frame_0001.ply")
    kept = obj.patina.linked_file
    obj.patina.linked_file = str(SCRATCH / "frame_####.ply")
    check(not bpy.ops.object.patina_points_hide.poll(), "a sequence")
    obj.patina.linked_file = kept
    patina.built.CACHE.clear()
    (SCRATCH / "gone_wall.ply").unlink()
    try:
        bpy.ops.object.patina_points_select_all(action='SELECT')
    except RuntimeError as error:
        check("is missing" in str(error), str(error))
    else:
        check(False, "a missing file")
