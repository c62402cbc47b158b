# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures of a viewport that orbits many points; for tests/bench/window.py, which runs

    xvfb-run -a -s "-screen 0 1280x800x24" blender --enable-event-simulate --factory-startup \\
        --python tests/blender/test_window.py -- figures

PATINA_FIGURES_POINTS says how many, of a ball; PATINA_FIGURES_FILE a saved cloud that is linked instead, and seen from above. The last line but one of what it prints is JSON. What Blender takes for its window and
what Patina takes are told apart, for under Xvfb both run on the same cores.

The view is orbited as a user does it, with the middle mouse button: Blender then redraws the view alone. A script that turns
it through its properties has all of Blender's editors redrawn.
"""

import json
import os
import time
from pathlib import Path
from statistics import median, mode

import gpu
import numpy as np
from harness import add_points
from mathutils import Quaternion
from patina.draw import canvas, viewport
from window import area, invoke_import, settled, setup, shown, view, window_region

SECONDS = 6.0  # of each kind of motion


SPEED = 143.0  # pixels that the mouse moves in a second: about a radian


def turn(since):
    """A radian a second."""
    view().view_rotation = Quaternion((0, 1, 0), time.perf_counter() - since)


def orbit(seconds):
    """Drags with the middle mouse button, to and fro across a third of the view, at each of Blender's steps. orbit.moved is
    when it did last."""
    window, region = viewport.bpy.context.window_manager.windows[0], window_region()
    reach, x, y = region.width / 3, region.x + region.width // 3, region.y + region.height // 2

    def mouse(kind, value, across=0.0):
        window.event_simulate(type=kind, value=value, x=x + round(across), y=y)

    mouse('MOUSEMOVE', 'NOTHING')
    yield lambda: True
    mouse('MIDDLEMOUSE', 'PRESS')
    yield lambda: True
    start = time.perf_counter()
    while (passed := time.perf_counter() - start) < seconds:
        across = reach - abs(SPEED * passed % (2 * reach) - reach)
        mouse('MOUSEMOVE', 'NOTHING', across)
        orbit.moved = time.perf_counter()
        yield lambda: True
    mouse('MIDDLEMOUSE', 'RELEASE', across)
    yield lambda: True


class Timed:
    """Stands in for a function of an object and keeps how long its calls took, in seconds."""

    def __init__(self, owner, name, finish=lambda: None):
        self._owner, self._name, self._call, self.calls = owner, name, getattr(owner, name), []

        def timed(*arguments):
            finish()  # what was asked of the GPU before is not its work
            start = time.perf_counter()
            result = self._call(*arguments)
            finish()
            self.calls.append(time.perf_counter() - start)
            return result

        setattr(owner, name, timed)

    def restore(self):
        setattr(self._owner, self._name, self._call)


def processor():
    """Seconds that Blender's process has kept the processor's cores busy, all of them together."""
    times = os.times()
    return times.user + times.system


def finish_drawing():
    """Waits for all that was asked of the GPU: a pixel cannot be read before."""
    gpu.state.active_framebuffer_get().read_color(0, 0, 1, 1, 4, 0, 'FLOAT')


def delivered(found, seconds):
    """Pictures of a moving view one after the other, without any of Blender's redraws between them: their number, and for
    how long Blender's thread was busy with each."""
    start = time.perf_counter()
    pictures, busy = found.pictures, 0.0
    region, space = window_region(), viewport.bpy.context.window.screen.areas
    space = next(area.spaces[0] for area in space if area.type == 'VIEW_3D')
    while time.perf_counter() - start < seconds:
        turn(start)
        view().update()
        begin, wanted = time.perf_counter(), found.pictures + 1
        found._view = viewport.sync.viewport_view(region, space, view(), viewport.bpy.context.scene)
        found._ask(found.pace.level)
        while found.pictures < wanted:
            viewport._work(0.0)
            busy += time.perf_counter() - begin
            time.sleep(0.0005)
            begin = time.perf_counter()
    count = found.pictures - pictures
    return count / (time.perf_counter() - start), busy / count


