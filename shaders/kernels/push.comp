// SPDX-License-Identifier: GPL-3.0-or-later
// push: empty or occluded pixels take the key of their coarse parent, where two of the three coarse cells on their side
// are covered too (else every edge would grow by a coarse pixel). SPEC 2.2; twin of native/device_cpu/kernels/push.c
//
//   STEP 0: find the pixels, a column of a coarse tile an invocation;   STEP 1: what they take. On a GPU STEP 0 does both
#version 430 core
#include "shared/filling.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"
#if STEP == 0
#define PT_TILE_COLUMNS 16
#include "lib/tiles.glsl"
#else
layout(local_size_x = 64) in;
#endif

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { push_args args; };
layout(std430, binding = BIND_keys) buffer keys_block { uvec2 keys[]; };
layout(std430, binding = BIND_from) buffer from_block { uint from[]; };
#ifdef PT_SOFTWARE
layout(std430, binding = BIND_taken) buffer taken_block { uint taken_groups[3], taken_count, taken[]; };
#define TAKES (STEP == 1)
#else
#define TAKES 1
#endif

float coarse_z(ivec2 size, int x, int y)
{
    bool inside = x >= 0 && y >= 0 && x < size.x && y < size.y;
    float z = read_z(inside ? uint(y * size.x + x) : 0u);
    return inside ? z : pt_float(PT_KEY_EMPTY_Z);
}

#if TAKES

// 3. The parent's key, where its surface is not dense at this level; refined: its surface's tangent plane here.
void take(view_args view, uint coarse_width, bool refined, uint at)
{
    ivec2 place = ivec2(pt_pixel(at, view.width)), cell = place >> 1;
    uint parent = uint(cell.y) * coarse_width + uint(cell.x), source = texelFetch(from_plane, int(parent)).x;
    uvec2 key = read_key(parent);
    vec4 normal = read_float4(source);
    float z = pt_float(key.y);
    precise float dense = (PT_DENSE * pt_footprint(view, z)) * normal.w;
    if (read_span(source) < dense)
        return;
    if (refined) {
        view_args coarse = view;
        coarse.level++;
        float limit = pt_level_distance(coarse, read_span(source), normal.w, z);
        uint measured = pt_cell_of(source, args.from_width, coarse.level, coarse_width);
        float farthest = pt_farthest(read_z(measured), texelFetch(from_plane, int(measured)).x, source, z);
        float plane = pt_plane_depth(view, normal.xyz, pt_ray(coarse, cell.x, cell.y), z, pt_ray(view, place.x, place.y), limit);
        ivec2 size = ivec2(coarse_width, args.coarse_height), side = (place & 1) * 2 - 1;
        if (farthest < plane) {
            farthest = pt_farther(farthest, coarse_z(size, cell.x + side.x, cell.y), z, plane);
            farthest = pt_farther(farthest, coarse_z(size, cell.x, cell.y + side.y), z, plane);
            farthest = pt_farther(farthest, coarse_z(size, cell.x + side.x, cell.y + side.y), z, plane);
        }
        key.y = pt_bits(pt_max(pt_min(plane, farthest), z));
    }
    keys[at] = key;
    from[at] = source;
}

#endif

#if STEP == 0

// Coarse z of a pixel's parent and of the cell beside it, on the pixel's side.
vec2 coarse_pair(ivec2 size, ivec2 cell, int side)
{
    return vec2(coarse_z(size, cell.x, cell.y), coarse_z(size, cell.x + side, cell.y));
}

// 2. The parent and two of the three coarse cells on this pixel's side are nearer than t. level: parent and the cell beside it;
// next: those below or above.
bool is_covered(vec2 level, vec2 next, float t)
{
    return level.x < t && int(level.y < t) + int(next.x < t) + int(next.y < t) >= 2;
}

// 1. threshold: what is nearer than it covers this pixel, which is not empty
float threshold(view_args view, uint at, float z)
{
    uint own = from[at];
    precise float t = z - pt_level_distance(view, read_deff(own), read_float4(own).w, z);
    return t;
}

void main()
{
    view_args view = args.view;
    ivec2 coarse_size = ivec2(args.coarse_width, args.coarse_height);
    float empty = pt_float(PT_KEY_EMPTY_Z), least_distance = args.least;
    uint lane = gl_LocalInvocationID.x, size = 2u * PT_TILE;
    uvec2 low = uvec2(view.rect[0] >> 1, view.rect[1] >> 1), high = uvec2(view.rect[2] + 1u >> 1, view.rect[3] + 1u >> 1), tile;
    bool there = pt_tile_at(uvec4(low, high), pt_tile_group() + lane / size, tile);
    uvec2 corner = 2u * (low + tile * PT_TILE);
    uint x = corner.x + lane % size, end = min(corner.y + size, view.rect[3]), found = 0u, asked = 0u;
    if (!there || x < view.rect[0] || x >= view.rect[2])
        end = 0u;
    // Empty pixels, and those that something may cover: few, so they are looked at by themselves.
    ivec2 cell = ivec2(x, corner.y) >> 1;
    int side = (x & 1u) != 0u ? 1 : -1;
    vec2 below = coarse_pair(coarse_size, cell - ivec2(0, 1), side), level = coarse_pair(coarse_size, cell, side);
    if (corner.y >= end)
        return;
    uint y = corner.y;
    do {
        vec2 above = coarse_pair(coarse_size, cell + ivec2(0, 1), side);
        for (uint upper = 0u; upper < 2u; upper++) {
            bool inside = y + upper >= view.rect[1] && y + upper < end;
            float z = inside ? pt_float(keys[(y + upper) * view.width + x].y) : 0.0;
            precise float least = z - pt_least_distance(view, least_distance, args.least_share, z);
            bool some = z < empty;
            found |= uint(!some && is_covered(level, upper == 0u ? below : above, empty)) << (y + upper - corner.y);
            asked |= uint(some && inside && level.x < least && args.background == 0u) << (y + upper - corner.y);
        }
        below = level;
        level = above;
        y += 2u;
        cell.y++;
    } while (y < end);
    for (; asked != 0u; asked &= asked - 1u) {
        uint row = uint(findLSB(asked)), y = corner.y + row, at = y * view.width + x;
        cell = ivec2(x, y) >> 1;
        float t = threshold(view, at, pt_float(keys[at].y));
        bool covered = is_covered(coarse_pair(coarse_size, cell, side),
                                  coarse_pair(coarse_size, cell + ivec2(0, (y & 1u) != 0u ? 1 : -1), side), t);
        found |= uint(covered) << row;
    }
#ifdef PT_SOFTWARE
    if (found == 0u)
        return;
    uint at = atomicAdd(taken_count, uint(bitCount(found)));
    for (; found != 0u; found &= found - 1u, at++)
        taken[at] = (corner.y + uint(findLSB(found))) * view.width + x;
#else
    for (; found != 0u; found &= found - 1u)
        take(view, args.coarse_width, args.refined != 0u, (corner.y + uint(findLSB(found))) * view.width + x);
#endif
}

#else

#define TAKEN_EACH 4u // pixels an invocation takes, as in native/device_gl/pixels.c

void main()
{
    view_args view = args.view;
    uint coarse_width = args.coarse_width;
    bool refined = args.refined != 0u;
    uint group = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * TAKEN_EACH;
    for (uint i = 0u; i < TAKEN_EACH; i++) {
        uint index = (group + i) * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
        if (index < taken_count)
            take(view, coarse_width, refined, taken[index]);
    }
}

#endif
