# SPDX-License-Identifier: GPL-3.0-or-later
"""What `build/package --tarball` packed works in any folder: programs compile and link by pkg-config, the command line renders, the man page
and the completion name every option. Makes the tarball first.

    test_tarball.py
"""
import math
import re
import shlex
import shutil
import subprocess
import sys
import tarfile
import tempfile
import unittest
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True
sys.path.append(str(ROOT / "build"))
import version  # noqa: E402


def run(*command: object, **how: object) -> str:
    done = subprocess.run(command, capture_output=True, text=True, check=False, **how)
    if done.returncode:
        raise AssertionError(f"{command[0]} ended with {done.returncode}: {done.stdout[-400:]}{done.stderr[-1000:]}")
    return done.stdout


def completed(script: Path, *words: str) -> list[str]:
    """What bash offers for the last of the words."""
    text = f"source '{script}'; COMP_WORDS=(patina {' '.join(repr(word) for word in words)}); COMP_CWORD={len(words)}; _patina; " \
           "printf '%s\\n' \"${COMPREPLY[@]}\""
    return sorted(filter(None, run("bash", "--norc", "-c", text, cwd=script.parent).splitlines()))


# Stands in for zsh's completion system, which has these only while the user types. Prints what would be shown.
ZSH = """compadd() { shift; print -l -- "$@" }
_describe() { print -l -- "${found[@]%%:*}" }
_files() { print -l -- * }
_message() { }
compset() { PREFIX=${PREFIX#*=} }
"""


def completed_in_zsh(script: Path, *words: str) -> list[str]:
    """What zsh offers for the last of the words."""
    text = ZSH + f"words=(patina {' '.join(map(shlex.quote, words))}) CURRENT={len(words) + 1} PREFIX={shlex.quote(words[-1])}; source {shlex.quote(str(script))}"
    typed = words[-1].partition("=")[2] if "=" in words[-1] else words[-1]
    return sorted({word for word in run("zsh", "-f", "-c", text, cwd=script.parent).splitlines() if word and word.startswith(typed)})


