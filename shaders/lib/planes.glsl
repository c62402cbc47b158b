// SPDX-License-Identifier: GPL-3.0-or-later
// Planes that a kernel reads come as buffer textures, the same units in all kernels (native/device_gl/kernels.c), and
// are written as storage blocks. llvmpipe fetches a texel, of four floats too, in half the time of a block's word.
#ifndef PT_PLANES_GLSL
#define PT_PLANES_GLSL

#include "lib/math.glsl"

// An invocation walks a line of pixels. On a GPU neighbours in a row share what they fetch at once, and walk up. llvmpipe takes
// its lanes one after the other, and processors fetch ahead of who walks along a row: smoothing takes 7.7 ms in place of 11.9.
#ifdef PT_SOFTWARE
#define PT_STEP uvec2(1u, 0u)
#else
#define PT_STEP uvec2(0u, 1u)
#endif
#define PT_ACROSS (PT_STEP.yx)
#define PT_UPWARDS (PT_STEP.y != 0u)

layout(binding = UNIT_key) uniform usamplerBuffer key_plane;
layout(binding = UNIT_from) uniform usamplerBuffer from_plane;
layout(binding = UNIT_deff) uniform samplerBuffer deff_plane;
layout(binding = UNIT_float4) uniform samplerBuffer float4_plane; // normals or colours
layout(binding = UNIT_other_float4) uniform samplerBuffer other_float4_plane;
layout(binding = UNIT_word) uniform usamplerBuffer word_plane; // of points

uvec2 read_key(uint pixel) { return texelFetch(key_plane, int(pixel)).xy; }
uint read_z_bits(uint pixel) { return texelFetch(key_plane, int(pixel)).y; }
float read_z(uint pixel) { return uintBitsToFloat(texelFetch(key_plane, int(pixel)).y); }
uint read_word(uint i) { return texelFetch(word_plane, int(i)).x; }
float read_float(uint i) { return texelFetch(deff_plane, int(i)).x; } // of kernels that read no deff plane
uint read_position(uint i) { return texelFetch(from_plane, int(i)).x; } // of kernels that read no from plane
uint read_from(uint pixel) { return texelFetch(from_plane, int(pixel)).x & ~PT_FROM_MIXED; }
float read_deff(uint pixel) { return texelFetch(deff_plane, int(pixel)).x; }
float read_span(uint pixel) { return uintBitsToFloat(texelFetch(word_plane, int(pixel)).x); } // of kernels that read no words
vec4 read_float4(uint pixel) { return texelFetch(float4_plane, int(pixel)); }

// How far z of a filled surface goes at most: as far beyond where it was measured as its span reaches along it. Where that cell of
// the level shows something else by now, as far as z_q. z, from: what the cell shows.
float pt_farthest(float z, uint from, uint source, float z_q)
{
    precise float farthest = z + read_span(source) * pt_rcp(read_float4(source).w);
    return from == source ? farthest : z_q;
}

// Or as far as what lies beside a pixel at z, if no farther from z than z from z_q: a gap's other side, or what is to hide a rim.
float pt_farther(float farthest, float beside, float z_q, float z)
{
    precise float step = z - z_q, next = z + step;
    return beside <= next ? pt_max(farthest, beside) : farthest;
}

// Of kernels that visit every pixel, 32 invocations a workgroup: 64 x 4 pixels a workgroup, as in native/device_gl/kernels.c,
// and eight of a row an invocation, PT_APART from one to the next.
#define PT_APART 8u

uvec2 pt_first_of_row()
{
    uint lane = gl_LocalInvocationID.x;
    return gl_WorkGroupID.xy * uvec2(PT_APART * 8u, 4u) + uvec2(lane % PT_APART, lane / PT_APART);
}

#endif
