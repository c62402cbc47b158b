// SPDX-License-Identifier: GPL-3.0-or-later
// The passes of discs: visibility, then (with the surfaces known) what the discs on the nearest surface show, and once shadows are known
// what light arrives at them. SPEC 5, solid.
#include "passes.h"
#include "shared/measured.h"
#include "shared/points.h"

#include <math.h>
#include <string.h>

// Where the depth pass tells of surfaces, and not of points. Discs have no mean where surfaces lie close behind each other: that of
// shells 1.5 spacings apart lies 1.2 behind the first.
int pt_tells_surfaces(const struct pt_builder *builder)
{
    const patina_settings *settings = &builder->scene->settings;
    return builder->plan->points_scattered && settings->depth == PATINA_DEPTH_SURFACE &&
           (settings->passes >> PATINA_PASS_DEPTH & 1u) &&
           (builder->plan->filled || (settings->surface == PATINA_SURFACE_SPLATS && !builder->plan->sigmas));
}

// And discs, in the mean, tell how far off it is.
static int tells_depths(const struct pt_builder *builder)
{
    return builder->layer == 1 && pt_tells_surfaces(builder) && builder->scene->settings.surface == PATINA_SURFACE_SPLATS;
}

int pt_blends_light(const struct pt_builder *builder)
{
    const struct pt_plan *plan = builder->plan;
    return pt_plan_draws(plan, PT_AS_DISCS) && // range images have words of the nearest point
           builder->scene->settings.surface == PATINA_SURFACE_SPLATS && plan->light_count &&
           (uint64_t)plan->view.width * plan->view.height * plan->light_count <= UINT32_MAX; // else words of the nearest disc's
}

// Binds what both kernels read of an instance; `blend`, if there is one, reads colours too, or marks or shadows.
static uint32_t bind_instance(struct pt_ref *refs, const struct pt_builder *builder, uint32_t i, const struct blend_args *blend)
{
    const struct pt_plan *plan = builder->plan;
    uint32_t count = pt_bind_kind(PT_AS_DISCS, i, refs);
    if (!blend)
        return count;
    refs[count++] = blend->part == PT_BLEND_COLORS  ? pt_buffer_of(PT_COLORS, i)
                    : blend->part == PT_BLEND_MARKS ? pt_buffer_of(PT_MARKS, plan->instances[i].of)
                                                    : pt_buffer_of(PT_SHADOWS, plan->instances[i].of);
    refs[count++] = pt_buffer_of(PT_OPACITIES, i);
    refs[count++] = blend->part == PT_BLEND_LIGHT ? pt_marks_of(builder, plan->instances[i].of) : pt_nothing();
    return count;
}

// What a pass of discs is made of.
struct disc_pass {
    struct pt_ref *refs; // the planes, then each instance's
    char *args;          // the head, and a struct disc_args an instance behind it
    size_t arg_size;
    uint32_t ref_count, instances;
    uint64_t points, chunks;
};

// Every instance in view, behind a head of `head` bytes that is still to be written; blend: NULL for splat. 0: memory lacks.
static int list_discs(struct pt_builder *builder, const struct blend_args *blend, size_t head, const struct pt_ref *planes,
                      uint32_t plane_count, struct disc_pass *out)
{
    struct pt_plan *plan = builder->plan;
    *out = (struct disc_pass){
        .refs = pt_arena_take(&plan->arena, (plane_count + 1 + 7 * (size_t)plan->instance_count) * sizeof *out->refs),
        .args = pt_arena_take(&plan->arena, head + plan->instance_count * sizeof(struct disc_args)),
        .ref_count = plane_count};
    if (!out->refs || !out->args) {
        builder->failed = PATINA_ERROR_MEMORY;
        return 0;
    }
    struct disc_args *discs = (struct disc_args *)(void *)(out->args + head);
    memcpy(out->refs, planes, plane_count * sizeof *planes);
    out->refs[out->ref_count++] = plan->drawn_words ? pt_buffer_of(PT_DRAWN, 0) : pt_nothing();
    for (uint32_t i = 0; i < plan->instance_count; i++) {
        const struct pt_plan_instance *instance = &plan->instances[i];
        const struct patina_cloud *cloud = instance->instance->cloud;
        if (!pt_draws(instance, PT_AS_DISCS))
            continue;
        discs[out->instances++] = (struct disc_args){.instance = instance->args,
                                                     .has_radii = cloud->info.has_radii ? PT_RADII_FLOATS
                                                                  : cloud->shapes       ? PT_RADII_SHAPES
                                                                                        : PT_RADII_NONE,
                                                     .radius = instance->as.discs.radius,
                                                     .radius_scale = instance->as.discs.radius_scale,
                                                     .radius_most = instance->as.discs.radius_most,
                                                     .surface_scale = instance->as.discs.surface_scale,
                                                     .shadowed = (uint32_t)pt_receives(instance->instance)};
        out->chunks += instance->chunk_count;
        out->points += instance->points;
        out->ref_count += bind_instance(out->refs + out->ref_count, builder, i, blend);
    }
    out->arg_size = head + out->instances * sizeof *discs;
    return 1;
}

// Discs behind each other that are one surface, where layers are told apart. Without normals discs face the picture: along a slope
// of s they lie up to s radii before and behind it, 2 radii / |n.v| in all. In its own pixel a disc that its centre's ray misses
// lies where its point does: of a slope, up to 0.71 pixels before it or behind.
#define DISC_PIXELS 1.5f
#define DISC_RADII 2.3f // classes of spacings are 1.19 wide: others' discs may be as much wider

