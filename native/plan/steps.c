// SPDX-License-Identifier: GPL-3.0-or-later
#include "passes.h"

#include <string.h>

struct pt_step *pt_add_step(struct pt_builder *builder, enum pt_step_of of)
{
    struct pt_plan *plan = builder->plan;
    if (plan->step_count == builder->step_room) {
        struct pt_step *grown = pt_arena_grow(&plan->arena, plan->steps, &builder->step_room, sizeof *grown);
        if (!grown) {
            builder->failed = PATINA_ERROR_MEMORY;
            return &builder->no_step;
        }
        plan->steps = grown;
    }
    struct pt_step *step = &plan->steps[plan->step_count++];
    *step = (struct pt_step){.of = of, .layer = builder->layer};
    return step;
}

uint32_t pt_open_step(struct pt_builder *builder, enum pt_step_of of)
{
    pt_add_step(builder, of);
    return builder->plan->step_count - 1;
}

struct pt_step *pt_step_at(struct pt_builder *builder, uint32_t at)
{
    return builder->failed ? &builder->no_step : &builder->plan->steps[at];
}

void pt_close_step(struct pt_builder *builder, uint32_t at)
{
    pt_step_at(builder, at)->inside = builder->plan->step_count - at - 1;
}

void pt_add_passes_step(struct pt_builder *builder, enum pt_step_of of)
{
    const struct pt_plan *plan = builder->plan;
    const uint32_t first = builder->listed, count = plan->pass_count - first;
    builder->listed = plan->pass_count;
    if (!count)
        return;
    struct pt_step *step = pt_add_step(builder, of);
    step->first = first;
    step->count = count;
    if (of == PT_STEP_MARK)
        PT_REASON(step, "where some light's texture is not at hand");
    else
        PT_REASON(step, "%u passes%s", count, builder->layer ? "" : " of the whole picture");
}

static void add_clear(struct pt_builder *builder, struct pt_ref plane, uint64_t word, uint32_t bytes, const char *reason)
{
    struct pt_step *step = pt_add_step(builder, PT_STEP_CLEAR);
    step->plane = plane;
    step->word = word;
    step->bytes = bytes;
    PT_REASON(step, "%s", reason);
}

static void clear_keys(struct pt_builder *builder, struct pt_ref plane, const char *reason)
{
    add_clear(builder, plane, (uint64_t)PT_KEY_EMPTY_Z << 32 | PT_KEY_EMPTY_ID, 8, reason);
}

// Whether some points lie in a file. Its boxes may be wrong, or it may lose pages: then points appear in pixels that no pass resolves.
static int reads_files(const struct pt_plan *plan)
{
    for (uint32_t i = 0; i < plan->instance_count; i++)
        if (plan->instances[i].instance->cloud->mapped >> PT_ARRAY_POSITIONS & 1u)
            return 1;
    return 0;
}

void pt_plan_clears(struct pt_builder *builder, int shown)
{
    enum { NOWHERE = 0x7FC00000 }; // the bits of a NaN
    struct pt_plan *plan = builder->plan;
    clear_keys(builder, pt_keys_of(builder, 0), "no point is drawn");
    if (pt_plan_shows(plan) && reads_files(plan))
        add_clear(builder, pt_from_of(builder, 0), 0, 4, "a damaged file's points may lie outside their boxes");
    if (plan->mesh.triangles)
        clear_keys(builder, pt_plane_at(PT_PLANE_MESH_KEYS, 0), "no triangle is drawn");
    if (!plan->mesh.triangles || !shown)
        return;
    clear_keys(builder, pt_plane_at(PT_PLANE_MESH_SHOWN, 0), "no mesh is shown");
    if (pt_mesh_pixels_shadowed(plan))
        add_clear(builder, pt_plane_at(PT_PLANE_MESH_PLACES, 0), NOWHERE, 4, "pixels without a mesh lie nowhere");
}

void pt_plan_no_density(struct pt_builder *builder)
{
    add_clear(builder, pt_plane_at(PT_PLANE_DENSITY, 0), 0, 4, "no soft point is counted");
}

