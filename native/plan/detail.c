// SPDX-License-Identifier: GPL-3.0-or-later
#include "detail.h"

#include "eye.h"
#include "ranges.h"
#include "scene/clouds/clusters.h"
#include "scene/clouds/paged.h"

// A builder's levels need not be exactly twice as wide as the next: what lies within this of a level is of it.
#define SAME_LEVEL 1.2

static void take_gaps(struct pt_detail *detail, double finest, double coarsest)
{
    detail->coarsest = pt_most(detail->coarsest, coarsest);
    detail->finest = finest > 0.0 && !(detail->finest > 0.0 && detail->finest <= finest) ? finest : detail->finest;
}

void pt_detail_begin(const struct patina_scene *scene, const struct pt_plan *plan, const struct pt_instance *instance,
                     struct pt_detail *detail)
{
    const struct patina_cloud *cloud = instance->whole; // levels are those of all its parts
    *detail = (struct pt_detail){0};
    // Cells of range images, and discs alone, know no coarser points.
    if (!(scene->settings.detail > 0.0f) || scene->settings.surface == PATINA_SURFACE_SPLATS ||
        pt_draws_ranges(scene, plan, instance))
        return;
    double finest, coarsest;
    if (cloud->paged) {
        pt_page_gaps(cloud, &finest, &coarsest);
        take_gaps(detail, finest, coarsest);
    } else if (cloud->clusters)
        for (uint32_t i = 0; i * PT_CLUSTER < cloud->chunk_count; i++)
            take_gaps(detail, cloud->clusters[i].finest, cloud->clusters[i].coarsest);
    else
        for (uint32_t c = 0; c < cloud->chunk_count; c++)
            take_gaps(detail, (double)cloud->chunks[c].gap, (double)cloud->chunks[c].gap);
    detail->tolerance = detail->coarsest > SAME_LEVEL * detail->finest ? (double)scene->settings.detail : 0.0;
}

// What the next coarser level leaves open shows no more than the tolerance.
int pt_detail_leaves_out(const struct pt_detail *detail, double gap, double pixel)
{
    return detail->tolerance > 0.0 && gap > 0.0 && 2.0 * gap <= detail->tolerance * pixel &&
           SAME_LEVEL * gap < detail->coarsest;
}

int pt_detail_draws(struct pt_detail *detail, const struct pt_chunk *chunk, double pixel, double *thinned)
{
    const double gap = (double)chunk->gap, most = detail->tolerance * pixel;
    *thinned = 1.0;
    if (!(detail->tolerance > 0.0) || !(gap > 0.0))
        return 1;
    if (pt_detail_leaves_out(detail, gap, pixel))
        return 0;
    double finest = detail->finest;
    while (2.0 * finest <= most && SAME_LEVEL * finest < detail->coarsest)
        finest *= 2.0;
    *thinned = finest / detail->finest;
    detail->least = detail->least > 0.0 ? pt_least(detail->least, gap) : gap;
    return 1;
}

void pt_detail_join(struct pt_detail *detail, const struct pt_detail *other)
{
    if (other->least > 0.0)
        detail->least = detail->least > 0.0 ? pt_least(detail->least, other->least) : other->least;
}

double pt_detail_thinning(const struct pt_detail *detail)
{
    return detail->least > 0.0 ? pt_most(detail->least / detail->finest, 1.0) : 1.0;
}
