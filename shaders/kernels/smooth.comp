// SPDX-License-Identifier: GPL-3.0-or-later
// smooth: 3 x 3 low-pass over the neighbours of the same layer. [D 3.4, Table 1]; twin of
// native/device_cpu/kernels/smooth.c
#version 430 core
#include "lib/math.glsl"
#include "lib/tiles.glsl"

layout(std430, binding = 0) readonly buffer arguments_block { smooth_args args; };
layout(std430, binding = 1) readonly buffer keys_block { uvec2 keys[]; };
layout(std430, binding = 2) readonly buffer from_block { uint from[]; };
layout(std430, binding = 3) readonly buffer deff_block { float deff[]; };
layout(std430, binding = 5) writeonly buffer result_block { vec4 result[]; };
layout(binding = 0) uniform samplerBuffer color;

// NOTHING 1: for the tiles without points.
vec4 smooth_pixel(ivec2 size, vec3 weights_of, int x, int y)
{
#if NOTHING
    return vec4(0.0);
#else
    int at = y * size.x + x;
    uint z_bits = keys[at].y;
    float z = pt_float(z_bits);
    bool empty = z_bits == PT_KEY_EMPTY_Z;
    float limit = empty ? 0.0 : deff[empty ? 0u : from[at] & ~PT_FROM_MIXED];
    precise vec3 sum = vec3(0.0);
    precise float weights = 0.0;
    for (int dy = -1; dy <= 1; dy++)
        for (int dx = -1; dx <= 1; dx++) {
            int qx = x + dx, qy = y + dy;
            bool inside = qx >= 0 && qy >= 0 && qx < size.x && qy < size.y;
            int q = inside ? qy * size.x + qx : at;
            precise float apart = pt_float(keys[q].y) - z;
            bool taken = inside && pt_abs(apart) <= limit; // else nothing there, or another layer
            float weight = dx != 0 && dy != 0 ? weights_of.z : dx != 0 || dy != 0 ? weights_of.y : weights_of.x;
            precise float weights_more = weights + weight;
            precise vec3 sum_more = sum + texelFetch(color, q).xyz * weight;
            weights = taken ? weights_more : weights;
            sum = taken ? sum_more : sum;
        }
    precise vec3 mean = sum * pt_rcp(weights);
    return empty ? vec4(0.0) : vec4(mean, 1.0);
#endif
}

void main()
{
    view_args view = args.view;
    vec3 weights = vec3(args.center, args.edge, args.corner);
    ivec2 size = ivec2(view.width, view.height);
    uvec2 column = pt_tile_column(view);
    for (uint y = column.y, end = pt_tile_end(view, column); y < end; y++)
        result[y * view.width + column.x] = smooth_pixel(size, weights, int(column.x), int(y));
}
