# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours of points: ramps over attributes, heights and distances, custom ramps, exposure, contrast, hidden classes."""

import os
import struct

import bpy
import numpy as np
from check_import import import_ply, write_ply
from check_points import grid, pixel
from harness import SCRATCH, add_points, check, check_close, drawn, linear, new_scene, render, reports, stats
from mathutils import Matrix, Vector
from patina import native
from patina.sync.points import coloring

GREEN = (30, 180, 90, 255)


def scene_of_numbers(values, kind='FLOAT', name="intensity"):
    """(scene, points, object): green points with an attribute; the object's ramp is over it, unlit."""
    scene = new_scene()
    points = grid()
    obj = add_points(points, np.tile(np.array(GREEN, np.uint8), (len(points), 1)))
    attribute = obj.data.attributes.new(name, kind, 'POINT')
    attribute.data.foreach_set("value", np.asarray(values, np.float32 if kind == 'FLOAT' else np.int32))
    obj.patina.lighting = 'UNLIT'
    obj.patina.colors.source = 'SCALAR'
    obj.patina.colors.scalar = name
    obj.patina.colors.ramp = 'GREY'
    return scene, points, obj


def test_attribute_ramp():
    values = np.linspace(0, 1000, 12)
    for kind in ('FLOAT', 'INT'):
        scene, points, obj = scene_of_numbers(values, kind)
        picture = render()["Combined"]
        grey = native.ramp("grey")
        for point, value in zip(points, np.float32(values) if kind == 'FLOAT' else values.astype(int)):
            place = value / 1000 * 255
            low = min(int(place), 254)
            wanted = grey[low] + (place - low) * (grey[low + 1] - grey[low])
            check_close(picture[pixel(scene, point)][:3], wanted, 2e-5, f"{kind} {value}")
        obj.patina.colors.use_range = True
        obj.patina.colors.range_min, obj.patina.colors.range_max = 500, 501
        picture = render()["Combined"]
        check_close(picture[pixel(scene, points[0])][:3], (0, 0, 0), 1e-6, "below the range")
        check_close(picture[pixel(scene, points[-1])][:3], (1, 1, 1), 1e-6, "beyond the range")


def test_missing_attribute():
    scene, points, obj = scene_of_numbers(np.zeros(12))
    obj.patina.colors.scalar = "nowhere"
    picture = render()["Combined"]
    check(any("no point attribute 'nowhere'" in text for _, text in reports), f"reports {reports}")
    check_close(picture[pixel(scene, points[0])][:3], linear(GREEN[:3]), 2e-6, "its own colours instead")


def test_fixed_and_grade():
    scene, points, obj = scene_of_numbers(np.zeros(12))
    obj.patina.colors.source = 'FIXED'
    obj.patina.color = (0.2, 0.3, 0.05)
    place = pixel(scene, points[3])
    check_close(render()["Combined"][place][:3], (0.2, 0.3, 0.05), 1e-6, "fixed")
    obj.patina.colors.exposure = 1.0
    check_close(render()["Combined"][place][:3], (0.4, 0.6, 0.1), 2e-6, "a stop more")
    obj.patina.colors.contrast = 2.0
    wanted = 0.18 * (np.array((0.4, 0.6, 0.1)) / 0.18) ** 2
    check_close(render()["Combined"][place][:3], wanted, 5e-6, "contrast around mid grey")
    obj.patina.colors.source = 'OWN'
    wanted = 0.18 * (2 * linear(GREEN[:3]) / 0.18) ** 2
    check_close(render()["Combined"][place][:3], wanted, 1e-5, "of their own colours")


