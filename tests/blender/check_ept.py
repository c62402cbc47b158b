# SPDX-License-Identifier: GPL-3.0-or-later
"""Folders of Entwine Point Tiles without conversion: the bytes of a COPC with the same octree; from a disk, and from servers."""

import json
import shutil

import bpy
import numpy as np
from check_copc import free_memory, import_copc, in_a_hurry, made, open_address, same, see, server, stream_of
from check_formats import with_laspy
from copc_files import points_of, too_fine
from ept_files import write_ept
from harness import SCRATCH, check, new_scene, render, reports, stats
from patina.sync.points import built

POINTS = 20000


def tiles(name, count=POINTS, offset=(0.0, 0.0, 0.0), **how):
    """The folder, and the counts of its nodes."""
    with_laspy()
    folder = SCRATCH / name
    shutil.rmtree(folder, ignore_errors=True)
    return folder, write_ept(folder, points_of(count, offset)[0], offset, **how)


def shown(path, stream='AUTO', z=-4.0, scalar=""):
    built.CACHE.clear()
    new_scene()
    reports.clear()
    objects = import_copc(path, stream)
    objects[0].patina.analysis = 'OFF'
    if scalar:
        objects[0].patina.colors.source, objects[0].patina.colors.scalar = 'SCALAR', scalar
        built.CACHE.clear()  # the one with the file's colours
    see(objects, z)
    return render()


def equal(one, other, what):
    for name, pixels in one.items():
        check((pixels == other[name]).all(), f"{what}: {name} differs")


def test_ept_has_the_bytes_of_a_copc():
    offsets = {"plain": (0.0, 0.0, 0.0), "far": (485000.0, 5428000.0, 300.0)}
    wanted = {}
    for name, offset in offsets.items():
        path, _, _ = made(f"beside-{name}.copc.laz", POINTS, offset=offset)
        wanted[name] = shown(path, 'ON')
        if name == "plain":
            same(shown(path, 'OFF'), wanted[name], name)
    for name, offset, how in (("plain", offsets["plain"], {}), ("far", offsets["far"], {"split": True, "zipped": True}),
                              ("plain", offsets["plain"], {"packed": "binary"}), ("far", offsets["far"], {"form": 3})):
        folder, counts = tiles("tiles", offset=offset, **how)
        found = shown(folder / "ept.json", 'OFF')  # there is no other way
        check(f"{POINTS:,} points" in stats[-1] and not reports, f"{how}: {stats[-1]} {reports}")
        check(bpy.context.view_layer.objects.active.name.startswith("tiles"), bpy.context.view_layer.objects.active.name)
        equal(wanted[name], found, f"{name} {how}")
        stream = stream_of()
        print(f"  {name} {how}: {stream.arrived} of {len(counts)} nodes")


def test_ept_of_billions_of_points():
    """It opens whole, and what lies there is shown in the same bytes."""
    folder, counts = tiles("huge")
    wanted = shown(folder / "ept.json")
    check(not reports, f"{reports}")
    finer = too_fine(1 + max(int(key.partition("-")[0]) for key in counts))
    (folder / "ept-hierarchy" / "0-0-0-0.json").write_text(json.dumps(counts | {"-".join(map(str, key)): count for key, count in finer}))
    with free_memory(None):  # finer nodes lie nowhere: a picture without them can be had
        found = shown(folder / "ept.json")
    said = " ".join(text for _, text in reports)
    told = stream_of().cloud.pages()
    check(told["points"] == POINTS + sum(count for _, count in finer) > 22e9 and told["arrived"] == POINTS, f"{told}")
    check("page " in said and str(folder) in said, said)  # nodes that are no files
    equal(wanted, found, "what lies there")


def test_ept_scalars_and_classes():
    for how in ({}, {"form": 1 + 2}, {"packed": "binary"}):
        folder, _ = tiles("values", 6000, **how)
        for name, least, most in (("intensity", 59000, 60000), ("number_of_returns", 2, 2)):
            shown(folder / "ept.json", scalar=name)
            cloud = stream_of().cloud
            cloud._learn()
            check(cloud.has_scalars and cloud.has_classes and cloud.class_bits[0] == 0b1100, f"{how}: {cloud.class_bits}")
            check(least <= cloud.scalar_range(0.0)[1] <= most, f"{how}: {name} {cloud.scalar_range(0.0)}")


