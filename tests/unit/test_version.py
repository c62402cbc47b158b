# SPDX-License-Identifier: GPL-3.0-or-later
"""The version is one number in all places, the library and the command line have it, and the binding refuses libraries whose version or
interface differs, with a message that says which and what to do.

    test_version.py FOLDER        with libpatina.so and patina, such as build/out/release
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True
sys.path += [str(ROOT / "build"), str(ROOT / "addon")]
import version  # noqa: E402

import native  # noqa: E402
from native import abi, loader  # noqa: E402

BUILD = Path()
PLACES = sorted({name for name, *_ in version.PLACES})
NEEDED = ".".join(str(part) for part in abi.VERSION)


class Places(unittest.TestCase):
    def setUp(self) -> None:
        made = tempfile.TemporaryDirectory()
        self.addCleanup(made.cleanup)
        self.folder = Path(made.name)
        for name in (*PLACES, "build/version.py"):
            (self.folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, self.folder / name)

    def run_script(self, *arguments: str) -> tuple[int, str]:
        done = subprocess.run([sys.executable, self.folder / "build/version.py", *arguments], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout + done.stderr

    def test_agree(self) -> None:
        self.assertEqual(version.differences(), [])
        self.assertEqual(self.run_script(), (0, version.number() + "\n"))

    def test_each_difference_is_found(self) -> None:
        for name, pattern, form in version.PLACES:
            path = self.folder / name
            before = path.read_text(encoding="utf-8")
            start, end = re.search(pattern, before, re.M).span(2)
            path.write_text(before[:start] + form.format(7, 8, 9) + before[end:], encoding="utf-8")
            code, said = self.run_script("--check")
            self.assertEqual(code, 1, f"{name}: {said}")
            self.assertIn(name, said)
            path.write_text(before, encoding="utf-8")
            self.assertEqual(self.run_script("--check")[0], 0)

    def test_writes_all(self) -> None:
        self.assertEqual(self.run_script("11.22.33")[0], 0)
        self.assertEqual(self.run_script("--check"), (0, "All places contain version 11.22.33.\n"))
        text = {name: (self.folder / name).read_text(encoding="utf-8") for name in PLACES}
        self.assertIn('"version": (11, 22, 33),', text["addon/__init__.py"])
        self.assertIn('\nversion = "11.22.33"\n', text["addon/blender_manifest.toml"])
        self.assertIn("schema_version = \"1.0.0\"", text["addon/blender_manifest.toml"])
        self.assertIn("VERSION = (11, 22)", text["addon/native/abi.py"])
        self.assertIn("\n## 11.22.33", text[".github/CHANGELOG.md"])
        self.assertEqual(self.run_script("1.0")[0], 2)

    def test_programs_have_it(self) -> None:
        os.environ["PATINA_LIBRARY"] = str(BUILD / "libpatina.so")
        loader.forget_library()
        told = native.library().patina_version().decode()
        self.assertRegex(told, re.escape(version.number()) + r"\+[0-9a-f]{12}$")
        said = subprocess.run([BUILD / "patina", "version"], capture_output=True, text=True, check=True).stdout
        self.assertEqual(said, f"patina {told}\n")


class Libraries(unittest.TestCase):
    def setUp(self) -> None:
        made = tempfile.TemporaryDirectory()
        self.addCleanup(made.cleanup)
        self.folder, self.count = Path(made.name), 0

    def message(self, path: Path, by_variable: bool = True) -> str:
        """Of the attempt to load a library."""
        before = loader.library_path
        os.environ["PATINA_LIBRARY"] = str(path)
        if not by_variable:
            del os.environ["PATINA_LIBRARY"]
            loader.library_path = lambda: path
        loader.forget_library()
        try:
            with self.assertRaises(native.PatinaError) as raised:
                native.library()
        finally:
            loader.library_path = before
            loader.forget_library()
        return str(raised.exception)

    def fake(self, told: str, without: str = "", sizes: str = "return ours(name);") -> Path:
        """A library that has all functions but one, and does nothing. sizes: body of its patina_struct_size."""
        self.count += 1
        source, library = self.folder / "fake.c", self.folder / f"fake{self.count}.so"
        own = {"patina_version", "patina_struct_size", without}
        structures = [name for name, value in vars(abi).items() if isinstance(value, type) and getattr(value, "_fields_", None)]
        names = ["patina" + re.sub("([A-Z])", lambda found: "_" + found.group().lower(), name) for name in structures]
        lines = ["#include <patina/patina.h>", "#include <string.h>", f'const char *patina_version(void) {{ return "{told}"; }}',
                 "static size_t ours(const char *name)", "{",
                 *(f'    if (!strcmp(name, "{name}")) return sizeof({name});' for name in names), "    return 0;", "}"]
        if without != "patina_struct_size":
            lines.append(f"size_t patina_struct_size(const char *name) {{ {sizes} }}")
        source.write_text("\n".join(lines), encoding="utf-8")
        rest = self.folder / "rest.c"
        rest.write_text("\n".join(f"void {name}(void) {{}}" for name in abi.CALLS if name not in own), encoding="utf-8")
        subprocess.run(["gcc", "-shared", "-fPIC", f"-I{ROOT}/native/include", source, rest, "-o", library], check=True)
        return library

    def test_other_versions(self) -> None:
        for told in ("0.0.9+0123456789ab", "99.0.0"):
            library = self.fake(told)
            said = self.message(library)
            for word in (str(library), f"version {told}", f"needs version {NEEDED}", "PATINA_LIBRARY", "remove the variable"):
                self.assertIn(word, said)
            said = self.message(library, by_variable=False)
            self.assertIn("Install Patina again", said)
            self.assertNotIn("PATINA_LIBRARY", said)

    def test_older_builds_of_this_version(self) -> None:
        """Each library of before patina_struct_size is one, too."""
        told = version.number() + "+0123456789ab"
        for without in ("patina_frame_render", "patina_struct_size"):
            said = self.message(self.fake(told, without))
            for word in (f"version {told}", f"no function {without}", "remove the variable"):
                self.assertIn(word, said)
        shorter = 'size_t size = ours(name); return strcmp(name, "patina_camera") ? size : size - 8;'
        said = self.message(self.fake(told, sizes=shorter))
        self.assertIn(f"its patina_camera has {native.abi.sizeof(abi.Camera) - 8} bytes, {native.abi.sizeof(abi.Camera)} are needed", said)
        longer_array = 'size_t size = ours(name); return strcmp(name, "patina_array") ? size : size + 8;'
        self.assertIn("its patina_array has", self.message(self.fake(told, sizes=longer_array)))

    def test_newer_builds_of_this_version_are_taken(self) -> None:
        """What has struct_size may have grown."""
        longer = 'size_t size = ours(name); return strcmp(name, "patina_camera") ? size : size + 8;'
        os.environ["PATINA_LIBRARY"] = str(self.fake(version.number(), sizes=longer))
        loader.forget_library()
        self.assertEqual(native.library().patina_version().decode(), version.number())
        loader.forget_library()

    def test_no_libraries(self) -> None:
        text = self.folder / "text.so"
        text.write_text("This is no library.", encoding="utf-8")
        self.assertIn(f"{text} cannot be loaded", self.message(text))
        source, other = self.folder / "other.c", self.folder / "other.so"
        source.write_text("int other(void) { return 0; }", encoding="utf-8")
        subprocess.run(["gcc", "-shared", "-fPIC", source, "-o", other], check=True)
        said = self.message(other)
        self.assertIn("patina_version", said)
        self.assertIn("remove the variable", said)
        self.assertIn("there is no ", self.message(self.folder / "none.so"))

    def test_rule_of_versions(self) -> None:
        for library, needed, fit in (((0, 1), (0, 1), True), ((0, 2), (0, 1), False), ((1, 0), (0, 1), False), ((1, 4), (1, 4), True),
                                     ((1, 5), (1, 4), True), ((1, 3), (1, 4), False), ((2, 4), (1, 4), False), ((0, 9), (1, 0), False)):
            self.assertEqual(loader.fits(library, needed), fit, (library, needed))


if __name__ == "__main__":
    BUILD = Path(sys.argv.pop(1)).resolve()
    result = unittest.main(exit=False).result
    bad = len(result.failures) + len(result.errors)
    print(f"{result.testsRun - bad} passed, {bad} failed, 0 skipped")
    sys.exit(1 if bad else 0)
