# SPDX-License-Identifier: GPL-3.0-or-later
"""Survey drawings: planes, what a scale needs, exported images and cut lines of a box far from zero, refusals, and the scene afterwards."""

import re

import bpy
import numpy as np
from check_plan import picture_of
from harness import SCRATCH, Skip, add_points, check, check_close, new_scene
from mathutils import Euler, Matrix
from patina.description import drawings as planes
from patina.description.drawings import DrawingError, Frame
from patina.read import readers
from patina.sync import drawings
from patina.sync.points import origin

FAR = (5_000_000.125, 5_400_000.25, 312.5)
SIZE, STEP = np.array((2.0, 1.5, 1.0)), 0.025  # of the box, around zero, and of its points
TURN = Matrix.Rotation(0.3, 4, 'Z')


def box():
    """(n, 3) points of the faces."""
    lines = [np.linspace(-0.5 * side, 0.5 * side, round(side / STEP) + 1) for side in SIZE]
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), -1).reshape(-1, 3)
    return grid[(np.abs(np.abs(grid) - 0.5 * SIZE) < 1e-6).any(axis=1)]


def scene_of_box():
    """A box that is turned, of two objects in coordinates of their own; Blender's zero is far away."""
    scene = new_scene(160, 120)
    scene.unit_settings.system, scene.unit_settings.scale_length = 'METRIC', 1.0
    points = box()
    own = Matrix.Translation((3.0, -2.0, 1.0)) @ Euler((np.pi / 2, 0.0, np.pi / 2)).to_matrix().to_4x4() @ Matrix.Scale(2.0, 4)
    for number, matrix in enumerate((Matrix.Identity(4), own)):
        part = points[points[:, 0] <= 0.0] if number == 0 else points[points[:, 0] > 0.0]
        local = np.column_stack([part, np.ones(len(part))]) @ np.array(matrix.inverted()).T
        obj = add_points(local[:, :3], name=f"part {number}", matrix=TURN @ matrix)
        obj[origin.PROPERTY] = obj[origin.SHARED] = list(FAR)
    bpy.context.view_layer.update()
    return scene


def plan(**options):
    check(bpy.ops.object.patina_add_drawing(by='PLAN', level=0.4, **options) == {'FINISHED'}, "not added")
    bpy.context.view_layer.update()
    return bpy.context.object


def export(obj, name, **options):
    path = SCRATCH / name
    check(bpy.ops.export_scene.patina_drawing(drawing=obj.name, filepath=str(path), **options) == {'FINISHED'}, name)
    return path


def refused(words, call, **arguments):
    try:
        call(**arguments)
    except (RuntimeError, DrawingError) as error:
        check(re.search(words, str(error)), f"'{error}' does not say '{words}'")
    else:
        raise AssertionError(f"was not refused: {words}")


def state_of(group, depth=2):
    """The plain properties of a group, and of those in it."""
    found = {}
    for name in set(group.bl_rna.properties.keys()) - {"use_nodes"}:  # which 5.2 deprecates
        value = getattr(group, name, None)
        if isinstance(value, (bool, int, float, str)):
            found[name] = value
        elif isinstance(value, bpy.types.ID):
            found[name] = value.name
        elif isinstance(value, bpy.types.bpy_struct) and depth:
            found[name] = state_of(value, depth - 1)
    return found


def test_plan():
    """Its frame, what it is on paper, and what the points support."""
    scene = scene_of_box()
    obj = plan()
    frame = drawings.frame_of(obj, scene)
    check(obj.patina.drawing.kind == 'PLAN' and obj.select_get() and drawings.of_scene(bpy.context.view_layer) == [obj], "the drawing")
    check_close(frame.origin, (0.0, 0.0, -0.1), 1e-6, "the middle, at 0.4 above the lowest point")
    check(frame.front == 0.0 and 0.4 <= frame.back < 0.5 and frame.width > 2.3, f"{frame}")
    obj.scale = (2.0, 3.0, 1.0)
    bpy.context.view_layer.update()
    check_close(drawings.frame_of(obj, scene).width, 2.0 * frame.width, 1e-6, "its scale counts")
    check(bpy.ops.object.patina_add_drawing(by='CEILING', level=0.4) == {'FINISHED'}, "no ceiling")
    bpy.context.view_layer.update()
    frame = drawings.frame_of(bpy.context.object, scene)
    check(frame.ceiling and frame.front == 0.0 and 0.6 <= frame.back < 0.7, f"{frame}")