void pt_join_discs(const struct pt_plan_instance *instance, struct resolve_args *args)
{
    const float radius = instance->as.discs.radius;
    args->view.footprint *= DISC_PIXELS;
    if (args->instance.has_normals)
        return;
    args->instance.d_min = fmaxf(args->instance.d_min, DISC_RADII * radius); // 0: of as many spacings
    for (uint32_t k = 0; k < PT_SPACINGS && !(radius > 0.0f); k++)
        args->instance.spacing[k] *= DISC_RADII * PT_DISC_SPACINGS / PT_SPACING_FACTOR;
}

void pt_plan_splat(struct pt_builder *builder)
{
    const struct pt_plan *plan = builder->plan;
    const int behind = builder->layer > 1 || builder->behind;
    const struct pt_ref planes[] = {pt_keys_of(builder, 0), pt_plane_if(behind, PT_PLANE_LIMIT, 0),
                                    pt_plane_at(PT_PLANE_DISC_BINS, 0)};
    struct disc_pass discs;
    if (!pt_plan_draws(plan, PT_AS_DISCS)) {
        const int points = pt_plan_draws(plan, PT_AS_POINTS);
        const char *reason = plan->ranges.cells && !points                             ? "all clouds in view are range images"
                             : builder->scene->settings.surface == PATINA_SURFACE_FILL ? "the settings ask for filling"
                             : plan->discs.count ? "no footprint in view is wide enough for a disc"
                                                 : "no cloud in view was analysed";
        pt_skip(builder, "splat", reason);
        pt_skip(builder, "blend", reason);
        return;
    }
    if (!list_discs(builder, NULL, sizeof(struct splat_args), planes, sizeof planes / sizeof *planes, &discs))
        return;
    const struct splat_args args = {
        .view = plan->view, .instances = discs.instances, .behind = (uint32_t)behind, .sifted = plan->drawn_words > 0};
    memcpy(discs.args, &args, sizeof args);
    struct pt_pass *pass = pt_add(builder, PT_KERNEL_splat, "splat", discs.args, discs.arg_size, discs.refs, discs.ref_count);
    if (behind && builder->layer <= 1)
        PT_REASON(pass, "discs behind what is drawn already, %u instances", discs.instances);
    else if (behind)
        PT_REASON(pass, "layer %u: discs behind layer %u in unfinished pixels", builder->layer, builder->layer - 1);
    else
        PT_REASON(pass, "%llu points in %llu chunks of %u instances are in view, as discs", (unsigned long long)discs.points,
                  (unsigned long long)discs.chunks, discs.instances);
}

enum { BLENDED = 6 }; // planes of pixels

// args: but for view, instances and sifted. NULL: the plan failed.
static struct pt_pass *add_blend(struct pt_builder *builder, struct blend_args args, const struct pt_ref of_pixels[BLENDED])
{
    struct disc_pass discs;
    struct pt_ref planes[BLENDED + 1];
    memcpy(planes, of_pixels, BLENDED * sizeof *planes);
    planes[BLENDED] = pt_plane_at(PT_PLANE_DISC_BINS, 0);
    if (!list_discs(builder, &args, sizeof args, planes, BLENDED + 1, &discs))
        return NULL;
    args.view = builder->plan->view;
    args.instances = discs.instances;
    args.sifted = builder->plan->drawn_words > 0;
    memcpy(discs.args, &args, sizeof args);
    struct pt_pass *pass = pt_add(builder, PT_KERNEL_blend, "blend", discs.args, discs.arg_size, discs.refs, discs.ref_count);
    PT_REASON(pass, "discs within a layer distance of the nearest, %u instances", discs.instances);
    return pass;
}

void pt_plan_blend(struct pt_builder *builder)
{
    if (!pt_plan_draws(builder->plan, PT_AS_DISCS))
        return;
    const int depths = tells_depths(builder);
    const struct pt_ref planes[] = {pt_keys_of(builder, 0),          pt_plane_at(PT_PLANE_DEFF, 0),
                                    pt_plane_at(PT_PLANE_NORMAL, 0), pt_plane_at(PT_PLANE_ALBEDO, 0),
                                    pt_plane_at(PT_PLANE_AWAY, 0),   pt_plane_if(depths, PT_PLANE_OFFSET, 0)};
    add_blend(builder, (struct blend_args){.depths = (uint32_t)depths}, planes);
}

void pt_plan_blend_marks(struct pt_builder *builder)
{
    const struct pt_ref none = pt_nothing(),
                        planes[BLENDED] = {pt_keys_of(builder, 0), pt_plane_at(PT_PLANE_DEFF, 0), none, none, none, none};
    struct pt_pass *pass = add_blend(builder, (struct blend_args){.part = PT_BLEND_MARKS}, planes);
    if (pass)
        PT_REASON(pass, "only points whose discs the picture shows need shadows");
}

void pt_plan_blend_light(struct pt_builder *builder)
{
    const uint32_t casting = builder->plan->light_count;
    const struct pt_ref none = pt_nothing(), light = pt_plane_at(PT_PLANE_LIGHT, 0);
    const struct pt_ref planes[BLENDED] = {pt_keys_of(builder, 0), pt_plane_at(PT_PLANE_DEFF, 0), none, light, none, none};
    for (uint32_t first = 0; first < casting; first += PT_BLEND_LIGHTS) {
        const uint32_t left = casting - first, lights = left < PT_BLEND_LIGHTS ? left : PT_BLEND_LIGHTS;
        const struct blend_args args = {.part = PT_BLEND_LIGHT, .first = first, .lights = lights};
        struct pt_pass *pass = add_blend(builder, args, planes);
        if (!pass)
            return;
        pass->late = PT_LATE_POINTS;
        PT_REASON(pass, "what arrives at the same discs of %u lights from light %u on", lights, first);
    }
}
