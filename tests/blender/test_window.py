# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's tests that need a window:

    xvfb-run -a -s "-screen 0 1280x800x24" blender --enable-event-simulate --factory-startup --python tests/blender/test_window.py [-- NAME ...]

NAME figures measures instead (figures.py), and frames (frame_figures.py); long_session and artist are for long_session.py.
--some leaves out what neither Blender's version nor its graphics change (ONCE). --drawn runs only tests that look at what Blender's graphics
drew (DRAWN): for a second backend. --oldest runs these and ONCE. A test is a generator: it yields what it waits for, a function that says
whether it has come.
"""

import importlib
import os
import sys
import time
import traceback
from pathlib import Path

import bpy

sys.path[:0] = [str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parent.parent)]

PATIENCE = 120.0  # s of a wait without progress of an analysis, on a machine that others load too
ALONE = {"newcomers_clicks"}  # run by their names only: they want Blender as it comes, and not as other tests left its window
# Of the library, files and processes, which are the same under each Blender; or too long for its software graphics: EEVEE of 5.2 compiles
# shaders for minutes.
ONCE = {"a_changed_link_keeps_nobody_waiting", "a_damaged_cache_is_mended", "a_spoilt_link_is_left_out", "analysis_refines", "balance_is_live",
        "betters_at_rest", "copc_from_a_slow_server", "copc_grows_sharper", "copc_of_a_server_that_goes_away",
        "eevee_and_points_hide_each_other", "failure_is_said", "holdout_betters", "many_points_come_by_detail", "moving_begins_again",
        "navigation_and_rest", "noise_ends_it", "processor_takes_over", "range_images_are_not_analyzed",
        "thinned_colors_in_material_preview"}
DRAWN = {"a_new_size_shows_no_stretched_picture", "box_in_the_view", "brush_in_the_view", "clipping_region", "coarse_pictures_fill_the_view",
         "draws_points", "edit_mode_selects_and_deletes", "edit_mode_shows_what_is_selected", "framing_begins_the_view_farther_away", "leaving_midway",
         "overlays_are_hidden_by_points", "panels_are_drawn_without_errors", "points_hide_their_dots", "quad_view", "the_world_lies_behind",
         "thinned_points_are_hidden_by_what_is_nearer", "toggling_lets_go", "too_bright_is_white",
         "what_changes_is_read", "what_is_left_out_shows_no_dots", "wide_points_hide_their_dots",
         "wide_points_leave_what_is_before_them"}
# What an option runs, and how the results call these tests.
CHOICES = {"--oldest": (lambda name: name in ONCE | DRAWN, "window tests of what Blender's graphics draw, and those that no version changes"),
           "--some": (lambda name: name not in ONCE, "window tests, those that depend on Blender's version"),
           "--drawn": (lambda name: name in DRAWN, "window tests of what Blender's graphics draw")}


def work():
    """Processor seconds of this process."""
    times = os.times()
    return times.user + times.system


def progress():
    """Progress of the analyses that run beside the viewport. It changes while they work."""
    from patina.sync.analyses.analyzing import ANALYSES
    return [job.progress.value() for job in ANALYSES._jobs.values()]


def tests():
    import setting
    importlib.import_module("harness")  # registers the add-on, which the others ask for
    import check_cloud_edits
    import check_drawn
    import check_drop
    import check_newcomer
    import check_overlays
    import check_thinned
    import check_view_compare
    import check_view_copc
    import check_view_drawings
    import check_view_edits
    import check_view_marks
    import check_view_measure
    import check_view_trust
    import check_view_walk
    import check_viewport
    import check_viewport_life
    import check_viewport_samples
    from names import chosen as by_words
    names = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    chosen, run = CHOICES[names.pop(0)] if names and names[0] in CHOICES else (None, "window tests")
    setting.say("the manual's clicks" if names == ["newcomers_clicks"] else run, whole=not names or names == ["newcomers_clicks"])
    if names == ["long_session"]:
        import session_rounds
        yield "long_session", session_rounds.long_session
        return
    if names == ["artist"]:
        import artist
        yield "artist", artist.artist
        return
    if names == ["figures"]:
        import figures
        yield "figures", figures.orbit_figures
        return
    if names == ["frames"]:
        import frame_figures
        yield "frames", frame_figures.frame_figures
        return
    modules = (check_viewport, check_viewport_life, check_viewport_samples, check_overlays, check_thinned, check_drawn,
               check_drop, check_cloud_edits, check_view_copc, check_view_edits, check_view_marks, check_view_compare, check_view_measure, check_view_drawings, check_view_trust, check_view_walk, check_newcomer)
    known = {name.removeprefix("test_"): test for module in modules for name, test in vars(module).items() if name.startswith("test_")}
    wrong = sorted((ONCE | DRAWN | ALONE) - set(known))
    assert not wrong, f"lists of test_window.py: no test is called {', '.join(wrong)}"
    for name in by_words(known, names):
        if names or name not in ALONE and (not chosen or chosen(name)):
            yield name, known[name]


class Runner:
    def __init__(self):
        self.queue = None
        self.steps = self.condition = None
        self.passed = self.failed = self.skipped = 0

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
                print(f"{self.passed} passed, {self.failed} failed, {self.skipped} skipped", flush=True)
                import harness
                harness.patina.unregister()
                finish(1 if self.failed or not self.passed else 0)
            self.name, test = self.queue.pop(0)
            self.started, self.work = time.perf_counter(), work()
            self.steps, self.condition = test(), None
        try:
            if self.condition is None or self.condition():
                self.condition = next(self.steps)
                self.asked, self.progress = time.perf_counter(), progress()
            elif self.progress != (now := progress()):
                self.asked, self.progress = time.perf_counter(), now
            elif time.perf_counter() - self.asked > PATIENCE:
                from patina.draw import viewport
                said = [found.message for found in viewport._VIEWPORTS]
                raise AssertionError(f"waited {PATIENCE:.0f} s in vain (line {self.steps.gi_frame.f_lineno}; {said})")
        except StopIteration:
            self.end()
        except Exception as error:
            self.end(error)
        return 0.01

    def end(self, error=None):
        """Of a test: says what came of it. What it used of deprecated things is an error too."""
        import harness
        self.steps = None
        try:
            if error:
                raise error
            harness.check_deprecated()
        except harness.Skip as reason:
            self.skipped += 1
            print(f"skip viewport/{self.name}: {reason}", flush=True)
        except Exception as raised:
            self.failed += 1
            where = traceback.extract_tb(raised.__traceback__)[-1]
            print(f"FAIL viewport/{self.name}: {raised} ({Path(where.filename).name}:{where.lineno})", flush=True)
        else:
            self.passed += 1
            print(f"ok viewport/{self.name} ({time.perf_counter() - self.started:.2f} s, {work() - self.work:.1f} s of a processor)", flush=True)


def finish(code):
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(Runner(), first_interval=0.5, persistent=True)
