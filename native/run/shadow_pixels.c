// SPDX-License-Identifier: GPL-3.0-or-later
// Shadows on meshes: the pixels that show one are tested as the points of a cloud are, a row of them for a chunk. What is known of
// them lasts as long as the picture.
#include "shadows.h"

#include "scene/clouds/fingerprint.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ERROR_MOST = 256 }; // samples, where an error is asked for

uint64_t pt_pixels_view(const struct patina_scene *scene, const struct pt_plan *plan)
{
    const patina_camera *c = &scene->camera;
    const double window[] = {c->left, c->right, c->bottom, c->top, c->near_clip, c->far_clip, (double)c->orthographic};
    uint64_t words = pt_fingerprint(0, &plan->view, sizeof plan->view);
    words = pt_fingerprint(words, c->world_from_camera, sizeof c->world_from_camera);
    words = pt_fingerprint(words, window, sizeof window);
    for (uint32_t i = 0; i < scene->mesh_count; i++) {
        const uint64_t mesh = atomic_load(&pt_mesh_at(scene, i)->mesh->alive->fingerprint);
        words = pt_fingerprint(words, &mesh, sizeof mesh);
        words = pt_fingerprint(words, pt_mesh_at(scene, i)->mesh_style.world_from_object,
                               sizeof pt_mesh_at(scene, i)->mesh_style.world_from_object);
    }
    return words;
}

// Samples that a light's pixels get in a finished picture. They are not looked at for when to stop: a part of the picture would
// stop at others than the whole. Even samples are off by about 1 / n.
static uint32_t samples_of(const struct patina_scene *scene, const struct pt_plan_light *light)
{
    const float error = scene->settings.shadow_error;
    uint32_t samples = 1;
    if (!(error > 0.0f) || light->samples == 1)
        return light->samples;
    while (samples < ERROR_MOST && (float)samples * error < 1.0f)
        samples *= 2;
    return samples < light->samples ? samples : light->samples;
}

int pt_pixels_open(struct patina_device *device, struct pt_shadow_pixels *pixels, const struct patina_scene *scene,
                   const struct pt_plan *plan, int changed)
{
    const uint64_t count = (uint64_t)plan->view.width * plan->view.height, view = pt_pixels_view(scene, plan);
    pixels->pending = 0;
    if (!plan->mesh.shadows)
        return PATINA_OK;
    const int again = changed || pixels->view != view;
    for (uint32_t i = 0; i < plan->light_count; i++) {
        const uint32_t most = samples_of(scene, &plan->lights[i]), next = again ? 1 : 2 * pixels->samples[i];
        pixels->samples[i] = scene->settings.shadow_progressive && next < most ? next ? next : 1 : most;
        pixels->pending += pixels->samples[i] < most;
    }
    pixels->view = view;
    if (plan->light_count * count > UINT32_MAX)
        return pt_fail(&device->handle, PATINA_ERROR_TOO_MANY_POINTS,
                       "shadows of %u lights on %llu pixels: their product must stay below 4294967296", plan->light_count,
                       (unsigned long long)count);
    const size_t size = plan->light_count * (size_t)count * 4;
    if (pixels->words.size == size)
        return PATINA_OK;
    device->ops->buffer_destroy(device, &pixels->words);
    int error = device->ops->buffer_create(device, size, NULL, 0, &pixels->words);
    return error;
}

// Whether a mesh shows anywhere.
static int some_shown(struct patina_device *device, const struct pt_planes *picture, const struct pt_plan *plan, int *some)
{
    const struct pt_buffer *plane = &picture->at[PT_PLANE_MESH_SHOWN][0];
    const uint32_t *rect = plan->view.rect;
    const size_t width = plan->view.width, count = width * (rect[3] - rect[1]);
    uint64_t *keys = malloc(count * sizeof *keys);
    int error = keys ? device->ops->buffer_read(device, plane, rect[1] * width * sizeof *keys, keys, count * sizeof *keys)
                     : pt_fail(&device->handle, PATINA_ERROR_MEMORY, "shadows on meshes: out of memory");
    *some = 0;
    for (size_t i = 0; i < count && !error && !*some; i++)
        *some = keys[i] >> 32 != PT_KEY_EMPTY_Z;
    free(keys);
    return error;
}

int pt_pixels_begin(struct patina_device *device, struct pt_shadow_pixels *pixels, const struct pt_planes *picture,
                    const struct pt_plan *plan, int *some)
{
    const int error = device->ops->buffer_fill(device, &pixels->words, 0, pixels->words.size, 0, 4);
    *some = 0;
    return error ? error : some_shown(device, picture, plan, some);
}