def test_height_and_distance():
    scene = new_scene()
    world = np.array([(x, y, -3.0 + 0.6 * x + y) for x in (-0.47, 0.02, 0.51) for y in (-0.41, 0.03, 0.38)])
    matrix = Matrix.Translation((0.3, -1, 2)) @ Matrix.Rotation(0.7, 4, 'X') @ Matrix.Diagonal((1, -2, 0.5, 1))
    local = np.array([matrix.inverted() @ Vector(point) for point in world])
    obj = add_points(local, matrix=matrix)
    colors = obj.patina.colors
    obj.patina.lighting = 'UNLIT'
    colors.ramp, colors.use_range = 'GREY', True
    grey = native.ramp("grey")
    for source, values, ends in (('HEIGHT', world[:, 2], (-5.0, -1.0)), ('OBJECT_HEIGHT', local[:, 2], (-12.0, -3.0)),
                                 ('DISTANCE', np.linalg.norm(world, axis=1), (2.0, 4.5))):
        colors.source = source
        colors.range_min, colors.range_max = ends
        picture = render()["Combined"]
        for point, value in zip(world, values):
            share = (value - ends[0]) / (ends[1] - ends[0])
            check(0 < share < 1, f"{source}: {value} lies on the ramp")
            wanted = np.interp(share, np.linspace(0, 1, 256), grey[:, 0])
            check_close(picture[pixel(scene, point)][0], wanted, 0.03, f"{source} at {value}")  # of the pixel's middle


def test_custom_ramp():
    scene, points, obj = scene_of_numbers(np.linspace(0, 1, 12))
    bpy.context.view_layer.objects.active = obj
    obj.patina.colors.ramp = 'HEAT'
    check(bpy.ops.object.patina_new_ramp() == {'FINISHED'}, "a ramp was made")
    colors = obj.patina.colors
    check(colors.ramp == 'CUSTOM' and len(colors.texture.color_ramp.elements) > 2, "with stops")
    ramp = colors.texture.color_ramp
    picture = render()["Combined"]
    for point, share in zip(points, np.linspace(0, 1, 12)):
        check_close(picture[pixel(scene, point)][:3], ramp.evaluate(float(share))[:3], 2e-3, f"heat at {share}")
    ramp.interpolation = 'CONSTANT'
    for element, color in zip(ramp.elements, ((1, 0, 0, 1), (0, 0, 1, 1))):
        element.color = color
    place = pixel(scene, points[0])
    check_close(render()["Combined"][place][:3], (1, 0, 0), 1e-6, "a stop that was painted")
    colors.texture = None
    check_close(render()["Combined"][place][:3], (0, 0, 0), 1e-6, "no texture: black to white")


def test_robust_range():
    values = np.append(np.linspace(0, 10, 11), 1e6)
    scene, points, obj = scene_of_numbers(values)
    bpy.context.view_layer.objects.active = obj
    check(bpy.ops.object.patina_robust_range() == {'FINISHED'}, "a range was found")
    colors = obj.patina.colors
    check(colors.use_range and colors.range_min < 1.0, f"range {colors.range_min} {colors.range_max}")
    check_close(colors.range_min, np.quantile(values, 0.01), 1e-4, "1 % below")


