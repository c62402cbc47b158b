// SPDX-License-Identifier: GPL-3.0-or-later
// Morton codes and a parallel least-significant-digit radix sort of (code << 32 | id) words: three stable passes of ten
// bits, histograms per block, so that the order does not depend on the number of threads.
#include "cloud.h"

#include <stdlib.h>
#include <string.h>

enum { DIGIT_BITS = 10, DIGITS = 1 << DIGIT_BITS, BLOCKS = 64 };

struct sort {
    const uint64_t *from;
    uint64_t *to;
    uint32_t count, shift;
    uint32_t (*offsets)[DIGITS]; // per block
};

static uint32_t block_begin(const struct sort *sort, uint32_t block)
{
    return (uint32_t)((uint64_t)sort->count * block / BLOCKS);
}

static void count_blocks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct sort *sort = context;
    (void)thread;
    for (uint32_t block = begin; block < end; block++) {
        uint32_t *histogram = sort->offsets[block];
        memset(histogram, 0, sizeof sort->offsets[block]);
        for (uint32_t i = block_begin(sort, block); i < block_begin(sort, block + 1); i++)
            histogram[sort->from[i] >> sort->shift & (DIGITS - 1)]++;
    }
}

static void scatter_blocks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct sort *sort = context;
    (void)thread;
    for (uint32_t block = begin; block < end; block++) {
        uint32_t *offset = sort->offsets[block];
        for (uint32_t i = block_begin(sort, block); i < block_begin(sort, block + 1); i++)
            sort->to[offset[sort->from[i] >> sort->shift & (DIGITS - 1)]++] = sort->from[i];
    }
}

int pt_morton_sort(struct pt_pool *pool, uint64_t *words, uint64_t *scratch, uint32_t count)
{
    struct sort sort = {.from = words, .to = scratch, .count = count};
    sort.offsets = malloc(BLOCKS * sizeof *sort.offsets);
    if (!sort.offsets)
        return PATINA_ERROR_MEMORY;
    for (sort.shift = 32; sort.shift < 62; sort.shift += DIGIT_BITS) {
        pt_parallel(pool, BLOCKS, 1, count_blocks, &sort);
        uint32_t sum = 0;
        for (uint32_t digit = 0; digit < DIGITS; digit++)
            for (uint32_t block = 0; block < BLOCKS; block++) {
                uint32_t here = sort.offsets[block][digit];
                sort.offsets[block][digit] = sum;
                sum += here;
            }
        pt_parallel(pool, BLOCKS, 1, scatter_blocks, &sort);
        const uint64_t *swap = sort.from;
        sort.from = sort.to;
        sort.to = (uint64_t *)swap;
    }
    memcpy(words, scratch, (size_t)count * sizeof *words); // three passes end in the scratch
    free(sort.offsets);
    return PATINA_OK;
}
