// SPDX-License-Identifier: GPL-3.0-or-later
// What is read of a frame: passes, layers, keys, shadow textures, statistics, planes.
#include "frame.h"

#include "shown.h"
#include "scene/clouds/paged.h"
#include "scene/clouds/shape_word.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct {
    enum pt_plane plane;
    uint32_t channels;
    const char *name;
} pass_table[PATINA_PASS_COUNT] = {
    [PATINA_PASS_COMBINED] = {PT_PLANE_COMBINED, 4, "COMBINED"},
    [PATINA_PASS_DEPTH] = {PT_PLANE_DEPTH, 1, "DEPTH"},
    [PATINA_PASS_NORMAL] = {PT_PLANE_NORMALS, 3, "NORMAL"},
    [PATINA_PASS_SOURCE] = {PT_PLANE_SOURCE, 1, "SOURCE"},
    [PATINA_PASS_SHADOW] = {PT_PLANE_SHADOW, 1, "SHADOW"},
    [PATINA_PASS_LINE] = {PT_PLANE_LINES, 1, "LINE"},
    [PATINA_PASS_TRUST] = {PT_PLANE_TRUST, 1, "TRUST"},
    [PATINA_PASS_THICKNESS] = {PT_PLANE_THICKNESS, 1, "THICKNESS"},
    [PATINA_PASS_DENSITY] = {PT_PLANE_DENSITY, 1, "DENSITY"},
    [PATINA_PASS_DISAGREEMENT] = {PT_PLANE_DISAGREEMENT, 1, "DISAGREEMENT"},
};

// The keys of the picture, whose rows are parts of the plane's. All rows are read by one call: each call waits for an OpenGL device.
static int read_crop(const struct patina_frame *frame, const char *call, uint64_t *keys)
{
    const uint32_t *crop = frame->shown.crop;
    const size_t wide = frame->shown.plane_width, count = crop[3] ? wide * (crop[3] - 1) + crop[2] : 0;
    uint64_t *rows = wide == crop[2] ? keys : malloc((count + 1) * sizeof *rows);
    if (!rows)
        return pt_fail(&frame->handle, PATINA_ERROR_MEMORY, "%s: out of memory", call);
    const int error = count ? frame->device->ops->buffer_read(frame->device, &frame->planes.at[PT_PLANE_KEYS][0],
                                                              (wide * crop[1] + crop[0]) * sizeof *rows, rows,
                                                              count * sizeof *rows)
                            : PATINA_OK;
    for (size_t y = 0; y < crop[3] && rows != keys && !error; y++)
        memcpy(keys + y * crop[2], rows + y * wide, crop[2] * sizeof *keys);
    if (rows != keys)
        free(rows);
    return error ? pt_fail_again(&frame->handle, error) : PATINA_OK;
}

// Keys as they lie in the plane. call: whose messages these are.
static int read_plane(const struct patina_frame *frame, const char *call, uint64_t *keys, size_t size)
{
    if (!frame->keys_valid)
        return pt_fail(&frame->handle, PATINA_ERROR_EMPTY, "%s: no finished render", call);
    if (size != (size_t)frame->shown.crop[2] * frame->shown.crop[3] * sizeof *keys)
        return pt_fail(&frame->handle, PATINA_ERROR_ARGUMENT, "%s: %u x %u keys; got %zu bytes", call, frame->shown.crop[2],
                       frame->shown.crop[3], size);
    return read_crop(frame, call, keys);
}

// The cloud of an instance whose uncolored points show the colors that their neighbors lent, or NULL.
static const struct patina_cloud *lent_cloud(const struct patina_frame *frame, uint32_t instance)
{
    const struct patina_cloud *cloud = pt_numbering_cloud(&frame->key_ids, instance);
    return cloud && cloud->info.uncolored && !frame->key_ids.clouds[instance].keeps_black ? cloud : NULL;
}

