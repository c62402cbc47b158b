// SPDX-License-Identifier: GPL-3.0-or-later
// smooth: 3 x 3 low-pass over the neighbours of the same layer. [D 3.4, Table 1]; twin of
// native/device_cpu/kernels/smooth.c
#version 430 core
#include "lib/math.glsl"
#include "lib/planes.glsl"
#include "lib/tiles.glsl"

layout(std430, binding = 0) readonly buffer arguments_block { smooth_args args; };
layout(std430, binding = 5) writeonly buffer result_block { vec4 result[]; };

// What a neighbour gives: its colour, and z in w; +inf outside the rectangle.
vec4 read_tap(uvec4 rect, uint width, uint x, uint y)
{
    bool inside = x >= rect.x && y >= rect.y && x < rect.z && y < rect.w; // -1 wraps to beyond it
    uint at = inside ? y * width + x : 0u;
    float z = read_z(at);
    return vec4(read_float4(at).xyz, inside ? z : pt_float(PT_KEY_EMPTY_Z));
}

struct tap_row {
    vec4 west, middle, east;
};

tap_row read_row(uvec4 rect, uint width, uint x, uint y)
{
    return tap_row(read_tap(rect, width, x - 1u, y), read_tap(rect, width, x, y), read_tap(rect, width, x + 1u, y));
}

// sum.w counts.
void add_tap(vec4 tap, float z, float limit, inout vec4 sum)
{
    precise float apart = tap.w - z;
    precise vec4 more = sum + vec4(tap.xyz, 1.0);
    bool same = pt_abs(apart) <= limit; // else another layer, or nothing
    sum = same ? more : sum; // what an empty pixel's colour holds is anything, NaN too
}

void main()
{
    view_args view = args.view;
    uvec4 rect = uvec4(view.rect[0], view.rect[1], view.rect[2], view.rect[3]);
    float center = args.center, edge = args.edge, corner = args.corner;
    uvec2 column = pt_tile_column(view);
    uint end = pt_tile_end(view, column), x = column.x;
    tap_row below = read_row(rect, view.width, x, column.y - 1u), row = read_row(rect, view.width, x, column.y);
    for (uint y = column.y; y < end; y++) {
        tap_row above = read_row(rect, view.width, x, y + 1u);
        uint at = y * view.width + x;
        float z = row.middle.w;
        bool some = z < pt_float(PT_KEY_EMPTY_Z);
        float limit = read_deff(some ? read_from(at) : at);
        vec4 edges = vec4(0.0), corners = vec4(0.0);
        add_tap(below.west, z, limit, corners);
        add_tap(below.middle, z, limit, edges);
        add_tap(below.east, z, limit, corners);
        add_tap(row.west, z, limit, edges);
        add_tap(row.east, z, limit, edges);
        add_tap(above.west, z, limit, corners);
        add_tap(above.middle, z, limit, edges);
        add_tap(above.east, z, limit, corners);
        precise float weights = (center + edges.w * edge) + corners.w * corner;
        precise vec3 total = (row.middle.xyz * center + edges.xyz * edge) + corners.xyz * corner;
        precise vec3 mean = total * pt_rcp(weights);
        if (some) // nothing reads the colour of an empty pixel
            result[at] = vec4(mean, 1.0);
        below = row;
        row = above;
    }
}
