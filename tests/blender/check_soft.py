# SPDX-License-Identifier: GPL-3.0-or-later
"""Soft points: by every source, what is soft lets the background through and the rest does not; own objects, linked files, viewport."""

import bpy
import numpy as np
from check_points import pixel
from harness import SCRATCH, add_points, check, check_close, new_scene, patina, render, reports
from patina import point_data
from patina.draw import histogram

COUNT = 9


def row(colors=None):
    """(scene, object, points): a row of points at z = -3, from left to right."""
    scene = new_scene()
    points = np.array([((k - 4) * 0.2, 0.0, -3.0) for k in range(COUNT)])
    if colors is None:
        colors = np.tile(np.array((200, 60, 60, 255), np.uint8), (COUNT, 1))
    obj = add_points(points, colors)
    obj.patina.soft.use = True
    obj.patina.soft.use_radius = True
    obj.patina.soft.radius = 0.08
    return scene, obj, points


def soft(scene, points):
    """Which of the points are soft: half of the background comes through them."""
    alpha = render()["Combined"][..., 3]
    at = [float(alpha[pixel(scene, point)]) for point in points]
    check(all(value > 0.999 or 0.2 < value < 0.8 for value in at), f"neither surface nor soft: {at}")
    return [k for k, value in enumerate(at) if value < 0.9]


def by(obj, source, **values):
    obj.patina.soft.by = source
    for name, value in values.items():
        setattr(obj.patina.soft, name, value)
    obj.update_tag()


def test_all():
    scene, obj, points = row()
    check(soft(scene, points) == list(range(COUNT)), "every point is soft")
    opacity = {}
    for model in ('BASE', 'CONCENTRIC', 'EXPRESS'):
        scene.patina.soft_model = model
        opacity[model] = render()["Combined"][..., 3].sum()
    check(len({round(float(value), 3) for value in opacity.values()}) == 3, f"three models: {opacity}")
    faint = opacity['EXPRESS']
    obj.patina.soft.opacity = 0.9
    check(render()["Combined"][..., 3].sum() > 1.5 * faint, "opacity")
    obj.patina.soft.use = False
    alpha = render()["Combined"][..., 3]
    check(set(np.unique(alpha)) <= {0.0, 1.0}, "off: surface")


def test_density():
    """Each point is shared out over its ball: across a parallel view they add up to how many there are."""
    scene, obj, _ = row()
    layer = bpy.context.view_layer
    layer.patina.use_pass_density = True
    obj.patina.soft.radius = 0.3  # many pixels
    scene.camera.data.type, scene.camera.data.ortho_scale = 'ORTHO', 4.0
    pixel = 4.0 / max(scene.render.resolution_x, scene.render.resolution_y)
    for model in ('BASE', 'CONCENTRIC', 'EXPRESS'):
        scene.patina.soft_model = model
        density = render()["Density"][..., 0]
        check_close(float(density.sum()) * pixel * pixel, COUNT, 0.02 * COUNT, f"{model}: points")
        check(density.min() == 0.0, f"{model}: beside them there are none")
    obj.patina.soft.use = False
    check(not render()["Density"].any(), "surfaces are not counted")
    layer.patina.use_pass_density = False
    check("Density" not in render(), "nor is the pass there, unless it is asked for")


def test_attribute():
    scene, obj, points = row()
    values = np.linspace(10.0, 90.0, COUNT).astype(np.float32)
    obj.data.attributes.new("score", 'FLOAT', 'POINT').data.foreach_set("value", values)
    by(obj, 'ATTRIBUTE', attribute="score", threshold=0.6)
    check(soft(scene, points) == [5, 6, 7, 8], "from the least to the greatest")
    by(obj, 'ATTRIBUTE', invert=True)
    check(soft(scene, points) == [0, 1, 2, 3], "inverted")  # 1 - F > 0.6
    by(obj, 'ATTRIBUTE', invert=False, use_range=True, range_min=0.0, range_max=100.0, threshold=0.75)
    check(soft(scene, points) == [7, 8], "by a range")
    obj.data.attributes["score"].data.foreach_set("value", np.ascontiguousarray(values[::-1]))
    point_data.changed(obj.data)
    check(soft(scene, points) == [0, 1], "numbers that changed")
    by(obj, 'ATTRIBUTE', attribute="nowhere")
    reports.clear()
    check(soft(scene, points) == [], "an attribute that is missing: surface")
    check(any("'nowhere' to be soft by" in text for _, text in reports), f"said so: {reports}")


