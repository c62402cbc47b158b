# SPDX-License-Identifier: GPL-3.0-or-later
"""View from Here and walk navigation in a window. See test_window.py for what a yield means."""

import bpy
from check_view_from_here import PLACES, eye_of, room_scene
from harness import Skip, check, check_close
from patina.operators import stations
from window import area, override, pause, screenshot, setup, shown, view, window_region


def test_walking_keeps_its_height():
    """View from Here shows the room around a station. Walking there keeps the height of the eye, with the preference Gravity enabled, which
    stays so; Blender's own walking falls."""
    if not bpy.app.use_event_simulate:
        raise Skip("walk navigation needs --enable-event-simulate")
    setup()
    scene, obj = room_scene()
    scene.patina.surface, scene.patina.fill = 'FILL', 'CLOSED'
    obj.patina.colors.source, obj.patina.color, obj.patina.lighting = 'FIXED', (0.6, 0.6, 0.6), 'UNLIT'
    scene.render.film_transparent = False
    area().spaces[0].shading.type = 'RENDERED'
    bpy.context.view_layer.objects.active = stations.of(obj)[0]
    settings = bpy.context.preferences.inputs.walk_navigation
    before, settings.use_gravity = settings.use_gravity, True
    try:
        with override():
            check(bpy.ops.view3d.patina_view_from_here() == {'FINISHED'}, "view from here")
        yield lambda: shown() is not None
        picture = screenshot("view from here")
        bright = (picture.min(axis=2) > 0.3).mean()
        check(bright > 0.3, f"{bright:.0%} of the view are walls")
        check_close(eye_of(view()), PLACES[0], 1e-3, "the eye")
        area().spaces[0].shading.type = 'WIREFRAME'  # drawn at once
        heights = {}
        for ours in (True, False):
            with override():
                call = bpy.ops.view3d.patina_walk if ours else bpy.ops.view3d.walk
                call('INVOKE_DEFAULT')
            check(settings.use_gravity, "the preference")
            region, window = window_region(), bpy.context.window_manager.windows[0]
            x, y = region.x + region.width // 2, region.y + region.height // 2
            for step in range(3):
                window.event_simulate(type='MOUSEMOVE', value='NOTHING', x=x + step % 2, y=y)
                yield pause(0.1, 1)
            heights[ours] = eye_of(view()).z
            window.event_simulate(type='ESC', value='PRESS', x=x, y=y)
            window.event_simulate(type='ESC', value='RELEASE', x=x, y=y)
            yield pause(0.2, 2)
        check(abs(heights[True] - PLACES[0][2]) < 0.01, f"walking without gravity: at {heights[True]:.2f}")
        check(heights[False] < heights[True] - 0.1, f"with gravity: at {heights[False]:.2f}")
    finally:
        settings.use_gravity = before
