# SPDX-License-Identifier: GPL-3.0-or-later
"""Cancelling, failing, and the add-on's place in Blender."""

import os
import threading
import time
from pathlib import Path

import bpy
import numpy as np
from harness import Skip, add_points, check, drawn, failing_render, new_scene, patina, render, reports, sphere
from patina import jobs, native
from patina.draw import engine, passes
from patina.draw import render as drawing


def test_break_writes_nothing():
    new_scene()
    add_points(*sphere(2000))
    stopped, engine.PatinaRenderEngine._stopped = engine.PatinaRenderEngine._stopped, lambda self: True
    interval, jobs.INTERVAL = jobs.INTERVAL, 0.0  # so that the poll comes before the end
    try:
        for _ in range(20):
            picture = render()
            if not picture:
                break
    finally:
        engine.PatinaRenderEngine._stopped = stopped
        jobs.INTERVAL = interval
    check(not picture, "20 cancelled renders were written")
    check(not any(kind == 'ERROR' for kind, _ in reports), f"reports {reports}")
    check(drawn(render()), "the next render is whole")


def test_cancel_while_building():
    """A big cloud stops soon: no more than a quarter of the work follows, in the median of five. The error is the one of cancelling."""
    positions = np.random.default_rng(5).uniform(-1, 1, (2_000_000, 3)).astype(np.float32)

    begun, late = time.process_time(), []
    native.Cloud(positions).close()
    whole = time.process_time() - begun
    for _ in range(5):
        cancels = []
        with native.Progress() as progress:

            def cancel(progress=progress, cancels=cancels):
                progress.cancel()
                cancels.append(time.process_time())

            try:
                jobs.run(lambda progress=progress: native.Cloud(positions, progress=progress), cancel, lambda: True)
                raise AssertionError("a cancelled build returned a cloud")
            except native.PatinaCancelled:
                late.append(time.process_time() - cancels[0])
    check(sorted(late)[2] < 0.25 * whole, f"{late} of {whole:.2f} s of a processor")


def test_cancel_before_rendering():
    with native.Device("cpu") as device, native.Scene() as scene, native.Frame(device) as frame:
        scene.set_camera(world_from_camera=np.eye(4).ravel(), left=-1, right=1, bottom=-1, top=1, near_clip=0.1,
                         far_clip=100)
        frame.cancel()
        try:
            frame.render(scene)
        except native.PatinaCancelled:
            return
    check(False, "a cancelled frame rendered")


def test_worker_errors_arrive_here():
    caught = []

    def work():
        check(threading.current_thread() is not threading.main_thread(), "work ran on the calling thread")
        raise ValueError("from the worker")

    try:
        jobs.run(work, lambda: None, lambda: False)
    except ValueError as error:
        caught.append(str(error))
    check(caught == ["from the worker"], f"caught {caught}")


def test_missing_library():
    new_scene()
    add_points([(0, 0, -2)])
    before = os.environ.get("PATINA_LIBRARY")
    os.environ["PATINA_LIBRARY"] = "/nowhere/libpatina.so"
    native.forget_library()
    patina._forget()
    drawing.forget_device()
    try:
        message = failing_render()
    finally:
        if before is None:
            del os.environ["PATINA_LIBRARY"]
        else:
            os.environ["PATINA_LIBRARY"] = before
        native.forget_library()
    check("library is missing" in message and "/nowhere/libpatina.so" in message, message)
    check("Traceback" not in message, message)
    check(drawn(render()), "a render with the library back")


def test_unknown_device_is_a_message():
    try:
        native.Device("abacus")
    except native.PatinaError as error:
        check(len(str(error)) > 5 and error.code < 0, repr(error))
    else:
        check(False, "a device named abacus")


def test_no_device_falls_back_silently():
    """A device that is asked for and cannot be had is a message, not another device."""
    scene = new_scene(16, 12)
    add_points([(0, 0, -2)])
    scene.patina.device = 'GL_SOFTWARE'
    try:
        render()
    except RuntimeError as error:
        check("Patina: " in str(error), str(error))
    else:
        import harness
        check("(OpenGL in Software)" in harness.stats[-1], harness.stats[-1])
    finally:
        drawing.forget_device()


