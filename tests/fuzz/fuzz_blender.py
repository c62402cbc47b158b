# SPDX-License-Identifier: GPL-3.0-or-later
"""Changed styles, properties as a stranger's .blend may hold them, notes of kept clouds and addresses. In Blender, or with the bpy module:

    PATINA_LIBRARY=... python tests/fuzz/fuzz_blender.py --runs 200 [READER ...]
    blender -b --factory-startup --python-exit-code 1 --python tests/fuzz/fuzz_blender.py -- --runs 200 [READER ...]
"""

import json
import os
import re
import sys
from pathlib import Path

sys.dont_write_bytecode = True
HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parents[0] / "blender")]
import bpy  # noqa: E402
import fuzzer  # noqa: E402
import harness  # noqa: E402
import mutate  # noqa: E402
from fuzzer import Reader, Refused  # noqa: E402
from patina import native  # noqa: E402
from patina.read.importers.reading import told  # noqa: E402
from patina.styles import styles  # noqa: E402
from patina.sync.points import kept  # noqa: E402

os.environ["BLENDER_USER_SCRIPTS"] = str(harness.SCRATCH)
GROUPS = {"scene": lambda: bpy.context.scene, "points": lambda: bpy.data.objects["points"], "layer": lambda: bpy.context.view_layer,
          "light": lambda: bpy.data.lights[0], "world": lambda: bpy.context.scene.world, "camera": lambda: bpy.context.scene.camera}


def stage():
    scene = harness.new_scene(24, 18)
    harness.add_points(*harness.sphere(150, 1.0, (0, 0, -4)))
    harness.add_light('SUN', 2.0)
    scene.world = bpy.data.worlds.new("world")
    return scene


def style_read(data):
    scene = bpy.context.scene if "points" in bpy.data.objects else stage()
    folder = styles.own_folder(create=True)
    path = folder / "input.json"
    path.write_bytes(data)
    styles.entries()
    try:
        styles.read(path)
        notices = styles.apply_to_scene(scene, "input")
        scene.patina.style.notice = "; ".join(notices)
    finally:
        path.unlink()
        styles._entry.cache_clear()


def style_seeds():
    return [path.read_bytes() for path in sorted(styles.SHIPPED.glob("*.json"))]


# ---- what a .blend holds


def values_of(group):
    """All that may be set of a group of properties, by its path: as a .blend holds it, whatever its type."""
    found = {}
    for item in group.bl_rna.properties:
        if item.identifier in {"rna_type", "name"} or item.is_readonly and item.type != 'POINTER':
            continue
        if item.type == 'POINTER':
            value = getattr(group, item.identifier)
            if isinstance(value, bpy.types.PropertyGroup):
                found[item.identifier] = values_of(value)
        elif item.type in {'BOOLEAN', 'INT', 'FLOAT'}:
            value = getattr(group, item.identifier)
            found[item.identifier] = list(value) if getattr(item, "is_array", False) else value
        elif item.type == 'ENUM':
            found[item.identifier] = 1
        elif item.type == 'STRING':
            found[item.identifier] = getattr(group, item.identifier)
    return found


def blend_seeds():
    stage()
    return [json.dumps({name: values_of(owner().patina) for name, owner in GROUPS.items() if hasattr(owner(), "patina")}).encode()]


def _put(owner, values):
    """Into the custom properties beneath the group: nothing checks types, limits or names there, as nothing does in a file."""
    try:
        owner["patina"] = values
    except (TypeError, ValueError, OverflowError, UnicodeError, RecursionError, KeyError):  # no file can hold it
        return False
    return True


def blend_change(data, chance, others):
    """A few properties alone, so that one does not hide the others' effect."""
    values = json.loads(data)
    for name in list(values):
        if chance.random() < 0.5:
            values[name] = {}
        elif isinstance(values[name], dict):
            values[name] = _some(mutate.change_json(values[name], chance), chance)
    return json.dumps(values).encode("utf-8", "surrogatepass")


def _some(values, chance):
    if not isinstance(values, dict):
        return values
    return {name: _some(value, chance) for name, value in values.items() if chance.random() < 0.5}


