# SPDX-License-Identifier: GPL-3.0-or-later
"""build/messages finds the error messages in C and Python, and which rows of the manual explain them."""

import sys
import unittest

from scripts import run, script

messages = script("messages")
C = r'''
    return pt_fail(&cloud->handle, PATINA_ERROR_FILE, "%s: cannot be %s (%5.1f %%)", path, what(a, "no"), 1.0);
    return pt_fail(NULL, bad ? A : B, bad ? "one, (" : "two" " and %llu \"three\"", x);
    pt_fail(NULL, code, "a %" PRIu64 " b", y);
    not_pt_fail(NULL, code, "no");
'''
PYTHON = '''
raise native.PatinaError(f"'{name}': is {a if b else 'c'} gone", -3)
raise PatinaError("plain" if a else f"{b} other")
self.report({'ERROR'}, importers.told(f"Patina: {error}"))
self.report({'ERROR'}, f"Patina: {path.name}: bad " + "end.")
self.report({'WARNING'}, "no")
print("no")
'''


class Code(unittest.TestCase):
    def test_c(self) -> None:
        self.assertEqual(messages.in_c(C), ["…: cannot be … (… %)", "one, (", 'two and … "three"', "a … b"])

    def test_python(self) -> None:
        self.assertEqual(sorted(messages.in_python(PYTHON, {"PatinaError"})), sorted(["'…': is … gone", "plain", "… other", "Patina: …", "Patina: …: bad end."]))
        self.assertEqual(messages.cleaned("Patina: …: … : bad  end."), "… : bad end")

    def test_exceptions(self) -> None:
        tree = messages.ast.parse("class A(Exception): pass\nclass B(mod.A): pass\nclass C(OSError): pass\nclass D(Panel): pass")
        self.assertEqual(messages.exceptions([tree]), {"A", "B", "C"})

    def test_the_tree_has_messages(self) -> None:
        found = messages.messages()
        self.assertGreater(len(found), 500)
        self.assertIn("the scene has no camera", found)
        self.assertIn("'…' has no points", found)


class Page(unittest.TestCase):
    def test_rows(self) -> None:
        page = "# A `no`\n| message | what |\n|---|---|\n| `a …`, `b` | do `c` |\ntext `d`\n"
        self.assertEqual(messages.rows(page), ["a …", "b"])

    def test_the_longest_row_explains(self) -> None:
        chosen, stale = messages.explained({"x: out of memory": "", "x: cut": "", "patina_f: x": "", "else": ""}, ["…: out of memory", "x…", "patina_…", "never"])
        self.assertEqual(chosen, {"x: out of memory": "…: out of memory", "x: cut": "x…", "patina_f: x": "patina_…", "else": None})
        self.assertEqual(stale, ["never"])

    def test_every_message_has_a_row_and_every_row_a_message(self) -> None:
        chosen, stale = messages.explained(messages.messages(), messages.rows(messages.pages()))
        self.assertEqual(stale, [])
        self.assertEqual([message for message, row in chosen.items() if not row], [])


if __name__ == "__main__":
    sys.exit(run())
