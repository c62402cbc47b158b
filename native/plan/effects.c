// SPDX-License-Identifier: GPL-3.0-or-later
// Effects in image space: which of them a picture has, and what their kernels get.
#include "passes.h"
#include "base/elementary.h"
#include "shared/effects.h"
#include "shared/picture.h"

#include <math.h>

// ---- eye-dome lighting -------------------------------------------------------------------------------------------------

// Steps of log2 z count 300 fold, as in Potree. In an orthographic view a step of a pixel's width counts as much as one of a
// pixel's width does in a perspective view 1024 pixels high of 45 degrees.
#define EDL_LOG 300.0
#define EDL_PIXEL (EDL_LOG * 1.4427 * 0.82 / 1024.0)

// Pixels: the k-th of the radii.
static double edl_radius(const patina_effects *effects, int k)
{
    return fmin((double)effects->edl_radius * (1 << k), PT_EDL_MOST);
}

static uint32_t edl_reach(const patina_effects *effects) { return (uint32_t)lround(edl_radius(effects, PT_EDL_RADII - 1)); }

static void plan_edl(struct pt_builder *builder, enum pt_plane color)
{
    const struct view_args *view = &builder->plan->view;
    const patina_effects *effects = &builder->scene->effects;
    if (!(effects->edl_strength > 0.0f)) {
        pt_skip(builder, "edl", "no eye-dome lighting is asked for");
        return;
    }
    struct edl_args args = {.view = *view, .from_eye = view->perspective && builder->scene->camera.panorama_face};
    const double scale = view->perspective ? EDL_LOG : EDL_PIXEL / ((double)view->footprint * pt_finer(builder->scene));
    for (int k = 0; k < PT_EDL_RADII; k++) {
        const double radius = edl_radius(effects, k);
        int32_t *offsets = args.offsets + 2 * PT_EDL_NEIGHBOURS * k;
        for (int i = 0; i < PT_EDL_NEIGHBOURS; i++) {
            double angle = 2.0 * 3.14159265358979323846 * i / PT_EDL_NEIGHBOURS;
            offsets[2 * i] = (int32_t)lround(radius * pt_cos(angle));
            offsets[2 * i + 1] = (int32_t)lround(radius * pt_sin(angle));
        }
        args.gain[k] = (float)(1.4427 * (double)effects->edl_strength / PT_EDL_NEIGHBOURS * edl_radius(effects, 0) / radius);
        args.wide[k] = (float)(2.0 * radius); // two spacings: the radius is that of the discs
    }
    args.reach = edl_reach(effects);
    args.narrow = 1.0f / args.wide[PT_EDL_RADII - 1];
    args.scale = (float)fmin(fmax(scale, 1e-30), 1e30);
    PT_REASON(PT_ADD(builder, edl, args,
                     {pt_keys_of(builder, 0), pt_from_of(builder, 0), pt_span_of(builder->plan),
                      pt_plane_at(PT_PLANE_NORMAL, 0), pt_plane_at(color, 0)}),
              "eye-dome lighting, strength %.2f, %ld to %u pixels around", (double)effects->edl_strength,
              lround(edl_radius(effects, 0)), args.reach);
}

// ---- ambient obscurance ------------------------------------------------------------------------------------------------

struct box {
    double lower[3], upper[3];
};

static void include(void *context, const double corner[3])
{
    struct box *box = context;
    for (int k = 0; k < 3; k++) {
        box->lower[k] = fmin(box->lower[k], corner[k]);
        box->upper[k] = fmax(box->upper[k], corner[k]);
    }
}

// Of all clouds, world; lower > upper where there is no point.
static struct box scene_box(const struct patina_scene *scene)
{
    struct box box = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    for (uint32_t i = 0; i < scene->cloud_count; i++) {
        const patina_cloud_info *info = &scene->instances[i].cloud->info;
        if (info->drawn)
            pt_box_corners(info->box_min, info->box_max, scene->instances[i].style.world_from_object, include, &box);
    }
    return box;
}

static double diagonal_square(const struct box *box)
{
    double square = 0.0;
    for (int k = 0; k < 3; k++)
        square += (box->upper[k] - box->lower[k]) * (box->upper[k] - box->lower[k]);
    return square;
}

