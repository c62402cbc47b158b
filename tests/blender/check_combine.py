# SPDX-License-Identifier: GPL-3.0-or-later
"""Points in a picture of Cycles: a plane of points and a plane of faces cross, each shows where it is nearer."""

import os
import tempfile

import bpy
import numpy as np
from harness import add_points, check, check_close, new_scene, reports
from patina.sync.view import combination, pairs


def crossing():
    """The faces lean to the left, the points to the right: they meet in the middle of the picture."""
    scene = new_scene(64, 48)
    x, y = np.meshgrid(np.linspace(-2, 2, 400), np.linspace(-2, 2, 400))
    points = np.stack([x, y, -4.0 + 0.5 * x], -1).reshape(-1, 3)
    add_points(points, np.tile(np.uint8((0, 255, 0, 255)), (len(points), 1)), None)
    mesh = bpy.data.meshes.new("faces")
    mesh.from_pydata([(-2, -2, -3), (2, -2, -5), (2, 2, -5), (-2, 2, -3)], [], [(0, 1, 2, 3)])
    material = bpy.data.materials.new("red light")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    nodes = material.node_tree.nodes
    light = nodes.new('ShaderNodeEmission')
    light.inputs["Color"].default_value = (1, 0, 0, 1)
    output = next(node for node in nodes if node.type == 'OUTPUT_MATERIAL')
    material.node_tree.links.new(light.outputs[0], output.inputs["Surface"])
    mesh.materials.append(material)
    scene.collection.objects.link(bpy.data.objects.new("faces", mesh))
    scene.render.engine = 'CYCLES'
    scene.cycles.samples = 1
    scene.cycles.device = 'CPU'
    scene.cycles.use_denoising = False
    scene.patina.antialias = 'OFF'
    scene.render.film_transparent = True
    return scene


def picture(scene):
    """What F12 leaves in Render Result, through a file: the composite."""
    path = os.path.join(tempfile.mkdtemp(), "out.exr")
    scene.render.image_settings.file_format = 'OPEN_EXR'
    scene.render.image_settings.color_depth = '32'
    scene.render.image_settings.exr_codec = 'ZIP'
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(path)
    pixels = np.array(image.pixels[:], np.float32).reshape(image.size[1], image.size[0], 4)
    bpy.data.images.remove(image)
    os.remove(path)
    return pixels


def hide_each_other(engine):
    """The crossing as this engine and Patina draw it together; its scene."""
    scene = crossing()
    check(bpy.ops.scene.patina_combine(engine=engine) == {'FINISHED'}, "refused")
    points = bpy.data.scenes[f"{scene.name} Points"]
    check(points.objects["points"] == scene.objects["points"], "the objects were copied")
    pixels = picture(scene)
    check_close(pixels[24, 20], (1, 0, 0, 1), 1e-3, "left, the faces are nearer")
    check_close(pixels[24, 44], (0, 1, 0, 1), 2e-3, "right, the points are nearer")
    green = (pixels[..., 1] > 0.5).sum(axis=1)
    check(abs(int(green[24]) - 32) <= 2, f"{green[24]} of 64 pixels of a row show points: they meet in the middle")

    # half-transparent points let the faces through
    scene.objects["points"].patina.opacity = 0.5
    check_close(picture(scene)[24, 44], (0.5, 0.5, 0, 1), 5e-3, "through the points")
    scene.objects["points"].patina.opacity = 1.0
    return scene


def test_cycles_and_points_hide_each_other():
    scene = hide_each_other('CYCLES')
    points, before = bpy.data.scenes[f"{scene.name} Points"], len(bpy.data.scenes)

    # once more: nothing is there twice, and what was set for the points stays
    points.patina.fill = 'OFF'
    check(bpy.ops.scene.patina_combine(engine='CYCLES') == {'FINISHED'}, "refused the second time")
    check(len(bpy.data.scenes) == before, f"{len(bpy.data.scenes)} scenes")
    check(bpy.data.scenes[f"{scene.name} Points"].patina.fill == 'OFF', "the points' settings were lost")
    check_close(picture(scene)[24, 44], (0, 1, 0, 1), 2e-3, "right, the second time")
    check_close(picture(scene)[24, 20], (1, 0, 0, 1), 1e-3, "left, the second time")


def test_needs_a_camera():
    scene = crossing()
    scene.camera = None
    before = len(bpy.data.scenes)
    try:
        done = bpy.ops.scene.patina_combine()
    except RuntimeError as error:
        check("no camera" in str(error), str(error))
    else:
        check(done == {'CANCELLED'}, f"{done}")
    check(len(bpy.data.scenes) == before, "a scene was left behind")


