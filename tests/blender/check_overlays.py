# SPDX-License-Identifier: GPL-3.0-or-later
"""The viewport with Blender's overlays on, as by default: what is on the screen after every kind of change, once all is at rest.
Blender draws vertices as black dots over every engine's picture, and the points' own surface has to hide them. See
test_window.py for what a yield means."""

import time

import bpy
import numpy as np
import screen
from harness import add_points, check, sphere
from mathutils import Quaternion
from patina import point_data
from patina.draw import viewport
from window import area, setup, view, window_region

DARK = 40  # of 255: no channel of points and background is below 140
LETTERS = 9000  # more than the dark pixels of texts, cursor and tools in four views, 2,000 to 7,000; the points' dots are 14,000 and more


def at_rest(seconds=0.4):
    """Whether nothing has been drawn or waited for, for so long."""
    since = None

    def come():
        nonlocal since
        views = [found for found in viewport._VIEWPORTS if found.engine()]
        still = views and not bpy.app.timers.is_registered(viewport._tick) and all(
            found.shown and found.shown.wish.level == viewport.pace.FULL and found._last is found.shown.wish for found in views)
        since = (since or time.perf_counter()) if still else None
        return still and time.perf_counter() - since > seconds
    return come


def within(picture, region):
    return picture[region.y:region.y + region.height, region.x:region.x + region.width]


def dark_pixels():
    """Of the 3D views on the screen, without having them drawn again. Headers and tools, which lie over a view and are of other sizes in each
    version of Blender, do not count."""
    picture, total = screen.pixels().copy(), 0
    for place in bpy.context.window_manager.windows[0].screen.areas:
        regions = list(place.regions) if place.type == 'VIEW_3D' else []
        for region in regions:
            if region.type != 'WINDOW' and region.width > 1 and region.height > 1:
                within(picture, region)[:] = 255
        for region in regions:
            if region.type == 'WINDOW':
                total += int((within(picture, region).max(axis=2) < DARK).sum())
    return total