def test_color_by():
    """The menu lists what the cloud has and nothing else; each entry shows its values between the 1st and 99th percentile."""
    values = np.append(np.linspace(0, 10, 11), 1e6)
    scene, points, obj = scene_of_numbers(values)
    bpy.context.view_layer.objects.active = obj
    colors = obj.patina.colors

    def listed():
        return [choice.label for choice in coloring.choices(obj)]

    always = ["Color", "One Color", "Height", "Local Height", "Distance from Camera", "Trust"]
    check(listed() == [*always[:2], "Intensity", *always[2:]], f"listed {listed()}")
    try:
        bpy.ops.object.patina_color_by(choice="Class")
        check(False, "a class that it does not have")
    except RuntimeError as error:
        check("has no 'Class'" in str(error), str(error))
    for name, kind, found in (("classification", 'INT', np.arange(12) % 4 + 2), ("gps_time", 'FLOAT', np.arange(12)),
                              ("scan", 'INT', np.arange(12) % 3), ("height_above_ground", 'FLOAT', np.arange(12)),
                              ("distance", 'FLOAT', np.linspace(-1, 3, 12)), ("mine", 'FLOAT', np.arange(12))):
        obj.data.attributes.new(name, kind, 'POINT').data.foreach_set(
            "value", np.asarray(found, np.int32 if kind == 'INT' else np.float32))
    obj.data.attributes.new("Normal", 'FLOAT_VECTOR', 'POINT').data.foreach_set("vector", np.tile(np.float32((0, -0.6, 0.8)), 12))
    wanted = ["Intensity", "Class", "Scan", "Time", "Height Above Ground", "Distance to Other", "mine", "Normal"]
    check(listed() == [*always[:2], *wanted, *always[2:]], f"listed {listed()}")

    place = pixel(scene, points[5])
    for label, name, ramp in (("Intensity", "intensity", 'GREY'), ("Time", "gps_time", 'VIRIDIS'), ("Distance to Other", "distance", 'DIVERGING')):
        check(bpy.ops.object.patina_color_by(choice=label) == {'FINISHED'}, label)
        check((colors.source, colors.scalar, colors.ramp, colors.use_range) == ('SCALAR', name, ramp, True), label)
        check(coloring.current(obj) == label, f"{coloring.current(obj)} is shown")
        held = np.empty(12, np.float32)
        obj.data.attributes[name].data.foreach_get("value", held)
        low, high = np.quantile(held, (0.01, 0.99))
        if ramp == 'DIVERGING':
            low, high = -max(-low, high), max(-low, high)
        check_close((colors.range_min, colors.range_max), (low, high), 1e-3 * high, label)
        table = native.ramp(ramp.lower())
        share = np.clip((held[5] - low) / (high - low), 0, 1) * 255
        expected = [np.interp(share, np.arange(256), table[:, i]) for i in range(3)]
        check_close(render()["Combined"][place][:3], expected, 1e-3, label)
    bpy.ops.object.patina_color_by(choice="Class")
    check(colors.ramp == 'CLASSES' and not colors.use_range, "classes have no range")
    check_close(render()["Combined"][place][:3], native.ramp("classes")[5 % 4 + 2], 1e-4, "the color of its class")
    bpy.ops.object.patina_color_by(choice="Normal")
    check(coloring.current(obj) == "Normal", coloring.current(obj))
    check_close(render()["Combined"][place][:3], (0.5, 0.2, 0.9), 1e-5, "normals of -1 to 1 are colors of 0 to 1")
    bpy.ops.object.patina_color_by(choice="Color")
    check_close(render()["Combined"][place][:3], linear(GREEN[:3]), 2e-6, "its own colors again")
    bpy.ops.object.patina_color_by(choice="Height")
    heights = points[:, 2] if points.ndim == 2 else points
    check_close((colors.range_min, colors.range_max), np.quantile(heights, (0.01, 0.99)), 1e-4, "range of heights") if colors.use_range \
        else check(np.ptp(heights) == 0, "a range of heights")


def test_hidden_classes():
    classes = np.arange(12) % 4 + 2
    scene, points, obj = scene_of_numbers(classes, 'INT', "classification")
    obj.patina.colors.ramp = 'CLASSES'
    obj.patina.colors.scalar = "classification"
    picture = render()
    table = native.ramp("classes")
    for point, number in zip(points, classes):
        check_close(picture["Combined"][pixel(scene, point)][:3], table[number], 1e-4, f"class {number}")
    obj.patina.colors.hidden[2] = True
    obj.patina.colors.hidden_more = "5, 70-300, nonsense"
    picture = render()
    shown = {tuple(pixel(scene, point)) for point, number in zip(points, classes) if number in (3, 4)}
    check(drawn(picture) == shown, f"{len(drawn(picture))} pixels, {len(shown)} expected")


