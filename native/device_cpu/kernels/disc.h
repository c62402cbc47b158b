// SPDX-License-Identifier: GPL-3.0-or-later
// Points as flat discs: where they lie on screen, and which pixels they cover how deep. SPEC 5, solid; twin of
// shaders/lib/disc.glsl
//
// About the disc's middle (x, y), z: a pixel (dx, dy) away sees the disc's plane at z / q, q = 1 + gx dx + gy dy (orthographic:
// z + gx dx + gy dy), at (e dx + f dy) dx + g dy^2 over q^2 squared radii from the middle.
#ifndef PT_DISC_H
#define PT_DISC_H

#include "device_cpu/cpu.h"
#include "device_cpu/rows.h"
#include "device_cpu/simd.h"

struct pt_disc {
    float x, y, z, gx, gy, e, f, g;
    int32_t box[4];   // x0, y0, x1, y1: pixels of the window that it may cover, both ends included
    int32_t column, row; // that it falls into; not always in the window
    uint32_t id;
};

// PT_LANES of them as they are made.
struct pt_discs {
    vf x, y, z, radius;
    vf gx, gy, e, f, g;
    vi box[4], column, row;
    vf n[3];     // unit, towards the viewer; 0 where the point has none
    vm drawn;
};

struct pt_disc_source {
    const struct view_args *view;
    const struct disc_args *args;
    const struct chunk_view *chunk;
    const float *positions; // of the chunk
    const uint32_t *ids;    // of the chunk
    const uint32_t *surface;
    const float *radii;
};

static inline vf pt_clamp_far(vf x) { return vf_min(vf_max(x, vf_set(-PT_DISC_FAR)), vf_set(PT_DISC_FAR)); }

// Radii, world units; below PT_DISC_LEAST: none.
static inline vf pt_disc_radius(const struct disc_args *args, const float *radii, vi id, vi word, vm lanes)
{
    if (args->radius > 0.0f)
        return vf_set(args->radius);
    if (args->has_radii)
        return vf_min(vf_gather(radii, id, lanes) * vf_set(args->radius_scale), vf_set(PT_DISC_MOST));
    return vf_gather(args->instance.spacing, vi_shr(word, PT_SPACING_SHIFT), lanes) * vf_set(PT_DISC_SPACINGS);
}

// 2. box: of the ball around the disc, not beyond the window. Lanes without one are taken out of drawn.
static inline void pt_disc_box(const struct view_args *view, struct pt_discs *d)
{
    const vf half = vf_set(0.5f), one = vf_set(1.0f);
    const vf lower[2] = { vf_set((float)view->origin_x), vf_set((float)view->origin_y) };
    const vf upper[2] = { vf_set((float)(view->origin_x + (int32_t)view->width - 1)),
                          vf_set((float)(view->origin_y + (int32_t)view->height - 1)) };
    const vf at[2] = { d->x, d->y };
    const float start[2] = { view->ray_x0, view->ray_y0 }, step[2] = { view->ray_xs, view->ray_ys };
    vf before = one; // of the ball's nearest point: the camera's plane lies beyond it
    vm around = vm_of_bits(0);
    if (view->perspective) {
        vf nearest = d->z - d->radius;
        around = vm_not(vf_lt(d->z * vf_set(0x1p-10f), nearest));
        before = vf_rcp(vf_select(around, one, nearest));
    }
    for (int k = 0; k < 2; k++) {
        vf reach = d->radius;
        if (view->perspective) {
            vf slope = vf_set(start[k]) + vf_set(step[k]) * at[k], square = slope * slope + one;
            reach = (reach * (square * vf_rsqrt(square))) * before;
        }
        reach = vf_select(around, vf_set(PT_DISC_FAR), reach * vf_set(1.001f * pt_rcp(step[k])));
        vf own = vf_floor(at[k]), first = vf_floor(pt_clamp_far((at[k] - reach) + half)),
           last = vf_floor(pt_clamp_far((at[k] + reach) - half));
        first = vf_max(vf_min(first, own), lower[k]);
        last = vf_min(vf_max(last, own), upper[k]);
        d->drawn = vm_and(d->drawn, vf_le(first, last));
        vi origin = vi_set((uint32_t)(k ? view->origin_y : view->origin_x));
        d->box[k] = vi_sub(vf_int(first), origin);
        d->box[2 + k] = vi_sub(vf_int(last), origin);
        *(k ? &d->row : &d->column) = vi_sub(vf_int(own), origin);
    }
}

