// SPDX-License-Identifier: GPL-3.0-or-later
// THE file: scene + settings -> passes, each with its reason, and why each other pass is left out.
#include "passes.h"

#include "expected.h"
#include "lines.h"
#include "shared/measured.h"
#include "shared/points.h"
#include "shared/shadows.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { BLEND_MOST = PT_REACH_shade - 1 };
// Of each filling filter in a light's map, at most: more widen steep surfaces (tests/scenes/test_shadow: 0.20% in place of
// 0.18% wrong), one leaves holes that light leaks through.
enum { MAP_ITERATIONS = 2 };

// ---- the passes --------------------------------------------------------------------------------------------------------

// Where shading finds the color of the instance's pixels: a PT_COLOR_*.
static void set_color_format(const struct pt_builder *builder, const struct pt_plan_instance *instance,
                             struct instance_args *args)
{
    if (pt_kinds[instance->kind].in_planes) {
        args->color_format = PT_COLOR_OF_PLANE;
        args->has_opacities = builder->plan->transparent != 0;
    }
    if (pt_averages(builder, instance))
        args->color_format = PT_COLOR_OF_PIXEL;
}

// Pixels over which filled normals are blended; 0: none. Filled pixels show their source's surface: half a spacing around, they border on
// the next source's.
static uint32_t blend_of(const struct pt_builder *builder, const struct pt_plan_instance *instance, uint32_t lit)
{
    const struct pt_plan *plan = builder->plan;
    const int normals = lit || (builder->scene->settings.passes >> PATINA_PASS_NORMAL & 1u) ||
                        pt_effects_want_normals(builder->scene);
    if (plan->quality != PATINA_QUALITY_REFINED || !normals || (pt_kinds[instance->kind].in_planes && !plan->iterations))
        return 0;
    return (uint32_t)fmin(fmax(floor(0.5 * plan->spacing_px + 0.5), 1.0), BLEND_MOST);
}

// color: COLOR_A, or UNLIT for the points' own colours.
static void plan_shade(struct pt_builder *builder, uint32_t i, enum pt_plane color)
{
    const struct pt_plan_instance *instance = &builder->plan->instances[i];
    struct shade_args args;
    pt_shade_lights(builder, pt_receives(instance->instance), &args);
    args.view = pt_view_filled(builder->plan, instance);
    args.instance = instance->args;
    const int shown = pt_line_surface(builder, &args.instance);
    if (!args.instance.lit)
        pt_without_lights(&args);
    if (shown)
        set_color_format(builder, instance, &args.instance);
    args.blend = blend_of(builder, instance, args.instance.lit);
    pt_own_colors(color, &args);
    args.of_pixels = instance->kind == PT_AS_DISCS && args.light_count && pt_blends_light(builder);
    if (shown)
        pt_plan_recolor(builder, instance, &args);
    const uint32_t format = args.instance.color_format;
    const int of_plane = format == PT_COLOR_OF_PLANE || format == PT_COLOR_OF_PIXEL;
    const struct pt_shade_refs own = {
        .keys = pt_keys_of(builder, 0),
        .normal = pt_plane_at(PT_PLANE_NORMAL, 0),
        .albedo = of_plane ? pt_plane_at(PT_PLANE_ALBEDO, 0) : pt_colors_of(instance, i, &args.recolor),
        .opacities = pt_buffer_of(PT_OPACITIES, i),
        .shadows = args.of_pixels ? pt_plane_at(PT_PLANE_LIGHT, 0) : pt_buffer_of(PT_SHADOWS, instance->of),
        .marks = args.of_pixels ? pt_nothing() : pt_marks_of(builder, instance->of)};
    PT_REASON(pt_add_shade(builder, color, &args, &own, PT_LATE_POINTS),
              "instance %u, %s, %u lights, filled normals blended over %u pixels%s", i, args.instance.lit ? "lit" : "unlit",
              args.light_count, args.blend, args.recolor.source ? ", ramp" : "");
}

