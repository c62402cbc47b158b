// SPDX-License-Identifier: GPL-3.0-or-later
// Records of soft points, for each tile of 16 x 16 pixels those that its pixels may show: looked through once, then shared out in
// the order of records, so that lists are the same whatever the threads; who draws a tile sorts its list (soft_order.h). Tiles are
// taken in batches whose lists fit the bins; a list always does.
#ifndef PT_SOFT_BINS_H
#define PT_SOFT_BINS_H

#include "device_cpu/rows.h"
#include "shared/balls.h"

#include <stdatomic.h>

enum { PT_SOFT_RANGES = 64, PT_SOFT_COUNTS = 1 << 22 };

struct pt_soft_seen { // a record that is drawn: its tiles, both ends included, and the order of its depth
    uint16_t x0, y0, x1, y1;
    uint32_t order, record;
};

struct pt_soft_bins {
    const struct pt_cpu_call *call;
    const struct soft_args *args;
    const float *points;
    uint32_t columns, rows, tiles, ranges;
    uint32_t drawn;            // of the records
    uint32_t first, end;       // tiles of this batch
    struct pt_soft_seen *seen; // of each range, from its first record's place on
    uint64_t *lists;           // order of depth << 32 | record
    size_t room;
    uint32_t *counts; // by range and tile; then where in the lists they go
    uint32_t *begins; // of the tiles' lists, in the batch; tiles + 1 of them
    uint32_t count[PT_SOFT_RANGES];
};

// Floats in the order of whole numbers, those below 0 too.
static inline uint32_t pt_soft_order(float z)
{
    const uint32_t bits = pt_bits(z);
    return bits >> 31 ? ~bits : bits | 1u << 31;
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
    if (pt_soft_of_discs(bins->args)) // others belong to another slab as a whole
        some = vm_and(some, vm_and(vf_lt(vf_set(bins->args->z_from), p[2]), vf_le(p[2], vf_set(bins->args->z_to))));
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

static inline uint32_t pt_soft_first(const struct pt_soft_bins *bins, uint32_t range)
{
    return (uint32_t)((uint64_t)(bins->args->records / 16) * range / bins->ranges) * 16;
}

// Which records of a range are drawn, and on how many tiles each.
static void pt_soft_look(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct pt_soft_bins *bins = context;
    (void)thread;
    for (uint32_t q = begin; q < end && !pt_cpu_cancelled(bins->call); q++) {
        const uint32_t first = pt_soft_first(bins, q), last = pt_soft_first(bins, q + 1);
        struct pt_soft_seen *seen = bins->seen + first;
        uint32_t *counts = bins->counts + (size_t)q * bins->tiles;
        memset(counts, 0, bins->tiles * sizeof *counts);
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
                *seen++ = (struct pt_soft_seen){(uint16_t)words[0][k], (uint16_t)words[1][k], (uint16_t)words[2][k],
                                                (uint16_t)words[3][k], pt_soft_order(z[k]),   i + k};
                for (uint32_t y = words[1][k]; y <= words[3][k]; y++)
                    for (uint32_t x = words[0][k]; x <= words[2][k]; x++)
                        counts[y * bins->columns + x]++;
            }
        }
        bins->count[q] = (uint32_t)(seen - (bins->seen + first));
    }
}

// A range's records into the lists of this batch's tiles.
static void pt_soft_fill(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct pt_soft_bins *bins = context;
    const uint32_t top = bins->first / bins->columns, bottom = (bins->end - 1) / bins->columns;
    (void)thread;
    for (uint32_t q = begin; q < end && !pt_cpu_cancelled(bins->call); q++) {
        const struct pt_soft_seen *seen = bins->seen + pt_soft_first(bins, q);
        uint32_t *counts = bins->counts + (size_t)q * bins->tiles;
        for (uint32_t i = 0; i < bins->count[q]; i++) {
            const uint64_t own = (uint64_t)seen[i].order << 32 | seen[i].record;
            const uint32_t y0 = seen[i].y0 > top ? seen[i].y0 : top, y1 = seen[i].y1 < bottom ? seen[i].y1 : bottom;
            for (uint32_t y = y0; y <= y1; y++)
                for (uint32_t x = seen[i].x0; x <= seen[i].x1; x++) {
                    const uint32_t tile = y * bins->columns + x;
                    if (tile >= bins->first && tile < bins->end)
                        bins->lists[counts[tile]++] = own;
                }
        }
    }
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
    if (bins->drawn)
        pt_parallel(bins->call->pool, bins->ranges, 1, pt_soft_fill, bins);
    return 1;
}

// Looks through the records. The bins: 64 bytes of what is counted, lists.
static inline int pt_soft_bins_open(struct pt_soft_bins *bins)
{
    const struct soft_args *args = bins->args;
    const uint32_t *rect = args->view.rect;
    char *memory = PT_DATA(bins->call, soft, bins);
    bins->columns = (rect[2] - rect[0] + PT_SOFT_TILE - 1) / PT_SOFT_TILE;
    bins->rows = (rect[3] - rect[1] + PT_SOFT_TILE - 1) / PT_SOFT_TILE;
    bins->tiles = bins->columns * bins->rows;
    bins->ranges = bins->tiles > PT_SOFT_COUNTS / PT_SOFT_RANGES ? PT_SOFT_COUNTS / bins->tiles + 1 : PT_SOFT_RANGES;
    bins->lists = (uint64_t *)(void *)(memory + 64);
    bins->room = (bins->call->buffers[PT_BUF_soft_bins]->size - 64) / sizeof *bins->lists;
    const size_t counts = (size_t)bins->ranges * bins->tiles;
    bins->seen = pt_cpu_scratch(bins->call, 0,
                                args->records * sizeof *bins->seen + (counts + bins->tiles + 1) * sizeof *bins->counts);
    if (!bins->seen)
        return PATINA_ERROR_MEMORY;
    bins->counts = (uint32_t *)(void *)(bins->seen + args->records);
    bins->begins = bins->counts + counts;
    pt_parallel(bins->call->pool, bins->ranges, 1, pt_soft_look, bins);
    bins->drawn = bins->end = 0;
    if (pt_cpu_cancelled(bins->call))
        return PATINA_ERROR_CANCELLED;
    for (uint32_t q = 0; q < bins->ranges; q++)
        bins->drawn += bins->count[q];
    return PATINA_OK;
}

#endif
