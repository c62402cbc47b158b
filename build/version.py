#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The version of Patina: MAJOR.MINOR.PATCH. It is defined in native/include/patina/patina.h.

    build/version.py              prints it
    build/version.py --check      fails where another place has another version
    build/version.py 1.2.3        writes a new version to all places

Blender reads bl_info and blender_manifest.toml without running code, so these two contain the number again. So do the topmost heading of
.github/CHANGELOG.md and, as major and minor version, addon/native/abi.py. Everything else reads the number here: the library, the command
line, and the names and metadata of packages.
"""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
HEADER = "native/include/patina/patina.h"
# File, what surrounds the number there, and how the number is written. Each matches once; of CHANGELOG.md the first match counts.
PLACES = (
    *((HEADER, rf"(#define PATINA_VERSION_{part} )(\d+)()", f"{{{index}}}") for index, part in enumerate(("MAJOR", "MINOR", "PATCH"))),
    ("addon/__init__.py", r'("version": \()(\d+, \d+, \d+)(\))', "{0}, {1}, {2}"),
    ("addon/blender_manifest.toml", r'(^version = ")([^"]*)(")', "{0}.{1}.{2}"),
    ("addon/native/abi.py", r"(^VERSION = \()(\d+, \d+)(\))", "{0}, {1}"),
    (".github/CHANGELOG.md", r"(^## )(\d+\.\d+\.\d+)()", "{0}.{1}.{2}"),
)


def parts(root: Path = ROOT) -> tuple[str, ...]:
    """Major, minor and patch number of the header."""
    header = (root / HEADER).read_text(encoding="utf-8")
    return tuple(re.search(rf"#define PATINA_VERSION_{part} (\d+)", header).group(1) for part in ("MAJOR", "MINOR", "PATCH"))


def number(root: Path = ROOT) -> str:
    return ".".join(parts(root))


def differences(root: Path = ROOT) -> list[str]:
    """A sentence for each place whose version is not the header's."""
    wrong = []
    for name, pattern, form in PLACES:
        found = re.search(pattern, (root / name).read_text(encoding="utf-8"), re.M)
        expected = form.format(*parts(root))
        if not found:
            wrong.append(f"{name} contains no version. Expected {expected}.")
        elif found.group(2) != expected:
            wrong.append(f"{name} contains version {found.group(2)}. {HEADER} defines {expected}.")
    return wrong


def write(new: str, root: Path = ROOT) -> None:
    """Writes MAJOR.MINOR.PATCH to all places."""
    for name, pattern, form in PLACES:
        path = root / name
        text, count = re.subn(pattern, lambda found, form=form: found.group(1) + form.format(*new.split(".")) + found.group(3),
                              path.read_text(encoding="utf-8"), count=1, flags=re.M)
        if not count:
            sys.exit(f"version: {name} contains no version")
        path.write_text(text, encoding="utf-8")


def main() -> int:
    if len(sys.argv) == 1:
        print(number())
    elif sys.argv[1:] == ["--check"]:
        wrong = differences()
        print("\n".join(wrong) or f"All places contain version {number()}.")
        return 1 if wrong else 0
    elif len(sys.argv) == 2 and re.fullmatch(r"\d+\.\d+\.\d+", sys.argv[1]):
        write(sys.argv[1])
    else:
        print(__doc__, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
