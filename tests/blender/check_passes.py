# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes, film, borders, view layers, and the picture on disk."""

import bpy
import numpy as np
from check_points import pixel
from harness import (
    SCRATCH,
    add_points,
    check,
    check_close,
    drawn,
    new_scene,
    render,
    render_layers,
    reports,
    saved,
    set_world,
    sphere,
    stats,
)
from mathutils import Matrix, Vector
from patina.draw import sample


def dense_scene(width=96, height=72):
    """A sphere of points with every filter at its default."""
    scene = new_scene(width, height)
    for name in ("fill", "smooth", "antialias"):
        scene.patina.property_unset(name)
    set_world((0.2, 0.3, 0.4))
    add_points(*sphere())
    return scene


def test_pass_list():
    scene = new_scene()
    add_points([(0, 0, -2)])
    check(set(render()) == {"Combined", "Depth", "Normal", "Source"}, "all passes")
    layer = scene.view_layers[0]
    layer.use_pass_z = layer.use_pass_normal = layer.patina.use_pass_source = False
    check(set(render()) == {"Combined"}, "Combined alone")


def test_depth():
    for kind in ('PERSP', 'ORTHO'):
        scene = new_scene()
        scene.camera.data.type = kind
        scene.camera.data.clip_start = 0.5
        scene.camera.data.ortho_scale = 3.0
        scene.camera.matrix_world = Matrix.Translation((0, 0, 5))
        point = (0.21, 0.13, 1.75)
        add_points([point])
        bpy.context.view_layer.update()
        depth = render()["Depth"][..., 0]
        check_close(depth[pixel(scene, point)], 3.25, 1e-5, f"{kind} depth from the camera's plane")
        check(np.sort(depth.ravel())[1] == np.float32(1e10), "depth where nothing is")


def test_depth_of_surfaces():
    """Not nearer than the surface is, where several points fall into a pixel."""
    scene = dense_scene(24, 18)
    points = render()["Depth"][..., 0]
    scene.patina.depth = 'SURFACE'
    surface = render()["Depth"][..., 0]
    seen = points < 100
    check((seen == (surface < 100)).all(), "the same pixels")
    farther = (surface - points)[seen]
    check(farther.mean() > 0 and (farther > 0).mean() > 0.8, f"{farther.mean()}, {(farther > 0).mean():.2f} of the pixels")


def test_average():
    """Of many points in a pixel, black and white, greys show in place of either; the same pixels, as deep."""
    scene = dense_scene(32, 24)
    scene.patina.smooth = 'OFF'
    positions, colors, normals = sphere(40000)
    colors[:, :3] = 255 * (np.arange(len(colors)) % 2)[:, None]
    scene.collection.objects.unlink(scene.collection.objects["points"])
    add_points(positions, colors, normals)
    plain = render()
    scene.patina.average = True
    mean = render()
    for name in ("Depth", "Source"):
        check(np.array_equal(plain[name], mean[name]), f"{name} is the same")
    inside = (plain["Combined"][..., 3] == 1) & (plain["Source"][..., 0] == 1)
    before, after = plain["Combined"][inside][:, 0], mean["Combined"][inside][:, 0]
    check(inside.sum() > 100 and after.std() < 0.4 * before.std(), f"{after.std()} beside {before.std()}")
    check(np.abs(after.mean() - before.mean()) < 0.1, f"{after.mean()} beside {before.mean()}")


def test_normal():
    scene = new_scene()
    normal = np.array((0.48, -0.36, 0.8))
    add_points([(0.1, 0.1, -2)], normals=[normal * 7])
    picture = render()["Normal"]
    check_close(picture[pixel(scene, (0.1, 0.1, -2))], normal, 2e-3, "normal")
    picture[pixel(scene, (0.1, 0.1, -2))] = 0
    check(not picture.any(), "normal where nothing is")


def test_source():
    scene = dense_scene()
    scene.patina.antialias = 'OFF'
    picture = render()
    source, alpha = picture["Source"][..., 0], picture["Combined"][..., 3]
    check((source[alpha == 0] == 0).all(), "0 where nothing is")
    check((source[alpha > 0] >= 1).all(), "1 and more where something is")
    check((source == 1).sum() > 100, "measured pixels")
    scene.patina.fill = 'OFF'
    check(set(np.unique(render()["Source"])) == {0, 1}, "measured or nothing without filling")


def test_filters_draw_a_closed_sphere():
    picture = dense_scene() and render()
    middle = picture["Combined"][30:42, 42:54]
    check((middle[..., 3] == 1).all(), "holes in the middle of the sphere")
    check_close(picture["Normal"][36, 48], (0, 0, 1), 0.15, "normal in the middle")
    check_close(picture["Depth"][36, 48, 0], 3.0, 0.02, "depth in the middle")


def test_film():
    scene = dense_scene()
    transparent = render()["Combined"]
    check((transparent[0, 0] == 0).all(), f"transparent corner {transparent[0, 0]}")
    check((transparent[..., :3][transparent[..., 3] == 0] == 0).all(), "premultiplied")
    scene.render.film_transparent = False
    opaque = render()["Combined"]
    check_close(opaque[0, 0], (0.2, 0.3, 0.4, 1), 1e-6, "opaque corner")
    check((opaque[..., 3] == 1).all(), "opaque alpha")
    over = transparent + (1 - transparent[..., 3:]) * np.float32((0.2, 0.3, 0.4, 1))
    check_close(over, opaque, 1e-5, "transparent over the world colour")


