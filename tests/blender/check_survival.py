# SPDX-License-Identifier: GPL-3.0-or-later
"""What is kept on the disk survives killed processes, flipped bytes, disks with coarse times and folders that go; styles are written whole or not at
all. tests/files/test_caches.py does the same without Blender."""

import json
import os
import random
import shutil
import time
from contextlib import contextmanager, nullcontext
from unittest import mock

import bpy
import numpy as np
from check_building import scan_file
from check_files import places
from check_import import import_ply
from check_kept import forget
from check_linked import dense
from check_preferences import enabled
from harness import SCRATCH, Skip, check, forget_files, new_scene, read_only, render
from patina.read import importers
from patina.styles import styles
from patina.sync.points import edits, files, linked


@contextmanager
def reads_nothing():
    """Within: no scan is read."""
    with mock.patch.object(importers, "steps", lambda *_: 1 / 0):
        yield


def test_flipped_notes():
    """Any byte of what lies beside a kept cloud: it says the same, or is made anew, and nobody shows other scans or another place."""
    source = linked.source(scan_file("flipped.las", 3000), analyzed=False)
    good = linked.load(source)
    wanted = (good.origin, good.scanners, good.units, good.scans, good.told, edits.scans_of(good.cloud).tobytes())
    check(good.scans is not None and len(good.scans.numbers) == 3, f"{good.scans}")
    chance, made = random.Random(7), 0
    for ending, places_tried in ((".json", None), (".scan", 12)):
        path = source.kept.with_suffix(ending)
        whole = path.read_bytes()
        for place in chance.sample(range(len(whole)), min(len(whole), places_tried or 60)):
            forget()
            data = bytearray(whole)
            data[place] ^= 1 << chance.randrange(8)
            path.unlink()
            path.write_bytes(data)
            found = linked.load(source)
            check((found.origin, found.scanners, found.units, found.scans, found.told, edits.scans_of(found.cloud).tobytes()) == wanted,
                  f"byte {place} of {ending}: {data[max(place - 20, 0):place + 20]}")
            made += path.read_bytes() == whole
    check(made > 60, f"{made} were made anew")


def test_notes_of_older_versions():
    """Without check sums they are good, too; what a newer version adds says nothing here."""
    source = linked.source(dense("older.ply", 3000), analyzed=False)
    linked.load(source)
    path = source.kept.with_suffix(".json")
    notes = json.loads(path.read_text("utf-8"))
    del notes["sum"]
    for more in ({}, {"newer": [1, {"a": 2}]}):
        path.write_text(json.dumps(notes | more), "utf-8")
        with reads_nothing():
            check(linked.load(source).cloud.count == 3000, "read anew")
    for text in ("[" * 100_000, "9" * 5000, json.dumps(notes | {"sum": 1})):
        path.write_text(text, "utf-8")
        check(linked.load(source).cloud.count == 3000, text[:30])


def test_leftovers_go():
    """What killed processes left half-written, of clouds that nobody builds any more, goes when the next cloud is built."""
    first = linked.source(dense("left_first.ply", 2000), analyzed=False)
    linked.load(first)
    folder = first.kept.parent
    old = "0123456789abcdef01234567-0123456789ab-01234567"
    ours = [f"{old}.cloud.part", f"{old}.cloud.part3", f"{old}.scan.99-1.part", f"{old}.json.99.part", f"{old}.cloud.7-0.part",
            "0123456789abcdef01234567-packed.ply.99-4.part"]
    theirs = ["film.mkv.part", f"{old}.mkv.part", f"{old}.part"]
    for name in ours + theirs:
        (folder / name).write_bytes(b"half")
    linked.load(linked.source(dense("left_second.ply", 2100), analyzed=False))
    left = [name for name in ours if (folder / name).exists()]
    check(not left, f"{left} stay")
    check(all((folder / name).exists() for name in theirs), "somebody else's file went")
    for name in theirs:
        (folder / name).unlink()


def test_times_of_whole_seconds():
    """Where a disk knows whole seconds alone, a file that changes within one is read anew the next time."""
    path = dense("seconds.ply", 2000)
    now = int(time.time())
    os.utime(path, (now, now))
    check(linked.load(linked.source(path, analyzed=False)).cloud.count == 2000, "loaded")
    moved = dense("seconds_moved.ply", 2000, offset=(0, 0, -5)).read_bytes()
    check(len(moved) == path.stat().st_size and moved != path.read_bytes(), "of one size")
    path.write_bytes(moved)
    os.utime(path, (now, now))
    forget()
    found = linked.load(linked.source(path, analyzed=False))
    check(found.box[0][2] + found.origin[2] < -5.5, f"the box of the file before: {found.box} from {found.origin}")
    os.utime(path, (now - 100, now - 100))
    forget()
    source = linked.source(path, analyzed=False)
    linked.load(source)
    forget()
    with reads_nothing():
        linked.load(source)


