// SPDX-License-Identifier: GPL-3.0-or-later
// What a cloud is, in 64 bits: shadow textures belong to points (SPEC 4), and files of them must know theirs again.
// What a caller's arrays hold, so that a host can tell whether its points changed.
#include "cloud.h"
#include "base/error.h"
#include "fingerprint.h"
#include "paged.h"

#include <string.h>

enum { WAYS = 4 }; // multiplications in flight

static uint64_t mix(uint64_t hash, uint64_t word)
{
    hash = (hash ^ word) * 0x9E3779B97F4A7C15ull;
    return hash ^ hash >> 29;
}

static void begin(uint64_t ways[WAYS], uint64_t seed)
{
    for (uint64_t i = 0; i < WAYS; i++)
        ways[i] = seed + i;
}

// All whole words of all ways; returns what is left over.
static size_t take(uint64_t ways[WAYS], const char *at, size_t size)
{
    uint64_t words[WAYS];
    for (; size >= sizeof words; size -= sizeof words, at += sizeof words) {
        memcpy(words, at, sizeof words);
        for (int i = 0; i < WAYS; i++)
            ways[i] = mix(ways[i], words[i]);
    }
    return size;
}

static uint64_t end(const uint64_t ways[WAYS], uint64_t seed, size_t left_over, const char *all, size_t size)
{
    uint64_t words[WAYS] = {0}, hash = mix(seed, left_over);
    if (left_over)
        memcpy(words, all + size - left_over, left_over);
    for (int i = 0; i < WAYS; i++)
        hash = mix(hash, mix(ways[i], words[i]));
    return hash;
}

uint64_t pt_fingerprint(uint64_t seed, const void *data, size_t size)
{
    uint64_t ways[WAYS];
    begin(ways, seed);
    return end(ways, seed, take(ways, data, size), data, size);
}

void pt_sum_begin(struct pt_sum *sum, uint64_t seed)
{
    *sum = (struct pt_sum){.seed = seed};
    begin(sum->ways, seed);
}

void pt_sum_add(struct pt_sum *sum, const void *data, size_t size)
{
    const char *from = data;
    const size_t waits = sum->size % sizeof sum->rest;
    sum->size += size;
    if (waits) {
        const size_t some = sizeof sum->rest - waits < size ? sizeof sum->rest - waits : size;
        memcpy(sum->rest + waits, from, some);
        if (waits + some < sizeof sum->rest)
            return;
        take(sum->ways, (const char *)sum->rest, sizeof sum->rest);
        from += some;
        size -= some;
    }
    const size_t left_over = take(sum->ways, from, size);
    memcpy(sum->rest, from + size - left_over, left_over);
}

uint64_t pt_sum_end(const struct pt_sum *sum)
{
    const size_t left_over = sum->size % sizeof sum->rest;
    return end(sum->ways, sum->seed, left_over, (const char *)sum->rest, left_over);
}

// The same of an array of the cloud, of which no more than a piece is held where it lies in a file.
static uint64_t fingerprint_array(uint64_t seed, const struct patina_cloud *cloud, const void *data, size_t size)
{
    enum { PIECE = 1 << 24 };
    uint64_t ways[WAYS];
    size_t left_over = 0;
    begin(ways, seed);
    for (size_t at = 0; at < size; at += PIECE) {
        left_over = take(ways, (const char *)data + at, size - at < PIECE ? size - at : PIECE);
        if (cloud->mapped)
            pt_cloud_return(cloud);
    }
    return end(ways, seed, left_over, data, size);
}

// Of a cloud whose points are on their way, what is there.
static uint64_t fingerprint_there(const struct patina_cloud *cloud)
{
    const uint64_t bytes = 4 * pt_position_words(cloud);
    uint64_t hash = cloud->info.count;
    for (uint32_t c = 0; (c = pt_chunk_from(cloud, c)) < cloud->chunk_count; c++) {
        const struct pt_chunk *chunk = &cloud->chunks[c];
        hash = pt_fingerprint(mix(hash, c), (const char *)cloud->positions + chunk->first * bytes, chunk->padded * bytes);
        hash = pt_fingerprint(hash, cloud->surfels + chunk->first, chunk->padded * sizeof *cloud->surfels);
        hash = pt_fingerprint(hash, chunk->origin, sizeof chunk->origin);
    }
    return hash;
}

static uint64_t fingerprint_of(const struct patina_cloud *cloud)
{
    if (pt_paged_absent(cloud))
        return fingerprint_there(cloud);
    const size_t size = cloud->slots * 4 * pt_position_words(cloud);
    uint64_t hash = fingerprint_array(cloud->info.count, cloud, cloud->positions, size);
    hash = fingerprint_array(hash, cloud, cloud->surfels, cloud->slots * 4);
    if (cloud->shapes)
        hash = fingerprint_array(hash, cloud, cloud->shapes, cloud->slots * 4);
    for (uint32_t c = 0; c < cloud->chunk_count; c++) {
        const struct pt_chunk *chunk = &cloud->chunks[c];
        const float step = cloud->packed ? pt_chunk_step(chunk) : 0.0f;
        hash = pt_fingerprint(hash, chunk->origin, sizeof chunk->origin);
        if (cloud->packed)
            hash = pt_fingerprint(hash, &step, sizeof step);
    }
    if (cloud->opacities)
        hash = fingerprint_array(hash, cloud, cloud->opacities, cloud->slots);
    return hash;
}

uint64_t pt_cloud_fingerprint(const struct patina_cloud *cloud)
{
    uint64_t known = atomic_load(&cloud->alive->fingerprint);
    if (!known) { // threads that meet here find the same
        known = fingerprint_of(cloud) | 1u;
        atomic_store(&cloud->alive->fingerprint, known);
    }
    return known;
}

uint64_t pt_cloud_stamp(const struct patina_cloud *cloud)
{
    const struct pt_alive *alive = cloud->alive;
    return mix(mix(alive->serial, atomic_load(&alive->pages)), atomic_load(&alive->shapes)) | 1u;
}

// The bytes of an array and what they mean; `hash` is what came before.
static uint64_t add_array(uint64_t hash, const patina_array *array, uint64_t count)
{
    static const uint64_t bytes[] = {0, 4, 8, 1, 2, 4, 1, 2, 4}; // by patina_type
    hash = mix(mix(mix(hash, array->data != NULL), array->type), array->components);
    return array->data ? pt_fingerprint(hash, array->data, count * array->components * bytes[array->type]) : hash;
}

enum { MOST_COMPONENTS = 4 }; // that any array of a descriptor may have

int pt_desc_fingerprint(const patina_cloud_desc *desc, uint64_t values[2])
{
    const patina_array *arrays[] = {&desc->position, &desc->normal, &desc->opacity, &desc->radius,
                                    &desc->classes,  &desc->color,  &desc->scalar};
    for (int i = 0; i < 7; i++)
        if (arrays[i]->data && (arrays[i]->type > PATINA_INT32 || arrays[i]->stride || arrays[i]->components > MOST_COMPONENTS))
            return pt_fail(NULL, PATINA_ERROR_ARGUMENT,
                           "patina_task_fingerprint: array %d is not tightly packed, of an unknown type, or of more than %d "
                           "components",
                           i, MOST_COMPONENTS);
    values[0] = mix(0, desc->count);
    values[1] = mix(1, desc->count);
    for (int i = 0; i < 7; i++)
        values[i / 5] = add_array(values[i / 5], arrays[i], desc->count);
    return PATINA_OK;
}
