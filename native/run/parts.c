// SPDX-License-Identifier: GPL-3.0-or-later
// What parts and their merge must agree on before either begins.
#include "merge.h"

#include "scene/clouds/fingerprint.h"

#include <string.h>

static int has_faint_casters(const struct patina_scene *scene, const struct pt_plan *plan)
{
    return plan->light_count && pt_casts_in_layers(scene);
}

const char *pt_parts_refused(const struct patina_scene *scene, const struct pt_plan *plan)
{
    int ranges = plan->ranges.cells > 0;
    for (uint32_t i = 0; i < plan->instance_count; i++)
        ranges |= plan->instances[i].kind == PT_AS_RANGES;
    return ranges                               ? "range images are"
           : plan->soft.count                   ? "soft points are"
           : scene->settings.pixel_samples > 1  ? "samples of pixels are"
           : plan->reopens                      ? "what stations looked through (free space) is"
           : has_faint_casters(scene, plan)     ? "shadows of points that have opacities of their own are"
           : scene->settings.shadow_progressive ? "shadows that are refined from picture to picture are"
                                                : NULL;
}

// ---- the digest ------------------------------------------------------------------------------------------------------

static uint64_t add(uint64_t hash, const void *data, size_t size) { return pt_fingerprint(hash, data, size); }
static uint64_t add_word(uint64_t hash, uint64_t word) { return add(hash, &word, sizeof word); }

static uint64_t add_cloud(uint64_t hash, const struct pt_instance *instance)
{
    const struct patina_cloud *cloud = instance->cloud;
    const patina_cloud_style *style = &instance->style;
    const uint32_t words[] = {style->lighting, style->cull_back, style->shadow_off, style->clip_off, style->hidden_kinds};
    const float numbers[] = {style->d_min, style->transparency, style->least_trust};
    hash = add_word(add_word(hash, cloud->info.count), cloud->slots);
    hash = add(hash, cloud->chunks, cloud->chunk_count * sizeof *cloud->chunks);
    hash = add(hash, style->world_from_object, sizeof style->world_from_object);
    hash = add(hash, style->hidden_classes, sizeof style->hidden_classes);
    return add(add(hash, words, sizeof words), numbers, sizeof numbers);
}

static uint64_t add_light(uint64_t hash, const patina_light_desc *light)
{
    const uint32_t words[] = {light->type, light->shape, light->shadows};
    const float numbers[] = {light->angle, light->radius, light->size[0], light->size[1], light->cone};
    hash = add(hash, light->position, sizeof light->position);
    hash = add(hash, light->direction, sizeof light->direction);
    hash = add(hash, light->side, sizeof light->side);
    return add(add(hash, words, sizeof words), numbers, sizeof numbers);
}

uint64_t pt_parts_digest(const struct patina_scene *scene, const struct pt_plan *plan)
{
    const patina_settings *settings = &scene->settings;
    const uint32_t shadows[] = {settings->shadow_samples, settings->shadow_resolution, settings->quality, settings->fill};
    uint64_t hash = add(PT_KEYS_VERSION, &plan->view, sizeof plan->view);
    hash = add(hash, plan->crop, sizeof plan->crop);
    hash = add(hash, shadows, sizeof shadows);
    for (uint32_t i = 0; i < plan->pass_count; i++) {
        const struct pt_pass *pass = &plan->passes[i];
        hash = add_word(hash, (uint64_t)pass->kernel << 32 | pass->layer);
        hash = add(hash, pass->arguments, pass->argument_size);
    }
    if (plan->light)
        hash = add(hash, plan->light, sizeof *plan->light);
    if (plan->ramps)
        hash = add(hash, plan->ramps, 3 * (size_t)plan->ramp_entries * sizeof *plan->ramps);
    for (uint32_t i = 0; i < plan->instance_count; i++)
        hash = add(hash, plan->instances[i].chunks, plan->instances[i].chunk_count * sizeof *plan->instances[i].chunks);
    for (uint32_t i = 0; i < scene->cloud_count; i++)
        hash = add_cloud(hash, &scene->instances[i]);
    for (uint32_t i = 0; i < scene->light_count; i++)
        hash = add_light(hash, &scene->lights[i]);
    for (uint32_t i = 0; i < scene->clip_count; i++) {
        hash = add(hash, scene->clips[i].world_from_clip, sizeof scene->clips[i].world_from_clip);
        hash = add_word(hash, (uint64_t)scene->clips[i].shape << 32 | scene->clips[i].cut);
    }
    return add_word(hash, scene->triangles);
}

struct pt_keys_name pt_parts_name(const struct pt_plan *plan, const struct pt_pass *pass, const struct pt_round *round)
{
    return plan->map ? (struct pt_keys_name){0, round->light, round->sample, round->group, round->face}
                     : (struct pt_keys_name){.layer = pass->layer};
}
