// SPDX-License-Identifier: GPL-3.0-or-later
// incline: places of cells -> their normals [K II.C]; twin of native/device_cpu/kernels/incline.c
#version 430 core
#include "shared/ranges.h"
#include "lib/ranges.glsl"
#include "lib/planes.glsl"

layout(local_size_x = 32, local_size_y = 8) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { incline_args args; };
layout(std430, binding = BIND_inclined) writeonly buffer inclined_block { vec4 inclined[]; };

// The cells around, anticlockwise.
const ivec2 ring[8] = ivec2[](ivec2(1, 0), ivec2(1, 1), ivec2(0, 1), ivec2(-1, 1), ivec2(-1, 0), ivec2(-1, -1), ivec2(0, -1),
                              ivec2(1, -1));

float joined = 0.0; // cells around

// The way to a cell around, in cells; 0 where it is none, or not joined.
vec3 step_to(view_args view, int x, int y, int k, vec4 own, vec2 ray, float scale)
{
    if (!pt_range_inside(view, x + ring[k].x, y + ring[k].y))
        return vec3(0.0);
    vec4 other = read_float4(uint(y + ring[k].y) * view.width + uint(x + ring[k].x));
    if (!(0.0 < other.w))
        return vec3(0.0);
    precise float deeper = other.z - own.z;
    if (!(pt_abs(deeper) <= pt_range_step(view, args.gamma, args.gamma_cells, pt_min(other.z, own.z))))
        return vec3(0.0);
    joined += 1.0;
    precise float across = (float(ring[k].x) + (other.x - own.x)) * view.ray_xs;
    precise float up = (float(ring[k].y) + (other.y - own.y)) * view.ray_ys;
    if (view.perspective != 0u) {
        across = across * other.z + ray.x * deeper;
        up = up * other.z + ray.y * deeper;
    }
    precise vec3 way = vec3(across * scale, up * scale, pt_negate(deeper) * scale);
    return way;
}

void main()
{
    view_args view = args.view;
    uint x = view.rect[0] + gl_GlobalInvocationID.x, y = view.rect[1] + gl_GlobalInvocationID.y;
    if (x >= view.rect[2] || y >= view.rect[3])
        return;
    uint at = y * view.width + x;
    vec4 own = read_float4(at);
    if (!(0.0 < own.w))
        return;
    precise float px = float(int(x) + view.origin_x) + own.x, py = float(int(y) + view.origin_y) + own.y;
    precise vec2 ray = vec2(view.ray_x0 + view.ray_xs * px, view.ray_y0 + view.ray_ys * py);
    float scale = pt_rcp(pt_footprint(view, own.z));
    vec3 steps[8];
    for (int k = 0; k < 8; k++)
        steps[k] = step_to(view, int(x), int(y), k, own, ray, scale);
    // all pairs less than half a turn apart: 24 triangles
    precise vec3 n = vec3(0.0);
    for (int k = 0; k < 8; k++) {
        vec3 a = steps[k];
        precise vec3 b = (steps[(k + 1) & 7] + steps[(k + 2) & 7]) + steps[(k + 3) & 7];
        n.x = n.x + (a.y * b.z - a.z * b.y);
        n.y = n.y + (a.z * b.x - a.x * b.z);
        n.z = n.z + (a.x * b.y - a.y * b.x);
    }
    float square = pt_dot(n, n);
    precise vec3 towards = vec3(0.0, 0.0, 1.0);
    precise float facing = n.z;
    if (view.perspective != 0u) {
        float r = pt_ray_rsqrt(ray);
        towards = vec3(pt_negate(ray.x) * r, pt_negate(ray.y) * r, r);
        facing = n.z - (n.x * ray.x + n.y * ray.y);
    }
    if (1e-12 < square) {
        towards = n * pt_rsqrt(square);
        if (facing < 0.0)
            towards = vec3(pt_negate(towards.x), pt_negate(towards.y), pt_negate(towards.z));
    }
    inclined[at] = vec4(towards, joined);
}
