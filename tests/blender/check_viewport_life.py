# SPDX-License-Identifier: GPL-3.0-or-later
"""What the 3D viewport in Rendered mode does and lets be: reading, working, waiting, failing, ending. See test_window.py for
what a yield means."""

import io
import math
import os
import sys
import threading
import time

import bpy
import gpu
import numpy as np
from check_import import import_ply as import_points
from check_linked import dense
from harness import SCRATCH, add_light, add_points, check, check_close, new_scene, patina, render, sphere
from mathutils import Quaternion
from patina.draw import graphics, histogram, pace, painting, viewport
from patina.read.importers import las
from patina.sync.analyses.analyzing import ANALYSES
from window import (
    area,
    invoke_import,
    newer,
    override,
    pause,
    screenshot,
    settled,
    setup,
    shown,
    view,
    whole_window,
    window_region,
)


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
    yield lambda: "trust" in bpy.data.objects["looked at"].data.attributes
    yield lambda: settled(20000)
    with bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=window_region()):
        bpy.ops.ed.undo()
    check("trust" not in bpy.data.objects["looked at"].data.attributes, "undone")
    yield lambda: settled(20000)


def test_histogram_follows():
    """A panel's histogram is painted by a timer, when a view has drawn the points, when the threshold moves and when numbers change."""
    setup()
    positions, colors, normals = sphere(5000, 1.0, (0, 0, 0))
    obj = add_points(positions, colors, normals)
    numbers = np.linspace(0.0, 0.999, 5000, dtype=np.float32)
    obj.data.attributes.new("score", 'FLOAT', 'POINT').data.foreach_set("value", numbers)
    soft = obj.patina.soft
    soft.use, soft.by, soft.attribute, soft.threshold = True, 'ATTRIBUTE', "score", 0.25
    obj.update_tag()
    check(histogram.of(obj) is None, "before a picture")

    def line():
        """Where the threshold stands in the picture of what is known now; None while that is not painted."""
        known = histogram.of(obj)
        if known is None or not histogram.icon(obj, known) or histogram._painted.get(histogram._title(obj.name)) != (
                known.stamp, soft.threshold, soft.transition):
            return None
        return int(np.flatnonzero((np.abs(histogram.pixels(obj) - histogram._LINE).max(-1) < 0.01).all(0))[-1])

    yield lambda: line() == 64
    check(int(histogram.of(obj).counts.sum()) == 5000, "every point")
    soft.threshold = 0.75
    yield lambda: line() == 192
    stamp = histogram.of(obj).stamp
    obj.data.attributes["score"].data.foreach_set("value", numbers[::-1] * 0.5)
    obj.data.update()
    yield lambda: histogram.of(obj).stamp > stamp and line() == 192 and histogram.of(obj).counts[128:].sum() == 0  # a sample may come first


