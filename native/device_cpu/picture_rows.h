// SPDX-License-Identifier: GPL-3.0-or-later
// Rows of the picture as separate vectors, indexed by x, so that every tap of a window is a plain load. What beyond the
// plane lies is empty. Rings of rows: row y lies in slot y modulo the ring's size.
#ifndef PT_PICTURE_ROWS_H
#define PT_PICTURE_ROWS_H

#include "rows.h"

enum { PT_ROW_PAD = 32 }; // floats before a row's first column and at least as many behind its last

static inline size_t pt_row_stride(uint32_t width) { return ((size_t)width + 15) / 16 * 16 + 2 * PT_ROW_PAD; }

// What the keys say of a row. z is +inf where the pixel is empty; the others are undefined there.
struct pt_seen_row {
    float *z;
    float *limit;        // d_eff of the surface shown
    float *normal[3];    // of the surface shown, those of filled pixels times `share`
    uint8_t *flat;       // of PT_LANES pixels each: whether all nine around each are one layer; NULL: not known
    uint32_t first, end; // columns between which something is seen, multiples of PT_LANES; equal where nothing is
};

// The planes that a row is seen from.
struct pt_planes {
    const struct view_args *view;
    uint32_t rect[4]; // nothing is seen beyond it
    const uint64_t *keys;
    const uint32_t *from;
    const float *normals, *deff;
};

static inline vi pt_source(const struct pt_planes *planes, size_t at) { return pt_source_of(planes->from, at); }

struct pt_span { // of z of PT_LANES columns of rows y - 1, y, y + 1
    vf near, far;
};

static inline struct pt_span pt_span_at(const struct pt_seen_row *const rows[3], int32_t x)
{
    vf below = vf_load(rows[0]->z + x), own = vf_load(rows[1]->z + x), above = vf_load(rows[2]->z + x);
    return (struct pt_span){vf_min(vf_min(below, above), own), vf_max(vf_max(below, above), own)};
}

// What flat says of the row in the middle: no filter of 3 x 3 need tell layers apart there. 94% of the torus' vectors are.
static inline void pt_find_flat(const struct pt_seen_row *const rows[3], uint32_t width)
{
    const int32_t first = (int32_t)rows[1]->first, end = (int32_t)rows[1]->end;
    struct pt_span west, here = pt_span_at(rows, first - PT_LANES), east = pt_span_at(rows, first);
    memset(rows[1]->flat, 0, width / PT_LANES + 2);
    for (int32_t x = first; x < end; x += PT_LANES) {
        west = here;
        here = east;
        east = pt_span_at(rows, x + PT_LANES);
        vf z = vf_load(rows[1]->z + x), limit = vf_load(rows[1]->limit + x);
        vf near = vf_min(vf_min(vf_west(west.near, here.near), vf_east(here.near, east.near)), here.near);
        vf far = vf_max(vf_max(vf_west(west.far, here.far), vf_east(here.far, east.far)), here.far);
        vm same = vm_and(vf_le(far - z, limit), vf_le(z - near, limit)); // as smoothing compares, then as anti-aliasing does
        same = vm_and(same, vf_le(far, z + limit));
        rows[1]->flat[x / PT_LANES] = vm_bits(same) == PT_ALL;
    }
}

// Whether all of PT_LANES pixels from x on are known to be.
static inline int pt_flat(const struct pt_seen_row *row, uint32_t x)
{
    return row->flat && row->flat[x / PT_LANES] && row->flat[(x + PT_LANES - 1) / PT_LANES];
}

// ---- weighted sums of 3 x 3 pixels -------------------------------------------------------------------------------------

struct pt_nine { // weights
    float center, edge, corner;
};

static inline vf pt_nine_sum(const struct pt_nine *weights, vf own, vf edges, vf corners)
{
    return (own * vf_set(weights->center) + edges * vf_set(weights->edge)) + corners * vf_set(weights->corner);
}

// Which of the nine around `some` pixels are of their layer. z: of rows y - 1, y, y + 1, at the first of PT_LANES pixels.
static inline void pt_same_layer(const float *const z[3], vf limit, vm some, vm same[3][3])
{
    const vf own = vf_load(z[1]);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            same[r][c] = vm_and(some, vf_le(vf_abs(vf_load(z[r] + c - 1) - own), limit));
}

// Sums of PT_LANES pixels; 0 for those that are not the same layer. rows as above, of any channel.
static inline vf pt_nine_pixels(const struct pt_nine *weights, const float *const rows[3], const vm same[3][3])
{
    vf tap[3][3];
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            tap[r][c] = vf_select(same[r][c], vf_load(rows[r] + c - 1), vf_zero());
    return pt_nine_sum(weights, tap[1][1], (tap[1][0] + tap[1][2]) + (tap[0][1] + tap[2][1]),
                       (tap[0][0] + tap[2][0]) + (tap[0][2] + tap[2][2]));
}

