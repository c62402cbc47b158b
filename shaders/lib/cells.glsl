// SPDX-License-Identifier: GPL-3.0-or-later
// Points of a chunk in the cells of an image buffer, over a band of rows, as many as the sums have room for. STEP 0: points are added
// up; STEP 1: means. Of merge and differ, whose arguments are `args`; twin of native/device_cpu/kernels/cells.h
#ifndef PT_CELLS_GLSL
#define PT_CELLS_GLSL

#include "lib/ranges.glsl"
#include "lib/planes.glsl"
#include "lib/points.glsl"
#include "lib/positions.glsl"

#if STEP == 0
layout(local_size_x = 64) in;
#else
layout(local_size_x = 32, local_size_y = 8) in;
#endif

#define SUMS 8u // of a cell, two words each, the low one first

layout(std430, binding = BIND_sums) buffer sums_block { uint sums[]; };
layout(std430, binding = BIND_chunks) readonly buffer chunks_block { chunk_view chunks[]; };
layout(std430, binding = BIND_surfels) readonly buffer surfels_block { uint surfels[]; };
layout(std430, binding = BIND_drawn) readonly buffer drawn_block { uint drawn[]; };

layout(location = 0) uniform uint first_chunk; // of this dispatch
layout(location = 1) uniform uint first_slot;  // where the bound part of what points have begins
layout(location = 3) uniform int band_first;
layout(location = 4) uniform int band_end;

float gamma_of(view_args view, float z) { return pt_range_gamma(view, args.gamma, args.gamma_cells, z); }

// What depths of a cell's points are told in parts of.
float reach_of(view_args view, float gamma, float z)
{
    precise float deepest = PT_RANGE_DEEPEST * pt_footprint(view, z);
    return pt_min(gamma, pt_max(deepest, PT_RANGE_LEAST));
}

#if STEP == 0

void add(uint at, float term)
{
    int value = int(term);
    if (value == 0)
        return;
    uint before = atomicAdd(sums[at], uint(value));
    uint high = (value < 0 ? 0xFFFFFFFFu : 0u) + (before + uint(value) < before ? 1u : 0u);
    if (high != 0u)
        atomicAdd(sums[at + 1u], high);
}

struct pt_cell_point {
    uint slot, cell, at; // of the bound part; at: its cell's sums
    float x, y, z;     // cells from the picture's corner
    float nearest, gamma, behind;
};

// Whether a chunk's point lies in the band, and on the nearest surface of its cell.
bool pt_point_of(chunk_view chunk, uint i, out pt_cell_point point)
{
    view_args view = args.view;
    float left = float(view.origin_x), right = float(view.origin_x + int(view.width));
    float bottom = float(view.origin_y + band_first), top = float(view.origin_y + band_end);
    // 1. where it lies
    uint base = chunk.first - first_slot;
    vec3 p = pt_position(base, chunk.padded, chunk.step, i);
    vec3 seen = pt_project(view, chunk, p);
    float x = seen.x, y = seen.y, z = seen.z;
    if (!(view.z_near <= z && z <= view.z_far && left <= x && x < right && bottom <= y && y < top))
        return false;
    if (args.sifted != 0u && chunk.sifted != 0u &&
        (drawn[chunk.sifted - 1u + i / PT_SLOTS_A_WORD] >> i % PT_SLOTS_A_WORD & 1u) == 0u)
        return false;
    point.slot = base + i;
    if (chunk.cull != 0u && pt_faces_away(chunk, surfels[point.slot], p))
        return false;
    // 2. on the nearest surface of its cell
    point.x = x;
    point.y = y;
    point.z = pt_abs(z);
    point.cell = uint(int(floor(y)) - view.origin_y) * view.width + uint(int(floor(x)) - view.origin_x);
    point.nearest = read_z(point.cell);
    point.gamma = gamma_of(view, point.nearest);
    precise float behind = point.z - point.nearest;
    point.behind = behind;
    point.at = 2u * SUMS * (point.cell - uint(band_first) * view.width);
    return 0.0 <= behind && behind <= point.gamma;
}

#else

// A sum as a float, in steps that are the same everywhere.
float sum_of(uint at)
{
    uint low = sums[at], high = sums[at + 1u];
    bool negative = (high & 0x80000000u) != 0u;
    if (negative) {
        high = ~high + (low == 0u ? 1u : 0u);
        low = 0u - low;
    }
    precise float value = float(high) * 4294967296.0 + float(low);
    return negative ? -value : value;
}

#endif
#endif
