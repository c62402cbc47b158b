# SPDX-License-Identifier: GPL-3.0-or-later
"""Points in a 3D view, of linked clouds selected, of others painted soft: the modal operators, what is seen of them, undo. See
test_window.py for what a yield means."""

import time

import bpy
import numpy as np
from check_edits import ROWS, chosen, wall
from check_import import import_ply
from harness import Skip, check
from patina import point_data
from patina.sync.points import edits
from window import area, newer, override, screenshot, settled, setup, shown, window_region

GREEN = (40, 200, 60)
MARGIN = 160  # pixels of the view on all sides of its middle, that hold the wall and none of Blender's own


def begin(name="view_wall.ply"):
    scene = setup()
    scene.patina.fill = 'CLOSED'
    scene.render.film_transparent = False
    obj, = import_ply(wall(name, offset=(0.0, 0.0, 0.0), color=GREEN), link=True)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.ed.undo_push(message="begin")
    return obj


def seen(obj):
    """Whether the whole picture of the object's edits as they are now is there."""
    return lambda: settled(ROWS * ROWS) and shown().shown.clouds[0].edits == edits.state_of(bpy.context.view_layer.objects.active or obj)


def orange(picture):
    """Pixels that show selected points."""
    return middle(picture, (picture[..., 0] > 0.6) & (picture[..., 2] < 0.35))


def lit(picture):
    return middle(picture, picture[..., :3].max(axis=2) > 0.1)


