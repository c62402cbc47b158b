// SPDX-License-Identifier: GPL-3.0-or-later
// Filling: levels of the pyramid, and what closes holes at each. [D 3.2, 3.3]
#include "passes.h"

#include "shared/filling.h"
#include "shared/points.h"

#include <math.h>
#include <stdio.h>

// What no pixel's layer distance is below, whatever the rounding; world units.
static float least_distance(const struct pt_plan *plan)
{
    float least = plan->mesh.triangles ? 0.0f : INFINITY; // a mesh has but its footprint
    for (uint32_t i = 0; i < plan->instance_count; i++) {
        const struct instance_args *args = &plan->instances[i].args;
        const patina_cloud_info *info = &plan->instances[i].instance->cloud->info;
        int known = info->spacing_min > 0.0 && isfinite(info->spacing_max); // no chunk is of class 0
        const float spacings = pt_has_sigmas(plan, &plan->instances[i]) ? PT_SPACING_SURE : PT_SPACING_FACTOR;
        least = fminf(least, fmaxf(args->d_min, spacings * args->spacing[known]));
    }
    return 0.999f * least;
}

// What share of a pixel's footprint at a level no layer distance is below, whatever the rounding.
static float least_share(const struct pt_plan *plan, uint32_t level)
{
    return 0.999f * (plan->sigmas && !level ? PT_FOOTPRINT_SURE : 1.0f);
}

// How far an analysed cloud's points close holes beside them, in d_eff (two spacings); discs cover what is theirs already. With
// discs as far as points, virtual scans show a tenth more of false surface, and a torus of 62,500 points 1 dB less.
#define REACH 1.0f
#define DISC_REACH 0.35f

static void plan_fill_level(struct pt_builder *builder, uint32_t level)
{
    struct pt_plan *plan = builder->plan;
    struct fill_args args = {.view = pt_view_at(plan, level),
                             .phases = PT_FILL_BACKGROUND | (level && plan->discs.count ? 0 : PT_FILL_OCCLUDED),
                             .iterations = plan->iterations,
                             .unfills = plan->fill == PATINA_FILL_CLOSED ? plan->iterations : 0,
                             .refined = plan->quality == PATINA_QUALITY_REFINED,
                             .least = least_distance(plan),
                             .least_share = least_share(plan, level),
                             .from_width = plan->view.width,
                             .alone = !level && plan->fill == PATINA_FILL_CLOSED};
    if (plan->reaches) {
        args.reach = REACH;
        args.disc_reach = DISC_REACH;
        args.discs_first = plan->discs.first;
    }
    PT_REASON(PT_ADD(builder, fill, args,
                     {pt_keys_of(builder, level), pt_from_of(builder, level), pt_plane_at(PT_PLANE_NORMAL, 0),
                      pt_plane_at(PT_PLANE_DEFF, 0), pt_span_of(plan)}),
              "level %u: %u fills, at most %u un-fills of background, then of occluded pixels", level, args.iterations,
              args.unfills);
}

static void plan_pyramid(struct pt_builder *builder)
{
    struct pt_plan *plan = builder->plan;
    for (uint32_t level = 1; level <= plan->levels; level++) {
        struct view_args fine = pt_view_at(plan, level - 1);
        struct pull_args args = {.view = pt_view_at(plan, level), .fine_width = fine.width, .fine_height = fine.height};
        // whole rows, and some past the rectangle: filters look one past it, at this level and at coarser ones
        const uint32_t more = 2u << (plan->levels - level);
        uint32_t *rect = args.view.rect;
        rect[0] = 0;
        rect[1] = rect[1] > more ? rect[1] - more : 0;
        rect[2] = args.view.width;
        rect[3] = rect[3] + more < args.view.height ? rect[3] + more : args.view.height;
        PT_REASON(PT_ADD(builder, pull, args,
                         {pt_keys_of(builder, level - 1), pt_from_of(builder, level - 1), pt_keys_of(builder, level),
                          pt_from_of(builder, level)}),
                  "spacing %.2f pixels: holes are closed at coarser levels first", plan->spacing_px);
    }
    for (uint32_t level = plan->levels; level > 0; level--) {
        plan_fill_level(builder, level);
        struct view_args coarse = pt_view_at(plan, level);
        struct push_args args = {.view = pt_view_at(plan, level - 1),
                                 .coarse_width = coarse.width,
                                 .coarse_height = coarse.height,
                                 .refined = plan->quality == PATINA_QUALITY_REFINED,
                                 .least = least_distance(plan),
                                 .least_share = least_share(plan, level - 1),
                                 .background = plan->discs.count > 0,
                                 .from_width = plan->view.width};
        PT_REASON(PT_ADD(builder, push, args,
                         {pt_keys_of(builder, level), pt_from_of(builder, level), pt_keys_of(builder, level - 1),
                          pt_from_of(builder, level - 1), pt_plane_at(PT_PLANE_NORMAL, 0), pt_plane_at(PT_PLANE_DEFF, 0),
                          pt_span_of(plan)}),
                  "level %u to level %u", level, level - 1);
    }
}

void pt_plan_filling(struct pt_builder *builder)
{
    struct pt_plan *plan = builder->plan;
    if (!plan->iterations) {
        pt_skip(builder, "fill",
                builder->scene->settings.surface == PATINA_SURFACE_SPLATS ? "the settings ask for discs"
                : plan->means == PT_MEANS_RANGES                          ? "all clouds in view are range images"
                : builder->scene->settings.error_target > 0.0f            ? "the error target is met without"
                                                                          : "switched off in the settings");
        pt_skip(builder, "pull", "no filling");
        pt_skip(builder, "push", "no filling");
        return;
    }
    if (plan->levels) {
        plan_pyramid(builder);
    } else {
        char reason[96];
        snprintf(reason, sizeof reason,
                 plan->fill == PATINA_FILL_PAPER ? "filling as in the paper has one level"
                                                 : "spacing %.2f pixels needs no coarser level",
                 plan->spacing_px);
        pt_skip(builder, "pull", reason);
        pt_skip(builder, "push", reason);
    }
    plan_fill_level(builder, 0);
}
