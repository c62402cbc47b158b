# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's preferences: readers of LAZ and E57 from files and by pip, the cache, defaults of device, threads and memory."""

import contextlib
import hashlib
import importlib
import importlib.machinery
import importlib.util
import io
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from types import SimpleNamespace
from unittest import mock

import bpy
import check_linked  # noqa: F401  no test leaves files with the user
from check_import import import_ply
from check_linked import dense
from check_panels import Row, context_of, drawn_by
from harness import REPOSITORY, SCRATCH, Skip, check, new_scene, render
from patina import choices, memory, native, preferences, tested, versions
from patina.description.settings import DeviceChoice
from patina.operators import preferences as operators
from patina.read import importers, readers
from patina.sync.points import cache, kept, linked
from patina.sync.view import settings

FOLDER = SCRATCH / "readers" / readers.TAG


@contextlib.contextmanager
def enabled():
    """As for an artist who enabled the add-on."""
    addon = bpy.context.preferences.addons.new()
    addon.module = "patina"
    try:
        yield choices.get()
    finally:
        bpy.context.preferences.addons.remove(addon)
        memory.limit = 0


def modules_of(packages):
    """The names of those that are imported."""
    return [name for name in sys.modules if name.split(".")[0] in packages]


@contextlib.contextmanager
def without_readers(*wanted):
    """As on Debian's Blender: none of them is there. wanted: what is looked for in their place. Modules of these that were imported before
    are not imported within, and come back whole."""
    known = {name: sys.modules.pop(name) for name in modules_of(wanted)}
    packages, readers.PACKAGES = readers.PACKAGES, dict.fromkeys(wanted, "tests")
    place, choices.readers_folder = choices.readers_folder, lambda: FOLDER
    shutil.rmtree(FOLDER, ignore_errors=True)
    try:
        yield
    finally:
        readers.look_no_more_in(FOLDER)
        readers.PACKAGES, choices.readers_folder = packages, place
        for name in modules_of(wanted):
            del sys.modules[name]
        sys.modules.update(known)


def wheel(name, folder="wheels", tag="py3-none-any", holds=None):
    (SCRATCH / folder).mkdir(exist_ok=True)
    path = SCRATCH / folder / f"{name}-1.0-{tag}.whl"
    with zipfile.ZipFile(path, "w") as archive:
        for inner, text in (holds or {f"{name}/__init__.py": "ANSWER = 42\n"}).items():
            archive.writestr(inner, text)
    return path


def fails(part, run):
    try:
        run()
    except RuntimeError as error:
        check(part in str(error), str(error))
    else:
        check(False, f"no word of '{part}'")


def test_readers_from_files():
    """Wheels that were fetched elsewhere, chosen one by one or as a folder, can be imported at once and after the next start."""
    with without_readers("patina_try_a", "patina_try_b"):
        check(readers.missing() == ["patina_try_a", "patina_try_b"], f"{readers.missing()}")
        first, second = wheel("patina_try_a"), wheel("patina_try_b", tag=f"{readers.TAG}-{readers.TAG}-linux_x86_64")
        bpy.ops.patina.install_reader_files(directory=str(first.parent), files=[{"name": first.name}])
        check(readers.missing() == ["patina_try_b"], f"{readers.missing()}")
        bpy.ops.patina.install_reader_files(filepath=str(second.parent))
        check(not readers.missing(), f"{readers.missing()}")
        import patina_try_a
        check(patina_try_a.ANSWER == 42 and Path(patina_try_a.__file__).is_relative_to(FOLDER), patina_try_a.__file__)
        bpy.ops.patina.install_reader_files(filepath=str(first))  # once more: in place of what is there
        readers.look_no_more_in(FOLDER)
        sys.modules.pop("patina_try_a")
        check(len(readers.missing()) == 2, "not where Python looks by itself")
        readers.look_in(choices.readers_folder())  # as register() does
        check(not readers.missing(), "lost by the next start")


