// SPDX-License-Identifier: GPL-3.0-or-later
// A scanner gives points that its camera did not see 0, 0, 0. Among colored points they are black specks. A black surface has black points
// around each of its own, so the neighborhood decides. Rounds read what the rounds before them left: the same for any threads.
#include "uncolored.h"
#include "analysis.h"
#include "base/color.h"
#include "base/platform.h"
#include "base/progress.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

// A point of a straight line of black points has 4 black ones among its 16 nearest, one at the rim of a black area 6 and more: both stay.
enum { NEIGHBOURS = 16, MOST_ABSENT = 3, ROUNDS = 4, COLORED = 0, ABSENT = 255 };

struct search {
    struct pt_uncolored *job;
    const struct pt_neighbours *tree;
    uint8_t *rounds; // slots: COLORED, the round that found the color, or ABSENT
    uint32_t round;
    double linear[256];
    atomic_uint_fast64_t absent, found;
};

static int is_absent(const struct patina_cloud *cloud, size_t slot)
{
    if (cloud->info.uncolored && cloud->shapes && cloud->shapes[slot] & PT_SHAPE_UNCOLORED)
        return 1;
    if (cloud->color_format == PT_COLOR_SRGB8) {
        const uint8_t *c = (const uint8_t *)cloud->colors + 3 * slot;
        return !(c[0] | c[1] | c[2]);
    }
    const float *c = (const float *)cloud->colors + 3 * slot;
    return c[0] == 0.0f && c[1] == 0.0f && c[2] == 0.0f;
}

static void look_for_absent(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct search *search = context;
    const struct patina_cloud *cloud = search->job->cloud;
    uint64_t absent = 0;
    (void)thread;
    for (uint32_t c = begin; c < end; c++) {
        const struct pt_chunk *chunk = &cloud->chunks[c];
        for (size_t slot = chunk->first; slot < (size_t)chunk->first + chunk->padded; slot++) {
            const int is = is_absent(cloud, slot);
            search->job->shapes[slot] &= ~PT_SHAPE_UNCOLORED;
            absent += is && slot < (size_t)chunk->first + chunk->count;
            if (search->rounds)
                search->rounds[slot] = is ? ABSENT : COLORED;
        }
        pt_store_look(search->job->store);
    }
    atomic_fetch_add(&search->absent, absent);
}

static void light_of(const struct search *search, size_t slot, double light[3])
{
    const struct pt_uncolored *job = search->job;
    for (size_t k = 0; k < 3; k++)
        light[k] = job->cloud->color_format == PT_COLOR_SRGB8 ? search->linear[((const uint8_t *)job->colors)[3 * slot + k]]
                                                              : (double)((const float *)job->colors)[3 * slot + k];
}

static void set_color(const struct search *search, size_t slot, const double light[3])
{
    struct pt_uncolored *job = search->job;
    for (size_t k = 0; k < 3; k++)
        if (job->cloud->color_format == PT_COLOR_SRGB8)
            ((uint8_t *)job->colors)[3 * slot + k] = (uint8_t)(255.0 * pt_srgb_of_linear(light[k]) + 0.5);
        else
            ((float *)job->colors)[3 * slot + k] = (float)light[k];
}

// Whether the point in a lane got the mean of its neighbors' colors.
static int color_point(const struct search *search, uint32_t place, const struct pt_found *found)
{
    const uint32_t lane = place % PT_LEAF, slot = search->tree->slots[place];
    uint32_t colored = 0, absent = 0;
    double sum[3] = {0.0, 0.0, 0.0}, light[3];
    for (uint32_t i = 0; i < found->count[lane]; i++) {
        const uint32_t beside = search->tree->slots[found->place[lane][i]], round = search->rounds[beside];
        if ((search->job->shapes[beside] >> PT_SHAPE_TRUST_SHIFT & 15u) < search->job->least_level)
            continue;
        if (round >= search->round) { // in this round, or never
            absent++;
            continue;
        }
        colored++;
        light_of(search, beside, light);
        for (int k = 0; k < 3; k++)
            sum[k] += light[k];
    }
    if (found->count[lane] < NEIGHBOURS || !colored || absent * NEIGHBOURS > MOST_ABSENT * (colored + absent))
        return 0;
    for (int k = 0; k < 3; k++)
        light[k] = sum[k] / colored;
    set_color(search, slot, light);
    search->rounds[slot] = (uint8_t)search->round;
    return 1;
}

