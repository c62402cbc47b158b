// SPDX-License-Identifier: GPL-3.0-or-later
// splat: points -> least key of every pixel that their discs cover. SPEC 5, solid; twin of native/device_cpu/kernels/splat.c
//
// A workgroup takes a chunk; passes as in scatter.comp.
#version 430 core
#if PASS == 2
#extension GL_ARB_gpu_shader_int64 : require
#extension GL_NV_shader_atomic_int64 : require
#endif
#include "shared/kernel_args.h"

layout(local_size_x = 64) in;

layout(std430, binding = 0) readonly buffer arguments_block { splat_args args; disc_args discs[]; };
#if PASS == 2
layout(std430, binding = 1) buffer keys_block { uint64_t keys[]; };
#else
layout(std430, binding = 1) buffer keys_block { uint keys[]; }; // two words a pixel: id, z bits
#endif
layout(std430, binding = 6) readonly buffer limit_block { float limit[]; };

#include "lib/disc.glsl"

void take(uint pixel, uint z_bits, uint id)
{
#if PASS == 0
    if (z_bits < keys[2u * pixel + 1u])
        atomicMin(keys[2u * pixel + 1u], z_bits);
#elif PASS == 1
    if (z_bits == keys[2u * pixel + 1u])
        atomicMin(keys[2u * pixel], id);
#else
    atomicMin(keys[pixel], uint64_t(z_bits) << 32 | uint64_t(id));
#endif
}

void main()
{
    chunk_view chunk = chunks[first_chunk + gl_WorkGroupID.x];
    view_args view = args.view;
    bool behind = args.behind != 0u;
    uint stride = gl_WorkGroupSize.x * gl_NumWorkGroups.y;
    for (uint i = gl_WorkGroupID.y * gl_WorkGroupSize.x + gl_LocalInvocationID.x; i < chunk.count; i += stride) {
        disc d;
        if (!disc_of(view, chunk, i, d))
            continue;
        for (int y = d.box.y; y <= d.box.w; y++)
            for (int x = d.box.x; x <= d.box.z; x++) {
                float z, square;
                bool beside;
                if (!disc_pixel(view, d, x, y, z, square, beside))
                    continue;
                uint pixel = uint(y) * view.width + uint(x);
                if (!behind || limit[pixel] < z)
                    take(pixel, pt_bits(z) & 0x7FFFFFFFu, chunk.id_base + d.id); // the sign bit of -0 is dropped
            }
    }
}
