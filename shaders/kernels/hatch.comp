// SPDX-License-Identifier: GPL-3.0-or-later
// hatch: strokes where planes cut the surface; twin of native/device_cpu/kernels/hatch.c
#version 430 core
#include "lib/math.glsl"
#include "lib/planes.glsl"
#include "lib/tiles.glsl"

layout(std430, binding = 0) readonly buffer arguments_block { hatch_args args; };
layout(std430, binding = 3) buffer color_block { vec4 color[]; };

struct pixel {
    vec3 n, ray, place; // the normal shown; (u, v, -1), in orthographic views (0, 0, -1); the point, view space
    vec2 width;         // of the pixel at the point
    float back;         // (n . r) / (n . r)^2
};

pixel find(view_args view, uint x, uint y, float z, vec3 n)
{
    pixel p;
    vec2 ray = pt_ray(view, int(x), int(y));
    precise vec3 place = vec3(ray, pt_negate(z + args.eye_z));
    precise vec2 width = vec2(view.ray_xs, view.ray_ys);
    p.n = n;
    p.ray = vec3(0.0, 0.0, -1.0);
    if (view.perspective != 0u) {
        p.ray = vec3(ray, -1.0);
        place = vec3(z * ray, pt_negate(z));
        width = z * width;
    }
    p.place = place;
    p.width = width;
    precise float facing = pt_dot(n, p.ray);
    precise float back = facing * pt_rcp(pt_max(facing * facing, PT_HATCH_GRAZING));
    p.back = back;
    return p;
}

// What a stroke of this level covers of the pixel; wide: its width, in shares of the spacing.
float stroke(uint level, pixel p, float wide)
{
    vec3 axis = vec3(args.axes[3u * level], args.axes[3u * level + 1u], args.axes[3u * level + 2u]);
    precise float along = pt_dot(axis, p.place) + args.offsets[level];
    // how much it grows a pixel on: the surface goes on in its tangent plane
    precise float turn = pt_dot(axis, p.ray) * p.back;
    precise float gx = p.width.x * (axis.x - turn * p.n.x), gy = p.width.y * (axis.y - turn * p.n.y);
    precise float square = pt_max(gx * gx + gy * gy, 1e-30);
    float root = pt_rsqrt(square);
    precise float rate = square * root;
    precise float wanted = rate * args.spacing;
    uint exponent = pt_bits(wanted) & 0x7F800000u; // the next power of two below
    float period = pt_float(exponent), inverse = pt_float((254u << 23) - exponent);
    precise float fade = wanted * inverse - 1.0;
    precise float at = along * inverse;
    precise float line = floor(at + 0.5);
    precise float off = pt_abs(at - line) * (period * root); // pixels
    precise float odd = line - 2.0 * floor(line * 0.5);      // 0 or 1
    precise float reach = (0.5 * wide) * (1.0 - odd * fade);
    precise float edge = pt_min(pt_max((reach - off) + 0.5, 0.0), 1.0);
    precise float covered = edge * pt_min(2.0 * reach, 1.0);
    return covered;
}

void main()
{
    view_args view = args.view;
    vec3 stroke_color = vec3(args.color[0], args.color[1], args.color[2]);
    uvec2 here = pt_tile_line(view);
    for (uint left = pt_tile_steps(view, here); left != 0u; left--, here += PT_STEP) {
        uint at = here.y * view.width + here.x;
        float z = read_z(at);
        if (z == pt_float(PT_KEY_EMPTY_Z))
            continue;
        pixel p = find(view, here.x, here.y, z, read_float4(at).xyz);
        vec4 c = color[at];
        precise float light = (0.2126 * c.x + 0.7152 * c.y) + 0.0722 * c.z;
        light = light * pt_rcp(pt_max(c.w, 1e-6));
        precise float tone = light * pt_rsqrt(pt_max(light, 1e-6)); // as the eye has it
        precise float bare = 1.0;
        for (uint level = 0u; level < args.levels; level++) {
            precise float dark = pt_min(pt_max(1.0 - tone * args.tones[level], 0.0), 1.0);
            precise float wide = args.width * dark;
            bare = bare * (1.0 - stroke(level, p, wide));
        }
        precise float ink = args.opacity * (1.0 - bare);
        precise vec3 under = c.xyz * (1.0 - args.ground) + vec3(c.w * args.ground);
        precise vec3 drawn = under * (1.0 - ink) + (stroke_color * c.w) * ink;
        color[at] = vec4(drawn, c.w);
    }
}
