// SPDX-License-Identifier: GPL-3.0-or-later
// Masks: bits in the caller's order become words in chunk order, once, so that a picture only looks them up.
#include "mask.h"

#include "base/platform.h"
#include "scene/clouds/paged.h"
#include "scene/clouds/parts.h"

#include <stdlib.h>

struct pt_alive *pt_alive_share(const struct patina_cloud *cloud)
{
    atomic_fetch_add(&cloud->alive->references, 1);
    return cloud->alive;
}

struct fill {
    const struct patina_mask *mask;   // of the cloud or a part
    const struct patina_cloud *cloud; // likewise
    const uint8_t *hidden, *selected;
};

static uint32_t bit_of(const uint8_t *bits, uint64_t index) { return bits ? bits[index / 8] >> index % 8 & 1u : 0; }

static void fill_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct fill *fill = context;
    (void)thread;
    for (uint32_t c = begin; c < end; c++) {
        const struct pt_chunk *chunk = &fill->cloud->chunks[c];
        uint32_t *words = fill->mask->words + chunk->first / PT_SLOTS_A_WORD, hidden = 0;
        for (uint32_t i = 0; i < chunk->padded; i++) {
            const uint64_t number = pt_number_of(fill->cloud, (uint64_t)chunk->first + i);
            const uint32_t hides = bit_of(fill->hidden, number), selects = bit_of(fill->selected, number);
            words[i / PT_SLOTS_A_WORD] |= (hides | selects << PT_SLOTS_A_WORD) << i % PT_SLOTS_A_WORD;
            hidden += i < chunk->count && hides;
        }
        fill->mask->chunks[c] = !hidden ? PT_MASKED_NONE : hidden == chunk->count ? PT_MASKED_ALL : PT_MASKED_SOME;
    }
}

// Once all words stand.
static void sum_up(struct patina_mask *mask, uint32_t chunk_count)
{
    mask->hash = 1;
    for (uint32_t c = 0; c < chunk_count; c++)
        mask->hides |= mask->chunks[c] != PT_MASKED_NONE;
    for (uint64_t i = 0; i < mask->word_count && mask->hides; i++)
        mask->hash = (mask->hash ^ (mask->words[i] & 0xFFFFu)) * 0x100000001B3ull; // FNV-1a
}

// Masks of the cloud's parts. 0: there is no memory.
static int divide(struct patina_mask *mask, const patina_cloud *cloud)
{
    mask->parts = calloc(cloud->part_count, sizeof *mask->parts);
    for (uint32_t i = 0; mask->parts && i < cloud->part_count; i++) {
        const struct patina_cloud *part = pt_part(cloud, i);
        mask->parts[i] = (struct patina_mask){.alive = pt_alive_create(),
                                              .word_count = part->slots / PT_SLOTS_A_WORD,
                                              .words = mask->words + part->first_slot / PT_SLOTS_A_WORD,
                                              .chunks = mask->chunks + part->first_chunk};
        mask->part_count += mask->parts[i].alive != NULL;
    }
    return mask->part_count == cloud->part_count;
}

static int make_mask(const patina_cloud *cloud, const uint8_t *hidden, const uint8_t *selected, size_t size, patina_mask **out)
{
    if (size != (cloud->info.count + 7) / 8)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_mask_create: %zu bytes for %llu points; it takes %llu", size,
                       (unsigned long long)cloud->info.count, (unsigned long long)((cloud->info.count + 7) / 8));
    struct patina_mask *mask = calloc(1, sizeof *mask);
    struct pt_pool *pool = pt_pool_create(pt_pool_threads_for(0, cloud->slots), 0);
    if (mask) {
        pt_handle_init(&mask->handle);
        mask->of = pt_alive_share(cloud);
        mask->alive = pt_alive_create();
        mask->word_count = cloud->slots / PT_SLOTS_A_WORD;
        mask->words = pt_pages_alloc(mask->word_count * sizeof *mask->words);
        mask->chunks = calloc(cloud->chunk_count + 1, 1);
    }
    const int good = mask && pool && mask->alive && mask->words && mask->chunks && (!cloud->part_count || divide(mask, cloud));
    if (good) {
        for (uint32_t i = 0; i < pt_part_count(cloud); i++) {
            struct fill fill = {pt_mask_part(mask, i), pt_part(cloud, i), hidden, selected};
            pt_parallel(pool, fill.cloud->chunk_count, 4, fill_chunks, &fill);
        }
        if (cloud->part_count)
            pt_cloud_return(cloud); // a large file's order was read
        sum_up(mask, cloud->chunk_count);
        for (uint32_t i = 0; i < mask->part_count; i++) {
            mask->parts[i].hides = mask->hides;
            mask->parts[i].hash = mask->hash;
        }
        *out = mask;
    } else {
        patina_mask_destroy(mask);
    }
    pt_pool_destroy(pool);
    return good ? PATINA_OK
                : pt_fail(NULL, PATINA_ERROR_MEMORY, "a mask of %llu points: out of memory",
                          (unsigned long long)cloud->info.count);
}

int patina_mask_create(const patina_cloud *cloud, const uint8_t *hidden, const uint8_t *selected, size_t size,
                       patina_mask **out)
{
    if (!cloud || !out || cloud->handle.magic != PT_MAGIC)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_mask_create: cloud or out is NULL, or the cloud destroyed");
    *out = NULL;
    const int refused = pt_whole_enter(cloud, "patina_mask_create");
    if (refused)
        return refused;
    const int error = make_mask(cloud, hidden, selected, size, out);
    pt_paged_leave(cloud);
    return error;
}

void patina_mask_destroy(patina_mask *mask)
{
    if (!mask)
        return;
    pt_pages_free(mask->words, mask->word_count * sizeof *mask->words);
    free(mask->chunks);
    for (uint32_t i = 0; i < mask->part_count; i++)
        pt_alive_end(mask->parts[i].alive);
    free(mask->parts);
    pt_alive_end(mask->alive);
    pt_alive_release(mask->of);
    pt_handle_destroy(&mask->handle);
    free(mask);
}
