// SPDX-License-Identifier: GPL-3.0-or-later
// edl: eye-dome lighting; twin of native/device_cpu/kernels/edl.c
#version 430 core
#include "shared/effects.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"
#include "lib/tiles.glsl"

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { edl_args args; };
layout(std430, binding = BIND_color) buffer color_block { vec4 color[]; };

float depth_of(float z, bool perspective)
{
    if (z == pt_float(PT_KEY_EMPTY_Z))
        return PT_EDL_EMPTY;
    return perspective ? pt_log2(z) : z;
}

void main()
{
    view_args view = args.view;
    bool perspective = view.perspective != 0u;
    float scale = args.scale, gain = args.gain;
    uvec2 here = pt_tile_line(view);
    for (uint left = pt_tile_steps(view, here); left != 0u; left--, here += PT_STEP) {
        uint at = here.y * view.width + here.x;
        float z = read_z(at);
        if (z == pt_float(PT_KEY_EMPTY_Z))
            continue;
        float own = depth_of(z, perspective);
        precise float sum = 0.0;
        for (int i = 0; i < PT_EDL_NEIGHBOURS; i++) {
            uint qx = here.x + uint(args.offsets[2 * i]), qy = here.y + uint(args.offsets[2 * i + 1]); // -1 wraps to beyond the plane
            bool inside = qx < view.width && qy < view.height;
            float near = inside ? depth_of(read_z(qy * view.width + qx), perspective) : PT_EDL_BEYOND;
            precise float behind = scale * (own - near);
            sum = sum + pt_min(pt_max(behind, 0.0), PT_EDL_STEP);
        }
        precise float light = pt_exp2(0.0 - gain * sum);
        vec4 c = color[at];
        precise vec3 darker = c.xyz * light;
        color[at] = vec4(darker, c.w);
    }
}
