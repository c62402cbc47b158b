# SPDX-License-Identifier: GPL-3.0-or-later
"""Modules of the add-on that need no Blender, for tests in a plain Python."""

import importlib
import sys
import types
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def imported(*names: str) -> list:
    """The modules of these names within the add-on."""
    for name, place in (("patina", "addon"), ("patina.importers", "addon/importers")):  # whose __init__ need Blender
        if name not in sys.modules:
            sys.modules[name] = types.ModuleType(name)
            sys.modules[name].__path__ = [str(ROOT / place)]
    return [importlib.import_module(f"patina.{name}") for name in names]
