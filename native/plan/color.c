// SPDX-License-Identifier: GPL-3.0-or-later
// What shade makes of the points' colours: a ramp over a scalar, a height or a distance; exposure and contrast.
#include "passes.h"
#include "ramp_span.h"
#include "base/elementary.h"
#include "scene/clip.h"

#include <math.h>
#include <string.h>

struct spread {
    const struct patina_scene *scene;
    int distances; // of corners in the world; else heights
    double axes[9], eye[3];
    struct span span;
};

static void widen(void *context, const double corner[3])
{
    struct spread *spread = context;
    double value = corner[2], away[3];
    for (int k = 0; k < 3; k++)
        away[k] = corner[k] - spread->eye[k];
    if (spread->distances)
        value = spread->scene->camera.orthographic ? -pt_dot(spread->axes + 6, away) : sqrt(pt_dot(away, away));
    spread->span.least = fmin(spread->span.least, value);
    spread->span.most = fmax(spread->span.most, value);
}

// Heights or distances of the corners of the cloud's chunks; of distances the least is 0 where the eye is among them.
static struct span span_of_boxes(const struct patina_scene *scene, const struct pt_instance *instance)
{
    static const double as_it_is[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    const enum patina_color_source source = instance->style.color_source;
    const double *matrix = source == PATINA_COLOR_OBJECT_HEIGHT ? as_it_is : instance->style.world_from_object;
    struct spread spread = {.scene = scene, .distances = source == PATINA_COLOR_DISTANCE, .span = {INFINITY, -INFINITY}};
    pt_camera_axes(&scene->camera, spread.axes, spread.eye);
    pt_cloud_corners(instance->whole, NULL, matrix, widen, &spread);
    return spread.span;
}

struct span pt_ramp_span(const struct patina_scene *scene, const struct pt_instance *instance)
{
    const float *range = instance->style.ramp_range;
    if (range[0] == range[1] && instance->style.color_source == PATINA_COLOR_TRUST)
        return (struct span){0.0, 1.0};
    if (range[0] == range[1] && instance->style.color_source != PATINA_COLOR_SCALAR)
        return span_of_boxes(scene, instance);
    if (range[0] == range[1])
        range = instance->cloud->info.scalar_range;
    return (struct span){(double)range[0], (double)range[1]};
}

// t = along . place + zero, of places in view space: world z, or object z, from 0 to 1 over the span.
static void set_height(const struct patina_scene *scene, const struct pt_instance *instance, struct span span, double slope,
                       struct recolor_args *out)
{
    double axes[9], eye[3], linear[9], translation[3], cofactors[9], up[3] = {0.0, 0.0, 1.0};
    pt_camera_axes(&scene->camera, axes, eye);
    pt_split_matrix(instance->style.world_from_object, linear, translation);
    if (instance->style.color_source == PATINA_COLOR_OBJECT_HEIGHT) { // the last row of the inverse
        pt_cofactors(linear, cofactors);
        double determinant = pt_determinant(linear);
        for (int k = 0; k < 3; k++) {
            up[k] = determinant != 0.0 && isfinite(cofactors[3 * k + 2] / determinant) ? cofactors[3 * k + 2] / determinant
                                                                                       : 0.0;
            eye[k] -= translation[k];
        }
    }
    out->zero = (float)((pt_dot(up, eye) - span.least) * slope);
    pt_apply(axes, up, translation);
    for (int k = 0; k < 3; k++)
        out->along[k] = (float)(translation[k] * slope);
}

// Room for `count` things of `size` bytes behind so many; NULL: memory lacks.
static void *grown(struct pt_plan *plan, void *old, uint32_t held, uint32_t count, size_t size, uint32_t *room)
{
    if (held + count <= *room)
        return old;
    const uint32_t wanted = 2 * (held + count);
    void *memory = pt_arena_take(&plan->arena, wanted * size);
    if (memory && held)
        memcpy(memory, old, held * size);
    *room = memory ? wanted : *room;
    return memory;
}

static const struct pt_plan_ramp *known_ramp(const struct pt_plan *plan, const float *ramp, uint32_t entries)
{
    for (uint32_t i = 0; i < plan->ramp_count; i++)
        if (plan->ramp_list[i].entries == entries &&
            !memcmp(plan->ramps + 3 * (size_t)plan->ramp_list[i].first, ramp, 3 * (size_t)entries * sizeof *ramp))
            return &plan->ramp_list[i];
    return NULL;
}

void pt_plan_ramp(struct pt_builder *builder, const float *ramp, uint32_t entries, struct recolor_args *out)
{
    struct pt_plan *plan = builder->plan;
    const struct pt_plan_ramp *known = known_ramp(plan, ramp, entries);
    out->first = known ? known->first : plan->ramp_entries;
    out->entries = entries;
    if (known)
        return;
    float *ramps = grown(plan, plan->ramps, plan->ramp_entries, entries, 3 * sizeof *ramps, &plan->ramp_room);
    struct pt_plan_ramp *list = grown(plan, plan->ramp_list, plan->ramp_count, 1, sizeof *list, &plan->ramp_list_room);
    if (!ramps || !list) {
        builder->failed = PATINA_ERROR_MEMORY;
        return;
    }
    plan->ramps = ramps;
    plan->ramp_list = list;
    memcpy(ramps + 3 * (size_t)plan->ramp_entries, ramp, 3 * (size_t)entries * sizeof *ramp);
    list[plan->ramp_count++] = (struct pt_plan_ramp){plan->ramp_entries, entries};
    plan->ramp_entries += entries;
}

static void set_ramp(struct pt_builder *builder, const struct pt_instance *instance, struct recolor_args *out)
{
    static const float grey[6] = {0.0f, 0.0f, 0.0f, 1.0f, 1.0f, 1.0f};
    const int own = instance->style.ramp != NULL;
    pt_plan_ramp(builder, own ? instance->style.ramp : grey, own ? instance->style.ramp_count : 2, out);
}

struct pt_ref pt_colors_of(const struct pt_plan_instance *planned, uint32_t i, const struct recolor_args *recolor)
{
    return recolor->source == PT_RAMP_TRUST    ? pt_shapes_of(planned, i)
           : recolor->source == PT_RAMP_SCALAR ? pt_buffer_of(PT_SCALARS, i)
                                               : pt_buffer_of(PT_COLORS, i);
}

void pt_plan_recolor(struct pt_builder *builder, const struct pt_plan_instance *planned, struct shade_args *args)
{
    const struct pt_instance *instance = planned->instance;
    const patina_cloud_style *style = &instance->style;
    struct recolor_args *out = &args->recolor;
    out->graded = style->exposure != 0.0f || style->contrast != 1.0f;
    out->gain = (float)pt_exp2((double)style->exposure);
    out->contrast = style->contrast;
    if (style->color_source == PATINA_COLOR_OWN)
        return;
    const int trust = style->color_source == PATINA_COLOR_TRUST && instance->cloud->info.has_shapes;
    args->instance.color_format = style->color_source == PATINA_COLOR_SCALAR || trust ? PT_COLOR_OF_SCALAR : 0;
    args->instance.has_opacities = planned->args.has_opacities; // discs: the point's own, as its colour
    if (style->color_source == PATINA_COLOR_FIXED || (style->color_source == PATINA_COLOR_TRUST && !trust))
        return;
    struct span span = pt_ramp_span(builder->scene, instance);
    double slope = span.most != span.least ? 1.0 / (span.most - span.least) : 0.0;
    slope = fabs(slope) < 1e30 ? slope : 0.0;
    set_ramp(builder, instance, out);
    out->source = trust                                          ? PT_RAMP_TRUST
                  : style->color_source == PATINA_COLOR_SCALAR   ? PT_RAMP_SCALAR
                  : style->color_source == PATINA_COLOR_DISTANCE ? PT_RAMP_DISTANCE
                                                                 : PT_RAMP_PLACE;
    out->zero = (float)span.least;
    out->along[0] = (float)slope;
    if (out->source == PT_RAMP_PLACE)
        set_height(builder->scene, instance, span, slope, out);
}
