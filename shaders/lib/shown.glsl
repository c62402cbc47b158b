// SPDX-License-Identifier: GPL-3.0-or-later
// What every pixel gives to a wide blend of normals (kernels/shade.comp): its surface's normal, times PT_BLEND_FILLED where it
// is filled, and z, +inf where it shows nothing. A tap of the blend is one fetch then, in place of three that wait for each
// other.
#version 430 core
#include "shared/colors.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"

layout(local_size_x = 32) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { shade_args args; };
layout(std430, binding = BIND_shown) writeonly buffer shown_block { vec4 shown[]; };

void main()
{
    uint width = args.view.width;
    uvec2 first = pt_first_of_row();
    uint x = first.x, y = first.y, end = y < args.view.height ? min(x + 8u * PT_APART, width) : x;
    if (x >= end)
        return;
    do {
        uint at = y * width + x, z = read_z_bits(at), source = z != PT_KEY_EMPTY_Z ? read_from(at) : at;
        precise vec3 normal = read_float4(source).xyz * (source == at ? 1.0 : PT_BLEND_FILLED);
        shown[at] = vec4(normal, pt_float(z));
        x += PT_APART;
    } while (x < end);
}
