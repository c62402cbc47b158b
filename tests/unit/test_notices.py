# SPDX-License-Identifier: GPL-3.0-or-later
"""build/notices finds files of unknown origin in packages, and names the works of others in them."""

import io
import json
import subprocess
import sys
import tarfile
import tempfile
import unittest
import zipfile
from pathlib import Path

from scripts import ROOT, run, script

notices = script("notices")
OWN = b"# SPDX-License-Identifier: GPL-3.0-or-later\n"
X64, ARM64 = b"\x7fELF" + bytes(14) + b"\x3e\x00", b"\x7fELF" + bytes(14) + b"\xb7\x00"
TRACKED = ["addon/__init__.py", "addon/readers.txt", "addon/draw/glyphs.npz", "addon/README.md", "addon/manual/install.md", "LICENSE", "native/base/error.c",
           "native/device_gl/glad/gl.c", "native/device_gl/glad/khrplatform.h"]


def zipped(files: dict[str, bytes]) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return out.getvalue()


def tarred(files: dict[str, bytes]) -> bytes:
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w:xz") as archive:
        for name, data in files.items():
            entry = tarfile.TarInfo(name)
            entry.size = len(data)
            archive.addfile(entry, io.BytesIO(data))
    return out.getvalue()


def wheel(name: str = "laspy", license: str = "BSD-2-Clause", more: dict[str, bytes] | None = None) -> bytes:
    info = f"{name}-1.0.dist-info"
    return zipped({f"{name}/__init__.py": b"", f"{info}/METADATA": f"Metadata-Version: 2.4\nName: {name}\nVersion: 1.0\nLicense-Expression: {license}\n".encode(),
                   f"{info}/licenses/LICENSE.txt": f"The license of {name}.".encode(), **(more or {})})


def lazrs(*crates: tuple[str, str]) -> bytes:
    listed = {"components": [{"name": name, "version": "2.0", "licenses": [{"expression": license}]} for name, license in crates]}
    return wheel("lazrs", "MIT", {"lazrs/lazrs.so": b"", "lazrs-1.0.dist-info/sboms/lazrs.cyclonedx.json": json.dumps(listed).encode()})


GOOD = {"__init__.py": OWN, "readers.txt": b"laspy\n", "draw/glyphs.npz": b"", "LICENSE": b"", "blender_manifest.toml": b"", "manual/index.html": b"",
        "manual/install.html": b"", "manual/lion.jpg": b"", "lib/libpatina.so": X64, "wheels/laspy-1.0-py3-none-any.whl": wheel(),
        "wheels/lazrs-1.0-py3-none-any.whl": lazrs(("laz", "Apache-2.0"), ("rayon", "MIT OR Apache-2.0"), ("syn", "odd")),
        "docs/sources.tar.xz": tarred({"patina-1.0/LICENSE": b"", "patina-1.0/native/base/error.c": b""})}


def faults(name: str, data: bytes) -> list[str]:
    return notices.Package(GOOD | {name: data}, TRACKED).faults


