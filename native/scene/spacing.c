// SPDX-License-Identifier: GPL-3.0-or-later
// Local spacing of a chunk: the median over samples of r_k sqrt(pi / k), r_k the distance to the k-th nearest neighbour
// within the chunk. For k = 6 this is 1 / sqrt(points per area) within 5% on random points and on square grids alike,
// and a few duplicate points do not fool it.
#include "cloud.h"

#include <math.h>
#include <stdlib.h>

enum { SAMPLES = 24, NEIGHBOURS = 6 };

// Squared distance from point `at` to its k-th nearest neighbour (k <= NEIGHBOURS).
static float kth_nearest(const float *x, const float *y, const float *z, uint32_t count, uint32_t at, uint32_t k)
{
    float nearest[NEIGHBOURS];
    for (uint32_t i = 0; i < k; i++)
        nearest[i] = INFINITY;
    for (uint32_t i = 0; i < count; i++) {
        float dx = x[i] - x[at], dy = y[i] - y[at], dz = z[i] - z[at];
        float d = dx * dx + dy * dy + dz * dz;
        if (!(d < nearest[k - 1]) || i == at)
            continue;
        uint32_t place = k - 1;
        for (; place > 0 && nearest[place - 1] > d; place--)
            nearest[place] = nearest[place - 1];
        nearest[place] = d;
    }
    return nearest[k - 1];
}

static int compare_floats(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
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
    qsort(distance, samples, sizeof *distance, compare_floats);
    return (float)sqrt((double)distance[samples / 2] * 3.14159265358979323846 / k);
}
