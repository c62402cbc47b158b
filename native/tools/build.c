// SPDX-License-Identifier: GPL-3.0-or-later
// patina convert IN OUT.cloud: builds the cloud on the disk from windows of the file, and analyses it. Whoever is killed leaves no file of
// that name but the one that was there before; the next run begins anew.
#include "tool.h"
#include "base/pause.h"

#include <stdlib.h>
#include <string.h>

enum {
    WINDOW = 1 << 18,      // points
    BESIDE = 32 << 20,     // bytes that a window and the program take beside the builder
    LEAST = 48 << 20,      // that a build takes
    ANALYSIS_A_POINT = 60, // bytes: 57 were measured of 4 million, 24 of them pages of the file
    QUIET_MS = 5000        // between two lines that say how far it is
};

// ---- how far it is, on standard error --------------------------------------------------------------------------------

struct report {
    const char *path, *doing;
    patina_progress *progress;
    double told; // when
    int percent; // that was told
};

static void report_begin(struct report *report, const char *doing)
{
    report->doing = doing;
    report->told = pt_milliseconds();
    report->percent = 0;
}

static void report_look(struct report *report)
{
    const int percent = (int)(100.0f * patina_progress_value(report->progress));
    const double now = pt_milliseconds();
    if (now - report->told < QUIET_MS || percent <= report->percent)
        return;
    tool_say("%s: %s, %d %%", report->path, report->doing, percent);
    report->told = now;
    report->percent = percent;
}

// Waits for a call on a thread of its own; what it returned, with its message where that of this thread is asked for.
static int finish(struct report *report, patina_task *task)
{
    while (!patina_task_done(task)) {
        pt_pause(20);
        report_look(report);
    }
    return patina_task_wait(task);
}

// ---- the file, window by window --------------------------------------------------------------------------------------

struct job {
    const struct tool_build *build;
    patina_progress *progress;
    struct report report;
    patina_rows *rows;
    patina_builder *builder;
    struct tool_stations stations;
    int has_stations;
    char *place; // where the builder writes: beside the file, where an analysis follows
    uint64_t memory;
};

static int fail(const struct job *job, const char *what, const void *handle, int code)
{
    tool_cancellable(NULL, NULL);
    tool_drain_log(1);
    (void)job;
    return tool_failed(what, handle, code);
}

static int is_attribute(const patina_file *file, const char *name)
{
    patina_file_info info = {.struct_size = sizeof info};
    patina_file_attribute attribute = {.struct_size = sizeof attribute};
    int code = patina_file_get_info(file, &info);
    for (uint32_t i = 0; i < info.attributes && !code; i++)
        if (!(code = patina_file_get_attribute(file, i, &attribute)) && !strcmp(attribute.name, name))
            return 1;
    return 0;
}

// All points into the builder. A tool_exit.
static int read_points(struct job *job)
{
    const struct tool_build *build = job->build;
    patina_rows_info info = {.struct_size = sizeof info};
    int code = patina_rows_get_info(job->rows, &info), said = 0;
    if (code)
        return fail(job, build->in, job->rows, code);
    if (info.whole[0])
        tool_say("note: %s is read whole: %s", build->in, info.whole);
    report_begin(&job->report, "reading points");
    for (;;) {
        patina_file *file = NULL;
        if ((code = patina_rows_next(job->rows, WINDOW, &file)))
            return fail(job, build->in, job->rows, code);
        if (!file)
            return TOOL_OK;
        if (build->attribute && !said && !is_attribute(file, build->attribute)) {
            tool_say("there is no attribute '%s' in '%s'", build->attribute, build->in);
            patina_file_destroy(file);
            return TOOL_FAILED;
        }
        said = 1;
        if (info.whole[0] && (code = tool_take_stations(file, &job->stations))) {
            const int result = fail(job, build->in, file, code);
            patina_file_destroy(file);
            return result;
        }
        job->has_stations = info.whole[0] != 0;
        code = patina_builder_add_file(job->builder, file, build->attribute);
        patina_file_destroy(file);
        if (code)
            return fail(job, build->out, job->builder, code);
        report_look(&job->report);
    }
}

// How many points there are, for the disk is asked for their room; 0 where that is not known yet.
static int begin_build(struct job *job)
{
    patina_rows_info info = {.struct_size = sizeof info};
    int code = patina_rows_get_info(job->rows, &info);
    const patina_builder_desc desc = {
        .struct_size = sizeof desc, .memory = job->memory > LEAST ? job->memory - BESIDE : LEAST - BESIDE, .count = info.count};
    if (!code)
        code = patina_builder_begin(job->place, &desc, &job->builder);
    return code ? fail(job, job->build->out, NULL, code) : TOOL_OK;
}

