// SPDX-License-Identifier: GPL-3.0-or-later
// Functions that decide pixels, twins of shaders/lib/*.glsl: correctly rounded +, -, x only, in one written order, no
// contraction, so that CPU widths and GL devices agree to the bit (SPEC 1).
#ifndef PT_VECTOR_MATH_H
#define PT_VECTOR_MATH_H

#include "simd.h"
#include "shared/words.h"

// 1 / x for normal x > 0, within 2 ulp: an integer seed (5% off) and three Newton steps.
static inline vf vf_rcp(vf x)
{
    const vf two = vf_set(2.0f);
    vf r = vi_float(vi_sub(vi_set(0x7EF311C7u), vf_bits(x)));
    r = r * (two - x * r);
    r = r * (two - x * r);
    return r * (two - x * r);
}

// 1 / sqrt(x) for normal x > 0, within 2 ulp: an integer seed (3.5% off) and three Newton steps.
static inline vf vf_rsqrt(vf x)
{
    const vf c = vf_set(1.5f);
    vf h = vf_set(0.5f) * x;
    vf r = vi_float(vi_sub(vi_set(0x5F375A86u), vi_shr(vf_bits(x), 1)));
    r = r * (c - (h * r) * r);
    r = r * (c - (h * r) * r);
    return r * (c - (h * r) * r);
}

// log2(x) for normal x > 0, within 2e-7 and a rounding: the exponent, and a polynomial in the mantissa less 1, which lies
// between sqrt(1/2) and sqrt(2).
static inline vf vf_log2(vf x)
{
    const vi least = vi_set(0x3F3504F3u); // sqrt(1/2)
    vi word = vi_add(vf_bits(x), vi_sub(vi_set(0x3F800000u), least));
    vf whole = vi_convert(vi_sub(vi_shr(word, 23), vi_set(127)));
    vf t = vi_float(vi_add(vi_and(word, vi_set(0x007FFFFFu)), least)) - vf_set(1.0f);
    vf p = t * vf_set(-0.14973319f) + vf_set(0.23570961f);
    p = p * t + vf_set(-0.24832283f);
    p = p * t + vf_set(0.28686887f);
    p = p * t + vf_set(-0.36026347f);
    p = p * t + vf_set(0.48093116f);
    p = p * t + vf_set(-0.72135246f);
    p = p * t + vf_set(1.4426949f);
    return whole + p * t;
}

// 2^x for x within +-126, within 4e-7 of it.
static inline vf vf_exp2(vf x)
{
    vf whole = vf_floor(x + vf_set(0.5f)), t = x - whole;
    vf p = t * vf_set(0.0013410005f) + vf_set(0.009676036f);
    p = p * t + vf_set(0.055502973f);
    p = p * t + vf_set(0.24022107f);
    p = p * t + vf_set(0.69314724f);
    p = p * t + vf_set(1.0000001f);
    return p * vi_float(vi_mul(vi_add(vf_int(whole), vi_set(127)), vi_set(1u << 23)));
}

// 4 ulp(z) for z >= 0 (0 at 0): the exponent alone, times 2^-21.
static inline vf vf_ulp4(vf z) { return vi_float(vi_and(vf_bits(z), vi_set(0x7F800000u))) * vf_set(0x1p-21f); }

// The octahedral normals of surfels, not yet unit. Words without one give anything.
static inline void vf_decode_normal(vi word, vf n[3])
{
    const vi mask = vi_set(0x1FFFu), middle = vi_set(4095u);
    const vf step = vf_set(1.0f / 4095.0f), zero = vf_zero();
    vf x = vi_convert(vi_sub(vi_and(word, mask), middle)) * step;
    vf y = vi_convert(vi_sub(vi_and(vi_shr(word, 13), mask), middle)) * step;
    vf z = (vf_set(1.0f) - vf_abs(x)) - vf_abs(y);
    vf fold = vf_max(zero - z, zero);
    n[0] = vf_select(vf_le(zero, x), x - fold, x + fold);
    n[1] = vf_select(vf_le(zero, y), y - fold, y + fold);
    n[2] = z;
}

