// SPDX-License-Identifier: GPL-3.0-or-later
// fill on a GPU: several steps of a phase in one dispatch, to the bits of kernels/fill.comp. A workgroup holds a square of SIDE pixels
// in shared memory, takes the steps there and writes what lies `guard` pixels inside: steps depend on neighbors, so what is wrong
// moves inwards from the border by a pixel a step (by two where strays close nothing). native/device_gl/fill_tiles.c counts the pixels.
//   PHASE: PT_FILL_BACKGROUND or PT_FILL_OCCLUDED; SIDE: of the square
// A pixel is an entry of the phase where it differs from what was kept before the phase: each fill takes a lesser key.
#version 430 core
#include "shared/filling.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"

#define THREADS 1024u
#define CELLS (SIDE * SIDE)
#define EACH ((CELLS + THREADS - 1u) / THREADS)

layout(local_size_x = 1024) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { fill_args args; };
layout(std430, binding = BIND_keys) writeonly buffer keys_block { uvec2 keys[]; }; // after these steps, in the rectangle
layout(std430, binding = BIND_from) writeonly buffer from_block { uint from[]; };
layout(std430, binding = BIND_kept_keys) readonly buffer kept_keys_block { uvec2 kept_keys[]; }; // before the phase, in the rectangle
layout(std430, binding = BIND_kept_from) readonly buffer kept_from_block { uint kept_from[]; };
layout(std430, binding = BIND_whole_keys) readonly buffer whole_keys_block { uvec2 whole_keys[]; }; // outside the rectangle
layout(std430, binding = BIND_whole_from) readonly buffer whole_from_block { uint whole_from[]; };

layout(location = 0) uniform uvec4 steps; // fills, un-fills, guard

shared uvec2 square_keys[CELLS];
shared uint square_from[CELLS];
#if PHASE == PT_FILL_BACKGROUND
shared uint strays[(CELLS + 31u) / 32u]; // pixels that stood alone before the phase, where their surface is dense
#endif
shared uint changed[2]; // whether a step changed something: odd ones, even ones
shared uint shows[2];   // whether some pixel is empty, or is not

ivec2 corner; // of the square; may lie outside the plane

const uvec2 EMPTY = uvec2(PT_KEY_EMPTY_ID, PT_KEY_EMPTY_Z);

bool in_rect(ivec2 place)
{
    uvec2 p = uvec2(place), low = uvec2(args.view.rect[0], args.view.rect[1]);
    return p.x - low.x < args.view.rect[2] - low.x && p.y - low.y < args.view.rect[3] - low.y;
}

bool in_plane(ivec2 place) { return uint(place.x) < args.view.width && uint(place.y) < args.view.height; }

// ---- the state, for lib/closing.glsl --------------------------------------------------------------------------------------------------

// Outside the square it is not known: what is beside it counts as wrong.
bool cell_at(ivec2 place, out uint cell)
{
    uvec2 p = uvec2(place - corner);
    cell = min(p.y * SIDE + p.x, CELLS - 1u);
    return p.x < SIDE && p.y < SIDE;
}

float z_at(ivec2 size, int x, int y)
{
    uint cell;
    bool known = cell_at(ivec2(x, y), cell);
    return known ? pt_float(square_keys[cell].y) : pt_float(PT_KEY_EMPTY_Z);
}

uvec2 key_at(ivec2 size, ivec2 place)
{
    uint cell;
    bool known = cell_at(place, cell);
    return known ? square_keys[cell] : EMPTY;
}

uint from_at(ivec2 size, ivec2 place)
{
    uint cell;
    cell_at(place, cell);
    return square_from[cell];
}

// What the cell showed before this dispatch, for it may be far off. In the background's phase cells that are measured stay as they
// are; in the other a dispatch takes one fill.
float farthest_of(uint cell, uint source, float z_q)
{
    bool inside = in_rect(ivec2(pt_pixel(cell, args.view.width)));
    float z = inside ? read_z(cell) : pt_float(whole_keys[cell].y);
    return pt_farthest(z, inside ? texelFetch(from_plane, int(cell)).x : whole_from[cell], source, z_q);
}

#include "lib/closing.glsl"

float own_distance(view_args view, uint source, float z)
{
    return view.level == 0u ? read_deff(source) : pt_level_distance(view, read_deff(source), read_float4(source).w, z);
}

// ---- loading -------------------------------------------------------------------------------------------------------------------------

uint cell_of(uint k) { return gl_LocalInvocationIndex + k * THREADS; }

ivec2 place_of(uint cell)
{
    uint row = cell / SIDE;
    return corner + ivec2(cell - row * SIDE, row);
}

uint pixel_of(ivec2 place) { return uint(place.y) * args.view.width + uint(place.x); }

