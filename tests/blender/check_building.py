# SPDX-License-Identifier: GPL-3.0-or-later
"""Linked clouds of large files are built on the disk, and are what they are where they are built in memory."""

import contextlib
import json
import math
import signal
import subprocess
import sys
import time
from pathlib import Path

import bpy
import numpy as np
from check_formats import e57_file
from check_import import import_ply
from harness import SCRATCH, Skip, check, new_scene, render
from patina import choices, jobs, memory, native
from patina.native import building as disk
from patina.read import importers
from patina.read.importers import e57_scans, las, las_header, library
from patina.sync.points import building, linked

bpy.utils.user_resource = lambda kind, path="", create=False: str(SCRATCH)  # no test leaves files with the user

LEAST, COUNT = 10000, 30000  # here, of what is large; points of most files, which are read in five pieces
FAR = np.array([500000.0, 5000000.0, 100.0])


def scan_file(name, count=COUNT, form=3, **changes):
    """A LAS as flown: a wavy ground in three strips, byte colors shifted, two classes, GPS times that do not begin with the least."""
    rng = np.random.default_rng(5)
    records = np.zeros(count, las_header.POINT_FORMATS[form])
    places = np.column_stack([rng.uniform(-2, 2, (count, 2)), np.zeros(count)])
    places[:, 2] = 0.2 * np.sin(3 * places[:, 0]) * np.cos(2 * places[:, 1]) - 6
    for axis, letter in enumerate("XYZ"):
        records[letter] = np.rint(places[:, axis] * 1e4)
    records["intensity"] = rng.integers(1, 5000, count)
    records["raw_classification"] = np.where(places[:, 0] > 0, 5, 2)
    records["point_source_id"] = 7 + np.arange(count) * 3 // count * 2
    records["gps_time"] = 1e5 + 1e-3 * (count // 2 - np.arange(count))
    for shift, channel in enumerate(("red", "green", "blue")):
        records[channel] = rng.integers(1 + shift, 200, count) * 256
    for field, value in changes.items():
        records[field] = value
    ground = np.column_stack([records[letter] for letter in "XYZ"]) * 1e-4 + FAR
    header = bytearray(227)
    header[0:4], header[24:26] = b"LASF", bytes([1, 2])
    header[94:96] = (227).to_bytes(2, "little")
    header[96:100] = (227).to_bytes(4, "little")
    header[104] = form
    header[105:107] = records.dtype.itemsize.to_bytes(2, "little")
    header[107:111] = count.to_bytes(4, "little")
    lower, upper = ground.min(axis=0), ground.max(axis=0)
    box = np.column_stack([upper, lower]).ravel()  # x most, x least, ...
    header[131:227] = np.concatenate([[1e-4] * 3, FAR, box]).astype("<f8").tobytes()
    path = SCRATCH / name
    path.write_bytes(bytes(header) + records.tobytes())
    return path


class Small:
    """Within: files of more than LEAST points are large, and read in pieces of 7000."""

    def __enter__(self):
        self.kept = building.LARGE, las.SMALL_PIECE, library.SMALL_PIECE
        building.LARGE, las.SMALL_PIECE, library.SMALL_PIECE = LEAST, 7000, 7000

    def __exit__(self, *_):
        building.LARGE, las.SMALL_PIECE, library.SMALL_PIECE = self.kept


def forget(source):
    for path in SCRATCH.glob(source.kept.name.split("-")[0] + "-*"):
        path.unlink()


def in_pieces(path, least):
    return jobs.finish(importers.in_pieces(path, least, (), importers.Progress()))


def both(path, **wanted):
    """Built in memory, and on the disk: the bytes of the clouds' files, of their notes and of the scans beside, by ending."""
    source = linked.source(path, **wanted)
    found = []
    for large in (False, True):
        forget(source)
        if large:
            with Small():
                linked.load(source)
        else:
            linked.load(source)
        found.append({ending: place.read_bytes() if place.exists() else None for ending in (".cloud", ".json", ".scan")
                      for place in (source.kept.with_suffix(ending),)})
        if source.analyzed:  # the head says what the cloud took in memory, and a check sum of the head
            head = bytearray(found[-1][".cloud"])
            head[128:136] = head[504:512] = bytes(8)
            found[-1][".cloud"] = bytes(head)
        left = {item.suffix for item in SCRATCH.glob(source.kept.name.split("-")[0] + "-*")}
        check(left <= {".cloud", ".json", ".scan"}, f"left over: {left}")
        check(len(list(SCRATCH.glob(source.kept.name.split("-")[0] + "-*.cloud"))) == 1, "the cloud without an analysis stays")
    return found


def alike(one, other):
    """Of what JSON holds, also within its texts: numbers but for the last digits, that sums in another order change."""
    if isinstance(one, str) and isinstance(other, str) and one[:1] == other[:1] == "[":
        one, other = json.loads(one), json.loads(other)
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=1e-9, abs_tol=1e-9)
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(alike, one, other))
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(alike(one[key], other[key]) for key in one)
    return type(one) is type(other) and one == other