def write_las(path):
    """Nine points with intensity 0, 100 .. 800; the last three are vegetation."""
    points = [(x, y, -30) for y in (-6, 0, 6) for x in (-6, 0, 6)]
    head = bytearray(227)
    head[:4], head[24], head[25] = b"LASF", 1, 2
    struct.pack_into("<HIIBHI", head, 94, 227, 227, 0, 0, 20, len(points))
    struct.pack_into("<12d", head, 131, 0.1, 0.1, 0.1, 0, 0, 0, 0.6, -0.6, 0.6, -0.6, -3, -3)
    body = b"".join(struct.pack("<iiiHBBbBH", *point, 100 * i, 9, 5 if i > 5 else 2, 0, 0, 0)
                    for i, point in enumerate(points))
    path.write_bytes(bytes(head) + body)
    return np.array(points) * 0.1


def test_after_import():
    """Intensity and class of a LAS file, at once and as a linked cloud."""
    for link in (False, True):
        scene = new_scene()
        path = SCRATCH / f"flight{int(link)}.las"
        points = write_las(path)
        bpy.ops.import_scene.patina_points(filepath=str(path), files=[{"name": path.name}], directory=str(SCRATCH), link=link)
        obj = bpy.context.view_layer.objects.active
        check(bool(obj.patina.linked_file) == link, "linked as asked")
        obj.patina.lighting = 'UNLIT'
        colors = obj.patina.colors
        check(bpy.ops.object.patina_color_by(choice="Intensity") == {'FINISHED'} and colors.use_range, f"by intensity, link {link}")
        labels = [choice.label for choice in coloring.choices(obj) if choice.label != "Color"]
        check(labels[:3] == ["One Color", "Intensity", "Class"], f"{labels} are listed, link {link}")
        check((colors.source, colors.scalar, colors.ramp) == ('SCALAR', "intensity", 'GREY'), f"set, link {link}")
        colors.use_range = False
        picture = render()
        grey = native.ramp("grey")
        for i, point in enumerate(points):
            wanted = np.interp(i / 8, np.linspace(0, 1, 256), grey[:, 0])
            check_close(picture["Combined"][pixel(scene, point)][0], wanted, 2e-3, f"point {i}, link {link}")
        colors.hidden[5] = True
        check(len(drawn(render())) == 6, f"vegetation is hidden, link {link}")
        bpy.context.view_layer.objects.active = obj
        check(bpy.ops.object.patina_robust_range() == {'FINISHED'}, f"a range, link {link}")
        check(colors.range_max > colors.range_min, f"range {colors.range_min} {colors.range_max}")
        colors.scalar = "nowhere"
        render()
        check(any("'nowhere'" in text for _, text in reports), f"reports {reports}, link {link}")
        os.unlink(path)


