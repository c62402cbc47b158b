# SPDX-License-Identifier: GPL-3.0-or-later
"""The path of an artist through a window of Blender, with a screenshot of each step, to be looked at: build/tour runs it.

PATINA_TOUR_SCAN names the scan, PATINA_SCREENSHOTS the folder of the pictures. An exception in a step is printed, and the next step
follows. The process ends with 1 if a step failed.
"""

import os
import sys
import time
import traceback
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))

SCAN = Path(os.environ["PATINA_TOUR_SCAN"])
PATIENCE = 90.0  # s that a step waits for the viewport's whole image
PAUSE = 2.0  # s for Blender's own drawing
ENGINES = ('CYCLES', 'BLENDER_EEVEE', 'BLENDER_EEVEE_NEXT')


def in_view(operator, *arguments, **options):
    from window import area, window_region
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=window_region()):
        return operator(*arguments, **options)


def pause(seconds=PAUSE):
    until = time.perf_counter() + seconds
    return lambda: time.perf_counter() > until


def still():
    """Waits until the viewport shows its whole image of a scene whose analysis is done, and PAUSE longer."""
    from patina.sync.analyses.analyzing import ANALYSES
    from window import shown
    begun, since = time.perf_counter(), []

    def done():
        now = time.perf_counter()
        if shown() and not ANALYSES.busy():
            since.append(now)
        return bool(since) and now - since[0] > PAUSE or now - begun > PATIENCE

    return done


def imported():
    return next((obj for obj in bpy.data.objects if obj.name.startswith(SCAN.stem[:12])), None)


def select_points(action):
    operator = bpy.ops.mesh.select_all if imported().type == 'MESH' else bpy.ops.pointcloud.select_all
    in_view(operator, action=action)


def shading(kind):
    from window import area
    area().spaces[0].shading.type = kind


def border(scene, on):
    scene.render.use_border = on
    scene.render.border_min_x, scene.render.border_max_x, scene.render.border_min_y, scene.render.border_max_y = 0.3, 0.7, 0.3, 0.8


def render(name):
    bpy.context.scene.render.filepath = os.path.join(os.environ["PATINA_SCREENSHOTS"], name)  # two files of two eyes
    bpy.ops.render.render(write_still=True)


def invert(scene):
    """A compositor that inverts the image."""
    from harness import compositor
    tree, out = compositor(scene)
    layers, node = tree.nodes.new('CompositorNodeRLayers'), tree.nodes.new('CompositorNodeInvert')
    tree.links.new(layers.outputs["Image"], node.inputs["Color"])
    tree.links.new(node.outputs[0], out.inputs[0])


def tour():
    """Yields what it waits for: a function that says whether it has come."""
    from harness import end_compositor
    from window import invoke_import, whole_window
    in_view(bpy.ops.wm.read_homefile, use_factory_startup=True, use_empty=False, app_template="", load_ui=False)
    yield pause()
    invoke_import(SCAN)
    begun = time.perf_counter()
    yield lambda: imported() or time.perf_counter() - begun > PATIENCE
    yield pause()
    whole_window("01_imported")
    in_view(bpy.ops.scene.patina_set_up)
    window = bpy.context.window_manager.windows[0]
    for value in ('PRESS', 'RELEASE'):  # what was offered goes away
        window.event_simulate('ESC', value, x=20, y=20)
    yield pause()
    whole_window("02_set_up")
    for kind in ('SOLID', 'MATERIAL'):
        shading(kind)
        yield pause(10.0)
        whole_window(f"03_{kind.lower()}")
    shading('RENDERED')
    yield still()
    whole_window("04_rendered_selected")
    imported().select_set(False)
    yield still()
    whole_window("05_rendered")
    imported().select_set(True)
    bpy.context.view_layer.objects.active = imported()
    in_view(bpy.ops.object.mode_set, mode='EDIT')
    for action in ('DESELECT', 'SELECT'):
        select_points(action)
        yield still()
        whole_window(f"06_edit_mode_{action.lower()}")
    in_view(bpy.ops.object.mode_set, mode='OBJECT')
    from patina.styles import styles
    for entry in styles.entries():
        if not entry.own:
            in_view(bpy.ops.patina.apply_style, style=entry.key)
            yield still()
            whole_window(f"07_style_{entry.key}")
    in_view(bpy.ops.patina.apply_style, style=styles.PLAIN)
    in_view(bpy.ops.screen.region_quadview)
    yield still()
    whole_window("08_quad_view")
    in_view(bpy.ops.screen.region_quadview)
    in_view(bpy.ops.view3d.localview, frame_selected=True)
    yield still()
    whole_window("09_local_view")
    in_view(bpy.ops.view3d.localview, frame_selected=False)
    scene = bpy.context.scene
    in_view(bpy.ops.view3d.view_camera)
    yield still()
    whole_window("10_camera")
    border(scene, True)
    yield still()
    whole_window("11_camera_border")
    border(scene, False)
    scene.render.resolution_percentage = 50
    render("12_f12")
    scene.render.use_multiview = True
    render("13_stereo")
    scene.render.use_multiview = False
    invert(scene)
    render("14_compositor")
    end_compositor(scene)
    path = os.path.join(os.environ["PATINA_SCREENSHOTS"], "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    in_view(bpy.ops.wm.open_mainfile, filepath=path, load_ui=False)
    yield pause()
    shading('RENDERED')
    yield still()
    whole_window("15_reopened")
    for engine in ENGINES:
        try:
            bpy.context.scene.render.engine = engine
        except TypeError:
            continue  # not of this Blender
        yield pause(10.0)
        whole_window(f"16_{engine.lower()}")
    bpy.context.scene.render.engine = 'PATINA'
    yield still()
    whole_window("17_patina_again")


def finish(code):
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


class Runner:
    steps = condition = None

    def __call__(self):
        try:
            if self.steps is None:
                import harness  # noqa: F401  registers the add-on
                self.steps = tour()
            if self.condition is None or self.condition():
                self.condition = next(self.steps)
        except StopIteration:
            print("tour: done", flush=True)
            finish(0)
        except BaseException:
            traceback.print_exc()
            finish(1)
        return 0.05


bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(Runner(), first_interval=0.5, persistent=True)
