// SPDX-License-Identifier: GPL-3.0-or-later
// normals: image-space normals of points that have none; twin of native/device_cpu/kernels/normals.c
//
// A plane is linear in the picture as 1/z (perspective) or z (orthographic). Least squares over the window's pixels
// that can belong to the same surface give w = w_p + a dx + b dy + c, hence the plane n . (u, v, -1) = w, hence n.
#version 430 core
#include "shared/measured.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"
#include "lib/tiles.glsl"
#include "lib/by_pixel.glsl"

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { normals_args args; };
layout(std430, binding = BIND_surfels) readonly buffer surfels_block { uint surfels[]; };
layout(std430, binding = BIND_normal) writeonly buffer normals_block { vec4 normals[]; };

struct window_sums {
    float n, x, y, xx, xy, yy, w, xw, yw;
};

float linear_depth(view_args view, float z) { return view.perspective != 0u ? pt_rcp(z) : z; }

// Depth of a pixel; nothing there, or beyond the plane: empty.
float depth_at(view_args view, int x, int y)
{
    bool inside = x >= 0 && y >= 0 && x < int(view.width) && y < int(view.height);
    return inside ? read_z(uint(y) * view.width + uint(x)) : pt_float(PT_KEY_EMPTY_Z);
}

// What z changes by a pixel to the next one that shows something, towards `way`; known: there is one.
float change_towards(view_args view, int reach, ivec2 p, float z, ivec2 way, out bool known)
{
    const float shares[PT_STEP_REACH] = float[PT_STEP_REACH](1.0, 0.5, 0.333333343);
    precise float change = 0.0;
    known = false;
    for (int k = 1; k <= reach && !known; k++) {
        float q = depth_at(view, p.x + k * way.x, p.y + k * way.y);
        known = q < pt_float(PT_KEY_EMPTY_Z);
        change = known ? (q - z) * shares[k - 1] : 0.0;
    }
    return change;
}

// What z changes by a pixel along an axis, as far as both sides agree.
float step_along(view_args view, int reach, ivec2 p, float z, ivec2 axis)
{
    bool known_before, known_after;
    precise float a = 0.0 - change_towards(view, reach, p, z, -axis, known_before);
    float b = change_towards(view, reach, p, z, axis, known_after);
    float first = known_before ? a : b, second = known_after ? b : a;
    bool alike = (0.0 < first && 0.0 < second) || (first < 0.0 && second < 0.0);
    return (known_before || known_after) && alike ? (pt_abs(first) < pt_abs(second) ? first : second) : 0.0;
}

// Radius of a pixel's window: shared/measured.h.
int reach_of(view_args view, int radius, float distance_limit, float z)
{
    precise float wanted = 0.0 - floor(0.0 - distance_limit * pt_rcp(pt_footprint(view, z)));
    return int(pt_min(pt_max(wanted, PT_ESTIMATE_LEAST), float(radius)));
}

