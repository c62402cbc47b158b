// SPDX-License-Identifier: GPL-3.0-or-later
// The end of a build on the disk: level by level, coarse ones first, what lies near each other becomes chunks, as much at a time as memory
// holds; what does not fit is divided by place. Chunks' arrays go onto tapes, for a file's sizes are known when all are there.
#include "builder.h"
#include "scene/clouds/fingerprint.h"
#include "base/progress.h"
#include "shared/words.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// From 1M points on in levels, of which the coarsest has 64k at most: a picture's worth of points reads in an instant.
enum {
    ONE_LEVEL = 1 << 20,
    COARSEST = 1 << 16,
    PARTS = 64,
    PART_BITS = 2,
    DEPTH_MOST = 12,
    PART_LEAST = 4096,
    PIECE = 1 << 20,
    MOST_AT_A_TIME = 1 << 30 // points: a cloud that is built in memory counts its slots by 31 bits
};

struct finish {
    struct patina_builder *builder;
    struct patina_progress *progress;
    struct patina_cloud cloud; // its numbers, and chunks
    uint32_t chunk_room;
    struct pt_tape tapes[PT_ARRAYS];
    uint64_t most; // points at a time
    char *records; // room for them, once there are any, and for their sorting words
    uint64_t *words;
    uint64_t done;
    float least_scalar, most_scalar;
    int translucent, any_part;
    uint32_t levels, finer; // in all; than the one at hand
    float progress_begin, progress_share;
};

// ---- the caller's progress, of which a call within has a part ------------------------------------------------------------

static void share_progress(const struct finish *finish, double from, double to)
{
    struct patina_progress *progress = finish->progress;
    const double whole = finish->progress_share > 0 ? (double)finish->progress_share : 1.0;
    if (progress) {
        progress->begin = (float)((double)finish->progress_begin + from * whole);
        progress->share = (float)((to - from) * whole);
    }
}

static void restore_progress(const struct finish *finish)
{
    if (finish->progress) {
        finish->progress->begin = finish->progress_begin;
        finish->progress->share = finish->progress_share;
    }
}

// ---- a part: chunks of what memory holds -----------------------------------------------------------------------------------

static uint32_t number_of(const struct patina_builder *builder, const char *record)
{
    uint32_t number;
    memcpy(&number, record + builder->number, sizeof number);
    return number;
}

// All points of a cloud in the order in which they came: chunks do not depend on what tapes they lay on.
static int sort_records(const struct patina_builder *builder, char *records, uint64_t count)
{
    char *copy = malloc((size_t)count * builder->record + 1);
    uint64_t first = UINT32_MAX, last = 0, next = 0;
    for (uint64_t i = 0; i < count; i++) {
        const uint32_t number = number_of(builder, records + i * builder->record);
        first = number < first ? number : first;
        last = number > last ? number : last;
    }
    const uint64_t span = count ? last - first + 1 : 0;
    uint32_t *places = malloc(span * sizeof *places + 1);
    if (copy && places) {
        memset(places, 0xFF, span * sizeof *places);
        memcpy(copy, records, (size_t)count * builder->record);
        for (uint64_t i = 0; i < count; i++)
            places[number_of(builder, copy + i * builder->record) - first] = (uint32_t)i;
        for (uint64_t i = 0; i < span; i++)
            if (places[i] != 0xFFFFFFFFu)
                memcpy(records + next++ * builder->record, copy + (size_t)places[i] * builder->record, builder->record);
    }
    const int error = !copy || !places ? ENOMEM : 0;
    free(copy);
    free(places);
    return error;
}

static void narrow_colors(const struct patina_builder *builder, char *records, uint64_t count, uint32_t shift)
{
    for (uint64_t i = 0; i < count; i++) {
        char *at = records + i * builder->record + builder->offset[2];
        uint16_t rgb[3];
        memcpy(rgb, at, sizeof rgb);
        for (int k = 0; k < 3; k++)
            at[k] = (char)(uint8_t)(rgb[k] >> shift);
    }
}

// 0, 8: bits to leave off; -1: they stay as they are.
static int narrow_shift(const struct patina_builder *builder)
{
    const unsigned seen = atomic_load(&builder->wide_colors);
    if (!builder->desc.narrow_colors || builder->size[2] != 6)
        return -1;
    return !(seen & 1u) ? 0 : !(seen & 2u) || !(seen & 4u) ? 8 : -1;
}

