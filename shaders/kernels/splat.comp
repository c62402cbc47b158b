// SPDX-License-Identifier: GPL-3.0-or-later
// splat: points -> least key of every pixel that their discs cover. SPEC 5, solid; twin of native/device_cpu/kernels/splat.c
//
// A workgroup takes a chunk, or one large disc; passes as in scatter.comp.
#version 430 core
#if PASS == 2
#extension GL_ARB_gpu_shader_int64 : require
#extension GL_NV_shader_atomic_int64 : require
#endif

#include "shared/points.h"

layout(local_size_x = 64) in;

layout(std430, binding = BIND_arguments) readonly buffer arguments_block { splat_args args; disc_args discs[]; };
#if PASS == 2
layout(std430, binding = BIND_keys) buffer keys_block { uint64_t keys[]; };
#else
layout(std430, binding = BIND_keys) buffer keys_block { uint keys[]; }; // two words a pixel: id, z bits
#endif
layout(std430, binding = BIND_limit) readonly buffer limit_block { float limit[]; };

#include "lib/disc.glsl"

void take(uint pixel, uint z_bits, uint id)
{
#if PASS == 0
    if (z_bits < keys[2u * pixel + 1u] && z_bits < atomicMin(keys[2u * pixel + 1u], z_bits))
        keys[2u * pixel] = PT_KEY_EMPTY_ID; // that of a point which scatter left there, farther off: all who come here write this
#elif PASS == 1
    if (z_bits == keys[2u * pixel + 1u])
        atomicMin(keys[2u * pixel], id);
#else
    atomicMin(keys[pixel], uint64_t(z_bits) << 32 | uint64_t(id));
#endif
}

void draw_pixel(view_args view, disc d, uint id, int x, int y)
{
    float z, square;
    bool beside;
    if (!disc_pixel(view, d, x, y, z, square, beside))
        return;
    uint pixel = uint(y) * view.width + uint(x);
    if (args.behind == 0u || limit[pixel] < z)
        take(pixel, pt_bits(z) & 0x7FFFFFFFu, id); // the sign bit of -0 is dropped
}

#if LARGE == 0

void main()
{
    uint at = first_chunk + gl_WorkGroupID.x;
    chunk_view chunk = chunks[at];
    view_args view = args.view;
    uint stride = gl_WorkGroupSize.x * gl_NumWorkGroups.y;
    for (uint i = gl_WorkGroupID.y * gl_WorkGroupSize.x + gl_LocalInvocationID.x; i < chunk.count; i += stride) {
        disc d;
        if (!disc_of(view, chunk, i, d) || disc_listed(d.box, at, i))
            continue;
        for (int y = d.box.y; y <= d.box.w; y++)
            for (int x = d.box.x; x <= d.box.z; x++)
                draw_pixel(view, d, chunk.id_base + d.id, x, y);
    }
}

#else

void main()
{
    uint at, part;
    if (!disc_large(at, part))
        return;
    chunk_view chunk = chunks[large[2u * at]];
    view_args view = args.view;
    disc d;
    if (!disc_of(view, chunk, large[2u * at + 1u], d))
        return;
    ivec2 own = ivec2(gl_LocalInvocationID.x & 7u, 8u * part + (gl_LocalInvocationID.x >> 3));
    for (int y = d.box.y + own.y; y <= d.box.w; y += 8 * int(parts))
        for (int x = d.box.x + own.x; x <= d.box.z; x += 8)
            draw_pixel(view, d, chunk.id_base + d.id, x, y);
}

#endif
