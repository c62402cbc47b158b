# SPDX-License-Identifier: GPL-3.0-or-later
"""What final renders have beyond one picture: more passes, samples, tiles, stereo, options of the command line."""

import sys
import time

import bpy
import numpy as np
from check_passes import dense_scene
from check_points import pixel
from harness import (
    add_points,
    check,
    check_close,
    failing_render,
    new_scene,
    patina,
    render,
    reports,
    set_world,
    sphere,
    stats,
    written,
)
from mathutils import Matrix, Vector
from patina import jobs, memory, native, options
from patina.draw import engine, viewport
from patina.draw import render as drawing
from patina.sync.analyses.analyzing import ANALYSES
from patina.sync.points import attributes, built, taking


def test_position():
    for kind in ('PERSP', 'ORTHO'):
        scene = new_scene()
        scene.view_layers[0].use_pass_position = True
        scene.camera.data.type = kind
        scene.camera.matrix_world = Matrix.Translation((10, 20, 5)) @ Matrix.Rotation(0.3, 4, 'Y')
        point = scene.camera.matrix_world @ Vector((0.21, 0.13, -3.0))
        add_points([point])
        bpy.context.view_layer.update()
        picture = render()["Position"]
        # the pass tells the pixel's centre at the point's depth: within half a pixel of 64
        check_close(picture[pixel(scene, point)], point, 0.06, f"{kind} position")
        picture[pixel(scene, point)] = 0
        check(not picture.any(), "position where nothing is")


def test_mist():
    scene = new_scene()
    scene.view_layers[0].use_pass_mist = True
    world = set_world((0, 0, 0))
    world.mist_settings.start, world.mist_settings.depth, world.mist_settings.falloff = 2.0, 4.0, 'LINEAR'
    add_points([(0.01, 0.01, -3), (0.9, 0.4, -3), (0.01, -0.6, -9)])
    bpy.context.view_layer.update()
    picture = render()["Mist"][..., 0]
    check_close(picture[pixel(scene, (0.01, 0.01, -3))], 0.25, 2e-3, "before the camera")
    aside = (np.linalg.norm((0.9, 0.4, 3)) - 2) / 4
    check_close(picture[pixel(scene, (0.9, 0.4, -3))], aside, 5e-3, "aside")
    check_close(picture[pixel(scene, (0.01, -0.6, -9))], 1, 0, "vanished")
    check(picture[0, 0] == 1, "nothing is far away")
    world.mist_settings.falloff = 'QUADRATIC'
    check_close(render()["Mist"][..., 0][pixel(scene, (0.01, 0.01, -3))], 0.0625, 2e-3, "quadratic")


def test_error_target():
    """A coarse target leaves filling out where it is met without, a fine one keeps it; Quality and Hole Filling give way."""
    scene = dense_scene()
    scene.patina.surface = 'FILL'
    scene.view_layers[0].patina.use_pass_source = True

    def filled():
        return int((np.abs(render()["Source"]) > 1.0).sum())

    check(filled() > 0, "as set, some pixels are filled")
    scene.patina.error_target = 50.0
    check(filled() == 0, "50% is met by measured points alone")
    scene.patina.fill = 'OFF'
    scene.patina.error_target = 0.01
    check(filled() > 0, "0.01% asks for all that there is")
    scene.patina.error_target = 0.0
    check(filled() == 0, "as set: filling is off")


def test_object_index():
    """Every pixel of an object, measured or filled, has its number; instances too."""
    scene = dense_scene()
    scene.view_layers[0].use_pass_object_index = True
    scene.patina.antialias = 'OFF'
    bpy.data.objects["points"].pass_index = 7
    positions, colors, normals = sphere(6000, 0.5, (1, 0, -3))
    add_points(positions, colors, normals, "other").pass_index = 3
    picture = render()
    index = picture.get("IndexOB", picture.get("Object Index"))[..., 0]
    alpha, depth = picture["Combined"][..., 3], picture["Depth"][..., 0]
    check(set(np.unique(index)) == {0, 3, 7}, f"{np.unique(index)}")
    check(((index > 0) == (alpha > 0)).all(), "index and alpha disagree")
    near = [float(depth[index == number].min()) for number in (3, 7)]
    check(abs(near[0] - 2.5) < 0.02 and abs(near[1] - 3.0) < 0.05, f"nearest {near}")


