# SPDX-License-Identifier: GPL-3.0-or-later
"""Transparency: opacity of objects and points, layers, their passes, the estimate of the layer distance."""

import bpy
import numpy as np
from check_passes import dense_scene
from check_points import grid, pixel
from harness import add_points, check, check_close, drawn, linear, new_scene, patina, render, reports, stats
from patina.sync.analyses import estimates

RED, GREEN = (200, 60, 40), (30, 180, 90)
DEEPER = 12  # times as far: farther behind than twice the spacing of the points


def colors(color, alpha=255, count=12):
    return np.tile(np.array((*color, alpha), np.uint8), (count, 1))


def two_sheets(opacity=0.25):
    """Points with others exactly behind them: (scene, points in front, front object, back object)."""
    scene = new_scene()
    points = grid()
    front = add_points(points, colors(RED), name="front")
    back = add_points(points * DEEPER, colors(GREEN), name="back")
    front.patina.opacity = opacity
    return scene, points, front, back


def blended(opacity):
    return opacity * linear(RED) + (1 - opacity) * linear(GREEN)


def test_object_opacity():
    for opacity in (0.25, 0.5, 0.9):
        scene, points, _, _ = two_sheets(opacity)
        picture = render()
        for point in points:
            got = picture["Combined"][pixel(scene, point)]
            check_close(got[:3], blended(opacity), 1e-5, f"opacity {opacity}")
            check_close(got[3], 1, 1e-6, "an opaque sheet behind")
            check_close(picture["Depth"][pixel(scene, point)], 2, 1e-5, "depth of the first layer")
        check("2 layers" in stats[-1], f"statistics {stats[-1]!r}")


def test_exact_opacities():
    scene, points, front, back = two_sheets(1.0)
    place = pixel(scene, points[4])
    check_close(render()["Combined"][place][:3], linear(RED), 2e-6, "opaque")
    check("layers" not in stats[-1], f"statistics {stats[-1]!r}")
    front.patina.opacity = 0.0
    picture = render()
    check_close(picture["Combined"][place][:3], linear(GREEN), 2e-6, "an object that is not there")
    check_close(picture["Depth"][place], 2 * DEEPER, 1e-4, "depth of what is there")
    back.patina.opacity = 0.0
    check(not drawn(render()), "nothing at all")


def test_film():
    scene, points, _, back = two_sheets(0.25)
    back.patina.opacity = 0.5
    got = render()["Combined"][pixel(scene, points[4])]
    check_close(got[3], 1 - 0.75 * 0.5, 1e-6, "alpha")
    check_close(got[:3], 0.25 * linear(RED) + 0.75 * 0.5 * linear(GREEN), 1e-5, "premultiplied colour")


def test_layer_cap():
    scene, points, _, _ = two_sheets(0.25)
    scene.patina.layers = 1
    got = render()["Combined"][pixel(scene, points[4])]
    check_close(got, (*0.25 * linear(RED), 0.25), 1e-5, "one layer only")


def test_opacity_attribute():
    scene, points, front, _ = two_sheets(1.0)
    values = np.linspace(0, 1, 12).astype(np.float32)
    front.data.attributes.new("glass", 'FLOAT', 'POINT').data.foreach_set("value", values)
    front.patina.opacity_attribute = "glass"
    picture = render()["Combined"]
    for point, value in zip(points, values):
        check_close(picture[pixel(scene, point)][:3], blended(value), 0.5 / 255 + 1e-5, f"a point of opacity {value}")
    front.patina.opacity = 0.5
    picture = render()["Combined"]
    for point, value in zip(points, values):
        check_close(picture[pixel(scene, point)][:3], blended(0.5 * value), 0.5 / 255, f"half of {value}")


