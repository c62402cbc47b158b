# SPDX-License-Identifier: GPL-3.0-or-later
"""Scanners' grids: borders where the scanner saw past a surface, by the operator and in pictures; and how far scans lie apart, as a
pass."""

import bpy
import numpy as np
from check_formats import range_image, text_file
from check_import import import_ply
from harness import add_points, check, new_scene, render, reports, sphere
from patina.sync.analyses import analysis
from patina.sync.points import built

APART = 0.03


def scene_of(text, name, link=False):
    scene = new_scene(64, 64)
    scene.camera.data.type, scene.camera.data.ortho_scale = 'ORTHO', 2.5
    obj, = import_ply(text_file(name, text), link=link)
    scene.camera.location = [-value for value in obj.get("patina_origin", (0.0, 0.0, 0.0))]
    bpy.context.view_layer.objects.active = obj
    return obj


def steps(name, link=False):
    """A wall that is not quite even, and columns 8 to 11 of 20 a unit before it, as a scanner sees them that looks along -z."""
    places = [(0.1 * (column - 9.5), 0.1 * (row - 9.5), 0.01 * ((7 * column + 13 * row) % 5) - (3.0 if 8 <= column <= 11 else 4.0))
              for row in range(20) for column in range(20)]
    lines = ["ply", "format ascii 1.0", "obj_info num_cols 20", "obj_info num_rows 20", "element vertex 400", "property float x",
             "property float y", "property float z", "element range_grid 400", "property list uchar int vertex_indices", "end_header",
             *("%g %g %g" % place for place in places), *(f"1 {i}" for i in range(400))]
    text_file("steps.ply", "\n".join(lines) + "\n")
    return scene_of("bmesh steps.ply 0 0 0 0 0 0 1\n", name, link)


def pair(name, link):
    """Two scans of a wall, the second behind the first by APART, which beside it is alone at the left."""
    range_image("near.ply", -4.0, 20, 10)
    range_image("far.ply", -4.0 - APART, 10, 10)
    obj = scene_of("bmesh near.ply -1 -0.5 0 0 0 0 1\nbmesh far.ply 0.02 -0.48 0 0 0 0 1\n", name, link)
    obj.patina.ranges.use = True
    return obj


def check_disagreement(link):
    obj = pair(f"apart_{link}.conf", link)
    layer = bpy.context.scene.view_layers[0]
    check("Disagreement" not in render(), "it is there, and nobody asked")
    layer.patina.use_pass_disagreement = True
    passes = render()
    told, shown = passes["Disagreement"][..., 0], np.isfinite(passes["Combined"][..., 3]) & (passes["Combined"][..., 3] > 0)
    both = shown[28:36, 38:54]
    check(both.all() and np.abs(told[28:36, 38:54] - APART).max() < 0.1 * APART, f"{told[28:36, 38:54]}")
    check(shown[28:36, 10:26].all() and not told[28:36, 10:26].any(), "where one is alone")
    obj.patina.ranges.use = False
    check(not render()["Disagreement"].any(), "surfaces that are no range images")
    layer.patina.use_pass_disagreement = False


def test_disagreement():
    check_disagreement(False)


def test_disagreement_of_links():
    check_disagreement(True)


def test_disagreement_without_conf():
    """Points with an attribute "scan" of whatever numbers, and no word of directions."""
    scene = new_scene(64, 64)
    scene.camera.data.type, scene.camera.data.ortho_scale = 'ORTHO', 2.5
    y, x = (values.reshape(-1) for values in np.mgrid[:20, :20])
    wall = np.stack([0.1 * x - 1, 0.1 * y - 1, np.full(400, -4.0)], 1)
    obj = add_points(np.concatenate([wall, wall + (0.01, 0.02, -APART)]))
    obj.data.attributes.new("scan", 'INT', 'POINT').data.foreach_set("value", np.repeat([3, 700], 400).astype(np.int32))
    obj.patina.ranges.use = True
    scene.view_layers[0].patina.use_pass_disagreement = True
    told = render()["Disagreement"][20:44, 20:44, 0]
    check(np.abs(told - APART).max() < 0.1 * APART, f"{told.min()} {told.max()}")


def kinds_of(data):
    kinds = np.empty(400, np.int32)
    data.attributes["kind"].data.foreach_get("value", kinds)
    return kinds.reshape(20, 20)


def test_operator_by_grid():
    obj = steps("operator.conf")
    check(bpy.ops.object.patina_analyze(by_grid=True) == {'FINISHED'}, "finished")
    kinds = kinds_of(obj.data)
    border = np.zeros((20, 20), bool)
    border[:, [8, 11]] = True
    check((kinds[1:-1, 1:-1][border[1:-1, 1:-1]] == 2).all(), f"{kinds}")
    check((kinds[1:-1, 9:11] == 1).all() and (kinds[1:-1, 2:7] == 1).all(), f"{kinds}")


def test_pictures_by_grid():
    """Live: the cloud is analyzed anew, and the picture changes at the board's sides; a cloud without a grid says so."""
    obj = steps("picture.conf")
    bpy.context.scene.patina.surface = 'SPLATS'
    plain = render()["Combined"]
    by_space = only_kinds()
    obj.patina.analysis_grid = True
    with_grid = render()["Combined"]
    by_grid = only_kinds()
    check(by_grid[1] + by_grid[2] == 400 and by_grid[2] >= 36, f"{by_space} {by_grid}")
    check(np.abs(with_grid - plain).max() > 0.01, "the picture is the same")
    check(not any(analysis.NO_GRID in text for _, text in reports), f"{reports}")
    obj.patina.analysis_grid = False
    check(np.array_equal(render()["Combined"], plain), "and back")
    new_scene(64, 64)
    ball = add_points(sphere(3000)[0])
    ball.patina.analysis_grid = True
    render()
    check(any(analysis.NO_GRID in text for _, text in reports), f"{reports}")
    bpy.context.view_layer.objects.active = ball
    check(bpy.ops.object.patina_analyze(by_grid=True) == {'FINISHED'}, "analyzed all the same")


def only_kinds():
    """Of the cloud of the last picture."""
    return list(built.CACHE._entries.values())[-1][1].kinds