// Returns the plane that holds the finished colour.
static enum pt_plane plan_image_filters(struct pt_builder *builder)
{
    static const float weights[3][3] = {{16.0f, 2.0f, 1.0f}, {4.0f, 2.0f, 1.0f}, {1.0f, 1.0f, 1.0f}};
    static const char *const names[3] = {"alleviated Gaussian", "Gaussian", "box"};
    struct pt_plan *plan = builder->plan;
    const patina_settings *settings = &builder->scene->settings;
    enum pt_plane color = PT_PLANE_COLOR_A;
    pt_plan_shaded_effects(builder, color);
    if (settings->smooth != PATINA_SMOOTH_OFF) {
        const float *w = weights[settings->smooth];
        struct smooth_args args = {
            .view = plan->view, .center = w[0], .edge = w[1], .corner = w[2], .translucent = plan->transparent != 0};
        PT_REASON(PT_ADD(builder, smooth, args,
                         {pt_keys_of(builder, 0), pt_from_of(builder, 0), pt_span_of(plan), pt_plane_at(color, 0),
                          pt_plane_at(PT_PLANE_COLOR_B, 0)}),
                  "%s, 3 x 3", names[settings->smooth]);
        color = PT_PLANE_COLOR_B;
    } else {
        pt_skip(builder, "smooth", "switched off in the settings");
    }
    pt_plan_drawn_effects(builder, color);
    if (settings->antialias == PATINA_ANTIALIAS_OFF) {
        pt_skip(builder, "antialias", "switched off in the settings");
        return color;
    }
    struct antialias_args args = {.view = plan->view,
                                  .layers = settings->antialias == PATINA_ANTIALIAS_LAYERS,
                                  .behind = builder->layer > 1,
                                  .mesh_base = (uint32_t)plan->ids.points,
                                  .mesh_count = (uint32_t)builder->scene->triangles,
                                  .inked = plan->line_radius > 0.0f};
    PT_REASON(PT_ADD(builder, antialias, args,
                     {pt_keys_of(builder, 0), pt_from_of(builder, 0), pt_span_of(plan), pt_plane_at(color, 0),
                      pt_plane_if(args.behind != 0, PT_PLANE_THROUGH, 0), args.inked ? pt_line_of(builder) : pt_nothing()}),
              args.layers ? "edges of background and layers" : "edges of background");
    return color;
}

// ---- layers ------------------------------------------------------------------------------------------------------------

static void plan_peel(struct pt_builder *builder, enum pt_plane color)
{
    const struct pt_plan *plan = builder->plan;
    struct peel_args args = {.view = plan->view,
                             .first = builder->layer == 1,
                             .stop = !builder->scene->settings.layer_passes,
                             .inked = plan->line_radius > 0.0f};
    PT_REASON(PT_ADD(builder, peel, args,
                     {pt_keys_of(builder, 0), pt_from_of(builder, 0), pt_span_of(plan), pt_shading_of(builder),
                      pt_plane_at(color, 0), pt_plane_at(PT_PLANE_LIMIT, 0), pt_plane_at(PT_PLANE_THROUGH, 0),
                      pt_plane_at(PT_PLANE_OVER, 0), pt_plane_at(PT_PLANE_TILES, PT_TILE_LEVEL)}),
              "layer %u of at most %u is blended, what may lie behind it is marked", builder->layer, plan->layers);
}

static struct compose_args compose_args(const struct pt_plan *plan)
{
    return (struct compose_args){.view = plan->view,
                                 .crop_x = plan->crop[0],
                                 .crop_y = plan->crop[1],
                                 .crop_width = plan->crop[2],
                                 .crop_height = plan->crop[3]};
}

static int fills_planes(const struct pt_plan *plan)
{
    return pt_plan_draws(plan, PT_AS_DISCS) || pt_plan_draws(plan, PT_AS_RANGES);
}

