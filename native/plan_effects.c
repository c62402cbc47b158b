// SPDX-License-Identifier: GPL-3.0-or-later
// Effects in image space: which of them a picture has, and what their kernels get.
#include "plan_passes.h"

#include <math.h>

// ---- eye-dome lighting -------------------------------------------------------------------------------------------------

// Steps of log2 z count 300 fold, as in Potree. In an orthographic view a step of a pixel's width counts as much as one of a
// pixel's width does in a perspective view 1024 pixels high of 45 degrees.
#define EDL_LOG 300.0
#define EDL_PIXEL (EDL_LOG * 1.4427 * 0.82 / 1024.0)

static void plan_edl(struct pt_builder *builder, enum pt_plane color)
{
    const struct view_args *view = &builder->plan->view;
    const patina_effects *effects = &builder->scene->effects;
    if (!(effects->edl_strength > 0.0f)) {
        pt_skip(builder, "edl", "no eye-dome lighting is asked for");
        return;
    }
    struct edl_args args = {.view = *view};
    for (int i = 0; i < PT_EDL_NEIGHBOURS; i++) {
        double angle = 2.0 * 3.14159265358979323846 * i / PT_EDL_NEIGHBOURS, radius = (double)effects->edl_radius;
        args.offsets[2 * i] = (int32_t)lround(radius * cos(angle));
        args.offsets[2 * i + 1] = (int32_t)lround(radius * sin(angle));
    }
    args.reach = (uint32_t)lround((double)effects->edl_radius);
    args.scale = (float)fmin(fmax(view->perspective ? EDL_LOG : EDL_PIXEL / (double)view->footprint, 1e-30), 1e30);
    args.gain = (float)(1.4427 * (double)effects->edl_strength / PT_EDL_NEIGHBOURS);
    PT_REASON(PT_ADD(builder, edl, args, {pt_keys_of(builder, 0), pt_plane_at(color, 0)}),
              "eye-dome lighting, strength %.2f, %u pixels around", (double)effects->edl_strength, args.reach);
}

// ---- all ---------------------------------------------------------------------------------------------------------------

void pt_plan_shaded_effects(struct pt_builder *builder, enum pt_plane color)
{
    plan_edl(builder, color);
}

uint32_t pt_effects_reach(const struct patina_scene *scene)
{
    const patina_effects *effects = &scene->effects;
    uint32_t reach = 0;
    if (effects->edl_strength > 0.0f)
        reach += (uint32_t)lround((double)effects->edl_radius);
    return reach;
}
