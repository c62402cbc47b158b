# SPDX-License-Identifier: GPL-3.0-or-later
"""COPC without conversion: the picture of a flat import, of no more points than it shows; from a disk, and from servers good and bad."""

import http.server
import sys
import threading
import time
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

import bpy
import numpy as np
from check_formats import with_laspy
from copc_files import claim, points_of, too_fine, write_copc
from harness import SCRATCH, check, new_scene, render, reports, sphere, stats
from mathutils import Matrix
from patina import memory, native
from patina.read import streaming
from patina.read.importers import PointFile
from patina.sync.points import addresses, built, edits, linked, origin
from patina.sync.points import made as points_made
from range_server import Server

bpy.utils.user_resource = lambda kind, path="", create=False: str(SCRATCH)  # no test leaves files with the user

POINTS = 30000


def made(name, count=POINTS, offset=(0.0, 0.0, 0.0), **how):
    with_laspy()
    path = SCRATCH / name
    records, positions = points_of(count, offset, **{key: how.pop(key) for key in ("seed", "wide") if key in how})
    return path, write_copc(path, records, offset, **how), positions


def see(objects, z=-4.0):
    for obj in objects:
        obj.matrix_world = Matrix.Translation((0, 0, z)) @ obj.matrix_world


def import_copc(path, stream):
    before = set(bpy.data.objects)
    result = bpy.ops.import_scene.patina_points(filepath=str(path), link=True, stream=stream)
    check(result == {'FINISHED'}, f"{result}")
    return [obj for obj in bpy.data.objects if obj not in before]


@contextmanager
def free_memory(size):
    """As long as this lasts so many bytes are free; None: nobody tells."""
    told = memory.free
    memory.free = lambda: size
    try:
        yield
    finally:
        memory.free = told


def stream_of():
    """Of the one cloud that is there."""
    found = streaming.streams_of(cloud for _, cloud in built.CACHE._entries.values())
    check(len(found) == 1, f"{len(found)} streams")
    return found[0]


def same(flat, streamed, what):
    """The same depths. Colors are means of points within a layer distance, which follows each chunk's spacing: other chunks, others."""
    deep = np.isfinite(flat["Depth"]) & np.isfinite(streamed["Depth"])
    other = np.isfinite(flat["Depth"]) != np.isfinite(streamed["Depth"])
    off = np.abs(np.where(deep, flat["Depth"], 0) - np.where(deep, streamed["Depth"], 0)) > 1e-5
    far = np.abs(flat["Combined"] - streamed["Combined"]).max(axis=-1)
    print(f"  {what}: {(off | other).sum()} depths differ; colors: {(far > 2e-3).mean():.2%} by more than 0.002, the most {far.max():.4f}")
    check(deep.mean() > 0.3 and (off | other).mean() < 0.001, f"{what}: depths differ")
    check((far > 2e-3).mean() < 0.04 and far.max() < 0.05, f"{what}: colors differ")


def flat_and_streamed(path):
    """Passes of two renders: of the file read whole, and of it streamed."""
    pictures = []
    for stream in ('OFF', 'ON'):
        built.CACHE.clear()
        new_scene()
        objects = import_copc(path, stream)
        objects[0].patina.analysis = 'OFF'
        see(objects)
        pictures.append(render())
    return pictures


def test_same_picture_as_flat():
    for name, offset, how in (("plain.copc.laz", (0, 0, 0), {}), ("far.copc.laz", (485000.0, 5428000.0, 300.0), {"pages": True}),
                              ("wide.copc.laz", (0, 0, 0), {"wide": True})):
        path, entries, _ = made(name, offset=offset, **how)
        pictures = flat_and_streamed(path)
        check(f"{POINTS:,} points" in stats[-1] and not reports, f"{stats[-1]} {reports}")
        same(*pictures, name)
        stream = stream_of()
        check(0 < stream.arrived <= len(entries), f"{stream.arrived} pages of {len(entries)}")
        print(f"  {name}: {stream.arrived} of {len(entries)} pages")