def test_same_files():
    """The cloud, its notes and its scans have the bytes that they have where the file is read whole: whatever a ramp lies over,
    analyzed or not, relative to another origin, without colors."""
    path, black = scan_file("large.las"), scan_file("large_black.las", red=0, green=0, blue=0)
    bare = scan_file("large_bare.las", raw_classification=0, point_source_id=3, intensity=0)
    for what, wanted in ((path, {}), (path, {"scalar": "gps_time"}), (path, {"scalar": "intensity", "analyzed": False}),
                         (path, {"origin": (499999.0, 5000001.0, 90.0), "scalar": "class"}), (black, {"hide_uncolored": True}),
                         (bare, {"scalar": "intensity"}), (path, {"hide_uncolored": True, "scalar": "point_source_id"})):
        whole, pieces = both(what, **wanted)
        for ending in whole:
            check(whole[ending] == pieces[ending], f"{what.name} {wanted}: {ending} differs")
    check(both(path)[1][".scan"] is not None, "no scans")


def test_same_extras():
    """Normals in extra dimensions, by laspy."""
    try:
        import laspy
    except ImportError:
        raise Skip("laspy is not installed here") from None
    header = laspy.LasHeader(point_format=3, version="1.2")
    header.scales, header.offsets = [1e-4] * 3, FAR
    header.add_extra_dims([laspy.ExtraBytesParams(name, "f4") for name in ("NormalX", "NormalY", "NormalZ", "Deviation")])
    data = laspy.LasData(header)
    rng = np.random.default_rng(1)
    data.x, data.y, data.z = (FAR + rng.normal(size=(30000, 3))).T
    for name in ("NormalX", "NormalY", "NormalZ", "Deviation"):
        data[name] = rng.normal(size=30000)
    path = SCRATCH / "large_extras.las"
    data.write(str(path))
    for wanted in ({"scalar": "Deviation"}, {"analyzed": False}):
        whole, pieces = both(path, **wanted)
        check(whole == pieces, f"{wanted}: differs")
    check(linked.load(linked.source(path)).cloud.has_normals, "no normals")


PLACE = (("x", "f8"), ("y", "f8"), ("z", "f8"))
BYTES = (("red", "u1"), ("green", "u1"), ("blue", "u1"))
WIDE = tuple((name, "u2") for name, _ in BYTES)
NORMALS = (("nx", "f4"), ("ny", "f4"), ("nz", "f4"))
SPLATS = tuple((name, "f4") for name in ("f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"))


def ply_file(name, fields, count=COUNT, behind="", **changes):
    """A wavy ground far away, whose other columns are numbers; behind: an element that the points' rows are followed by."""
    rng = np.random.default_rng(6)
    rows = np.zeros(count, [(field, f"<{kind}") for field, kind in fields])
    for field, kind in fields:
        rows[field] = rng.uniform(0.1, 1.0, count) if kind[0] == "f" else rng.integers(0, 7, count)
    for axis in "xyz":
        rows[axis] = rng.uniform(-2, 2, count) + FAR["xyz".index(axis)] if axis != "z" else 0.2 * np.sin(3 * (rows["x"] - FAR[0]))
    rows["x"][::977] = np.nan
    for field, value in changes.items():
        rows[field] = value
    words = {"f8": "double", "f4": "float", "u1": "uchar", "u2": "ushort"}
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\n"
    head += "".join(f"property {words[kind]} {field}\n" for field, kind in fields)
    path = SCRATCH / name
    path.write_bytes((head + behind + "end_header\n").encode() + rows.tobytes() + (bytes([3]) + np.arange(3, dtype="<i4").tobytes() if behind else b""))
    return path