def test_what_changes_is_read():
    """The camera, a transform and painting read no more than what changed."""
    setup()
    positions, colors, normals = sphere(20000, 1.0, (0, 0, 0))
    obj = add_points(positions, np.full_like(colors, (0, 255, 0, 255)), normals)
    other = add_points(positions + (3, 0, 0), colors, normals, "other")
    yield lambda: shown() and shown().shown.stats["points"] == 40000
    found = shown()
    reads = found.trusted.reads
    native_clouds = [entry[1] for entry in patina.built.CACHE._entries.values()]
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
    check([entry[1] for entry in patina.built.CACHE._entries.values()] and
          all(any(entry[1] is cloud for cloud in native_clouds) for entry in patina.built.CACHE._entries.values()),
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
        meanwhile += found._rendering is not None  # Blender went on to here
    cheapest = max(levels, key=pace.Level.loss)
    print(f"  {found.pictures - before} pictures in {time.perf_counter() - start:.1f} s of motion, the cheapest of "
          f"{cheapest.strata}/6 at 1/{cheapest.shrink}; Blender went on {meanwhile} times while one was drawn")
    yield lambda: settled(2_000_000)
    check(found.shown.wish.level == pace.FULL and found.shown.stats["points_scattered"] > 1_000_000, f"{found.shown.stats}")


def test_toggling_lets_go():
    """Leaving Rendered mode ends the engine and its work."""
    setup()
    add_points(*sphere(5000, 1.0, (0, 0, 0)))
    yield lambda: shown() is not None
    area().spaces[0].shading.type = 'SOLID'
    area().tag_redraw()
    yield lambda: not viewport._VIEWPORTS


def test_a_freed_engine_is_let_go():
    """Python may still refer to an engine that Blender has freed; then every use of it raises an error."""

    class Freed:
        @property
        def is_preview(self):
            raise ReferenceError("StructRNA of type PatinaRenderEngine has been removed")

    setup()
    engine = Freed()
    found = viewport.Viewport(engine)
    check(found.engine() is None and viewport.of_area(area()) is not found, "taken for one that lives")
    viewport._wake()
    yield lambda: found not in viewport._VIEWPORTS
    check(not found.tick(), "the timer comes again")


def test_leaving_midway():
    """Leaving Rendered mode while points are made a cloud of, or while they are drawn, ends both."""
    rng = np.random.default_rng(2)
    for step in ("_progress", "_rendering"):
        setup()
        begun = -math.inf

        def under_way():
            """Between two looks the step may begin and end: then there are other points."""
            nonlocal begun
            if any(found._task and getattr(found, step) for found in viewport._VIEWPORTS):
                return True
            if time.perf_counter() - begun > 10.0:
                for obj in [obj for obj in bpy.data.objects if obj.type == 'MESH']:
                    bpy.data.objects.remove(obj)
                add_points(rng.normal(size=(2_000_000, 3)).astype(np.float32), None, None)
                begun = time.perf_counter()
            return False

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


def test_graphics_that_lack_something():
    """One message that names Blender's backend and says what works; a shader that failed is not compiled with each redraw."""
    setup(overlays=True)
    add_points(*sphere(5000, 1.0, (0, 0, 0)))
    yield lambda: shown() is not None
    found, tried, create = shown(), [], gpu.shader.create_from_info

    def failing(info):
        tried.append(info)
        raise Exception("Shader Compile Error, see console for more details")

    painting.forget()
    gpu.shader.create_from_info = failing
    try:
        for turn in (0.5, 0.6, 0.7):
            before = found.pictures
            view().view_rotation = Quaternion((0, 1, 0), turn)
            yield lambda before=before: found.pictures > before and "Shader Compile Error" in found.message
        check(graphics.name() in found.message and "F12" in found.message, found.message)
        check(len(tried) <= 2, f"compiled {len(tried)} times")
        check(render()["Combined"].any(), "F12 shows nothing")
    finally:
        gpu.shader.create_from_info = create
        painting.forget()
    before = found.pictures
    view().view_rotation = Quaternion((0, 1, 0), 0.8)
    yield newer(before)
    check(not found.message, found.message)


def test_processor_takes_over():
    """A GPU that fails in mid-session: the processor goes on, the sidebar says why; another choice is tried anew."""
    scene = setup()
    gpu = viewport.native.Device("cpu")  # stands for one: here it is to fail, not to draw
    gpu.name, gpu.label = "gl-egl", "A GPU"
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
        yield lambda: settled(5000) and shown().shown.device == "A GPU"
        found = shown()
        viewport.native.Frame.start = failing
        for turn in (0.5, 0.7):
            before = found.pictures
            view().view_rotation = Quaternion((0, 1, 0), turn)
            yield newer(before)
            check(found.shown.device.startswith("Processor (") and not found.message, f"{found.shown.device}: {found.message}")
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
        offer = statistics.PATINA_PT_sidebar_set_up
        check(not offer.poll(bpy.context), "Set Up is offered, and Patina is the engine")
        for cls in set(statistics._CLASSES) - {offer}:
            check(cls.poll(bpy.context), f"{cls.__name__} does not show")
            cls.draw(type("Panel", (), {"layout": _Layout(said)})(), bpy.context)
    check("20,000" in said and "scatter" in said, f"{said}")
    check(any(text.startswith("no ") or "because" in text for text in said), "no reason for a pass that was left out")
    screenshot("sidebar")
    area().spaces[0].show_region_ui = False


def test_a_changed_link_keeps_nobody_waiting():
    """A linked LAS that changed is read piece by piece; Blender goes on between them, the old picture stays."""
    source = import_points(dense("changed.ply", 60000, (0, 0, 0)))[0]
    path = SCRATCH / "changed.las"
    bpy.ops.export_scene.patina_points(overwrite=True, filepath=str(path), kind='LAS')
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


def test_import_of_a_user():
    """Blender goes on while a user's import reads its file in pieces; Esc ends it, and leaves nothing."""
    from types import SimpleNamespace

    from patina.operators.import_points import PATINA_OT_import_points as Import
    new_scene()
    path = dense("user.ply", 60000, (0, 0, 0))
    import_points(path)
    las_path = SCRATCH / "user.las"
    bpy.ops.export_scene.patina_points(overwrite=True, filepath=str(las_path), kind='LAS')
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


def test_edit_mode():
    """Points stay in view while they are edited, follow each step, and are read no more often than they change."""
    setup()
    points = add_points(*sphere(20000, 1.0, (0, 0, 0)))
    bpy.context.view_layer.objects.active = points
    yield lambda: settled(20000)

    def middle():
        columns = np.nonzero(np.isfinite(shown().shown.depth[..., 0]).any(axis=0))[0]
        return columns.mean() / shown().shown.depth.shape[1]

    window, before = bpy.context.window_manager.windows[0], middle()
    with bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=window_region()):
        bpy.ops.object.mode_set(mode='EDIT')
        bpy.ops.mesh.select_all(action='SELECT')
    try:
        area().tag_redraw()
        start = time.perf_counter()
        yield lambda: time.perf_counter() - start > 0.5 and settled(20000)
        check(abs(middle() - before) < 0.002, "entering moved the points")
        with bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=window_region()):
            bpy.ops.transform.translate(value=(1.0, 0, 0))
        yield lambda: settled(20000) and middle() > before + 0.1
        reads = shown().trusted.reads
        pictures = shown().pictures
        view().view_rotation = Quaternion((0, 1, 0), 0.2)
        yield lambda: newer(pictures)() and settled(20000)
        check(shown().trusted.reads == reads, "moving the view read points")
    finally:
        with bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=window_region()):
            bpy.ops.object.mode_set(mode='OBJECT')
    yield lambda: settled(20000)


