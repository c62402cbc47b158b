// SPDX-License-Identifier: GPL-3.0-or-later
// The passes that take back what was closed where a station looked through: what shows there is drawn a second time behind it, and
// what closes it once more becomes what was measured. Planned only where a cloud's free space is asked for.
#include "passes.h"
#include "shared/filling.h"

#include <math.h>
#include <string.h>

// Whether the instance's stations are known, and asked in this way.
static int asks(const struct pt_instance *instance, uint32_t free_space)
{
    const int shown = free_space != PATINA_FREE_SPACE_SHOW || instance->style.color_source == PATINA_COLOR_OWN;
    return shown && instance->style.free_space == free_space && instance->cloud->sights.count > 0;
}

uint32_t pt_reopen_rounds(const struct patina_scene *scene, const struct pt_plan *plan)
{
    uint32_t asked = 0;
    for (uint32_t i = 0; i < scene->cloud_count; i++)
        asked |= asks(&scene->instances[i], PATINA_FREE_SPACE_USE);
    return asked && !plan->map && plan->layers == 1 ? 2 : 0; // behind what is open nothing is peeled
}

// The camera as the instance's object has it: rows of its turn, and where it stands. 0 where the object is flat.
static int look_from_object(const struct pt_builder *builder, const struct pt_instance *instance, double rows[9], double eye[3])
{
    double axes[9], position[3], linear[9], translation[3], inverse[9], offset[3], size = 0.0;
    pt_camera_axes(&builder->scene->camera, axes, position);
    pt_split_matrix(instance->style.world_from_object, linear, translation);
    const double determinant = pt_invert(linear, inverse);
    for (int k = 0; k < 9; k++)
        size = fmax(size, fabs(linear[k]));
    if (!(fabs(determinant) > 1e-14 * size * size * size) || !isfinite(determinant))
        return 0;
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) // view to world: the axes' transpose
            rows[3 * r + c] = pt_dot(inverse + 3 * r, axes + 3 * c);
    for (int k = 0; k < 3; k++)
        offset[k] = position[k] - translation[k];
    pt_apply(inverse, offset, eye);
    return 1;
}

// Arguments with the instance's stations behind them; NULL where nothing can be asked.
static struct reopen_args *arguments_of(struct pt_builder *builder, uint32_t i, uint32_t phase, size_t *size)
{
    const struct pt_plan *plan = builder->plan;
    const struct pt_plan_instance *instance = &plan->instances[i];
    const struct pt_sights *sights = &instance->instance->cloud->sights;
    double rows[9], eye[3];
    if (!look_from_object(builder, instance->instance, rows, eye))
        return NULL;
    *size = sizeof(struct reopen_args) + sights->count * sizeof(struct station_args);
    struct reopen_args *args = pt_arena_take(&builder->plan->arena, *size);
    if (!args) {
        builder->failed = PATINA_ERROR_MEMORY;
        return NULL;
    }
    struct station_args *stations = (struct station_args *)(args + 1);
    *args = (struct reopen_args){.view = plan->view,
                                 .id_base = instance->args.id_base,
                                 .id_first = instance->args.id_first,
                                 .id_count = instance->args.id_count,
                                 .phase = phase,
                                 .discs = (uint32_t)pt_kinds[instance->kind].in_planes,
                                 .stations = sights->count,
                                 .eye_z = pt_eye_z(builder->scene)};
    for (int k = 0; k < 9; k++)
        args->rows[k] = (float)rows[k];
    for (uint32_t s = 0; s < sights->count; s++) {
        const struct pt_sight *sight = &sights->each[s];
        const float grow = 1.0f + sight->share;
        stations[s] = (struct station_args){
            .grow = grow * grow, .first = sight->first, .across = sight->across, .base = sight->base};
        for (int k = 0; k < 3; k++) // float64 until here: the difference is small where both are far from the origin
            stations[s].eye[k] = (float)(eye[k] - sight->place[k]);
    }
    return args;
}