def test_weights():
    scene, obj, points = row()
    group = obj.vertex_groups.new(name="faint")
    group.add([2, 3], 0.9, 'REPLACE')
    group.add([4], 0.3, 'REPLACE')
    by(obj, 'ATTRIBUTE', attribute="faint")
    check(soft(scene, points) == [2, 3], "painted weights")
    group.add([4], 1.0, 'REPLACE')
    point_data.changed(obj.data)
    check(soft(scene, points) == [2, 3, 4], "painted on")


def test_colors_and_classes():
    grey = np.array([[20 + 28 * k] * 3 + [255] for k in range(COUNT)], np.uint8)
    scene, obj, points = row(grey)
    by(obj, 'LUMINANCE', threshold=0.5)
    check(soft(scene, points) == [4, 5, 6, 7, 8], "bright points")
    obj.data.attributes.new("classification", 'INT', 'POINT').data.foreach_set("value", np.array([2, 3, 4, 5, 6, 2, 3, 64, 9], np.int32))
    point_data.changed(obj.data)
    by(obj, 'CLASSES', classes="3-4, 64")
    check(soft(scene, points) == [1, 2, 6, 7], "classes")
    obj.data.attributes.remove(obj.data.attributes["classification"])
    point_data.changed(obj.data)
    reports.clear()
    check(soft(scene, points) == [], "no classes: surface")
    check(any("has no classes to be soft by" in text for _, text in reports), f"said so: {reports}")


def test_distance():
    scene, obj, points = row()
    target = bpy.data.objects.new("target", None)
    target.location = (-0.8, 0.0, -3.0)
    scene.collection.objects.link(target)
    by(obj, 'DISTANCE', target=target, use_range=True, range_min=0.0, range_max=1.0, threshold=0.5)
    check(soft(scene, points) == [3, 4, 5, 6, 7, 8], "far from an object")
    target.location.x = 0.8
    check(soft(scene, points) == [0, 1, 2, 3, 4, 5], "that moved")
    target.location.z = float('nan')
    reports.clear()
    check(soft(scene, points) == [], "far from nowhere: surface")
    check(any("has no object at a place that is a number to be soft by" in text for _, text in reports), f"said so: {reports}")
    target.location.z = -3.0
    target.rotation_euler = (0.0, 1.5707963, 0.0)  # its z along x
    by(obj, 'DISTANCE', shape='PLANE', range_min=-1.5, range_max=0.5)
    check(soft(scene, points) == [6, 7, 8], "beyond a plane")  # x - 0.8 > -0.5
    by(obj, 'DISTANCE', shape='AXIS', range_min=0.0, range_max=1.0)
    check(soft(scene, points) == [], "on an axis")


def test_found():
    """By what the library finds of the points: density halves the row; uncertainty takes any cloud with normals."""
    scene = new_scene()
    rng = np.random.default_rng(3)
    dense, wide = rng.uniform((-1, -0.6), (0, 0.6), (6000, 2)), rng.uniform((0, -0.6), (1, 0.6), (1500, 2))
    points = np.c_[np.r_[dense, wide], np.full(7500, -3.0)]
    obj = add_points(points, normals=np.tile((0.0, 0.0, 1.0), (7500, 1)))
    obj.patina.soft.use = True
    by(obj, 'DENSITY', opacity=0.1, use_range=True, range_max=5000.0)
    scene.patina.fill = 'CLOSED'
    alpha = render()["Combined"][..., 3]
    left, right = alpha[16:32, 14:28].mean(), alpha[16:32, 36:50].mean()
    check(left < 0.9 < 0.99 < right, f"what lies dense is soft: {left}, {right}")
    by(obj, 'UNCERTAINTY', use_range=False, threshold=1.0)
    check(render()["Combined"][20:28, 16:48, 3].mean() > 0.99, "no more than wholly uncertain")


