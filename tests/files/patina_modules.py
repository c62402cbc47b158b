# SPDX-License-Identifier: GPL-3.0-or-later
"""Modules of the add-on that need no Blender, for tests in a plain Python."""

import importlib
import sys
import types
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def imported(*names: str) -> list:
    """The modules of these names within the add-on."""
    if "patina" not in sys.modules:  # whose __init__ needs Blender
        sys.modules["patina"] = types.ModuleType("patina")
        sys.modules["patina"].__path__ = [str(ROOT / "addon")]
    return [importlib.import_module(f"patina.{name}") for name in names]
