// SPDX-License-Identifier: GPL-3.0-or-later
// dim: points behind the soft points of a light's view. SPEC 5; twin of native/device_cpu/kernels/dim.c
//
// A workgroup takes a chunk (or every gl_NumWorkGroups.y-th part of it). A word belongs to one point, so invocations never meet.
#version 430 core
#include "shared/shadows.h"
#include "shared/words.h"
#include "lib/points.glsl"
#include "lib/positions.glsl"

layout(local_size_x = 64) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { dim_args args; };
layout(std430, binding = BIND_veil) readonly buffer veil_block { float veil[]; };
layout(std430, binding = BIND_chunks) readonly buffer chunks_block { chunk_view chunks[]; };
layout(std430, binding = BIND_marks) readonly buffer marks_block { uint marks[]; };
#include "lib/marks.glsl"
#include "lib/shadow_words.glsl"

layout(std430, binding = BIND_shadows) buffer shadows_block { uint words[]; };
layout(std430, binding = BIND_differs) buffer differs_block { uint differs[]; };

layout(location = 0) uniform uint first_chunk; // of this dispatch
layout(location = 1) uniform uint first_slot;  // where the bound part of positions begins

// 2. What the ray of a texel has lost where the point is: `slab`, and how far into it.
float texel_at(view_args view, uint column, uint row, uint slab, float into)
{
    uint at = (row * view.width + column) * args.veils + slab;
    float last = veil[at], before = slab != 0u ? veil[at - 1u] : 0.0;
    precise float lost = before + into * (last - before);
    return lost;
}

float clamped(float x, uint most) { return pt_min(pt_max(x, 0.0), float(most)); }

// What is taken of 255 from a point.
uint loss_of(view_args view, chunk_view chunk, uint base, uint i)
{
    // 1. project
    vec3 p = pt_position(base, chunk.padded, chunk.step, i);
    vec3 seen = pt_project(view, chunk, p);
    float x = seen.x, y = seen.y, z = seen.z;
    if (!(args.window[0] <= x && x < args.window[2] && args.window[1] <= y && y < args.window[3] && view.z_near <= z))
        return 0u;
    precise float deep = clamped((z - args.veil_from) * args.veil_scale, args.veils);
    float slab = pt_min(floor(deep), float(args.veils - 1u));
    precise float into = deep - slab, px = (x - 0.5) - float(view.origin_x), py = (y - 0.5) - float(view.origin_y);
    precise float left = floor(px), below = floor(py), across = px - left, up = py - below;
    uvec2 columns = uvec2(uint(clamped(left, view.width - 1u)), uint(clamped(left + 1.0, view.width - 1u)));
    uvec2 rows = uvec2(uint(clamped(below, view.height - 1u)), uint(clamped(below + 1.0, view.height - 1u)));
    // 3. between their middles
    precise float lost[2];
    for (int k = 0; k < 2; k++) {
        float first = texel_at(view, columns.x, rows[k], uint(slab), into), then = texel_at(view, columns.y, rows[k], uint(slab), into);
        lost[k] = first + across * (then - first);
    }
    precise float sum = lost[0] + up * (lost[1] - lost[0]);
    precise float taken = 1.0 - pt_exp2(pt_max(sum * -1.44269504, -126.0));
    precise float steps = clamped(taken, 1u) * 255.0 + 0.5;
    return uint(steps);
}

void main()
{
    chunk_view chunk = chunks[first_chunk + gl_WorkGroupID.x];
    view_args view = args.view;
    bool all = args.close != 0u || args.compare != 0u, whole = args.alone != 0u || args.close != 0u;
    uint base = chunk.first - first_slot;
    uint stride = gl_WorkGroupSize.x * gl_NumWorkGroups.y;
    for (uint i = gl_WorkGroupID.y * gl_WorkGroupSize.x + gl_LocalInvocationID.x; i < chunk.count; i += stride) {
        uint id = chunk.first + i;
        if (args.marked != 0u && !pt_is_shown(id))
            continue;
        uint loss = loss_of(view, chunk, base, i);
        if (!all && loss == 0u)
            continue;
        bool differ;
        uint at = args.base + pt_word_at(args.marked, args.step, id);
        words[at] = pt_shadow_note(words[at], loss, whole, args.samples, differ);
        if (differ && args.compare != 0u)
            differs[0] = 1u;
    }
}
