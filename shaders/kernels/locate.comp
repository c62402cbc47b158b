// SPDX-License-Identifier: GPL-3.0-or-later
// locate: where pixels that show a mesh lie, and which way they face, as points of a cloud; twin of
// native/device_cpu/kernels/locate.c
#version 430 core

#include "shared/meshes.h"
#include "shared/words.h"

layout(local_size_x = 32, local_size_y = 8) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { locate_args args; };
layout(std430, binding = BIND_shown) readonly buffer shown_block { uvec2 shown[]; };
layout(std430, binding = BIND_mesh_keys) readonly buffer mesh_keys_block { uvec2 mesh_keys[]; };
layout(std430, binding = BIND_vertices) readonly buffer vertices_block { float vertices[]; };
layout(std430, binding = BIND_indices) readonly buffer indices_block { uint indices[]; };
layout(std430, binding = BIND_places) writeonly buffer places_block { float places[]; };
layout(std430, binding = BIND_words) writeonly buffer words_block { uint words[]; };

#include "lib/triangle.glsl"

// 2. to the nearest of 8191 steps a side; what is not a number is no normal.
uint encode_normal(vec3 n)
{
    precise float sum = (pt_abs(n.x) + pt_abs(n.y)) + pt_abs(n.z);
    if (!(1e-30 <= sum))
        return PT_NORMAL_NONE;
    float scale = pt_rcp(sum);
    precise float x = n.x * scale, y = n.y * scale;
    precise float across = 1.0 - pt_abs(y), up = 1.0 - pt_abs(x); // the lower half is folded over the corners
    if (n.z < 0.0) {
        bool right = 0.0 <= x, above = 0.0 <= y;
        x = right ? across : pt_negate(across);
        y = above ? up : pt_negate(up);
    }
    precise float column = (x * 4095.0 + 4095.0) + 0.5, row = (y * 4095.0 + 4095.0) + 0.5;
    return uint(pt_min(pt_max(floor(column), 0.0), 8190.0)) + uint(pt_min(pt_max(floor(row), 0.0), 8190.0)) * (1u << 13);
}

void main()
{
    view_args view = args.view;
    uint x = view.rect[0] + gl_GlobalInvocationID.x, y = view.rect[1] + gl_GlobalInvocationID.y;
    if (x >= view.rect[2] || y >= view.rect[3])
        return;
    uint at = y * view.width + x, index = mesh_keys[at].x - args.mesh.id_base;
    if (index >= args.mesh.id_count || shown[at].y == PT_KEY_EMPTY_Z)
        return;
    vec2 ray = pt_ray(view, int(x), int(y));
    float z = pt_float(shown[at].y);
    vec3 n = plane_normal(find_triangle(index, x, y), ray);
    // 1. in view space
    precise vec2 aside = ray * (view.perspective != 0u ? z : 1.0);
    precise float deep = z + args.eye_z;
    uint row = 3u * y * view.width + x;
    places[row] = aside.x;
    places[row + view.width] = aside.y;
    places[row + 2u * view.width] = pt_negate(deep);
    words[at] = encode_normal(n);
}
