# SPDX-License-Identifier: GPL-3.0-or-later
"""build/docs: links of pages fit the site, headers become pages with each function, and menus show each page once."""

import re
import sys
import tempfile
import unittest
from pathlib import Path

from scripts import ROOT, run, script

docs = script("docs")
HEADER = """// SPDX-License-Identifier: GPL-3.0-or-later
// What it is: a * b.
//
//     code(here);
#ifndef PATINA_H
#define PATINA_H
#include <stddef.h>

// ---- clouds ----------

typedef struct patina_cloud patina_cloud;

// A size. Two
// lines.
typedef struct patina_size {
    int width; // pixels
} patina_size;

// Loads `*path`.
PATINA_API int patina_load(const char *path,
                           patina_cloud **out);
PATINA_API void patina_free(patina_cloud *cloud);

#define PATINA_LIST(X) \\
    X(A)               \\
    X(B)
#endif
"""


class Links(unittest.TestCase):
    def test_links(self) -> None:
        def of(name: str, text: str) -> str:
            return docs.with_links(name, text).rstrip("\n")
        self.assertEqual(of("addon/manual/trust.md", "[a](color.md#b) [c](../README.md) ![d](../../.pictures/lion.jpg)"),
                         "[a](color.md#b) [c](index.md) ![d](../images/lion.jpg)")
        self.assertEqual(of("README.md", "[a](native/include/patina/patina.h), [b](LICENSE), [c](https://x.org), [d](#e)"),
                         "[a](interface/patina.md), b, [c](https://x.org), [d](#e)")
        self.assertEqual(of("README.md", "`[a](LICENSE)` [`b`](addon/README.md)"), "`[a](LICENSE)` [`b`](manual/index.md)")
        self.assertEqual(of("README.md", "```\n[a](LICENSE)\n```"), "```\n[a](LICENSE)\n```")

    def test_places(self) -> None:
        self.assertEqual(docs.place_of(".github/CHANGELOG.md"), "project/CHANGELOG.md")
        self.assertEqual(docs.place_of(".pictures/scans/trust.md"), "images/scans/trust.md")
        for name in ("LICENSE", "native/base/error.h", "native/device_gl/glad/README.md", ".github/ISSUE_TEMPLATE/wish.md"):
            self.assertIsNone(docs.place_of(name), name)


class Headers(unittest.TestCase):
    def test_a_page(self) -> None:
        page = docs.header_page("native/include/patina/patina.h", HEADER)
        self.assertEqual(re.findall(r"^#+ .*", page, re.M), ["# patina.h", "## Clouds", "### patina_cloud", "### patina_size", "### patina_load", "### patina_free",
                                                             "### PATINA_LIST"])
        self.assertIn(r"What it is: a \* b.", page)
        self.assertIn("    code(here);", page)
        self.assertIn("    int width; // pixels\n} patina_size;\n```\n\nA size. Two\nlines.", page)
        self.assertIn("patina_cloud **out);\n```\n\nLoads `*path`.", page)
        self.assertNotIn("ifndef", page)

    def test_every_function_of_every_header_has_a_heading(self) -> None:
        count = 0
        for path in sorted((ROOT / docs.HEADERS).glob("*.h")):
            text = path.read_text(encoding="utf-8")
            headings = re.findall(r"^### (\w+)", docs.header_page(path.name, text), re.M)
            functions = docs.public_functions(text)
            count += len(functions)
            self.assertEqual([name for name in functions if headings.count(name) != 1], [], path.name)
        self.assertGreater(count, 100)


class Site(unittest.TestCase):
    def test_every_page_is_in_the_menu_once(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            docs.write_pages(Path(folder), Path(folder) / "site")
            pages = sorted(path.relative_to(Path(folder) / "pages").as_posix() for path in Path(folder).rglob("*.md"))
            menu = re.findall(r"([\w/.-]+\.md)$", (Path(folder) / "mkdocs.yml").read_text(encoding="utf-8").split("nav:\n")[1], re.M)
            self.assertEqual(sorted(menu), pages)

    @unittest.skipUnless((docs.OUT / "docs/bin/mkdocs").exists(), "docs: build/setup docs installs what builds the site")
    def test_broken_links_are_faults(self) -> None:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            docs.write_pages(folder, folder / "site")
            with (folder / "pages/manual/trust.md").open("a", encoding="utf-8") as page:
                page.write("\n" + docs.with_links("addon/manual/trust.md", "[x](nowhere.md) [y](color.md#nothing) ![z](../../.pictures/no.jpg)"))
            found = docs.generated(folder)
            for part in ("nowhere.md", "no anchor '#nothing'", "no.jpg"):
                self.assertIn(part.replace("no anchor", "does not contain an anchor"), found)

    def test_pages_that_load_from_elsewhere(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            page = Path(folder) / "a.html"
            page.write_text('<a href="https://x.org">x</a> <img src="images/a.jpg"> <link rel="stylesheet" href="a.css">')
            self.assertEqual(docs.loads_from_elsewhere(Path(folder)), [])
            page.write_text('<script src="https://x.org/a.js"></script>')
            self.assertEqual(len(docs.loads_from_elsewhere(Path(folder))), 1)

    def test_groups_follow_the_index(self) -> None:
        text = "## A\n| x | [a](manual/a.md), [b](manual/b.md#c) |\n## B\n| y | [a](manual/a.md) [d](../x.md) |\n## C\n| z | [e](manual/e.md) |\n"
        self.assertEqual(docs.groups(text), [("A", ["addon/manual/a.md", "addon/manual/b.md"]), ("C", ["addon/manual/e.md"])])


if __name__ == "__main__":
    sys.exit(run())
