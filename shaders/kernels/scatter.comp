// SPDX-License-Identifier: GPL-3.0-or-later
// scatter: points -> least key a pixel. [D 3.1]; twin of native/device_cpu/kernels/scatter.c
//
// A workgroup takes a chunk (or every gl_NumWorkGroups.y-th part of it). The minimum commutes, so the order of points
// never shows. Without 64-bit atomics a key is made in two passes over all points of all instances:
//   PASS 0: least z;   PASS 1: least id among the points that have exactly this z.   PASS 2: both at once, 64 bits.
//   RANGES: both passes run over a range of points before the next range comes: what was the least z is another's then.
//   BEHIND, SIFTED: as in the arguments, known beforehand: software would read the limit and drawn words for nothing.
// llvmpipe runs the vectors of a workgroup one after the other: a workgroup of one walks its chunk from end to end, and a pass
// takes 5.2 ms in place of 7.6. Points and their words come as textures.
#version 430 core
#if PASS == 2
#extension GL_ARB_gpu_shader_int64 : require
#extension GL_NV_shader_atomic_int64 : require
#endif
#include "shared/points.h"
#include "lib/planes.glsl"
#include "lib/points.glsl"
#define PT_POSITION_TEXELS
#include "lib/positions.glsl"

#ifdef PT_SOFTWARE
layout(local_size_x = 8) in;
#else
layout(local_size_x = 64) in;
#endif

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { scatter_args args; };
#if PASS == 2
layout(std430, binding = BIND_keys) buffer keys_block { uint64_t keys[]; };
#else
layout(std430, binding = BIND_keys) buffer keys_block { uint keys[]; }; // two words a pixel: id, z bits
#endif
layout(std430, binding = BIND_chunks) readonly buffer chunks_block { chunk_view chunks[]; };
layout(std430, binding = BIND_limit) readonly buffer limit_block { float limit[]; };
layout(std430, binding = BIND_drawn) readonly buffer drawn_block { uint drawn[]; };

layout(location = 0) uniform uint first_chunk; // of this dispatch
layout(location = 1) uniform uint first_slot;  // where the bound part of positions and surface begins

void main()
{
    chunk_view chunk = chunks[first_chunk + gl_WorkGroupID.x];
    view_args view = args.view;
    float left = float(view.origin_x), right = float(view.origin_x + int(view.width));
    float bottom = float(view.origin_y), top = float(view.origin_y + int(view.height));
    bool cull = chunk.cull != 0u;
    uint base = chunk.first - first_slot;
    uint stride = gl_WorkGroupSize.x * gl_NumWorkGroups.y;

    for (uint i = gl_WorkGroupID.y * gl_WorkGroupSize.x + gl_LocalInvocationID.x; i < chunk.count; i += stride) {
        // 1. project
        vec3 p = pt_position(base, chunk.padded, chunk.step, i);
        vec3 seen = pt_project(view, chunk, p);
        float x = seen.x, y = seen.y, z = seen.z;
        // 2. clip: NaN fails every comparison; what was sifted out is not drawn
        if (!(view.z_near <= z && z <= view.z_far && left <= x && x < right && bottom <= y && y < top))
            continue;
#if SIFTED
        if (chunk.sifted != 0u &&
            (drawn[chunk.sifted - 1u + i / PT_SLOTS_A_WORD] >> i % PT_SLOTS_A_WORD & 1u) == 0u)
            continue;
#endif
        // 3. back faces
        if (cull && pt_faces_away(chunk, read_word(base + i), p))
            continue;
        // 4. limit and early depth test; the sign bit of -0 is dropped
        uint pixel = uint(int(floor(y)) - view.origin_y) * view.width + uint(int(floor(x)) - view.origin_x);
        uint z_bits = pt_bits(z) & 0x7FFFFFFFu;
#if BEHIND
        if (!(limit[pixel] < z))
            continue;
#endif
        uint least = read_z_bits(pixel); // what others write meanwhile may come late: it is less
#if PASS == 1
        if (least != z_bits)
            continue;
#else
        if (least < z_bits || (PASS == 0 && least == z_bits))
            continue;
#endif
        // 5. the least key
        uint id = chunk.first + i;
#if PASS == 0
#if RANGES
        if (z_bits < atomicMin(keys[2u * pixel + 1u], z_bits))
            keys[2u * pixel] = PT_KEY_EMPTY_ID; // all who come here write this
#else
        atomicMin(keys[2u * pixel + 1u], z_bits); // a disc's id that was there is greater than any point's
#endif
#elif PASS == 1
        atomicMin(keys[2u * pixel], chunk.id_base + id);
#else
        atomicMin(keys[pixel], uint64_t(z_bits) << 32 | uint64_t(chunk.id_base + id));
#endif
    }
}