def test_a_spoilt_link_is_left_out():
    """The rest is drawn, the sidebar says why one is not, and a file that is whole again is seen."""
    path = dense("spoilt_in_view.ply", 20000, (0, 0, 0))
    whole = path.read_bytes()
    setup()
    import_points(path, link=True)
    path.write_bytes(whole[:-200])
    add_points(*sphere(5000, 1.0, (0, 0, 0)))
    yield lambda: settled(5000)
    found = shown()
    check(not found.message and any(str(path) in notice for notice in found.notices), f"{found.message} {found.notices}")
    path.write_bytes(whole)
    bpy.context.scene.update_tag()
    yield lambda: settled(25000)
    check(not found.notices, f"{found.notices}")


def test_a_plan_is_one_undo_step():
    """The dialog opens, and one undo takes back what the plan set, not what came before."""
    scene = setup()
    add_points(*sphere(5000, 1.0, (0, 0, 0))).select_set(True)
    yield lambda: settled(5000)
    with override():
        bpy.ops.ed.undo_push(message="before")
        check(bpy.ops.render.patina_plan_sheet('INVOKE_DEFAULT') == {'RUNNING_MODAL'}, "no dialog")
    yield pause(0.5)
    whole_window("plan_dialog")
    if bpy.app.use_event_simulate:
        window = bpy.context.window_manager.windows[0]
        for value in ('PRESS', 'RELEASE'):  # closes the dialog, which would lie over the views of the tests that follow
            window.event_simulate('ESC', value, x=20, y=20)
            yield pause(0.3)
    with override():
        size = scene.render.resolution_x
        scene.render.resolution_y = 777
        bpy.ops.ed.undo_push(message="height")
        bpy.ops.render.patina_plan('EXEC_DEFAULT', True, filepath=str(SCRATCH / "undone.png"), scale=10.0, dpi=100.0, write_picture=False)
        check(bpy.context.scene.camera.name == "Plan" and bpy.context.scene.render.resolution_x != size, "not set up")
        bpy.ops.ed.undo()
    scene = bpy.context.scene
    left = scene.camera and scene.camera.name, "Plan" in bpy.data.objects, scene.render.resolution_x, scene.render.resolution_y
    check(left[0] != "Plan" and left[1:] == (False, size, 777), f"{left}")


