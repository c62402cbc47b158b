// SPDX-License-Identifier: GPL-3.0-or-later
// push: empty or occluded pixels take the key of their coarse parent, where two of the three coarse cells on their side
// are covered too (else every edge would grow by a coarse pixel). SPEC 2.2; twin of native/device_cpu/kernels/push.c
#version 430 core
#include "lib/math.glsl"
#include "lib/planes.glsl"

layout(local_size_x = 32, local_size_y = 8) in;

layout(std430, binding = 0) readonly buffer arguments_block { push_args args; };
layout(std430, binding = 3) buffer keys_block { uvec2 keys[]; };
layout(std430, binding = 4) buffer from_block { uint from[]; };

float coarse_z(ivec2 size, int x, int y)
{
    bool inside = x >= 0 && y >= 0 && x < size.x && y < size.y;
    float z = read_z(inside ? uint(y * size.x + x) : 0u);
    return inside ? z : pt_float(PT_KEY_EMPTY_Z);
}

void main()
{
    view_args view = args.view;
    ivec2 coarse_size = ivec2(args.coarse_width, args.coarse_height);
    bool refined = args.refined != 0u;
    uint x = view.rect[0] + gl_GlobalInvocationID.x, y = view.rect[1] + gl_GlobalInvocationID.y;
    if (x >= view.rect[2] || y >= view.rect[3])
        return;
    uint at = y * view.width + x;

    // 1. threshold: what is nearer than it covers this pixel
    precise float t = pt_float(keys[at].y);
    if (t < pt_float(PT_KEY_EMPTY_Z)) {
        uint own = from[at];
        t = t - pt_level_distance(view, read_deff(own), read_float4(own).w, t);
    }
    // 2. the parent and the three coarse cells on this pixel's side
    int px = int(x >> 1), py = int(y >> 1), sx = (x & 1u) != 0u ? 1 : -1, sy = (y & 1u) != 0u ? 1 : -1;
    float z = coarse_z(coarse_size, px, py);
    if (!(z < t))
        return;
    int covered = int(coarse_z(coarse_size, px + sx, py) < t) + int(coarse_z(coarse_size, px, py + sy) < t) +
                  int(coarse_z(coarse_size, px + sx, py + sy) < t);
    if (covered < 2)
        return;
    // 3. its key; refined: its surface's tangent plane here
    uint parent = uint(py * coarse_size.x + px);
    uint source = texelFetch(from_plane, int(parent)).x;
    if (refined) {
        view_args coarse = view;
        coarse.level++;
        vec2 ray_p = pt_ray(view, int(x), int(y)), ray_q = pt_ray(coarse, px, py);
        vec4 normal = read_float4(source);
        float limit = pt_level_distance(coarse, read_deff(source), normal.w, z);
        z = pt_plane_depth(view, normal.xyz, ray_q, z, ray_p, limit);
    }
    keys[at] = uvec2(read_key(parent).x, pt_bits(z));
    from[at] = source;
}