FACE = "element face 1\nproperty list uchar int vertex_indices\n"


def test_same_ply():
    """The same of PLYs: colors of bytes, of 16 bits, black ones; classes and scalars; splats; faces behind normals; one whose faces give it
    normals, which is read whole."""
    whole = ply_file("large.ply", (*PLACE, *BYTES, *NORMALS, ("classification", "u1"), ("scan", "u1"), ("heat", "f4")))
    for what, wanted in ((whole, {"scalar": "heat"}), (whole, {"origin": (499999.0, 5000001.0, 90.0), "analyzed": False}),
                         (ply_file("large_wide.ply", (*PLACE, *WIDE)), {}),
                         (ply_file("large_black.ply", (*PLACE, *BYTES, *NORMALS), red=0, green=0, blue=0, nx=0, ny=0, nz=0), {"analyzed": False}),
                         (SCRATCH / "large_black.ply", {"hide_uncolored": True}),
                         (ply_file("large_hidden.ply", (*PLACE, *BYTES), red=0, green=0), {"hide_uncolored": True}),
                         (ply_file("large_uncolored.ply", PLACE), {"hide_uncolored": True}),
                         (ply_file("large_mesh.ply", (*PLACE, *NORMALS), behind=FACE), {"analyzed": False}),
                         (ply_file("large_splats.ply", (*PLACE, *SPLATS)), {"scalar": "opacity"}),
                         (ply_file("large_splats2.ply", (*PLACE, *SPLATS)), {"hide_uncolored": True}),
                         (ply_file("large_faces.ply", PLACE, behind=FACE), {})):
        check((in_pieces(what, LEAST) is None) == (what.name == "large_faces.ply"), f"{what.name}: not read as it should be")
        in_memory, pieces = both(what, **wanted)
        for ending in in_memory:
            check(in_memory[ending] == pieces[ending], f"{what.name} {wanted}: {ending} differs")
    check(in_pieces(whole, COUNT) is None, "a small PLY in pieces")
    shown_uncolored(SCRATCH / "large_black.ply")


def test_many_lists():
    """A PLY with many rows of lists, which would have to be gone through at one go, is read whole, wherever they lie; opening and reading
    follow the progress, and end with it."""
    path, most = ply_file("large_lists.ply", (*PLACE, *NORMALS), behind=FACE), library.MOST_LISTS
    library.MOST_LISTS = 0
    try:
        check(in_pieces(path, LEAST) is None, "many lists in pieces")
        check(in_pieces(ply_file("large_rows.ply", PLACE, behind="element camera 3\nproperty float x\n"), LEAST) is not None, "rows without lists")
    finally:
        library.MOST_LISTS = most
    for at in (0, 1):
        progress, ended = importers.Progress(), False
        try:
            if at == 0:
                progress.cancel()
            pieces, reading = jobs.finish(importers.in_pieces(path, LEAST, (), progress)), progress.part(0, 1)
            with Small():
                each = pieces.each(reading)
                next(each)
                reading._native.cancel()  # as one does who does not look between pieces
                next(each)
        except native.PatinaCancelled:
            ended = True
        check(ended, f"not cancelled {('at the opening', 'between windows')[at]}")


