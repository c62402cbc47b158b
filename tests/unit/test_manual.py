# SPDX-License-Identifier: GPL-3.0-or-later
"""build/check_manual finds the faults that it is there to find, and build/package makes pages whose links and images exist."""

import re
import subprocess
import sys
import unittest

from scripts import ROOT, run, script

check = script("check_manual")
WORDS = " ".join(["word"] * 36)


def manual() -> str:
    pages = [ROOT / "addon/README.md", *(ROOT / "addon/manual").glob("*.md")]
    return "\n".join(path.read_text(encoding="utf-8") for path in pages)


class Prose(unittest.TestCase):
    def lines(self, text: str) -> list[int]:
        return [number for number, _ in check.long_lines(text)]

    def sentences(self, text: str) -> list[int]:
        return [number for number, _ in check.long_sentences(text)]

    def test_long_lines(self) -> None:
        long = "x" * 60 + " " + "y" * 60
        self.assertEqual(self.lines(f"short\n{long}\n"), [2])
        self.assertEqual(self.lines(f"# {long}\n"), [1])
        self.assertEqual(self.lines(f"| {long} |\n```sh\n{long}\n```\n![{long}](a.png)\n"), [])
        self.assertEqual(self.lines(f"{'x' * 100} [link](manual/{'y' * 40}.md) `{'z' * 40}`\n"), [])

    def test_long_sentences(self) -> None:
        self.assertEqual(self.sentences(f"Short.\n\n{WORDS}.\n"), [3])
        self.assertEqual(self.sentences(f"- {WORDS}\n- short\n"), [1])
        self.assertEqual(self.sentences(f"| a | {WORDS} |\n"), [1])
        half = " ".join(["word"] * 20)
        self.assertEqual(self.sentences(f"{half}. {half}.\n\n- {half}\n- {half}\n\n```sh\n{WORDS}\n```\n"), [])
        self.assertEqual(self.sentences(f"{half}\n{half}.\n"), [1], "a sentence goes on in the next line")

    def test_wrong_terms(self) -> None:
        def of(text: str) -> list[str]:
            return [fault for _, fault in check.wrong_terms(text)]
        self.assertEqual(of("Two Colours, coloured; analysed."),
                         ["write 'color' instead of 'colours'", "write 'color' instead of 'coloured'", "write 'analyze' instead of 'analysed'"])
        self.assertEqual(of("A `picture` in *Baked Picture*, `analyse`; colors."), [])

    def test_dead_links(self) -> None:
        def of(text: str) -> list[str]:
            return [fault for _, fault in check.dead_links(ROOT / "addon/README.md", text)]
        self.assertEqual(of("[a](manual/install.md) [b](manual/install.md#which-zip) ![c](../.pictures/path.jpg) [d](https://x.org)"), [])
        self.assertEqual(len(of("[a](manual/nothing.md) ![b](../.pictures/nothing.jpg) [c](manual/install.md#nothing)")), 3)
        self.assertEqual(of("`[a](nothing.md)`\n```\n[a](nothing.md)\n```\n"), [])


class Named(unittest.TestCase):
    def test_options(self) -> None:
        found = check.options()
        for name in ("--size", "--edl", "--soft-field", "--neighbours", "--next", "--patina-strict", "--rounds", "--pack"):
            self.assertIn(name, found)

    def test_labels(self) -> None:
        found = {(path, label) for path, _, label in check.properties()}
        for pair in (("soft.py", "Transition"), ("brush.py", "Strength"), ("preferences.py", "Cache Folder"), ("effects.def", "Eye-Dome Lighting"),
                     ("import_points.py", "Keep Every")):
            self.assertIn(pair, found)
        source = "class A:\n    a: BoolProperty(name='Shown')\n    b: IntProperty(name='Not Shown', options={'HIDDEN'})\n"
        self.assertEqual(check.properties_in(source), [("a", "Shown")])
        self.assertEqual(check.named_labels("Choose *Points > Color: Height*, **not** `*Code*`.") & {"Color", "Height", "Code", "not"}, {"Color", "Height"})

    def test_what_is_missing(self) -> None:
        text = manual()
        self.assertEqual(list(check.missing(text)), [])
        self.assertEqual([fault for fault in check.missing(text.replace("--soft-shells", "")) if "--soft-shells" in fault],
                         ["the manual does not name the option --soft-shells (soft.c)"])
        self.assertTrue([fault for fault in check.missing(text.replace("*Keep Every*", "it")) if "*Keep Every*" in fault])

    def test_styles(self) -> None:
        page = (ROOT / "addon/manual/styles.md").read_text(encoding="utf-8")
        self.assertEqual(list(check.styles(page)), [])
        self.assertEqual(list(check.styles(page.replace("| *Museum* |", "| it |"))),
                         ["museum.json: add a row '| *Museum* | what it shows |' to the table in addon/manual/styles.md"])

    def test_all_holds(self) -> None:
        done = subprocess.run([sys.executable, ROOT / "build/check_manual"], capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stdout), (0, "1 passed, 0 failed, 0 skipped\n"))


class Pages(unittest.TestCase):
    def test_links_and_images(self) -> None:
        if subprocess.run(["/usr/bin/python3", "-c", "import markdown"], capture_output=True, check=False).returncode:
            self.skipTest("Debian's python3-markdown is missing: build/setup")
        files = script("package").manual()
        pages = {name: data.decode() for name, data in files.items() if name.endswith(".html")}
        self.assertEqual(pages.keys(), {"manual/index.html", *(f"manual/{path.stem}.html" for path in (ROOT / "addon/manual").glob("*.md"))})
        for name, page in pages.items():
            for target in re.findall(r'href="([^"]+)"', page):
                if ":" not in target:
                    there, _, anchor = target.partition("#")
                    other = pages[f"manual/{there}"] if there else page
                    self.assertTrue(not anchor or f'id="{anchor}"' in other, f"{name}: {target}")
            for image in re.findall(r'src="([^"]+)"', page):
                self.assertTrue(files[f"manual/{image}"].is_file(), f"{name}: {image}")
        linked = set(re.findall(r'href="([\w-]+\.html)', pages["manual/index.html"]))
        self.assertEqual({f"manual/{name}" for name in linked}, pages.keys() - {"manual/index.html"}, "the index leads to every page")
        self.assertIn("<table>", pages["manual/index.html"])
        self.assertIn("<pre>", pages["manual/command-line.html"])
        self.assertIn("auto|splats", pages["manual/options.html"])


if __name__ == "__main__":
    sys.exit(run())