def test_real_readers_from_files():
    """The packages themselves, as wheels: a LAZ file that could not be read can."""
    source = next(iter((REPOSITORY / "build/out/readers/lib").glob("python3*/site-packages")), None)
    if source is None or not (source / "laspy").is_dir() or f"python3.{sys.version_info[1]}" not in str(source):
        raise Skip("the readers for this Python are not installed")
    holds = [path for name in ("laspy", "lazrs") for path in (source / name).rglob("*")
             if path.is_file() and path.suffix != ".pyc"] + list(source.glob("lazrs*.so"))
    path = SCRATCH / "wheels" / f"laspy-2.7.0-{readers.TAG}-abi3-linux_x86_64.whl"
    path.parent.mkdir(exist_ok=True)
    with zipfile.ZipFile(path, "w") as archive:
        for item in holds:
            archive.write(item, item.relative_to(source))
    code = ("import sys, types; from pathlib import Path\n"
            f"alone = types.ModuleType('alone'); alone.__path__ = [{str(REPOSITORY / 'addon')!r}]; sys.modules['alone'] = alone\n"
            "import alone.read.readers as m\n"
            f"assert 'laspy' in m.missing(); list(m.install([Path({str(path)!r})], Path({str(FOLDER)!r})))\n"
            "import laspy, lazrs; assert laspy.LazBackend.Lazrs.is_available(); print('READY', laspy.__file__)")
    import numpy
    done = subprocess.run([sys.executable, "-s", "-c", code], capture_output=True, text=True, check=False,
                          env={"PATH": "/usr/bin", "PYTHONPATH": str(Path(numpy.__file__).parents[1])})
    check(f"READY {FOLDER}" in done.stdout, done.stderr[-400:])


def test_readers_leave_no_second_name_of_a_script():
    """What multiprocessing keeps makes Blender 3.4 crash when it quits."""
    text = "import sys\nsys.modules['__mp_main__'] = sys.modules['__main__']\n"
    with without_readers("patina_try_g"):
        path = wheel("patina_try_g", holds={"patina_try_g/__init__.py": text})
        bpy.ops.patina.install_reader_files(filepath=str(path))
        kept = sys.modules.pop("__mp_main__", None)
        readers.load("patina_try_g")
        check("__mp_main__" not in sys.modules, "it stays")
        if kept:
            sys.modules["__mp_main__"] = kept


def test_readers_of_every_system():
    """Which wheels a system and its processor take."""
    for system, machine, fit in (("linux", "x86_64", "manylinux_2_28_x86_64"), ("linux", "aarch64", "manylinux2014_aarch64"),
                                 ("win32", "AMD64", "win_amd64"), ("win32", "ARM64", "win_arm64"),
                                 ("darwin", "x86_64", "macosx_10_9_x86_64"), ("darwin", "arm64", "macosx_11_0_arm64")):
        with mock.patch("sys.platform", system), mock.patch("platform.machine", lambda machine=machine: machine):
            for other in ("manylinux_2_28_x86_64", "manylinux2014_aarch64", "win_amd64", "win_arm64", "macosx_10_9_x86_64", "macosx_11_0_arm64"):
                check(readers._runs_here(other) == (other == fit), f"{other} on {system}, {machine}")


def test_readers_that_do_not_fit():
    with without_readers("patina_try_c"):
        for path, part in ((wheel("patina_try_c", tag="cp27-cp27m-linux_x86_64"), "another Python"),
                           (wheel("patina_try_c", tag=f"{readers.TAG}-{readers.TAG}-beos_m68k"), "another system"),
                           (wheel("patina_try_c", "evil", holds={"../outside.py": ""}), "is damaged")):
            fails(part, lambda path=path: bpy.ops.patina.install_reader_files(filepath=str(path)))
        broken = SCRATCH / "wheels" / "patina_try_c-2.0-py3-none-any.whl"
        broken.write_bytes(b"PK nothing")
        fails("is damaged", lambda: bpy.ops.patina.install_reader_files(filepath=str(broken)))
        (SCRATCH / "notes.txt").write_text("")
        fails("no wheel", lambda: bpy.ops.patina.install_reader_files(filepath=str(SCRATCH / "notes.txt")))
        check(not FOLDER.exists() or not list(FOLDER.iterdir()), "something was left behind")
        check(not (SCRATCH / "readers/outside.py").exists(), "it wrote outside")