def scanned(count, seed, **more):
    """A wavy ground in a scan of an E57 (check_formats.e57_file)."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-2, 2, (2, count))
    found = {f"cartesian{axis}": ("float", (), values) for axis, values in zip("XYZ", (x, y, 0.2 * np.sin(3 * x) * np.cos(2 * y)), strict=True)}
    found["cartesianInvalidState"] = ("integer", (0, 2), np.arange(count) % 331 == 7)
    for name in ("Red", "Green", "Blue"):
        found[f"color{name}"] = ("integer", (0, 255), rng.integers(1, 200, count))
    found["intensity"] = ("float", (), rng.uniform(0, 1, count))
    found["classification"] = ("integer", (0, 255), rng.integers(1, 7, count))
    return found | more


def same_e57(path, **wanted):
    check(in_pieces(path, LEAST) is not None, f"{path.name} is read whole")
    whole, pieces = both(path, **wanted)
    for ending in (".cloud", ".scan"):
        check(whole[ending] == pieces[ending], f"{path.name} {wanted}: {ending} differs")
    check(alike(json.loads(whole[".json"]), json.loads(pieces[".json"])), f"{path.name} {wanted}: the notes differ")
    return pieces


def shown_uncolored(path):
    """Both ways: where all points are black, Hide Uncolored shows them as those of a cloud without colors."""
    source = linked.source(path, hide_uncolored=True)
    for large in (False, True):
        forget(source)
        with Small() if large else contextlib.nullcontext():
            cloud = linked.load(source).cloud
        check(cloud.drawn > 20000 and not cloud.has_colors and not cloud.has_opacities, f"{path.name}: {cloud.drawn} points, colors {cloud.has_colors}")


def zeros(count, seed, **more):
    """A scan that has all columns, of nothing but zeros."""
    found = scanned(count, seed)
    for name in ("colorRed", "colorGreen", "colorBlue", "intensity", "classification"):
        found[name] = (*found[name][:2], np.zeros(count))
    return found | {f"nor:normal{axis}": ("float", (), np.zeros(count)) for axis in "XYZ"} | more


def test_same_e57():
    """The same of an E57 of two scans, of which one has no classes; of one whose columns are zero everywhere; of scans of which one has
    no valid point; one with a grid is read whole."""
    turned = ((0.8, 0.0, 0.0, 0.6), (500010.0, 5000000.0, 4.0))
    second = scanned(20000, 2, pose=turned)
    del second["classification"]
    path = e57_file("large.e57", scanned(30000, 1, pose=((1.0, 0.0, 0.0, 0.0), (500000.0, 5000000.0, 3.0))), second)
    size, e57_scans.SMALL_PIECE = e57_scans.SMALL_PIECE, 7000
    try:
        for wanted in ({"scalar": "intensity"}, {"analyzed": False, "origin": (499999.0, 5000001.0, 90.0)}, {"hide_uncolored": True}):
            same_e57(path, **wanted)
        check(same_e57(path)[".scan"] is not None, "no scans")
        nothing = e57_file("large_zero.e57", zeros(30000, 4))
        for wanted in ({"scalar": "intensity"}, {"analyzed": False}, {"hide_uncolored": True}):
            same_e57(nothing, **wanted)
        shown_uncolored(nothing)
        gone = {"cartesianInvalidState": ("integer", (0, 2), np.full(12000, 2))}
        posed = [((1.0, 0.0, 0.0, 0.0), (x, 0.0, 3.0)) for x in (1.0, -1.0)]
        for name, first, second in (("large_first.e57", {}, gone), ("large_second.e57", gone, {})):
            path = e57_file(name, scanned(12000, 5, pose=posed[0], **first), scanned(12000, 6, pose=posed[1], **second))
            check(same_e57(path)[".scan"] is None, f"{name}: several scans")
        many = [scanned(12, seed, pose=((1.0, 0.0, 0.0, 0.0), (0.001 * seed, 0.0, 3.0))) for seed in range(1030)]
        check(same_e57(e57_file("large_many.e57", *many))[".scan"] is None, "more scans than are graded")
        gridded = scanned(12000, 3, rowIndex=("integer", (0, 200), np.arange(12000) // 100), columnIndex=("integer", (0, 200), np.arange(12000) % 100))
        check(in_pieces(e57_file("large_grid.e57", gridded), LEAST) is None, "a grid in pieces")
    finally:
        e57_scans.SMALL_PIECE = size


def test_cut_ply():
    """A PLY that ends too early is refused by both ways, with one message."""
    path = ply_file("large_whole.ply", (*PLACE, *BYTES))
    cut = SCRATCH / "large_cut.ply"
    cut.write_bytes(path.read_bytes()[:-400])
    source = linked.source(cut)
    with Small():
        try:
            linked.load(source)
        except native.PatinaError as error:
            check("cut short" in str(error) and f"{COUNT} rows" in str(error), str(error))
        else:
            check(False, "a cut file was read")
    check(not source.kept.exists(), "a cloud was kept")


def test_same_picture():
    path = scan_file("large_picture.las")
    pictures = []
    for large in (False, True):
        forget(linked.source(path))
        new_scene()
        if large:
            with Small():
                obj, = import_ply(path, link=True)
        else:
            obj, = import_ply(path, link=True)
        obj.location = (-2, -2, -8)
        pictures.append(render())
        check(tuple(obj["patina_origin"]) != (0.0, 0.0, 0.0), "no origin")
    for name, pixels in pictures[0].items():
        check(np.array_equal(pixels, pictures[1][name], equal_nan=True), f"{name} differs")


def test_cancelled_and_cut():
    """Who cancels, loses interest, or has a file that ends too early finds nothing left; the next time it is read."""
    path = scan_file("large_cancelled.las")
    source = linked.source(path)
    before = set(SCRATCH.iterdir())
    with Small():
        total = sum(1 for _ in linked.steps(source, importers.Progress()))
        forget(source)
        for at in range(0, total, 2):
            progress = importers.Progress()
            steps = linked.steps(source, progress)
            for _ in range(at + 1):
                next(steps)
            if at % 4:
                steps.close()
            else:
                progress.cancel()
                try:
                    for _ in steps:
                        pass
                except native.PatinaError as error:
                    check(error.code == native.CANCELLED, str(error))
            check(not source.kept.exists(), f"step {at}: a cloud was kept")
            forget(source)
            check(set(SCRATCH.iterdir()) == before, f"step {at}: {set(SCRATCH.iterdir()) - before}")
        cut = SCRATCH / "large_cut.las"
        cut.write_bytes(path.read_bytes()[:-40])
        try:
            linked.load(linked.source(cut))
        except native.PatinaError as error:
            check(any(f"ends after {COUNT - lost:,} of {COUNT:,}" in str(error) for lost in (1, 2)), str(error))
        else:
            check(False, "a cut file was read")
        check(linked.load(source).cloud.count == COUNT, "the next time it is read")


class OnDisk:
    """Within: whoever analyzes in memory fails; told are the caps of what is analyzed on the disk, whose cap is this."""

    def __init__(self, memory=0):
        self.memory, self.told = memory, []

    def __enter__(self):
        self.kept = native.Cloud.start_analysis, native.Cloud.analyse, disk.start_analysis, choices.cloud_bytes
        native.Cloud.start_analysis = native.Cloud.analyse = lambda *_arguments, **_more: check(False, "analyzed in memory")
        disk.start_analysis, choices.cloud_bytes = self._start, lambda: self.memory
        return self.told

    def _start(self, cloud, path, to, memory, progress, **given):
        self.told.append((memory, path.name, to.name, sorted(name for name, value in given.items() if value is not None and value is not False)))
        return self.kept[2](cloud, path, to, memory, progress, **given)

    def __exit__(self, *_):
        native.Cloud.start_analysis, native.Cloud.analyse, disk.start_analysis, choices.cloud_bytes = self.kept


def without_head(place):
    """A cloud's file without what its head says of memory, and the check sum of that."""
    data = bytearray(place.read_bytes())
    data[128:136] = data[504:512] = bytes(8)
    return bytes(data)