def change(scene):
    """(what, step): each makes another picture; the last ones take back."""
    render = scene.render
    other = bpy.data.objects.new("other", scene.camera.data.copy())
    scene.collection.objects.link(other)
    other.location, other.rotation_euler = (0.3, 0.1, 0.5), (0.0, 0.05, 0.1)

    def border(crop):
        render.use_border, render.use_crop_to_border = True, crop
        render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.25, 0.8, 0.1, 0.75

    def markers():
        render.use_border = False
        for frame, camera in ((1, scene.camera), (10, bpy.data.objects["camera"])):
            scene.timeline_markers.new(camera.name, frame=frame).camera = camera
        scene.frame_set(10)

    yield "size", lambda: (setattr(render, "resolution_x", 100), setattr(render, "resolution_y", 60))
    yield "percentage", lambda: setattr(render, "resolution_percentage", 50)
    yield "pixels' aspect", lambda: setattr(render, "pixel_aspect_x", 1.5)
    yield "camera", lambda: setattr(scene, "camera", other)
    yield "cropped border", lambda: border(True)
    yield "border", lambda: border(False)
    yield "markers", markers


def places(scene):
    """(what, step, whether the small patch of points in the upper left corner shows): where objects and collections are put."""
    x, y = np.meshgrid(np.linspace(-0.5, -0.3, 60), np.linspace(0.2, 0.4, 60))
    patch = np.stack([x, y, np.full_like(x, -2.0)], -1).reshape(-1, 3)
    obj = add_points(patch, np.tile(np.uint8((0, 255, 0, 255)), (len(patch), 1)), None, name="patch", link=False)
    outer, inner = bpy.data.collections.new("outer"), bpy.data.collections.new("inner")

    def layer_of(*names):
        found = bpy.context.view_layer.layer_collection
        for name in names:
            found = found.children[name]
        return found

    def moved():
        inner.objects.unlink(obj)
        outer.objects.link(obj)

    yield "at the root", lambda: scene.collection.objects.link(obj), True
    yield "away from it", lambda: scene.collection.objects.unlink(obj), False
    yield "in a new collection", lambda: (inner.objects.link(obj), scene.collection.children.link(inner)), True
    yield "excluded", lambda: setattr(layer_of("inner"), "exclude", True), False
    yield "not any more", lambda: setattr(layer_of("inner"), "exclude", False), True
    yield "deeper", lambda: (scene.collection.children.unlink(inner), outer.children.link(inner),
                             scene.collection.children.link(outer)), True
    yield "the outer excluded", lambda: setattr(layer_of("outer"), "exclude", True), False
    yield "the inner alone", lambda: (setattr(layer_of("outer"), "exclude", False),
                                      setattr(layer_of("outer", "inner"), "exclude", True)), False
    yield "out of it", moved, True
    yield "held out", lambda: setattr(layer_of("outer"), "holdout", True), False
    yield "no more", lambda: setattr(layer_of("outer"), "holdout", False), True
    yield "removed", lambda: bpy.data.collections.remove(outer), False


def test_points_follow_collections():
    """What is put into the scene later shows, wherever; what is excluded or taken away does not. Nothing has to be combined again."""
    scene = crossing()
    bpy.ops.scene.patina_combine(engine='CYCLES')
    points = bpy.data.scenes[f"{scene.name} Points"]
    for what, step, shown in places(scene):
        step()
        green = picture(scene)[35:40, 11:17, 1].max()
        check((green > 0.5) == shown, f"{what}: {green:.2f} of green where the points are")
        check({item.name for item in points.collection.all_objects} == {item.name for item in scene.collection.all_objects}, what)


def test_followed_before_a_picture():
    """Blender tells of collections at once: the scene of points is right on the screen too, and in undo."""
    scene = crossing()
    bpy.ops.scene.patina_combine(engine='CYCLES')
    points = bpy.data.scenes[f"{scene.name} Points"]
    late = bpy.data.collections.new("late")
    scene.collection.children.link(late)
    bpy.context.view_layer.update()
    check("late" in points.collection.children, "a new collection came not before the picture")
    bpy.context.view_layer.layer_collection.children["late"].exclude = True
    bpy.context.view_layer.update()
    check(points.view_layers[0].layer_collection.children["late"].exclude, "it is not excluded before the picture")


