# SPDX-License-Identifier: GPL-3.0-or-later
"""What tests of the scripts in build/ share."""

import importlib.machinery
import importlib.util
import sys
import unittest
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "build"))  # modules that the scripts share
sys.dont_write_bytecode = True


def script(name: str) -> ModuleType:
    """A script of build/ as a module."""
    loader = importlib.machinery.SourceFileLoader(name, str(ROOT / "build" / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    loader.exec_module(module)
    return module


def run() -> int:
    """Runs the tests of the main module and prints the closing line that build/test counts. Returns the exit status."""
    result = unittest.main(module="__main__", exit=False).result
    failed, skipped = len(result.failures) + len(result.errors), len(result.skipped)
    for _, reason in result.skipped:
        print(f"skip {reason}")
    print(f"{result.testsRun - failed - skipped} passed, {failed} failed, {skipped} skipped")
    return int(bool(failed))