// Points that were measured without a color, and show their neighbors', read 0.5 in SOURCE.
static int mark_uncolored(const struct patina_frame *frame, float *pixels)
{
    const size_t count = (size_t)frame->shown.crop[2] * frame->shown.crop[3];
    uint32_t instance = 0, slot;
    int some = 0;
    for (uint32_t i = 0; i < frame->key_ids.count; i++) {
        some |= lent_cloud(frame, i) != NULL;
    }
    if (!some || !frame->keys_valid)
        return PATINA_OK;
    uint64_t *keys = malloc(count * sizeof *keys + 1);
    int error = keys ? read_plane(frame, "patina_frame_read", keys, count * sizeof *keys)
                     : pt_fail(&frame->handle, PATINA_ERROR_MEMORY, "patina_frame_read: out of memory");
    for (size_t i = 0; i < count && !error; i++) {
        if (pixels[i] != 1.0f || !pt_numbering_find(&frame->key_ids, (uint32_t)keys[i], &instance, &slot))
            continue;
        const struct patina_cloud *cloud = lent_cloud(frame, instance);
        if (cloud && cloud->shapes[slot] & PT_SHAPE_UNCOLORED)
            pixels[i] = 0.5f;
    }
    free(keys);
    return error;
}

int pt_frame_read(const struct patina_frame *frame, uint32_t pass, float *pixels, size_t size)
{
    if (pass >= PATINA_PASS_COUNT)
        return pt_fail(&frame->handle, PATINA_ERROR_ARGUMENT, "patina_frame_read: no pass %u", pass);
    if (!frame->shown.picture_valid || !(frame->shown.passes >> pass & 1u))
        return pt_fail(&frame->handle, PATINA_ERROR_EMPTY, "patina_frame_read: no %s pass was rendered", pass_table[pass].name);
    size_t expected = (size_t)frame->shown.stats.width * frame->shown.stats.height * pass_table[pass].channels * sizeof *pixels;
    if (size != expected)
        return pt_fail(&frame->handle, PATINA_ERROR_ARGUMENT,
                       "patina_frame_read: %s is %u x %u x %u floats, %zu bytes; got %zu", pass_table[pass].name,
                       frame->shown.stats.width, frame->shown.stats.height, pass_table[pass].channels, expected, size);
    const uint32_t known = 1u << PATINA_PASS_TRUST | 1u << PATINA_PASS_THICKNESS | 1u << PATINA_PASS_DENSITY |
                           1u << PATINA_PASS_DISAGREEMENT;
    if ((pass == PATINA_PASS_SHADOW && frame->shown.all_lit) || (pass == PATINA_PASS_LINE && !frame->shown.has_lines) ||
        (known & ~frame->shown.assessed) >> pass & 1u) { // no plane
        for (size_t i = 0; i < size / sizeof *pixels; i++)
            pixels[i] = pass == PATINA_PASS_SHADOW ? 1.0f : 0.0f;
        return PATINA_OK;
    }
    int error = frame->device->ops->buffer_read(frame->device, &frame->planes.at[pass_table[pass].plane][0], 0, pixels, size);
    error = error ? pt_fail_again(&frame->handle, error) : PATINA_OK;
    return error || pass != PATINA_PASS_SOURCE ? error : mark_uncolored(frame, pixels);
}

int pt_frame_read_layer(const struct patina_frame *frame, uint32_t layer, uint32_t pass, float *pixels, size_t size)
{
    static const enum pt_plane planes[] = {[PATINA_PASS_COMBINED] = PT_PLANE_LAYER_COMBINED,
                                           [PATINA_PASS_DEPTH] = PT_PLANE_LAYER_DEPTH,
                                           [PATINA_PASS_NORMAL] = PT_PLANE_LAYER_NORMALS};
    if (pass > PATINA_PASS_NORMAL || !layer || layer > PATINA_MAX_LAYERS)
        return pt_fail(&frame->handle, PATINA_ERROR_ARGUMENT, "patina_frame_read_layer: no pass %u of a layer %u", pass, layer);
    if (!frame->keys_valid || !(frame->shown.layer_passes >> pass & 1u) || layer > frame->shown.layer_most)
        return pt_fail(&frame->handle, PATINA_ERROR_EMPTY, "patina_frame_read_layer: no %s pass of layer %u was asked for",
                       pass_table[pass].name, layer);
    size_t count = (size_t)frame->shown.stats.width * frame->shown.stats.height * pass_table[pass].channels;
    if (size != count * sizeof *pixels)
        return pt_fail(&frame->handle, PATINA_ERROR_ARGUMENT,
                       "patina_frame_read_layer: %s is %u x %u x %u floats; got %zu bytes", pass_table[pass].name,
                       frame->shown.stats.width, frame->shown.stats.height, pass_table[pass].channels, size);
    if (layer > frame->layer_count) { // peeling ended before
        for (size_t i = 0; i < count; i++)
            pixels[i] = pass == PATINA_PASS_DEPTH ? INFINITY : 0.0f;
        return PATINA_OK;
    }
    int error = frame->device->ops->buffer_read(frame->device, &frame->planes.at[planes[pass]][layer - 1], 0, pixels, size);
    return error ? pt_fail_again(&frame->handle, error) : PATINA_OK;
}

