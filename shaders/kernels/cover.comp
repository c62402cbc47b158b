// SPDX-License-Identifier: GPL-3.0-or-later
// cover: pixels in which a mesh lies in front show it; its normal, layer distance and colour there; twin of
// native/device_cpu/kernels/cover.c
#version 430 core
#include "shared/kernel_args.h"

layout(local_size_x = 32, local_size_y = 8) in;

layout(std430, binding = 0) readonly buffer arguments_block { cover_args args; };
layout(std430, binding = 1) buffer keys_block { uvec2 keys[]; };
layout(std430, binding = 2) buffer from_block { uint from[]; };
layout(std430, binding = 3) buffer normals_block { vec4 normals[]; };
layout(std430, binding = 4) writeonly buffer deff_block { float deff[]; };
layout(std430, binding = 5) readonly buffer mesh_keys_block { uvec2 mesh_keys[]; };
layout(std430, binding = 6) readonly buffer vertices_block { float vertices[]; };
layout(std430, binding = 7) readonly buffer indices_block { uint indices[]; };
layout(std430, binding = 8) writeonly buffer shown_block { uvec2 shown[]; };
layout(std430, binding = 9) writeonly buffer shown_normals_block { vec4 shown_normals[]; };
layout(std430, binding = 10) writeonly buffer albedo_block { float albedo[]; };
layout(std430, binding = 11) readonly buffer limit_block { float limit[]; };

#include "lib/mesh.glsl"

struct triangle {
    uint corner[3];
    vec3 position[3]; // object units
    float share[3];   // of each vertex at the pixel
};

vec3 between(triangle t, uint offset)
{
    precise vec3 v = (t.share[0] * read_vertex(t.corner[0], offset) + t.share[1] * read_vertex(t.corner[1], offset)) +
                     t.share[2] * read_vertex(t.corner[2], offset);
    return v;
}

float cross_of(vec2 a, vec2 b)
{
    precise float c = a.x * b.y - b.x * a.y;
    return c;
}

// 1. the triangle, and where on it the pixel's centre lies.
triangle find_triangle(uint index, uint x, uint y)
{
    triangle t;
    vec2 apart[3];
    precise vec2 p = vec2(float(args.view.origin_x + int(x)) + 0.5, float(args.view.origin_y + int(y)) + 0.5);
    for (uint i = 0u; i < 3u; i++) {
        t.corner[i] = indices[3u * index + i];
        t.position[i] = read_vertex(t.corner[i], 0u);
        vec3 at = place_vertex(t.position[i]);
        precise vec2 d = at.xy - p * (args.view.perspective != 0u ? at.z : 1.0);
        apart[i] = d;
    }
    float f[3] = float[3](cross_of(apart[1], apart[2]), cross_of(apart[2], apart[0]), cross_of(apart[0], apart[1]));
    precise float sum = (f[0] + f[1]) + f[2];
    bool turned = sum < 0.0;
    for (uint i = 0u; i < 3u; i++)
        f[i] = pt_max(turned ? pt_negate(f[i]) : f[i], 0.0);
    sum = (f[0] + f[1]) + f[2];
    bool good = 1e-30 <= sum && sum <= 1e30;
    float scale = pt_rcp(good ? sum : 1.0);
    for (uint i = 0u; i < 3u; i++) {
        precise float share = f[i] * scale;
        t.share[i] = good ? share : i == 0u ? 1.0 : 0.0;
    }
    return t;
}

// In view space and unit; where it is nothing, n.
vec3 turn_normal(vec3 object, vec3 n)
{
    vec3 turned = vec3(pt_dot(vec3(args.mesh.normal_matrix[0], args.mesh.normal_matrix[1], args.mesh.normal_matrix[2]), object),
                       pt_dot(vec3(args.mesh.normal_matrix[3], args.mesh.normal_matrix[4], args.mesh.normal_matrix[5]), object),
                       pt_dot(vec3(args.mesh.normal_matrix[6], args.mesh.normal_matrix[7], args.mesh.normal_matrix[8]), object));
    float square = pt_dot(turned, turned);
    bool good = 1e-30 <= square && square <= 1e30;
    precise vec3 unit = turned * pt_rsqrt(good ? square : 1.0);
    return good ? unit : n;
}

// 2. the plane's normal; of a triangle without one, towards the eye.
vec3 plane_normal(triangle t, vec2 ray)
{
    precise vec3 a = t.position[1] - t.position[0], b = t.position[2] - t.position[0];
    vec3 across = vec3(cross_of(a.yz, b.yz), cross_of(a.zx, b.zx), cross_of(a.xy, b.xy));
    precise vec3 n = vec3(0.0, 0.0, 1.0);
    if (args.view.perspective != 0u) {
        float r = pt_ray_rsqrt(ray);
        n = vec3(pt_negate(ray.x) * r, pt_negate(ray.y) * r, r);
    }
    return turn_normal(across, n);
}

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
    triangle t = find_triangle(index, x, y);
    vec2 ray = pt_ray(view, int(x), int(y));
    vec3 n = plane_normal(t, ray);
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
    shown[at] = uvec2(at, key.y);
    shown_normals[at] = vec4(smooth_normal, inverse);
    for (uint k = 0u; k < 3u; k++)
        albedo[3u * at + k] = color[k];
}
