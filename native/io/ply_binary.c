// SPDX-License-Identifier: GPL-3.0-or-later
// Rows as bytes, either order. Rows without lists are converted a column at a time, in blocks that stay in the cache;
// rows with lists one by one. Values pass through float64, which holds every PLY type exactly.
#include "ply.h"

#include <string.h>

enum {
    BLOCK = 1024,     // rows: 8 KiB of float64
    POLL_ROWS = 65536 // a poll is cheap beside that many rows
};

struct bytes {
    struct ply_cursor *at;
    bool swap; // the file's byte order is not this machine's
};

static uint16_t read16(const uint8_t *p, bool swap)
{
    uint16_t bits;
    memcpy(&bits, p, sizeof bits);
    return swap ? __builtin_bswap16(bits) : bits;
}

static uint32_t read32(const uint8_t *p, bool swap)
{
    uint32_t bits;
    memcpy(&bits, p, sizeof bits);
    return swap ? __builtin_bswap32(bits) : bits;
}

static double read_float(const uint8_t *p, bool swap)
{
    uint32_t bits = read32(p, swap);
    float value;
    memcpy(&value, &bits, sizeof value);
    return (double)value;
}

static double read_double(const uint8_t *p, bool swap)
{
    uint64_t bits;
    memcpy(&bits, p, sizeof bits);
    bits = swap ? __builtin_bswap64(bits) : bits;
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

// n values of a type, the first at p, each `row` bytes behind the one before.
static void load(double *values, const uint8_t *p, size_t row, size_t n, uint32_t type, bool swap)
{
    switch (type) {
    case PATINA_INT8:
        for (size_t i = 0; i < n; i++)
            values[i] = (int8_t)p[i * row];
        break;
    case PATINA_UINT8:
        for (size_t i = 0; i < n; i++)
            values[i] = p[i * row];
        break;
    case PATINA_INT16:
        for (size_t i = 0; i < n; i++)
            values[i] = (int16_t)read16(p + i * row, swap);
        break;
    case PATINA_UINT16:
        for (size_t i = 0; i < n; i++)
            values[i] = read16(p + i * row, swap);
        break;
    case PATINA_INT32:
        for (size_t i = 0; i < n; i++)
            values[i] = (int32_t)read32(p + i * row, swap);
        break;
    case PATINA_UINT32:
        for (size_t i = 0; i < n; i++)
            values[i] = read32(p + i * row, swap);
        break;
    case PATINA_FLOAT32:
        for (size_t i = 0; i < n; i++)
            values[i] = read_float(p + i * row, swap);
        break;
    case PATINA_FLOAT64:
        for (size_t i = 0; i < n; i++)
            values[i] = read_double(p + i * row, swap);
        break;
    }
}

// Bytes of a row; 0 when it has lists.
static uint64_t fixed_row(const struct ply_property *properties, uint32_t count)
{
    uint64_t size = 0;
    for (uint32_t k = 0; k < count; k++) {
        if (properties[k].count_type != PATINA_NONE)
            return 0;
        size += pt_type_size(properties[k].type);
    }
    return size;
}

static int read_fixed(struct bytes *b, const struct ply_property *properties, const struct ply_element *element, uint64_t row,
                      const struct ply_target *targets)
{
    double values[BLOCK];
    for (uint64_t first = 0; first < element->count; first += BLOCK) {
        size_t n = element->count - first < BLOCK ? (size_t)(element->count - first) : BLOCK;
        const uint8_t *p = b->at->input->data + b->at->offset;
        int code = first % POLL_ROWS ? PATINA_OK : ply_poll(b->at->input, b->at->offset);
        if (code)
            return code;
        for (uint32_t k = 0; k < element->properties; k++) {
            if (targets[k].data) {
                load(values, p, row, n, properties[k].type, b->swap);
                ply_store(&targets[k], first, n, values);
            }
            p += pt_type_size(properties[k].type);
        }
        b->at->offset += n * row;
    }
    return PATINA_OK;
}

static int ends_early(const struct bytes *b, const struct ply_element *element, uint64_t i)
{
    return ply_fault(b->at, "%s: the file ends at byte %llu, inside row %llu of the %llu of element %s (from byte %llu on)",
                     b->at->input->name, (unsigned long long)b->at->input->size, (unsigned long long)(b->at->before + i),
                     (unsigned long long)(b->at->all ? b->at->all : element->count), element->name,
                     (unsigned long long)b->at->offset);
}

// The items of a list, handed on or passed over.
static int read_items(struct bytes *b, const struct ply_property *property, const struct ply_element *element,
                      struct ply_lists *lists, uint64_t i, double count)
{
    struct ply_cursor *at = b->at;
    if (count < 0)
        return ply_fault(at, "%s: byte %llu: list %s of row %llu has the count %.0f", at->input->name,
                         (unsigned long long)(at->offset - pt_type_size(property->count_type)), property->name,
                         (unsigned long long)(at->before + i), count);
    size_t item = pt_type_size(property->type);
    uint64_t size = (uint64_t)count * item; // below 2^35
    if (at->input->size - at->offset < size)
        return ends_early(b, element, i);
    int code = lists ? ply_make_room(at, lists, (size_t)count) : PATINA_OK;
    if (lists && !code) {
        load(lists->items, at->input->data + at->offset, item, (size_t)count, property->type, b->swap);
        lists->take(lists->context, i, lists->items, (size_t)count);
    }
    at->offset += size;
    return code;
}

static int read_loose_row(struct bytes *b, const struct ply_property *properties, const struct ply_element *element,
                          const struct ply_target *targets, struct ply_lists *lists, uint64_t i)
{
    double value;
    int code = PATINA_OK;
    for (uint32_t k = 0; k < element->properties && !code; k++) {
        bool list = properties[k].count_type != PATINA_NONE;
        uint32_t type = list ? properties[k].count_type : properties[k].type;
        if (b->at->input->size - b->at->offset < pt_type_size(type))
            return ends_early(b, element, i);
        load(&value, b->at->input->data + b->at->offset, 0, 1, type, b->swap);
        b->at->offset += pt_type_size(type);
        if (list)
            code = read_items(b, &properties[k], element, lists && lists->property == k ? lists : NULL, i, value);
        else if (targets && targets[k].data)
            ply_store(&targets[k], i, 1, &value);
    }
    return code;
}

int ply_read_binary(struct ply_cursor *at, const struct ply_element *element, const struct ply_target *targets,
                    struct ply_lists *lists)
{
    const struct ply_property *properties = at->header->properties + element->first;
    bool big_machine = __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__;
    struct bytes b = {.at = at, .swap = (at->header->format == PLY_BIG_ENDIAN) != big_machine};
    uint64_t row = fixed_row(properties, element->properties);
    if (element->properties == 0)
        return PATINA_OK;
    int code = ply_check_count(at, element);
    if (code)
        return code;
    if (row && targets)
        return read_fixed(&b, properties, element, row, targets);
    if (row) {
        at->offset += element->count * row;
        return PATINA_OK;
    }
    for (uint64_t i = 0; i < element->count && !code; i++) {
        if (i % POLL_ROWS == 0)
            code = ply_poll(at->input, at->offset);
        if (!code)
            code = read_loose_row(&b, properties, element, targets, lists, i);
    }
    return code;
}
