// SPDX-License-Identifier: GPL-3.0-or-later
// reveal: how far scans lie apart where pixels show an instance, into the crop; twin of native/device_cpu/kernels/reveal.c
#version 430 core
#include "shared/picture.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"

layout(local_size_x = 32, local_size_y = 8) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { reveal_args args; };
layout(std430, binding = BIND_disagreement) writeonly buffer disagreement_block { float disagreement[]; };

void main()
{
    uint x = args.view.rect[0] + gl_GlobalInvocationID.x, y = args.view.rect[1] + gl_GlobalInvocationID.y;
    if (x >= args.view.rect[2] || y >= args.view.rect[3])
        return;
    uint at = y * args.view.width + x;
    uvec2 key = read_key(at);
    bool ours = key.y != PT_KEY_EMPTY_Z && (key.x - args.instance.id_base) - args.instance.id_first < args.instance.id_count;
    if (ours || args.first != 0u)
        disagreement[(y - args.crop_y) * args.crop_width + x - args.crop_x] = ours ? read_deff(read_from(at)) : 0.0;
}
