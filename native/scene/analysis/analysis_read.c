// SPDX-License-Identifier: GPL-3.0-or-later
// What an analysed cloud knows, back in the caller's order; neighbours themselves, and [S]'s radius and uncertainty from them.
#include "analysis.h"
#include "base/compare.h"
#include "base/descriptor.h"
#include "base/platform.h"
#include "base/progress.h"
#include "scene/clouds/paged.h"
#include "shared/words.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct reading {
    const patina_cloud *cloud;
    const patina_neighbourhoods *wanted;
    struct pt_neighbours tree;
    patina_progress *progress;
    float *uncertainty; // a number
    atomic_uint done;
};

static uint32_t normal_of(const patina_cloud *cloud, uint32_t slot, double n[3])
{
    const uint32_t bits = cloud->surfels[slot] & PT_NORMAL_BITS;
    n[0] = n[1] = n[2] = 0.0;
    if (bits != PT_NORMAL_NONE)
        pt_decode_normal(bits, n);
    return bits;
}

static void read_chunks(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    const struct reading *reading = context;
    const patina_cloud *cloud = reading->cloud;
    const patina_neighbourhoods *to = reading->wanted;
    (void)thread;
    for (uint32_t c = begin; c < end; c++)
        for (uint32_t i = 0; i < cloud->chunks[c].count; i++) {
            const uint32_t slot = cloud->chunks[c].first + i;
            const size_t at = pt_number_of(cloud, slot);
            struct pt_neighbourhood hood;
            double n[3];
            const uint32_t bits = normal_of(cloud, slot, n);
            pt_unpack_shape(cloud->shapes ? cloud->shapes[slot] : 0, bits, cloud->spacing_base, &hood);
            for (size_t k = 0; k < 3 && to->normal; k++)
                to->normal[3 * at + k] = (float)n[k];
            for (size_t k = 0; k < 3 && to->axis; k++)
                to->axis[3 * at + k] = (float)hood.axis[k];
            if (to->spacing)
                to->spacing[at] = (float)(cloud->spacing_base * pt_spacing_of_class(cloud->surfels[slot] >> PT_SPACING_SHIFT));
            if (to->half_axes) {
                to->half_axes[2 * at] = (float)hood.major;
                to->half_axes[2 * at + 1] = (float)hood.minor;
            }
            if (to->sigma)
                to->sigma[at] = (float)hood.sigma;
            if (to->kind)
                to->kind[at] = (uint8_t)hood.kind;
            if (to->trust)
                to->trust[at] = (float)hood.trust;
            if (to->seen_through)
                to->seen_through[at] = cloud->shapes && (cloud->shapes[slot] & PT_SHAPE_SEEN_THROUGH);
        }
}

// [S Eq. 20, 21], corrected: r = 2 max |p_i - p_j| / sqrt(K); F = r sum (2 - n_i n_j)^2 / K. Where sides are not known, that of
// n_j is n_i's; where a normal is not, the product is 0.
static void read_soft(const struct reading *reading, uint32_t place, const struct pt_found *found, size_t at)
{
    const patina_cloud *cloud = reading->cloud;
    const uint32_t lane = place % PT_LEAF, count = found->count[lane];
    const double radius = count ? 2.0 * sqrt(found->square[lane][count - 1] / count) : 0.0;
    double n[3], m[3], sum = 0.0;
    if (reading->wanted->soft_radius)
        reading->wanted->soft_radius[at] = (float)radius;
    if (!reading->uncertainty)
        return;
    normal_of(cloud, reading->tree.slots[place], n);
    for (uint32_t i = 0; i < count; i++) {
        normal_of(cloud, reading->tree.slots[found->place[lane][i]], m);
        double product = n[0] * m[0] + n[1] * m[1] + n[2] * m[2];
        product = cloud->info.normals_oriented ? product : fabs(product);
        sum += (2.0 - product) * (2.0 - product);
    }
    reading->uncertainty[at] = count ? (float)(radius * sum / count) : 0.0f;
}

static void read_leaves(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct reading *reading = context;
    const struct pt_neighbours *tree = &reading->tree;
    const uint32_t k = reading->wanted->neighbours;
    struct pt_found found;
    (void)thread;
    for (uint32_t leaf = begin; leaf < end && !pt_progress_cancelled(reading->progress); leaf++) {
        pt_neighbours_find(tree, tree, leaf, pt_leaf_lanes(tree, leaf), k, &found);
        for (uint32_t left = pt_leaf_lanes(tree, leaf); left; left &= left - 1) {
            const uint32_t lane = (uint32_t)__builtin_ctz(left), place = leaf * PT_LEAF + lane;
            const size_t at = pt_number_of(reading->cloud, tree->slots[place]);
            for (uint32_t i = 0; i < found.count[lane]; i++) {
                if (reading->wanted->numbers)
                    reading->wanted->numbers[at * k + i] = pt_number_of(reading->cloud, tree->slots[found.place[lane][i]]);
                if (reading->wanted->distances)
                    reading->wanted->distances[at * k + i] = sqrt(found.square[lane][i]);
            }
            read_soft(reading, place, &found, at);
        }
        uint32_t done = atomic_fetch_add_explicit(&reading->done, 1, memory_order_relaxed) + 1;
        if (done % 256 == 0)
            pt_progress_raise(reading->progress, 0.1 + 0.9 * done / tree->leaf_count);
    }
}

