// SPDX-License-Identifier: GPL-3.0-or-later
// Long calls on threads of their own, for hosts that must go on meanwhile and start no threads themselves.
#include "base/descriptor.h"
#include "base/error.h"
#include "base/words.h"
#include "scene/analysis/analysis.h"
#include "scene/clouds/fingerprint.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

struct patina_task {
    struct pt_handle handle;
    struct pt_thread thread;
    int joined;
    atomic_int done;
    int error; // of the work, once it is done
    int (*work)(struct patina_task *task);
    patina_frame *frame;
    const patina_scene *scene;
    patina_cloud_desc desc;
    patina_array color;
    patina_progress *progress;
    uint64_t *fingerprint;
    const patina_read *reads;
    uint32_t read_count;
    double refine_ms;
    patina_cloud *painted; // the caller's
    uint32_t page;
    patina_cloud *cloud; // built, until it is taken
    char *path, *to;     // its own copies
    patina_builder *builder;
    const patina_cloud *saved;
    patina_file *file; // opened, until it is taken
    patina_analysis_desc analyse;
    uint64_t memory;
    struct pt_analysis analysis; // computed, until it is applied
    patina_grid_desc grid;
    float *normals;
    patina_distance_desc distance;
    patina_ground_desc ground;
    float *distances, *intervals, *heights;
    uint8_t *grounds;
    double offset[3];
    const uint8_t *hidden;
    size_t hidden_size;
    uint64_t room, *count;
    float *positions, *colors, *scalars;
};

static void thread_main(void *argument)
{
    struct patina_task *task = argument;
    task->error = task->work(task);
    if (task->error)
        pt_fail_again(&task->handle, task->error);
    atomic_store(&task->done, 1);
}

// Starts a copy of the task.
static int start(const struct patina_task *task, patina_task **out)
{
    if (!out)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "a task: out is NULL");
    *out = malloc(sizeof **out);
    if (!*out)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "a task: out of memory");
    **out = *task;
    pt_handle_init(&(*out)->handle);
    atomic_init(&(*out)->done, 0);
    if (!pt_thread_start(&(*out)->thread, thread_main, *out, 0))
        return PATINA_OK;
    pt_handle_destroy(&(*out)->handle);
    free(*out);
    *out = NULL;
    return pt_fail(NULL, PATINA_ERROR_MEMORY, "a task: the system gives no thread");
}

static int read_passes(struct patina_task *task)
{
    int code = PATINA_OK;
    for (uint32_t i = 0; i < task->read_count && !code; ++i)
        code = patina_frame_read(task->frame, task->reads[i].pass, task->reads[i].pixels, task->reads[i].size);
    return code;
}

static int render(struct patina_task *task)
{
    const int code = patina_frame_render(task->frame, task->scene);
    return code ? code : read_passes(task);
}

static int refine(struct patina_task *task)
{
    const int code = patina_frame_refine(task->frame, task->scene, task->refine_ms);
    return code ? code : read_passes(task);
}

static int build(struct patina_task *task) { return patina_cloud_create(&task->desc, task->progress, &task->cloud); }

static int paint(struct patina_task *task) { return patina_cloud_set_colors(task->painted, &task->color); }

static int give_page(struct patina_task *task) { return patina_cloud_page_give(task->painted, task->page, &task->desc); }

static int open_file(struct patina_task *task) { return patina_file_open(task->path, task->progress, &task->file); }

static int save(struct patina_task *task) { return patina_cloud_save(task->saved, task->path); }

static int end_build(struct patina_task *task) { return patina_builder_end(task->builder, task->progress); }

static int add_to_build(struct patina_task *task) { return patina_builder_add(task->builder, &task->desc); }

static int verify(struct patina_task *task) { return patina_cloud_verify(task->path, task->progress); }

static int thin(struct patina_task *task)
{
    patina_cloud *cloud = NULL;
    int error = patina_cloud_open_at(task->path, task->offset, &cloud);
    if (!error)
        error = patina_cloud_thin(cloud, task->hidden, task->hidden_size, task->room, task->positions, task->colors,
                                  task->normals, task->scalars, task->count);
    patina_cloud_destroy(cloud);
    return error;
}

static int analyse(struct patina_task *task)
{
    return pt_analysis_compute(task->painted, &task->analyse, NULL, task->progress, &task->analysis);
}

static int analyse_file(struct patina_task *task)
{
    return patina_cloud_analyse_file(task->path, &task->analyse, task->memory, task->to, task->progress);
}

static int fingerprint(struct patina_task *task) { return pt_desc_fingerprint(&task->desc, task->fingerprint); }

static int grid_normals(struct patina_task *task) { return patina_grid_normals(&task->grid, task->progress, task->normals); }

