# SPDX-License-Identifier: GPL-3.0-or-later
"""What files of strangers may do: .github/SECURITY.md, line by line. Python's audit events tell what the add-on does meanwhile."""

import json
import os
import sys
import tempfile
import types
from contextlib import contextmanager
from pathlib import Path
from unittest import mock

import bpy
import numpy as np
from harness import SCRATCH, add_points, check, forget_files, new_scene, patina, render, sphere
from patina.read import readers
from patina.styles import styles
from patina.sync.points import addresses, built, kept

FOLDER = SCRATCH / "strangers"
MARK = FOLDER / "it-ran"
CODE = f"__import__('os').system('touch {MARK}')"
WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT
_events: list[tuple[str, tuple]] | None = None
CHANGES = {"os.mkdir": 0, "os.remove": 0, "os.rename": 1, "os.rmdir": 0, "os.link": 1, "os.symlink": 1, "os.chmod": 0, "shutil.move": 1,
           "shutil.copyfile": 1, "os.truncate": 0}  # which of an event's arguments is what it writes to


def _hook(event, arguments):
    if _events is not None:
        _events.append((event, arguments))


sys.addaudithook(_hook)


@contextmanager
def recorded():
    """What happens: the events of the block."""
    global _events
    FOLDER.mkdir(exist_ok=True)
    MARK.unlink(missing_ok=True)
    _events = found = []
    try:
        yield found
    finally:
        _events = None


def files(*folders):
    return {str(path): (path.stat().st_size, path.stat().st_mtime_ns) for folder in folders for path in Path(folder).rglob("*") if path.is_file()}


def check_events(events, processes=()):
    """Nothing was run but processes of the add-on's own scripts, nothing was written but in the cache and in folders for temporary files, and
    nobody was asked on the network."""
    ours = [str(place) for place in (kept.folder(), Path(tempfile.gettempdir()))]
    for event, arguments in events:
        check(event != "exec" or MARK.name not in str(arguments[0].co_consts), "a text of the file was run")
        check(event not in {"os.system", "os.exec", "os.fork", "os.forkpty", "os.posix_spawn", "os.startfile", "pty.spawn", "code.__new__"}, f"{event}{arguments}")
        check(not event.startswith(("socket.connect", "socket.getaddrinfo", "socket.sendto", "urllib.")), f"{event}{arguments}")
        if event == "compile":
            check(MARK.name not in str(arguments[0]), f"compiled: {arguments}")
        if event == "subprocess.Popen":
            words = [os.fspath(word) for word in arguments[1]]
            check(any(word.endswith(processes) for word in words), f"started: {words}")
        written = None
        if event == "open" and isinstance(arguments[0], (str, bytes)):
            written = arguments[0] if isinstance(arguments[2], int) and arguments[2] & WRITES else None
        elif event in CHANGES:
            written = arguments[CHANGES[event]]
        if isinstance(written, (str, bytes)) and os.fsdecode(written) != os.devnull:
            place = os.path.realpath(os.fsdecode(written))
            check(any(place.startswith(os.path.realpath(own)) for own in ours), f"{event} {place}")
    check(not MARK.exists(), "a text of the file was run")


def texts_of(group, found=()):
    """Every text property of a group and of those within it, with its owner."""
    found = list(found)
    for item in group.bl_rna.properties:
        if item.identifier in {"rna_type", "name"}:
            continue
        if item.type == 'POINTER' and isinstance(getattr(group, item.identifier), bpy.types.PropertyGroup):
            found = texts_of(getattr(group, item.identifier), found)
        elif item.type == 'STRING' and not item.is_readonly:
            found.append((group, item.identifier))
    return found