class Origins(unittest.TestCase):
    def only(self, name: str, data: bytes, why: str) -> None:
        found = faults(name, data)
        self.assertEqual(len(found), 1, found)
        self.assertTrue(found[0].startswith(name) and why in found[0], found)

    def test_a_good_package(self) -> None:
        self.assertEqual(notices.Package(GOOD, TRACKED).faults, [])

    def test_files_of_unknown_origin(self) -> None:
        self.only("stray.bin", b"\xff", "git does not track it")
        self.only("sync/stray.py", OWN, "git does not track it")
        self.only("__init__.py", b"import os\n", "no line with GPL-3.0-or-later")
        self.only("manual/stray.jpg", b"", "nor an image")
        self.only("manual/stray.html", b"", "neither a page")
        self.only("lib/libstray.so", b"", "origin is unknown")
        self.only("packages/stray/__init__.py", b"", "origin is unknown")
        self.only("docs/sources.tar.xz", tarred({"patina-1.0/stray.c": b""}), "git does not track it")

    def test_wheels(self) -> None:
        self.only("wheels/numpy-1.0.whl", wheel("numpy"), "does not name: numpy")
        self.only("wheels/laspy-1.0-py3-none-any.whl", wheel(license="GPL-2.0-only"), "its license is GPL-2.0-only; build/notices expects BSD-2-Clause")
        self.only("wheels/laspy-1.0-py3-none-any.whl", wheel(more={"stray/__init__.py": b""}), "outside of laspy")
        self.only("wheels/laspy-1.0-py3-none-any.whl", zipped({"laspy/__init__.py": b""}), "without a name")
        self.only("wheels/lazrs-1.0-py3-none-any.whl", wheel("lazrs", "MIT", {"lazrs/lazrs.so": b""}), "no list of what that is made of")
        self.only("wheels/lazrs-1.0-py3-none-any.whl", lazrs(("odd", "SSPL-1.0")), "crate odd 2.0: its license is SSPL-1.0")

    def test_unpacked_wheels_of_legacy_packages(self) -> None:
        info = "packages/laspy-1.0.dist-info"
        about = b"Name: laspy\nVersion: 1.0\nLicense-Expression: BSD-2-Clause\n"
        good = {"packages/laspy/__init__.py": b"", f"{info}/METADATA": about, f"{info}/licenses/LICENSE.txt": b"Its license."}
        found = notices.Package(good, TRACKED)
        self.assertEqual(found.faults, [])
        self.assertEqual([(work.name, work.own_text) for work in found.works], [("laspy 1.0", "Its license.")])
        self.assertIn("brings no text", notices.Package({name: data for name, data in good.items() if "LICENSE" not in name}, TRACKED).faults[0])


class Texts(unittest.TestCase):
    def test_works_and_licenses_are_named(self) -> None:
        text = notices.notices(notices.Package(GOOD, TRACKED))
        for part in ("glad 2.0.8", "DejaVu Sans", "laspy 1.0", "The license of laspy.", "laz 2.0", "rayon 2.0", "Apache-2.0 (chosen of MIT OR Apache-2.0)",
                     "Copyright (c) 2008-2018 The Khronos Group", "Bitstream", "Creative Commons Legal Code", "Markus Schütz"):
            self.assertIn(part, text)
        self.assertNotIn("syn 2.0", text, "the compiler alone runs it")
        self.assertEqual(text.count("License text: Apache-2.0\n"), 1)
        self.assertNotIn("sigeom", text, "no image of the package shows it")

    def test_what_compilers_add(self) -> None:
        def named(name: str, library: bytes) -> list[bool]:
            found = notices.Package({f"lib/{name}": library}, TRACKED)
            self.assertEqual(found.faults, [])
            return [work in found.works for work in (notices.ZIG, notices.MINGW)]
        self.assertEqual(named("libpatina.so", X64), [False, False])
        self.assertEqual(named("libpatina.so", ARM64), [True, False])
        self.assertEqual(named("libpatina.dylib", b""), [True, False])
        self.assertEqual(named("patina.dll", b"MZ"), [True, True])

    def test_the_text_in_a_package_is_checked(self) -> None:
        own = {name: (ROOT / name).read_bytes() for name in ("LICENSE",)} | {"__init__.py": (ROOT / "addon/__init__.py").read_bytes()}
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "patina-1.zip"
            path.write_bytes(zipped(own))
            self.assertIn("NOTICE.txt", notices.faults_of(path)[0])
            path.write_bytes(zipped(own | {"NOTICE.txt": notices.notices(notices.Package(own)).encode()}))
            self.assertEqual(notices.faults_of(path), [])
            path.write_bytes(zipped(own | {"stray.so": b""}))
            done = subprocess.run([ROOT / "build/notices", "--check", path], capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 1)
            self.assertIn("patina-1.zip: stray.so: its origin is unknown", done.stdout)


if __name__ == "__main__":
    sys.exit(run())