// A 32nd of the diagonal of all clouds' boxes: the folds of a statue, the corners of a room.
static double usual_radius(const struct patina_scene *scene)
{
    const struct box box = scene_box(scene);
    double square = diagonal_square(&box);
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
        args.spiral[2 * i] = (float)(at * pt_cos(angle));
        args.spiral[2 * i + 1] = (float)(at * pt_sin(angle));
    }
    static const uint8_t order[PT_OBSCURE_TURNS] = {0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5};
    for (int i = 0; i < PT_OBSCURE_TURNS; i++) { // neighbours are turned far apart
        double angle = 2.0 * pi * order[i] / PT_OBSCURE_TURNS;
        args.turns[2 * i] = (float)pt_cos(angle);
        args.turns[2 * i + 1] = (float)pt_sin(angle);
    }
    PT_REASON(PT_ADD(builder, obscure, args,
                     {pt_keys_of(builder, 0), pt_from_of(builder, 0), pt_span_of(builder->plan), pt_shading_of(builder),
                      pt_plane_at(color, 0), pt_plane_at(PT_PLANE_OBSCURED, 0)}),
              "ambient obscurance, strength %.2f, within %.4g", (double)args.strength, radius);
}

// ---- toon --------------------------------------------------------------------------------------------------------------

#define TOON_SHARP 0.05f // least share of a band that its edge takes

static void plan_toon(struct pt_builder *builder, enum pt_plane color)
{
    const patina_effects *effects = &builder->scene->effects;
    if (!effects->toon_bands) {
        pt_skip(builder, "toon", "no bands of light are asked for");
        return;
    }
    struct toon_args args = {.view = builder->plan->view,
                             .bands = (float)effects->toon_bands - 0.5f,
                             .inverse = (float)(1.0 / (effects->toon_bands - 0.5)),
                             .steepness = 1.0f / fmaxf(effects->toon_softness, TOON_SHARP)};
    PT_REASON(PT_ADD(builder, toon, args, {pt_keys_of(builder, 0), pt_plane_at(PT_PLANE_UNLIT, 0), pt_plane_at(color, 0)}),
              "light in %u bands", effects->toon_bands);
}

// ---- hatching ------------------------------------------------------------------------------------------------------------

// A place near the scene's middle where planes of all spacings meet, along an axis: coordinates from there are small.
static double anchor_of(const struct box *box, const double axis[3])
{
    double middle[3], square = diagonal_square(box);
    for (int k = 0; k < 3; k++)
        middle[k] = 0.5 * (box->lower[k] + box->upper[k]);
    if (!(square > 0.0) || !isfinite(square))
        return 0.0;
    double grid = pt_exp2(ceil(pt_log2(sqrt(square))) + 1.0);
    return grid * round(pt_dot(axis, middle) / grid);
}

static void plan_hatch(struct pt_builder *builder, enum pt_plane color)
{
    // level cuts, then a steep hand's slant, then across; none along an axis of the world, where walls and floors lie
    static const double axes[PT_HATCH_LEVELS][3] = {{0.16, 0.24, 0.957}, {0.72, -0.36, 0.593}, {-0.50, -0.76, 0.415}};
    static const float tones[PT_HATCH_LEVELS] = {1.15f, 1.75f, 3.0f}; // the first begins below 87 % of white, by eye
    const struct patina_scene *scene = builder->scene;
    const patina_effects *effects = &scene->effects;
    if (!effects->hatch_levels) {
        pt_skip(builder, "hatch", "no hatching is asked for");
        return;
    }
    struct hatch_args args = {.view = builder->plan->view,
                              .levels = effects->hatch_levels,
                              .eye_z = pt_eye_z(scene),
                              .spacing = effects->hatch_spacing,
                              .width = 0.6f * effects->hatch_spacing,
                              .opacity = effects->hatch_opacity,
                              .ground = effects->hatch_ground};
    const struct box box = scene_box(scene);
    double camera[9], position[3];
    pt_camera_axes(&scene->camera, camera, position);
    for (int level = 0; level < PT_HATCH_LEVELS; level++) {
        double axis[3], view[3], length = sqrt(pt_dot(axes[level], axes[level]));
        for (int k = 0; k < 3; k++) {
            axis[k] = axes[level][k] / length;
            args.color[k] = effects->hatch_color[k];
        }
        pt_apply(camera, axis, view);
        for (int k = 0; k < 3; k++)
            args.axes[3 * level + k] = (float)view[k];
        args.offsets[level] = (float)(pt_dot(axis, position) - anchor_of(&box, axis));
        args.tones[level] = tones[level];
    }
    PT_REASON(PT_ADD(builder, hatch, args, {pt_keys_of(builder, 0), pt_shading_of(builder), pt_plane_at(color, 0)}),
              "strokes in %u directions, %.1f pixels apart", args.levels, (double)args.spacing);
}

