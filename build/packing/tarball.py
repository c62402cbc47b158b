# SPDX-License-Identifier: GPL-3.0-or-later
"""patina-VERSION-linux-x86_64.tar.gz: the library, its headers and the command line, as they lie in a prefix such as /usr/local."""
import gzip
import subprocess
import sys
import tempfile
from pathlib import Path

import version

from . import command_texts, notice
from .common import LARGEST, OUT, ROOT, say, tarred

# Relative to itself, so that the unpacked folder may be moved.
PKG_CONFIG = """prefix=${{pcfiledir}}/../..
libdir=${{prefix}}/lib
includedir=${{prefix}}/include

Name: Patina
Description: Renders point clouds as closed surfaces
Version: {version}
Cflags: -I${{includedir}}
Libs: -L${{libdir}} -lpatina
"""

README = """Patina {version} for Linux on x86-64

bin/patina          the command line: man -l share/man/man1/patina.1. It needs glibc 2.34 and libpng 1.6
lib, include        the library and its interface, include/patina/patina.h. The library needs glibc 2.28
lib/pkgconfig       PKG_CONFIG_PATH=.../lib/pkgconfig pkg-config --cflags --libs patina
share               the man page and the completion of options in bash and zsh

Everything works in the unpacked folder, wherever that is. To install it for all users:

    sudo cp -a bin include lib share /usr/local && sudo ldconfig
"""


def make() -> None:
    say("compiling the library and the command line; the first time takes minutes")
    subprocess.run([ROOT / "build/compile", "release", "patina_packed", "patina_tool_packed"], check=True)
    number, packed = version.number(), ROOT / "build/out/release/packed"
    name = f"patina-{number}-linux-x86_64"
    help_ = command_texts.read(packed / "bin/patina")
    files = {"LICENSE": ROOT / "LICENSE", "NOTICE": notice.text(number), "README": README.format(version=number),
             "lib/pkgconfig/patina.pc": PKG_CONFIG.format(version=number), "share/man/man1/patina.1": command_texts.man_page(help_, number),
             "share/bash-completion/completions/patina": command_texts.bash_completion(help_),
             "share/zsh/site-functions/_patina": command_texts.zsh_completion(help_)}
    for path in sorted((ROOT / "native/include/patina").iterdir()):
        files[f"include/patina/{path.name}"] = path
    with tempfile.TemporaryDirectory() as scratch:
        for program in ("bin/patina", f"lib/libpatina.so.{number}"):
            files[program] = Path(scratch) / Path(program).name
            subprocess.run(["strip", "--strip-unneeded", "-o", files[program], packed / program], check=True)
        soname = str((packed / "lib/libpatina.so").readlink())
        write(OUT / f"{name}.tar.gz", name, files, {"lib/libpatina.so": soname, f"lib/{soname}": f"libpatina.so.{number}"})


def write(path: Path, prefix: str, files: dict, links: dict) -> None:
    """The same input gives the same bytes. files: path or text of each. Removes tarballs of other versions."""
    packed = gzip.compress(tarred(prefix, files, links, lambda name: name.startswith(("bin/", "lib/libpatina"))), 9, mtime=0)
    if len(packed) > LARGEST:
        sys.exit(f"package: {path.name} is larger than {LARGEST / 1e6:.0f} MB")
    for old in path.parent.glob("patina-*.tar.gz"):
        old.unlink()
    path.write_bytes(packed)
    print(f"{path.relative_to(ROOT)}: {len(files)} files, {len(packed) / 1e6:.2f} MB")
