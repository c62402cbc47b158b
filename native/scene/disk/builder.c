// SPDX-License-Identifier: GPL-3.0-or-later
// Taking in the points of a cloud that is built on the disk: records, by level and place, onto tapes.
#include "builder.h"
#include "base/descriptor.h"
#include "io/file.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    BATCH = 1 << 15,
    SHARE = 1 << 10,
    LEAST_MEMORY = 16 << 20,
    NOWHERE = 0xFFFF,
    BLOCK_LEAST = 1 << 12,
    BLOCK_MOST = 1 << 18
};
enum { COLOR = 2, OPACITY = 3 }; // fields
enum { ALL_FIELDS = (1 << PT_BUILDER_FIELDS) - 1 };
enum { ABOVE_BYTE = 1, LOW_BYTE = 2, UNLIKE = 4 };

// Cells of a level's grid are 2^bits a side.
static const uint8_t level_bits[PT_BUILDER_LEVELS] = {3, 1, 1, 0, 0, 0, 0, 0, 0};

static const struct {
    size_t at; // in patina_cloud_desc
    uint32_t components;
    const char *name;
} fields[PT_BUILDER_FIELDS] = {
    {offsetof(patina_cloud_desc, position), 3, "position"}, {offsetof(patina_cloud_desc, normal), 3, "normal"},
    {offsetof(patina_cloud_desc, color), 3, "color"},       {offsetof(patina_cloud_desc, opacity), 1, "opacity"},
    {offsetof(patina_cloud_desc, radius), 1, "radius"},     {offsetof(patina_cloud_desc, scalar), 1, "scalar"},
    {offsetof(patina_cloud_desc, classes), 1, "classes"}};

static const patina_array *array_of(const patina_cloud_desc *desc, int field)
{
    return (const patina_array *)(const void *)((const char *)desc + fields[field].at);
}

uint32_t pt_builder_level_first(uint32_t level)
{
    uint32_t first = 0;
    for (uint32_t f = 0; f < level; f++)
        first += 1u << 3 * level_bits[f];
    return first;
}

int pt_builder_fail(struct patina_builder *builder, int error)
{
    char text[128];
    builder->failed = error == ENOMEM ? PATINA_ERROR_MEMORY : PATINA_ERROR_FILE;
    return error == ENOMEM ? pt_fail(&builder->handle, builder->failed, "%s: out of memory", builder->path)
                           : pt_fail(&builder->handle, builder->failed, "%s: cannot be written: %s", builder->path,
                                     pt_error_text(error, text, sizeof text));
}

// ---- begin -------------------------------------------------------------------------------------------------------------

static void set_grid(struct patina_builder *builder, const double box_min[3], const double box_max[3])
{
    double edge = 0.0;
    for (int k = 0; k < 3; k++) {
        builder->cell_min[k] = box_min[k];
        edge = fmax(edge, box_max[k] - box_min[k]);
    }
    builder->cell = edge > 0.0 && isfinite(8.0 / edge) ? 8.0 / edge : 0.0;
    builder->placed = 1;
}

static int is_box(const double box_min[3], const double box_max[3])
{
    double edge = 0.0;
    for (int k = 0; k < 3; k++) {
        if (!isfinite(box_min[k]) || !isfinite(box_max[k]) || box_max[k] < box_min[k])
            return 0;
        edge = fmax(edge, box_max[k] - box_min[k]);
    }
    return edge > 0.0;
}

