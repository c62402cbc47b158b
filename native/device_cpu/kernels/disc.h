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

// PT_LANES of them.
struct pt_discs {
    vf x, y, z, radius;
    vf gx, gy, e, f, g;
    vi box[4];      // x0, y0, x1, y1: pixels of the window that they may cover, both ends included
    vi column, row; // that they fall into; not always in the window
    vi id;          // in their cloud
    vf n[3];        // unit, towards the viewer; 0 where the point has none
    vm drawn;
};

enum { PT_DISC_TILE = 64 }; // pixels

struct pt_disc_source {
    const struct view_args *view;
    const struct disc_args *args;
    const struct chunk_view *chunk;
    const float *positions; // of the chunk
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

// 1. Projects points of a chunk, at p.
static inline void pt_disc_project(const struct pt_disc_source *s, const vf p[3], vm lanes, struct pt_discs *d)
{
    const struct view_args *view = s->view;
    const vf far = vf_set(PT_DISC_FAR);
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
}

// Leaves out those that face away: positions p, surface words.
static inline void pt_disc_cull(const struct pt_disc_source *s, const vf p[3], vi word, struct pt_discs *d)
{
    vf n[3], v[3];
    if (!s->chunk->cull)
        return;
    vf_decode_normal(word, n);
    for (uint32_t k = 0; k < 3; k++)
        v[k] = vf_set(s->chunk->eye[k]) - vf_set(s->chunk->eye[3]) * p[k];
    vm away = vf_le((n[0] * v[0] + n[1] * v[1]) + n[2] * v[2], vf_zero());
    vm none = vi_eq(vi_and(word, vi_set(PT_NORMAL_BITS)), vi_set(PT_NORMAL_NONE));
    d->drawn = vm_and(d->drawn, vm_not(vm_and(away, vm_not(none))));
}

// Radius and box, by the surface words.
static inline void pt_disc_size(const struct pt_disc_source *s, vi word, struct pt_discs *d)
{
    d->radius = pt_disc_radius(s->args, s->radii, d->id, word, d->drawn);
    d->radius = vf_select(vf_le(vf_set(PT_DISC_LEAST), d->radius), d->radius, vf_zero());
    pt_disc_box(s->view, d);
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

// 4. The ellipse's own box, which is smaller, where it is no needle and its middle lies in the window: within q of
// e dx^2 + f dx dy + g dy^2 = q^2, for the greatest q there is. Leaves out no pixel that is covered.
static inline void pt_disc_tighten(const struct view_args *view, struct pt_discs *d)
{
    const vf half = vf_set(0.5f), one = vf_set(1.0f), slack = vf_set(0.02f);
    const vf determinant = d->e * d->g - (d->f * d->f) * vf_set(0.25f);
    const vf inverse = vf_rcp(vf_max(determinant, vf_set(1e-30f)));
    const vf at[2] = { d->x, d->y }, size[2] = { d->g, d->e };
    vm round = vm_and(vf_le((d->e * d->g) * vf_set(1e-3f), determinant), vf_le(vf_set(1e-30f), determinant));
    vf first[2], last[2], own[2], most = one;
    for (int k = 0; k < 2; k++) {
        first[k] = vi_convert(d->box[k]);
        last[k] = vi_convert(d->box[2 + k]);
        own[k] = vi_convert(k ? d->row : d->column);
        round = vm_and(round, vm_and(vf_le(first[k], own[k]), vf_le(own[k], last[k])));
        most = most + vf_abs(k ? d->gy : d->gx) * ((last[k] - first[k]) + one);
    }
    for (int k = 0; k < 2; k++) {
        const vf square = vf_max(size[k] * inverse, vf_set(1e-12f)), origin = vf_set((float)(k ? view->origin_y : view->origin_x));
        const vf reach = pt_clamp_far((square * vf_rsqrt(square)) * (most * vf_set(1.001f)) + slack);
        const vf begin = vf_floor((at[k] - reach) + half) - origin, end = vf_floor((at[k] + reach) - half) - origin;
        d->box[k] = vi_select(round, vf_int(vf_min(vf_max(first[k], begin), own[k])), d->box[k]);
        d->box[2 + k] = vi_select(round, vf_int(vf_max(vf_min(last[k], end), own[k])), d->box[2 + k]);
    }
}

// A part of the window: first column and row, and how many.
struct pt_disc_tile {
    int32_t x, y, width, height;
};

// What discs show of one pixel each.
struct pt_disc_pixels {
    uint32_t index[PT_LANES]; // of the pixel in the tile, rows of PT_DISC_TILE
    uint32_t z[PT_LANES];     // its depth there, bits
    float weight[PT_LANES];
};

typedef void pt_disc_work(void *context, uint32_t covered, const struct pt_disc_pixels *pixels);

// The greatest of some lanes.
static inline uint32_t pt_most_of(vi value, uint32_t lanes)
{
    uint32_t each[PT_LANES], most = 0;
    vi_store(each, value, vm_first(PT_LANES));
    for (; lanes; lanes &= lanes - 1)
        most = each[__builtin_ctz(lanes)] > most ? each[__builtin_ctz(lanes)] : most;
    return most;
}

static inline vi pt_lesser(vi a, vi b) { return vi_select(vi_lt_unsigned(a, b), a, b); }

// Calls work for the pixels of a tile that the discs cover: one disc a lane, all of them a step to the right or up at a time.
// (They are a few pixels wide: lanes along a row would idle, and what is done with a pixel comes one at a time anyway.)
// weigh: 1 with weights, exp(-2 s) within 2.4e-4, s squared distance over radius squared; in its own pixel a disc is a pixel
// wide at least.
static inline __attribute__((always_inline)) void pt_disc_draw(const struct view_args *view, const struct pt_discs *d,
                                                               const struct pt_disc_tile *tile, int weigh, pt_disc_work *work,
                                                               void *context)
{
    const vf half = vf_set(0.5f), one = vf_set(1.0f), two = vf_set(2.0f), least = vf_set(PT_DISC_LEAST);
    const vf z_near = vf_set(view->z_near), z_far = vf_set(view->z_far);
    const vi tile_x = vi_set((uint32_t)tile->x), tile_y = vi_set((uint32_t)tile->y), next = vi_set(1);
    // boxes within the tile
    const vi x0 = vi_select(vi_lt_unsigned(d->box[0], tile_x), tile_x, d->box[0]);
    const vi y0 = vi_select(vi_lt_unsigned(d->box[1], tile_y), tile_y, d->box[1]);
    const vi x1 = pt_lesser(vi_add(d->box[2], next), vi_set((uint32_t)(tile->x + tile->width)));
    const vi y1 = pt_lesser(vi_add(d->box[3], next), vi_set((uint32_t)(tile->y + tile->height)));
    const vm inside = vm_and(d->drawn, vm_and(vi_lt_unsigned(x0, x1), vi_lt_unsigned(y0, y1)));
    const uint32_t lanes = vm_bits(inside);
    const vi columns = vi_sub(x1, x0), rows = vi_sub(y1, y0), own_column = vi_sub(d->column, x0), own_row = vi_sub(d->row, y0);
    const uint32_t most_columns = pt_most_of(columns, lanes), most_rows = pt_most_of(rows, lanes);
    // halves of pixels are exact: the window's corner, then a step at a time
    const vf first_x = vi_convert(vi_add(vi_set((uint32_t)view->origin_x), x0)) + half;
    vf py = vi_convert(vi_add(vi_set((uint32_t)view->origin_y), y0)) + half;
    vi row = vi_add(vi_mul(vi_sub(y0, tile_y), vi_set(PT_DISC_TILE)), vi_sub(x0, tile_x));
    // discs that may pass the ends of the view
    const vf reach = d->radius * vf_set(1.01f);
    const int ends = (vm_bits(vm_and(vf_le(z_near, d->z - reach), vf_le(d->z + reach, z_far))) & lanes) != lanes;
    struct pt_disc_pixels pixels;
    for (uint32_t j = 0; j < most_rows; j++, py = py + one, row = vi_add(row, vi_set(PT_DISC_TILE))) {
        const vm in_rows = vm_and(inside, vi_lt_unsigned(vi_set(j), rows)), in_own = vm_and(in_rows, vi_eq(own_row, vi_set(j)));
        const vf dy = py - d->y, rise = d->gy * dy, cross = d->f * dy, along = (d->g * dy) * dy;
        vf px = first_x;
        for (uint32_t i = 0; i < most_columns; i++, px = px + one) {
            const vm lane = vm_and(in_rows, vi_lt_unsigned(vi_set(i), columns)), own = vm_and(lane, vm_and(in_own, vi_eq(own_column, vi_set(i))));
            const vf dx = px - d->x, slope = d->gx * dx + rise;
            vf square = (d->e * dx + cross) * dx + along, z = d->z + slope;
            vm covered = lane;
            if (view->perspective) {
                const vf q = one + slope, inverse = vf_rcp(q);
                covered = vm_and(covered, vf_le(least, q));
                z = d->z * inverse;
                square = square * (inverse * inverse);
            }
            covered = vm_and(covered, vf_le(square, one));
            const vm beside = vm_and(own, vm_not(covered)); // covered by the point alone
            z = vf_select(beside, d->z, z);
            covered = vm_or(covered, beside);
            if (ends)
                covered = vm_and(covered, vm_and(vf_le(z_near, z), vf_le(z, z_far)));
            const uint32_t bits = vm_bits(covered);
            if (!bits)
                continue;
            vi_store(pixels.index, vi_add(row, vi_set(i)), vm_first(PT_LANES));
            vi_store(pixels.z, vi_and(vf_bits(z), vi_set(0x7FFFFFFFu)), vm_first(PT_LANES)); // the sign bit of -0 is dropped
            if (weigh) {
                if (vm_bits(own)) {
                    const vf pixel = (dx * dx + dy * dy) * two;
                    square = vf_select(own, vf_select(beside, pixel, vf_min(pixel, square)), square);
                }
                vf w = vf_set(0.25565624f) * square - vf_set(1.03321445f);
                w = w * square + vf_set(1.90144324f);
                w = w * square - vf_set(1.98814547f);
                w = w * square + vf_set(0.99976468f);
                vf_store(pixels.weight, w, vm_first(PT_LANES));
            }
            work(context, bits, &pixels);
        }
    }
}

#endif