def _small(value, key=""):
    """Images, shadows and samples that take minutes are what they say, and no fault."""
    if isinstance(value, dict):
        return {name: _small(part, name) for name, part in value.items()}
    if isinstance(value, (int, float)) and not isinstance(value, bool) and any(
            part in key for part in ("samples", "resolution", "iterations", "layers", "shells", "error", "noise", "size", "tile", "width", "height", "frames")):
        return min(max(value, -5), 5) if value == value else value
    return value


OURS = re.compile(r"\(\w+\.py:\d+\)$")  # how the engine tells of a fault of our own


def draw(scene):
    """An image. Refused with what the engine reports; AssertionError where that is a fault of ours, or obeyed by a terminal."""
    scene.update_tag()
    bpy.context.view_layer.update()
    scene.render.engine = 'PATINA'
    harness.reports.clear()
    failed = ""
    try:
        bpy.ops.render.render()
    except RuntimeError as error:
        failed = " ".join(str(error).split())
    for text in (failed, *(told(text) for _, text in harness.reports)):
        assert not OURS.search(text), text
        assert not fuzzer.controls(text), f"control characters in {text[:200]!r}"
    if failed:
        raise Refused(failed[:1000])


def blend_read(data):
    """The file's properties, its panels' reads, and an image."""
    scene = stage()
    values = _small(json.loads(data))
    for name, owner in GROUPS.items():
        if name in values and hasattr(owner(), "patina"):
            _put(owner(), values[name])
            values_of(owner().patina)
    for handler in (*bpy.app.handlers.load_post, *bpy.app.handlers.save_pre):
        if handler.__module__.startswith("patina"):
            handler(None)
    draw(scene)


# ---- links

LINKS = ("//scan.ply", "/nowhere/scan.laz", "scan.####.ply", "http://127.0.0.1:9/x.copc.laz", "https://127.0.0.1:9/ept.json", "ftp://127.0.0.1/x.laz",
         "file:///etc/passwd", "/dev/zero", "/dev/null", "/", "//", "", ".", "//../../..", "x" * 300, "x" * 5000 + ".ply", "a\x1b[31m.ply", "\u202egpj.ply", "~/x.ply",
         "//server/share/x.ply", "\\\\server\\share\\x.ply", "C:\\x.ply", "CON.ply", "%s%n.ply", "http://", "https://[::1", "http://\u0661:99999999/x.copc.laz", "//" + "#" * 400 + ".ply",
         "//x.ply\n", "http://user:password@127.0.0.1:9/x.copc.laz", "x.cloud", "x.e57", "x.pcd", "x.conf", "x.unknown")


def link_change(data, chance, _others):
    text = chance.choice(LINKS)
    for _ in range(chance.choice((0, 0, 1, 2))):
        at = chance.randrange(len(text) + 1)
        text = text[:at] + chance.choice(("/", "..", "#", ":", "%00", "\n", " ", "\u00e9", "@", "?", "x" * 200, ".ply", "//")) + text[at:]
    return text.encode()


def link_read(data):
    """An object that links such a place draws, or says why it does not; nothing is asked on the network."""
    scene = stage()
    obj = bpy.data.objects["points"]
    obj.patina.linked_file = data.decode("utf-8", "replace")
    draw(scene)


# ---- beside kept clouds


def notes_seeds():
    return [json.dumps({"origin": [1.0, 2.0, 3.0], "scanners": [0.0] * 6, "units": [1.0, 1.0], "told": "two scans",
                        "scans": {"name": "scan", "numbers": [0.0, 1.0]}}).encode()]


def notes_read(data):
    path = harness.SCRATCH / "notes.json"
    path.write_bytes(data)
    kept.read_notes(path)


READERS = {
    "style": Reader(style_seeds, mutate.json_change, style_read, (styles.StyleError,)),
    "blend": Reader(blend_seeds, blend_change, blend_read, (Refused, native.PatinaError), 0.3),
    "link": Reader(lambda: [b""], link_change, link_read, (Refused, native.PatinaError), 0.5),
    "notes": Reader(notes_seeds, mutate.json_change, notes_read, (ValueError, OSError)),
}

arguments = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else sys.argv[1:] if Path(sys.argv[0]).name == Path(__file__).name else []
code = fuzzer.main(READERS, arguments)
sys.stdout.flush()
os._exit(code)