static void color_leaves(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct search *search = context;
    struct pt_found found;
    uint64_t count = 0;
    (void)thread;
    for (uint32_t leaf = begin; leaf < end && !pt_progress_cancelled(search->job->progress); leaf++) {
        uint32_t lanes = 0;
        for (uint32_t left = pt_leaf_lanes(search->tree, leaf); left; left &= left - 1) {
            const uint32_t lane = (uint32_t)__builtin_ctz(left);
            lanes |= (uint32_t)(search->rounds[search->tree->slots[leaf * PT_LEAF + lane]] == ABSENT) << lane;
        }
        if (!lanes)
            continue;
        pt_neighbours_find(search->tree, search->tree, leaf, lanes, NEIGHBOURS, &found);
        for (uint32_t left = lanes; left; left &= left - 1)
            count += (uint64_t)color_point(search, leaf * PT_LEAF + (uint32_t)__builtin_ctz(left), &found);
        pt_store_look(search->job->store);
    }
    atomic_fetch_add(&search->found, count);
}

// Sets the bit of all points that got a color, and padding to what it repeats.
static void mark_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct search *search = context;
    const struct patina_cloud *cloud = search->job->cloud;
    const size_t size = pt_color_size(cloud->color_format);
    (void)thread;
    for (uint32_t c = begin; c < end; c++) {
        const struct pt_chunk *chunk = &cloud->chunks[c];
        for (size_t i = 0; i < chunk->padded && chunk->count; i++) {
            const size_t slot = chunk->first + i, of = chunk->first + (i < chunk->count ? i : chunk->count - 1u);
            const uint32_t round = search->rounds[of];
            search->job->shapes[slot] |= round != COLORED && round != ABSENT ? PT_SHAPE_UNCOLORED : 0u;
            if (of != slot)
                memcpy((char *)search->job->colors + slot * size, (const char *)search->job->colors + of * size, size);
        }
        pt_store_look(search->job->store);
    }
}

// Absent points whose color was a neighbors' before read black again.
static void copy_colors(struct search *search)
{
    const struct pt_uncolored *job = search->job;
    const size_t size = pt_color_size(job->cloud->color_format), piece = PT_CHUNK_POINTS;
    for (size_t first = 0; first < job->cloud->slots; first += piece) {
        const size_t count = job->cloud->slots - first < piece ? (size_t)job->cloud->slots - first : piece;
        memcpy((char *)job->colors + first * size, (const char *)job->cloud->colors + first * size, count * size);
        for (size_t slot = first; slot < first + count; slot++)
            if (search->rounds[slot] == ABSENT)
                memset((char *)job->colors + slot * size, 0, size);
        pt_store_look(job->store);
    }
}

static int color_points(struct search *search, struct pt_pool *pool)
{
    struct pt_uncolored *job = search->job;
    const struct patina_cloud *cloud = job->cloud;
    struct pt_neighbours own = {0};
    int error = job->tree ? PATINA_OK : pt_neighbours_create(&own, cloud, PT_STRATA, job->store, pool, job->progress, 0.0, 0.5);
    if (error)
        return error;
    own.any_twins = 1;
    search->tree = job->tree ? job->tree : &own;
    search->rounds = pt_store_alloc(job->store, cloud->slots);
    job->colors = search->rounds ? pt_store_alloc(job->store, pt_color_bytes(cloud)) : NULL;
    if (job->colors) {
        uint64_t before = 0;
        pt_parallel(pool, cloud->chunk_count, 4, look_for_absent, search);
        copy_colors(search);
        for (search->round = 1; search->round <= ROUNDS && !job->keep; search->round++) {
            pt_parallel(pool, search->tree->leaf_count, 64, color_leaves, search);
            job->count = atomic_load(&search->found);
            if (job->count == before)
                break;
            before = job->count;
        }
        pt_parallel(pool, cloud->chunk_count, 4, mark_chunks, search);
        error = pt_progress_cancelled(job->progress) ? PATINA_ERROR_CANCELLED : PATINA_OK;
    } else {
        error = PATINA_ERROR_MEMORY;
    }
    pt_store_free(job->store, search->rounds, cloud->slots);
    if (!job->tree)
        pt_neighbours_destroy(&own);
    return error;
}

