// SPDX-License-Identifier: GPL-3.0-or-later
#include "key_file.h"

#include "base/version.h"
#include "shared/view.h"
#include "scene/clouds/fingerprint.h"

#include <stdlib.h>
#include <string.h>

static const char magic[8] = {'p', 'a', 't', 'k', 'e', 'y', 's', '\n'};

_Static_assert(sizeof(struct pt_keys_head) == 112 && sizeof(struct pt_keys_record) == 48, "the file has no padding");

static uint64_t check_of(const struct pt_keys_head *head)
{
    return pt_fingerprint(PT_KEYS_VERSION, head, offsetof(struct pt_keys_head, check));
}

// ---- writing ---------------------------------------------------------------------------------------------------------

static int cannot_write(struct pt_key_writer *writer, int error)
{
    char text[128];
    return pt_fail(writer->handle, PATINA_ERROR_FILE, "%s: keys cannot be written: %s", writer->path,
                   pt_error_text(error, text, sizeof text));
}

static int put(struct pt_key_writer *writer, const void *data, size_t size)
{
    if (size && fwrite(data, 1, size, writer->whole.stream) != size)
        writer->failed = 1; // pt_whole_end knows why
    writer->head.size += size;
    return writer->failed;
}

int pt_key_writer_begin(struct pt_key_writer *writer, const struct pt_handle *handle, const char *path,
                        const struct pt_keys_head *head, const char *note)
{
    *writer = (struct pt_key_writer){.handle = handle, .path = path, .head = *head};
    struct pt_keys_head *own = &writer->head;
    memcpy(own->magic, magic, sizeof magic);
    own->version = PT_KEYS_VERSION;
    snprintf(own->engine, sizeof own->engine, "%s", pt_version);
    own->records = 0;
    own->size = 0;
    own->note_size = note ? strlen(note) : 0;
    if (own->note_size > PT_KEYS_MOST_NOTE)
        return pt_fail(handle, PATINA_ERROR_ARGUMENT, "%s: its note is longer than 1 MiB", path);
    const int error = pt_whole_begin(path, &writer->whole);
    if (error)
        return cannot_write(writer, error);
    own->sums = pt_fingerprint(PT_KEYS_VERSION, note, own->note_size);
    put(writer, own, sizeof *own);
    put(writer, note, own->note_size);
    return PATINA_OK;
}

static int put_record(struct pt_key_writer *writer, struct pt_keys_record *record, const void *data)
{
    record->sum = pt_fingerprint(PT_KEYS_VERSION, data, record->size);
    put(writer, record, sizeof *record);
    put(writer, data, record->size);
    writer->head.sums = pt_fingerprint(writer->head.sums, record, sizeof *record);
    writer->head.records++;
    return PATINA_OK;
}

static int is_empty(uint64_t key) { return key >> 32 == PT_KEY_EMPTY_Z; }

int pt_key_writer_keys(struct pt_key_writer *writer, const struct pt_keys_name *name, const uint64_t *plane, uint32_t width,
                       uint32_t first, uint32_t rows)
{
    unsigned char *data = malloc((size_t)rows * (8 + 8 * (size_t)width) + 1), *at = data;
    if (!data)
        return pt_fail(writer->handle, PATINA_ERROR_MEMORY, "%s: writing keys: out of memory", writer->path);
    for (uint32_t y = first; y < first + rows; y++) {
        const uint64_t *row = plane + (size_t)y * width;
        uint32_t span[2] = {0, width};
        while (span[0] < width && is_empty(row[span[0]]))
            span[0]++;
        while (span[1] > span[0] && is_empty(row[span[1] - 1]))
            span[1]--;
        span[1] -= span[0];
        memcpy(at, span, sizeof span);
        memcpy(at + sizeof span, row + span[0], 8 * (size_t)span[1]);
        at += sizeof span + 8 * (size_t)span[1];
    }
    struct pt_keys_record record = {*name, width, first, rows, (uint64_t)(at - data), 0};
    put_record(writer, &record, data);
    free(data);
    return PATINA_OK;
}

int pt_key_writer_limits(struct pt_key_writer *writer, const struct pt_keys_name *name, const float *plane, uint32_t width,
                         uint32_t first, uint32_t rows)
{
    struct pt_keys_record record = {*name, width, first, rows, 4 * (uint64_t)width * rows, 0};
    return put_record(writer, &record, plane + (size_t)first * width);
}

