# SPDX-License-Identifier: GPL-3.0-or-later
"""Points as discs: the mode, their radii, what the source pass says of them, and how the panel shows them; Gaussian splats as discs."""

from types import SimpleNamespace

import bpy
import numpy as np
from check_import import import_ply, write_ply
from check_points import grid, pixel
from harness import SCRATCH, Skip, add_points, check, check_close, drawn, linear, move, new_scene, render, reports
from patina import point_data
from patina.read import importers
from patina.sync.points import attributes, splats

COLOR = (200, 60, 40)


def discs(radius=0.0, attribute=None):
    """A grid of points as discs: (scene, points, object). attribute: values of a point attribute "size"."""
    scene = new_scene()
    check(scene.patina.surface == 'AUTO', "discs are a choice")
    points = grid()
    normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    obj = add_points(points, np.tile(np.array((*COLOR, 255), np.uint8), (len(points), 1)), normals)
    scene.patina.surface = 'SPLATS'
    obj.patina.radius = radius
    if attribute is not None:
        obj.data.attributes.new("size", 'FLOAT', 'POINT').data.foreach_set("value", np.asarray(attribute, np.float32))
        obj.patina.radius_attribute = "size"
    return scene, points, obj


def size_of(scene, points, picture):
    """Pixels that each point's disc covers, in the order of the points."""
    covered = np.array(sorted(drawn(picture)))
    places = np.array([pixel(scene, point) for point in points])
    nearest = np.argmin(((covered[:, None] - places[None]) ** 2).sum(2), 1)
    return np.bincount(nearest, minlength=len(points))


def test_radius():
    scene, points, _ = discs(0.1)
    picture = render()
    step = (pixel(scene, points[0] + [1, 0, 0])[1] - pixel(scene, points[0])[1]) * 0.1  # a radius in pixels
    got = size_of(scene, points, picture)
    check(np.all(abs(got - np.pi * step ** 2) <= 0.25 * np.pi * step ** 2), f"pixels {got}, radius {step}")
    for place in drawn(picture):
        check_close(picture["Combined"][place][:3], linear(COLOR), 5e-5, "colour")  # sums are whole numbers
        check_close(picture["Depth"][place], 2, 1e-5, "depth")
    row, column = pixel(scene, points[5])
    check_close(picture["Source"][row, column], 1, 0, "where the point fell")
    check_close(picture["Source"][row, column + 2], 3, 1e-5, "two pixels beside it")


def test_without_radius():
    scene, points, obj = discs()
    move(obj, 0, points[1])  # their spacing is that of the others still
    scene.patina.surface = 'FILL'
    scene.patina.fill = 'OFF'
    few = len(drawn(render()))
    scene.patina.surface = 'SPLATS'
    check(len(drawn(render())) > 10 * few, "discs as wide as the spacing of the points")


def test_radius_attribute():
    scene, points, obj = discs(attribute=[0.1] * 6 + [0.0] * 6)
    got = size_of(scene, points, render())
    check(np.all(got[:6] > 5) and np.all(got[6:] == 1), f"pixels {got}")
    obj.data.attributes["size"].data.foreach_set("value", np.full(12, 0.1, np.float32))
    point_data.changed(obj.data)
    got = size_of(scene, points, render())
    check(np.all(got > 5), f"changed radii: pixels {got}")
    obj.patina.radius = 0.01
    check(np.all(size_of(scene, points, render()) <= 2), "one radius for all")
    obj.patina.radius_attribute = "length"
    render()
    check(any("no point attribute 'length'" in text for _, text in reports), f"reports {reports}")


def test_radii_without_bounds():
    """Inf, NaN and 1e30 are limited to the cloud's bounding box, and reported once; a radius within it stays, with no message."""
    for bad in (np.inf, 1e30, np.nan):
        scene, points, obj = discs(attribute=[0.1] * 12)
        whole = render()["Combined"][..., 3] > 0
        check(not any("radi" in text for _, text in reports), f"{reports}")
        small = int(whole.sum())
        obj.data.attributes["size"].data[0].value = bad
        point_data.changed(obj.data)
        covered = render()["Combined"][..., 3] > 0
        said = [text for _, text in reports if "disc radius is not a number or larger than the cloud" in text]
        check(len(said) == 1 and f"'{obj.name}': 1 disc" in said[0], f"{bad}: {reports}")
        if np.isnan(bad):
            check(0 < small - covered.sum() < small / 6, f"NaN: {covered.sum()} pixels, {small} before")
            continue
        most = 0.5 * np.linalg.norm(np.ptp(points, axis=0))
        step = (pixel(scene, points[0] + [1, 0, 0])[1] - pixel(scene, points[0])[1]) * most  # pixels
        places = np.argwhere(covered) - np.array(pixel(scene, points[0]))
        own = np.array([pixel(scene, point) for point in points]) - np.array(pixel(scene, points[0]))
        reach = max(step, np.linalg.norm(own, axis=1).max() + 0.1 / most * step) + 2
        check(np.linalg.norm(places, axis=1).max() <= reach, f"{bad}: {np.linalg.norm(places, axis=1).max()} pixels away, {reach}")
        check(not covered.all() and covered.sum() > small, f"{bad}: {covered.mean():.0%} of the image")