def ball(count):
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(count, 3)).astype(np.float32)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    add_points(directions * 1.5, None, directions)


def link(path):
    """A saved cloud, framed and seen from above."""
    view().view_rotation = Quaternion((1, 0, 0), 0.9)
    area().spaces[0].clip_end = 1e5
    invoke_import(Path(path), link=True, frame=True)


def orbit_figures():
    scene = setup()
    path, count = os.environ.get("PATINA_FIGURES_FILE"), int(os.environ.get("PATINA_FIGURES_POINTS", "10000000"))
    if path:
        link(path)
        yield lambda: (found := shown()) is not None and found.shown.stats["points"] > 0
        count = shown().shown.stats["points"]
    else:
        scene.patina.fill = 'CLOSED'
        ball(count)
    yield lambda: settled(count)
    found, region = shown(), window_region()
    figures = {"points": count, "width": region.width, "height": region.height,
               "transform": scene.view_settings.view_transform}

    # as it is
    draws, uploads = Timed(viewport.Viewport, "draw"), Timed(viewport, "_upload")
    works, levels, used = {}, {}, processor()
    for condition in orbit(SECONDS):
        yield condition
        works[found.pictures], levels[found.pictures] = found.shown.stats["ms"], found.shown.wish.level
    moved, used = orbit.moved, processor() - used
    draws.restore()
    uploads.restore()
    figures |= {"shown_a_second": len(uploads.calls) / SECONDS, "redraws_a_second": len(draws.calls) / SECONDS,
                "processor_ms": 1e3 * used / len(uploads.calls), "work_ms": median(works.values()),
                "longest_ms": 1e3 * max(draws.calls)}
    yield lambda: settled(count)
    level = mode(levels.values())
    figures |= {"rest_s": time.perf_counter() - moved, "strata": level.strata, "shrink": level.shrink,
                "whole_ms": found.shown.stats["ms"]}

    # Blender alone
    draw, redraws = viewport.Viewport.draw, []
    viewport.Viewport.draw = lambda self, context, depsgraph: redraws.append(0) or ""
    used = processor()
    yield from orbit(SECONDS)
    used = processor() - used
    viewport.Viewport.draw = draw
    figures |= {"bare_redraws_a_second": len(redraws) / SECONDS, "bare_processor_ms": 1e3 * used / len(redraws)}
    area().tag_redraw()
    yield lambda: settled(count)

    # without what Blender does in each redraw for the lines of overlays, hidden or not
    system = viewport.bpy.context.preferences.system
    system.use_overlay_smooth_wire = False
    uploads = Timed(viewport, "_upload")
    yield from orbit(SECONDS)
    uploads.restore()
    system.use_overlay_smooth_wire = True
    figures["rough_shown_a_second"] = len(uploads.calls) / SECONDS
    yield lambda: settled(count)

    # Patina alone
    figures["delivered_a_second"], busy = delivered(found, SECONDS)
    figures["busy_ms"] = 1e3 * busy
    yield lambda: settled(count)

    # what is done of it on the GPU, each waited for, while no picture is made
    pictures = Timed(viewport.Viewport, "_draw_picture", finish_drawing)
    uploads = Timed(canvas, "_upload", finish_drawing)
    ask, viewport.Viewport._ask = viewport.Viewport._ask, lambda self, level: None
    for condition in orbit(SECONDS):
        yield condition
        found.canvas.drawn = None  # uploaded anew each time
    viewport.Viewport._ask = ask
    pictures.restore()
    uploads.restore()
    figures |= {"upload_ms": 1e3 * median(uploads.calls), "draw_ms": 1e3 * (median(pictures.calls) - median(uploads.calls))}
    print(json.dumps(figures), flush=True)
