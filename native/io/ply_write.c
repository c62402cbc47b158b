// SPDX-License-Identifier: GPL-3.0-or-later
// patina_write_ply: binary little-endian, the columns of a cloud's descriptor. Written beside the target and renamed
// over it when whole, so that a full disk never costs the file that was there.
#include "ply.h"
#include "base/descriptor.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    BLOCK = 4096,    // rows a write
    LONGEST_ROW = 64 // bytes: 3 + 3 doubles and 4 floats
};

struct writer {
    const patina_cloud_desc *desc;
    bool has_origin;
    uint32_t position_type; // as written
    FILE *stream;
};

// One optional array of the descriptor.
static int check_array(const patina_array *array, uint64_t count, bool types_fit, bool components_fit, const char *name)
{
    if (!types_fit || !components_fit)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_write_ply: %s: %u components of type %u cannot be written", name,
                       array->components, array->type);
    uint64_t packed = array->components * pt_type_size(array->type);
    if (array->stride && array->stride < packed)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_write_ply: %s: the stride %llu is less than an element", name,
                       (unsigned long long)array->stride);
    if (count > (uint64_t)PTRDIFF_MAX / (array->stride ? array->stride : packed))
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_write_ply: %llu points are more than memory can hold",
                       (unsigned long long)count);
    return PATINA_OK;
}

static int check_desc(const patina_cloud_desc *desc)
{
    const patina_array *p = &desc->position, *n = &desc->normal, *c = &desc->color;
    if (!p->data && desc->count)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_write_ply: there are no positions");
    for (int axis = 0; axis < 3; axis++)
        if (!isfinite(desc->origin[axis]))
            return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_write_ply: the origin is not finite");
    int code = p->data ? check_array(p, desc->count, pt_is_float(p->type), p->components == 3, "positions") : PATINA_OK;
    if (!code && n->data)
        code = check_array(n, desc->count, pt_is_float(n->type), n->components == 3, "normals");
    bool color_type = c->type == PATINA_UINT8 || c->type == PATINA_UINT16 || c->type == PATINA_FLOAT32;
    if (!code && c->data)
        code = check_array(c, desc->count, color_type, c->components == 3 || c->components == 4, "colours");
    return code;
}

static void write_header(const struct writer *w)
{
    static const char *const position[] = {"x", "y", "z"}, *const normal[] = {"nx", "ny", "nz"},
                             *const color[] = {"red", "green", "blue", "alpha"};
    const patina_cloud_desc *d = w->desc;
    fprintf(w->stream, "ply\nformat binary_little_endian 1.0\ncomment written by Patina %d.%d.%d\nelement vertex %llu\n",
            PATINA_VERSION_MAJOR, PATINA_VERSION_MINOR, PATINA_VERSION_PATCH, (unsigned long long)d->count);
    for (uint32_t i = 0; i < 3; i++)
        fprintf(w->stream, "property %s %s\n", ply_type_name(w->position_type), position[i]);
    for (uint32_t i = 0; d->normal.data && i < 3; i++)
        fprintf(w->stream, "property %s %s\n", ply_type_name(d->normal.type), normal[i]);
    for (uint32_t i = 0; d->color.data && i < d->color.components; i++)
        fprintf(w->stream, "property %s %s\n", ply_type_name(d->color.type), color[i]);
    fprintf(w->stream, "end_header\n");
}

// Copies size bytes of a little-endian value, whatever this machine's order.
static uint8_t *put(uint8_t *row, const void *value, size_t size)
{
    const uint8_t *bytes = value;
    for (size_t i = 0; i < size; i++)
        row[i] = bytes[__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__ ? i : size - 1 - i];
    return row + size;
}

static const uint8_t *element(const patina_array *array, uint64_t i)
{
    uint64_t stride = array->stride ? array->stride : array->components * pt_type_size(array->type);
    return (const uint8_t *)array->data + i * stride;
}

static uint8_t *put_array(uint8_t *row, const patina_array *array, uint64_t i)
{
    size_t size = pt_type_size(array->type);
    const uint8_t *from = element(array, i);
    for (uint32_t c = 0; c < array->components; c++)
        row = put(row, from + c * size, size);
    return row;
}

static uint8_t *put_position(uint8_t *row, const struct writer *w, uint64_t i)
{
    const patina_array *array = &w->desc->position;
    if (!w->has_origin)
        return put_array(row, array, i);
    const uint8_t *from = element(array, i);
    for (int axis = 0; axis < 3; axis++) {
        double wide;
        float narrow;
        if (array->type == PATINA_FLOAT64) {
            memcpy(&wide, from + 8 * axis, sizeof wide);
        } else {
            memcpy(&narrow, from + 4 * axis, sizeof narrow);
            wide = (double)narrow;
        }
        wide += w->desc->origin[axis];
        row = put(row, &wide, sizeof wide);
    }
    return row;
}

static bool write_rows(const struct writer *w)
{
    uint8_t *block = malloc((size_t)BLOCK * LONGEST_ROW);
    bool good = block != NULL;
    for (uint64_t first = 0; good && first < w->desc->count; first += BLOCK) {
        uint64_t end = w->desc->count - first < BLOCK ? w->desc->count : first + BLOCK;
        uint8_t *row = block;
        for (uint64_t i = first; i < end; i++) {
            row = put_position(row, w, i);
            if (w->desc->normal.data)
                row = put_array(row, &w->desc->normal, i);
            if (w->desc->color.data)
                row = put_array(row, &w->desc->color, i);
        }
        good = fwrite(block, 1, (size_t)(row - block), w->stream) == (size_t)(row - block);
    }
    free(block);
    return good;
}

static int fail_to_write(const char *path, int error)
{
    char name[200], buffer[128];
    pt_clip_name(name, sizeof name, path);
    return pt_fail(NULL, PATINA_ERROR_FILE, "%s: cannot be written: %s", name, pt_error_text(error, buffer, sizeof buffer));
}

int patina_write_ply(const char *path, const patina_cloud_desc *given)
{
    patina_cloud_desc taken;
    const patina_cloud_desc *const desc = &taken;
    if (!path || !given)
        return pt_fail(NULL, PATINA_ERROR_ARGUMENT, "patina_write_ply: path or desc is NULL");
    int code = pt_take(NULL, "patina_write_ply", given, &taken, sizeof taken);
    code = code ? code : check_desc(desc);
    if (code)
        return code;
    struct writer w = {.desc = desc};
    for (int axis = 0; axis < 3; axis++)
        w.has_origin |= desc->origin[axis] != 0;
    w.position_type = w.has_origin || desc->position.type == PATINA_FLOAT64 ? PATINA_FLOAT64 : PATINA_FLOAT32;

    struct pt_whole whole;
    int error = pt_whole_begin(path, &whole);
    if (error)
        return fail_to_write(path, error);
    w.stream = whole.stream;
    write_header(&w);
    bool good = write_rows(&w) && !ferror(w.stream);
    error = pt_whole_end(&whole, good);
    return error ? fail_to_write(path, error) : PATINA_OK;
}
