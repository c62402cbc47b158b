// SPDX-License-Identifier: GPL-3.0-or-later
// Shadow textures in a file (SPEC 4). Little-endian:
//   "patshado", u32 version, u32 lights, u32 instances, u32 bytes a word, u64 checksum of all that follows
//   per light: u32 samples, u32 settled, f32 error, u32 numbers, then float64 numbers: what it depends on (pt_light_key)
//   per instance: u64 fingerprint (0: receives no shadows), u64 slots, then the words of the points in chunk order, light by light
#include "frame.h"

#include "scene/clouds/fingerprint.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { VERSION = 3, HEADER_BYTES = 32 };
static const char magic[8] = {'p', 'a', 't', 's', 'h', 'a', 'd', 'o'};

// ---- writing -----------------------------------------------------------------------------------------------------------

struct bytes {
    unsigned char *data;
    size_t size, room;
    int failed;
};

static void put(struct bytes *bytes, const void *data, size_t size)
{
    if (bytes->failed || bytes->size + size > bytes->room) {
        size_t room = 2 * bytes->room + size + 4096;
        unsigned char *grown = bytes->failed ? NULL : realloc(bytes->data, room);
        if (!grown) {
            bytes->failed = 1;
            return;
        }
        bytes->data = grown;
        bytes->room = room;
    }
    memcpy(bytes->data + bytes->size, data, size);
    bytes->size += size;
}

static void put32(struct bytes *bytes, uint32_t value) { put(bytes, &value, sizeof value); }
static void put64(struct bytes *bytes, uint64_t value) { put(bytes, &value, sizeof value); }

static uint32_t bytes_a_word(const struct pt_shadows *shadows)
{
    uint32_t most = 0;
    for (uint32_t i = 0; i < shadows->light_count; i++)
        most = shadows->lights[i].samples > most ? shadows->lights[i].samples : most;
    return most * 255 <= 0xFF ? 1 : most * 255 <= 0xFFFF ? 2 : 4;
}

static int put_words(const struct patina_frame *frame, uint32_t instance, uint32_t width, struct bytes *bytes)
{
    const struct pt_buffer *buffer = &frame->shadows.words[instance];
    uint32_t *words = malloc(buffer->size);
    if (!words)
        return pt_fail(&frame->handle, PATINA_ERROR_MEMORY, "saving shadows: out of memory");
    int error = frame->device->ops->buffer_read(frame->device, buffer, 0, words, buffer->size);
    for (size_t i = 0; i < buffer->size / 4 && !error; i++)
        put(bytes, &words[i], width); // the low bytes come first
    free(words);
    return error ? pt_fail_again(&frame->handle, error) : PATINA_OK;
}

static int put_textures(const struct patina_frame *frame, uint32_t width, struct bytes *bytes)
{
    const struct pt_shadows *shadows = &frame->shadows;
    for (uint32_t i = 0; i < shadows->light_count; i++) {
        const struct pt_shadow_light *light = &shadows->lights[i];
        put32(bytes, light->samples);
        put32(bytes, light->settled);
        put(bytes, &light->error, 4);
        put32(bytes, (uint32_t)light->key_count);
        put(bytes, light->key, light->key_count * sizeof *light->key);
    }
    for (uint32_t i = 0; i < shadows->instance_count; i++) {
        put64(bytes, shadows->fingerprints[i]);
        put64(bytes, shadows->words[i].size / 4 / shadows->light_count);
        int error = shadows->words[i].size ? put_words(frame, i, width, bytes) : PATINA_OK;
        if (error)
            return error;
    }
    return bytes->failed ? pt_fail(&frame->handle, PATINA_ERROR_MEMORY, "saving shadows: out of memory") : PATINA_OK;
}

static int write_file(const struct patina_frame *frame, const char *path, const struct bytes *header, const struct bytes *body)
{
    struct pt_whole whole;
    char text[128];
    int error = pt_whole_begin(path, &whole);
    if (!error) {
        const int good = fwrite(header->data, 1, header->size, whole.stream) == header->size &&
                         fwrite(body->data, 1, body->size, whole.stream) == body->size;
        error = pt_whole_end(&whole, good);
    }
    return error ? pt_fail(&frame->handle, PATINA_ERROR_FILE, "%s: shadows cannot be written: %s", path,
                           pt_error_text(error, text, sizeof text))
                 : PATINA_OK;
}

