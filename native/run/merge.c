// SPDX-License-Identifier: GPL-3.0-or-later
#include "merge.h"

#include "scene/clouds/fingerprint.h"

#include <stdlib.h>
#include <string.h>

// ---- files -----------------------------------------------------------------------------------------------------------

static int by_round_and_part(const void *a, const void *b)
{
    const struct pt_keys_head *first = &((const struct pt_key_file *)a)->head, *second = &((const struct pt_key_file *)b)->head;
    if (first->round != second->round)
        return first->round < second->round ? -1 : 1;
    return (first->part > second->part) - (first->part < second->part);
}

static int lacks(const struct pt_merge *merge, uint32_t part, uint32_t round)
{
    return pt_fail(merge->handle, PATINA_ERROR_FORMAT, "part %u of %u of round %u is missing", part, merge->of, round);
}

// The file behind `i`, in order, must be of this part and round.
static int check_place(const struct pt_merge *merge, uint32_t i, uint32_t part, uint32_t round)
{
    const struct pt_key_file *file = &merge->files[i], *first = merge->files;
    if (file->head.of != merge->of)
        return pt_fail(merge->handle, PATINA_ERROR_FORMAT, "%s is part %u of %u; %s is one of %u", file->path, file->head.part,
                       file->head.of, first->path, merge->of);
    if (i && by_round_and_part(file, file - 1) == 0)
        return pt_fail(merge->handle, PATINA_ERROR_FORMAT, "%s and %s are both part %u of %u of round %u", file[-1].path,
                       file->path, file->head.part, merge->of, file->head.round);
    if (file->head.round != round || file->head.part != part)
        return lacks(merge, part, round);
    if (file->head.picture != first->head.picture)
        return pt_fail(merge->handle, PATINA_ERROR_FORMAT, "%s and %s are of different pictures", file->path, first->path);
    if (file->head.before != merge->chain)
        return pt_fail(merge->handle, PATINA_ERROR_FORMAT, "%s follows on other files of the rounds before: scatter it anew",
                       file->path);
    return PATINA_OK;
}

static int check_places(struct pt_merge *merge)
{
    uint64_t sums = 0;
    merge->of = merge->files[0].head.of;
    for (uint32_t i = 0; i < merge->count; i++) {
        const uint32_t part = i % merge->of + 1, round = i / merge->of + 1;
        const int error = check_place(merge, i, part, round);
        if (error)
            return error;
        sums = pt_fingerprint(sums, &merge->files[i].head.check, sizeof(uint64_t));
        if (part == merge->of) {
            merge->chain = sums;
            merge->rounds = round;
        }
    }
    return merge->count % merge->of ? lacks(merge, merge->count % merge->of + 1, merge->rounds + 1) : PATINA_OK;
}

int pt_merge_open(struct pt_merge *merge, const struct pt_handle *handle, const char *const *paths, uint32_t count)
{
    *merge = (struct pt_merge){.handle = handle, .last = {.layer = UINT32_MAX}};
    merge->files = calloc(count + 1u, sizeof *merge->files);
    int error = merge->files ? PATINA_OK : pt_fail(handle, PATINA_ERROR_MEMORY, "a merge: out of memory");
    for (; merge->count < count && !error; merge->count += !error) {
        struct pt_key_file *file = &merge->files[merge->count];
        error = pt_key_file_open(file, handle, paths[merge->count]);
        if (error || (file->head.kind == PATINA_KEYS_PART && file->head.part && file->head.part <= file->head.of))
            continue;
        error = pt_fail(handle, PATINA_ERROR_FORMAT, "%s: no keys of a part, but what a round is told", file->path);
        pt_key_file_close(file);
    }
    if (error)
        return error;
    if (!count)
        return pt_fail(handle, PATINA_ERROR_EMPTY, "a merge without files");
    qsort(merge->files, count, sizeof *merge->files, by_round_and_part); // of two alike an error follows
    return check_places(merge);
}

void pt_merge_close(struct pt_merge *merge)
{
    for (uint32_t i = 0; i < merge->count; i++)
        pt_key_file_close(&merge->files[i]);
    free(merge->files);
    merge->files = NULL;
    merge->count = 0;
}

