# SPDX-License-Identifier: GPL-3.0-or-later
"""python -I starter.py PATHS SCRIPT ARGUMENT ...: the script, with packages where Blender's Python looks for them."""

import os
import runpy
import sys

sys.path += [path for path in sys.argv[1].split(os.pathsep) if path not in sys.path]
sys.argv = sys.argv[2:]
runpy.run_path(sys.argv[0], run_name="__main__")
