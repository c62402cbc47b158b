# SPDX-License-Identifier: GPL-3.0-or-later
"""Measuring in a window: clicks, snapping, Backspace, Esc, what is drawn, and the list in the sidebar. See test_window.py for what a yield means."""

import bpy
import numpy as np
from harness import Skip, add_points, check, check_close
from patina.operators.view_tools import view_of
from patina.sync import measures
from window import area, override, pause, screenshot, settled, setup, view, window_region

ROWS, TOOLS = 41, 80
COUNT = ROWS * ROWS


def begin():
    """A wall of points, seen from the front, in Rendered mode; the view shows overlays."""
    scene = setup(overlays=True)
    scene.patina.fill = 'CLOSED'
    scene.unit_settings.system, scene.unit_settings.length_unit = 'METRIC', 'METERS'
    line = np.linspace(-2.0, 2.0, ROWS)
    wall = np.stack(np.meshgrid(line, line, [0.0]), -1).reshape(-1, 3)
    obj = add_points(wall, colors=np.full((COUNT, 4), (40, 60, 160, 255), np.uint8), name="wall")
    bpy.context.view_layer.objects.active = obj
    space = area().spaces[0]
    for name in ("show_floor", "show_axis_x", "show_axis_y", "show_cursor", "show_object_origins", "show_outline_selected", "show_text", "show_stats"):
        setattr(space.overlay, name, False)
    bpy.ops.ed.undo_push(message="begin")
    return scene, obj


def pixel_of(place):
    """Pixels of the view."""
    region = window_region()
    with override():
        camera = view_of(bpy.context).camera
    matrix = np.array(camera.world_from_camera).reshape(4, 4)
    x, y, z = np.linalg.inv(matrix)[:3] @ (*place, 1.0)
    return ((x / -z - camera.left) / (camera.right - camera.left) * region.width, (y / -z - camera.bottom) / (camera.top - camera.bottom) * region.height)


def send(kind, value, place, ctrl=False):
    window, region = bpy.context.window_manager.windows[0], window_region()
    window.event_simulate(kind, value, x=int(region.x + place[0]), y=int(region.y + place[1]), ctrl=ctrl)


def events(*steps):
    """Waits a moment after each: (type, place, Ctrl)."""
    for kind, place, ctrl in steps:
        for value in (('NOTHING',) if kind == 'MOUSEMOVE' else ('PRESS', 'RELEASE')):
            send(kind, value, place, ctrl)
            yield pause(0.05, 2)


def start(kind):
    if not bpy.app.use_event_simulate:
        raise Skip("needs --enable-event-simulate")
    with override():
        check(bpy.ops.object.patina_measure('INVOKE_DEFAULT', kind=kind) == {'RUNNING_MODAL'}, "it does not run")


def yellow(picture):
    """Pixels in the color of measurements: (row, column) each. At the left are Blender's tools."""
    picture = np.where((np.arange(picture.shape[1]) > TOOLS)[:, None], picture, 0.0)
    return np.argwhere((picture[..., 0] > 0.75) & (picture[..., 1] > 0.5) & (picture[..., 1] < 0.9) & (picture[..., 2] < 0.4))


def test_measure_by_clicks():
    """Two clicks beside points: their distance, drawn between them. Ctrl does not snap. Backspace and Esc. Undo takes it away."""
    scene, obj = begin()
    entries = obj.patina.measures.entries
    yield lambda: settled(COUNT)
    check(not len(yellow(screenshot("measure_none"))), "nothing is measured yet")
    one, other = (pixel_of(place) for place in ((-1.0, -0.5, 0.0), (1.0, 0.5, 0.0)))
    start('DISTANCE')
    near = (one[0] + 3, one[1] - 2), (other[0] - 2, other[1] + 3)
    yield from events(('MOUSEMOVE', near[0], False), ('LEFTMOUSE', near[0], False), ('MOUSEMOVE', (20.0, 20.0), False), ('LEFTMOUSE', (20.0, 20.0), False),
                      ('MOUSEMOVE', near[1], False), ('LEFTMOUSE', near[1], False), ('LEFTMOUSE', near[0], False), ('BACK_SPACE', near[1], False),
                      ('RET', near[1], False))
    yield lambda: len(entries) == 1
    found = measures.read(obj, 0)
    check_close(found.points, [(-1.0, -0.5, 0.0), (1.0, 0.5, 0.0)], 1e-6, "two points of the wall, and neither the place beside it nor the removed one")
    check(found.kind == 'DISTANCE' and abs(found.values.value - np.sqrt(5)) < 1e-6, f"{found}")
    yield pause(0.3)
    drawn = yellow(screenshot("measure_distance"))[:, ::-1]
    check(len(drawn) > 100, f"{len(drawn)} pixels of the line")
    along = np.subtract(other, one)
    length = np.hypot(*along)
    aside = drawn + 0.5 - one
    across = np.abs(along[0] * aside[:, 1] - along[1] * aside[:, 0]) / length
    check(np.percentile(across, 95) < 5.0, f"the line is off by {np.percentile(across, 95):.1f} pixels")
    share = (drawn + 0.5 - one) @ along / length ** 2
    check(share.min() < 0.02 and share.max() > 0.98, f"from {share.min():.2f} to {share.max():.2f} of the way")
    start('POINT')
    yield from events(('MOUSEMOVE', near[0], False), ('LEFTMOUSE', near[0], True))
    yield lambda: len(entries) == 2
    exact = measures.read(obj, 1).points[0]
    check(0.005 < np.hypot(*(exact[:2] - (-1.0, -0.5))) < 0.1 and abs(exact[2]) < 1e-3, f"with Ctrl it snapped: {exact}")
    start('AREA')
    yield from events(('MOUSEMOVE', near[0], False), ('LEFTMOUSE', near[0], False), ('ESC', near[0], False))
    check(len(entries) == 2, "Esc keeps something")
    entries[0].hide = entries[1].hide = True
    yield pause(0.3)
    check(not len(yellow(screenshot("measure_hidden"))), "hidden ones are drawn")
    with override():
        bpy.ops.ed.undo()
        bpy.ops.ed.undo()
    yield lambda: not len(bpy.context.view_layer.objects["wall"].patina.measures.entries)


