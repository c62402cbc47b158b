# SPDX-License-Identifier: GPL-3.0-or-later
"""Clouds in Solid, Wireframe and Material Preview shading: their colors are on the screen, of meshes of points and of PointCloud objects.
See test_window.py for what a yield means."""

import time
from dataclasses import replace

import bpy
import check_linked  # noqa: F401  no test leaves files with the user
import numpy as np
import screen
from check_formats import with_laspy
from check_import import import_ply, write_ply
from copc_files import points_of, write_copc
from harness import SCRATCH, add_points, check, sphere
from patina import choices, point_data
from patina.draw import thinned
from patina.read import streaming
from patina.read.importers import PointFile
from patina.sync.points import built, edits, linked, made
from window import area, keep, pause, setup, window_region

COLOR = (210, 60, 40, 255)
PAUSE = 0.6  # seconds
NONE = 3000  # pixels: of the red axis, which is as red
KINDS = (False, True) if point_data.HAS_CLOUDS else (False,)


def seen(name="", color=COLOR):
    """How many pixels of the view have a color, as it is or mixed with the mark of selected objects."""
    bpy.ops.wm.redraw_timer(type='DRAW_WIN_SWAP', iterations=1)
    picture, region = screen.settled_pixels(), window_region()
    picture = picture[region.y:region.y + region.height, region.x:region.x + region.width]
    keep(f"thinned {name}", picture)
    return int((np.abs(picture.astype(np.int16) - np.int16(color[:3])).max(axis=2) < 45).sum())


def given(cloud, count=120_000, color=COLOR, center=(0, 0, 0)):
    positions, _, normals = sphere(count, 1.5, center)
    points = PointFile("scan", positions.astype(np.float32), normals.astype(np.float32), np.tile(np.uint8(color), (count, 1)), {}, (0.0, 0.0, 0.0), 0, {})
    obj = bpy.data.objects.new("scan", made.to_data(points, cloud))
    bpy.context.scene.collection.objects.link(obj)
    return obj


def view_in(kind):
    setup(overlays=True)
    area().spaces[0].shading.type = kind
    area().spaces[0].show_region_ui = False


def test_thinned_colors_in_solid():
    """Of both kinds, selected or not, in Solid and Wireframe; never more points than the budget."""
    for cloud in KINDS:
        view_in('SOLID')
        obj = given(cloud)
        counts = {}
        for kind in ('SOLID', 'WIREFRAME'):
            for selected in (False, True):
                area().spaces[0].shading.type = kind
                obj.select_set(selected)
                yield pause(PAUSE)
                counts[kind, selected] = seen(f"{kind} {obj.type} {selected}")
        check(min(counts.values()) > 60_000, f"{obj.type}: pixels in the cloud's color: {counts}")
        parts = [part for part in thinned._parts.values() if part]
        check(len(parts) == 1 and len(parts[0].places) == choices.PREVIEW_POINTS, f"{[len(part.places) for part in parts]} points are shown")
        obj.hide_set(True)
        yield pause(PAUSE)
        check(seen("hidden") < NONE, f"{seen()} pixels of a hidden {obj.type}")
        obj.hide_set(False)
        colors = np.tile(np.float32((0.1, 0.8, 0.2, 1.0)), 120_000)
        obj.data.attributes["Col"].data.foreach_set("color_srgb", colors)
        point_data.changed(obj.data)
        obj.location.x = 1.0
        yield pause(PAUSE)
        check(seen("painted", (26, 204, 51)) > 60_000, f"{obj.type}: {seen('', (26, 204, 51))} pixels after its colors changed")


