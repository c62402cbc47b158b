// SPDX-License-Identifier: GPL-3.0-or-later
// fill: hole filling, one phase a run of these steps. [D 3.2, 3.3] with the rule of SPEC 2.2; twin of
// native/device_cpu/kernels/fill.c
//
// A step first decides from the state before it, then applies: what changes is listed, so the planes are never copied,
// and only tiles within reach of a change are looked at again. Entries stay listed with the pixel's state before the
// phase: un-filling walks that list alone. The order within lists depends on scheduling; a pixel is in a list once, so
// it never shows.
//   STEP 0: find the pixels to fill, empty or OCCLUDED ones (2: above level 0);   STEP 1: what they become;
//   STEP 2: apply;   STEP 3: the tiles for the next step;
//   STEP 4: mark;   STEP 5: restore;   STEP 6: the entries for the next step;
//   STEP 7: how many workgroups walk what a step has listed
// That is software's way. On a GPU lib/fill_tiles.glsl takes many steps a dispatch.
#version 430 core
#include "shared/filling.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"
#if STEP == 0
#include "lib/tiles.glsl"
#elif STEP == 7
layout(local_size_x = 1) in;
#else
layout(local_size_x = 64) in;
#endif

#define EACH 4u // entries an invocation applies

struct change {
    uint pixel, id, z, from;
};

struct saved_pixel { // as it was before the phase
    uint pixel, id, z, from;
};

struct walk { // as an indirect dispatch takes it, and how many there are
    uint x, y, z, count;
};

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { fill_args args; };
layout(std430, binding = BIND_keys) writeonly buffer keys_block { uvec2 keys[]; };
layout(std430, binding = BIND_from) writeonly buffer from_block { uint from[]; };
layout(std430, binding = BIND_walks) coherent buffer walks_block {
    walk changes, applies, saves, tiles, looks;
};
layout(std430, binding = BIND_changed) buffer changed_block { change changed[]; };
layout(std430, binding = BIND_saved) buffer saved_block { saved_pixel saved[]; };
layout(std430, binding = BIND_filled) buffer filled_block { uint filled[]; }; // a bit a pixel: filled in this phase
layout(std430, binding = BIND_stamps) buffer stamps_block { uint stamps[]; }; // a word a tile: the step it was listed for last
layout(std430, binding = BIND_woken) coherent buffer woken_block { walk wakes; uint woken[]; }; // tiles for the next step

layout(location = 0) uniform uint listed;  // STEP 7: by which step
layout(location = 1) uniform uint stamp;   // of this step
layout(location = 2) uniform uint columns; // tiles in a row
layout(location = 3) uniform uint most;    // STEP 3, 7: tiles
layout(location = 4) uniform uint all;     // STEP 4: 1: look at all
layout(location = 5) uniform uint phase;   // STEP 1, 2, 4: PT_FILL_*

// Outside the plane: nothing.
float z_at(ivec2 size, int x, int y)
{
    bool inside = x >= 0 && y >= 0 && x < size.x && y < size.y;
    float z = read_z(inside ? uint(y * size.x + x) : 0u);
    return inside ? z : pt_float(PT_KEY_EMPTY_Z);
}

uvec2 key_at(ivec2 size, ivec2 place) { return read_key(uint(place.y * size.x + place.x)); }
uint from_at(ivec2 size, ivec2 place) { return texelFetch(from_plane, place.y * size.x + place.x).x; }

float farthest_of(uint cell, uint source, float z_q)
{
    return pt_farthest(read_z(cell), texelFetch(from_plane, int(cell)).x, source, z_q);
}

#include "lib/closing.glsl"

float own_distance(view_args view, uint source, float z)
{
#if STEP == 0 && OCCLUDED == 1
    return read_deff(source);
#else
    return pt_level_distance(view, read_deff(source), read_float4(source).w, z);
#endif
}

#if (STEP == 0 && OCCLUDED == 0) || STEP == 4