void load_square()
{
    uint some = 0u;
    if (gl_LocalInvocationIndex < 2u) {
        changed[gl_LocalInvocationIndex] = 0u;
        shows[gl_LocalInvocationIndex] = 0u;
    }
    barrier();
    for (uint k = 0u; k < EACH; k++) {
        uint cell = cell_of(k);
        ivec2 place = place_of(cell);
        if (cell >= CELLS)
            break;
        uvec2 key = EMPTY;
        uint source = 0u;
        if (in_plane(place)) {
            uint pixel = pixel_of(place);
            bool inside = in_rect(place);
            key = inside ? read_key(pixel) : whole_keys[pixel];
            source = inside ? texelFetch(from_plane, int(pixel)).x : whole_from[pixel];
        }
        square_keys[cell] = key;
        square_from[cell] = source;
        some |= key.y == PT_KEY_EMPTY_Z ? 1u : 2u;
    }
    if ((some & 1u) != 0u)
        shows[0] = 1u;
    if ((some & 2u) != 0u)
        shows[1] = 1u;
    barrier();
}

// ---- strays --------------------------------------------------------------------------------------------------------------------------

#if PHASE == PT_FILL_BACKGROUND

bool was_covered(ivec2 place)
{
    return in_plane(place) && pt_float((in_rect(place) ? kept_keys[pixel_of(place)].y : whole_keys[pixel_of(place)].y)) <
                                  pt_float(PT_KEY_EMPTY_Z);
}

// Whether a pixel stood alone before the phase where its surface is dense.
bool was_stray(ivec2 place)
{
    bool alone = in_rect(place) && was_covered(place);
    for (int d = 0; d < 8 && alone; d++)
        alone = !was_covered(place + ring[d]);
    if (!alone)
        return false;
    uint pixel = pixel_of(place), source = kept_from[pixel] & ~PT_FROM_MIXED;
    precise float dense = (PT_DENSE * pt_footprint(args.view, pt_float(kept_keys[pixel].y))) * read_float4(source).w;
    return read_span(source) < dense;
}

void find_strays()
{
    for (uint i = gl_LocalInvocationIndex; i < (CELLS + 31u) / 32u; i += THREADS)
        strays[i] = 0u;
    barrier();
    for (uint k = 0u; k < EACH; k++) {
        uint cell = cell_of(k);
        if (cell < CELLS && square_keys[cell].y != PT_KEY_EMPTY_Z && was_stray(place_of(cell)))
            atomicOr(strays[cell >> 5], 1u << (cell & 31u));
    }
    barrier();
}

// now: it stands alone still. Fills cover nothing that later fills or un-fills do not.
bool is_stray(ivec2 place, bool now)
{
    ivec2 size = ivec2(args.view.width, args.view.height);
    uint cell;
    bool stray = cell_at(place, cell);
    stray = stray && (strays[cell >> 5] >> (cell & 31u) & 1u) != 0u;
    for (int d = 0; d < 8 && stray && now; d++)
        stray = !(z_at(size, place.x + ring[d].x, place.y + ring[d].y) < pt_float(PT_KEY_EMPTY_Z));
    return stray;
}

uint with_strays(ivec2 place, uint white, bool now)
{
    for (int d = 0; d < 8; d++)
        if ((white >> d & 1u) == 0u && is_stray(place + ring[d], now))
            white |= 1u << d;
    return white;
}

#endif

// ---- steps ---------------------------------------------------------------------------------------------------------------------------

// Whether all neighbors lie in the square. Other pixels stay as they are: what is beside them is not known.
bool is_inner(uint cell)
{
    ivec2 p = place_of(cell) - corner;
    return min(p.x, p.y) > 0 && max(p.x, p.y) < int(SIDE) - 1;
}

// Of an inner cell.
uint white_of(uint cell, float threshold)
{
    uint white = 0u;
    for (int d = 0; d < 8; d++)
        white |= uint(!(pt_float(square_keys[int(cell) + ring[d].y * int(SIDE) + ring[d].x].y) < threshold)) << d;
    return white;
}

// Whether a pixel is filled, from the state before the step. threshold: what is nearer covers it.
bool is_open(uint cell, ivec2 place, uvec2 key, uint source, out float threshold)
{
    bool some = key.y != PT_KEY_EMPTY_Z;
    threshold = pt_float(key.y);
#if PHASE == PT_FILL_OCCLUDED
    if (!some)
        return false;
    precise float t = threshold - own_distance(args.view, source & ~PT_FROM_MIXED, threshold);
    threshold = t;
#else
    if (some)
        return false;
#endif
    uint white = white_of(cell, threshold);
    if (pt_five_white(white))
        return false;
#if PHASE == PT_FILL_BACKGROUND
    if (args.alone != 0u)
        return !pt_five_white(with_strays(place, white, true));
#endif
    return true;
}