def test_facts():
    frame = Frame(np.zeros(3), np.array((1.0, 0, 0)), np.array((0, 0, 1.0)), 20.0, 10.0, 0.0, 5.0, 20.0)
    rows = dict(planes.facts(frame, 0.006, 0.002))
    check(rows["Paper"] == "1,000 x 500 mm" and rows["Pixel"] == "1.7 mm" and rows["Image"] == "12,000 x 6,000 pixels, 288.0 MB", f"{rows}")
    check(rows["Points"] == "1:20 needs a point every 1.7 mm; these have one every 6 mm", rows["Points"])
    check(rows["Accuracy"] == "1:20 allows an error of 3.6 mm; noise is 2 mm", rows["Accuracy"])
    check(not planes.supported(frame, 0.006, 0.002) and planes.supported(frame, 0.0016, 0.002) and not planes.supported(frame, 0.001, 0.004), "support")


def test_lines():
    """Cut lines of two objects are one closed line at its place in the world, to a fraction of what the scale allows. Clipped points have none."""
    scene_of_box()
    obj = plan(scale=20.0)
    path = export(obj, "plan.dxf")
    text = export(obj, "plan.svg").read_text()
    width = drawings.frame_of(obj, bpy.context.scene).paper()[0]
    check(abs(float(re.search(r'<svg[^>]* width="([\d.]+)mm"', text)[1]) - 1000.0 * width) < 1e-3 and 'id="cut"' in text, text[:300])
    try:
        import ezdxf
    except ImportError:
        try:
            readers.load("ezdxf")
        except Exception as error:
            raise Skip("needs ezdxf") from error
        import ezdxf
    lines = [entity for entity in ezdxf.readfile(path).modelspace() if entity.dxf.layer == "cut"]
    check(len(lines) == 1 and lines[0].closed, f"{len(lines)} lines")
    places = np.array([tuple(place) for place in lines[0].vertices_in_wcs()]) - FAR
    check_close(places[:, 2], -0.1, 1e-6, "their height")
    own = np.abs(places[:, :2] @ np.array(TURN)[:2, :2])  # in the box's own axes
    off = np.abs((own - 0.5 * SIZE[:2]).max(axis=1))
    check(off.max() < 0.18e-3 * 20.0, f"{1e3 * off.max():.2f} mm off")
    ends = np.linalg.norm(own - 0.5 * SIZE[:2], axis=1)
    check((ends < STEP).sum() >= 4, f"four corners: {ends}")
    flat = ezdxf.readfile(export(obj, "flat.dxf", flat=True)).modelspace()
    check(all(0.0 <= x <= 1000.0 * width for line in flat for x, *_ in line.get_points()), "the sheet, in millimeters")
    length = np.linalg.norm(np.roll(places, -1, axis=0) - places, axis=1).sum()
    clip = bpy.data.objects.new("clip", None)
    clip.patina.clip.shape = 'BOX'
    clip.location, clip.scale = (0.0, 0.0, -0.1), (0.5, 0.5, 0.5)
    bpy.context.scene.collection.objects.link(clip)
    bpy.context.view_layer.update()
    refused("meets no surface", bpy.ops.export_scene.patina_drawing, drawing=obj.name, filepath=str(SCRATCH / "clipped.dxf"))
    clip.location.x = 0.8
    bpy.context.view_layer.update()
    half = ezdxf.readfile(export(obj, "half.dxf")).modelspace()
    check(0.1 * length < sum(np.linalg.norm(np.diff(list(line.vertices_in_wcs()), axis=0), axis=1).sum() for line in half) < 0.6 * length, "clipped")


def test_curves():
    """Cut lines as curves have the box's corners at their places in Blender's world, also in a unit of 0.1 m and on a scaled drawing."""
    scene = scene_of_box()
    obj = plan(scale=20.0)
    obj.scale = (1.5, 1.5, 1.5)
    for unit in (1.0, 0.1):
        scene.unit_settings.scale_length = unit
        bpy.context.view_layer.update()
        before = set(bpy.data.objects)
        check(bpy.ops.object.patina_drawing_to_curves(drawing=obj.name) == {'FINISHED'}, "not added")
        (curve,) = set(bpy.data.objects) - before
        check(curve.name.startswith(f"{obj.name} cut") and curve.select_get() and bpy.context.object == curve, f"{curve.name}")
        (spline,) = curve.data.splines
        check(spline.type == 'POLY' and spline.use_cyclic_u, f"{spline.type}")
        places = np.array([curve.matrix_world @ point.co.xyz for point in spline.points])
        check_close(places[:, 2], -0.1, 1e-5, "their height")
        own = np.abs(places[:, :2] @ np.array(TURN)[:2, :2])
        check(np.abs((own - 0.5 * SIZE[:2]).max(axis=1)).max() < 0.18e-3 * 20.0, f"{own}")
        check((np.linalg.norm(own - 0.5 * SIZE[:2], axis=1) < STEP).sum() >= 4, "four corners")
    obj.location.z = 50.0
    bpy.context.view_layer.update()
    count = len(bpy.data.curves)
    refused("meets no surface", bpy.ops.object.patina_drawing_to_curves, drawing=obj.name)
    check(len(bpy.data.curves) == count, "curves of nothing")


