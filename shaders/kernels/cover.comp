// SPDX-License-Identifier: GPL-3.0-or-later
// cover: pixels in which a mesh lies in front show it; its normal, layer distance and colour there; twin of
// native/device_cpu/kernels/cover.c
#version 430 core

#include "shared/meshes.h"

layout(local_size_x = 32, local_size_y = 8) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { cover_args args; };
layout(std430, binding = BIND_keys) buffer keys_block { uvec2 keys[]; };
layout(std430, binding = BIND_from) buffer from_block { uint from[]; };
layout(std430, binding = BIND_normal) buffer normals_block { vec4 normals[]; };
layout(std430, binding = BIND_deff) writeonly buffer deff_block { float deff[]; };
layout(std430, binding = BIND_mesh_keys) readonly buffer mesh_keys_block { uvec2 mesh_keys[]; };
layout(std430, binding = BIND_vertices) readonly buffer vertices_block { float vertices[]; };
layout(std430, binding = BIND_indices) readonly buffer indices_block { uint indices[]; };
layout(std430, binding = BIND_shown) writeonly buffer shown_block { uvec2 shown[]; };
layout(std430, binding = BIND_shown_normal) writeonly buffer shown_normals_block { vec4 shown_normals[]; };
layout(std430, binding = BIND_albedo) writeonly buffer albedo_block { vec4 albedo[]; };
layout(std430, binding = BIND_limit) readonly buffer limit_block { float limit[]; };

#include "lib/triangle.glsl"

void main()
{
    view_args view = args.view;
    uint x = view.rect[0] + gl_GlobalInvocationID.x, y = view.rect[1] + gl_GlobalInvocationID.y;
    if (x >= view.rect[2] || y >= view.rect[3])
        return;
    uint at = y * view.width + x;
    uvec2 key = mesh_keys[at], other = keys[at];
    uint index = key.x - args.mesh.id_base;
    if (index >= args.mesh.id_count || key.y == PT_KEY_EMPTY_Z)
        return;
    // a pixel that is not beyond the limit was filled across a layer taken before
    if (!pt_key_less(key, other) && !(args.behind != 0u && pt_float(other.y) <= limit[at]))
        return;
    triangle t = find_triangle(index, x, y); // 1.
    vec2 ray = pt_ray(view, int(x), int(y));
    vec3 n = plane_normal(t, ray); // 2.
    // 3. layer distance of what is as dense as the pixels
    float inverse = pt_rcp(pt_max(pt_cosine(view, n, ray), PT_COSINE_FLOOR));
    float z = pt_float(key.y);
    deff[at] = pt_layer_distance(view, 0.0, pt_footprint(view, z), z, inverse);
    // 4. a point's normal stays: pixels around may show it
    bool measured = (from[at] & ~PT_FROM_MIXED) == at && other.y != PT_KEY_EMPTY_Z;
    if (!measured)
        normals[at] = vec4(n, inverse);
    from[at] = at;
    keys[at] = key;
    // 5. what shading asks for
    if (args.shown == 0u)
        return;
    vec3 smooth_normal = args.mesh.has_normals != 0u ? turn_normal(between(t, 3u), n) : n;
    vec3 color = vec3(args.mesh.color[0], args.mesh.color[1], args.mesh.color[2]);
    if (args.mesh.has_colors != 0u)
        color = between(t, 3u + 3u * args.mesh.has_normals);
    shown[at] = uvec2(args.first + at, key.y);
    shown_normals[at] = vec4(smooth_normal, inverse);
    albedo[at] = vec4(color, 1.0);
}
