# SPDX-License-Identifier: GPL-3.0-or-later
"""The bench from end to end on one small case: rows as promised, comparison, page, README marks."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from unittest import mock

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import bench  # noqa: E402
import case as cases  # noqa: E402
import gpu  # noqa: E402
import plots  # noqa: E402
import quoted  # noqa: E402
import readme  # noqa: E402
import rows as kept  # noqa: E402

import native  # noqa: E402

FIELDS = ["scene", "mode", "device", "width", "height", "points", "quality", "threads", "ms_median", "ms_min", "ms_max",
          "peak_mb", "passes", "error"]


class Bench(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        cls.folder = tempfile.TemporaryDirectory()
        cls.out = Path(cls.folder.name)
        cls.text = cls.bench("--quick", "--only", "steady")
        cls.result = json.loads((cls.out / "bench.json").read_text())

    @classmethod
    def tearDownClass(cls) -> None:
        cls.folder.cleanup()

    @classmethod
    def bench(cls, *options: str) -> str:
        done = subprocess.run([sys.executable, str(HERE / "bench.py"), "--device", "cpu", "--out", str(cls.out),
                               *options], capture_output=True, text=True, timeout=300)
        if done.returncode:
            raise AssertionError(done.stderr)
        return done.stdout

    def test_rows(self) -> None:
        self.assertEqual(self.result["absent"], [])
        self.assertEqual(len(self.result["rows"]), len(self.result["details"]))
        row = self.result["rows"][0]
        self.assertEqual(list(row), FIELDS)
        self.assertLessEqual(row["ms_min"], row["ms_median"])
        self.assertLessEqual(row["ms_median"], row["ms_max"])
        self.assertGreater(row["passes"]["scatter"], 0.0)
        self.assertGreater(row["error"]["coverage_iou"], 0.97)
        self.assertGreater(row["error"]["temporal_variance"], 0.0)

    def test_an_unknown_device_is_a_line(self) -> None:
        text = self.bench("--quick", "--only", "headline", "--device", "no-such-device", "--out",
                          str(self.out / "absent"))
        self.assertIn("no-such-device", text)
        result = json.loads((self.out / "absent/bench.json").read_text())
        self.assertTrue(all(row["device"] == "cpu" for row in result["rows"]))
        self.assertTrue(any(row["device"] == "no-such-device" for row in result["absent"]))

    def test_comparison_with_itself(self) -> None:
        text = self.bench("--from", str(self.out / "bench.json"), "--compare", str(self.out / "bench.json"))
        line = next(line for line in text.split("## Against")[1].splitlines() if line.startswith("| sphere"))
        self.assertIn("| 1.000 |", line)
        self.assertIn("+0.00000", line)

    def test_page(self) -> None:
        page = (self.out / "bench.html").read_text()
        self.assertIn("<table>", page)
        self.assertIn("sphere", page)

    def test_front(self) -> None:
        self.assertEqual(plots.front([(1, 5), (2, 3), (3, 4), (4, 1), (0.5, 9)]), [(0.5, 9), (1, 5), (2, 3), (4, 1)])

    def test_readme_marks(self) -> None:
        (self.out / ".pictures").mkdir(exist_ok=True)
        path = self.out / "README.md"
        path.write_text("before\n<!-- bench speed -->\nold\n<!-- end -->\nafter\n")
        headline = [{**detail, "group": "headline"} for detail in self.result["details"]]  # as if it had been asked for
        self.assertIn("speed", readme.update({**self.result, "details": headline}, self.out))
        text = path.read_text()
        self.assertTrue(text.startswith("before\n<!-- bench speed -->\n") and text.endswith("\n<!-- end -->\nafter\n"))
        self.assertIn("depth rms", text)
        self.assertNotIn("old", text)

    def test_readme_keeps_what_could_not_be_measured(self) -> None:
        path = self.out / "README.md"
        path.write_text("<!-- bench leaves -->\nold\n<!-- end -->\n<!-- bench slopes -->\nold\n<!-- end -->\n")
        parts = {"leaves": {"title": "", "text": "| some |\nskip scan.las: there is no such file"},
                 "slopes": {"title": "", "text": "new"}}
        readme.update({**self.result, "parts": parts}, self.out)
        self.assertEqual(path.read_text(), "<!-- bench leaves -->\nold\n<!-- end -->\n<!-- bench slopes -->\nnew\n<!-- end -->\n")

    def test_readme_keeps_a_table_in_place_of_an_empty_one(self) -> None:
        path = self.out / "README.md"
        full, empty = "| a |\n|---|\n| 1 |", "| a |\n|---|"
        path.write_text("<!-- bench leaves -->\nold\n<!-- end -->\n<!-- bench slopes -->\nold\n<!-- end -->\n")
        readme.update({**self.result, "parts": {"leaves": {"title": "", "text": empty}, "slopes": {"title": "", "text": full}}}, self.out)
        self.assertEqual(path.read_text(), f"<!-- bench leaves -->\nold\n<!-- end -->\n<!-- bench slopes -->\n{full}\n<!-- end -->\n")

    def test_rows_are_kept_as_they_come(self) -> None:
        """A run that is interrupted keeps what it has."""
        out = self.out / "interrupted"
        row = {**self.result["rows"][0], **self.result["details"][0]}
        options = argparse.Namespace(quick=True, full=False, readme=False, only=["headline"], frames=1, device=["cpu"], out=out,
                                     library=HERE.parents[1] / "build/out/release/libpatina.so")
        with mock.patch.object(cases, "run", side_effect=[row, KeyboardInterrupt]), self.assertRaises(KeyboardInterrupt):
            bench.measure(options)
        result = json.loads((out / "bench.json").read_text())
        self.assertEqual([one["ms_median"] for one in result["rows"]], [row["ms_median"]])
        self.bench("--from", str(out / "bench.json"))

    def test_frames_of_opengl(self) -> None:
        """Rows of gpu.py: what passes ask for adds up, both devices show the same, a GPU's times are those of its passes."""
        for driver in ("software", "hardware"):
            with mock.patch.dict(os.environ, PATINA_GL_AS=driver, PATINA_LIBRARY=str(HERE.parents[1] / "build/out/release/libpatina.so")):
                found = list(gpu.separately(["20000", "--size", "160x120", "--size", "64x64", "--frames", "3", "--what", "surface", "--what", "6 layers"]))
            if "unavailable" in found[0]:
                self.skipTest(f"there is no OpenGL device here: {found[0]['unavailable']}")
            self.assertEqual([(row["device"], row["what"], row["width"]) for row in found],
                             [(device, what, width) for what, width in (("surface", 160), ("surface", 64), ("6 layers", 160))
                              for device in ("gl-egl", "cpu")])
            result = {**self.result, "rows": [], "details": [], "absent": [], "gpu_bandwidth": 2.0}
            for row in found:
                kept.add(result, row)
            for row in (row for row in found if row["device"] == "gl-egl"):
                self.assertTrue(row["same"], row)
                self.assertEqual(row["hardware"], driver == "hardware")
                self.assertLessEqual({"scatter", "resolve", "fill"}, set(row["passes"]) & set(row["work"]))
                for name in (*gpu.COUNTS, "bytes"):
                    asked = sum(one[name] for one in row["work"].values())
                    self.assertLessEqual(asked, row["gl"][name], name)
                    if name not in ("empty", "waits", "copies"):  # no pass needs these on a GPU
                        self.assertGreater(asked, row["gl"][name] // 2, name)
            path = self.out / "README.md"
            path.write_text("<!-- bench gpu -->\nold\n<!-- end -->\n")
            readme.update(result, self.out)
            self.assertEqual("old" not in path.read_text(), driver == "hardware")  # figures of a GPU come from one
            self.assertIn("| 20k, 160 x 120, surface |", gpu.markdown(result))

    def test_devices_that_differ_are_found(self) -> None:
        subject = gpu.Subject(20_000)
        frames = [native.Frame(native.Device("cpu")) for _ in range(2)]
        for frame, turn in zip(frames, (0.0, 3.0)):
            frame.render(subject.scene("surface", (64, 64), turn))
        self.assertTrue(gpu.agreement(frames[0], frames[0])["same"])
        self.assertFalse(gpu.agreement(*frames)["same"])

    def test_independent(self) -> None:
        """A line a shape and quality, the worst of each column but decibels."""
        row, detail = self.result["rows"][0], {**self.result["details"][0], "group": "independent"}
        rows, details = [], []
        for density, psnr, bias in ((1.0, 30.0, -0.2), (4.0, 35.0, 0.1)):
            error = {"color_psnr": psnr, "inner_holes": 0.001 * density, "outer_growth": 0.0, "depth_rms_spacings": density,
                     "depth_bias_spacings": bias, "flicker_inside": 0.5 * density, "flicker_edges": 2.0}
            rows.append({**row, "scene": "knot", "quality": "analysed", "error": error, "ms_median": density})
            details.append({**detail, "density": density})
        table = readme.independent({**self.result, "rows": rows, "details": details}).splitlines()
        self.assertEqual(len(table), 3)
        self.assertTrue(table[2].startswith("| knot | analysed | 30.0 | 35.0 | 4.0 | 0.40 | 0.00 | 4.00 | -0.200 | 2.0 / 2.0 |"), table[2])

    def test_scaling(self) -> None:
        row, detail = self.result["rows"][0], self.result["details"][0]
        rows = [{**row, "device": "cpu", "threads": threads, "ms_median": ms} for threads, ms in ((1, 12.0), (2, 8.0))]
        result = {**self.result, "rows": rows, "details": [{**detail, "group": "scaling"}] * 2}
        self.assertTrue(readme.scaling(result).endswith("| 12.0 (1.0×) | 8.0 (1.5×) |"))

    def test_quoted(self) -> None:
        library = HERE.parents[1] / "build/out/release/libpatina.so"
        table = quoted.holes(library).splitlines()
        self.assertEqual([row.split()[1] for row in table[2:]], ["0.1", "0.2", "0.3", "0.4", "0.5", "0.75", "1", "2", "4", "8", "16", "30"])
        self.assertRegex(quoted.slopes(library), r"from 5° to 85°, 0\.3 to 10 points a pixel, loses at most 0\.\d{3} % ")


if __name__ == "__main__":
    result = unittest.main(exit=False, verbosity=0).result
    failed, skipped = len(result.failures) + len(result.errors), len(result.skipped)
    print(f"{result.testsRun - failed - skipped} passed, {failed} failed, {skipped} skipped")
    sys.exit(1 if failed else 0)