static int fail_to_number(const struct patina_frame *frame, int error, const char *call)
{
    return error == PATINA_ERROR_FILE
               ? pt_fail(&frame->handle, error, "%s: a cloud's file was cut short since, or its disk is gone. Render again",
                         call)
           : error ? pt_fail(&frame->handle, error, "%s: a cloud in view was destroyed since", call)
                   : PATINA_OK;
}

int pt_frame_read_keys(const struct patina_frame *frame, uint64_t *keys, size_t size)
{
    int error = read_plane(frame, "patina_frame_read_keys", keys, size);
    if (error)
        return error;
    error = pt_numbering_keys(&frame->key_ids, keys, size / sizeof *keys);
    return error == PATINA_ERROR_TOO_MANY_POINTS
               ? pt_fail(
                     &frame->handle, error,
                     "patina_frame_read_keys: the scene holds %llu points and triangles, whose numbers have more than 32 bits: "
                     "patina_frame_read_numbers reads them",
                     (unsigned long long)(frame->key_ids.points + frame->key_ids.triangles))
               : fail_to_number(frame, error, "patina_frame_read_keys");
}

int pt_frame_read_numbers(const struct patina_frame *frame, uint64_t *numbers, size_t size)
{
    int error = read_plane(frame, "patina_frame_read_numbers", numbers, size);
    if (error)
        return error;
    error = pt_numbering_numbers(&frame->key_ids, numbers, size / sizeof *numbers);
    return fail_to_number(frame, error, "patina_frame_read_numbers");
}

int pt_frame_read_ids(const struct patina_frame *frame, const struct patina_scene *scene, uint64_t *keys, size_t size)
{
    if (!pt_numbering_is_of(&frame->key_ids, scene))
        return pt_fail(&frame->handle, PATINA_ERROR_ARGUMENT, "the frame's last picture is of another scene");
    return read_plane(frame, "patina_frame_read_keys", keys, size);
}

// A buffer's bytes, of which the caller has to dispose.
static int read_buffer(const struct patina_frame *frame, const struct pt_buffer *buffer, size_t at, size_t size,
                       uint32_t **words)
{
    *words = malloc(size + 1);
    if (!*words)
        return pt_fail(&frame->handle, PATINA_ERROR_MEMORY, "patina_frame_read_shadows: out of memory");
    const int error = frame->device->ops->buffer_read(frame->device, buffer, at, *words, size);
    return error ? pt_fail_again(&frame->handle, error) : PATINA_OK;
}

// Shadow words of an instance.
struct words {
    uint32_t *each, *marks; // marks: those of shown points
    uint32_t first, step;   // of the light
};

static uint32_t word_of(const struct words *words, uint32_t slot)
{
    if (!words->marks)
        return words->each[slot];
    const uint32_t place = pt_shown_place(words->marks, slot);
    return place ? words->each[(size_t)words->step * place + words->first] : 0;
}

// What arrives at the points of an instance, which of a cloud in parts is one of them.
static int read_part(const struct patina_frame *frame, uint32_t instance, uint32_t light, float *values)
{
    const struct pt_shadows *shadows = &frame->shadows;
    const struct patina_cloud *cloud = frame->numbering.clouds[instance].cloud;
    const size_t bytes = shadows->words[instance].size / shadows->light_count, marks = shadows->marks[instance].size;
    struct words words = {.first = light, .step = shadows->light_count};
    if (!bytes && !marks)
        return PATINA_OK; // nothing of it was there
    int error = marks ? read_buffer(frame, &shadows->marks[instance], 0, marks, &words.marks) : PATINA_OK;
    if (!error)
        error = marks ? read_buffer(frame, &shadows->shown, 0, shadows->shown.size, &words.each)
                      : read_buffer(frame, &shadows->words[instance], light * bytes, bytes, &words.each);
    const float scale = 1.0f / (255.0f * (float)shadows->lights[light].samples);
    for (uint32_t c = 0; c < cloud->chunk_count && !error; c++) {
        const struct pt_chunk *chunk = &cloud->chunks[c];
        for (uint32_t slot = chunk->first; slot < chunk->first + chunk->count; slot++)
            values[pt_number_of(cloud, slot)] = 1.0f - (float)(word_of(&words, slot) & PT_SHADOW_SUM) * scale;
    }
    free(words.each);
    free(words.marks);
    return error;
}

