# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's tests. Run in Blender, or with the bpy module:

    blender -b --factory-startup --python-exit-code 1 --python tests/blender/test_addon.py [-- NAME ...]
    python tests/blender/test_addon.py [NAME ...]

The library is the one that PATINA_LIBRARY names. NAMEs run only the tests whose names contain one of them; --some leaves out what no
version of Blender changes (ONCE), where others run all.
"""

import importlib
import os
import sys
import time
import traceback
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

MODULES = ("check_camera", "check_points", "check_lights", "check_passes", "check_layers", "check_shadows", "check_final",
           "check_samples", "check_plan", "check_color", "check_clip", "check_panels", "check_styles", "check_import", "check_formats",
           "check_linked", "check_building", "check_copc", "check_pages", "check_ept", "check_edits", "check_files", "check_places",
           "check_preferences", "check_set_up",
           "check_sequence", "check_motion", "check_panorama", "check_migrate", "check_meshes", "check_textures", "check_combine",
           "check_session", "check_effects", "check_lines", "check_splats", "check_pace", "check_analysis", "check_edit_mode",
           "check_losses", "check_roles", "check_kept", "check_world", "check_materials", "check_nodes", "check_cryptomatte",
           "check_soft", "check_soft_looks", "check_scans", "check_grids", "check_newcomers", "check_farm",
           "check_gpu")  # the last: with graphics in the background others would have them too
# Of files, servers and processes beside Blender, or of pictures that the library alone decides: how the names begin.
ONCE = ("analysis/once", "building/", "copc/", "ept/", "formats/", "kept/", "linked/opens_from_its_cache", "pages/", "samples/panoramas_sample_by_sample",
        "styles/shipped_files_say", "styles/thumbnails_are_of_today", "textures/points_shadow_triangles")


def wanted_names():
    arguments = sys.argv
    if "--" in arguments:
        return arguments[arguments.index("--") + 1:]
    return arguments[1:] if Path(arguments[0]).name == Path(__file__).name else []


def main():
    import harness
    names = wanted_names()
    some = "--some" in names
    names = [name for name in names if name != "--some"]
    passed = failed = skipped = 0
    for module in map(importlib.import_module, MODULES):
        for name, test in list(vars(module).items()):
            if not name.startswith("test_") or names and not any(part in name for part in names):
                continue
            label = f"{module.__name__[len('check_'):]}/{name[len('test_'):]}"
            start = time.perf_counter()
            try:
                if some and label.startswith(ONCE):
                    raise harness.Skip("no version of Blender changes it; Debian's runs it, and the newest that has readers")
                test()
            except harness.Skip as reason:
                skipped += 1
                print(f"skip {label}: {reason}", flush=True)
            except Exception as error:
                failed += 1
                where = traceback.extract_tb(error.__traceback__)[-1]
                text = " ".join(str(error).split()) or type(error).__name__
                print(f"FAIL {label}: {text} ({Path(where.filename).name}:{where.lineno})", flush=True)
            else:
                passed += 1
                print(f"ok {label} ({time.perf_counter() - start:.2f} s)", flush=True)
    harness.patina.unregister()
    print(f"{passed} passed, {failed} failed, {skipped} skipped", flush=True)
    return 1 if failed or not passed else 0


code = main()
sys.stdout.flush()
sys.stderr.flush()
os._exit(code)  # the bpy module may hang in its own clean-up