def test_border_is_a_crop():
    """Bit for bit, in what Blender holds and in the file, with and without cropping."""
    scene = dense_scene()
    whole = render()
    settings = scene.render
    settings.use_border = True
    settings.border_min_x, settings.border_max_x = 0.31, 0.74
    settings.border_min_y, settings.border_max_y = 0.17, 0.69
    x0, y0, x1, y1 = 29, 12, 71, 49
    for crop in (True, False):
        settings.use_crop_to_border = crop
        part = render()
        for name, pixels in whole.items():
            check(np.array_equal(part[name], pixels[y0:y1, x0:x1]), f"{name}, crop {crop}")
        file = saved()
        if crop:
            check(np.array_equal(file, whole["Combined"][y0:y1, x0:x1]), "cropped file")
        else:
            wanted = np.zeros_like(whole["Combined"])
            wanted[y0:y1, x0:x1] = whole["Combined"][y0:y1, x0:x1]
            check(file.shape == wanted.shape and np.array_equal(file, wanted), "file with the border in its place")


def test_view_layers():
    scene = new_scene()
    scene.view_layers[0].name = "first"
    second = scene.view_layers.new("second")
    check(second.use_pass_z is not None and not second.patina.use_pass_source, "its own passes")
    for name, x in (("first", -0.3), ("second", 0.3)):
        collection = bpy.data.collections.new(name)
        scene.collection.children.link(collection)
        collection.objects.link(add_points([(x, 0.02, -2)], link=False))
    scene.view_layers["first"].layer_collection.children["second"].exclude = True
    second.layer_collection.children["first"].exclude = True
    pictures = render_layers()
    for name, x in (("first", -0.3), ("second", 0.3)):
        check(drawn(pictures[name]) == {pixel(scene, (x, 0.02, -2))}, f"layer {name}")
    check("Source" in pictures["first"] and "Source" not in pictures["second"], "passes by layer")


def test_empty_scene():
    scene = new_scene()
    scene.render.film_transparent = False
    set_world((0.5, 0.25, 0.125))
    picture = render()
    check_close(picture["Combined"], np.broadcast_to((0.5, 0.25, 0.125, 1), (48, 64, 4)), 1e-6, "background")
    check((picture["Depth"] == np.float32(1e10)).all() and not picture["Source"].any(), "nothing there")
    check([text for _, text in reports] == ["no visible object has points to draw"], f"reports {reports}")


def test_file_holds_the_passes_colour():
    dense_scene()
    picture = render()["Combined"]
    check(np.array_equal(saved(), picture), "EXR file")


def test_png():
    scene = dense_scene()
    scene.view_settings.view_transform = 'Standard'
    scene.render.film_transparent = True
    picture = render()["Combined"]
    file = saved('PNG')
    check(file.shape == picture.shape, f"PNG of {file.shape}")
    check_close(file[..., 3], picture[..., 3], 0.5 / 255 + 1e-6, "alpha in the PNG")
    check(file[36, 48, :3].std() > 0 and file[36, 48, 3] == 1, "colour in the PNG")


def test_animation():
    scene = new_scene(32, 24)
    obj = add_points([(-0.3, 0, -2)])
    for frame, x in ((1, 0.0), (2, 0.6)):
        obj.location.x = x
        obj.keyframe_insert("location", frame=frame)
    scene.frame_start, scene.frame_end = 1, 2
    scene.render.filepath = str(SCRATCH / "frame_")
    scene.render.image_settings.file_format = 'PNG'
    bpy.ops.render.render(animation=True)
    columns = []
    for frame in (1, 2):
        image = bpy.data.images.load(str(SCRATCH / f"frame_{frame:04}.png"))
        columns.append(np.argwhere(np.array(image.pixels).reshape(24, 32, 4)[..., 3] > 0)[0, 1])
    check(columns[0] < 16 < columns[1], f"columns {columns}")


def test_statistics_line():
    dense_scene()
    render()
    check(stats[-1].startswith("6,000 points, ") and " ms, Processor" in stats[-1], f"statistics {stats[-1]!r}")


def test_source_where_all_discs_are_beside_the_view():
    """Points wide enough to be discs lie just outside the picture: there is none in it to tell of."""
    scene = new_scene(640, 400)
    positions, normals, colors = sample.points(300000)
    add_points(positions, colors, normals)
    scene.patina.fill, scene.patina.smooth, scene.patina.antialias = 'CLOSED', 'ALLEVIATED', 'LAYERS'
    scene.camera.location = (2.2, -2.6, 1.4)
    scene.camera.rotation_euler = (Vector((0, 0, 0.6)) - scene.camera.location).to_track_quat('-Z', 'Y').to_euler()
    picture = render()
    shown = picture["Combined"][..., 3] > 0
    check(shown.mean() > 0.3 and np.abs(picture["Source"][shown]).min() >= 1.0, "every pixel that shows something has a source")
