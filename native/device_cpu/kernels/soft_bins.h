// SPDX-License-Identifier: GPL-3.0-or-later
// Records of soft points, in order of depth, for each tile of 16 x 16 pixels: sorted once, then shared out in that order, so that
// every list is sorted whatever the threads. Tiles are taken in batches whose lists fit the bins; a list always does.
#ifndef PT_SOFT_BINS_H
#define PT_SOFT_BINS_H

#include "device_cpu/rows.h"
#include "shared/balls.h"

#include <stdatomic.h>

enum { PT_SOFT_RANGES = 64, PT_SOFT_COUNTS = 1 << 22 };

struct pt_soft_box { // tiles, both ends included
    uint16_t x0, y0, x1, y1;
};

struct pt_soft_bins {
    const struct pt_cpu_call *call;
    const struct soft_args *args;
    const float *points;
    uint32_t columns, rows, tiles, ranges;
    uint32_t drawn;            // of the records
    uint32_t first, end;       // tiles of this batch
    uint64_t *keys, *other;    // depth << 32 | record
    struct pt_soft_box *boxes; // by record
    uint32_t *lists;
    size_t room;
    uint32_t *counts; // by range and digit, then by range and tile
    uint32_t *begins; // of the tiles' lists, in the batch; tiles + 1 of them
    uint32_t count[PT_SOFT_RANGES];
    int shift;
};

// Floats in the order of whole numbers, those below 0 too.
static inline uint32_t pt_soft_order(float z)
{
    const uint32_t bits = pt_bits(z);
    return bits >> 31 ? ~bits : bits | 1u << 31;
}

static inline uint32_t pt_soft_range(uint32_t count, uint32_t ranges, uint32_t i)
{
    return (uint32_t)((uint64_t)count * i / ranges);
}

// Of a light's view all are balls.
static inline int pt_soft_of_discs(const struct soft_args *args) { return PT_SOFT_DISCS(args->model) && !args->veils; }

// Ends of PT_LANES balls or discs on screen along one axis, pixels of the picture. ray: of the centre, in units of the axis.
static inline void pt_soft_ends(const struct pt_soft_bins *bins, vf ray, vf ratio, float begin, float step, vf out[2])
{
    const vf one = vf_set(1.0f), slope = ray * ray + one, scale = vf_rcp(vf_set(step));
    if (pt_soft_of_discs(bins->args)) {
        const vf half = ratio * (slope * vf_rsqrt(slope));
        out[0] = (ray - half - vf_set(begin)) * scale;
        out[1] = (ray + half - vf_set(begin)) * scale;
        return;
    }
    const vf square = ratio * ratio, inner = slope - square, half = ratio * (inner * vf_rsqrt(inner));
    const vf wider = vf_rcp(vf_max(one - square, vf_set(1e-6f)));
    out[0] = ((ray - half) * wider - vf_set(begin)) * scale;
    out[1] = ((ray + half) * wider - vf_set(begin)) * scale;
}

// The tiles that a record's ball may touch; 0: none. A pixel wider than exact.
static inline vm pt_soft_boxes(const struct pt_soft_bins *bins, const vf p[4], vm some, vi box[4])
{
    const struct view_args *view = &bins->args->view;
    const vf one = vf_set(1.0f), zero = vf_zero();
    const float begin[2] = {view->ray_x0, view->ray_y0}, step[2] = {view->ray_xs, view->ray_ys};
    vf r = one;
    if (view->perspective && pt_soft_of_discs(bins->args)) // others lie behind the eye
        some = vm_and(some, vf_lt(vf_set(PT_SOFT_BEFORE), p[2]));
    vm good = some; // of others the eye may stand in the ball: it is everywhere
    if (view->perspective && !pt_soft_of_discs(bins->args))
        good = vm_and(some, vf_lt(vf_set(1.001f) * p[3], p[2]));
    if (view->perspective)
        r = vf_rcp(vf_select(good, p[2], one));
    for (int k = 0; k < 2; k++) {
        const int32_t origin = k ? view->origin_y : view->origin_x;
        const float low = (float)(origin + (int32_t)view->rect[k]), high = (float)(origin + (int32_t)view->rect[2 + k]);
        const vf center = p[k] * r;
        vf ends[2];
        if (view->perspective) {
            pt_soft_ends(bins, vf_set(begin[k]) + vf_set(step[k]) * center, p[3] * r, begin[k], step[k], ends);
        } else {
            const vf half = p[3] * vf_rcp(vf_set(step[k]));
            ends[0] = center - half;
            ends[1] = center + half;
        }
        ends[0] = vf_select(good, ends[0] - one, vf_set(low));
        ends[1] = vf_select(good, ends[1] + one, vf_set(high));
        some = vm_and(some, vm_and(vf_lt(ends[0], vf_set(high)), vf_le(vf_set(low), ends[1])));
        const vf most = vf_set(high - low - 1.0f);
        box[k] = vf_int(vf_min(vf_max(ends[0] - vf_set(low), zero), most));
        box[2 + k] = vf_int(vf_min(vf_max(ends[1] - vf_set(low), zero), most));
    }
    for (int k = 0; k < 4; k++)
        box[k] = vi_shr(box[k], 4);
    return some;
}

