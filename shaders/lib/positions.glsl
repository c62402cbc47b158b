// SPDX-License-Identifier: GPL-3.0-or-later
// The positions of a chunk's points, which are floats or packed (shared/packed.h); twin of native/device_cpu/points.h. They come as a storage
// block, or as the texture of words that lib/planes.glsl reads where PT_POSITION_TEXELS is defined.
#ifndef PT_POSITIONS_GLSL
#define PT_POSITIONS_GLSL

#include "shared/packed.h"

#ifdef PT_POSITION_TEXELS
uint pt_position_word(uint i) { return read_position(i); }
#else
layout(std430, binding = BIND_positions) readonly buffer positions_block { uint positions[]; };
uint pt_position_word(uint i) { return positions[i]; }
#endif

// Of slot i of a chunk, relative to its origin; base: its first slot, in the bound part.
vec3 pt_position(uint base, uint padded, float size, uint i)
{
    if (size > 0.0) {
        uint at = PT_PACKED_WORDS * base + i, low = pt_position_word(at), high = pt_position_word(at + padded);
        uvec3 q = uvec3(low & PT_PACKED_MASK, high & PT_PACKED_MASK, low >> PT_PACKED_BITS | (high >> 10 & PT_PACKED_HIGH));
        precise vec3 p = vec3(ivec3(q) - PT_PACKED_MIDDLE) * size;
        return p;
    }
    uint at = PT_POSITION_WORDS * base + i;
    return vec3(uintBitsToFloat(pt_position_word(at)), uintBitsToFloat(pt_position_word(at + padded)),
                uintBitsToFloat(pt_position_word(at + 2u * padded)));
}

#endif