def test_other_opacity_attributes():
    scene, points, front, _ = two_sheets(1.0)
    front.data.attributes.new("there", 'BOOLEAN', 'POINT').data.foreach_set("value", np.arange(12) % 2 == 0)
    front.data.attributes.new("tint", 'BYTE_COLOR', 'POINT').data.foreach_set(
        "color_srgb", (colors(RED, 51) / np.float32(255)).reshape(-1))
    front.patina.opacity_attribute = "there"
    picture = render()["Combined"]
    for index, point in enumerate(points):
        check_close(picture[pixel(scene, point)][:3], linear(GREEN if index % 2 else RED), 1e-5, "there or not")
    front.patina.opacity_attribute = "tint"
    check_close(render()["Combined"][pixel(scene, points[4])][:3], blended(0.2), 1e-5, "alpha of a colour")
    front.patina.opacity_attribute = "nowhere"
    check_close(render()["Combined"][pixel(scene, points[4])][:3], linear(RED), 2e-6, "no attribute: opaque")
    check(any("no point attribute 'nowhere' to take as opacity" in text for _, text in reports), f"reports {reports}")


def test_layer_passes():
    scene, points, _, _ = two_sheets(0.25)
    scene.view_layers[0].patina.pass_layers = 3
    picture = render()
    names = {f"Layer {number}{kind}" for number in (1, 2, 3) for kind in ("", " Depth", " Normal")}
    check(set(picture) == names | {"Combined", "Depth", "Normal", "Source"}, f"passes {sorted(picture)}")
    place = pixel(scene, points[4])
    check_close(picture["Layer 1"][place], (*0.25 * linear(RED), 0.25), 1e-5, "layer 1")
    check_close(picture["Layer 2"][place], (*linear(GREEN), 1), 1e-5, "layer 2")
    check(not picture["Layer 3"].any() and not picture["Layer 3 Normal"].any(), "layer 3 has nothing")
    check((picture["Layer 3 Depth"] == np.float32(1e10)).all(), "depth of nothing")
    check_close(picture["Layer 1 Depth"][place], 2, 1e-5, "depth of layer 1")
    check_close(picture["Layer 2 Depth"][place], 2 * DEEPER, 1e-4, "depth of layer 2")
    check(np.array_equal(picture["Layer 1 Depth"], picture["Depth"]), "the first layer's depth is the picture's")


def test_layers_of_what_is_opaque():
    scene, points, _, _ = two_sheets(1.0)
    plain = render()["Combined"]
    scene.view_layers[0].patina.pass_layers = 2
    picture = render()
    check(np.array_equal(picture["Combined"], plain), "the picture does not change")
    check_close(picture["Layer 2"][pixel(scene, points[4])][:3], linear(GREEN), 1e-5, "behind an opaque sheet")


def test_more_passes_than_layers():
    scene, points, _, _ = two_sheets(0.25)
    scene.patina.layers = 1
    scene.view_layers[0].patina.pass_layers = 2
    check_close(render()["Layer 2"][pixel(scene, points[4])], (*linear(GREEN), 1), 1e-5, "layer 2 is peeled")


def test_glass_sphere():
    """With every filter: both halves show, closed."""
    scene = dense_scene()
    bpy.context.scene.objects["points"].patina.opacity = 0.5
    picture = render()["Combined"]
    check("2 layers" in stats[-1], f"statistics {stats[-1]!r}")
    check_close(picture[30:42, 42:54, 3], 0.75, 1e-5, "alpha in the middle of the sphere")
    scene.render.film_transparent = False
    over = picture + (1 - picture[..., 3:]) * np.float32((0.2, 0.3, 0.4, 1))
    check_close(render()["Combined"], over, 1e-5, "over the world colour")


def test_estimate_of_layer_distance():
    scene = new_scene()
    x, y = np.meshgrid(np.arange(40) * 0.01, np.arange(40) * 0.01)
    points = np.stack([x.ravel(), y.ravel(), np.full(x.size, -2.0)], 1)
    obj = add_points(points, name="sheet")
    obj.scale = (3, 3, 3)
    render()
    estimate = estimates.layer_distance(obj.name_full)
    check(0.05 < estimate < 0.08, f"two spacings of 0.03 are estimated as {estimate}")
    check(estimates.layer_distance("nobody") is None, "an object that was not drawn")
    bpy.data.objects.remove(obj)
    render()
    check(estimates.layer_distance("sheet") is None, "gone with the object")
    check(patina.ui.panels._length(scene, 0.0032).replace(" ", "") in {"3.2mm", "0.0032m"}, "in the scene's units")
