// SPDX-License-Identifier: GPL-3.0-or-later
// Rows as text: a row is a line. Blank lines are passed over, lines end with LF, CR LF or CR.
#include "number.h"
#include "ply.h"

#include <math.h>
#include <string.h>

enum { POLL_ROWS = 4096 };

struct text {
    const struct pt_input *input;
    const uint8_t *at, *end;
    uint64_t line; // number of the line that `at` is in
    locale_t c_locale;
};

static bool line_ends(const struct text *t)
{
    return t->at == t->end || pt_is_line_end(*t->at);
}

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
            return pt_fail(NULL, PATINA_ERROR_FORMAT,
                           "%s: the file ends at line %llu, behind %llu of the %llu rows of element %s", t->input->name,
                           (unsigned long long)t->line, (unsigned long long)i, (unsigned long long)element->count,
                           element->name);
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
    const uint8_t *behind = pt_parse_number(t->at, t->end, t->c_locale, value);
    if (!behind)
        return pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: line %llu: '%s' is not a number (property %s)", t->input->name,
                       (unsigned long long)t->line, ply_quote(quoted, t->at, token_length(t)), property);
    if (type != PATINA_FLOAT32 && type != PATINA_FLOAT64 && (!fits(type, byte, *value) || *value != trunc(*value)))
        return pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: line %llu: '%s' does not fit property %s of type %s",
                       t->input->name, (unsigned long long)t->line, ply_quote(quoted, t->at, token_length(t)), property,
                       ply_type_name(type));
    t->at = behind;
    return PATINA_OK;
}

static int short_line(const struct text *t, const char *property)
{
    return pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: line %llu ends before property %s", t->input->name,
                   (unsigned long long)t->line, property);
}

static int skip_list(struct text *t, const struct ply_property *property)
{
    double count = 0;
    int code = read_value(t, property->count_type, false, property->name, &count);
    if (code)
        return code;
    if (count < 0)
        return pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: line %llu: list %s has the count %.0f", t->input->name,
                       (unsigned long long)t->line, property->name, count);
    for (; count > 0; count--) {
        skip_blanks(t);
        if (line_ends(t))
            return short_line(t, property->name);
        t->at += token_length(t);
    }
    return PATINA_OK;
}

static int read_row(struct text *t, const struct ply_property *properties, uint32_t property_count,
                    const struct ply_target *targets, uint64_t i)
{
    for (uint32_t k = 0; k < property_count; k++) {
        const struct ply_property *property = &properties[k];
        skip_blanks(t);
        if (line_ends(t)) {
            // A list that the rows lack is no loss: lists are not kept.
            if (property->count_type != PATINA_NONE)
                continue;
            return short_line(t, property->name);
        }
        double value = 0;
        int code = property->count_type != PATINA_NONE
                       ? skip_list(t, property)
                       : read_value(t, property->type, targets[k].wrap, property->name, &value);
        if (code)
            return code;
        if (targets[k].data)
            ply_store(&targets[k], i, 1, &value);
    }
    skip_blanks(t);
    char quoted[44];
    if (!line_ends(t))
        return pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: line %llu goes on with '%s' behind the last of %u properties",
                       t->input->name, (unsigned long long)t->line, ply_quote(quoted, t->at, token_length(t)),
                       property_count);
    return PATINA_OK;
}

// targets NULL: the rows are passed over, a line each, without a look at what they hold.
static int read_element(struct text *t, const struct ply_header *header, const struct ply_element *element,
                        const struct ply_target *targets)
{
    if (element->properties == 0)
        return PATINA_OK;
    int code = ply_check_count(t->input, header, element, (uint64_t)(t->at - t->input->data));
    for (uint64_t i = 0; i < element->count && !code; i++) {
        if (i % POLL_ROWS == 0)
            code = ply_poll(t->input, (uint64_t)(t->at - t->input->data));
        if (!code)
            code = start_row(t, element, i);
        if (code)
            break;
        if (targets)
            code = read_row(t, header->properties + element->first, element->properties, targets, i);
        while (!targets && !line_ends(t))
            t->at++;
        next_line(t);
    }
    return code;
}

// A count that is too small leaves points out: that deserves a line in the log.
static void warn_of_rest(struct text *t, const struct ply_header *header, uint32_t vertex)
{
    for (uint32_t e = vertex + 1; e < header->element_count; e++)
        if (header->elements[e].count)
            return;
    for (skip_blanks(t); t->at != t->end && line_ends(t); skip_blanks(t))
        next_line(t);
    if (t->at != t->end)
        pt_log(PT_LOG_WARNING, "%s: line %llu and what follows is more than the header declares, and was not read",
               t->input->name, (unsigned long long)t->line);
}

int ply_read_ascii(const struct pt_input *input, const struct ply_header *header, uint32_t vertex,
                   const struct ply_target *targets)
{
    struct text t = { .input = input,
                      .at = input->data + header->body,
                      .end = input->data + input->size,
                      .line = header->body_line,
                      .c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0) };
    if (!t.c_locale)
        return pt_fail(NULL, PATINA_ERROR_MEMORY, "%s: out of memory", input->name);
    int code = PATINA_OK;
    for (uint32_t e = 0; e <= vertex && !code; e++)
        code = read_element(&t, header, &header->elements[e], e == vertex ? targets : NULL);
    if (!code)
        warn_of_rest(&t, header, vertex);
    freelocale(t.c_locale);
    return code;
}