// ---- contour lines -------------------------------------------------------------------------------------------------------

// A round number, 1, 2 or 5 times a power of ten, of which 10 to 25 make the length.
static double usual_interval(double length)
{
    if (!(length > 0.0) || !isfinite(length))
        return 1.0;
    double least = length / 25.0, ten = pt_pow(10.0, floor(pt_log10(least)));
    double interval = least <= ten ? ten : least <= 2.0 * ten ? 2.0 * ten : least <= 5.0 * ten ? 5.0 * ten : 10.0 * ten;
    return fmin(fmax(interval, 1e-9), 1e9);
}

// Of a box along an axis.
static double extent(const struct box *box, const double axis[3])
{
    double length = 0.0;
    for (int k = 0; k < 3; k++)
        length += fabs(axis[k]) * (box->upper[k] - box->lower[k]);
    return length;
}

static int follows_values(const struct patina_scene *scene)
{
    return scene->effects.contour_opacity > 0.0f && scene->effects.contour_source == PATINA_CONTOUR_ATTRIBUTE;
}

static int has_values(const struct pt_plan_instance *instance)
{
    return instance->chunk_count && instance->instance->cloud->info.has_scalars;
}

// Of the scalars of what is in view; least > most where there are none.
static void values_range(const struct pt_plan *plan, double range[2])
{
    range[0] = INFINITY;
    range[1] = -INFINITY;
    for (uint32_t i = 0; i < plan->instance_count; i++) {
        const float *own = plan->instances[i].instance->cloud->info.scalar_range;
        if (!has_values(&plan->instances[i]))
            continue;
        range[0] = fmin(range[0], (double)own[0]);
        range[1] = fmax(range[1], (double)own[1]);
    }
}

// A bold line in the middle of the range: values less that are small.
static double values_offset(const patina_effects *effects, const double range[2], double interval)
{
    const double start = (double)effects->contour_start, bold = interval * effects->contour_every;
    const double offset = start + bold * round((0.5 * (range[0] + range[1]) - start) / bold);
    return isfinite(offset) ? offset : start;
}

static double values_interval(const patina_effects *effects, const double range[2])
{
    const double interval = (double)effects->contour_interval;
    return interval > 0.0 ? interval : usual_interval(range[1] - range[0]);
}

void pt_plan_values(struct pt_builder *builder)
{
    const struct pt_plan *plan = builder->plan;
    const patina_effects *effects = &builder->scene->effects;
    double range[2];
    values_range(plan, range);
    if (!follows_values(builder->scene) || range[0] > range[1]) {
        const char *reason = follows_values(builder->scene) ? "no cloud in view has scalars"
                                                            : "no lines along an attribute are asked for";
        pt_skip(builder, "value", reason);
        pt_skip(builder, "slope", reason);
        return;
    }
    struct value_args args = {.first = 1};
    args.offset = (float)values_offset(effects, range, values_interval(effects, range));
    for (uint32_t i = 0; i < plan->instance_count; i++) {
        if (!has_values(&plan->instances[i]))
            continue;
        args.view = args.first ? plan->view : pt_view_filled(plan, &plan->instances[i]);
        args.instance = plan->instances[i].args;
        PT_REASON(PT_ADD(builder, value, args,
                         {pt_keys_of(builder, 0), pt_buffer_of(PT_SCALARS, i), pt_plane_at(PT_PLANE_VALUES, 0)}),
                  "instance %u: contour lines follow its scalars", i);
        args.first = 0;
    }
    const struct slope_args slope = {.view = plan->view};
    PT_REASON(PT_ADD(builder, slope, slope,
                     {pt_keys_of(builder, 0), pt_from_of(builder, 0), pt_plane_at(PT_PLANE_NORMAL, 0), pt_span_of(plan),
                      pt_plane_at(PT_PLANE_VALUES, 0), pt_plane_at(PT_PLANE_SLOPES, 0)}),
              "what the scalars are about each pixel, and grow by");
}

