// SPDX-License-Identifier: GPL-3.0-or-later
// Points as flat discs: where they lie on screen, and which pixels they cover how deep. SPEC 5, solid; twin of
// shaders/lib/disc.glsl
//
// About the disc's middle (x, y), z: a pixel (dx, dy) away sees the disc's plane at z / q, q = 1 + gx dx + gy dy (orthographic:
// z + gx dx + gy dy), at e w^2 + m dy^2 over q^2 squared radii from the middle, w = dx + h dy. Neither term is negative, so
// that nothing cancels however flat the disc is seen.
#ifndef PT_DISC_H
#define PT_DISC_H

#include "device_cpu/cpu.h"
#include "device_cpu/rows.h"
#include "device_cpu/points.h"
#include "shared/discs.h"

// PT_LANES of them.
struct pt_discs {
    vf x, y, z, radius; // radius: of the major half axis
    vi shape;           // word, with PT_RADII_SHAPES
    vf ratio;           // with PT_RADII_SHAPES: of the half axes, 1 at least
    vf reach[2];        // no farther does the ball around, pixels
    vf low[2], high[2]; // nor beyond these
    vf widest;          // q at most, within the disc
    vf gx, gy, e, h, m;
    vm gentle;      // the slope within reach is at most PT_DISC_GENTLE
    vi box[4];      // x0, y0, x1, y1: pixels of the window that they may cover, both ends included
    vi column, row; // that they fall into; not always in the window
    vi id;          // in their cloud
    vf n[3];        // unit, towards the viewer; 0 where the point has none
    vm drawn;
};

struct pt_disc_source {
    const struct view_args *view;
    const struct disc_args *args;
    const struct chunk_view *chunk;
    const uint32_t *points;  // of the chunk
    const uint32_t *surfels; // of the chunk
    const void *radii;       // floats or shape words
};

static inline vf pt_clamp_far(vf x) { return vf_min(vf_max(x, vf_set(-PT_DISC_FAR)), vf_set(PT_DISC_FAR)); }

static const float pt_shape_cosines[64] = {PT_SHAPE_COSINES}, pt_shape_sines[64] = {PT_SHAPE_SINES},
                   pt_shape_ratios[32] = {PT_SHAPE_RATIOS};

// Whether discs have the half axes of their points' shapes.
static inline int pt_disc_shaped(const struct disc_args *args)
{
    return args->has_radii == PT_RADII_SHAPES && !(args->radius > 0.0f);
}

// Radii, world units; below PT_DISC_LEAST: none.
static inline void pt_disc_size(const struct disc_args *args, const void *radii, vi id, vi word, vm lanes, struct pt_discs *d)
{
    const float *spacing = args->instance.spacing;
    vf radius = vf_set(args->radius);
    if (pt_disc_shaped(args)) {
        d->shape = vi_gather(radii, id, lanes);
        const vi kind = vi_and(vi_shr(d->shape, PT_SHAPE_KIND_SHIFT), vi_set(7));
        radius = vf_look_up(spacing, PT_SPACINGS, vi_and(d->shape, vi_set(PT_SHAPE_CLASS_BITS)));
        radius = vf_select(vi_eq(kind, vi_set(PT_KIND_SURFACE)), radius * vf_set(args->surface_scale), radius);
        d->ratio = vf_look_up(pt_shape_ratios, 32, vi_and(vi_shr(d->shape, PT_SHAPE_RATIO_SHIFT), vi_set(15)));
    } else if (!(args->radius > 0.0f) && args->has_radii) {
        radius = vf_min(vf_gather(radii, id, lanes) * vf_set(args->radius_scale), vf_set(PT_DISC_MOST));
    } else if (!(args->radius > 0.0f)) {
        radius = vf_look_up(spacing, PT_SPACINGS, vi_shr(word, PT_SPACING_SHIFT)) * vf_set(PT_DISC_SPACINGS);
    }
    if (args->radius_most > 0.0f) { // the minor half axis is shortened last
        const vf one = vf_set(1.0f), most = vf_set(args->radius_most);
        const vm beyond = vf_lt(most, radius);
        if (pt_disc_shaped(args))
            d->ratio = vf_max(d->ratio * vf_select(beyond, most * vf_rcp(vf_select(beyond, radius, one)), one), one);
        radius = vf_select(beyond, most, radius);
    }
    d->radius = vf_select(vf_le(vf_set(PT_DISC_LEAST), radius), radius, vf_zero());
}

