# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels as Blender draws them, in the window: each where it belongs, none with an error, labels that can be read. See
test_window.py for what a yield means."""

import traceback
from types import SimpleNamespace

import bpy
import numpy as np
import screen
from check_panels import Drawing, Row, context_of, panels
from harness import SCRATCH, add_light, add_points, check, sphere
from patina import point_data
from patina.draw import viewport
from patina.sync.analyses.analysis import SCANNERS
from patina.ui import rows
from window import area, keep, settled, setup, window_region

TABS = {"render": 'RENDER', "view_layer": 'VIEW_LAYER', "object": 'OBJECT', "data": 'DATA', "material": 'MATERIAL',
        "world": 'WORLD'}
DECORATOR, ARROW, PAD = 20, 20, 8  # beside a menu's text
MARK, FIRST = (255, 0, 255), 130  # a color; pixels: the path and the data block's name are above the first panel


def editor():
    return next(found for found in bpy.context.window.screen.areas if found.type == 'PROPERTIES')


def probe(space, region, tab, category=""):
    """A panel of Blender's that holds all of ours that belong to its place, those that are closed too. Returns it and what it keeps:
    names of panels that were drawn, errors."""
    drawn, errors = set(), []

    def draw(self, context):
        for cls in panels():
            if (cls.bl_space_type, cls.bl_region_type, getattr(cls, "bl_context", "")) != (space, region, tab) or cls == kind:
                continue
            try:
                if cls.poll(context):
                    held = Drawing(cls, self.layout.column())
                    for part in ("draw_header", "draw_header_preset", "draw"):
                        if hasattr(cls, part):
                            getattr(cls, part)(held, context)
                    drawn.add(cls.__name__)
            except Exception:
                errors.append(f"{cls.__name__}: {traceback.format_exc(limit=-1)}")

    words = {"bl_label": "Probe", "bl_space_type": space, "bl_region_type": region, "draw": draw}
    words |= {"bl_context": tab} if tab else {"bl_category": category}
    kind = type(f"TEST_PT_{space.lower()}_{tab or category.lower()}", (bpy.types.Panel,), words)
    bpy.utils.register_class(kind)
    return kind, drawn, errors


def objects():
    """One of each kind that has panels of its own."""
    points = add_points(*sphere(2000, 1.0, (0, 0, 0)))
    points.data[SCANNERS] = [0.0, 0.0, 5.0]
    number = add_points([(0, 0, 0)], name="sequence")
    number.patina.linked_file = str(SCRATCH / "scan_####.ply")
    mesh = bpy.data.meshes.new("faces")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    mesh.materials.append(bpy.data.materials.new("paint"))
    faces = bpy.data.objects.new("faces", mesh)
    empty = bpy.data.objects.new("empty", None)
    camera = bpy.data.objects.new("panorama", bpy.data.cameras.new("panorama"))
    camera.data.type = 'PANO'
    for obj in (faces, empty, camera):
        bpy.context.scene.collection.objects.link(obj)
    return [points, number, faces, empty, camera, add_light('AREA', 10)]


def select(obj):
    for other in bpy.context.view_layer.objects:
        other.select_set(other == obj)
    bpy.context.view_layer.objects.active = obj


def test_panels_are_drawn_without_errors():
    """Every panel of ours, in its tab or the sidebar, for objects of every kind, as they come and with every switch on."""
    scene = setup()
    scene.world = bpy.data.worlds.new("drawn")
    held = objects()
    probes = [probe('PROPERTIES', 'WINDOW', tab) for tab in TABS] + [probe('VIEW_3D', 'UI', "", category) for category in ("Item", "Tool", "View")]
    try:
        area().spaces[0].show_region_ui = True
        for on in (False, True):
            groups = [scene.patina, scene.patina.studio, scene.patina.effects, scene.patina.lines, held[0].patina,
                      held[0].patina.colors]
            for group in groups if on else ():
                for name, kind in group.bl_rna.properties.items():
                    if kind.type == 'BOOLEAN' and not kind.is_array and name.startswith("use"):
                        setattr(group, name, True)
                    elif kind.type == 'ENUM' and not name.startswith("device"):
                        setattr(group, name, kind.enum_items[-1].identifier)
            for obj in held:
                select(obj)
                for tab, name in TABS.items():
                    if tab in {"render", "view_layer", "world"} and obj != held[0]:
                        continue  # the same for all
                    try:
                        editor().spaces[0].context = name
                    except TypeError:  # an object without such a tab
                        continue
                    editor().tag_redraw()
                    area().tag_redraw()
                    bpy.ops.wm.redraw_timer(type='DRAW_WIN_SWAP', iterations=1)
            yield None
        scene.render.engine = 'CYCLES'  # with another engine Set Up is offered
        area().spaces[0].shading.type = 'SOLID'
        area().tag_redraw()
        bpy.ops.wm.redraw_timer(type='DRAW_WIN_SWAP', iterations=1)
        errors = [error for _, _, found in probes for error in found]
        check(not errors, f"{len(errors)}: {errors[:1]}")
        drawn = set().union(*(found for _, found, _ in probes))
        missing = {cls.__name__ for cls in panels()} - drawn - {"PATINA_PT_presets"}  # which hangs from a button
        check(not missing, f"never drawn: {sorted(missing)}")
    finally:
        area().spaces[0].show_region_ui = False
        for kind, _, _ in probes:
            bpy.utils.unregister_class(kind)
        bpy.data.materials.remove(bpy.data.materials["paint"])


def swatches():
    """Heights of the pixels that have the color of MARK in the properties editor, from its top."""
    editor().tag_redraw()
    for _ in range(2):
        bpy.ops.wm.redraw_timer(type='DRAW_WIN_SWAP', iterations=1)
    region = next(region for region in editor().regions if region.type == 'WINDOW')
    picture = screen.settled_pixels()[region.y:region.y + region.height, region.x:region.x + region.width].astype(int)
    keep(f"first panel {bpy.context.object.name}", picture.astype("uint8"))
    rows_found = (abs(picture - MARK).max(axis=2) < 8).sum(axis=1) > 20
    return [region.height - 1 - row for row in rows_found.nonzero()[0]]


def test_points_are_the_first_panel():
    """Of a mesh of points and of a PointCloud, in the tab of their data; not of other meshes. Blender has drawn the
    meshes' tab before. It keeps the order in which an editor first drew panels: one that draws meshes with Patina, and then a PointCloud
    with another engine, puts Points of PointClouds last."""
    scene = setup()
    mesh = bpy.data.meshes.new("faces")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    faces = bpy.data.objects.new("faces", mesh)
    scene.collection.objects.link(faces)
    held = [faces, add_points([(0, 0, 0)])]
    if point_data.HAS_CLOUDS:
        data = point_data.finished(point_data.new("cloud", np.zeros((1, 3), np.float32), True), True)
        held.append(bpy.data.objects.new("cloud", data))
        scene.collection.objects.link(held[-1])

    def mark(panel, context):
        panel.layout.prop(context.object, "color", text="")

    panel = bpy.types.PATINA_PT_points
    panel.prepend(mark)
    try:
        for obj in held:
            obj.color = (1.0, 0.0, 1.0, 1.0)
            select(obj)
            if obj.type == 'MESH':
                scene.render.engine = 'BLENDER_WORKBENCH'
                editor().spaces[0].context = 'DATA'
                check(not swatches(), f"{obj.name}: with another engine")
            scene.render.engine = 'PATINA'
            found = swatches()
            yield None
            if obj == faces:
                check(not found, "of a mesh with faces")
            else:
                check(found and found[0] < FIRST, f"{obj.name}: the first panel begins at pixel {found[:1]}")
    finally:
        panel.remove(mark)


def sidebar():
    return [cls for cls in panels() if (cls.bl_space_type, cls.bl_region_type) == ('VIEW_3D', 'UI')]


def test_labels_fit_the_sidebar():
    """As wide as it opens first: names take two fifths of a line, the words of menus and buttons what is left of it."""
    setup()
    obj = add_points(*sphere(2000, 1.0, (0, 0, 0)))
    select(obj)
    yield lambda: settled(2000)
    context, known = context_of(obj), bpy.context
    context.area = area()
    wide = []

    def must(text, room, where):
        width = rows.text_width(known, text)
        if width > room:
            wide.append(f"{where}: '{text}' is {width:.0f} wide, {room:.0f} are there")

    for source in ('OWN', 'FIXED', 'HEIGHT'):
        obj.patina.colors.source = source
        for cls in sidebar():
            layout = Row()
            obj.patina.linked_file = ""
            context.engine = 'PATINA'
            if not cls.poll(context):
                obj.patina.linked_file = "scan.ply"  # some are of linked clouds alone
            if not cls.poll(context):
                context.engine = 'CYCLES'  # and what is offered with other engines
            check(cls.poll(context), cls.__name__)
            cls.draw(Drawing(cls, layout), context)
            must(cls.bl_label, rows.LEAST - 2 * ARROW, cls.__name__)
            for kind, owner, name, text in layout.drawn:
                if kind.startswith("label"):
                    must(text, rows.LEAST - PAD, cls.__name__)
                elif owner is not None and name:
                    found = owner.bl_rna.properties[name]
                    if found.type == 'BOOLEAN':
                        must(text, rows.LEAST - ARROW - PAD, cls.__name__)
                        continue
                    must(text, 0.4 * rows.LEAST, cls.__name__)
                    for item in found.enum_items if found.type == 'ENUM' and text else ():
                        must(item.name, 0.6 * rows.LEAST - ARROW - PAD, f"{cls.__name__}.{name}")
                elif kind == "row" and text:
                    must(text, 0.4 * rows.LEAST, cls.__name__)
    check(not wide, f"{len(wide)}: {wide[:8]}")


def test_texts_are_broken_where_they_must():
    """No word of a sentence or a table is lost, no line is wider than the region."""
    context = bpy.context
    text = "Points that are far from what their neighbors are part of are not drawn and cast no shadow"
    for width in (80, 160, 400):
        found = rows.lines(context, text, width)
        check(" ".join(found) == text, f"{found}")
        check(all(rows.text_width(context, line) <= width for line in found), f"{width}: {found}")
    check(len(rows.lines(context, text, 80)) > len(rows.lines(context, text, 400)), "as many lines everywhere")
    layout = Row()
    with_region = SimpleNamespace(preferences=context.preferences, region=None)
    rows.table(with_region, layout, [("Time", "3 ms"), ("Expected Error", "37.22% of white, up to 60%")])
    said = [text for kind, _, _, text in layout.drawn if kind == "label" and text]
    check(said[:3] == ["Time", "3 ms", "Expected Error"] and " ".join(said[3:]) == "37.22% of white, up to 60%", f"{said}")
    yield None


def test_statistics_of_a_quad_view():
    """They are figures, not the advice to switch to what is on."""
    setup()
    add_points(*sphere(2000, 1.0, (0, 0, 0)))
    yield lambda: settled(2000)

    def quad():
        window = bpy.context.window_manager.windows[0]
        with bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=window_region()):
            bpy.ops.screen.region_quadview()

    quad()
    try:
        yield lambda: sum(found.engine() is not None and found.shown is not None for found in viewport._VIEWPORTS) >= 4
        layout, context = Row(), context_of()
        context.area = area()
        bpy.types.PATINA_PT_statistics.draw(Drawing(bpy.types.PATINA_PT_statistics, layout), context)
        said = [text for _, _, _, text in layout.drawn]
        check("2,000" in said, f"{said}")
    finally:
        quad()
    yield lambda: settled(2000)
