# SPDX-License-Identifier: GPL-3.0-or-later
"""A seeded artist in a real window: long_session.py --artist runs it, and build/soak for two hours.

A round begins with an empty scene and ends so. In between the artist does a few things in random order. After each round a line says what the
process holds, and the first image of each round is compared with the first of all.
"""

import gc
import hashlib
import os
import random
import time
from pathlib import Path

import bpy
import numpy as np
from check_linked import dense
from harness import SCRATCH, check, render
from mathutils import Matrix, Quaternion
from patina import point_data
from patina.draw import viewport
from patina.sync.points import built
from session_rounds import operate, undo
from window import area, override, setup, shown, view

POINTS = 20_000
ACTIONS_A_ROUND = 6


def held():
    """What this process holds, as text: resident MB, handles, threads, temporary files."""
    gc.collect()
    status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    files = sum(1 for path in SCRATCH.parent.iterdir() if path != SCRATCH)  # long_session.py gives the process a folder of its own
    return f"{int(status['VmRSS'].split()[0]) / 1000:.1f} MB {len(os.listdir('/proc/self/fd'))} handles {status['Threads'].strip()} threads {files} files"


def still():
    """Whether the view shows the whole image of what is there, and nothing is analyzed."""
    return shown() is not None


class Artist:
    def __init__(self, seed):
        self.chance, self.scene, self.saved = random.Random(seed), None, str(SCRATCH / "artist.blend")
        self.scans = [dense(f"artist-{i}.ply", POINTS, (0, 0, 0)) for i in range(2)]
        bpy.context.preferences.filepaths.use_auto_save_temporary_files = False  # Blender's own file, two minutes after the last load

    def clouds(self):
        return [obj for obj in bpy.context.view_layer.objects if point_data.is_cloud(obj)]

    def look(self):
        yield lambda: bpy.context.window is not None  # after another file was loaded
        area().tag_redraw()
        yield still

    def import_scan(self):
        operate(bpy.ops.import_scene.patina_points, filepath=str(self.chance.choice(self.scans)), link=self.chance.random() < 0.5)
        yield from self.look()

    def analyze(self):
        for obj in self.clouds()[:1]:
            bpy.context.view_layer.objects.active = obj
            obj.patina.analysis = self.chance.choice(('ALWAYS', 'AUTO', 'OFF'))
        yield from self.look()

    def orbit(self):
        for _ in range(4):
            view().view_rotation = Quaternion((self.chance.random() - 0.5, 1, self.chance.random() - 0.5), self.chance.random())
            yield from self.look()

    def brush(self):
        """Points are selected, hidden and come back; some are soft."""
        for obj in self.clouds()[:1]:
            bpy.context.view_layer.objects.active = obj
            corners = [{"name": "", "loc": (self.chance.randrange(300), self.chance.randrange(300)), "time": 0.0} for _ in range(2)]
            with override():
                for operator, options in ((bpy.ops.object.patina_points_select, {"path": corners}), (bpy.ops.object.patina_points_hide, {}),
                                          (bpy.ops.object.patina_points_reveal, {})):
                    if operator.poll():
                        operator(**options)
            obj.patina.soft.use = self.chance.random() < 0.3
        yield from self.look()

    def take_back(self):
        for operator in (bpy.ops.ed.undo, bpy.ops.ed.redo):
            if self.chance.random() < 0.7 and operator.poll():
                undo(operator)
                yield from self.look()

    def final(self):
        if self.clouds():
            render()
        yield from self.look()

    def cancel(self):
        """A change begins an image, another ends it at once."""
        for _ in range(5):
            view().view_distance = 4.0 + 4.0 * self.chance.random()
            area().tag_redraw()
            until = time.monotonic() + 0.05 * self.chance.random()
            yield lambda until=until: time.monotonic() > until
        yield from self.look()

    def style(self):
        from patina.styles import styles
        key = self.chance.choice([found.key for found in styles.entries() if not found.own])
        with override():
            bpy.ops.patina.apply_style(style=key)
        yield from self.look()

    def save_and_load(self):
        undo(lambda: bpy.ops.wm.save_as_mainfile(filepath=self.saved, check_existing=False))
        undo(lambda: bpy.ops.wm.open_mainfile(filepath=self.saved, load_ui=False))
        yield from self.look()

    def delete(self):
        for obj in self.clouds()[-1:]:
            bpy.data.objects.remove(obj)
        yield from self.look()

    def other_engine(self):
        scene = bpy.context.scene
        scene.render.engine = 'BLENDER_WORKBENCH'
        until = time.monotonic() + 0.3
        yield lambda: time.monotonic() > until
        scene.render.engine = 'PATINA'
        yield from self.look()

    def resize(self):
        bpy.context.scene.render.resolution_x = self.chance.choice((64, 160, 333))
        space = area().spaces[0]
        space.show_region_ui = not space.show_region_ui  # the view becomes wider or narrower
        yield from self.look()

    def change_on_disk(self):
        """A linked scan becomes another file, shorter or longer, while it is shown."""
        path = self.chance.choice(self.scans)
        dense(path.name, POINTS if self.chance.random() < 0.5 else POINTS // 2, (0, 0, 0))
        for obj in self.clouds():
            obj.update_tag()
        yield from self.look()

    def actions(self):
        known = (self.import_scan, self.analyze, self.orbit, self.brush, self.take_back, self.final, self.cancel, self.style, self.save_and_load,
                 self.delete, self.other_engine, self.resize, self.change_on_disk)
        first = [self.import_scan]
        return first + self.chance.choices(known, k=ACTIONS_A_ROUND)

    def round(self):
        scene = setup()
        area().spaces[0].show_region_ui = False
        scene.render.resolution_x, scene.render.resolution_y = 160, 120
        scene.camera.matrix_world = Matrix.Translation((0, 0, 6))
        dense(self.scans[0].name, POINTS, (0, 0, 0))
        operate(bpy.ops.import_scene.patina_points, filepath=str(self.scans[0]))
        yield from self.look()
        image = hashlib.sha1(np.ascontiguousarray(render()["Combined"]).tobytes()).hexdigest()
        for obj in self.clouds():
            bpy.data.objects.remove(obj)
        for action in self.actions():
            self.doing = action.__name__
            yield from action()
            failed = [found.message for found in viewport._VIEWPORTS if found.message]
            check(not failed or action == self.change_on_disk, f"{self.doing}: {failed}")
        setup()
        built.CACHE.clear()
        for kind in (bpy.data.actions, bpy.data.images, bpy.data.volumes, bpy.data.materials, bpy.data.texts):
            for item in list(kind):
                if item.name not in ("Render Result", "Viewer Node"):
                    kind.remove(item)
        operate(bpy.ops.object.select_all)
        until = time.monotonic() + 0.3
        yield lambda: time.monotonic() > until
        return image


def artist():
    """PATINA_SESSION_MINUTES long, PATINA_SESSION_SEED other."""
    print(f"session: process {os.getpid()}", flush=True)
    bpy.context.preferences.edit.undo_steps = 8
    found = Artist(int(os.environ.get("PATINA_SESSION_SEED", "49")))
    end = time.monotonic() + 60.0 * float(os.environ.get("PATINA_SESSION_MINUTES", "1"))
    first, number = None, 0
    while number < 2 or time.monotonic() < end:
        image = yield from found.round()
        first = first or image
        check(image == first, f"round {number}: the first image differs")
        number += 1
        print(f"session: round {number} holds {held()}", flush=True)