// Balls wider than a 32nd of their depth: where exactly they are seen. One whose rim the camera's plane cuts has an end all
// the same, towards the view's axis: what passes the eye closely far outside the view is not drawn across it.
static inline void pt_disc_near(const struct view_args *view, vm wide, struct pt_discs *d)
{
    const vf zero = vf_zero(), one = vf_set(1.0f), at[2] = {d->x, d->y}, far = vf_set(PT_DISC_FAR);
    const float start[2] = {view->ray_x0, view->ray_y0}, step[2] = {view->ray_xs, view->ray_ys};
    const vf k = (d->radius * vf_set(1.001f)) * vf_rcp(d->z), left = one - k * k;
    const vm before = vf_le(vf_set(0.015625f), left); // the camera's plane
    const vf inverse = vf_rcp(vf_select(before, left, one));
    for (int i = 0; i < 2; i++) {
        const vf slope = vf_set(start[i]) + vf_set(step[i]) * at[i], u = vf_abs(slope), square = u * u + one;
        const vf room = square - k * k; // the eye lies outside the ball, seen along the other axis
        const vm outside = vf_le(square * vf_set(0.0009765625f), room);
        const vf safe = vf_select(outside, room, one), root = safe * vf_rsqrt(safe);
        const vf pixels = vf_set(1.001f * pt_rcp(step[i]));
        const vf towards = (((k * (u * root + k)) * vf_rcp(vf_select(wide, u + k * root, one)))) * pixels; // the axis
        const vf beyond = ((k * (root + u * k)) * inverse) * pixels;
        const vf inner = vf_select(outside, towards, far), outer = vf_select(vm_and(outside, before), beyond, far);
        const vm right = vf_le(zero, slope);
        const vf low = at[i] - vf_select(right, inner, outer), high = at[i] + vf_select(right, outer, inner);
        d->low[i] = vf_select(wide, vf_max(low, d->low[i]), d->low[i]);
        d->high[i] = vf_select(wide, vf_min(high, d->high[i]), d->high[i]);
    }
}

// 2. The ball around the disc: how many pixels it reaches to the sides.
static inline void pt_disc_reach(const struct view_args *view, struct pt_discs *d)
{
    const vf one = vf_set(1.0f), at[2] = {d->x, d->y};
    const float start[2] = {view->ray_x0, view->ray_y0}, step[2] = {view->ray_xs, view->ray_ys};
    vf before = one; // of the ball's nearest point: the camera's plane lies beyond it
    vm around = vm_of_bits(0);
    d->widest = one;
    if (view->perspective) {
        vf nearest = d->z - d->radius;
        around = vm_not(vf_lt(d->z * vf_set(0.03125f), nearest));
        before = vf_rcp(vf_select(around, one, nearest));
        d->widest = vf_select(around, vf_set(PT_DISC_FAR), (d->z * before) * vf_set(1.05f));
    }
    for (int k = 0; k < 2; k++) {
        vf reach = d->radius;
        if (view->perspective) {
            vf slope = vf_set(start[k]) + vf_set(step[k]) * at[k], square = slope * slope + one;
            reach = (reach * (square * vf_rsqrt(square))) * before;
        }
        d->reach[k] = vf_select(around, vf_set(PT_DISC_FAR), reach * vf_set(1.001f * pt_rcp(step[k])));
        d->low[k] = at[k] - d->reach[k];
        d->high[k] = at[k] + d->reach[k];
    }
    const vm wide = vf_lt(d->z * vf_set(0.03125f), d->radius);
    if (view->perspective && vm_bits(vm_and(wide, d->drawn)))
        pt_disc_near(view, wide, d);
}