static int tape_of(struct finish *finish, enum pt_array array, const void *data, uint64_t bytes)
{
    return data ? pt_tape_write(&finish->builder->spill, &finish->tapes[array], data, bytes) : 0;
}

static void sum_up(struct finish *finish, const struct patina_cloud *part)
{
    patina_cloud_info *info = &finish->cloud.info;
    for (int k = 0; k < 3; k++) {
        info->box_min[k] = fmin(info->box_min[k], part->info.box_min[k]);
        info->box_max[k] = fmax(info->box_max[k], part->info.box_max[k]);
    }
    info->drawn += part->info.drawn;
    info->invalid_normals += part->info.invalid_normals;
    info->invalid_colors += part->info.invalid_colors;
    info->radius_most = fmaxf(info->radius_most, part->info.radius_most);
    for (uint32_t c = 0; c < part->chunk_count; c++)
        for (int k = 0; k < 8; k++)
            info->class_bits[k] |= part->chunks[c].classes[k];
    for (uint64_t i = 0; part->scalars && i < part->slots; i++)
        if (isfinite(part->scalars[i])) {
            finish->least_scalar = part->scalars[i] < finish->least_scalar ? part->scalars[i] : finish->least_scalar;
            finish->most_scalar = part->scalars[i] > finish->most_scalar ? part->scalars[i] : finish->most_scalar;
        }
    for (uint64_t i = 0; part->opacities && !finish->translucent && i < part->slots; i++)
        finish->translucent = part->opacities[i] < 255;
    if (part->classes)
        finish->cloud.class_hash = pt_fingerprint(finish->any_part ? finish->cloud.class_hash : 1, part->classes, part->slots);
    finish->any_part = 1;
}

static int append_chunks(struct finish *finish, const struct patina_cloud *part)
{
    struct patina_cloud *cloud = &finish->cloud;
    const uint64_t count = (uint64_t)cloud->chunk_count + part->chunk_count;
    if (count > UINT32_MAX)
        return PATINA_ERROR_TOO_MANY_POINTS;
    if (count > finish->chunk_room) {
        const uint32_t room = 2 * count < UINT32_MAX ? (uint32_t)(2 * count) : UINT32_MAX;
        struct pt_chunk *chunks = realloc(cloud->chunks, room * sizeof *chunks);
        if (!chunks)
            return PATINA_ERROR_MEMORY;
        cloud->chunks = chunks;
        finish->chunk_room = room;
    }
    // of this level alone lie fewer points than of the cloud
    const double share = pow(0.25, finish->finer) * (finish->finer + 1 < finish->levels ? 0.75 : 1.0);
    for (uint32_t c = 0; c < part->chunk_count; c++) {
        struct pt_chunk *chunk = &cloud->chunks[cloud->chunk_count++];
        *chunk = part->chunks[c];
        chunk->first += (uint32_t)cloud->slots; // modulo 2^32, as the file has it
        chunk->spacing *= (float)sqrt(share);
        chunk->gap = finish->levels > 1 ? (float)(1u << finish->finer) : 0.0f; // times the spacing, once that is settled
    }
    cloud->slots += part->slots;
    return PATINA_OK;
}

static int keep_part(struct finish *finish, struct patina_cloud *part)
{
    const uint64_t slots = part->slots;
    sum_up(finish, part);
    const int error = append_chunks(finish, part);
    if (error)
        return error;
    finish->cloud.color_format = part->color_format;
    if (tape_of(finish, PT_ARRAY_POSITIONS, part->positions, slots * 12) ||
        tape_of(finish, PT_ARRAY_ORDER, finish->cloud.unordered ? NULL : part->order, slots * 4) ||
        tape_of(finish, PT_ARRAY_SURFELS, part->surfels, slots * 4) ||
        tape_of(finish, PT_ARRAY_COLORS, part->colors, slots * pt_color_size(part->color_format)) ||
        tape_of(finish, PT_ARRAY_OPACITIES, part->opacities, slots) ||
        tape_of(finish, PT_ARRAY_RADII, part->radii, slots * 4) ||
        tape_of(finish, PT_ARRAY_SCALARS, part->scalars, slots * 4) || tape_of(finish, PT_ARRAY_CLASSES, part->classes, slots))
        return pt_builder_fail(finish->builder, finish->builder->spill.error);
    return PATINA_OK;
}

