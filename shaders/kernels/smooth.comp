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

void smooth_pixel(uvec4 rect, uint width, vec3 weights_of, uint x, uint y)
{
    uint at = y * width + x;
    uint z_bits = keys[at].y;
    if (z_bits == PT_KEY_EMPTY_Z)
        return; // nothing reads the colour of an empty pixel
    float z = pt_float(z_bits), limit = deff[from[at] & ~PT_FROM_MIXED];
    precise vec3 sum = vec3(0.0);
    precise float weights = 0.0;
    for (int dy = -1; dy <= 1; dy++)
        for (int dx = -1; dx <= 1; dx++) {
            uint qx = x + uint(dx), qy = y + uint(dy); // -1 wraps to beyond the rectangle
            bool inside = qx >= rect.x && qy >= rect.y && qx < rect.z && qy < rect.w;
            uint q = inside ? qy * width + qx : at;
            precise float apart = pt_float(keys[q].y) - z;
            bool same = inside && pt_abs(apart) <= limit; // else another layer, or nothing
            float weight = dx != 0 && dy != 0 ? weights_of.z : dx != 0 || dy != 0 ? weights_of.y : weights_of.x;
            precise float more_weights = weights + weight;
            precise vec3 more = sum + texelFetch(color, int(q)).xyz * weight;
            weights = same ? more_weights : weights;
            sum = same ? more : sum; // what an empty pixel's colour holds is anything, NaN too
        }
    precise vec3 mean = sum * pt_rcp(weights);
    result[at] = vec4(mean, 1.0);
}

void main()
{
    view_args view = args.view;
    uvec4 rect = uvec4(view.rect[0], view.rect[1], view.rect[2], view.rect[3]);
    vec3 weights = vec3(args.center, args.edge, args.corner);
    uvec2 column = pt_tile_column(view);
    for (uint y = column.y, end = pt_tile_end(view, column); y < end; y++)
        smooth_pixel(rect, view.width, weights, column.x, y);
}
