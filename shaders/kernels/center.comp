// SPDX-License-Identifier: GPL-3.0-or-later
// center: measured point -> how far behind it its tangent plane lies in the middle of its pixel; twin of
// native/device_cpu/kernels/center.c
//
// A workgroup takes a chunk. Points are projected anew, as scatter does.
#version 430 core
#include "shared/measured.h"
#include "lib/math.glsl"
#include "lib/positions.glsl"

layout(local_size_x = 64) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { center_args args; };
layout(std430, binding = BIND_keys) readonly buffer keys_block { uvec2 keys[]; }; // id, z bits
layout(std430, binding = BIND_normal) readonly buffer normal_block { vec4 normal[]; };
layout(std430, binding = BIND_deff) readonly buffer deff_block { float deff[]; };
layout(std430, binding = BIND_offset) writeonly buffer offset_block { float offset[]; };
layout(std430, binding = BIND_chunks) readonly buffer chunks_block { chunk_view chunks[]; };

layout(location = 0) uniform uint first_chunk; // of this dispatch
layout(location = 1) uniform uint first_slot;  // where the bound part of positions begins

void main()
{
    chunk_view chunk = chunks[first_chunk + gl_WorkGroupID.x];
    view_args view = args.view;
    vec3 row_x = vec3(chunk.row[0], chunk.row[1], chunk.row[2]);
    vec3 row_y = vec3(chunk.row[3], chunk.row[4], chunk.row[5]);
    vec3 row_z = vec3(chunk.row[6], chunk.row[7], chunk.row[8]);
    float left = float(view.origin_x), right = float(view.origin_x + int(view.width));
    float bottom = float(view.origin_y), top = float(view.origin_y + int(view.height));
    uint base = chunk.first - first_slot;
    uint stride = gl_WorkGroupSize.x * gl_NumWorkGroups.y;

    for (uint i = gl_WorkGroupID.y * gl_WorkGroupSize.x + gl_LocalInvocationID.x; i < chunk.count; i += stride) {
        vec3 p = pt_position(base, chunk.padded, chunk.step, i);
        precise float z = (((chunk.lo[2] + row_z.x * p.x) + row_z.y * p.y) + row_z.z * p.z) + chunk.hi[2];
        precise float x = (((chunk.lo[0] + row_x.x * p.x) + row_x.y * p.y) + row_x.z * p.z) + chunk.hi[0];
        precise float y = (((chunk.lo[1] + row_y.x * p.x) + row_y.y * p.y) + row_y.z * p.z) + chunk.hi[1];
        if (view.perspective != 0u) {
            float r = pt_rcp(z);
            x = x * r;
            y = y * r;
        }
        if (!(view.z_near <= z && z <= view.z_far && left <= x && x < right && bottom <= y && y < top))
            continue;
        int column = int(floor(x)) - view.origin_x, row = int(floor(y)) - view.origin_y;
        uint pixel = uint(row) * view.width + uint(column);
        if (keys[pixel] != uvec2(chunk.id_base + chunk.first + i, pt_bits(z) & 0x7FFFFFFFu))
            continue;
        // 1. to the middle of the pixel, in the view's units (perspective: at z = 1), and how n leans that way
        vec3 n = normal[pixel].xyz;
        vec2 ray = pt_ray(view, column, row);
        precise float dx = (float(view.origin_x + column) + 0.5) - x;
        precise float dy = (float(view.origin_y + row) + 0.5) - y;
        precise float rise = n.x * (view.ray_xs * dx) + n.y * (view.ray_ys * dy);
        precise float facing = 0.0 - n.z;
        precise float deep = rise * z;
        precise float towards = (n.x * ray.x + n.y * ray.y) - n.z;
        if (view.perspective != 0u) {
            rise = deep;
            facing = towards;
        }
        // 2. the plane's step, no farther than the surface is known to go on
        float size = pt_abs(facing);
        precise float step_back = rise * pt_rcp(size);
        precise float back = 0.0 - step_back;
        precise float near_half = 0.5 * z;
        float most = deff[pixel];
        precise float nearest = 0.0 - pt_min(most, near_half);
        float found = pt_min(pt_max(facing < 0.0 ? step_back : back, nearest), most);
        offset[pixel] = size > 1e-6 ? found : 0.0;
    }
}
