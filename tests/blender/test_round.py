# SPDX-License-Identifier: GPL-3.0-or-later
"""A file of the oldest Blender goes to the newest and back, and looks the same in each:

    PATINA_LIBRARY=... /usr/bin/python3 tests/blender/test_round.py NEWEST BETWEEN OLDEST

NEWEST and OLDEST start Blender, BETWEEN is the Python of a bpy module. The file holds meshes of points and a linked cloud, with colors by a
ramp, grades of scans, opacities and an effect. All passes are compared with those of the first Blender, bit by bit. The way back has two
limits, which are Blender's own: 3.4 opens no file of 5.0 and later (another file format), and no mesh of 4.0 and later (it crashes).
PointClouds that 4.5 LTS saves come through, so that is the way that is tested.
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve()
LINE = "round: "  # before what a Blender says
NAMES = ("plain", "ramp")


def begin(folder):
    """Oldest: makes the file."""
    import bpy
    import numpy as np
    from harness import new_scene, sphere
    from patina.read.importers import PointFile
    from patina.sync.points import made
    scene = new_scene(96, 64)
    positions, colors, normals = sphere(4000)
    for index, name in enumerate(NAMES):
        points = PointFile(name, positions.astype(np.float32), normals.astype(np.float32), colors,
                           {"intensity": np.linspace(0, 1, 4000, dtype=np.float32)}, (0.0, 0.0, 0.0), 0, {"crs": "EPSG:1"})
        obj = bpy.data.objects.new(name, made.to_data(points, False))
        scene.collection.objects.link(obj)
        obj.location = (1.3 * (2 * index - 1), 0.0, -0.5)
        obj.patina.opacity, obj.patina.lighting = 0.75, 'UNLIT'
        obj.patina.points.scans.add().gain = 1.5
        obj["own"] = index
    obj.patina.colors.source, obj.patina.colors.scalar, obj.patina.colors.ramp = 'SCALAR', "intensity", 'VIRIDIS'
    path = folder / "few.ply"
    with open(path, "wb") as file:
        file.write(b"ply\nformat binary_little_endian 1.0\nelement vertex 4000\nproperty float x\nproperty float y\nproperty float z\nend_header\n")
        file.write((positions * 0.5 + (0.0, 0.9, -2.0)).astype("<f4").tobytes())
    bpy.ops.import_scene.patina_points(filepath=str(path), link=True)
    bpy.context.object.name = "linked"
    scene.patina.effects.use_edl = True
    keep(folder)


def newest(folder):
    """Meshes look as they did, the conversion is offered, and changes nothing that is seen."""
    import bpy
    check_objects('MESH')
    compare(folder, "meshes")
    convert(bpy.ops.object.patina_to_point_cloud, 'POINTCLOUD')
    compare(folder, "point clouds")


def refused(folder):
    """Oldest: it opens no file of the newest, says so, and keeps what is open."""
    import bpy
    from harness import add_points, new_scene, sphere
    new_scene()
    add_points(*sphere(10), name="kept")
    try:
        bpy.ops.wm.open_mainfile(filepath=str(folder / "newest.blend"))
    except RuntimeError:
        assert "kept" in bpy.data.objects, "the session is lost"
        return
    raise AssertionError("it opens: the manual's page tested.md says that it does not")


def between(folder):
    import bpy
    check_objects('POINTCLOUD')
    compare(folder, "point clouds")
    linked = bpy.data.objects["linked"]
    data = linked.data
    bpy.data.objects.remove(linked)
    bpy.data.meshes.remove(data)
    keep(folder)


def oldest(folder):
    """It draws point clouds, though it has no tools for them: they can become meshes."""
    import bpy
    check_objects('POINTCLOUD')
    compare(folder, "point clouds")
    convert(bpy.ops.object.patina_to_mesh, 'MESH')
    compare(folder, "meshes")


def again(folder):
    check_objects('MESH')
    compare(folder, "meshes")


STEPS = {"begin": (begin, ""), "newest": (newest, "begin"), "refused": (refused, ""), "between": (between, "newest"),
         "oldest": (oldest, "between"), "again": (again, "oldest")}  # and the file that each opens


def keep(folder):
    import numpy as np
    from harness import render
    np.savez(folder / "picture.npz", **render())


def compare(folder, what):
    import numpy as np
    from harness import render, reports
    seen, wanted = render(), np.load(folder / "picture.npz")
    for name in wanted.files:
        assert name in seen, f"{what}: there is no pass {name}: {reports}"
        assert np.array_equal(wanted[name], seen[name]), f"{what}: {name} differs in {(wanted[name] != seen[name]).any(axis=2).sum()} pixels"
    assert len(wanted.files) >= 4 and (wanted["Combined"][..., 3] > 0).sum() > 500, f"{what}: the image is empty"
    assert not reports, f"{what}: {reports}"


def check_objects(kind):
    import bpy
    for index, name in enumerate(NAMES):
        obj = bpy.data.objects[name]
        assert obj.type == kind, f"{name} is {obj.type}"
        assert obj["own"] == index and obj.data["patina_crs"] == "EPSG:1", f"{name}: own properties are lost"
        assert abs(obj.patina.opacity - 0.75) < 1e-6 and obj.patina.points.scans[0].gain == 1.5, f"{name}: settings are lost"


def convert(operator, kind):
    import bpy
    objects = [bpy.data.objects[name] for name in NAMES]
    for other in bpy.context.view_layer.objects:
        other.select_set(other in objects)
    bpy.context.view_layer.objects.active = objects[0]
    assert operator.poll() and operator() == {'FINISHED'}, "not converted"
    check_objects(kind)


def step(name, folder):
    """Runs in a Blender."""
    import bpy
    sys.path.insert(0, str(HERE.parent))
    import harness  # noqa: F401  registers the add-on
    work, source = STEPS[name]
    if source:
        bpy.ops.wm.open_mainfile(filepath=str(folder / f"{source}.blend"))
    work(folder)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / f"{name}.blend"))
    print(f"{LINE}{bpy.app.version_string}", flush=True)


def run(program, name, folder):
    """Whether a step passed."""
    start = [program, str(HERE)] if "python" in Path(program).name else [
        program, "-b", "--factory-startup", "--python-exit-code", "1", "--python", str(HERE), "--"]
    done = subprocess.run([*start, "--step", name, str(folder)], capture_output=True, text=True, check=False)
    said = [line[len(LINE):] for line in done.stdout.splitlines() if line.startswith(LINE)]
    if done.returncode or not said:
        told = [line for line in (done.stdout + done.stderr).splitlines() if re.match(r"\w+(Error|Exception): ", line)]
        print(f"FAIL {name}: {(told or [f'ended with {done.returncode}'])[-1]}", flush=True)
        return False
    print(f"ok {name} (Blender {said[-1]})", flush=True)
    return True


def main(new, module, old):
    passed = failed = 0
    with tempfile.TemporaryDirectory(prefix="patina-round-") as folder:
        for program, name in ((old, "begin"), (new, "newest"), (old, "refused"), (module, "between"), (old, "oldest"), (new, "again")):
            if run(program, name, Path(folder)):
                passed += 1
            else:
                failed += 1
                break  # the others go on from its file
    print(f"{passed} passed, {failed} failed, 0 skipped", flush=True)
    return failed


if __name__ == "__main__":
    if "--step" in sys.argv:
        chosen, place = sys.argv[sys.argv.index("--step") + 1:][:2]
        step(chosen, Path(place))
        sys.stdout.flush()
        os._exit(0)  # the bpy module may hang in its own clean-up
    sys.exit(main(*sys.argv[1:4]))