def red_pixels(picture):
    return int(((picture[..., 0] > 0.8) & (picture[..., 1] < 0.3) & (picture[..., 2] < 0.3)).sum())


def test_a_missing_link_shows_a_red_box():
    """A red box with the object's name, a line in the status bar, an error in F12. All go when the file is found again."""
    from patina.draw import missing
    path = dense("missing_in_view.ply", 20000, (0, 0, 0))
    elsewhere = path.parent / "elsewhere_in_view"
    setup()
    import_points(path, link=True)
    add_points(*sphere(5000, 0.3, (0, 0, 0)))
    yield lambda: settled(25000)
    obj, = (obj for obj in bpy.data.objects if obj.patina.linked_file)
    check(not missing.status() and red_pixels(screenshot("link_there")) == 0, "red without a reason")
    elsewhere.mkdir(exist_ok=True)
    path.rename(elsewhere / path.name)
    bpy.context.scene.update_tag()
    yield lambda: settled(5000)
    yield lambda: missing._said == missing.status()
    check(f"'{obj.name}'" in missing.status() and "missing" in missing.status(), missing.status())
    check(red_pixels(screenshot("link_missing")) > 500, "no red box")
    whole_window("link_missing_window")
    try:
        bpy.ops.render.render()
        check(False, "no error in the report")
    except RuntimeError as error:
        check(f"{path.name} is missing" in str(error), str(error))
    bpy.ops.file.find_missing_files(directory=str(elsewhere))
    bpy.context.scene.update_tag()
    yield lambda: settled(25000)
    yield lambda: not missing._said
    check(not missing.status() and red_pixels(screenshot("link_found")) == 0, f"red although found: {missing.status()}")


def test_a_damaged_cache_is_mended():
    """What is kept of a link is shown at once; where it turns out to be damaged, the file itself is read beside."""
    from patina.sync.points import kept, linked
    path = dense("mended_in_view.ply", 60000, (0, 0, 0))
    source = linked.source(path)
    linked.load(source)
    whole = source.kept.read_bytes()
    source.kept.unlink()
    source.kept.write_bytes(whole[:1 << 17] + bytes(1 << 18) + whole[(1 << 17) + (1 << 18):])
    kept.CHECKS._seen.clear()
    setup()
    import_points(path, link=True)
    yield lambda: settled(60000) and not kept.CHECKS.busy()
    yield lambda: settled(60000) and source.kept.exists()
    viewport.native.Cloud.start_verifying(source.kept).result()
    found = shown()
    check(found.shown.clouds[0].cloud.count == 60000 and not found.message, found.message)
    mended = found.shown.color.copy()
    pictures = found.pictures
    viewport.sync.points.built.CACHE.clear()
    bpy.context.scene.update_tag()
    found.trusted.forget()
    bpy.context.view_layer.objects.active.update_tag()
    yield lambda: newer(pictures)() and settled(60000)
    check((found.shown.color == mended).all(), "the picture is that of the whole file")
