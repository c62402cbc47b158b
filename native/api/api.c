// SPDX-License-Identifier: GPL-3.0-or-later
// Devices, frames and progress as callers see them: check, delegate. The other exported functions stand with what they
// concern: scene/clouds/cloud.c, scene/scene.c, io/file.c, task.c, error.c, log.c.
#include "run/execute.h"
#include "run/frame_samples.h"
#include "scene/clouds/paged.h"
#include "base/descriptor.h"
#include "base/progress.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static int fail(const char *what) { return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "%s", what); }

// ---- progress ----------------------------------------------------------------------------------------------------------

int patina_progress_create(patina_progress **out)
{
    if (!out)
        return fail("patina_progress_create: out is NULL");
    *out = calloc(1, sizeof **out);
    if (!*out)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "a progress: out of memory");
    pt_handle_init(&(*out)->handle);
    return PATINA_OK;
}

void patina_progress_destroy(patina_progress *progress)
{
    if (!progress)
        return;
    pt_handle_destroy(&progress->handle);
    free(progress);
}

void patina_progress_cancel(patina_progress *progress)
{
    if (progress)
        atomic_store(&progress->cancelled, 1);
}

float patina_progress_value(const patina_progress *progress) { return progress ? atomic_load(&progress->value) : 0.0f; }

// ---- devices -----------------------------------------------------------------------------------------------------------

// GL on a hardware driver, else the CPU: software GL is slower than our C (9 times on llvmpipe). Through EGL, which Linux has: no driver
// of Windows was ever tried, so there it is taken by name alone.
static int create_auto(const patina_device_desc *desc, patina_device **out)
{
    if (pt_device_gl_create(desc, "gl-egl", out) == PATINA_OK) {
        if ((*out)->info.hardware)
            return PATINA_OK;
        (*out)->ops->destroy(*out);
        *out = NULL;
        pt_log(PT_LOG_INFO, "device auto: OpenGL runs in software here, the CPU device is faster");
    }
    return pt_device_cpu_create(desc, "cpu", out);
}

static int create_named(const patina_device_desc *desc, const char *name, patina_device **out)
{
    if (!strcmp(name, "auto"))
        return create_auto(desc, out);
    if (!strncmp(name, "cpu", 3))
        return pt_device_cpu_create(desc, name, out);
    if (!strcmp(name, "gl-egl") || !strcmp(name, "gl-osmesa") || !strcmp(name, "gl-wgl"))
        return pt_device_gl_create(desc, name, out);
    return pt_fail(
        NULL, PATINA_ERROR_ARGUMENT,
        "device \"%s\": known are auto, cpu, cpu-scalar, cpu-sse42, cpu-avx2, cpu-avx512, cpu-neon, gl-egl, gl-osmesa, gl-wgl",
        name);
}

int patina_device_create(const patina_device_desc *desc, patina_device **out)
{
    patina_device_desc checked;
    if (!out)
        return fail("patina_device_create: out is NULL");
    *out = NULL;
    int error = pt_take(NULL, "patina_device_create", desc, &checked, sizeof checked);
    error = error ? error : create_named(&checked, checked.name ? checked.name : "auto", out);
    if (!error) {
        (*out)->mapped_cap = checked.mapped_cap;
        pt_mutex_init(&(*out)->turns);
        pt_condition_init(&(*out)->changed);
    }
    return error;
}

void patina_device_destroy(patina_device *device)
{
    if (!device)
        return;
    pt_condition_destroy(&device->changed);
    pt_mutex_destroy(&device->turns);
    device->ops->destroy(device);
}

int patina_device_get_info(const patina_device *device, patina_device_info *info)
{
    if (!device)
        return fail("patina_device_get_info: device is NULL");
    return pt_give(&device->handle, "patina_device_get_info", &device->info, sizeof device->info, info);
}

// ---- frames ------------------------------------------------------------------------------------------------------------

int patina_frame_create(patina_device *device, patina_frame **out)
{
    if (!device || !out)
        return fail("patina_frame_create: device or out is NULL");
    *out = calloc(1, sizeof **out);
    if (!*out)
        return pt_fail(&device->handle, PATINA_ERROR_MEMORY, "a frame: out of memory");
    pt_handle_init(&(*out)->handle);
    (*out)->device = device;
    (*out)->planes.poisoned = getenv("PATINA_POISON_PLANES") != NULL;
    return PATINA_OK;
}

void patina_frame_destroy(patina_frame *frame)
{
    if (!frame)
        return;
    pt_frame_release(frame);
    pt_handle_destroy(&frame->handle);
    free(frame);
}

// Waits for the device. A cancel must not wait for another frame's turn.
static int take_turn(patina_frame *frame)
{
    struct patina_device *device = frame->device;
    int cancelled = 0;
    pt_mutex_lock(&device->turns);
    while (device->taken && !(cancelled = atomic_exchange(&frame->cancel, 0)))
        pt_condition_wait(&device->changed, &device->turns);
    device->taken |= !cancelled;
    pt_mutex_unlock(&device->turns);
    return cancelled ? pt_fail(&frame->handle, PATINA_ERROR_CANCELLED, "rendering was cancelled") : PATINA_OK;
}

