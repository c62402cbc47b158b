# SPDX-License-Identifier: GPL-3.0-or-later
"""Styles of soft points, by their pixels; and numbers that points go by, from their analysis to a file and back."""

import bpy
import numpy as np
from check_soft import by
from harness import SCRATCH, add_points, check, check_close, new_scene, patina, render, reports
from patina.styles import styles

RED, BLUE = (220, 40, 40, 255), (40, 60, 220, 255)


def wall(z, half=2.0, step=0.02, low=(-1.0, -1.0), high=(1.0, 1.0)):
    """Points of a square that faces the camera; low, high: of it, in parts of its half."""
    x, y = np.meshgrid(np.arange(low[0] * half, high[0] * half, step), np.arange(low[1] * half, high[1] * half, step))
    return np.stack([x.ravel(), y.ravel(), np.full(x.size, z)], 1)


def stage(*parts, classes=None):
    """(scene, object) of walls in their colors, which face the camera."""
    scene = new_scene()
    scene.render.film_transparent = False
    scene.patina.fill = 'CLOSED'
    points = np.concatenate([part for part, _ in parts])
    colors = np.concatenate([np.tile(np.array(color, np.uint8), (len(part), 1)) for part, color in parts])
    obj = add_points(points, colors, np.tile((0.0, 0.0, 1.0), (len(points), 1)))
    if classes is not None:
        numbers = np.repeat(np.array(classes, np.int32), [len(part) for part, _ in parts])
        obj.data.attributes.new("classification", 'INT', 'POINT').data.foreach_set("value", numbers)
    bpy.context.view_layer.objects.active = obj
    return scene, obj


def styled(key):
    reports.clear()
    check(bpy.ops.patina.apply_style(style=key) == {'FINISHED'}, key)
    picture = render()["Combined"][..., :3]
    check(not reports, f"{key}: {reports}")
    return picture


def redness(picture):
    return picture[..., 0] / np.maximum(picture[..., 0] + picture[..., 2], 1e-6)


def test_vegetation_lets_through():
    """A tree's points before a wall: the wall comes through them; a wall of a building's before it does not."""
    left, right = (wall(-3.0, high=(0.0, 1.0)), RED), (wall(-3.0, low=(0.0, -1.0)), RED)
    stage(left, right, (wall(-5.0, 4.0), BLUE), classes=(5, 6, 6))
    before = redness(styled("scan"))
    check(before[12:36, 4:60].min() > 0.9, "as scanned all that is before is red")
    shown = redness(styled("vegetation"))
    check(shown[12:36, 4:26].max() < 0.85 and shown[12:36, 4:26].min() > 0.02, f"plants: {shown[24, 4:26]}")
    check(shown[12:36, 38:60].min() > 0.9, f"the building stands: {shown[24, 38:60]}")
    again = redness(styled("museum"))
    check(again[12:36, 4:26].min() > 0.8, "another style has no soft points")


def test_above_ground_lets_through():
    """What is higher than half a meter above the ground lets the wall behind it through; what is lower stands."""
    left, right = (wall(-3.0, high=(0.0, 1.0)), RED), (wall(-3.0, low=(0.0, -1.0)), RED)
    _, obj = stage(left, right, (wall(-5.0, 4.0), BLUE))
    heights = np.concatenate([np.full(len(left[0]), 3.0), np.full(len(right[0]), 0.2), np.zeros(len(obj.data.vertices) - len(left[0]) - len(right[0]))])
    obj.data.attributes.new("height_above_ground", 'FLOAT', 'POINT').data.foreach_set("value", heights.astype(np.float32))
    shown = redness(styled("above_ground"))
    check(shown[12:36, 4:26].max() < 0.85 and shown[12:36, 4:26].min() > 0.02, f"high: {shown[24, 4:26]}")
    check(shown[12:36, 38:60].min() > 0.9, f"low: {shown[24, 38:60]}")


def test_xray_walls_add_up():
    """One, two and three walls behind one another: each is seen through the others."""
    scene, _ = stage((wall(-3.0), RED), (wall(-4.0, 4.0, low=(-1.0, -1.0), high=(0.2, 1.0)), RED),
                     (wall(-5.0, 6.0, low=(-1.0, -1.0), high=(-0.15, 1.0)), RED))
    picture = styled("xray_walls").sum(2)
    three, two, one = picture[16:32, 4:16].mean(), picture[16:32, 30:36].mean(), picture[16:32, 48:60].mean()
    ground = np.asarray(scene.patina.studio.background).sum()
    check(ground < one and one + 0.3 * (one - ground) < two and two + 0.2 * (one - ground) < three,
          f"ground {ground:.3f}, one wall {one:.3f}, two {two:.3f}, three {three:.3f}")