int pt_frame_save_shadows(const struct patina_frame *frame, const char *path)
{
    const struct pt_shadows *shadows = &frame->shadows;
    struct bytes body = {0}, header = {0};
    int whole = shadows->light_count > 0 && !shadows->of_marked;
    for (uint32_t i = 0; i < shadows->light_count; i++)
        whole &= shadows->lights[i].samples && !shadows->lights[i].partial;
    if (!whole)
        return pt_fail(&frame->handle, PATINA_ERROR_EMPTY, "%s: the frame holds no whole shadow textures; bake them first",
                       path);
    uint32_t width = bytes_a_word(shadows);
    int error = put_textures(frame, width, &body);
    if (!error) {
        put(&header, magic, sizeof magic);
        put32(&header, VERSION);
        put32(&header, shadows->light_count);
        put32(&header, shadows->instance_count);
        put32(&header, width);
        put64(&header, pt_fingerprint(VERSION, body.data, body.size));
        error = header.failed ? pt_fail(&frame->handle, PATINA_ERROR_MEMORY, "saving shadows: out of memory")
                              : write_file(frame, path, &header, &body);
    }
    free(body.data);
    free(header.data);
    return error;
}

// ---- reading -----------------------------------------------------------------------------------------------------------

struct reader {
    const struct patina_frame *frame;
    const char *path;
    const unsigned char *at, *end;
    uint32_t lights, instances, width;
};

static int refuse(const struct reader *reader, const char *why)
{
    return pt_fail(&reader->frame->handle, PATINA_ERROR_FORMAT, "%s: %s", reader->path, why);
}

static int take(struct reader *reader, void *out, size_t size)
{
    if ((size_t)(reader->end - reader->at) < size)
        return refuse(reader, "damaged: it ends early");
    memcpy(out, reader->at, size);
    reader->at += size;
    return PATINA_OK;
}

static unsigned char *read_file(const char *path, size_t *size)
{
    struct pt_disk disk;
    unsigned char *data = NULL;
    size_t got = 0;
    *size = 0;
    if (pt_disk_open(path, &disk))
        return NULL;
    if (disk.kind == PT_DISK_FILE && disk.size < SIZE_MAX)
        data = malloc((size_t)disk.size + 1);
    if (data && (pt_disk_read(&disk, 0, data, (size_t)disk.size, &got) || got != disk.size)) {
        free(data);
        data = NULL;
    }
    pt_disk_close(&disk);
    *size = data ? got : 0;
    return data;
}

static int check_header(struct reader *reader, const struct patina_scene *scene, const struct pt_plan *plan)
{
    uint32_t version = 0;
    uint64_t checksum = 0;
    char start[sizeof magic];
    if ((size_t)(reader->end - reader->at) < HEADER_BYTES || memcmp(reader->at, magic, sizeof magic) != 0)
        return refuse(reader, "no file of shadow textures");
    take(reader, start, sizeof start);
    take(reader, &version, 4);
    take(reader, &reader->lights, 4);
    take(reader, &reader->instances, 4);
    take(reader, &reader->width, 4);
    take(reader, &checksum, 8);
    if (version != VERSION)
        return pt_fail(&reader->frame->handle, PATINA_ERROR_FORMAT, "%s: of version %u; this is for version %d: bake anew",
                       reader->path, version, VERSION);
    if (checksum != pt_fingerprint(VERSION, reader->at, (size_t)(reader->end - reader->at)) ||
        (reader->width != 1 && reader->width != 2 && reader->width != 4))
        return refuse(reader, "damaged: its checksum is wrong");
    if (reader->lights != plan->light_count)
        return pt_fail(&reader->frame->handle, PATINA_ERROR_FORMAT, "%s: stale: baked with %u casting lights, the scene has %u",
                       reader->path, reader->lights, plan->light_count);
    if (reader->instances != scene->cloud_count)
        return pt_fail(&reader->frame->handle, PATINA_ERROR_FORMAT, "%s: foreign: baked for %u clouds, the scene has %u",
                       reader->path, reader->instances, scene->cloud_count);
    return PATINA_OK;
}

