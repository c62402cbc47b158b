// SPDX-License-Identifier: GPL-3.0-or-later
// Scalar functions that decide pixels, twins of shaders/lib/*.glsl: correctly rounded +, -, x only, in one written
// order, no contraction, so that CPU widths and GL devices agree to the bit (SPEC 1). simd.h holds the same for vectors.
#ifndef PT_MATH_H
#define PT_MATH_H

#include "kernel_args.h"

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
static inline float pt_abs(float x) { return pt_float(pt_bits(x) & 0x7FFFFFFFu); }

// 1 / x for normal x > 0, within 2 ulp: an integer seed (5% off) and three Newton steps.
static inline float pt_rcp(float x)
{
    float r = pt_float(0x7EF311C7u - pt_bits(x));
    r = r * (2.0f - x * r);
    r = r * (2.0f - x * r);
    return r * (2.0f - x * r);
}

// 1 / sqrt(x) for normal x > 0, within 2 ulp: an integer seed (3.5% off) and three Newton steps.
static inline float pt_rsqrt(float x)
{
    float h = 0.5f * x;
    float r = pt_float(0x5F375A86u - (pt_bits(x) >> 1));
    r = r * (1.5f - (h * r) * r);
    r = r * (1.5f - (h * r) * r);
    return r * (1.5f - (h * r) * r);
}

// 4 ulp(z) for z >= 0 (0 at 0): the exponent alone, times 2^-21.
static inline float pt_ulp4(float z) { return pt_float(pt_bits(z) & 0x7F800000u) * 0x1p-21f; }

// The octahedral normal of a surface word, not yet unit. The caller has excluded PT_NORMAL_NONE.
static inline void pt_decode_normal(uint32_t word, float n[3])
{
    float x = (float)((int32_t)(word & 0x1FFFu) - 4095) * (1.0f / 4095.0f);
    float y = (float)((int32_t)((word >> 13) & 0x1FFFu) - 4095) * (1.0f / 4095.0f);
    float z = (1.0f - pt_abs(x)) - pt_abs(y);
    float fold = pt_max(-z, 0.0f); // the lower half is folded over the corners
    n[0] = x >= 0.0f ? x - fold : x + fold;
    n[1] = y >= 0.0f ? y - fold : y + fold;
    n[2] = z;
}

// Ray of the pixel (x, y) of this view's level: see struct view_args.
static inline void pt_ray(const struct view_args *view, int32_t x, int32_t y, float ray[2])
{
    float scale = (float)(1u << view->level);
    float px = ((float)((view->origin_x >> view->level) + x) + 0.5f) * scale;
    float py = ((float)((view->origin_y >> view->level) + y) + 0.5f) * scale;
    ray[0] = view->ray_x0 + view->ray_xs * px;
    ray[1] = view->ray_y0 + view->ray_ys * py;
}

// |n . v| for a unit normal.
static inline float pt_cosine(const struct view_args *view, const float n[3], const float ray[2])
{
    if (!view->perspective)
        return pt_abs(n[2]);
    float dot = (n[0] * ray[0] + n[1] * ray[1]) - n[2];
    return pt_abs(dot) * pt_rsqrt((ray[0] * ray[0] + ray[1] * ray[1]) + 1.0f);
}

// Width of a pixel of this view's level at z.
static inline float pt_footprint(const struct view_args *view, float z)
{
    float width = view->footprint * (float)(1u << view->level);
    return view->perspective ? width * z : width;
}

// SPEC 1, effective layer distance, given 1 / max(|n.v|, C).
static inline float pt_layer_distance(const struct view_args *view, float d_min, float spacing, float z, float inverse)
{
    float d = pt_max(d_min, PT_SPACING_FACTOR * spacing);
    d = pt_max(d, pt_footprint(view, z));
    d = pt_max(d, pt_ulp4(z));
    return d * inverse;
}

// d_eff at this view's level of the pixel whose surface comes from the measured pixel with these values.
static inline float pt_level_distance(const struct view_args *view, float deff, float inverse, float z)
{
    return view->level ? pt_max(deff, pt_footprint(view, z) * inverse) : deff;
}

// z at ray p of the plane with normal n through the point at (ray q, z_q), not nearer than z_q, not farther than
// z_q + limit. SPEC 2.2, refined filling.
static inline float pt_plane_depth(const struct view_args *view, const float n[3], const float ray_q[2], float z_q,
                                   const float ray_p[2], float limit)
{
    float z = z_q;
    if (view->perspective) {
        float dot_q = (n[0] * ray_q[0] + n[1] * ray_q[1]) - n[2];
        float dot_p = (n[0] * ray_p[0] + n[1] * ray_p[1]) - n[2];
        float sign = dot_p < 0.0f ? -1.0f : 1.0f;
        float size = pt_abs(dot_p);
        if (size > 1e-6f)
            z = (z_q * (dot_q * sign)) * pt_rcp(size);
    } else {
        float sign = n[2] < 0.0f ? -1.0f : 1.0f;
        float size = pt_abs(n[2]);
        if (size > 1e-6f)
            z = z_q + ((n[0] * (ray_p[0] - ray_q[0]) + n[1] * (ray_p[1] - ray_q[1])) * sign) * pt_rcp(size);
    }
    return pt_min(pt_max(z, z_q), z_q + limit);
}

// Bit i of white: ring neighbour i is white, counted anticlockwise. 1 when five (four) consecutive ones are.
static inline uint32_t pt_five_white(uint32_t white)
{
    uint32_t w = white | white << 8;
    return (w & w >> 1 & w >> 2 & w >> 3 & w >> 4 & 0xFFu) != 0;
}

static inline uint32_t pt_four_white(uint32_t white)
{
    uint32_t w = white | white << 8;
    return (w & w >> 1 & w >> 2 & w >> 3 & 0xFFu) != 0;
}

#endif