int patina_builder_begin(const char *path, const patina_builder_desc *given, patina_builder **out)
{
    patina_builder_desc desc;
    if (!path || !*path || !out)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_builder_begin: bad arguments");
    *out = NULL;
    int error = pt_take(NULL, "patina_builder_begin", given, &desc, sizeof desc);
    if (error)
        return error;
    const uint64_t memory = desc.memory ? desc.memory : pt_free_memory() / 3;
    desc.memory = memory > LEAST_MEMORY ? memory : LEAST_MEMORY;
    struct patina_builder *builder = calloc(1, sizeof *builder);
    if (!builder)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "%s: out of memory", path);
    pt_handle_init(&builder->handle);
    builder->desc = desc;
    for (uint32_t level = 0; level < PT_BUILDER_LEVELS; level++)
        builder->level_first[level] = (uint16_t)pt_builder_level_first(level);
    builder->path = malloc(strlen(path) + 1);
    builder->pool = pt_pool_create(desc.threads, 0);
    builder->targets = malloc(BATCH * sizeof *builder->targets);
    builder->places = malloc(BATCH * sizeof *builder->places);
    for (int k = 0; k < 3; k++) {
        builder->box_min[k] = INFINITY;
        builder->box_max[k] = -INFINITY;
    }
    if (is_box(desc.box_min, desc.box_max))
        set_grid(builder, desc.box_min, desc.box_max);
    uint32_t block = BLOCK_LEAST;
    while (block < BLOCK_MOST && block < desc.memory >> 11) // of all buckets together less than a third of it
        block *= 2;
    if (!builder->path || !builder->pool || !builder->targets || !builder->places) {
        patina_builder_destroy(builder);
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "%s: out of memory", path);
    }
    memcpy(builder->path, path, strlen(path) + 1);
    if ((error = pt_spill_open(&builder->spill, path, block))) {
        error = pt_builder_fail(builder, error);
        patina_builder_destroy(builder);
        return error;
    }
    *out = builder;
    return PATINA_OK;
}

void patina_builder_destroy(patina_builder *builder)
{
    if (!builder)
        return;
    for (int i = 0; i < PT_BUILDER_BUCKETS; i++)
        pt_tape_drop(&builder->spill, &builder->buckets[i].tape);
    pt_spill_close(&builder->spill);
    pt_pages_free(builder->waiting, (size_t)builder->waiting_room * builder->record);
    pt_pool_destroy(builder->pool);
    free(builder->records);
    free(builder->places);
    free(builder->targets);
    free(builder->path);
    pt_handle_destroy(&builder->handle);
    free(builder);
}

// ---- records -------------------------------------------------------------------------------------------------------------

uint64_t pt_builder_slot_bytes(const struct patina_builder *builder)
{
    const uint32_t color = builder->shape.color.type == PATINA_UINT8 ? 3 : 12;
    return 20 + (builder->size[COLOR] ? color : 0) + (builder->size[3] ? 1 : 0) + (builder->size[4] ? 4 : 0) +
           (builder->size[5] ? 4 : 0) + (builder->size[6] ? 1 : 0);
}

// Before anything is written.
static int ask_for_room(struct patina_builder *builder)
{
    uint64_t room;
    const uint64_t bytes = builder->desc.count * (builder->record + pt_builder_slot_bytes(builder));
    if (pt_disk_room(builder->path, &room) || room >= bytes)
        return PATINA_OK;
    builder->failed = PATINA_ERROR_FILE;
    return pt_fail(&builder->handle, PATINA_ERROR_FILE, "%s: building it takes %.1f GB on the disk, which has %.1f GB left",
                   builder->path, (double)bytes / 1e9, (double)room / 1e9);
}

static int take_shape(struct patina_builder *builder, const patina_cloud_desc *piece)
{
    builder->shape = *piece;
    for (int i = 0; i < PT_BUILDER_FIELDS; i++) {
        const patina_array *array = array_of(piece, i);
        builder->offset[i] = builder->record;
        builder->size[i] = array->data ? fields[i].components * (uint32_t)pt_type_size(array->type) : 0;
        builder->record += builder->size[i];
        builder->nonzero |= builder->size[i] ? 0 : 1u << i; // is not looked for
    }
    builder->number = builder->record;
    builder->record += sizeof(uint32_t);
    builder->records = malloc((size_t)BATCH * builder->record);
    if (!builder->placed) {
        builder->waiting_room = builder->desc.memory / 8 / builder->record;
        builder->waiting = pt_pages_alloc((size_t)builder->waiting_room * builder->record);
    }
    if (!builder->records || (!builder->placed && !builder->waiting))
        return pt_builder_fail(builder, ENOMEM);
    return ask_for_room(builder);
}

