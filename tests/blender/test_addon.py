# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's tests. Run in Blender, or with the bpy module:

    blender -b --factory-startup --python-exit-code 1 --python tests/blender/test_addon.py [-- NAME ...]
    python tests/blender/test_addon.py [NAME ...]

The library is the one that PATINA_LIBRARY names. NAMEs run only the tests whose names contain one of them; --some leaves out what no
version of Blender changes (ONCE), where others run all; --quick, before each commit, what takes long (SLOW). --part=1/2 runs every second module.
"""

import importlib
import os
import sys
import time
import traceback
from pathlib import Path

sys.path[:0] = [str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parent.parent)]

MODULES = ("check_camera", "check_points", "check_lights", "check_passes", "check_layers", "check_shadows", "check_final",
           "check_samples", "check_plan", "check_drawings", "check_color", "check_marks", "check_measure", "check_clip", "check_panels", "check_styles", "check_import", "check_formats",
           "check_linked", "check_building", "check_copc", "check_pages", "check_ept", "check_edits", "check_files", "check_places",
           "check_preferences", "check_set_up",
           "check_sequence", "check_motion", "check_panorama", "check_migrate", "check_meshes", "check_textures", "check_combine",
           "check_clouds", "check_session", "check_effects", "check_lines", "check_splats", "check_pace", "check_analysis", "check_edit_mode", "check_trust",
           "check_losses", "check_roles", "check_kept", "check_survival", "check_world", "check_materials", "check_nodes", "check_point_materials", "check_point_patterns", "check_cryptomatte",
           "check_level", "check_compare", "check_animation", "check_view_from_here", "check_soft", "check_soft_looks", "check_scans", "check_grids", "check_newcomers", "check_kinds", "check_farm", "check_sample_scenes",
           "check_security", "check_gpu")  # the last: with graphics in the background others would have them too
# Of files, servers and processes beside Blender, or of pictures that the library alone decides: how the names begin.
ONCE = ("analysis/once", "building/", "copc/", "ept/", "formats/", "kept/", "survival/", "linked/opens_from_its_cache", "pages/", "samples/panoramas_sample_by_sample",
        "styles/shipped_files_say", "styles/thumbnails_are_of_today", "textures/points_shadow_triangles")
# What takes seconds of a processor, by its whole name: Blenders beside this one, Cycles, many pictures, large files. Each module keeps a test
# that is quicker.
SLOW = ("analysis/beside", "analysis/cancel", "analysis/final_takes_over", "analysis/once",
        "building/cancelled_and_cut", "building/killed", "building/no_room_to_analyze", "building/same_files", "building/same_ply",
        "building/two_at_once", "effects/contour", "farm/farm_draws_frames", "farm/farm_draws_tiles", "farm/three_build_one_cloud_at_once", "kept/damage_is_found",
        "linked/opens_from_its_cache", "losses/farm_learns_of_it", "preferences/readers_by_pip", "preferences/real_readers_from_files",
        "roles/beside_cycles", "roles/shadow_catcher", "samples/panoramas_sample_by_sample", "styles/save_and_load",
        "styles/shipped_files_say_just_what_differs", "styles/thumbnails_are_of_today", "textures/opacity",
        "textures/points_shadow_triangles", "world/baked_skies_like_cycles", "world/light_like_cycles", "world/nodes_like_cycles")
# What an option leaves out, why, and what it runs.
CHOICES = {"--some": (lambda label: label.startswith(ONCE), "no version of Blender changes them; Debian's runs them, and the newest that has readers",
                      "those that depend on Blender's version"),
           "--quick": (lambda label: label in SLOW, "they take long, and build/test runs them", "quick ones")}


def wanted_names():
    arguments = sys.argv
    if "--" in arguments:
        return arguments[arguments.index("--") + 1:]
    return arguments[1:] if Path(arguments[0]).name == Path(__file__).name else []


def wrong_lists(labels):
    """What ONCE and SLOW say that is not so; labels: of all tests."""
    wrong = [f"{name} is no test" for name in (*SLOW, *ONCE) if not any(label.startswith(name) for label in labels)]
    quick = {label.split("/")[0] for label in labels if label not in SLOW}
    return wrong + [f"all tests of {module} are slow" for module in sorted({label.split("/")[0] for label in labels} - quick)]


def work():
    """Processor seconds of this process, and of those that it waited for."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def main():
    import harness
    import setting
    from names import chosen
    names = wanted_names()
    left_out = {name: [] for name in names if name in CHOICES}
    part, parts = next((map(int, name[len("--part="):].split("/")) for name in names if name.startswith("--part=")), (1, 1))
    names = [name for name in names if not name.startswith("--")]
    kinds = {(): "background tests", ("gpu_",): "tests of the viewport's shaders"}
    setting.say(", ".join([kinds.get(tuple(names), "named tests"), *(CHOICES[choice][2] for choice in left_out)]), (part, parts),
                whole=tuple(names) in kinds)
    passed = failed = skipped = 0
    took = []
    modules = [[(f"{module.__name__[len('check_'):]}/{name[len('test_'):]}", test) for name, test in vars(module).items() if name.startswith("test_")]
               for module in map(importlib.import_module, MODULES)]  # all, in each part
    labels = [label for tests in modules for label, _ in tests]
    wanted = set(chosen(labels, names))
    for place, tests in enumerate(modules):
        for label, test in tests:
            if place % parts != part - 1 or label not in wanted:
                continue
            choice = next((choice for choice in left_out if CHOICES[choice][0](label)), None)
            if choice:
                skipped += 1
                left_out[choice].append(label)
                continue
            start, before = time.perf_counter(), work()
            try:
                test()
                harness.check_deprecated()
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
                took.append((work() - before, label))
                print(f"ok {label} ({time.perf_counter() - start:.2f} s)", flush=True)
    for wrong in wrong_lists(labels):
        failed += 1
        print(f"FAIL lists of test_addon.py: {wrong}", flush=True)
    for choice, those in left_out.items():
        if those:
            print(f"skip {choice}: {CHOICES[choice][1]}: {', '.join(those)}", flush=True)
    harness.patina.unregister()
    print("seconds of a processor:", ", ".join(f"{label} {seconds:.1f}" for seconds, label in sorted(took, reverse=True)[:10]), flush=True)
    print(f"{passed} passed, {failed} failed, {skipped} skipped", flush=True)
    return 1 if failed or not passed else 0


code = main()
sys.stdout.flush()
sys.stderr.flush()
os._exit(code)  # the bpy module may hang in its own clean-up