// Normals of surfels in view space, not yet unit. Words without one give anything.
static inline void vf_view_normal(const struct instance_args *instance, vi word, vf n[3])
{
    const float *m = instance->normal_matrix;
    vf object[3];
    vf_decode_normal(word, object);
    for (int k = 0; k < 3; k++)
        n[k] = (vf_set(m[3 * k]) * object[0] + vf_set(m[3 * k + 1]) * object[1]) + vf_set(m[3 * k + 2]) * object[2];
}

// Rays of the pixels (x, y) of this view's level: see struct view_args.
static inline void vf_ray_of(const struct view_args *view, vi x, vi y, vf ray[2])
{
    const vf half = vf_set(0.5f), scale = vf_set((float)(1u << view->level));
    vf px = (vi_convert(vi_add(vi_set((uint32_t)(view->origin_x >> view->level)), x)) + half) * scale;
    vf py = (vi_convert(vi_add(vi_set((uint32_t)(view->origin_y >> view->level)), y)) + half) * scale;
    ray[0] = vf_set(view->ray_x0) + vf_set(view->ray_xs) * px;
    ray[1] = vf_set(view->ray_y0) + vf_set(view->ray_ys) * py;
}

// Rays of PT_LANES pixels from (x, y) on.
static inline void vf_ray(const struct view_args *view, uint32_t x, uint32_t y, vf ray[2])
{
    vf_ray_of(view, vi_add(vi_set(x), vi_lanes()), vi_set(y), ray);
}

// |n . v| for unit normals.
static inline vf vf_cosine(const struct view_args *view, const vf n[3], const vf ray[2])
{
    if (!view->perspective)
        return vf_abs(n[2]);
    vf dot = (n[0] * ray[0] + n[1] * ray[1]) - n[2];
    return vf_abs(dot) * vf_rsqrt((ray[0] * ray[0] + ray[1] * ray[1]) + vf_set(1.0f));
}

// The greatest of whole numbers in some lanes, from 0 to `most`; 0 in none.
static inline int vf_greatest(vf a, vm lanes, int most)
{
    while (most && !vm_bits(vm_and(lanes, vf_le(vf_set((float)most), a))))
        most--;
    return most;
}

// Width of a pixel of this view's level at z.
static inline vf vf_footprint(const struct view_args *view, vf z)
{
    vf width = vf_set(view->footprint * (float)(1u << view->level));
    if (view->perspective)
        width = width * z;
    return width;
}

// max(d_min, thick, footprint, 4 ulp(z)) / max(|n.v|, C), given 1 / max(|n.v|, C).
static inline vf vf_distance_of(float d_min, vf thick, vf footprint, vf z, vf inverse)
{
    vf d = vf_max(vf_set(d_min), thick);
    d = vf_max(d, footprint);
    d = vf_max(d, vf_ulp4(z));
    return d * inverse;
}

// SPEC 1, effective layer distance of points of which the spacing alone is known.
static inline vf vf_layer_distance(const struct view_args *view, float d_min, vf spacing, vf z, vf inverse)
{
    return vf_distance_of(d_min, vf_set(PT_SPACING_FACTOR) * spacing, vf_footprint(view, z), z, inverse);
}

// The same where sigma is known.
static inline vf vf_sure_distance(const struct view_args *view, float d_min, vf sigma, vf spacing, vf z, vf inverse)
{
    const vf most = vf_set(PT_SPACING_FACTOR) * spacing, sure = vf_set(PT_SPACING_SURE) * spacing;
    const vf thick = vf_min(vf_max(vf_set(PT_SIGMAS) * sigma, sure), most);
    return vf_distance_of(d_min, thick, vf_footprint(view, z) * vf_set(PT_FOOTPRINT_SURE), z, inverse);
}

// 1 / max(|n.v|, C) of pixels.
static inline vf vf_gather_inverse(const float *normals, vi i, vm lanes)
{
    return vf_gather(normals, vi_add(vi_mul(i, vi_set(4)), vi_set(3)), lanes);
}

