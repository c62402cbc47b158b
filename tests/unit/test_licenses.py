# SPDX-License-Identifier: GPL-3.0-or-later
"""build/check_licenses finds source files without a license, and images without sources and terms."""

import sys
import unittest

from scripts import ROOT, run, script

check = script("check_licenses")
OWN = "SPDX-License-Identifier: GPL-3.0-or-later"
PAGE = """# Images
## Scans
| scan | source | credit | terms |
|---|---|---|---|
| `lion.ply` | a site | someone | BSD |
| `bunny.ply` | a site | someone | |
## Images
| image | scans |
|---|---|
| `a.jpg` | lion.ply, generated |
| `b.jpg` | bunny.ply |
| `c.jpg` | dragon.ply |
| `gone.jpg` | generated |
"""


class Sources(unittest.TestCase):
    def test_which_files_need_a_license(self) -> None:
        for name in ("native/a.c", "shaders/b.comp", "shaders/lib/c.glsl", "addon/d.py", "addon/farm/e.js", "build/test", "build/f.cmake",
                     "build/CMakeLists.txt", ".ci/run", ".github/workflows/g.yml", ".pre-commit-config.yaml", "native/kernels.def"):
            self.assertTrue(check.is_source(name), name)
        for name in ("README.md", "LICENSE", "tests/results.json", ".pictures/a.jpg", "tests/fuzz/corpus/style/good", "tests/fuzz/corpus/x/a.c"):
            self.assertFalse(check.is_source(name), name)

    def test_a_missing_line(self) -> None:
        self.assertIn("add a line", check.fault_of("native/a.c", "int a;\n"))
        self.assertIn("add a line", check.fault_of("native/a.c", "\n" * check.LINES + f"// {OWN}\n"), "too far down")
        self.assertEqual(check.fault_of("native/a.c", f"// {OWN}\nint a;\n"), "")
        self.assertEqual(check.fault_of("build/a", f"#!/bin/bash\n# {OWN}\n"), "")
        self.assertEqual(check.fault_of("a.h", f"/* {OWN} */\r\n"), "")

    def test_another_license(self) -> None:
        glad = "/**\n * SPDX-License-Identifier: (WTFPL OR CC0-1.0) AND Apache-2.0\n */\n"
        self.assertEqual(check.fault_of("native/device_gl/glad/gl.c", glad), "")
        self.assertIn("expected GPL-3.0-or-later", check.fault_of("native/base/gl.c", glad))
        self.assertIn("expected (WTFPL", check.fault_of("native/device_gl/glad/gl.c", f"// {OWN}\n"))


class Images(unittest.TestCase):
    def test_tables(self) -> None:
        scans, images = check.tables(PAGE)
        self.assertEqual(list(scans), ["lion.ply", "bunny.ply"])
        self.assertEqual(images["a.jpg"], ["lion.ply, generated"])
        self.assertEqual(check.shown(images["a.jpg"]), ["lion.ply"])

    def test_faults(self) -> None:
        found = dict(check.faults_of_images(["a.jpg", "b.jpg", "c.jpg", "new.jpg"], PAGE))
        self.assertEqual(set(found), {"new.jpg", ".pictures/README.md"})
        texts = [fault for _, fault in check.faults_of_images(["a.jpg", "b.jpg", "c.jpg", "new.jpg"], PAGE)]
        self.assertEqual(len(texts), 4, texts)
        for part in ("which scans", "scan dragon.ply", "gone.jpg does not exist", "bunny.ply lacks"):
            self.assertTrue(any(part in text for text in texts), part)

    def test_every_scan_of_the_gallery_has_terms(self) -> None:
        scans, _ = check.tables((ROOT / ".pictures/README.md").read_text(encoding="utf-8"))
        gallery = (ROOT / "tests/bench/gallery.py").read_text(encoding="utf-8")
        named = check.re.findall(r'Scan\("[^"]*?([^"/]+)"', gallery)
        self.assertGreater(len(named), 15)
        self.assertEqual([name for name in named if name not in scans], [])

    def test_the_tree(self) -> None:
        self.assertEqual(check.faults(), [])


if __name__ == "__main__":
    sys.exit(run())
