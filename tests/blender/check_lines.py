# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines in Blender: around a ball before a wall, every switch, the pass, and the viewport's narrower pictures."""

import bpy
import numpy as np
from harness import add_points, check, check_close, new_scene, render, sphere

SIDE = 128
RADIUS = 32  # of the ball, pixels


def stage(wall=True, **lines):
    """A red ball, 64 pixels wide, before a white wall, seen from above; unlit."""
    scene = new_scene(SIDE, SIDE)
    scene.camera.data.type = 'ORTHO'
    scene.camera.data.ortho_scale = 4.0
    scene.patina.fill, scene.patina.antialias = 'CLOSED', 'LAYERS'
    places, _, normals = sphere(60000, 1.0, (0, 0, -4))
    red = np.tile(np.float32((1, 0, 0, 1)), (len(places), 1))
    add_points(places, colors=red, normals=normals, name="ball")
    if wall:
        across = np.linspace(-2.2, 2.2, 280)
        x, y = np.meshgrid(across, across)
        flat = np.stack([x.ravel(), y.ravel(), np.full(x.size, -8.0)], 1)
        white = np.ones((len(flat), 4), np.float32)
        add_points(flat, colors=white, normals=np.tile((0.0, 0.0, 1.0), (len(flat), 1)), name="wall")
    scene.patina.lines.use = True
    for name, value in lines.items():
        setattr(scene.patina.lines, name, value)
    bpy.context.view_layer.patina.use_pass_line = True
    return scene


def row(picture, name="Combined"):
    """From the ball's middle to the right."""
    return picture[name][SIDE // 2, SIDE // 2:]


def test_off_and_on():
    scene = stage(use=False)
    plain = render()
    check(plain["Line"].max() == 0, "no lines, no pass")
    scene.patina.lines.use = True
    picture = render()
    changed = np.abs(picture["Combined"] - plain["Combined"]).max(2) > 0
    check(not (changed & (picture["Line"][..., 0] == 0)).any(), "pixels changed where there is no line")
    line = row(picture, "Line")[:, 0]
    check(line[:RADIUS - 2].max() == 0 and line[RADIUS + 6:].max() == 0, f"lines away from the outline: {line}")
    check(1.5 <= line.sum() <= 2.5, f"{line.sum()} pixels wide, 2 were asked for")
    check_close(row(picture)[line == 1], (0, 0, 0, 1), 0, "the line is black")
    depth = row(picture, "Depth")[:, 0]
    check(depth[line == 1].max() < 5.0 and depth[-8] > 7.9, f"lines have the ball's depth: {depth}")


def test_width():
    for width in (1.0, 4.0, 9.5):
        stage(width=width)
        line = row(render(), "Line")
        check(abs(line.sum() - width) <= 0.5, f"{line.sum()} pixels wide, {width} were asked for")
    stage(units='WORLD', width_world=0.125)  # 32 pixels a unit
    check(abs(row(render(), "Line").sum() - 4.0) <= 0.5, "width in the scene's units")


def test_on_the_background():
    stage(wall=False, width=4.0, color=(0.25, 0.5, 1.0), opacity=0.5)
    picture = render()
    line = row(picture, "Line")[:, 0]
    check(abs(line.sum() - 0.5 * 4.0) <= 0.25, f"{line.sum()}")
    outside = row(picture)[RADIUS + 2]
    check_close(outside, (0.125, 0.25, 0.5, 0.5), 1e-6, "half a line on nothing")


def test_color():
    stage(width=6.0, source='POINT', tint=0.5)
    check_close(row(render())[RADIUS + 3], (0.5, 0, 0, 1), 1e-3, "half the points' red")
    stage(width=6.0, source='DEPTH', color=(0, 1, 0), far_color=(0, 0, 1), near=3.0, far=5.0)
    picture = render()
    share = (row(picture, "Depth")[RADIUS + 3, 0] - 3) / 2
    check(0.3 < share < 0.5, f"the ball ends at a depth of {share * 2 + 3}")
    check_close(row(picture)[RADIUS + 3], (0, 1 - share, share, 1), 1e-5, "between green and blue")


def test_soft():
    stage(width=8.0, soft=1.0)
    line = row(render(), "Line")[RADIUS + 1:RADIUS + 9, 0]
    check((np.diff(line) < 0).all() and line[0] > 0.75 and line[-1] < 0.2, f"fades outwards: {line}")


def test_surface():
    stage(surface='PAPER', paper=(0.5, 0.75, 0.25))
    picture = render()
    check_close(row(picture)[:RADIUS - 3], (0.5, 0.75, 0.25, 1), 1e-6, "paper on the ball")
    check_close(row(picture)[-8:], (0.5, 0.75, 0.25, 1), 1e-6, "and on the wall")
    stage(surface='NONE')
    picture = render()
    alpha, line = picture["Combined"][..., 3], picture["Line"][..., 0]
    check_close(alpha, line, 1e-6, "only lines")
    check(line.max() == 1, "there are some")


def test_least_step():
    stage(offset=5.0)  # the wall lies 4 behind
    check(row(render(), "Line").max() == 0, "a step of 4 is less than 5")


def test_transparent_layers():
    scene = stage()
    scene.objects["ball"].patina.opacity = 0.5
    picture = render()
    check_close(row(picture)[:RADIUS // 2], row(picture)[0], 1e-3, "no lines inside")
    line = row(picture, "Line")[:, 0]
    check_close(row(picture)[line == 1], (0, 0, 0, 1), 0, "the outline is black")


def test_tiles_and_border():
    stage(width=9.0)
    whole = render()["Combined"]
    bpy.context.scene.patina.tile_size = 37
    check_close(render()["Combined"], whole, 0, "tiles")


def test_viewport_scales_lines():
    from patina import sync
    from patina.draw import pace, viewport
    scene = stage(width=6.0)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    view = sync.final_view(scene.camera.evaluated_get(depsgraph), depsgraph)
    described = sync.describe(depsgraph, view, lambda what, progress: False)
    level = pace.Level(strata=pace.STRATA, shrink=2)
    check_close(viewport.Wish(described, view, level, 0.0).description([]).lines.width, 3.0, 0, "half the pixels, half the width")
    scene.patina.lines.use = False
    scene.update_tag()
    bpy.context.view_layer.update()
    described = sync.describe(bpy.context.evaluated_depsgraph_get(), view, lambda what, progress: False)
    check(described.lines is None, "switched off")