def test_largest_gap():
    """Discs are no wider than the largest gap, whatever their radii."""
    scene, points, obj = discs(0.1)
    narrow = render()["Combined"]
    for radius, attribute in ((0.3, None), (0.0, [0.3] * 12)):
        scene, points, obj = discs(radius, attribute)
        wide = len(drawn(render()))
        obj.patina.largest_gap = 0.2
        check((render()["Combined"] == narrow).all(), f"radius {radius}, radii {attribute}")
        check(wide > 2 * (narrow[..., 3] > 0).sum(), "they were wider before")
        obj.patina.largest_gap = 9.0
        check(len(drawn(render())) == wide, "a gap that none reaches")
    scene, points, obj = discs()  # as wide as their neighborhoods say, and not always round
    wide = len(drawn(render()))
    obj.patina.largest_gap = 0.2
    check(0 < len(drawn(render())) <= (narrow[..., 3] > 0).sum() < wide, "as wide as they are themselves")


def test_blended():
    """Where two discs overlap on one surface, their colours are mixed; a surface behind stays out."""
    scene = new_scene()
    scene.patina.surface = 'SPLATS'
    near = add_points(np.array([[0.0, 0.0, -2.0], [0.1, 0.0, -2.0]]),
                      np.array([[255, 0, 0, 255], [0, 255, 0, 255]], np.uint8), np.tile([0.0, 0.0, 1.0], (2, 1)))
    far = add_points(np.array([[0.05, 0.0, -4.0]]), np.array([[0, 0, 255, 255]], np.uint8), np.array([[0.0, 0.0, 1.0]]))
    near.patina.radius = far.patina.radius = 0.3
    red, green, blue = render()["Combined"][pixel(scene, [0.05, 0.0, -2.0])][:3]
    check(0.3 < red < 0.7 and abs(red + green - 1) < 1e-3 and blue == 0, f"mixed {red}, {green}, {blue}")


# Three Gaussian splats before the camera: flat to it; the same from the side, by half a right turn about y; faint.
PLACES = np.array([[-0.45, -0.1, -2.0], [0.45, -0.1, -2.0], [0.0, 0.3, -2.0]], np.float32)
SIZES = np.log([[0.1, 0.2, 0.001]] * 3)
TURNS = np.array([[2.0, 0, 0, 0], [1, 0, 1, 0], [1, 0, 0, 0]])
BASE = np.array([[1.2, -0.9, 0.0], [0.3, 0.3, 0.3], [-1.0, 0.5, 1.0]])
LOGITS = np.array([20.0, 20.0, -0.5])
AREA = 2 * np.pi * 0.1 * 0.2  # of a disc


def splat_columns():
    columns = [*zip("xyz", PLACES.T, strict=True), *((f"n{axis}", np.zeros(3)) for axis in "xyz"),
               *((f"f_dc_{k}", BASE[:, k]) for k in range(3)), *((f"f_rest_{k}", np.full(3, 9.0)) for k in range(45)), ("opacity", LOGITS),
               *((f"scale_{k}", SIZES[:, k]) for k in range(3)), *((f"rot_{k}", TURNS[:, k]) for k in range(4))]
    return [(name, "f4", values) for name, values in columns]


def check_discs(scene, what):
    picture = render()
    pixels = picture["Combined"]
    side = abs(pixel(scene, PLACES[0] + [1, 0, 0])[1] - pixel(scene, PLACES[0])[1])  # pixels of a unit
    covered = np.array(sorted(drawn(picture)))
    nearest = np.argmin(((covered[:, None] - np.array([pixel(scene, place) for place in PLACES])[None]) ** 2).sum(2), 1)
    flat, turned, faint = np.bincount(nearest, minlength=3)
    check(abs(flat - AREA * side ** 2) <= 0.15 * AREA * side ** 2 and abs(faint - flat) <= 0.15 * flat, f"{what}: pixels {flat}, {faint}")
    check(turned < 0.5 * flat, f"{what}: pixels from the side {turned}, else {flat}")
    shown = 255 * (0.5 + 0.28209479177387814 * BASE[0])
    check_close(pixels[pixel(scene, PLACES[0])][:3], linear(np.rint(np.clip(shown, 0, 255))), 2e-3, f"{what}: color")
    check_close(pixels[pixel(scene, PLACES[2])][3], 1 / (1 + np.exp(0.5)), 3e-3, f"{what}: opacity")