def test_linked():
    scene, obj, points = row()
    path = SCRATCH / "soft.xyz"
    path.write_text("//X Y Z Intensity\n" + "".join(f"{x:.6g} {y:.6g} {z:.6g} {k * 10}\n" for k, (x, y, z) in enumerate(points)))
    bpy.data.objects.remove(obj)
    box = bpy.data.objects.new("linked", bpy.data.meshes.new("box"))
    scene.collection.objects.link(box)
    box.patina.linked_file = str(path)
    group = box.patina.soft
    group.use = group.use_radius = True
    group.radius = 0.08
    origin = np.array(box.get("patina_origin", (0.0, 0.0, 0.0)), float) if "patina_origin" in box else np.zeros(3)
    file = patina.native.File(str(path))
    place = np.array(file.positions(), float) + np.array(file.origin) - origin
    name = file.attributes[0]
    check(soft(scene, place) == list(range(COUNT)), "a linked cloud, all of it")
    by(box, 'ATTRIBUTE', attribute=name, use_range=True, range_min=0.0, range_max=80.0, threshold=0.55)
    check(soft(scene, place) == [5, 6, 7, 8], "by a column of its file")
    by(box, 'DISTANCE', range_min=2.9, range_max=3.1, threshold=0.5)  # from the camera
    check(soft(scene, place) == [0, 1, 2, 3, 5, 6, 7, 8], "by distance from the camera: all but the nearest")


def test_panel_is_there():
    check(hasattr(bpy.types, "PATINA_PT_soft"), "the panel is there")


# ---- the histogram ---------------------------------------------------------------------------------------------------


def seen(obj):
    """What the panel shows of a known histogram, once its picture was painted: heights of the bars in pixels, which columns are of
    soft points, and where the threshold's line stands."""
    known = histogram.of(obj)
    histogram.icon(obj, known)
    histogram.paint()
    check(histogram.icon(obj, known) > 0 or bpy.app.background, "an icon")
    image = histogram.pixels(obj)

    def are(color):
        return np.abs(image - color).max(-1) < 0.01

    line = np.flatnonzero(are(histogram._LINE).all(0))
    bars = are(histogram._HARD) | are(histogram._SOFT)
    return bars.sum(0), are(histogram._SOFT).any(0), line


def check_histogram(obj, numbers, what):
    """Against numbers of 0 to 1, counted here."""
    counts = np.bincount(np.minimum((np.asarray(numbers) * 256).astype(int), 255), minlength=256)
    known = histogram.of(obj)
    check((known.counts == counts).all(), f"{what}: counted {known.counts[known.counts > 0]}, not {counts[counts > 0]}")
    heights, soft_columns, line = seen(obj)
    counts = counts.reshape(64, 4).sum(1).repeat(4)  # a bar is four bins wide
    threshold = obj.patina.soft.threshold
    check(len(line) == 2 and abs(line.mean() + 0.5 - 256 * threshold) <= 1.5, f"{what}: the line at {line}, the threshold {threshold}")
    for k in set(range(256)) - set(line):
        wanted = max(np.sqrt(counts[k] / counts.max()) * 248, 2.0) if counts[k] else 0.0
        check(abs(heights[k] - wanted) <= 1.0, f"{what}: column {k} is {heights[k]} high, not {wanted:.1f}")
        check(soft_columns[k] == bool(counts[k] and (k + 0.5) / 256 > threshold), f"{what}: column {k} is soft")


