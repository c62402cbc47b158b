// SPDX-License-Identifier: GPL-3.0-or-later
// What an edge is, and how much of its pixel it covers: a part of antialias and of tail.glsl. [D 3.5] With BEHIND, include it behind
// a block that has float through[].
#ifndef PT_EDGES_GLSL
#define PT_EDGES_GLSL

#include "shared/colors.h"
#include "lib/planes.glsl"

const ivec2 cross_offsets[4] = ivec2[4](ivec2(1, 0), ivec2(0, 1), ivec2(-1, 0), ivec2(0, -1));

// Neighbour i of a pixel; its own index for one outside the plane: unknown, no edge.
uint neighbour(ivec2 size, int x, int y, int i)
{
    int qx = x + cross_offsets[i].x, qy = y + cross_offsets[i].y;
    bool inside = qx >= 0 && qy >= 0 && qx < size.x && qy < size.y;
    return inside ? uint(qy * size.x + qx) : uint(y * size.x + x);
}

// Beyond this a neighbour is on another layer.
float step_limit(bool layers, uint at, uint z_bits)
{
    precise float limit = pt_float(z_bits) + read_deff(read_from(at));
    return layers ? limit : pt_float(PT_KEY_EMPTY_Z);
}

bool is_far(uint q, float z, float limit)
{
#if BEHIND
    if (z == pt_float(PT_KEY_EMPTY_Z))
        return !(through[q] < PT_SPENT);
#endif
    return z > limit || z == pt_float(PT_KEY_EMPTY_Z);
}

// count: of far neighbours.
float edge_coverage(antialias_args args, uint id, float count)
{
    precise float coverage = pt_max(0.833333313465 - count * 0.333333343267, 0.166666671634); // 5/6, 1/3, 1/6
    return id - args.mesh_base < args.mesh_count ? PT_MESH_COVERAGE : coverage;
}

#endif
