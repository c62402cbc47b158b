# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples of final pictures as they come: shown from the first one on, kept when Esc ends them, ended by a noise threshold."""

import re
import threading

import numpy as np
from check_motion import stage
from harness import add_points, check, new_scene, render, reports, sphere, stats
from patina import jobs
from patina.draw import engine
from patina.draw import render as drawing

_described: list[tuple] = []


def scene_of(samples, width=96, height=72):
    scene = new_scene(width, height)
    scene.patina.fill, scene.patina.surface = 'CLOSED', 'FILL'
    scene.patina.samples = samples
    add_points(*sphere(6000))
    return scene


def taken():
    """How many samples the last picture says that it has, at the most."""
    found = re.search(r"([\d,]+) (of [\d,]+ )?samples", stats[-1])
    return int(found[1].replace(",", "")) if found else 1


def stopped_when(condition):
    """The pictures of a render whose artist presses Esc then, and Blender's own pixels."""
    stopped, engine.PatinaRenderEngine._stopped = engine.PatinaRenderEngine._stopped, lambda self: condition()
    try:
        return render()
    finally:
        engine.PatinaRenderEngine._stopped = stopped


def shown_steps(wanted=("COMBINED", "DEPTH")):
    """What draw() shows of the scene's picture, and the picture."""
    draw, found = drawing.draw, []

    def watch(description, planes, poll, tile_size, _show):
        every, drawing.SHOWN_EVERY, drawing.SHOWN_SHARE, drawing.STEP = drawing.SHOWN_EVERY, 0.0, 0.0, 0.0
        try:
            return draw(description, planes, poll, tile_size, lambda shown: found.append(dict(shown)))
        finally:
            drawing.SHOWN_EVERY, drawing.SHOWN_SHARE, drawing.STEP = every, 10.0, 100.0

    drawing.draw = watch
    try:
        return found, render()
    finally:
        drawing.draw = draw


def test_shown_from_the_first_on():
    """The first picture that is shown is that of one sample, with all its planes; later ones are nearer to the last."""
    scene = scene_of(1600)  # enough to be looked at a few times, on a busy machine too
    found, last = shown_steps()
    check(len(found) > 3, f"{len(found)} pictures were shown")
    check({"COMBINED", "DEPTH"} <= set(found[0]) and all(set(planes) == {"COMBINED"} for planes in found[1:]),
          f"{[set(planes) for planes in found[:3]]}")
    off = [float(np.square(planes["COMBINED"] - last["Combined"]).sum()) for planes in found]
    check(off[0] > 0 and off[1] < 0.8 * off[0] and off[-1] < 0.2 * off[0], f"{off}")
    scene.patina.samples = 1
    one = render()
    check((found[0]["COMBINED"] == one["Combined"]).all(), "the first picture is not that of one sample")
    check((last["Depth"] == one["Depth"]).all(), "depth is that of one sample")


def test_a_new_scene_takes_four():
    """Four samples by default are nearer to 64 than one is. With a noise threshold, the default is no maximum."""
    def picture(samples=None, noise=0.0):
        scene = scene_of(1 if samples is None else samples)
        if samples is None:
            scene.patina.property_unset("samples")
        scene.patina.noise = noise
        return render()["Combined"]
    one, four, many, new = picture(1), picture(4), picture(64), picture()
    check((new == four).all() and "4 samples" in stats[-1], stats[-1])
    errors = [float(np.square(found - many).mean()) ** 0.5 for found in (one, new)]
    check(0.0 < errors[1] < 0.75 * errors[0], f"errors of 1 and 4 samples: {errors}")
    picture(noise=0.001)
    check(" 4 samples" not in stats[-1], f"the default is a maximum: {stats[-1]}")


def test_steps_are_one_go():
    """Tiles, which are made at one go, have the same pixels."""
    scene = scene_of(12)
    whole = render()
    check(taken() > 8, stats[-1])
    scene.patina.tile_size = 40
    tiled = render()
    for name, pixels in whole.items():
        check((pixels == tiled[name]).all(), f"{name} differs")


