# SPDX-License-Identifier: GPL-3.0-or-later
"""What changes from frame to frame: sequences of files, attributes, places, settings."""

import bpy
import check_linked  # noqa: F401  no test leaves files with the user
import numpy as np
from check_import import write_ply
from harness import SCRATCH, add_points, check, check_close, new_scene, render, reports, set_world
from patina.sync.points import built, linked, sequence

SIZE = 64


def scans(folder, numbers, origin=(0, 0, 0)):
    """A folder of scans, each of a dot; number n at x = n - 3, with coordinates from an origin of its own on."""
    (SCRATCH / folder).mkdir(exist_ok=True)
    for number in numbers:
        x = number - 3.0 + np.linspace(0, 0.1, 4) * any(origin) + origin[0]  # what float32 would not hold far away
        write_ply(f"{folder}/scan_{number:04}.ply", [("x", "f8", x), ("y", "f8", np.zeros(4) + origin[1]),
                                                      ("z", "f8", np.full(4, -4.0) + origin[2])])
    return SCRATCH / folder / "scan_0001.ply"


def link(path):
    """Linked as a sequence, seen by an orthographic camera of 8 units a side, 8 pixels a unit."""
    scene = new_scene(SIZE, SIZE)
    scene.camera.data.type, scene.camera.data.ortho_scale = 'ORTHO', 8.0
    bpy.ops.import_scene.patina_points(filepath=str(path), link=True, sequence=True)
    obj = bpy.context.view_layer.objects.active
    obj.location = (0, 0, 0)
    return obj


