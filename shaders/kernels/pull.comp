// SPDX-License-Identifier: GPL-3.0-or-later
// pull: 2 x 2 -> 1, the least key: what a scatter at half the resolution gives. SPEC 2.2; twin of
// native/device_cpu/kernels/pull.c
#version 430 core
#include "shared/filling.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"

layout(local_size_x = 32) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { pull_args args; };
layout(std430, binding = BIND_keys) writeonly buffer keys_block { uvec2 keys[]; };
layout(std430, binding = BIND_from) writeonly buffer from_block { uint from[]; };

void main()
{
    uvec4 rect = uvec4(args.view.rect[0], args.view.rect[1], args.view.rect[2], args.view.rect[3]);
    uint width = args.view.width, fine_width = args.fine_width, fine_height = args.fine_height;
    uvec2 first = rect.xy + pt_first_of_row();
    uint x = first.x, y = first.y, end = y < rect.w ? min(x + 8u * PT_APART, rect.z) : x;
    if (x >= end)
        return;
    do {
        uint best = 2u * y * fine_width + 2u * x;
        uvec2 key = read_key(best);
        for (uint child = 1u; child < 4u; child++) {
            uint fx = 2u * x + (child & 1u), fy = 2u * y + (child >> 1);
            bool inside = fx < fine_width && fy < fine_height;
            uint at = inside ? fy * fine_width + fx : best;
            uvec2 other = read_key(at);
            bool less = pt_key_less(other, key);
            best = less ? at : best;
            key = less ? other : key;
        }
        keys[y * width + x] = key;
        from[y * width + x] = args.view.level == 1u ? best : texelFetch(from_plane, int(best)).x; // of level 0: measured, or empty
        x += PT_APART;
    } while (x < end);
}
