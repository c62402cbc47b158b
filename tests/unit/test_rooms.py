# SPDX-License-Identifier: GPL-3.0-or-later
"""build/check_rooms says what it is there to say: on a copy of the sources as they are, nothing; of each thing that must not be, where
it is."""

import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
READER = "addon/sync/points/attributes.py"  # of Blender's memory


class Rooms(unittest.TestCase):
    def setUp(self) -> None:
        made = tempfile.TemporaryDirectory()
        self.addCleanup(made.cleanup)
        self.folder = Path(made.name)
        for name in ("native", "shaders", "addon", "python"):
            shutil.copytree(ROOT / name, self.folder / name, ignore=shutil.ignore_patterns("glad", "__pycache__", "presets"))
        (self.folder / "build").mkdir()
        shutil.copy(ROOT / "build/check_rooms", self.folder / "build")

    def check(self) -> tuple[int, str]:
        done = subprocess.run([sys.executable, self.folder / "build/check_rooms"], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout + done.stderr

    def refuses(self, name: str, line: str, *said: str) -> None:
        """With this line at the file's end it fails and says all of `said`; without it, no more."""
        path = self.folder / name
        before = path.read_bytes()
        path.write_bytes(before + b"\n" + line.encode() + b"\n")
        code, text = self.check()
        self.assertEqual(code, 1, f"{name}: {line!r} was taken: {text}")
        for word in said:
            self.assertIn(word, text)
        path.write_bytes(before)
        self.assertEqual(self.check()[0], 0)

    def test_nothing_is_wrong(self) -> None:
        code, text = self.check()
        self.assertEqual(code, 0, text)
        self.assertIn("0 wrong", text)

    def test_memory_is_read_in_one_file(self) -> None:
        lines = ("import ctypes", "from ctypes import string_at", "values = np.ctypeslib.as_array(pointer, (3,))",
                 "word = c_float.from_address(mesh.as_pointer())", "seen = numpy.array(Holder(__array_interface__=told))",
                 "words = (c_int * 4).from_buffer(layer)")
        for line in lines:
            self.refuses("addon/sync/points/clouds.py", line, "addon/sync/points/clouds.py:", "memory by its address", READER)
        self.refuses("python/patina_render/renders.py", "import ctypes", "python/patina_render/renders.py:", "memory by its address")
        number = len((self.folder / "addon/draw/viewport.py").read_text(encoding="utf-8").splitlines()) + 2
        self.refuses("addon/draw/viewport.py", "import ctypes", f"addon/draw/viewport.py:{number}:")
        for name in (READER, "addon/native/__init__.py"):
            path = self.folder / name
            path.write_text(path.read_text(encoding="utf-8") + "\nimport ctypes\n", encoding="utf-8")
            self.assertEqual(self.check()[0], 0, f"{name} may")

    def test_rooms_and_circles(self) -> None:
        self.refuses("native/plan/effects.c", '#include "run/frame.h"', "plan may not know run")
        self.refuses("native/scene/clouds/cloud.c", "#include <pthread.h>", "operating system")
        self.refuses("native/plan/plan.h", '#include "passes.h"', "a circle")

    def test_imports_of_the_addon_go_one_way(self) -> None:
        self.refuses("addon/sync/points/ranges.py", "from ...operators import polls", "ranges.py:", "sync may not import operators")
        self.refuses("addon/draw/pace.py", "def late():\n    from ..ui import rows", "draw may not import ui")
        self.refuses("addon/description/view.py", "from ..sync.view import camera", "description may not import sync")
        self.refuses("addon/native/loader.py", "from .. import options", "native may not import options")
        self.refuses("addon/sync/view/camera.py", "def late():\n    from . import clipping", "a circle of imports", "sync.view.camera", "sync.view.clipping")
        self.refuses("addon/read/streaming/source.py", "def late():\n    import ept", "a circle of imports", "read.streaming.source")

    def test_readers_and_writers_do_not_know_blender(self) -> None:
        for name in ("description/points.py", "native/frames.py", "read/importers/las.py", "write/exporters.py", "jobs.py"):
            self.refuses(f"addon/{name}", "import bpy", f"addon/{name}:", "may not import bpy")
        self.refuses("addon/read/readers.py", "def late():\n    from mathutils import Vector", "read may not import mathutils")

    def test_sizes_of_the_addon(self) -> None:
        self.refuses("addon/ui/rows.py", "# more\n" * 500, "addon/ui/rows.py:", "more than 500")
        flat = [self.folder / f"addon/{name}.py" for name in ("one", "two", "three")]
        for path in flat:
            path.write_text("", encoding="utf-8")
        code, text = self.check()
        self.assertEqual(code, 1, text)
        for said in ("ADDON in build/check_rooms does not list one", "lie flat, more than 12"):
            self.assertIn(said, text)


if __name__ == "__main__":
    unittest.main()
