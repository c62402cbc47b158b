# SPDX-License-Identifier: GPL-3.0-or-later
"""The wheel of patina-render: python/patina_render, with addon/native as its private package _native, and the library in lib/."""
import tempfile
from pathlib import Path

import version

from . import notice
from .common import LARGEST, OUT, PLATFORMS, ROOT, compiled, say, wheel

PACKAGE, PLATFORM = "patina_render", "linux-x64"

METADATA = """Metadata-Version: 2.1
Name: patina-render
Version: {version}
Summary: Renders point clouds as closed surfaces: numpy arrays in, numpy arrays out
License: GPL-3.0-or-later
License-File: LICENSE
License-File: NOTICE
Requires-Python: >=3.10
Requires-Dist: numpy>=1.22
Description-Content-Type: text/markdown

{description}
"""


def make() -> None:
    say("compiling the library; the first time takes minutes")
    info = f"{PACKAGE}-{version.number()}.dist-info"
    with tempfile.TemporaryDirectory() as scratch:
        library = compiled(PLATFORM, Path(scratch))
        files = {f"{PACKAGE}/lib/{library.name}": library.read_bytes(), f"{info}/LICENSE": (ROOT / "LICENSE").read_bytes(),
                 f"{info}/NOTICE": notice.text(version.number()).encode(),
                 f"{info}/METADATA": METADATA.format(version=version.number(), description=(ROOT / "python/README.md").read_text(encoding="utf-8")).encode()}
        for folder, to in ((ROOT / "python" / PACKAGE, PACKAGE), (ROOT / "addon/native", f"{PACKAGE}/_native")):
            files |= {f"{to}/{path.relative_to(folder).as_posix()}": path.read_bytes() for path in sorted(folder.rglob("*.py"))}
        for old in OUT.glob(f"{PACKAGE}-*.whl"):
            old.unlink()
        path = wheel(f"{PACKAGE}-{version.number()}", f"py3-none-{PLATFORMS[PLATFORM][2][-1]}", files, OUT)
    print(f"{path.relative_to(ROOT)}: {len(files)} files, {path.stat().st_size / 1e6:.2f} MB")
    if path.stat().st_size > LARGEST:
        raise SystemExit(f"package: {path.name} is larger than {LARGEST / 1e6:.0f} MB")