// Whether something changed. turn: which of `changed` it uses; the other one is cleared for the next step.
bool end_step(uint turn)
{
    bool some = changed[turn] != 0u;
    if (gl_LocalInvocationIndex == 0u)
        changed[turn ^ 1u] = 0u;
    barrier();
    return some;
}

bool fill_step(uint turn)
{
    uvec2 new_keys[EACH];
    uint new_from[EACH], taken = 0u;
    for (uint k = 0u; k < EACH; k++) {
        uint cell = cell_of(k);
        ivec2 place = place_of(cell);
        if (cell >= CELLS || !is_inner(cell) || !in_rect(place))
            continue;
        float threshold;
        if (is_open(cell, place, square_keys[cell], square_from[cell], threshold) &&
            close_pixel(args.view, place, threshold, new_keys[k], new_from[k]))
            taken |= 1u << k;
    }
    if (taken != 0u)
        changed[turn] = 1u;
    barrier();
    for (uint k = 0u; k < EACH; k++)
        if ((taken >> k & 1u) != 0u) {
            square_keys[cell_of(k)] = new_keys[k];
            square_from[cell_of(k)] = new_from[k];
        }
    return end_step(turn);
}

// Which of this invocation's pixels are entries, and below what their neighbors were dark.
uint find_entries(out float thresholds[EACH])
{
    uint entries = 0u;
    for (uint k = 0u; k < EACH; k++) {
        uint cell = cell_of(k);
        ivec2 place = place_of(cell);
        thresholds[k] = pt_float(PT_KEY_EMPTY_Z);
        if (cell >= CELLS || !is_inner(cell) || !in_rect(place) || square_keys[cell].y == PT_KEY_EMPTY_Z)
            continue;
        uint pixel = pixel_of(place);
        uvec2 key = kept_keys[pixel];
        bool differs = key != square_keys[cell] || kept_from[pixel] != square_from[cell];
        entries |= uint(differs) << k;
#if PHASE == PT_FILL_OCCLUDED
        if (differs) {
            float z = pt_float(key.y);
            precise float t = z - own_distance(args.view, kept_from[pixel] & ~PT_FROM_MIXED, z);
            thresholds[k] = t;
        }
#endif
    }
    return entries;
}

bool unfill_step(uint turn, inout uint entries, float thresholds[EACH])
{
    uint marked = 0u;
    for (uint k = 0u; k < EACH; k++) {
        if ((entries >> k & 1u) == 0u)
            continue;
        uint cell = cell_of(k);
        uint white = white_of(cell, thresholds[k]);
        bool shown = pt_four_white(white);
#if PHASE == PT_FILL_BACKGROUND
        if (!shown && args.alone != 0u)
            shown = pt_four_white(with_strays(place_of(cell), white, false));
#endif
        marked |= uint(shown) << k;
    }
    if (marked != 0u)
        changed[turn] = 1u;
    barrier();
    for (uint k = 0u; k < EACH; k++)
        if ((marked >> k & 1u) != 0u) {
            uint cell = cell_of(k), pixel = pixel_of(place_of(cell));
            square_keys[cell] = kept_keys[pixel];
            square_from[cell] = kept_from[pixel];
        }
    entries &= ~marked;
    return end_step(turn);
}

void write_square()
{
    uint guard = steps.z;
    for (uint k = 0u; k < EACH; k++) {
        uint cell = cell_of(k);
        ivec2 place = place_of(cell);
        uvec2 in_square = uvec2(place - corner) - guard;
        if (cell < CELLS && in_square.x < SIDE - 2u * guard && in_square.y < SIDE - 2u * guard && in_rect(place)) {
            uint pixel = pixel_of(place);
            keys[pixel] = square_keys[cell];
            from[pixel] = square_from[cell];
        }
    }
}

void main()
{
    uint turn = 0u, inner = SIDE - 2u * steps.z;
    corner = ivec2(args.view.rect[0], args.view.rect[1]) + ivec2(gl_WorkGroupID.xy * inner) - int(steps.z);
    load_square();
#if PHASE == PT_FILL_BACKGROUND
    bool some = shows[0] != 0u && shows[1] != 0u;
    if (some && args.alone != 0u)
        find_strays();
#else
    bool some = shows[1] != 0u;
#endif
    for (uint i = 0u; i < steps.x && some; i++, turn ^= 1u)
        if (!fill_step(turn)) {
            turn ^= 1u;
            break;
        }
    if (some && steps.y != 0u) {
        float thresholds[EACH];
        uint entries = find_entries(thresholds);
        for (uint i = 0u; i < steps.y; i++, turn ^= 1u)
            if (!unfill_step(turn, entries, thresholds))
                break;
    }
    write_square();
}
