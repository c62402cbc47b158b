# SPDX-License-Identifier: GPL-3.0-or-later
"""Installs the packed add-on as a user does, renders with it, removes it again. After build/package:

    blender -b --factory-startup --python-exit-code 1 --python tests/blender/test_package.py
    python tests/blender/test_package.py        (with the bpy module)

BLENDER_USER_SCRIPTS, _CONFIG and _EXTENSIONS must name throwaway folders, PATINA_LIBRARY must not be set.
"""
import importlib
import importlib.machinery
import importlib.util
import io
import math
import os
import re
import signal
import struct
import subprocess
import sys
import tempfile
import traceback
import zipfile
from pathlib import Path

import bpy

# isort: split
import addon_utils  # is there once bpy is

ROOT = Path(__file__).resolve().parents[2]
LEGACY = bpy.app.version < (4, 2, 0)
MODULE = "patina" if LEGACY else "bl_ext.user_default.patina"


def package():
    zips = sorted((ROOT / "build/out/packages").glob("patina-*.zip"))
    zips = [path for path in zips if path.stem.endswith("-legacy") == LEGACY]
    assert len(zips) == 1, f"run build/package first: {zips}"
    return str(zips[0])


def test_says_what_it_does():
    """Packing compiles for minutes the first time: it says so before."""
    with subprocess.Popen([ROOT / "build/package"], stdout=subprocess.PIPE, text=True, start_new_session=True,
                          env=os.environ | {"PATINA_NINJA_FLAGS": "-n"}) as packing:  # nothing is compiled meanwhile
        said = packing.stdout.readline()
        os.killpg(packing.pid, signal.SIGKILL)
    assert said.startswith("package: compiling"), said


def folder():
    return Path(sys.modules[MODULE].__file__).resolve().parent


def libraries():
    """Ours that this process has loaded."""
    with open("/proc/self/maps", encoding="utf-8") as maps:
        return {str(Path(line.split()[-1]).resolve()) for line in maps if "libpatina" in line}


def test_install():
    assert "PATINA_LIBRARY" not in os.environ
    for kind in ("SCRIPTS", "CONFIG", "EXTENSIONS"):
        assert Path(os.environ[f"BLENDER_USER_{kind}"]).is_dir(), f"BLENDER_USER_{kind} names no folder"
    if LEGACY:
        assert bpy.ops.preferences.addon_install(filepath=package()) == {"FINISHED"}
        assert bpy.ops.preferences.addon_enable(module=MODULE) == {"FINISHED"}
    else:
        done = bpy.ops.extensions.package_install_files(filepath=package(), repo="user_default", enable_on_install=True)
        assert done == {"FINISHED"}, done
    assert addon_utils.check(MODULE)[1], "not enabled"
    inside = os.environ["BLENDER_USER_SCRIPTS" if LEGACY else "BLENDER_USER_EXTENSIONS"]
    assert Path(inside).resolve() in folder().parents, folder()
    assert (folder() / "LICENSE").is_file()
    pages = {path: path.read_text(encoding="utf-8") for path in (folder() / "manual").glob("*.html")}
    images = {image for page in pages.values() for image in re.findall(r'src="([^"]+)"', page)}
    assert len(images) > 5 and all((folder() / "manual" / image).is_file() for image in images), images
    assert (folder() / "manual/index.html") in pages and len(pages) > 20, sorted(pages)
    for path, page in pages.items():
        links = [link.partition("#")[0] for link in re.findall(r'href="([^":]+)"', page)]
        assert all((path.parent / link).is_file() for link in links if link), (path.name, links)
    assert not list((folder() / "manual").glob("*.md"))


def lazrs():
    """The compiled module of this Python that the package brought; None where PyPI has none for it."""
    found = importlib.util.find_spec("lazrs")
    place = Path(next(iter(found.submodule_search_locations)))
    assert (folder() if LEGACY else Path(os.environ["BLENDER_USER_EXTENSIONS"]).resolve()) in place.resolve().parents, place
    return next((place / f"lazrs{suffix}" for suffix in importlib.machinery.EXTENSION_SUFFIXES if (place / f"lazrs{suffix}").is_file()), None)