static int cloud_distance(struct patina_task *task)
{
    return patina_cloud_distance(&task->distance, task->progress, task->distances, task->intervals);
}

static int ground(struct patina_task *task)
{
    return patina_ground(&task->ground, task->progress, task->heights, task->grounds);
}

int patina_task_render(patina_frame *frame, const patina_scene *scene, const patina_read *reads, uint32_t count,
                       patina_task **out)
{
    if (count && !reads)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_task_render: reads is NULL");
    const struct patina_task task = {.work = render, .frame = frame, .scene = scene, .reads = reads, .read_count = count};
    return start(&task, out);
}

int patina_task_refine(patina_frame *frame, const patina_scene *scene, double ms, const patina_read *reads, uint32_t count,
                       patina_task **out)
{
    if (count && !reads)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_task_refine: reads is NULL");
    const struct patina_task task = {
        .work = refine, .frame = frame, .scene = scene, .refine_ms = ms, .reads = reads, .read_count = count};
    return start(&task, out);
}

int patina_task_build(const patina_cloud_desc *desc, patina_progress *progress, patina_task **out)
{
    struct patina_task task = {.work = build, .progress = progress};
    if (!desc)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_task_build: desc is NULL");
    const int error = pt_take(NULL, "patina_task_build", desc, &task.desc, sizeof task.desc);
    return error ? error : start(&task, out);
}

int patina_task_give_page(patina_cloud *cloud, uint32_t page, const patina_cloud_desc *desc, patina_task **out)
{
    struct patina_task task = {.work = give_page, .painted = cloud, .page = page};
    if (!cloud || !desc)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_task_give_page: cloud or desc is NULL");
    const int error = pt_take(NULL, "patina_task_give_page", desc, &task.desc, sizeof task.desc);
    return error ? error : start(&task, out);
}

int patina_task_set_colors(patina_cloud *cloud, const patina_array *color, patina_task **out)
{
    if (!color)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_task_set_colors: color is NULL");
    return start(&(struct patina_task){.work = paint, .painted = cloud, .color = *color}, out);
}

int patina_task_analyse(patina_cloud *cloud, const patina_analysis_desc *desc, patina_progress *progress, patina_task **out)
{
    struct patina_task task = {.work = analyse, .painted = cloud, .progress = progress};
    int error = pt_take(NULL, "patina_task_analyse", desc, &task.analyse, sizeof task.analyse);
    error = error ? error : pt_analysis_check(cloud, &task.analyse);
    return error ? error : start(&task, out);
}

int patina_task_apply(patina_task *task)
{
    if (!task)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_task_apply: task is NULL");
    int error = patina_task_wait(task);
    if (error)
        return error;
    if (!task->analysis.shapes)
        return pt_fail(&task->handle, PATINA_ERROR_EMPTY, "patina_task_apply: nothing was analysed, or it was applied");
    error = pt_analysis_apply(task->painted, &task->analysis);
    return error ? pt_fail_again(&task->handle, error) : PATINA_OK;
}

int patina_task_fingerprint(const patina_cloud_desc *desc, uint64_t values[2], patina_task **out)
{
    struct patina_task task = {.work = fingerprint, .fingerprint = values};
    if (!desc || !values)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_task_fingerprint: desc or values is NULL");
    int error = pt_take(NULL, "patina_task_fingerprint", desc, &task.desc, sizeof task.desc);
    if (!error && task.desc.count >> 48)
        error = pt_fail(NULL, PATINA_ERROR_TOO_MANY_POINTS,
                        "patina_task_fingerprint: %llu points are more than any array holds",
                        (unsigned long long)task.desc.count);
    return error ? error : start(&task, out);
}

int patina_task_grid_normals(const patina_grid_desc *grid, patina_progress *progress, float *normals, patina_task **out)
{
    struct patina_task task = {.work = grid_normals, .progress = progress, .normals = normals};
    if (!grid)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_task_grid_normals: grid is NULL");
    const int error = pt_take(NULL, "patina_task_grid_normals", grid, &task.grid, sizeof task.grid);
    return error ? error : start(&task, out);
}

int patina_task_cloud_distance(const patina_distance_desc *desc, patina_progress *progress, float *distance, float *interval,
                               patina_task **out)
{
    struct patina_task task = {.work = cloud_distance, .progress = progress, .distances = distance, .intervals = interval};
    if (!desc)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_task_cloud_distance: desc is NULL");
    const int error = pt_take(NULL, "patina_task_cloud_distance", desc, &task.distance, sizeof task.distance);
    return error ? error : start(&task, out);
}