def test_analyzed_on_the_disk():
    """What was built on the disk is analyzed there, below the cap, to the same bytes, with the scanners of its file; what it says meanwhile;
    smaller files are analyzed in memory."""
    count, cap = 300000, 1 << 24
    path = scan_file("large_disk.las", count)
    source, bare = linked.source(path), linked.source(path, analyzed=False)
    with Small():
        linked.load(bare)
    check(bare.kept.stat().st_size + 36 * count > cap, "all of it fits")
    cloud = native.Cloud.open(bare.kept)
    cloud.analyse()
    cloud.start_save(SCRATCH / "wanted").result()
    progress, seen = importers.Progress(), []
    with Small(), OnDisk(cap) as told:
        steps = linked.steps(source, progress)
        while True:
            try:
                task = next(steps)
            except StopIteration as end:
                cloud = end.value.cloud
                break
            while not task.done():
                seen.append((progress.doing, progress.value()))
                time.sleep(0.002)
    check(told == [(cap, bare.kept.name, source.kept.name, [])], f"{told}")
    check(cloud.has_shapes and cloud.bytes < 4 * count, f"{cloud.bytes} bytes of {count} points are in memory")
    check(source.kept.read_bytes() == (SCRATCH / "wanted").read_bytes() and bare.kept.exists(), "other bytes")
    values = [value for doing, value in seen if doing == "Analyzing 300,000 points on the disk"]
    check(values and values == sorted(values) and 2 / 3 <= values[0] < values[-1] <= 1.0, f"{values}")
    scans = [scanned(20000, seed, pose=((1.0, 0.0, 0.0, 0.0), (x, 0.0, 3.0))) for seed, x in ((1, 2.0), (2, -2.0))]
    path = e57_file("large_disk.e57", *scans)
    whole, _ = both(path)
    forget(linked.source(path))
    with Small(), OnDisk() as told:
        linked.load(linked.source(path))
    check(len(told) == 1 and {"station", "stations", "free_space"} <= set(told[0][3]), f"{told}")
    check(without_head(linked.source(path).kept) == whole[".cloud"], "other bytes with stations")
    check(not linked.source(path, analyzed=False).kept.exists(), "the cloud without an analysis stays")
    small = linked.source(scan_file("large_not.las", 20000))
    try:
        with OnDisk() as told:
            linked.load(small)
    except AssertionError as error:
        check("analyzed in memory" in str(error) and not told, str(error))
    else:
        check(False, "a small file is analyzed on the disk")


