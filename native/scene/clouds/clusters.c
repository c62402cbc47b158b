// SPDX-License-Identifier: GPL-3.0-or-later
#include "clusters.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FEWEST = 4 }; // clusters that are worth while

// So much wider than it is, of its size and of where it lies: far more than float64 and the chunks' own boxes round.
#define WIDER 0x1p-10
#define FARTHER 0x1p-44

static void widen(struct pt_cluster *cluster, const struct pt_chunk *chunk, double low[3], double high[3])
{
    struct pt_chunk *around = &cluster->around;
    const double gap = (double)chunk->gap;
    double sum = (double)chunk->reach + (double)chunk->footprint + (double)chunk->spacing + gap;
    for (int k = 0; k < 3; k++) {
        const double first = chunk->origin[k] + (double)chunk->box_min[k], last = chunk->origin[k] + (double)chunk->box_max[k];
        sum += fabs(first) + fabs(last) + fabs(chunk->origin[k]);
        low[k] = first < low[k] ? first : low[k];
        high[k] = last > high[k] ? last : high[k];
    }
    cluster->known &= isfinite(sum) != 0;
    around->reach = fmaxf(around->reach, chunk->reach);
    around->footprint = fmaxf(around->footprint, chunk->footprint);
    around->spacing = fmaxf(around->spacing, chunk->spacing);
    cluster->coarsest = gap > cluster->coarsest ? gap : cluster->coarsest;
    cluster->finest = gap > 0.0 && !(cluster->finest > 0.0 && cluster->finest <= gap) ? gap : cluster->finest;
}

void pt_cluster_box(const double low[3], const double high[3], struct pt_chunk *around)
{
    for (int k = 0; k < 3; k++) {
        const double middle = 0.5 * low[k] + 0.5 * high[k], half = 0.5 * high[k] - 0.5 * low[k];
        const double far = half * (1.0 + WIDER) + fmax(fabs(low[k]), fabs(high[k])) * FARTHER;
        around->origin[k] = middle;
        around->box_max[k] = nextafterf((float)far, INFINITY);
        around->box_min[k] = -around->box_max[k];
    }
}

static void make(const struct pt_chunk *chunks, uint32_t count, struct pt_cluster *cluster)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    int levels = 1;
    memset(cluster, 0, sizeof *cluster);
    cluster->known = 1;
    for (uint32_t c = 0; c < count; c++) {
        widen(cluster, &chunks[c], low, high);
        levels &= chunks[c].gap > 0.0f;
    }
    cluster->around.gap = levels ? (float)cluster->coarsest : 0.0f;
    pt_cluster_box(low, high, &cluster->around);
}

void pt_clusters_make(struct patina_cloud *cloud)
{
    const uint32_t clusters = (cloud->chunk_count + PT_CLUSTER - 1) / PT_CLUSTER;
    free(cloud->clusters);
    cloud->clusters = clusters < FEWEST ? NULL : malloc(clusters * sizeof *cloud->clusters);
    for (uint32_t i = 0; i < clusters && cloud->clusters; i++) {
        const uint32_t first = i * PT_CLUSTER, left = cloud->chunk_count - first;
        make(cloud->chunks + first, left < PT_CLUSTER ? left : PT_CLUSTER, &cloud->clusters[i]);
    }
}
