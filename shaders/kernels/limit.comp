// SPDX-License-Identifier: GPL-3.0-or-later
// limit: from where on a light's next map of a faint caster sees its points [D 6]; twin of
// native/device_cpu/kernels/limit.c
#version 430 core
#include "shared/shadows.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"
#include "lib/by_pixel.glsl"

layout(local_size_x = 64) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { limit_args args; };
layout(std430, binding = BIND_opacities) readonly buffer opacities_block { uint opacities[]; }; // four a word
layout(std430, binding = BIND_limit) writeonly buffer limit_block { float limit[]; };
layout(std430, binding = BIND_some) writeonly buffer some_block { uint some_left[]; };

void main()
{
    uint x = args.view.rect[0] + gl_GlobalInvocationID.x, y = args.view.rect[1] + gl_GlobalInvocationID.y;
    if (x >= args.view.rect[2] || y >= args.view.rect[3])
        return;
    uint at = y * args.view.width + x;
    uvec2 key = read_key(at);
    bool some = key.y != PT_KEY_EMPTY_Z;
    if (some && args.loss == 255u) {
        uint id = pt_place_of(key.x - args.caster, at);
        some = (opacities[id >> 2] >> 8u * (id & 3u) & 255u) != 255u;
    }
    precise float next = pt_float(PT_KEY_EMPTY_Z);
    if (some) {
        next = pt_float(key.y) + read_deff(read_from(at));
        some_left[0] = 1u;
    }
    limit[at] = next;
}