def test_made_meanwhile():
    """Another Blender analyzes the cloud and lets go what was built, just before this one begins: that cloud is taken."""
    path = scan_file("large_meanwhile.las")
    source, bare = linked.source(path), linked.source(path, analyzed=False)
    with Small():
        linked.load(source)
    files = {place: place.read_bytes() for place in (source.kept.with_suffix(ending) for ending in (".cloud", ".json", ".scan"))}
    forget(source)
    start = disk.start_analysis

    def meanwhile(*arguments, **more):
        for place, data in files.items():
            place.write_bytes(data)
        bare.kept.unlink()
        return start(*arguments, **more)

    with Small(), OnDisk():
        disk.start_analysis = meanwhile
        check(linked.load(source).cloud.has_shapes, "not analyzed")
    check(source.kept.read_bytes() == files[source.kept], "another cloud")


def test_no_room_to_analyze():
    """Where the disk has room for what was built, and not for what an analysis finds: that stays in memory, where it fits, else what is
    wrong is said. What was built stays, and nothing is left beside it."""
    try:
        import resource
    except ImportError:
        raise Skip("this system does not limit what a process may write") from None
    path = scan_file("large_no_room.las")
    source, bare = linked.source(path), linked.source(path, analyzed=False)
    with Small():
        linked.load(bare)
    before = set(SCRATCH.iterdir())
    limits, heard, free = resource.getrlimit(resource.RLIMIT_FSIZE), signal.signal(signal.SIGXFSZ, signal.SIG_IGN), memory.free
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (bare.kept.stat().st_size + 1000, limits[1]))
        with Small():
            check(linked.load(source).cloud.has_shapes, "not analyzed")
            check(not source.kept.exists(), "a cloud is kept")
            memory.free = lambda: 1000
            try:
                linked.load(source)
            except native.PatinaError as error:
                check(error.code == native.FILE and str(source.kept) in str(error), str(error))
            else:
                check(False, "analyzed without room")
    finally:
        memory.free = free
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, heard)
    left = {item for item in set(SCRATCH.iterdir()) - before if item != source.kept.with_suffix(".scan")}
    check(bare.kept.exists() and not left, f"left over: {left}")
    with Small():
        check(linked.load(source).cloud.has_shapes and source.kept.exists(), "with room")


