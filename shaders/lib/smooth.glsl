// SPDX-License-Identifier: GPL-3.0-or-later
// The 3 x 3 low-pass of one pixel: a part of smooth and of tail.glsl. [D 3.4, Table 1]
#ifndef PT_SMOOTH_GLSL
#define PT_SMOOTH_GLSL

#include "shared/colors.h"
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

// A neighbour of the same layer; of another, nothing: what an empty pixel's colour holds is anything, NaN too.
tap_sum same_layer(tap t, float z, float limit)
{
    precise float apart = t.z - z;
    bool same = pt_abs(apart) <= limit;
    return tap_sum(same ? t.color : vec4(0.0), same ? 1.0 : 0.0);
}

tap_sum both(tap_sum a, tap_sum b)
{
    precise vec4 color = a.color + b.color;
    return tap_sum(color, a.count + b.count);
}

// limit: how far apart in depth neighbours of the same layer are at most.
vec4 pt_smooth(smooth_args args, tap_row behind, tap_row row, tap_row ahead, float limit)
{
    float z = row.middle.z;
    tap_sum edges = both(both(same_layer(row.low, z, limit), same_layer(row.high, z, limit)),
                         both(same_layer(behind.middle, z, limit), same_layer(ahead.middle, z, limit)));
    tap_sum first = same_layer(behind.low, z, limit), last = same_layer(ahead.high, z, limit);
    tap_sum higher = same_layer(behind.high, z, limit), further = same_layer(ahead.low, z, limit);
    tap_sum corners = PT_UPWARDS ? both(both(first, further), both(higher, last)) // of columns
                                 : both(both(first, higher), both(further, last));
    precise float weights = (args.center + edges.count * args.edge) + corners.count * args.corner;
    precise vec4 total = (row.middle.color * args.center + edges.color * args.edge) + corners.color * args.corner;
    precise vec4 mean = total * pt_rcp(weights);
    return vec4(mean.xyz, args.translucent != 0u ? pt_min(mean.w, 1.0) : 1.0);
}

#endif