def test_size_and_validator():
    """Small, and what Blender's own validator accepts: by the command line where this is a Blender, else by the same script."""
    assert Path(package()).stat().st_size < 12e6, Path(package()).stat().st_size
    if LEGACY:
        return
    script = next(Path(addon_utils.__file__).resolve().parents[1].glob("addons_core/bl_pkg/cli/blender_ext.py"))
    command = [bpy.app.binary_path, "--command", "extension"] if bpy.app.binary_path else [sys.executable, script]
    done = subprocess.run([*command, "validate", package()], capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0 and "error" not in (done.stdout + done.stderr).lower(), done.stdout + done.stderr
    with zipfile.ZipFile(package()) as archive:
        names = [name for name in archive.namelist() if name.endswith(".whl")]
    assert names and all("-py3-none-" in name for name in names), f"bound to one Python: {names}"


ROWS = 5000


def points_file(packed):
    """A LAS 1.2 of point format 0, and its bytes."""
    rows = bytearray()
    for i in range(ROWS):
        rows += struct.pack("<iiiHBBbBH", i, 2 * i, i % 100, i % 65536, 0x09, 2, 0, 0, 0)
    head = bytearray(227)
    head[:4], head[24:26] = b"LASF", b"\x01\x02"
    struct.pack_into("<12d", head, 131, 0.001, 0.001, 0.001, 0, 0, 0, 5, 0, 10, 0, 0.1, 0)
    record, body = b"", bytes(rows)
    if packed:
        import lazrs as module
        vlr = module.LazVlr.new_for_compression(0, 0)
        data = bytes(vlr.record_data())
        record = b"\0\0laszip encoded\0\0" + struct.pack("<HH", 22204, len(data)) + bytes(32) + data
        out = io.BytesIO()
        packer = module.LasZipCompressor(out, vlr)
        packer.compress_many(body)
        packer.done()
        offset = struct.unpack_from("<q", out.getvalue())[0] + 227 + len(record)  # of the chunk table, from the file's beginning
        body = struct.pack("<q", offset) + out.getvalue()[8:]
    struct.pack_into("<HIIBHI", head, 94, 227, 227 + len(record), int(packed), 0x80 * packed, 20, ROWS)
    return bytes(head) + record + body


def imported(name, data):
    """The heights of the points of a file, as Blender has them; the message where it is not read."""
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / name
        path.write_bytes(data)
        before = set(bpy.data.objects)
        try:
            bpy.ops.import_scene.patina_points(filepath=str(path))
        except RuntimeError as error:
            return str(error)
    obj, = set(bpy.data.objects) - before
    if obj.type == 'POINTCLOUD':
        return [round(item.vector.x, 3) for item in obj.data.attributes["position"].data]
    return [round(vertex.co.x, 3) for vertex in obj.data.vertices]


def test_reads():
    """LAS without any package, LAZ with the package's lazrs, the same points. Without lazrs LAS still works, and LAZ gives one message."""
    wanted = [round(0.001 * i, 3) for i in range(ROWS)]
    assert imported("plain.las", points_file(False)) == wanted
    module = lazrs()
    if module:
        module.rename(module.with_suffix(".away"))
        importlib.invalidate_caches()
    try:
        head = bytearray(points_file(False))
        head[104] |= 0x80
        told = imported("packed.laz", bytes(head))
        assert isinstance(told, str) and told.count("Patina:") == 1 and "lazrs" in told and "Install Readers" in told, told
        assert imported("plain.las", points_file(False)) == wanted
    finally:
        if module:
            module.with_suffix(".away").rename(module)
            importlib.invalidate_caches()
    if module:
        found = imported("packed.laz", points_file(True))
        assert found == wanted, found if isinstance(found, str) else found[:9]
    else:
        print(f"no lazrs for Python {sys.version_info[0]}.{sys.version_info[1]}: LAZ was not read")


def test_nothing_is_loaded():
    """The library waits for points: neither the start nor a scene that is set up for it asks for it."""
    bpy.context.scene.render.engine = "PATINA"
    bpy.context.view_layer.update()
    assert not libraries(), libraries()


def test_render():
    scene = bpy.context.scene
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    turn = math.pi * (3 - math.sqrt(5))
    heights = [1 - (2 * i + 1) / 20000 for i in range(20000)]
    ball = [(math.sqrt(1 - z * z) * math.cos(i * turn), math.sqrt(1 - z * z) * math.sin(i * turn), z)
            for i, z in enumerate(heights)]
    mesh = bpy.data.meshes.new("ball")
    mesh.from_pydata(ball, [], [])
    scene.collection.objects.link(bpy.data.objects.new("ball", mesh))
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location, camera.rotation_euler = (0, -5, 0), (math.pi / 2, 0, 0)
    scene.collection.objects.link(camera)
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.rotation_euler = 3, (math.pi / 3, 0, 0)
    scene.collection.objects.link(sun)

    scene.camera, scene.render.engine = camera, "PATINA"
    scene.render.resolution_x = scene.render.resolution_y = 96
    scene.render.resolution_percentage = 100
    scene.render.film_transparent = True
    scene.render.image_settings.file_format, scene.render.image_settings.color_mode = "PNG", "RGBA"
    with tempfile.TemporaryDirectory() as output:
        scene.render.filepath = str(Path(output) / "ball.png")
        assert bpy.ops.render.render(write_still=True) == {"FINISHED"}
        image = bpy.data.images.load(scene.render.filepath)
        assert tuple(image.size) == (96, 96)
        pixels = image.pixels[:]
    alpha = pixels[3::4]
    middle = 4 * (48 * 96 + 48)
    assert alpha[0] == 0 and alpha[48 * 96 + 48] == 1, (alpha[0], alpha[48 * 96 + 48])
    assert pixels[middle] > 0.2, pixels[middle:middle + 4]
    share = sum(a > 0.5 for a in alpha) / len(alpha)
    across = (96 * camera.data.lens / camera.data.sensor_width) / math.sqrt(5 * 5 - 1)  # radius of the outline, pixels
    assert abs(share - math.pi * across ** 2 / 96 ** 2) < 0.02, (share, math.pi * across ** 2 / 96 ** 2)
    if LEGACY:
        wanted = folder() / "lib/libpatina.so"
    else:  # where Blender unpacks wheels
        import patina_library
        wanted = patina_library.PATH
        assert Path(os.environ["BLENDER_USER_EXTENSIONS"]).resolve() in wanted.resolve().parents and not (folder() / "lib").exists(), wanted
    assert libraries() == {str(wanted.resolve())}, (libraries(), wanted)


def test_remove():
    place = folder()
    if LEGACY:
        assert bpy.ops.preferences.addon_disable(module=MODULE) == {"FINISHED"}
        window = bpy.context.window_manager.windows[0]
        with bpy.context.temp_override(window=window, area=window.screen.areas[0]):  # which the operator redraws
            assert bpy.ops.preferences.addon_remove(module=MODULE) == {"FINISHED"}
    else:
        done = bpy.ops.extensions.package_uninstall(repo_directory=str(place.parent), pkg_id="patina")
        assert done == {"FINISHED"}, done
    assert not addon_utils.check(MODULE)[1]
    assert not place.exists(), place


def main():
    sys.path.insert(0, str(Path(__file__).resolve().parent))
    import setting
    setting.say("the package, installed")
    passed = failed = 0
    for test in (test_says_what_it_does, test_size_and_validator, test_install, test_nothing_is_loaded, test_reads, test_render, test_remove):
        try:
            test()
            passed += 1
            print(f"ok {test.__name__}", flush=True)
        except Exception:  # a test's failure is one line of the sum, whatever it is
            failed += 1
            print(f"FAILED {test.__name__}", flush=True)
            traceback.print_exc(file=sys.stdout)
    print(f"{passed} passed, {failed} failed, 0 skipped", flush=True)
    return 1 if failed else 0


code = main()
sys.stdout.flush()
os._exit(code)  # the bpy module may hang in its own clean-up