// Of clouds whose points arrive page by page, what is there now is what the picture is of. renew: nobody's picture goes on yet.
static void enter_clouds(const patina_scene *scene, int renew)
{
    for (uint32_t i = 0; i < scene->cloud_count; i++)
        pt_paged_enter(scene->instances[i].cloud, renew);
}

static void leave_clouds(const patina_scene *scene)
{
    for (uint32_t i = 0; i < scene->cloud_count; i++)
        pt_paged_leave(scene->instances[i].cloud);
}

static int begin_turn(patina_frame *frame, const patina_scene *scene, int renew)
{
    const int error = take_turn(frame);
    if (!error)
        enter_clouds(scene, renew);
    return error;
}

static int end_turn(patina_frame *frame, const patina_scene *scene, int error)
{
    leave_clouds(scene);
    pt_mutex_lock(&frame->device->turns);
    frame->device->taken = 0;
    pt_condition_wake_all(&frame->device->changed);
    pt_mutex_unlock(&frame->device->turns);
    return error;
}

int patina_frame_render(patina_frame *frame, const patina_scene *scene)
{
    if (!frame || !scene)
        return fail("patina_frame_render: frame or scene is NULL");
    int error = begin_turn(frame, scene, 1);
    return error ? error : end_turn(frame, scene, pt_frame_render(frame, scene));
}

int patina_frame_check(patina_frame *frame, const patina_scene *scene)
{
    if (!frame || !scene)
        return fail("patina_frame_check: frame or scene is NULL");
    enter_clouds(scene, 1);
    const int error = pt_frame_check(frame, scene);
    leave_clouds(scene);
    return error;
}

int patina_frame_refine(patina_frame *frame, const patina_scene *scene, double ms)
{
    if (!frame || !scene || isnan(ms))
        return fail("patina_frame_refine: frame or scene is NULL, or ms is not a number");
    int error = begin_turn(frame, scene, 0);
    return error ? error : end_turn(frame, scene, pt_frame_refine(frame, scene, ms));
}

int patina_frame_scatter(patina_frame *frame, const patina_scene *scene, const patina_part *part, const char *path)
{
    patina_part checked;
    if (!frame || !scene || !part || !path)
        return fail("patina_frame_scatter: frame, scene, part or path is NULL");
    int error = pt_take(&frame->handle, "patina_frame_scatter", part, &checked, sizeof checked);
    if (!error && (!checked.part || checked.part > checked.of || checked.of > 65536))
        error = pt_fail(&frame->handle, PATINA_ERROR_ARGUMENT, "patina_frame_scatter: there is no part %u of %u", checked.part,
                        checked.of);
    error = error ? error : begin_turn(frame, scene, 1);
    return error ? error : end_turn(frame, scene, pt_frame_scatter(frame, scene, &checked, path));
}

int patina_frame_merge(patina_frame *frame, const patina_scene *scene, const char *const *paths, uint32_t count,
                       const char *next, uint32_t *round)
{
    if (!frame || !scene || !round || (count && !paths))
        return fail("patina_frame_merge: frame, scene, paths or round is NULL");
    for (uint32_t i = 0; i < count; i++)
        if (!paths[i])
            return fail("patina_frame_merge: a path is NULL");
    int error = begin_turn(frame, scene, 1);
    return error ? error : end_turn(frame, scene, pt_frame_merge(frame, scene, paths, count, next, round));
}

int patina_keys_get_info(const char *path, patina_keys_info *info)
{
    struct pt_key_file file;
    if (!path)
        return fail("patina_keys_get_info: path is NULL");
    int error = pt_key_file_open(&file, NULL, path);
    if (error)
        return error;
    patina_keys_info told = {.struct_size = sizeof told,
                             .kind = file.head.kind,
                             .part = file.head.part,
                             .of = file.head.of,
                             .round = file.head.round,
                             .picture = file.head.picture,
                             .note_size = file.head.note_size};
    memcpy(told.engine, file.head.engine, sizeof told.engine);
    pt_key_file_close(&file);
    return pt_give(NULL, "patina_keys_get_info", &told, sizeof told, info);
}

int patina_keys_read_note(const char *path, char *note, size_t size)
{
    struct pt_key_file file;
    if (!path || !note)
        return fail("patina_keys_read_note: path or note is NULL");
    int error = pt_key_file_open(&file, NULL, path);
    if (error)
        return error;
    if (size == file.head.note_size + 1)
        memcpy(note, file.note, size);
    else
        error = pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_keys_read_note: %s: the note takes %llu bytes; got %zu", path,
                        (unsigned long long)file.head.note_size + 1, size);
    pt_key_file_close(&file);
    return error;
}

