// SPDX-License-Identifier: GPL-3.0-or-later
// Points of a chunk as a view sees them, PT_LANES at a time; twin of shaders/lib/points.glsl
#ifndef PT_POINTS_H
#define PT_POINTS_H

#include "device_cpu/vector_math.h"
#include "shared/packed.h"
#include "shared/view.h"

// What places a chunk's points, of what places its cloud's: three words each, or two where they are packed (struct chunk_view).
static inline const uint32_t *pt_chunk_points(const void *positions, const struct chunk_view *chunk)
{
    return (const uint32_t *)positions + (size_t)(chunk->step > 0.0f ? PT_PACKED_WORDS : PT_POSITION_WORDS) * chunk->first;
}

static inline vf pt_unpack(vi q, float step) { return (vi_convert(q) - vf_set((float)PT_PACKED_MIDDLE)) * vf_set(step); }

// Points from slot i of the chunk on, relative to its origin; points: pt_chunk_points. packed: as its step says, where a loop is written
// once for each.
static inline void pt_load_points_as(int packed, const struct chunk_view *chunk, const uint32_t *points, uint32_t i, vf p[3])
{
    const uint32_t *at = points + i;
    if (packed) {
        const vi low = vi_load(at), high = vi_load(at + chunk->padded), mask = vi_set(PT_PACKED_MASK);
        p[0] = pt_unpack(vi_and(low, mask), chunk->step);
        p[1] = pt_unpack(vi_and(high, mask), chunk->step);
        p[2] = pt_unpack(vi_or(vi_shr(low, PT_PACKED_BITS), vi_and(vi_shr(high, 10), vi_set(PT_PACKED_HIGH))), chunk->step);
        return;
    }
    for (uint32_t k = 0; k < 3; k++)
        p[k] = vi_float(vi_load(at + k * (size_t)chunk->padded));
}

static inline void pt_load_points(const struct chunk_view *chunk, const uint32_t *points, uint32_t i, vf p[3])
{
    pt_load_points_as(chunk->step > 0.0f, chunk, points, i, p);
}

// The point in slot i alone.
static inline void pt_load_point(const struct chunk_view *chunk, const uint32_t *points, uint32_t i, float p[3])
{
    const uint32_t *at = points + i;
    if (chunk->step > 0.0f) {
        pt_packed_point(at[0], at[chunk->padded], chunk->step, p);
        return;
    }
    for (uint32_t k = 0; k < 3; k++)
        p[k] = pt_float(at[k * (size_t)chunk->padded]);
}

// Row 0, 1 or 2 of points as the view sees their chunk: see struct chunk_view.
static inline vf vf_transform(const struct chunk_view *chunk, int row, vf x, vf y, vf z)
{
    const float *r = chunk->row + 3 * row;
    return (((vf_set(chunk->lo[row]) + vf_set(r[0]) * x) + vf_set(r[1]) * y) + vf_set(r[2]) * z) + vf_set(chunk->hi[row]);
}

// Where the view sees them: x and y in pixels, and their depth.
static inline void pt_project(const struct view_args *view, const struct chunk_view *chunk, const vf p[3], vf at[3])
{
    for (int k = 0; k < 3; k++)
        at[k] = vf_transform(chunk, k, p[0], p[1], p[2]);
    if (view->perspective) {
        const vf r = vf_rcp(at[2]);
        at[0] = at[0] * r;
        at[1] = at[1] * r;
    }
}

// What of the picture is drawn, and between which depths.
struct pt_window {
    vf z_near, z_far, left, right, bottom, top;
};

// Of the view's columns, and of the rows from bottom to top.
static inline struct pt_window pt_window_rows(const struct view_args *view, float bottom, float top)
{
    return (struct pt_window){.z_near = vf_set(view->z_near),
                              .z_far = vf_set(view->z_far),
                              .left = vf_set((float)view->origin_x),
                              .right = vf_set((float)(view->origin_x + (int32_t)view->width)),
                              .bottom = vf_set(bottom),
                              .top = vf_set(top)};
}

// NaN fails every comparison.
static inline vm pt_within(const struct pt_window *window, const vf at[3])
{
    return vm_and(vm_and(vf_le(window->z_near, at[2]), vf_le(at[2], window->z_far)),
                  vm_and(vm_and(vf_le(window->left, at[0]), vf_lt(at[0], window->right)),
                         vm_and(vf_le(window->bottom, at[1]), vf_lt(at[1], window->top))));
}

// Those of `some` points from slot i on that were not sifted out; drawn is not read where nothing of the chunk is.
static inline vm pt_keep_drawn(const struct chunk_view *chunk, const uint32_t *drawn, uint32_t i, vm some)
{
    if (!chunk->sifted)
        return some;
    return vm_and(some, vm_of_bits(drawn[chunk->sifted - 1 + i / PT_SLOTS_A_WORD] >> i % PT_SLOTS_A_WORD));
}

// Which of PT_LANES points face away.
static inline vm pt_faces_away(const struct chunk_view *chunk, vi word, const vf p[3])
{
    vf n[3], v[3];
    vf_decode_normal(word, n);
    for (uint32_t k = 0; k < 3; k++)
        v[k] = vf_set(chunk->eye[k]) - vf_set(chunk->eye[3]) * p[k];
    vm away = vf_le((n[0] * v[0] + n[1] * v[1]) + n[2] * v[2], vf_zero());
    return vm_and(away, vm_not(vi_eq(vi_and(word, vi_set(PT_NORMAL_BITS)), vi_set(PT_NORMAL_NONE))));
}

#endif