int pt_key_writer_end(struct pt_key_writer *writer, int error)
{
    struct pt_keys_head *head = &writer->head;
    head->check = check_of(head);
    if (!error && !writer->failed)
        writer->failed = pt_stream_seek(writer->whole.stream, 0) || fwrite(head, sizeof *head, 1, writer->whole.stream) != 1;
    const int code = pt_whole_end(&writer->whole, !error && !writer->failed);
    return error ? error : code ? cannot_write(writer, code) : PATINA_OK;
}

// ---- reading ---------------------------------------------------------------------------------------------------------

static int refuse(const struct pt_key_file *file, const struct pt_handle *handle, const char *why)
{
    return pt_fail(handle, PATINA_ERROR_FORMAT, "%s: %s", file->path, why);
}

static int read_at(const struct pt_key_file *file, const struct pt_handle *handle, uint64_t offset, void *data, size_t size)
{
    size_t got = 0;
    const int error = pt_disk_read(&file->disk, offset, data, size, &got);
    char text[128];
    if (error)
        return pt_fail(handle, PATINA_ERROR_FILE, "%s: cannot be read: %s", file->path,
                       pt_error_text(error, text, sizeof text));
    return got < size ? refuse(file, handle, "damaged: it ends early") : PATINA_OK;
}

static int read_head(struct pt_key_file *file, const struct pt_handle *handle)
{
    struct pt_keys_head *head = &file->head;
    if (file->disk.kind != PT_DISK_FILE || file->disk.size < sizeof magic)
        return refuse(file, handle, "no file of keys");
    const size_t size = file->disk.size < sizeof *head ? (size_t)file->disk.size : sizeof *head;
    const int error = read_at(file, handle, 0, head, size);
    if (error)
        return error;
    if (memcmp(head->magic, magic, sizeof magic) != 0)
        return refuse(file, handle, "no file of keys");
    if (size < sizeof *head)
        return refuse(file, handle, "damaged: it ends early");
    if (head->version != PT_KEYS_VERSION)
        return pt_fail(handle, PATINA_ERROR_FORMAT, "%s: keys of version %u; this is for version %d: scatter anew", file->path,
                       head->version, PT_KEYS_VERSION);
    if (head->check != check_of(head)) // as it was read, so before anything in it is cut
        return refuse(file, handle, "damaged: the check sum of its head is wrong");
    head->engine[sizeof head->engine - 1] = 0;
    if (head->size != file->disk.size)
        return pt_fail(handle, PATINA_ERROR_FORMAT, "%s: damaged: it has %llu of %llu bytes", file->path,
                       (unsigned long long)file->disk.size, (unsigned long long)head->size);
    if (strcmp(head->engine, pt_version) != 0)
        return pt_fail(handle, PATINA_ERROR_FORMAT, "%s: written by Patina %s; this is %s: scatter anew", file->path,
                       head->engine, pt_version);
    return head->note_size > PT_KEYS_MOST_NOTE ? refuse(file, handle, "damaged: its note has no end") : PATINA_OK;
}

// The records' own heads: their pixels are read when they are asked for.
static int read_records(struct pt_key_file *file, const struct pt_handle *handle)
{
    const struct pt_keys_head *head = &file->head;
    uint64_t offset = sizeof *head + head->note_size, sums;
    if (head->records > head->size / sizeof *file->records)
        return refuse(file, handle, "damaged: it holds fewer records than it says");
    file->records = calloc(head->records + 1u, sizeof *file->records);
    file->offsets = calloc(head->records + 1u, sizeof *file->offsets);
    file->note = calloc(head->note_size + 1, 1);
    if (!file->records || !file->offsets || !file->note)
        return pt_fail(handle, PATINA_ERROR_MEMORY, "%s: out of memory", file->path);
    int error = read_at(file, handle, sizeof *head, file->note, head->note_size);
    sums = pt_fingerprint(PT_KEYS_VERSION, file->note, head->note_size);
    for (uint32_t i = 0; i < head->records && !error; i++) {
        struct pt_keys_record *record = &file->records[i];
        error = read_at(file, handle, offset, record, sizeof *record);
        offset += sizeof *record;
        file->offsets[i] = offset;
        sums = pt_fingerprint(sums, record, sizeof *record);
        if (!error && record->size > head->size - offset)
            return refuse(file, handle, "damaged: a record is longer than the file");
        offset += record->size;
    }
    if (!error && (offset != head->size || sums != head->sums))
        return refuse(file, handle, "damaged: its records are not those that were written");
    return error;
}

