// SPDX-License-Identifier: GPL-3.0-or-later
// push: empty or occluded pixels take the key of their coarse parent, where two of the three coarse cells on their side
// are covered too (else every edge would grow by a coarse pixel). SPEC 2.2; twin of native/device_cpu/kernels/push.c
//
//   STEP 0: find the pixels, a column of a coarse tile an invocation;   STEP 1: what they take
#version 430 core
#include "lib/math.glsl"
#include "lib/planes.glsl"
#if STEP == 0
#define PT_TILE_COLUMNS 16
#include "lib/tiles.glsl"
#else
layout(local_size_x = 64) in;
#endif

layout(std430, binding = 0) readonly buffer arguments_block { push_args args; };
layout(std430, binding = 3) buffer keys_block { uvec2 keys[]; };
layout(std430, binding = 4) buffer from_block { uint from[]; };
layout(std430, binding = 7) buffer counters_block { uint taken_count; };
layout(std430, binding = 8) buffer taken_block { uint taken[]; };

#if STEP == 0

float coarse_z(ivec2 size, int x, int y)
{
    bool inside = x >= 0 && y >= 0 && x < size.x && y < size.y;
    float z = read_z(inside ? uint(y * size.x + x) : 0u);
    return inside ? z : pt_float(PT_KEY_EMPTY_Z);
}

bool is_covered(view_args view, ivec2 coarse_size, uint x, uint y)
{
    uint at = y * view.width + x;
    // 1. threshold: what is nearer than it covers this pixel
    float own_z = pt_float(keys[at].y);
    int px = int(x >> 1), py = int(y >> 1), sx = (x & 1u) != 0u ? 1 : -1, sy = (y & 1u) != 0u ? 1 : -1;
    bool some = own_z < pt_float(PT_KEY_EMPTY_Z);
    precise float least = own_z - pt_least_distance(view, args.least, own_z), parent = coarse_z(coarse_size, px, py);
    precise float t = some ? least : own_z;
    for (bool asked = some && parent < t; asked; asked = false) { // not `if`: software skips loops that nobody enters
        uint own = from[at];
        t = own_z - pt_level_distance(view, read_deff(own), read_float4(own).w, own_z);
    }
    // 2. the parent and the three coarse cells on this pixel's side
    int sides = int(coarse_z(coarse_size, px + sx, py) < t) + int(coarse_z(coarse_size, px, py + sy) < t) +
                int(coarse_z(coarse_size, px + sx, py + sy) < t);
    return parent < t && sides >= 2;
}

void main()
{
    view_args view = args.view;
    ivec2 coarse_size = ivec2(args.coarse_width, args.coarse_height);
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    uint lane = gl_LocalInvocationID.x, size = 2u * PT_TILE;
    uint index = group * PT_TILES_IN_GROUP + lane / size;
    uvec2 tile = pt_pixel(tile_list[min(index, tile_count - 1u)], tile_columns);
    uvec2 corner = 2u * (uvec2(view.rect[0] >> 1, view.rect[1] >> 1) + tile * PT_TILE);
    uint x = corner.x + lane % size, end = min(corner.y + size, view.rect[3]), found = 0u;
    if (index >= tile_count || x < view.rect[0] || x >= view.rect[2])
        end = 0u;
    for (uint y = max(corner.y, view.rect[1]); y < end; y++)
        found |= uint(is_covered(view, coarse_size, x, y)) << (y - corner.y);
    if (found == 0u)
        return;
    uint at = atomicAdd(taken_count, uint(bitCount(found)));
    for (; found != 0u; found &= found - 1u, at++)
        taken[at] = (corner.y + uint(findLSB(found))) * view.width + x;
}

#else

layout(location = 0) uniform uint entries;

// 3. The parent's key, where its surface is not dense at this level; refined: its surface's tangent plane here.
void main()
{
    view_args view = args.view;
    uint coarse_width = args.coarse_width;
    bool refined = args.refined != 0u;
    uint index = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * gl_WorkGroupSize.x +
                 gl_LocalInvocationID.x;
    if (index >= entries)
        return;
    uint at = taken[index];
    ivec2 place = ivec2(pt_pixel(at, view.width)), cell = place >> 1;
    uint parent = uint(cell.y) * coarse_width + uint(cell.x), source = texelFetch(from_plane, int(parent)).x;
    uvec2 key = read_key(parent);
    vec4 normal = read_float4(source);
    float z = pt_float(key.y);
    precise float dense = (PT_DENSE * pt_footprint(view, z)) * normal.w;
    if (read_deff(source) < dense)
        return;
    if (refined) {
        view_args coarse = view;
        coarse.level++;
        float limit = pt_level_distance(coarse, read_deff(source), normal.w, z);
        z = pt_plane_depth(view, normal.xyz, pt_ray(coarse, cell.x, cell.y), z, pt_ray(view, place.x, place.y), limit);
        key.y = pt_bits(z);
    }
    keys[at] = key;
    from[at] = source;
}

#endif