static void box_of(struct pt_bucket **list, uint32_t n, double box_min[3], double box_max[3])
{
    for (int k = 0; k < 3; k++) {
        box_min[k] = INFINITY;
        box_max[k] = -INFINITY;
        for (uint32_t i = 0; i < n; i++) {
            box_min[k] = fmin(box_min[k], list[i]->box_min[k]);
            box_max[k] = fmax(box_max[k], list[i]->box_max[k]);
        }
    }
}

struct loading {
    struct patina_builder *builder;
    struct pt_bucket **list;
    char *records;
    atomic_int error;
};

static void load_bucket(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct loading *loading = context;
    const struct patina_builder *builder = loading->builder;
    uint64_t at = 0;
    (void)thread;
    for (uint32_t i = 0; i < end; i++) {
        const struct pt_tape *tape = &loading->list[i]->tape;
        const int error = i < begin ? 0 : pt_tape_read(&builder->spill, tape, 0, loading->records + at, tape->size);
        if (error)
            atomic_store(&loading->error, error);
        at += tape->size;
    }
}

static int load(struct finish *finish, struct pt_bucket **list, uint32_t n, char *records)
{
    struct patina_builder *builder = finish->builder;
    struct loading loading = {.builder = builder, .list = list, .records = records};
    pt_parallel(builder->pool, n, 1, load_bucket, &loading);
    for (uint32_t i = 0; i < n; i++)
        pt_tape_drop(&builder->spill, &list[i]->tape);
    return loading.error ? pt_builder_fail(builder, loading.error) : PATINA_OK;
}

static int make_part(struct finish *finish, struct pt_bucket **list, uint32_t n, uint64_t count)
{
    struct patina_builder *builder = finish->builder;
    const double of_all = builder->drawn ? 0.8 / (double)builder->drawn : 0.0;
    const int shift = narrow_shift(builder), whole = count == builder->drawn;
    struct pt_build_part of = {.numbers = {.type = PATINA_UINT32, .components = 1, .stride = builder->record}};
    struct patina_cloud *part = NULL;
    patina_cloud_desc desc;
    char *const records = finish->records;
    box_of(list, n, of.box_min, of.box_max);
    of.numbers.data = records + builder->number;
    of.words = finish->words;
    of.scratch = finish->words + finish->most;
    int error = load(finish, list, n, records);
    if (!error && whole && !finish->cloud.unordered && sort_records(builder, records, count))
        error = PATINA_ERROR_MEMORY;
    if (!error) {
        if (shift >= 0)
            narrow_colors(builder, records, count, (uint32_t)shift);
        pt_builder_view(builder, records, count, &desc);
        desc.color.type = shift >= 0 ? PATINA_UINT8 : desc.color.type;
        share_progress(finish, of_all * (double)finish->done, of_all * (double)(finish->done + count));
        error = pt_cloud_build(&desc, PT_BUILD_FREELY, &of, builder->pool, finish->progress, &part);
    }
    if (!error)
        error = keep_part(finish, part);
    finish->done += count;
    patina_cloud_destroy(part);
    return error;
}

// ---- what does not fit is divided --------------------------------------------------------------------------------------------

// Into an eighth along each axis of a cube around it; points at one place by their order.
static int divide(struct finish *finish, struct pt_bucket **list, uint32_t n, int depth, struct pt_bucket *parts)
{
    struct patina_builder *builder = finish->builder;
    double box_min[3], box_max[3], edge = 0.0;
    uint64_t count = 0, next = 0;
    for (uint32_t i = 0; i < n; i++)
        count += list[i]->count;
    box_of(list, n, box_min, box_max);
    for (int k = 0; k < 3; k++)
        edge = fmax(edge, box_max[k] - box_min[k]);
    const double cell = edge > 0.0 && isfinite(4.0 / edge) ? 4.0 / edge : 0.0;
    const int by_place = cell > 0.0 && depth < DEPTH_MOST;
    const uint64_t piece = PIECE / builder->record;
    char *records = malloc((size_t)piece * builder->record);
    int error = records ? 0 : ENOMEM;
    for (uint32_t i = 0; i < n && !error; i++) {
        for (uint64_t done = 0; done < list[i]->count && !error; done += piece) {
            const uint64_t some = list[i]->count - done < piece ? list[i]->count - done : piece;
            patina_cloud_desc desc;
            error = pt_tape_read(&builder->spill, &list[i]->tape, done * builder->record, records, some * builder->record);
            pt_builder_view(builder, records, some, &desc);
            for (uint64_t j = 0; j < some && !error; j++) {
                double p[3];
                pt_cloud_position(&desc, j, p);
                const uint64_t to = by_place ? pt_builder_cell(p, box_min, cell, PART_BITS) : next++ * PARTS / count;
                pt_builder_extend(&parts[to], p);
                error = pt_tape_write(&builder->spill, &parts[to].tape, records + j * builder->record, builder->record);
            }
            error = error ? error : pt_progress_cancelled(finish->progress) ? ECANCELED : 0;
        }
        pt_tape_drop(&builder->spill, &list[i]->tape);
    }
    for (int i = 0; i < PARTS && !error; i++)
        error = pt_tape_rest(&builder->spill, &parts[i].tape);
    free(records);
    return !error ? PATINA_OK : error == ECANCELED ? PATINA_ERROR_CANCELLED : pt_builder_fail(builder, error);
}