def middle(picture, found):
    height, width = found.shape
    inside = np.zeros_like(found)
    inside[height // 2 - MARGIN:height // 2 + MARGIN, width // 2 - MARGIN:width // 2 + MARGIN] = True
    return found & inside


def drag(places, shift=False, ctrl=False):
    """Events as a mouse makes them, on the running operator: places in pixels of the view."""
    window, region = bpy.context.window_manager.windows[0], window_region()

    def send(kind, value, place):
        window.event_simulate(kind, value, x=int(region.x + place[0]), y=int(region.y + place[1]), shift=shift, ctrl=ctrl)

    send('MOUSEMOVE', 'NOTHING', places[0])
    yield
    send('LEFTMOUSE', 'PRESS', places[0])
    yield
    for place in places[1:]:
        send('MOUSEMOVE', 'NOTHING', place)
        yield
    send('LEFTMOUSE', 'RELEASE', places[-1])
    yield


def simulated(places, **keys):
    """Waits one look after each event."""
    for _ in drag(places, **keys):
        looked = []
        yield lambda looked=looked: looked or looked.append(1)


def test_box_in_the_view():
    """Dragged with the mouse: what is inside is orange; Shift adds, H hides, undo brings back."""
    obj = begin()
    yield lambda: settled(ROWS * ROWS)
    before = screenshot("edit_before")
    whole = lit(before).sum()
    check(not orange(before).any() and whole > 5000, f"{whole} pixels of the wall")
    height, width = before.shape[:2]
    if not bpy.app.use_event_simulate:
        print("  without --enable-event-simulate: the mouse is left out", flush=True)
        with override():
            bpy.ops.object.patina_points_select(path=[{"name": "", "loc": place, "time": 0.0} for place in ((width / 2, 0), (width, height))])
    else:
        with override():
            bpy.ops.object.patina_points_select('INVOKE_DEFAULT', shape='BOX')
        yield from simulated([(width / 2, 5), (width * 0.7, height / 2), (width - 5, height - 5)])
    yield lambda: chosen(obj).any()
    check((chosen(obj) == (np.arange(ROWS) >= ROWS // 2)).all(), f"{chosen(obj).sum()} points")
    yield seen(obj)
    picture = screenshot("edit_selected")
    columns = np.argwhere(orange(picture))[:, 1]
    check(columns.min() >= width // 2 - 3 and abs(orange(picture).sum() - whole / 2) < 0.05 * whole, f"from column {columns.min()}")
    with override():
        bpy.ops.object.patina_points_hide()
        bpy.ops.ed.undo_push(message="hide")
    yield seen(obj)
    picture = screenshot("edit_hidden")
    check(abs(lit(picture).sum() - whole / 2) < 0.05 * whole and not orange(picture).any(), f"{lit(picture).sum()} of {whole} pixels")
    with override():
        bpy.ops.ed.undo()
        bpy.ops.ed.undo()
    yield seen(obj)
    picture = screenshot("edit_undone")
    check(abs(lit(picture).sum() - whole) < 0.01 * whole and not orange(picture).any(), f"{lit(picture).sum()} of {whole} pixels")


def test_lasso_in_the_view():
    obj = begin("view_lasso.ply")
    yield lambda: settled(ROWS * ROWS)
    region = window_region()
    center, radius = np.array((region.width, region.height)) / 2, region.height / 8
    ring = [tuple(center + radius * np.array((np.cos(a), np.sin(a)))) for a in np.linspace(0, 2 * np.pi, 25)]
    if bpy.app.use_event_simulate:
        with override():
            bpy.ops.object.patina_points_select('INVOKE_DEFAULT', shape='LASSO')
        yield from simulated(ring)
    else:
        with override():
            bpy.ops.object.patina_points_select(shape='LASSO', path=[{"name": "", "loc": place, "time": 0.0} for place in ring])
    yield lambda: chosen(obj).any()
    yield seen(obj)
    found = np.argwhere(orange(screenshot("edit_lasso")))
    off = np.hypot(*(found - center[::-1] + 0.5).T)
    check(off.max() < radius + 6 and len(found) > 0.85 * np.pi * radius ** 2, f"{len(found)} pixels, {off.max():.0f} from the middle")


def test_what_operators_and_scripts_set_is_shown():
    """Color by Scan as a click in the sidebar, properties set from Python, on the object and the scene; nothing else is touched."""
    obj = begin("view_scans.ply")
    yield lambda: settled(ROWS * ROWS)
    pictures = [screenshot("set_before")]
    steps = (("by scan", lambda: bpy.ops.object.patina_scans_color()),
             ("a ramp", lambda: setattr(obj.patina.colors, "ramp", 'GREY')),
             ("opacity", lambda: setattr(obj.patina, "opacity", 0.4)),
             ("whole again", lambda: setattr(obj.patina, "opacity", 1.0)),
             ("own colors", lambda: setattr(obj.patina.colors, "source", 'OWN')),
             ("listed", lambda: bpy.ops.object.patina_scans_list()),
             ("graded", lambda: setattr(obj.patina.points.scans[0], "gain", 0.3)),
             ("reset", lambda: bpy.ops.object.patina_scans_reset()),
             ("its color", lambda: setattr(bpy.context.scene.patina.studio, "background", (0.1, 0.2, 0.6))),
             ("background", lambda: setattr(bpy.context.scene.patina.studio, "use_background", True)))
    silent = []
    for name, step in steps:
        before = shown().pictures
        with override():
            step()
        start = time.perf_counter()
        yield lambda: newer(before)() or time.perf_counter() - start > 20.0
        if not newer(before)():
            silent.append(name)
            continue
        yield lambda: settled(ROWS * ROWS)
        pictures.append(screenshot(f"set_{name}"))
    check(not silent, f"nothing is drawn after: {silent}")
    changes = [int((np.abs(after - old)[..., :3].max(axis=2) > 0.05).sum()) for old, after in zip(pictures, pictures[1:], strict=False)]
    found = dict(zip([name for name, _ in steps], changes, strict=True))
    check(all(count > 3000 for name, count in found.items() if name not in {"listed", "its color"}), f"pixels that changed: {found}")


def test_tools_and_esc():
    """The two tools stand in the toolbar; Esc ends the outline and changes nothing."""
    obj = begin("view_tools.ply")
    yield lambda: settled(ROWS * ROWS)
    with override():
        for name in ("patina.points_lasso", "patina.points_box"):
            check(bpy.ops.wm.tool_set_by_id(name=name) == {'FINISHED'}, name)
            check(bpy.context.workspace.tools.from_space_view3d_mode('OBJECT').idname == name, name)
    if bpy.app.use_event_simulate:
        window, sidebar = bpy.context.window_manager.windows[0], next(region for region in area().regions if region.type == 'UI')
        with bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=sidebar):
            bpy.ops.wm.tool_set_by_id(name="builtin.select_box")
            check(bpy.ops.object.patina_points_select('INVOKE_REGION_WIN', shape='BOX') == {'RUNNING_MODAL'}, "a button of the sidebar")
            tool = bpy.context.workspace.tools.from_space_view3d_mode('OBJECT').idname
            check(tool == "patina.points_box", f"{tool}: H would hide the object")
    if bpy.app.use_event_simulate:
        window, region = bpy.context.window_manager.windows[0], window_region()
        x, y = region.x + 100, region.y + 100
        looked = []
        for kind, value in (('LEFTMOUSE', 'PRESS'), ('ESC', 'PRESS'), ('ESC', 'RELEASE'), ('LEFTMOUSE', 'RELEASE')):
            window.event_simulate(kind, value, x=x, y=y)
            looked.clear()
            yield lambda: looked or looked.append(1)
        # with the tool: a drag begins the operator by itself, with Shift it extends
        for shift, (low, high) in ((False, (0.15, 0.5)), (True, (0.5, 0.85))):
            y0, y1 = low * region.height, high * region.height
            for kind, value, place in (('MOUSEMOVE', 'NOTHING', (region.width - 250, y1)), ('LEFTMOUSE', 'PRESS', (region.width - 250, y1)),
                                       ('MOUSEMOVE', 'NOTHING', (region.width - 280, y1 - 20)), ('MOUSEMOVE', 'NOTHING', (100, y0)),
                                       ('LEFTMOUSE', 'RELEASE', (100, y0))):
                window.event_simulate(kind, value, x=int(region.x + place[0]), y=int(region.y + place[1]), shift=shift)
                looked.clear()
                yield lambda: looked or looked.append(1)
            yield lambda shift=shift: chosen(obj)[:ROWS if shift else ROWS // 2].all()
            if not shift:
                check(not chosen(obj)[ROWS // 2:].any(), "half of it")
    else:
        print("  without --enable-event-simulate: no drags", flush=True)
    with override():
        bpy.ops.wm.tool_set_by_id(name="builtin.select_box")


def test_grading_is_live():
    obj = begin("view_graded.ply")
    with override():
        bpy.ops.object.patina_scans_list()
    yield lambda: settled(ROWS * ROWS)
    before = screenshot("edit_ungraded")
    wall_pixels = lit(before)
    obj.patina.points.scans[1].gain = 0.25
    obj.update_tag()  # as a slider does
    yield seen(obj)
    after = screenshot("edit_graded")
    upper = np.arange(before.shape[0])[:, None] > before.shape[0] / 2 + 5
    lower = np.arange(before.shape[0])[:, None] < before.shape[0] / 2 - 5
    check(np.median(after[wall_pixels & upper][:, 1]) < 0.6 * np.median(before[wall_pixels & upper][:, 1]), "the upper scan is darker")
    check(np.abs(after[wall_pixels & lower] - before[wall_pixels & lower]).max() < 0.02, "the lower one stays")
    obj.patina.points.scans[1].hide = True
    yield seen(obj)
    hidden = screenshot("edit_hidden_scan")
    check(np.median(hidden[wall_pixels & upper][:, 1]) < 0.5 * np.median(after[wall_pixels & upper][:, 1]), "the upper scan is hidden")
    check(np.abs(hidden[wall_pixels & lower] - before[wall_pixels & lower]).max() < 0.02, "the lower one is not")


def test_selection_stays_while_samples_come():
    """A view at rest betters its picture; what is selected is seen in all of them, and not twice."""
    obj = begin("view_samples.ply")
    yield lambda: settled(ROWS * ROWS)
    with override():
        bpy.ops.object.patina_points_select_by(by='CLASS', number=6)
    yield seen(obj)
    one = screenshot("edit_one_sample")
    bpy.context.scene.patina.viewport_samples = 8
    bpy.context.scene.update_tag()
    yield lambda: shown() and not shown().shown.first and not shown().shown.stats["pixel_pending"]
    more = screenshot("edit_more_samples")
    both = orange(one) & orange(more)
    check(both.sum() > 0.95 * max(orange(one).sum(), orange(more).sum()) > 5000, f"{orange(one).sum()} and {orange(more).sum()} pixels")
    check(np.median(np.abs(one - more)[both]) < 0.02, "of another color")


def test_damaged_edits_are_told():
    obj = begin("view_damaged.ply")
    yield lambda: settled(ROWS * ROWS)
    pictures = shown().pictures
    obj[edits.PROPERTY] = "of nothing"
    obj.update_tag()
    yield newer(pictures)
    said = [text for text in shown().notices if "damaged" in text]
    check(len(said) == 1 and lit(screenshot("edit_damaged")).sum() > 5000, f"{shown().notices}")


def test_keys_mean_selected_points():
    """H with Blender's own tool active hides the points that are selected, not the object; X deletes points; without any, H is Blender's."""
    if not bpy.app.use_event_simulate:
        raise Skip("without --enable-event-simulate no key can be pressed")
    obj = begin("view_keys.ply")
    yield lambda: settled(ROWS * ROWS)
    window, region = bpy.context.window_manager.windows[0], window_region()

    def press(key):
        place = {"x": region.x + region.width // 2, "y": region.y + region.height // 2}
        window.event_simulate('MOUSEMOVE', 'NOTHING', **place)
        window.event_simulate(key, 'PRESS', **place)
        window.event_simulate(key, 'RELEASE', **place)

    corners = [{"name": "", "loc": place, "time": 0.0} for place in ((region.width / 2, 0), (region.width, region.height))]
    for key, plane in (('H', "hidden"), ('X', "deleted")):
        with override():
            bpy.ops.object.patina_points_select(path=corners)
        before = chosen(obj).sum()
        check(before > 0, "nothing is selected")
        press(key)
        yield lambda plane=plane: chosen(obj, plane).any()
        check(chosen(obj, plane).sum() == before and not obj.hide_get() and obj.name in bpy.data.objects, f"{key}: points are {plane}")
        with override():
            bpy.ops.object.patina_points_reveal(select=False)
            bpy.ops.object.patina_points_restore()
            bpy.ops.object.patina_points_select_all(action='DESELECT')
    press('H')
    yield obj.hide_get


# ---- the brush for soft points ---------------------------------------------------------------------------------------


def soft_numbers():
    """Of the active object; none yet: zeros."""
    data = bpy.context.view_layer.objects.active.data
    found = data.attributes.get("soft")
    values = np.zeros(point_data.count_of(data), np.float32)
    if found:
        found.data.foreach_get("value", values)
    return values.reshape(ROWS, ROWS)


def painted_wall():
    scene = setup()
    scene.patina.fill = 'CLOSED'
    scene.render.film_transparent = False
    obj, = import_ply(wall("view_brush.ply", offset=(0.0, 0.0, 0.0), color=GREEN))
    obj.patina.soft.opacity = 0.1
    bpy.context.view_layer.objects.active = obj
    bpy.ops.ed.undo_push(message="begin")


def key(kind, place, **held):
    window, region = bpy.context.window_manager.windows[0], window_region()
    for value in ('PRESS', 'RELEASE'):
        window.event_simulate(kind, value, x=int(region.x + place[0]), y=int(region.y + place[1]), **held)


def bright(picture):
    """Pixels of green surface; the brush's circle takes some."""
    return int(middle(picture, (picture[..., 1] > 0.5) & (picture[..., 0] < 0.4)).sum())


def test_brush_in_the_view():
    """Two strokes are two steps of undo, within the brush and after it; what is painted is seen, and seen through."""
    if not bpy.app.use_event_simulate:
        raise Skip("without --enable-event-simulate there is no mouse")
    painted_wall()
    yield lambda: settled(ROWS * ROWS)
    pictures = [bright(screenshot("brush_before"))]
    region = window_region()
    x, y = region.width / 2, region.height / 2
    with override():
        check(bpy.ops.object.patina_soft_brush('INVOKE_DEFAULT') == {'RUNNING_MODAL'}, "it begins")
    bpy.context.window_manager.patina_brush.radius = 20.0
    for height in (y + 60, y - 60):
        yield lambda: settled(ROWS * ROWS)
        before, rounds = int((soft_numbers() == 1.0).sum()), shown().pictures
        yield from simulated([(x - 120, height), (x, height), (x + 120, height)])
        yield lambda before=before: (soft_numbers() == 1.0).sum() > before
        yield newer(rounds)
        yield lambda: settled(ROWS * ROWS)
        pictures.append(bright(screenshot(f"brush_{len(pictures)}")))
    once = pictures[0] - pictures[1]
    check(once > 2000 and abs(once - (pictures[1] - pictures[2])) < 0.3 * once, f"each stroke changes the picture: {pictures}")
    both = soft_numbers()
    check(both[ROWS // 2:].any() and both[:ROWS // 2].any() and not both[ROWS // 2 - 1:ROWS // 2 + 1].any(), "two bands")
    key('Z', (x, y), ctrl=True)
    yield lambda: not soft_numbers()[:ROWS // 2].any()
    check((soft_numbers()[ROWS // 2:] == both[ROWS // 2:]).all(), "Ctrl Z takes the second stroke back, and it alone")
    yield lambda: settled(ROWS * ROWS) and abs(bright(screenshot("brush_undone")) - pictures[1]) < 0.1 * once
    yield from simulated([(x - 120, y + 60), (x + 120, y + 60)], shift=True)
    yield lambda: not soft_numbers().any()
    with override():
        bpy.ops.ed.undo()
    yield lambda: (soft_numbers()[ROWS // 2:] == both[ROWS // 2:]).all()
    key('ESC', (x, y))
    looked = []
    yield lambda: looked or looked.append(1)
    check((soft_numbers()[ROWS // 2:] == both[ROWS // 2:]).all() and not soft_numbers()[:ROWS // 2].any(), "what was painted stays")
    with override():
        bpy.ops.ed.undo()
    yield lambda: "soft" not in bpy.context.view_layer.objects.active.data.attributes
    check(not bpy.context.view_layer.objects.active.patina.soft.use, "the first stroke's step holds the panel too")
    yield lambda: settled(ROWS * ROWS) and abs(bright(screenshot("brush_begin")) - pictures[0]) < 0.1 * once
    # a drag is Blender's own tool again; if it selects something, that is a step of undo too
    yield from simulated([(x - 120, y), (x + 120, y)])
    check("soft" not in bpy.context.view_layer.objects.active.data.attributes, "Esc ends the brush")


def test_brush_shows_while_it_paints():
    """Before the button is let go; begun from another area's button; X and ] are the brush's."""
    if not bpy.app.use_event_simulate:
        raise Skip("without --enable-event-simulate there is no mouse")
    painted_wall()
    yield lambda: settled(ROWS * ROWS)
    window, region, brush = bpy.context.window_manager.windows[0], window_region(), bpy.context.window_manager.patina_brush
    other = next(item for item in window.screen.areas if item.type == 'PROPERTIES')
    x, y = region.width / 2, region.height / 2
    with bpy.context.temp_override(window=window, screen=window.screen, area=other, region=other.regions[-1]):
        bpy.ops.object.patina_soft_brush('INVOKE_DEFAULT')
    brush.radius, brush.through = 20.0, False
    key('X', (x, y))
    yield lambda: brush.through
    key('RIGHT_BRACKET', (x, y))
    yield lambda: brush.radius > 22.0
    yield lambda: settled(ROWS * ROWS)
    rounds = shown().pictures

    def send(kind, value, place):
        window.event_simulate(kind, value, x=int(region.x + place[0]), y=int(region.y + place[1]))

    send('MOUSEMOVE', 'NOTHING', (x - 100, y))
    send('LEFTMOUSE', 'PRESS', (x - 100, y))
    yield
    send('MOUSEMOVE', 'NOTHING', (x + 50, y))
    yield newer(rounds)
    check(soft_numbers().any(), "the button is held, and it is there already")
    send('LEFTMOUSE', 'RELEASE', (x + 100, y))
    yield lambda: soft_numbers()[ROWS // 2, ROWS * 3 // 4 - 4:].any()
    key('RIGHTMOUSE', (x, y))
    yield
    brush.through = False