def test_thinned_points_are_hidden_by_what_is_nearer():
    """And by nothing else; instances are shown, and a budget of none shows none."""
    for cloud in KINDS:
        view_in('SOLID')
        obj = given(cloud)
        obj.select_set(False)
        yield pause(PAUSE)
        whole = seen("whole")
        bpy.ops.mesh.primitive_cube_add(size=2.0, location=(0.0, 0.0, 2.2))
        cube = bpy.context.object
        cube.select_set(False)
        yield pause(PAUSE)
        behind = seen("behind")
        check(behind < 0.7 * whole, f"{obj.type}: {behind} of {whole} pixels behind a cube")
        cube.location.z = -4.0
        yield pause(PAUSE)
        check(seen("before") > 0.97 * whole, f"{obj.type}: {seen()} of {whole} pixels before a cube")
        bpy.data.objects.remove(cube)
        collection = bpy.data.collections.new("scans")
        bpy.context.scene.collection.objects.unlink(obj)
        collection.objects.link(obj)
        instance = bpy.data.objects.new("instance", None)
        instance.instance_type, instance.instance_collection = 'COLLECTION', collection
        bpy.context.scene.collection.objects.link(instance)
        yield pause(PAUSE)
        check(seen("instance") > 0.97 * whole, f"{obj.type}: {seen()} of {whole} pixels of an instance")
        before, choices.PREVIEW_POINTS = choices.PREVIEW_POINTS, 0
        area().tag_redraw()
        yield pause(PAUSE)
        none, choices.PREVIEW_POINTS = seen("none"), before
        check(none < NONE, f"{obj.type}: {none} pixels without a budget")


def test_thinned_linked_clouds():
    """The points of the saved cloud show in Solid and Wireframe, in their colors, at the object's place; no more than the budget; hidden
    objects and a budget of none show none. A file that changes is shown as it is once it was read again."""
    view_in('SOLID')
    positions, _, normals = sphere(120_000, 1.5, (0, 0, 0))

    def write(color):
        return write_ply("thinned.ply", [(axis, "f4", positions[:, i]) for i, axis in enumerate("xyz")]
                         + [(f"n{axis}", "f4", normals[:, i]) for i, axis in enumerate("xyz")]
                         + [(name, "u1", np.full(len(positions), color[i])) for i, name in enumerate(("red", "green", "blue"))])

    obj, = import_ply(write(COLOR), link=True)
    counts = {}
    for kind in ('SOLID', 'WIREFRAME'):
        for selected in (False, True):
            area().spaces[0].shading.type = kind
            obj.select_set(selected)
            start = time.perf_counter()
            yield lambda: any(thinned._parts.values()) and time.perf_counter() - start > PAUSE
            counts[kind, selected] = seen(f"linked {kind} {selected}")
    check(min(counts.values()) > 60_000, f"pixels in the cloud's color: {counts}")
    part, = thinned._parts.values()
    check(len(part.places) == choices.PREVIEW_POINTS, f"{len(part.places)} points are shown")
    check(np.abs(np.linalg.norm(part.places[:, :3], axis=1) - 1.5).max() < 1e-3, "they lie elsewhere")
    obj.location.x = 20.0
    yield pause(PAUSE)
    check(seen("linked away") < NONE, f"{seen()} pixels of one that lies elsewhere")
    obj.location.x = 0.0
    obj.hide_set(True)
    yield pause(PAUSE)
    check(seen("linked hidden") < NONE, f"{seen()} pixels of a hidden one")
    obj.hide_set(False)
    write((40, 200, 60))
    linked.load(linked.source_of(obj, 1, []))
    obj.location.x = 0.01
    yield lambda: seen("linked again", (40, 200, 60)) > 60_000
    before, choices.PREVIEW_POINTS = choices.PREVIEW_POINTS, 0
    area().tag_redraw()
    yield pause(PAUSE)
    none, choices.PREVIEW_POINTS = seen("linked none"), before
    check(none < NONE, f"{none} pixels without a budget")


