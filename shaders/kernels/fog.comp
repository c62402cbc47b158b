// SPDX-License-Identifier: GPL-3.0-or-later
// fog: colours fade with distance; twin of native/device_cpu/kernels/fog.c
#version 430 core
#include "lib/math.glsl"
#include "lib/planes.glsl"
#include "lib/tiles.glsl"

layout(std430, binding = 0) readonly buffer arguments_block { fog_args args; };
layout(std430, binding = 2) buffer color_block { vec4 color[]; };

void main()
{
    view_args view = args.view;
    float start = args.start, inverse = args.inverse, density = args.density;
    vec3 veil = vec3(args.color[0], args.color[1], args.color[2]);
    uvec2 here = pt_tile_line(view);
    for (uint left = pt_tile_steps(view, here); left != 0u; left--, here += PT_STEP) {
        uint at = here.y * view.width + here.x;
        float z = read_z(at);
        if (z == pt_float(PT_KEY_EMPTY_Z))
            continue;
        precise float away = z;
        if (view.perspective != 0u) {
            vec2 ray = pt_ray(view, int(here.x), int(here.y));
            precise float square = (ray.x * ray.x + ray.y * ray.y) + 1.0;
            away = z * (square * pt_rsqrt(square));
        }
        precise float share = pt_min(pt_max((away - start) * inverse, 0.0), 1.0) * density;
        vec4 c = color[at];
        precise vec3 faded = c.xyz * (1.0 - share) + veil * (share * c.w);
        color[at] = vec4(faded, c.w);
    }
}