// Boxes and keys of a range of records, packed at the range's beginning.
static void pt_soft_look(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct pt_soft_bins *bins = context;
    (void)thread;
    for (uint32_t q = begin; q < end; q++) {
        const uint32_t first = pt_soft_range(bins->args->records / 16, bins->ranges, q) * 16;
        const uint32_t last = pt_soft_range(bins->args->records / 16, bins->ranges, q + 1) * 16;
        uint64_t *keys = bins->other + first;
        bins->count[q] = 0;
        for (uint32_t i = first; i < last; i += PT_LANES) {
            vf p[4];
            vi box[4];
            uint32_t words[4][PT_LANES];
            float z[PT_LANES];
            vf_gather4(bins->points, vi_mul(vi_add(vi_set(i), vi_lanes()), vi_set(2)), vm_first(PT_LANES), p);
            vm some = vf_lt(p[2], vf_set(pt_float(PT_KEY_EMPTY_Z)));
            if (!vm_bits(some))
                continue;
            some = pt_soft_boxes(bins, p, some, box);
            for (int k = 0; k < 4; k++)
                vi_store(words[k], box[k]);
            vf_store(z, p[2]);
            for (uint32_t lanes = vm_bits(some); lanes; lanes &= lanes - 1) {
                const uint32_t k = (uint32_t)__builtin_ctz(lanes);
                bins->boxes[i + k] = (struct pt_soft_box){(uint16_t)words[0][k], (uint16_t)words[1][k], (uint16_t)words[2][k],
                                                          (uint16_t)words[3][k]};
                keys[bins->count[q]++] = (uint64_t)pt_soft_order(z[k]) << 32 | (i + k);
            }
        }
    }
}

static void pt_soft_digits(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct pt_soft_bins *bins = context;
    (void)thread;
    for (uint32_t q = begin; q < end; q++) {
        uint32_t *counts = bins->counts + 256 * (size_t)q;
        memset(counts, 0, 256 * sizeof *counts);
        for (uint32_t i = pt_soft_range(bins->drawn, bins->ranges, q); i < pt_soft_range(bins->drawn, bins->ranges, q + 1); i++)
            counts[bins->keys[i] >> bins->shift & 255u]++;
    }
}

static void pt_soft_move(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct pt_soft_bins *bins = context;
    (void)thread;
    for (uint32_t q = begin; q < end; q++) {
        uint32_t *to = bins->counts + 256 * (size_t)q;
        for (uint32_t i = pt_soft_range(bins->drawn, bins->ranges, q); i < pt_soft_range(bins->drawn, bins->ranges, q + 1); i++)
            bins->other[to[bins->keys[i] >> bins->shift & 255u]++] = bins->keys[i];
    }
}

// By depth; equal ones keep the order of their records.
static void pt_soft_sort(struct pt_soft_bins *bins)
{
    for (bins->shift = 32; bins->shift < 64; bins->shift += 8) {
        uint32_t at = 0;
        pt_parallel(bins->call->pool, bins->ranges, 1, pt_soft_digits, bins);
        for (uint32_t digit = 0; digit < 256; digit++)
            for (uint32_t q = 0; q < bins->ranges; q++) {
                uint32_t *count = bins->counts + 256 * (size_t)q + digit, own = *count;
                *count = at;
                at += own;
            }
        pt_parallel(bins->call->pool, bins->ranges, 1, pt_soft_move, bins);
        uint64_t *swap = bins->keys;
        bins->keys = bins->other;
        bins->other = swap;
    }
}

