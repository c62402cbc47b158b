# SPDX-License-Identifier: GPL-3.0-or-later
"""Legends, scale bar, north arrow and title block: in the Overlay pass and burned in, without graphics."""

import math
import re
from unittest import mock

import bpy
import numpy as np
from check_color import scene_of_numbers
from harness import add_points, check, check_close, new_scene, points_of, render
from mathutils import Euler, Matrix
from patina import native
from patina.draw import marks as painting
from patina.sync.view import marks

KEEP = ""  # a folder for the images, to look at


def pictures(scene, name):
    """(Combined, Overlay) of a render."""
    scene.view_layers[0].patina.use_pass_overlay = True
    found = render()
    if KEEP:
        image = bpy.data.images.new(name, found["Overlay"].shape[1], found["Overlay"].shape[0], alpha=True, float_buffer=True)
        image.pixels.foreach_set((found["Overlay"] + found["Combined"] * (1 - found["Overlay"][..., 3:])).reshape(-1))
        image.save_render(f"{KEEP}/{name}.png")
    return found["Combined"], found["Overlay"]


def of_values():
    scene, points, obj = scene_of_numbers(np.linspace(0, 1000, 12))
    scene.render.resolution_x, scene.render.resolution_y = 640, 400
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.patina_color_by(choice="Intensity")
    return scene, obj


def test_ticks_are_round():
    for low, high, wanted in ((0, 1, "0.0 0.2 0.4 0.6 0.8 1.0"), (-0.013, 0.013, "-0.010 -0.005 0.000 0.005 0.010"),
                              (117.2, 1893.0, "200 400 600 800 1,000 1,200 1,400 1,600 1,800"), (3, 3, "3")):
        texts = [text for _, text in marks.ticks(low, high)]
        check(all(low <= value <= high for value, _ in marks.ticks(low, high)), f"{texts} of {low} to {high}")
        check(len(texts) <= 9 and " ".join(texts) == wanted, f"{texts} of {low} to {high}")