static struct extract_args extract_args(const struct pt_builder *builder, uint32_t passes)
{
    const struct pt_plan *plan = builder->plan;
    struct extract_args args = {.view = plan->view,
                                .crop_x = plan->crop[0],
                                .crop_y = plan->crop[1],
                                .crop_width = plan->crop[2],
                                .crop_height = plan->crop[3],
                                .depth = passes >> PATINA_PASS_DEPTH & 1u,
                                .normal = passes >> PATINA_PASS_NORMAL & 1u,
                                .source = passes >> PATINA_PASS_SOURCE & 1u,
                                .shadow = pt_plan_shows(plan) && plan->light_count && (passes >> PATINA_PASS_SHADOW & 1u),
                                .discs_first = plan->discs.first,
                                // of layers only the last is there still; where no disc is drawn nothing says where one fell
                                .discs_count = plan->layers > 1 || !fills_planes(plan) ? 0 : plan->discs.count};
    double axes[9], position[3];
    pt_camera_axes(&builder->scene->camera, axes, position);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            args.world_from_view[3 * r + c] = (float)axes[3 * c + r];
    return args;
}

static void plan_layer_passes(struct pt_builder *builder, enum pt_plane color)
{
    const uint32_t passes = builder->scene->settings.layer_passes, layer = builder->layer, slot = layer - 1;
    struct compose_args compose = compose_args(builder->plan);
    struct extract_args extract = extract_args(builder, passes);
    if (passes >> PATINA_PASS_COMBINED & 1u)
        PT_REASON(PT_ADD(builder, compose, compose,
                         {pt_keys_of(builder, 0), pt_plane_at(color, 0), pt_plane_at(PT_PLANE_LAYER_COMBINED, slot)}),
                  "colour of layer %u is asked for", layer);
    if (extract.depth || extract.normal)
        PT_REASON(PT_ADD(builder, extract, extract,
                         {pt_keys_of(builder, 0), pt_from_of(builder, 0), pt_shading_of(builder),
                          pt_plane_if(extract.depth != 0, PT_PLANE_LAYER_DEPTH, slot),
                          pt_plane_if(extract.normal != 0, PT_PLANE_LAYER_NORMALS, slot), pt_nothing(), pt_nothing(),
                          pt_nothing(), pt_nothing(), pt_nothing()}),
                  "of layer %u are asked for:%s%s", layer, extract.depth ? " depth" : "", extract.normal ? " normal" : "");
    pt_plan_ink_layer(builder, passes >> PATINA_PASS_COMBINED & 1u ? PT_PLANE_LAYER_COMBINED : PT_PLANE_COUNT,
                      extract.depth ? PT_PLANE_LAYER_DEPTH : PT_PLANE_COUNT);
}

// ---- the picture -------------------------------------------------------------------------------------------------------

static void set_background(const patina_settings *settings, float background[4])
{
    for (int k = 0; k < 3; k++)
        background[k] = settings->film_transparent ? 0.0f : pt_background(settings)[k];
    background[3] = settings->film_transparent ? 0.0f : 1.0f;
}

