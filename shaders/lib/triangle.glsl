// SPDX-License-Identifier: GPL-3.0-or-later
// What a pixel shows of a mesh: which part of a triangle, facing where; twin of native/device_cpu/kernels/triangle.h. The kernel
// has declared args with its view and mesh, vertices and indices.
#ifndef PT_TRIANGLE_GLSL
#define PT_TRIANGLE_GLSL

#include "lib/mesh.glsl"

struct triangle {
    uint corner[3];
    vec3 position[3]; // object units
    float share[3];   // of each vertex at the pixel
    vec2 away[3];     // of each corner from the pixel's centre, times its depth
    float depth[3];   // 1 in orthographic views
    bool turned;      // its corners run clockwise
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

// The triangle, and where on it the pixel's centre lies.
triangle find_triangle(uint index, uint x, uint y)
{
    triangle t;
    precise vec2 p = vec2(float(args.view.origin_x + int(x)) + 0.5, float(args.view.origin_y + int(y)) + 0.5);
    for (uint i = 0u; i < 3u; i++) {
        t.corner[i] = indices[3u * index + i];
        t.position[i] = read_vertex(t.corner[i], 0u);
        vec3 at = place_vertex(t.position[i]);
        t.depth[i] = args.view.perspective != 0u ? at.z : 1.0;
        precise vec2 d = at.xy - p * t.depth[i];
        t.away[i] = d;
    }
    float f[3] = float[3](cross_of(t.away[1], t.away[2]), cross_of(t.away[2], t.away[0]), cross_of(t.away[0], t.away[1]));
    precise float sum = (f[0] + f[1]) + f[2];
    t.turned = sum < 0.0;
    for (uint i = 0u; i < 3u; i++)
        f[i] = pt_max(t.turned ? pt_negate(f[i]) : f[i], 0.0);
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

// The plane's normal; of a triangle without one, towards the eye.
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

#endif
