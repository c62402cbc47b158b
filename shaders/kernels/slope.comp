// SPDX-License-Identifier: GPL-3.0-or-later
// slope: values around a pixel -> the plane that fits them best; twin of native/device_cpu/kernels/slope.c
#version 430 core
#include "shared/effects.h"
#include "lib/tiles.glsl"

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { slope_args args; };
layout(std430, binding = BIND_values) readonly buffer values_block { float values[]; };
layout(std430, binding = BIND_slopes) writeonly buffer slopes_block { vec4 slopes[]; };

bool is_known(float value) { return (pt_bits(value) & 0x7FFFFFFFu) < 0x7F800000u; }

vec4 slope_at(view_args view, uvec2 here, uint at, float z, float value)
{
    // 1. two spacings across the view, in pixels
    uint source = read_from(at);
    float limit = read_deff(source), steepest = PT_SLOPE_STEEPEST;
    float cosine = pt_cosine(view, read_float4(source).xyz, pt_ray(view, int(here.x), int(here.y)));
    precise float across = limit * pt_max(pt_abs(cosine), PT_SLOPE_GRAZING);
    precise float wide = across * pt_rcp(pt_footprint(view, z)) + 0.5;
    float radius = pt_min(pt_max(floor(wide), PT_SLOPE_LEAST), float(PT_SLOPE_MOST));
    float step_size = floor((radius + (float(PT_SLOPE_TAPS) - 1.0)) * (1.0 / float(PT_SLOPE_TAPS)));
    float most = (radius + 1.0) * (radius + 1.0), inverse = pt_rcp(most);
    int reach = step_size > 1.0 ? PT_SLOPE_TAPS : int(radius);
    uvec2 corner = uvec2(view.rect[0], view.rect[1]), size = uvec2(view.rect[2], view.rect[3]) - corner;
    // 2. sums of what is around
    precise float w = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0, yy = 0.0, v = 0.0, xv = 0.0, yv = 0.0;
    for (int j = -reach; j <= reach; j++)
        for (int i = -reach; i <= reach; i++) {
            float dx = step_size * float(i), dy = step_size * float(j);
            float square = dx * dx + dy * dy;
            precise float part = 1.0 - square * inverse;
            uvec2 q = uvec2(ivec2(here) + ivec2(int(dx), int(dy))), inside = q - corner;
            if (square >= most || inside.x >= size.x || inside.y >= size.y)
                continue;
            uint there = q.y * view.width + q.x;
            precise float off = read_z(there) - z;
            if (!(pt_abs(off) <= limit))
                continue;
            float other = values[there];
            if (!is_known(other))
                continue;
            precise float change = other - value, px = part * dx, py = part * dy;
            w = w + part;
            x = x + px;
            y = y + py;
            xx = xx + px * dx;
            xy = xy + px * dy;
            yy = yy + py * dy;
            v = v + part * change;
            xv = xv + px * change;
            yv = yv + py * change;
        }
    // 3. the plane
    precise float per = pt_rcp(w), mx = x * per, my = y * per, mv = v * per;
    precise float cxx = (xx * per - mx * mx) + PT_SLOPE_RIDGE, cyy = (yy * per - my * my) + PT_SLOPE_RIDGE;
    precise float cxy = xy * per - mx * my, cxv = xv * per - mx * mv, cyv = yv * per - my * mv;
    precise float det = cxx * cyy - cxy * cxy;
    float solved = pt_rcp(pt_max(det, PT_SLOPE_RIDGE * PT_SLOPE_RIDGE));
    precise float gx = (cyy * cxv - cxy * cyv) * solved, gy = (cxx * cyv - cxy * cxv) * solved;
    precise float middle = value + (mv - (gx * mx + gy * my));
    return vec4(middle, pt_min(pt_max(gx, -steepest), steepest), pt_min(pt_max(gy, -steepest), steepest), 1.0);
}

void main()
{
    view_args view = args.view;
    uvec2 here = pt_tile_line(view);
    for (uint left = pt_tile_steps(view, here); left != 0u; left--, here += PT_STEP) {
        uint at = here.y * view.width + here.x;
        float z = read_z(at);
        if (pt_bits(z) == PT_KEY_EMPTY_Z)
            continue;
        float value = values[at];
        slopes[at] = is_known(value) ? slope_at(view, here, at, z, value) : vec4(0.0);
    }
}