def test_linked_file():
    """A file that only the library reads, far from zero: the corners' coordinates are its own."""
    scene, path = new_scene(), SCRATCH / "far.xyz"
    np.savetxt(path, box() + (5e6, 4e6, 100.0), fmt="%.4f")
    bpy.ops.import_scene.patina_points(directory=str(path.parent), files=[{"name": path.name}], link=True)
    bpy.context.view_layer.update()
    text = export(plan(scale=20.0), "far.dxf").read_text()
    lines = re.findall(r"\nLWPOLYLINE\n.*?(?=\n  0\n)", text, re.DOTALL)
    places = np.array(re.findall(r"\n 10\n(\S+)\n 20\n(\S+)", lines[0]), np.float64) - (5e6, 4e6)
    check(len(lines) == 1 and len(places) >= 4, f"{len(lines)} lines")
    off = np.abs(np.abs(places) - 0.5 * SIZE[:2]).max(axis=1)
    check((off < 1e-3).sum() >= 4, f"the corners: {places}")
    check(abs(float(re.search(r"\n 38\n(\S+)", lines[0])[1]) - 99.9) < 1e-5 and scene.get(origin.PROPERTY) is not None, "its height")


def test_image():
    """Points are in their pixels; behind and before the depth there is nothing; a ceiling is above the plane, and not turned around. The scene stays."""
    scene = new_scene(123, 77)
    places = np.array([(0.0, 0.0, 0.0), (4.0, 1.0, -0.5), (3.0, 2.5, -3.0), (1.0, 2.0, 0.5), (2.0, 0.5, 9.0)])
    obj = add_points(places, np.full((5, 4), 255, np.uint8))
    scene["patina_origin"] = [431000.0, 4581000.0, 2000.0]
    scene.timeline_markers.new("bound", frame=1).camera = scene.camera
    scene.render.engine = 'BLENDER_WORKBENCH'
    empty = bpy.data.objects.new("Drawing", None)
    scene.collection.objects.link(empty)
    empty.matrix_world = Matrix.Translation((2.0, 1.5, 0.0))
    group = empty.patina.drawing
    group.kind, group.width, group.height, group.front, group.back, group.scale, group.pixel = 'PLAN', 5.0, 4.0, 0.1, 1.0, 100.0, 0.01
    bpy.context.view_layer.update()

    def whole():
        return (state_of(scene), [marker.camera for marker in scene.timeline_markers], sorted(bpy.data.objects.keys()), sorted(bpy.data.cameras.keys()),
                bpy.context.object, [other.name for other in bpy.context.selected_objects], obj.hide_render)
    before = whole()
    for kind, wanted in (('PLAN', [0, 1]), ('CEILING', [0, 3])):
        group.kind = kind
        path = export(empty, f"{kind}.png")
        pixels = picture_of(path)
        check(pixels.shape[:2] == (400, 500), f"{pixels.shape}")
        a, d, b, e, c, f = (float(line) for line in path.with_suffix(".pgw").read_text().split())
        check_close((a, d, b, e), (0.01, 0, 0, -0.01), 1e-9, "a pixel's size")
        found = np.argwhere(pixels[..., 3] > 0.5)
        check(len(found) == len(wanted), f"{kind}: {found}")
        for x, y, _ in places[wanted]:
            off = np.abs(found - ((4581000 + y - f) / e, (431000 + x - c) / a)).max(axis=1).min()
            check(off <= 0.51, f"{kind}: ({x}, {y}) is {off:.2f} pixels from its place")
    group.kind = 'PLAN'
    after = whole()
    check(after == before, f"{[(one, other) for one, other in zip(before, after, strict=True) if one != other]}")


