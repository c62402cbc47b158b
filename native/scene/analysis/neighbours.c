// SPDX-License-Identifier: GPL-3.0-or-later
#include "neighbours.h"
#include "base/platform.h"
#include "base/progress.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// ---- leaves of a chunk -----------------------------------------------------------------------------------------------------

struct place {
    float p[3];
    uint32_t slot;
};

// A strict order: leaves do not depend on how they were found.
static int before(const struct place *a, const struct place *b, int axis)
{
    return a->p[axis] < b->p[axis] || (a->p[axis] == b->p[axis] && a->slot < b->slot);
}

// The `middle` least come first (Wirth's selection; its pivot suits points that nearly lie in order).
static void split_at(struct place *places, uint32_t count, uint32_t middle, int axis)
{
    int64_t low = 0, high = (int64_t)count - 1, wanted = middle;
    while (low < high) {
        const struct place pivot = places[wanted];
        int64_t i = low, j = high;
        do {
            while (before(&places[i], &pivot, axis))
                i++;
            while (before(&pivot, &places[j], axis))
                j--;
            if (i <= j) {
                const struct place kept = places[i];
                places[i++] = places[j];
                places[j--] = kept;
            }
        } while (i <= j);
        low = j < wanted ? i : low;
        high = wanted < i ? j : high;
    }
}

struct fill {
    struct pt_neighbours *tree;
    struct patina_progress *progress;
    double begin, end;
    atomic_uint done;
};

static void fill_leaf(struct pt_neighbours *tree, uint32_t leaf, const struct place *places, uint32_t count)
{
    float *xyz = tree->places + (size_t)leaf * 3 * PT_LEAF;
    for (uint32_t lane = 0; lane < PT_LEAF; lane++) {
        for (int k = 0; k < 3; k++)
            xyz[k * PT_LEAF + (int)lane] = lane < count ? places[lane].p[k] : INFINITY;
        tree->slots[leaf * PT_LEAF + lane] = places[lane < count ? lane : count - 1].slot;
    }
}

// Splits the points along their box's longest side, at whole leaves. All leaves but a chunk's last are full.
static void split(struct pt_neighbours *tree, struct place *places, uint32_t count, uint32_t leaf, struct pt_box_node *node)
{
    const uint32_t leaves = (count + PT_LEAF - 1) / PT_LEAF;
    int axis = 0;
    for (int k = 0; k < 3; k++) {
        node->low[k] = node->high[k] = places[0].p[k];
        for (uint32_t i = 1; i < count; i++) {
            node->low[k] = places[i].p[k] < node->low[k] ? places[i].p[k] : node->low[k];
            node->high[k] = places[i].p[k] > node->high[k] ? places[i].p[k] : node->high[k];
        }
        axis = node->high[k] - node->low[k] > node->high[axis] - node->low[axis] ? k : axis;
    }
    if (leaves == 1) {
        fill_leaf(tree, leaf, places, count);
        return;
    }
    const uint32_t left = (leaves + 1) / 2, middle = left * PT_LEAF;
    split_at(places, count, middle, axis);
    split(tree, places, middle, leaf, node + 1);
    split(tree, places + middle, count - middle, leaf + left, node + 2 * left);
}

static void fill_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct fill *fill = context;
    struct pt_neighbours *tree = fill->tree;
    struct place places[PT_CHUNK_POINTS];
    float unpacked[3 * PT_CHUNK_POINTS];
    (void)thread;
    for (uint32_t c = begin; c < end && !pt_progress_cancelled(fill->progress); c++) {
        const struct pt_chunk *chunk = &tree->cloud->chunks[c];
        const float *xyz = pt_chunk_positions(tree->cloud, chunk, unpacked);
        const uint32_t first = tree->chunk_leaf[c], count = pt_neighbours_of_chunk(tree, c);
        for (uint32_t i = 0; i < count; i++)
            places[i] = (struct place){{xyz[i], xyz[chunk->padded + i], xyz[2 * chunk->padded + i]}, chunk->first + i};
        split(tree, places, count, first, tree->nodes + 2 * (size_t)first);
        for (uint32_t leaf = first; leaf < tree->chunk_leaf[c + 1]; leaf++)
            tree->leaf_chunk[leaf] = c;
        uint32_t done = atomic_fetch_add_explicit(&fill->done, 1, memory_order_relaxed);
        pt_progress_raise(fill->progress, fill->begin + (fill->end - fill->begin) * done / tree->chunk_count);
    }
}

// ---- the tree over chunks --------------------------------------------------------------------------------------------------

struct middle {
    double p[3];
    uint32_t chunk;
};

// What places may be off by in the cloud's frame.
static double rounding_of(const struct pt_neighbours *tree)
{
    double most = 0.0;
    for (uint32_t c = 0; c < tree->chunk_count; c++)
        for (int k = 0; k < 3; k++) {
            const struct pt_chunk *chunk = &tree->cloud->chunks[c];
            const double box = fmax(fabs((double)chunk->box_min[k]), fabs((double)chunk->box_max[k]));
            most = fmax(most, fabs(chunk->origin[k]) + fabs(tree->origin[k]) + box);
        }
    return 8.0 * DBL_EPSILON * most;
}

static int compare_axis(const void *a, const void *b, int axis)
{
    const struct middle *x = a, *y = b;
    return x->p[axis] < y->p[axis] ? -1 : x->p[axis] > y->p[axis] ? 1 : (x->chunk > y->chunk) - (x->chunk < y->chunk);
}
static int compare_x(const void *a, const void *b) { return compare_axis(a, b, 0); }
static int compare_y(const void *a, const void *b) { return compare_axis(a, b, 1); }
static int compare_z(const void *a, const void *b) { return compare_axis(a, b, 2); }

