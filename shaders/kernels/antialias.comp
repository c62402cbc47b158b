// SPDX-License-Identifier: GPL-3.0-or-later
// antialias: Laplace on depth as steps. [D 3.5]; twin of native/device_cpu/kernels/antialias.c
//
// k of the four cross neighbours are farther than d_eff (or empty). A pixel is drawn when a point falls anywhere in it,
// so an edge pixel's true coverage is below 1: for a straight edge at 0 degrees (k = 1) it is uniform in 0..1, mean
// 1/2; at 45 degrees the outermost pixels (k = 2) cover t^2/2, mean 1/6. Both are met by coverage = 5/6 - k/3, floored
// at 1/6 so that lone pixels stay visible.
//
// Edges are few: they are listed, their new colours made, and applied when every pixel has been looked at.
//   STEP 0: find;   STEP 1: mix, an edge an invocation;   STEP 2: apply
// On a GPU STEP 0 mixes too, and leaves a bit a pixel in place of the list: a word for each invocation's line.
//   BEHIND, INKED: as in the arguments, known beforehand: software would read the through and line planes for nothing.
#version 430 core
#include "shared/colors.h"
#include "lib/math.glsl"
#include "lib/planes.glsl"
#ifdef PT_SOFTWARE
#define LISTS 1
#else
#define LISTS 0
#endif
#if STEP == 0 || !LISTS
#include "lib/tiles.glsl"
#else
layout(local_size_x = 64) in;
#endif

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { antialias_args args; };
layout(std430, binding = BIND_from) buffer from_block { uint from[]; };
layout(std430, binding = BIND_color) writeonly buffer color_block { vec4 color[]; };
layout(std430, binding = BIND_through) readonly buffer through_block { float through[]; };
layout(std430, binding = BIND_line) readonly buffer line_block { float line[]; };
layout(std430, binding = BIND_edges) buffer edges_block { uint edge_groups[3], edge_count, edges[]; };
layout(std430, binding = BIND_mixed) buffer mixed_block { vec4 mixed[]; };

#include "lib/edges.glsl"

#if STEP == 1 || (STEP == 0 && !LISTS)

// What an edge becomes.
vec4 mix_of(uint at)
{
    ivec2 size = ivec2(args.view.width, args.view.height);
    uvec2 pixel = pt_pixel(at, uint(size.x));
    float limit = step_limit(args.layers != 0u, at, read_z_bits(at));
    precise vec4 sum = vec4(0.0);
    float count = 0.0;
    for (int i = 0; i < 4; i++) {
        uint q = neighbour(size, int(pixel.x), int(pixel.y), i);
        float z = read_z(q);
        if (!is_far(q, z, limit))
            continue;
        count += 1.0;
        if (z < pt_float(PT_KEY_EMPTY_Z))
            sum = sum + read_float4(q);
    }
    float coverage = edge_coverage(args, read_key(at).x, count);
    precise float share = (1.0 - coverage) * pt_rcp(count);
    precise vec4 mix_color = read_float4(at) * coverage + sum * share;
    return mix_color;
}

#endif

uint entry_index() { return (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * gl_WorkGroupSize.x + gl_LocalInvocationID.x; }

#if STEP == 0

bool is_edge_towards(ivec2 size, int x, int y, int i, float limit)
{
    uint q = neighbour(size, x, y, i);
    return is_far(q, read_z(q), limit);
}

// Among cross_offsets: ahead on the line, and to its sides.
const int AHEAD = PT_STEP.x != 0u ? 0 : 1, SIDE = 1 - AHEAD;

// z_behind, z, z_ahead: of the pixel and those beside it in its line.
bool is_edge(ivec2 size, bool layers, int x, int y, float z_behind, float z, float z_ahead)
{
    uint at = uint(y * size.x + x);
    float limit = step_limit(layers, at, pt_bits(z));
    bool edge = is_edge_towards(size, x, y, SIDE, limit) || is_edge_towards(size, x, y, SIDE + 2, limit) ||
                is_far(neighbour(size, x, y, AHEAD), z_ahead, limit) ||
                is_far(neighbour(size, x, y, AHEAD + 2), z_behind, limit);
#if INKED
    edge = edge && !(line[at] > 0.0);
#endif
    return edge && z < pt_float(PT_KEY_EMPTY_Z);
}

void main()
{
    view_args view = args.view;
    bool layers = args.layers != 0u;
    ivec2 size = ivec2(view.width, view.height);
    uvec2 first = pt_tile_line(view);
    uint found = 0u, steps = pt_tile_steps(view, first), i = 0u;
    if (steps == 0u)
        return;
    float behind = read_z(neighbour(size, int(first.x), int(first.y), AHEAD + 2)), z = read_z(first.y * view.width + first.x);
    do {
        ivec2 here = ivec2(first + i * PT_STEP);
        float ahead = read_z(neighbour(size, here.x, here.y, AHEAD));
        found |= uint(is_edge(size, layers, here.x, here.y, behind, z, ahead)) << i;
        behind = z;
        z = ahead;
    } while (++i < steps);
#if LISTS
    if (found == 0u)
        return;
    uint to = atomicAdd(edge_count, uint(bitCount(found)));
#else
    edges[entry_index()] = found;
#endif
    for (; found != 0u; found &= found - 1u) {
        uvec2 here = first + uint(findLSB(found)) * PT_STEP;
        uint at = here.y * view.width + here.x;
#if LISTS
        edges[to++] = at;
#else
        mixed[at] = mix_of(at);
#endif
    }
}

#else

#if STEP == 1

void main()
{
    uint index = entry_index();
    if (index < edge_count)
        mixed[index] = mix_of(edges[index]);
}

#elif LISTS

void main()
{
    uint index = entry_index();
    if (index >= edge_count)
        return;
    uint at = edges[index];
    color[at] = mixed[index];
    from[at] |= PT_FROM_MIXED;
}

#else

void main()
{
    uvec2 first = pt_tile_line(args.view);
    if (pt_tile_steps(args.view, first) == 0u)
        return;
    for (uint found = edges[entry_index()]; found != 0u; found &= found - 1u) {
        uvec2 here = first + uint(findLSB(found)) * PT_STEP;
        uint at = here.y * args.view.width + here.x;
        color[at] = mixed[at];
        from[at] |= PT_FROM_MIXED;
    }
}

#endif
#endif