int pt_frame_read_shadows(const struct patina_frame *frame, uint32_t number, uint32_t light, float *values, size_t size)
{
    const struct pt_shadows *shadows = &frame->shadows;
    uint32_t first;
    const uint32_t parts = pt_numbering_parts(&frame->numbering, number, &first);
    uint64_t words = 0;
    for (uint32_t i = first; i < first + parts && i < shadows->instance_count; i++)
        words += shadows->words[i].size + shadows->marks[i].size;
    if (!words || first + parts > shadows->instance_count || light >= shadows->light_count || !shadows->lights[light].samples)
        return pt_fail(&frame->handle, PATINA_ERROR_EMPTY, "patina_frame_read_shadows: no texture of light %u on instance %u",
                       light, number);
    const struct patina_cloud *cloud = pt_numbering_cloud(&frame->numbering, first);
    if (!cloud)
        return pt_fail(&frame->handle, PATINA_ERROR_EMPTY, "patina_frame_read_shadows: cloud %u was destroyed since", number);
    const size_t count = (size_t)cloud->info.count;
    if (size != count * sizeof *values)
        return pt_fail(&frame->handle, PATINA_ERROR_ARGUMENT, "patina_frame_read_shadows: %zu points; got %zu bytes", count,
                       size);
    for (size_t i = 0; i < count; i++)
        values[i] = 1.0f; // of points that are not drawn
    int error = PATINA_OK;
    pt_paged_enter(cloud, 0);
    for (uint32_t i = first; i < first + parts && !error; i++)
        error = read_part(frame, i, light, values);
    pt_paged_leave(cloud);
    return error ? pt_fail_again(&frame->handle, error) : PATINA_OK;
}

// What was asked of an OpenGL device, or of the processor, as a JSON object.
static void write_counts(const struct pt_counts *counts, uint64_t bytes, int gl, char *text, size_t size)
{
    if (gl)
        snprintf(text, size,
                 "{\"dispatches\":%llu,\"empty\":%llu,\"barriers\":%llu,\"calls\":%llu,\"copies\":%llu,\"waits\":%llu,"
                 "\"uploaded\":%llu,\"bytes\":%llu}",
                 (unsigned long long)counts->dispatches, (unsigned long long)counts->empty,
                 (unsigned long long)counts->barriers, (unsigned long long)counts->calls, (unsigned long long)counts->copies,
                 (unsigned long long)counts->waits, (unsigned long long)counts->uploaded, (unsigned long long)bytes);
    else
        snprintf(text, size, "{\"barriers\":%llu,\"bytes\":%llu}", (unsigned long long)counts->steps,
                 (unsigned long long)bytes);
}

