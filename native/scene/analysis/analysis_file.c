// SPDX-License-Identifier: GPL-3.0-or-later
// Analysing saved clouds that memory has no room for (SPEC 13): the file is mapped, and so is what the analysis keeps of points.
#include "analysis.h"
#include "base/descriptor.h"
#include "base/progress.h"
#include "scene/clouds/page_sums.h"
#include "scene/clouds/parts.h"

#include <stdlib.h>
#include <string.h>

enum { PIECE = 1 << 20, LEAST_MEMORY = 16 << 20 };
#define OF_ANALYSIS 0.95 // of the progress

static void share_progress(patina_progress *progress, float begin, float whole, double from, double to)
{
    if (!progress)
        return;
    progress->begin = begin + (float)from * whole;
    progress->share = (float)(to - from) * whole;
}

static int write_arrays(struct pt_cloud_writer *writer, struct patina_cloud *cloud, struct pt_store *store,
                        patina_progress *progress)
{
    struct pt_section sections[PT_ARRAYS];
    pt_cloud_sections(cloud, sections);
    for (int i = 0; i < PT_ARRAYS; i++)
        for (uint64_t done = 0; done < sections[i].size; done += PIECE) {
            const uint64_t left = sections[i].size - done;
            pt_cloud_writer_add(writer, (enum pt_array)i, (const char *)*sections[i].data + done, left < PIECE ? left : PIECE);
            pt_store_look(store);
            pt_progress_set(progress, (i + (double)done / (double)sections[i].size) / PT_ARRAYS);
            if (pt_progress_cancelled(progress))
                return pt_fail(NULL, PATINA_ERROR_CANCELLED, "analysing the cloud was cancelled");
        }
    return PATINA_OK;
}

// Whose arrays may lie in the store; not its chunks.
static void close_cloud(struct patina_cloud *cloud, const struct pt_store *store)
{
    for (uint32_t i = 0; store && i < store->count; i++) {
        cloud->surfels = store->arrays[i].pages == cloud->surfels ? NULL : cloud->surfels;
        cloud->shapes = store->arrays[i].pages == cloud->shapes ? NULL : cloud->shapes;
        cloud->colors = store->arrays[i].pages == cloud->colors ? NULL : cloud->colors;
    }
    cloud->chunks = NULL;
    patina_cloud_destroy(cloud);
}

// Closes the cloud before the file is replaced, which may be its own.
static int write_cloud(struct patina_cloud *cloud, const char *path, struct pt_store *store, patina_progress *progress)
{
    struct patina_cloud head = *cloud; // whose chunks outlive it
    struct pt_cloud_writer *writer = NULL;
    int error = pt_cloud_writer_begin(path, &head, &writer);
    if (!error) {
        error = write_arrays(writer, &head, store, progress);
        error = error ? error : pt_pages_fail_lost(cloud);
        if (!error && pt_store_lost(store))
            error = pt_fail(NULL, PATINA_ERROR_FILE, "%s: what the analysis keeps beside it cannot be read back from the disk",
                            path);
        if (error)
            pt_cloud_writer_drop(writer);
    }
    close_cloud(cloud, store);
    if (!error)
        error = pt_cloud_writer_end(writer, &head);
    free(head.chunks);
    return error;
}

// Room on the disk for the file, and for what memory has none for.
static int ask_for_room(const char *path, const struct patina_cloud *cloud, int stored)
{
    uint64_t room, bytes = pt_cloud_mapped_bytes(cloud) + 4 * cloud->slots + (stored ? pt_analysis_memory(cloud) : 0);
    if (pt_disk_room(path, &room) || room >= bytes)
        return PATINA_OK;
    return pt_fail(NULL, PATINA_ERROR_FILE, "%s: analysing it takes %.1f GB on the disk, which has %.1f GB left", path,
                   (double)bytes / 1e9, (double)room / 1e9);
}

static int analyse(struct patina_cloud *cloud, const patina_analysis_desc *desc, uint64_t memory, const char *path,
                   patina_progress *progress)
{
    const float begin = progress ? progress->begin : 0.0f, share = progress ? progress->share : 0.0f,
                whole = share > 0.0f ? share : 1.0f;
    const int stored = pt_cloud_mapped_bytes(cloud) + pt_analysis_memory(cloud) > memory;
    struct pt_store room, *store = stored ? &room : NULL;
    struct pt_analysis analysis;
    int error = ask_for_room(path, cloud, stored);
    error = error ? error : pt_pages_refuse(cloud, memory / 2, progress);
    if (error) {
        patina_cloud_destroy(cloud);
        return error;
    }
    if (store)
        pt_store_open(store, path, cloud, memory);
    share_progress(progress, begin, whole, 0.0, OF_ANALYSIS);
    error = pt_analysis_compute(cloud, desc, store, progress, &analysis);
    if (!error) {
        error = pt_analysis_apply(cloud, &analysis);
        pt_analysis_free(&analysis);
    }
    share_progress(progress, begin, whole, OF_ANALYSIS, 1.0);
    if (error)
        patina_cloud_destroy(cloud);
    else
        error = write_cloud(cloud, path, store, progress);
    if (progress) {
        progress->begin = begin;
        progress->share = share;
    }
    if (store)
        pt_store_close(store);
    return error;
}

int patina_cloud_analyse_file(const char *from, const patina_analysis_desc *given, uint64_t memory, const char *to,
                              patina_progress *progress)
{
    patina_analysis_desc desc;
    patina_cloud *cloud = NULL;
    if (!from || !to || !*to)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_cloud_analyse_file: bad arguments");
    int error = pt_take(NULL, "patina_cloud_analyse_file", given, &desc, sizeof desc);
    if (error || (error = patina_cloud_open(from, &cloud)))
        return error;
    error = pt_parts_refuse(cloud, "patina_cloud_analyse_file");
    if (error || (error = pt_analysis_check(cloud, &desc))) {
        patina_cloud_destroy(cloud);
        return error;
    }
    memory = memory ? memory : pt_free_memory() / 3;
    error = analyse(cloud, &desc, memory > LEAST_MEMORY ? memory : LEAST_MEMORY, to, progress);
    if (!error)
        pt_progress_set(progress, 1.0);
    return error;
}
