# SPDX-License-Identifier: GPL-3.0-or-later
"""How a program of the add-on is run in a process of its own, with the Python and the packages that Blender has. Knows no Blender."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def command(script: Path) -> list[str]:
    """What starts a script. It imports nothing of the add-on, and no module of the current folder or the user's."""
    paths = os.pathsep.join(path for path in sys.path if path)
    return [python(), "-I", str(Path(__file__).with_name("starter.py")), paths, str(script)]


def python() -> str:
    """Blender's own; where it names another program than itself, that of its folder."""
    own = Path(sys.prefix) / "bin" / f"python{sys.version_info[0]}.{sys.version_info[1]}"
    return str(own) if own.exists() else sys.executable
