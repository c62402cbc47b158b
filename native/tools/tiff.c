// SPDX-License-Identifier: GPL-3.0-or-later
// TIFF 6.0 with deflated strips, and GeoTIFF 1.1 (OGC 19-008) with a projected or a local coordinate system.
#include "tiff.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

enum { STRIP_BYTES = 1 << 20, LEVEL = 4, ENTRIES = 24 };
enum { SHORT = 3, LONG = 4, ASCII = 2, DOUBLE = 12 };

static const struct {
    uint16_t samples, bytes, format; // format: 1 whole numbers, 3 IEEE
} kinds[] = {[TIFF_BYTE] = {1, 1, 1}, [TIFF_FLOAT] = {1, 4, 3}, [TIFF_RGBA] = {4, 1, 1}, [TIFF_RGBA16] = {4, 2, 1}};

struct tool_tiff {
    char *path;
    struct pt_whole whole;
    enum tool_tiff_kind kind;
    struct tool_raster raster;
    uint32_t width, height, rows_per_strip, rows, strips;
    size_t row_bytes, packed_room;
    uint8_t *strip, *packed;
    uint32_t *offsets, *sizes; // of strips
    uint64_t at;               // where the next byte goes
    int error;                 // of errno.h
};

static void put(struct tool_tiff *tiff, const void *bytes, size_t size)
{
    if (tiff->error)
        return;
    if (tiff->at + size > UINT32_MAX)
        tiff->error = EFBIG;
    else if (size && fwrite(bytes, 1, size, tiff->whole.stream) != size)
        tiff->error = errno ? errno : EIO;
    tiff->at += size;
}

static int end(struct tool_tiff *tiff, int good)
{
    const int wanted = good;
    char why[128];
    good = good && !tiff->error;
    const int error = tiff->whole.stream ? pt_whole_end(&tiff->whole, good) : 0;
    if (wanted && tiff->error == EFBIG)
        tool_say("'%s' cannot be written: it would have more than 4 GiB. Make --extent smaller, or --pixel larger", tiff->path);
    else if (wanted && (tiff->error || error))
        tool_say("'%s' cannot be written: %s", tiff->path, pt_error_text(tiff->error ? tiff->error : error, why, sizeof why));
    free(tiff->path);
    free(tiff->strip);
    free(tiff->packed);
    free(tiff->offsets);
    free(tiff->sizes);
    free(tiff);
    return good && !error ? 0 : -1;
}

struct tool_tiff *tool_tiff_open(const char *path, uint32_t width, uint32_t height, enum tool_tiff_kind kind,
                                 const struct tool_raster *raster)
{
    struct tool_tiff *tiff = calloc(1, sizeof *tiff);
    if (!tiff) {
        tool_say("out of memory");
        return NULL;
    }
    tiff->kind = kind;
    tiff->raster = *raster;
    tiff->width = width;
    tiff->height = height;
    tiff->row_bytes = (size_t)width * kinds[kind].samples * kinds[kind].bytes;
    tiff->rows_per_strip = (uint32_t)(STRIP_BYTES / tiff->row_bytes) + 1;
    tiff->packed_room = compressBound((uLong)(tiff->row_bytes * tiff->rows_per_strip));
    tiff->path = malloc(strlen(path) + 1);
    tiff->strip = malloc(tiff->row_bytes * tiff->rows_per_strip);
    tiff->packed = malloc(tiff->packed_room);
    tiff->offsets = malloc((height / tiff->rows_per_strip + 1) * sizeof *tiff->offsets);
    tiff->sizes = malloc((height / tiff->rows_per_strip + 1) * sizeof *tiff->sizes);
    if (tiff->path)
        strcpy(tiff->path, path);
    if (!tiff->path || !tiff->strip || !tiff->packed || !tiff->offsets || !tiff->sizes) {
        tool_say("'%s' cannot be written: out of memory", path);
    } else if ((tiff->error = pt_whole_begin(path, &tiff->whole)) != 0) {
        tiff->whole.stream = NULL;
        end(tiff, 1);
        return NULL;
    } else {
        put(tiff, (const uint8_t[8]){0}, 8); // the head follows when the directory's place is known
        return tiff;
    }
    end(tiff, 0);
    return NULL;
}

static void end_strip(struct tool_tiff *tiff)
{
    const uint32_t rows = (tiff->rows - 1) % tiff->rows_per_strip + 1;
    uLongf size = (uLongf)tiff->packed_room;
    if (!tiff->error && compress2(tiff->packed, &size, tiff->strip, (uLong)(tiff->row_bytes * rows), LEVEL) != Z_OK)
        tiff->error = ENOMEM;
    tiff->offsets[tiff->strips] = (uint32_t)tiff->at;
    tiff->sizes[tiff->strips++] = (uint32_t)size;
    put(tiff, tiff->packed, size);
}

int tool_tiff_row(struct tool_tiff *tiff, const void *row)
{
    memcpy(tiff->strip + tiff->row_bytes * (tiff->rows % tiff->rows_per_strip), row, tiff->row_bytes);
    tiff->rows++;
    if (tiff->rows % tiff->rows_per_strip == 0 || tiff->rows == tiff->height)
        end_strip(tiff);
    return tiff->error ? -1 : 0;
}

// ---- the directory -------------------------------------------------------------------------------------------------

struct directory {
    uint16_t count;
    struct entry {
        uint16_t tag, type;
        uint32_t count, value;
    } entries[ENTRIES];
};

