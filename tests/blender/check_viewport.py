# SPDX-License-Identifier: GPL-3.0-or-later
"""The 3D viewport in Rendered mode, in a real window. See test_window.py for what a yield means."""

import io
import os
import sys
import threading
import time

import bpy
import numpy as np
from check_combine import hide_each_other
from check_import import import_ply as import_points
from check_linked import dense
from harness import SCRATCH, add_light, add_points, check, check_close, new_scene, patina, render, sphere
from mathutils import Matrix, Quaternion

from patina import pace, viewport
from patina.importers import las
from patina.sync.analyzing import ANALYSES

KEEP = os.environ.get("PATINA_SCREENSHOTS")  # a folder that keeps them


def area():
    return next(area for area in bpy.context.window.screen.areas if area.type == 'VIEW_3D')


def window_region():
    return next(region for region in area().regions if region.type == 'WINDOW')


def view():
    return area().spaces[0].region_3d


def shown():
    """The viewport's engine, when its whole picture is there."""
    found = viewport.of_area(area())
    if found and found.shown and found.shown.wish.level == pace.FULL and found._last is found.shown.wish:
        return found
    return None


def settled(points):
    """Whether the whole picture of what the view shows now is there, with so many points in the scene."""
    found = shown()
    return found is not None and not ANALYSES.busy() and found.shown.stats["points"] == points and \
        found.shown.wish.view == viewport.sync.viewport_view(window_region(), area().spaces[0], view(), bpy.context.scene)


def newer(than):
    """Waits for a whole picture after so many."""
    return lambda: (found := shown()) is not None and found.pictures > than


def setup(overlays=False):
    """A scene in Rendered mode, seen from the front, 6 away."""
    scene = new_scene()
    scene.view_settings.view_transform = 'Standard'
    space = area().spaces[0]
    space.overlay.show_overlays = overlays
    space.show_gizmo = False
    space.shading.type = 'SOLID'
    rv3d = space.region_3d
    rv3d.view_perspective = 'PERSP'
    rv3d.view_location, rv3d.view_distance = (0, 0, 0), 6.0
    rv3d.view_rotation = Quaternion()
    space.shading.type = 'RENDERED'
    return scene


def clip_border(xmin, xmax, ymin, ymax):
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=window_region()):
        bpy.ops.view3d.clip_border(xmin=xmin, xmax=xmax, ymin=ymin, ymax=ymax)
    area().tag_redraw()  # as the end of the gesture does


def toggle_local_view():
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=window_region()):
        bpy.ops.view3d.localview(frame_selected=False)


def screenshot(name):
    """The view's pixels as shown, (height, width, 4) 0..1, row 0 at the bottom."""
    path = os.path.join(KEEP or str(SCRATCH), f"{name}.png")
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=window_region()):
        bpy.ops.wm.redraw_timer(type='DRAW_WIN_SWAP', iterations=1)
        bpy.ops.screen.screenshot(filepath=path)
    image = bpy.data.images.load(path)
    width, height = image.size
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    region = window_region()
    return pixels.reshape(height, width, 4)[region.y:region.y + region.height, region.x:region.x + region.width]


def test_styles_at_once_and_one_step_of_undo():
    """The view shows a picked style without being touched; one undo takes all of it back, one redo gives it again."""
    scene = setup()
    scene.render.film_transparent = False
    obj = add_points(*sphere(60000, 1.5, (0, 0, 0)))
    name, scene_name = obj.name, scene.name
    yield lambda: settled(60000)
    pictures = shown().pictures
    scene.patina.style.chosen = 'museum'
    yield newer(pictures)
    corner = shown().shown.color[0, 0, :3]
    check_close(corner, scene.patina.studio.background, 1e-6, "the view's background")
    scene.patina.style.chosen = 'scan'
    window = bpy.context.window_manager.windows[0]

    def look():
        scene, obj = bpy.data.scenes[scene_name], bpy.data.objects[name]
        return scene.patina.style.chosen, scene.patina.studio.use_light, obj.patina.lighting

    with bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=window_region()):
        bpy.ops.ed.undo_push(message="before")
        bpy.ops.patina.apply_style('EXEC_DEFAULT', True, style="museum")
        check(look() == ("museum", True, 'LIT'), f"applied: {look()}")
        bpy.ops.ed.undo()
        check(look() == ("scan", False, 'AUTO'), f"undone: {look()}")
        bpy.ops.ed.redo()
        check(look() == ("museum", True, 'LIT'), f"redone: {look()}")
    picture = screenshot("styles")
    check(picture.shape[0] > 100, "drawn")
    yield lambda: settled(60000)