void pt_plan_no_veil(struct pt_builder *builder)
{
    clear_keys(builder, pt_plane_at(PT_PLANE_KEYS, 0), "no surface ends the light");
    add_clear(builder, pt_plane_at(PT_PLANE_VEIL, 0), 0, 4, "no soft point takes any");
}

static void nothing_reached(struct pt_builder *builder)
{
    add_clear(builder, pt_plane_at(PT_PLANE_SOFT_REACHED, 0), 0xBF800000u, 4, "no layer is taken"); // -1
}

void pt_plan_peeling(struct pt_builder *builder)
{
    if (builder->plan->soft.part_count)
        nothing_reached(builder);
    if (builder->plan->line_radius > 0.0f)
        add_clear(builder, pt_plane_at(PT_PLANE_OVER, 0), 0, 4, "lines find nothing before them");
    add_clear(builder, pt_plane_at(PT_PLANE_THROUGH, 0), 0x3F800000u, 4,
              "all light comes through, outside the points' rectangle too");
}

// ---- lights --------------------------------------------------------------------------------------------------------------

static void plan_group(struct pt_builder *builder, uint32_t light, uint32_t index)
{
    const struct pt_shadow_group *group = &builder->plan->groups[index];
    const uint32_t faces = pt_open_step(builder, PT_STEP_FACES);
    uint32_t faint = 0;
    PT_REASON(pt_step_at(builder, faces), "one map, or six where the light sees its casters all around");
    if (group->faint) {
        faint = pt_open_step(builder, PT_STEP_FAINT);
        pt_step_at(builder, faint)->most = PT_FAINT_LAYERS;
        pt_step_at(builder, faint)->ends = PT_END_SPENT;
        PT_REASON(pt_step_at(builder, faint), "points of instance %u have opacities of their own", group->only);
    }
    const uint32_t map = pt_open_step(builder, PT_STEP_MAP);
    if (group->soft)
        PT_REASON(pt_step_at(builder, map), "soft points of instance %u", group->only);
    else if (group->only != PT_NO_INSTANCE)
        PT_REASON(pt_step_at(builder, map), "instance %u takes %u of 255 parts of light", group->only, group->loss);
    else if (group->without != PT_NO_INSTANCE)
        PT_REASON(pt_step_at(builder, map), "all opaque casters but instance %u, which must not shadow itself", group->without);
    else
        PT_REASON(pt_step_at(builder, map), "all opaque casters");
    if (group->faint)
        pt_close_step(builder, faint);
    pt_close_step(builder, faces);
    for (uint32_t at = faces; at < builder->plan->step_count && !builder->failed; at++) {
        builder->plan->steps[at].light = light;
        builder->plan->steps[at].group = index;
    }
}

void pt_plan_light_steps(struct pt_builder *builder)
{
    struct pt_plan *plan = builder->plan;
    const patina_settings *settings = &builder->scene->settings;
    const size_t most = 3 * (size_t)builder->scene->cloud_count + 1;
    if (plan->light_count && !plan->groups) {
        if (!(plan->groups = pt_arena_take(&plan->arena, most * sizeof *plan->groups))) {
            builder->failed = PATINA_ERROR_MEMORY;
            return;
        }
        plan->group_count = pt_shadow_groups(builder->scene, plan->groups);
    }
    for (uint32_t i = 0; i < plan->light_count; i++) {
        const uint32_t loop = pt_open_step(builder, PT_STEP_LIGHT);
        struct pt_step *step = pt_step_at(builder, loop);
        step->light = i;
        step->most = plan->lights[i].samples;
        step->ends = step->most > 1 ? PT_END_UNCHANGED : 0;
        step->ends |= step->most > 1 && settings->shadow_error > 0.0f ? PT_END_ERROR_MET : 0;
        PT_REASON(step, "light %u%s", i, builder->layer > 1 ? ", of pixels that show meshes" : "");
        for (uint32_t g = 0; g < plan->group_count; g++)
            plan_group(builder, i, g);
        struct pt_step *end = pt_add_step(builder, PT_STEP_CLOSE);
        end->light = i;
        PT_REASON(end, "of receivers that several maps were tested for");
        pt_close_step(builder, loop);
    }
}
