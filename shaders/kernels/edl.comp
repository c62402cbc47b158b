// SPDX-License-Identifier: GPL-3.0-or-later
// edl: eye-dome lighting; twin of native/device_cpu/kernels/edl.c
#version 430 core
#include "shared/effects.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"
#include "lib/tiles.glsl"

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { edl_args args; };
layout(std430, binding = BIND_color) buffer color_block { vec4 color[]; };

float depth_of(view_args view, uvec2 here, float z)
{
    if (z == pt_float(PT_KEY_EMPTY_Z))
        return PT_EDL_EMPTY;
    if (view.perspective == 0u)
        return z;
    precise float depth = pt_log2(z);
    if (args.from_eye != 0u) {
        vec2 ray = pt_ray(view, int(here.x), int(here.y));
        precise float square = (ray.x * ray.x + ray.y * ray.y) + 1.0;
        precise float farther = depth + 0.5 * pt_log2(square);
        depth = farther;
    }
    return depth;
}

// Two spacings of the surface that the pixel shows, in pixels.
float width_at(view_args view, uvec2 here, uint at, float z)
{
    uint source = read_from(at);
    float cosine = pt_cosine(view, read_float4(source).xyz, pt_ray(view, int(here.x), int(here.y)));
    precise float across = read_deff(source) * pt_min(pt_max(cosine, PT_EDL_GRAZING), 1.0);
    precise float wide = across * pt_rcp(pt_footprint(view, z));
    return wide;
}

// The least of the pixel and its first neighbours.
float least_width(view_args view, uvec2 here, uint at, float z)
{
    float least = width_at(view, here, at, z);
    for (int i = 0; i < PT_EDL_NEIGHBOURS && least > args.wide[0]; i++) {
        uvec2 q = here + uvec2(uint(args.offsets[2 * i]), uint(args.offsets[2 * i + 1]));
        uint near = q.y * view.width + q.x;
        float z_q = q.x < view.width && q.y < view.height ? read_z(near) : pt_float(PT_KEY_EMPTY_Z);
        if (z_q != pt_float(PT_KEY_EMPTY_Z))
            least = pt_min(least, width_at(view, q, near, z_q));
    }
    return least;
}

void main()
{
    view_args view = args.view;
    float scale = args.scale;
    uvec2 here = pt_tile_line(view);
    for (uint left = pt_tile_steps(view, here); left != 0u; left--, here += PT_STEP) {
        uint at = here.y * view.width + here.x;
        float z = read_z(at);
        if (z == pt_float(PT_KEY_EMPTY_Z))
            continue;
        float own = depth_of(view, here, z), width = least_width(view, here, at, z);
        int radius = 0;
        while (radius < PT_EDL_RADII - 1 && width > args.wide[radius])
            radius++;
        float gain = args.gain[radius];
        precise float sum = 0.0;
        for (int i = 0; i < PT_EDL_NEIGHBOURS; i++) {
            int offset = 2 * (PT_EDL_NEIGHBOURS * radius + i);
            uint qx = here.x + uint(args.offsets[offset]), qy = here.y + uint(args.offsets[offset + 1]); // -1 wraps to beyond the plane
            bool inside = qx < view.width && qy < view.height;
            float near = inside ? depth_of(view, uvec2(qx, qy), read_z(qy * view.width + qx)) : PT_EDL_BEYOND;
            precise float behind = scale * (own - near);
            sum = sum + pt_min(pt_max(behind, 0.0), PT_EDL_STEP);
        }
        precise float fade = pt_min(pt_max(2.0 - width * args.narrow, 0.0), 1.0);
        precise float light = pt_exp2(0.0 - (fade * gain) * sum);
        vec4 c = color[at];
        precise vec3 darker = c.xyz * light;
        color[at] = vec4(darker, c.w);
    }
}
