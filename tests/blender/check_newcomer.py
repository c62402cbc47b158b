# SPDX-License-Identifier: GPL-3.0-or-later
"""README's way from the import to F12, as a newcomer goes it in the window of a fresh Blender. See test_window.py for what a
yield means; PATINA_SCREENSHOTS names a folder that keeps the pictures."""

import os
import subprocess
from functools import partial
from pathlib import Path

import bpy
import numpy as np
from harness import REPOSITORY, SCRATCH, Skip, check, saved
from patina.operators import samples, set_up
from window import area, invoke_import, pause, screenshot, shown, view, whole_window, window_region

POINTS = int(os.environ.get("PATINA_NEWCOMER_POINTS", "20000"))


def in_view(operator, **options):
    window = bpy.context.window_manager.windows[0]
    with bpy.context.temp_override(window=window, screen=window.screen, area=area(), region=window_region()):
        return operator(**options)


def test_set_up_is_offered_after_the_first_import():
    """To who imports into the start scene, and once they took it no more: from there F12 shows the points."""
    path = SCRATCH / "offered.ply"
    subprocess.run(["/usr/bin/python3", str(REPOSITORY / "build/relief"), str(path), "5000"], check=True)
    in_view(bpy.ops.wm.read_homefile, use_factory_startup=True, use_empty=False, app_template="", load_ui=False)
    yield lambda: "Cube" in bpy.data.objects
    offers, asked = [], set_up.offer
    set_up.offer = lambda context: (offers.append(context.scene.name), asked(context))
    try:
        invoke_import(path)
        yield lambda: "offered" in bpy.data.objects and offers
        screenshot("path_0_offered")
        check(in_view(bpy.ops.scene.patina_set_up) == {'FINISHED'}, "set up")
        check(bpy.context.scene.render.engine == 'PATINA' and "Cube" not in bpy.data.objects, "engine and cube")
        check(area().spaces[0].region_3d.view_perspective == 'CAMERA', "the view looks through the camera that was aimed")
        invoke_import(path)
        yield lambda: "offered.001" in bpy.data.objects
        check(len(offers) == 1, f"{len(offers)} offers")
    finally:
        set_up.offer = asked
    bpy.ops.render.render()
    bright = saved('PNG')[..., :3].max(axis=2) > 0.2
    check(bright.mean() > 0.1, f"F12 shows points on {bright.mean():.0%} of the picture")


def test_newcomers_path():
    """Delete the cube, import, choose the engine, aim the camera, pick a style, look, F12."""
    path = SCRATCH / "relief.ply"
    subprocess.run(["/usr/bin/python3", str(REPOSITORY / "build/relief"), str(path), str(POINTS)], check=True)
    in_view(bpy.ops.wm.read_homefile, use_factory_startup=True, use_empty=False, app_template="", load_ui=False)
    yield lambda: "Cube" in bpy.data.objects
    in_view(bpy.ops.object.select_all, action='DESELECT')
    bpy.data.objects["Cube"].select_set(True)
    in_view(bpy.ops.object.delete)
    check(invoke_import(path) == {'RUNNING_MODAL'}, "the import")
    yield lambda: "relief" in bpy.data.objects
    scene, obj = bpy.context.scene, bpy.data.objects["relief"]
    check(obj.select_get() and bpy.context.view_layer.objects.active == obj, "the points are selected")
    screenshot("path_1_imported")
    scene.render.engine = 'PATINA'
    check(in_view(bpy.ops.view3d.camera_to_view_selected) == {'FINISHED'}, "the camera")
    editor = next(found for found in bpy.context.window.screen.areas if found.type == 'PROPERTIES')
    editor.spaces[0].context = 'RENDER'
    area().spaces[0].shading.type = 'RENDERED'
    in_view(bpy.ops.view3d.view_camera)
    scene.patina.style.chosen = "museum"
    yield lambda: shown() and shown().shown.stats["points"] == POINTS
    screenshot("path_2_style")
    alpha = shown().shown.color[..., :3].max(axis=2)
    check(0.05 < (alpha > 0.05).mean() < 0.9, f"the view shows points on {(alpha > 0.05).mean():.0%} of it")
    bpy.ops.render.render()
    picture = saved('PNG')
    if "PATINA_SCREENSHOTS" in os.environ:
        bpy.data.images['Render Result'].save_render(str(Path(os.environ["PATINA_SCREENSHOTS"]) / "path_3_f12.png"))
    check(picture.shape[:2] == (1080, 1920), f"{picture.shape}")
    bright = picture[..., :3].max(axis=2) > 0.2
    rows, columns = np.nonzero(bright)
    check(0.1 < bright.mean() < 0.8, f"F12 shows points on {bright.mean():.0%} of the picture")
    check(abs(columns.mean() - 960) < 150 and abs(rows.mean() - 540) < 150, "the points are not in the middle")


