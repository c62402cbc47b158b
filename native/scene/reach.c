// SPDX-License-Identifier: GPL-3.0-or-later
#include "reach.h"

#include "scene/clouds/paged.h"
#include "shared/balls.h"
#include "shared/discs.h"
#include "soft.h"

#include <math.h>

// Of footprints, where discs alone make the surface: a footprint ends about where its neighbors' begin, and filling closes what lies
// between. At 1.55 depths of a sphere of random points lie beyond their bounds (tests/scenes/test_truth); at 1.8 contour lines through few
// points do (test_values), since wide discs mix the values of far neighbors. Borders, lines and foliage end where they end.
#define SURFACE_SCALE 1.7f

float pt_surface_scale(const struct patina_scene *scene)
{
    return scene->settings.surface == PATINA_SURFACE_SPLATS ? SURFACE_SCALE : 1.0f;
}

double pt_stretch(const double m[16])
{
    double scale = 0.0;
    for (int c = 0; c < 3; c++)
        scale = fmax(scale, sqrt(m[c] * m[c] + m[4 + c] * m[4 + c] + m[8 + c] * m[8 + c]));
    return scale;
}

static double disc_limit(const struct patina_scene *scene, const struct pt_instance *instance)
{
    return fmin(0.5 * (double)instance->style.largest_gap * pt_thinning(scene), (double)PT_DISC_MOST);
}

static double own_reach(const struct patina_scene *scene, const struct pt_instance *instance, const struct pt_chunk *chunk,
                        double scale, int most)
{
    if (instance->style.radius > 0.0f)
        return (double)instance->style.radius;
    if (instance->cloud->info.has_radii)
        return (double)instance->cloud->info.radius_most * scale;
    if (instance->cloud->shapes)
        return (double)(pt_surface_scale(scene) * (most ? chunk->reach : chunk->footprint)) * scale;
    return 1.2 * (double)PT_DISC_SPACINGS * (double)chunk->spacing * scale; // classes of spacings are 1.19 wide
}

double pt_disc_reach(const struct patina_scene *scene, const struct pt_instance *instance, const struct pt_chunk *chunk,
                     double scale, int most)
{
    const double reach = own_reach(scene, instance, chunk, scale, most) * pt_thinning(scene),
                 limit = disc_limit(scene, instance);
    return limit > 0.0 ? fmin(reach, limit) : reach;
}

double pt_ball_scale(const struct patina_scene *scene, const struct pt_instance *instance, double scale)
{
    const float radius = instance->style.soft_radius;
    return (radius > 0.0f ? (double)radius : scale) * pt_thinning(scene);
}

double pt_ball_reach(const struct patina_scene *scene, const struct pt_instance *instance, const struct pt_chunk *chunk,
                     double scale)
{
    const double radius = instance->style.soft_radius > 0.0f ? 1.0 : pt_soft_reach(instance->cloud, chunk);
    return fmin(radius * pt_ball_scale(scene, instance, scale), (double)PT_SOFT_WIDEST);
}

double pt_chunk_reach(const struct patina_scene *scene, const struct pt_instance *instance, const struct pt_chunk *chunk,
                      double scale, int most)
{
    const int discs = !pt_all_soft(instance) && (scene->settings.surface == PATINA_SURFACE_SPLATS ||
                                                 (scene->settings.surface == PATINA_SURFACE_AUTO && instance->cloud->shapes));
    const double disc = discs ? pt_disc_reach(scene, instance, chunk, scale, most) : 0.0,
                 ball = pt_has_balls(&instance->style) ? pt_ball_reach(scene, instance, chunk, scale) : 0.0;
    return fmax(disc, ball);
}

double pt_instance_reach(const struct patina_scene *scene, const struct pt_instance *instance)
{
    const struct patina_cloud *cloud = instance->cloud;
    const double scale = pt_stretch(instance->style.world_from_object);
    double most = 0.0;
    pt_paged_enter(cloud, 0);
    for (uint32_t page = pt_page_first(cloud); page != PATINA_NO_PAGE;) {
        const int absent = !pt_page_is_there(cloud, page);
        if (absent) {
            struct pt_chunk box;
            pt_page_box(cloud, page, &box);
            most = fmax(most, pt_chunk_reach(scene, instance, &box, scale, 1));
        }
        page = pt_page_next(cloud, page, !absent || !pt_page_nests(cloud)); // finer pages reach no farther
    }
    for (uint32_t c = 0; (c = pt_chunk_from(cloud, c)) < cloud->chunk_count; c++)
        most = fmax(most, pt_chunk_reach(scene, instance, &cloud->chunks[c], scale, 1));
    pt_paged_leave(cloud);
    return most;
}
