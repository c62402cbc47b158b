// SPDX-License-Identifier: GPL-3.0-or-later
// A few points of a cloud, evenly chosen, for quick previews. Of each chunk they are of the first strata that hold enough: of a mapped
// file little else is read.
#include "cloud.h"
#include "paged.h"
#include "base/color.h"
#include "shared/words.h"

#include <math.h>

struct thinned {
    const struct patina_cloud *cloud;
    const uint8_t *hidden; // bits in the caller's order, or NULL
    float *positions, *colors, *normals, *scalars;
    uint64_t room, tried, count;
};

static void put_color(const struct patina_cloud *cloud, uint64_t slot, float *rgb)
{
    for (int k = 0; k < 3; k++)
        rgb[k] = cloud->color_format == PT_COLOR_SRGB8
                     ? (float)pt_linear_of_srgb(((const uint8_t *)cloud->colors)[3 * slot + (uint64_t)k] / 255.0)
                     : ((const float *)cloud->colors)[3 * slot + (uint64_t)k];
}

static void put_normal(const struct patina_cloud *cloud, uint64_t slot, float *normal)
{
    double n[3] = {0.0, 0.0, 0.0};
    if ((cloud->surfels[slot] & PT_NORMAL_BITS) != PT_NORMAL_NONE)
        pt_decode_normal(cloud->surfels[slot], n);
    for (int k = 0; k < 3; k++)
        normal[k] = (float)n[k];
}

static void put_point(struct thinned *to, const struct pt_chunk *chunk, uint32_t i)
{
    const struct patina_cloud *cloud = to->cloud;
    const uint64_t slot = pt_chunk_slot(cloud, chunk) + i, number = to->hidden ? pt_number_of(cloud, slot) : 0;
    to->tried++;
    if (to->count == to->room || (to->hidden && to->hidden[number / 8] >> number % 8 & 1))
        return;
    const uint64_t at = to->count++;
    double p[3];
    pt_point_place(cloud, chunk, i, p);
    for (int k = 0; k < 3; k++)
        to->positions[3 * at + (uint64_t)k] = (float)p[k];
    if (to->colors && cloud->colors)
        put_color(cloud, slot, to->colors + 3 * at);
    if (to->normals && (cloud->info.has_normals || cloud->shapes))
        put_normal(cloud, slot, to->normals + 3 * at);
    if (to->scalars && cloud->scalars)
        to->scalars[at] = cloud->scalars[slot];
}

// Evenly spaced ones of the least prefix of strata that holds so many: strata are in Morton order each.
static void thin_chunk(struct thinned *to, const struct pt_chunk *chunk, uint32_t count)
{
    uint32_t strata = 1;
    while (strata < PT_STRATA && pt_chunk_prefix(chunk, strata) < count)
        strata++;
    const uint64_t prefix = pt_chunk_prefix(chunk, strata);
    for (uint32_t k = 0; k < count; k++)
        put_point(to, chunk, (uint32_t)(k * prefix / count));
}

static uint64_t ones(const uint8_t *bits, size_t size)
{
    uint64_t count = 0;
    for (size_t i = 0; i < size; i++)
        count += (uint64_t)__builtin_popcount(bits[i]);
    return count;
}

int patina_cloud_thin(const patina_cloud *cloud, const uint8_t *hidden, size_t size, uint64_t room, float *positions,
                      float *colors, float *normals, float *scalars, uint64_t *count)
{
    if (!cloud || !count || (room && !positions))
        return pt_fail(cloud ? &cloud->handle : NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_thin: bad arguments");
    if (size != (hidden ? (cloud->info.count + 7) / 8 : 0))
        return pt_fail(&cloud->handle, PATINA_ERROR_ARGUMENT, "patina_cloud_thin: %zu bytes of hidden points for %llu points",
                       size, (unsigned long long)cloud->info.count);
    struct thinned to = {cloud, hidden, positions, colors, normals, scalars, room, 0, 0};
    uint64_t total = 0, seen = 0;
    const int refused = hidden ? pt_whole_enter(cloud, "patina_cloud_thin")
                               : (pt_paged_enter(cloud, 1), 0); // takes in what arrived
    if (refused)
        return refused;
    for (uint32_t c = 0; (c = pt_chunk_from(cloud, c)) < cloud->chunk_count; c++)
        total += cloud->chunks[c].count;
    const uint64_t gone = ones(hidden, size), shown = total > gone ? total - gone : 0;
    const double share = shown > room ? (double)room / (double)shown : 1.0;
    for (uint32_t c = 0; (c = pt_chunk_from(cloud, c)) < cloud->chunk_count; c++) {
        seen += cloud->chunks[c].count;
        const double wanted = floor((double)seen * share) -
                              (double)to.tried; // of a chunk as many as it holds, if others are hidden
        thin_chunk(&to, &cloud->chunks[c], (uint32_t)fmin(wanted, (double)cloud->chunks[c].count));
    }
    pt_paged_leave(cloud);
    *count = to.count;
    return PATINA_OK;
}
