// SPDX-License-Identifier: GPL-3.0-or-later
#include "lines.h"
#include "shared/picture.h"

#include <math.h>
#include <string.h>

// ---- how wide ------------------------------------------------------------------------------------------------------------

struct depths {
    double axes[9], position[3], nearest, farthest;
};

static void look_at(void *context, const double corner[3])
{
    struct depths *depths = context;
    double from_eye[3];
    for (int k = 0; k < 3; k++)
        from_eye[k] = corner[k] - depths->position[k];
    double z = -pt_dot(depths->axes + 6, from_eye);
    depths->nearest = fmin(depths->nearest, z);
    depths->farthest = fmax(depths->farthest, z);
}

// Least and greatest z of all boxes, whatever of them is in view: a region decides as the whole picture does.
static void find_depths(const struct patina_scene *scene, double *nearest, double *farthest)
{
    const patina_camera *camera = &scene->camera;
    struct depths depths = {.nearest = INFINITY, .farthest = -INFINITY};
    const double from = camera->orthographic ? camera->near_clip : 0.0, least = camera->orthographic ? 0.0 : camera->near_clip;
    pt_camera_axes(camera, depths.axes, depths.position);
    pt_each_corner(scene, look_at, &depths);
    *nearest = isfinite(depths.nearest) ? fmax(depths.nearest - from, least) : least;
    *farthest = fmax(depths.farthest - from, *nearest);
}

float pt_line_radius(const struct patina_scene *scene)
{
    double width = (double)scene->lines.width, nearest, farthest;
    if (!scene->has_lines)
        return 0.0f;
    if (scene->lines.world) {
        width /= pt_pixel_width(scene);
        find_depths(scene, &nearest, &farthest);
        if (!scene->camera.orthographic)
            width /= nearest;
    }
    return (float)fmin(width, PT_LINE_MOST);
}

// Pixels nearer than the radius and a half; one at least, for the edges.
static uint32_t tap_reach(float radius) { return radius <= 0.5f ? 1 : (uint32_t)ceil((double)radius + 0.5) - 1; }

uint32_t pt_line_reach(const struct pt_plan *plan) { return plan->line_radius > 0.0f ? tap_reach(plan->line_radius) + 3 : 0; }

// ---- planes and rectangles -----------------------------------------------------------------------------------------------

struct pt_ref pt_line_of(const struct pt_builder *builder)
{
    return pt_plane_at(builder->layer > 1 ? PT_PLANE_LINE_BEHIND : PT_PLANE_LINE, 0);
}

static struct pt_ref nearest_of(const struct pt_builder *builder)
{
    return pt_plane_at(builder->layer > 1 ? PT_PLANE_NEAREST_BEHIND : PT_PLANE_NEAREST, 0);
}

// The rectangle, wider by a margin, within the planes.
static void widen(const struct pt_plan *plan, uint32_t rect[4], uint32_t margin)
{
    const uint32_t size[2] = {plan->view.width, plan->view.height};
    for (int k = 0; k < 2; k++) {
        rect[k] = rect[k] > margin ? rect[k] - margin : 0;
        rect[2 + k] = rect[2 + k] + margin < size[k] ? rect[2 + k] + margin : size[k];
    }
}

// Layers that are peeled keep colours with alpha: surfaces that are not shown are clear. Others are blanked at the end.
static int is_clear(const struct pt_plan *plan) { return plan->layers > 1 || plan->transparent; }

// ---- ink -------------------------------------------------------------------------------------------------------------------

// args: what is to be done; targets: of colours, of z and of shares.
static void add_ink(struct pt_builder *builder, const struct ink_args *args, struct pt_ref colors,
                    const struct pt_ref targets[3])
{
    static const char *const sources[] = {"one colour", "the points' colours", "colours by depth"};
    PT_REASON(
        PT_ADD(builder, ink, *args,
               {pt_keys_of(builder, 0), pt_line_of(builder), nearest_of(builder), colors, targets[0], targets[1], targets[2]}),
        "lines in %s%s%s%s", sources[args->source], args->behind ? ", behind the layers before" : "",
        args->depth ? ", with their depth" : "", args->mask ? ", and as a pass" : "");
}