def test_all_kinds_are_drawn():
    """Each kind at its place; the sidebar lists them; Frame moves the view; behind the eye nothing is drawn."""
    scene, obj = begin()
    add = bpy.ops.object.patina_add_measurement
    yield lambda: settled(COUNT)
    before, drawn = screenshot("kinds_none"), [0]
    for kind, places, middle in (('HEIGHT', "-1.5 1 0  -1 1 0.5", (-1.5, 1.0, 0.25)), ('ANGLE', "0.5 1 0  0 1 0  0 1.5 0", (0.25, 1.0, 0.0)),
                                 ('AREA', "-1 -1 0 0 -1 0 0 0 0 -1 0 0", (-1.0, -0.5, 0.0)), ('POINT', "1 -1 0", (1.0, -1.0, 0.0))):
        with override():
            add(kind=kind, coordinates=places, space='OBJECT')
        yield pause(0.3)
        after = screenshot(f"kinds_{kind}")
        x, y = (int(value) for value in pixel_of(middle))
        changed = np.abs(after - before)[y - 6:y + 7, x - 6:x + 7].max(axis=2) > 0.2
        check(changed.sum() > 5, f"{kind}: {changed.sum()} pixels changed at {x}, {y}")
        drawn.append(len(yellow(after)))  # of its color alone: Blender's own panels come and go
        check(drawn[-1] > drawn[-2], f"{kind} adds no pixels: {drawn}")
    space = area().spaces[0]
    space.show_region_ui = True
    yield pause(0.3)
    if bpy.app.use_event_simulate:  # its tab, the lowest
        side = next(region for region in area().regions if region.type == 'UI')
        send('LEFTMOUSE', 'PRESS', (side.x + side.width - 12 - window_region().x, window_region().height - 192))
        send('LEFTMOUSE', 'RELEASE', (side.x + side.width - 12 - window_region().x, window_region().height - 192))
        yield pause(0.3)
    screenshot("kinds_sidebar")
    space.show_region_ui = False
    yield pause(0.3)
    with override():
        bpy.ops.object.patina_frame_measurement(index=2)
    check_close(view().view_location, (-0.5, -0.5, 0.0), 1e-6, "framed")
    yield lambda: settled(COUNT)
    with override():
        view().view_location, view().view_distance = (0.0, 0.0, -20.0), 6.0  # all lies behind the eye
    yield pause(0.5)
    check(not len(yellow(screenshot("kinds_behind"))), "what lies behind the eye is drawn")
    space.overlay.show_overlays = False
    view().view_location = (0.0, 0.0, 0.0)
    yield lambda: settled(COUNT)
    check(not len(yellow(screenshot("kinds_without"))), "drawn without overlays")


def test_tool_measures_by_a_click():
    """The tool of the toolbar: its first click is the first point, also of a kind with one point; a click beside the wall adds none."""
    scene, obj = begin()
    if not bpy.app.use_event_simulate:
        raise Skip("needs --enable-event-simulate")
    yield lambda: settled(COUNT)
    entries = obj.patina.measures.entries
    with override():
        bpy.ops.wm.tool_set_by_id(name="patina.measure")
        tool = bpy.context.workspace.tools.from_space_view3d_mode('OBJECT')
        check(tool.idname == "patina.measure", f"the tool is {tool.idname}")
        tool.operator_properties("object.patina_measure").kind = 'POINT'
    place = pixel_of((0.5, -0.5, 0.0))
    yield from events(('MOUSEMOVE', place, False), ('LEFTMOUSE', (place[0] + 2, place[1] + 1), False), ('MOUSEMOVE', place, False))
    yield lambda: len(entries) == 1
    check_close(measures.read(obj, 0).points, [(0.5, -0.5, 0.0)], 1e-6, "the nearest point")
    with override():
        bpy.context.workspace.tools.from_space_view3d_mode('OBJECT').operator_properties("object.patina_measure").kind = 'DISTANCE'
    other = pixel_of((-0.5, -0.5, 0.0))
    yield from events(('LEFTMOUSE', (100.0, 20.0), False), ('LEFTMOUSE', place, False), ('LEFTMOUSE', other, False), ('RIGHTMOUSE', other, False))
    yield lambda: len(entries) == 2
    found = measures.read(obj, 1)
    check(len(found.points) == 2 and abs(found.values.value - 1.0) < 1e-6, f"{found}")
    with override():
        bpy.ops.wm.tool_set_by_id(name="builtin.select_box")