def test_files_of_splats():
    """A PLY of Gaussian splats becomes discs, in Blender and linked, and says so."""
    path = write_ply("splats.ply", splat_columns())
    warnings = importers.reader(path).read(path, importers.Filter(), importers.Progress()).warnings
    check(any("Gaussian splats, taken as discs" in text for text in warnings), f"notice {warnings}")
    for link in (False, True):
        scene = new_scene(192, 144)
        scene.patina.surface = 'SPLATS'
        obj, = import_ply(path, link=link)
        check(link or set(obj.data.attributes.keys()) >= {"opacity", "radius", "Normal", "Col"}
              and not [name for name in obj.data.attributes.keys() if name.startswith(("f_", "rot_", "scale_"))], "what is kept of them")
        check_discs(scene, "linked" if link else "imported")


def test_splats_of_blender():
    """A point cloud of the kind that Blender 5.3 has is drawn as discs too; here one that is only called so."""
    honest = splats.are
    raw = [(name, 'FLOAT', values) for name, _, values in splat_columns() if len(name) > 2]
    opacities = 1 / (1 + np.exp(-LOGITS))
    shape = [("scale", 'FLOAT_VECTOR', np.exp(SIZES)), ("rotation", 'QUATERNION', TURNS)]
    four = 'FLOAT4' if 'FLOAT4' in bpy.types.Attribute.bl_rna.properties["data_type"].enum_items else 'FLOAT_COLOR'  # from 5.2 on; before
    own = [*shape, ("radiance:base", four, np.column_stack([BASE, opacities])), ("radiance:sh_0", 'FLOAT_VECTOR', np.full((3, 3), 9.0)),
           ("of a later version", 'QUATERNION', np.full((3, 4), 9.0)), ("radiance:next", 'FLOAT', np.ones(3))]  # nobody knows these
    usual = [*shape, ("opacity", 'FLOAT', opacities), ("sh_dc", 'FLOAT_VECTOR', BASE)]
    try:
        splats.are = lambda data: isinstance(data, bpy.types.PointCloud)
        for what, found in (("as in files", raw), ("as Blender has them", own), ("as is usual", usual)):
            scene = splats_in_blender(found)
            check_discs(scene, what)
            check(any("they are drawn as discs of even color" in text and "no attribute" not in text for _, text in reports), f"notice {reports}")
        for left_out, told in (("scale", "drawn as plain points; no attribute tells their size (scale)"),
                               ("rotation", "drawn as discs of even color; no attribute tells their rotation (rotation)"),
                               ("radiance:base", "no attribute tells their color (radiance:base), opacity (radiance:base)")):
            scene = splats_in_blender([attribute for attribute in own if attribute[0] != left_out])
            if left_out == "scale":
                scene.patina.surface = 'FILL'  # of points as discs their spacing would tell a size
            covered = len(drawn(render()))
            check(covered == 3 if left_out == "scale" else covered > 100, f"without {left_out}: pixels {covered}")
            check(any(told in text for _, text in reports), f"notice {reports}")
    finally:
        splats.are = honest
    check(not splats.are(bpy.context.object.data) and bpy.context.object.type == 'POINTCLOUD', "a cloud of points is none of splats")


def splats_in_blender(found):
    """A scene with the three splats as a point cloud of Blender's; found: (name, type, values) of its attributes."""
    scene = new_scene(192, 144)
    scene.patina.surface = 'SPLATS'
    obj = add_points(PLACES)
    for name, kind, values in found:
        key = {'FLOAT_VECTOR': "vector", 'FLOAT4': "vector", 'FLOAT_COLOR': "color"}.get(kind, "value")
        obj.data.attributes.new(name, kind, 'POINT').data.foreach_set(key, np.asarray(values, np.float32).reshape(-1))
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    try:
        bpy.ops.object.convert(target='POINTCLOUD')
    except TypeError:
        raise Skip("this Blender makes no point clouds of meshes") from None
    return scene


def test_four_numbers():
    """An attribute of four numbers a point, as Blender 5.2 brings them, here one that is only shaped so; one value may stand for all points."""
    class Items(list):
        def foreach_get(self, key, out):
            check(key == "vector", f"their property is {key}")
            out[:] = np.concatenate(self)

    rows = np.arange(12, dtype=np.float32).reshape(3, 4)
    for kept in (rows, rows[:1]):
        radiance = SimpleNamespace(domain='POINT', data_type='FLOAT4', data=Items(kept))
        data = SimpleNamespace(attributes={"radiance:base": radiance})
        check(np.array_equal(attributes.numbers(data, 3, "radiance:base", 4), np.broadcast_to(kept, (3, 4))), f"{len(kept)} of them")


def test_packed_splats():
    """Kinds of splats that nobody reads here are refused by name."""
    new_scene()
    path = SCRATCH / "garden.spz"
    path.write_bytes(b"\x1f\x8b\x08\x00rest")
    for link in (False, True):
        reports.clear()
        try:
            check(not import_ply(path, link=link), "nothing comes of it")
        except RuntimeError as error:  # of an operator that reports an error
            reports.append(('ERROR', str(error)))
        check(any("packed Gaussian splats (.spz) are not read" in text for _, text in reports), f"reports {reports}")
