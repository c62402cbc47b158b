// SPDX-License-Identifier: GPL-3.0-or-later
// mark: which points the picture shows (SPEC 4: shadows of no others are computed); twin of
// native/device_cpu/kernels/mark.c
#version 430 core
#include "shared/shadows.h"
#include "shared/words.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"
#include "lib/tiles.glsl"

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { mark_args args; };
layout(std430, binding = BIND_marks) buffer marks_block { uint marks[]; };

void main()
{
    view_args view = args.view;
    uint id_base = args.id_base, id_first = args.id_first, id_count = args.id_count;
    uvec2 here = pt_tile_line(view);
    for (uint left = pt_tile_steps(view, here); left != 0u; left--, here += PT_STEP) {
        uvec2 key = read_key(here.y * view.width + here.x);
        uint id = key.x - id_base;
        if (id - id_first < id_count && key.y != PT_KEY_EMPTY_Z)
            atomicOr(marks[2u * (id / PT_MARK_SLOTS)], 1u << id % PT_MARK_SLOTS);
    }
}
