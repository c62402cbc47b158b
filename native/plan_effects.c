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

// ---- ambient obscurance ------------------------------------------------------------------------------------------------

// A 32nd of the diagonal of all clouds' boxes: the folds of a statue, the corners of a room.
static double usual_radius(const struct patina_scene *scene)
{
    double lower[3] = {INFINITY, INFINITY, INFINITY}, upper[3] = {-INFINITY, -INFINITY, -INFINITY}, square = 0.0;
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        const patina_cloud_info *info = &scene->instances[i].cloud->info;
        double linear[9], translation[3], corner[3], moved[3];
        pt_split_matrix(scene->instances[i].style.world_from_object, linear, translation);
        for (int c = 0; c < 8 && info->drawn; c++) {
            for (int k = 0; k < 3; k++)
                corner[k] = c >> k & 1 ? info->box_max[k] : info->box_min[k];
            pt_apply(linear, corner, moved);
            for (int k = 0; k < 3; k++) {
                lower[k] = fmin(lower[k], moved[k] + translation[k]);
                upper[k] = fmax(upper[k], moved[k] + translation[k]);
            }
        }
    }
    for (int k = 0; k < 3; k++)
        square += (upper[k] - lower[k]) * (upper[k] - lower[k]);
    return isfinite(square) && square > 0.0 ? sqrt(square) / 32.0 : 1.0;
}

static void plan_obscure(struct pt_builder *builder, enum pt_plane color)
{
    const patina_effects *effects = &builder->scene->effects;
    const double pi = 3.14159265358979323846;
    if (!(effects->obscurance_strength > 0.0f)) {
        pt_skip(builder, "obscure", "no ambient obscurance is asked for");
        return;
    }
    struct obscure_args args = {.view = builder->plan->view, .strength = effects->obscurance_strength};
    double radius = (double)effects->obscurance_radius;
    radius = radius > 0.0 ? radius : usual_radius(builder->scene);
    args.radius = (float)radius;
    for (int i = 0; i < PT_OBSCURE_TAPS; i++) { // golden angle: no two in line
        double at = (i + 0.5) / PT_OBSCURE_TAPS, angle = pi * (3.0 - sqrt(5.0)) * i;
        args.spiral[2 * i] = (float)(at * cos(angle));
        args.spiral[2 * i + 1] = (float)(at * sin(angle));
    }
    static const uint8_t order[PT_OBSCURE_TURNS] = {0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5};
    for (int i = 0; i < PT_OBSCURE_TURNS; i++) { // neighbours are turned far apart
        double angle = 2.0 * pi * order[i] / PT_OBSCURE_TURNS;
        args.turns[2 * i] = (float)cos(angle);
        args.turns[2 * i + 1] = (float)sin(angle);
    }
    PT_REASON(PT_ADD(builder, obscure, args,
                     {pt_keys_of(builder, 0), pt_from_of(builder, 0), pt_plane_at(PT_PLANE_DEFF, 0),
                      pt_shading_of(builder), pt_plane_at(color, 0), pt_plane_at(PT_PLANE_OBSCURED, 0)}),
              "ambient obscurance, strength %.2f, within %.4g", (double)args.strength, radius);
}

int pt_effects_want_normals(const struct patina_scene *scene) { return scene->effects.obscurance_strength > 0.0f; }

// ---- all ---------------------------------------------------------------------------------------------------------------

void pt_plan_shaded_effects(struct pt_builder *builder, enum pt_plane color)
{
    plan_obscure(builder, color);
    plan_edl(builder, color);
}

uint32_t pt_effects_reach(const struct patina_scene *scene)
{
    const patina_effects *effects = &scene->effects;
    uint32_t reach = 0;
    if (effects->edl_strength > 0.0f)
        reach += (uint32_t)lround((double)effects->edl_radius);
    if (effects->obscurance_strength > 0.0f)
        reach += (uint32_t)PT_OBSCURE_MOST + PT_OBSCURE_BLUR;
    return reach;
}
