// SPDX-License-Identifier: GPL-3.0-or-later
// raster: triangles -> least key a pixel; twin of native/device_cpu/kernels/raster.c
//
// An invocation takes a triangle. Those larger than SMALL pixels are drawn by the whole workgroup afterwards, and by every
// gl_NumWorkGroups.y-th workgroup a part. Keys are made in two passes as in scatter: PASS 0: least z; PASS 1: least id.
#version 430 core

#include "shared/meshes.h"

#define GROUP 64u
#define SMALL 64

layout(local_size_x = 64) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { raster_args args; };
layout(std430, binding = BIND_keys) buffer keys_block { uint keys[]; }; // two words a pixel: id, z bits
layout(std430, binding = BIND_vertices) readonly buffer vertices_block { float vertices[]; };
layout(std430, binding = BIND_indices) readonly buffer indices_block { uint indices[]; };
layout(std430, binding = BIND_texels) readonly buffer texels_block { uint texels[]; };
layout(std430, binding = BIND_limit) readonly buffer limit_block { float limit[]; };

#include "lib/texture.glsl"

layout(location = 0) uniform uint first_triangle; // of this dispatch

shared uint large_count;
shared uint large[GROUP];

// On the inner side of an edge, or on it and it belongs to the triangle.
bool inner(ivec2 a, ivec2 b, ivec2 s)
{
    ivec2 d = b - a;
    uint high, low;
    int side = compare_products(d, s - a, high, low);
    return side > 0 || (side == 0 && (d.y < 0 || (d.y == 0 && d.x < 0)));
}

void draw_pixel(facet f, int x, int y, uint id)
{
    const int half_unit = 1 << (PT_MESH_BITS - 1);
    ivec2 s = ivec2(x, y) * (1 << PT_MESH_BITS) + half_unit;
    if (!inner(f.at[0], f.at[1], s) || !inner(f.at[1], f.at[2], s) || !inner(f.at[2], f.at[0], s))
        return;
    precise float up = f.b * (float(s.y) - f.below);
    precise float value = f.first + (f.a * (float(s.x) - f.left) + up);
    value = pt_min(pt_max(value, f.first), f.greatest);
    float z = args.view.perspective != 0u ? pt_rcp(value) : value;
    uint pixel = uint(y - args.view.origin_y) * args.view.width + uint(x - args.view.origin_x);
    if (!(args.view.z_near <= z && z <= args.view.z_far) || (args.behind != 0u && !(limit[pixel] < z)))
        return;
    if (args.mesh.texture.cut > 0.0) {
        triangle t = find_triangle(id - args.mesh.id_base, uint(x - args.view.origin_x), uint(y - args.view.origin_y));
        if (!(args.mesh.texture.cut <= image_at(place_on_image(t)).w))
            return;
    }
    uint z_bits = pt_bits(z) & 0x7FFFFFFFu;
#if PASS == 0
    if (z_bits < keys[2u * pixel + 1u] && z_bits < atomicMin(keys[2u * pixel + 1u], z_bits))
        keys[2u * pixel] = PT_KEY_EMPTY_ID; // that of a mesh before, farther off: all who come here write this
#else
    if (keys[2u * pixel + 1u] == z_bits)
        atomicMin(keys[2u * pixel], id);
#endif
}

// Draws every stride-th pixel, from `lane` on, of the facets of a triangle that are large, or of those that are not. Returns
// whether any is large.
bool draw_triangle(uint index, bool wants_large, uint lane, uint stride)
{
    const int half_unit = 1 << (PT_MESH_BITS - 1);
    ivec2 corner = ivec2(args.view.origin_x, args.view.origin_y), size = ivec2(args.view.width, args.view.height);
    bool some_large = false;
    outline o;
    facet f;
    outline_of(index, o);
    for (uint k = 1u; k + 1u < o.count; k++) {
        if (!facet_of(o, k, f))
            continue;
        ivec2 low = min(f.at[0], min(f.at[1], f.at[2])), high = max(f.at[0], max(f.at[1], f.at[2]));
        ivec2 begin = max(-((half_unit - low) >> PT_MESH_BITS), corner); // the centres between them
        ivec2 end = min(((high - half_unit) >> PT_MESH_BITS) + 1, corner + size), extent = end - begin;
        if (extent.x <= 0 || extent.y <= 0)
            continue;
        bool is_large = extent.x > SMALL || extent.x * extent.y > SMALL;
        some_large = some_large || is_large;
        if (is_large != wants_large)
            continue;
        for (uint i = lane; i < uint(extent.x * extent.y); i += stride) {
            uvec2 at = pt_pixel(i, uint(extent.x));
            draw_pixel(f, begin.x + int(at.x), begin.y + int(at.y), args.mesh.id_base + index);
        }
    }
    return some_large;
}

void main()
{
    uint index = first_triangle + gl_WorkGroupID.x * GROUP + gl_LocalInvocationID.x;
    if (gl_LocalInvocationID.x == 0u)
        large_count = 0u;
    barrier();
    if (index < args.mesh.id_count && draw_triangle(index, false, gl_WorkGroupID.y, gl_NumWorkGroups.y))
        large[atomicAdd(large_count, 1u)] = index;
    barrier();
    for (uint i = 0u; i < large_count; i++)
        draw_triangle(large[i], true, gl_WorkGroupID.y * GROUP + gl_LocalInvocationID.x, gl_NumWorkGroups.y * GROUP);
}
