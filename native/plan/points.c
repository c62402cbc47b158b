// SPDX-License-Identifier: GPL-3.0-or-later
// The passes of points that are pixels, and of what the pixels of points and discs show: normals, layer distances, depths.
#include "passes.h"
#include "shared/measured.h"
#include "shared/points.h"

#include <math.h>

// Radius of the window for image-space normals: two spacings, at least 3 pixels so that a point's place within its pixel
// averages out, at most 16 (beyond, points are too far apart on screen for a surface to be seen anyway). Pixels take less of it
// where points lie nearer together, PT_ESTIMATE_LEAST at least.
enum { ESTIMATE_LEAST = 3, ESTIMATE_MOST = PT_REACH_normals };

void pt_plan_points(struct pt_builder *builder)
{
    struct pt_plan *plan = builder->plan;
    if (!pt_plan_draws(plan, PT_AS_POINTS)) {
        if (!plan->ranges.cells)
            pt_skip(builder, "scatter",
                    builder->scene->settings.surface == PATINA_SURFACE_SPLATS
                        ? "the settings ask for discs"
                        : "all footprints in view are wide enough for discs");
        return;
    }
    struct scatter_args args = {
        .view = plan->view, .behind = builder->layer > 1 || builder->behind, .sifted = plan->drawn_words > 0};
    struct pt_ref *refs = pt_arena_take(&plan->arena, (3 + PT_KIND_BUFFERS * (size_t)plan->instance_count) * sizeof *refs);
    uint64_t points = 0, chunks = 0;
    uint32_t count = 0;
    if (!refs) {
        builder->failed = PATINA_ERROR_MEMORY;
        return;
    }
    refs[count++] = pt_keys_of(builder, 0);
    refs[count++] = pt_plane_if(args.behind != 0, PT_PLANE_LIMIT, 0);
    refs[count++] = args.sifted ? pt_buffer_of(PT_DRAWN, 0) : pt_nothing();
    for (uint32_t i = 0; i < plan->instance_count; i++) {
        if (!pt_draws(&plan->instances[i], PT_AS_POINTS))
            continue;
        count += pt_bind_kind(PT_AS_POINTS, i, refs + count);
        args.instances++;
        chunks += plan->instances[i].chunk_count;
        points += plan->instances[i].points;
    }
    struct pt_pass *pass = pt_add(builder, PT_KERNEL_scatter, "scatter", &args, sizeof args, refs, count);
    if (builder->layer > 1)
        PT_REASON(pass, "layer %u: what lies behind layer %u in unfinished pixels", builder->layer, builder->layer - 1);
    else if (builder->again)
        PT_REASON(pass, "points behind what is drawn already, %u instances", args.instances);
    else
        PT_REASON(pass, "%llu points in %llu chunks of %u instances are in view", (unsigned long long)points,
                  (unsigned long long)chunks, args.instances);
}

static void plan_center(struct pt_builder *builder, uint32_t i)
{
    const struct center_args args = {.view = builder->plan->view};
    PT_REASON(PT_ADD(builder, center, args,
                     {pt_keys_of(builder, 0), pt_plane_at(PT_PLANE_NORMAL, 0), pt_span_of(builder->plan),
                      pt_plane_at(PT_PLANE_OFFSET, 0), pt_buffer_of(PT_CHUNKS, i), pt_buffer_of(PT_POSITIONS, i)}),
              "depth of instance %u's surface in the middle of each pixel", i);
}

void pt_plan_resolve(struct pt_builder *builder, uint32_t i)
{
    struct pt_plan *plan = builder->plan;
    const struct pt_plan_instance *instance = &plan->instances[i];
    if (!instance->args.has_normals) {
        double wanted = ceil(2.0 * plan->spacing_px);
        struct normals_args args = {.view = pt_view_of(plan, instance, 0), .instance = instance->args};
        args.radius = wanted < ESTIMATE_LEAST ? ESTIMATE_LEAST : wanted > ESTIMATE_MOST ? ESTIMATE_MOST : (uint32_t)wanted;
        args.steep = !builder->layer;
        PT_REASON(PT_ADD(builder, normals, args,
                         {pt_keys_of(builder, 0), pt_buffer_of(PT_SURFELS, i), pt_plane_at(PT_PLANE_NORMAL, 0)}),
                  "instance %u has no normals: estimated from the depth of at most %u x %u pixels", i, 2 * args.radius + 1,
                  2 * args.radius + 1);
    }
    const int thick = pt_has_sigmas(plan, instance);
    struct resolve_args args = {.view = pt_view_of(plan, instance, 0),
                                .instance = instance->args,
                                .sigma_scale = thick ? pt_sigma_scale(instance) : 0.0f,
                                .with_span = plan->sigmas != 0};
    if (instance->kind == PT_AS_DISCS && plan->layers > 1)
        pt_join_discs(instance, &args);
    PT_REASON(PT_ADD(builder, resolve, args,
                     {pt_keys_of(builder, 0), pt_buffer_of(PT_SURFELS, i), pt_plane_at(PT_PLANE_NORMAL, 0),
                      pt_plane_at(PT_PLANE_DEFF, 0), pt_from_of(builder, 0), thick ? pt_shapes_of(instance, i) : pt_nothing(),
                      pt_plane_if(plan->sigmas, PT_PLANE_SPAN, 0)}),
              "layer distance%s and normal of instance %u's pixels", thick ? " by sigma" : "", i);
    if (builder->layer == 1 && pt_tells_surfaces(builder) && instance->kind == PT_AS_POINTS)
        plan_center(builder, i);
}

void pt_plan_resolved(struct pt_builder *builder)
{
    const struct pt_plan *plan = builder->plan;
    const int some = pt_plan_draws(plan, PT_AS_POINTS) || pt_plan_draws(plan, PT_AS_DISCS);
    if (!pt_tells_surfaces(builder) || !plan->filled)
        pt_skip(builder, "center",
                !plan->filled ? "discs have the depth of their surface" : "the depth asked for is the points'");
    if (!pt_has_pass(plan, PT_KERNEL_normals))
        pt_skip(builder, "normals", some ? "every cloud in view has normals" : "range images have those of their cells");
    if (!some)
        pt_skip(builder, "resolve", "range images tell normals and layer distances themselves");
}
