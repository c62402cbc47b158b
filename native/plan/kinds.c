// SPDX-License-Identifier: GPL-3.0-or-later
// The list of kinds, and how far what is drawn of a point reaches in each.
#include "eye.h"

#include "scene/reach.h"
#include "shared/balls.h"
#include "shared/discs.h"

#include <math.h>

double pt_reach_of_none(const struct pt_to_place *what, const struct pt_chunk *chunk)
{
    (void)what;
    (void)chunk;
    return 0.0;
}

// ---- discs ---------------------------------------------------------------------------------------------------------------

double pt_reach_of_discs(const struct pt_to_place *what, const struct pt_chunk *chunk)
{
    return pt_disc_reach(what->scene, what->instance, chunk, what->object->scale, 1);
}

double pt_usual_disc(const struct pt_to_place *what, const struct pt_chunk *chunk)
{
    return pt_disc_reach(what->scene, what->instance, chunk, what->object->scale, 0);
}

struct pt_drawn_discs pt_discs_of(const struct pt_to_place *what, double thinned)
{
    const double limit = fmin(0.5 * (double)what->instance->style.largest_gap * thinned, (double)PT_DISC_MOST);
    return (struct pt_drawn_discs){.radius = (float)fmin((double)what->instance->style.radius * thinned, (double)PT_DISC_MOST),
                                   .radius_scale = (float)fmin(what->object->scale * thinned, (double)PT_DISC_MOST),
                                   .radius_most = (float)limit,
                                   .surface_scale = pt_surface_scale(what->scene)};
}

// ---- balls ---------------------------------------------------------------------------------------------------------------

double pt_reach_of_balls(const struct pt_to_place *what, const struct pt_chunk *chunk)
{
    return pt_ball_reach(what->scene, what->instance, chunk, what->object->scale);
}

struct pt_drawn_balls pt_balls_of(const struct pt_to_place *what)
{
    const double scale = pt_ball_scale(what->scene, what->instance, what->object->scale);
    return (struct pt_drawn_balls){.radius_scale = (float)fmin(scale, (double)PT_SOFT_WIDEST)};
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