// Now; to un-fill, before the phase.
bool is_covered(ivec2 size, ivec2 place)
{
    bool covered = z_at(size, place.x, place.y) < pt_float(PT_KEY_EMPTY_Z);
#if STEP == 4
    uint pixel = covered ? uint(place.y * size.x + place.x) : 0u;
    covered = covered && (filled[pixel >> 5] >> (pixel & 31u) & 1u) == 0u;
#endif
    return covered;
}

// Whether a pixel stands alone where its surface is dense: a stray.
bool is_stray(view_args view, ivec2 place)
{
    ivec2 size = ivec2(view.width, view.height);
    bool alone = place.x >= int(view.rect[0]) && place.y >= int(view.rect[1]) && place.x < int(view.rect[2]) &&
                 place.y < int(view.rect[3]) && is_covered(size, place);
    for (int d = 0; d < 8 && alone; d++)
        alone = !is_covered(size, place + ring[d]);
    uint pixel = alone ? uint(place.y * size.x + place.x) : 0u, source = alone ? read_from(pixel) : 0u;
    precise float dense = (PT_DENSE * pt_footprint(view, read_z(pixel))) * read_float4(source).w;
    return alone && read_span(source) < dense;
}

#endif

#if STEP == 0

#if OCCLUDED == 0

// 4. Strays are white too.
uint with_strays(view_args view, ivec2 place, uint white)
{
    for (int d = 0; d < 8; d++)
        if ((white >> d & 1u) == 0u && is_stray(view, place + ring[d].x * ivec2(PT_ACROSS) + ring[d].y * ivec2(PT_STEP)))
            white |= 1u << d;
    return white;
}

#endif

vec3 z_across(ivec2 size, ivec2 p)
{
    ivec2 low = p - ivec2(PT_ACROSS), high = p + ivec2(PT_ACROSS);
    return vec3(z_at(size, low.x, low.y), z_at(size, p.x, p.y), z_at(size, high.x, high.y));
}

// 2. Threshold of a pixel, and whether it is a candidate at all.
bool candidate(view_args view, uint pixel, float z, out float threshold)
{
    float empty = pt_float(PT_KEY_EMPTY_Z);
    threshold = empty;
#if OCCLUDED
    bool some = z < empty;
    precise float t = z - own_distance(view, some ? read_from(pixel) : 0u, z);
    threshold = t;
    return some;
#else
    return !(z < empty);
#endif
}

void walk_list()
{
    view_args view = args.view;
    ivec2 size = ivec2(view.width, view.height);
    uvec2 first = pt_tile_line(view);
    uint steps = pt_tile_steps(view, first), fills = 0u, i = 0u;
    if (steps == 0u)
        return;
    // 1. z of three rows across the line, sliding along it
    ivec2 here = ivec2(first);
    vec3 behind = z_across(size, here - ivec2(PT_STEP)), row = z_across(size, here);
    do {
        vec3 ahead = z_across(size, here + ivec2(PT_STEP));
        float t;
        bool fill = candidate(view, uint(here.y * size.x + here.x), row.y, t);
        // 3. white: not nearer than the threshold; five consecutive ones: a true border
        uint white = uint(!(row.z < t)) | uint(!(ahead.z < t)) << 1 | uint(!(ahead.y < t)) << 2 |
                     uint(!(ahead.x < t)) << 3 | uint(!(row.x < t)) << 4 | uint(!(behind.x < t)) << 5 |
                     uint(!(behind.y < t)) << 6 | uint(!(behind.z < t)) << 7;
        fill = fill && !pt_five_white(white);
#if OCCLUDED == 0
        if (fill && args.alone != 0u)
            fill = !pt_five_white(with_strays(view, here, white));
#endif
        fills |= uint(fill) << i;
        behind = row;
        row = ahead;
        here += ivec2(PT_STEP);
    } while (++i < steps);
    if (fills == 0u)
        return;
    uint at = atomicAdd(changes.count, uint(bitCount(fills)));
    for (; fills != 0u; fills &= fills - 1u, at++) {
        uvec2 found = first + uint(findLSB(fills)) * PT_STEP;
        changed[at].pixel = found.y * view.width + found.x;
    }
}

#elif STEP != 7