def test_thinned_without_hidden_and_deleted():
    """Points of a linked cloud that are hidden or deleted are left out, and come back; edits of another file hide nothing. Scans that are
    hidden are left out of linked and imported clouds."""
    view_in('SOLID')
    positions, _, normals = sphere(60_000, 1.5, (0, 0, 0))
    path = write_ply("edited.ply", [(axis, "f4", positions[:, i]) for i, axis in enumerate("xyz")]
                     + [(f"n{axis}", "f4", normals[:, i]) for i, axis in enumerate("xyz")] + [("scan", "u1", np.uint8(positions[:, 0] > 0))]
                     + [(name, "u1", np.full(len(positions), COLOR[i])) for i, name in enumerate(("red", "green", "blue"))])

    def pixels(name):
        start = time.perf_counter()
        yield lambda: any(thinned._parts.values()) and time.perf_counter() - start > PAUSE
        counts[name] = seen(f"without {name}")

    for link in (True, False):
        counts = {}
        obj, = import_ply(path, link=link)
        obj.select_set(False)
        yield from pixels("all")
        if link:
            none, right = edits.none(len(positions)), edits.of_flags(positions[:, 0] > 0)
            for name, changed in (("hidden", replace(none, hidden=right)), ("deleted", replace(none, deleted=~right)), ("other", edits.none(77))):
                obj[edits.PROPERTY] = changed.packed()
                obj.update_tag()
                yield from pixels(name)
            del obj[edits.PROPERTY]
            part, = filter(None, thinned._parts.values())
            check(len(part.places) == choices.PREVIEW_POINTS, f"{len(part.places)} points of edits of another file")
        item = obj.patina.points.scans.add()
        item.name, item.number, item.hide = "scan 1", 1, True
        obj.update_tag()
        yield from pixels("scan")
        part, = filter(None, thinned._parts.values())
        check((part.places[:, 0] <= 0).all() and len(part.places) > 25_000, f"{len(part.places)} points, to {part.places[:, 0].max()}")
        item.hide = False
        obj.update_tag()
        yield from pixels("again")
        for name in counts.keys() - {"all", "other", "again"}:
            check(0.35 < counts[name] / counts["all"] < 0.65, f"{name}: {counts}")
        check(counts["again"] > 0.97 * counts["all"] and counts.get("other", counts["all"]) > 0.97 * counts["all"], f"{counts}")
        bpy.data.objects.remove(obj)


def test_thinned_streamed_clouds():
    """The coarsest points of a file that is read as needed, in their colors, at the object's place, though no image was drawn."""
    with_laspy()
    view_in('SOLID')
    records, positions = points_of(60_000)
    for name, value in zip(("red", "green", "blue"), COLOR, strict=False):
        records[name] = value * 257
    path = SCRATCH / "thinned.copc.laz"
    write_copc(path, records, least=6000)
    bpy.ops.import_scene.patina_points(filepath=str(path), link=True, stream='ON')
    obj = bpy.context.object
    obj.select_set(False)
    before, choices.PREVIEW_POINTS = choices.PREVIEW_POINTS, 5000
    built.CACHE.clear()  # as after a file is opened
    thinned.forget()
    area().tag_redraw()
    yield lambda: any(thinned._parts.values())
    yield pause(PAUSE)
    count, part = seen("streamed"), next(filter(None, thinned._parts.values()))
    stream, = streaming.streams_of(cloud for _, cloud in built.CACHE._entries.values())
    choices.PREVIEW_POINTS = before
    check(count > 20_000, f"{count} pixels in the cloud's color")
    check(len(part.places) == 5000, f"{len(part.places)} points")
    check(np.abs(np.linalg.norm(part.places[:, :3], axis=1) - 1.0).max() < 2e-3, "they lie elsewhere")
    check(stream.arrived == 1, f"{stream.arrived} pages were read")


def test_thinned_points_without_colors():
    """Grays by their normals; points without a place, and objects without points, cause nothing."""
    view_in('SOLID')
    positions, _, normals = sphere(50_000, 1.5, (0, 0, 0))
    positions[:100] = np.nan
    points = add_points(positions, None, normals)
    points.select_set(False)
    for cloud in KINDS:
        empty = bpy.data.pointclouds.new("empty") if cloud else bpy.data.meshes.new("empty")
        bpy.context.scene.collection.objects.link(bpy.data.objects.new("empty", empty))
    yield pause(PAUSE)
    bpy.ops.wm.redraw_timer(type='DRAW_WIN_SWAP', iterations=1)
    picture, region = screen.settled_pixels().astype(np.int16), window_region()
    picture = picture[region.y:region.y + region.height, region.x:region.x + region.width]
    bright = (picture.min(axis=2) > 110) & (np.ptp(picture, axis=2) < 12)
    check(bright.sum() > 40_000, f"{bright.sum()} gray pixels")


def test_thinned_colors_in_material_preview():
    """EEVEE shows PointClouds by their material; meshes of points get theirs from Patina."""
    view_in('MATERIAL')
    obj = given(False)
    obj.select_set(False)
    yield pause(2.0)
    start = time.perf_counter()
    yield lambda: seen("material") > 60_000 or time.perf_counter() - start > 100.0
    check(seen("material") > 60_000, f"{seen()} pixels in the cloud's color")