// For each range of the sorted records: how many fall on each tile; then, with the counts made places, where they lie.
static void pt_soft_share(struct pt_soft_bins *bins, uint32_t q, int fill)
{
    uint32_t *counts = bins->counts + (size_t)q * bins->tiles;
    for (uint32_t i = pt_soft_range(bins->drawn, bins->ranges, q); i < pt_soft_range(bins->drawn, bins->ranges, q + 1); i++) {
        const uint32_t record = (uint32_t)bins->keys[i];
        const struct pt_soft_box box = bins->boxes[record];
        for (uint32_t y = box.y0; y <= box.y1; y++)
            for (uint32_t x = box.x0; x <= box.x1; x++) {
                const uint32_t tile = y * bins->columns + x;
                if (!fill)
                    counts[tile]++;
                else if (tile >= bins->first && tile < bins->end)
                    bins->lists[counts[tile]++] = record;
            }
    }
}

static void pt_soft_count(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct pt_soft_bins *bins = context;
    (void)thread;
    for (uint32_t q = begin; q < end; q++) {
        memset(bins->counts + (size_t)q * bins->tiles, 0, bins->tiles * sizeof *bins->counts);
        pt_soft_share(bins, q, 0);
    }
}

static void pt_soft_fill(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    (void)thread;
    for (uint32_t q = begin; q < end; q++)
        pt_soft_share(context, q, 1);
}

// Lists of the next batch, from bins->end on; 0: all tiles were taken.
static inline int pt_soft_batch(struct pt_soft_bins *bins)
{
    size_t used = 0;
    bins->first = bins->end;
    if (bins->first == bins->tiles)
        return 0;
    for (uint32_t tile = bins->first; tile < bins->tiles; tile++) {
        size_t own = 0;
        for (uint32_t q = 0; q < bins->ranges; q++)
            own += bins->counts[(size_t)q * bins->tiles + tile];
        if (used + own > bins->room)
            break;
        bins->begins[tile] = (uint32_t)used;
        for (uint32_t q = 0; q < bins->ranges; q++) {
            uint32_t *count = bins->counts + (size_t)q * bins->tiles + tile, mine = *count;
            *count = (uint32_t)used;
            used += mine;
        }
        bins->end = tile + 1;
        bins->begins[tile + 1] = (uint32_t)used;
    }
    pt_parallel(bins->call->pool, bins->ranges, 1, pt_soft_fill, bins);
    return 1;
}

// Looks through the records and sorts them. The bins: 64 bytes of what is counted, two keys a record, lists.
static inline int pt_soft_bins_open(struct pt_soft_bins *bins)
{
    const struct soft_args *args = bins->args;
    const uint32_t *rect = args->view.rect, n = args->records;
    char *memory = PT_DATA(bins->call, soft, bins);
    bins->columns = (rect[2] - rect[0] + PT_SOFT_TILE - 1) / PT_SOFT_TILE;
    bins->rows = (rect[3] - rect[1] + PT_SOFT_TILE - 1) / PT_SOFT_TILE;
    bins->tiles = bins->columns * bins->rows;
    bins->ranges = bins->tiles > PT_SOFT_COUNTS / PT_SOFT_RANGES ? PT_SOFT_COUNTS / bins->tiles + 1 : PT_SOFT_RANGES;
    bins->keys = (uint64_t *)(void *)(memory + 64);
    bins->other = bins->keys + n;
    bins->lists = (uint32_t *)(void *)(bins->other + n);
    bins->room = (bins->call->buffers[PT_BUF_soft_bins]->size - 64) / 4 - 4 * (size_t)n;
    const size_t counts = (size_t)bins->ranges * (bins->tiles > 256 ? bins->tiles : 256);
    bins->boxes = pt_cpu_scratch(bins->call, 0, n * sizeof *bins->boxes + (counts + bins->tiles + 1) * sizeof *bins->counts);
    if (!bins->boxes)
        return PATINA_ERROR_MEMORY;
    bins->counts = (uint32_t *)(void *)(bins->boxes + n);
    bins->begins = bins->counts + counts;
    pt_parallel(bins->call->pool, bins->ranges, 1, pt_soft_look, bins);
    bins->drawn = 0;
    for (uint32_t q = 0; q < bins->ranges; q++) {
        memcpy(bins->keys + bins->drawn, bins->other + pt_soft_range(n / 16, bins->ranges, q) * 16,
               bins->count[q] * sizeof *bins->keys);
        bins->drawn += bins->count[q];
    }
    pt_soft_sort(bins);
    pt_parallel(bins->call->pool, bins->ranges, 1, pt_soft_count, bins);
    bins->end = 0;
    return pt_cpu_cancelled(bins->call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}

#endif
