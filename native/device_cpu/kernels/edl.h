// SPDX-License-Identifier: GPL-3.0-or-later
// Eye-dome lighting over rows of f(z) in a ring: a logarithm a pixel, and every neighbour is a plain load.
#ifndef PT_EDL_H
#define PT_EDL_H

#include "device_cpu/picture_rows.h"
#include "shared/effects.h"

enum { PT_EDL_PAD = PT_EDL_MOST + 16 }; // floats before a row's first column and behind its last

// What a pixel's width is told from.
struct pt_edl_planes {
    const uint64_t *keys;
    const uint32_t *from;
    const float *deff, *normal;
};

#define PT_EDL_PLANES(call)                                                                                                    \
    (struct pt_edl_planes)                                                                                                     \
    {                                                                                                                          \
        PT_DATA(call, edl, keys), PT_DATA(call, edl, from), PT_DATA(call, edl, deff), PT_DATA(call, edl, normal)               \
    }

static inline size_t pt_edl_stride(uint32_t width) { return ((size_t)width + 15) / 16 * 16 + 2 * PT_EDL_PAD; }

// f(z) of PT_LANES pixels from (x, y) on; z is above 0 in perspective views.
static inline vf pt_edl_depth(const struct edl_args *args, vf z, uint32_t x, uint32_t y)
{
    if (!args->view.perspective)
        return z;
    const vf depth = vf_log2(z);
    if (!args->from_eye)
        return depth;
    vf ray[2];
    vf_ray(&args->view, x, y, ray);
    return depth + vf_set(0.5f) * vf_log2((ray[0] * ray[0] + ray[1] * ray[1]) + vf_set(1.0f));
}

// Row y of the plane.
static inline void pt_edl_load_row(const struct edl_args *args, const uint64_t *keys, int32_t y, float *row)
{
    const struct view_args *view = &args->view;
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z)), beyond = vf_set(PT_EDL_BEYOND);
    const uint32_t inside = y < 0 || y >= (int32_t)view->height ? 0 : view->width;
    keys += (ptrdiff_t)y * view->width;
    for (int32_t x = -PT_EDL_PAD; x < 0; x += PT_LANES)
        vf_store(row + x, beyond);
    for (uint32_t x = 0; x < inside; x += PT_LANES) {
        vf z = vi_float(vi_load_z(keys + x));
        vm some = vf_lt(z, empty);
        vf depth = vf_set(PT_EDL_EMPTY);
        if (vm_bits(some))
            depth = vf_select(some, pt_edl_depth(args, vf_select(some, z, vf_set(1.0f)), x, (uint32_t)y), depth);
        vf_store(row + x, depth);
    }
    for (uint32_t x = inside; x < view->width + PT_EDL_PAD; x++)
        row[x] = PT_EDL_BEYOND;
}

// A ring of 2 reach + 1 rows.
struct pt_edl_ring {
    float *rows;
    size_t stride;
    uint32_t count;
};

static inline float *pt_edl_row(const struct pt_edl_ring *ring, int32_t y)
{
    const uint32_t slot = (uint32_t)(y + (int32_t)ring->count) % ring->count;
    return ring->rows + slot * ring->stride + PT_EDL_PAD;
}

// Rows of each radius' neighbours, at the offset.
static inline void pt_edl_near(const struct edl_args *args, const struct pt_edl_ring *ring, int32_t y,
                               const float *near[PT_EDL_RADII * PT_EDL_NEIGHBOURS])
{
    for (int i = 0; i < PT_EDL_RADII * PT_EDL_NEIGHBOURS; i++)
        near[i] = pt_edl_row(ring, y + args->offsets[2 * i + 1]) + args->offsets[2 * i];
}