// Lines of the layer at hand: a pass, or one for each instance whose points give their colours.
static void plan_ink(struct pt_builder *builder, struct ink_args args, const struct pt_ref targets[3])
{
    const struct pt_plan *plan = builder->plan;
    const patina_lines *lines = &builder->scene->lines;
    double nearest = (double)lines->range[0], farthest = (double)lines->range[1];
    const int of_points = lines->source == PATINA_LINE_POINT && args.color_target;
    args.view = plan->view;
    args.source = lines->source;
    args.opacity = 1.0f - lines->transparency;
    memcpy(args.color, lines->color, sizeof args.color);
    memcpy(args.far_color, lines->far_color, sizeof args.far_color);
    if (!(farthest > nearest))
        find_depths(builder->scene, &nearest, &farthest);
    args.start = (float)nearest;
    args.scale = farthest > nearest ? (float)(1.0 / (farthest - nearest)) : 0.0f;
    widen(plan, args.view.rect, pt_line_reach(plan));
    struct ink_args all = args;
    all.instance.id_count = 0xFFFFFFFFu; // everyone's
    if (of_points)
        all.color_target = all.depth = 0;
    if (all.color_target || all.depth || all.mask || all.blank)
        add_ink(builder, &all, pt_nothing(), targets);
    args.blank = args.mask = 0;
    for (uint32_t i = 0; i < plan->instance_count && of_points; i++) {
        const struct pt_plan_instance *instance = &plan->instances[i];
        if (!instance->chunk_count)
            continue;
        args.view = pt_view_of(plan, instance, ((plan->iterations + 2) << plan->levels) + pt_line_reach(plan));
        for (int k = 0; k < 2; k++) { // nothing says beyond it where lines are
            args.view.rect[k] = args.view.rect[k] > all.view.rect[k] ? args.view.rect[k] : all.view.rect[k];
            args.view.rect[2 + k] = args.view.rect[2 + k] < all.view.rect[2 + k] ? args.view.rect[2 + k] : all.view.rect[2 + k];
        }
        args.instance = instance->args;
        add_ink(builder, &args, pt_buffer_of(PT_COLORS, i), targets);
    }
    if (of_points && plan->mesh.triangles) { // behind the points' ids; in white
        args.view = all.view;
        args.instance = (struct instance_args){.id_base = (uint32_t)plan->ids.points,
                                               .id_count = (uint32_t)builder->scene->triangles,
                                               .color = {1.0f, 1.0f, 1.0f}};
        add_ink(builder, &args, pt_nothing(), targets);
    }
}

static struct ink_args over_crop(const struct pt_plan *plan)
{
    return (struct ink_args){
        .crop_x = plan->crop[0], .crop_y = plan->crop[1], .crop_width = plan->crop[2], .crop_height = plan->crop[3]};
}

void pt_plan_ink_layer(struct pt_builder *builder, enum pt_plane color, enum pt_plane depth)
{
    struct ink_args args = over_crop(builder->plan);
    args.color_target = color != PT_PLANE_COUNT;
    args.depth = depth != PT_PLANE_COUNT;
    if (!(builder->plan->line_radius > 0.0f) || !(args.color_target || args.depth))
        return;
    const uint32_t slot = builder->layer - 1;
    plan_ink(builder, args,
             (struct pt_ref[]){pt_plane_if(args.color_target != 0, color, slot), pt_plane_if(args.depth != 0, depth, slot),
                               pt_nothing()});
}