static void plan_extract(struct pt_builder *builder)
{
    struct extract_args extract = extract_args(builder, builder->scene->settings.passes);
    extract.centered = pt_tells_surfaces(builder) ? (uint32_t)builder->plan->ids.points : 0;
    if (!extract.depth && !extract.normal && !extract.source && !extract.shadow) {
        pt_skip(builder, "extract", "no pass beside the combined one is asked for");
        return;
    }
    PT_REASON(
        PT_ADD(builder, extract, extract,
               {pt_plane_at(PT_PLANE_KEYS, 0), pt_plane_if(extract.source || extract.centered, PT_PLANE_FROM, 0),
                pt_plane_if(extract.normal != 0, PT_PLANE_SHADING, 0), pt_plane_if(extract.depth != 0, PT_PLANE_DEPTH, 0),
                pt_plane_if(extract.normal != 0, PT_PLANE_NORMALS, 0), pt_plane_if(extract.source != 0, PT_PLANE_SOURCE, 0),
                pt_plane_if(extract.shadow != 0, PT_PLANE_ARRIVED, 0), pt_plane_if(extract.shadow != 0, PT_PLANE_SHADOW, 0),
                pt_plane_if(extract.discs_count != 0, PT_PLANE_AWAY, 0),
                pt_plane_if(extract.centered != 0, PT_PLANE_OFFSET, 0)}),
        "asked for:%s%s%s%s", extract.depth ? " depth" : "", extract.normal ? " normal" : "", extract.source ? " source" : "",
        extract.shadow ? " shadow" : "");
}

static void plan_output(struct pt_builder *builder, enum pt_plane color)
{
    const patina_settings *settings = &builder->scene->settings;
    struct compose_args compose = compose_args(builder->plan);
    set_background(settings, compose.background);
    compose.everywhere = builder->plan->layers > 1 && builder->plan->line_radius > 0.0f;
    const int focuses = pt_effects_focus(builder->scene);
    if (focuses) // before depth of field: with what gives it colours, passes may run as one
        plan_extract(builder);
    pt_plan_focus(builder, color, &compose);
    if (focuses)
        return;
    PT_REASON(PT_ADD(builder, compose, compose,
                     {pt_plane_at(PT_PLANE_KEYS, 0), pt_plane_at(color, 0), pt_plane_at(PT_PLANE_COMBINED, 0)}),
              "%s",
              settings->film_transparent ? "transparent film"
              : settings->own_background ? "over its own background"
                                         : "over the world colour");
    plan_extract(builder);
}

// Why no light casts a shadow, or NULL.
static const char *no_shadows(const struct patina_scene *scene)
{
    uint32_t casting = 0, receiving = 0, objects = 0;
    for (uint32_t i = 0; i < scene->light_count; i++)
        casting += scene->lights[i].shadows != 0;
    for (uint32_t i = 0; i < scene->cloud_count; i++) {
        receiving += (uint32_t)pt_receives(&scene->instances[i]);
        objects += !(scene->instances[i].style.shadow_off & PATINA_SHADOW_NO_CAST);
    }
    for (uint32_t i = 0; i < scene->mesh_count; i++) {
        receiving += (uint32_t)pt_mesh_receives(pt_mesh_at(scene, i));
        objects += (uint32_t)pt_mesh_casts(pt_mesh_at(scene, i));
    }
    return !casting     ? "no light casts shadows"
           : !receiving ? "no lit cloud and no mesh receives shadows"
           : !objects   ? "nothing casts shadows"
                        : NULL;
}

static void plan_ranks(struct pt_builder *builder)
{
    const struct pt_plan *plan = builder->plan;
    for (uint32_t i = 0; i < plan->instance_count; i++) {
        const struct pt_plan_instance *instance = &plan->instances[i];
        const struct rank_args args = {.view = plan->view};
        if (instance->chunk_count && pt_receives(instance->instance))
            PT_REASON(
                PT_ADD(builder, rank, args,
                       {pt_buffer_of(PT_CHUNKS, i), pt_buffer_of(PT_MARKS, instance->of), {PT_OF_FLAG, PT_FLAG_MARKED, 0}}),
                "shadow words of instance %u are those of marked points", i);
    }
}

