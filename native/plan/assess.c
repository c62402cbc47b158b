// SPDX-License-Identifier: GPL-3.0-or-later
// The passes of what an analysis knows of the points that a picture shows: trust and thickness.
#include "passes.h"
#include "shared/picture.h"

#include <string.h>

// The part of the crop that the instance may show, in the planes; 0: none.
static int part_of_crop(const struct pt_plan *plan, const struct pt_plan_instance *instance, uint32_t rect[4])
{
    const struct view_args filled = pt_view_filled(plan, instance);
    for (int k = 0; k < 2; k++) {
        const uint32_t end = plan->crop[k] + plan->crop[2 + k];
        rect[k] = filled.rect[k] > plan->crop[k] ? filled.rect[k] : plan->crop[k];
        rect[2 + k] = filled.rect[2 + k] < end ? filled.rect[2 + k] : end;
    }
    return rect[0] < rect[2] && rect[1] < rect[3];
}

void pt_plan_assess(struct pt_builder *builder)
{
    struct pt_plan *plan = builder->plan;
    const uint32_t asked = builder->scene->settings.passes & (1u << PATINA_PASS_TRUST | 1u << PATINA_PASS_THICKNESS);
    struct assess_args args = {.crop_x = plan->crop[0],
                               .crop_y = plan->crop[1],
                               .crop_width = plan->crop[2],
                               .first = 1,
                               .trust = asked >> PATINA_PASS_TRUST & 1u,
                               .thickness = asked >> PATINA_PASS_THICKNESS & 1u};
    for (uint32_t i = 0; i < plan->instance_count && asked; i++) {
        const struct pt_plan_instance *instance = &plan->instances[i];
        const patina_cloud_info *info = &instance->instance->cloud->info;
        args.sigma_scale = pt_sigma_scale(instance);
        uint32_t part[4];
        if (!instance->chunk_count || !info->has_shapes || !part_of_crop(plan, instance, part))
            continue;
        const uint32_t whole[4] = {plan->crop[0], plan->crop[1], plan->crop[0] + plan->crop[2], plan->crop[1] + plan->crop[3]};
        args.view = plan->view;
        memcpy(args.view.rect, args.first ? whole : part, sizeof part);
        args.instance = instance->args;
        PT_REASON(
            PT_ADD(builder, assess, args,
                   {pt_plane_at(PT_PLANE_KEYS, 0), pt_shapes_of(instance, i), pt_plane_if(args.trust != 0, PT_PLANE_TRUST, 0),
                    pt_plane_if(args.thickness != 0, PT_PLANE_THICKNESS, 0)}),
            "of instance %u are asked for:%s%s", i, args.trust ? " trust" : "", args.thickness ? " thickness" : "");
        args.first = 0;
        plan->assessed |= asked;
    }
    if (args.first)
        pt_skip(builder, "assess", asked ? "no cloud in view was analysed" : "neither trust nor thickness is asked for");
}