static int make_parts(struct finish *finish, struct pt_bucket **list, uint32_t n, int in_order, int depth);

static int make_divided(struct finish *finish, struct pt_bucket **list, uint32_t n, int depth)
{
    struct pt_bucket *parts = calloc(PARTS, sizeof *parts), *lists[PARTS];
    uint32_t some = 0;
    if (!parts)
        return PATINA_ERROR_MEMORY;
    int error = divide(finish, list, n, depth, parts);
    for (uint32_t i = 0; i < PARTS; i++)
        if (parts[i].count)
            lists[some++] = &parts[i];
    error = error ? error : make_parts(finish, lists, some, 1, depth + 1);
    for (uint32_t i = 0; i < PARTS; i++)
        pt_tape_drop(&finish->builder->spill, &parts[i].tape);
    free(parts);
    return error;
}

// Neighbours together as far as memory holds them. in_order: they lie in Morton order.
static int make_parts(struct finish *finish, struct pt_bucket **list, uint32_t n, int in_order, int depth)
{
    int error = PATINA_OK;
    uint64_t all = 0;
    for (uint32_t i = 0; i < n; i++)
        all += list[i]->count;
    if (!in_order && n > 1 && all > finish->most)
        return make_divided(finish, list, n, depth);
    for (uint32_t i = 0, end; i < n && !error; i = end) {
        uint64_t count = list[i]->count;
        for (end = i + 1; end < n && count + list[end]->count <= finish->most; end++)
            count += list[end]->count;
        if (pt_progress_cancelled(finish->progress))
            error = PATINA_ERROR_CANCELLED;
        else if (count > finish->most)
            error = make_divided(finish, list + i, 1, depth);
        else if (count)
            error = make_part(finish, list + i, end - i, count);
    }
    return error;
}

static int make_levels(struct finish *finish)
{
    struct patina_builder *builder = finish->builder;
    finish->levels = 1;
    while (builder->drawn > ONE_LEVEL && finish->levels < PT_BUILDER_LEVELS &&
           builder->drawn >> 2 * (finish->levels - 1) > COARSEST)
        finish->levels++;
    int error = PATINA_OK;
    for (uint32_t level = 0; level < finish->levels && !error; level++) {
        finish->finer = finish->levels - 1 - level;
        struct pt_bucket *list[PT_BUILDER_BUCKETS];
        uint32_t n = 0;
        const uint32_t end = pt_builder_level_first(level ? finish->finer + 1 : PT_BUILDER_LEVELS);
        for (uint32_t i = pt_builder_level_first(finish->finer); i < end; i++)
            if (builder->buckets[i].count)
                list[n++] = &builder->buckets[i];
        error = make_parts(finish, list, n, level > 0, 0);
    }
    return error;
}

// ---- the file ----------------------------------------------------------------------------------------------------------------

// The next `count` slots get the class of their chunks' spacing; *chunk is where they begin, of which *done are done.
static void add_classes(const struct patina_cloud *cloud, uint32_t *surfels, uint64_t count, uint32_t *chunk, uint32_t *done)
{
    for (uint64_t i = 0; i < count;) {
        const struct pt_chunk *at = &cloud->chunks[*chunk];
        const uint32_t word = pt_class_of_spacing((double)at->spacing, cloud->spacing_base) << PT_SPACING_SHIFT;
        for (; *done < at->padded && i < count; i++, ++*done)
            surfels[i] |= word;
        if (*done == at->padded) {
            ++*chunk;
            *done = 0;
        }
    }
}

// A piece of a tape goes into the file while the next one is read.
struct handing {
    struct finish *finish;
    struct pt_cloud_writer *writer;
    enum pt_array array;
    char *at_hand, *next;
    uint64_t size, offset, next_size; // of what is at hand; of the next one
    int error;
};