void pt_plan_ink(struct pt_builder *builder, const float background[4])
{
    const struct pt_plan *plan = builder->plan;
    const uint32_t passes = builder->scene->settings.passes;
    struct ink_args args = over_crop(plan);
    if (!(plan->line_radius > 0.0f))
        return;
    args.color_target = plan->layers == 1;
    args.depth = passes >> PATINA_PASS_DEPTH & 1u;
    args.mask = passes >> PATINA_PASS_LINE & 1u;
    args.blank = args.color_target && builder->scene->lines.surface == PATINA_LINE_SURFACE_NONE && !is_clear(plan);
    memcpy(args.background, background, sizeof args.background);
    if (args.color_target || args.depth || args.mask)
        plan_ink(builder, args,
                 (struct pt_ref[]){pt_plane_if(args.color_target || args.blank, PT_PLANE_COMBINED, 0),
                                   pt_plane_if(args.depth != 0, PT_PLANE_DEPTH, 0),
                                   pt_plane_if(args.mask != 0, PT_PLANE_LINES, 0)});
}

// ---- lines ---------------------------------------------------------------------------------------------------------------

void pt_line_taps(struct lines_args *args)
{
    const double beyond = (double)args->most + 0.5;
    const int reach = (int)(args->reach = tap_reach(args->most));
    args->tap_count = 0;
    for (int square = 1; (double)square < beyond * beyond; square++)
        for (int y = -reach; y <= reach; y++) {
            int rest = square - y * y, x = (int)sqrt((double)(rest > 0 ? rest : 0));
            const uint32_t place = (uint32_t)(y + 128) << 8 | (uint32_t)square << 16;
            if (x * x != rest)
                continue;
            if (x)
                args->taps[args->tap_count++] = (uint32_t)(128 - x) | place;
            args->taps[args->tap_count++] = (uint32_t)(128 + x) | place;
        }
}

void pt_plan_lines(struct pt_builder *builder)
{
    const struct pt_plan *plan = builder->plan;
    const patina_lines *lines = &builder->scene->lines;
    if (!(plan->line_radius > 0.0f)) {
        pt_skip(builder, "lines", "no lines are asked for");
        pt_skip(builder, "ink", "no lines are asked for");
        return;
    }
    struct lines_args args = {.view = plan->view,
                              .width = lines->width,
                              .world = lines->world && plan->view.perspective,
                              .most = plan->line_radius,
                              .offset = lines->offset,
                              .soft = lines->soft,
                              .antialias = builder->scene->settings.antialias != PATINA_ANTIALIAS_OFF,
                              .behind = builder->layer > 1};
    widen(plan, args.view.rect, pt_line_reach(plan));
    pt_line_taps(&args);
    const struct pt_ref refs[] = {pt_keys_of(builder, 0),
                                  pt_from_of(builder, 0),
                                  pt_plane_at(PT_PLANE_NORMAL, 0),
                                  pt_span_of(builder->plan),
                                  pt_line_of(builder),
                                  nearest_of(builder),
                                  pt_plane_if(args.behind != 0, PT_PLANE_LIMIT, 0),
                                  pt_plane_if(args.behind != 0, PT_PLANE_THROUGH, 0)};
    PT_REASON(pt_add(builder, PT_KERNEL_lines, "lines", &args, sizeof args, refs, sizeof refs / sizeof *refs),
              "silhouettes of layer %u, at most %.2f pixels wide", builder->layer, (double)plan->line_radius);
    if (plan->layers > 1) {
        const struct pt_ref over = pt_plane_at(PT_PLANE_OVER, 0);
        plan_ink(
            builder,
            (struct ink_args){.behind = 1, .color_target = 1, .crop_width = plan->view.width, .crop_height = plan->view.height},
            (struct pt_ref[]){over, pt_nothing(), pt_nothing()});
    }
}

// ---- surfaces under lines --------------------------------------------------------------------------------------------------

int pt_line_surface(const struct pt_builder *builder, struct instance_args *instance)
{
    const patina_lines *lines = &builder->scene->lines;
    if (!(builder->plan->line_radius > 0.0f) || lines->surface == PATINA_LINE_SURFACE_SHOWN)
        return 1;
    instance->color_format = instance->lit = 0;
    memcpy(instance->color, lines->paper, sizeof instance->color);
    if (lines->surface == PATINA_LINE_SURFACE_NONE && is_clear(builder->plan)) {
        instance->opacity = 0.0f;
        instance->has_opacities = 0;
    }
    return 0;
}