def test_esc_keeps_the_picture():
    """What there is when Esc comes is written, with its other passes; nothing is told as an error."""
    scene = scene_of(1)
    one = render()
    scene.patina.samples = 1024
    calls = []
    kept = stopped_when(lambda: calls.append(1) or len(calls) > 12)
    check(kept, "nothing was written")
    check("stopped" in stats[-1] and 1 <= taken() < 1024, stats[-1])
    check(any(kind == 'INFO' and "stopped" in text for kind, text in reports), f"{reports}")
    check(taken() > 1, f"{stats[-1]}: nothing came after the first sample")
    check((kept["Depth"] == one["Depth"]).all(), "depth is that of one sample")
    soft = [((picture["Combined"][..., 3] > 0.01) & (picture["Combined"][..., 3] < 0.99)).sum() for picture in (one, kept)]
    check(soft[1] > soft[0] + 40, f"{soft} soft pixels with one sample and with those that were kept")
    check(not any(kind == 'ERROR' for kind, _ in reports), f"{reports}")
    scene.patina.samples = 4
    check(render() and "stopped" not in stats[-1], "the next render is whole")


def test_esc_tells_the_samples():
    """How many there are of how many, where one alone was taken too, and which tiles have; while it goes on, its share."""
    scene = scene_of(1024)
    stats.clear()
    stopped_when(lambda: any(text.startswith("Rendering, ") for text in stats))
    check(re.search(r" [\d,]+ of 1,024 samples, stopped", stats[-1]), stats[-1])
    check(any(re.fullmatch(r"Rendering, \d+% of 1,024 samples", text) for text in stats), f"{stats}")
    scene.patina.surface, scene.patina.samples = 'SPLATS', 1024
    better = drawing.native.Frame.refine

    def never(*_):
        raise drawing.native.PatinaCancelled("cancelled", drawing.native.CANCELLED)

    drawing.native.Frame.refine = never
    try:
        render()
        check(stats[-1].endswith("1 of 1,024 samples, stopped"), stats[-1])
        scene.patina.samples, scene.patina.noise = 1, 0.01
        render()
        check(stats[-1].endswith(" 1 sample, stopped"), stats[-1])
    finally:
        drawing.native.Frame.refine = better
    scene.patina.surface, scene.patina.samples, scene.patina.noise = 'FILL', 100, 0.0
    render()
    check(stats[-1].endswith("100 samples"), f"a whole one: {stats[-1]}")


def test_esc_between_two_steps():
    """Each step of the samples begins anew, so that an Esc between two of them was heard by none."""
    heard = threading.Event()

    def work():
        for _ in range(400):
            heard.clear()
            if heard.wait(0.05):
                return True
        return False

    asked = []

    def cancel():
        asked.append(1)
        if len(asked) > 1:  # the first comes between two steps
            heard.set()

    check(jobs.run(work, cancel, lambda: True), "it went on to its end")


def test_esc_keeps_moments():
    """With motion blur the moments that there are make the picture."""
    scene = stage()
    scene.patina.motion_steps = 400
    calls = []
    kept = stopped_when(lambda: calls.append(1) or len(calls) > 40)
    check(kept and re.search(r" \d+ of \d+ samples, stopped", stats[-1]), f"{stats[-1]}")
    check(scene.frame_current == 1 and scene.frame_subframe == 0.0, "the frame is the artist's again")
    total = kept["Combined"][..., 3].sum()
    check(abs(total / 64.0 - 1.0) < 0.01, f"the tile covers {total:.2f} of 64 pixels")


def test_noise_threshold():
    """As many samples as it takes; Samples are the most."""
    scene = scene_of(1)
    counts = []
    for noise in (0.05, 0.01):
        scene.patina.noise = noise
        check(render(), "nothing was drawn")
        counts.append(taken())
    check(4 <= counts[0] < counts[1] <= 256, f"{counts}")
    scene.patina.samples = 6
    scene.patina.noise = 0.0001
    render()
    check(taken() <= 6, stats[-1])
    scene.patina.noise = 0.0
    scene.patina.samples = 1
    render()
    check("samples" not in stats[-1], stats[-1])


