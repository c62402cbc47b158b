// SPDX-License-Identifier: GPL-3.0-or-later
// Shadow textures: what is at hand, and room for what is not.
#include "shadows.h"

#include "shown.h"

#include <stdlib.h>
#include <string.h>

static void forget_lights(struct pt_shadows *shadows)
{
    for (uint32_t i = 0; i < shadows->light_count; i++)
        free(shadows->lights[i].key);
    memset(shadows->lights, 0, sizeof shadows->lights);
    shadows->light_count = 0;
}

static void forget_instances(struct patina_device *device, struct pt_shadows *shadows)
{
    for (uint32_t i = 0; i < shadows->instance_count; i++) {
        device->ops->buffer_destroy(device, &shadows->words[i]);
        device->ops->buffer_destroy(device, &shadows->marks[i]);
    }
    free(shadows->words);
    free(shadows->marks);
    free(shadows->fingerprints);
    device->ops->buffer_destroy(device, &shadows->shown);
    shadows->words = shadows->marks = NULL;
    shadows->fingerprints = NULL;
    shadows->instance_count = 0;
}

void pt_shadows_release(struct patina_device *device, struct pt_shadows *shadows)
{
    forget_lights(shadows);
    forget_instances(device, shadows);
    pt_planes_release(device, &shadows->planes);
    for (int i = 0; i < PT_FLAGS; i++)
        device->ops->buffer_destroy(device, &shadows->flags[i]);
    pt_plan_buffers_release(device, &shadows->own);
    device->ops->buffer_destroy(device, &shadows->pixels.words);
}

struct pt_buffer *pt_shadows_buffer(struct pt_shadows *shadows, uint32_t which, uint32_t instance)
{
    if (instance == PT_PIXELS && which == PT_SHADOWS)
        return &shadows->pixels.words;
    if (instance >= shadows->instance_count)
        return &shadows->none;
    if (which == PT_SHADOWS && shadows->of_marked)
        return &shadows->shown;
    return which == PT_MARKS ? &shadows->marks[instance] : &shadows->words[instance];
}

// Whole textures are good for the same points wherever they lie; words of marked points for one picture, which need not read them for it.
static uint64_t identity_of(const struct pt_shadows *shadows, const struct pt_instance *instance)
{
    return shadows->of_marked && pt_receives(instance) ? pt_cloud_stamp(instance->cloud) : pt_shadows_identity(instance);
}

uint64_t pt_shadows_identity(const struct pt_instance *instance)
{
    return pt_receives(instance) ? pt_cloud_fingerprint(instance->cloud) : 0;
}

// The words are for these instances and so many lights.
static int same_places(const struct pt_shadows *shadows, const struct patina_scene *scene, const struct pt_plan *plan)
{
    int same = shadows->light_count == plan->light_count && shadows->instance_count == scene->cloud_count;
    for (uint32_t i = 0; same && i < scene->cloud_count && !shadows->of_marked;
         i++) // ahead of fingerprints, which read all points
        same = !pt_receives(&scene->instances[i]) ||
               shadows->words[i].size == shadows->light_count * scene->instances[i].cloud->slots * 4;
    for (uint32_t i = 0; same && i < scene->cloud_count; i++)
        same = shadows->fingerprints[i] == identity_of(shadows, &scene->instances[i]);
    return same;
}

