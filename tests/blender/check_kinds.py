# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of other modules, once more with PointCloud objects in place of meshes of points: everything works on both kinds. Imports make
PointClouds from Blender 4.5 on, so tests that import files run on these as they are; check_clouds.py tests what the two share and how one
becomes the other."""

import functools
import importlib

import harness
from harness import Skip
from patina import point_data

# Of these modules all tests run again but those that name what only meshes have, or that make no points of their own.
MODULES = {
    "points": {"bytes_are_read_in_place", "geometry_nodes_points", "point_cloud_object", "instances_of_geometry_nodes", "nodes_on_point_clouds",
               "meshes_with_faces_are_named"},
    "color": {"after_import"},
    "clip": set(),
    "layers": set(),
    "lights": {"like_cycles", "linked_world_is_named"},
    "lines": set(),
    "materials": {"vertex_groups_as_opacity", "radii_of_point_clouds", "materials_of_geometry_nodes"},
    "motion": {"said_once"},
    "passes": {"animation", "png"},
    "point_materials": {"linked_files_keep_their_colors", "like_cycles", "materials_by_index"},
    "roles": {"beside_cycles", "unknown_is_told_once", "light_linking_of_lamps_is_told"},
    "scans": {"scans_of_links_are_hidden", "balance_of_links", "many_stations_come_in_parts", "ptx_is_range_images", "bad_scans_of_ptx",
              "scans_survive_linking", "stations_survive_linking"},
    "soft": {"weights", "linked", "panel_is_there", "brush_goes_on_with_weights", "brush_refuses", "viewport_takes_what_was_painted"},
    "splats": {"files_of_splats", "splats_of_blender", "four_numbers", "packed_splats"},
    "styles": {"folder_is_a_throwaway_one", "shipped_files_say_just_what_differs", "thumbnails_are_of_today", "save_and_load",
               "thumbnail_of_the_scene", "own_styles_replace_shipped_ones", "unknown_keys", "bad_files", "styles_by_their_shown_names",
               "unwritable", "imported_points_wear_the_style"},
}


def _again(test):
    @functools.wraps(test)
    def run():
        if not point_data.HAS_CLOUDS:
            raise Skip("point clouds are made of points from Blender 4.5 on")
        harness.kind = 'POINTCLOUD'
        try:
            test()
        finally:
            harness.kind = 'MESH'
    return run


def _collect():
    for name, left_out in MODULES.items():
        module = importlib.import_module(f"check_{name}")
        tests = {key.removeprefix("test_"): test for key, test in vars(module).items() if key.startswith("test_")}
        wrong = left_out - set(tests)
        assert not wrong, f"check_{name} has no test {', '.join(sorted(wrong))}"
        yield from ((f"test_{name}_{key}", _again(test)) for key, test in tests.items() if key not in left_out)


globals().update(_collect())