int pt_key_file_open(struct pt_key_file *file, const struct pt_handle *handle, const char *path)
{
    char text[128];
    *file = (struct pt_key_file){.path = path};
    int error = pt_disk_open(path, &file->disk);
    if (error)
        return pt_fail(handle, PATINA_ERROR_FILE, "%s: cannot be opened: %s", path, pt_error_text(error, text, sizeof text));
    error = read_head(file, handle);
    if (!error)
        error = read_records(file, handle);
    if (error) {
        pt_key_file_close(file);
        file->path = NULL;
    }
    return error;
}

void pt_key_file_close(struct pt_key_file *file)
{
    if (!file->path)
        return;
    pt_disk_close(&file->disk);
    free(file->records);
    free(file->offsets);
    free(file->note);
}

// What a record holds; NULL after a message.
static unsigned char *read_record(const struct pt_key_file *file, const struct pt_handle *handle,
                                  const struct pt_keys_name *name, const uint32_t shape[3], const struct pt_keys_record **out)
{
    uint32_t i = 0;
    while (i < file->head.records && memcmp(&file->records[i].name, name, sizeof *name) != 0)
        i++;
    const struct pt_keys_record *record = &file->records[i];
    if (i == file->head.records || record->width != shape[0] || record->first != shape[1] || record->rows != shape[2]) {
        refuse(file, handle, "its keys are of another picture");
        return NULL;
    }
    unsigned char *data = malloc(record->size + 1);
    if (!data) {
        pt_fail(handle, PATINA_ERROR_MEMORY, "%s: out of memory", file->path);
        return NULL;
    }
    if (read_at(file, handle, file->offsets[i], data, record->size)) {
        free(data);
        return NULL;
    }
    if (pt_fingerprint(PT_KEYS_VERSION, data, record->size) != record->sum) {
        free(data);
        refuse(file, handle, "damaged: the check sum of its keys is wrong");
        return NULL;
    }
    *out = record;
    return data;
}

int pt_key_file_take(const struct pt_key_file *file, const struct pt_handle *handle, const struct pt_keys_name *name,
                     uint64_t ids, uint64_t *plane, uint32_t width, uint32_t first, uint32_t rows)
{
    const uint32_t shape[3] = {width, first, rows};
    const struct pt_keys_record *record;
    unsigned char *data = read_record(file, handle, name, shape, &record);
    if (!data)
        return PATINA_ERROR_FORMAT;
    const unsigned char *at = data, *end = data + record->size;
    int good = 1;
    for (uint32_t y = 0; y < rows && good; y++) {
        uint32_t span[2] = {0, 0};
        good = (size_t)(end - at) >= sizeof span;
        if (good)
            memcpy(span, at, sizeof span);
        at += good ? sizeof span : 0;
        good = good && span[0] <= width && span[1] <= width - span[0] && (size_t)(end - at) >= 8 * (size_t)span[1];
        uint64_t *row = plane + (size_t)y * width + span[0];
        for (uint32_t x = 0; x < span[1] && good; x++, at += 8) {
            uint64_t key;
            memcpy(&key, at, sizeof key);
            good = is_empty(key) || (key >> 32 < PT_KEY_EMPTY_Z && (uint32_t)key < ids);
            row[x] = key < row[x] ? key : row[x];
        }
    }
    free(data);
    return good && at == end ? PATINA_OK : refuse(file, handle, "damaged: its rows do not fit");
}

int pt_key_file_limits(const struct pt_key_file *file, const struct pt_handle *handle, const struct pt_keys_name *name,
                       float *plane, uint32_t width, uint32_t first, uint32_t rows)
{
    const uint32_t shape[3] = {width, first, rows};
    const struct pt_keys_record *record;
    unsigned char *data = read_record(file, handle, name, shape, &record);
    if (!data)
        return PATINA_ERROR_FORMAT;
    const int fits = record->size == 4 * (uint64_t)width * rows;
    if (fits)
        memcpy(plane, data, record->size);
    free(data);
    return fits ? PATINA_OK : refuse(file, handle, "damaged: its rows do not fit");
}
