// SPDX-License-Identifier: GPL-3.0-or-later
// Long calls on threads of their own, a part of patina.h, which includes it. Its conventions and thread rules hold here too.
#ifndef PATINA_TASKS_H
#define PATINA_TASKS_H

#ifndef PATINA_H
#error "include patina/patina.h"
#endif

#ifdef __cplusplus
extern "C" {
#endif

// ---- tasks: long calls that return at once and run on a thread of their own ------------------------------------------

// Each starts one call. Handles and arrays that it is given must stay until the task is done; descriptors are copied. Stop
// it with patina_frame_cancel or patina_progress_cancel.

// A pass that a task reads once its picture is done: the arguments of patina_frame_read.
typedef struct patina_read {
    uint32_t pass;
    float *pixels;
    size_t size;
} patina_read;

// patina_frame_render, then patina_frame_read of each of `count` reads, which must stay like other arrays; 0: none.
PATINA_API int patina_task_render(patina_frame *frame, const patina_scene *scene, const patina_read *reads, uint32_t count,
                                  patina_task **out);
// The same of patina_frame_refine.
PATINA_API int patina_task_refine(patina_frame *frame, const patina_scene *scene, double ms, const patina_read *reads,
                                  uint32_t count, patina_task **out);
PATINA_API int patina_task_build(const patina_cloud_desc *desc, patina_progress *progress,
                                 patina_task **out); // patina_cloud_create
PATINA_API int patina_task_set_colors(patina_cloud *cloud, const patina_array *color,
                                      patina_task **out); // patina_cloud_set_colors
// patina_cloud_analyse beside frames: the cloud stays as it is, and may be drawn, until patina_task_apply takes what was found;
// no frame may be rendering it then. stations and station must live until the task is done.
PATINA_API int patina_task_analyse(patina_cloud *cloud, const patina_analysis_desc *desc, patina_progress *progress,
                                   patina_task **out);
PATINA_API int patina_task_apply(patina_task *task); // waits; PATINA_ERROR_EMPTY the second time or for other tasks
// Two numbers that tell whether points changed: of count, positions, normals, opacities, radii and classes; of count, colours
// and scalars. Not
// against forgery. Arrays must be tightly packed (stride 0), else the task fails with PATINA_ERROR_ARGUMENT. `values` are
// written once the task is done. About as fast as memory is read.
PATINA_API int patina_task_fingerprint(const patina_cloud_desc *desc, uint64_t values[2], patina_task **out);
PATINA_API int patina_task_grid_normals(const patina_grid_desc *grid, patina_progress *progress, float *normals,
                                        patina_task **out);                                           // patina_grid_normals
PATINA_API int patina_task_open_file(const char *path, patina_progress *progress, patina_task **out); // patina_file_open
PATINA_API int patina_task_save(const patina_cloud *cloud, const char *path, patina_task **out);      // patina_cloud_save
// patina_builder_add, while the host reads the next piece: what the arrays of desc point to must stay as it is, and nothing else is asked
// of the builder, until the task is done.
PATINA_API int patina_task_add_to_build(patina_builder *builder, const patina_cloud_desc *desc, patina_task **out);
PATINA_API int patina_task_end_build(patina_builder *builder, patina_progress *progress,
                                     patina_task **out); // patina_builder_end
// patina_cloud_analyse_file; what desc points to must stay until the task is done, the paths are copied.
PATINA_API int patina_task_analyse_file(const char *from, const patina_analysis_desc *desc, uint64_t memory, const char *to,
                                        patina_progress *progress, patina_task **out);
PATINA_API int patina_task_verify(const char *path, patina_progress *progress, patina_task **out); // patina_cloud_verify
// patina_cloud_open_at, then patina_cloud_thin of it. offset: 3 numbers, copied. The cloud is closed again. hidden must stay until the
// task is done.
PATINA_API int patina_task_thin(const char *path, const double *offset, const uint8_t *hidden, size_t size, uint64_t room,
                                float *positions, float *colors, float *normals, float *scalars, uint64_t *count,
                                patina_task **out);
PATINA_API int patina_task_done(const patina_task *task); // 1 when the call has ended; does not block
// Waits for the end and returns what the call returned; its message is at the task.
PATINA_API int patina_task_wait(patina_task *task);
// Waits, and gives ownership of the cloud that patina_task_build made; PATINA_ERROR_EMPTY the second time or without one.
PATINA_API int patina_task_take_cloud(patina_task *task, patina_cloud **out);
// The same for the file that patina_task_open_file opened.
PATINA_API int patina_task_take_file(patina_task *task, patina_file **out);
PATINA_API void patina_task_destroy(patina_task *task); // waits; a cloud or file that was not taken goes too

#ifdef __cplusplus
}
#endif
#endif