def check_lent_colors(link):
    """With Color Uncolored Points off, lent points are black and Source is 1 there; all other pixels stay, and it needs no analysis anew."""
    scene = new_scene(64, 48)
    scene.patina.smooth, scene.view_layers[0].patina.use_pass_source = 'OFF', True
    side, rng = 90, np.random.default_rng(9)
    v, u = (values.reshape(-1) for values in np.mgrid[:side, :side])
    places = np.stack([(u / side - 0.5) * 4, (v / side - 0.5) * 4, np.full(u.shape, -4.0)], 1) + rng.uniform(-0.01, 0.01, (side * side, 3))
    colors = np.where((rng.random(side * side) < 0.06)[:, None], 0, (200, 160, 120))
    path = write_ply(f"lent_{link}.ply", [(axis, "f4", places[:, k]) for k, axis in enumerate("xyz")]
                     + [(name, "u1", colors[:, k]) for k, name in enumerate(("red", "green", "blue"))])
    obj, = import_ply(path, link=link)
    obj.patina.lighting = 'UNLIT'
    group = obj.patina.points
    check(group.use_lent_colors, "on by default")
    lent = render()
    group.use_lent_colors = False
    black = render()
    check(not any(text.startswith("Analyzing") for text in stats), "analyzed again")
    marked, measured = (lent["Source"][..., 0] == value for value in (0.5, 1.0))
    check(marked.sum() > 30 and measured.sum() > 1000, f"{marked.sum()} and {measured.sum()} pixels")
    check(lent["Combined"][marked][:, :3].min() > 0.1 and not black["Combined"][marked][:, :3].any(), "black where a color was lent")
    check((black["Source"][marked] == 1.0).all() and not (black["Source"] == 0.5).any(), "Source")
    check((black["Combined"][measured] == lent["Combined"][measured]).all(), "the others stay")
    group.scans.add().gain = 0.5
    dim = render()["Combined"]
    check(not dim[marked][:, :3].any(), "black with a grade")
    check_close(dim[measured][:, :3], 0.5 * lent["Combined"][measured][:, :3], 0.03, "graded")
    group.scans.clear()
    obj.patina.colors.source = 'FIXED'
    fixed = render()["Combined"]
    group.use_lent_colors = True
    check((render()["Combined"] == fixed).all(), "one color for all points")
    obj.patina.colors.source = 'OWN'
    check((render()["Combined"] == lent["Combined"]).all(), "on again")


def test_lent_colors():
    check_lent_colors(False)


def test_lent_colors_of_links():
    check_lent_colors(True)


def test_uncolored_points_take_their_neighbors_color():
    """Black specks among colored points are gone in the image and marked in Source; a black square stays; with other colors likewise."""
    side = 90
    scene = new_scene(64, 48)
    scene.patina.smooth, scene.view_layers[0].patina.use_pass_source = 'OFF', True
    v, u = (values.reshape(-1) for values in np.mgrid[:side, :side])
    rng = np.random.default_rng(9)
    places = np.stack([(u / side - 0.5) * 4, (v / side - 0.5) * 4, np.full(u.shape, -4.0)], 1) + rng.uniform(-0.01, 0.01, (side * side, 3))
    colors = np.full((side * side, 4), (200, 160, 120, 255), np.uint8)
    square = (abs(u - 45) < 8) & (abs(v - 45) < 8)
    specks = (rng.random(side * side) < 0.06) & (abs(u - 45) + abs(v - 45) > 24)
    colors[square | specks, :3] = 0
    obj = add_points(places, colors)
    obj.patina.lighting = 'UNLIT'
    for attempt in range(2):
        picture = render()
        seen = picture["Source"][..., 0]
        marked = seen == 0.5
        share = marked.sum() / ((seen == 1) | marked).sum()
        check(0.02 < share < 0.1, f"{share:.3f} are marked")
        check_close(np.median(picture["Combined"][marked][:, :3], axis=0), linear((200, 160, 120))[:3] if attempt == 0 else linear((90, 90, 200))[:3], 0.02,
                    "their color")
        black = (picture["Combined"][..., :3].max(axis=2) < 0.02) & (picture["Combined"][..., 3] > 0.99)
        rows, columns = np.nonzero(black)
        check(len(rows) > 20 and abs(rows - 23.5).max() < 9 and abs(columns - 31.5).max() < 9, "the square alone is black")
        other = np.where((square | specks)[:, None], (0, 0, 0, 255), (90, 90, 200, 255)) / 255.0
        other[:, :3] = np.where(other[:, :3] <= 0.04045, other[:, :3] / 12.92, ((other[:, :3] + 0.055) / 1.055) ** 2.4)
        name = next(a.name for a in obj.data.attributes if a.data_type in {'BYTE_COLOR', 'FLOAT_COLOR'})
        obj.data.attributes[name].data.foreach_set("color", other.astype(np.float32).ravel())
        obj.data.update_tag()
    obj.patina.analysis = 'OFF'
    picture = render()
    check(not (picture["Source"][..., 0] == 0.5).any(), "nothing is marked without an analysis")