def test_ept_on_a_server():
    folder, counts = tiles("served", 6000)
    wanted = shown(folder / "ept.json")
    for how in ("", "busy", "flaky"):
        built.CACHE.clear()
        new_scene()
        reports.clear()
        with server(folder, how) as (address, asked), in_a_hurry():
            address = address.replace("/served", "/ept.json?key=1/2")
            obj = open_address(address)
            see([obj])
            found = render()
        check(not reports, f"{how}: {reports}")
        equal(wanted, found, how)
        print(f"  {how or 'good'}: {len(asked)} answers for {len(counts)} nodes")


def fails(folder, told, what):
    try:
        shown(folder / "ept.json")
    except RuntimeError as error:
        said = str(error)
    else:
        said = " ".join(text for _, text in reports)
    check(told in said and folder.name in said, f"{what}: {said}")
    print(f"  {what}: {said.strip()[:200]}")


def test_ept_heads_that_are_none():
    folder, _ = tiles("heads", 3000)
    head = json.loads((folder / "ept.json").read_text())
    for change, told in (({"dataType": "zstandard"}, "packed as 'zstandard'"), ({"bounds": [0, 0, 0, 1, 1]}, "bounds, span or scale are none"),
                         ({"bounds": [0, 0, 0, 1, 1, 2]}, "no cube"), ({"span": 0}, "bounds, span or scale"), ({"schema": []}, "none of EPT's"),
                         ({"bounds": "here"}, "none of EPT's"), ({"hierarchyType": "xml"}, "none of EPT's"), ({"span": float("nan")}, "span"),
                         ({"schema": 7}, "none of EPT's")):
        (folder / "ept.json").write_text(json.dumps(head | change))
        fails(folder, told, f"{change}"[:60])
    for text, told in (("{", "ept.json is damaged"), ("[1]", "it holds no object"), ("[" * 100000, "ept.json is damaged"), ("", "ept.json is damaged")):
        (folder / "ept.json").write_text(text)
        fails(folder, told, f"'{text[:8]}'")


def test_ept_hierarchies_that_lie():
    folder, counts = tiles("lies", 6000)
    place, first = folder / "ept-hierarchy/0-0-0-0.json", sorted(counts)[1]
    for change, told in (({"1-0-0-9": 5}, "outside of it"), ({"31-0-0-0": 5}, "outside of it"), ({"1-0-0": 5}, "says '1-0-0': 5"), ({first: -7}, "-7"),
                         ({first: 1 << 40}, "its octree is damaged"), ({first: "many"}, "many"), ({"0-0-0-0": -1}, "read before"),
                         ({"2-0-0-0": -1}, "ept-hierarchy/2-0-0-0.json cannot be read"), ({first: counts[first] + 1}, "where the hierarchy says"),
                         ({first: True}, "True"), (dict.fromkeys(counts, 0), "no node has points")):
        place.write_text(json.dumps(counts | change))
        fails(folder, told, f"{change}"[:60])
    place.write_text("{}")
    fails(folder, "no node has points", "empty")
    place.unlink()
    fails(folder, "cannot be read: No such file", "no hierarchy")


def test_ept_nodes_that_are_none():
    """The others are shown."""
    folder, counts = tiles("nodes", 6000)
    first = sorted(counts)[1]
    path = folder / f"ept-data/{first}.laz"
    good = path.read_bytes()
    noise = np.random.default_rng(3).integers(0, 256, len(good), np.uint8).tobytes()
    other = (folder / f"ept-data/{sorted(counts)[2]}.laz").read_bytes()
    for data, told in ((None, "cannot be read: No such file"), (good[:300], f"{first}.laz"), (noise, f"{first}.laz"), (b"", f"{first}.laz"),
                       (good[:400] + noise[400:], f"{first}.laz"), (other, f"{first}.laz" if counts[sorted(counts)[2]] != counts[first] else "cube")):
        path.unlink(missing_ok=True)
        if data is not None:
            path.write_bytes(data)
        found = None
        try:
            found = shown(folder / "ept.json")
        except RuntimeError as error:
            check(False, str(error))
        said = " ".join(text for _, text in reports)
        check(told in said and "page " in said and str(folder) in said, f"{told}: {said}")
        check(np.isfinite(found["Depth"]).mean() > 0.2, "the others are gone")
        print(f"  {said[:200]}")
    path.write_bytes(good)
    (folder / "ept-data/0-0-0-0.laz").unlink()
    fails(folder, "ept-data/0-0-0-0.laz cannot be read", "the root")


def test_ept_is_not_imported_whole():
    folder, _ = tiles("whole", 3000)
    new_scene()
    try:
        bpy.ops.import_scene.patina_points(filepath=str(folder / "ept.json"))
    except RuntimeError as error:
        check("Enable Link" in str(error), str(error))
    else:
        check(False, "it was imported")
