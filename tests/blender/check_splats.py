# SPDX-License-Identifier: GPL-3.0-or-later
"""Points as discs: the mode, their radii, what the source pass says of them, and how the panel shows them."""

import numpy as np
from check_points import grid, pixel
from harness import add_points, check, check_close, drawn, linear, new_scene, render, reports

COLOR = (200, 60, 40)


def discs(radius=0.0, attribute=None):
    """A grid of points as discs: (scene, points, object). attribute: values of a point attribute "size"."""
    scene = new_scene()
    check(scene.patina.surface == 'AUTO', "discs are a choice")
    points = grid()
    normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    obj = add_points(points, np.tile(np.array((*COLOR, 255), np.uint8), (len(points), 1)), normals)
    scene.patina.surface = 'SPLATS'
    obj.patina.radius = radius
    if attribute is not None:
        obj.data.attributes.new("size", 'FLOAT', 'POINT').data.foreach_set("value", np.asarray(attribute, np.float32))
        obj.patina.radius_attribute = "size"
    return scene, points, obj


def size_of(scene, points, picture):
    """Pixels that each point's disc covers, in the order of the points."""
    covered = np.array(sorted(drawn(picture)))
    places = np.array([pixel(scene, point) for point in points])
    nearest = np.argmin(((covered[:, None] - places[None]) ** 2).sum(2), 1)
    return np.bincount(nearest, minlength=len(points))


def test_radius():
    scene, points, _ = discs(0.1)
    picture = render()
    step = (pixel(scene, points[0] + [1, 0, 0])[1] - pixel(scene, points[0])[1]) * 0.1  # a radius in pixels
    got = size_of(scene, points, picture)
    check(np.all(abs(got - np.pi * step ** 2) <= 0.25 * np.pi * step ** 2), f"pixels {got}, radius {step}")
    for place in drawn(picture):
        check_close(picture["Combined"][place][:3], linear(COLOR), 5e-5, "colour")  # sums are whole numbers
        check_close(picture["Depth"][place], 2, 1e-5, "depth")
    row, column = pixel(scene, points[5])
    check_close(picture["Source"][row, column], 1, 0, "where the point fell")
    check_close(picture["Source"][row, column + 2], 3, 1e-5, "two pixels beside it")


def test_without_radius():
    scene, points, obj = discs()
    obj.data.vertices[0].co = obj.data.vertices[1].co  # their spacing is that of the others still
    scene.patina.surface = 'FILL'
    scene.patina.fill = 'OFF'
    few = len(drawn(render()))
    scene.patina.surface = 'SPLATS'
    check(len(drawn(render())) > 10 * few, "discs as wide as the spacing of the points")


def test_radius_attribute():
    scene, points, obj = discs(attribute=[0.1] * 6 + [0.0] * 6)
    got = size_of(scene, points, render())
    check(np.all(got[:6] > 5) and np.all(got[6:] == 1), f"pixels {got}")
    obj.data.attributes["size"].data.foreach_set("value", np.full(12, 0.1, np.float32))
    obj.data.update()
    got = size_of(scene, points, render())
    check(np.all(got > 5), f"changed radii: pixels {got}")
    obj.patina.radius = 0.01
    check(np.all(size_of(scene, points, render()) <= 2), "one radius for all")
    obj.patina.radius_attribute = "length"
    render()
    check(any("no point attribute 'length'" in text for _, text in reports), f"reports {reports}")


def test_largest_gap():
    """Discs are no wider than the largest gap, whatever their radii."""
    scene, points, obj = discs(0.1)
    narrow = render()["Combined"]
    for radius, attribute in ((0.3, None), (0.0, [0.3] * 12)):
        scene, points, obj = discs(radius, attribute)
        wide = len(drawn(render()))
        obj.patina.largest_gap = 0.2
        check((render()["Combined"] == narrow).all(), f"radius {radius}, radii {attribute}")
        check(wide > 2 * (narrow[..., 3] > 0).sum(), "they were wider before")
        obj.patina.largest_gap = 9.0
        check(len(drawn(render())) == wide, "a gap that none reaches")
    scene, points, obj = discs()  # as wide as their neighborhoods say, and not always round
    wide = len(drawn(render()))
    obj.patina.largest_gap = 0.2
    check(0 < len(drawn(render())) <= (narrow[..., 3] > 0).sum() < wide, "as wide as they are themselves")


def test_blended():
    """Where two discs overlap on one surface, their colours are mixed; a surface behind stays out."""
    scene = new_scene()
    scene.patina.surface = 'SPLATS'
    near = add_points(np.array([[0.0, 0.0, -2.0], [0.1, 0.0, -2.0]]),
                      np.array([[255, 0, 0, 255], [0, 255, 0, 255]], np.uint8), np.tile([0.0, 0.0, 1.0], (2, 1)))
    far = add_points(np.array([[0.05, 0.0, -4.0]]), np.array([[0, 0, 255, 255]], np.uint8), np.array([[0.0, 0.0, 1.0]]))
    near.patina.radius = far.patina.radius = 0.3
    red, green, blue = render()["Combined"][pixel(scene, [0.05, 0.0, -2.0])][:3]
    check(0.3 < red < 0.7 and abs(red + green - 1) < 1e-3 and blue == 0, f"mixed {red}, {green}, {blue}")
