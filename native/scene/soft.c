// SPDX-License-Identifier: GPL-3.0-or-later
#include "soft.h"
#include "mask.h"
#include "scene/clouds/shape_word.h"
#include "shared/words.h"

#include <float.h>
#include <math.h>
#include <string.h>

// A ball of K even points on a plane has the radius sqrt(K / pi) spacings, and Eq. 20 takes 2 / sqrt(K) of it.
#define RADIUS_SPACINGS 1.128379167
// Of the chunk's spacing, what a point's own counts for at most, where points have their own: strays would be balls before everything.
// Else it is the chunk's, but for the steps of its class.
#define WIDEST 2.0
#define CLASS 1.2
#define ROUNDED 1.004 // by pt_soft_word, at most
// Words of foliage and strays hold the spacing of their dots, so that filling closes nothing beside them: about PT_COVER_DOT of how far
// apart the points are. Of random points in space this gives balls of 0.96 density^(-1/3).
#define OF_DOT (1.0 / PT_COVER_DOT)

static double widest(const struct patina_cloud *cloud) { return cloud->shapes ? WIDEST : CLASS; }

float pt_soft_radius(const struct patina_cloud *cloud, const struct pt_chunk *chunk, uint32_t slot)
{
    if (cloud->radii)
        return cloud->radii[slot];
    const uint32_t kind = cloud->shapes ? PT_SHAPE_KIND(cloud->shapes[slot]) : PT_KIND_UNKNOWN;
    const double dot = kind == PT_KIND_VOLUME || kind == PT_KIND_STRAY ? OF_DOT : 1.0, mean = (double)chunk->spacing,
                 own = dot * cloud->spacing_base * pt_spacing_of_class(cloud->surfels[slot] >> PT_SPACING_SHIFT);
    return (float)(RADIUS_SPACINGS * (own > 0.0 ? fmin(own, widest(cloud) * mean) : mean));
}

double pt_soft_reach(const struct patina_cloud *cloud, const struct pt_chunk *chunk)
{
    return ROUNDED *
           (cloud->radii ? (double)cloud->info.radius_most : widest(cloud) * RADIUS_SPACINGS * (double)chunk->spacing);
}

static uint32_t bits_of(float radius)
{
    uint32_t bits;
    memcpy(&bits, &radius, sizeof bits);
    return bits;
}

struct pt_soft_code pt_soft_code(const struct patina_cloud *cloud, const struct patina_field *field, int one)
{
    if (one || !cloud->radii || (field && !(field->radii[1] > 0.0f)))
        return (struct pt_soft_code){.step = 1u << 15};
    if (!field)
        return (struct pt_soft_code){.whole = 1, .step = 1};
    const uint32_t least = bits_of(field->radii[0]), step = (bits_of(field->radii[1]) - least) / (PT_FIELD_RADIUS - 1) + 1;
    return (struct pt_soft_code){.base = least - step, .step = step}; // the least is 1, not 0
}

uint32_t pt_soft_word(struct pt_soft_code code, uint32_t f, float radius)
{
    const uint32_t bits = radius > 0.0f ? bits_of(fminf(radius, FLT_MAX)) : 0;
    if (code.whole)
        return bits;
    const uint32_t steps = bits ? (bits - code.base + code.step / 2) / code.step : 0;
    return f << PT_FIELD_SHIFT | (steps < PT_FIELD_RADIUS ? steps : PT_FIELD_RADIUS);
}