int pt_shadows_make_places(struct patina_device *device, struct pt_shadows *shadows, const struct patina_scene *scene,
                           uint32_t light_count, int of_marked)
{
    forget_lights(shadows);
    forget_instances(device, shadows);
    shadows->of_marked = (uint32_t)of_marked;
    shadows->words = calloc((size_t)scene->cloud_count + 1, sizeof *shadows->words);
    shadows->marks = calloc((size_t)scene->cloud_count + 1, sizeof *shadows->marks);
    shadows->fingerprints = calloc((size_t)scene->cloud_count + 1, sizeof *shadows->fingerprints);
    if (!shadows->words || !shadows->marks || !shadows->fingerprints) {
        forget_instances(device, shadows);
        return pt_fail(&device->handle, PATINA_ERROR_MEMORY, "shadow textures: out of memory");
    }
    shadows->instance_count = scene->cloud_count;
    shadows->light_count = light_count;
    for (uint32_t i = 0; i < scene->cloud_count; i++) {
        uint64_t points = scene->instances[i].cloud->slots;
        shadows->fingerprints[i] = identity_of(shadows, &scene->instances[i]);
        if (!shadows->fingerprints[i] || of_marked)
            continue;
        int error = light_count * points > UINT32_MAX
                        ? pt_fail(&device->handle, PATINA_ERROR_TOO_MANY_POINTS,
                                  "shadows of %u lights on %llu points: their product must stay below 4294967296", light_count,
                                  (unsigned long long)points)
                        : device->ops->buffer_create(device, light_count * points * 4, NULL, 0, &shadows->words[i]);
        if (error) {
            forget_lights(shadows);
            forget_instances(device, shadows);
            return error;
        }
    }
    return PATINA_OK;
}

uint32_t pt_samples_wanted(const struct pt_shadows *shadows, const struct patina_scene *scene, const struct pt_plan *plan,
                           uint32_t i)
{
    const struct pt_shadow_light *light = &shadows->lights[i];
    const struct pt_plan_light *planned = &plan->lights[i];
    if (light->settled)
        return light->samples;
    if (!scene->settings.shadow_progressive || scene->settings.shadow_lazy ||
        (!shadows->of_marked && light->samples == planned->samples))
        return planned->samples;
    const uint32_t next = pt_plan_lazy(scene, plan) ? shadows->next : light->samples ? 2 * light->samples : 1;
    return next < planned->samples ? next : planned->samples;
}

int pt_shadows_stale(const struct pt_shadows *shadows, const struct patina_scene *scene, const struct pt_plan *plan)
{
    for (uint32_t i = 0; i < plan->light_count; i++)
        if (shadows->lights[i].samples != pt_samples_wanted(shadows, scene, plan, i))
            return 1;
    return 0;
}

// No point is marked yet. Memory anew: on the processor what no picture marks takes none.
static int make_marks(struct patina_device *device, struct pt_shadows *shadows, const struct patina_scene *scene)
{
    int error = pt_flag_write(device, shadows, PT_FLAG_MARKED, 0);
    for (uint32_t i = 0; i < shadows->instance_count && !error; i++) {
        device->ops->buffer_destroy(device, &shadows->marks[i]);
        if (shadows->fingerprints[i])
            error = device->ops->buffer_create(device, pt_marks_size(scene->instances[i].cloud->slots), NULL, PT_ZEROED,
                                               &shadows->marks[i]);
    }
    return error;
}

// Compares the lights with those that words are of; those of others have no samples. *changed: there are such.
static int match_lights(struct patina_device *device, struct pt_shadows *shadows, const struct patina_scene *scene,
                        const struct pt_plan *plan, int *changed)
{
    for (uint32_t i = 0; i < plan->light_count; i++) {
        struct pt_shadow_light *light = &shadows->lights[i];
        uint64_t (*const identity)(const struct patina_cloud *) = shadows->of_marked ? pt_cloud_stamp : pt_cloud_fingerprint;
        size_t count = pt_light_key(scene, &plan->lights[i], identity, NULL, 0);
        double *key = malloc(count * sizeof *key);
        if (!key)
            return pt_fail(&device->handle, PATINA_ERROR_MEMORY, "shadow textures: out of memory");
        pt_light_key(scene, &plan->lights[i], identity, key, count);
        int known = light->key && light->key_count == count && pt_same_key(light->key, key, count);
        *changed |= !known;
        if (!known || light->partial || (light->samples > plan->lights[i].samples && !light->settled))
            light->samples = light->settled = 0;
        free(light->key);
        light->key = key;
        light->key_count = count;
    }
    return PATINA_OK;
}

