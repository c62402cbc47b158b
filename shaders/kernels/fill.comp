// SPDX-License-Identifier: GPL-3.0-or-later
// fill: one phase of hole filling. [D 3.2, 3.3] with the rule of SPEC 2.2; twin of native/device_cpu/kernels/fill.c
//
// A step first decides from the state before it, then applies: what changes is listed, so the planes are never copied.
// Tiles whose reach did not change are skipped. Entries stay listed with the pixel's state before the phase: un-filling
// walks that list alone. The order within lists depends on scheduling; a pixel is in a list once, so it never shows.
//   STEP 0: decide, a tile a workgroup;   STEP 1: apply, an entry an invocation;   STEP 2: mark;   STEP 3: restore
#version 430 core
#include "lib/math.glsl"

#define TILE_X 32
#define TILE_Y 8

#if STEP == 0
layout(local_size_x = TILE_X, local_size_y = TILE_Y) in;
#else
layout(local_size_x = 64) in;
#endif

struct change {
    uint pixel, id, z, from;
    float threshold; // before: a neighbour nearer than this is dark
};

struct saved_pixel { // as it was before the phase
    uint pixel, id, z, from;
    float threshold;
    uint restore;
};

layout(std430, binding = 0) readonly buffer arguments_block { fill_args args; };
layout(std430, binding = 1) buffer keys_block { uvec2 keys[]; };
layout(std430, binding = 2) buffer from_block { uint from[]; };
layout(std430, binding = 3) readonly buffer normals_block { vec4 normals[]; };
layout(std430, binding = 4) readonly buffer deff_block { float deff[]; };
layout(std430, binding = 5) buffer counters_block { uint changed_count, saved_count; };
layout(std430, binding = 6) buffer changed_block { change changed[]; };
layout(std430, binding = 7) buffer saved_block { saved_pixel saved[]; };
layout(std430, binding = 8) buffer filled_block { uint filled[]; }; // a bit a pixel: filled in this phase
layout(std430, binding = 9) buffer tiles_block { uint tiles[]; };   // the step in which the tile has to be looked at

layout(location = 0) uniform uint stamp;   // of this step
layout(location = 1) uniform uint first;   // 1: the phase's first step looks at every tile
layout(location = 2) uniform uint entries; // STEP 0: room in `changed`, else the entries to walk
layout(location = 3) uniform uint tiles_x; // in a row

const uint NO_PIXEL = 0xFFFFFFFFu;
// The ring, anticlockwise from east.
const ivec2 ring[8] = ivec2[8](ivec2(1, 0), ivec2(1, 1), ivec2(0, 1), ivec2(-1, 1), ivec2(-1, 0), ivec2(-1, -1),
                               ivec2(0, -1), ivec2(1, -1));

// Which of the ring are white: not nearer than the threshold. Outside the plane: nothing, hence white.
uint white_ring(int width, int height, int x, int y, float threshold)
{
    uint white = 0u;
    for (int d = 0; d < 8; d++) {
        int nx = x + ring[d].x, ny = y + ring[d].y;
        float z = pt_float(PT_KEY_EMPTY_Z);
        if (nx >= 0 && ny >= 0 && nx < width && ny < height)
            z = pt_float(keys[uint(ny * width + nx)].y);
        white |= uint(!(z < threshold)) << d;
    }
    return white;
}

#if STEP == 0

float own_distance(view_args view, uint source, float z)
{
    float inverse = view.level != 0u ? normals[source].w : 1.0;
    return pt_level_distance(view, deff[source], inverse, z);
}

