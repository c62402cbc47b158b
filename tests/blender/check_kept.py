# SPDX-License-Identifier: GPL-3.0-or-later
"""What is kept of linked clouds on the disk: where, one for each way that objects show a file, and what becomes of damage."""

import os
import random
import tempfile
from contextlib import nullcontext
from pathlib import Path

import bpy
import numpy as np
from check_import import import_ply
from check_linked import dense
from harness import SCRATCH, check, new_scene, patina, read_only, render
from patina.read.importers import library
from patina.sync.points import built, kept, linked


def forget():
    """As a new session."""
    built.CACHE.clear()
    kept.CHECKS.clear()
    kept.CHECKS._seen.clear()


def test_without_a_home():
    """Where Blender has no folder of user data, nothing falls into the current one."""
    honest, here, temporary = bpy.utils.user_resource, os.getcwd(), tempfile.tempdir
    work, locked = SCRATCH / "work", SCRATCH / "locked"
    work.mkdir(exist_ok=True)
    os.chdir(work)
    tempfile.tempdir = str(SCRATCH)
    path = dense("homeless.ply")
    try:
        for answer in ("", "/proc/nowhere/patina", str(locked)):
            with read_only(locked) if answer == str(locked) else nullcontext():
                asked = []
                bpy.utils.user_resource = lambda *_, answer=answer, asked=asked, **options: asked.append(options) or answer
                found = linked.load(linked.source(path))
                check(found.cloud.count == 20000, "loaded")
                check(not any(options.get("create") for options in asked), "Blender prints a traceback where it cannot create a folder")
                check(not list(work.iterdir()), f"the current folder holds {list(work.iterdir())}")
                place = linked.source(path).kept
                check(place.is_absolute() and place.exists() and place.parent.parent == SCRATCH, f"kept as {place}")
                check(place.parent.stat().st_mode & 0o077 == 0, "others may look into it")
        check(not list(locked.iterdir()), "the folder was not read-only")
    finally:
        os.chdir(here)
        bpy.utils.user_resource, tempfile.tempdir = honest, temporary


def test_two_ways_of_one_file():
    """Objects that link one file with ramps of different attributes keep a cloud each; what is kept of the file as it was goes."""
    path = dense("two_ways.ply")
    first, second = (linked.source(path, scalar=name) for name in ("", "intensity"))
    for source in (first, second):
        linked.load(source)
    read, library.steps = library.steps, lambda *arguments: 1 / 0
    try:
        for source in (first, second):
            check(linked.load(source).cloud.count == 20000, "opened from what was kept")
    finally:
        library.steps = read
    os.utime(path, (1, 1))
    linked.load(linked.source(path))
    check(not first.kept.exists() and not second.kept.exists(), "what was kept of the file before stays")


def test_notes_that_are_none():
    """A JSON that is no object, or lacks something, is written anew."""
    path = dense("notes.ply")
    source = linked.source(path)
    linked.load(source)
    notes = source.kept.with_suffix(".json")
    good = notes.read_text("utf-8")
    for text in ("[1, 2]", "3", "null", '"text"', "{}", '{"origin": [0, 0]}', '{"origin": ["a", 0, 0]}', '{"origin": [0, 0, 0], "scanners": 7}',
                 "{", "\udcff".encode("utf-8", "surrogateescape").decode("latin-1")):
        notes.write_text(text, "utf-8")
        check(linked.load(source).cloud.count == 20000, text)
        check(notes.read_text("utf-8") == good, f"{text} stays")


def test_damage_is_found():
    """Random bytes over the points of a kept cloud: the picture is the right one all the same, and the file is mended."""
    path = dense("damaged.ply", 60000)
    new_scene().camera.location.z = 5.0  # scans lie at zero
    import_ply(path, link=True)
    wanted = render()
    check((wanted["Combined"][..., 3] > 0).any(), "nothing is drawn")
    source = linked.source(path)
    whole = source.kept.read_bytes()
    random.seed(4)
    changed = 0
    for _ in range(30):
        forget()
        at = random.randrange(1 << 16, len(whole) - 64)
        if not any(whole[at:at + 64]):  # the rest of a section
            continue
        changed += 1
        source.kept.unlink()
        source.kept.write_bytes(whole[:at] + bytes(random.randrange(256) for _ in range(64)) + whole[at + 64:])
        picture = render()
        check(all(np.array_equal(pixels, picture[name]) for name, pixels in wanted.items()), f"damage at {at} shows")
        patina.native.Cloud.start_verifying(source.kept).result()
    check(changed > 20, f"{changed} tries")
    forget()
    read, library.steps = library.steps, lambda *arguments: 1 / 0
    try:
        check(all(np.array_equal(pixels, wanted[name]) for name, pixels in render().items()), "what was mended is not used")
    finally:
        library.steps = read
    check(Path(source.kept).exists(), "kept")