static void hand_on(void *context, uint32_t begin, uint32_t end, uint32_t thread)
{
    struct handing *handing = context;
    const struct patina_builder *builder = handing->finish->builder;
    (void)thread;
    for (uint32_t i = begin; i < end; i++)
        if (i == 0 && handing->size)
            pt_cloud_writer_add(handing->writer, handing->array, handing->at_hand, handing->size);
        else if (i == 1 && handing->next_size)
            handing->error = pt_tape_read(&builder->spill, &handing->finish->tapes[handing->array], handing->offset,
                                          handing->next, handing->next_size);
}

// buffer: room for two pieces.
static int write_tape(struct finish *finish, struct pt_cloud_writer *writer, enum pt_array array, uint64_t wanted, char *buffer)
{
    struct patina_builder *builder = finish->builder;
    struct pt_tape *tape = &finish->tapes[array];
    struct handing handing = {.finish = finish, .writer = writer, .array = array, .at_hand = buffer, .next = buffer + PIECE};
    const char end[4] = {0}; // behind bytes that are read as words
    uint32_t chunk = 0, slots = 0;
    do {
        const uint64_t left = tape->size - handing.offset;
        handing.next_size = left < PIECE ? left : PIECE;
        pt_parallel(builder->pool, 2, 1, hand_on, &handing);
        if (handing.error)
            return pt_builder_fail(builder, handing.error);
        if (pt_progress_cancelled(finish->progress))
            return PATINA_ERROR_CANCELLED;
        if (array == PT_ARRAY_SURFELS)
            add_classes(&finish->cloud, (uint32_t *)(void *)handing.next, handing.next_size / 4, &chunk, &slots);
        char *const done = handing.at_hand;
        handing.at_hand = handing.next;
        handing.next = done;
        handing.size = handing.next_size;
        handing.offset += handing.next_size;
    } while (handing.size);
    pt_cloud_writer_add(writer, array, end, wanted - tape->size);
    pt_tape_drop(&builder->spill, tape);
    return PATINA_OK;
}

static int settle(struct finish *finish)
{
    struct patina_cloud *cloud = &finish->cloud;
    patina_cloud_info *info = &cloud->info;
    struct pt_section sections[PT_ARRAYS];
    const int error = pt_cloud_settle_built(cloud);
    if (error)
        return error;
    for (uint32_t c = 0; c < cloud->chunk_count; c++)
        cloud->chunks[c].gap *= cloud->chunks[c].spacing;
    info->has_opacities = info->has_opacities && finish->translucent;
    info->chunks = cloud->chunk_count;
    info->count = cloud->unordered ? info->drawn : info->count;
    info->invalid_positions = finish->builder->invalid_positions;
    info->scalar_range[0] = finish->least_scalar <= finish->most_scalar ? finish->least_scalar : 0.0f;
    info->scalar_range[1] = finish->least_scalar <= finish->most_scalar ? finish->most_scalar : 0.0f;
    pt_cloud_sections(cloud, sections);
    for (int i = 0; i < PT_ARRAYS; i++)
        info->bytes += sections[i].size;
    return PATINA_OK;
}

static int write_file(struct finish *finish)
{
    struct pt_cloud_writer *writer;
    struct patina_cloud *cloud = &finish->cloud;
    struct pt_section sections[PT_ARRAYS];
    int error = settle(finish);
    if (error)
        return error;
    pt_cloud_sections(cloud, sections);
    char *buffer = malloc(2 * PIECE);
    if (!buffer)
        return PATINA_ERROR_MEMORY;
    if ((error = pt_cloud_writer_begin(finish->builder->path, cloud, &writer))) {
        free(buffer);
        return finish->builder->failed = pt_fail_again(&finish->builder->handle, error);
    }
    pt_cloud_writer_add(writer, PT_ARRAY_CHUNKS, cloud->chunks, sections[PT_ARRAY_CHUNKS].size);
    for (int i = PT_ARRAY_POSITIONS; i < PT_ARRAYS && !error; i++) {
        if (sections[i].size)
            error = write_tape(finish, writer, (enum pt_array)i, sections[i].size, buffer);
        share_progress(finish, 0.0, 1.0);
        pt_progress_set(finish->progress, 0.8 + 0.2 * (i + 1) / PT_ARRAYS);
    }
    free(buffer);
    if (error) {
        pt_cloud_writer_drop(writer);
        return error;
    }
    error = pt_cloud_writer_end(writer, cloud);
    if (!error && cloud->unordered)
        pt_log(PT_LOG_INFO, "%s: its %llu points are numbered as they lie: an order counts to 4294967295",
               finish->builder->path, (unsigned long long)finish->builder->count);
    return error ? finish->builder->failed = pt_fail_again(&finish->builder->handle, error) : PATINA_OK;
}

