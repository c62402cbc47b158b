# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples in a window: a viewport at rest betters its picture, moving begins again; F12 shows each step."""

import threading
import time

import bpy
import numpy as np
from harness import _rect, add_points, check, render, sphere
from mathutils import Quaternion
from patina.draw import engine, passes, viewport
from patina.draw import render as drawing
from window import area, screenshot, settled, setup, shown, view, window_region


def scene_of(samples, count=40000):
    scene = setup()
    settings = scene.patina
    settings.fill, settings.smooth, settings.antialias, settings.surface = 'CLOSED', 'ALLEVIATED', 'LAYERS', 'FILL'
    scene.render.film_transparent = False
    settings.viewport_samples = samples
    positions, colors, normals = sphere(count, 1.5, (0, 0, 0))
    add_points(positions, colors, normals)
    return scene


class watching:
    """Every picture that viewports finish meanwhile, and how long Blender waited for the timer each time."""

    def __init__(self):
        self.pictures, self.waits = [], []

    def __enter__(self):
        self._advance, self._tick, self._better = viewport.Viewport.advance, viewport._work, viewport.BETTER
        viewport.BETTER = 0.0

        def advance(found, until):
            before = found.shown
            done = self._advance(found, until)
            if found.shown is not before:
                self.pictures.append(found.shown)
            return done

        def work(until):
            start = time.perf_counter()
            self._tick(until)
            self.waits.append(time.perf_counter() - start)

        viewport.Viewport.advance, viewport._work = advance, work
        return self

    def __exit__(self, *_):
        viewport.Viewport.advance, viewport._work, viewport.BETTER = self._advance, self._tick, self._better


def at_end(count):
    return lambda: settled(count) and not shown().shown.stats["pixel_pending"]


def test_betters_at_rest():
    """Each picture has more samples than the one before, and is nearer to the last; that is the final render's, and on screen."""
    scene = scene_of(24)
    view().view_rotation = Quaternion((0.8, 0.3, 0.4, 0.2)).normalized()
    with watching() as seen:
        yield at_end(40000)
        steps = [picture for picture in seen.pictures if picture.wish is shown().shown.wish]
    counts = [picture.stats["pixel_samples"] for picture in steps]
    check(counts[0] == 1 and counts[-1] >= 20 and len(counts) > 4 and counts == sorted(counts), f"{counts}")
    last = steps[-1].color
    off = [float(np.square(picture.color - last).sum()) for picture in steps]
    check(off[1] < 0.8 * off[0] and off[-2] < 0.1 * off[0], f"{off}")
    check(shown()._status().endswith(f"{counts[-1]} samples"), shown()._status())
    check(all(picture.depth is steps[0].depth for picture in steps), "depth is that of one sample")
    on_screen = screenshot("bettered")[..., :3]
    wanted = np.clip(last[..., :3], 0, 1)
    wanted = np.where(wanted <= 0.0031308, 12.92 * wanted, 1.055 * wanted ** (1 / 2.4) - 0.055)
    off = abs(on_screen - wanted).max(axis=2)[last[..., :3].max(axis=2) > 0]  # Blender's own stands beside
    check(off.size > 50000 and off.max() < 0.02, f"the screen is off by {off.max():.3f}")
    region, camera, space = window_region(), scene.camera, area().spaces[0]
    scene.render.resolution_x, scene.render.resolution_y = region.width, region.height
    camera.matrix_world = view().view_matrix.inverted()
    camera.data.lens, camera.data.sensor_width = space.lens, 72.0
    camera.data.clip_start, camera.data.clip_end = space.clip_start, space.clip_end
    scene.patina.samples = 24
    final = render()["Combined"]
    check((np.abs(final - last).max(axis=2) > 0.02).mean() < 0.002, "the final render differs")