// d_eff at this view's level, given that of level 0 and 1 / max(|n.v|, C).
static inline vf vf_level_distance(const struct view_args *view, vf d, vf inverse, vf z)
{
    return view->level ? vf_max(d, vf_footprint(view, z) * inverse) : d;
}

// z at a ray of the plane through a point at z_q of another, given n . ray of both.
static inline vf vf_meet(vf z_q, vf dot_q, vf dot_p)
{
    vf sign = vf_select(vf_lt(dot_p, vf_zero()), vf_set(-1.0f), vf_set(1.0f)), size = vf_abs(dot_p);
    vm good = vf_lt(vf_set(1e-6f), size);
    vf r = vf_rcp(vf_select(good, size, vf_set(1.0f)));
    return vf_select(good, ((z_q * dot_q) * sign) * r, z_q);
}

// Which cell, of a level whose rows are `width` long, holds a pixel of level 0, whose rows are `from_width` long. The float
// quotient is off by one at most.
static inline vi vi_cell_of(vi pixel, uint32_t from_width, uint32_t level, uint32_t width)
{
    if (!level)
        return pixel;
    const vi across = vi_set(from_width), one = vi_set(1), none = vi_set(0);
    vi row = vf_int(vi_convert(pixel) / vi_convert(across)), column = vi_sub(pixel, vi_mul(row, across));
    const vm before = vi_lt_unsigned(vi_set(INT32_MAX), column), behind = vm_not(vm_or(before, vi_lt_unsigned(column, across)));
    row = vi_sub(vi_add(row, vi_select(behind, one, none)), vi_select(before, one, none));
    column = vi_sub(vi_add(column, vi_select(before, across, none)), vi_select(behind, across, none));
    return vi_add(vi_mul(vi_shr(row, (int)level), vi_set(width)), vi_shr(column, (int)level));
}

// How far z of a surface goes at most: as far beyond where it was measured as its span reaches along it. Where that cell of the
// level shows something else by now, as far as z_q.
static inline vf vf_farthest(const uint64_t *keys, const uint32_t *from, vi cell, vi source, vm lanes, vf z_q, vf span,
                             vf inverse)
{
    const vm shown = vm_and(lanes, vi_eq(vi_gather(from, cell, lanes), source));
    return vf_select(shown, vi_float(vi_gather_z(keys, cell, shown)) + span * vf_rcp(inverse), z_q);
}

// Or as far as what lies beside a pixel at z, if no farther from z than z from z_q: a gap's other side, or what is to hide a rim.
static inline vf vf_farther(vf farthest, vf beside, vf z_q, vf z)
{
    return vf_select(vf_le(beside, z + (z - z_q)), vf_max(farthest, beside), farthest);
}

// z at ray p of the plane with normal n through the point at (ray q, z_q), not nearer than z_q, not farther than
// z_q + limit. SPEC 2.2, refined filling.
static inline vf vf_plane_depth(const struct view_args *view, const vf n[3], const vf ray_q[2], vf z_q, const vf ray_p[2],
                                vf limit)
{
    const vf zero = vf_zero(), one = vf_set(1.0f);
    vf z = z_q;
    if (view->perspective) {
        vf dot_q = (n[0] * ray_q[0] + n[1] * ray_q[1]) - n[2], dot_p = (n[0] * ray_p[0] + n[1] * ray_p[1]) - n[2];
        z = vf_meet(z_q, dot_q, dot_p);
    } else {
        vf sign = vf_select(vf_lt(n[2], zero), vf_set(-1.0f), one), size = vf_abs(n[2]);
        vm good = vf_lt(vf_set(1e-6f), size);
        vf r = vf_rcp(vf_select(good, size, one));
        vf rise = (n[0] * (ray_p[0] - ray_q[0]) + n[1] * (ray_p[1] - ray_q[1])) * sign;
        z = vf_select(good, z_q + rise * r, z);
    }
    return vf_min(vf_max(z, z_q), z_q + limit);
}

#endif
