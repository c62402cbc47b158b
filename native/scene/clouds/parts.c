// SPDX-License-Identifier: GPL-3.0-or-later
#include "parts.h"

#include "base/platform.h"
#include "clusters.h"

#include <stdlib.h>

uint64_t pt_part_slots(void)
{
    const char *told = getenv("PATINA_PART_SLOTS");
    const unsigned long long most = told ? strtoull(told, NULL, 10) : 0;
    return !most || most > 0x7FFFFFFF ? 0x7FFFFFFF : most > PT_CHUNK_POINTS ? most : PT_CHUNK_POINTS;
}

// The chunks from `first` on that fit.
static uint32_t fitting(const struct patina_cloud *cloud, uint32_t first, uint64_t most)
{
    uint64_t slots = 0;
    uint32_t c = first;
    while (c < cloud->chunk_count && slots + cloud->chunks[c].padded <= most)
        slots += cloud->chunks[c++].padded;
    return c - first;
}

// A part's arrays begin in the whole's.
static void lay_arrays(const struct patina_cloud *whole, struct patina_cloud *part)
{
    struct patina_cloud copy = *whole;
    struct pt_section from[PT_ARRAYS], to[PT_ARRAYS];
    pt_cloud_sections(&copy, from);
    pt_cloud_sections(part, to);
    for (int i = PT_ARRAY_POSITIONS; i < PT_ARRAY_SIGHTS; i++) {
        char *data = *from[i].data;
        *to[i].data = data ? data + part->first_slot * pt_cloud_array_bytes(whole, (enum pt_array)i) : NULL;
    }
}

int pt_part_begin(const struct patina_cloud *whole, uint32_t first_chunk, uint32_t chunks, uint64_t first_slot,
                  uint64_t first_number, struct patina_cloud *part)
{
    *part = *whole;
    part->parts = NULL;
    part->part_count = 0;
    part->clusters = NULL;
    part->begins = NULL;
    part->first_chunk = first_chunk;
    part->first_slot = first_slot;
    part->first_number = first_number;
    part->chunks = whole->chunks + first_chunk;
    part->chunk_count = chunks;
    part->info.chunks = chunks;
    lay_arrays(whole, part);
    pt_handle_init(&part->handle);
    part->alive = pt_alive_create();
    return part->alive ? PATINA_OK : PATINA_ERROR_MEMORY;
}

// Part of the whole from a chunk on, whose points before it are known.
static int make_part(const struct patina_cloud *whole, uint32_t first_chunk, uint32_t chunks, const struct patina_cloud *before,
                     struct patina_cloud *part)
{
    const int error = pt_part_begin(whole, first_chunk, chunks, before ? before->first_slot + before->slots : 0,
                                    before ? before->first_number + before->info.drawn : 0, part);
    part->slots = part->info.drawn = 0;
    for (uint32_t c = 0; c < chunks; c++) {
        part->chunks[c].first = (uint32_t)part->slots;
        part->slots += part->chunks[c].padded;
        part->info.drawn += part->chunks[c].count;
    }
    if (error || (part->unordered && pt_cloud_count_places(part)))
        return PATINA_ERROR_MEMORY;
    if (whole->clusters)
        pt_clusters_make(part);
    return PATINA_OK;
}

int pt_parts_make(struct patina_cloud *cloud, uint64_t most)
{
    if (cloud->slots <= most)
        return PATINA_OK;
    const uint64_t each = pt_part_share(most);
    uint32_t count = 0;
    for (uint32_t c = 0; c < cloud->chunk_count; c += fitting(cloud, c, each))
        count++;
    struct patina_cloud *parts = calloc(count, sizeof *parts);
    if (!parts)
        return PATINA_ERROR_MEMORY;
    for (uint32_t c = 0; cloud->part_count < count; cloud->part_count++) {
        const uint32_t i = cloud->part_count, chunks = fitting(cloud, c, each);
        const int error = make_part(cloud, c, chunks, i ? &parts[i - 1] : NULL, &parts[i]);
        if (error) {
            cloud->parts = parts;
            cloud->part_count++;
            pt_parts_destroy(cloud);
            return error;
        }
        c += chunks;
    }
    cloud->parts = parts;
    return PATINA_OK;
}

void pt_parts_follow(struct patina_cloud *cloud)
{
    for (uint32_t i = 0; i < cloud->part_count; i++) {
        struct patina_cloud *part = &cloud->parts[i];
        const uint64_t drawn = part->info.drawn, chunks = part->info.chunks;
        part->info = cloud->info;
        part->info.drawn = drawn;
        part->info.chunks = chunks;
        part->mapped = cloud->mapped;
        part->color_format = cloud->color_format;
        lay_arrays(cloud, part);
        atomic_fetch_add(&part->alive->colors, 1);
    }
}

int pt_parts_refuse(const struct patina_cloud *cloud, const char *call)
{
    return cloud->part_count ? pt_fail(&cloud->handle, PATINA_ERROR_TOO_MANY_POINTS,
                                       "%s: takes a cloud of up to %llu points, and of %llu not yet", call,
                                       (unsigned long long)pt_part_slots(), (unsigned long long)cloud->info.count)
                             : PATINA_OK;
}

// Arrays, chunks, sums of pages and what stations saw are the whole's.
void pt_parts_destroy(struct patina_cloud *cloud)
{
    for (uint32_t i = 0; i < cloud->part_count; i++) {
        struct patina_cloud *part = &cloud->parts[i];
        pt_alive_end(part->alive);
        free(part->begins);
        free(part->clusters);
        pt_handle_destroy(&part->handle);
    }
    free(cloud->parts);
    cloud->parts = NULL;
    cloud->part_count = 0;
}