// Sets the axis of a height, and its offset; returns the interval.
static double set_contour_height(const struct patina_scene *scene, struct contour_args *args)
{
    const patina_effects *effects = &scene->effects;
    double axis[3] = {0.0, 0.0, 1.0}, camera[9], position[3], view[3];
    for (int k = 0; k < 3 && effects->contour_source == PATINA_CONTOUR_PLANE; k++)
        axis[k] = (double)effects->contour_axis[k];
    double length = sqrt(pt_dot(axis, axis));
    for (int k = 0; k < 3; k++)
        axis[k] /= length;
    const struct box box = scene_box(scene);
    double interval = (double)effects->contour_interval;
    interval = interval > 0.0 ? interval : usual_interval(extent(&box, axis));
    pt_camera_axes(&scene->camera, camera, position);
    pt_apply(camera, axis, view);
    // counted in float64 from the bold line next to the camera: what float32 adds to it is the distance from the camera
    args->offset = (float)remainder(pt_dot(axis, position) - (double)effects->contour_start, interval * effects->contour_every);
    for (int k = 0; k < 3; k++)
        args->axis[k] = (float)view[k];
    return interval;
}

static void plan_contour(struct pt_builder *builder, enum pt_plane color)
{
    const struct patina_scene *scene = builder->scene;
    const patina_effects *effects = &scene->effects;
    if (!(effects->contour_opacity > 0.0f)) {
        pt_skip(builder, "contour", "no contour lines are asked for");
        return;
    }
    const int bold = effects->contour_every > 1;
    struct contour_args args = {
        .view = builder->plan->view, .eye_z = pt_eye_z(scene), .opacity = effects->contour_opacity, .kinds = bold ? 2 : 1};
    double range[2];
    values_range(builder->plan, range);
    if (follows_values(scene) && range[0] > range[1]) {
        pt_skip(builder, "contour", "no cloud in view has scalars");
        return;
    }
    args.of_values = (uint32_t)follows_values(scene);
    const double interval = args.of_values ? values_interval(effects, range) : set_contour_height(scene, &args);
    const float widths[PT_CONTOUR_KINDS] = {effects->contour_width, effects->contour_bold};
    for (uint32_t i = 0; i < PT_CONTOUR_KINDS; i++) {
        double apart = i ? interval * effects->contour_every : interval, even = 2.0 * fmax((double)widths[i], 1.0);
        args.interval[i] = (float)apart;
        args.inverse[i] = (float)(1.0 / apart);
        args.width[i] = widths[i];
        args.even[i] = (float)even;
        args.per_even[i] = (float)(1.0 / even);
    }
    for (int k = 0; k < 3; k++)
        args.color[k] = effects->contour_color[k];
    PT_REASON(PT_ADD(builder, contour, args,
                     {pt_keys_of(builder, 0), pt_shading_of(builder), pt_plane_if(args.of_values != 0, PT_PLANE_SLOPES, 0),
                      pt_plane_at(color, 0)}),
              "contour lines %.4g apart%s, %.1f pixels wide", interval, args.of_values ? " in the scalars" : "",
              (double)args.width[0]);
}

// ---- fog ---------------------------------------------------------------------------------------------------------------

static void plan_fog(struct pt_builder *builder, enum pt_plane color)
{
    const struct patina_scene *scene = builder->scene;
    const patina_effects *effects = &scene->effects;
    if (!(effects->fog_density > 0.0f)) {
        pt_skip(builder, "fog", "no fog is asked for");
        return;
    }
    double from = scene->camera.orthographic ? scene->camera.near_clip : 0.0; // what z counts from
    double deep = (double)effects->fog_end - (double)effects->fog_start;
    struct fog_args args = {.view = builder->plan->view,
                            .start = (float)((double)effects->fog_start - from),
                            .inverse = (float)fmin(1.0 / deep, 1e30),
                            .density = effects->fog_density};
    for (int k = 0; k < 3; k++)
        args.color[k] = effects->fog_fixed ? effects->fog_color[k] : pt_background(&scene->settings)[k];
    PT_REASON(PT_ADD(builder, fog, args, {pt_keys_of(builder, 0), pt_plane_at(color, 0)}), "fog from %.4g to %.4g",
              (double)effects->fog_start, (double)effects->fog_end);
}

// ---- depth of field ------------------------------------------------------------------------------------------------------

int pt_effects_focus(const struct patina_scene *scene) { return scene->effects.focus_aperture > 0.0f; }

