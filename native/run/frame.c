// SPDX-License-Identifier: GPL-3.0-or-later
// What a frame is asked for: a picture, of samples or not, or shadow textures alone.
#include "frame.h"

#include "execute.h"
#include "frame_samples.h"
#include "page_check.h"

#include <math.h>
#include <string.h>

static int bake_once(struct patina_frame *frame, const struct patina_scene *scene, const void *of)
{
    (void)of;
    struct patina_scene whole = *scene; // its handle is not touched
    struct pt_plan plan;
    whole.settings.shadow_lazy = whole.settings.shadow_progressive = 0;
    frame->times.count = 0;
    frame->shadow_maps = 0;
    const int known = frame->keys_valid, layers = (int)frame->layer_count;
    int error = pt_plan_textures(&whole, &plan);
    if (error)
        return pt_fail(&frame->handle, error, "shadow textures: out of memory");
    if (!plan.light_count || !scene->cloud_count)
        error = pt_fail(&frame->handle, PATINA_ERROR_EMPTY, "shadows: no light of the scene casts any, or there is no cloud");
    if (!error)
        error = pt_frame_number(frame, scene, NULL);
    if (!error) {
        const struct pt_layer first = frame->layers[0];
        error = pt_frame_execute(frame, &whole, &plan);
        frame->keys_valid = known; // of the last picture, which stays
        frame->layer_count = (uint32_t)layers;
        frame->layers[0] = first;
    }
    pt_plan_destroy(&plan);
    return error;
}

int pt_frame_bake(struct patina_frame *frame, const struct patina_scene *scene)
{
    const int error = pt_frame_until_sound(frame, scene, "baking shadows", bake_once, NULL);
    atomic_store(&frame->cancel, 0);
    return error;
}

// What the device did since.
static int count_since(struct patina_frame *frame, const struct pt_counts *before)
{
    struct pt_counts now = {0};
    const int error = frame->device->ops->counts(frame->device, &now);
    frame->counts = pt_counts_between(before, &now);
    return error;
}

int pt_frame_render(struct patina_frame *frame, const struct patina_scene *scene)
{
    struct pt_counts before = {0};
    frame->device->measured = frame->measured;
    int counted = frame->device->ops->counts(frame->device, &before);
    double start = pt_milliseconds();
    atomic_store(&frame->progress, 0.0f);
    frame->progress_done = 0.0f;
    frame->progress_share = 1.0f;
    frame->times.count = 0;
    frame->times.bytes = 0;
    frame->shadow_maps = frame->shadow_size[0] = frame->shadow_size[1] = 0;
    frame->sampling[0] = frame->sampling[1] = 1;
    frame->pager = (struct pt_pager){0};
    pt_mean_destroy(frame);
    int error = scene->settings.pixel_samples > 1 ? pt_frame_sample(frame, scene) : pt_frame_draw(frame, scene);
    if (!error)
        frame->shown.stats.ms = pt_milliseconds() - start;
    frame->counts = (struct pt_counts){0};
    if (!counted && !error)
        error = count_since(frame, &before);
    atomic_store(&frame->cancel, 0);
    return error;
}

void pt_frame_release(struct patina_frame *frame)
{
    pt_mean_destroy(frame);
    pt_planes_release(frame->device, &frame->planes);
    pt_shadows_release(frame->device, &frame->shadows);
    pt_plan_buffers_release(frame->device, &frame->own);
    pt_residency_release(&frame->residency, frame->device);
    pt_numbering_release(&frame->numbering);
    pt_numbering_release(&frame->key_ids);
}