def shown(frame):
    """The number of the scan in the picture, or 0."""
    bpy.context.scene.frame_set(frame)
    columns = np.argwhere(render()["Combined"][..., 3].any(axis=0)).ravel()
    return int((columns[0] + 0.5 - SIZE / 2) // 8 + 3) if len(columns) else 0


def told(part):
    return [text for _, text in reports if part in text]


def test_a_file_a_frame():
    obj = link(scans("frames", (1, 2, 3, 5)))
    settings = obj.patina.sequence
    check(obj.patina.linked_file.endswith("scan_####.ply") and obj.name == "scan", obj.patina.linked_file)
    check([shown(frame) for frame in (1, 2, 3)] == [1, 2, 3], "frame by frame")
    settings.start, settings.step = 10, 2
    check([shown(frame) for frame in (10, 11, 12, 14)] == [1, 1, 2, 3], "two frames a file, from 10 on")
    check([shown(frame) for frame in (1, 18, 40)] == [1, 5, 5], "held outside")
    settings.outside = 'LOOP'
    check([shown(frame) for frame in (20, 22, 8, 0)] == [1, 2, 5, 1], "over and over")
    settings.outside = 'HIDE'
    check([shown(frame) for frame in (9, 10, 19, 20)] == [0, 1, 5, 0], "hidden outside")
    check(not told("missing"), f"{reports}")


def test_a_missing_file():
    """One message names it; the file before it stays, from whichever side the frame was reached."""
    link(scans("gap", (1, 2, 5)))
    for frame in (3, 4):
        check(shown(frame) == 2, f"frame {frame}")
        check(len(told("missing")) == 1 and told(f"scan_{frame:04}.ply is missing at frame {frame}, scan_0002.ply stays"),
              f"{reports}")
    check(shown(5) == 5 and not told("missing"), f"{reports}")
    (SCRATCH / "gap/scan_0003.ply").write_bytes((SCRATCH / "gap/scan_0005.ply").read_bytes())
    check(shown(3) == 5 and not told("missing"), "a file that came later is found")
    for path in (SCRATCH / "gap").glob("*.ply"):
        path.unlink()
    check(shown(1) == 0 and told("no file fits scan_####.ply"), f"{reports}")


def test_one_origin():
    """Scans far from zero, whose files would each take another origin, keep their places to each other."""
    path = scans("far", (1,), (485432.0, 5428765.0, 312.0))
    scans("far", (2,), (485432.0 + 1, 5428765.0, 312.0))
    obj = link(path)
    origin = np.array(obj["patina_origin"])
    check(origin[0] == 485430.0, f"{origin}")
    check(linked.load(linked.source(path.with_name("scan_0002.ply"))).origin[0] == 485432.0, "an origin of its own")
    obj.location = origin - (485432.0, 5428765.0, 312.0)
    check([shown(1), shown(2)] == [1, 3], "the second lies one further to the right")


def test_recent_clouds_stay():
    """Clouds of other frames stay within a budget; the picture's own always."""
    link(scans("recent", range(1, 6)))
    built.CACHE.clear()
    shown(1)
    one = next(iter(built.CACHE._entries.values()))[1].footprint
    budget, built.IDLE_BYTES = built.IDLE_BYTES, 2 * one
    try:
        for frame in range(1, 6):
            check(shown(frame) == frame, f"frame {frame}")
        kept = list(built.CACHE._entries)
        check(len(kept) == 3 and kept[-1][1].endswith("scan_0005.ply"), f"{kept}")
        cloud = built.CACHE._entries[kept[0]][1]
        check(shown(3) == 3 and built.CACHE._entries[kept[0]][1] is cloud, "a kept cloud is opened again")
    finally:
        built.IDLE_BYTES = budget


def test_patterns():
    folder = SCRATCH / "names"
    folder.mkdir()
    for name in ("a7.ply", "a12.ply", "a012.ply", "b1.ply", "a3.laz", "a.ply", "x#1.ply"):
        (folder / name).touch()
    files = sequence.files_of(folder / "a#.ply")
    check(sorted(files) == [7, 12], f"{files}")
    check(sorted(sequence.files_of(folder / "a##.ply")) == [12], "as many digits at least")
    check(sequence.pattern_of(folder / "run2_frame0100.laz").name == "run2_frame####.laz", "the last number counts")
    check(sequence.pattern_of(folder / "a.ply") is None, "no number")
    check(not sequence.is_pattern(folder / "x#1.ply") and sequence.is_pattern(folder / "y#1.ply"), "a file of that name")


def attribute_nodes():
    """Geometry nodes: opacity = frame / 4."""
    tree = bpy.data.node_groups.new("fade", 'GeometryNodeTree')
    if hasattr(tree, "interface"):
        tree.interface.new_socket("Geometry", in_out='INPUT', socket_type='NodeSocketGeometry')
        tree.interface.new_socket("Geometry", in_out='OUTPUT', socket_type='NodeSocketGeometry')
    else:
        tree.inputs.new('NodeSocketGeometry', "Geometry")
        tree.outputs.new('NodeSocketGeometry', "Geometry")
    first, last, time, share, store = (tree.nodes.new(kind) for kind in (
        "NodeGroupInput", "NodeGroupOutput", "GeometryNodeInputSceneTime", "ShaderNodeMath",
        "GeometryNodeStoreNamedAttribute"))
    share.operation = 'MULTIPLY'
    share.inputs[1].default_value = 0.25
    store.data_type, store.domain = 'FLOAT', 'POINT'
    store.inputs["Name"].default_value = "fade"
    value = next(item for item in store.inputs if item.name == "Value" and item.enabled)
    for a, b in ((first.outputs[0], store.inputs[0]), (time.outputs["Frame"], share.inputs[0]),
                 (share.outputs[0], value), (store.outputs[0], last.inputs[0])):
        tree.links.new(a, b)
    return tree


def test_everything_is_animated():
    """An attribute (by geometry nodes), an object, its style, the camera, the world: each frame shows its own."""
    scene = new_scene(SIZE, SIZE)
    scene.camera.data.type, scene.camera.data.ortho_scale = 'ORTHO', 8.0
    scene.render.film_transparent = False
    grid = (np.mgrid[0:8, 0:8].reshape(2, -1).T + 0.5) / 8.0
    places = np.column_stack([grid, np.full(len(grid), -4.0)])
    obj = add_points(places)
    obj.patina.lighting, obj.patina.opacity_attribute = 'UNLIT', "fade"
    obj.modifiers.new("fade", 'NODES').node_group = attribute_nodes()
    world = set_world((1, 1, 1))
    color = next(node for node in world.node_tree.nodes if node.bl_idname == 'ShaderNodeBackground').inputs["Color"]
    for frame in (1, 3):
        obj.location.x = frame - 3.0
        obj.keyframe_insert("location", frame=frame)
        obj.patina.color = (0.25 * frame,) * 3
        obj.patina.keyframe_insert("color", frame=frame)
        scene.camera.location.y = frame - 1.0
        scene.camera.keyframe_insert("location", frame=frame)
        color.default_value = (0.0, 0.0, 0.25 * frame, 1.0)
        color.keyframe_insert("default_value", frame=frame)
    for frame in (1, 2, 3):
        scene.frame_set(frame)
        picture = render()["Combined"]
        left, bottom = SIZE // 2 + 8 * (frame - 3), SIZE // 2 - 8 * (frame - 1)
        middle, behind = 0.25 * frame, np.array((0, 0, 0.25 * frame))
        check_close(picture[bottom + 3, left + 3, :3], middle * middle + behind * (1 - middle), 0.01, f"frame {frame}")
        points = np.argwhere(np.abs(picture[..., 0]) > 0.001)
        check(points.min(axis=0).tolist() == [bottom, left] and points.max(axis=0).tolist() == [bottom + 7, left + 7],
              f"frame {frame}: {points.min(axis=0)} to {points.max(axis=0)}, not from {(bottom, left)}")


def test_sequence_becomes_a_mesh():
    obj = link(scans("mesh", (1, 2)))
    bpy.context.scene.frame_set(2)
    bpy.ops.object.patina_linked_to_mesh()
    check(not obj.patina.linked_file and len(obj.data.vertices) == 4 and obj.data.vertices[0].co.x == -1.0,
          "the points of the frame's file")
