# SPDX-License-Identifier: GPL-3.0-or-later
"""Clouds in Solid, Wireframe and Material Preview shading: their colors are on the screen, of meshes of points and of PointCloud objects.
See test_window.py for what a yield means."""

import time

import bpy
import numpy as np
import screen
from harness import add_points, check, sphere
from patina import choices, point_data
from patina.draw import thinned
from patina.read.importers import PointFile
from patina.sync.points import made
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