struct pt_column {  // PT_LANES pixels
    vf own, beside; // of row y; of rows y - 1 and y + 1, the sum
};

static inline struct pt_column pt_column_at(const float *const rows[3], int32_t x)
{
    return (struct pt_column){vf_load(rows[1] + x), vf_load(rows[0] + x) + vf_load(rows[2] + x)};
}

// The same sums, times scale and at most `most`, from x to `end` where all nine are one layer: every column is loaded once.
static inline void pt_nine_flat(const struct pt_nine *weights, const float *const rows[3], int32_t x, int32_t end, vf scale,
                                vf most, float *out)
{
    struct pt_column west, here = pt_column_at(rows, x - PT_LANES), east = pt_column_at(rows, x);
    for (; x < end; x += PT_LANES) {
        west = here;
        here = east;
        east = pt_column_at(rows, x + PT_LANES);
        vf edges = (vf_west(west.own, here.own) + vf_east(here.own, east.own)) + here.beside;
        vf corners = vf_west(west.beside, here.beside) + vf_east(here.beside, east.beside);
        vf_store(out + x, vf_min(pt_nine_sum(weights, here.own, edges, corners) * scale, most));
    }
}

// Columns from x on that nothing is seen in; at least PT_LANES.
static inline void pt_empty_columns(float *z, int32_t x, int32_t end)
{
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    for (; x < end - PT_LANES; x += PT_LANES)
        vf_store(z + x, empty);
    vf_store(z + end - PT_LANES, empty);
}

static inline void pt_empty_row(float *z, uint32_t width) { pt_empty_columns(z, -PT_ROW_PAD, (int32_t)width + PT_ROW_PAD); }

// Asks for PT_LANES pixels of planes: hardware forgets a stream between two rows.
static inline void pt_ask_for_keys(const struct pt_planes *planes, size_t at)
{
    __builtin_prefetch(planes->keys + at);
    __builtin_prefetch(planes->keys + at + 8);
    __builtin_prefetch(planes->from + at);
    __builtin_prefetch(planes->deff + at);
}

static inline void pt_ask_for_normals(const struct pt_planes *planes, size_t at)
{
    for (uint32_t i = 0; i < 4 * PT_LANES; i += 16)
        __builtin_prefetch(planes->normals + 4 * at + i);
}

// Row y of the planes. with_normals = 0: they are not wanted.
static inline void pt_see_row(const struct pt_planes *planes, int32_t y, float share, int with_normals, struct pt_seen_row *row)
{
    const uint32_t width = planes->view->width, *rect = planes->rect, first = rect[0] / PT_LANES * PT_LANES;
    const vf empty = vf_set(pt_float(PT_KEY_EMPTY_Z));
    row->first = row->end = 0;
    if (y < (int32_t)rect[1] || y >= (int32_t)rect[3]) {
        pt_empty_row(row->z, width);
        return;
    }
    pt_empty_columns(row->z, -PT_ROW_PAD, (int32_t)first);
    for (uint32_t x = first; x < rect[2]; x += PT_LANES) {
        size_t at = (size_t)y * width + x;
        vf z = vi_float(vi_load_z(planes->keys + at));
        vm some = vm_and(vm_first(pt_lanes_left(x, rect[2])), vf_lt(z, empty));
        vf_store(row->z + x, z);
        if (!vm_bits(some))
            continue;
        row->first = row->end ? row->first : x;
        row->end = x + PT_LANES;
        pt_ask_for_keys(planes, at + width); // shading asks for normals
        vi source = pt_source(planes, at);
        vm filled = pt_filled(source, at, some);
        const vf factor = vf_select(filled, vf_set(share), vf_set(1.0f));
        vf n[4]; // and d_eff
        if (vm_bits(filled) && with_normals) {
            vf_gather3_1(planes->normals, planes->deff, source, some, n);
        } else if (vm_bits(filled)) {
            n[3] = vf_gather(planes->deff, source, some);
        } else {
            if (with_normals)
                vf_load4(planes->normals + 4 * at, n);
            n[3] = vf_load(planes->deff + at);
        }
        vf_store(row->limit + x, n[3]);
        for (uint32_t k = 0; k < 3 && with_normals; k++)
            vf_store(row->normal[k] + x, n[k] * factor);
    }
    pt_empty_columns(row->z, (int32_t)rect[2], (int32_t)width + PT_ROW_PAD);
}

#endif
