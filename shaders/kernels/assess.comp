// SPDX-License-Identifier: GPL-3.0-or-later
// assess: trust and thickness of the points that pixels show, into the crop; twin of native/device_cpu/kernels/assess.c
#version 430 core
#include "shared/picture.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"
#include "lib/by_pixel.glsl"

layout(local_size_x = 32, local_size_y = 8) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { assess_args args; };
layout(std430, binding = BIND_shapes) readonly buffer shapes_block { uint shapes[]; };
layout(std430, binding = BIND_trust) writeonly buffer trust_block { float trust[]; };
layout(std430, binding = BIND_thickness) writeonly buffer thickness_block { float thickness[]; };

void main()
{
    uint x = args.view.rect[0] + gl_GlobalInvocationID.x, y = args.view.rect[1] + gl_GlobalInvocationID.y;
    if (x >= args.view.rect[2] || y >= args.view.rect[3])
        return;
    uint at = y * args.view.width + x;
    uvec2 key = read_key(at);
    uint id = key.x - args.instance.id_base, to = (y - args.crop_y) * args.crop_width + x - args.crop_x;
    bool ours = key.y != PT_KEY_EMPTY_Z && id - args.instance.id_first < args.instance.id_count;
    if (!ours && args.first == 0u)
        return;
    uint word = ours ? shapes[pt_place_of(id, at)] : 0u, sigma_class = word >> PT_SHAPE_SIGMA_SHIFT & PT_SHAPE_CLASS_BITS;
    precise float doubt = ours ? float(15u - (word >> PT_SHAPE_TRUST_SHIFT & 15u)) : 15.0;
    precise float sure = (225.0 - doubt * doubt) * PT_TRUST_STEP;
    precise float sigma = args.instance.spacing[sigma_class] * args.sigma_scale;
    if (args.trust != 0u)
        trust[to] = sure;
    if (args.thickness != 0u)
        thickness[to] = sigma_class != 0u ? sigma : 0.0;
}
