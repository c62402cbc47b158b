// SPDX-License-Identifier: GPL-3.0-or-later
// What shade makes of the points' colours: a ramp over a scalar, a height or a distance; exposure and contrast.
#include "plan_passes.h"

#include <math.h>
#include <string.h>

struct span {
    double least, most;
};

static void widen(struct span *span, double value)
{
    span->least = fmin(span->least, value);
    span->most = fmax(span->most, value);
}

// Heights or distances of the corners of the cloud's chunks; of distances the least is 0 where the eye is among them.
static struct span span_of_boxes(const struct patina_scene *scene, const struct pt_instance *instance)
{
    const struct patina_cloud *cloud = instance->cloud;
    const enum patina_color_source source = instance->style.color_source;
    struct span span = { INFINITY, -INFINITY };
    double linear[9], translation[3], axes[9], eye[3], p[3], q[3];
    pt_split_matrix(instance->style.world_from_object, linear, translation);
    pt_camera_axes(&scene->camera, axes, eye);
    for (uint32_t c = 0; c < cloud->chunk_count; c++)
        for (int corner = 0; corner < 8; corner++) {
            const struct pt_chunk *chunk = &cloud->chunks[c];
            for (int k = 0; k < 3; k++)
                p[k] = chunk->origin[k] + (double)(corner >> k & 1 ? chunk->box_max[k] : chunk->box_min[k]);
            pt_apply(linear, p, q);
            for (int k = 0; k < 3; k++)
                q[k] += translation[k] - (source == PATINA_COLOR_DISTANCE ? eye[k] : 0.0);
            if (source != PATINA_COLOR_DISTANCE)
                widen(&span, source == PATINA_COLOR_HEIGHT ? q[2] : p[2]);
            else
                widen(&span, scene->camera.orthographic ? -pt_dot(axes + 6, q) : sqrt(pt_dot(q, q)));
        }
    return span;
}

static struct span span_of(const struct patina_scene *scene, const struct pt_instance *instance)
{
    const float *range = instance->style.ramp_range;
    if (range[0] == range[1] && instance->style.color_source != PATINA_COLOR_SCALAR)
        return span_of_boxes(scene, instance);
    if (range[0] == range[1])
        range = instance->cloud->info.scalar_range;
    return (struct span){ (double)range[0], (double)range[1] };
}

// t = along . place + zero, of places in view space: world z, or object z, from 0 to 1 over the span.
static void set_height(const struct patina_scene *scene, const struct pt_instance *instance, struct span span, double slope,
                       struct recolor_args *out)
{
    double axes[9], eye[3], linear[9], translation[3], cofactors[9], up[3] = { 0.0, 0.0, 1.0 };
    pt_camera_axes(&scene->camera, axes, eye);
    pt_split_matrix(instance->style.world_from_object, linear, translation);
    if (instance->style.color_source == PATINA_COLOR_OBJECT_HEIGHT) { // the last row of the inverse
        pt_cofactors(linear, cofactors);
        double determinant = pt_determinant(linear);
        for (int k = 0; k < 3; k++) {
            up[k] = determinant != 0.0 && isfinite(cofactors[3 * k + 2] / determinant) ? cofactors[3 * k + 2] / determinant : 0.0;
            eye[k] -= translation[k];
        }
    }
    out->zero = (float)((pt_dot(up, eye) - span.least) * slope);
    pt_apply(axes, up, translation);
    for (int k = 0; k < 3; k++)
        out->along[k] = (float)(translation[k] * slope);
}

static void set_ramp(const struct pt_instance *instance, struct recolor_args *out)
{
    static const float grey[6] = { 0.0f, 0.0f, 0.0f, 1.0f, 1.0f, 1.0f };
    out->entries = instance->style.ramp ? instance->style.ramp_count : 2;
    memcpy(out->ramp, instance->style.ramp ? instance->style.ramp : grey, 3 * (size_t)out->entries * sizeof *out->ramp);
}

void pt_plan_recolor(const struct pt_builder *builder, const struct pt_plan_instance *planned, struct shade_args *args)
{
    const struct pt_instance *instance = planned->instance;
    const patina_cloud_style *style = &instance->style;
    struct recolor_args *out = &args->recolor;
    out->graded = style->exposure != 0.0f || style->contrast != 1.0f;
    out->gain = (float)exp2((double)style->exposure);
    out->contrast = style->contrast;
    if (style->color_source == PATINA_COLOR_OWN)
        return;
    args->instance.color_format = style->color_source == PATINA_COLOR_SCALAR ? PT_COLOR_OF_SCALAR : 0;
    args->instance.has_opacities = planned->args.has_opacities; // discs: the point's own, as its colour
    if (style->color_source == PATINA_COLOR_FIXED)
        return;
    struct span span = span_of(builder->scene, instance);
    double slope = span.most != span.least ? 1.0 / (span.most - span.least) : 0.0;
    slope = fabs(slope) < 1e30 ? slope : 0.0;
    set_ramp(instance, out);
    out->source = style->color_source == PATINA_COLOR_SCALAR     ? PT_RAMP_SCALAR
                  : style->color_source == PATINA_COLOR_DISTANCE ? PT_RAMP_DISTANCE
                                                                 : PT_RAMP_PLACE;
    out->zero = (float)span.least;
    out->along[0] = (float)slope;
    if (out->source == PT_RAMP_PLACE)
        set_height(builder->scene, instance, span, slope, out);
}
