// SPDX-License-Identifier: GPL-3.0-or-later
// One machine's part of a picture's points: of the plan its passes of points alone are run, on a share of their chunks, and so of the
// plan of every light's map.
#include "frame.h"

#include "execute.h"
#include "merge.h"
#include "page_check.h"
#include "scene/clouds/page_sums.h"

#include <stdlib.h>
#include <string.h>

struct part_job {
    struct patina_frame *frame;
    const struct patina_scene *scene;
    const patina_part *part;
    struct pt_plan plan;
    struct pt_planes planes;
    struct pt_key_file before; // what the part is told; path NULL: the first round
    struct pt_key_writer writer;
};

// A share of every list of chunks in view, so that all parts have as much to do; as they lie beside each other, so that a file that is
// mapped is read in one piece.
static int bind_share(struct pt_execution *e, const patina_part *part)
{
    int error = PATINA_OK;
    for (uint32_t i = 0; i < e->plan->instance_count && !error; i++) {
        const struct pt_plan_instance *instance = &e->plan->instances[i];
        const uint64_t count = instance->chunk_count, first = pt_share_before(part, part->part - 1, count);
        if (count)
            error = pt_bind_chunks(&e->binder, i, instance->chunks + first,
                                   (uint32_t)(pt_share_before(part, part->part, count) - first));
    }
    return error;
}

static int clear_keys(struct pt_execution *e, const struct pt_ref *keys)
{
    int error = PATINA_OK;
    for (uint32_t i = 0; i < e->plan->step_count && !error; i++) {
        const struct pt_step *step = &e->plan->steps[i];
        if (step->of == PT_STEP_CLEAR && step->plane.which == keys->which && step->plane.index == keys->index) {
            error = pt_planes_clear(e->device, e->binder.planes, e->plan, step);
            break; // the plane of a later layer is the same
        }
    }
    return error;
}

// Where the layer lies behind the one before.
static int set_limit(struct part_job *job, struct pt_execution *e, const struct pt_keys_name *name)
{
    const struct pt_plan *plan = e->plan;
    const uint32_t *rect = plan->view.rect, width = plan->view.width, rows = rect[3] - rect[1];
    float *limits = malloc(4 * (size_t)width * rows + 1);
    int error = limits ? pt_key_file_limits(&job->before, &job->frame->handle, name, limits, width, rect[1], rows)
                       : pt_fail(&e->device->handle, PATINA_ERROR_MEMORY, "a part: out of memory");
    if (!error)
        error = pt_planes_ensure(e->device, e->binder.planes, plan, PT_PLANE_LIMIT, 0);
    if (!error)
        error = e->device->ops->buffer_write(e->device, &e->binder.planes->at[PT_PLANE_LIMIT][0], 4 * (size_t)width * rect[1],
                                             limits, 4 * (size_t)width * rows);
    free(limits);
    return error;
}

static int write_keys(struct part_job *job, struct pt_execution *e, const struct pt_ref *keys, const struct pt_keys_name *name)
{
    const struct pt_plan *plan = e->plan;
    const struct pt_buffer *plane = &e->binder.planes->at[keys->which][keys->index];
    const uint32_t *rect = plan->view.rect;
    uint64_t *copy = malloc(plane->size + 1);
    int error = copy ? e->device->ops->buffer_read(e->device, plane, 0, copy, plane->size)
                     : pt_fail(&e->device->handle, PATINA_ERROR_MEMORY, "a part: out of memory");
    if (!error)
        error = pt_key_writer_keys(&job->writer, name, copy, plan->view.width, rect[1], rect[3] - rect[1]);
    free(copy);
    return error;
}

static int is_run(const struct pt_pass *pass, uint32_t layer)
{
    return pt_pass_role(pass) == PT_ROLE_SIEVE || (pt_is_of_parts(pass) && pass->layer == layer);
}

// The share's damaged pages, where the device reads in ranges.
static int look_at_share(struct part_job *job, struct pt_execution *e, uint32_t layer)
{
    int found = PATINA_OK;
    for (uint32_t i = 0; i < e->plan->pass_count && found >= 0; i++) {
        const struct pt_pass *pass = &e->plan->passes[i];
        const int one = is_run(pass, layer) ? pt_pager_begin_pass(e->pager, e->plan, pass, job->part) : PATINA_OK;
        found = one ? one : found;
    }
    return found;
}