// The box of what lies between low and high, not beyond the window. Lanes without one are taken out of drawn.
static inline void pt_disc_box(const struct view_args *view, const vf low[2], const vf high[2], struct pt_discs *d)
{
    const vf half = vf_set(0.5f), at[2] = {d->x, d->y};
    const int32_t origin[2] = {view->origin_x, view->origin_y};
    const uint32_t size[2] = {view->width, view->height};
    for (int k = 0; k < 2; k++) {
        vf own = vf_floor(at[k]), first = vf_floor(pt_clamp_far(low[k] + half)), last = vf_floor(pt_clamp_far(high[k] - half));
        first = vf_max(vf_min(first, own), vf_set((float)origin[k]));
        last = vf_min(vf_max(last, own), vf_set((float)(origin[k] + (int32_t)size[k] - 1)));
        d->drawn = vm_and(d->drawn, vf_le(first, last));
        d->box[k] = vi_sub(vf_int(first), vi_set((uint32_t)origin[k]));
        d->box[2 + k] = vi_sub(vf_int(last), vi_set((uint32_t)origin[k]));
        *(k ? &d->row : &d->column) = vi_sub(vf_int(own), vi_set((uint32_t)origin[k]));
    }
}

// 1. Projects points of a chunk, at p.
static inline void pt_disc_project(const struct pt_disc_source *s, const vf p[3], vm lanes, struct pt_discs *d)
{
    const struct view_args *view = s->view;
    const vf far = vf_set(PT_DISC_FAR);
    vf at[3];
    pt_project(view, s->chunk, p, at);
    d->x = at[0];
    d->y = at[1];
    d->z = at[2];
    // NaN fails every comparison
    d->drawn = vm_and(vm_and(lanes, vm_and(vf_le(vf_set(view->z_near), d->z), vf_le(d->z, vf_set(view->z_far)))),
                      vm_and(vf_lt(vf_abs(d->x), far), vf_lt(vf_abs(d->y), far)));
}

// Leaves out those that face away: positions p, surfels.
static inline void pt_disc_cull(const struct pt_disc_source *s, const vf p[3], vi word, struct pt_discs *d)
{
    if (s->chunk->cull)
        d->drawn = vm_and(d->drawn, vm_not(pt_faces_away(s->chunk, word, p)));
}

// The half axes of shapes in view space: as covectors, of which offsets in the plane get their share of each half axis when
// they are divided by the radius. normal: in the object, not yet unit. SPEC 11.
static inline void pt_disc_axes(const struct disc_args *args, const struct pt_discs *d, const vf normal[3], vf axes[2][3])
{
    const vf one = vf_set(1.0f), zero = vf_zero();
    const vf scale = vf_rsqrt((normal[0] * normal[0] + normal[1] * normal[1]) + normal[2] * normal[2]);
    const vf x = normal[0] * scale, y = normal[1] * scale, z = normal[2] * scale;
    const vm up = vf_le(vf_set(PT_SHAPE_UP), z);
    const vf a = vf_rcp(one + vf_abs(z)), b = (x * y) * a;
    const vf c = one - (y * y) * a;
    const vf t1[3] = {one - (x * x) * a, zero - b, vf_select(up, zero - x, x)};
    const vf t2[3] = {vf_select(up, zero - b, b), vf_select(up, c, zero - c), zero - y};
    const vi angle = vi_and(vi_shr(d->shape, PT_SHAPE_ANGLE_SHIFT), vi_set(63));
    const vf cosine = vf_look_up(pt_shape_cosines, 64, angle), sine = vf_look_up(pt_shape_sines, 64, angle);
    const vf short_scale = d->ratio * vf_set(args->instance.axis_scale), long_scale = vf_set(args->instance.axis_scale);
    const float *m = args->instance.normal_matrix;
    vf along[3], across[3];
    for (int k = 0; k < 3; k++) {
        along[k] = cosine * t1[k] + sine * t2[k];
        across[k] = cosine * t2[k] - sine * t1[k];
    }
    for (int k = 0; k < 3; k++) {
        axes[0][k] = ((vf_set(m[3 * k]) * along[0] + vf_set(m[3 * k + 1]) * along[1]) + vf_set(m[3 * k + 2]) * along[2]) *
                     long_scale;
        axes[1][k] = ((vf_set(m[3 * k]) * across[0] + vf_set(m[3 * k + 1]) * across[1]) + vf_set(m[3 * k + 2]) * across[2]) *
                     short_scale;
    }
}

