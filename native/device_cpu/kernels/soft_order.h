// SPDX-License-Identifier: GPL-3.0-or-later
// A tile's list in order of depth, and of records where depths are equal: put into buckets of depth at once, and these in order when
// they are come to. Lists come in the order of records, and no step turns equal ones round.
#ifndef PT_SOFT_ORDER_H
#define PT_SOFT_ORDER_H

#include <stdint.h>
#include <string.h>

enum {
    PT_SOFT_BUCKETS = 4096, // at most; of a short list fewer, each of some PT_SOFT_OWN
    PT_SOFT_OWN = 8,
    PT_SOFT_FEW = 40 // in a bucket; of more, digits are sorted
};

struct pt_soft_order {
    uint64_t *list, *other; // order of depth << 32 | record: in buckets; memory of as many
    uint32_t count, ready;  // of the list; of these are in order
    uint32_t bucket;        // the next one
    uint32_t ends[PT_SOFT_BUCKETS];
};

// Puts `list` into buckets in `room`, both of `count`; the list's memory is used on.
static inline void pt_soft_order_open(struct pt_soft_order *order, uint64_t *list, uint64_t *room, uint32_t count)
{
    uint32_t least = UINT32_MAX, most = 0, at = 0, buckets = 64;
    int shift = 0;
    while (buckets < PT_SOFT_BUCKETS && buckets * PT_SOFT_OWN < count)
        buckets *= 2;
    order->list = room;
    order->other = list;
    order->count = count;
    order->ready = order->bucket = 0;
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t z = (uint32_t)(list[i] >> 32);
        least = z < least ? z : least;
        most = z > most ? z : most;
    }
    while (count && (most - least) >> shift >= buckets)
        shift++;
    memset(order->ends, 0, buckets * sizeof *order->ends);
    for (uint32_t i = 0; i < count; i++)
        order->ends[((uint32_t)(list[i] >> 32) - least) >> shift]++;
    for (uint32_t k = 0; k < buckets; k++) {
        const uint32_t own = order->ends[k];
        order->ends[k] = at;
        at += own;
    }
    for (uint32_t i = 0; i < count; i++)
        room[order->ends[((uint32_t)(list[i] >> 32) - least) >> shift]++] = list[i];
}

// Four digits, so that what is sorted ends where it was.
static inline void pt_soft_sort_digits(uint64_t *list, uint64_t *other, uint32_t count)
{
    for (int shift = 32; shift < 64; shift += 8) {
        uint32_t places[256] = {0}, at = 0;
        for (uint32_t i = 0; i < count; i++)
            places[list[i] >> shift & 255u]++;
        for (uint32_t k = 0; k < 256; k++) {
            const uint32_t own = places[k];
            places[k] = at;
            at += own;
        }
        for (uint32_t i = 0; i < count; i++)
            other[places[list[i] >> shift & 255u]++] = list[i];
        uint64_t *const swap = list;
        list = other;
        other = swap;
    }
}

static inline void pt_soft_sort_few(uint64_t *list, uint32_t count)
{
    for (uint32_t i = 1; i < count; i++) {
        const uint64_t own = list[i];
        uint32_t k = i;
        for (; k > 0 && list[k - 1] > own; k--)
            list[k] = list[k - 1];
        list[k] = own;
    }
}

// The first `wanted` of the list, at least, are in order.
static inline void pt_soft_order_to(struct pt_soft_order *order, uint32_t wanted)
{
    wanted = wanted < order->count ? wanted : order->count;
    while (order->ready < wanted) {
        const uint32_t end = order->ends[order->bucket++], own = end - order->ready;
        if (own > PT_SOFT_FEW)
            pt_soft_sort_digits(order->list + order->ready, order->other + order->ready, own);
        else
            pt_soft_sort_few(order->list + order->ready, own);
        order->ready = end;
    }
}

// All of it, as records alone.
static inline const uint32_t *pt_soft_order_all(struct pt_soft_order *order)
{
    uint32_t *records = (uint32_t *)(void *)order->other;
    pt_soft_order_to(order, order->count);
    for (uint32_t i = 0; i < order->count; i++)
        records[i] = (uint32_t)order->list[i];
    return records;
}

#endif