// 1. Projects those of a chunk's points that `slot` and `lanes` name; faces the viewer, radius, box. Returns their ids and
// surface words.
static inline void pt_disc_place(const struct pt_disc_source *s, vi slot, vm lanes, struct pt_discs *d, vi *id, vi *word)
{
    const struct view_args *view = s->view;
    const vf far = vf_set(PT_DISC_FAR);
    vf p[3], v[3];
    for (uint32_t k = 0; k < 3; k++)
        p[k] = vf_gather(s->positions + (size_t)k * s->chunk->padded, slot, lanes);
    d->z = vf_transform(s->chunk, 2, p[0], p[1], p[2]);
    d->x = vf_transform(s->chunk, 0, p[0], p[1], p[2]);
    d->y = vf_transform(s->chunk, 1, p[0], p[1], p[2]);
    if (view->perspective) {
        vf r = vf_rcp(d->z);
        d->x = d->x * r;
        d->y = d->y * r;
    }
    // NaN fails every comparison
    d->drawn = vm_and(vm_and(lanes, vm_and(vf_le(vf_set(view->z_near), d->z), vf_le(d->z, vf_set(view->z_far)))),
                      vm_and(vf_lt(vf_abs(d->x), far), vf_lt(vf_abs(d->y), far)));
    *id = vi_gather(s->ids, slot, d->drawn);
    *word = vi_gather(s->surface, *id, d->drawn);
    if (s->chunk->cull) {
        vf n[3];
        vf_decode_normal(*word, n);
        for (uint32_t k = 0; k < 3; k++)
            v[k] = vf_set(s->chunk->eye[k]) - vf_set(s->chunk->eye[3]) * p[k];
        vm away = vf_le((n[0] * v[0] + n[1] * v[1]) + n[2] * v[2], vf_zero());
        vm none = vi_eq(vi_and(*word, vi_set(PT_NORMAL_BITS)), vi_set(PT_NORMAL_NONE));
        d->drawn = vm_and(d->drawn, vm_not(vm_and(away, vm_not(none))));
    }
    d->radius = pt_disc_radius(s->args, s->radii, *id, *word, d->drawn);
    d->radius = vf_select(vf_le(vf_set(PT_DISC_LEAST), d->radius), d->radius, vf_zero());
    pt_disc_box(view, d);
}

// 3. plane and ellipse
static inline void pt_disc_shape(const struct pt_disc_source *s, vi word, struct pt_discs *d)
{
    const struct view_args *view = s->view;
    const vf zero = vf_zero(), one = vf_set(1.0f), xs = vf_set(view->ray_xs), ys = vf_set(view->ray_ys);
    vf u = zero, v = zero, n[3] = { zero, zero, one };
    vm none = vm_first(PT_LANES);
    if (view->perspective) {
        u = vf_set(view->ray_x0) + xs * d->x;
        v = vf_set(view->ray_y0) + ys * d->y;
    }
    // the normal; without one: that of the picture
    if (s->args->instance.has_normals) {
        vf own[3];
        vf_view_normal(&s->args->instance, word, own);
        vf square = (own[0] * own[0] + own[1] * own[1]) + own[2] * own[2];
        none = vi_eq(vi_and(word, vi_set(PT_NORMAL_BITS)), vi_set(PT_NORMAL_NONE));
        none = vm_or(none, vm_not(vf_le(vf_set(1e-30f), square)));
        vf scale = vf_rsqrt(square);
        for (int k = 0; k < 3; k++)
            n[k] = vf_select(none, n[k], own[k] * scale);
    }
    // how steep the plane is
    vf facing = (n[0] * u + n[1] * v) - n[2];
    vm away = vf_lt(zero, facing);
    vf size = vf_abs(facing);
    vm flat = vm_and(vf_le(vf_set(PT_DISC_LEAST), d->radius), vf_le(vf_set(PT_DISC_TILT), size));
    vf inverse = vf_rcp(vf_select(flat, size, one));
    for (int k = 0; k < 3; k++) // towards the viewer: facing = -size
        n[k] = vf_select(away, zero - n[k], n[k]);
    d->gx = (n[0] * xs) * inverse;
    d->gy = (n[1] * ys) * inverse;
    for (int k = 0; k < 3; k++)
        d->n[k] = vf_select(none, zero, n[k]);
    vf fine = vf_rcp(vf_select(flat, d->radius, one));
    if (view->perspective) {
        d->gx = zero - d->gx;
        d->gy = zero - d->gy;
        fine = d->z * fine;
    }
    flat = vm_and(flat, vf_le(fine, vf_set(PT_DISC_FINE)));
    // a step of a pixel along x, y: (xs - gx u, -gx v, gx), (-gy u, ys - gy v, gy) times z / q
    vf a[2] = { xs - d->gx * u, d->gx * v }, b[2] = { d->gy * u, ys - d->gy * v };
    d->e = ((a[0] * a[0] + a[1] * a[1]) + d->gx * d->gx) * fine * fine;
    d->f = ((d->gx * d->gy - a[0] * b[0]) - a[1] * b[1]) * (fine + fine) * fine;
    d->g = ((b[0] * b[0] + b[1] * b[1]) + d->gy * d->gy) * fine * fine;
    // its pixel alone
    d->gx = vf_select(flat, d->gx, zero);
    d->gy = vf_select(flat, d->gy, zero);
    d->e = vf_select(flat, d->e, vf_set(1e20f));
    d->f = vf_select(flat, d->f, zero);
    d->g = vf_select(flat, d->g, vf_set(1e20f));
}