// In parts of the 99th percentile, at most 1. At most a million points are looked at for it.
static int normalize(float *values, const patina_cloud *cloud)
{
    const uint64_t step = cloud->slots / (1 << 20) + 1, room = cloud->slots / step + 1;
    float *sorted = malloc(room * sizeof *sorted);
    uint64_t count = 0;
    if (!sorted)
        return PATINA_ERROR_MEMORY;
    for (uint64_t slot = 0; slot < cloud->slots; slot += step)
        sorted[count++] = values[pt_number_of(cloud, slot)];
    qsort(sorted, count, sizeof *sorted, pt_compare_floats);
    const float most = count ? sorted[(count - 1) * 99 / 100] : 0.0f;
    free(sorted);
    for (uint64_t i = 0; i < cloud->info.count; i++)
        values[i] = most > 0.0f ? fminf(values[i] / most, 1.0f) : 0.0f;
    return PATINA_OK;
}

// Points that are not drawn read 0, and have no neighbours.
static void clear(const patina_neighbourhoods *to, size_t count)
{
    const struct {
        void *data;
        size_t size;
    } arrays[] = {{to->normal, 12}, {to->axis, 12}, {to->spacing, 4},     {to->half_axes, 8},   {to->sigma, 4},
                  {to->kind, 1},    {to->trust, 4}, {to->soft_radius, 4}, {to->uncertainty, 4}, {to->seen_through, 1}};
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++)
        if (arrays[i].data)
            memset(arrays[i].data, 0, count * arrays[i].size);
    if (to->numbers)
        memset(to->numbers, 0xFF, count * to->neighbours * sizeof *to->numbers);
    for (size_t i = 0; to->distances && i < count * to->neighbours; i++)
        to->distances[i] = INFINITY;
}

static int read_all(struct reading *reading, struct pt_pool *pool)
{
    const patina_neighbourhoods *to = reading->wanted;
    pt_parallel(pool, reading->cloud->chunk_count, 1, read_chunks, reading);
    if (!to->numbers && !to->distances && !to->soft_radius && !to->uncertainty)
        return PATINA_OK;
    int error = pt_neighbours_create(&reading->tree, reading->cloud, PT_STRATA, NULL, pool, reading->progress, 0.0, 0.1);
    if (error)
        return error;
    reading->uncertainty = to->uncertainty;
    pt_parallel(pool, reading->tree.leaf_count, 64, read_leaves, reading);
    pt_neighbours_destroy(&reading->tree);
    if (pt_progress_cancelled(reading->progress))
        return PATINA_ERROR_CANCELLED;
    return to->uncertainty ? normalize(to->uncertainty, reading->cloud) : PATINA_OK;
}

int patina_cloud_neighbourhoods(const patina_cloud *cloud, const patina_neighbourhoods *given, patina_progress *progress)
{
    patina_neighbourhoods taken;
    const patina_neighbourhoods *const wanted = &taken;
    if (!cloud || !given)
        return pt_fail(cloud ? &cloud->handle : NULL, PATINA_ERROR_ARGUMENT,
                       "patina_cloud_neighbourhoods: cloud or wanted is NULL");
    int error = pt_take(&cloud->handle, "patina_cloud_neighbourhoods", given, &taken, sizeof taken);
    if (error)
        return error;
    const int walks = wanted->numbers || wanted->distances || wanted->soft_radius || wanted->uncertainty;
    if (walks && (wanted->neighbours < 1 || wanted->neighbours > PT_NEIGHBOURS_MOST))
        return pt_fail(&cloud->handle, PATINA_ERROR_ARGUMENT, "patina_cloud_neighbourhoods: neighbours: 1 to %d, not %u",
                       PT_NEIGHBOURS_MOST, wanted->neighbours);
    if ((error = pt_undivided_enter(cloud, "patina_cloud_neighbourhoods")))
        return error;
    struct reading reading = {.cloud = cloud, .wanted = wanted, .progress = progress};
    struct pt_pool *pool = pt_pool_create(wanted->threads, 0);
    clear(wanted, cloud->info.count);
    error = pool ? read_all(&reading, pool) : PATINA_ERROR_MEMORY;
    pt_pool_destroy(pool);
    pt_paged_leave(cloud);
    if (!error)
        pt_progress_set(progress, 1.0);
    return error ? pt_fail(&cloud->handle, error,
                           error == PATINA_ERROR_CANCELLED ? "reading neighbourhoods was cancelled"
                                                           : "reading neighbourhoods: out of memory")
                 : PATINA_OK;
}
