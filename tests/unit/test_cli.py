#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line, from outside: test_cli.py PATH_OF_PATINA [NAME of a test ...]. Needs Python's own library only. Before the path there may be what
runs a program of another system: test_cli.py "wine build/out/windows-x64/patina.exe". The tests are in cli_*.py."""
import os
import sys
import tempfile
from pathlib import Path

sys.dont_write_bytecode = True
sys.path[1:1] = [str(Path(__file__).resolve().parents[2] / folder) for folder in ("build", "tests")]
import cli  # noqa: E402
import cli_analysis  # noqa: E402
import cli_batches  # noqa: E402
import cli_borders  # noqa: E402
import cli_colors  # noqa: E402
import cli_drawings  # noqa: E402
import cli_files  # noqa: E402
import cli_maps  # noqa: E402
import cli_measure  # noqa: E402
import cli_numbers  # noqa: E402
import cli_outlines  # noqa: E402
import cli_pictures  # noqa: E402
import cli_ranges  # noqa: E402
import cli_rasters  # noqa: E402
import cli_sheets  # noqa: E402
import cli_styles  # noqa: E402
import cli_trust  # noqa: E402
import cli_usage  # noqa: E402
from runs import run_tests  # noqa: E402


def main():
    modules = (cli_analysis, cli_colors, cli_drawings, cli_rasters, cli_maps, cli_sheets, cli_batches, cli_styles, cli_outlines, cli_usage, cli_pictures, cli_borders, cli_numbers, cli_files, cli_ranges, cli_trust, cli_measure)
    tests = {name: test for module in modules for name, test in vars(module).items() if name.startswith("test_")}
    with tempfile.TemporaryDirectory() as folder:
        cli.FOLDER = Path(folder)
        return run_tests(tests, sys.argv[2:])[1] != 0


if __name__ == "__main__":
    os.environ.pop("PATINA_SHADER_DIR", None)
    sys.exit(main())