def view_pixels():
    """(h, w, 3) int16: the middle of the first 3D view, without tools and texts at its sides."""
    region = window_region()
    part = screen.pixels()[region.y:region.y + region.height, region.x:region.x + region.width].astype(np.int16)
    height, width = part.shape[:2]
    return part[height // 4:3 * height // 4, width // 4:3 * width // 4]


def do(operator, *how, place=None, **options):
    window = bpy.context.window_manager.windows[0]
    place = place or area()
    region = next(region for region in place.regions if region.type == 'WINDOW')
    with bpy.context.temp_override(window=window, screen=window.screen, area=place, region=region):
        operator(*how, **options)


def bright_scene():
    scene = setup(overlays=True)
    area().spaces[0].show_region_ui = False
    scene.render.film_transparent = False
    scene.patina.studio.use_background = True
    scene.patina.studio.background = (0.5, 0.5, 0.5)
    positions, colors, normals = sphere(60000, 1.5, (0, 0, 0))
    points = add_points(positions, np.full_like(colors, (220, 180, 140, 255)), normals)
    points.patina.lighting = 'UNLIT'
    return scene, points


def redraw_by_engines():
    for found in list(viewport._VIEWPORTS):
        if found.engine():
            found.engine().tag_redraw()


def changes(scene, points):
    """What an artist does: (name, step). A step that gives something waits for it."""
    space = area().spaces[0]

    def orbit():
        for _ in range(5):
            do(bpy.ops.view3d.view_orbit, angle=0.2, type='ORBITLEFT')
            yield lambda: True

    def shade(kind):
        space.shading.type = kind
        start = time.perf_counter()
        yield lambda: time.perf_counter() - start > 0.3
        space.shading.type = 'RENDERED'

    def split():
        do(bpy.ops.screen.area_split, direction='VERTICAL', factor=0.6)
        for place in bpy.context.window.screen.areas:  # Blender gives the new one Solid
            if place.type == 'VIEW_3D':
                place.spaces[0].shading.type = 'RENDERED'

    def close():
        views = [place for place in bpy.context.window.screen.areas if place.type == 'VIEW_3D']
        do(bpy.ops.screen.area_close, place=min(views, key=lambda place: place.width))

    def mesh():
        points.data.attributes["Col"].data.foreach_set("color_srgb", np.tile(np.float32([0.9, 0.8, 0.6, 1]), len(points.data.vertices)))
        points.data.update()

    yield "a look from above", lambda: do(bpy.ops.view3d.view_axis, type='TOP')
    yield "an orbit", orbit
    yield "one step", lambda: do(bpy.ops.view3d.view_orbit, angle=0.5, type='ORBITUP')
    yield "a jump", lambda: setattr(view(), "view_rotation", Quaternion((0, 1, 0), 1.0))
    yield "zoom", lambda: setattr(view(), "view_distance", 8.0)
    yield "an object moved", lambda: setattr(points, "location", (0.3, 0.2, 0.0))
    yield "painted", mesh
    yield "a setting", lambda: setattr(scene.patina, "fill", 'CLOSED')
    yield "Solid and back", lambda: shade('SOLID')
    yield "Wireframe and back", lambda: shade('WIREFRAME')
    yield "Material and back", lambda: shade('MATERIAL')
    yield "four views", lambda: do(bpy.ops.screen.region_quadview)
    yield "one view", lambda: do(bpy.ops.screen.region_quadview)
    yield "split", split
    yield "closed", close
    yield "maximised", lambda: do(bpy.ops.screen.screen_full_area)
    yield "back", lambda: do(bpy.ops.screen.screen_full_area)
    yield "larger", lambda: setattr(space, "show_region_header", False)
    yield "smaller", lambda: setattr(space, "show_region_header", True)
    yield "overlays off", lambda: setattr(space.overlay, "show_overlays", False)
    yield "overlays on", lambda: setattr(space.overlay, "show_overlays", True)
    yield "another frame", lambda: scene.frame_set(scene.frame_current + 1)
    yield "local view", lambda: do(bpy.ops.view3d.localview, frame_selected=False)
    yield "global view", lambda: do(bpy.ops.view3d.localview, frame_selected=False)


def test_points_hide_their_dots():
    """After every change by the redraw that showed it; then by a whole one, and by one that only the engine asks for."""
    scene, points = bright_scene()
    yield at_rest()
    for obj in bpy.context.view_layer.objects:
        obj.select_set(False)
    wrong, steps = [], [("the import", lambda: None), *changes(scene, points)]
    for name, step in steps:
        if name == "local view":
            points.select_set(True)
        found = step()
        if hasattr(found, "__next__"):
            yield from found
        yield at_rest()
        points.select_set(False)
        counts = [dark_pixels()]
        for redraw in (area().tag_redraw, redraw_by_engines) if name in {"the import", "global view"} else ():
            redraw()
            yield at_rest()
            counts.append(dark_pixels())
        if max(counts) > LETTERS:
            wrong.append(f"{name}: {counts}")
    check(not wrong, f"{len(wrong)} of {len(steps)} changes show dark pixels: {'; '.join(wrong)}")
    view().view_perspective = 'PERSP'


def test_what_is_left_out_shows_no_dots():
    """Clips, hidden classes and trust leave points out of the picture; their vertices are there for Blender."""
    _, points = bright_scene()
    layer = points.data.attributes.new("classification", 'INT', 'POINT')
    layer.data.foreach_set("value", np.tile(np.int32([2, 5]), len(points.data.vertices) // 2))
    bpy.ops.object.empty_add(type='CUBE', location=(0.0, 0.0, 2.0))
    clip = bpy.context.object
    points.select_set(False)
    clip.select_set(False)
    yield at_rest()
    whole, counts = dark_pixels(), {}

    def seen(name):
        points.select_set(False)
        yield at_rest()
        counts[name] = dark_pixels()

    space = area().spaces[0]
    space.overlay.show_overlays = False
    yield at_rest()
    before = view_pixels()
    clip.patina.clip.shape = 'BOX'
    yield at_rest()
    check((view_pixels() != before).any(axis=2).mean() > 0.02, "the clip cuts nothing that is seen")
    space.overlay.show_overlays = True
    yield from seen("clip")
    before = [found.shown for found in viewport._VIEWPORTS if found.engine()]
    do(bpy.ops.view3d.view_orbit, angle=0.5, type='ORBITUP')
    # On a busy machine the redraw comes later than at_rest() waits for one.
    yield lambda: not any(found.shown in before for found in viewport._VIEWPORTS if found.engine())
    yield from seen("clip, orbited")
    clip.patina.clip.shape = 'NONE'
    points.patina.colors.hidden[5] = True
    yield from seen("hidden class")
    points.patina.colors.hidden[5] = False
    points.patina.points.scans.add().hide = True  # of all points
    yield from seen("hidden scan")
    points.patina.points.scans.clear()
    points.update_tag()
    yield from seen("whole again")
    check(max(counts.values()) < LETTERS and whole < LETTERS, f"dark pixels: whole {whole}, {counts}")


def test_untrusted_points_show_no_dots():
    """They are left out by default."""
    _, points = bright_scene()
    rng = np.random.default_rng(5)
    positions, colors, normals = sphere(60000, 1.5, (0, 0, 0))
    strays = rng.uniform(-2.0, 2.0, (20000, 3))
    strays = strays[np.linalg.norm(strays, axis=1) > 1.7].astype(np.float32)
    colors = np.tile(np.uint8([220, 180, 140, 255]), (len(positions) + len(strays), 1))
    bpy.data.objects.remove(points)
    points = add_points(np.concatenate([positions, strays]), colors, np.concatenate([normals, np.zeros_like(strays)]))
    points.patina.lighting = 'UNLIT'
    yield at_rest()
    points.select_set(False)
    yield at_rest()
    untrusted = next(found for found in viewport._VIEWPORTS if found.shown).shown.stats["untrusted"]
    check(untrusted > 2000, f"of {len(strays)} strays {untrusted} are untrusted")
    check(dark_pixels() < LETTERS, f"dark pixels: {dark_pixels()}")


def test_a_new_size_shows_no_stretched_picture():
    """The redraw after it waits for the picture; here as long as a machine with other work may need."""
    bright_scene()
    yield at_rest()
    stretched, drawn = [], viewport.Viewport._draw_picture

    def draw(self, context):
        stretched.append((self.shown.wish.view.width, self.shown.wish.view.height) != (self._view.width, self._view.height))
        drawn(self, context)

    waits, viewport.RESIZED, viewport.Viewport._draw_picture = viewport.RESIZED, 20.0, draw
    try:
        for operator, options in ((bpy.ops.screen.area_split, {"direction": 'VERTICAL', "factor": 0.6}),
                                  (bpy.ops.screen.screen_full_area, {}), (bpy.ops.screen.screen_full_area, {})):
            do(operator, **options)
            yield at_rest()
        views = [place for place in bpy.context.window.screen.areas if place.type == 'VIEW_3D']
        do(bpy.ops.screen.area_close, place=min(views, key=lambda place: place.width))
        yield at_rest()
    finally:
        viewport.RESIZED, viewport.Viewport._draw_picture = waits, drawn
    check(len(stretched) >= 4 and not any(stretched), f"{sum(stretched)} of {len(stretched)} redraws stretch a picture")


def orange_pixels():
    """Of the screen: what Blender draws selected vertices with."""
    red, green, blue = np.moveaxis(screen.pixels().astype(np.int16), 2, 0)
    return int(((red > 220) & (green > 80) & (green < 160) & (blue < 60)).sum())


def test_edit_mode_shows_what_is_selected():
    """In Rendered shading too, on the side that is seen, and nothing else; outside of Edit Mode all dots are hidden."""
    _, points = bright_scene()
    bpy.context.view_layer.objects.active = points
    yield at_rest()
    counts = []
    flags = np.arange(len(points.data.vertices)) < len(points.data.vertices) // 20  # at the end that the view shows
    for action in ('SELECT', 'SOME', 'DESELECT'):
        if action == 'SOME':
            points.data.vertices.foreach_set("select", flags)
        do(bpy.ops.object.mode_set, mode='EDIT')
        if action != 'SOME':
            do(bpy.ops.mesh.select_all, action=action)
        area().tag_redraw()
        yield at_rest()
        counts.append((orange_pixels(), dark_pixels()))
        do(bpy.ops.object.mode_set, mode='OBJECT')
        points.select_set(False)
        area().tag_redraw()
        yield at_rest()
    (every, _), some, none = counts
    check(every > 20000 and 2000 < some[0] < every / 2 and none[0] < 2000, f"all, some and none selected: {counts} orange and dark pixels")
    check(max(some[1], none[1]) < LETTERS, f"some and none selected: {counts} orange and dark pixels")
    check(dark_pixels() < LETTERS, f"{dark_pixels()} dark pixels after Edit Mode")


def test_point_clouds_show_no_dots():
    """Converted, with one step of undo: selected or not, nothing but an outline covers the image, and an empty within is hidden."""
    if not point_data.HAS_CLOUDS:
        return
    _, points = bright_scene()
    bpy.context.view_layer.objects.active = points
    points.select_set(True)
    bpy.ops.ed.undo_push(message="Points")
    do(bpy.ops.object.patina_to_point_cloud, 'EXEC_DEFAULT', True)
    empty = bpy.data.objects.new("empty", None)
    empty.empty_display_type, empty.empty_display_size = 'CUBE', 0.3
    bpy.context.scene.collection.objects.link(empty)
    name, counts = points.name, []
    for selected in (False, True):
        points.select_set(selected)
        empty.select_set(False)
        area().tag_redraw()
        yield at_rest()
        counts.append((orange_pixels(), dark_pixels()))
    check(points.type == 'POINTCLOUD' and max(dark for _, dark in counts) < LETTERS, f"orange and dark pixels: {counts}")
    check(counts[0][0] < 2000 and counts[1][0] < 8000, f"orange and dark pixels: {counts}")
    points.select_set(False)
    for shown in ('TEXTURED', 'BOUNDS'):  # as a box Blender draws no depth of the points: they hide what lies within all the same
        points.display_type = shown
        hidden = []
        for size in (0.01, 0.3):
            empty.empty_display_size = size
            empty.select_set(True)
            area().tag_redraw()
            yield at_rest()
            hidden.append(orange_pixels())
        check(abs(hidden[1] - hidden[0]) < 60, f"{shown}: orange pixels of a small and a large empty within: {hidden}")
    bpy.data.objects.remove(empty)
    do(bpy.ops.ed.undo)
    points = bpy.data.objects[name]
    check(points.type == 'MESH' and len(points.data.vertices) == 60000, f"after undo: {points.type}")
    yield at_rest()


def wide_scene():
    """Ground of 600 m, bright, as the view comes: it begins a centimeter away and ends where Set Up for Points puts it."""
    scene, points = bright_scene()
    bpy.data.objects.remove(points)
    axis = np.linspace(-300.0, 300.0, 500, dtype=np.float32)
    x, y = (grid.ravel() for grid in np.meshgrid(axis, axis))
    positions = np.stack([x, y, 20.0 * np.sin(x / 40.0) * np.cos(y / 55.0)], 1)
    points = add_points(positions, np.full((len(positions), 4), (220, 180, 140, 255), np.uint8))
    points.patina.lighting = 'UNLIT'
    points.select_set(False)
    space = area().spaces[0]
    space.clip_start, space.clip_end = 0.01, 2217.0
    view().view_location, view().view_distance = (0, 0, 0), 900.0
    view().view_rotation = Quaternion((1, 0, 0), 0.7)
    return scene, points


def test_wide_points_hide_their_dots():
    """Hundreds of meters away one step of Blender's depths is meters, where the view begins a centimeter before the eye."""
    _, points = wide_scene()
    steps = [("a look", lambda: None), ("near", lambda: setattr(view(), "view_distance", 300.0)),
             ("far", lambda: setattr(view(), "view_distance", 1500.0)),
             ("an orbit", lambda: setattr(view(), "view_rotation", Quaternion((0.9, 0.35, 0.1, 0.2)).normalized())),
             ("far from the middle of the world", lambda: [setattr(points, "location", (3000, 2000, 0)),
                                                           setattr(view(), "view_location", (3000, 2000, 0))]),
             ("back", lambda: [setattr(points, "location", (0, 0, 0)), setattr(view(), "view_location", (0, 0, 0))]),
             ("four views", lambda: do(bpy.ops.screen.region_quadview)), ("one view", lambda: do(bpy.ops.screen.region_quadview)),
             ("maximised", lambda: do(bpy.ops.screen.screen_full_area)), ("restored", lambda: do(bpy.ops.screen.screen_full_area))]
    counts = {}
    for name, step in steps:
        step()
        area().tag_redraw()
        yield at_rest()
        counts[name] = dark_pixels()
    wrong = {name: dark for name, dark in counts.items() if dark > LETTERS}
    check(not wrong, f"dark pixels: {wrong} of {counts}")
    view().view_perspective = 'PERSP'


def test_wide_points_leave_what_is_before_them():
    """An empty over the ground, 100 m before it, is seen whole with the view at 900 m; one below it is not."""
    _, points = wide_scene()
    view().view_rotation = Quaternion()
    empty = bpy.data.objects.new("empty", None)
    empty.empty_display_type, empty.empty_display_size = 'CUBE', 30.0
    bpy.context.scene.collection.objects.link(empty)
    pictures = []
    for height in (None, 140.0, -140.0):
        empty.hide_set(height is None)
        empty.location.z = height or 0.0
        area().tag_redraw()
        yield at_rest()
        pictures.append(view_pixels())
    without, before, below = pictures
    changed = [int((np.abs(picture - without).max(axis=2) > 20).sum()) for picture in (before, below)]
    check(changed[0] > 300 and changed[1] < 30, f"pixels of an empty before and below the ground: {changed}")


def test_framing_begins_the_view_farther_away():
    """Frame Points, and with it Set Up for Points, sets where views end, and where they begin so that depths tell overlays from
    points: for a landscape, not for a pebble."""
    _, points = wide_scene()
    space = area().spaces[0]
    starts = []
    for scale in (1e-4, 1.0):
        points.scale = (scale, scale, scale)
        space.clip_start = 0.01
        bpy.context.view_layer.update()
        do(bpy.ops.object.patina_frame_points)
        starts.append(round(space.clip_start, 4))
    yield at_rest()
    check(starts[0] == 0.01 and 0.1 < starts[1] < 0.5, f"views of 6 cm and 600 m begin at {starts}")
    check(dark_pixels() < LETTERS, f"{dark_pixels()} dark pixels")
