// SPDX-License-Identifier: GPL-3.0-or-later
// coarsen: an image buffer without points, and what lies behind the layers taken so far, cell by cell; twin of
// native/device_cpu/kernels/coarsen.c
#version 430 core
#include "shared/ranges.h"
#include "lib/math.glsl"

layout(local_size_x = 32, local_size_y = 8) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { coarsen_args args; };
layout(std430, binding = BIND_keys) writeonly buffer keys_block { uvec2 keys[]; };
layout(std430, binding = BIND_limit) readonly buffer limit_block { float limit[]; };
layout(std430, binding = BIND_beyond) writeonly buffer beyond_block { float beyond[]; };

// Which of `count` pixels from `origin` on a cell has a part of.
ivec2 part_of(int cell, int origin, uint count)
{
    precise float low = float(cell) * args.pixel, high = float(cell + 1) * args.pixel;
    return ivec2(max(int(floor(low)) - origin, 0), min(int(ceil(high)) - origin, int(count)));
}

void main()
{
    view_args view = args.view;
    uint x = view.rect[0] + gl_GlobalInvocationID.x, y = view.rect[1] + gl_GlobalInvocationID.y;
    if (x >= view.rect[2] || y >= view.rect[3])
        return;
    uint at = y * view.width + x;
    keys[at] = uvec2(PT_KEY_EMPTY_ID, PT_KEY_EMPTY_Z);
    if (args.behind == 0u)
        return;
    ivec2 columns = part_of(view.origin_x + int(x), args.origin_x, args.width);
    ivec2 rows = part_of(view.origin_y + int(y), args.origin_y, args.height);
    float least = pt_float(PT_KEY_EMPTY_Z);
    for (int row = rows.x; row < rows.y; row++)
        for (int column = columns.x; column < columns.y; column++)
            least = pt_min(limit[uint(row) * args.width + uint(column)], least);
    beyond[at] = least;
}