void main()
{
    view_args view = args.view;
    bool occluded = args.occluded != 0u, refined = args.refined != 0u;
    if (first == 0u && tiles[gl_WorkGroupID.y * tiles_x + gl_WorkGroupID.x] != stamp)
        return;
    uint ux = view.rect[0] + gl_GlobalInvocationID.x, uy = view.rect[1] + gl_GlobalInvocationID.y;
    if (ux >= view.rect[2] || uy >= view.rect[3])
        return;
    int x = int(ux), y = int(uy), width = int(view.width), height = int(view.height);
    uint pixel = uy * view.width + ux;

    // 1. z
    uint z_bits = keys[pixel].y;
    if ((z_bits == PT_KEY_EMPTY_Z) == occluded)
        return;
    // 2. threshold
    precise float threshold = pt_float(z_bits);
    if (occluded)
        threshold = threshold - own_distance(view, from[pixel], threshold);
    // 3. five consecutive white ring neighbours: a true border
    if (pt_five_white(white_ring(width, height, x, y, threshold)))
        return;
    // 4. the least key among the neighbours; refined: its surface's tangent plane at this pixel
    uvec2 key = uvec2(0xFFFFFFFFu);
    ivec2 best = ivec2(x, y);
    for (int d = 0; d < 8; d++) {
        int nx = x + ring[d].x, ny = y + ring[d].y;
        if (nx < 0 || ny < 0 || nx >= width || ny >= height)
            continue;
        uvec2 other = keys[uint(ny * width + nx)];
        if (pt_key_less(other, key)) {
            key = other;
            best = ivec2(nx, ny);
        }
    }
    uint source = from[uint(best.y * width + best.x)];
    if (refined) {
        float z = pt_float(key.y);
        z = pt_plane_depth(view, normals[source].xyz, pt_ray(view, best.x, best.y), z, pt_ray(view, x, y),
                           own_distance(view, source, z));
        key.y = pt_bits(z);
    }
    uint at = atomicAdd(changed_count, 1u);
    if (at < entries) // else the list is made larger and the step repeated: nothing has changed yet
        changed[at] = change(pixel, key.x, key.y, source, threshold);
}

#else

uint entry_index()
{
    return (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
}

#if STEP == 1

// The tiles that a change at this pixel concerns look again in the next step.
void wake_tiles(uvec4 rect, uint x, uint y)
{
    uvec2 low = uvec2(max(x, rect.x + 1u) - 1u - rect.x, max(y, rect.y + 1u) - 1u - rect.y) / uvec2(TILE_X, TILE_Y);
    uvec2 high = uvec2(min(x + 1u, rect.z - 1u) - rect.x, min(y + 1u, rect.w - 1u) - rect.y) / uvec2(TILE_X, TILE_Y);
    for (uint ty = low.y; ty <= high.y; ty++)
        for (uint tx = low.x; tx <= high.x; tx++)
            tiles[ty * tiles_x + tx] = stamp;
}

void main()
{
    uvec4 rect = uvec4(args.view.rect[0], args.view.rect[1], args.view.rect[2], args.view.rect[3]);
    uint width = args.view.width, index = entry_index();
    bool unfills = args.unfills != 0u;
    if (index >= entries)
        return;
    change c = changed[index];
    uvec2 old_key = keys[c.pixel];
    uint old_from = from[c.pixel];
    keys[c.pixel] = uvec2(c.id, c.z);
    from[c.pixel] = c.from;
    wake_tiles(rect, c.pixel % width, c.pixel / width);
    if (!unfills)
        return;
    uint bit = 1u << (c.pixel & 31u);
    if ((atomicOr(filled[c.pixel >> 5], bit) & bit) == 0u) // else an earlier entry knows the state before the phase
        saved[atomicAdd(saved_count, 1u)] = saved_pixel(c.pixel, old_key.x, old_key.y, old_from, c.threshold, 0u);
}

#elif STEP == 2

// 5. Un-filling: an entry whose pixel shows four consecutive white cells is marked ...
void main()
{
    int width = int(args.view.width), height = int(args.view.height);
    uint index = entry_index();
    if (index >= entries || saved[index].pixel == NO_PIXEL)
        return;
    int pixel = int(saved[index].pixel);
    uint white = white_ring(width, height, pixel % width, pixel / width, saved[index].threshold);
    saved[index].restore = uint(pt_four_white(white));
}

#else

// ... and gets back what it was before the phase.
void main()
{
    uint index = entry_index();
    if (index >= entries || saved[index].pixel == NO_PIXEL || saved[index].restore == 0u)
        return;
    saved_pixel s = saved[index];
    keys[s.pixel] = uvec2(s.id, s.z);
    from[s.pixel] = s.from;
    saved[index].pixel = NO_PIXEL;
    atomicAdd(changed_count, 1u);
}

#endif
#endif