uint entry_index()
{
    return (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
}

#if STEP == 2 || STEP == 5

// The tiles that a change at this pixel concerns: pixels beside it, and those beside what stood alone.
void wake_tiles(uvec4 rect, uvec2 place)
{
    uvec2 low = (max(place, rect.xy + 2u) - 2u - rect.xy) / 8u, high = (min(place + 2u, rect.zw - 1u) - rect.xy) / 8u;
    stamps[low.y * columns + low.x] = stamp;
    stamps[low.y * columns + high.x] = stamp;
    stamps[high.y * columns + low.x] = stamp;
    stamps[high.y * columns + high.x] = stamp;
}

#endif

const uint NO_PIXEL = 0xFFFFFFFFu;

#if STEP == 1

// 5. The least key among the neighbours; refined: its surface's tangent plane at this pixel.
void walk_list()
{
    view_args view = args.view;
    bool occluded = phase == PT_FILL_OCCLUDED, unfills = args.unfills != 0u;
    uint index = entry_index();
    if (index >= changes.count)
        return;
    uint pixel = changed[index].pixel, source;
    uvec2 key, old_key = read_key(pixel);
    uint old_from = texelFetch(from_plane, int(pixel)).x;
    precise float threshold = pt_float(old_key.y);
    if (occluded && (unfills || args.reach > 0.0))
        threshold = threshold - own_distance(view, old_from & ~PT_FROM_MIXED, threshold);
    bool taken = close_pixel(view, ivec2(pt_pixel(pixel, view.width)), threshold, key, source);
    changed[index] = change(taken ? pixel : NO_PIXEL, key.x, key.y, source);
}

#elif STEP == 2

void walk_list()
{
    uvec4 rect = uvec4(args.view.rect[0], args.view.rect[1], args.view.rect[2], args.view.rect[3]);
    uint width = args.view.width, group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    bool unfills = args.unfills != 0u, occluded = phase == PT_FILL_OCCLUDED;
    // a pixel can be filled twice in the phase; and what was there before says what is a stray
    bool refills = args.unfills != 0u && (phase == PT_FILL_OCCLUDED || args.alone != 0u);
    uint count = changes.count, first = group * EACH * gl_WorkGroupSize.x + gl_LocalInvocationID.x, saves_here = 0u;
    for (uint k = 0u; k < EACH && unfills; k++) {
        uint index = first + k * gl_WorkGroupSize.x, pixel = index < count ? changed[index].pixel : NO_PIXEL;
        // An entry filled before in this phase is saved already.
        bool saves_it = pixel != NO_PIXEL && !(occluded && (filled[pixel >> 5] >> (pixel & 31u) & 1u) != 0u);
        saves_here |= uint(saves_it) << k;
    }
    uint at = saves_here != 0u ? atomicAdd(saves.count, uint(bitCount(saves_here))) : 0u; // software takes them one by one
    for (uint k = 0u; k < EACH; k++) {
        uint index = first + k * gl_WorkGroupSize.x;
        if (index >= count)
            return;
        change c = changed[index];
        if (c.pixel == NO_PIXEL)
            continue;
        if ((saves_here >> k & 1u) != 0u) {
            uvec2 old = read_key(c.pixel); // nobody else writes it
            saved[at++] = saved_pixel(c.pixel, old.x, old.y, texelFetch(from_plane, int(c.pixel)).x);
        }
        keys[c.pixel] = uvec2(c.id, c.z);
        from[c.pixel] = c.from;
        wake_tiles(rect, pt_pixel(c.pixel, width));
        if (refills)
            atomicOr(filled[c.pixel >> 5], 1u << (c.pixel & 31u));
    }
}

#elif STEP == 3

void walk_list()
{
    uint tile = entry_index();
    if (tile < most && stamps[tile] == stamp)
        woken[atomicAdd(wakes.count, 1u)] = tile;
}

#else

// 6. Un-filling. changed[].id lists the entries to look at (all: the phase's first step), changed[].pixel those marked:
// an entry whose pixel shows four consecutive white cells ...
#if STEP == 4

void walk_list()
{
    ivec2 size = ivec2(args.view.width, args.view.height);
    uint index = entry_index();
    if (index >= (all != 0u ? saves.count : looks.count))
        return;
    uint entry = all != 0u ? index : changed[index].id;
    saved_pixel s = saved[entry];
    if (s.pixel == NO_PIXEL) // restored
        return;
    ivec2 place = ivec2(pt_pixel(s.pixel, uint(size.x)));
    precise float threshold = pt_float(s.z); // a neighbour nearer than this was dark
    if (phase == PT_FILL_OCCLUDED)
        threshold = threshold - own_distance(args.view, s.from & ~PT_FROM_MIXED, threshold);
    uint white = 0u;
    for (int d = 0; d < 8; d++)
        white |= uint(!(z_at(size, place.x + ring[d].x, place.y + ring[d].y) < threshold)) << d;
    if (args.alone != 0u && phase == PT_FILL_BACKGROUND && !pt_four_white(white))
        for (int d = 0; d < 8; d++) // strays are white
            if ((white >> d & 1u) == 0u && is_stray(args.view, place + ring[d]))
                white |= 1u << d;
    if (pt_four_white(white))
        changed[atomicAdd(changes.count, 1u)].pixel = entry;
}

// ... gets back what it was before the phase.
#elif STEP == 5

void walk_list()
{
    uvec4 rect = uvec4(args.view.rect[0], args.view.rect[1], args.view.rect[2], args.view.rect[3]);
    uint width = args.view.width, index = entry_index();
    if (index >= changes.count)
        return;
    uint entry = changed[index].pixel;
    saved_pixel s = saved[entry];
    keys[s.pixel] = uvec2(s.id, s.z);
    from[s.pixel] = s.from;
    saved[entry].pixel = NO_PIXEL;
    wake_tiles(rect, pt_pixel(s.pixel, width));
}

#else

void walk_list()
{
    uvec2 corner = uvec2(args.view.rect[0], args.view.rect[1]);
    uint width = args.view.width, index = entry_index();
    if (index >= saves.count || saved[index].pixel == NO_PIXEL)
        return;
    uvec2 tile = (pt_pixel(saved[index].pixel, width) - corner) / 8u;
    if (stamps[tile.y * columns + tile.x] == stamp)
        changed[atomicAdd(looks.count, 1u)].id = index;
}

#endif
#endif
#endif

// ---- how many workgroups walk what ----------------------------------------------------------------------------------------

#if STEP == 7

// How many workgroups of 64 there are for so many.
void count_groups(inout walk w, uint count)
{
    uint groups = (count + 63u) / 64u, in_row = min(groups, 16384u); // as in native/device_gl/bind.c
    w.x = in_row;
    w.y = in_row != 0u ? (groups + in_row - 1u) / in_row : 0u;
    w.z = 1u;
}

// Of what that step listed. Lists that were walked begin anew; who lists nothing leaves nothing to walk until something is listed again.
void count_lists(uint step)
{
    uint found = changes.count, woken_count = wakes.count, chosen = looks.count;
    bool finds = step == 0u || step == 4u;
    count_groups(applies, step == 0u ? (found + EACH - 1u) / EACH : 0u);
    count_groups(changes, finds ? found : 0u);
    changes.count = finds ? found : 0u;
    if (step == 0u) {
        count_groups(tiles, found != 0u ? most : 0u);
        count_groups(wakes, 0u);
        wakes.count = 0u;
    } else if (step == 3u) {
        count_groups(tiles, 0u);
        count_groups(wakes, (woken_count + 3u) / 4u * 64u); // four tiles each: lib/tiles.glsl
        count_groups(saves, saves.count);
    } else if (step == 4u) {
        count_groups(saves, found != 0u ? saves.count : 0u);
        count_groups(looks, 0u);
        looks.count = 0u;
    } else {
        count_groups(looks, chosen);
        count_groups(saves, chosen != 0u ? saves.count : 0u);
    }
}

void main() { count_lists(listed); }

#else

void main() { walk_list(); }

#endif
