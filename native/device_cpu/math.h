// SPDX-License-Identifier: GPL-3.0-or-later
// Scalars that the vector vocabulary (simd.h) and its users need one at a time.
#ifndef PT_MATH_H
#define PT_MATH_H

#include <stdint.h>
#include <string.h>

static inline uint32_t pt_bits(float x)
{
    uint32_t u;
    memcpy(&u, &x, 4);
    return u;
}

static inline float pt_float(uint32_t u)
{
    float x;
    memcpy(&x, &u, 4);
    return x;
}

static inline float pt_max(float a, float b) { return a > b ? a : b; }
static inline float pt_min(float a, float b) { return a < b ? a : b; }

// 1 / x for normal x > 0, within 2 ulp: an integer seed (5% off) and three Newton steps.
static inline float pt_rcp(float x)
{
    float r = pt_float(0x7EF311C7u - pt_bits(x));
    r = r * (2.0f - x * r);
    r = r * (2.0f - x * r);
    return r * (2.0f - x * r);
}

#endif