def test_tiles_are_the_whole():
    scene = dense_scene(97, 71)
    scene.view_layers[0].use_pass_object_index = True
    whole = render()
    scene.patina.tile_size = 32
    tiled = render()
    check(set(whole) == set(tiled), f"{set(tiled)}")
    for name, pixels in whole.items():
        check((pixels == tiled[name]).all(), f"{name} differs in {np.count_nonzero(pixels != tiled[name])} values")


def test_tiles_of_regions():
    check(drawing.tiles((0, 0, 100, 50), 0) == [(0, 0, 100, 50)], "a small picture is one tile")
    large = drawing.tiles((0, 0, 16384, 16384), 0)
    check(len(large) == 16 and large[0] == (0, 0, 4096, 4096), f"{large[:2]}")
    odd = drawing.tiles((3, 5, 70, 40), 32)
    check(sum((x1 - x0) * (y1 - y0) for x0, y0, x1, y1 in odd) == 67 * 35, f"{odd}")


def test_tiles_by_free_memory():
    """Where memory is short a picture is made of tiles that fit, with the same pixels; they are about as large as each other."""
    giga = 1 << 30
    check(drawing.tiles((0, 0, 6000, 6000), 0, 16 * giga) == drawing.tiles((0, 0, 6000, 6000), 3000), "halves")
    for budget in (giga // 4, giga, 4 * giga):
        sides = [x1 - x0 for x0, _, x1, _ in drawing.tiles((0, 0, 6000, 6000), 0, budget)]
        check(max(sides) ** 2 * drawing.PIXEL_BYTES <= budget and min(sides) > 0.9 * max(sides), f"{budget}: {sides[:4]}")
    check(len(drawing.tiles((0, 0, 600, 600), 0, 0)) == 4, "the least are 512")
    check(memory.free() is None or 1 << 26 < memory.free() < 1 << 50, f"{memory.free()} bytes are free")
    scene = dense_scene(700, 600)
    whole = render()
    memory.limit = 1000
    try:
        tiled = render()
    finally:
        memory.limit = 0
    for name, pixels in whole.items():
        check((pixels == tiled[name]).all(), f"{name} differs")
    check(scene.patina.tile_size == 0, "nobody chose tiles")


def test_smaller_tiles_where_the_device_refuses():
    """A device that refuses large images gets smaller and smaller tiles, with the same pixels and without a warning. One that refuses
    every size leaves one error."""
    scene = dense_scene(1100, 1030)
    whole, honest, refused, most = render(), native.Frame.render, [], 700 * 700

    def picky(self, drawn):
        x0, y0, x1, y1 = region[0]
        if (x1 - x0) * (y1 - y0) > most:
            refused.append(region[0])
            raise native.PatinaError("a large image: render it in regions", native.TOO_LARGE)
        honest(self, drawn)

    region, set_settings = [None], native.Scene.set_settings

    def noted(self, **settings):
        region[0] = settings["region"]
        set_settings(self, **settings)

    native.Frame.render, native.Scene.set_settings = picky, noted
    reports.clear()
    try:
        for scene.patina.tile_size in (0, 1000):
            refused.clear()
            tiled = render()
            check(refused and (scene.patina.tile_size or refused[0] == (0, 0, 1100, 1030)), f"{refused}")
            for name, pixels in whole.items():
                check((pixels == tiled[name]).all(), f"{name} differs")
        check(not [text for kind, text in reports if kind in {'WARNING', 'ERROR'}], f"{reports}")
        most = 0
        check("render it in regions" in str(failing_render()), f"{reports}")
    finally:
        native.Frame.render, native.Scene.set_settings = honest, set_settings


def test_small_clouds_beside_each_other():
    """Many small clouds are built together, not one after another: the same picture, and cancelled as readily."""
    def fill():
        new_scene(96, 72)
        for index in range(40):
            place = (index % 8 - 3.5, index // 8 - 2, -9)
            obj = add_points(*sphere(400, 0.4, place), name=f"ball {index:02}")
            obj.patina.analysis = 'ALWAYS' if index % 2 else 'OFF'
        built.CACHE.clear()

    fill()
    small, taking.SMALL = taking.SMALL, 0
    run, waits = jobs.run, []
    jobs.run = lambda *arguments: (waits.append(1), run(*arguments))[1]
    try:
        alone = render()
        one_by_one = len(waits)
        taking.SMALL = small
        built.CACHE.clear()
        waits.clear()
        together = render()
    finally:
        jobs.run, taking.SMALL = run, small
    check(one_by_one >= 40 and len(waits) <= 4, f"{one_by_one} and {len(waits)} times the artist's Blender waited")
    for name, pixels in alone.items():
        check((pixels == together[name]).all(), f"{name} differs")
    check(any("40 small clouds" in text for text in stats), f"{stats}")
    built.CACHE.clear()
    stopped, engine.PatinaRenderEngine._stopped = engine.PatinaRenderEngine._stopped, lambda self: True
    try:
        check(render() == {}, "a picture of a cancelled render")
    finally:
        engine.PatinaRenderEngine._stopped = stopped
    check(render()["Combined"][..., 3].any(), "and the next one draws")


def test_samples():
    """More samples come nearer to the share of a pixel that is covered; data passes do not change."""
    scene = dense_scene(64, 64)
    scene.patina.antialias = 'OFF'
    scene.camera.data.sensor_fit = 'HORIZONTAL'
    one = render()
    scene.patina.samples = 16
    many = render()
    check((one["Depth"] == many["Depth"]).all(), "depth changed")
    alpha = many["Combined"][..., 3]
    edges = (alpha > 0.01) & (alpha < 0.99)
    check(40 < edges.sum() < 400, f"{edges.sum()} soft pixels")
    check(set(np.unique(one["Combined"][..., 3])) == {0, 1}, "one sample without anti-aliasing is hard")
    check_close(alpha * 16, np.rint(alpha * 16), 1e-4, "a mean of sixteen hard pixels")
    areas = [float(picture["Combined"][..., 3].sum()) for picture in (one, many)]
    check(abs(areas[1] / areas[0] - 1) < 0.01, f"areas {areas}")


def test_stereo():
    scene = new_scene(64, 48)
    scene.render.use_multiview = True
    scene.render.views_format = 'STEREO_3D'
    scene.camera.data.stereo.convergence_mode = 'PARALLEL'
    scene.camera.data.stereo.interocular_distance = 0.2
    add_points([(0, 0, -2)])
    render()
    check([eye for eye, _ in written] == ["left", "right"], f"{[eye for eye, _ in written]}")
    columns = [int(np.argwhere(planes["COMBINED"][..., 3] > 0)[0][1]) for _, planes in written]
    wanted = 64 * scene.camera.data.lens / scene.camera.data.sensor_width * 0.2 / 2
    check(abs(columns[0] - columns[1] - wanted) <= 1, f"columns {columns}, {wanted:.1f} apart wanted")


def test_options():
    read = options.read
    check(read(["blender", "-b"]) == {}, "no options")
    check(read(["blender", "--", "--other", "1", "--patina-device", "cpu", "--patina-samples=4"]) ==
          {"device": 'CPU', "samples": 4}, "two options")
    check(read(["--", "--patina-strict", "--patina-threads", "2"]) == {"strict": 1, "threads": 2}, "a switch")
    check(read(["--", "--patina-noise", "0.02"]) == {"noise": 0.02}, "noise")
    for words, part in ((["--patina-noise", "much"], "a number from 0 to 1"), (["--patina-device", "abacus"], "auto, cpu"), (["--patina-colour"], "only device"),
                        (["--patina-threads", "many"], "a number"),
                        (["--patina-strict=no"], "does not take a value")):
        try:
            read(["--", *words])
        except native.PatinaError as error:
            check(part in str(error), str(error))
        else:
            check(False, f"{words} was taken")
    scene = dense_scene()
    before = sys.argv
    sys.argv = ["blender", "--", "--patina-device", "cpu-scalar", "--patina-quality", "paper", "--patina-threads", "1"]
    try:
        described = []
        draw, drawing.draw = drawing.draw, lambda item, *rest: described.append(item) or draw(item, *rest)
        try:
            render()
        finally:
            drawing.draw = draw
        check((described[0].device.name, described[0].device.threads) == ("cpu-scalar", 1), f"{described[0].device}")
        check(described[0].settings.quality == 1, "quality")
        check(scene.patina.device == 'CPU', "the scene itself was changed")
    finally:
        sys.argv = before
        drawing.forget_device()


def test_a_viewport_gives_its_picture_up():
    """Its steps end while the library draws: the picture has ended, too, before its scene goes and an analysis may change the clouds."""
    scene = dense_scene(3000, 3000)
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    description = engine.sync.describe(depsgraph, engine.sync.final_view(scene.camera, depsgraph), lambda what, progress: False)
    with native.Frame(drawing.device_for(description.device)) as frame:
        steps = viewport.Viewport.__new__(viewport.Viewport)._draw_frame(frame, description, ("COMBINED",), [])
        task = next(steps)
        check(task in ANALYSES._frames and not task.done(), "it draws")
        steps.close()
        check(task.done() and not ANALYSES._frames, "it still draws")


def test_cancel_is_soon():
    """A large picture stops soon after the wish: no more than a tenth of its work follows."""
    scene = dense_scene(3000, 3000)
    scene.render.film_transparent = False
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    view = patina.draw.engine.sync.final_view(scene.camera, depsgraph)
    description = patina.draw.engine.sync.describe(depsgraph, view, lambda what, progress: False)

    progress, honest, render_honest = [], native.Frame.cancel, native.Frame.render

    def cancel(frame):
        honest(frame)
        progress.append(frame.progress())

    def whole(frame, drawn):
        try:
            render_honest(frame, drawn)
        finally:
            progress.append(frame.progress())

    native.Frame.cancel, native.Frame.render = cancel, whole
    try:
        drawing.draw(description, ["COMBINED"], lambda share: share > 0.2)
        raise AssertionError("the picture was done before it could be cancelled")
    except native.PatinaCancelled:
        pass
    finally:
        native.Frame.cancel, native.Frame.render = honest, render_honest
    check(max(progress) - progress[0] < 0.1, f"{progress}")


def test_reading_may_be_cancelled():
    """Reading points of Blender asks between its steps, and every half million points of bytes; nothing is read after a yes."""
    scene = new_scene(32, 24)
    count = 4 * attributes.BLOCK
    positions, colors, normals = sphere(1000)
    add_points(np.tile(positions, (count // 1000 + 1, 1))[:count], np.tile(colors, (count // 1000 + 1, 1))[:count],
               np.tile(normals, (count // 1000 + 1, 1))[:count])
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    view = patina.draw.engine.sync.final_view(scene.camera, depsgraph)
    gaps, asked, after = [], [], []
    original = attributes.opacities  # the last thing that is read
    attributes.opacities = lambda *arguments: after.append(1) or original(*arguments)

    def reading(stop_at):
        patina.draw.engine.sync.points.built.CACHE.clear()
        asked.clear(), after.clear(), gaps.clear()
        last = time.perf_counter()

        def poll(what, progress):
            nonlocal last
            if after:
                return True  # the cloud is being built: enough
            asked.append(what)
            gaps.append(time.perf_counter() - last)
            last = time.perf_counter()
            return len(asked) == stop_at

        try:
            patina.draw.engine.sync.describe(depsgraph, view, poll)
        except native.PatinaCancelled:
            return
        check(False, "was not cancelled")

    try:
        reading(-1)
        steps = len(asked)
        check(steps >= 8, f"asked {steps} times while reading {count:,} points")
        print(f"     longest without asking: {max(gaps) * 1e3:.0f} ms of {sum(gaps) * 1e3:.0f} for {count:,} points")
        reading(steps - 1)
        check(len(asked) == steps - 1 and not after, "read on after the cancel")
    finally:
        attributes.opacities = original


def test_animation():
    """A render of frames: objects, cameras and attributes that move."""
    scene = new_scene(32, 24)
    obj = add_points([(0, 0, -2)])
    obj.location.x = -0.5
    obj.keyframe_insert("location", frame=1)
    obj.location.x = 0.5
    obj.keyframe_insert("location", frame=3)
    columns = []
    for frame in (1, 3):
        scene.frame_set(frame)
        columns.append(int(np.argwhere(render()["Combined"][..., 3] > 0)[0][1]))
    check(columns[1] - columns[0] > 10, f"columns {columns}")
