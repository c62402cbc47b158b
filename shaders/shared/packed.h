// SPDX-License-Identifier: GPL-3.0-or-later
// Where points are in a cloud's memory, and packed positions. Read by C and by GLSL; the functions are the host's.
#ifndef PT_SHARED_PACKED_H
#define PT_SHARED_PACKED_H

// Packed positions (SPEC 13): two words a point, a chunk's first ones one behind the other and then its second ones. x and y are the low
// 21 bits of each, of z the first has the low 11 and the second the rest. A coordinate is (q - middle) step from the chunk's origin: q
// and the difference are whole numbers that a float holds, and the step is a power of two, so that it has the same bits everywhere.
#define PT_POSITION_WORDS 3u // a point that is not
#define PT_PACKED_WORDS 2u
#define PT_PACKED_BITS 21
#define PT_PACKED_MASK 0x1FFFFFu
#define PT_PACKED_MIDDLE 0x100000
#define PT_PACKED_HIGH 0x3FF800u // of z, once the second word is moved down by 10

#ifndef GL_core_profile
#include <stdint.h>

// What of each coordinate stands in them.
static inline void pt_packed_parts(uint32_t low, uint32_t high, uint32_t q[3])
{
    q[0] = low & PT_PACKED_MASK;
    q[1] = high & PT_PACKED_MASK;
    q[2] = low >> PT_PACKED_BITS | (high >> 10 & PT_PACKED_HIGH);
}

static inline void pt_packed_point(uint32_t low, uint32_t high, float step, float p[3])
{
    uint32_t q[3];
    pt_packed_parts(low, high, q);
    for (int k = 0; k < 3; k++)
        p[k] = ((float)q[k] - (float)PT_PACKED_MIDDLE) * step;
}

// The whole number of steps next to a coordinate; what is none, or beyond the step's reach, is somewhere within it.
static inline uint32_t pt_packed_part(float x, float step)
{
    const double most = PT_PACKED_MIDDLE - 1, steps = (double)x / (double)step;
    const double within = !(steps > -most) ? -most : steps < most ? steps : most; // no number, too
    return (uint32_t)(within + PT_PACKED_MIDDLE + 0.5);
}

static inline void pt_packed_words(const float p[3], float step, uint32_t words[2])
{
    const uint32_t z = pt_packed_part(p[2], step);
    words[0] = pt_packed_part(p[0], step) | z << PT_PACKED_BITS;
    words[1] = pt_packed_part(p[1], step) | z >> (32 - PT_PACKED_BITS) << PT_PACKED_BITS;
}

#endif
#endif
