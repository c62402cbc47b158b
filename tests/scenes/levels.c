// SPDX-License-Identifier: GPL-3.0-or-later
#include "levels.h"

#include "base/platform.h"
#include "scene/clouds/cloud.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// 0: the coarsest.
static uint32_t level_of(uint32_t number, uint32_t levels)
{
    uint32_t word = number * 0x9E3779B1u, level = levels - 1;
    word ^= word >> 15;
    word *= 0x85EBCA77u;
    word ^= word >> 13;
    for (; level && !(word & 3u); word >>= 2)
        level--;
    return level;
}

// Arrays of the cloud as it becomes.
struct dealt {
    const struct patina_cloud *from;
    struct pt_chunk *chunks;
    float *positions;
    uint32_t *order, *surfels, *shapes;
    uint8_t *colors;
    uint32_t chunk_count;
    uint64_t slots;
};

static void copy_point(struct dealt *to, const struct pt_chunk *source, uint32_t i, struct pt_chunk *chunk, float (*place)[3])
{
    const struct patina_cloud *from = to->from;
    const uint64_t slot = source->first + i, out = chunk->first + chunk->count;
    for (int k = 0; k < 3; k++) {
        const double p =
            (double)((const float *)from->positions)[3 * (uint64_t)source->first + (uint64_t)k * source->padded + i];
        place[chunk->count][k] = (float)(p + (source->origin[k] - chunk->origin[k]));
    }
    to->order[out] = from->order[slot];
    to->surfels[out] = from->surfels[slot];
    to->shapes[out] = from->shapes[slot];
    memcpy(to->colors + 3 * out, (const uint8_t *)from->colors + 3 * slot, 3);
    chunk->count++;
}

// Of all chunks that it takes points of.
static void take_numbers(struct pt_chunk *chunk, const struct pt_chunk *source)
{
    for (int k = 0; k < 8; k++) {
        chunk->classes[k] |= source->classes[k];
        chunk->shapes[k] |= source->shapes[k];
    }
    chunk->reach = fmaxf(chunk->reach, source->reach);
    chunk->footprint = fmaxf(chunk->footprint, source->footprint);
}

static void end_chunk(struct dealt *to, float (*place)[3], float gap)
{
    struct pt_chunk *chunk = &to->chunks[to->chunk_count];
    if (!chunk->count)
        return;
    chunk->padded = (chunk->count + PT_CHUNK_ALIGN - 1) / PT_CHUNK_ALIGN * PT_CHUNK_ALIGN;
    chunk->gap = gap;
    const uint64_t first = chunk->first, last = first + chunk->count - 1;
    for (int k = 0; k < 3; k++) {
        float *axis = to->positions + 3 * first + (uint64_t)k * chunk->padded;
        chunk->box_min[k] = chunk->box_max[k] = place[0][k];
        for (uint32_t i = 0; i < chunk->padded; i++) {
            axis[i] = place[i < chunk->count ? i : chunk->count - 1][k];
            chunk->box_min[k] = fminf(chunk->box_min[k], axis[i]);
            chunk->box_max[k] = fmaxf(chunk->box_max[k], axis[i]);
        }
    }
    for (uint64_t i = last + 1; i < first + chunk->padded; i++) {
        to->order[i] = to->order[last];
        to->surfels[i] = to->surfels[last];
        to->shapes[i] = to->shapes[last];
        memcpy(to->colors + 3 * i, to->colors + 3 * last, 3);
    }
    pt_chunk_cone(chunk, to->surfels + first);
    to->slots += chunk->padded;
    to->chunk_count++;
}

static void deal_level(struct dealt *to, uint32_t level, uint32_t levels, float (*place)[3])
{
    const float gap = (float)(to->from->info.spacing * exp2((double)(levels - 1 - level)));
    for (uint32_t c = 0; c < to->from->chunk_count; c++) {
        const struct pt_chunk *source = &to->from->chunks[c];
        for (uint32_t i = 0; i < source->count; i++) {
            struct pt_chunk *chunk = &to->chunks[to->chunk_count];
            if (level_of(to->from->order[source->first + i], levels) != level)
                continue;
            if (!chunk->count) {
                *chunk = *source;
                chunk->first = (uint32_t)to->slots;
                chunk->count = 0;
            }
            take_numbers(chunk, source);
            copy_point(to, source, i, chunk, place);
            if (chunk->count == PT_CHUNK_POINTS)
                end_chunk(to, place, gap);
        }
    }
    end_chunk(to, place, gap);
}

static void replace(void **array, uint64_t old_bytes, void *dealt, uint64_t bytes)
{
    pt_pages_free(*array, old_bytes);
    *array = pt_pages_alloc(bytes);
    if (!*array)
        support_die("levels: out of memory");
    memcpy(*array, dealt, bytes);
    free(dealt);
}

static void take_over(patina_cloud *cloud, struct dealt *to)
{
    const uint64_t old = cloud->slots, slots = to->slots;
    replace(&cloud->positions, old * 12, to->positions, slots * 12);
    replace((void **)&cloud->order, old * 4, to->order, slots * 4);
    replace((void **)&cloud->surfels, old * 4, to->surfels, slots * 4);
    replace((void **)&cloud->shapes, old * 4, to->shapes, slots * 4);
    replace(&cloud->colors, old * 3 + 4, to->colors, slots * 3 + 4);
    free(cloud->chunks);
    cloud->chunks = to->chunks;
    cloud->chunk_count = cloud->info.chunks = to->chunk_count;
    cloud->slots = slots;
}

void levels_make(patina_cloud *cloud, uint32_t levels, struct level *out)
{
    const uint64_t most = cloud->slots + PT_CHUNK_ALIGN * (uint64_t)levels + PT_CHUNK_POINTS;
    struct dealt to = {.from = cloud};
    float(*place)[3] = calloc(PT_CHUNK_POINTS, sizeof *place);
    to.chunks = calloc(most / PT_CHUNK_POINTS + levels + 2, sizeof *to.chunks);
    to.positions = malloc(most * 12);
    to.order = malloc(most * 4);
    to.surfels = malloc(most * 4);
    to.shapes = malloc(most * 4);
    to.colors = calloc(most + 2, 3);
    if (!place || !to.chunks || !to.positions || !to.order || !to.surfels || !to.shapes || !to.colors || !cloud->shapes ||
        cloud->color_format != PT_COLOR_SRGB8)
        support_die("levels: out of memory, or the cloud was not analysed or has no colours");
    for (uint32_t level = 0; level < levels; level++) {
        out[level].chunk = to.chunk_count;
        out[level].slot = to.slots;
        deal_level(&to, level, levels, place);
        out[level].chunk_end = to.chunk_count;
        out[level].slot_end = to.slots;
    }
    free(place);
    take_over(cloud, &to);
}