int pt_merge_begin(struct pt_merge *merge, const struct patina_scene *scene, const struct pt_plan *plan)
{
    const char *refused = pt_parts_refused(scene, plan);
    merge->last = (struct pt_keys_name){.layer = UINT32_MAX}; // it may begin once more
    if (refused)
        return pt_fail(merge->handle, PATINA_ERROR_UNSUPPORTED,
                       "%s not scattered in parts: render the picture whole, or in tiles", refused);
    if (pt_parts_digest(scene, plan) != merge->files[0].head.picture)
        return pt_fail(merge->handle, PATINA_ERROR_FORMAT, "%s is of another picture: its scene or settings differ",
                       merge->files[0].path);
    return PATINA_OK;
}

// ---- passes ----------------------------------------------------------------------------------------------------------

// What lies behind is known only of the rounds before: the parts are told where the next begins.
static int want_round(struct pt_merge *merge, struct pt_binder *binder, const struct pt_keys_name *name)
{
    const struct pt_plan *plan = binder->plan;
    const struct pt_buffer *limit = &binder->planes->at[PT_PLANE_LIMIT][0];
    const uint32_t *rect = plan->view.rect;
    const struct pt_keys_head head = {
        .kind = PATINA_KEYS_NEXT, .round = merge->rounds + 1, .picture = merge->files[0].head.picture, .before = merge->chain};
    struct pt_key_writer writer;
    if (!merge->next)
        return pt_fail(merge->handle, PATINA_ERROR_EMPTY, "the parts' keys of round %u are missing", merge->rounds + 1);
    float *plane = malloc(limit->size);
    int error = plane ? binder->device->ops->buffer_read(binder->device, limit, 0, plane, limit->size)
                      : pt_fail(merge->handle, PATINA_ERROR_MEMORY, "a merge: out of memory");
    if (!error)
        error = pt_key_writer_begin(&writer, merge->handle, merge->next, &head, NULL);
    if (!error) {
        error = pt_key_writer_limits(&writer, name, plane, plan->view.width, rect[1], rect[3] - rect[1]);
        error = pt_key_writer_end(&writer, error);
    }
    free(plane);
    merge->wanted = error ? 0 : head.round;
    return error ? error : PATINA_ERROR_CANCELLED;
}

int pt_merge_take(struct pt_merge *merge, struct pt_binder *binder, const struct patina_scene *scene,
                  const struct pt_pass *pass, const struct pt_round *round)
{
    const struct pt_plan *plan = binder->plan;
    const struct pt_keys_name name = pt_parts_name(plan, pass, round);
    const uint32_t *rect = plan->view.rect, width = plan->view.width, at = name.layer ? name.layer : 1;
    const size_t size = (size_t)(rect[3] - rect[1]) * width * sizeof(uint64_t);
    struct pt_buffer *keys;
    if (!memcmp(&name, &merge->last, sizeof name)) // points and discs: one plane
        return PATINA_OK;
    if (at > merge->rounds)
        return want_round(merge, binder, &name);
    int error = pt_bind(binder, &pass->refs[0], &keys);
    uint64_t *rows = error ? NULL : malloc(size + 1);
    if (!rows)
        return error ? error : pt_fail(merge->handle, PATINA_ERROR_MEMORY, "a merge: out of memory");
    for (size_t i = 0; i < size / sizeof *rows; i++)
        rows[i] = (uint64_t)PT_KEY_EMPTY_Z << 32 | PT_KEY_EMPTY_ID;
    for (uint32_t i = 0; i < merge->count && !error; i++)
        if (merge->files[i].head.round == at)
            error = pt_key_file_take(&merge->files[i], merge->handle, &name, pt_parts_ids(scene, plan), rows, width, rect[1],
                                     rect[3] - rect[1]);
    if (!error) // no pass writes beyond the rectangle's rows: planes are known to be empty there
        error = binder->device->ops->buffer_write(binder->device, keys, (size_t)rect[1] * width * sizeof *rows, rows, size);
    free(rows);
    merge->last = name;
    return error;
}
