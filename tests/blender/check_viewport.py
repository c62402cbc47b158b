# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of the 3D viewport in Rendered mode, in a real window. See test_window.py for what a yield means."""

import bpy
import numpy as np
from check_combine import hide_each_other
from check_point_materials import Tree
from check_world import image_of, sky, world_with
from harness import add_light, add_points, check, check_close, render, sphere
from mathutils import Matrix, Quaternion
from patina.draw import backdrop, pace, viewport
from patina.sync.analyses.analyzing import ANALYSES
from window import area, clip_border, newer, screenshot, settled, setup, shown, toggle_local_view, view, window_region


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
    """Gaps and trust change the picture at once, and nothing is built or analyzed again: Blender tags geometry with each
    property, so the points are read, and found to be the same."""
    scene = setup()
    scene.patina.surface = 'SPLATS'
    obj = add_points(np.concatenate([sphere(3000, 1.5, (0, 0, 0))[0], [[2.2, 1.0, 0.0]]]))
    obj.patina.least_trust = 0.0
    obj.patina.lighting = 'UNLIT'
    yield lambda: settled(3001) and shown().shown.clouds[0].cloud.has_shapes
    found = shown()
    covered = [float((found.shown.color[..., 3] > 0).mean())]
    built = found.shown.clouds[0].cloud
    for name, value in (("largest_gap", 0.02), ("least_trust", 0.64)):
        before = found.pictures
        setattr(obj.patina, name, value)
        yield lambda: newer(before)() and settled(3001)
        covered.append(float((found.shown.color[..., 3] > 0).mean()))
        check(covered[-1] < covered[-2], f"{name}: {covered}")
        check(found.shown.clouds[0].cloud is built, f"{name}: built again")


def test_range_images_are_not_analyzed():
    """The view shows them, and no analysis begins; filled, one does, of the same cloud."""
    scene = setup()
    scene.patina.surface = 'RANGES'
    add_points(sphere(3000, 1.5, (0, 0, 0))[0])
    yield lambda: settled(3000)
    found = shown()
    built = found.shown.clouds[0].cloud
    check(not built.has_shapes and not ANALYSES.busy() and not found.shown.clouds[0].analyzed, "analyzed")
    scene.patina.surface = 'AUTO'
    yield lambda: settled(3000) and shown().shown.clouds[0].cloud.has_shapes
    check(found.shown.clouds[0].cloud is built, "built again")


def test_balance_is_live():
    """Two scans that differ in light, every other point: turning the balance off changes the image at once, and on again too."""
    setup()
    positions = sphere(6000, 1.5, (0, 0, 0))[0]
    odd = np.arange(6000) % 2
    obj = add_points(positions, np.where(odd[:, None] == 1, (180, 180, 180, 255), (90, 90, 90, 255)).astype(np.uint8))
    obj.data.attributes.new("scan", 'FLOAT', 'POINT').data.foreach_set("value", odd.astype(np.float32))
    bpy.context.view_layer.objects.active = obj
    yield lambda: settled(6000)
    group, found = obj.patina.points, shown()

    def spread():
        color = found.shown.color
        return float(color[color[..., 3] > 0.99][:, 0].std())

    spreads = [spread()]
    for use in (False, True):
        before = found.pictures
        group.use_balance = use
        yield lambda before=before: newer(before)() and settled(6000)
        spreads.append(spread())
    check(spreads[0] < 0.2 * spreads[1] and abs(spreads[2] - spreads[0]) < 1e-4, f"{spreads}")


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
            # two take turns; a redraw of Blender's between may ask for a picture more
            check(len({id(pixels) for pixels in memory[1:]}) <= 2, "fresh memory for every picture")
    finally:
        viewport.REST = rest
        del found.pace.note
    whole = areas.pop(pace.FULL)
    check(whole > 10000, f"{whole} pixels of the disc")
    for level, pixels in areas.items():
        check(abs(pixels / whole - 1.0) < 0.02, f"{level}: {pixels} pixels of the disc, {whole} of the whole picture")