def test_histogram():
    new_scene()
    rng = np.random.default_rng(5)
    points = np.c_[rng.uniform(-1.0, 1.0, (20_000, 2)), np.full(20_000, -3.0)]
    grey = np.clip(np.round(rng.normal(130, 30, 20_000)), 0, 255).astype(np.uint8)
    obj = add_points(points, np.stack([grey] * 3 + [np.full(20_000, 255, np.uint8)], 1))
    group = obj.patina.soft
    group.use = True
    by(obj, 'LUMINANCE', threshold=0.6)
    check(histogram.of(obj) is None, "nothing before a picture")
    render()
    check_histogram(obj, (grey + 1e-4) / 255.0, "luminance")
    check(abs(histogram.of(obj).share(0.6) - (grey > 153).mean()) < 0.02, "so many are soft")
    group.threshold = 0.3
    check_histogram(obj, (grey + 1e-4) / 255.0, "another threshold, without a picture")

    values = (rng.integers(0, 256, 20_000) ** 2 // 256 + 0.5).astype(np.float32)
    obj.data.attributes.new("score", 'FLOAT', 'POINT').data.foreach_set("value", values)
    by(obj, 'ATTRIBUTE', attribute="score", use_range=True, range_min=0.0, range_max=256.0)
    check(histogram.of(obj) is None, "another field is not known yet")
    render()
    check_histogram(obj, values / 256.0, "an attribute")
    check(histogram.of(obj).range == (0.0, 256.0) and abs(histogram.of(obj).number(0.25) - 64.0) < 1e-6, "in its own numbers")
    before = histogram.of(obj).stamp
    render()
    check(histogram.of(obj).stamp == before, "the same field is not read anew")
    by(obj, 'ATTRIBUTE', invert=True)
    check(histogram.of(obj) is None, "inverted: another one")
    render()
    check_histogram(obj, 1.0 - values / 256.0, "inverted")
    check(histogram.of(obj).range == (256.0, 0.0), "its ends changed places")
    values[:5000] = 200.5
    obj.data.attributes["score"].data.foreach_set("value", values)
    point_data.changed(obj.data)
    render()
    check_histogram(obj, 1.0 - values / 256.0, "painted")

    for source, count in (('DISTANCE', 20_000), ('DENSITY', 20_000)):
        by(obj, source, use_range=False, invert=False)
        render()
        known = histogram.of(obj)
        check(known.counts.sum() == count and known.range[0] < known.range[1], f"{source}: {known.range}")


def test_viewport_takes_what_was_painted():
    """As a viewport reads points: again only after Blender said that they changed."""
    _, obj, _ = row()
    obj.data.attributes.new("score", 'FLOAT', 'POINT').data.foreach_set("value", np.linspace(0.0, 1.0, COUNT, dtype=np.float32))
    by(obj, 'ATTRIBUTE', attribute="score")
    clouds, trusted = patina.sync.points.clouds, patina.sync.Trusted()

    def taken():
        notices = []
        graph = bpy.context.evaluated_depsgraph_get()
        item, = clouds.collect(graph, trusted.take(notices), notices)
        cloud = patina.jobs.finish(item.cloud.resolve(patina.native.Progress()))
        return item, cloud, patina.sync.points.soft.field_of(cloud, item.soft)

    item, cloud, field = taken()
    check(taken()[2] is field and trusted.reads == 1, "nothing is read or made anew")
    obj.patina.soft.threshold = 0.7
    obj.update_tag()
    moved, _, same = taken()
    check(same is field and moved.soft != item.soft, "another threshold takes the same field")
    obj.data.attributes["score"].data.foreach_set("value", np.zeros(COUNT, np.float32))
    point_data.changed(obj.data)
    trusted.forget({("Mesh", obj.data.name_full)})
    _, painted, other = taken()
    check(painted is cloud and other is not field and trusted.reads == 2, "painted numbers make another field of the same cloud")


# ---- the brush -------------------------------------------------------------------------------------------------------


def paint(places, **options):
    """Pixels of the final picture."""
    bpy.context.view_layer.update()
    return bpy.ops.object.patina_soft_brush(path=[{"name": "", "loc": place, "time": 0.0} for place in places], **options)


def middle(scene, point):
    row, column = pixel(scene, point)
    return column + 0.5, row + 0.5


def numbers(obj, name="soft"):
    values = np.empty(point_data.count_of(obj.data), np.float32)
    obj.data.attributes[name].data.foreach_get("value", values)
    return values


def cloud():
    """The row, not soft by anything yet, and active."""
    scene, obj, points = row()
    obj.patina.soft.use = False
    bpy.context.view_layer.objects.active = obj
    return scene, obj, points


def refused(**options):
    """What it says."""
    try:
        paint(((10, 10),), **options)
    except RuntimeError as error:
        return str(error)
    raise AssertionError("it was painted")


def test_brush_paints_under_its_way():
    scene, obj, points = cloud()
    between = np.subtract(middle(scene, points[1]), middle(scene, points[0]))[0]
    obj.patina.soft.by, obj.patina.soft.invert = 'LUMINANCE', True
    check(paint([middle(scene, points[2]), middle(scene, points[5])], radius=0.4 * between) == {'FINISHED'}, "a stroke")
    group = obj.patina.soft
    check(group.use and group.by == 'ATTRIBUTE' and group.attribute == "soft" and not group.invert, "the panel goes by it")
    check(group.use_range and (group.range_min, group.range_max) == (0.0, 1.0), "a range that stays")
    check(numbers(obj).tolist() == [0, 0, 1, 1, 1, 1, 0, 0, 0], f"between its two places too: {numbers(obj)}")
    check(soft(scene, points) == [2, 3, 4, 5], "the picture says the same")
    paint([middle(scene, points[3])], radius=0.4 * between, strength=0.0)
    paint([middle(scene, points[8])], radius=0.4 * between, strength=0.75)
    check(numbers(obj).tolist() == [0, 0, 1, 0, 1, 1, 0, 0, 0.75], f"hard again, and weaker: {numbers(obj)}")
    check(len(obj.data.attributes) == len({item.name for item in obj.data.attributes}) and "soft.001" not in obj.data.attributes, "one alone")
    before = numbers(obj)
    check(paint([(1.0, 1.0)], radius=2.0) == {'CANCELLED'} and (numbers(obj) == before).all(), "beside all points: nothing")


def test_brush_paints_what_is_seen():
    """Points behind others only with through; soft ones stand before what is behind them as others do."""
    scene, obj, points = cloud()
    hidden = add_points(points * 2.0, name="behind")  # on the same rays
    bpy.context.view_layer.objects.active = hidden
    stroke = [middle(scene, points[0]), middle(scene, points[-1])]
    check(paint(stroke, radius=3.0) == {'CANCELLED'} and "soft" not in hidden.data.attributes, "nothing of it is seen")
    check(paint(stroke, radius=3.0, through=True) == {'FINISHED'} and numbers(hidden).all(), "through")
    bpy.context.view_layer.objects.active = obj
    paint(stroke, radius=3.0)
    check(numbers(obj).all(), "the nearer ones")
    paint(stroke, radius=3.0, strength=0.0)
    check(not numbers(obj).any(), "hard again, where they were soft before a background")
    check(numbers(hidden).all(), "no other object's")


def test_brush_keeps_what_the_panel_goes_by():
    scene, obj, points = cloud()
    values = np.linspace(10.0, 90.0, COUNT).astype(np.float32)
    obj.data.attributes.new("score", 'FLOAT', 'POINT').data.foreach_set("value", values)
    by(obj, 'ATTRIBUTE', attribute="score", use=True, use_range=True, range_min=0.0, range_max=100.0, threshold=0.7)
    paint([middle(scene, points[1])], radius=3.0)
    found = numbers(obj, "score")
    check(found[1] == 100.0 and (np.delete(found, 1) == np.delete(values, 1)).all() and "soft" not in obj.data.attributes, f"{found}")
    check(soft(scene, points) == [1, 7, 8], "where its range counts it as 1")
    by(obj, 'ATTRIBUTE', use_range=False, invert=True, threshold=0.5)
    paint([middle(scene, points[8])], radius=3.0)
    low, high = obj.patina.soft.range_min, obj.patina.soft.range_max
    check(obj.patina.soft.use_range and 10.0 <= low < 30.0 and 80.0 < high <= 100.0, f"from {low} to {high}")
    check(abs(numbers(obj, "score")[8] - low) < 1e-4 and 8 in soft(scene, points), "inverted: the least is soft")


def test_brush_goes_on_with_weights():
    scene, obj, points = cloud()
    obj.vertex_groups.new(name="faint").add([2, 3], 0.9, 'REPLACE')
    by(obj, 'ATTRIBUTE', attribute="faint", use=True)
    paint([middle(scene, points[6])], radius=3.0)
    name = obj.patina.soft.attribute
    check(name != "faint" and soft(scene, points) == [2, 3, 6], f"{name}: those of the group, and one more")


def test_brush_refuses():
    """With the reason, and nothing is changed."""
    scene, obj, points = cloud()
    obj.modifiers.new("array", 'ARRAY')
    check("modifiers of 'points' make other points" in refused(), "modifiers")
    obj.modifiers.clear()
    scene.camera = None
    check("camera" in refused(), "nothing to see it by")
    scene.camera = next(item for item in scene.objects if item.type == 'CAMERA')
    check("soft" not in obj.data.attributes and not obj.patina.soft.use, "nothing is left behind")
    bpy.ops.object.mode_set(mode='EDIT')
    said = refused()
    bpy.ops.object.mode_set(mode='OBJECT')
    check("only in Object Mode" in said, said)
    faces = bpy.data.objects.new("faces", bpy.data.meshes.new("faces"))
    faces.data.from_pydata([(0, 0, -3), (1, 0, -3), (0, 1, -3)], [], [(0, 1, 2)])
    scene.collection.objects.link(faces)
    bpy.context.view_layer.objects.active = faces
    check("the mesh has faces" in refused(), "faces")
    linked = bpy.data.objects.new("linked", bpy.data.meshes.new("box"))
    scene.collection.objects.link(linked)
    linked.patina.linked_file = str(SCRATCH / "soft.xyz")
    bpy.context.view_layer.objects.active = linked
    check("a linked file's points are not Blender's" in refused(), "a linked file")
    bpy.context.view_layer.objects.active = None
    check("the active object has no points" in refused(), "nothing")