def test_a_sample_opens_rendered():
    """Blender asks to save a changed file first. Then the view shows the sample's points, through its camera."""
    options = {"filepath": str(samples.path_of("Relief")), "load_ui": True, "use_splash": False}
    bpy.context.scene.name = "mine"
    bpy.ops.ed.undo_push()  # changed
    check(bpy.data.is_dirty and bpy.context.preferences.view.use_save_prompt, "nothing to ask for")
    check(in_view(partial(bpy.ops.wm.read_homefile, 'INVOKE_AREA'), **options) == {'INTERFACE'}, "Blender did not ask")
    yield pause(0.5)
    check("mine" in bpy.data.scenes, "the changes are lost")
    in_view(bpy.ops.wm.read_homefile, **options)
    yield lambda: area().spaces[0].shading.type == 'RENDERED' and shown() is not None
    screenshot("sample_relief")
    check(shown().shown.stats["points"] == len(bpy.data.objects["Relief"].data.vertices), "points")
    check(view().view_perspective == 'CAMERA' and bpy.data.filepath == "", "camera or file")
    in_view(bpy.ops.wm.read_homefile, use_factory_startup=True, use_empty=False, app_template="", load_ui=True)
    yield lambda: "Cube" in bpy.data.objects


# Where Blender 3.4 puts things in a window of 1280 x 800 as it comes, from the top left; dialogs have windows of their own.
MENU_FILE, MENU_IMPORT, MENU_POINTS = (46, 13), (80, 295), (350, 546)
DIALOG_FILE, DIALOG_IMPORT = (312, 78), (1031, 603)
RENDERED, RENDER_TAB, STYLE, MUSEUM = (1017, 40), (1074, 354), (1168, 468), (913, 170)
MOST_CLICKS = 16


class Hand:
    """Clicks and keys, as the newcomer's, counted. Each is a generator: it ends when Blender had time for it."""

    def __init__(self, before):
        self.clicks = before

    def click(self, place):
        """In the newest window."""
        window = bpy.context.window_manager.windows[-1]
        x, y = place[0], window.height - place[1]
        for step in (6, 3, 0):
            window.event_simulate('MOUSEMOVE', 'NOTHING', x=x - step, y=y)
            yield pause(0.2)
        for value in ('PRESS', 'RELEASE'):
            window.event_simulate('LEFTMOUSE', value, x=x, y=y)
            yield pause(0.1)
        self.clicks += 1
        yield pause(0.5)

    def clicks_until(self, done, *places):
        """Again where Blender missed one while it drew, as it does on a slow machine; they count once."""
        for _ in range(3):
            before = self.clicks
            for place in places:
                yield from self.click(place)
            enough = pause(10.0)
            yield lambda enough=enough: done() or enough()
            if done():
                return
            self.clicks = before
            window = bpy.context.window_manager.windows[0]
            for value in ('PRESS', 'RELEASE'):
                window.event_simulate('ESC', value, x=20, y=20)
            yield pause(1.0)
        check(False, f"clicks at {places} had no effect")


def test_newcomers_clicks():
    """The manual's list, click by click: from Blender as it comes to a picture in a style, with at most 16."""
    window = bpy.context.window_manager.windows[0]
    if not bpy.app.use_event_simulate or bpy.app.version[:2] != (3, 4) or (window.width, window.height) != (1280, 800):
        raise Skip("it needs --enable-event-simulate and Blender 3.4 in a window of 1280 x 800")
    path = SCRATCH / "clicks" / "relief.ply"
    path.parent.mkdir()
    subprocess.run(["/usr/bin/python3", str(REPOSITORY / "build/relief"), str(path), str(POINTS)], check=True)
    in_view(bpy.ops.wm.read_homefile, use_factory_startup=True, use_empty=False, app_template="")
    yield lambda: "Cube" in bpy.data.objects
    hand, windows = Hand(1), bpy.context.window_manager.windows  # one that the splash takes
    scene = bpy.context.scene
    yield from hand.clicks_until(lambda: len(windows) == 2, MENU_FILE, MENU_IMPORT, MENU_POINTS)
    browser = windows[1].screen.areas[0].spaces[0]
    yield lambda: browser.params is not None
    browser.params.directory = str(path.parent).encode()  # where the newcomer keeps scans
    yield pause(2.0)
    yield from hand.click(DIALOG_FILE)
    yield from hand.click(DIALOG_IMPORT)
    yield lambda: "relief" in bpy.data.objects and len(windows) == 1
    yield pause(1.0)
    whole_window("clicks_1_imported")
    # Set Up for Points is offered under the hand
    yield from hand.clicks_until(lambda: scene.render.engine == 'PATINA', MENU_POINTS)
    yield from hand.clicks_until(lambda: area().spaces[0].shading.type == 'RENDERED', RENDERED)
    editor = next(found for found in windows[0].screen.areas if found.type == 'PROPERTIES')
    yield from hand.clicks_until(lambda: editor.spaces[0].context == 'RENDER', RENDER_TAB)
    yield lambda: shown() and shown().shown.stats["points"] == POINTS
    yield from hand.clicks_until(lambda: scene.patina.style.chosen == "museum", STYLE, MUSEUM)
    yield lambda: shown() and shown().shown.stats["points"] == POINTS
    whole_window("clicks_2_style")
    bpy.ops.render.render()  # F12
    hand.clicks += 1
    if "PATINA_SCREENSHOTS" in os.environ:
        bpy.data.images['Render Result'].save_render(str(Path(os.environ["PATINA_SCREENSHOTS"]) / "clicks_3_f12.png"))
    bright = saved('PNG')[..., :3].max(axis=2) > 0.2
    check(0.1 < bright.mean() < 0.8, f"F12 shows points on {bright.mean():.0%} of the picture")
    print(f"  {hand.clicks} clicks", flush=True)
    check(hand.clicks <= MOST_CLICKS, f"{hand.clicks} clicks")