def test_panels_draw():
    """Panels draw without an error, with every switch off and with every one on. Blender prints what a panel raises."""
    scene = setup()
    obj = add_points(*sphere(2000, 1.5, (0, 0, 0)))
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    area().spaces[0].show_region_ui = True
    editor = next(found for found in bpy.context.window.screen.areas if found.type == 'PROPERTIES')
    switches = [(group, kind.identifier) for owner in (scene, obj) for group in groups(owner.patina)
                for kind in group.bl_rna.properties if kind.type == 'BOOLEAN' and not kind.is_array]
    said, sys.stderr = sys.stderr, io.StringIO()
    try:
        for on in (False, True):
            for group, name in switches:
                setattr(group, name, on)
            for tab in ('RENDER', 'OUTPUT', 'VIEW_LAYER', 'SCENE', 'WORLD', 'OBJECT', 'DATA'):
                editor.spaces[0].context = tab
                area().tag_redraw()
                editor.tag_redraw()
                until = time.perf_counter() + 0.3
                yield lambda: time.perf_counter() > until
    finally:
        said, sys.stderr = sys.stderr.getvalue(), said
        editor.spaces[0].context = 'RENDER'
    check("Traceback" not in said, said)


def groups(group):
    """A property group and those within."""
    yield group
    for kind in group.bl_rna.properties:
        if kind.type == 'POINTER' and kind.fixed_type.identifier.startswith("Patina"):
            yield from groups(getattr(group, kind.identifier))