static int check_shape(struct patina_builder *builder, const patina_cloud_desc *piece)
{
    for (int i = 0; i < PT_BUILDER_FIELDS; i++) {
        const patina_array *array = array_of(piece, i);
        if ((array->data != NULL) != (builder->size[i] != 0) ||
            (array->data && array->type != array_of(&builder->shape, i)->type))
            return pt_fail(&builder->handle, PATINA_ERROR_ARGUMENT, "%s: not as in the first piece", fields[i].name);
    }
    if (memcmp(piece->origin, builder->shape.origin, sizeof piece->origin))
        return pt_fail(&builder->handle, PATINA_ERROR_ARGUMENT, "origin: not as in the first piece");
    return PATINA_OK;
}

void pt_builder_view(const struct patina_builder *builder, const char *records, uint64_t count, patina_cloud_desc *desc)
{
    *desc = builder->shape;
    desc->count = count;
    desc->threads = builder->desc.threads;
    for (int i = 0; i < PT_BUILDER_FIELDS; i++) {
        patina_array *array = (patina_array *)(void *)((char *)desc + fields[i].at);
        array->data = builder->size[i] ? records + builder->offset[i] : NULL;
        array->components = fields[i].components;
        array->stride = builder->record;
    }
}

struct batch {
    struct patina_builder *builder;
    const patina_cloud_desc *piece;
    uint64_t first; // of the piece's points
    char *records;
    uint32_t count;
    atomic_ullong invalid;
};

// A field's bytes: those of most files as a few words.
static inline void copy_field(char *to, const char *from, uint32_t size)
{
    switch (size) {
    case 1: *to = *from; break;
    case 2: memcpy(to, from, 2); break;
    case 4: memcpy(to, from, 4); break;
    case 6: memcpy(to, from, 6); break;
    case 12: memcpy(to, from, 12); break;
    default: memcpy(to, from, size);
    }
}

// Of the fields whose bits are unset, those of which the record has a byte that is not zero.
static unsigned look_for_values(const struct patina_builder *builder, const char *record, unsigned nonzero)
{
    for (int k = 0; k < PT_BUILDER_FIELDS; k++)
        for (uint32_t j = 0; j < builder->size[k] && !(nonzero & 1u << k); j++)
            nonzero |= record[builder->offset[k] + j] ? 1u << k : 0;
    return nonzero;
}

struct seen { // bits of 16-bit colours
    unsigned all, unlike;
};

static inline void look_at_color(const char *color, struct seen *seen)
{
    uint16_t rgb[3];
    memcpy(rgb, color, sizeof rgb);
    for (int k = 0; k < 3; k++) {
        seen->all |= rgb[k];
        seen->unlike |= (rgb[k] >> 8 ^ rgb[k]) & 255u;
    }
}

static uint32_t level_of(uint32_t number)
{
    uint32_t hash = number + 0x9E3779B9u; // a murmur hash's end: neighbours in the file go to any level
    hash = (hash ^ hash >> 16) * 0x85EBCA6Bu;
    hash = (hash ^ hash >> 13) * 0xC2B2AE35u;
    hash ^= hash >> 16;
    uint32_t level = 0;
    while (level < PT_BUILDER_LEVELS - 1 && !(hash >> (30 - 2 * level) & 3u))
        level++;
    return level;
}

uint32_t pt_builder_cell(const double p[3], const double cell_min[3], double cell, uint32_t bits)
{
    uint32_t grid[3];
    const double most = (double)((1u << bits) - 1);
    for (int k = 0; k < 3; k++) {
        const double g = (p[k] - cell_min[k]) * cell;
        grid[k] = g > 0.0 ? g < most ? (uint32_t)g : (uint32_t)most : 0u;
    }
    return pt_morton_code(grid[0], grid[1], grid[2]);
}