def test_exported_copc():
    """What is exported as COPC comes back by laspy and by streaming: the same points, colors and classes, none twice, coarse ones evenly
    spread; laspy finds those of a box and of a level; the picture as needed is the one of the whole file."""
    with_laspy()
    import laspy
    new_scene()
    rng = np.random.default_rng(4)
    positions, _, normals = sphere(POINTS * 2, 1.0, (0, 0, 0))
    colors = np.concatenate([rng.integers(0, 256, (len(positions), 3)), np.full((len(positions), 1), 255)], 1).astype(np.uint8)
    classes = (2 + (positions[:, 2] > 0)).astype(np.int8)
    points = PointFile("scan", positions.astype(np.float32), normals.astype(np.float32), colors, {"class": classes, "point_source_id": np.arange(len(positions), dtype=np.float32)},
                       (485000.0, 5428000.0, 300.0), 0, {})
    obj = bpy.data.objects.new("scan", points_made.to_data(replace(points), cloud=False))
    origin.place(obj, points.origin, origin.shared(bpy.context.scene, points.origin))
    bpy.context.scene.collection.objects.link(obj)
    obj.select_set(True)
    path = SCRATCH / "out.copc.laz"
    path.unlink(missing_ok=True)
    bpy.ops.export_scene.patina_points(filepath=str(path), kind='COPC')
    with laspy.CopcReader.open(path) as reader:
        back = reader.query()
        levels = [reader.query(level=level) for level in range(2)]
        upper = reader.query(bounds=laspy.copc.Bounds(np.array((485000.0, 5428000.0, 300.0)), np.array((485002.0, 5428002.0, 302.0))))
        spacing = reader.copc_info.spacing
    check(len(back) == len(positions) == sum(map(len, levels)), f"{[len(level) for level in levels]} of {len(positions)} points")
    found = np.column_stack([np.column_stack([back.x, back.y, back.z]) - (485000, 5428000, 300), back.red, back.green, back.blue, back.classification])
    given = np.column_stack([positions, colors[:, :3].astype(int) * 257, classes])
    check((np.sort(back.point_source_id) == np.arange(len(positions))).all(), "points are twice there")
    check(np.abs(found - given[back.point_source_id]).max() < 1e-4, "other points, colors or classes")
    inside = (positions > 0).all(axis=1).sum()
    check(abs(len(upper) - inside) <= 3, f"{len(upper)} points in the box of {inside}")
    coarse = np.floor((np.column_stack([levels[0].x, levels[0].y, levels[0].z]) - (484998, 5427998, 298)) / spacing)
    check(len(np.unique(coarse, axis=0)) > 0.6 * len(coarse) > 6000, f"{len(np.unique(coarse, axis=0))} places of {len(coarse)} coarse points")
    pictures = flat_and_streamed(path)
    check(f"{len(positions):,} points" in stats[-1] and not reports, f"{stats[-1]} {reports}")
    deep = [np.isfinite(picture["Depth"]) for picture in pictures]
    check(deep[0].mean() > 0.3 and (deep[0] != deep[1]).mean() < 0.001, "depths differ")


def test_what_asks_for_the_whole():
    """Edits and fields are of all points: of those that come as needed pictures are drawn without, and say so."""
    path, _, _ = made("edited.copc.laz")
    built.CACHE.clear()
    new_scene()
    objects = import_copc(path, 'ON')
    see(objects)
    plain = render()
    item = objects[0].patina.points.scans.add()
    item.name, item.number, item.gain = "All points", edits.ALL, 4.0
    objects[0].patina.soft.use, objects[0].patina.soft.by = True, 'LUMINANCE'
    edited = render()
    check(np.array_equal(plain["Combined"], edited["Combined"]), "the picture changed")
    bpy.context.view_layer.objects.active = objects[0]
    try:
        bpy.ops.object.patina_points_select_all(action='SELECT')
        check(False, "points were selected")
    except RuntimeError as error:
        check("read as needed" in str(error), f"{error}")
    for word in ("neither hidden nor graded", "to be soft by"):
        check(any(word in text for _, text in reports), f"{word}: {reports}")