static void plan_marks(struct pt_builder *builder)
{
    struct pt_plan *plan = builder->plan;
    const char *none = no_shadows(builder->scene);
    int lazy = pt_plan_lazy(builder->scene, plan);
    if (none || !lazy)
        pt_skip(builder, "mark",
                none                                           ? none
                : plan->layers > 1                             ? "what later layers show is not known yet"
                : pt_soft_receives(builder->scene)             ? "soft points all take shadows"
                : builder->scene->settings.shadow_error > 0.0f ? "the error target is measured on whole shadow textures"
                                                               : "whole shadow textures, to be kept");
    if (none)
        pt_skip(builder, "shadow_test", none);
    if (none || !pt_casts_in_layers(builder->scene))
        pt_skip(builder, "limit", none ? none : "the points of no cloud that casts have opacities of their own");
    if (none || !pt_soft_casts(builder->scene))
        pt_skip(builder, "dim", none ? none : "no soft point casts shadows");
    const int blended = !none && lazy && pt_blends_light(builder); // all that a pixel of discs shows, then
    int marked = !blended;
    if (blended)
        pt_plan_blend_marks(builder);
    for (uint32_t i = 0; i < plan->instance_count && !none && lazy; i++) {
        const struct pt_plan_instance *instance = &plan->instances[i];
        if (!instance->chunk_count || !pt_receives(instance->instance) || (blended && instance->kind == PT_AS_DISCS))
            continue;
        struct mark_args args = {.view = pt_view_filled(plan, instance),
                                 .id_base = instance->args.id_base,
                                 .id_first = instance->args.id_first,
                                 .id_count = instance->args.id_count};
        PT_REASON(PT_ADD(builder, mark, args, {pt_keys_of(builder, 0), pt_buffer_of(PT_MARKS, instance->of)}),
                  "only points of instance %u that the picture shows need shadows", i);
        marked = 1;
    }
    if (!marked)
        pt_skip(builder, "mark", "the discs that pixels show are marked");
    if (none || !lazy)
        pt_skip(builder, "rank", none ? none : "shadow words of all points");
    else
        plan_ranks(builder);
}

static int is_of_points(enum pt_stage stage)
{
    return stage == PT_STAGE_points || stage == PT_STAGE_ranges || stage == PT_STAGE_measured || stage == PT_STAGE_filling;
}

static int is_planned(const struct pt_plan *plan, enum pt_kernel kernel)
{
    int known = pt_has_pass(plan, kernel);
    for (uint32_t i = 0; i < plan->skipped_count; i++)
        known |= !strcmp(plan->skipped[i].name, pt_kernels[kernel].name);
    return known;
}

// What nothing was said of yet: all of it, or what makes surfaces of points.
static void skip_rest(struct pt_builder *builder, const char *reason, int of_points)
{
    for (int k = 0; k < PT_KERNEL_COUNT; k++)
        if ((!of_points || is_of_points(pt_kernels[k].stage)) && !is_planned(builder->plan, (enum pt_kernel)k) &&
            !(builder->plan->light_count && pt_kernels[k].stage == PT_STAGE_shadows)) // in the lights' maps
            pt_skip(builder, pt_kernels[k].name, reason);
}

static const struct {
    void (*see)(struct pt_builder *);
    void (*show)(struct pt_builder *, uint32_t instance);
    void (*join)(struct pt_builder *);
    void (*cover)(struct pt_builder *, int shown);
    void (*front)(struct pt_builder *);
} work_of[PT_AS_COUNT] = {
#define PT_X(kind, source, sees, shows, in_planes, reach, pixels, beyond, see, show, join, cover, front, ...)                  \
    {see, show, join, cover, front},
    PT_KINDS(PT_X)
#undef PT_X
};

// Keys are least ones, whoever comes first: discs lie near, and what they hide scatter need not look at.
static const enum pt_kind by_sight[PT_AS_COUNT] = {PT_AS_DISCS, PT_AS_POINTS, PT_AS_RANGES, PT_AS_SOFT, PT_AS_MESH};