def test_holdouts_sample_by_sample():
    """A picture that is made of several betters as a whole: a hole stays a hole, with soft borders."""
    scene_of(200)
    hole = add_points(*sphere(6000, 0.4, (0.3, 0, -2.5)))
    hole.is_holdout = True
    found, last = shown_steps()
    check(len(found) > 2, f"{len(found)} pictures were shown")
    alpha = last["Combined"][..., 3]
    check(alpha.max() > 0.99 and ((alpha > 0.05) & (alpha < 0.95)).sum() > 60, "soft borders")
    held = [float(planes["COMBINED"][30:42, 54:60, 3].max()) for planes in found]
    check(max(held) < 0.02, f"something stands in the hole: {held}")


def betters(found, last, one):
    """Shown from one sample on, nearer to the last by and by; all planes come first."""
    check(len(found) > 2, f"{len(found)} pictures were shown")
    check({"COMBINED", "DEPTH"} <= set(found[0]) and all(set(planes) == {"COMBINED"} for planes in found[1:]), "planes")
    check((last["Depth"] == one["Depth"]).all(), "depth is that of one sample")
    check(taken() > 1 and "stopped" not in stats[-1], stats[-1])


def test_tiles_sample_by_sample():
    """A picture in tiles: one sample of each first, and then better tile by tile, to the pixels of the whole picture."""
    scene = scene_of(1)
    one = render()
    scene.patina.samples = 300
    whole = render()
    scene.patina.tile_size = 40
    found, last = shown_steps()
    check((last["Combined"] == whole["Combined"]).all(), "the tiles are not the whole picture")
    betters(found, last, one)


def test_panoramas_sample_by_sample():
    """All around: six faces of one sample each first, joined, and then face by face better."""
    from check_panorama import stage as around
    pictures = []
    for samples in (1, 300):
        scene = around(256, 128)
        scene.patina.fill, scene.patina.surface, scene.patina.samples = 'CLOSED', 'FILL', samples
        add_points(*sphere(6000, 1.0, (3.0, 2.0, 1.0)))
        found, last = shown_steps()
        pictures.append(last)
    betters(found, last, pictures[0])
    soft = [((picture["Combined"][..., 3] > 0.01) & (picture["Combined"][..., 3] < 0.99)).sum() for picture in pictures]
    check(soft[1] > soft[0] + 20, f"{soft} soft pixels with one sample and many")
    again = render()  # in the background nobody looks: at one go
    check((again["Combined"] == last["Combined"]).all(), "at one go it is another picture")


def test_esc_keeps_tiles():
    """Esc in the midst of the tiles: those that are done are soft, the others have one sample; none is missing."""
    scene = scene_of(1)
    one = render()
    scene.patina.samples, scene.patina.tile_size = 1024, 40
    seen = []
    draw, kept = drawing.draw, []

    def watch(description, planes, poll, tile_size, _show):
        return draw(description, planes, poll, tile_size, lambda shown: seen.append(shown))

    drawing.draw = watch
    try:
        kept = stopped_when(lambda: len(seen) > 1)
    finally:
        drawing.draw = draw
    check(kept and "stopped" in stats[-1], stats[-1])
    check(re.search(r" 1 to [\d,]+ of 1,024 samples", stats[-1]), stats[-1])
    check(((kept["Combined"][..., 3] > 0) == (one["Combined"][..., 3] > 0)).mean() > 0.97, "the points are there")
    check((kept["Combined"] != one["Combined"]).any() and (kept["Depth"] == one["Depth"]).all(), "nothing is better than one sample")


def test_noise_threshold_in_tiles():
    """Each tile takes as many as it needs."""
    scene = scene_of(1)
    scene.patina.tile_size, scene.patina.noise = 40, 0.02
    found, last = shown_steps()
    check(found and 4 <= taken() <= 256, stats[-1])
    again = render()
    check((again["Combined"] == last["Combined"]).all(), "at one go it is another picture")