def test_refusals():
    scene = scene_of_box()
    obj = plan()
    group, call = obj.patina.drawing, bpy.ops.export_scene.patina_drawing
    path = export(obj, "kept.svg")
    text = path.read_text()
    refused("exists", call, drawing=obj.name, filepath=str(path))
    for name, value, ending, words in (("scale", 0.0, "svg", "the scale is 1:0"), ("pixel", 1e-6, "png", "too large"), ("pixel", 5e-5, "png", "of memory|too large"),
                                       ("width", 0.0, "dxf", "the extent is"), ("back", 0.0, "dxf", "its depth is 0")):
        kept = getattr(group, name)
        setattr(group, name, value)
        bpy.context.view_layer.update()
        refused(words, call, drawing=obj.name, filepath=str(SCRATCH / f"refused.{ending}"), overwrite=True)
        setattr(group, name, kept)
    refused("drawings are exported as", call, drawing=obj.name, filepath=str(SCRATCH / "refused.pdf"))
    refused("no drawing", call, drawing="part 0", filepath=str(SCRATCH / "refused.svg"))
    obj.location.z = 40.0
    bpy.context.view_layer.update()
    refused("meets no surface", call, drawing=obj.name, filepath=str(path), overwrite=True)
    obj.location.z = float("nan")
    bpy.context.view_layer.update()
    refused("not finite", call, drawing=obj.name, filepath=str(path), overwrite=True)
    obj.location.z = -0.1
    bpy.data.objects["part 1"].scale.x *= 1.1
    bpy.context.view_layer.update()
    refused("'part 1' is scaled differently", call, drawing=obj.name, filepath=str(path), overwrite=True)
    check(path.read_text() == text and not list(SCRATCH.glob("refused*")), "a file was written")
    for other in list(scene.objects):
        bpy.data.objects.remove(other)
    refused("no points", bpy.ops.object.patina_add_drawing)


def test_batch():
    """All drawings at once; a file that exists stops it; one that fails does not stop the others."""
    scene_of_box()
    plan()
    other = plan()
    other.location.z, folder = 40.0, SCRATCH / "batch"
    folder.mkdir()
    bpy.context.view_layer.update()
    call = bpy.ops.export_scene.patina_drawings
    check(call(directory=str(folder), image=False, svg=True) == {'FINISHED'}, "the batch")
    check(sorted(path.name for path in folder.iterdir()) == ["Plan.dxf", "Plan.svg"], f"{list(folder.iterdir())}")
    refused("Plan.dxf, Plan.svg exist", call, directory=str(folder), image=False, svg=True)
    check(call(directory=str(folder), image=False, overwrite=True) == {'FINISHED'}, "over the others")
    refused("no format", call, directory=str(folder), image=False, dxf=False)


def test_picked_planes():
    """A wall, three points and a line, picked at pixels of the camera's image, by what is known of the box."""
    scene = scene_of_box()
    scene.patina.fill = 'CLOSED'
    scene.camera.matrix_world = TURN @ Matrix.Translation((0.0, -4.0, 0.2)) @ Matrix.Rotation(1.5, 4, 'X')  # looks at the face at y = -0.75
    bpy.context.view_layer.update()
    front = TURN.to_3x3() @ Matrix.Identity(3)
    normal = -np.array(front.col[1])

    def pick(by, *places, **options):
        check(bpy.ops.object.patina_pick_drawing(by=by, path=[{"name": "", "loc": place, "time": 0.0} for place in places], **options) == {'FINISHED'}, by)
        bpy.context.view_layer.update()
        return drawings.frame_of(bpy.context.object, scene)

    for vertical in (True, False):
        frame = pick('WALL', (80.0, 60.0), vertical=vertical)
        check(np.degrees(np.arccos(min(frame.normal @ normal, 1.0))) < 0.2, f"its normal is {frame.normal}, not {normal}")
        check(abs(normal @ frame.origin - 0.75) < 0.005 and abs(frame.up[2] - 1.0) < 1e-3, f"{frame}")
        check(bpy.context.object.patina.drawing.kind == 'ELEVATION' and abs(frame.width - 2.0 - 0.08) < 0.05 + 1.5 * 0.02, f"{frame.width}")
    frame = pick('POINTS', (100.0, 50.0), (60.0, 50.0), (80.0, 70.0))  # from the right to the left
    check(frame.normal @ normal > 0.999, f"{frame.normal}")
    frame = pick('LINE', (60.0, 50.0), (100.0, 50.0))
    check(bpy.context.object.patina.drawing.kind == 'SECTION' and frame.normal @ normal > 0.99 and frame.front == 0.0, f"{frame}")
    refused("needs 3 points", bpy.ops.object.patina_pick_drawing, by='POINTS', path=[])
    refused("on a line", planes.by_points, points=np.array([(0, 0, 0), (1, 1, 1), (2, 2, 2.0)]), towards=lambda place: -place)
    refused("above each other", planes.by_line, points=np.array([(0, 0, 0), (0, 0, 1.0)]))
    level = np.column_stack([np.random.default_rng(1).random((50, 2)), np.zeros(50)])
    refused("nearly level", planes.by_wall, points=level, vertical=True, towards=lambda place: np.array((0, 0, 1.0)))
    refused("too few", planes.by_wall, points=level[:2], vertical=True, towards=lambda place: np.array((0, 0, 1.0)))