// What the measured pixels show: of all kinds that filling comes behind.
static void plan_measured(struct pt_builder *builder)
{
    const struct pt_plan *plan = builder->plan;
    for (int k = 0; k < PT_AS_COUNT; k++)
        if (work_of[by_sight[k]].see)
            work_of[by_sight[k]].see(builder);
    for (uint32_t i = 0; i < plan->instance_count; i++)
        if (plan->instances[i].chunk_count && work_of[plan->instances[i].kind].show)
            work_of[plan->instances[i].kind].show(builder, i);
    for (int kind = 0; kind < PT_AS_COUNT; kind++)
        if (work_of[kind].join)
            work_of[kind].join(builder);
}

static void plan_covers(struct pt_builder *builder, int shown)
{
    for (int kind = 0; kind < PT_AS_COUNT; kind++)
        if (work_of[kind].cover)
            work_of[kind].cover(builder, shown);
}

static void plan_fronts(struct pt_builder *builder)
{
    for (int kind = 0; kind < PT_AS_COUNT; kind++)
        if (work_of[kind].front)
            work_of[kind].front(builder);
}

// Scatter, surfaces, filling: what pictures and light maps have in common.
static void plan_surfaces(struct pt_builder *builder)
{
    if (!builder->plan->points_scattered) {
        skip_rest(builder, "no cloud is in view", 1);
        return;
    }
    pt_plan_sift(builder);
    plan_measured(builder);
    if (builder->plan->reopens == 2) {
        const int behind = builder->behind;
        pt_plan_filling(builder);
        if (!pt_plan_reopen_find(builder)) {
            pt_plan_reopen_take(builder); // says why not
            return;
        }
        builder->again = builder->behind = 1;
        plan_measured(builder);
        builder->behind = behind;
    }
    pt_plan_reopen_keep(builder);
    pt_plan_filling(builder);
    builder->again = 0;
    pt_plan_reopen_take(builder);
}

// What must be known of shadows before the layer at hand is shaded.
static void plan_shadows(struct pt_builder *builder)
{
    const struct pt_plan *plan = builder->plan;
    if (plan->light_count && (builder->layer == 1 || plan->mesh.shadows))
        pt_add_passes_step(builder, PT_STEP_PASSES);
    if (builder->layer == 1)
        plan_marks(builder);
    if (builder->layer == 1 && plan->light_count)
        pt_add_passes_step(builder, PT_STEP_MARK);
    if (plan->light_count && (builder->layer == 1 || plan->mesh.shadows))
        pt_plan_light_steps(builder);
    if (pt_blends_light(builder))
        pt_plan_blend_light(builder);
}

// Returns the plane that holds the layer's colour.
static enum pt_plane plan_layer(struct pt_builder *builder)
{
    struct pt_plan *plan = builder->plan;
    plan_surfaces(builder);
    plan_covers(builder, 1);
    pt_plan_average(builder);
    pt_plan_lines(builder);
    plan_shadows(builder);
    plan_fronts(builder);
    pt_plan_values(builder);
    uint32_t tail = plan->pass_count;
    for (int own = pt_effects_want_albedo(builder->scene); own >= 0; own--) { // normals are shown by the last
        enum pt_plane shaded = own ? PT_PLANE_UNLIT : PT_PLANE_COLOR_A;
        for (uint32_t i = 0; i < plan->instance_count; i++)
            if (plan->instances[i].chunk_count)
                plan_shade(builder, i, shaded);
        pt_plan_mesh_shade(builder, shaded);
    }
    pt_plan_reopen_show(builder, PT_PLANE_COLOR_A);
    pt_plan_tint(builder, PT_PLANE_COLOR_A);
    enum pt_plane color = plan_image_filters(builder);
    if (plan->layers > 1)
        plan_peel(builder, color);
    builder->tail = tail;
    return color;
}

static int pointwise(enum pt_kernel kernel)
{
    switch (kernel) {
#define PT_POINTWISE(name, ...) case PT_KERNEL_##name:
#include "pointwise.def"
#undef PT_POINTWISE
        return 1;
    default: return 0;
    }
}