// ---- end -----------------------------------------------------------------------------------------------------------------

// Normals, colours, scalars and classes: their bytes stay in the records, which nobody looks at then.
static void leave_out_zeros(struct patina_builder *builder)
{
    static const int may[] = {1, 2, 5, 6};
    const unsigned nonzero = atomic_load(&builder->nonzero);
    for (size_t i = 0; i < sizeof may / sizeof may[0]; i++)
        builder->size[may[i]] = nonzero & 1u << may[i] ? builder->size[may[i]] : 0;
}

static void free_room(struct finish *finish)
{
    pt_pages_free(finish->records, finish->most * finish->builder->record);
    pt_pages_free(finish->words, finish->most * 2 * sizeof *finish->words);
    finish->records = NULL;
    finish->words = NULL;
}

static int end_build(struct finish *finish)
{
    struct patina_builder *builder = finish->builder;
    int error = pt_builder_drain(builder);
    if (error)
        return error;
    for (int i = 0; i < PT_BUILDER_BUCKETS; i++)
        if (pt_tape_rest(&builder->spill, &builder->buckets[i].tape))
            return pt_builder_fail(builder, builder->spill.error);
    if (builder->desc.narrow_colors == 1)
        leave_out_zeros(builder);
    patina_cloud_desc desc;
    const int narrow = narrow_shift(builder) >= 0;
    pt_builder_view(builder, "", builder->count, &desc);
    desc.color.type = narrow ? PATINA_UINT8 : desc.color.type;
    pt_cloud_begin_info(&finish->cloud, &desc);
    finish->cloud.unordered = builder->count > UINT32_MAX; // words of an order
    finish->cloud.info.has_scalars = desc.scalar.data != NULL;
    finish->cloud.info.has_classes = desc.classes.data != NULL && builder->count;
    for (int k = 0; k < 3; k++) {
        finish->cloud.info.box_min[k] = INFINITY;
        finish->cloud.info.box_max[k] = -INFINITY;
    }
    // records, sorting words twice, and what is made of them, with some air
    const uint64_t each = builder->record + 16 + pt_builder_slot_bytes(builder) + 8;
    finish->most = builder->desc.memory / 8 * 5 / each;
    finish->most = finish->most > PART_LEAST ? finish->most : PART_LEAST;
    finish->most = finish->most < MOST_AT_A_TIME ? finish->most : MOST_AT_A_TIME;
    finish->most = finish->most < builder->drawn ? finish->most : builder->drawn;
    finish->records = pt_pages_alloc(finish->most * builder->record);
    finish->words = pt_pages_alloc(finish->most * 2 * sizeof *finish->words);
    error = finish->records && finish->words ? make_levels(finish) : PATINA_ERROR_MEMORY;
    free_room(finish);
    return error ? error : write_file(finish);
}

int patina_builder_end(patina_builder *builder, patina_progress *progress)
{
    if (!builder)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_builder_end: builder is NULL");
    if (builder->failed || builder->ended)
        return pt_fail(&builder->handle, builder->failed ? builder->failed : PATINA_ERROR_ARGUMENT,
                       "patina_builder_end: the build %s", builder->failed ? "failed before" : "has ended");
    struct finish *finish = calloc(1, sizeof *finish);
    if (!finish)
        return pt_builder_fail(builder, ENOMEM);
    builder->ended = 1;
    finish->builder = builder;
    finish->progress = progress;
    finish->progress_begin = progress ? progress->begin : 0;
    finish->progress_share = progress ? progress->share : 0;
    finish->least_scalar = INFINITY;
    finish->most_scalar = -INFINITY;
    int error = end_build(finish);
    restore_progress(finish);
    if (!error)
        pt_progress_set(progress, 1.0);
    for (int i = 0; i < PT_ARRAYS; i++)
        pt_tape_drop(&builder->spill, &finish->tapes[i]);
    free(finish->cloud.chunks);
    free(finish);
    if (error && !builder->failed)
        pt_fail_again(&builder->handle, builder->failed = pt_cloud_tell(error, builder->count));
    return error;
}