// Radius in pixels of the circle of confusion of what is infinitely far, in orthographic views of a world unit out of focus.
static double focus_scale(const struct patina_scene *scene)
{
    const patina_effects *effects = &scene->effects;
    return fmin(0.5 * (double)effects->focus_aperture / ((double)effects->focus_distance * pt_pixel_width(scene)), 1e9);
}

static double focus_most(const struct patina_scene *scene)
{
    const patina_camera *camera = &scene->camera;
    double distance = (double)scene->effects.focus_distance, scale = focus_scale(scene);
    if (camera->orthographic)
        return fmin(scale * fmax(fabs(distance - camera->near_clip), fabs(camera->far_clip - distance)), PT_FOCUS_MOST);
    return fmin(scale * fmax(fabs(1.0 - distance / camera->near_clip), 1.0), PT_FOCUS_MOST);
}

void pt_plan_focus(struct pt_builder *builder, enum pt_plane color, const struct compose_args *compose)
{
    const struct patina_scene *scene = builder->scene;
    if (!pt_effects_focus(scene)) {
        pt_skip(builder, "focus", "all is in focus");
        return;
    }
    double most = focus_most(scene), distance = (double)scene->effects.focus_distance;
    struct focus_args args = {.view = compose->view,
                              .crop_x = compose->crop_x,
                              .crop_y = compose->crop_y,
                              .crop_width = compose->crop_width,
                              .crop_height = compose->crop_height,
                              .distance = (float)(scene->camera.orthographic ? distance - scene->camera.near_clip : distance),
                              .scale = (float)focus_scale(scene),
                              .most = (float)most,
                              .reach = (uint32_t)fmin(ceil(most + 0.5), PT_FOCUS_MOST)};
    for (int k = 0; k < 4; k++)
        args.background[k] = compose->background[k];
    PT_REASON(
        PT_ADD(builder, focus, args, {pt_plane_at(PT_PLANE_KEYS, 0), pt_plane_at(color, 0), pt_plane_at(PT_PLANE_COMBINED, 0)}),
        "depth of field, sharp at %.4g, circles of at most %.1f pixels", distance, most);
    pt_skip(builder, "compose", "depth of field does it");
}

// ---- paper ---------------------------------------------------------------------------------------------------------------

static void plan_paper(struct pt_builder *builder)
{
    const patina_effects *effects = &builder->scene->effects;
    const struct pt_plan *plan = builder->plan;
    const float *tint = effects->paper_color;
    if (tint[0] == 1.0f && tint[1] == 1.0f && tint[2] == 1.0f && !(effects->paper_grain > 0.0f)) {
        pt_skip(builder, "paper", "no paper is asked for");
        return;
    }
    struct paper_args args = {.view = plan->view,
                              .crop_width = plan->crop[2],
                              .crop_height = plan->crop[3],
                              .x = plan->pixel_offset[0],
                              .y = plan->pixel_offset[1],
                              .color = {tint[0], tint[1], tint[2]},
                              .grain = effects->paper_grain};
    PT_REASON(PT_ADD(builder, paper, args, {pt_plane_at(PT_PLANE_COMBINED, 0)}), "paper, grain %.2f", (double)args.grain);
}

// ---- all ---------------------------------------------------------------------------------------------------------------

int pt_effects_want_normals(const struct patina_scene *scene)
{
    return scene->effects.obscurance_strength > 0.0f || scene->effects.hatch_levels ||
           (scene->effects.contour_opacity > 0.0f && !follows_values(scene));
}

int pt_effects_want_albedo(const struct patina_scene *scene) { return scene->effects.toon_bands > 0; }

void pt_plan_shaded_effects(struct pt_builder *builder, enum pt_plane color)
{
    plan_obscure(builder, color);
    plan_edl(builder, color);
    plan_toon(builder, color);
}

void pt_plan_drawn_effects(struct pt_builder *builder, enum pt_plane color)
{
    plan_hatch(builder, color);
    plan_contour(builder, color);
    plan_fog(builder, color);
}

void pt_plan_picture_effects(struct pt_builder *builder) { plan_paper(builder); }

uint32_t pt_effects_reach(const struct patina_scene *scene)
{
    const patina_effects *effects = &scene->effects;
    uint32_t reach = 0;
    if (effects->edl_strength > 0.0f)
        reach += edl_reach(effects);
    if (effects->obscurance_strength > 0.0f)
        reach += PT_REACH_obscure;
    if (follows_values(scene))
        reach += PT_REACH_slope;
    if (pt_effects_focus(scene))
        reach += PT_REACH_focus;
    return reach;
}