def test_many_points_come_by_detail():
    """Of many points the first picture leaves out most, and at rest ever finer ones follow, to the whole one; moving begins in between."""
    many, following, details = pace.MANY, pace.next_detail, []
    pace.MANY = 1000

    def next_detail(detail):
        details.append(detail)
        return following(detail)

    pace.next_detail = next_detail
    try:
        setup()
        bpy.context.scene.render.film_transparent = False
        positions, colors, normals = sphere(50000, 1.5, (0, 0, 0))
        add_points(positions, colors, normals)
        yield lambda: settled(50000)
        check(details in ([pace.FIRST, pace.MOVING], [pace.MOVING]), f"{details}")  # a redraw between counts as a motion
        before = shown().pictures
        view().view_rotation = Quaternion((0, 1, 0), 0.4)
        del details[:]
        yield newer(before)
        check(details and set(details) == {pace.MOVING}, f"{details}")
    finally:
        pace.MANY, pace.next_detail = many, following


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
        half = height // 10  # within the sphere, in a small window too
        middle = picture[height // 2 - half:height // 2 + half, width // 2 - half:width // 2 + half, :3]
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
    frame = viewport.sync.view.camera.camera_frame(region, view(), scene.camera, scene)
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
    whole, region = drawn(), window_region()
    clip_border(region.width // 2, region.width, 0, region.height)
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


def test_eevee_and_points_hide_each_other():
    """EEVEE draws in a window only."""
    scene = hide_each_other('EEVEE')
    check(scene.render.engine.startswith('BLENDER_EEVEE'), scene.render.engine)
    yield lambda: True


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


def test_material_nodes_follow():
    """A viewport shows the colors of nodes; an edited node shows at once, and the cloud is not built again."""
    setup()
    obj = add_points(sphere(60000, 1.5, (0, 0, 0))[0])
    obj.patina.lighting = 'UNLIT'
    tree = Tree(obj)
    value = tree.node('ShaderNodeRGB').outputs[0]
    value.default_value = (0.0, 0.0, 1.0, 1)
    tree.color(value)
    yield lambda: settled(60000)
    found = shown()
    cloud, reads, pictures, there = found.shown.clouds[0].cloud, found.trusted.reads, found.pictures, found.shown.color[..., 3] > 0
    check_close(np.median(found.shown.color[there], axis=0)[:3], (0, 0, 1), 1e-3, "blue")
    value.default_value = (1.0, 0.0, 0.0, 1)
    yield lambda: newer(pictures)() and np.median(shown().shown.color[there], axis=0)[0] > 0.999
    check(shown().trusted.reads == reads + 1, f"{shown().trusted.reads - reads} reads of one change")
    check(shown().shown.clouds[0].cloud is cloud, "the cloud is recolored")
    tree.set(tree.surface.inputs["Base Color"], tree.node('ShaderNodeAmbientOcclusion').outputs["Color"])
    yield lambda: shown() and any("'Ambient Occlusion' (Ambient Occlusion) cannot be evaluated" in text for text in shown().notices)


def test_holdouts_and_catchers():
    """A hole and a shadow, as in the final picture; and back when they are ordinary objects again."""
    scene = setup()
    scene.patina.use_shadows = scene.render.film_transparent = True
    scene.patina.fill = 'CLOSED'
    u, v = np.meshgrid(np.linspace(-1.5, 1.5, 300), np.linspace(-1.5, 1.5, 300))
    floor = add_points(np.stack([u.ravel(), v.ravel(), np.zeros(u.size)], 1), None, np.tile((0.0, 0.0, 1.0), (u.size, 1)), "floor")
    hole = add_points(np.stack([u.ravel() / 5 + 0.5, v.ravel() / 5, np.full(u.size, 1.0)], 1), None, None, "hole")
    add_light('SUN', 3.0, direction=(-1.0, 0, -1))
    yield lambda: settled(180000)
    before = shown().pictures
    hole.is_holdout = floor.is_shadow_catcher = True
    for obj in (hole, floor):
        obj.update_tag()
    yield lambda: newer(before)() and settled(180000)
    yield lambda: not shown().shown.stats["shadow_pending"]
    color = shown().shown.color
    height, width = color.shape[:2]
    pixel = view().window_matrix[0][0] * width / 2  # a unit, at distance 1

    def at(x, z):
        return color[height // 2, round(width / 2 + x * pixel / (6.0 - z))]

    check(not at(0.5, 1.0).any(), f"the hole {at(0.5, 1.0)}")
    check_close(at(-0.5, 0.0), (0, 0, 0, 1), 0.1, "the shadow")
    check(at(-1.2, 0.0)[3] < 0.05, f"the catcher itself {at(-1.2, 0.0)}")
    hole.is_holdout = floor.is_shadow_catcher = False
    before = shown().pictures
    for obj in (hole, floor):
        obj.update_tag()
    yield lambda: newer(before)() and settled(180000)
    color = shown().shown.color
    check(at(0.5, 1.0)[3] == 1.0 and at(-1.2, 0.0)[3] == 1.0, "seen again")


def test_the_world_lies_behind():
    """Each pixel of the screen shows what a final picture has there, however the world is made; a transparent film has none."""
    scene = setup()
    scene.render.film_transparent = False
    scene.view_settings.view_transform = 'Standard'
    positions, colors, normals = sphere(20000, 1.0, (0, 0, 0))
    add_points(positions, colors, normals)
    view().view_rotation = Quaternion((0.8, 0.5, 0.3, 0.2)).normalized()
    image = image_of(sky())
    for kind, properties in (('ShaderNodeTexEnvironment', dict(image=image, turn=(0.3, 0.1, 1.0))),
                             ('ShaderNodeTexEnvironment', dict(image=image, projection='MIRROR_BALL')),
                             ('ShaderNodeTexGradient', dict(gradient_type='RADIAL', turn=(0.0, 0.7, 0.4)))):
        before = shown().pictures if shown() else 0
        world_with(kind, **properties)
        yield lambda: settled(20000) and newer(before)()
        picture = screenshot(f"world_{kind}")[..., :3]
        found = shown().shown
        behind = backdrop.pixels(found.wish.description(found.clouds))
        wanted = np.where(behind <= 0.0031308, 12.92 * behind, 1.055 * np.maximum(behind, 1e-9) ** (1 / 2.4) - 0.055).clip(0, 1)
        bare = found.color[..., 3] == 0
        bare[-60:], bare[:, :60], bare[:, -60:] = False, False, False  # there Blender draws headers and tools over it
        check(bare.mean() > 0.3 and np.ptp(wanted[bare]) > 0.1, f"{kind}: {bare.mean():.2f} of it is world")
        off = np.abs(picture - wanted)[bare]
        check(np.percentile(off, 99) * 255 < 2.5, f"{kind}: {shown().message} {np.percentile(off, 99) * 255:.1f} of 255 off")
    scene.render.film_transparent = True
    yield lambda: settled(20000) and shown().shown.behind is None
    check(not shown().shown.color[0, 0].any(), "a transparent film")
