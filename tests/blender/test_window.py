# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's tests that need a window:

    xvfb-run -a -s "-screen 0 1280x800x24" blender --enable-event-simulate --factory-startup --python tests/blender/test_window.py [-- NAME ...]

NAME figures measures instead (figures.py); long_session is for long_session.py. A test is a generator: it yields what it
waits for, a function that says whether it has come.
"""

import importlib
import os
import sys
import time
import traceback
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))

PATIENCE = 120.0  # s of a wait, after which nothing comes any more, on a machine that others load too
ALONE = {"newcomers_clicks"}  # run by their names only: they want Blender as it comes, and not as other tests left its window


def tests():
    importlib.import_module("harness")  # registers the add-on, which the others ask for
    import check_drawn
    import check_newcomer
    import check_overlays
    import check_view_copc
    import check_view_edits
    import check_viewport
    import check_viewport_life
    import check_viewport_samples
    names = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    if names == ["long_session"]:
        import session_rounds
        yield "long_session", session_rounds.long_session
    if names == ["figures"]:
        import figures
        yield "figures", figures.orbit_figures
    modules = (check_viewport, check_viewport_life, check_viewport_samples, check_overlays, check_drawn, check_view_copc, check_view_edits, check_newcomer)
    for name, test in [item for module in modules for item in vars(module).items()]:
        short = name.removeprefix("test_")
        if name.startswith("test_") and (any(part in name for part in names) if names else short not in ALONE):
            yield short, test


class Runner:
    def __init__(self):
        self.queue = None
        self.steps = self.condition = None
        self.passed = self.failed = 0

    def __call__(self):
        try:
            self.queue = list(tests()) if self.queue is None else self.queue
            return self.step()
        except BaseException:
            traceback.print_exc()
            finish(1)

    def step(self):
        if self.steps is None:
            if not self.queue:
                print(f"{self.passed} passed, {self.failed} failed, 0 skipped", flush=True)
                import harness
                harness.patina.unregister()
                finish(1 if self.failed or not self.passed else 0)
            self.name, test = self.queue.pop(0)
            self.started = time.perf_counter()
            self.steps, self.condition = test(), None
        try:
            if self.condition is None or self.condition():
                self.condition = next(self.steps)
                self.asked = time.perf_counter()
            elif time.perf_counter() - self.asked > PATIENCE:
                from patina import viewport
                said = [found.message for found in viewport._VIEWPORTS]
                raise AssertionError(f"waited {PATIENCE:.0f} s in vain (line {self.steps.gi_frame.f_lineno}; {said})")
        except StopIteration:
            self.passed += 1
            print(f"ok viewport/{self.name} ({time.perf_counter() - self.started:.2f} s)", flush=True)
            self.steps = None
        except Exception as error:
            self.failed += 1
            where = traceback.extract_tb(error.__traceback__)[-1]
            print(f"FAIL viewport/{self.name}: {error} ({Path(where.filename).name}:{where.lineno})", flush=True)
            self.steps = None
        return 0.01


def finish(code):
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(Runner(), first_interval=0.5, persistent=True)