def test_more_than_memory_is_told_beforehand():
    path, entries, _ = made("much.copc.laz")
    built.CACHE.clear()
    new_scene()
    see(import_copc(path, 'ON'))
    with free_memory(400_000), suppress(RuntimeError):
        bpy.ops.render.render()
    check(any("points that are not there yet and take 0.0 GB" in text for _, text in reports), f"{reports}")
    time.sleep(1.0)
    stream_of().advance()
    check(stream_of().arrived == 0 and not stream_of().busy, "points were fetched")
    check(np.isfinite(render()["Depth"]).any(), "nothing is drawn once there is room")


def test_only_what_is_seen():
    path, entries, positions = made("seen.copc.laz", 60000)
    built.CACHE.clear()
    scene = new_scene()
    see(import_copc(path, 'ON'), -1.15)
    scene.camera.data.lens = 300
    picture = render()
    check(np.isfinite(picture["Depth"]).mean() > 0.1, "nothing is seen")
    stream = stream_of()
    print(f"  {stream.arrived} of {len(entries)} pages, {stream.cloud.pages()['arrived']:,} of {len(positions):,} points")
    check(stream.arrived < 0.7 * len(entries), f"{stream.arrived} of {len(entries)} pages")
    check(any("Fetching" in text and "MB" in text for text in stats), f"{stats[:8]}")


def test_scalars_and_classes():
    path, _, _ = made("values.copc.laz")
    built.CACHE.clear()
    new_scene()
    obj, = import_copc(path, 'ON')
    obj.patina.colors.source = 'SCALAR'
    obj.patina.colors.scalar = "intensity"
    built.CACHE.clear()  # the one with the file's colours
    see([obj])
    render()
    cloud = stream_of().cloud
    cloud._learn()
    check(cloud.has_scalars and cloud.has_classes and cloud.class_bits[0] == 0b1100, f"{cloud.class_bits}")
    low, high = cloud.scalar_range(0.0)
    check(0 <= low < 500 and 59000 < high <= 60000, f"{low} to {high}")


def test_a_small_one_is_read_whole():
    path, _, _ = made("small.copc.laz")
    built.CACHE.clear()
    new_scene()
    obj, = import_copc(path, 'AUTO')
    see([obj])
    render()
    check(not streaming.streams_of(cloud for _, cloud in built.CACHE._entries.values()), "it is streamed")
    obj.patina.stream = 'ON'
    render()
    check(stream_of().cloud.count == POINTS, "it is not streamed")


def held():
    """Bytes of this process that lie in memory."""
    return 4096 * int(Path("/proc/self/statm").read_text().split()[1]) if sys.platform == "linux" else 0


def test_files_of_billions_of_points():
    """Such a file opens whole: what of it can be read is there, in the same bytes as without the rest, and the rest takes no memory."""
    path, entries, _ = made("few.copc.laz")
    huge, finer = SCRATCH / "huge.copc.laz", too_fine(1 + max(key[0] for key, *_ in entries))
    claim(path, huge, entries, finer)
    total = POINTS + sum(count for _, count in finer)
    pictures = []
    for name in (path, huge):
        built.CACHE.clear()
        new_scene()
        reports.clear()
        before = held()
        objects = import_copc(name, 'ON' if name is path else 'AUTO')
        objects[0].patina.analysis = 'OFF'
        see(objects)
        if name is huge:
            with suppress(RuntimeError):
                bpy.ops.render.render()
            check(any("not there yet and take 5" in text for _, text in reports), f"{reports}")
        with free_memory(None):  # its finer pages lie nowhere: a picture without them can be had
            pictures.append(render())
        told = stream_of().cloud.pages()
        print(f"  {told['arrived']:,} of {told['points']:,} points, {(held() - before) / 1e6:.0f} MB more in memory")
        check(told["points"] == (POINTS if name is path else total) and told["arrived"] == POINTS, f"{told}")
        check(held() - before < 500e6, f"{(held() - before) / 1e6:.0f} MB")
    said = " ".join(text for _, text in reports)
    check(total > 22e9 and str(huge) in said and "page " in said, said)  # pages that lie nowhere
    for plane, pixels in pictures[0].items():
        check((pixels == pictures[1][plane]).all(), f"{plane} differs")
    print(f"  {said}")


