# SPDX-License-Identifier: GPL-3.0-or-later
"""Trust in a window: the image and the histogram in the panel follow the slider."""

import bpy
import numpy as np
from check_trust import BALL, KINDS, STRAYS, places
from harness import add_points, check
from patina.draw import histogram
from patina.sync.analyses import trust
from window import newer, screenshot, settled, setup, shown, whole_window


def _red(color):
    return int(((color[..., 3] > 0) & (color[..., 0] > color[..., 1])).sum())


def _shows_data():
    """Whether the properties editor shows the object's data. It offers them once it has drawn the active object."""
    properties = next(area for area in bpy.context.window.screen.areas if area.type == 'PROPERTIES')
    properties.tag_redraw()
    try:
        properties.spaces[0].context = 'DATA'
    except TypeError:
        return False
    return True


def test_trust_is_live():
    """Strays come and go with the slider; nothing is analyzed or built again. The panel's histogram and figures follow, and the screen shows
    what the image has."""
    scene = setup()
    scene.patina.surface = 'SPLATS'
    positions, colors = places()
    obj = add_points(positions + (0, 0, 4), colors)
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    obj.patina.lighting = 'UNLIT'
    if 'POINTCLOUD' in KINDS:
        bpy.ops.object.patina_to_point_cloud()
        obj = bpy.context.view_layer.objects.active
        obj.patina.lighting = 'UNLIT'
    yield _shows_data
    yield lambda: settled(BALL + STRAYS) and shown().shown.clouds[0].cloud.has_shapes
    found = shown()
    built = found.shown.clouds[0].cloud
    automatic, out = _red(found.shown.color), found.shown.stats["untrusted"]
    check(out >= 0.8 * STRAYS and trust.left_out(built, 0.0) == out, f"{out} are left out")

    def painted():
        """Where the line stands in the histogram; None while that is not painted."""
        known = histogram.trust_of(obj)
        level = trust.level_from(known.cloud(), trust.least_of(obj.patina)) if known else 0
        if known is None or not histogram.trust_icon(obj, known, level) or \
                histogram._painted.get(histogram._trust_title(obj.name)) != (known.stamp, level):
            return None
        image = histogram.pixels(obj, histogram._trust_title)
        return int(np.flatnonzero((np.abs(image - histogram._LINE).max(-1) < 0.01).all(0)).max()) // (histogram.SIZE // trust.LEVELS)

    yield lambda: painted() == trust.level_from(built, 0.0)
    whole_window("trust-automatic")
    seen = []
    for least in (0.0, 0.3, 0.9, -1.0):
        before = found.pictures
        obj.patina.least_trust = least
        yield lambda: newer(before)() and settled(BALL + STRAYS)
        check(found.shown.clouds[0].cloud is built, "built again")
        check(found.shown.stats["untrusted"] == trust.left_out(built, trust.least_of(obj.patina)), f"figures at {least}")
        yield lambda: painted() == trust.level_from(built, trust.least_of(obj.patina))
        seen.append(_red(found.shown.color))
        if least == 0.0:
            pixels = screenshot("trust-0")
            whole_window("trust-all")
            check(((pixels[..., 0] > 0.8) & (pixels[..., 1] < 0.2)).sum() > 15, "red points are on the screen")
    check(seen[0] > 15 and seen[3] == automatic < 0.2 * seen[0], f"red pixels: {automatic}, {seen}")
    check(seen[0] >= seen[1] >= seen[2], f"red pixels: {seen}")


def test_none_trusted_is_said():
    """In the view's notices, which Statistics shows, until the threshold is lower."""
    setup().patina.surface = 'FILL'
    obj = add_points(np.random.default_rng(2).uniform(-1.0, 1.0, (300, 3)))
    obj.patina.least_trust = 0.0
    yield lambda: settled(300) and shown().shown.clouds[0].cloud.has_shapes
    found = shown()
    check(not any("no point is trusted" in text for text in found.notices), f"{found.notices}")
    counts = np.array(found.shown.clouds[0].cloud.trusts)
    before = found.pictures
    obj.patina.least_trust = trust.of_level(int(np.flatnonzero(counts).max()) + 1)
    yield lambda: newer(before)() and settled(300)
    check(sum("no point is trusted" in text for text in found.notices) == 1, f"{found.notices}")
    check(found.shown.stats["none_trusted"] == 300 and found.shown.stats["untrusted"] == 0, "figures")
    before = found.pictures
    obj.patina.least_trust = 0.0
    yield lambda: newer(before)() and settled(300)
    check(not any("no point is trusted" in text for text in found.notices), f"{found.notices}")
