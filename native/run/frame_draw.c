// SPDX-License-Identifier: GPL-3.0-or-later
// One picture of a frame: the scene is planned, the plan executed on the frame's planes, and what there is to be told of it kept.
#include "frame.h"
#include "scene/clip.h"

#include "execute.h"
#include "page_check.h"

#include "scene/clouds/page_sums.h"

#include <math.h>
#include <string.h>

int pt_frame_number(struct patina_frame *frame, const struct patina_scene *scene, const struct pt_plan *plan)
{
    frame->keys_valid &= !plan;
    return pt_numbering_take(&frame->numbering, scene, NULL) || (plan && pt_numbering_take(&frame->key_ids, scene, plan))
               ? pt_fail(NULL, PATINA_ERROR_MEMORY, "numbering %u instances: out of memory", scene->cloud_count)
               : PATINA_OK;
}

static void keep_statistics(struct patina_frame *frame, const struct patina_scene *scene, const struct pt_plan *plan, double ms)
{
    struct pt_shown *shown = &frame->shown;
    shown->stats = (patina_frame_stats){.struct_size = sizeof shown->stats,
                                        .width = plan->crop[2],
                                        .height = plan->crop[3],
                                        .points = plan->points,
                                        .points_scattered = plan->points_scattered,
                                        .triangles = plan->mesh.triangles,
                                        .chunks = plan->chunks,
                                        .chunks_culled = plan->chunks_culled,
                                        .chunks_clipped = plan->chunks_clipped,
                                        .chunks_cut = plan->chunks_cut,
                                        .pixel_samples = 1,
                                        .ms = ms};
    for (uint32_t i = 0; i < scene->cloud_count; i++) {
        shown->stats.untrusted += pt_untrusted(&scene->instances[i]);
        shown->stats.none_trusted += pt_none_trusted(&scene->instances[i]);
    }
    shown->peak = plan->peak;
    shown->soft_parts = plan->soft.part_count;
    shown->soft_records = plan->soft.records;
    shown->stats.plane_bytes = pt_planes_total(&frame->planes);
    shown->stats.spacing_px = (float)plan->spacing_px;
    shown->stats.expected = plan->expected;
    shown->stats.layers = frame->layer_count && plan->layers == 1;
    for (uint32_t i = 0; i < frame->layer_count; i++)
        shown->stats.layers += frame->layers[i].pixels > 0;
    shown->layer_most = plan->layers;
    shown->layer_passes = scene->settings.layer_passes;
    shown->stats.shadow_maps = frame->shadow_maps;
    shown->stats.shadow_width = frame->shadow_size[0];
    shown->stats.shadow_height = frame->shadow_size[1];
    shown->stats.mapped_bytes = frame->pager.mapped;
    shown->stats.mapped_cap = frame->pager.cap;
    shown->stats.mapped_held = atomic_load(&frame->pager.held);
    shown->stats.mapped_read = frame->pager.read;
    shown->stats.mapped_rounds = frame->pager.rounds;
    shown->stats.mapped_returned = atomic_load(&frame->pager.returned);
    for (uint32_t i = 0; i < scene->cloud_count; i++)
        shown->stats.points_lost += pt_is_first_part(scene, i) ? pt_pages_lost_points(scene->instances[i].whole) : 0;
    for (uint32_t i = 0; i < frame->shadows.instance_count; i++)
        shown->stats.shadow_bytes += frame->shadows.words[i].size + frame->shadows.marks[i].size;
    shown->stats.shadow_bytes += frame->shadows.shown.size;
    frame->light_count = plan->light_count;
    for (uint32_t i = 0; i < plan->light_count; i++) {
        const struct pt_shadow_light *light = &frame->shadows.lights[i];
        const int refined = plan->mesh.shadows && frame->shadows.pixels.pending; // at once with the points
        shown->stats.shadow_pending += (light->samples < plan->lights[i].samples && !light->settled) || refined;
        const uint32_t of_pixels = plan->mesh.shadows ? frame->shadows.pixels.samples[i] : 0;
        const uint32_t samples = light->samples > of_pixels ? light->samples : of_pixels;
        shown->stats.shadow_samples = samples > shown->stats.shadow_samples ? samples : shown->stats.shadow_samples;
        shown->stats.shadow_error = fmaxf(shown->stats.shadow_error, light->error);
    }
    frame->shadows.reached = shown->stats.shadow_pending ? frame->shadows.next : 0;
    memcpy(frame->skipped, plan->skipped, sizeof frame->skipped);
    frame->skipped_count = plan->skipped_count;
    shown->passes = scene->settings.passes | 1u << PATINA_PASS_COMBINED;
    shown->all_lit = !plan->light_count || !pt_plan_shows(plan);
    shown->has_lines = plan->line_radius > 0.0f;
    shown->assessed = plan->assessed;
    memcpy(shown->crop, plan->crop, sizeof shown->crop);
    shown->plane_width = plan->view.width;
    frame->keys_valid = 1;
    shown->picture_valid = 1;
}

static void link_planes(struct patina_frame *frame)
{
    frame->planes.other = &frame->shadows.planes;
    frame->shadows.planes.other = &frame->planes;
    frame->shadows.planes.varies = 1;
}