// The bucket of a point, by its level and place.
static uint16_t target_of(const struct patina_builder *builder, uint32_t number, const double p[3])
{
    const uint32_t level = level_of(number), cell = pt_builder_cell(p, builder->cell_min, builder->cell, 3);
    return (uint16_t)(builder->level_first[level] + (cell >> 3 * (3 - level_bits[level])));
}

static void assemble(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct batch *batch = context;
    struct patina_builder *builder = batch->builder;
    const patina_array *arrays[PT_BUILDER_FIELDS];
    const int colors = builder->desc.narrow_colors && builder->size[COLOR] == 6;
    struct seen seen = {0, 0};
    unsigned nonzero = atomic_load(&builder->nonzero);
    uint64_t invalid = 0;
    (void)thread;
    for (int k = 0; k < PT_BUILDER_FIELDS; k++)
        arrays[k] = array_of(batch->piece, k);
    for (uint32_t i = begin * SHARE; i < end * SHARE && i < batch->count; i++) {
        char *record = batch->records + (size_t)i * builder->record;
        const uint64_t from = batch->first + i;
        const uint32_t number = (uint32_t)(builder->count +
                                           i); // beyond 2^32 nobody is told it, but levels are still a matter of it
        double *p = builder->places[i];
        pt_cloud_position(batch->piece, from, p);
        const int finite = isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2]);
        invalid += !finite;
        builder->targets[i] = !finite || (builder->size[OPACITY] && !pt_cloud_draws(batch->piece, from, p)) ? NOWHERE
                              : builder->placed ? target_of(builder, number, p)
                                                : 0;
        for (int k = 0; k < PT_BUILDER_FIELDS; k++)
            if (builder->size[k])
                copy_field(record + builder->offset[k], (const char *)arrays[k]->data + from * arrays[k]->stride,
                           builder->size[k]);
        memcpy(record + builder->number, &number, sizeof number);
        if (colors)
            look_at_color(record + builder->offset[COLOR], &seen);
        if (nonzero != ALL_FIELDS)
            nonzero = look_for_values(builder, record, nonzero);
    }
    atomic_fetch_or(&builder->nonzero, nonzero);
    atomic_fetch_or(&builder->wide_colors,
                    (seen.all > 255 ? ABOVE_BYTE : 0) | (seen.all & 255 ? LOW_BYTE : 0) | (seen.unlike ? UNLIKE : 0));
    atomic_fetch_add(&batch->invalid, invalid);
}

// ---- places ------------------------------------------------------------------------------------------------------------

static void box_add(double box_min[3], double box_max[3], const double p[3])
{
    for (int k = 0; k < 3; k++) {
        box_min[k] = p[k] < box_min[k] ? p[k] : box_min[k];
        box_max[k] = p[k] > box_max[k] ? p[k] : box_max[k];
    }
}

void pt_builder_extend(struct pt_bucket *bucket, const double p[3])
{
    if (!bucket->count++) {
        memcpy(bucket->box_min, p, sizeof bucket->box_min);
        memcpy(bucket->box_max, p, sizeof bucket->box_max);
    } else {
        box_add(bucket->box_min, bucket->box_max, p);
    }
}

static int place(struct patina_builder *builder, struct batch *batch)
{
    for (uint32_t i = 0; i < batch->count; i++) {
        if (builder->targets[i] == NOWHERE)
            continue;
        struct pt_bucket *bucket = &builder->buckets[builder->targets[i]];
        builder->drawn++;
        pt_builder_extend(bucket, builder->places[i]);
        pt_tape_write(&builder->spill, &bucket->tape, batch->records + (size_t)i * builder->record, builder->record);
    }
    return builder->spill.error ? pt_builder_fail(builder, builder->spill.error) : PATINA_OK;
}