def hostile_blend():
    """A file in which every text of the add-on is a program, a path that leads elsewhere, or an address."""
    scene = new_scene(32, 24)
    values = [CODE, f"#{CODE}", "//../../../../../../tmp/x", f"$(touch {MARK})", f"`touch {MARK}`", "http://127.0.0.1:9/x.copc.laz", "\\\\127.0.0.1\\share\\x.ply"]
    objects = [add_points(*sphere(100, 1.0, (0, 0, -4)), name=f"points {CODE} {number}") for number in range(len(values))]
    for obj, value in zip(objects, values):
        for owner, name in texts_of(obj.patina):
            setattr(owner, name, value)
        obj.data["patina_scans"] = value
    for owner in (scene, scene.view_layers[0], scene.camera, scene.camera.data):
        for group, name in texts_of(owner.patina) if hasattr(owner, "patina") else ():
            setattr(group, name, CODE)
    scene.camera.name = CODE
    path = FOLDER / "hostile.blend"
    FOLDER.mkdir(exist_ok=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False)
    return path


def test_a_blend_runs_and_writes_nothing():
    path = hostile_blend()
    before = files(FOLDER)
    built.CACHE.clear()
    with recorded() as events, mock.patch.object(addresses, "online", lambda: False):
        bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False)
        try:
            render()
        except RuntimeError:
            pass  # it has links to what is nowhere
    check_events(events)
    check(files(FOLDER) == before, f"{set(files(FOLDER)) ^ set(before)}")
    check(any(event == "open" for event, _ in events), "no event was heard")


def test_a_packed_scan_goes_to_the_cache():
    """Whatever its path says: what Blender packed is put down under a name of its content."""
    folder = FOLDER / "packed"
    folder.mkdir(parents=True, exist_ok=True)
    scan = folder / "scan.xyz"
    scan.write_text("".join(f"{i % 5} {i % 7} -4\n" for i in range(60)))
    new_scene(32, 24)
    forget_files()
    bpy.ops.import_scene.patina_points(filepath=str(scan), link=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "packed.blend"), check_existing=False)
    obj = bpy.context.view_layer.objects.active
    bpy.ops.file.pack_all()
    check(obj.patina.linked_data.packed_file, "Blender packed nothing")
    obj.patina.linked_data.filepath = "//../elsewhere/../../x.xyz"
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "packed.blend"), check_existing=False)
    scan.unlink()
    before = files(FOLDER)
    built.CACHE.clear()
    with recorded() as events:
        bpy.ops.wm.open_mainfile(filepath=str(folder / "packed.blend"), load_ui=False)
        picture = render()
    check_events(events, ("reader.py", "main.py"))
    check(picture["Combined"][..., 3].any(), "the packed points are not drawn")
    check(files(FOLDER) == before, f"{set(files(FOLDER)) ^ set(before)}")


def test_a_style_sets_its_own_properties_alone():
    new_scene(32, 24)
    add_points(*sphere(100, 1.0, (0, 0, -4)))
    scene = bpy.context.scene
    state = (scene.render.filepath, scene.render.engine, len(bpy.data.texts), scene.frame_end)
    given = FOLDER / "odd.json"
    FOLDER.mkdir(exist_ok=True)
    given.with_suffix(".png").write_bytes(b"a thumbnail")
    given.write_text(json.dumps({
        "patina_style": 1, "name": f"../../{CODE}", "about": CODE,
        "scene": {"render.filepath": "/tmp/x", "__class__": CODE, "studio.__init__": CODE, "version": 99, "id_data.render.engine": "CYCLES", "shadow_file": "/tmp/x"},
        "points": {"linked_file": "/etc/passwd", "address": "http://127.0.0.1:9/x.copc.laz", "modifiers": CODE},
        "view": {"transform": CODE, "look": CODE}}))
    with mock.patch.object(styles, "own_folder", lambda create=False: FOLDER / "own"), recorded() as events:
        (FOLDER / "own").mkdir(exist_ok=True)
        bpy.ops.patina.load_style(filepath=str(given))
    outside = [event for event in events if event[0] != "open" or str(FOLDER / "own") not in str(event[1][0])]
    check_events([event for event in outside if str(FOLDER / "own") not in str(event[1])])
    check((scene.render.filepath, scene.render.engine, len(bpy.data.texts), scene.frame_end) == state, "it set what no style has")
    check(bpy.data.objects["points"].patina.linked_file == "" and bpy.data.objects["points"].patina.address == "", "it linked a file")
    check({path.name for path in (FOLDER / "own").iterdir()} == {"odd.json", "odd.png"}, f"{list((FOLDER / 'own').iterdir())}")


