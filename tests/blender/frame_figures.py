# SPDX-License-Identifier: GPL-3.0-or-later
"""What a frame of an orbit takes in Blender's window, and where it goes; for tests/bench/window.py, which runs

    xvfb-run -a -s "-screen 0 1280x800x24" blender --enable-event-simulate --factory-startup \\
        --python tests/blender/test_window.py -- frames

PATINA_FIGURES_POINTS says how many points, of a ball: a PointCloud where this Blender imports such, else a mesh. PATINA_FIGURES_SECONDS
says how long each orbit takes. The middle mouse button drags. Times are processor times of all threads of Blender's process, because other
programs disturb the clock more. Whole redraws are measured by the clock too. The last line but one of the output is JSON.
"""

import json
import os
import time
from statistics import median

import harness
from figures import ball, finish_drawing, orbit
from patina import point_data
from patina.draw import overlays, painting, viewport
from patina.sync.analyses import analyzing
from window import area, settled, setup, shown, window_region

SECONDS = float(os.environ.get("PATINA_FIGURES_SECONDS", "6"))  # of each orbit


class Worked:
    """Stands in for a function of an object and keeps what processor time its calls took, in seconds. waits: for the GPU, before and after."""

    def __init__(self, owner, name, waits=True):
        self._owner, self._name, self._call, self.calls = owner, name, getattr(owner, name), []

        def timed(*arguments, **options):
            if waits:
                finish_drawing()
            start = time.process_time()
            result = self._call(*arguments, **options)
            if waits:
                finish_drawing()
            self.calls.append(time.process_time() - start)
            return result

        setattr(owner, name, timed)

    def ms(self):
        """The middle one; 0 if it was never called."""
        setattr(self._owner, self._name, self._call)
        return 1e3 * median(self.calls) if self.calls else 0.0


def orbited(seconds):
    """Drags. Returns {"redraws", "ms", "clock_ms"}: processor time and clock time of one redraw, all included."""
    redraws, draw = [], viewport.Viewport.draw

    def counted(self, *arguments):
        redraws.append(0)
        return draw(self, *arguments)

    viewport.Viewport.draw = counted
    start, clock = time.process_time(), time.perf_counter()
    yield from orbit(seconds)
    viewport.Viewport.draw = draw
    count = max(len(redraws), 1)
    return {"redraws": len(redraws), "ms": 1e3 * (time.process_time() - start) / count, "clock_ms": 1e3 * (time.perf_counter() - clock) / count}


def frame_figures():
    count = int(os.environ.get("PATINA_FIGURES_POINTS", "10000000"))
    analyzing.BESIDE = os.cpu_count()  # not measured, and no one works in this window meanwhile
    harness.kind = 'POINTCLOUD' if point_data.HAS_CLOUDS else 'MESH'
    scene = setup(overlays=True)
    scene.patina.fill = 'CLOSED'
    ball(count)
    for obj in scene.objects:
        point_data.spare_spheres(obj)  # as an import does
    figures = {"points": count, "kind": harness.kind}
    for name, visible in (("hidden", False), ("shown", True)):
        area().spaces[0].overlay.show_overlays = visible
        yield lambda: settled(count)
        yield from measured(figures, name, count)
    region = window_region()
    figures |= {"width": region.width, "height": region.height}
    print(json.dumps(figures), flush=True)


def measured(figures, name, count):
    """Adds to the figures, with overlays hidden or shown."""
    found = shown()
    pictures = found.pictures
    whole = yield from orbited(SECONDS)
    yield lambda: settled(count)
    figures[name] = {"whole_ms": whole["ms"], "whole_clock_ms": whole["clock_ms"], "redraws": whole["redraws"], "pictures": found.pictures - pictures}

    # no new image: the last one is uploaded and drawn each time
    ask, viewport.Viewport._ask = viewport.Viewport._ask, lambda self, level, detail=0.0: None
    for condition in _each(found, orbited(SECONDS), figures[name], "shown_ms"):
        yield condition
    uploads, covers = Worked(viewport, "_upload"), Worked(painting, "covering", waits=False)
    draws, after = Worked(viewport.Viewport, "_draw_picture"), Worked(viewport.Viewport, "_finish_overlays")
    for condition in _each(found, orbited(SECONDS), figures[name], "timed_ms"):
        yield condition
    parts = {"upload_ms": uploads.ms(), "cover_ms": covers.ms(), "draw_ms": draws.ms(), "after_ms": after.ms()}
    parts["draw_ms"] = max(parts["draw_ms"] - parts["upload_ms"] - parts["cover_ms"], 0.0)
    figures[name] |= parts | {"beyond_ms": sum(parts.values())}

    # Blender alone
    draw, viewport.Viewport.draw = viewport.Viewport.draw, lambda self, context, depsgraph: ""
    overlays._waiting.clear()
    bare = yield from orbited(SECONDS)
    viewport.Viewport.draw, viewport.Viewport._ask = draw, ask
    figures[name] |= {"bare_ms": bare["ms"], "bare_clock_ms": bare["clock_ms"]}
    area().tag_redraw()


def _each(found, steps, figures, key):
    """Goes through an orbit, with the image uploaded anew for each redraw."""
    while True:
        try:
            condition = next(steps)
        except StopIteration as end:
            figures[key] = end.value["ms"]
            return
        found.canvas.drawn = None
        yield condition
