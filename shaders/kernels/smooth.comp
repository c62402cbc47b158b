// SPDX-License-Identifier: GPL-3.0-or-later
// smooth: 3 x 3 low-pass over the neighbours of the same layer. [D 3.4, Table 1]; twin of
// native/device_cpu/kernels/smooth.c
#version 430 core
#include "lib/math.glsl"

layout(local_size_x = 32, local_size_y = 8) in;

layout(std430, binding = 0) readonly buffer arguments_block { smooth_args args; };
layout(std430, binding = 1) readonly buffer keys_block { uvec2 keys[]; };
layout(std430, binding = 2) readonly buffer from_block { uint from[]; };
layout(std430, binding = 3) readonly buffer deff_block { float deff[]; };
layout(std430, binding = 4) readonly buffer color_block { vec4 color[]; };
layout(std430, binding = 5) writeonly buffer result_block { vec4 result[]; };

void main()
{
    uvec4 rect = uvec4(args.view.rect[0], args.view.rect[1], args.view.rect[2], args.view.rect[3]);
    int width = int(args.view.width), height = int(args.view.height);
    float center = args.center, edge = args.edge, corner = args.corner;
    uint x = rect.x + gl_GlobalInvocationID.x, y = rect.y + gl_GlobalInvocationID.y;
    if (x >= rect.z || y >= rect.w)
        return;
    uint at = y * uint(width) + x;
    uint z_bits = keys[at].y;
    if (z_bits == PT_KEY_EMPTY_Z) {
        result[at] = vec4(0.0);
        return;
    }
    float z = pt_float(z_bits), limit = deff[from[at] & ~PT_FROM_MIXED];
    precise vec3 sum = vec3(0.0);
    precise float weights = 0.0;
    for (int dy = -1; dy <= 1; dy++)
        for (int dx = -1; dx <= 1; dx++) {
            int qx = int(x) + dx, qy = int(y) + dy;
            if (qx < 0 || qy < 0 || qx >= width || qy >= height)
                continue;
            uint q = uint(qy * width + qx);
            precise float apart = pt_float(keys[q].y) - z;
            if (!(pt_abs(apart) <= limit))
                continue; // nothing there, or another layer
            float weight = dx != 0 && dy != 0 ? corner : dx != 0 || dy != 0 ? edge : center;
            weights += weight;
            sum = sum + color[q].xyz * weight;
        }
    precise vec3 mean = sum * pt_rcp(weights);
    result[at] = vec4(mean, 1.0);
}
