// SPDX-License-Identifier: GPL-3.0-or-later
// rank: where the shadow words of points that the picture shows lie; twin of shaders/kernels/rank.comp
//
// Chunks that share the words of their marks both find them: the first gives the rank.
#include "device_cpu/rows.h"
#include "shared/shadows.h"

enum { GROUPS_MOST = 1024 }; // of marks that get their ranks at one go

struct groups {
    uint32_t count, points, each[GROUPS_MOST];
};

static void give_ranks(const struct pt_cpu_call *call, uint32_t *marks, struct groups *groups)
{
    uint32_t rank = 1 + __atomic_fetch_add((uint32_t *)PT_DATA(call, rank, marked), groups->points, __ATOMIC_RELAXED);
    for (uint32_t i = 0; i < groups->count; i++) {
        uint32_t *pair = marks + 2 * (size_t)groups->each[i];
        __atomic_store_n(pair + 1, rank, __ATOMIC_RELAXED);
        rank += (uint32_t)__builtin_popcount(pair[0]);
    }
    groups->count = groups->points = 0;
}

static void rank_chunk(const struct pt_cpu_call *call, const struct chunk_view *chunk)
{
    uint32_t *marks = PT_DATA(call, rank, marks);
    const uint32_t first = chunk->first / PT_MARK_SLOTS, end = (chunk->first + chunk->padded - 1) / PT_MARK_SLOTS + 1;
    struct groups groups = {0};
    for (uint32_t i = first; i < end; i++) {
        uint32_t *pair = marks + 2 * (size_t)i, none = 0;
        if (pair[0] && __atomic_compare_exchange_n(pair + 1, &none, 1, 0, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
            groups.points += (uint32_t)__builtin_popcount(pair[0]);
            groups.each[groups.count++] = i;
            if (groups.count == GROUPS_MOST)
                give_ranks(call, marks, &groups);
        }
    }
    if (groups.count)
        give_ranks(call, marks, &groups);
}

static void rank_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct pt_cpu_call *call = context;
    const struct chunk_view *chunks = PT_DATA(call, rank, chunks);
    (void)thread;
    for (uint32_t c = begin; c < end && !pt_cpu_cancelled(call); c++)
        rank_chunk(call, &chunks[c]);
}

int PT_KERNEL_ENTRY(rank)(const struct pt_cpu_call *call)
{
    pt_parallel(call->pool, (uint32_t)(call->buffers[PT_BUF_rank_chunks]->size / sizeof(struct chunk_view)), 16, rank_chunks,
                (void *)call);
    return pt_cpu_cancelled(call) ? PATINA_ERROR_CANCELLED : PATINA_OK;
}