int pt_builder_drain(struct patina_builder *builder)
{
    patina_cloud_desc desc;
    int error = PATINA_OK;
    if (builder->placed)
        return PATINA_OK;
    set_grid(builder, builder->box_min, builder->box_max);
    pt_builder_view(builder, builder->waiting, builder->waiting_count, &desc);
    for (uint64_t done = 0; done < builder->waiting_count && !error; done += BATCH) {
        const uint64_t left = builder->waiting_count - done;
        struct batch batch = {.builder = builder, .records = builder->waiting + done * builder->record};
        batch.count = (uint32_t)(left < BATCH ? left : BATCH);
        for (uint32_t i = 0; i < batch.count; i++) {
            uint32_t number;
            memcpy(&number, batch.records + (size_t)i * builder->record + builder->number, sizeof number);
            pt_cloud_position(&desc, done + i, builder->places[i]);
            builder->targets[i] = target_of(builder, number, builder->places[i]);
        }
        error = place(builder, &batch);
    }
    pt_pages_free(builder->waiting, (size_t)builder->waiting_room * builder->record);
    builder->waiting = NULL;
    return error;
}

static int wait_or_place(struct patina_builder *builder, struct batch *batch)
{
    if (builder->placed)
        return place(builder, batch);
    for (uint32_t i = 0; i < batch->count; i++)
        if (builder->targets[i] != NOWHERE)
            box_add(builder->box_min, builder->box_max, builder->places[i]);
    if (builder->waiting_count + batch->count > builder->waiting_room) {
        uint16_t *targets = malloc(BATCH * sizeof *targets); // of the batch, which are not places yet
        double(*places)[3] = malloc(BATCH * sizeof *places);
        if (targets && places) {
            memcpy(targets, builder->targets, BATCH * sizeof *targets);
            memcpy(places, builder->places, BATCH * sizeof *places);
        }
        int error = !targets || !places ? pt_builder_fail(builder, ENOMEM) : pt_builder_drain(builder);
        if (!error) {
            memcpy(builder->places, places, BATCH * sizeof *places);
            for (uint32_t i = 0; i < batch->count; i++)
                builder->targets[i] = targets[i] == NOWHERE ? targets[i]
                                                            : target_of(builder, (uint32_t)builder->count + i, places[i]);
            error = place(builder, batch);
        }
        free(targets);
        free(places);
        return error;
    }
    for (uint32_t i = 0; i < batch->count; i++)
        if (builder->targets[i] != NOWHERE)
            memcpy(builder->waiting + builder->record * builder->waiting_count++, batch->records + (size_t)i * builder->record,
                   builder->record);
    return PATINA_OK;
}

int patina_builder_add(patina_builder *builder, const patina_cloud_desc *given)
{
    patina_cloud_desc piece;
    if (!builder || !given)
        return pt_fail(builder ? &builder->handle : NULL, PATINA_ERROR_ARGUMENT, "patina_builder_add: bad arguments");
    if (builder->failed || builder->ended)
        return pt_fail(&builder->handle, builder->failed ? builder->failed : PATINA_ERROR_ARGUMENT,
                       "patina_builder_add: the build %s", builder->failed ? "failed before" : "has ended");
    int error = pt_take(&builder->handle, "patina_builder_add", given, &piece, sizeof piece);
    if (error || (error = pt_cloud_check_desc(&piece)))
        return pt_fail_again(&builder->handle, error);
    if (!piece.count)
        return PATINA_OK;
    if ((error = builder->record ? check_shape(builder, &piece) : take_shape(builder, &piece)))
        return error;
    for (uint64_t done = 0; done < piece.count && !error; done += BATCH) {
        const uint64_t left = piece.count - done;
        struct batch batch = {.builder = builder, .piece = &piece, .first = done, .records = builder->records};
        batch.count = (uint32_t)(left < BATCH ? left : BATCH);
        pt_parallel(builder->pool, (batch.count + SHARE - 1) / SHARE, 1, assemble, &batch);
        builder->invalid_positions += batch.invalid;
        error = wait_or_place(builder, &batch);
        builder->count += batch.count;
    }
    return error;
}
