# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures of a viewport that orbits many points; for tests/bench/window.py, which runs

    xvfb-run -a -s "-screen 0 1280x800x24" blender --factory-startup --python tests/blender/test_window.py -- figures

PATINA_FIGURES_POINTS says how many. The last line but one of what it prints is JSON. What Blender takes for its window and
what Patina takes are told apart, for under Xvfb both run on the same cores.
"""

import json
import os
import time
from statistics import median

import gpu
import numpy as np
from check_viewport import settled, setup, shown, view, window_region
from harness import add_points
from mathutils import Quaternion

from patina import viewport

SECONDS = 6.0  # of each kind of motion


def turn(since):
    """A radian a second."""
    view().view_rotation = Quaternion((0, 1, 0), time.perf_counter() - since)


def moving(seconds):
    """Turns the view at each of Blender's steps."""
    start = time.perf_counter()
    while time.perf_counter() - start < seconds:
        turn(start)
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


def orbit_figures():
    scene = setup()
    scene.patina.fill = 'CLOSED'
    count = int(os.environ.get("PATINA_FIGURES_POINTS", "10000000"))
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(count, 3)).astype(np.float32)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    add_points(directions * 1.5, None, directions)
    yield lambda: settled(count)
    found, region = shown(), window_region()
    figures = {"points": count, "width": region.width, "height": region.height}

    # as it is
    draws, begun = Timed(viewport.Viewport, "draw"), found.pictures
    works = {}
    for condition in moving(SECONDS):
        yield condition
        works[found.pictures] = found.shown.stats["ms"]
    stopped = time.perf_counter()
    draws.restore()
    figures |= {"shown_a_second": (found.pictures - begun) / SECONDS, "redraws_a_second": len(draws.calls) / SECONDS,
                "work_ms": median(works.values()), "longest_ms": 1e3 * max(draws.calls)}
    level = found.pace.level
    yield lambda: settled(count)
    figures |= {"rest_s": time.perf_counter() - stopped, "strata": level.strata, "shrink": level.shrink}

    # Patina alone
    figures["delivered_a_second"], busy = delivered(found, SECONDS)
    figures["busy_ms"] = 1e3 * busy
    yield lambda: settled(count)

    # what is done of it on the GPU, each waited for, while no picture is made
    pictures = Timed(viewport.Viewport, "_draw_picture", finish_drawing)
    uploads = Timed(viewport, "_upload", finish_drawing)
    ask, viewport.Viewport._ask = viewport.Viewport._ask, lambda self, level: None
    for condition in moving(SECONDS):
        yield condition
        found._drawn = None  # uploaded anew each time
    viewport.Viewport._ask = ask
    pictures.restore()
    uploads.restore()
    turn(0.0)
    figures |= {"upload_ms": 1e3 * median(uploads.calls), "draw_ms": 1e3 * (median(pictures.calls) - median(uploads.calls))}
    yield lambda: settled(count)

    # Blender alone
    draw, redraws = viewport.Viewport.draw, []
    viewport.Viewport.draw = lambda self, context, depsgraph: redraws.append(0) or ""
    yield from moving(SECONDS)
    viewport.Viewport.draw = draw
    figures["bare_redraws_a_second"] = len(redraws) / SECONDS
    print(json.dumps(figures), flush=True)