int pt_uncolored_find(struct pt_uncolored *job, struct pt_pool *pool)
{
    const struct patina_cloud *cloud = job->cloud;
    struct search search = {.job = job};
    job->colors = NULL;
    job->count = 0;
    if (!cloud->colors || (job->keep && !cloud->info.uncolored))
        return PATINA_OK;
    for (int i = 0; i < 256; i++)
        search.linear[i] = pt_linear_of_srgb(i / 255.0);
    pt_parallel(pool, cloud->chunk_count, 4, look_for_absent, &search);
    const uint64_t absent = atomic_load(&search.absent);
    if (!absent || absent == cloud->info.drawn)
        return PATINA_OK; // all of them black: nobody lends a color
    const int error = color_points(&search, pool);
    if (error || (!job->count && !cloud->info.uncolored)) {
        pt_store_free(job->store, job->colors, pt_color_bytes(cloud));
        job->colors = NULL;
    }
    return error;
}

// Makes the shape words the cloud's own, so that they can be written: words of a mapped file cannot. Devices may hold the address of the
// words before: the new state makes them take the new one. 0 or PATINA_ERROR_MEMORY.
static int own_shapes(struct patina_cloud *cloud)
{
    const size_t size = cloud->slots * sizeof *cloud->shapes;
    uint32_t *shapes = cloud->mapped >> PT_ARRAY_SHAPES & 1u ? pt_pages_alloc(size) : cloud->shapes;
    if (!shapes)
        return PATINA_ERROR_MEMORY;
    if (shapes == cloud->shapes)
        return PATINA_OK;
    memcpy(shapes, cloud->shapes, size);
    pt_pages_free(cloud->shapes, size);
    cloud->shapes = shapes;
    cloud->info.bytes += size;
    cloud->mapped &= ~(1u << PT_ARRAY_SHAPES);
    atomic_fetch_add(&cloud->alive->shapes, 1);
    return PATINA_OK;
}

// After the colors of an analysed cloud were replaced: the same, with a tree of its own. Without memory they stay as they are.
static void lend_again(struct patina_cloud *cloud, struct pt_pool *pool)
{
    if (cloud->part_count || own_shapes(cloud))
        return;
    struct pt_uncolored job = {.cloud = cloud, .shapes = cloud->shapes, .least_level = pt_default_level(cloud->info.trusts)};
    for (size_t slot = 0; slot < cloud->slots; slot++) // the bits are of the colors before
        cloud->shapes[slot] &= ~PT_SHAPE_UNCOLORED;
    if (!pt_uncolored_find(&job, pool) && job.colors) {
        pt_pages_free(cloud->colors, pt_color_bytes(cloud));
        cloud->colors = job.colors;
        cloud->info.uncolored = job.count;
        atomic_fetch_add(&cloud->alive->colors, 1);
    }
}

int patina_cloud_set_colors(patina_cloud *cloud, const patina_array *color)
{
    const int error = pt_cloud_set_colors(cloud, color);
    if (error || !cloud->shapes || cloud->keeps_colors)
        return error;
    struct pt_pool *pool = pt_pool_create(cloud->threads, 0);
    if (pool)
        lend_again(cloud, pool);
    pt_pool_destroy(pool);
    return PATINA_OK;
}
