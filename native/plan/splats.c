// SPDX-License-Identifier: GPL-3.0-or-later
// The passes of discs: visibility, then (with the surfaces known) what the discs on the nearest surface show. SPEC 5, solid.
#include "passes.h"

#include <string.h>

// Where the depth pass tells of surfaces, and not of points. Discs have no mean where surfaces lie close behind each other: that of
// shells 1.5 spacings apart lies 1.2 behind the first.
int pt_tells_surfaces(const struct pt_builder *builder)
{
    const patina_settings *settings = &builder->scene->settings;
    return settings->depth == PATINA_DEPTH_SURFACE && (settings->passes >> PATINA_PASS_DEPTH & 1u) &&
           (builder->plan->filled || (settings->surface == PATINA_SURFACE_SPLATS && !builder->plan->sigmas));
}

int pt_tells_depths(const struct pt_builder *builder)
{
    return builder->layer == 1 && pt_tells_surfaces(builder) && builder->scene->settings.surface == PATINA_SURFACE_SPLATS;
}

// Binds what both kernels read of an instance; `blend` reads colours too.
static uint32_t bind_instance(struct pt_ref *refs, uint32_t i, int blend)
{
    static const enum pt_instance_buffer list[] = {PT_CHUNKS, PT_POSITIONS, PT_SURFACE, PT_RADII, PT_COLORS, PT_OPACITIES};
    const uint32_t count = blend ? 6 : 4;
    for (uint32_t k = 0; k < count; k++)
        refs[k] = pt_buffer_of(list[k], i);
    return count;
}

// Arguments with the discs of every instance in view behind them. behind: of splat, the limit holds.
static void add_discs(struct pt_builder *builder, int blend, const struct pt_ref *planes, uint32_t plane_count, int behind)
{
    struct pt_plan *plan = builder->plan;
    const size_t head = blend ? sizeof(struct blend_args) : sizeof(struct splat_args);
    struct pt_ref *refs = pt_arena_take(&plan->arena, (plane_count + 1 + 6 * (size_t)plan->instance_count) * sizeof *refs);
    char *args = pt_arena_take(&plan->arena, head + plan->instance_count * sizeof(struct disc_args));
    if (!refs || !args) {
        builder->failed = PATINA_ERROR_MEMORY;
        return;
    }
    struct disc_args *discs = (struct disc_args *)(void *)(args + head);
    uint64_t points = 0, chunks = 0;
    uint32_t instances = 0, count = plane_count;
    memcpy(refs, planes, plane_count * sizeof *planes);
    refs[count++] = plan->drawn_words ? pt_buffer_of(PT_DRAWN, 0) : pt_nothing();
    for (uint32_t i = 0; i < plan->instance_count; i++) {
        const struct pt_plan_instance *instance = &plan->instances[i];
        const struct patina_cloud *cloud = instance->instance->cloud;
        if (!instance->chunk_count || !instance->discs)
            continue;
        discs[instances++] = (struct disc_args){.instance = instance->args,
                                                .has_radii = cloud->info.has_radii ? PT_RADII_FLOATS
                                                             : cloud->shapes       ? PT_RADII_SHAPES
                                                                                   : PT_RADII_NONE,
                                                .radius = instance->radius,
                                                .radius_scale = instance->radius_scale,
                                                .radius_most = instance->radius_most,
                                                .surface_scale = instance->surface_scale};
        chunks += instance->chunk_count;
        points += instance->points;
        count += bind_instance(refs + count, i, blend);
    }
    struct splat_args splat = {
        .view = plan->view, .instances = instances, .behind = (uint32_t)behind, .sifted = plan->drawn_words > 0};
    struct blend_args mix = {.view = plan->view,
                             .instances = instances,
                             .sifted = plan->drawn_words > 0,
                             .depths = (uint32_t)pt_tells_depths(builder)};
    memcpy(args, blend ? (void *)&mix : (void *)&splat, head);
    struct pt_pass *pass = pt_add(builder, blend ? PT_KERNEL_blend : PT_KERNEL_splat, blend ? "blend" : "splat", args,
                                  head + instances * sizeof *discs, refs, count);
    if (blend)
        PT_REASON(pass, "discs within a layer distance of the nearest, %u instances", instances);
    else if (behind && builder->layer <= 1)
        PT_REASON(pass, "discs behind what is drawn already, %u instances", instances);
    else if (behind)
        PT_REASON(pass, "layer %u: discs behind layer %u in unfinished pixels", builder->layer, builder->layer - 1);
    else
        PT_REASON(pass, "%llu points in %llu chunks of %u instances are in view, as discs", (unsigned long long)points,
                  (unsigned long long)chunks, instances);
}

void pt_plan_splat(struct pt_builder *builder)
{
    const int behind = builder->layer > 1 || builder->behind;
    const struct pt_ref planes[] = {pt_keys_of(builder, 0), pt_plane_if(behind, PT_PLANE_LIMIT, 0)};
    add_discs(builder, 0, planes, 2, behind);
}

void pt_plan_blend(struct pt_builder *builder)
{
    const struct pt_ref planes[] = {pt_keys_of(builder, 0),          pt_plane_at(PT_PLANE_DEFF, 0),
                                    pt_plane_at(PT_PLANE_NORMAL, 0), pt_plane_at(PT_PLANE_ALBEDO, 0),
                                    pt_plane_at(PT_PLANE_AWAY, 0),   pt_plane_if(pt_tells_depths(builder), PT_PLANE_OFFSET, 0)};
    add_discs(builder, 1, planes, 6, 0);
}