def test_draws_points():
    """Screen colours of a sphere are its bytes; the background is the world's."""
    setup()
    positions, colors, normals = sphere(60000, 1.5, (0, 0, 0))
    bpy.context.scene.patina.fill = 'CLOSED'
    bpy.context.scene.render.film_transparent = False
    add_points(positions, np.full_like(colors, (200, 100, 50, 255)), normals)
    yield lambda: shown() and shown().shown.stats["points"] == 60000
    picture = screenshot("draws_points")
    height, width = picture.shape[:2]
    check_close(picture[height // 2, width // 2, :3] * 255, (200, 100, 50), 1.01, "the middle")
    check_close(picture[5, 5, :3], (0, 0, 0), 0.01, "a corner")
    inside = np.abs(picture[..., :3] * 255 - (200, 100, 50)).max(axis=2) < 3
    radius = np.sqrt(inside.sum() / np.pi)
    region, rv3d = window_region(), view()
    wanted = 1.5 / np.sqrt(36 - 1.5 ** 2) * rv3d.window_matrix[0][0] * region.width / 2
    check(abs(radius - wanted) < 1.5, f"radius {radius:.1f}, not {wanted:.1f} pixels")


def test_too_bright_is_white():
    """Light that half floats, which Blender's viewport is made of, cannot hold."""
    scene = setup()
    scene.render.film_transparent = False
    positions, colors, normals = sphere(100000, 1.5, (0, 0, 0))
    add_points(positions, np.full_like(colors, 255), normals).patina.lighting = 'LIT'
    add_light('SUN', 1e7)
    scene.view_settings.view_transform = 'Filmic'
    yield lambda: settled(100000) and shown().shown.color.max() > 1e6
    picture = screenshot("bright")
    check((picture[..., :3] > 0.99).all(axis=2).sum() > 10000, "the disc is white")


def test_same_as_final():
    """At rest the viewport holds the final render's picture."""
    scene = setup()
    positions, colors, normals = sphere(40000, 1.5, (0, 0, 0))
    add_points(positions, colors, normals)
    settings = scene.patina
    settings.fill, settings.smooth, settings.antialias = 'CLOSED', 'ALLEVIATED', 'LAYERS'
    settings.effects.use_edl = settings.effects.use_obscurance = settings.effects.use_paper = True
    view().view_rotation = Quaternion((0.8, 0.3, 0.4, 0.2)).normalized()
    yield lambda: settled(40000)
    picture = shown().shown
    region = window_region()
    scene.render.resolution_x, scene.render.resolution_y = region.width, region.height
    camera = scene.camera
    camera.matrix_world = view().view_matrix.inverted()
    space = area().spaces[0]
    camera.data.lens, camera.data.sensor_width = space.lens, 72.0  # what a free view stands for
    camera.data.clip_start, camera.data.clip_end = space.clip_start, space.clip_end
    final = render()["Combined"]
    check(final.shape == picture.color.shape, f"{final.shape} against {picture.color.shape}")
    off = np.abs(final - picture.color).max(axis=2) > 0.02  # Blender's float32 matrices move some points by a pixel
    check(picture.color[..., 3].mean() > 0.02, "an empty viewport")
    check(off.mean() < 0.002, f"{off.mean():.2%} of the pixels differ")


def test_analysis_refines():
    """Points without normals are drawn as they are, and again when they are analyzed; then the picture is the final one.
    Blender goes on all the while, and points that are deleted are waited for no longer."""
    scene = setup()
    scene.patina.fill = 'CLOSED'
    obj = add_points(sphere(400000, 1.5, (0, 0, 0))[0])
    add_light('SUN', 3.0)
    yield lambda: shown() and shown().shown.stats["points"] == 400000
    first = shown().shown
    check(not first.clouds[0].cloud.has_shapes, "drawn before")
    check(ANALYSES.busy(), "under way")
    looks, longest, last = 0, 0.0, time.perf_counter()
    while ANALYSES.busy():
        yield lambda: True
        now = time.perf_counter()
        looks, longest, last = looks + 1, max(longest, now - last), now
    print(f"  analyzed while Blender went on {looks} times, waiting at most {longest * 1000:.0f} ms")
    check(looks > 20, f"Blender went on {looks} times")
    yield lambda: settled(400000)
    refined = shown().shown
    check(refined.clouds[0].cloud.has_shapes and refined.clouds[0].cloud is first.clouds[0].cloud, "the same cloud")
    check(shown().trusted.reads == 1, f"read {shown().trusted.reads} times")
    picture = screenshot("analyzed")
    check((picture[..., :3].max(axis=2) > 0.2).mean() > 0.03, "an empty view")
    analyzed = refined.color.copy()  # its memory is taken for later pictures
    obj.patina.analysis = 'OFF'
    obj.update_tag(refresh={'OBJECT'})  # as a panel does
    yield lambda: settled(400000) and not shown().shown.clouds[0].cloud.has_shapes
    plain = shown().shown.color.copy()
    check((plain != analyzed).any(), "Off is the same picture")
    obj.patina.analysis = 'AUTO'
    obj.update_tag(refresh={'OBJECT'})
    yield lambda: settled(400000) and shown().shown.clouds[0].cloud.has_shapes
    obj.data.vertices[0].co.x += 0.1
    obj.data.update()
    yield lambda: ANALYSES.busy()
    bpy.data.objects.remove(obj)
    yield lambda: settled(0)


def test_headlight_follows_the_view():
    """What the view looks at is lit, from every side."""
    scene = setup()
    scene.patina.fill = 'CLOSED'
    scene.patina.studio.use_headlight = True
    scene.patina.studio.headlight = 3.0
    positions, _, normals = sphere(60000, 1.5, (0, 0, 0))
    add_points(positions, None, normals)
    for turn in (0.0, 1.5, 3.0):
        view().view_rotation = Quaternion((0, 1, 0), turn)
        area().tag_redraw()
        yield lambda: settled(60000)
        picture = shown().shown.color
        height, width = picture.shape[:2]
        check_close(picture[height // 2, width // 2, 0], 0.8 * 3.0 / np.pi, 0.02, f"the middle, turned by {turn}")


def test_what_is_hidden_follows():
    """Gaps, doubts and strays change the picture at once, and nothing is read or analyzed again."""
    scene = setup()
    scene.patina.surface = 'SPLATS'
    obj = add_points(np.concatenate([sphere(3000, 1.5, (0, 0, 0))[0], [[2.2, 1.0, 0.0]]]))
    obj.patina.lighting = 'UNLIT'
    yield lambda: settled(3001) and shown().shown.clouds[0].cloud.has_shapes
    found = shown()
    covered = [float((found.shown.color[..., 3] > 0).mean())]
    reads = found.trusted.reads
    for name, value in (("largest_gap", 0.02), ("hide_stray", True), ("least_certainty", 1.0)):
        before = found.pictures
        setattr(obj.patina, name, value)
        obj.update_tag(refresh={'OBJECT'})
        yield lambda: newer(before)() and settled(3001)
        covered.append(float((found.shown.color[..., 3] > 0).mean()))
        check(covered[-1] < covered[-2], f"{name}: {covered}")
    check(found.trusted.reads == reads, "read again")


def test_analyze_is_undone():
    """A user's Analyze goes on beside Blender; one step of undo takes the attributes back."""
    setup()
    obj = add_points(sphere(20000, 1.5, (0, 0, 0))[0], name="looked at")
    bpy.context.view_layer.objects.active = obj
    yield lambda: settled(20000)
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=window_region()):
        bpy.ops.ed.undo_push(message="before")
        bpy.ops.object.patina_analyze('INVOKE_DEFAULT', True)
    yield lambda: "certainty" in bpy.data.objects["looked at"].data.attributes
    yield lambda: settled(20000)
    with bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=window_region()):
        bpy.ops.ed.undo()
    check("certainty" not in bpy.data.objects["looked at"].data.attributes, "undone")
    yield lambda: settled(20000)


def test_depth_of_field_of_the_camera():
    """A view through the camera has its depth of field, a free view has none."""
    scene = setup()
    positions, colors, normals = sphere(20000, 1.0, (0, 0, 0))
    add_points(positions, colors, normals)
    lens = scene.camera.data.dof
    lens.use_dof, lens.aperture_fstop, lens.focus_distance = True, 0.05, 2.0
    scene.camera.location = (0, 0, 6)
    yield lambda: settled(20000)

    def soft():
        alpha = shown().shown.color[..., 3]
        return int(((alpha > 0.02) & (alpha < 0.98)).sum())

    free = soft()
    before = shown().pictures
    view().view_perspective = 'CAMERA'
    area().tag_redraw()
    yield lambda: newer(before)() and settled(20000)
    check(soft() > 3 * free, f"{free} soft pixels before, {soft()} through the camera")


def test_what_changes_is_read():
    """The camera, a transform and painting read no more than what changed."""
    scene = setup()
    positions, colors, normals = sphere(20000, 1.0, (0, 0, 0))
    obj = add_points(positions, np.full_like(colors, (0, 255, 0, 255)), normals)
    other = add_points(positions + (3, 0, 0), colors, normals, "other")
    yield lambda: shown() and shown().shown.stats["points"] == 40000
    found = shown()
    reads = found.trusted.reads
    native_clouds = [entry[1] for entry in patina.clouds.CACHE._entries.values()]
    before = found.pictures
    view().view_rotation = Quaternion((0, 1, 0), 0.3)
    yield newer(before)
    check(shown() is found and found.trusted.reads == reads, "moving the view read points")
    before = found.pictures
    other.location.x = 1.0
    yield newer(before)
    check(found.trusted.reads == reads, "moving an object read points")
    before = found.pictures
    obj.data.attributes["Col"].data.foreach_set("color_srgb", np.tile(np.float32([1, 0, 0, 1]), len(positions)))
    obj.data.update()
    yield newer(before)
    check(found.trusted.reads == reads + 1, f"painting read {found.trusted.reads - reads} objects")
    check([entry[1] for entry in patina.clouds.CACHE._entries.values()] and
          all(any(entry[1] is cloud for cloud in native_clouds) for entry in patina.clouds.CACHE._entries.values()),
          "painting built a cloud")
    picture = screenshot("painted")
    red = (picture[..., 0] > 0.9) & (picture[..., 1] < 0.1)
    check(red.mean() > 0.01, f"{red.mean():.2%} of the view is red")


def test_navigation_and_rest():
    """While the view moves, cheaper pictures come; at rest the whole one. Blender is never kept waiting."""
    scene = setup()
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(2_000_000, 3)).astype(np.float32)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    add_points(directions * 1.5, None, directions)
    scene.patina.fill = 'CLOSED'
    scene.patina.navigation_ms = 20
    yield lambda: shown() and shown().shown.stats["points"] == 2_000_000
    found = shown()
    levels, meanwhile, before = set(), 0, found.pictures
    start = time.perf_counter()
    while found.pictures < before + 4 or not meanwhile:
        view().view_rotation = Quaternion((0, 1, 0), time.perf_counter() - start)
        yield lambda: True
        check(time.perf_counter() - start < 60.0, f"{found.pictures - before} pictures in 60 s of motion")
        levels.add(found.shown.wish.level)
        meanwhile += found._rendering  # Blender went on to here
    cheapest = max(levels, key=pace.Level.loss)
    print(f"  {found.pictures - before} pictures in {time.perf_counter() - start:.1f} s of motion, the cheapest of "
          f"{cheapest.strata}/6 at 1/{cheapest.shrink}; Blender went on {meanwhile} times while one was drawn")
    yield lambda: settled(2_000_000)
    check(found.shown.wish.level == pace.FULL and found.shown.stats["points_scattered"] > 1_000_000, f"{found.shown.stats}")


def test_coarse_pictures_fill_the_view():
    """A picture of fewer pixels shows the same disc in the same colour, and memory of pictures that are no longer shown is
    written again."""
    setup()
    bpy.context.scene.patina.fill = 'CLOSED'
    bpy.context.scene.render.film_transparent = False
    positions, colors, normals = sphere(100000, 1.5, (0, 0, 0))
    add_points(positions, np.full_like(colors, (200, 100, 50, 255)), normals)
    yield lambda: settled(100000)
    found, rest, areas = shown(), viewport.REST, {}
    found.pace.note = lambda *arguments: None  # the level is chosen here
    viewport.REST = 1e9  # and stays
    try:
        for level in (pace.FULL, pace.Level(pace.STRATA, 2), pace.Level(4, 1)):
            found.pace.level, view().view_rotation = level, Quaternion((0, 1, 0), 0.1 * (len(areas) + 1))
            yield lambda: found.shown.wish.level == level
            picture = screenshot(f"coarse_{level.strata}_{level.shrink}")
            areas[level] = int((np.abs(picture[..., :3] * 255 - (200, 100, 50)).max(axis=2) < 3).sum())
        for shrink in (2, 1):
            found.pace.level, memory = pace.Level(4, shrink), []
            for step in range(4):
                before = found.pictures
                view().view_rotation = Quaternion((0, 1, 0), 0.5 + 0.1 * step + shrink)
                yield lambda: found.pictures > before
                memory.append(found.shown.color)
            check(memory[1] is memory[3] and memory[1] is not memory[2], "fresh memory for every picture")
    finally:
        viewport.REST = rest
        del found.pace.note
    whole = areas.pop(pace.FULL)
    check(whole > 10000, f"{whole} pixels of the disc")
    for level, pixels in areas.items():
        check(abs(pixels / whole - 1.0) < 0.02, f"{level}: {pixels} pixels of the disc, {whole} of the whole picture")


def test_overlays_are_hidden_by_points():
    """An empty's axes behind the points do not show, those before them do."""
    setup(overlays=True)
    space = area().spaces[0]
    space.overlay.show_floor = space.overlay.show_axis_x = space.overlay.show_axis_y = False
    space.overlay.show_extras = True
    space.overlay.show_object_origins = space.overlay.show_cursor = space.overlay.show_text = False
    space.overlay.show_relationship_lines = space.overlay.show_stats = False
    bpy.context.scene.patina.fill = 'CLOSED'
    positions, colors, normals = sphere(100000, 1.0, (0, 0, 0))
    points = add_points(positions, np.full_like(colors, (0, 255, 0, 255)), normals)
    empty = bpy.data.objects.new("empty", None)
    empty.empty_display_type, empty.empty_display_size = 'CUBE', 0.3
    bpy.context.scene.collection.objects.link(empty)
    points.hide_select = True
    counts = []
    for z in (-2.0, 2.0):
        empty.location.z = z
        found = viewport.of_area(area())
        before = found.pictures if found else 0
        yield lambda: shown() and shown().pictures > before and shown().shown.stats["points"] == 100000
        picture = screenshot(f"overlay_{z:.0f}")
        height, width = picture.shape[:2]
        middle = picture[height // 2 - 60:height // 2 + 60, width // 2 - 60:width // 2 + 60, :3]
        counts.append(int((np.abs(middle - (0, 1, 0)).max(axis=2) > 0.2).sum()))
    check(counts[1] > 50 and counts[0] < counts[1] / 5,
          f"{counts[0]} pixels of a cube behind the sphere, {counts[1]} of one before it")


def test_local_view_and_border():
    scene = setup()
    positions, colors, normals = sphere(20000, 1.0, (0, 0, 0))
    first = add_points(positions, colors, normals, "first")
    add_points(positions + (2, 0, 0), colors, normals, "second")
    yield lambda: shown() and shown().shown.stats["points"] == 40000
    bpy.context.view_layer.objects.active = first
    first.select_set(True)
    bpy.data.objects["second"].select_set(False)
    toggle_local_view()
    yield lambda: shown() and shown().shown.stats["points"] == 20000
    toggle_local_view()
    yield lambda: shown() and shown().shown.stats["points"] == 40000
    space = area().spaces[0]
    space.use_render_border = True
    space.render_border_min_x, space.render_border_max_x = 0.25, 0.5
    space.render_border_min_y, space.render_border_max_y = 0.25, 0.75
    region = window_region()
    yield lambda: shown() and abs(shown().shown.color.shape[1] - region.width / 4) <= 1
    space.use_render_border = False
    whole = scene.render
    whole.use_border = True
    whole.border_min_x, whole.border_max_x, whole.border_min_y, whole.border_max_y = 0.0, 0.5, 0.0, 1.0
    scene.camera.matrix_world = Matrix.Translation((0, 0, 6))
    view().view_perspective = 'CAMERA'
    before = shown().pictures
    yield newer(before)
    frame = viewport.sync.camera.camera_frame(region, view(), scene.camera, scene)
    check(abs((frame[2] - frame[0]) / (frame[3] - frame[1]) - 64 / 48) < 0.01, f"camera frame {frame}")
    wanted = (frame[2] - frame[0]) / 2
    check(abs(shown().shown.color.shape[1] - wanted) <= 1.5, f"{shown().shown.color.shape} for {wanted}")


def test_orthographic_view():
    setup()
    positions, colors, normals = sphere(20000, 1.0, (0, 0, 0))
    bpy.context.scene.patina.fill = 'CLOSED'
    add_points(positions, colors, normals)
    view().view_perspective = 'ORTHO'
    yield lambda: shown() and shown().shown.stats["points"] == 20000 and \
        shown().shown.wish.view.camera.orthographic == 1
    picture = shown().shown
    radius = np.sqrt((picture.color[..., 3] > 0.5).sum() / np.pi)
    wanted = view().window_matrix[0][0] * window_region().width / 2
    check(abs(radius - wanted) < 1.5, f"radius {radius:.1f}, not {wanted:.1f}")


def test_toggling_lets_go():
    """Leaving Rendered mode ends the engine and its work."""
    setup()
    add_points(*sphere(5000, 1.0, (0, 0, 0)))
    yield lambda: shown() is not None
    area().spaces[0].shading.type = 'SOLID'
    area().tag_redraw()
    yield lambda: not viewport._VIEWPORTS


def test_leaving_midway():
    """Leaving Rendered mode while points are made a cloud of, or while they are drawn, ends both."""
    rng = np.random.default_rng(2)
    for step in ("_progress", "_rendering"):
        setup()
        add_points(rng.normal(size=(2_000_000, 3)).astype(np.float32), None, None)

        def under_way():
            return any(found._task and getattr(found, step) for found in viewport._VIEWPORTS)

        yield under_way
        area().spaces[0].shading.type = 'SOLID'
        area().tag_redraw()
        yield lambda: not viewport._VIEWPORTS and not viewport._TURNS


def test_no_python_elsewhere():
    """Points come, are painted and looked at without any thread of Python's beside Blender's."""
    setup()
    positions, colors, normals = sphere(20000, 1.0, (0, 0, 0))
    started, start = [], threading.Thread.start

    def counted(self):
        started.append(self.name)
        start(self)

    threading.Thread.start = counted
    try:
        obj = add_points(positions, colors, normals)
        yield lambda: settled(20000)
        found, before = shown(), shown().pictures
        obj.data.attributes["Col"].data.foreach_set("color_srgb", np.tile(np.float32([1, 0, 0, 1]), len(positions)))
        obj.data.update()
        yield newer(before)
        before = found.pictures
        view().view_rotation = Quaternion((0, 1, 0), 0.6)
        yield newer(before)
    finally:
        threading.Thread.start = start
    check(not started, f"threads {started}")
    check(threading.enumerate() == [threading.main_thread()], f"threads {threading.enumerate()}")


def test_failure_is_said():
    """A failing picture leaves the last one and says why."""
    setup()
    add_points(*sphere(5000, 1.0, (0, 0, 0)))
    yield lambda: shown() is not None
    found, honest = shown(), viewport.native.Frame.start
    picture = found.shown

    def failing(self, *arguments):
        raise viewport.native.PatinaError("no memory left", -2)

    viewport.native.Frame.start = failing
    view().view_rotation = Quaternion((0, 1, 0), 0.5)
    try:
        yield lambda: "no memory left" in found.message
    finally:
        viewport.native.Frame.start = honest
    check(found.shown is picture, "the last good picture went")
    before = found.pictures
    view().view_rotation = Quaternion((0, 1, 0), 0.6)
    yield newer(before)
    check(not found.message, found.message)


def test_meshes_among_points():
    """A mesh is drawn, follows its object without being read again, changes with its faces, and leaves in local view."""
    scene = setup()
    points = add_points(*sphere(5000, 1.0, (0, 0, 0)))
    mesh = bpy.data.meshes.new("square")
    mesh.from_pydata([(-0.5, -0.5, 2), (0.5, -0.5, 2), (0.5, 0.5, 2), (-0.5, 0.5, 2)], [], [(0, 1, 2, 3)])
    obj = bpy.data.objects.new("square", mesh)
    scene.collection.objects.link(obj)
    nearest = lambda: float(shown().shown.depth.min())
    yield lambda: settled(5000) and abs(nearest() - 4.0) < 1e-3
    check(shown().shown.stats["triangles"] == 2, f"{shown().shown.stats['triangles']} triangles")
    reads = shown().trusted.reads
    obj.location.z = 1.0
    yield lambda: settled(5000) and abs(nearest() - 3.0) < 1e-3
    check(shown().trusted.reads == reads, "moving an object read it again")
    for vertex in mesh.vertices:
        vertex.co.z = 2.5
    mesh.update()
    yield lambda: settled(5000) and abs(nearest() - 2.5) < 1e-3
    bpy.context.view_layer.objects.active = points
    for other in bpy.context.view_layer.objects:
        other.select_set(other == points)
    toggle_local_view()
    yield lambda: settled(5000) and shown().shown.stats["triangles"] == 0
    toggle_local_view()
    yield lambda: settled(5000) and shown().shown.stats["triangles"] == 2


def test_clipping_region():
    """Alt B shows what lies in a rectangle of the view, from all sides; again, and all is back."""
    setup()
    add_points(*sphere(20000, 1.0, (0, 0, 0)))
    yield lambda: settled(20000)
    drawn = lambda: int(np.isfinite(shown().shown.depth).sum())
    whole, region, before = drawn(), window_region(), shown().pictures
    clip_border(region.width // 2, region.width, 0, region.height)
    yield newer(before)
    yield lambda: settled(20000) and drawn() < 0.6 * whole
    columns = np.nonzero(np.isfinite(shown().shown.depth[..., 0]).any(axis=0))[0]
    check(abs(columns.min() - shown().shown.depth.shape[1] / 2) < 3, f"columns from {columns.min()} on")
    check(0.4 * whole < drawn(), f"{drawn()} of {whole} pixels")
    view().view_rotation = Quaternion((0, 1, 0), np.pi)  # from behind, the right half is the left one
    yield lambda: settled(20000) and np.nonzero(np.isfinite(shown().shown.depth[..., 0]).any(axis=0))[0].max() < \
        shown().shown.depth.shape[1] / 2 + 3
    view().use_clip_planes = False
    area().tag_redraw()
    yield lambda: settled(20000) and drawn() > 0.9 * whole


def test_processor_takes_over():
    """A GPU that fails in mid-session: the processor goes on, the sidebar says why; another choice is tried anew."""
    scene = setup()
    gpu = viewport.native.Device("cpu")  # stands for one: here it is to fail, not to draw
    gpu.name = "gl-egl"
    honest, honest_start, tried = viewport.render.device_for, viewport.native.Frame.start, []

    def failing(self, *arguments):
        if self._device is gpu and len(tried) < 3:
            tried.append(1)
            raise viewport.native.PatinaError("the context is lost", -6)
        return honest_start(self, *arguments)

    viewport.render.device_for = lambda choice: gpu if choice.name == "gl-egl" else honest(choice)
    try:
        scene.patina.device = 'GL'
        add_points(*sphere(5000, 1.0, (0, 0, 0)))
        yield lambda: settled(5000) and shown().shown.device == "gl-egl"
        found = shown()
        viewport.native.Frame.start = failing
        for turn in (0.5, 0.7):
            before = found.pictures
            view().view_rotation = Quaternion((0, 1, 0), turn)
            yield newer(before)
            check(found.shown.device.startswith("cpu") and not found.message, f"{found.shown.device}: {found.message}")
            check(any("the context is lost" in notice for notice in found.notices), f"{found.notices}")
        check(len(tried) == 1, f"the lost device was tried {len(tried)} times")
        scene.patina.device = 'CPU'
        scene.update_tag()  # as the user interface does
        yield lambda: not any("the context is lost" in notice for notice in found.notices)
    finally:
        viewport.render.device_for, viewport.native.Frame.start = honest, honest_start
        scene.patina.device = 'AUTO'


class _Layout:
    """Takes every call of a panel; a property that is not there fails."""

    def __init__(self, said):
        self.said = said

    def __getattr__(self, name):
        def call(*arguments, **options):
            if name.startswith("prop"):
                check(arguments[1] in arguments[0].bl_rna.properties, f"no property {arguments[1]}")
            if name == "label":
                self.said.append(options["text"])
            return _Layout(self.said)
        return call


def test_sidebar():
    """The sidebar tells the figures of its view."""
    from patina.ui import statistics
    setup()
    positions, colors, normals = sphere(20000, 1.0, (0, 0, 0))
    add_points(positions, colors, normals)
    area().spaces[0].show_region_ui = True
    yield lambda: settled(20000)
    said = []
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, area=area(), region=window_region()):
        for cls in statistics._CLASSES:
            check(cls.poll(bpy.context), f"{cls.__name__} does not show")
            cls.draw(type("Panel", (), {"layout": _Layout(said)})(), bpy.context)
    check("20,000" in said and "scatter" in said, f"{said}")
    check(any(text.startswith("no ") or "because" in text for text in said), "no reason for a pass that was left out")
    screenshot("sidebar")
    area().spaces[0].show_region_ui = False


def test_quad_view():
    """Four views of one area have an engine each, and share the clouds."""
    setup()
    positions, colors, normals = sphere(20000, 1.0, (0, 0, 0))
    add_points(positions, colors, normals)
    yield lambda: settled(20000)
    window = bpy.context.window_manager.windows[0]

    def toggle():
        with bpy.context.temp_override(window=window, area=area(), region=window_region()):
            bpy.ops.screen.region_quadview()

    toggle()
    try:
        yield lambda: len([found for found in viewport._VIEWPORTS if found.engine() and found.shown]) >= 4
        clouds = {id(found.shown.clouds[0].cloud) for found in viewport._VIEWPORTS if found.engine() and found.shown}
        check(len(clouds) == 1, f"{len(clouds)} clouds")
        screenshot("quad")
    finally:
        toggle()
    yield lambda: settled(20000)


def test_a_changed_link_keeps_nobody_waiting():
    """A linked LAS that changed is read piece by piece; Blender goes on between them, the old picture stays."""
    source = import_points(dense("changed.ply", 60000, (0, 0, 0)))[0]
    path = SCRATCH / "changed.las"
    bpy.ops.export_scene.patina_points(filepath=str(path), kind='LAS')
    scene = setup()
    check(source is not None and scene, "a scene of its own")
    import_points(path, link=True)
    yield lambda: settled(60000)
    found, before = shown(), shown().pictures
    piece, las.SMALL_PIECE = las.SMALL_PIECE, 3000
    turns = []
    os.utime(path, (1, 1))
    bpy.context.view_layer.objects.active.location.x = 0.1

    def read_again():
        if found.pictures == before:
            turns.append(found.shown.stats["points"])
        return found.pictures > before and settled(60000)

    yield read_again
    las.SMALL_PIECE = piece
    check(len(turns) >= 3 and set(turns) == {60000}, f"{len(turns)} turns of Blender while 20 pieces were read")
    check(not found.message, found.message)


def invoke_import(path, **options):
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=window_region()):
        return bpy.ops.import_scene.patina_points('INVOKE_DEFAULT', directory=str(path.parent), files=[{"name": path.name}],
                                                  **options)


def test_import_of_a_user():
    """Blender goes on while a user's import reads its file in pieces; Esc ends it, and leaves nothing."""
    from types import SimpleNamespace

    from patina.operators.import_points import PATINA_OT_import_points as Import
    new_scene()
    path = dense("user.ply", 60000, (0, 0, 0))
    import_points(path)
    las_path = SCRATCH / "user.las"
    bpy.ops.export_scene.patina_points(filepath=str(las_path), kind='LAS')
    piece, las.SMALL_PIECE = las.SMALL_PIECE, 300
    turns, modal = [], Import.modal

    def counted(self, context, event):
        turns.append(self._progress.value())
        return modal(self, context, event if len(turns) < stop else SimpleNamespace(type='ESC'))

    Import.modal = counted
    try:
        for stop, link in ((3, False), (3, True), (10 ** 9, False), (10 ** 9, True)):
            setup()
            turns.clear()
            meshes = len(bpy.data.meshes)
            check(invoke_import(las_path, link=link) == {'RUNNING_MODAL'}, "the import waits")
            if stop == 3:
                yield lambda: len(turns) >= 3
                yield lambda: not any(turns[3:])
                check(len(bpy.data.meshes) == meshes and "user" not in bpy.data.objects, "half an import was left")
            else:
                yield lambda: "user" in bpy.data.objects
                yield lambda: settled(60000)
                check(link or len(turns) >= 3, f"Blender came to its turn {len(turns)} times")
                check(turns == sorted(turns), f"progress {turns}")
    finally:
        Import.modal, las.SMALL_PIECE = modal, piece


def test_eevee_and_points_hide_each_other():
    """EEVEE draws in a window only."""
    scene = hide_each_other('EEVEE')
    check(scene.render.engine.startswith('BLENDER_EEVEE'), scene.render.engine)
    yield lambda: True


def test_rest_is_rest():
    """When the whole picture is there, nothing is drawn or rendered any more."""
    setup()
    add_points(*sphere(5000, 1.0, (0, 0, 0)))
    yield lambda: settled(5000)
    found, calls, draw = shown(), [], viewport.Viewport.draw

    def counted(self, *arguments):
        calls.append(time.perf_counter())
        return draw(self, *arguments)

    start = time.perf_counter()
    yield lambda: time.perf_counter() - start > 0.5  # draws that were under way
    viewport.Viewport.draw, pictures = counted, found.pictures
    start = time.perf_counter()
    yield lambda: time.perf_counter() - start > 1.0
    viewport.Viewport.draw = draw
    check(len(calls) <= 1 and found.pictures == pictures, f"{len(calls)} draws, {found.pictures - pictures} pictures")
    check(not bpy.app.timers.is_registered(viewport._tick), "the timer still runs")


def test_clips_and_ramps_follow():
    """A moved clip box, and a ramp that is painted, show at once; the points are read only once."""
    setup()
    obj = add_points(*sphere(60000, 1.5, (0, 0, 0)))
    obj.patina.lighting = 'UNLIT'
    obj.patina.colors.source = 'HEIGHT'
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.patina_new_ramp()
    box = bpy.data.objects.new("box", None)
    box.patina.clip.shape = 'BOX'
    box.scale = (2, 2, 2)
    bpy.context.scene.collection.objects.link(box)
    yield lambda: settled(60000)
    found = shown()
    reads, whole = found.trusted.reads, (found.shown.color[..., 3] > 0).sum()
    pictures = found.pictures
    box.location.x = 2.0  # the right half
    yield newer(pictures)
    half = shown().shown.color[..., 3] > 0
    check(0.4 * whole < half.sum() < 0.6 * whole, f"{half.sum()} of {whole} pixels")
    middle = half.shape[1] // 2
    check(half[:, middle + 2:].sum() > 0.95 * half.sum(), "those on the right")
    pictures = shown().pictures
    for element in obj.patina.colors.texture.color_ramp.elements:
        element.color = (0.0, 0.0, 1.0, 1.0)
    yield lambda: newer(pictures)() and np.median(shown().shown.color[half], axis=0)[2] > 0.999  # each stop is a change
    check_close(np.median(shown().shown.color[half], axis=0), (0, 0, 1, 1), 1e-4, "painted blue")
    check(shown().trusted.reads == reads, "the points were not read again")
