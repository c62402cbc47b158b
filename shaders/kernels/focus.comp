// SPDX-License-Identifier: GPL-3.0-or-later
// focus: depth of field, and over the background, into the crop; twin of native/device_cpu/kernels/focus.c
#version 430 core
#include "shared/picture.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"

layout(local_size_x = 16, local_size_y = 16) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { focus_args args; };
layout(std430, binding = BIND_combined) writeonly buffer combined_block { vec4 combined[]; };

// Radius of the circle of confusion, pixels.
float circle_of(float z)
{
    bool some = z < pt_float(PT_KEY_EMPTY_Z);
    if (args.view.perspective == 0u) {
        precise float off = pt_abs(z - args.distance) * args.scale;
        return some ? pt_min(off, args.most) : args.most;
    }
    float inverse = some ? pt_rcp(z) : 0.0;
    precise float radius = pt_abs(1.0 - args.distance * inverse) * args.scale;
    return pt_min(radius, args.most);
}

float density_of(float circle)
{
    float wide = pt_max(circle, PT_FOCUS_SHARP);
    precise float density = pt_rcp(wide * wide) * PT_FOCUS_DENSITY;
    return density;
}

// The largest circle among those that may reach the workgroup's pixels.
shared uint largest;

void find_largest(view_args view, uint x, uint y)
{
    if (gl_LocalInvocationIndex == 0u)
        largest = 0u;
    barrier();
    int reach = int(args.reach);
    ivec2 corner = ivec2(int(x) - int(gl_LocalInvocationID.x), int(y) - int(gl_LocalInvocationID.y)) - reach;
    ivec2 last = min(corner + 15 + 2 * reach, ivec2(view.width, view.height) - 1);
    float most = 0.0;
    for (int qy = max(corner.y, 0) + int(gl_LocalInvocationID.y); qy <= last.y; qy += 16)
        for (int qx = max(corner.x, 0) + int(gl_LocalInvocationID.x); qx <= last.x; qx += 16) {
            float z = read_z(uint(qy) * view.width + uint(qx));
            most = z < pt_float(PT_KEY_EMPTY_Z) ? pt_max(most, circle_of(z)) : most; // empty pixels spread nothing
        }
    atomicMax(largest, pt_bits(most));
    barrier();
}

void main()
{
    view_args view = args.view;
    uint cx = gl_GlobalInvocationID.x, cy = gl_GlobalInvocationID.y, x = args.crop_x + cx, y = args.crop_y + cy;
    find_largest(view, x, y);
    if (cx >= args.crop_width || cy >= args.crop_height)
        return;
    precise float most = pt_float(largest) + 0.5;
    int reach = min(int(most), int(args.reach));
    float z = read_z(y * view.width + x), circle = circle_of(z), density = density_of(circle);
    precise vec4 near = vec4(0.0), far = vec4(0.0);
    precise float near_weight = 0.0, far_weight = 0.0;
    for (int dy = -reach; dy <= reach; dy++)
        for (int dx = -reach; dx <= reach; dx++) {
            precise float square = float(dx * dx + dy * dy);
            precise float away = square * pt_rsqrt(pt_max(square, 1.0));
            uint qx = x + uint(dx), qy = y + uint(dy);
            if (!(away < most) || qx >= view.width || qy >= view.height)
                continue;
            uint q = qy * view.width + qx;
            float at = read_z(q), wide = circle_of(at), dense = density_of(wide);
            bool before = at < z;
            if (!before) { // what lies behind does not spread over what is sharper
                wide = pt_min(wide, circle);
                dense = pt_max(dense, density);
            }
            precise float weight = pt_min(pt_max((wide - away) + 0.5, 0.0), 1.0) * dense;
            vec4 c = at < pt_float(PT_KEY_EMPTY_Z) ? read_float4(q) : vec4(0.0);
            precise vec4 weighted = c * weight;
            if (before) {
                near = near + weighted;
                near_weight = near_weight + weight;
            } else {
                far = far + weighted;
                far_weight = far_weight + weight;
            }
        }
    precise float far_share = (1.0 - pt_min(near_weight, 1.0)) * pt_rcp(far_weight);
    precise vec4 c = near * pt_rcp(pt_max(near_weight, 1.0)) + far * far_share;
    c.w = pt_min(c.w, 1.0);
    vec4 background = vec4(args.background[0], args.background[1], args.background[2], args.background[3]);
    precise vec4 over = c + (1.0 - c.w) * background;
    combined[cy * args.crop_width + cx] = over;
}
