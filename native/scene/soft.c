// SPDX-License-Identifier: GPL-3.0-or-later
#include "soft.h"
#include "shared/words.h"

#include <math.h>
#include <string.h>

// A ball of K even points on a plane has the radius sqrt(K / pi) spacings, and Eq. 20 takes 2 / sqrt(K) of it.
#define RADIUS_SPACINGS 1.128379167
// Of the chunk's spacing, what a point's own counts for at most, where points have their own: strays would be balls before everything.
// Else it is the chunk's, but for the steps of its class.
#define WIDEST 2.0
#define CLASS 1.2
#define ROUNDED 1.004 // by pt_soft_word

static double widest(const struct patina_cloud *cloud) { return cloud->shapes ? WIDEST : CLASS; }

float pt_soft_radius(const struct patina_cloud *cloud, const struct pt_chunk *chunk, uint32_t slot)
{
    if (cloud->radii)
        return cloud->radii[slot];
    const double own = cloud->spacing_base * pt_spacing_of_class(cloud->surface[slot] >> PT_SPACING_SHIFT),
                 mean = (double)chunk->spacing;
    return (float)(RADIUS_SPACINGS * (own > 0.0 ? fmin(own, widest(cloud) * mean) : mean));
}

double pt_soft_reach(const struct patina_cloud *cloud, const struct pt_chunk *chunk)
{
    return ROUNDED *
           (cloud->radii ? (double)cloud->info.radius_most : widest(cloud) * RADIUS_SPACINGS * (double)chunk->spacing);
}

uint32_t pt_soft_word(uint32_t step, float radius)
{
    uint32_t bits;
    memcpy(&bits, &radius, sizeof bits);
    bits = bits < 0x7F7FC000u ? bits + 0x4000u : 0x7F7F8000u;
    return step << PT_FIELD_SHIFT | (bits >> 15 & PT_FIELD_RADIUS);
}