def test_packed_file_is_half_written():
    """A packed file that was put down by halves, or damaged since, is put down anew."""
    base, scan = places("half")
    new_scene()
    forget_files()
    obj, = import_ply(scan, link=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(base / "half.blend"))
    bpy.ops.file.pack_all()
    whole = scan.read_bytes()
    place = files.path_of(obj)
    for data in (whole[:len(whole) // 2], b"", bytes(len(whole))):
        place.write_bytes(data)
        files._unpacked.clear()
        check(files.path_of(obj) == place and place.read_bytes() == whole, f"{len(data)} bytes stay")


def test_cache_folder_goes():
    """The folder is deleted, read-only, no folder or nowhere during the session: pictures go on."""
    path, folder = dense("gone_folder.ply", 2000), SCRATCH / "going"
    with enabled() as chosen:
        chosen.cache_folder = str(folder)
        new_scene().camera.location.z = 5.0
        obj, = import_ply(path, link=True)
        wanted = render()
        check((wanted["Combined"][..., 3] > 0).any(), "nothing is drawn")
        check(any(folder.glob("*.cloud")), "kept elsewhere")
        shutil.rmtree(folder)
        for case in ("deleted", "a file", "nowhere", "read-only"):
            forget()
            if case == "a file":
                shutil.rmtree(folder, ignore_errors=True)
                folder.write_bytes(b"x")
            elif case == "nowhere":
                chosen.cache_folder = "/proc/nowhere/patina"
            elif case == "read-only":
                folder.unlink()
                chosen.cache_folder = str(folder)
            with read_only(folder) if case == "read-only" else nullcontext():
                picture = render()
            check(all(np.array_equal(picture[name], pixels) for name, pixels in wanted.items()), case)
        check(not any(folder.iterdir()), "the folder was not read-only")


@contextmanager
def full_disk():
    """Within: files grow to 20 bytes and no further."""
    if os.name == "nt":
        raise Skip("Windows limits no sizes of files")
    import resource
    import signal
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def test_styles_are_written_whole():
    """A disk that is full while a style is saved, or loaded from elsewhere, leaves the one before."""
    new_scene()
    path, other = styles.own_folder(create=True) / "whole.json", SCRATCH / "elsewhere/whole.json"
    other.parent.mkdir()
    styles.write(path, styles.Style("Before"))
    good = path.read_bytes()
    after = styles.Style("Afterwards", "About " * 20)
    styles.write(other, after)
    for work in (lambda: styles.write(path, after), lambda: bpy.ops.patina.load_style(filepath=str(other))):
        try:
            with full_disk():
                work()
        except (styles.StyleError, RuntimeError) as error:
            check(f"{path}: File too large" in str(error), str(error))
        else:
            check(False, "it was written")
        check(path.read_bytes() == good and not list(path.parent.glob("*.part")), f"{path.read_bytes()}")
    path.unlink()


def test_hostile_styles():
    """Pipes, numbers of thousands of digits, and names with commands: a sentence on one line."""
    folder = styles.own_folder(create=True)
    path = folder / "hostile.json"
    evil = "\\u001b]0;x\\u0007\\n" * 3
    for text, wanted in (('{"patina_style": ' + "9" * 5000 + "}", "no valid JSON"), ('{"patina_style": "' + "x" * 50_000 + '"}', "of version"),
                         ('{"patina_style": 1, "points": {"opacity": "' + evil + "y" * 50_000 + '"}}', "points.opacity is"),
                         ('{"patina_style": 1, "view": {"transform": [' + "1," * 20_000 + "1]}}", "view.transform is")):
        path.write_text(text, encoding="utf-8")
        try:
            styles.read(path)
        except styles.StyleError as error:
            said = str(error)
            check(wanted in said and len(said) < 400 and said.isprintable(), said[:500])
        else:
            check(False, f"{text[:60]} was read")
    path.write_text('{"patina_style": 1, "name": "' + evil + "n" * 5000 + '", "about": "' + evil + '", "points": {"' + evil + '": 1}}', encoding="utf-8")
    found = styles.read(path)
    check(found.label.isprintable() and len(found.label) <= 100 and found.about.isprintable(), repr(found.label))
    check(all(key.isprintable() for key in found.unknown), f"{found.unknown}")
    path.unlink()
    if os.name != "nt":
        os.mkfifo(path)
        for call in (lambda: styles.read(path), styles.entries):
            try:
                call()
            except styles.StyleError as error:
                check("is a folder, device or pipe" in str(error), str(error))
        path.unlink()