int patina_frame_bake_shadows(patina_frame *frame, const patina_scene *scene)
{
    if (!frame || !scene)
        return fail("patina_frame_bake_shadows: frame or scene is NULL");
    int error = begin_turn(frame, scene, 1);
    return error ? error : end_turn(frame, scene, pt_frame_bake(frame, scene));
}

int patina_frame_load_shadows(patina_frame *frame, const patina_scene *scene, const char *path)
{
    if (!frame || !scene || !path)
        return fail("patina_frame_load_shadows: frame, scene or path is NULL");
    int error = begin_turn(frame, scene, 1);
    return error ? error : end_turn(frame, scene, pt_frame_load_shadows(frame, scene, path));
}

int patina_frame_save_shadows(const patina_frame *frame, const char *path)
{
    if (!frame || !path)
        return fail("patina_frame_save_shadows: frame or path is NULL");
    return pt_frame_save_shadows(frame, path);
}

int patina_frame_read_shadows(const patina_frame *frame, uint32_t instance, uint32_t light, float *values, size_t size)
{
    if (!frame || !values)
        return fail("patina_frame_read_shadows: frame or values is NULL");
    return pt_frame_read_shadows(frame, instance, light, values, size);
}

void patina_frame_cancel(patina_frame *frame)
{
    if (!frame)
        return;
    atomic_store(&frame->cancel, 1);
    pt_mutex_lock(&frame->device->turns); // never held for long
    pt_condition_wake_all(&frame->device->changed);
    pt_mutex_unlock(&frame->device->turns);
}

float patina_frame_progress(const patina_frame *frame) { return frame ? atomic_load(&frame->progress) : 0.0f; }

int patina_frame_read(const patina_frame *frame, uint32_t pass, float *pixels, size_t size)
{
    if (!frame || !pixels)
        return fail("patina_frame_read: frame or pixels is NULL");
    return pt_frame_read(frame, pass, pixels, size);
}

int patina_frame_read_keys(const patina_frame *frame, uint64_t *keys, size_t size)
{
    if (!frame || !keys)
        return fail("patina_frame_read_keys: frame or keys is NULL");
    return pt_frame_read_keys(frame, keys, size);
}

int patina_frame_read_numbers(const patina_frame *frame, uint64_t *numbers, size_t size)
{
    if (!frame || !numbers)
        return fail("patina_frame_read_numbers: frame or numbers is NULL");
    return pt_frame_read_numbers(frame, numbers, size);
}

int patina_frame_read_layer(const patina_frame *frame, uint32_t layer, uint32_t pass, float *pixels, size_t size)
{
    if (!frame || !pixels)
        return fail("patina_frame_read_layer: frame or pixels is NULL");
    return pt_frame_read_layer(frame, layer, pass, pixels, size);
}

int patina_frame_get_stats(const patina_frame *frame, patina_frame_stats *stats)
{
    if (!frame)
        return fail("patina_frame_get_stats: frame is NULL");
    if (!frame->shown.picture_valid)
        return pt_fail(&frame->handle, PATINA_ERROR_EMPTY, "patina_frame_get_stats: no finished render");
    return pt_give(&frame->handle, "patina_frame_get_stats", &frame->shown.stats, sizeof frame->shown.stats, stats);
}

size_t patina_frame_stats_json(const patina_frame *frame, char *buffer, size_t size)
{
    return frame ? pt_frame_stats_json(frame, buffer, size) : 0;
}

size_t patina_frame_plan_text(patina_frame *frame, const patina_scene *scene, char *buffer, size_t size)
{
    struct pt_plan plan;
    if (!frame || !scene)
        return 0;
    enter_clouds(scene, 1);
    if (pt_plan_create(scene, NULL, &plan)) { // a picture may be drawn by the device's threads meanwhile
        leave_clouds(scene);
        return 0;
    }
    pt_frame_share_planes(frame, &plan); // without memory it stays untold
    plan.mapped_cap = pt_pager_cap(frame->device, scene, &plan.round_bytes);
    plan.round_bytes = plan.mapped_cap ? plan.round_bytes : 0;
    plan.copied = frame->device->copies;
    size_t length = pt_plan_text(scene, &plan, buffer, size);
    pt_plan_destroy(&plan);
    leave_clouds(scene);
    return length;
}

int patina_frame_keep_planes(patina_frame *frame, uint32_t keep)
{
    if (!frame)
        return fail("patina_frame_keep_planes: frame is NULL");
    frame->planes.apart = keep != 0;
    return PATINA_OK;
}

int patina_frame_measure(patina_frame *frame, uint32_t measure)
{
    if (!frame)
        return fail("patina_frame_measure: frame is NULL");
    frame->measured = measure != 0;
    return PATINA_OK;
}

int patina_frame_dump_planes(const patina_frame *frame, const char *folder)
{
    if (!frame || !folder)
        return fail("patina_frame_dump_planes: frame or folder is NULL");
    return pt_frame_dump(frame, folder);
}
