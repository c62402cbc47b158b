// SPDX-License-Identifier: GPL-3.0-or-later
// antialias: Laplace on depth as steps. [D 3.5]; twin of native/device_cpu/kernels/antialias.c
//
// k of the four cross neighbours are farther than d_eff (or empty). A pixel is drawn when a point falls anywhere in it, so
// an edge pixel's true coverage is below 1: for a straight edge at 0 degrees (k = 1) it is uniform in 0..1, mean 1/2; at
// 45 degrees the outermost pixels (k = 2) cover t^2/2, mean 1/6. Both are met by coverage = 5/6 - k/3, floored at 1/6 so
// that lone pixels stay visible.
#version 430 core
#include "lib/math.glsl"
#include "lib/tiles.glsl"

layout(std430, binding = 0) readonly buffer arguments_block { antialias_args args; };
layout(std430, binding = 1) readonly buffer keys_block { uvec2 keys[]; };
layout(std430, binding = 2) buffer from_block { uint from[]; };
layout(std430, binding = 3) readonly buffer deff_block { float deff[]; };
layout(std430, binding = 5) writeonly buffer result_block { vec4 result[]; };
layout(binding = 0) uniform samplerBuffer color;

const ivec2 cross_offsets[4] = ivec2[4](ivec2(1, 0), ivec2(0, 1), ivec2(-1, 0), ivec2(0, -1));

// NOTHING 1: for the tiles without points.
vec4 antialias_pixel(ivec2 size, bool layers, int x, int y)
{
    int at = y * size.x + x;
    vec4 own = texelFetch(color, at);
#if !NOTHING
    uint z_bits = keys[at].y;
    float empty = pt_float(PT_KEY_EMPTY_Z);
    bool some = z_bits != PT_KEY_EMPTY_Z;
    uint source = some ? from[at] : 0u;
    precise float limit = pt_float(z_bits) + deff[source & ~PT_FROM_MIXED];
    limit = layers && some ? limit : empty;
    precise vec4 far_color = vec4(0.0);
    float far_count = 0.0;
    for (int i = 0; i < 4; i++) {
        int qx = x + cross_offsets[i].x, qy = y + cross_offsets[i].y;
        bool inside = qx >= 0 && qy >= 0 && qx < size.x && qy < size.y; // outside: unknown, no edge
        int q = inside ? qy * size.x + qx : at;
        float z = pt_float(keys[q].y);
        bool far = some && inside && (z > limit || z == empty);
        precise vec4 more = far_color + texelFetch(color, q);
        far_color = far && z < empty ? more : far_color;
        far_count += far ? 1.0 : 0.0;
    }
    if (far_count > 0.0) {
        precise float coverage = pt_max(0.833333313465 - far_count * 0.333333343267, 0.166666671634); // 5/6, 1/3, 1/6
        precise float share = (1.0 - coverage) * pt_rcp(far_count);
        precise vec4 mixed = own * coverage + far_color * share;
        own = mixed;
        from[at] = source | PT_FROM_MIXED;
    }
#endif
    return own;
}

void main()
{
    view_args view = args.view;
    bool layers = args.layers != 0u;
    ivec2 size = ivec2(view.width, view.height);
    uvec2 column = pt_tile_column(view);
    for (uint y = column.y, end = pt_tile_end(view, column); y < end; y++)
        result[y * view.width + column.x] = antialias_pixel(size, layers, int(column.x), int(y));
}
