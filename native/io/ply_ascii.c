// SPDX-License-Identifier: GPL-3.0-or-later
// Rows as text: a row is a line. Blank lines are passed over, lines end with LF, CR LF or CR.
#include "number.h"
#include "ply.h"

#include <math.h>
#include <string.h>

enum { POLL_ROWS = 4096 };

struct text {
    struct ply_cursor *cursor; // brought here at the end
    const struct pt_input *input;
    const uint8_t *at, *end;
    uint64_t line; // number of the line that `at` is in
};

static bool line_ends(const struct text *t) { return t->at == t->end || pt_is_line_end(*t->at); }

static void skip_blanks(struct text *t)
{
    while (t->at != t->end && pt_is_blank(*t->at))
        t->at++;
}

static void next_line(struct text *t)
{
    if (t->at == t->end)
        return;
    if (*t->at++ == '\r' && t->at != t->end && *t->at == '\n')
        t->at++;
    t->line++;
}

static size_t token_length(const struct text *t)
{
    size_t length = 0;
    while (t->at + length != t->end && !pt_is_blank(t->at[length]) && !pt_is_line_end(t->at[length]))
        length++;
    return length;
}

// Comes to the first word of row i, or says that there is none.
static int start_row(struct text *t, const struct ply_element *element, uint64_t i)
{
    for (skip_blanks(t); line_ends(t); skip_blanks(t)) {
        if (t->at == t->end)
            return ply_fault(t->cursor, "%s: the file ends at line %llu, behind %llu of the %llu rows of element %s",
                             t->input->name, (unsigned long long)t->line, (unsigned long long)(t->cursor->before + i),
                             (unsigned long long)(t->cursor->all ? t->cursor->all : element->count), element->name);
        next_line(t);
    }
    return PATINA_OK;
}

// byte: the value is one that some writers call char though it goes up to 255.
static bool fits(uint32_t type, bool byte, double value)
{
    switch (type) {
    case PATINA_INT8: return value >= INT8_MIN && value <= (byte ? UINT8_MAX : INT8_MAX);
    case PATINA_UINT8: return value >= 0 && value <= UINT8_MAX;
    case PATINA_INT16: return value >= INT16_MIN && value <= INT16_MAX;
    case PATINA_UINT16: return value >= 0 && value <= UINT16_MAX;
    case PATINA_INT32: return value >= INT32_MIN && value <= INT32_MAX;
    case PATINA_UINT32: return value >= 0 && value <= UINT32_MAX;
    }
    return true;
}

// One value of a declared type. Integers must be whole and in range: anything else means that columns and header do not
// belong together.
static int read_value(struct text *t, uint32_t type, bool byte, const char *property, double *value)
{
    char quoted[44];
    const uint8_t *behind = pt_parse_number(t->at, t->end, value);
    if (!behind)
        return ply_fault(t->cursor, "%s: line %llu: '%s' is not a number (property %s)", t->input->name,
                         (unsigned long long)t->line, ply_quote(quoted, t->at, token_length(t)), property);
    if (type != PATINA_FLOAT32 && type != PATINA_FLOAT64 && (!fits(type, byte, *value) || *value != trunc(*value)))
        return ply_fault(t->cursor, "%s: line %llu: '%s' does not fit property %s of type %s", t->input->name,
                         (unsigned long long)t->line, ply_quote(quoted, t->at, token_length(t)), property, ply_type_name(type));
    t->at = behind;
    return PATINA_OK;
}

static int short_line(const struct text *t, const char *property)
{
    return ply_fault(t->cursor, "%s: line %llu ends before property %s", t->input->name, (unsigned long long)t->line, property);
}

// The items of a list, handed on or passed over.
static int read_list(struct text *t, const struct ply_property *property, struct ply_lists *lists, uint64_t i)
{
    double count = 0;
    size_t got = 0;
    int code = read_value(t, property->count_type, false, property->name, &count);
    if (code)
        return code;
    if (count < 0)
        return ply_fault(t->cursor, "%s: line %llu: list %s has the count %.0f", t->input->name, (unsigned long long)t->line,
                         property->name, count);
    for (; (double)got < count && !code; got++) {
        skip_blanks(t);
        if (line_ends(t))
            return short_line(t, property->name);
        if (!lists)
            t->at += token_length(t);
        else if (!(code = ply_make_room(t->cursor, lists, got + 1)))
            code = read_value(t, property->type, false, property->name, &lists->items[got]);
    }
    if (lists && !code)
        lists->take(lists->context, i, lists->items, got);
    return code;
}

static int read_row(struct text *t, const struct ply_property *properties, uint32_t property_count,
                    const struct ply_target *targets, struct ply_lists *lists, uint64_t i)
{
    for (uint32_t k = 0; k < property_count; k++) {
        const struct ply_property *property = &properties[k];
        skip_blanks(t);
        if (line_ends(t)) {
            if (property->count_type != PATINA_NONE) // a list that the rows lack is no loss
                continue;
            return short_line(t, property->name);
        }
        double value = 0;
        int code = property->count_type != PATINA_NONE
                       ? read_list(t, property, lists && lists->property == k ? lists : NULL, i)
                       : read_value(t, property->type, targets && targets[k].wrap, property->name, &value);
        if (code)
            return code;
        if (targets && targets[k].data)
            ply_store(&targets[k], i, 1, &value);
    }
    skip_blanks(t);
    char quoted[44];
    if (!line_ends(t))
        return ply_fault(t->cursor, "%s: line %llu goes on with '%s' behind the last of %u properties", t->input->name,
                         (unsigned long long)t->line, ply_quote(quoted, t->at, token_length(t)), property_count);
    return PATINA_OK;
}

static int read_element(struct text *t, const struct ply_element *element, const struct ply_target *targets,
                        struct ply_lists *lists)
{
    int code = PATINA_OK;
    for (uint64_t i = 0; i < element->count && !code; i++) {
        if (i % POLL_ROWS == 0)
            code = ply_poll(t->input, (uint64_t)(t->at - t->input->data));
        if (!code)
            code = start_row(t, element, i);
        if (code)
            break;
        if (targets || lists)
            code = read_row(t, t->cursor->header->properties + element->first, element->properties, targets, lists, i);
        while (!targets && !lists && !line_ends(t))
            t->at++;
        next_line(t);
    }
    return code;
}

int ply_read_ascii(struct ply_cursor *at, const struct ply_element *element, const struct ply_target *targets,
                   struct ply_lists *lists)
{
    int code = element->properties ? ply_check_count(at, element) : PATINA_OK;
    if (code || element->properties == 0)
        return code;
    struct text t = {.cursor = at,
                     .input = at->input,
                     .at = at->input->data + at->offset,
                     .end = at->input->data + at->input->size,
                     .line = at->line};
    code = read_element(&t, element, targets, lists);
    at->offset = (uint64_t)(t.at - at->input->data);
    at->line = t.line;
    return code;
}
