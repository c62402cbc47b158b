// SPDX-License-Identifier: GPL-3.0-or-later
// smooth, antialias and compose as one, where nobody asks for the colours between them: llvmpipe takes 9 ms in place of 14.
//   STEP 0: smooth and compose, and find the edges;   STEP 1: mix these, an edge an invocation, smoothing once more.
// In software what is empty is background already (native/device_gl/pixels.c). On a GPU STEP 0 writes it, and mixes the edges.
//   INKED: pixels with a line are no edges
#version 430 core
#include "lib/math.glsl"
#include "lib/planes.glsl"
#include "lib/smooth.glsl"
#define BEHIND 0
#include "lib/edges.glsl"
#if STEP == 0
#include "lib/tiles.glsl"
#else
layout(local_size_x = 64) in;
#endif

layout(std430, binding = BIND_arguments) readonly buffer arguments_block {
    smooth_args smoothing;
    antialias_args edging;
    compose_args composing;
    uint walked[4]; // the rectangle that STEP 0 walks: on a GPU it holds the crop
};
layout(std430, binding = BIND_combined) writeonly buffer combined_block { vec4 combined[]; };
layout(std430, binding = BIND_line) readonly buffer line_block { float line[]; };
#ifdef PT_SOFTWARE
layout(std430, binding = BIND_edges) buffer edges_block { uint edge_groups[3], edge_count, edges[]; };
#define MIXES (STEP == 1)
#else
#define MIXES 1
#endif

#define ARGS composing
#include "lib/bodies.glsl"
#include "pointwise/compose.h"

struct crop_part {
    uvec2 corner, size;
};

crop_part read_crop()
{
    return crop_part(uvec2(composing.crop_x, composing.crop_y), uvec2(composing.crop_width, composing.crop_height));
}

void write_pixel(crop_part crop, uvec2 in_crop, vec4 color)
{
    pt_here here;
    float over[4] = {color.x, color.y, color.z, color.w};
    here.some = true;
    pt_compose(here, over);
    combined[in_crop.y * crop.size.x + in_crop.x] = vec4(over[0], over[1], over[2], over[3]);
}

#if MIXES

vec4 smoothed(smooth_args args, uvec4 rect, uint at)
{
    uvec2 p = pt_pixel(at, args.view.width);
    return pt_smooth(args, read_row(rect, args.view.width, p - PT_STEP), read_row(rect, args.view.width, p),
                     read_row(rect, args.view.width, p + PT_STEP), read_deff(read_from(at)));
}

void mix_edge(uint at)
{
    smooth_args args = smoothing;
    uvec4 rect = uvec4(args.view.rect[0], args.view.rect[1], args.view.rect[2], args.view.rect[3]);
    ivec2 size = ivec2(args.view.width, args.view.height);
    crop_part crop = read_crop();
    uvec2 pixel = pt_pixel(at, args.view.width), key = read_key(at);
    float limit = step_limit(edging.layers != 0u, at, key.y);
    precise vec4 sum = vec4(0.0);
    float count = 0.0;
    for (int i = 0; i < 4; i++) {
        uint q = neighbour(size, int(pixel.x), int(pixel.y), i);
        float z = read_z(q);
        if (!is_far(q, z, limit))
            continue;
        count += 1.0;
        if (z < pt_float(PT_KEY_EMPTY_Z))
            sum = sum + smoothed(args, rect, q);
    }
    float coverage = edge_coverage(edging, key.x, count);
    precise float share = (1.0 - coverage) * pt_rcp(count);
    precise vec4 mix_color = smoothed(args, rect, at) * coverage + sum * share;
    write_pixel(crop, pixel - crop.corner, mix_color);
}

#endif

#if STEP == 0

void main()
{
    view_args view = smoothing.view;
    smooth_args args = smoothing;
    uvec4 rect = uvec4(view.rect[0], view.rect[1], view.rect[2], view.rect[3]);
    bool layers = edging.layers != 0u;
    float empty = pt_float(PT_KEY_EMPTY_Z);
    crop_part crop = read_crop();
    view_args walk = view;
    walk.rect = walked;
    uvec2 first = pt_tile_line(walk), here = first;
    uint steps = pt_tile_steps(walk, first), found = 0u, i = 0u;
    if (steps == 0u)
        return;
    tap_row behind = read_row(rect, view.width, here - PT_STEP), row = read_row(rect, view.width, here);
    do {
        tap_row ahead = read_row(rect, view.width, here + PT_STEP);
        uint at = here.y * view.width + here.x;
        float z = row.middle.z, limit = read_deff(z < empty ? read_from(at) : at);
        uvec2 in_crop = here - crop.corner; // left of it and below: beyond its size
        bool in_picture = in_crop.x < crop.size.x && in_crop.y < crop.size.y;
        bool shown = z < empty && in_picture;
#ifndef PT_SOFTWARE
        if (in_picture && !shown)
            combined[in_crop.y * crop.size.x + in_crop.x] = vec4(composing.background[0], composing.background[1],
                                                                 composing.background[2], composing.background[3]);
#endif
        vec4 mean = pt_smooth(args, behind, row, ahead, limit);
        if (shown)
            write_pixel(crop, in_crop, mean);
        precise float step_far = z + limit; // the crop ends before the plane: all neighbours are known
        step_far = layers ? step_far : empty;
        bool edge = is_far(at, behind.middle.z, step_far) || is_far(at, ahead.middle.z, step_far) ||
                    is_far(at, row.low.z, step_far) || is_far(at, row.high.z, step_far);
#if INKED
        edge = edge && !(line[at] > 0.0);
#endif
        found |= uint(edge && shown) << i;
        behind = row;
        row = ahead;
        here += PT_STEP;
    } while (++i < steps);
#ifdef PT_SOFTWARE
    if (found == 0u)
        return;
    uint to = atomicAdd(edge_count, uint(bitCount(found)));
    for (; found != 0u; found &= found - 1u, to++) {
        here = first + uint(findLSB(found)) * PT_STEP;
        edges[to] = here.y * view.width + here.x;
    }
#else
    for (; found != 0u; found &= found - 1u) {
        here = first + uint(findLSB(found)) * PT_STEP;
        mix_edge(here.y * view.width + here.x);
    }
#endif
}

#else

void main()
{
    uint index = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
    if (index < edge_count)
        mix_edge(edges[index]);
}

#endif