def test_readers_by_pip():
    """What pip fetches is installed; what pip says is said; a package without a wheel leaves the others; Esc ends it."""
    made = wheel("patina_try_d", "fetched")
    every = (REPOSITORY / "addon/readers.txt").read_text("utf-8").split()
    (SCRATCH / "pip.py").write_text(
        "import shutil, sys\nargs = sys.argv\nassert 'download' in args and '--no-deps' in args\n"
        "if 'laspy==' not in args[-1]: sys.exit(f'ERROR: No matching distribution found for {args[-1]}')\n"
        f"shutil.copy({str(made)!r}, args[args.index('-d') + 1])\n")
    (SCRATCH / "no_pip.py").write_text("import sys\nprint('ERROR: Could not find a version')\nsys.exit(1)\n")
    (SCRATCH / "slow_pip.py").write_text("import time\ntime.sleep(60)\n")
    if not getattr(bpy.app, "online_access", True):
        check(not bpy.ops.patina.install_readers.poll(), "Blender shall stay offline")
        raise Skip("this Blender was told to stay offline")
    try:
        with without_readers("patina_try_d"):
            operators.PIP = [sys.executable, str(SCRATCH / "pip.py")]
            with mock.patch.object(readers, "wanted", lambda: every[:2]):
                fails(f"pip fetched {made.name}, which is none of the files", bpy.ops.patina.install_readers)
                with mock.patch.object(readers, "_sums", lambda: {made.name: 64 * "0"}):
                    fails("its checksum differs", bpy.ops.patina.install_readers)
                check(readers.missing() == ["patina_try_d"], "installed in spite of its checksum")
                with mock.patch.object(readers, "_sums", lambda: {made.name: hashlib.sha256(made.read_bytes()).hexdigest()}):
                    bpy.ops.patina.install_readers()
            import patina_try_d
            check(patina_try_d.ANSWER == 42, "not there")
        with without_readers("patina_try_e"):
            operators.PIP = [sys.executable, str(SCRATCH / "no_pip.py")]
            fails("Could not find a version", bpy.ops.patina.install_readers)
            fails("Install from Files", bpy.ops.patina.install_readers)
            (SCRATCH / "no_wheel.py").write_text("import sys\nsys.exit('ERROR: No matching distribution found for ' + sys.argv[-1])\n")
            operators.PIP = [sys.executable, str(SCRATCH / "no_wheel.py")]
            fails(f"PyPI has no wheel of {', '.join(every)} for Python 3.{sys.version_info[1]}", bpy.ops.patina.install_readers)
            fails("Convert LAZ files to LAS", bpy.ops.patina.install_readers)
            (SCRATCH / "no_net.py").write_text("import sys\nprint('WARNING: Retrying (Retry(total=4))')\nsys.exit('ERROR: No matching distribution found')\n")
            operators.PIP = [sys.executable, str(SCRATCH / "no_net.py")]
            fails("PyPI cannot be reached", bpy.ops.patina.install_readers)
            told = []
            steps = readers.download(SCRATCH, [sys.executable, str(SCRATCH / "slow_pip.py")])
            told.append(next(steps))
            steps.close()  # as Esc does: pip is waited for no longer
            check(f"0 of {len(every)}" in told[0], f"{told}")
    finally:
        operators.PIP = None


def test_pip_from_its_wheel():
    """A Python without pip has the wheel that ensurepip would install, or there is a sentence."""
    folder = SCRATCH / "wheels of pip"
    folder.mkdir(exist_ok=True)
    honest = importlib.util.find_spec
    with mock.patch.object(importlib.util, "find_spec", lambda name, *rest: None if name == "pip" else honest(name, *rest)), \
            mock.patch.object(readers, "_wheels_of_pip", lambda: [folder]):
        try:
            readers._pip_command()
        except readers.ReadersError as error:
            check("has no pip" in str(error) and "Install from Files" in str(error), str(error))
        else:
            check(False, "there is none")
        with zipfile.ZipFile(folder / "pip-99.0-py3-none-any.whl", "w") as archive:
            archive.writestr("pip/__main__.py", "print('pip of a wheel')\n")
        done = subprocess.run(readers._pip_command(), capture_output=True, text=True, check=False)
        check("pip of a wheel" in done.stdout, done.stderr[-300:])


