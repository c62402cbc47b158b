// SPDX-License-Identifier: GPL-3.0-or-later
// smooth: 3 x 3 low-pass over the neighbours of the same layer. [D 3.4, Table 1]; twin of
// native/device_cpu/kernels/smooth.c
#version 430 core
#include "lib/math.glsl"
#include "lib/planes.glsl"
#include "lib/tiles.glsl"

layout(std430, binding = 0) readonly buffer arguments_block { smooth_args args; };
layout(std430, binding = 5) writeonly buffer result_block { vec4 result[]; };

// What a neighbour gives: its colour, and z; +inf outside the rectangle.
struct tap {
    vec4 color;
    float z;
};

tap read_tap(uvec4 rect, uint width, uint x, uint y)
{
    bool inside = x >= rect.x && y >= rect.y && x < rect.z && y < rect.w; // -1 wraps to beyond it
    uint at = inside ? y * width + x : 0u;
    float z = read_z(at);
    return tap(read_float4(at), inside ? z : pt_float(PT_KEY_EMPTY_Z));
}

struct tap_row { // across the line
    tap low, middle, high;
};

tap_row read_row(uvec4 rect, uint width, uvec2 p)
{
    uvec2 low = p - PT_ACROSS, high = p + PT_ACROSS;
    return tap_row(read_tap(rect, width, low.x, low.y), read_tap(rect, width, p.x, p.y), read_tap(rect, width, high.x, high.y));
}

struct tap_sum {
    vec4 color;
    float count;
};

void add_tap(tap t, float z, float limit, inout tap_sum sum)
{
    precise float apart = t.z - z;
    precise vec4 more = sum.color + t.color;
    bool same = pt_abs(apart) <= limit; // else another layer, or nothing
    sum.count += same ? 1.0 : 0.0;
    sum.color = same ? more : sum.color; // what an empty pixel's colour holds is anything, NaN too
}

void main()
{
    view_args view = args.view;
    uvec4 rect = uvec4(view.rect[0], view.rect[1], view.rect[2], view.rect[3]);
    bool translucent = args.translucent != 0u;
    float center = args.center, edge = args.edge, corner = args.corner;
    uvec2 here = pt_tile_line(view);
    uint left = pt_tile_steps(view, here);
    if (left == 0u)
        return;
    tap_row behind = read_row(rect, view.width, here - PT_STEP), row = read_row(rect, view.width, here);
    do {
        tap_row ahead = read_row(rect, view.width, here + PT_STEP);
        uint at = here.y * view.width + here.x;
        float z = row.middle.z;
        bool some = z < pt_float(PT_KEY_EMPTY_Z);
        float limit = read_deff(some ? read_from(at) : at);
        tap_sum edges = tap_sum(vec4(0.0), 0.0), corners = edges;
        add_tap(behind.low, z, limit, corners); // in the order of rows
        add_tap(PT_UPWARDS ? behind.middle : row.low, z, limit, edges);
        add_tap(PT_UPWARDS ? behind.high : ahead.low, z, limit, corners);
        add_tap(PT_UPWARDS ? row.low : behind.middle, z, limit, edges);
        add_tap(PT_UPWARDS ? row.high : ahead.middle, z, limit, edges);
        add_tap(PT_UPWARDS ? ahead.low : behind.high, z, limit, corners);
        add_tap(PT_UPWARDS ? ahead.middle : row.high, z, limit, edges);
        add_tap(ahead.high, z, limit, corners);
        precise float weights = (center + edges.count * edge) + corners.count * corner;
        precise vec4 total = (row.middle.color * center + edges.color * edge) + corners.color * corner;
        precise vec4 mean = total * pt_rcp(weights);
        if (some) // nothing reads the colour of an empty pixel
            result[at] = vec4(mean.xyz, translucent ? pt_min(mean.w, 1.0) : 1.0);
        behind = row;
        row = ahead;
        here += PT_STEP;
    } while (--left != 0u);
}