def test_legend_of_a_ramp():
    scene, obj = of_values()
    plain, none = pictures(scene, "none")
    check(not none.any(), "an overlay that nobody asked for")
    obj.patina.colors.use_legend, obj.patina.colors.ramp = True, 'HEAT'
    picture, overlay = pictures(scene, "ramp")
    check(overlay[..., 3].any() and not overlay[:, :400].any(), "the legend is at the right")
    # one column of the legend is the ramp, from the smallest value to the largest
    table = native.ramp("heat")
    reddest = overlay[..., 0] - overlay[..., 2]
    column = int(np.argmax((reddest > 0.3).sum(axis=0)))
    rows = np.nonzero(reddest[:, column] > 0.3)[0]
    check(len(rows) > 50, f"{len(rows)} rows of the ramp")
    heights = overlay[:, column, :3].sum(axis=1)
    inside = np.nonzero(heights > 0.06)[0]
    check((np.diff(heights[rows[0]:rows[-1]]) > -1e-4).all(), "brighter from the bottom to the top")
    check_close(overlay[rows[len(rows) // 2], column, :3],
                table[np.abs(table - overlay[rows[len(rows) // 2], column, :3]).sum(axis=1).argmin()], 0.01, "a color of the ramp")
    check(len(inside) >= len(rows), "and black below")
    obj.patina.colors.ramp = 'GREY'
    scene.patina.marks.burn = True
    burned, overlay = pictures(scene, "burned")
    check_close(burned, overlay + plain * (1 - overlay[..., 3:]), 1e-5, "burned in is the overlay over the image")


def test_legend_of_automatic_ranges():
    """The values at the ends are those that images take, in the scene's units; they color the lowest and the highest points."""
    scene = new_scene(64, 48)
    scene.unit_settings.system, scene.unit_settings.scale_length = 'METRIC', 1.0
    obj = add_points(np.random.default_rng(4).uniform((-0.5, -0.5, -4.0), (0.5, 0.5, -2.0), (500, 3)), matrix=Matrix.Translation((0.0, 0.0, -1.0)) @ Matrix.Scale(2.0, 4))
    colors = obj.patina.colors
    colors.use_legend, colors.ramp = True, 'GREY'
    places = points_of(obj)
    world = places * 2.0 + (0.0, 0.0, -1.0)
    for source, values in (('HEIGHT', world[:, 2]), ('OBJECT_HEIGHT', places[:, 2]), ('DISTANCE', np.linalg.norm(world, axis=1))):
        colors.source = source
        found = []
        with mock.patch.object(painting, "paint", side_effect=lambda marks, *size: found.append(marks) or np.zeros((size[1], size[0], 4), np.float32)):
            pictures(scene, f"automatic_{source}")
        legend, = found[0].legends
        texts = [text for _, text in legend.ticks]
        check(texts and all(re.fullmatch(r"-?[\d,.]+", text) for text in texts), f"{source}: {legend.title} {texts}")
        check(re.search(r"\((m|cm|mm)\)$", legend.title), legend.title)
        meters = {"m": 1.0, "cm": 0.01, "mm": 0.001}[legend.title.rpartition("(")[2][:-1]]
        shares, shown = np.array([place for place, _ in legend.ticks]), np.array([float(text.replace(",", "")) for text in texts]) * meters
        size = 2.0 if source == 'OBJECT_HEIGHT' else 1.0
        if len(shown) > 1:  # places and values are on a line from the least to the most
            slope, zero = np.polyfit(shares, shown, 1)
            near = 0.2 if source == 'DISTANCE' else 0.01  # distances end at corners of boxes
            check_close((zero, zero + slope), (values.min() * size, values.max() * size), near * slope, f"{source}: values at the ends")


def test_legend_of_classes():
    scene, points, obj = scene_of_numbers(np.arange(12) % 3 + 4, 'INT', "classification")
    scene.render.resolution_x, scene.render.resolution_y = 640, 400
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.patina_color_by(choice="Class")
    obj.patina.colors.use_legend = True
    table = native.ramp("classes")
    for hidden in (False, True):
        obj.patina.colors.hidden[5] = hidden
        _, overlay = pictures(scene, f"classes_{hidden}")
        shown = {number for number in range(19) if (np.abs(overlay[..., :3] - table[number]).max(axis=2) < 1e-3).sum() > 40}
        check(shown == ({4, 6} if hidden else {4, 5, 6}), f"classes {shown}, hidden {hidden}")


def test_scale_bar():
    """Its white part is as long as it says, in orthographic views; in perspective views at the stated distance."""
    scene, obj = of_values()
    group = scene.patina.marks
    group.use_bar = True
    _, overlay = pictures(scene, "no_bar")
    check(not overlay.any(), "a bar in a perspective view without a distance")
    camera = scene.camera.data
    for name, kind, distance, wide, meters in (("ortho", 'ORTHO', 0.0, 7.0, 1.0), ("ortho_small", 'ORTHO', 0.0, 0.07, 0.01),
                                               ("perspective", 'PERSP', 10.0, None, None)):
        camera.type, group.bar_distance = kind, distance
        if wide:
            camera.ortho_scale = wide
        else:
            wide = distance * camera.sensor_width / camera.lens
            meters = marks.round_step(marks.BAR * wide)
        _, overlay = pictures(scene, name)
        lit = (overlay[..., :3].min(axis=2) > 0.5)
        longest = max(int(row.sum()) for row in lit)
        check_close(longest, meters / wide * 640, 1.5, f"{name}: pixels of {meters} units")
    view = SimpleView(camera)
    scene.unit_settings.system = 'METRIC'
    check(marks._bar(scene, view).text == "1 m at 10 m", marks._bar(scene, view).text)


class SimpleView:
    panorama = None

    def __init__(self, camera):
        from patina.description.view import Camera
        self.camera = Camera(0, (1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1), -0.36, 0.36, -0.2, 0.2, 0.1, 100.0)


def test_north_and_title():
    scene, obj = of_values()
    group = scene.patina.marks
    group.use_north = True
    scene.camera.rotation_euler = Euler((0, 0, 0))
    for turn, wanted in ((0.0, (0, 1)), (math.radians(90), (1, 0))):
        group.north = turn
        _, overlay = pictures(scene, f"north_{wanted[0]}")
        lit = overlay[..., :3].min(axis=2) > 0.5
        y, x = np.nonzero(lit)
        panel = np.nonzero(overlay[..., 3])
        off = np.array((x.mean() - panel[1].mean(), y.mean() - panel[0].mean()))
        along = wanted.index(1)
        # the needle is wide behind and pointed ahead
        check(len(x) > 50 and abs(off[1 - along]) < 1.5 and off[along] < -1.5, f"north along {wanted}: {off} off")
    scene.camera.rotation_euler = Euler((math.radians(90), 0, 0))
    group.north = 0.0
    _, overlay = pictures(scene, "north_along")
    check(not overlay.any(), "an arrow along the view")
    group.use_north, group.use_title, group.title, group.note = False, True, "Façade 12°", "Ø 5 m, 2026"
    _, overlay = pictures(scene, "title")
    check(overlay[:100, 320:, 3].any() and not overlay[:, :320].any(), "the title is at the lower right")
    size = painting.line("I", 20.0).shape[1]
    check(painting.line("IIII", 20.0).shape[1] > 2 * size and painting.line("\u4e2d", 20.0).any(), "letters beyond Latin-1 become ?")


def test_measurements_in_renders():
    """In the Overlay pass their lines join the pixels of their points, also of a border, and are cut at the near clip; hidden ones are not there."""
    scene = new_scene(400, 300)
    obj = add_points([(-1.0, 0.5, -6.0), (1.0, -0.5, -6.0), (0.0, 0.0, 5.0)])
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.patina_add_measurement(kind='DISTANCE', coordinates="-1 0.5 -6  1 -0.5 -6", space='OBJECT')
    scene.render.image_settings.color_mode = 'RGBA'
    _, overlay = pictures(scene, "measures_off")
    check(not overlay.any(), "measurements that nobody asked for")
    scene.patina.marks.use_measures = True
    focal = 400 * 50 / 36 / 6
    ends = np.array([(200 - focal, 150 + 0.5 * focal), (200 + focal, 150 - 0.5 * focal)])

    def off_line(found):
        """Pixels from the line through both ends."""
        x, y = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
        return np.abs(x * (found[:, 1] - ends[0, 1]) - y * (found[:, 0] - ends[0, 0]))

    def lit(overlay):
        return np.argwhere((overlay[..., 0] > 0.5) & (overlay[..., 2] < 0.2))[:, ::-1] + 0.5

    _, overlay = pictures(scene, "measures")
    found, along = lit(overlay), ends[1] - ends[0]
    across = off_line(found)
    share = (found - ends[0]) @ along / (along @ along)
    check(len(found) > 150 and across.max() < 4.0, f"{len(found)} pixels, {across.max()} off the line")
    check(abs(share.min()) < 0.02 and abs(share.max() - 1.0) < 0.02, f"from {share.min()} to {share.max()}")
    check((overlay[..., :3].min(axis=2) > 0.6).sum() > 20, "no value is written")
    scene.render.use_border, scene.render.border_min_x, scene.render.border_max_x = True, 0.25, 0.75
    scene.render.border_min_y, scene.render.border_max_y = 0.25, 0.75
    _, part = pictures(scene, "measures_border")
    if part.shape == overlay.shape:
        part = part[75:225, 100:300]
    found = lit(part) + (100, 75)
    check(len(found) > 50 and off_line(found).max() < 4.0, "of a border: off the line")
    scene.render.use_border = False
    bpy.ops.object.patina_add_measurement(kind='DISTANCE', coordinates="0 0 -6  0 0.5 20", space='OBJECT')  # the second is behind the camera
    _, behind = pictures(scene, "measures_behind")
    check(np.isfinite(behind).all() and behind[160:, 195:206, 3].any(), "the part before the camera")
    for entry in obj.patina.measures.entries:
        entry.hide = True
    _, overlay = pictures(scene, "measures_hidden")
    check(not overlay.any(), "hidden ones")