// The passes of points of a layer, or (0) of a map.
static int run_points(struct part_job *job, struct pt_execution *e, uint32_t layer)
{
    const struct pt_plan *plan = e->plan;
    const struct pt_pass *first = NULL;
    int error = pt_binder_open(&e->binder);
    if (!error)
        error = bind_share(e, job->part);
    if (!error)
        error = look_at_share(job, e, layer);
    for (uint32_t i = 0; i < plan->pass_count && !error; i++) {
        const struct pt_pass *pass = &plan->passes[i];
        if (pt_pass_role(pass) == PT_ROLE_SIEVE)
            error = pt_run_passes(e, i, 1);
        if (error || !pt_is_of_parts(pass) || pass->layer != layer)
            continue;
        if (!first) {
            const struct pt_keys_name name = pt_parts_name(plan, pass, &e->round);
            first = pass;
            error = clear_keys(e, &pass->refs[0]);
            if (!error && layer > 1)
                error = set_limit(job, e, &name);
        }
        if (!error)
            error = pt_run_passes(e, i, 1);
    }
    if (!error && first) {
        const struct pt_keys_name name = pt_parts_name(plan, first, &e->round);
        error = write_keys(job, e, &first->refs[0], &name);
    }
    return error;
}

static struct pt_execution execution_of(struct part_job *job, struct pt_plan *plan)
{
    struct patina_frame *frame = job->frame;
    return (struct pt_execution){.device = frame->device,
                                 .scene = job->scene,
                                 .plan = plan,
                                 .pager = &frame->pager,
                                 .times = &frame->times,
                                 .cancel = &frame->cancel,
                                 .binder = {.device = frame->device,
                                            .plan = plan,
                                            .residency = &frame->residency,
                                            .planes = &job->planes,
                                            .picture = &job->planes,
                                            .in_parts = 1,
                                            .own = plan->map ? &frame->shadows.own : &frame->own,
                                            .shadows = &frame->shadows}};
}

static int draw_map(struct part_job *job, const struct pt_round *round)
{
    struct pt_plan map;
    int error = pt_plan_map(job->scene, &job->plan, round, &map);
    if (error)
        return error == PATINA_ERROR_MEMORY ? pt_fail(&job->frame->handle, error, "a light's map: out of memory")
                                            : pt_fail_again(&job->frame->handle, error);
    struct pt_execution execution = execution_of(job, &map);
    execution.round = *round;
    if (map.pass_count)
        error = run_points(job, &execution, 0);
    pt_execution_close(&execution);
    pt_plan_destroy(&map);
    return error;
}

// All of a light's maps, as many samples as it may take: no map depends on another, nor on the picture.
static int draw_light(struct part_job *job, uint32_t light)
{
    struct pt_plan *plan = &job->plan;
    struct pt_round round = {.light = light, .points = 1, .pixels = plan->mesh.shadows};
    int error = pt_plan_light_map(job->scene, plan, light);
    for (round.sample = 0; round.sample < plan->lights[light].samples && !error; round.sample++)
        for (round.group = 0; round.group < plan->group_count && !error; round.group++)
            for (round.face = 0; round.face < pt_light_faces(plan, light) && !error; round.face++)
                if (pt_plan_tested(job->scene, plan, &round, round.group))
                    error = draw_map(job, &round);
    return error;
}

static int draw(struct part_job *job, uint32_t round)
{
    struct pt_execution execution = execution_of(job, &job->plan);
    int error = run_points(job, &execution, round);
    pt_execution_close(&execution);
    for (uint32_t light = 0; light < job->plan.light_count && round == 1 && !error; light++)
        error = draw_light(job, light);
    return error;
}

