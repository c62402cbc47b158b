// SPDX-License-Identifier: GPL-3.0-or-later
// Local spacing of a chunk: the median over samples of r_k sqrt(pi / k), r_k the distance to the k-th nearest neighbour
// within the chunk. For k = 6 this is 1 / sqrt(points per area) within 5% on random points and on square grids alike,
// and a few duplicate points do not fool it. What a cloud makes of its chunks' spacings, and their classes.
#include "cloud.h"
#include "base/compare.h"
#include "base/elementary.h"
#include "shared/view.h"

#include <math.h>
#include <stdlib.h>

enum { SAMPLES = 24, NEIGHBOURS = 6, BLOCK = 32 };

// Squared distance from point `at` to its k-th nearest neighbour (k <= NEIGHBOURS).
static float kth_nearest(const float *x, const float *y, const float *z, uint32_t count, uint32_t at, uint32_t k)
{
    float nearest[NEIGHBOURS];
    for (uint32_t i = 0; i < k; i++)
        nearest[i] = INFINITY;
    for (uint32_t first = 0; first < count; first += BLOCK) { // of most blocks no point is near
        const uint32_t some = count - first < BLOCK ? count - first : BLOCK;
        float d[BLOCK];
        uint32_t near = 0;
        for (uint32_t i = 0; i < some; i++) {
            const float dx = x[first + i] - x[at], dy = y[first + i] - y[at], dz = z[first + i] - z[at];
            d[i] = dx * dx + dy * dy + dz * dz;
            near |= d[i] < nearest[k - 1];
        }
        for (uint32_t i = 0; i < some && near; i++) {
            if (!(d[i] < nearest[k - 1]) || first + i == at)
                continue;
            uint32_t place = k - 1;
            for (; place > 0 && nearest[place - 1] > d[i]; place--)
                nearest[place] = nearest[place - 1];
            nearest[place] = d[i];
        }
    }
    return nearest[k - 1];
}

float pt_spacing_estimate(const float *x, const float *y, const float *z, uint32_t count)
{
    if (count < 2)
        return 0.0f;
    uint32_t k = count - 1 < NEIGHBOURS ? count - 1 : NEIGHBOURS;
    uint32_t samples = count < SAMPLES ? count : SAMPLES;
    float distance[SAMPLES];
    for (uint32_t s = 0; s < samples; s++)
        distance[s] = kth_nearest(x, y, z, count, (uint32_t)((uint64_t)count * s / samples), k);
    qsort(distance, samples, sizeof *distance, pt_compare_floats);
    return (float)sqrt((double)distance[samples / 2] * 3.14159265358979323846 / k);
}

// ---- of a whole cloud ----------------------------------------------------------------------------------------------------

struct counted {
    double spacing; // first: pt_compare_doubles sorts by it
    uint64_t points;
};

// Chunks of a few points that lie much farther apart than all others are strays, and what lies between them is nothing: they get
// the spacing that all but one in STRAYS of the points stay below. Without it 0.1% of strays, 90 to 130 spacings apart, decide the
// picture's levels: 160 pixels in place of 1.4.
#define STRAY_SPACINGS 8.0
enum { STRAYS = 200 };

static int tame_strays(struct patina_cloud *cloud)
{
    struct counted *list = malloc((cloud->chunk_count + 1) * sizeof *list);
    uint64_t points = 0, below = 0;
    uint32_t count = 0, at = 0;
    if (!list)
        return PATINA_ERROR_MEMORY;
    for (uint32_t c = 0; c < cloud->chunk_count; c++)
        if (cloud->chunks[c].count > 1) {
            list[count++] = (struct counted){(double)cloud->chunks[c].spacing, cloud->chunks[c].count};
            points += cloud->chunks[c].count;
        }
    qsort(list, count, sizeof *list, pt_compare_doubles);
    while (at < count && (below += list[at].points) < points - points / STRAYS)
        at++;
    const double usual = at < count ? list[at].spacing : 0.0;
    free(list);
    for (uint32_t c = 0; c < cloud->chunk_count && usual > 0.0; c++)
        if ((double)cloud->chunks[c].spacing > STRAY_SPACINGS * usual)
            cloud->chunks[c].spacing = (float)usual;
    return PATINA_OK;
}

// The median goes into the info, and stands in for chunks too small to have a spacing of their own.
int pt_cloud_settle_spacing(struct patina_cloud *cloud)
{
    double *known = tame_strays(cloud) ? NULL : malloc((cloud->chunk_count + 1) * sizeof *known);
    if (!known)
        return PATINA_ERROR_MEMORY;
    uint32_t count = 0;
    for (uint32_t c = 0; c < cloud->chunk_count; c++)
        if (cloud->chunks[c].count > 1)
            known[count++] = (double)cloud->chunks[c].spacing;
    qsort(known, count, sizeof *known, pt_compare_doubles);
    cloud->info.spacing = count ? known[count / 2] : 0.0;
    cloud->info.spacing_min = count ? known[0] : 0.0;
    cloud->info.spacing_max = count ? known[count - 1] : 0.0;
    cloud->info.layer_distance = (double)PT_SPACING_FACTOR * cloud->info.spacing;
    for (uint32_t i = 0; i < count && !(cloud->spacing_base > 0.0); i++)
        cloud->spacing_base = known[i];
    // sixteen octaves of classes: where density varies more than that, the finest spacings are rounded up
    if (count && cloud->spacing_base < known[count - 1] / 32768.0)
        cloud->spacing_base = known[count - 1] / 32768.0;
    free(known);
    for (uint32_t c = 0; c < cloud->chunk_count; c++)
        if (cloud->chunks[c].count == 1)
            cloud->chunks[c].spacing = (float)cloud->info.spacing;
    return PATINA_OK;
}

int pt_cloud_settle_built(struct patina_cloud *cloud)
{
    if (pt_cloud_settle_spacing(cloud))
        return PATINA_ERROR_MEMORY;
    for (uint32_t c = 0; c < cloud->chunk_count; c++)
        cloud->chunks[c].built = cloud->chunks[c].spacing;
    cloud->built = cloud->info.spacing;
    return PATINA_OK;
}

double pt_spacing_of_class(uint32_t index) { return index ? pt_exp2(((double)index - 1.0) / 4.0) : 0.0; }

uint32_t pt_class_of_spacing(double spacing, double base) // rounded up: a layer distance may be too wide, not too narrow
{
    if (!(spacing > 0.0) || !(base > 0.0) || !isfinite(spacing / base))
        return 0;
    double steps = ceil(4.0 * pt_log2(spacing / base) - 1e-6);
    return steps < 0.0 ? 1u : steps > 62.0 ? 63u : (uint32_t)steps + 1u;
}
