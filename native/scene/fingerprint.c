// SPDX-License-Identifier: GPL-3.0-or-later
// What a cloud is, in 64 bits: shadow textures belong to points (SPEC 4), and files of them must know theirs again.
#include "cloud.h"
#include "fingerprint.h"

#include <string.h>

enum { WAYS = 4 }; // multiplications in flight

static uint64_t mix(uint64_t hash, uint64_t word)
{
    hash = (hash ^ word) * 0x9E3779B97F4A7C15ull;
    return hash ^ hash >> 29;
}

uint64_t pt_fingerprint(uint64_t seed, const void *data, size_t size)
{
    uint64_t ways[WAYS] = { seed, seed + 1, seed + 2, seed + 3 }, words[WAYS] = { 0 };
    const char *at = data;
    for (; size >= sizeof words; size -= sizeof words, at += sizeof words) {
        memcpy(words, at, sizeof words);
        for (int i = 0; i < WAYS; i++)
            ways[i] = mix(ways[i], words[i]);
    }
    memset(words, 0, sizeof words);
    if (size)
        memcpy(words, at, size);
    uint64_t hash = mix(seed, size);
    for (int i = 0; i < WAYS; i++)
        hash = mix(hash, mix(ways[i], words[i]));
    return hash;
}

uint64_t pt_cloud_fingerprint(const struct patina_cloud *cloud)
{
    uint64_t hash = pt_fingerprint(cloud->info.count, cloud->positions, cloud->slots * 12);
    hash = pt_fingerprint(hash, cloud->ids, cloud->slots * 4);
    for (uint32_t c = 0; c < cloud->chunk_count; c++) {
        const struct pt_chunk *chunk = &cloud->chunks[c];
        hash = pt_fingerprint(hash, chunk->origin, sizeof chunk->origin);
        for (uint32_t i = 0; i < chunk->count; i++)
            hash = mix(hash, cloud->surface[cloud->ids[chunk->first + i]]);
    }
    return hash;
}
