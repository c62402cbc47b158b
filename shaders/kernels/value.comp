// SPDX-License-Identifier: GPL-3.0-or-later
// value: the scalar of the point that a pixel shows; twin of native/device_cpu/kernels/value.c
#version 430 core
#include "shared/effects.h"
#include "lib/tiles.glsl"
#include "lib/by_pixel.glsl"

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { value_args args; };
layout(std430, binding = BIND_scalars) readonly buffer scalars_block { float scalars[]; };
layout(std430, binding = BIND_values) buffer values_block { float values[]; };

void main()
{
    view_args view = args.view;
    uvec2 here = pt_tile_line(view);
    for (uint left = pt_tile_steps(view, here); left != 0u; left--, here += PT_STEP) {
        uint at = here.y * view.width + here.x;
        uvec2 key = read_key(at);
        uint id = key.x - args.instance.id_base;
        bool ours = key.y != PT_KEY_EMPTY_Z && id - args.instance.id_first < args.instance.id_count;
        if (!ours && args.first == 0u)
            continue;
        float scalar = ours ? scalars[pt_place_of(id, at)] : 0.0;
        bool known = ours && (pt_bits(scalar) & 0x7FFFFFFFu) < 0x7F800000u;
        precise float off = scalar - args.offset;
        off = pt_min(pt_max(off, -PT_VALUE_MOST), PT_VALUE_MOST);
        values[at] = known ? off : pt_float(0x7FC00000u);
    }
}