def test_the_order_of_nodes():
    """Parents come before what they hold, and of one depth nodes lie along Morton's curve, at any depth: what a picture sees has few numbers between
    that it does not see, however large the file is."""
    sys.path.append(str(Path(streaming.__file__).parent))  # the reader runs in a process of its own, where its modules are at hand
    import copc
    random = np.random.default_rng(5)
    nodes = np.zeros(500, copc.ENTRY)
    nodes["key"][:, 0] = random.integers(0, 31, len(nodes))
    nodes["key"][:, 1:] = random.integers(0, 1 << 30, (len(nodes), 3)) >> (30 - nodes["key"][:, :1])
    interleaved = [(int(key[0]), sum((int(key[3 - axis]) >> bit & 1) << (3 * bit + axis) for bit in range(30) for axis in range(3)))
                   for key in copc.in_order(nodes)["key"]]
    check(interleaved == sorted(interleaved), "not along the curve")

    levels, a_node, a_part = 10, 63000, 1 << 26  # ground of 22 billion points
    ground = np.zeros(sum(4 ** level for level in range(levels)), copc.ENTRY)
    ground["key"] = np.concatenate([np.stack([np.full(4 ** level, level), *(axis.ravel() for axis in np.indices((2 ** level, 2 ** level))),
                                              np.zeros(4 ** level, int)], 1) for level in range(levels)])
    keys = copc.in_order(ground)["key"]
    side = 0.5 ** keys[:, 0]
    away = (keys[:, 1:3] + 0.5) * side[:, None] - (0.3, 0.4)
    seen = (np.abs(away[:, 1]) < np.tan(np.radians(5)) * np.abs(away[:, 0]) + side) & (away[:, 0] > -side)  # along x
    each = a_part // a_node
    windows = sum(int(np.ptp(np.flatnonzero(part)) + 1) for part in np.split(seen, range(each, len(seen), each)) if part.any())
    print(f"  {seen.sum() * a_node / 1e9:.2f} of {len(keys) * a_node / 1e9:.1f} billion points in view, {windows * a_node / 1e9:.2f} have numbers")
    check(windows < 2 * seen.sum(), f"{windows} pages have numbers, {seen.sum()} are in view")


def test_a_page_holds_less_than_a_part():
    """More than a page of a file ever has."""
    box, parents = np.tile([0.0, 0.0, 0.0, 1.0, 1.0, 1.0], (2, 1)), np.full(2, -1)
    for counts, good in (([1 << 30, 1 << 30], True), ([1, (1 << 31) - 1], False)):
        try:
            native.Cloud.begin(box, np.ones(2), np.array(counts, np.uint32), parents, "", False, False, ([0.0] * 3, [1.0] * 3))
        except native.PatinaError as error:
            check(not good and "page 1 has 2147483647 points" in str(error), str(error))
        else:
            check(good, "a page larger than a part is taken")


def test_damaged_files():
    path, entries, _ = made("damaged.copc.laz")
    good = path.read_bytes()
    noise = bytes(np.random.default_rng(1).integers(0, 256, 200, np.uint8))
    for name, at, what, told in (("head", entries[3][1] + 40, b"\xff" * 40, "its layers are longer"), ("page", entries[3][1] + 120, noise, "page "),
                                 ("tree", 469, b"\xff" * 8, "cannot be read"), ("short", None, None, "cannot be read"),
                                 ("laszip", 589 + 2, b"nobody", "does not say how its points are packed")):
        bad = SCRATCH / f"bad-{name}.copc.laz"
        bad.write_bytes(good[:800] if at is None else good[:at] + what + good[at + len(what):])
        built.CACHE.clear()
        new_scene()
        reports.clear()
        try:
            objects = import_copc(bad, 'ON')
        except RuntimeError as error:
            check(name not in {"head", "page"} and (told in str(error) or "bad-" in str(error)), str(error))
            continue
        see(objects)
        render()
        said = " ".join(text for _, text in reports)
        check(name in {"head", "page"} and str(bad) in said and told in said, f"{name}: {said}")
        print(f"  {said}")


# ---- servers -------------------------------------------------------------------------------------------------------------