static void split_chunks(struct pt_neighbours *tree, struct middle *middles, uint32_t count, uint32_t at, double slack,
                         struct pt_chunk_node *node)
{
    static int (*const compare[3])(const void *, const void *) = {compare_x, compare_y, compare_z};
    int axis = 0;
    for (int k = 0; k < 3; k++) {
        node->low[k] = INFINITY;
        node->high[k] = -INFINITY;
        for (uint32_t i = 0; i < count; i++) {
            const struct pt_chunk *chunk = &tree->cloud->chunks[middles[i].chunk];
            const double place = chunk->origin[k] - tree->origin[k];
            const double low = place + (double)chunk->box_min[k], high = place + (double)chunk->box_max[k];
            node->low[k] = fmin(node->low[k], low - slack);
            node->high[k] = fmax(node->high[k], high + slack);
        }
        axis = node->high[k] - node->low[k] > node->high[axis] - node->low[axis] ? k : axis;
    }
    if (count == 1) {
        tree->chunk_order[at] = middles[0].chunk;
        return;
    }
    qsort(middles, count, sizeof *middles, compare[axis]);
    const uint32_t left = (count + 1) / 2;
    split_chunks(tree, middles, left, at, slack, node + 1);
    split_chunks(tree, middles + left, count - left, at + left, slack, node + 2 * left);
}

static int build_chunk_nodes(struct pt_neighbours *tree)
{
    struct middle *middles = malloc((tree->chunk_count + 1) * sizeof *middles);
    if (!middles)
        return PATINA_ERROR_MEMORY;
    for (uint32_t c = 0; c < tree->chunk_count; c++) {
        memcpy(middles[c].p, tree->cloud->chunks[c].origin, sizeof middles[c].p);
        middles[c].chunk = c;
    }
    if (tree->chunk_count)
        split_chunks(tree, middles, tree->chunk_count, 0, rounding_of(tree), tree->chunk_nodes);
    free(middles);
    return PATINA_OK;
}

// ---- create ----------------------------------------------------------------------------------------------------------------

static int best_level(void)
{
#if (defined(__x86_64__) || defined(__i386__)) && !defined(PT_ONLY_SCALAR)
    const enum pt_vectors level = pt_processor_vectors();
    if (level >= PT_VECTORS_AVX2)
        return level >= PT_VECTORS_AVX512 ? 2 : 1;
#endif
    return 0;
}

uint32_t pt_neighbours_of_chunk(const struct pt_neighbours *tree, uint32_t chunk)
{
    return pt_chunk_prefix(&tree->cloud->chunks[chunk], tree->strata);
}

int pt_neighbours_create(struct pt_neighbours *tree, const struct patina_cloud *cloud, uint32_t strata, struct pt_store *store,
                         struct pt_pool *pool, struct patina_progress *progress, double begin, double end)
{
    *tree = (struct pt_neighbours){
        .cloud = cloud, .store = store, .chunk_count = cloud->chunk_count, .strata = strata, .level = best_level()};
    int error = PATINA_ERROR_MEMORY;
    tree->chunk_leaf = malloc((cloud->chunk_count + 1) * sizeof *tree->chunk_leaf);
    if (!tree->chunk_leaf)
        return error;
    for (uint32_t c = 0; c < cloud->chunk_count; c++) {
        tree->chunk_leaf[c] = tree->leaf_count;
        tree->leaf_count += (pt_neighbours_of_chunk(tree, c) + PT_LEAF - 1) / PT_LEAF;
    }
    tree->chunk_leaf[cloud->chunk_count] = tree->leaf_count;
    for (int k = 0; k < 3 && cloud->chunk_count; k++)
        tree->origin[k] = cloud->chunks[0].origin[k];
    tree->places = pt_store_alloc(store, (size_t)tree->leaf_count * PT_LEAF * 12);
    tree->slots = pt_store_alloc(store, (size_t)tree->leaf_count * PT_LEAF * 4);
    tree->leaf_chunk = pt_store_alloc(store, (size_t)tree->leaf_count * 4);
    tree->nodes = pt_store_alloc(store, (size_t)tree->leaf_count * 2 * sizeof *tree->nodes);
    tree->chunk_nodes = malloc((2 * (size_t)cloud->chunk_count + 1) * sizeof *tree->chunk_nodes);
    tree->chunk_order = malloc((cloud->chunk_count + 1) * sizeof *tree->chunk_order);
    if (tree->places && tree->slots && tree->leaf_chunk && tree->nodes && tree->chunk_nodes && tree->chunk_order)
        error = build_chunk_nodes(tree);
    if (!error) {
        struct fill fill = {.tree = tree, .progress = progress, .begin = begin, .end = end};
        pt_parallel(pool, tree->chunk_count, 1, fill_chunks, &fill);
        error = pt_progress_cancelled(progress) ? PATINA_ERROR_CANCELLED : PATINA_OK;
    }
    if (error)
        pt_neighbours_destroy(tree);
    return error;
}

void pt_neighbours_destroy(struct pt_neighbours *tree)
{
    pt_store_free(tree->store, tree->places, (size_t)tree->leaf_count * PT_LEAF * 12);
    pt_store_free(tree->store, tree->slots, (size_t)tree->leaf_count * PT_LEAF * 4);
    pt_store_free(tree->store, tree->leaf_chunk, (size_t)tree->leaf_count * 4);
    pt_store_free(tree->store, tree->nodes, (size_t)tree->leaf_count * 2 * sizeof *tree->nodes);
    free(tree->chunk_leaf);
    free(tree->chunk_nodes);
    free(tree->chunk_order);
    *tree = (struct pt_neighbours){0};
}