// 1. Sums over the window, of rows first. Pixel counts and offsets are small integers: exact in float32. Which pixels:
// shared/measured.h.
window_sums gather(view_args view, int radius, int x, int y, float z, float w, float distance_limit, float slope,
                   vec2 steps)
{
    precise window_sums s = window_sums(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (int dy = -radius; dy <= radius; dy++) {
        precise float n = 0.0, sum_x = 0.0, sum_xx = 0.0, sum_w = 0.0, sum_xw = 0.0;
        for (int dx = -radius; dx <= radius; dx++) {
            int qx = x + dx, qy = y + dy;
            if (qx < 0 || qy < 0 || qx >= int(view.width) || qy >= int(view.height))
                continue;
            float zq = read_z(uint(qy) * view.width + uint(qx));
            float fx = float(dx);
            precise float along = steps.x * fx, up = steps.y * float(dy);
            precise float apart = (zq - z) - (along + up);
            precise float reach = slope * float(max(abs(dx), abs(dy)));
            precise float steep = PT_STEEP * (pt_abs(along) + pt_abs(up));
            if (!(pt_abs(apart) <= pt_max(pt_max(distance_limit, reach), steep)))
                continue; // another surface, or nothing
            precise float dw = linear_depth(view, zq) - w;
            n = n + 1.0;
            sum_x = sum_x + fx;
            sum_xx = sum_xx + fx * fx;
            sum_w = sum_w + dw;
            sum_xw = sum_xw + fx * dw;
        }
        float fy = float(dy);
        s.n = s.n + n;
        s.x = s.x + sum_x;
        s.y = s.y + n * fy;
        s.xx = s.xx + sum_xx;
        s.xy = s.xy + sum_x * fy;
        s.yy = s.yy + n * (fy * fy);
        s.w = s.w + sum_w;
        s.xw = s.xw + sum_xw;
        s.yw = s.yw + fy * sum_w;
    }
    return s;
}

// 2. to 4. The normal from the sums; zero where they hold none.
vec3 fit(view_args view, window_sums s, float w, vec2 ray)
{
    // 2. Normal equations about the mean, all times n: slopes a, b of w and its value at the pixel. det is an exact
    // integer (in float32 up to a rounding): 0 when the pixels lie on a line.
    precise float xx = s.n * s.xx - s.x * s.x, xy = s.n * s.xy - s.x * s.y, yy = s.n * s.yy - s.y * s.y;
    precise float xw = s.n * s.xw - s.x * s.w, yw = s.n * s.yw - s.y * s.w;
    precise float det = xx * yy - xy * xy;
    float inverse = pt_rcp(pt_max(det, 0.5));
    precise float a = (yy * xw - xy * yw) * inverse;
    precise float b = (xx * yw - xy * xw) * inverse;
    precise float c = w + (s.w - (a * s.x + b * s.y)) * pt_rcp(pt_max(s.n, 1.0));
    // 3. the plane's normal from dw/dx = a, dw/dy = b a pixel
    precise vec3 n = vec3(a * view.ray_ys, b * view.ray_xs, view.ray_xs * view.ray_ys);
    if (view.perspective != 0u)
        n.z = (n.x * ray.x + n.y * ray.y) - c * n.z;
    else
        ray = vec2(0.0);
    // 4. unit, towards the viewer: n . (u, v, -1) < 0. Largest component first, so that no square over- or underflows.
    float largest = pt_max(pt_max(pt_abs(n.x), pt_abs(n.y)), pt_abs(n.z));
    bool found = 0.5 < det && 1e-30 < largest && largest < 1e30;
    n = n * pt_rcp(found ? largest : 1.0);
    float scale = pt_rsqrt(pt_dot(n, n));
    precise float facing = (n.x * ray.x + n.y * ray.y) - n.z;
    if (0.0 < facing)
        scale = -scale;
    precise vec3 unit = n * scale;
    return found ? unit : vec3(0.0);
}

void normal_pixel(view_args view, int radius, bool steep, uint id_base, uint id_first, uint id_count, float d_min, uint x, uint y)
{
    uint at = y * view.width + x;
    uvec2 key = read_key(at);
    uint id = key.x - id_base;
    if (key.y == PT_KEY_EMPTY_Z || id - id_first >= id_count)
        return;
    float z = pt_float(key.y), w = linear_depth(view, z);
    float spacing = args.instance.spacing[surfels[pt_place_of(id, at)] >> PT_SPACING_SHIFT];
    float distance_limit = pt_layer_distance(view, d_min, spacing, z, 1.0);
    precise float slope = 4.0 * pt_footprint(view, z); // 76 degrees
    int column = int(x), row = int(y);
    vec2 steps = vec2(0.0);
    if (steep) {
        steps.x = step_along(view, min(radius, PT_STEP_REACH), ivec2(column, row), z, ivec2(1, 0));
        steps.y = step_along(view, min(radius, PT_STEP_REACH), ivec2(column, row), z, ivec2(0, 1));
    }
    int reach = reach_of(view, radius, distance_limit, z);
    window_sums s = gather(view, reach, column, row, z, w, distance_limit, slope, steps);
    normals[at] = vec4(fit(view, s, w, pt_ray(view, int(x), int(y))), 0.0);
}

void main()
{
    view_args view = args.view;
    uint id_base = args.instance.id_base, id_first = args.instance.id_first, id_count = args.instance.id_count;
    float d_min = args.instance.d_min;
    int radius = int(args.radius);
    bool steep = args.steep != 0u;
    uvec2 here = pt_tile_line(view);
    for (uint left = pt_tile_steps(view, here); left != 0u; left--, here += PT_STEP)
        normal_pixel(view, radius, steep, id_base, id_first, id_count, d_min, here.x, here.y);
}
