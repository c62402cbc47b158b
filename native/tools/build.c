// SPDX-License-Identifier: GPL-3.0-or-later
// patina convert IN OUT.cloud: builds the cloud on the disk from windows of the file, and analyses it there. Whoever is killed leaves no
// file of that name but the one that was there before; the next run begins anew.
#include "tool.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

enum {
    WINDOW = 1 << 18,  // points
    BESIDE = 32 << 20, // bytes that a window and the program take beside the builder
    LEAST = 48 << 20,  // that a build takes
    UNKNOWN = 1 << 30, // and where nobody knows what is free
    QUIET_MS = 5000    // between two lines that say how far it is
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
    struct pt_whole own; // holds the names beside the file for this process
    const char *place;   // the built cloud: beside the file, where something follows
    const char *found;   // the analysed one: the file, or beside it, where it is made smaller
    uint64_t memory;
};

static int fail(const struct job *job, const char *what, const void *handle, int code)
{
    (void)job;
    tool_drain_log(1);
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

struct teller {
    struct report *report;
    atomic_int done;
};

static void tell(void *context)
{
    struct teller *teller = context;
    while (!atomic_load(&teller->done)) {
        pt_pause(20);
        report_look(teller->report);
    }
}

static int analyse(struct job *job)
{
    patina_analysis_desc desc = {.struct_size = sizeof desc, .keep_normals = 1};
    struct teller teller = {.report = &job->report};
    struct pt_thread thread;
    if (job->has_stations)
        tool_describe_stations(&job->stations, &desc);
    desc.free_space = desc.station_count > 1; // one alone sees through nothing
    report_begin(&job->report, "analysing the cloud");
    const int told = !pt_thread_start(&thread, tell, &teller, 0); // whoever has no thread for it hears nothing
    const int code = patina_cloud_analyse_file(job->place, &desc, job->memory, job->found, job->progress);
    atomic_store(&teller.done, 1);
    if (told)
        pt_thread_join(&thread);
    if (code == PATINA_ERROR_TOO_MANY_POINTS) {
        tool_say("note: %s is not analysed: it has more points than an analysis takes", job->build->out);
        job->found = job->place;
        return TOOL_OK;
    }
    return code ? fail(job, job->build->in, NULL, code) : TOOL_OK;
}

static int is_smaller(const struct tool_build *build) { return build->pack || build->drop_order; }

enum step { BUILT, ANALYSED, SMALLER }; // of pt_whole_steps

// The name beside the file of what a step makes.
static char *beside(const struct job *job, enum step step)
{
    const char *path = job->own.beside, *ending = pt_whole_steps[step];
    char *name = malloc(strlen(path) + strlen(ending) + 1);
    if (name)
        strcat(strcpy(name, path), ending);
    else
        tool_say("out of memory");
    return name;
}

static int save_into(const struct job *job, const char *from, const char *to)
{
    const patina_save_desc desc = {
        .struct_size = sizeof desc, .pack = (uint32_t)job->build->pack, .drop_order = (uint32_t)job->build->drop_order};
    patina_cloud *cloud = NULL;
    int code = patina_cloud_open(from, &cloud);
    if (!code)
        code = patina_cloud_save_as(cloud, to, &desc);
    const int result = code ? fail(job, from, cloud, code) : TOOL_OK;
    patina_cloud_destroy(cloud);
    return result;
}

static int read_info(const struct job *job, const char *path, patina_cloud_info *info)
{
    patina_cloud *cloud = NULL;
    int code = patina_cloud_open(path, &cloud);
    *info = (patina_cloud_info){.struct_size = sizeof *info};
    if (!code)
        code = patina_cloud_get_info(cloud, info);
    const int result = code ? fail(job, path, cloud, code) : TOOL_OK;
    patina_cloud_destroy(cloud);
    return result;
}

// A saved cloud becomes the one that is asked for, smaller where that is. In its own place too: what is mapped is replaced on no Windows, so it
// is closed before.
static int save_as(const struct job *job, const char *from)
{
    const char *out = job->build->out;
    const int itself = !strcmp(from, out);
    char *own = itself ? beside(job, SMALLER) : NULL, text[128];
    patina_cloud_info info;
    if (itself && !own)
        return TOOL_FAILED;
    int result = save_into(job, from, own ? own : out);
    const int error = own && !result ? pt_file_replace(out, own) : 0;
    if (error) {
        tool_say("%s: cannot be written: %s", out, pt_error_text(error, text, sizeof text));
        pt_file_remove(own);
        result = TOOL_FAILED;
    }
    free(own);
    if (result || !job->build->pack)
        return result;
    result = read_info(job, out, &info);
    if (!result)
        tool_say("note: packing moved positions by %.3g at most", info.packed_error);
    return result;
}

static int finish_cloud(struct job *job)
{
    patina_cloud_info info;
    int result = read_info(job, job->place, &info);
    if (!result && info.invalid_positions)
        tool_say("note: %llu points of %s are nowhere, and are not drawn: a coordinate is no finite number",
                 (unsigned long long)info.invalid_positions, job->build->in);
    if (!result && (job->build->unanalysed || info.has_shapes)) // or not to be
        return save_as(job, job->place);
    result = result ? result : analyse(job);
    if (result || job->found == job->build->out)
        return result;
    result = save_as(job, job->found);
    if (job->found != job->place) // which is the input where that is a saved cloud
        pt_file_remove(job->found);
    return result;
}

// A saved cloud needs no building; what is not analysed gets its name at once.
static int convert(struct job *job)
{
    const struct tool_build *build = job->build;
    const int built = tool_begins(build->in, "patina\n\x1a", 8);
    if (built && build->attribute)
        return tool_misuse("--attribute: a saved cloud has the one that it was made with");
    const int builds_beside = !built && (!build->unanalysed || is_smaller(build));
    const int finds_beside = !build->unanalysed && is_smaller(build);
    char *own = builds_beside ? beside(job, BUILT) : NULL, *found = finds_beside ? beside(job, ANALYSED) : NULL;
    int result = (builds_beside && !own) || (finds_beside && !found) ? TOOL_FAILED : TOOL_OK;
    job->place = built ? build->in : own ? own : build->out;
    job->found = found ? found : build->out;
    if (!result && !built)
        result = build_cloud(job);
    if (!result && (built || own)) {
        result = finish_cloud(job);
        if (own)
            pt_file_remove(own);
    }
    free(found);
    free(own);
    return result;
}

int tool_convert_to_cloud(const struct tool_build *build)
{
    const uint64_t share = pt_free_memory() / 3;
    struct job job = {.build = build, .memory = build->memory ? build->memory : share ? share : UNKNOWN};
    if (patina_progress_create(&job.progress)) {
        tool_say("out of memory");
        return TOOL_FAILED;
    }
    job.report = (struct report){.path = build->in, .progress = job.progress};
    tool_cancellable(job.progress, NULL);
    char text[128];
    const int error = pt_whole_begin(build->out, &job.own);
    if (error)
        tool_say("%s: cannot be written: %s", build->out, pt_error_text(error, text, sizeof text));
    const int result = error ? TOOL_FAILED : convert(&job);
    if (!error)
        pt_whole_end(&job.own, 0); // what was made has its name already
    tool_cancellable(NULL, NULL);
    tool_drain_log(1);
    patina_builder_destroy(job.builder);
    patina_rows_destroy(job.rows);
    tool_free_stations(&job.stations);
    patina_progress_destroy(job.progress);
    return result;
}