static inline void pt_disc_store(const struct pt_discs *d, vi id, struct pt_disc out[PT_LANES])
{
    const vf *const numbers[8] = { &d->x, &d->y, &d->z, &d->gx, &d->gy, &d->e, &d->f, &d->g };
    const vi *const words[7] = { &d->box[0], &d->box[1], &d->box[2], &d->box[3], &d->column, &d->row, &id };
    uint32_t lanes[15][PT_LANES];
    for (int k = 0; k < 8; k++)
        vf_store((float *)lanes[k], *numbers[k], vm_first(PT_LANES));
    for (int k = 0; k < 7; k++)
        vi_store(lanes[8 + k], *words[k], vm_first(PT_LANES));
    for (uint32_t i = 0; i < PT_LANES; i++)
        for (int k = 0; k < 15; k++)
            memcpy((char *)&out[i] + 4 * k, &lanes[k][i], 4);
}
_Static_assert(sizeof(struct pt_disc) == 60, "pt_disc_store writes its words one after another");

// What of PT_LANES pixels of the window from (x, y) on the disc covers: their depths; `beside` are covered by the point alone.
// square: distance over radius squared, where covered and not beside. inverse_q is left for it.
static inline vm pt_disc_pixels(const struct view_args *view, const struct pt_disc *d, int32_t x, int32_t y, vm lanes, vf *z,
                                vf *square, vm *beside)
{
    const vf half = vf_set(0.5f), one = vf_set(1.0f);
    vf dx = (vi_convert(vi_add(vi_set((uint32_t)(view->origin_x + x)), vi_lanes())) + half) - vf_set(d->x);
    vf dy = (vf_set((float)(view->origin_y + y)) + half) - vf_set(d->y);
    vf slope = vf_set(d->gx) * dx + vf_set(d->gy) * dy, q = one, inverse = one;
    *square = (vf_set(d->e) * dx + vf_set(d->f) * dy) * dx + (vf_set(d->g) * dy) * dy;
    vm covered = lanes;
    if (view->perspective) {
        q = one + slope;
        covered = vm_and(covered, vf_le(vf_set(PT_DISC_LEAST), q));
        inverse = vf_rcp(q);
        *z = vf_set(d->z) * inverse;
        *square = *square * (inverse * inverse);
    } else {
        *z = vf_set(d->z) + slope;
    }
    covered = vm_and(covered, vf_le(*square, one));
    *beside = vm_of_bits(0);
    if (y == d->row) {
        vm own = vm_and(lanes, vi_eq(vi_add(vi_set((uint32_t)x), vi_lanes()), vi_set((uint32_t)d->column)));
        *beside = vm_and(own, vm_not(covered));
        *z = vf_select(*beside, vf_set(d->z), *z);
        covered = vm_or(covered, own);
    }
    return vm_and(covered, vm_and(vf_le(vf_set(view->z_near), *z), vf_le(*z, vf_set(view->z_far))));
}

// The weights of those pixels: exp(-2 square) within 2.4e-4; in its own pixel the disc is a pixel wide at least.
static inline vf pt_disc_weights(const struct view_args *view, const struct pt_disc *d, int32_t x, int32_t y, vf square, vm beside)
{
    if (y == d->row) {
        const vf half = vf_set(0.5f), two = vf_set(2.0f);
        vf dx = (vi_convert(vi_add(vi_set((uint32_t)(view->origin_x + x)), vi_lanes())) + half) - vf_set(d->x);
        vf dy = (vf_set((float)(view->origin_y + y)) + half) - vf_set(d->y), pixel = (dx * dx + dy * dy) * two;
        vm own = vi_eq(vi_add(vi_set((uint32_t)x), vi_lanes()), vi_set((uint32_t)d->column));
        square = vf_select(beside, pixel, square);
        square = vf_select(own, vf_min(pixel, square), square);
    }
    vf w = vf_set(0.25565624f) * square - vf_set(1.03321445f);
    w = w * square + vf_set(1.90144324f);
    w = w * square - vf_set(1.98814547f);
    return w * square + vf_set(0.99976468f);
}

#endif
