# SPDX-License-Identifier: GPL-3.0-or-later
"""The wheel that `build/package --wheel` makes, installed by pip into a fresh environment without a network: its files, its example by its
pixels, and its calls (wheel_calls.py). Makes the wheel first.

    build/out/venv/bin/python tests/unit/test_wheel.py        (that environment brings pip and numpy)
"""
import base64
import hashlib
import os
import re
import struct
import subprocess
import sys
import sysconfig
import tempfile
import unittest
import zipfile
import zlib
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True
sys.path.append(str(ROOT / "build"))
import version  # noqa: E402

INFO = f"patina_render-{version.number()}.dist-info"
COUNTS = []  # lines of wheel_calls.py


def run(*command: object, **how: object) -> str:
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "PATINA", "PIP"))}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment, **how)
    if done.returncode:
        raise AssertionError(f"{command[0]} ended with {done.returncode}: {done.stdout[-1000:]}{done.stderr[-3000:]}")
    return done.stdout


def read_png(path: Path) -> np.ndarray:
    """(h, w, 4) uint8, of a file of write_png: no row is filtered."""
    data = path.read_bytes()
    width, height = struct.unpack_from(">II", data, 16)
    at, packed = 8, b""
    while at < len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        assert zlib.crc32(data[at + 4:at + 8 + size]) == struct.unpack_from(">I", data, at + 8 + size)[0], kind
        packed += data[at + 8:at + 8 + size] if kind == b"IDAT" else b""
        at += 12 + size
    rows = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, 1 + 4 * width)
    assert not rows[:, 0].any()
    return rows[:, 1:].reshape(height, width, 4)


class Wheel(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        run(ROOT / "build/package", "--wheel")
        cls.wheel = ROOT / f"build/out/packages/patina_render-{version.number()}-py3-none-manylinux_2_28_x86_64.whl"
        scratch = tempfile.TemporaryDirectory()
        cls.addClassCleanup(scratch.cleanup)
        cls.work = Path(scratch.name)
        run(sys.executable, "-m", "venv", "--without-pip", cls.work / "fresh")
        cls.python = cls.work / "fresh/bin/python"
        site = Path(run(cls.python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))").strip())
        (site / "numpy.pth").write_text(sysconfig.get_path("purelib"), encoding="utf-8")  # numpy as it is here
        run(sys.executable, "-m", "pip", "--python", cls.python, "install", "-q", "--no-index", "--no-deps", cls.wheel)
        cls.site = site

    def test_files(self) -> None:
        with zipfile.ZipFile(self.wheel) as archive:
            names = set(archive.namelist())
            rows = [line.split(",") for line in archive.read(f"{INFO}/RECORD").decode().splitlines()]
            self.assertEqual({row[0] for row in rows}, names)
            for name, digest, size in rows[:-1]:
                data = archive.read(name)
                self.assertEqual(digest, "sha256=" + base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode(), name)
                self.assertEqual(int(size), len(data), name)
            self.assertIn("Tag: py3-none-manylinux_2_28_x86_64\n", archive.read(f"{INFO}/WHEEL").decode())
            metadata = archive.read(f"{INFO}/METADATA").decode()
            for line in ("Name: patina-render", f"Version: {version.number()}", "Requires-Dist: numpy>=1.22", "License: GPL-3.0-or-later"):
                self.assertIn(f"{line}\n", metadata)
            binding = {name.removeprefix("patina_render/_native/"): archive.read(name) for name in names if "/_native/" in name}
            self.assertEqual(binding, {path.name: path.read_bytes() for path in (ROOT / "addon/native").glob("*.py")}, "the add-on's own binding")
            library = self.work / "libpatina.so"
            library.write_bytes(archive.read("patina_render/lib/libpatina.so"))
        self.assertTrue({f"{INFO}/LICENSE", f"{INFO}/NOTICE", "patina_render/example.py"} <= names)
        self.assertIn("0 failed", run(ROOT / "build/check_library", library))
        self.assertLess(self.wheel.stat().st_size, 3e6)

    def test_is_installed(self) -> None:
        told = run(self.python, "-c", "import patina_render; print(patina_render.__file__, patina_render.version())", cwd=self.work).split()
        self.assertTrue(told[0].startswith(str(self.site)), told)
        self.assertTrue(told[1].startswith(f"{version.number()}+"), told)
        self.assertIn(f"patina-render {version.number()}", run(sys.executable, "-m", "pip", "--python", self.python, "list", "--format", "freeze",
                                                              "--disable-pip-version-check").replace("==", " "))

    def test_nothing_is_loaded_on_import(self) -> None:
        run(self.python, "-c", "import patina_render; assert 'libpatina' not in open('/proc/self/maps').read()", cwd=self.work)

    def test_example(self) -> None:
        """A torus on white, lit from the upper left, with a hole."""
        image = self.work / "torus.png"
        said = run(self.python, "-m", "patina_render.example", image, cwd=self.work)
        self.assertRegex(said, r"^31% of the pixels show the torus, 2\.7\d to 4\.7\d away\n$")
        pixels = read_png(image)
        self.assertEqual(pixels.shape, (480, 640, 4))
        self.assertTrue((pixels[..., 3] == 255).all())
        for row, column in ((5, 5), (475, 635), (240, 320), (90, 320)):
            self.assertEqual(pixels[row, column, :3].tolist(), [255, 255, 255], (row, column))
        left, right, top, bottom = (pixels[row, column, :3].astype(int) for row, column in ((230, 150), (230, 490), (140, 380), (340, 320)))
        self.assertTrue(left[1] > left[0] and left[2] > left[0], left)  # cyan
        self.assertTrue(right[0] > right[1] > right[2], right)  # orange
        self.assertTrue(top[0] > top[1] and top[2] > top[1], top)  # violet
        self.assertTrue(min(bottom[:2]) > bottom[2] + 50, bottom)  # yellow
        self.assertLess(pixels[400, 420, :3].sum(), pixels[320, 250, :3].sum(), "the lower right is in shade")
        again = subprocess.run([self.python, "-m", "patina_render.example", image], capture_output=True, text=True, check=False)
        self.assertNotEqual(again.returncode, 0)
        self.assertIn("exists", again.stderr)

    def test_manual_shows_the_example(self) -> None:
        """The manual's page prints it as it is."""
        page = (ROOT / "addon/manual/python.md").read_text(encoding="utf-8")
        example = (ROOT / "python/patina_render/example.py").read_text(encoding="utf-8")
        shown = re.search(r"```python\n(.*?)```", page[page.index("example"):], re.S).group(1)
        body = re.search(r"def main.*?\n(.*?)\n\nif", example, re.S).group(1)
        self.assertIn("\n".join(line.removeprefix("    ") for line in body.rstrip().splitlines()), shown.replace('"torus.png"', "path"))

    def test_calls(self) -> None:
        folder = self.work / "files"
        folder.mkdir()
        said = run(self.python, ROOT / "tests/unit/wheel_calls.py", folder, cwd=self.work)
        COUNTS.append(int(re.search(r"(\d+) passed, 0 failed", said).group(1)))


if __name__ == "__main__":
    result = unittest.main(exit=False).result
    bad = len(result.failures) + len(result.errors)
    print(f"{result.testsRun - bad + sum(COUNTS)} passed, {bad} failed, 0 skipped")
    sys.exit(1 if bad else 0)