int patina_task_ground(const patina_ground_desc *desc, patina_progress *progress, float *height, uint8_t *is_ground,
                       patina_task **out)
{
    struct patina_task task = {.work = ground, .progress = progress, .heights = height, .grounds = is_ground};
    if (!desc)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_task_ground: desc is NULL");
    const int error = pt_take(NULL, "patina_task_ground", desc, &task.ground, sizeof task.ground);
    return error ? error : start(&task, out);
}

// Starts a task that has a path.
static int start_at(struct patina_task *task, const char *path, patina_task **out)
{
    if (!path)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "a task: path is NULL");
    task->path = pt_copy_text(path, strlen(path));
    if (!task->path)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "a task: out of memory");
    const int code = start(task, out);
    if (code)
        free(task->path);
    return code;
}

int patina_task_open_file(const char *path, patina_progress *progress, patina_task **out)
{
    return start_at(&(struct patina_task){.work = open_file, .progress = progress}, path, out);
}

int patina_task_save(const patina_cloud *cloud, const char *path, patina_task **out)
{
    return start_at(&(struct patina_task){.work = save, .saved = cloud}, path, out);
}

int patina_task_add_to_build(patina_builder *builder, const patina_cloud_desc *desc, patina_task **out)
{
    struct patina_task task = {.work = add_to_build, .builder = builder};
    if (!builder || !desc)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_task_add_to_build: builder or desc is NULL");
    const int error = pt_take(NULL, "patina_task_add_to_build", desc, &task.desc, sizeof task.desc);
    return error ? error : start(&task, out);
}

int patina_task_end_build(patina_builder *builder, patina_progress *progress, patina_task **out)
{
    if (!builder)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_task_end_build: builder is NULL");
    const struct patina_task task = {.work = end_build, .builder = builder, .progress = progress};
    return start(&task, out);
}

int patina_task_analyse_file(const char *from, const patina_analysis_desc *desc, uint64_t memory, const char *to,
                             patina_progress *progress, patina_task **out)
{
    struct patina_task task = {.work = analyse_file, .memory = memory, .progress = progress};
    int error = pt_take(NULL, "patina_task_analyse_file", desc, &task.analyse, sizeof task.analyse);
    if (error)
        return error;
    if (!to)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_task_analyse_file: to is NULL");
    task.to = pt_copy_text(to, strlen(to));
    if (!task.to)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "a task: out of memory");
    error = start_at(&task, from, out);
    if (error)
        free(task.to);
    return error;
}

int patina_task_verify(const char *path, patina_progress *progress, patina_task **out)
{
    return start_at(&(struct patina_task){.work = verify, .progress = progress}, path, out);
}

int patina_task_thin(const char *path, const double *offset, const uint8_t *hidden, size_t size, uint64_t room,
                     float *positions, float *colors, float *normals, float *scalars, uint64_t *count, patina_task **out)
{
    if (!offset || !count || (room && !positions))
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_task_thin: offset, positions or count is NULL");
    struct patina_task task = {.work = thin, .hidden = hidden, .hidden_size = size, .room = room, .count = count};
    memcpy(task.offset, offset, sizeof task.offset);
    task.positions = positions;
    task.colors = colors;
    task.normals = normals;
    task.scalars = scalars;
    return start_at(&task, path, out);
}

int patina_task_take_file(patina_task *task, patina_file **out)
{
    if (!task || !out)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_task_take_file: task or out is NULL");
    int error = patina_task_wait(task);
    *out = task->file;
    task->file = NULL;
    if (error || *out)
        return error;
    return pt_fail(&task->handle, PATINA_ERROR_EMPTY, "patina_task_take_file: no file, or it was taken");
}

int patina_task_done(const patina_task *task) { return !task || atomic_load(&task->done); }

int patina_task_wait(patina_task *task)
{
    if (!task)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_task_wait: task is NULL");
    if (!task->joined)
        pt_thread_join(&task->thread);
    task->joined = 1;
    return task->error;
}

int patina_task_take_cloud(patina_task *task, patina_cloud **out)
{
    if (!task || !out)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_task_take_cloud: task or out is NULL");
    int error = patina_task_wait(task);
    *out = task->cloud;
    task->cloud = NULL;
    if (error || *out)
        return error;
    return pt_fail(&task->handle, PATINA_ERROR_EMPTY, "patina_task_take_cloud: no cloud, or it was taken");
}

void patina_task_destroy(patina_task *task)
{
    if (!task)
        return;
    patina_task_wait(task);
    patina_cloud_destroy(task->cloud);
    patina_file_destroy(task->file);
    pt_analysis_free(&task->analysis);
    free(task->path);
    free(task->to);
    pt_handle_destroy(&task->handle);
    free(task);
}