def test_goes_on_behind_the_build():
    """Whoever ends between build and analysis goes on from the cloud that was built."""
    path = scan_file("large_half.las")
    source = linked.source(path)
    with Small():
        linked.load(linked.source(path, analyzed=False))
        read = las._pieces
        las._pieces = lambda *arguments: 1 / 0
        try:
            check(linked.load(source).cloud.has_shapes, "not analyzed")
        finally:
            las._pieces = read
    check(linked.source(path, analyzed=False).kept.exists(), "another object's cloud is gone")


def test_full_disk():
    """The disk is asked before anything is written; a file that memory holds is read whole then, others say what is wrong."""
    path = scan_file("large_full.las")
    source = linked.source(path)
    begin = building.Builder.add

    def full(*_arguments, **_more):
        raise native.PatinaError("building it takes 3.0 GB on the disk, which has 1.0 GB left", native.FILE)

    free, building.Builder.add = memory.free, full
    try:
        with Small():
            check(linked.load(source).cloud.count == COUNT, "not read whole")
            forget(source)
            memory.free = lambda: 1000
            try:
                linked.load(source)
            except native.PatinaError as error:
                check("which has 1.0 GB left" in str(error), str(error))
            else:
                check(False, "built without room")
    finally:
        memory.free, building.Builder.add = free, begin
    check(not source.kept.exists(), "something was kept")


OTHER = """
import os
import sys
sys.path.insert(0, {here!r})
import check_building
from pathlib import Path
check_building.bpy.utils.user_resource = lambda kind, path="", create=False: {folder!r}
with check_building.Small():
    print("begins", flush=True)
    check_building.linked.load(check_building.linked.source(Path({path!r})))
    print("has it", flush=True)
os._exit(0)  # the bpy module may hang in its own clean-up
"""


def other(path):
    """Another Blender, which builds the cloud of a file in this one's folder."""
    text = OTHER.format(here=str(Path(__file__).resolve().parent), folder=str(SCRATCH), path=str(path))
    program = [bpy.app.binary_path, "-b", "--factory-startup", "--python-use-system-env", "--python-expr"] if bpy.app.binary_path else [sys.executable, "-c"]
    return subprocess.Popen([*program, text], stdout=subprocess.PIPE, bufsize=0)  # begins() takes no byte of what follows


def begins(process):
    check(any(line.strip() == b"begins" for line in process.stdout), "it did not begin")


def test_two_at_once():
    """Two Blenders build one cloud at a time; then one of them is killed: each time there is one whole cloud, and nothing beside."""
    path = scan_file("large_two.las", 60000)
    source = linked.source(path)
    with Small():
        linked.load(source)
    wanted = source.kept.read_bytes()
    for kill in (False, True):
        forget(source)
        both = [other(path) for _ in range(2)]
        for process in both:
            begins(process)
        if kill:
            time.sleep(0.3)
            both[0].kill()
        told = [process.communicate(timeout=300)[0].decode() for process in both]
        check("has it" in told[1] and (kill or "has it" in told[0]), f"{told}")
        check(source.kept.read_bytes() == wanted, "another cloud")
        with Small():
            check(linked.load(source).cloud.has_shapes, "not analyzed")
        left = {item.suffix for item in SCRATCH.glob(source.kept.name.split("-")[0] + "-*")}
        check(kill or left == {".cloud", ".json", ".scan"}, f"left over: {left}")


def test_killed():
    """Killed at any moment: the next time the cloud is built, or found, and is whole."""
    path = scan_file("large_killed.las", 60000)
    source = linked.source(path)
    with Small():
        linked.load(source)
    wanted = source.kept.read_bytes()
    for wait in (0.1, 0.5, "built"):
        forget(source)
        process = other(path)
        begins(process)
        while wait == "built" and not linked.source(path, analyzed=False).kept.exists() and process.poll() is None:
            time.sleep(0.005)
        time.sleep(0.1 if wait == "built" else wait)  # built: it is being analyzed
        process.kill()
        process.communicate()
        with Small():
            linked.load(source)
        check(source.kept.read_bytes() == wanted, f"killed after {wait}: another cloud")
        left = {item.suffix for item in SCRATCH.glob(source.kept.name.split("-")[0] + "-*")}
        check(left <= {".cloud", ".json", ".scan"}, f"killed after {wait}: left over: {left}")