static void add_pass(struct pt_builder *builder, uint32_t i, const struct reopen_args *args, size_t size, enum pt_plane color)
{
    const uint32_t phase = args->phase;
    const int keeps = phase == PT_REOPEN_KEEP || phase == PT_REOPEN_TAKE;
    const struct pt_ref refs[] = {pt_keys_of(builder, 0),
                                  pt_from_of(builder, 0),
                                  pt_plane_at(PT_PLANE_DEFF, 0),
                                  pt_plane_if(args->discs != 0, PT_PLANE_AWAY, 0),
                                  phase == PT_REOPEN_KEEP ? pt_nothing() : pt_buffer_of(PT_SIGHTS, i),
                                  pt_plane_if(phase == PT_REOPEN_FIND, PT_PLANE_LIMIT, 0),
                                  pt_plane_if(keeps, PT_PLANE_KEYS_KEPT, 0),
                                  pt_plane_if(phase == PT_REOPEN_SHOW, color, 0)};
    struct pt_pass *pass = pt_add(builder, PT_KERNEL_reopen, "reopen", args, size, refs, sizeof refs / sizeof *refs);
    if (phase == PT_REOPEN_KEEP)
        PT_REASON(pass, "what was measured, before it is filled");
    else
        PT_REASON(pass, "instance %u: %s where one of %u stations looked through", i,
                  phase == PT_REOPEN_FIND   ? "what was closed is drawn again behind,"
                  : phase == PT_REOPEN_SHOW ? "what was closed is shown in magenta,"
                                            : "what was closed is open again,",
                  args->stations);
}

// A pass for every instance in view that asks so. Returns whether there are any.
static int add_passes(struct pt_builder *builder, uint32_t free_space, uint32_t phase, enum pt_plane color)
{
    const struct pt_plan *plan = builder->plan;
    struct reopen_args *args = NULL;
    uint32_t before = 0;
    size_t size, sizes = 0;
    int added = 0;
    for (uint32_t i = 0; i < plan->instance_count; i++) {
        if (!plan->instances[i].chunk_count || !asks(plan->instances[i].instance, free_space))
            continue;
        struct reopen_args *next = arguments_of(builder, i, phase, &size);
        if (!next)
            continue;
        next->first = !added++;
        if (args)
            add_pass(builder, before, args, sizes, color);
        args = next;
        sizes = size;
        before = i;
    }
    if (args) {
        args->last = 1;
        add_pass(builder, before, args, sizes, color);
    }
    return added > 0;
}

int pt_plan_reopen_find(struct pt_builder *builder)
{
    return builder->layer == 1 && builder->plan->reopens == 2 &&
           add_passes(builder, PATINA_FREE_SPACE_USE, PT_REOPEN_FIND, PT_PLANE_COLOR_A);
}

void pt_plan_reopen_keep(struct pt_builder *builder)
{
    if (!builder->layer || !builder->plan->reopens || !builder->plan->iterations)
        return;
    const struct reopen_args args = {.view = builder->plan->view, .phase = PT_REOPEN_KEEP};
    add_pass(builder, 0, &args, sizeof args, PT_PLANE_COLOR_A);
}

void pt_plan_reopen_take(struct pt_builder *builder)
{
    if (!builder->layer)
        return;
    if (!builder->plan->reopens || !add_passes(builder, PATINA_FREE_SPACE_USE, PT_REOPEN_TAKE, PT_PLANE_COLOR_A))
        pt_skip(builder, "reopen",
                builder->plan->reopens ? "no cloud in view knows what its stations saw" : "no cloud's free space is used");
}

void pt_plan_reopen_show(struct pt_builder *builder, enum pt_plane color)
{
    if (color == PT_PLANE_COLOR_A)
        add_passes(builder, PATINA_FREE_SPACE_SHOW, PT_REOPEN_SHOW, color);
}
