# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that are dropped on a view, Blender 4.1 and later. What the window system delivers ends in wm.drop_import_file, which is called here
as Blender's drop box does: it looks for a file handler that takes the ending and the place. See test_window.py for what a yield means."""

import bpy
import numpy as np
from check_import import write_ply
from harness import SCRATCH, Skip, check, new_scene, sphere
from patina import point_data
from patina.operators import import_points
from window import area, pause, whole_window

COUNT = 500
KIND = 'POINTCLOUD' if point_data.HAS_CLOUDS else 'MESH'


def press(*keys):
    window = bpy.context.window_manager.windows[0]
    for key in keys:
        for value in ('PRESS', 'RELEASE'):
            window.event_simulate(key, value, x=window.width // 2, y=window.height // 2)
        yield pause(1.0, 10)


def drop(*paths, place='VIEW_3D'):
    window = bpy.context.window_manager.windows[0]
    found = area() if place == 'VIEW_3D' else next(item for item in window.screen.areas if item.type == place)
    region = next(item for item in found.regions if item.type == 'WINDOW')
    with bpy.context.temp_override(window=window, screen=window.screen, area=found, region=region):
        return bpy.ops.wm.drop_import_file('INVOKE_DEFAULT', directory=str(paths[0].parent), files=[{"name": path.name} for path in paths])


def files():
    folder = SCRATCH / "dropped"
    folder.mkdir(exist_ok=True)
    positions, colors, _ = sphere(COUNT)
    rows = np.concatenate([positions, colors[:, :3]], 1)
    xyz, pts, ply, wrong = (folder / name for name in ("one.xyz", "two.pts", "three.ply", "wrong.pcd"))
    np.savetxt(xyz, rows, fmt="%.5f %.5f %.5f %d %d %d")
    np.savetxt(pts, rows, fmt="%.5f %.5f %.5f %d %d %d", header=str(COUNT), comments="")
    write_ply(str(ply), [(axis, "f4", positions[:, i]) for i, axis in enumerate("xyz")])
    wrong.write_text("no points\n")
    return xyz, pts, ply, wrong


def there():
    return {obj.name: obj for obj in bpy.data.objects if obj.type == KIND}


def test_dropped_files_are_imported():
    """One, several, and one that two importers take, where Blender asks; a file that is none brings a message and nothing else."""
    if not hasattr(bpy.types, "FileHandler"):
        raise Skip("files can be dropped from Blender 4.1 on")
    new_scene()
    xyz, pts, ply, wrong = files()
    check(drop(xyz) == {'FINISHED'}, "one file")
    yield lambda: set(there()) == {"one"}
    check(point_data.count_of(there()["one"].data) == COUNT and "Col" in there()["one"].data.attributes, "its points")
    yield from press('ESC')  # what is offered after a first import
    check(drop(pts, xyz) == {'FINISHED'}, "two files")
    yield lambda: set(there()) == {"one", "one.001", "two"}
    check(bpy.context.view_layer.objects.active in there().values(), "what was dropped is active")
    check(drop(ply) == {'INTERFACE'}, "Blender has an importer of PLY too")
    yield pause(2.0, 10)
    whole_window("dropped")
    yield from press('P')  # the letter that the menu underlines in Import Points
    yield lambda: "three" in bpy.data.objects
    check(bpy.data.objects["three"].type == KIND, "the menu's entry is not ours")
    before, said, tell = set(bpy.data.objects.keys()), [], import_points.PATINA_OT_import_points._tell
    import_points.PATINA_OT_import_points._tell = lambda self, kind, text: (said.append((kind, text)), tell(self, kind, text))
    try:
        drop(wrong)
        yield lambda: said
    finally:
        import_points.PATINA_OT_import_points._tell = tell
    check(set(bpy.data.objects.keys()) == before and [kind for kind, _ in said] == ['ERROR'] and "wrong.pcd" in said[0][1], f"{said}")
    yield from press('ESC')
    check(drop(xyz, place='OUTLINER') == {'FINISHED'}, "dropped on the outliner")
    yield lambda: "one.002" in there()
