// SPDX-License-Identifier: GPL-3.0-or-later
// compose: colour over the background, into the crop; twin of native/device_cpu/kernels/compose.c
#version 430 core
#include "lib/math.glsl"
#include "lib/planes.glsl"

layout(local_size_x = 32) in;

layout(std430, binding = 0) readonly buffer arguments_block { compose_args args; };
layout(std430, binding = 3) writeonly buffer combined_block { vec4 combined[]; };

void main()
{
    uint width = args.view.width, crop_x = args.crop_x, crop_y = args.crop_y;
    uint crop_width = args.crop_width, crop_height = args.crop_height;
    vec4 background = vec4(args.background[0], args.background[1], args.background[2], args.background[3]);
    bool everywhere = args.everywhere != 0u;
    uvec2 first = pt_first_of_row();
    uint x = first.x, y = first.y, end = y < crop_height ? min(x + 8u * PT_APART, crop_width) : x;
    if (x >= end)
        return;
    do {
        uint at = (crop_y + y) * width + crop_x + x;
        vec4 c = read_float4(at);
        precise vec4 over = c + (1.0 - c.w) * background;
        bool empty = !everywhere && read_z_bits(at) == PT_KEY_EMPTY_Z;
        combined[y * crop_width + x] = empty ? background : over;
        x += PT_APART;
    } while (x < end);
}