// Adds a tag; values that do not fit into its entry are written before the directory.
static void add(struct tool_tiff *tiff, struct directory *directory, uint16_t tag, uint16_t type, uint32_t count,
                const void *values)
{
    const size_t size = count * (type == ASCII ? 1u : type == SHORT ? 2u : type == LONG ? 4u : 8u);
    struct entry *entry = &directory->entries[directory->count++];
    *entry = (struct entry){.tag = tag, .type = type, .count = count};
    if (size <= sizeof entry->value) {
        memcpy(&entry->value, values, size);
        return;
    }
    put(tiff, (const uint8_t[8]){0}, (8 - tiff->at % 8) % 8);
    entry->value = (uint32_t)tiff->at;
    put(tiff, values, size);
}

static void add_short(struct tool_tiff *tiff, struct directory *directory, uint16_t tag, uint16_t value)
{
    add(tiff, directory, tag, SHORT, 1, &value);
}

static void add_long(struct tool_tiff *tiff, struct directory *directory, uint16_t tag, uint32_t value)
{
    add(tiff, directory, tag, LONG, 1, &value);
}

static void add_place(struct tool_tiff *tiff, struct directory *directory)
{
    const struct tool_raster *r = &tiff->raster;
    if (r->along_row[1] == 0 && r->down[0] == 0 && r->along_row[0] > 0 && r->down[1] < 0) {
        add(tiff, directory, 33550, DOUBLE, 3, (const double[3]){r->along_row[0], -r->down[1], 0});        // ModelPixelScale
        add(tiff, directory, 33922, DOUBLE, 6, (const double[6]){0, 0, 0, r->corner[0], r->corner[1], 0}); // ModelTiepoint
        return;
    }
    const double m[16] = {
        r->along_row[0], r->down[0], 0, r->corner[0], r->along_row[1], r->down[1], 0, r->corner[1], 0, 0, 0, 0, 0, 0, 0, 1};
    add(tiff, directory, 34264, DOUBLE, 16, m); // ModelTransformation
}

// GeoKeys: model 1 is projected, 32767 the user's; raster 1: pixels are areas; unit 9001 is the meter.
static void add_keys(struct tool_tiff *tiff, struct directory *directory)
{
    const struct tool_raster *r = &tiff->raster;
    if (r->epsg) {
        const uint16_t keys[] = {1, 1, 1, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, (uint16_t)r->epsg};
        add(tiff, directory, 34735, SHORT, sizeof keys / sizeof *keys, keys);
        return;
    }
    const size_t length = strlen(r->name) + 1; // the key's text ends in a bar
    char *text = malloc(length + 1);
    if (!text) {
        tiff->error = ENOMEM;
        return;
    }
    memcpy(text, r->name, length);
    memcpy(text + length - 1, "|", 2);
    const uint16_t keys[] = {1, 1, 1, 4, 1024, 0, 1, 32767, 1025, 0, 1, 1, 1026, 34737, (uint16_t)length, 0, 3076, 0, 1, 9001};
    add(tiff, directory, 34735, SHORT, sizeof keys / sizeof *keys, keys);
    add(tiff, directory, 34737, ASCII, (uint32_t)length + 1, text);
    free(text);
}

static void write_directory(struct tool_tiff *tiff)
{
    const uint16_t samples = kinds[tiff->kind].samples, bits = (uint16_t)(8 * kinds[tiff->kind].bytes),
                   format = kinds[tiff->kind].format;
    struct directory d = {0}; // tags in ascending order
    add_long(tiff, &d, 256, tiff->width);
    add_long(tiff, &d, 257, tiff->height);
    add(tiff, &d, 258, SHORT, samples, (const uint16_t[4]){bits, bits, bits, bits});
    add_short(tiff, &d, 259, 8);                    // compression: deflate
    add_short(tiff, &d, 262, samples == 4 ? 2 : 1); // RGB, or 0 is black
    add(tiff, &d, 273, LONG, tiff->strips, tiff->offsets);
    add_short(tiff, &d, 277, samples);
    add_long(tiff, &d, 278, tiff->rows_per_strip);
    add(tiff, &d, 279, LONG, tiff->strips, tiff->sizes);
    add_short(tiff, &d, 284, 1); // samples of a pixel are together
    if (samples == 4)
        add_short(tiff, &d, 338, 2); // the fourth is alpha, not premultiplied
    add(tiff, &d, 339, SHORT, samples, (const uint16_t[4]){format, format, format, format});
    add_place(tiff, &d);
    add_keys(tiff, &d);
    if (tiff->kind == TIFF_FLOAT)
        add(tiff, &d, 42113, ASCII, 4, "nan"); // GDAL's: what stands for nothing
    put(tiff, (const uint8_t[8]){0}, (8 - tiff->at % 8) % 8);
    const uint32_t begin = (uint32_t)tiff->at;
    put(tiff, &d.count, sizeof d.count);
    put(tiff, d.entries, d.count * sizeof *d.entries);
    put(tiff, (const uint8_t[4]){0}, 4);
    const uint16_t order = 0x4949, answer = 42; // all systems that Patina is built for have the lowest byte first
    if (!tiff->error && pt_stream_seek(tiff->whole.stream, 0))
        tiff->error = errno ? errno : EIO;
    put(tiff, &order, sizeof order);
    put(tiff, &answer, sizeof answer);
    put(tiff, &begin, sizeof begin);
}

int tool_tiff_close(struct tool_tiff *tiff, int good)
{
    if (good && !tiff->error)
        write_directory(tiff);
    if (good && !tiff->error && (fflush(tiff->whole.stream) || ferror(tiff->whole.stream)))
        tiff->error = errno ? errno : EIO;
    return end(tiff, good);
}
