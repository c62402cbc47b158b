// SPDX-License-Identifier: GPL-3.0-or-later
// antialias: Laplace on depth as steps. [D 3.5]; twin of native/device_cpu/kernels/antialias.c
//
// k of the four cross neighbours are farther than d_eff (or empty). A pixel is drawn when a point falls anywhere in it, so
// an edge pixel's true coverage is below 1: for a straight edge at 0 degrees (k = 1) it is uniform in 0..1, mean 1/2; at
// 45 degrees the outermost pixels (k = 2) cover t^2/2, mean 1/6. Both are met by coverage = 5/6 - k/3, floored at 1/6 so
// that lone pixels stay visible.
#version 430 core
#include "lib/math.glsl"

layout(local_size_x = 32, local_size_y = 8) in;

layout(std430, binding = 0) readonly buffer arguments_block { antialias_args args; };
layout(std430, binding = 1) readonly buffer keys_block { uvec2 keys[]; };
layout(std430, binding = 2) buffer from_block { uint from[]; };
layout(std430, binding = 3) readonly buffer deff_block { float deff[]; };
layout(std430, binding = 4) readonly buffer color_block { vec4 color[]; };
layout(std430, binding = 5) writeonly buffer result_block { vec4 result[]; };

const ivec2 cross_offsets[4] = ivec2[4](ivec2(1, 0), ivec2(0, 1), ivec2(-1, 0), ivec2(0, -1));

void main()
{
    uvec4 rect = uvec4(args.view.rect[0], args.view.rect[1], args.view.rect[2], args.view.rect[3]);
    int width = int(args.view.width), height = int(args.view.height);
    bool layers = args.layers != 0u;
    uint x = rect.x + gl_GlobalInvocationID.x, y = rect.y + gl_GlobalInvocationID.y;
    if (x >= rect.z || y >= rect.w)
        return;
    uint at = y * uint(width) + x;
    uint z_bits = keys[at].y;
    vec4 own = color[at];
    if (z_bits == PT_KEY_EMPTY_Z) {
        result[at] = own;
        return;
    }
    float empty = pt_float(PT_KEY_EMPTY_Z);
    precise float limit = empty;
    if (layers)
        limit = pt_float(z_bits) + deff[from[at] & ~PT_FROM_MIXED];
    precise vec4 far_color = vec4(0.0);
    float far_count = 0.0;
    for (int i = 0; i < 4; i++) {
        int qx = int(x) + cross_offsets[i].x, qy = int(y) + cross_offsets[i].y;
        if (qx < 0 || qy < 0 || qx >= width || qy >= height)
            continue; // unknown: no edge
        uint q = uint(qy * width + qx);
        float z = pt_float(keys[q].y);
        if (!(z > limit || z == empty))
            continue;
        far_count += 1.0;
        if (z < empty)
            far_color = far_color + color[q];
    }
    if (far_count > 0.0) {
        precise float coverage = pt_max(0.833333313465 - far_count * 0.333333343267, 0.166666671634); // 5/6, 1/3, 1/6
        precise float share = (1.0 - coverage) * pt_rcp(far_count);
        precise vec4 mixed = own * coverage + far_color * share;
        own = mixed;
        from[at] |= PT_FROM_MIXED;
    }
    result[at] = own;
}