// 3. plane and ellipse
static inline void pt_disc_shape(const struct view_args *view, const struct disc_args *args, vi word, struct pt_discs *d)
{
    const vf zero = vf_zero(), one = vf_set(1.0f), xs = vf_set(view->ray_xs), ys = vf_set(view->ray_ys);
    vf u = zero, v = zero, n[3] = {zero, zero, one}, object[3] = {zero, zero, one};
    vm none = vm_first(PT_LANES);
    if (view->perspective) {
        u = vf_set(view->ray_x0) + xs * d->x;
        v = vf_set(view->ray_y0) + ys * d->y;
    }
    // the normal; without one: that of the picture
    if (args->instance.has_normals) {
        const float *m = args->instance.normal_matrix;
        vf own[3];
        vf_decode_normal(word, object);
        for (int k = 0; k < 3; k++)
            own[k] = (vf_set(m[3 * k]) * object[0] + vf_set(m[3 * k + 1]) * object[1]) + vf_set(m[3 * k + 2]) * object[2];
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
    // a step of a pixel along x, y: (xs - gx u, -gx v, gx), (-gy u, ys - gy v, gy) times z / q, in radii (orthographic: depth is
    // -z); their squares and product, and the area that they span
    const vf sign = vf_set(view->perspective ? 1.0f : -1.0f);
    const vf a[3] = {(xs - d->gx * u) * fine, (d->gx * v) * fine, (sign * d->gx) * fine};
    const vf b[3] = {(d->gy * u) * fine, (ys - d->gy * v) * fine, (sign * d->gy) * fine};
    vf e = (a[0] * a[0] + a[1] * a[1]) + a[2] * a[2], f = (a[2] * b[2] - a[0] * b[0]) - a[1] * b[1];
    vf area = ((xs * fine) * (ys * fine)) * inverse;
    if (args->instance.has_normals && pt_disc_shaped(args)) {
        vf axes[2][3], p[2], q[2];
        pt_disc_axes(args, d, object, axes);
        for (int k = 0; k < 2; k++) {
            p[k] = (a[0] * axes[k][0] - a[1] * axes[k][1]) + a[2] * axes[k][2];
            q[k] = (b[1] * axes[k][1] - b[0] * axes[k][0]) + b[2] * axes[k][2];
        }
        const vf turn = (n[0] * (axes[0][1] * axes[1][2] - axes[0][2] * axes[1][1]) +
                         n[1] * (axes[0][2] * axes[1][0] - axes[0][0] * axes[1][2])) +
                        n[2] * (axes[0][0] * axes[1][1] - axes[0][1] * axes[1][0]);
        e = vf_select(none, e, p[0] * p[0] + p[1] * p[1]);
        f = vf_select(none, f, p[0] * q[0] + p[1] * q[1]);
        area = vf_select(none, area, area * vf_abs(turn));
    }
    const vf part = vf_rcp(vf_max(e, vf_set(PT_DISC_LEAST)));
    // or its pixel alone
    d->gx = vf_select(flat, d->gx, zero);
    d->gy = vf_select(flat, d->gy, zero);
    d->e = vf_select(flat, e, vf_set(1e20f));
    d->h = vf_select(flat, f * part, zero);
    d->m = vf_select(flat, area * (area * part), vf_set(1e20f));
    d->gentle = vf_le(vf_abs(d->gx) * (d->reach[0] + one) + vf_abs(d->gy) * (d->reach[1] + one), vf_set(PT_DISC_GENTLE));
}

// 4. The ellipse's own box, which is smaller: within q of e w^2 + m dy^2 = q^2, for the greatest q that the disc has. Leaves out
// no pixel that is covered.
static inline void pt_disc_tight_box(const struct view_args *view, struct pt_discs *d)
{
    const vf one = vf_set(1.0f), least = vf_set(PT_DISC_LEAST), at[2] = {d->x, d->y};
    const vm known = vm_and(vf_le(least, d->e), vf_le(least, d->m));
    vf most = one, low[2], high[2];
    if (view->perspective)
        most = vf_min((one + vf_abs(d->gx) * (d->reach[0] + one)) + vf_abs(d->gy) * (d->reach[1] + one), d->widest);
    most = most * vf_set(1.001f);
    const vf up = vf_rsqrt(vf_max(d->m, least)), beside = d->h * up;
    const vf square = vf_max(beside * beside + vf_rcp(vf_max(d->e, least)), vf_set(1e-12f)); // of what it reaches to the sides
    const vf own[2] = {square * vf_rsqrt(square), up};
    for (int k = 0; k < 2; k++) {
        const vf reach = own[k] * most + vf_set(0.02f);
        low[k] = vf_select(known, vf_max(at[k] - reach, d->low[k]), d->low[k]);
        high[k] = vf_select(known, vf_min(at[k] + reach, d->high[k]), d->high[k]);
    }
    pt_disc_box(view, low, high, d);
}

// A part of the window: first column and row, and how many.
struct pt_disc_tile {
    int32_t x, y, width, height;
};

// Pixels are looked at PT_LANES at a time, of one disc: rows of eight, as wide as most discs. (With a disc a lane, what is done
// with a pixel comes one at a time.) These patches are listed first and seen then, so that no branch waits for their
// arithmetic: a million points took 59 ms with AVX-512, where branches did 74.
enum {
    PT_PATCH_COLUMNS = PT_LANES < 8 ? PT_LANES : 8,
    PT_PATCH_ROWS = PT_LANES / PT_PATCH_COLUMNS,
    PT_PATCH_BEYOND = (PT_PATCH_ROWS - 1) * PT_DISC_TILE + PT_PATCH_COLUMNS, // pixels after a tile's that may be touched
    PT_LIST_ROWS = 8, // that are listed at once: with four splat takes 1.05 of the time with AVX2
    PT_PATCHES = 64,  // PT_LANES lists, at least
};

#if defined(PT_ISA_AVX512)
typedef uint16_t pt_patch_box;
#else
typedef uint8_t pt_patch_box;
#endif

// Discs, their numbers one by one, and their patches.
struct pt_patches {
    const struct view_args *view;
    struct pt_disc_tile tile;
    float middle_x[PT_DISC_TILE + PT_PATCH_COLUMNS]; // of pixels: halves are exact
    _Alignas(64) float middle_y[PT_DISC_TILE + PT_PATCH_ROWS][PT_PATCH_COLUMNS];
    float x[PT_LANES], y[PT_LANES], z[PT_LANES], gx[PT_LANES], gy[PT_LANES], e[PT_LANES], h[PT_LANES], m[PT_LANES];
    float deep[PT_LANES]; // no pixel of the disc lies nearer or farther than so much from its middle
    uint32_t x0[PT_LANES], y0[PT_LANES], x1[PT_LANES], y1[PT_LANES]; // boxes in the tile
    uint32_t first[PT_LANES], columns[PT_LANES], rows[PT_LANES];     // not of wide: first pixel; columns, a bit each; rows
    uint32_t column[PT_LANES], row[PT_LANES];                        // own pixels in the tile, if they lie there
    uint32_t small, ends, gentle; // those that may miss or hardly fill their own pixel; that may pass the ends of the view
    uint32_t wide;                // those that one list may not hold
    uint32_t count;
    uint32_t at[PT_PATCHES];      // first pixel in the tile, rows of PT_DISC_TILE | lane of the disc << 16
    pt_patch_box box[PT_PATCHES]; // pixels of the disc's box, a bit a lane
};

// What a disc shows of a patch.
struct pt_shown {
    vm covered;
    vf z;              // depth there; -0 counts as 0
    vf dx, dy, square; // from the disc's middle, pixels; squared radii
    vm own, beside;    // of a small disc: the pixel that its point falls into, and that if the disc lies beside it
};

static inline vi pt_power_of_two(vi n) { return vf_int(vi_float(vi_mul(vi_add(n, vi_set(127)), vi_set(1u << 23)))); }
static inline vi pt_lesser(vi a, vi b) { return vi_select(vi_lt_unsigned(a, b), a, b); }

// Turns to another tile.
static inline void pt_patches_turn(struct pt_patches *out, const struct view_args *view, struct pt_disc_tile tile)
{
    out->view = view;
    out->tile = tile;
    for (int32_t i = 0; i < PT_DISC_TILE + PT_PATCH_COLUMNS; i++)
        out->middle_x[i] = (float)(view->origin_x + tile.x + i) + 0.5f;
    for (int32_t i = 0; i < PT_DISC_TILE + PT_PATCH_ROWS; i++)
        for (int k = 0; k < PT_PATCH_COLUMNS; k++)
            out->middle_y[i][k] = (float)(view->origin_y + tile.y + i) + 0.5f;
}

// Takes down PT_LANES discs, whose patches begin at multiples of `step` columns; returns those with pixels in the tile.
static inline uint32_t pt_patches_begin(struct pt_patches *out, const struct pt_discs *d, uint32_t step)
{
    const struct view_args *view = out->view;
    // in its own pixel, less than 0.71 from its middle, a disc with e w^2 + m dy^2 <= 1.9 (dx^2 + dy^2) and q > 0.99 lies over
    // the middle, and the weight is its own
    const vf mixed = vf_abs(d->e * d->h), steep = vf_max(d->e, mixed * vf_abs(d->h) + d->m) + mixed;
    const vf slope = vf_abs(d->gx) + vf_abs(d->gy);
    const vi tile_x = vi_set((uint32_t)out->tile.x), tile_y = vi_set((uint32_t)out->tile.y), next = vi_set(1);
    const vi x0 = vi_select(vi_lt_unsigned(d->box[0], tile_x), tile_x, d->box[0]);
    const vi y0 = vi_select(vi_lt_unsigned(d->box[1], tile_y), tile_y, d->box[1]);
    const vi x1 = pt_lesser(vi_add(d->box[2], next), vi_set((uint32_t)(out->tile.x + out->tile.width)));
    const vi y1 = pt_lesser(vi_add(d->box[3], next), vi_set((uint32_t)(out->tile.y + out->tile.height)));
    const vi first = vi_and(x0, vi_set(~(step - 1))); // tiles begin at multiples of it
    const vi columns = vi_sub(pt_power_of_two(vi_sub(x1, first)), pt_power_of_two(vi_sub(x0, first))), rows = vi_sub(y1, y0);
    const vm wide = vm_or(vi_lt_unsigned(vi_set(PT_PATCH_COLUMNS), vi_sub(x1, first)),
                          vi_lt_unsigned(vi_set(PT_LIST_ROWS), rows));
    const vf reach = d->radius * vf_set(1.01f);
    const vm within = vm_and(vf_le(vf_set(view->z_near), d->z - reach), vf_le(d->z + reach, vf_set(view->z_far)));
    out->ends = ~vm_bits(within);
    out->gentle = vm_bits(d->gentle);
    out->wide = vm_bits(wide);
    out->small = ~vm_bits(vm_and(vf_le(steep, vf_set(1.9f)), vf_le(slope, vf_set(0.02f))));
    vf_store(out->x, d->x);
    vf_store(out->y, d->y);
    vf_store(out->z, d->z);
    vf_store(out->gx, d->gx);
    vf_store(out->gy, d->gy);
    vf_store(out->e, d->e);
    vf_store(out->h, d->h);
    vf_store(out->m, d->m);
    vf_store(out->deep, d->radius * vf_set(1.001f));
    vi_store(out->x0, vi_sub(x0, tile_x));
    vi_store(out->y0, vi_sub(y0, tile_y));
    vi_store(out->x1, vi_sub(x1, tile_x));
    vi_store(out->y1, vi_sub(y1, tile_y));
    vi_store(out->first, vi_add(vi_mul(vi_sub(y0, tile_y), vi_set(PT_DISC_TILE)), vi_sub(first, tile_x)));
    vi_store(out->columns, columns);
    vi_store(out->rows, rows);
    vi_store(out->column, vi_sub(d->column, tile_x));
    vi_store(out->row, vi_sub(d->row, tile_y));
    return vm_bits(vm_and(d->drawn, vm_and(vi_lt_unsigned(x0, x1), vi_lt_unsigned(y0, y1))));
}

typedef void pt_patches_work(void *context, struct pt_patches *list);

// Lists patches of a disc, PT_LIST_ROWS at most, one below another from the pixel `first` on.
static inline void pt_patches_list(struct pt_patches *list, uint32_t disc, uint32_t first, uint32_t columns, uint32_t rows)
{
    typedef uint32_t listed __attribute__((vector_size(4 * PT_LIST_ROWS / PT_PATCH_ROWS))); // stored at once
    listed at;
    for (uint32_t i = 0; i < PT_LIST_ROWS / PT_PATCH_ROWS; i++)
        at[i] = i * PT_PATCH_ROWS * PT_DISC_TILE;
    at += first | disc << 16;
    const uint64_t box = (columns * 0x0101010101010101u) & ~0ull >> (64 - 8 * rows); // eight bits a row
    memcpy(list->at + list->count, &at, sizeof at);
    memcpy(list->box + list->count, &box, sizeof box);
    list->count += (rows + PT_PATCH_ROWS - 1) / PT_PATCH_ROWS; // the others do not count
}

static inline uint32_t pt_at_most(uint32_t a, uint32_t most) { return a < most ? a : most; }

// Calls work for the patches of a tile that some discs, a bit each, may cover, up to PT_PATCHES at a time.
static inline __attribute__((always_inline)) void pt_patches_draw(struct pt_patches *list, const struct pt_discs *discs,
                                                                  uint32_t some, uint32_t step, pt_patches_work *work,
                                                                  void *context)
{
    const uint32_t drawn = pt_patches_begin(list, discs, step) & some;
    list->count = 0;
    for (uint32_t lanes = drawn & ~list->wide; lanes; lanes &= lanes - 1) {
        const uint32_t k = (uint32_t)__builtin_ctz(lanes);
        pt_patches_list(list, k, list->first[k], list->columns[k], list->rows[k]);
    }
    for (uint32_t lanes = drawn & list->wide; lanes; lanes &= lanes - 1) {
        const uint32_t k = (uint32_t)__builtin_ctz(lanes);
        for (uint32_t x = list->x0[k]; x < list->x1[k]; x = (x & ~(step - 1)) + PT_PATCH_COLUMNS)
            for (uint32_t y = list->y0[k]; y < list->y1[k]; y += PT_LIST_ROWS) {
                const uint32_t first = x & ~(step - 1), end = pt_at_most(list->x1[k] - first, PT_PATCH_COLUMNS);
                if (list->count > PT_PATCHES - PT_LIST_ROWS / PT_PATCH_ROWS) {
                    work(context, list);
                    list->count = 0;
                }
                pt_patches_list(list, k, y * PT_DISC_TILE + first, (1u << end) - (1u << (x - first)),
                                pt_at_most(list->y1[k] - y, PT_LIST_ROWS));
            }
    }
    work(context, list);
}

// The middles of a patch's pixels, from the lists of them.
static inline vf pt_patch_columns(const float *p)
{
#if defined(PT_ISA_AVX512)
    return _mm512_broadcast_f32x8(_mm256_loadu_ps(p));
#else
    return vf_load(p);
#endif
}

static inline uint32_t pt_patch_pixel(const struct pt_patches *list, uint32_t i) { return list->at[i] & 0xFFFFu; }
static inline uint32_t pt_patch_disc(const struct pt_patches *list, uint32_t i) { return list->at[i] >> 16; }

// The lane of a small disc's own pixel.
static inline vm pt_patch_own(const struct pt_patches *list, uint32_t i)
{
    const uint32_t k = pt_patch_disc(list, i), at = pt_patch_pixel(list, i);
    const uint32_t column = list->column[k] - at % PT_DISC_TILE, row = list->row[k] - at / PT_DISC_TILE;
    const int here = column < PT_PATCH_COLUMNS && row < PT_PATCH_ROWS;
    return vm_of_bits(here ? list->box[i] & 1u << (row * PT_PATCH_COLUMNS + column) : 0);
}

// Every pixel of a patch against its disc.
static inline struct pt_shown pt_patch_show(const struct pt_patches *list, uint32_t i)
{
    const struct view_args *view = list->view;
    const uint32_t k = pt_patch_disc(list, i), at = pt_patch_pixel(list, i);
    const vf one = vf_set(1.0f), z = vf_set(list->z[k]);
    struct pt_shown out = {.dx = pt_patch_columns(list->middle_x + at % PT_DISC_TILE) - vf_set(list->x[k]),
                           .dy = vf_load(list->middle_y[at / PT_DISC_TILE]) - vf_set(list->y[k])};
    const vf slope = vf_set(list->gx[k]) * out.dx + vf_set(list->gy[k]) * out.dy;
    const vf w = out.dx + vf_set(list->h[k]) * out.dy;
    out.square = (vf_set(list->e[k]) * w) * w + (vf_set(list->m[k]) * out.dy) * out.dy;
    out.covered = vm_of_bits(list->box[i]);
    if (view->perspective) {
        vf inverse = (one - slope) * (one + slope * slope);
        if (!(list->gentle >> k & 1u)) {
            out.covered = vm_and(out.covered, vf_le(vf_set(PT_DISC_LEAST), one + slope));
            inverse = vf_rcp(one + slope);
        }
        out.z = z * inverse;
        if (!(list->gentle >> k & 1u)) // where slopes cancel, the depth shows it
            out.covered = vm_and(out.covered, vf_le(vf_abs(out.z - z), vf_set(list->deep[k])));
        out.square = out.square * (inverse * inverse);
    } else {
        out.z = z + slope;
    }
    out.covered = vm_and(out.covered, vf_le(out.square, one));
    out.own = out.beside = vm_of_bits(0);
    if (list->small >> k & 1u) {
        out.own = pt_patch_own(list, i);
        out.beside = vm_and(out.own, vm_not(out.covered)); // covered by the point alone
        out.z = vf_select(out.beside, z, out.z);
        out.covered = vm_or(out.covered, out.beside);
    }
    if (list->ends >> k & 1u)
        out.covered = vm_and(out.covered, vm_and(vf_le(vf_set(view->z_near), out.z), vf_le(out.z, vf_set(view->z_far))));
    out.z = vf_abs(out.z); // the sign bit of -0 is dropped
    return out;
}

// exp(-2 s) within 2.4e-4, s squared distance over radius squared; in its own pixel a disc is a pixel wide at least.
static inline vf pt_shown_weight(const struct pt_shown *shown)
{
    vf s = shown->square;
    if (vm_bits(shown->own)) {
        const vf pixel = (shown->dx * shown->dx + shown->dy * shown->dy) * vf_set(2.0f);
        s = vf_select(shown->own, vf_select(shown->beside, pixel, vf_min(pixel, s)), s);
    }
    const vf two = s * s;
    const vf high = vf_set(0.25565624f) * two + (vf_set(1.90144324f) - vf_set(1.03321445f) * s);
    return high * two + (vf_set(0.99976468f) - vf_set(1.98814547f) * s);
}

// The pixels of a patch from `at` on, of a tile's floats.
static inline vf pt_patch_load(const float *p)
{
#if defined(PT_ISA_AVX512)
    return _mm512_insertf32x8(_mm512_castps256_ps512(_mm256_loadu_ps(p)), _mm256_loadu_ps(p + PT_DISC_TILE), 1);
#else
    return vf_load(p);
#endif
}

#endif
