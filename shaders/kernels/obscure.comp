// SPDX-License-Identifier: GPL-3.0-or-later
// obscure: ambient obscurance within a view-space radius; twin of native/device_cpu/kernels/obscure.c
//   STEP 0: every pixel's taps   STEP 1: the mean over 5 x 5 of them, and the colour
#version 430 core
#include "shared/effects.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"
#include "lib/tiles.glsl"

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { obscure_args args; };
layout(std430, binding = BIND_color) buffer color_block { vec4 color[]; };
layout(std430, binding = BIND_obscured) buffer obscured_block { float obscured[]; };

#if STEP == 0

struct point {
    float z;
    vec2 ray;
    vec3 n;
    float pixels, inverse; // radius of the taps on screen; 1 / radius in the scene
    vec2 turn;             // cosine, sine
};

point place(view_args view, float radius, uint at, uint x, uint y)
{
    point p;
    p.z = read_z(at);
    p.ray = pt_ray(view, int(x), int(y));
    vec3 shown = read_float4(at).xyz;
    precise float toward = 0.0 - shown.z; // n . r: a surface that faces away from the viewer is seen from behind
    if (view.perspective != 0u)
        toward = (shown.x * p.ray.x + shown.y * p.ray.y) - shown.z;
    p.n = 0.0 < toward ? 0.0 - shown : shown;
    float width = pt_footprint(view, p.z);
    precise float pixels = pt_min(radius * pt_rcp(width), PT_OBSCURE_MOST);
    precise float shortened = pixels * width;
    p.pixels = pixels;
    p.inverse = pt_rcp(shortened);
    uint turn = (uint(view.origin_x) + x & 3u) + 4u * (uint(view.origin_y) + y & 3u);
    p.turn = vec2(args.turns[2u * turn], args.turns[2u * turn + 1u]);
    return p;
}

// What the tap adds.
float tap(view_args view, point p, vec2 s, uint x, uint y)
{
    precise float dx = floor((p.turn.x * s.x - p.turn.y * s.y) * p.pixels + 0.5);
    precise float dy = floor((p.turn.y * s.x + p.turn.x * s.y) * p.pixels + 0.5);
    uint qx = x + uint(int(dx)), qy = y + uint(int(dy)); // -1 wraps to beyond the plane
    if (qx >= view.width || qy >= view.height)
        return 0.0;
    uint bits = read_z_bits(qy * view.width + qx);
    if (bits == PT_KEY_EMPTY_Z) // there square may be no number, of which drivers say that it is below 1
        return 0.0;
    float z = pt_float(bits);
    precise vec3 v = vec3(view.ray_xs * dx, view.ray_ys * dy, p.z - z);
    if (view.perspective != 0u) {
        v.x = z * (p.ray.x + v.x) - p.z * p.ray.x;
        v.y = z * (p.ray.y + v.y) - p.z * p.ray.y;
    }
    v = v * p.inverse;
    precise float square = (v.x * v.x + v.y * v.y) + v.z * v.z;
    if (!(square < 1.0))
        return 0.0;
    precise float cosine = ((p.n.x * v.x + p.n.y * v.y) + p.n.z * v.z) * pt_rsqrt(square + 1e-4);
    precise float above = pt_max(cosine - PT_OBSCURE_BIAS, 0.0);
    precise float weighted = above * (1.0 - square);
    return weighted;
}

void main()
{
    view_args view = args.view;
    float radius = args.radius;
    uvec2 here = pt_tile_line(view);
    for (uint left = pt_tile_steps(view, here); left != 0u; left--, here += PT_STEP) {
        uint at = here.y * view.width + here.x;
        if (read_z_bits(at) == PT_KEY_EMPTY_Z)
            continue;
        point p = place(view, radius, at, here.x, here.y);
        precise float sum = 0.0;
        for (int i = 0; i < PT_OBSCURE_TAPS; i++)
            sum = sum + tap(view, p, vec2(args.spiral[2 * i], args.spiral[2 * i + 1]), here.x, here.y);
        precise float mean = sum * (PT_OBSCURE_GAIN / PT_OBSCURE_TAPS);
        obscured[at] = pt_min(mean, 1.0);
    }
}

#else

void main()
{
    view_args view = args.view;
    float strength = args.strength;
    uvec2 here = pt_tile_line(view);
    for (uint left = pt_tile_steps(view, here); left != 0u; left--, here += PT_STEP) {
        uint at = here.y * view.width + here.x;
        float z = read_z(at);
        if (z == pt_float(PT_KEY_EMPTY_Z))
            continue;
        float limit = 2.0 * read_deff(read_from(at));
        precise float sum = 0.0, total = 0.0;
        for (int dy = -PT_OBSCURE_BLUR; dy <= PT_OBSCURE_BLUR; dy++)
            for (int dx = -PT_OBSCURE_BLUR; dx <= PT_OBSCURE_BLUR; dx++) {
                uint qx = here.x + uint(dx), qy = here.y + uint(dy);
                if (qx >= view.width || qy >= view.height)
                    continue;
                uint q = qy * view.width + qx;
                precise float apart = read_z(q) - z;
                if (!(pt_abs(apart) <= limit))
                    continue;
                float weight = (abs(dx) == PT_OBSCURE_BLUR ? 0.5 : 1.0) * (abs(dy) == PT_OBSCURE_BLUR ? 0.5 : 1.0);
                sum = sum + weight * obscured[q];
                total = total + weight;
            }
        precise float mean = sum * pt_rcp(total);
        precise float light = pt_max(1.0 - strength * mean, 0.0);
        vec4 c = color[at];
        precise vec3 darker = c.xyz * light;
        color[at] = vec4(darker, c.w);
    }
}

#endif
