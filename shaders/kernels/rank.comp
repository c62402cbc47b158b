// SPDX-License-Identifier: GPL-3.0-or-later
// rank: where the shadow words of points that the picture shows lie; twin of native/device_cpu/kernels/rank.c
//
// A workgroup takes a chunk (or every gl_NumWorkGroups.y-th part of it). Chunks that share the words of their marks both find them: the
// first gives the rank.
#version 430 core
#include "shared/shadows.h"
#include "shared/words.h"
#include "lib/math.glsl"

layout(local_size_x = 64) in;

layout(std430, binding = BIND_chunks) readonly buffer chunks_block { chunk_view chunks[]; };
layout(std430, binding = BIND_marks) buffer marks_block { uint marks[]; };
layout(std430, binding = BIND_marked) buffer marked_block { uint marked[]; };

layout(location = 0) uniform uint first_chunk; // of this dispatch

void main()
{
    chunk_view chunk = chunks[first_chunk + gl_WorkGroupID.x];
    uint stride = gl_WorkGroupSize.x * gl_NumWorkGroups.y;
    uint first = chunk.first / PT_MARK_SLOTS, end = (chunk.first + chunk.padded - 1u) / PT_MARK_SLOTS + 1u;
    for (uint i = first + gl_WorkGroupID.y * gl_WorkGroupSize.x + gl_LocalInvocationID.x; i < end; i += stride) {
        uint bits = marks[2u * i];
        if (bits != 0u && atomicCompSwap(marks[2u * i + 1u], 0u, 1u) == 0u)
            marks[2u * i + 1u] = 1u + atomicAdd(marked[0], uint(bitCount(bits)));
    }
}