int pt_shadows_open(struct patina_device *device, struct pt_shadows *shadows, const struct patina_scene *scene,
                    const struct pt_plan *plan)
{
    const int lazy = pt_plan_lazy(scene, plan);
    int error = PATINA_OK, changed = 0;
    if (!plan->light_count)
        return PATINA_OK;
    const uint64_t view = pt_pixels_view(scene, plan);
    for (int i = 0; i < PT_FLAGS && !error; i++)
        if (!shadows->flags[i].size)
            error = device->ops->buffer_create(device, sizeof(uint32_t), NULL, 0, &shadows->flags[i]);
    if (!error && (!same_places(shadows, scene, plan) || (shadows->of_marked && !lazy))) {
        error = pt_shadows_make_places(device, shadows, scene, plan->light_count, lazy);
        changed = 1;
    }
    error = error ? error : match_lights(device, shadows, scene, plan, &changed);
    shadows->reached = changed || view != shadows->view ? 0 : shadows->reached;
    shadows->next = shadows->reached ? 2 * shadows->reached : 1;
    shadows->view = view;
    if (!error && lazy && !shadows->of_marked &&
        pt_shadows_stale(shadows, scene, plan)) { // what was whole is not whole any more
        error = pt_shadows_make_places(device, shadows, scene, plan->light_count, 1);
        error = error ? error : match_lights(device, shadows, scene, plan, &changed);
    }
    shadows->placed = 0;
    if (!error && shadows->of_marked)
        error = make_marks(device, shadows, scene);
    return error ? error : pt_pixels_open(device, &shadows->pixels, scene, plan, changed);
}

// ---- words and flags -----------------------------------------------------------------------------------------------------

// Room for the words of as many points as have ranks, without samples.
static int place_marked(struct patina_device *device, struct pt_shadows *shadows)
{
    uint32_t marked = 0;
    int error = pt_flag_read(device, shadows, PT_FLAG_MARKED, &marked);
    const uint64_t size = ((1 + (uint64_t)marked) * shadows->light_count * 4 + 7) / 8 * 8;
    if (!error && size / 4 > INT32_MAX) // kernels gather by signed indices
        return pt_fail(&device->handle, PATINA_ERROR_TOO_MANY_POINTS,
                       "shadows of %u lights on %u points that the picture shows: their product must stay below 2147483648",
                       shadows->light_count, marked);
    if (!error && shadows->shown.size < size) {
        device->ops->buffer_destroy(device, &shadows->shown);
        error = device->ops->buffer_create(device, size, NULL, 0, &shadows->shown);
    }
    shadows->placed = !error;
    return error ? error : device->ops->buffer_fill(device, &shadows->shown, 0, size, 0, 4);
}

int pt_shadows_clear(struct patina_device *device, struct pt_shadows *shadows, uint32_t light)
{
    int error = PATINA_OK;
    if (shadows->of_marked)
        return shadows->placed ? PATINA_OK : place_marked(device, shadows);
    for (uint32_t i = 0; i < shadows->instance_count && !error; i++) {
        struct pt_buffer *words = &shadows->words[i];
        const size_t size = words->size / shadows->light_count;
        if (!size)
            continue;
        if (shadows->light_count == 1) {
            error = device->ops->buffer_fill(device, words, 0, size, 0, 4);
            continue;
        }
        void *zeros = calloc(size, 1);
        error = zeros ? device->ops->buffer_write(device, words, light * size, zeros, size)
                      : pt_fail(&device->handle, PATINA_ERROR_MEMORY, "shadow textures: out of memory");
        free(zeros);
    }
    return error;
}

int pt_flag_write(struct patina_device *device, struct pt_shadows *shadows, enum pt_flag flag, uint32_t word)
{
    return device->ops->buffer_write(device, &shadows->flags[flag], 0, &word, sizeof word);
}

int pt_flag_read(struct patina_device *device, const struct pt_shadows *shadows, enum pt_flag flag, uint32_t *word)
{
    return device->ops->buffer_read(device, &shadows->flags[flag], 0, word, sizeof *word);
}