static int reads_planes(enum pt_kernel kernel) { return kernel == PT_KERNEL_smooth || kernel == PT_KERNEL_antialias; }

static int gives_picture(enum pt_kernel kernel) { return kernel == PT_KERNEL_compose || kernel == PT_KERNEL_peel; }

static int runs_with_others(enum pt_kernel kernel)
{
    return pt_kernels[kernel].stage == PT_STAGE_colors || pt_kernels[kernel].stage == PT_STAGE_effects || pointwise(kernel);
}

// From shading on, passes may run as one where nobody asks for what lies between them; or from behind the last of those that shading
// does not follow at once, if smoothing or anti-aliasing follow. Up to the picture, or to depth of field, which looks around in the colours.
static void put_together(const struct pt_builder *builder)
{
    const struct pt_plan *plan = builder->plan;
    const patina_settings *settings = &builder->scene->settings;
    const uint32_t of_first = 1u << PATINA_PASS_NORMAL | 1u << PATINA_PASS_SOURCE |
                              1u << PATINA_PASS_SHADOW; // are taken from its planes, at the end
    uint32_t first = builder->tail, end = first, leaves = 0;
    int picture = 0, reads = 0;
    if (settings->layer_passes || plan->mesh.triangles || (plan->layers == 1 && plan->transparent) ||
        (plan->layers > 1 && builder->layer == 1 && (settings->passes & of_first)))
        return;
    for (; end < plan->pass_count; end++) {
        const enum pt_kernel kernel = plan->passes[end].kernel;
        if (runs_with_others(kernel)) {
            picture |= gives_picture(kernel);
            reads |= reads_planes(kernel);
        } else if (picture) {
            break;
        } else if (kernel == PT_KERNEL_focus && reads) {
            const uint32_t left = plan->passes[end].refs[PT_BUF_focus_color].which;
            if (first == builder->tail || left != PT_PLANE_COLOR_A) // a walk behind shading reads that plane: never in place
                leaves = 1 + left;
            break;
        } else {
            first = end + 1;
            reads = 0;
        }
    }
    if (leaves || (picture && (first == builder->tail || reads))) {
        plan->passes[first].together = end - first;
        plan->passes[first].leaves = leaves;
    }
}

// A layer with its passes and steps, of several or the only one.
static enum pt_plane plan_whole_layer(struct pt_builder *builder)
{
    const struct pt_plan *plan = builder->plan;
    pt_plan_clears(builder, 1);
    if (plan->layers > 1 && builder->layer == 1)
        pt_plan_peeling(builder);
    const enum pt_plane color = plan_layer(builder);
    if (plan->layers > 1)
        put_together(builder);
    plan_layer_passes(builder, color);
    if (plan->layers > 1) {
        pt_add_passes_step(builder, PT_STEP_PASSES);
        PT_REASON(pt_add_step(builder, PT_STEP_COVERED), "what layer %u covers, and what may lie behind it", builder->layer);
    }
    return color;
}

static void plan_soft(struct pt_builder *builder)
{
    if (pt_counts_soft(builder))
        pt_plan_no_density(builder);
    pt_plan_soft(builder);
}

