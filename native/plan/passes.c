// SPDX-License-Identifier: GPL-3.0-or-later
#include "passes.h"

#include <math.h>
#include <string.h>

static void *copy(struct pt_builder *builder, const void *source, size_t size)
{
    void *memory = pt_arena_take(&builder->plan->arena, size);
    if (memory)
        memcpy(memory, source, size);
    else
        builder->failed = PATINA_ERROR_MEMORY;
    return memory;
}

struct pt_pass *pt_add(struct pt_builder *builder, enum pt_kernel kernel, const char *name, const void *arguments,
                       size_t argument_size, const struct pt_ref *refs, uint32_t ref_count)
{
    struct pt_plan *plan = builder->plan;
    if (plan->pass_count == builder->room) {
        struct pt_pass *grown = pt_arena_grow(&plan->arena, plan->passes, &builder->room, sizeof *grown);
        if (!grown) {
            builder->failed = PATINA_ERROR_MEMORY;
            return &builder->nowhere;
        }
        plan->passes = grown;
    }
    const int wrong = pt_check_bindings(kernel, arguments, refs, ref_count);
    builder->failed = wrong ? wrong : builder->failed;
    struct pt_pass *pass = &plan->passes[plan->pass_count++];
    *pass = (struct pt_pass){.kernel = kernel,
                             .layer = builder->layer,
                             .name = builder->as ? builder->as : name,
                             .output = !builder->layer && !plan->map,
                             .arguments = copy(builder, arguments, argument_size),
                             .argument_size = argument_size,
                             .refs = copy(builder, refs, ref_count * sizeof *refs),
                             .ref_count = ref_count};
    return pass;
}

int pt_has_pass(const struct pt_plan *plan, enum pt_kernel kernel)
{
    for (uint32_t i = 0; i < plan->pass_count; i++)
        if (plan->passes[i].kernel == kernel)
            return 1;
    return 0;
}

void pt_skip(struct pt_builder *builder, const char *name, const char *reason)
{
    struct pt_plan *plan = builder->plan;
    if (builder->layer > 1 || builder->again || plan->skipped_count == sizeof plan->skipped / sizeof plan->skipped[0])
        return;
    struct pt_skipped *skipped = &plan->skipped[plan->skipped_count++];
    skipped->name = name;
    snprintf(skipped->reason, sizeof skipped->reason, "%s", reason);
}

double pt_pixel_width(const struct patina_scene *scene)
{
    const patina_camera *camera = &scene->camera;
    return fmax((camera->right - camera->left) / scene->settings.width,
                (camera->top - camera->bottom) / scene->settings.height);
}

struct view_args pt_view_at(const struct pt_plan *plan, uint32_t level)
{
    struct view_args view = plan->view;
    uint32_t cell = 1u << level;
    view.level = level;
    view.width = (view.width + cell - 1) >> level;
    view.height = (view.height + cell - 1) >> level;
    for (int k = 0; k < 2; k++) {
        view.rect[k] >>= level;
        view.rect[2 + k] = (view.rect[2 + k] + cell - 1) >> level;
    }
    return view;
}

struct view_args pt_view_of(const struct pt_plan *plan, const struct pt_plan_instance *instance, uint32_t margin)
{
    struct view_args view = plan->view;
    const uint32_t *rect = instance->rect;
    for (int k = 0; k < 2; k++) {
        view.rect[k] = rect[k] > margin ? rect[k] - margin : 0;
        view.rect[2 + k] = rect[2 + k] + margin;
    }
    view.rect[2] = view.rect[2] < view.width ? view.rect[2] : view.width;
    view.rect[3] = view.rect[3] < view.height ? view.rect[3] : view.height;
    return view;
}

struct view_args pt_view_filled(const struct pt_plan *plan, const struct pt_plan_instance *instance)
{
    struct view_args view = pt_view_of(plan, instance, (plan->iterations + 2) << plan->levels);
    const uint32_t *whole = plan->view.rect;
    for (int k = 0; k < 2; k++) {
        view.rect[k] = view.rect[k] > whole[k] ? view.rect[k] : whole[k];
        view.rect[2 + k] = view.rect[2 + k] < whole[2 + k] ? view.rect[2 + k] : whole[2 + k];
    }
    return view;
}

void pt_plan_destroy(struct pt_plan *plan)
{
    pt_arena_free(plan->arena);
    *plan = (struct pt_plan){0};
}