// Two spacings of the surfaces that pixels show, in pixels.
static inline vf pt_edl_width_at(const struct edl_args *args, const struct pt_edl_planes *planes, vi x, vi y, vm some)
{
    const struct view_args *view = &args->view;
    const vf one = vf_set(1.0f);
    const vi at = vi_add(vi_mul(y, vi_set(view->width)), x);
    const vf z = vf_select(some, vi_float(vi_gather_z(planes->keys, at, some)), one);
    const vi source = vi_and(vi_gather(planes->from, at, some), vi_set(~PT_FROM_MIXED));
    const vf deff = vf_select(some, vf_gather(planes->deff, source, some), one);
    vf n[4], ray[2];
    vf_gather4(planes->normal, source, some, n);
    for (int k = 0; k < 3; k++)
        n[k] = vf_select(some, n[k], vf_zero());
    vf_ray_of(view, x, y, ray);
    const vf across = deff * vf_min(vf_max(vf_cosine(view, n, ray), vf_set(PT_EDL_GRAZING)), one);
    return across * vf_rcp(vf_footprint(view, z));
}

// The least width of PT_LANES pixels from (x, y) on and of their first neighbours. Where a pixel's own is at most the first of
// wide, an upper bound: no more is known then, nor asked for.
static inline vf pt_edl_width(const struct edl_args *args, const struct pt_edl_planes *planes, uint32_t x, uint32_t y, vm some)
{
    const struct view_args *view = &args->view;
    const size_t at = (size_t)y * view->width + x;
    const vf one = vf_set(1.0f), first = vf_set(args->wide[0]), empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    const vf z = vf_select(some, vi_float(vi_load_z(planes->keys + at)), one);
    const vf deff = vf_gather(planes->deff, pt_source_of(planes->from, at), some);
    vf least = vf_select(some, deff, vf_zero()) * vf_rcp(vf_footprint(view, z));
    vm wide = vm_and(some, vf_lt(first, least));
    if (!vm_bits(wide))
        return least;
    const vi columns = vi_add(vi_set(x), vi_lanes());
    least = vf_select(wide, pt_edl_width_at(args, planes, columns, vi_set(y), wide), least);
    for (int i = 0; i < PT_EDL_NEIGHBOURS; i++) {
        wide = vm_and(wide, vf_lt(first, least));
        const vi qx = vi_add(columns, vi_set((uint32_t)args->offsets[2 * i]));
        const vi qy = vi_set(y + (uint32_t)args->offsets[2 * i + 1]);
        vm shown = vm_and(vi_lt_unsigned(qx, vi_set(view->width)), vi_lt_unsigned(qy, vi_set(view->height)));
        shown = vm_and(shown, wide);
        if (!vm_bits(shown))
            continue;
        const vi near = vi_add(vi_mul(qy, vi_set(view->width)), qx);
        shown = vm_and(shown, vf_lt(vi_float(vi_gather_z(planes->keys, near, shown)), empty));
        if (vm_bits(shown))
            least = vf_select(shown, vf_min(least, pt_edl_width_at(args, planes, qx, qy, shown)), least);
    }
    return least;
}

// What the colours of PT_LANES pixels from (x, y) on are multiplied with, where they show `some`.
static inline vf pt_edl_light(const struct edl_args *args, const struct pt_edl_planes *planes,
                              const float *const near[PT_EDL_RADII * PT_EDL_NEIGHBOURS], vf depth, uint32_t x, uint32_t y,
                              vm some)
{
    const vf zero = vf_zero(), most = vf_set(PT_EDL_STEP), scale = vf_set(args->scale),
             width = pt_edl_width(args, planes, x, y, some);
    const vf fade = vf_min(vf_max(vf_set(2.0f) - width * vf_set(args->narrow), zero), vf_set(1.0f));
    vf dark = zero;
    vm left = some;
    for (int radius = 0; radius < PT_EDL_RADII && vm_bits(left); radius++) {
        const vm wider = radius < PT_EDL_RADII - 1 ? vm_and(left, vf_lt(vf_set(args->wide[radius]), width)) : vm_of_bits(0);
        const vm here = vm_and(left, vm_not(wider));
        const float *const *ring = near + PT_EDL_NEIGHBOURS * radius;
        vf sum = zero;
        left = wider;
        if (!vm_bits(here))
            continue;
        for (int i = 0; i < PT_EDL_NEIGHBOURS; i++)
            sum = sum + vf_min(vf_max(scale * (depth - vf_load(ring[i] + x)), zero), most);
        dark = vf_select(here, (fade * vf_set(args->gain[radius])) * sum, dark);
    }
    return vf_exp2(zero - dark);
}

#endif