@contextmanager
def server(path, how=""):
    asked = []
    running = http.server.ThreadingHTTPServer(("127.0.0.1", 0), partial(Server, path, how, asked))
    running.daemon_threads = True
    threading.Thread(target=running.serve_forever, args=(0.02,), daemon=True).start()
    try:
        yield f"http://127.0.0.1:{running.server_address[1]}/{path.name}", asked
    finally:
        running.shutdown()
        running.server_close()


@contextmanager
def in_a_hurry():
    kept = streaming.TIMEOUT, streaming.WAIT
    online, addresses.online = addresses.online, lambda: True
    streaming.TIMEOUT, streaming.WAIT = 0.4, 0.02
    try:
        yield
    finally:
        (streaming.TIMEOUT, streaming.WAIT), addresses.online = kept, online


def open_address(address):
    before = set(bpy.data.objects)
    check(bpy.ops.import_scene.patina_address(address=address) == {'FINISHED'}, "not opened")
    obj, = [obj for obj in bpy.data.objects if obj not in before]
    return obj


def test_address():
    path, entries, _ = made("served.copc.laz")
    built.CACHE.clear()
    new_scene()
    see(import_copc(path, 'ON'))
    local = render()
    for how in ("", "slow", "busy", "flaky"):
        built.CACHE.clear()
        new_scene()
        with server(path, how) as (address, asked), in_a_hurry():
            obj = open_address(address)
            check(obj.patina.linked_file == address and obj.name == "served", f"{obj.name} {obj.patina.linked_file}")
            see([obj])
            found = render()
        check(not reports, f"{how}: {reports}")
        for name, pixels in local.items():
            check((pixels == found[name]).all(), f"{how}: {name} differs")
        size = sum(last + 1 - first for first, last in asked)
        print(f"  {how or 'good'}: {len(asked)} ranges, {size:,} bytes of {path.stat().st_size:,}")


def test_servers_that_fail():
    path, _, _ = made("fails.copc.laz", 8000)
    for how, told in (("hangs", "does not answer in time"), ("cut", "cut the connection"), ("garbage", "page "), ("other", "a different part"),
                      ("refuses", "answers 404"), ("whole", "sends no parts of files")):
        built.CACHE.clear()
        new_scene()
        reports.clear()
        with server(path, how) as (address, _), in_a_hurry():
            try:
                see([open_address(address)])
            except RuntimeError as error:
                check(how in {"refuses", "whole"}, str(error))
                said = str(error)
            else:
                render()
                said = " ".join(text for _, text in reports)
        check(told in said and address in said, f"{how}: {said}")
        print(f"  {how}: {said.strip()}")


def test_nothing_is_fetched_unasked():
    path, _, _ = made("unasked.copc.laz", 3000)
    built.CACHE.clear()
    new_scene()
    online, addresses.online = addresses.online, lambda: False
    try:
        with server(path) as (address, asked):
            try:
                bpy.ops.import_scene.patina_address(address=address)
            except RuntimeError as error:
                check("online" in str(error).lower(), str(error))
            else:
                check(False, "it was fetched")
            check(not asked, f"{asked}")
            obj = bpy.data.objects.new("there", linked.box_mesh("there", ((0, 0, 0), (1, 1, 1))))
            bpy.context.scene.collection.objects.link(obj)
            obj.patina.linked_file = address
            render()
            check(not asked and any("online" in text.lower() for _, text in reports), f"{asked} {reports}")
            for bad in ("ftp://127.0.0.1/x.copc.laz", "file:///etc/passwd"):
                try:
                    addresses.check(bad)
                except native.PatinaError as error:
                    check("only http" in str(error), str(error))
                else:
                    check(False, f"{bad} is an address")
    finally:
        addresses.online = online


def test_ends_with_its_cloud():
    path, _, _ = made("ends.copc.laz", 3000)
    built.CACHE.clear()
    new_scene()
    see(import_copc(path, 'ON'))
    render()
    stream = stream_of()
    process, place = stream._process, stream._place
    check(process.poll() is None and place.is_dir(), "not there")
    del stream
    built.CACHE.clear()
    new_scene()
    import gc
    gc.collect()
    check(process.poll() is not None and not place.is_dir(), "the process or its folder stays")