class Tarball(unittest.TestCase):
    @classmethod
    def setUpClass(cls) -> None:
        run(ROOT / "build/package", "--tarball")
        scratch = tempfile.TemporaryDirectory()
        cls.addClassCleanup(scratch.cleanup)
        cls.work = Path(scratch.name)
        name = f"patina-{version.number()}-linux-x86_64"
        with tarfile.open(ROOT / f"build/out/packages/{name}.tar.gz") as archive:
            archive.extractall(cls.work / "a folder")
        cls.prefix = cls.work / "a folder" / name
        cls.environment = {"PATH": "/usr/bin:/bin", "PKG_CONFIG_PATH": str(cls.prefix / "lib/pkgconfig")}
        cls.points = cls.work / "ball.xyz"
        spiral = [(1 - i / 2000, 2.4 * i) for i in range(4000)]  # from pole to pole of a ball
        cls.points.write_text("".join(f"{(1 - z * z) ** .5 * math.cos(turn):.5f} {(1 - z * z) ** .5 * math.sin(turn):.5f} {z:.5f}\n"
                                      for z, turn in spiral), encoding="utf-8")

    def compiled(self, source: Path, name: str) -> Path:
        """A program that links the unpacked library and finds it there."""
        words = shlex.split(run("pkg-config", "--cflags", "--libs", "patina", env=self.environment))
        program = self.work / name
        run("gcc", "-std=c11", "-Wall", "-Wextra", "-Werror", source, *words, f"-Wl,-rpath,{self.prefix}/lib", "-lm", "-o", program)
        return program

    def test_holds_what_a_prefix_holds(self) -> None:
        number = version.number()
        for name in ("bin/patina", f"lib/libpatina.so.{number}", "lib/libpatina.so", "lib/pkgconfig/patina.pc", "share/man/man1/patina.1",
                     "share/bash-completion/completions/patina", "share/zsh/site-functions/_patina", "LICENSE", "NOTICE", "README"):
            self.assertTrue((self.prefix / name).is_file(), name)
        headers = {path.name for path in (ROOT / "native/include/patina").iterdir()}
        self.assertEqual({path.name for path in (self.prefix / "include/patina").iterdir()}, headers)
        library = (self.prefix / "lib/libpatina.so").resolve()
        told = run("readelf", "-d", library)
        soname = re.search(r"SONAME.*\[(.*)\]", told).group(1)
        major, minor, _ = number.split(".")
        self.assertEqual(soname, f"libpatina.so.0.{minor}" if major == "0" else f"libpatina.so.{major}")
        self.assertEqual((self.prefix / "lib" / soname).resolve(), library)
        self.assertIn("0 failed", run(ROOT / "build/check_library", library))
        notice = (self.prefix / "NOTICE").read_text(encoding="utf-8")
        for word in ("glad", "Permission is hereby granted", "The Khronos Group", "Apache-2.0"):
            self.assertIn(word, notice)

    @unittest.skipUnless(shutil.which("pkg-config"), "pkg-config is not installed: build/setup")
    def test_pkg_config(self) -> None:
        self.assertEqual(run("pkg-config", "--modversion", "patina", env=self.environment).strip(), version.number())

    @unittest.skipUnless(shutil.which("pkg-config"), "pkg-config is not installed: build/setup")
    def test_example_of_the_readme(self) -> None:
        """native/README.md's program, as it is printed there."""
        readme = (ROOT / "native/README.md").read_text(encoding="utf-8")
        source = self.work / "view.c"
        source.write_text(re.search(r"```c\n(#include <patina/patina\.h>.*?)```", readme, re.S).group(1), encoding="utf-8")
        program = self.compiled(source, "view")
        run(program, self.points)
        missing = subprocess.run([program, self.work / "none.ply"], capture_output=True, text=True, check=False)
        self.assertEqual(missing.returncode, 1)
        self.assertIn("none.ply", missing.stderr)

    @unittest.skipUnless(shutil.which("pkg-config"), "pkg-config is not installed: build/setup")
    def test_pixels(self) -> None:
        self.assertIn("a ball", run(self.compiled(ROOT / "tests/unit/test_example.c", "ball")))

    def test_command_line(self) -> None:
        patina = self.prefix / "bin/patina"
        self.assertRegex(run(patina, "version"), rf"^patina {re.escape(version.number())}\+[0-9a-f]{{12}}\n$")
        image = self.work / "ball.png"
        run(patina, "render", self.points, "-o", image, "--size", "64x64", "--device", "cpu")
        self.assertEqual(image.read_bytes()[:8], b"\x89PNG\r\n\x1a\n")

    def options(self) -> set[str]:
        """That the command prints itself."""
        usage = run(self.prefix / "bin/patina", "help")
        return set(re.findall(r"(?<=\s)--[a-z][a-z-]*", usage.partition("Topics")[2]))

    @unittest.skipUnless(shutil.which("man"), "man is not installed: build/setup")
    def test_man_page(self) -> None:
        page = self.prefix / "share/man/man1/patina.1"
        done = subprocess.run(["man", "-l", "--warnings", page], capture_output=True, text=True, check=False,
                              env={"PATH": "/usr/bin:/bin", "LC_ALL": "C", "MANWIDTH": "200", "MANPAGER": "cat"})
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        shown = re.sub(r".\x08", "", done.stdout)
        options = self.options()
        self.assertGreater(len(options), 90)
        self.assertEqual({option for option in options if not re.search(rf"{option}(?![a-z-])", shown)}, set())
        for word in ("SYNOPSIS", "patina scatter FILE...", "EXIT STATUS", "effects: depth cues", version.number()):
            self.assertIn(word, shown)

    def test_completion(self) -> None:
        script = self.prefix / "share/bash-completion/completions/patina"
        self.completes(script, completed)
        self.assertEqual(completed(script, "render", "--surface", "=", "sp"), ["splats"])

    @unittest.skipUnless(shutil.which("zsh"), "zsh is not installed: build/setup")
    def test_completion_in_zsh(self) -> None:
        script = self.prefix / "share/zsh/site-functions/_patina"
        self.completes(script, completed_in_zsh)
        self.assertEqual(completed_in_zsh(script, "render", "--surface=sp"), ["splats"])
        self.assertTrue(script.read_text(encoding="utf-8").startswith("#compdef patina\n"))

    def completes(self, script: Path, completed: Callable[..., list[str]]) -> None:
        self.assertEqual(completed(script, "re"), ["render"])
        self.assertEqual(completed(script, "render", "--surf"), ["--surface"])
        self.assertEqual(completed(script, "render", "--surface", ""), ["auto", "fill", "ranges", "splats"])
        self.assertIn("gl-egl", completed(script, "render", "--device", ""))
        self.assertEqual(completed(script, "convert", "--analysis", ""), ["off", "on"])
        self.assertEqual(completed(script, "render", "--analysis", ""), ["auto", "grid", "off", "on"])
        self.assertEqual(completed(script, "convert", "--p"), ["--pack"])
        self.assertEqual(completed(script, "merge", "--"), ["--device", "--memory", "--next", "--output", "--threads", "--verbose"])
        self.assertEqual(completed(script, "ground", "--"), ["--cell", "--largest", "--output", "--threshold"])
        self.assertIn("--contours", completed(script, "draw", "--"))
        self.assertEqual(completed(script, "render", "--depth", ""), ["point", "surface"])
        self.assertEqual(completed(script, "draw", "--depth", ""), [], "the lengths of a drawing")
        self.assertEqual(completed(script, "render", "--size", ""), [], "a number is no file")
        (script.parent / "a cloud.ply").touch()
        self.assertEqual(completed(script, "info", "a"), ["a cloud.ply"])
        self.assertEqual(completed(script, "draw", "--batch", "a"), ["a cloud.ply"])
        self.assertEqual(completed(script, "render", "--batch", "a"), [], "points at a time")
        self.assertIn("soft", completed(script, "help", "s"))
        of_commands = {option for command in ("convert", "analyse", "distance", "ground", "draw", "render", "scatter", "merge")
                       for option in completed(script, command, "--")}
        self.assertEqual(self.options() - of_commands, set())


if __name__ == "__main__":
    result = unittest.main(exit=False).result
    bad = len(result.failures) + len(result.errors)
    for test, why in result.skipped:
        print(f"skip {test.id().rpartition('.')[2]}: {why}")
    print(f"{result.testsRun - bad - len(result.skipped)} passed, {bad} failed, {len(result.skipped)} skipped")
    sys.exit(1 if bad else 0)