static int build_cloud(struct job *job)
{
    int code = patina_rows_open(job->build->in, job->progress, &job->rows);
    if (code)
        return fail(job, job->build->in, NULL, code);
    int result = begin_build(job);
    if (!result)
        result = read_points(job);
    patina_rows_destroy(job->rows);
    job->rows = NULL;
    if (result)
        return result;
    patina_task *task = NULL;
    report_begin(&job->report, "building the cloud");
    code = patina_task_end_build(job->builder, job->progress, &task);
    if (!code)
        code = finish(&job->report, task);
    if (code)
        result = fail(job, job->build->out, task, code);
    patina_task_destroy(task);
    patina_builder_destroy(job->builder); // and with it what was sorted, before the analysis needs room
    job->builder = NULL;
    return result;
}

// ---- its analysis ----------------------------------------------------------------------------------------------------

// Whether the analysis of a cloud is made, and why not.
static int is_analysed(const struct job *job, const patina_cloud_info *info)
{
    const double needed = (double)ANALYSIS_A_POINT * (double)info->drawn;
    if (job->build->analysis != TOOL_ANALYSED_WHERE_NEEDED || needed <= (double)job->memory)
        return 1;
    tool_say("note: written without an analysis, which would take %.1f GB of memory, and may take %.1f: --analysis on makes it",
             1e-9 * needed, 1e-9 * (double)job->memory);
    return 0;
}

static int analyse(struct job *job, patina_cloud *cloud)
{
    patina_analysis_desc desc = {.struct_size = sizeof desc, .keep_normals = 1};
    if (job->has_stations)
        tool_describe_stations(&job->stations, &desc);
    desc.free_space = desc.station_count > 1; // one alone sees through nothing
    patina_task *task = NULL;
    report_begin(&job->report, "analysing the cloud");
    int code = patina_task_analyse(cloud, &desc, job->progress, &task);
    if (!code)
        code = finish(&job->report, task);
    if (!code)
        code = patina_task_apply(task);
    const int result = code ? fail(job, job->build->in, task, code) : TOOL_OK;
    patina_task_destroy(task);
    return result;
}

static int finish_cloud(struct job *job, patina_cloud **cloud)
{
    patina_cloud_info info = {.struct_size = sizeof info};
    int code = patina_cloud_open(job->place, cloud);
    if (!code)
        code = patina_cloud_get_info(*cloud, &info);
    if (code)
        return fail(job, job->place, NULL, code);
    if (info.invalid_positions)
        tool_say("note: %llu points of %s are nowhere, and are not drawn: a coordinate is no finite number",
                 (unsigned long long)info.invalid_positions, job->build->in);
    if (is_analysed(job, &info)) {
        const int result = analyse(job, *cloud);
        if (result)
            return result;
    }
    tool_cancellable(NULL, NULL);
    code = patina_cloud_save(*cloud, job->build->out);
    return code ? fail(job, job->build->out, *cloud, code) : TOOL_OK;
}

static char *beside(const char *path)
{
    static const char ending[] = ".built";
    char *name = malloc(strlen(path) + sizeof ending);
    if (name)
        memcpy(memcpy(name, path, strlen(path)) + strlen(path), ending, sizeof ending);
    return name;
}

int tool_convert_to_cloud(const struct tool_build *build)
{
    struct job job = {.build = build, .memory = build->memory ? build->memory : pt_free_memory() / 3};
    patina_cloud *cloud = NULL;
    const int analysed = build->analysis != TOOL_UNANALYSED;
    int result = TOOL_OK;
    job.place = analysed ? beside(build->out) : NULL;
    if ((analysed && !job.place) || patina_progress_create(&job.progress)) {
        free(job.place);
        tool_say("out of memory");
        return TOOL_FAILED;
    }
    char *own = job.place;
    job.place = analysed ? own : (char *)(uintptr_t)build->out;
    job.report = (struct report){.path = build->in, .progress = job.progress};
    tool_cancellable(job.progress, NULL);
    result = build_cloud(&job);
    if (!result && analysed)
        result = finish_cloud(&job, &cloud);
    tool_cancellable(NULL, NULL);
    tool_drain_log(1);
    patina_cloud_destroy(cloud);
    if (analysed)
        pt_file_remove(own);
    patina_builder_destroy(job.builder);
    patina_rows_destroy(job.rows);
    tool_free_stations(&job.stations);
    patina_progress_destroy(job.progress);
    free(own);
    return result;
}