static void plan_points(struct pt_builder *builder)
{
    const struct pt_plan *plan = builder->plan;
    float background[4];
    builder->layer = 1;
    enum pt_plane color = plan_whole_layer(builder);
    uint32_t loop = 0;
    if (plan->layers > 1) {
        builder->layer = 2;
        loop = pt_open_step(builder, PT_STEP_LAYERS);
        pt_step_at(builder, loop)->most = plan->layers - 1;
        pt_step_at(builder, loop)->ends = PT_END_LAYER_EMPTY | PT_END_SPENT;
        PT_REASON(pt_step_at(builder, loop), "%s",
                  plan->transparent ? "something in view lets light through" : "passes of every layer are asked for");
    }
    for (; builder->layer >= 2 && builder->layer <= plan->layers; builder->layer++) {
        const uint32_t layer = pt_open_step(builder, PT_STEP_LAYER);
        PT_REASON(pt_step_at(builder, layer), "what lies behind layer %u", builder->layer - 1);
        color = plan_whole_layer(builder);
        pt_close_step(builder, layer);
    }
    if (plan->layers > 1)
        pt_close_step(builder, loop);
    builder->layer = 0;
    pt_plan_soft_beyond(builder);
    if (plan->layers == 1)
        pt_skip(builder, "peel",
                plan->transparent ? "the settings ask for one layer" : "everything in view is opaque: one layer");
    plan_output(builder, plan->layers > 1 ? PT_PLANE_OVER : color);
    set_background(&builder->scene->settings, background);
    pt_plan_ink(builder, background);
    plan_soft(builder);
    pt_plan_picture_effects(builder);
    if (plan->layers == 1)
        put_together(builder);
    pt_plan_assess(builder);
    pt_plan_reveal(builder);
    pt_add_passes_step(builder, PT_STEP_PASSES);
}

static void plan_nothing(struct pt_builder *builder, const char *reason)
{
    builder->plan->line_radius = 0.0f;
    pt_plan_clears(builder, 1);
    if (builder->plan->soft.count)
        pt_plan_sift(builder);
    if (builder->plan->light_count) {
        pt_add_passes_step(builder, PT_STEP_PASSES);
        pt_plan_light_steps(builder);
    }
    plan_output(builder, PT_PLANE_COLOR_A);
    plan_soft(builder);
    pt_plan_picture_effects(builder);
    put_together(builder);
    skip_rest(builder, reason, 0);
    pt_add_passes_step(builder, PT_STEP_PASSES);
}

int pt_plan_depth(struct pt_builder *builder)
{
    struct pt_plan *plan = builder->plan;
    plan->map = 1;
    const int error = pt_plan_view(builder->scene, plan);
    if (plan->iterations > MAP_ITERATIONS)
        plan->iterations = MAP_ITERATIONS;
    if (error || !pt_plan_shows(plan))
        return error;
    plan_surfaces(builder);
    plan_covers(builder, 0);
    return builder->failed;
}

int pt_plan_textures(const struct patina_scene *scene, struct pt_plan *plan)
{
    struct pt_builder builder = {.scene = scene, .plan = plan};
    *plan = (struct pt_plan){0};
    pt_plan_lights(scene, plan);
    pt_plan_light_steps(&builder);
    if (builder.failed)
        pt_plan_destroy(plan);
    return builder.failed;
}

int pt_plan_create(const struct patina_scene *scene, struct pt_pool *pool, struct pt_plan *plan)
{
    struct pt_builder builder = {.scene = scene, .plan = plan};
    *plan = (struct pt_plan){.pool = pool, .panorama = scene->camera.panorama_face != 0};
    if (!scene->has_camera)
        return pt_fail(&scene->handle, PATINA_ERROR_ARGUMENT, "the scene has no camera");
    int error = pt_plan_view(scene, plan);
    if (!error && (pt_plan_shows(plan) || plan->soft.part_count) && !no_shadows(scene))
        pt_plan_lights(scene, plan);
    if (!error) {
        if (pt_plan_shows(plan))
            plan_points(&builder);
        else
            plan_nothing(&builder, scene->mesh_count     ? "nothing is in view"
                                   : !scene->cloud_count ? "the scene has no cloud"
                                   : plan->soft.count    ? "everything in view is soft"
                                   : !plan->chunks       ? "the clouds have no points"
                                                         : "no cloud is in view");
        error = builder.failed;
    }
    if (error == PATINA_ERROR_MEMORY)
        pt_fail(&scene->handle, error, "planning the frame: out of memory");
    if (error == PATINA_ERROR_INTERNAL)
        pt_fail_again(&scene->handle, error);
    if (error)
        pt_plan_destroy(plan);
    return error;
}
