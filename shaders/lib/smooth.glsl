// SPDX-License-Identifier: GPL-3.0-or-later
// The 3 x 3 low-pass of one pixel: a part of smooth and of finish. [D 3.4, Table 1]
#ifndef PT_SMOOTH_GLSL
#define PT_SMOOTH_GLSL

#include "lib/planes.glsl"

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

// limit: how far apart in depth neighbours of the same layer are at most.
vec4 pt_smooth(smooth_args args, tap_row behind, tap_row row, tap_row ahead, float limit)
{
    float z = row.middle.z;
    tap_sum edges = tap_sum(vec4(0.0), 0.0), corners = edges;
    add_tap(behind.low, z, limit, corners); // in the order of rows
    add_tap(PT_UPWARDS ? behind.middle : row.low, z, limit, edges);
    add_tap(PT_UPWARDS ? behind.high : ahead.low, z, limit, corners);
    add_tap(PT_UPWARDS ? row.low : behind.middle, z, limit, edges);
    add_tap(PT_UPWARDS ? row.high : ahead.middle, z, limit, edges);
    add_tap(PT_UPWARDS ? ahead.low : behind.high, z, limit, corners);
    add_tap(PT_UPWARDS ? ahead.middle : row.high, z, limit, edges);
    add_tap(ahead.high, z, limit, corners);
    precise float weights = (args.center + edges.count * args.edge) + corners.count * args.corner;
    precise vec4 total = (row.middle.color * args.center + edges.color * args.edge) + corners.color * args.corner;
    precise vec4 mean = total * pt_rcp(weights);
    return vec4(mean.xyz, args.translucent != 0u ? pt_min(mean.w, 1.0) : 1.0);
}

#endif