// Compares a light's numbers with the scene's; on success `light` owns them.
static int take_light(struct reader *reader, const struct patina_scene *scene, const struct pt_plan *plan, uint32_t i,
                      struct pt_shadow_light *light)
{
    uint32_t count = 0;
    size_t wanted = pt_light_key(scene, &plan->lights[i], pt_cloud_fingerprint, NULL, 0);
    if (take(reader, &light->samples, 4) || take(reader, &light->settled, 4) || take(reader, &light->error, 4) ||
        take(reader, &count, 4))
        return PATINA_ERROR_FORMAT;
    double *key = malloc(wanted * sizeof *key), *ours = malloc(wanted * sizeof *ours);
    int error = key && ours ? PATINA_OK
                            : pt_fail(&reader->frame->handle, PATINA_ERROR_MEMORY, "loading shadows: out of memory");
    if (!error && count != wanted)
        error = refuse(reader, "damaged: a light of another kind");
    if (!error)
        error = take(reader, key, wanted * sizeof *key);
    if (!error) {
        pt_light_key(scene, &plan->lights[i], pt_cloud_fingerprint, ours, wanted);
        if (!pt_same_key(key, ours, wanted))
            error = pt_fail(&reader->frame->handle, PATINA_ERROR_FORMAT,
                            "%s: stale: light %u, a cloud, or how they lie to each other changed since it was baked",
                            reader->path, i);
        else if (!light->samples || light->samples > 4096 || (light->samples != plan->lights[i].samples && !light->settled))
            error = pt_fail(&reader->frame->handle, PATINA_ERROR_FORMAT,
                            "%s: stale: light %u was baked with %u samples, the scene asks for %u", reader->path, i,
                            light->samples, plan->lights[i].samples);
    }
    free(ours);
    if (error) {
        free(key);
        return error;
    }
    light->key = key;
    light->key_count = wanted;
    return PATINA_OK;
}

static int take_words(struct reader *reader, struct patina_frame *frame, uint32_t i)
{
    struct pt_buffer *buffer = &frame->shadows.words[i];
    uint32_t *words = calloc(buffer->size / 4 + 1, 4);
    int error = words ? PATINA_OK : pt_fail(&frame->handle, PATINA_ERROR_MEMORY, "loading shadows: out of memory");
    for (size_t k = 0; k < buffer->size / 4 && !error; k++)
        error = take(reader, &words[k], reader->width);
    if (!error && (error = frame->device->ops->buffer_write(frame->device, buffer, 0, words, buffer->size)))
        pt_fail_again(&frame->handle, error);
    free(words);
    return error;
}

// The instances' fingerprints, ahead of any change: foreign points leave the frame as it was.
static int check_instances(struct reader reader, const struct patina_scene *scene)
{
    for (uint32_t i = 0; i < reader.instances; i++) {
        const struct pt_instance *instance = &scene->instances[i];
        uint64_t fingerprint = 0, points = 0, wanted = pt_receives(instance) ? instance->cloud->slots : 0;
        if (take(&reader, &fingerprint, 8) || take(&reader, &points, 8))
            return PATINA_ERROR_FORMAT;
        if (points != wanted || fingerprint != pt_shadows_identity(instance))
            return pt_fail(&reader.frame->handle, PATINA_ERROR_FORMAT, "%s: foreign: baked for other points than cloud %u's",
                           reader.path, i);
        size_t size = (size_t)points * reader.lights * reader.width;
        if ((size_t)(reader.end - reader.at) < size)
            return refuse(&reader, "damaged: it ends early");
        reader.at += size;
    }
    return reader.at == reader.end ? PATINA_OK : refuse(&reader, "damaged: there is more than it should hold");
}

static int take_textures(struct reader *reader, struct patina_frame *frame, const struct patina_scene *scene,
                         const struct pt_plan *plan)
{
    struct pt_shadow_light lights[PT_MAX_LIGHTS] = {0};
    int error = PATINA_OK;
    for (uint32_t i = 0; i < reader->lights && !error; i++)
        error = take_light(reader, scene, plan, i, &lights[i]);
    if (!error)
        error = check_instances(*reader, scene);
    if (!error)
        error = pt_shadows_make_places(frame->device, &frame->shadows, scene, plan->light_count, 0);
    if (error)
        pt_fail_again(&frame->handle, error);
    for (uint32_t i = 0; i < reader->instances && !error; i++) {
        reader->at += 16;
        if (frame->shadows.words[i].size)
            error = take_words(reader, frame, i);
    }
    for (uint32_t i = 0; i < PT_MAX_LIGHTS; i++) {
        if (!error && i < reader->lights)
            frame->shadows.lights[i] = lights[i];
        else
            free(lights[i].key);
    }
    return error;
}

int pt_frame_load_shadows(struct patina_frame *frame, const struct patina_scene *scene, const char *path)
{
    struct pt_plan plan = {0};
    size_t size;
    unsigned char *data = read_file(path, &size);
    if (!data)
        return pt_fail(&frame->handle, PATINA_ERROR_FILE, "%s: cannot be read", path);
    struct reader reader = {.frame = frame, .path = path, .at = data, .end = data + size};
    pt_plan_lights(scene, &plan);
    int error = check_header(&reader, scene, &plan);
    if (!error)
        error = take_textures(&reader, frame, scene, &plan);
    if (!error)
        error = pt_frame_number(frame, scene, NULL);
    pt_plan_destroy(&plan);
    free(data);
    return error;
}