def test_a_package_of_another_python_is_missing():
    """The zip's lazrs holds modules of some Pythons. On another one it is missing, and what is installed then comes first."""
    with without_readers("lazrs"):
        packages, readers.PACKAGES = readers.PACKAGES, {"lazrs": "LAZ and COPC"}
        kept = list(sys.path)
        foreign, own = SCRATCH / "foreign/lazrs", FOLDER / "lazrs"
        try:
            for place, suffix in ((foreign, ".cpython-39-x86_64-linux-gnu.so"), (own, importlib.machinery.EXTENSION_SUFFIXES[0])):
                place.mkdir(parents=True, exist_ok=True)
                (place / "__init__.py").write_text("")
                (place / f"lazrs{suffix}").write_bytes(b"")
            sys.path[:] = [str(foreign.parent), *(path for path in sys.path if not (Path(path) / "lazrs").is_dir())]
            importlib.invalidate_caches()
            check(readers.missing() == ["lazrs"], f"{readers.missing()}")
            check(readers.status() == [("LAZ and COPC: needs the Python package lazrs", False)], f"{readers.status()}")
            check("3.10 to 3.14" in readers.how_to("LAZ and COPC") and "Install Readers" in readers.how_to("LAZ and COPC"), readers.how_to("LAZ and COPC"))
            readers.look_in(FOLDER)
            check(not readers.missing() and sys.path[0] == str(FOLDER), f"{readers.missing()}, {sys.path[:2]}")
        finally:
            sys.path[:], readers.PACKAGES = kept, packages
            importlib.invalidate_caches()


def test_what_lacks_is_told_in_the_preview():
    path = SCRATCH / "packed.laz"
    import numpy as np
    from check_places import las_file
    head = bytearray(las_file("plain.las", np.zeros((3, 3))).read_bytes())
    head[104] |= 0x80
    path.write_bytes(bytes(head))
    missing, readers.missing = readers.missing, lambda: ["laspy"]
    try:
        check(any("Install Readers" in line for line in importers.preview(path)), f"{importers.preview(path)}")
    finally:
        readers.missing = missing


def test_cache_folder_size_and_clear():
    mine = SCRATCH / "my caches"
    with enabled() as chosen:
        chosen.cache_folder = str(mine)
        new_scene()
        import_ply(dense("kept.ply"), link=True)
        check(len(list(mine.glob("*.cloud"))) == 1, f"{list(mine.iterdir())}")
        count, size = cache.held()
        check(count == 1 and size > 20000 * 10, f"{count} {size}")
        check(operators.cache_text() == "1 kept, 0.00 GB", operators.cache_text())
        bpy.ops.patina.remove_caches(points=False)
        check(not list(mine.iterdir()) and cache.held() == (0, 0), f"{list(mine.iterdir())}")
        (mine / "mine.txt").write_text("stays")
        render()
        check(len(list(mine.glob("*.cloud"))) == 1, "it is made anew")
        bpy.ops.patina.remove_caches(points=False)
        check((mine / "mine.txt").is_file(), "somebody else's file is gone")
        chosen.cache_limit = 1
        check(choices.cache_bytes() == 1 << 30, "the limit")
    check(kept.folder() != mine and choices.cache_bytes() == 32 << 30, "defaults hold without")
    check(linked.source(SCRATCH / "kept.ply").kept.parent != mine, "linked clouds follow")