size_t pt_frame_stats_json(const struct patina_frame *frame, char *buffer, size_t size)
{
    size_t length = 0;
#define PUT(...)                                                                                                               \
    length += (size_t)snprintf(buffer && length < size ? buffer + length : NULL, buffer && length < size ? size - length : 0,  \
                               __VA_ARGS__)
    PUT("{\"passes\":{");
    for (uint32_t i = 0; i < frame->times.count; i++) { // whole numbers: a locale may write 0,5 for 0.5
        unsigned long long parts = (unsigned long long)(frame->times.each[i].ms * 1e4 + 0.5);
        PUT("%s\"%s\":%llu.%04llu", i ? "," : "", frame->times.each[i].name, parts / 10000, parts % 10000);
    }
    PUT("},\"skipped\":{");
    for (uint32_t i = 0; i < frame->skipped_count; i++) // reasons are our own words: no quotes, no backslashes
        PUT("%s\"%s\":\"%s\"", i ? "," : "", frame->skipped[i].name, frame->skipped[i].reason);
    PUT("},\"layers\":[");
    for (uint32_t i = 0; i < frame->layer_count; i++)
        PUT("%s{\"points\":%llu,\"pixels\":%llu}", i ? "," : "", (unsigned long long)frame->layers[i].points,
            (unsigned long long)frame->layers[i].pixels);
    PUT("],\"lights\":[");
    for (uint32_t i = 0; i < frame->light_count; i++) {
        const struct pt_shadow_light *light = &frame->shadows.lights[i];
        unsigned long long parts = (unsigned long long)((double)light->error * 1e6 + 0.5);
        PUT("%s{\"samples\":%u,\"error\":%llu.%06llu}", i ? "," : "", light->samples, parts / 1000000, parts % 1000000);
    }
    PUT("],\"samples\":{\"grid\":%u,\"shifts\":%u},\"planes\":{\"peak\":%llu,\"held\":%llu", frame->sampling[0],
        frame->sampling[1], (unsigned long long)frame->shown.peak, (unsigned long long)frame->shown.stats.plane_bytes);
    if (frame->shown.soft_parts)
        PUT(",\"soft\":{\"parts\":%u,\"records\":%u}", frame->shown.soft_parts, frame->shown.soft_records);
    PUT("},\"mapped\":{\"bytes\":%llu,\"cap\":%llu,\"held\":%llu,\"read\":%llu,\"rounds\":%u,\"returned\":%u}",
        (unsigned long long)frame->shown.stats.mapped_bytes, (unsigned long long)frame->shown.stats.mapped_cap,
        (unsigned long long)frame->shown.stats.mapped_held, (unsigned long long)frame->shown.stats.mapped_read,
        frame->shown.stats.mapped_rounds, frame->shown.stats.mapped_returned);
    const int gl = frame->counts.calls > 0;
    char counts[256];
    write_counts(&frame->counts, frame->times.bytes, gl, counts, sizeof counts);
    PUT(",\"%s\":%s,\"work\":{", gl ? "gl" : "cpu", counts);
    for (uint32_t i = 0, some = 0; i < frame->times.count; i++) {
        const struct pt_timing *timing = &frame->times.each[i];
        if (!timing->bytes && !timing->counts.calls && !timing->counts.steps)
            continue; // a time alone
        write_counts(&timing->counts, timing->bytes, gl, counts, sizeof counts);
        PUT("%s\"%s\":%s", some++ ? "," : "", timing->name, counts);
    }
    PUT("}}");
#undef PUT
    return length;
}

static int unwritten(const struct patina_frame *frame, const char *path)
{
    return pt_fail(&frame->handle, PATINA_ERROR_FILE,
                   "%s: cannot be written. Check that its folder exists and the disk has room", path);
}

int pt_frame_dump(const struct patina_frame *frame, const char *folder)
{
    const int sampled = frame->sampling[0] * frame->sampling[1] > 1; // what lies between is of the last finer picture
    // bins of discs are a device's own: addresses, and blocks as its threads came to them
    for (int p = 0; p < PT_PLANE_COUNT; p++)
        for (int level = 0; level < PT_SLOTS; level++) {
            const struct pt_buffer *plane = &frame->planes.at[p][level];
            char path[4096];
            if (!plane->size || frame->planes.lost[p][level] || pt_plane_rows[p].size == PT_SIZE_DISCS ||
                (sampled && p != PT_PLANE_KEYS && pt_plane_rows[p].size != PT_SIZE_CROP))
                continue;
            void *copy = malloc(plane->size);
            if (!copy)
                return pt_fail(&frame->handle, PATINA_ERROR_MEMORY, "dumping planes: out of memory");
            int error = frame->device->ops->buffer_read(frame->device, plane, 0, copy, plane->size);
            snprintf(path, sizeof path, "%s/%s_%d.raw", folder, pt_plane_rows[p].name, level);
            FILE *file = error ? NULL : pt_stream_open(path, "wb");
            size_t written = file ? fwrite(copy, 1, plane->size, file) : 0;
            free(copy);
            if (error || !file || fclose(file) || written != plane->size)
                return unwritten(frame, path);
            uint32_t width = pt_plane_rows[p].size == PT_SIZE_CROP ? frame->shown.crop[2]
                                                                   : (frame->shown.plane_width + (1u << level) - 1) >> level;
            snprintf(path, sizeof path, "%s/%s_%d.txt", folder, pt_plane_rows[p].name, level);
            file = pt_stream_open(path, "w");
            if (!file ||
                fprintf(file, "%s level %d: %u pixels wide, %zu rows, %u bytes a pixel, row 0 at the bottom\n",
                        pt_plane_rows[p].name, level, width, width ? plane->size / pt_plane_bytes((enum pt_plane)p) / width : 0,
                        pt_plane_bytes((enum pt_plane)p)) < 0 ||
                fclose(file))
                return unwritten(frame, path);
        }
    return PATINA_OK;
}
