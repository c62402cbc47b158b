// SPDX-License-Identifier: GPL-3.0-or-later
// The list of kinds, and how far what is drawn of a point reaches in each.
#include "eye.h"

#include "scene/soft.h"
#include "shared/balls.h"
#include "shared/discs.h"

#include <math.h>

// Of footprints, where discs alone make the surface: a footprint ends about where its neighbours' begin, and filling closes what lies
// between. Of a sphere of random points 1.2 % stays open at 1, 0.03 at 1.4, 0.01 at 1.55; at 1.6 sharp edges and slits lose half a
// decibel. Borders, lines and foliage end where they end.
#define SURFACE_SCALE 1.55f

double pt_reach_of_none(const struct pt_to_place *what, const struct pt_chunk *chunk)
{
    (void)what;
    (void)chunk;
    return 0.0;
}

// ---- discs ---------------------------------------------------------------------------------------------------------------

// No disc is wider than this; 0: as wide as it is.
static double radius_most(const struct pt_instance *instance, double thinned)
{
    return fmin(0.5 * (double)instance->style.largest_gap * thinned, (double)PT_DISC_MOST);
}

static float surface_scale(const struct patina_scene *scene)
{
    return scene->settings.surface == PATINA_SURFACE_SPLATS ? SURFACE_SCALE : 1.0f;
}

static double own_reach(const struct pt_to_place *what, const struct pt_chunk *chunk, double thinned, int most)
{
    const struct pt_instance *instance = what->instance;
    if (instance->style.radius > 0.0f)
        return (double)instance->style.radius * thinned;
    if (instance->cloud->info.has_radii)
        return (double)instance->cloud->info.radius_most * what->object->scale * thinned;
    if (instance->cloud->shapes)
        return (double)(surface_scale(what->scene) * (most ? chunk->reach : chunk->footprint)) * what->object->scale * thinned;
    return 1.2 * (double)PT_DISC_SPACINGS * (double)chunk->spacing * what->object->scale *
           thinned; // classes of spacings are 1.19 wide
}

static double disc_reach(const struct pt_to_place *what, const struct pt_chunk *chunk, int most)
{
    const double thinned = pt_thinning(what->scene), reach = own_reach(what, chunk, thinned, most),
                 limit = radius_most(what->instance, thinned);
    return limit > 0.0 ? fmin(reach, limit) : reach;
}

double pt_reach_of_discs(const struct pt_to_place *what, const struct pt_chunk *chunk) { return disc_reach(what, chunk, 1); }

double pt_usual_disc(const struct pt_to_place *what, const struct pt_chunk *chunk) { return disc_reach(what, chunk, 0); }

struct pt_drawn_discs pt_discs_of(const struct pt_to_place *what, double thinned)
{
    return (struct pt_drawn_discs){.radius = (float)fmin((double)what->instance->style.radius * thinned, (double)PT_DISC_MOST),
                                   .radius_scale = (float)fmin(what->object->scale * thinned, (double)PT_DISC_MOST),
                                   .radius_most = (float)radius_most(what->instance, thinned),
                                   .surface_scale = surface_scale(what->scene)};
}

// ---- balls ---------------------------------------------------------------------------------------------------------------

// World units, of a radius of 1.
static double ball_scale(const struct pt_to_place *what)
{
    const float radius = what->instance->style.soft_radius;
    return (radius > 0.0f ? (double)radius : what->object->scale) * pt_thinning(what->scene);
}

double pt_reach_of_balls(const struct pt_to_place *what, const struct pt_chunk *chunk)
{
    const double radius = what->instance->style.soft_radius > 0.0f ? 1.0 : pt_soft_reach(what->instance->cloud, chunk);
    return fmin(radius * ball_scale(what), (double)PT_SOFT_WIDEST);
}

struct pt_drawn_balls pt_balls_of(const struct pt_to_place *what)
{
    return (struct pt_drawn_balls){.radius_scale = (float)fmin(ball_scale(what), (double)PT_SOFT_WIDEST)};
}

// ---- the list ------------------------------------------------------------------------------------------------------------

const struct pt_kind_row pt_kinds[PT_AS_COUNT] = {
#define PT_X(kind, source, sees, shows, in_planes, reach, pixels, beyond, see, show, join, cover, front, ...)                  \
    {PT_SOURCE_##source,                                                                                                       \
     PT_KERNEL_##sees,                                                                                                         \
     PT_KERNEL_##shows,                                                                                                        \
     in_planes,                                                                                                                \
     reach,                                                                                                                    \
     (double)(pixels),                                                                                                         \
     beyond,                                                                                                                   \
     sizeof((int[]){__VA_ARGS__}) / sizeof(int),                                                                               \
     {__VA_ARGS__}},
    PT_KINDS(PT_X)
#undef PT_X
};
