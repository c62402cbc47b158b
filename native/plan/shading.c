// SPDX-License-Identifier: GPL-3.0-or-later
// What shading is told of the world and its lights, as the camera sees them.
#include "light_points.h"
#include "passes.h"
#include "base/elementary.h"
#include "shared/measured.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

_Static_assert(offsetof(struct light_view, each) % 16 == 0 && sizeof(struct light_args) % 16 == 0 &&
                   sizeof(struct light_view) <= 16384,
               "lights lie as std140 has them, in a block that every driver takes");

static void set_vector(const double axes[9], const double vector[3], float out[3])
{
    double view[3];
    pt_apply(axes, vector, view);
    for (int k = 0; k < 3; k++)
        out[k] = (float)view[k];
}

static void set_light(const struct patina_scene *scene, const patina_light_desc *light, struct light_args *out)
{
    const double pi = 3.14159265358979323846;
    double axes[9], position[3], vector[3], points[3 * PT_AREA_POINTS], strength = (double)light->power;
    pt_camera_axes(&scene->camera, axes, position);
    for (int k = 0; k < 3; k++)
        vector[k] = light->type == PATINA_LIGHT_SUN ? -light->direction[k] : light->position[k] - position[k];
    set_vector(axes, vector, out->vector);
    set_vector(axes, light->direction, out->axis);
    if (light->type == PATINA_LIGHT_POINT || light->type == PATINA_LIGHT_SPOT)
        strength /= 4.0 * pi;               // radiant power -> intensity
    if (light->type == PATINA_LIGHT_AREA) { // radiance times area, over its points
        strength /= pi * PT_AREA_POINTS;
        pt_area_points(light, points);
        for (int i = 0; i < PT_AREA_POINTS; i++) {
            for (int k = 0; k < 3; k++)
                vector[k] = points[3 * i + k] - position[k];
            set_vector(axes, vector, out->points[i]);
        }
    }
    double edge = pt_cos(0.5 * (double)light->cone);
    out->cone[0] = (float)edge;
    out->cone[1] = (float)(1.0 / fmax((1.0 - edge) * (double)light->blend, 1e-6));
    out->type = light->type;
    for (int k = 0; k < 3; k++)
        out->color[k] = (float)((double)light->color[k] * strength);
}

static void set_lights(const struct pt_plan *plan, const struct patina_scene *scene, struct light_view *out)
{
    uint32_t casting = 0;
    for (uint32_t i = 0; i < scene->light_count; i++) { // patina_scene_add_light keeps them to PT_MAX_LIGHTS
        set_light(scene, &scene->lights[i], &out->each[i]);
        if (casting < plan->light_count && plan->lights[casting].light == &scene->lights[i])
            out->each[i].shadow = ++casting;
    }
}

// world_light seen from the camera: its first three directions as a vector, the last five as a symmetric matrix, which turn.
static void set_ambient(const struct patina_scene *scene, struct light_view *out)
{
    double axes[9], position[3];
    if (!scene->settings.world_directed)
        return;
    pt_camera_axes(&scene->camera, axes, position);
    for (int c = 0; c < 3; c++) {
        const float *world = scene->settings.world_light[c];
        const double along[3] = {world[1], world[2], world[3]}, xy = 0.5 * world[4], yz = 0.5 * world[5], zx = 0.5 * world[6];
        const double matrix[9] = {world[7] - world[8], xy, zx, xy, -world[7] - world[8], yz, zx, yz, 2.0 * world[8]};
        double turned[9], rows[9];
        float view[9];
        for (int k = 0; k < 3; k++)
            pt_apply(matrix, axes + 3 * k, rows + 3 * k);
        for (int k = 0; k < 3; k++)
            pt_apply(rows, axes + 3 * k, turned + 3 * k);
        view[0] = world[0];
        set_vector(axes, along, view + 1);
        view[4] = (float)(2.0 * turned[1]);
        view[5] = (float)(2.0 * turned[5]);
        view[6] = (float)(2.0 * turned[2]);
        view[7] = (float)(0.5 * (turned[0] - turned[4]));
        view[8] = (float)(0.5 * turned[8]);
        for (int k = 0; k < 9; k++)
            out->ambient[k][c] = view[k];
    }
}

void pt_shade_lights(const struct pt_builder *builder, int receives, struct shade_args *args)
{
    const struct patina_scene *scene = builder->scene;
    *args = (struct shade_args){.view = builder->plan->view};
    args->directed = scene->settings.world_directed;
    args->eye_z = pt_eye_z(scene);
    args->arrived = builder->layer <= 1 && builder->plan->light_count && (scene->settings.passes >> PATINA_PASS_SHADOW & 1u);
    args->light_count = scene->light_count;
    for (uint32_t i = 0; i < scene->light_count; i++)
        args->light_types |= 1u << scene->lights[i].type;
    args->casting = receives ? builder->plan->light_count : 0;
}

struct pt_ref pt_light_of(struct pt_builder *builder, const struct shade_args *args)
{
    const struct patina_scene *scene = builder->scene;
    struct pt_plan *plan = builder->plan;
    if (!args->instance.lit)
        return pt_nothing();
    if (!plan->light) {
        struct light_view *light = pt_arena_take(&plan->arena, sizeof *light);
        if (!light) {
            builder->failed = PATINA_ERROR_MEMORY;
            return pt_nothing();
        }
        memcpy(light->world, scene->settings.world_color, sizeof light->world);
        set_ambient(scene, light);
        set_lights(plan, scene, light);
        plan->light = light;
    }
    return (struct pt_ref){PT_OF_PLAN, PT_PLAN_LIGHTS, 0};
}

struct pt_pass *pt_add_shade(struct pt_builder *builder, enum pt_plane color, const struct shade_args *args,
                             const struct pt_shade_refs *own, enum pt_late words)
{
    struct pt_pass *pass = PT_ADD(builder, shade, *args,
                                  {own->keys, pt_from_of(builder, 0), own->normal, pt_span_of(builder->plan), own->albedo,
                                   pt_shading_of(builder), pt_plane_at(color, 0), own->opacities, own->shadows, own->marks,
                                   pt_plane_if(args->arrived != 0, PT_PLANE_ARRIVED, 0), pt_light_of(builder, args),
                                   pt_ramps_of(args)});
    pass->late = pt_shade_late(args, words);
    return pass;
}

// ---- what is known late --------------------------------------------------------------------------------------------------

// Of a sum of so many samples, what one of it is of all light.
static float scale_of(uint32_t samples) { return 1.0f / (255.0f * (float)samples); }

static void set_blend(const struct pt_words *words, struct blend_args *args)
{
    args->marked = words->step > 0;
    args->step = words->step;
    for (uint32_t i = 0; i < args->lights; i++)
        args->scales[i] = scale_of(words->samples[args->first + i]);
}

static void set_shade(const struct pt_words *words, struct shade_args *args)
{
    args->marked = !args->of_pixels && words->step > 0;
    args->step = words->step;
    for (uint32_t i = 0; i < args->casting; i++)
        args->scales[i] = args->of_pixels ? 1.0f / (float)PT_SHADOW_SUM : scale_of(words->samples[i]);
}

void pt_plan_late(const struct pt_pass *pass, const struct pt_words *words, void *arguments)
{
    if (pass->late == PT_LATE_NOTHING)
        return;
    if (pass->kernel == PT_KERNEL_blend)
        set_blend(words, arguments);
    else
        set_shade(words, arguments);
}