def test_uncertainty_is_soft():
    """Where normals disagree the wall behind comes through."""
    scene, obj = stage((wall(-3.0), RED), (wall(-5.0, 4.0), BLUE))
    count, front = len(obj.data.vertices), len(wall(-3.0))
    x = np.empty(count * 3, np.float32)
    obj.data.vertices.foreach_get("co", x)
    rng = np.random.default_rng(2)
    normals = np.tile(np.float32((0.0, 0.0, 1.0)), (count, 1))
    noisy = np.flatnonzero((x[::3] > 0.0) & (np.arange(count) < front))
    normals[noisy] = rng.normal(size=(len(noisy), 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    obj.data.attributes["Normal"].data.foreach_set("vector", normals.reshape(-1))
    obj.data.update()
    shown = redness(styled("uncertainty"))
    check(shown[16:32, 6:26].min() > 0.9, f"sure: {shown[24, 6:26]}")
    check(shown[16:32, 38:58].mean() < 0.8, f"unsure: {shown[24, 38:58]}")


def test_cutaway_shows_the_farther_half():
    scene, _ = stage((wall(-3.0), RED), (wall(-9.0, 8.0, 0.04), BLUE))
    check(redness(styled("scan"))[12:36, 8:56].min() > 0.9, "as scanned the near wall hides the other")
    shown = redness(styled("cutaway"))
    check(shown[12:36, 8:56].max() < 0.85, f"the far wall comes through: {shown[24, 8:56]}")
    scene.camera.location.z, scene.camera.rotation_euler.y = -12.0, np.pi
    behind = redness(render()["Combined"][..., :3])[20:28, 28:36]
    check(0.1 < behind.min() and behind.max() < 0.95, f"from wherever the camera looks, the red one comes through now: {behind}")


def test_styles_leave_what_was_painted():
    """A style without soft points leaves an artist's own; one with them takes their place, and the next one ends that."""
    _, obj = stage((wall(-3.0, step=0.1), RED), classes=(5,))
    obj.data.attributes.new("mine", 'FLOAT', 'POINT')
    by(obj, 'ATTRIBUTE', use=True, attribute="mine", threshold=0.25)
    styled("museum")
    group = obj.patina.soft
    check(group.use and group.by == 'ATTRIBUTE' and group.attribute == "mine" and group.threshold == 0.25, "museum leaves it")
    kept = styles.taken("", bpy.context.scene, obj).points
    check(kept["soft.use"] and kept["soft.attribute"] == "mine", f"a style of one's own has it: {kept}")
    styled("vegetation")
    check(group.use and group.by == 'CLASSES' and group.threshold == 0.5, "vegetation takes its place")
    styled("ink")
    check(not group.use and group.by == 'ALL', "and ink ends that")


# ---- numbers ---------------------------------------------------------------------------------------------------------


def numbers(obj, name):
    found = np.empty(len(obj.data.vertices), np.float32)
    obj.data.attributes[name].data.foreach_get("value", found)
    return found


def test_numbers_from_analysis_to_file():
    """Radius, uncertainty and density become attributes, make points soft, are painted, exported, linked and read again."""
    scene = new_scene()
    rng = np.random.default_rng(4)
    dense, wide = rng.uniform((-1, -0.6), (0, 0.6), (6000, 2)), rng.uniform((0, -0.6), (1, 0.6), (1500, 2))
    points = np.c_[np.r_[dense, wide], np.full(7500, -3.0)]
    obj = add_points(points)
    bpy.context.view_layer.objects.active = obj
    check(bpy.ops.object.patina_analyze(soft=True) == {'FINISHED'}, "analyzed")
    radius, uncertainty, density = (numbers(obj, name) for name in ("soft_radius", "uncertainty", "density"))
    left = points[:, 0] < -0.1
    right = points[:, 0] > 0.1
    check_close(np.median(density[left]), 5000.0, 1500.0, "points for each square meter where they lie dense")
    check_close(np.median(density[right]), 1250.0, 400.0, "and where not")
    # [S Eq. 20], even points: 1.13 spacings
    check_close(np.median(radius[left]) * np.sqrt(5000.0), 1.13, 0.12, "radius in spacings")
    check_close(np.median(radius[right]) / np.median(radius[left]), 2.0, 0.2, "twice as far apart")
    check(uncertainty.min() >= 0.0 and uncertainty.max() <= 1.0 and uncertainty.std() > 0.01, "uncertainty of 0 to 1")

    obj.patina.soft.use = True
    by(obj, 'ATTRIBUTE', attribute="density", opacity=0.1, use_range=True, range_min=0.0, range_max=5000.0)
    scene.patina.fill = 'CLOSED'
    alpha = render()["Combined"][..., 3]
    check(alpha[16:32, 14:28].mean() < 0.9 < 0.99 < alpha[16:32, 36:50].mean(), "dense points are soft")
    obj.patina.colors.source, obj.patina.colors.scalar = 'SCALAR', "density"
    obj.patina.colors.use_range, obj.patina.colors.range_max = True, 5000.0
    obj.patina.lighting, obj.patina.soft.use = 'UNLIT', False
    obj.update_tag()
    shown = render()["Combined"][..., :3]
    check(np.abs(shown[16:32, 14:28].mean((0, 1)) - shown[16:32, 36:50].mean((0, 1))).max() > 0.1, "density is seen")
    density[:100] = 12345.0  # edited
    obj.data.attributes["density"].data.foreach_set("value", density)

    path = SCRATCH / "numbers.ply"
    obj.select_set(True)
    check(bpy.ops.export_scene.patina_points(overwrite=True, filepath=str(path), selected=True) == {'FINISHED'}, "exported")
    file = patina.native.File(str(path))
    check({"soft_radius", "uncertainty", "density"} <= set(file.attributes), f"{file.attributes}")
    bpy.data.objects.remove(obj)
    box = bpy.data.objects.new("linked", bpy.data.meshes.new("box"))
    scene.collection.objects.link(box)
    box.patina.linked_file = str(path)
    box.patina.soft.use = True
    by(box, 'ATTRIBUTE', attribute="density", opacity=0.1, use_range=True, range_min=0.0, range_max=5000.0)
    reports.clear()
    linked = render()["Combined"][..., 3]
    check(not reports, f"{reports}")
    check(linked[16:32, 14:28].mean() < 0.9 < 0.99 < linked[16:32, 36:50].mean(), "a linked file's column makes points soft")
    for source in ('DENSITY', 'UNCERTAINTY'):
        by(box, source, use_range=source == 'DENSITY', threshold=0.5)
        other = render()["Combined"][..., 3]
        check(not reports, f"{source}: {reports}")
        if source == 'DENSITY':
            check(other[16:32, 14:28].mean() < 0.9 < 0.99 < other[16:32, 36:50].mean(), "found of a linked file")


def test_same_in_millimeters():
    """The numbers and the picture are the same in millimeters and meters."""
    rng = np.random.default_rng(6)
    points = np.c_[rng.uniform((-1, -0.6), (1, 0.6), (4000, 2)), -3.0 + 0.05 * rng.normal(size=4000)]
    shown, found = [], []
    for scale in (1.0, 1000.0):
        scene = new_scene()
        obj = add_points(points * scale)
        bpy.context.view_layer.objects.active = obj
        scene.camera.data.clip_end = 100.0 * scale
        scene.camera.data.clip_start = 0.1 * scale
        check(bpy.ops.object.patina_analyze(soft=True) == {'FINISHED'}, "analyzed")
        found.append({name: numbers(obj, name) for name in ("soft_radius", "uncertainty")})
        obj.patina.soft.use = True
        by(obj, 'ATTRIBUTE', attribute="uncertainty", threshold=0.2, use_range=True)
        shown.append(render()["Combined"][..., 3])
    check_close(found[1]["soft_radius"], 1000.0 * found[0]["soft_radius"], 0.1, "radius")
    off = np.abs(found[1]["uncertainty"] - found[0]["uncertainty"])
    check((off > 1e-3).mean() < 0.002, f"uncertainty: {(off > 1e-3).sum()} of {len(off)} differ, by {off.max():.3f} at most: by what rounding "
                                       "makes of neighbors that are equally far")
    check((np.abs(shown[0] - shown[1]) > 0.02).mean() < 0.01, f"{(np.abs(shown[0] - shown[1]) > 0.02).mean():.2%} of the picture differs")