def test_moving_begins_again():
    """A view that moves shows its first sample at once, and betters again at rest; Blender waits for no sample."""
    scene_of(1024)
    yield lambda: settled(40000) and shown().shown.stats["pixel_samples"] > 2
    with watching() as seen:
        for step in range(3):
            before, turned = len(seen.pictures), time.monotonic()
            view().view_rotation = Quaternion((0, 1, 0), 0.2 * (step + 1))
            area().tag_redraw()
            yield lambda: settled(40000) and shown().shown.stats["pixel_samples"] > 2
            new = [picture for picture in seen.pictures[before:] if picture.wish is shown().shown.wish]
            check(new[0].first and new[0].stats["pixel_samples"] == 1, f"{new[0].stats['pixel_samples']} samples at first")
            check(time.monotonic() - turned < 30.0, "late")
    longest = sorted(seen.waits)[-3:]
    check(longest[0] < 0.5, f"Blender waited {longest} s")  # two times others may have held it up
    bpy.context.scene.patina.viewport_samples = 1
    bpy.context.scene.update_tag()  # as its button does
    yield at_end(40000)
    check(shown().shown.stats["pixel_samples"] == 1, "one sample is asked for")


def test_noise_ends_it():
    scene = scene_of(1)
    scene.patina.viewport_noise = 0.02
    yield at_end(40000)
    stats = shown().shown.stats
    check(4 <= stats["pixel_samples"] <= 256 and 0 < stats["pixel_error"] <= 0.02, f"{stats}")


def test_holdout_betters():
    """A picture that is made of several."""
    scene_of(12)
    hole = add_points(*sphere(20000, 0.5, (0, 0, 1.5)))
    hole.is_holdout = True
    with watching() as seen:
        yield at_end(60000)
    counts = [picture.stats["pixel_samples"] for picture in seen.pictures if picture.wish is shown().shown.wish]
    check(counts[0] == 1 and counts[-1] >= 9, f"{counts}")
    color = shown().shown.color
    height, width = color.shape[:2]
    check(color[height // 2, width // 2, 3] < 0.01 and color[height // 2, width // 2 + width // 12, 3] > 0.9, "the hole")


def test_final_shows_each_step():
    """F12 in a window: Blender's own picture betters while it is drawn, and Esc keeps it."""
    scene = scene_of(1)
    scene.camera.location = (0, 0, 6)
    scene.render.resolution_x, scene.render.resolution_y = 320, 240
    scene.patina.samples = 1024
    held, ended = [], []  # what Blender has

    def blenders(asked):
        result = asked.get_result()
        item = next(item for item in result.layers[0].passes if item.name == "Combined")
        return _rect(item, result.resolution_y, result.resolution_x)

    # Blender keeps one flag for all threads of whether Python may write, and a call sets it back to what it was when it
    # began. A final render that begins while a panel is drawn leaves it at "may not" for good: nothing is drawn till ours began.
    begun = threading.Event()
    put, stopped, write = passes.Shown.put, engine.PatinaRenderEngine._stopped, passes.write
    every = drawing.SHOWN_EVERY
    # without a window of its own: Blender 3.4 crashes when the scene that one shows is removed
    bpy.context.preferences.view.render_display_type = 'NONE'
    drawing.SHOWN_EVERY = 0.0

    def watch(self, described, planes, show=True):
        put(self, described, planes, show)
        if show:
            held.append((planes["COMBINED"], blenders(self._engine)))

    def finish(*arguments, **keywords):
        write(*arguments, **keywords)
        ended.append((arguments[3]["COMBINED"], blenders(arguments[0])))

    passes.Shown.put, passes.write = watch, finish
    engine.PatinaRenderEngine._stopped = lambda self: begun.set() or len(held) >= 5
    try:
        check(bpy.ops.render.render('INVOKE_DEFAULT') == {'RUNNING_MODAL'}, "Blender does not render")
        check(begun.wait(30.0), "the render does not begin")
        yield lambda: ended and not bpy.app.is_job_running('RENDER') if hasattr(bpy.app, "is_job_running") else ended
    finally:
        passes.Shown.put, engine.PatinaRenderEngine._stopped, passes.write = put, stopped, write
        drawing.SHOWN_EVERY = every
    check(len(held) >= 5, f"{len(held)} pictures")
    check(all((ours == its).all() for ours, its in [*held, *ended]), "Blender has another picture")
    off = [float(np.square(picture - ended[0][1]).sum()) for _, picture in held]
    check(off[0] > 0 and off[1] < off[0] and off[3] < 0.7 * off[0], f"{off}")
