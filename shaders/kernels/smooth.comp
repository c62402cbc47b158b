// SPDX-License-Identifier: GPL-3.0-or-later
// smooth: 3 x 3 low-pass over the neighbours of the same layer. [D 3.4, Table 1]; twin of
// native/device_cpu/kernels/smooth.c
#version 430 core
#include "shared/colors.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"
#include "lib/smooth.glsl"
#include "lib/tiles.glsl"

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { smooth_args args; };
layout(std430, binding = BIND_result) writeonly buffer result_block { vec4 result[]; };

void main()
{
    smooth_args smoothing = args;
    view_args view = smoothing.view;
    uvec4 rect = uvec4(view.rect[0], view.rect[1], view.rect[2], view.rect[3]);
    uvec2 here = pt_tile_line(view);
    uint left = pt_tile_steps(view, here);
    if (left == 0u)
        return;
    tap_row behind = read_row(rect, view.width, here - PT_STEP), row = read_row(rect, view.width, here);
    do {
        tap_row ahead = read_row(rect, view.width, here + PT_STEP);
        uint at = here.y * view.width + here.x;
        bool some = row.middle.z < pt_float(PT_KEY_EMPTY_Z);
        vec4 mean = pt_smooth(smoothing, behind, row, ahead, read_deff(some ? read_from(at) : at));
        if (some) // nothing reads the colour of an empty pixel
            result[at] = mean;
        behind = row;
        row = ahead;
        here += PT_STEP;
    } while (--left != 0u);
}