def test_remove_caches_lists_and_deletes():
    """Each kind of file with its folder and size; installed readers only on request."""
    mine, packages = SCRATCH / "stored", SCRATCH / "installed"
    readers_folder = choices.readers_folder
    choices.readers_folder = lambda: packages / "cp3"
    try:
        with enabled() as chosen:
            chosen.cache_folder = str(mine)
            new_scene()
            import_ply(dense("stored.ply"), link=True)
            (packages / "cp3/laspy").mkdir(parents=True)
            (packages / "cp3/laspy/__init__.py").write_bytes(b"# ours\n")
            stored = operators._stored()
            check({name: entry[:2] for name, entry in stored.items()} == {"clouds": (mine, 1), "points": (mine / "pages", 0), "packages": (packages, 1)}, f"{stored}")
            check(stored["packages"][2] == 7 and stored["clouds"][2] > 200_000, f"{stored}")
            layout = mock.MagicMock()
            operators.PATINA_OT_remove_caches.draw(SimpleNamespace(layout=layout, _stored=stored), None)
            shown = str(layout.mock_calls)
            check(str(mine) in shown and str(packages) in shown and "1 file, 0.00 GB" in shown, shown)
            bpy.ops.patina.remove_caches()
            check(not list(mine.glob("*.cloud")) and packages.is_dir(), "the caches, and nothing else")
            bpy.ops.patina.remove_caches(clouds=False, points=False, packages=True)
            check(not packages.exists(), "the packages")
    finally:
        choices.readers_folder = readers_folder


def test_defaults_of_device_threads_and_memory():
    scene = new_scene()
    scene.patina.device, scene.patina.threads, scene.render.threads_mode = 'AUTO', 0, 'AUTO'
    check(settings.device(scene) == DeviceChoice("auto", 0), "without preferences")
    with enabled() as chosen:
        chosen.device, chosen.threads, chosen.memory_limit = 'CPU', 3, 2
        check(settings.device(scene) == DeviceChoice("cpu", 3), f"{settings.device(scene)}")
        check(memory.for_planes() == 2 << 30, f"{memory.for_planes()}")
        scene.patina.device, scene.patina.threads = 'CPU_SCALAR', 2
        check(settings.device(scene) == DeviceChoice("cpu-scalar", 2), "the scene's own come first")
        chosen.cloud_limit = 3
        check(settings.device(scene).mapped == 3 << 30, f"{settings.device(scene)}")
        with native.Device("cpu", mapped=1 << 30) as device:
            check(device.name.startswith("cpu"), f"{device.name}")
        chosen.cloud_limit = 0
        check(settings.device(scene).mapped == 0, "a third of what is free again")
        chosen.memory_limit = 0
        check(memory.limit == 0, "no limit again")


def test_manual_is_there():
    path = operators.manual()
    check(path is not None and path.read_text("utf-8").startswith("# The manual"), f"{path}")
    check(any(draw.__module__ == operators.__name__ for draw in bpy.types.TOPBAR_MT_help._dyn_ui_initialize()), "not in the menu Help")


def test_a_newer_blender_is_told_of():
    """Once in the console, in the preferences and in the sidebar; not if this version was tested."""
    this = bpy.app.version[:2]
    with mock.patch.object(tested, "NEWEST", this):
        check(not versions.notice(), versions.notice())
    with mock.patch.object(tested, "NEWEST", (3, 3)), contextlib.redirect_stdout(io.StringIO()) as said:
        versions.tell()
        check(said.getvalue().count("\n") == 1 and "3.3" in said.getvalue() and f"{this[0]}.{this[1]}" in said.getvalue(), said.getvalue())
        new_scene()
        labels = [text for kind, _, _, text in drawn_by(bpy.types.PATINA_PT_statistics, context_of()) if kind == "label"]
        check(versions.notice() in " ".join(labels), f"the sidebar: {labels}")
        with enabled() as known:
            layout = Row()
            drawn = SimpleNamespace(layout=layout, bl_rna=known.bl_rna, **{name: getattr(known, name) for name in known.__annotations__})
            preferences.PatinaPreferences.draw(drawn, context_of())
        labels = [text for kind, _, _, text in layout.drawn if kind == "label"]
        check(versions.notice() in " ".join(labels), f"the preferences: {labels}")


def test_a_blender_without_numpy_is_told_of():
    """Debian's package of Blender brings no numpy. Enabling then ends with one message that says what to install."""
    place = REPOSITORY / "addon/__init__.py"
    found = importlib.util.spec_from_file_location("patina_alone", place, submodule_search_locations=[str(place.parent)])
    with mock.patch.dict(sys.modules, {"numpy": None}):
        try:
            found.loader.exec_module(importlib.util.module_from_spec(found))
            said = "it was enabled"
        except ImportError as error:
            said = str(error)
    check(said.startswith("Patina needs numpy") and "sudo apt install python3-numpy" in said, said)