def test_a_cloud_is_data():
    """Texts of a cloud's file, such as names of attributes and of coordinate systems, are no code, and reading one writes nothing."""
    folder = FOLDER / "clouds"
    folder.mkdir(parents=True, exist_ok=True)
    rows = "".join(f"{i} {i % 7} -4 {i}\n" for i in range(40))
    text = "__import__('os').abort()"
    (folder / "a.ply").write_text(f"ply\nformat ascii 1.0\ncomment {CODE}\nelement vertex 40\nproperty float x\nproperty float y\nproperty float z\n"
                                  f"property float {text}\nend_header\n{rows}")
    (folder / "b.csv").write_text(f"x,y,z,{text}\n" + rows.replace(" ", ","))
    (folder / "c.pcd").write_text(f"VERSION .7\nFIELDS x y z {text}\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 40\nHEIGHT 1\nPOINTS 40\nDATA ascii\n{rows}")
    (folder / "d.las").write_bytes(_las_with(CODE.encode()))
    before = files(folder)
    for path in sorted(folder.iterdir()):
        for link in (False, True):
            new_scene(32, 24)
            built.CACHE.clear()
            with recorded() as events:
                bpy.ops.import_scene.patina_points(filepath=str(path), link=link)
                render()
            check_events(events, ("reader.py", "main.py"))
            check(bpy.context.view_layer.objects.active is not None, f"{path.name} was not imported")
    check(files(folder) == before, "reading wrote beside the scans")


def _las_with(text):
    import struct
    head, record = bytearray(227), struct.pack("<H16sHH32s", 0, b"LASF_Projection", 2112, len(text), text[:32]) + text
    head[:4], head[24:26] = b"LASF", bytes([1, 2])
    head[26:58] = text[:32].ljust(32, b"\0")
    struct.pack_into("<HIIBHI", head, 94, 227, 227 + len(record), 1, 0, 20, 40)
    struct.pack_into("<12d", head, 131, 0.1, 0.1, 0.1, 0, 0, 0, 4, 0, 0, 0, -4, -4)
    return bytes(head) + record + b"".join(struct.pack("<iii8x", i, 0, -40) for i in range(40))


def test_network_is_asked_for():
    """An address of a file is fetched only where Blender may go online, and the artist opened it in this session; or in the background, where
    somebody started this Blender to draw that file."""
    address = "http://127.0.0.1:9/x.copc.laz"
    window = types.SimpleNamespace(app=types.SimpleNamespace(background=False, online_access=True))
    addresses.forget()
    with mock.patch.object(addresses, "online", lambda: True), mock.patch.object(addresses, "bpy", window):
        check("Open Address" in addresses.refusal(address), addresses.refusal(address))
        addresses.open_once(address)
        check(addresses.refusal(address) == "", addresses.refusal(address))
        check(addresses.refusal(address + "x") != "", "another address was opened along")
        for other in ("ftp://127.0.0.1/x", "file:///etc/passwd", "//server/share", "javascript:x"):
            addresses.open_once(other)
            check("only http" in addresses.refusal(other), other)
    with mock.patch.object(addresses, "online", lambda: False):
        check("online" in addresses.refusal(address).lower(), addresses.refusal(address))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with mock.patch.object(addresses, "online", lambda: True), mock.patch.object(addresses, "bpy", window):
        check("Open Address" in addresses.refusal(address), "another file was loaded, and its address may still be fetched")
    addresses.forget()


def test_nothing_is_asked_at_start():
    """Registering the add-on, its panels' reads and a new scene reach for no network; readers are installed by a click alone."""
    with recorded() as events:
        patina.unregister()
        patina.register()
        new_scene(32, 24)
        add_points(*sphere(100, 1.0, (0, 0, -4)))
        for name in ("lazrs", "pye57"):
            readers.lacks(name)
        render()
    check_events(events)
    check(np.isfinite(render()["Combined"]).all(), "no image")