// The plan of a picture, or of textures alone, on the frame's planes.
int pt_frame_execute(struct patina_frame *frame, const struct patina_scene *scene, struct pt_plan *plan)
{
    struct pt_execution execution = {.device = frame->device,
                                     .scene = scene,
                                     .plan = plan,
                                     .merge = frame->merge,
                                     .pager = &frame->pager,
                                     .times = &frame->times,
                                     .cancel = &frame->cancel,
                                     .stops_writing = !frame->shown.picture_valid,
                                     .progress = &frame->progress,
                                     .progress_done = frame->progress_done,
                                     .progress_share = frame->progress_share,
                                     .layers = frame->layers,
                                     .layer_count = pt_plan_shows(plan),
                                     .binder = {.device = frame->device,
                                                .plan = plan,
                                                .residency = &frame->residency,
                                                .planes = &frame->planes,
                                                .picture = &frame->planes,
                                                .in_parts = frame->merge != NULL,
                                                .own = &frame->own,
                                                .shadows = &frame->shadows}};
    frame->keys_valid = 0;
    link_planes(frame);
    frame->layers[0] = (struct pt_layer){.points = plan->points_scattered};
    frame->pager.merged = frame->merge != NULL;
    frame->pager.cancel = &frame->cancel;
    int error = pt_shadows_open(frame->device, &frame->shadows, scene, plan);
    if (!error)
        error = pt_maps_check(frame->device, &frame->planes, &frame->shadows, 0, scene, plan);
    if (!error && !(error = pt_pager_open(&frame->pager, frame->device, scene))) {
        error = pt_execute(&execution);
        error = error ? error : pt_pager_lose(&frame->pager);
        pt_pager_close(&frame->pager);
    }
    pt_execution_close(&execution);
    if (error)
        frame->shown.picture_valid &= !execution.writing; // half a picture is none: the device failed, or it was the first
    frame->layer_count = execution.layer_count;
    frame->shadow_maps += execution.maps;
    for (int k = 0; k < 2; k++)
        frame->shadow_size[k] = execution.map_size[k] > frame->shadow_size[k] ? execution.map_size[k] : frame->shadow_size[k];
    return error;
}

int pt_frame_share_planes(const struct patina_frame *frame, struct pt_plan *plan)
{
    const struct pt_abilities abilities = {.together = pt_passes_together,
                                           .device = frame->device,
                                           .bin_threads = frame->device->bin_threads,
                                           .bins_had = frame->planes.bins};
    return pt_plan_share_planes(plan, &abilities, frame->planes.apart);
}

static int draw_once(struct patina_frame *frame, const struct patina_scene *scene, const void *of)
{
    (void)of;
    struct pt_plan plan;
    const double start = pt_milliseconds();
    int error = pt_plan_create(scene, frame->device->pool, &plan);
    if (!error && (error = pt_frame_number(frame, scene, &plan)))
        pt_plan_destroy(&plan);
    if (!error && frame->merge && (error = pt_merge_begin(frame->merge, scene, &plan)))
        pt_plan_destroy(&plan);
    if (error)
        return error;
    pt_note_time(&frame->times, "plan", pt_milliseconds() - start);
    frame->keys_valid = 0;
    link_planes(frame);
    error = pt_frame_share_planes(frame, &plan);
    if (error)
        pt_fail(&frame->device->handle, error, "planning the frame: out of memory");
    else
        error = pt_planes_check(frame->device, &frame->planes, &plan);
    if (!error)
        error = pt_planes_open(frame->device, &frame->planes, &plan);
    if (!error)
        error = pt_frame_execute(frame, scene, &plan);
    if (!error)
        keep_statistics(frame, scene, &plan, pt_milliseconds() - start);
    pt_plan_destroy(&plan);
    return error;
}

int pt_frame_check(struct patina_frame *frame, const struct patina_scene *scene)
{
    struct pt_plan plan;
    int error = pt_plan_create(scene, NULL, &plan); // another frame may be drawn by the device's threads meanwhile
    if (error)
        return pt_fail_again(&frame->handle, error);
    error = pt_frame_share_planes(frame, &plan);
    error = error ? pt_fail(NULL, error, "planning the frame: out of memory")
                  : pt_planes_check(frame->device, &frame->planes, &plan);
    if (!error)
        error = pt_maps_check(frame->device, &frame->planes, &frame->shadows, 1, scene, &plan);
    pt_plan_destroy(&plan);
    return error ? pt_fail_again(&frame->handle, error) : PATINA_OK;
}

int pt_frame_draw(struct patina_frame *frame, const struct patina_scene *scene)
{
    return pt_frame_until_sound(frame, scene, "rendering", draw_once, NULL);
}

int pt_frame_until_sound(struct patina_frame *frame, const struct patina_scene *scene, const char *what, pt_frame_job *once,
                         const void *of)
{
    int error;
    do {
        pt_pager_prepare(&frame->pager, scene);
        error = once(frame, scene, of);
    } while (error == PT_AGAIN);
    for (uint32_t i = 0; i < scene->cloud_count; i++)
        pt_pages_tell_lost(scene->instances[i].whole);
    if (error == PATINA_ERROR_CANCELLED)
        return pt_fail(&frame->handle, error, "%s was cancelled", what);
    return error ? pt_fail_again(&frame->handle, error) : PATINA_OK;
}