def test_points_scene_has_its_own():
    """What an artist puts into the scene of points alone stays in it, combined again too."""
    scene = crossing()
    bpy.ops.scene.patina_combine(engine='CYCLES')
    points = bpy.data.scenes[f"{scene.name} Points"]
    own = add_points(np.zeros((3, 3)), name="own", link=False)
    points.collection.objects.link(own)
    for _ in range(2):
        picture(scene)
        points = bpy.data.scenes[f"{scene.name} Points"]
        check("own" in points.collection.objects and "own" not in scene.collection.objects, f"{points.collection.objects[:]}")
        bpy.ops.scene.patina_combine(engine='CYCLES')


def test_scene_of_points_deleted():
    """Then the picture is that of the first scene alone, which is said once; combining again brings the points back."""
    scene = crossing()
    alone = picture(scene)
    bpy.ops.scene.patina_combine(engine='CYCLES')
    both = picture(scene)
    said, tell = [], pairs.tell
    pairs.tell = said.append
    try:
        bpy.data.scenes.remove(bpy.data.scenes[f"{scene.name} Points"])
        for _ in range(2):
            check_close(picture(scene), alone, 1e-6, "the faces alone")
        check(len(said) == 1 and "without points" in said[0] and scene.name in said[0], f"{said}")
        bpy.ops.scene.patina_combine(engine='CYCLES')
        bpy.ops.scene.patina_combine(engine='CYCLES')
        tree, = combination.trees_of(scene)
        tree.nodes.new('CompositorNodeRLayers').scene = bpy.data.scenes.new("another")
        bpy.data.scenes.remove(bpy.data.scenes["another"])
        check_close(picture(scene), both, 1e-6, "combined again")
        check(len(said) == 1, f"{said}")
    finally:
        pairs.tell = tell


def test_points_follow_their_scene():
    """Whatever changes after Combine, the picture is the one that combining then would have made; and nothing is warned of."""
    scene = crossing()
    bpy.ops.scene.patina_combine(engine='CYCLES')
    for what, step in change(scene):
        step()
        bpy.context.view_layer.update()
        reports.clear()
        pixels = picture(scene)
        check([text for kind, text in reports if kind != 'INFO'] == [], f"{what}: {reports}")
        bpy.ops.scene.patina_combine(engine='CYCLES')
        anew = picture(scene)
        check(pixels.shape == anew.shape and (pixels[..., 1] > 0.5).sum() > 30, f"{what}: {pixels.shape}, an empty picture")
        check(np.array_equal(pixels, anew), f"{what}: {(pixels != anew).any(axis=2).mean():.1%} of the pixels differ")


def test_frames_follow():
    scene = crossing()
    bpy.ops.scene.patina_combine(engine='CYCLES')
    points = bpy.data.scenes[f"{scene.name} Points"]
    scene.frame_start, scene.frame_end, scene.frame_step, scene.render.fps = 3, 9, 2, 12
    picture(scene)
    check((points.frame_start, points.frame_end, points.frame_step, points.render.fps) == (3, 9, 2, 12), "the frames")


def test_a_new_name():
    """Renaming either scene leaves them a pair; files that know the pair by name are understood."""
    scene = crossing()
    bpy.ops.scene.patina_combine(engine='CYCLES')
    count, points = len(bpy.data.scenes), bpy.data.scenes[f"{scene.name} Points"]
    points["patina_points_of"] = scene.name  # as files of before have it
    picture(scene)
    points.patina.fill = 'OFF'
    scene.name = "other name"
    bpy.ops.scene.patina_combine(engine='CYCLES')
    check(len(bpy.data.scenes) == count, f"{[one.name for one in bpy.data.scenes]}")
    points = bpy.data.scenes["other name Points"]
    check(points.patina.fill == 'OFF', "what was set for the points is lost")
    points.name = "mine"
    scene.render.resolution_x = 80
    check(picture(scene).shape[:2] == (48, 80) and bpy.data.scenes["mine"].render.resolution_x == 80, "it follows by any name")
    bpy.context.window.scene = points = bpy.data.scenes["mine"]
    check(not bpy.ops.scene.patina_combine.poll(), "points of points")
    bpy.context.window.scene = scene
    bpy.data.scenes.remove(points)
    picture(scene)


def test_denoise_where_cycles_can():
    """Debian's Cycles ends a picture with an error where it is to denoise: it is asked no more, and others still are."""
    import _cycles
    scene = crossing()
    scene.cycles.use_denoising = True
    check(bpy.ops.scene.patina_combine(engine='CYCLES') == {'FINISHED'}, "refused")
    check(scene.cycles.use_denoising == getattr(_cycles, "with_openimagedenoise", True), f"Denoise is {scene.cycles.use_denoising}")
    if not scene.cycles.use_denoising:
        check(picture(scene)[..., :3].max() > 0.1, "nothing in the picture")