def test_our_own_bug_is_a_message():
    new_scene()
    original = passes.write
    passes.write = lambda *arguments: 1 / 0
    try:
        message = failing_render()
    finally:
        passes.write = original
    check("ZeroDivisionError" in message and "Traceback" not in message, message)


def test_closed_handle_is_a_message():
    device = native.Device("cpu")
    device.close()
    device.close()
    try:
        device._call("get_info", None)
    except native.PatinaError as error:
        check("closed" in str(error), str(error))


def test_standard_panels():
    panels = {panel.__name__: panel.COMPAT_ENGINES for panel in bpy.types.Panel.__subclasses__()
              if hasattr(panel, "COMPAT_ENGINES")}
    for name in ("DATA_PT_lens", "DATA_PT_camera", "RENDER_PT_format", "RENDER_PT_output", "WORLD_PT_context_world"):
        check('PATINA' in panels[name], f"{name} does not show")
    check('PATINA' not in panels["DATA_PT_light"], "two light panels")


def test_enum_numbers_are_the_librarys():
    scene = new_scene()
    numbers = {name: [item.value for item in scene.patina.bl_rna.properties[name].enum_items]
               for name in ("quality", "fill", "smooth", "antialias")}
    check(numbers == {"quality": [0, 1], "fill": [0, 1, 2], "smooth": [0, 1, 2, 3], "antialias": [0, 1, 2]},
          f"{numbers}")


def test_registers_twice():
    patina.unregister()
    check(not any('PATINA' in getattr(panel, "COMPAT_ENGINES", ()) for panel in bpy.types.Panel.__subclasses__()),
          "panels remember an engine that is gone")
    patina.register()
    new_scene()
    add_points([(0, 0, -2)])
    check(drawn(render()), "a render after registering again")


def test_memory_runs_short():
    """A picture that memory has no room for: a message that says so, and Blender draws the next one."""
    import resource
    scene = new_scene(4000, 3000)
    add_points(*sphere(2000))
    scene.render.resolution_percentage = 1
    render()
    before = resource.getrlimit(resource.RLIMIT_AS)
    held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    scene.render.resolution_percentage = 100
    resource.setrlimit(resource.RLIMIT_AS, (held + (250 << 20), before[1]))  # its planes take 1.5 GB, tiles less; the image itself 230 MB
    try:
        text = failing_render()
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)
    check("out of memory" in text and "Error:" not in text.partition("Patina: ")[2], text)
    scene.render.resolution_percentage = 1
    check(drawn(render()), "nothing was drawn afterwards")


def test_wrong_attribute_names():
    """Each is named in a warning; the points are drawn without."""
    new_scene()
    obj = add_points(*sphere(2000))
    obj.patina.color_attribute, obj.patina.normal_attribute, obj.patina.opacity_attribute = "collor", "norm", "opaque"
    picture = render()
    text = " ".join(text for kind, text in reports if kind == 'WARNING')
    for name, use in (("collor", "color"), ("norm", "normal"), ("opaque", "opacity")):
        check(f"no point attribute '{name}' to take as {use}" in text, text)
    check(drawn(picture), "nothing was drawn")


def test_cpu_takes_over():
    """A GL device that fails in the middle of a picture: a warning, and the CPU's picture."""
    try:
        native.Device("gl-osmesa").close()
    except native.PatinaError as error:
        raise Skip(str(error)) from None
    new_scene()
    add_points(*sphere(2000))
    bpy.context.scene.patina.device = 'GL_SOFTWARE'
    honest = native.Frame.render

    def failing(self, scene):
        if self._device.name.startswith("gl"):
            raise native.PatinaError("the context is lost", -6)
        honest(self, scene)

    native.Frame.render = failing
    try:
        picture = render()
    finally:
        native.Frame.render = honest
        drawing.forget_device()
    check(drawn(picture), "nothing was drawn")
    check(any(kind == 'WARNING' and "OpenGL in Software) failed, the processor drew" in text for kind, text in reports), f"reports {reports}")