// Reads what the part is told; *head: of the file to be.
static int begin(struct part_job *job, struct pt_keys_head *head)
{
    const struct pt_handle *handle = &job->frame->handle;
    const char *refused = pt_parts_refused(job->scene, &job->plan);
    if (refused)
        return pt_fail(handle, PATINA_ERROR_UNSUPPORTED, "%s not scattered in parts: render the picture whole, or in tiles",
                       refused);
    *head = (struct pt_keys_head){.kind = PATINA_KEYS_PART, .part = job->part->part, .of = job->part->of, .round = 1};
    head->picture = pt_parts_digest(job->scene, &job->plan);
    if (!job->part->behind)
        return PATINA_OK;
    const int error = pt_key_file_open(&job->before, handle, job->part->behind);
    if (error)
        return error;
    const struct pt_keys_head *told = &job->before.head;
    if (told->kind != PATINA_KEYS_NEXT)
        return pt_fail(handle, PATINA_ERROR_FORMAT, "%s: keys of a part, not what a merge left for the next round",
                       job->part->behind);
    if (told->picture != head->picture)
        return pt_fail(handle, PATINA_ERROR_FORMAT, "%s is of another picture: its scene or settings differ",
                       job->part->behind);
    head->round = told->round;
    head->before = told->before;
    return PATINA_OK;
}

// Nobody who merges the keys would see that some are missing: a part whose file lost pages fails.
static int fail_lost(const struct patina_scene *scene)
{
    int error = PATINA_OK;
    for (uint32_t i = 0; i < scene->cloud_count && !error; i++)
        error = pt_pages_fail_lost(scene->instances[i].whole);
    return error;
}

struct part_file {
    const patina_part *part;
    const char *path;
};

// Its keys, and a copy of them that is written.
static int check_size(const struct part_job *job)
{
    const struct pt_plan *plan = &job->plan;
    const uint64_t keys = pt_plan_plane_bytes(plan, PT_PLANE_KEYS, 0);
    int error = PATINA_OK;
    for (uint32_t i = 0; i < plan->pass_count && !error; i++)
        if (pt_is_of_parts(&plan->passes[i]))
            error = pt_planes_check_pass(job->frame->device, plan, &plan->passes[i]);
    return error ? error : pt_planes_check_memory(job->frame->device, plan, 0, 2 * keys);
}

static int scatter_once(struct patina_frame *frame, const struct patina_scene *scene, const void *of)
{
    const struct part_file *file = of;
    const patina_part *part = file->part;
    struct part_job job = {.frame = frame, .scene = scene, .part = part, .planes = {.varies = 1}};
    struct pt_keys_head head;
    frame->times.count = 0;
    frame->pager = (struct pt_pager){.cancel = &frame->cancel, .losses = frame->pager.losses, .lost = frame->pager.lost};
    int error = pt_plan_create(scene, frame->device->pool, &job.plan);
    if (error)
        return error;
    pt_plan_set_bins(&job.plan, frame->device->bin_threads, 0);
    error = check_size(&job);
    if (!error)
        error = begin(&job, &head);
    if (!error)
        error = pt_key_writer_begin(&job.writer, &frame->handle, file->path, &head, part->note);
    if (!error) {
        error = pt_pager_open(&frame->pager, frame->device, scene);
        if (!error) {
            error = draw(&job, head.round);
            if (error >= 0 && fail_lost(scene))
                error = PATINA_ERROR_FILE;
            pt_pager_close(&frame->pager);
        }
        error = pt_key_writer_end(&job.writer, error);
    }
    pt_key_file_close(&job.before);
    pt_planes_release(frame->device, &job.planes);
    pt_plan_destroy(&job.plan);
    return error;
}

int pt_frame_scatter(struct patina_frame *frame, const struct patina_scene *scene, const patina_part *part, const char *path)
{
    struct patina_scene whole = *scene; // its handle is not touched
    const struct part_file file = {part, path};
    whole.in_parts = 1;
    const int error = pt_frame_until_sound(frame, &whole, "scattering", scatter_once, &file);
    atomic_store(&frame->cancel, 0);
    return error;
}

int pt_frame_merge(struct patina_frame *frame, const struct patina_scene *scene, const char *const *paths, uint32_t count,
                   const char *next, uint32_t *round)
{
    struct pt_merge merge;
    struct patina_scene whole = *scene; // its handle is not touched
    *round = 0;
    whole.in_parts = 1;
    int error = pt_merge_open(&merge, &frame->handle, paths, count);
    if (!error) {
        merge.next = next;
        frame->merge = &merge;
        error = pt_frame_render(frame, &whole);
        frame->merge = NULL;
        *round = merge.wanted;
    }
    pt_merge_close(&merge);
    return error == PATINA_ERROR_CANCELLED && *round ? PATINA_OK : error;
}
