// SPDX-License-Identifier: GPL-3.0-or-later
// The header: lines of words. Everything that it claims is checked here, save the counts, which the readers of the rows
// hold against the bytes that are there.
#include "number.h"
#include "ply.h"

#include <math.h>
#include <string.h>

enum { MOST_WORDS = 6 }; // "comment patina origin X Y Z" is the longest line that means something

struct word {
    const uint8_t *text;
    size_t length;
};

struct reader {
    const struct pt_input *input;
    struct ply_header *header;
    uint64_t offset; // of the next line
    uint64_t line;   // number of the line in `words`
    bool mac;        // lines end with a lone carriage return
    struct word words[MOST_WORDS];
    uint32_t word_count; // of the line, may be more than MOST_WORDS
};

static const struct {
    const char *name;
    uint32_t type;
} type_names[] = {
    {"char", PATINA_INT8},   {"uchar", PATINA_UINT8},   {"short", PATINA_INT16},     {"ushort", PATINA_UINT16},
    {"int", PATINA_INT32},   {"uint", PATINA_UINT32},   {"float", PATINA_FLOAT32},   {"double", PATINA_FLOAT64},
    {"int8", PATINA_INT8},   {"uint8", PATINA_UINT8},   {"int16", PATINA_INT16},     {"uint16", PATINA_UINT16},
    {"int32", PATINA_INT32}, {"uint32", PATINA_UINT32}, {"float32", PATINA_FLOAT32}, {"float64", PATINA_FLOAT64},
    {"bool", PATINA_UINT8}, // 0 or 1: no type of the format, but written
};

const char *ply_type_name(uint32_t type)
{
    for (size_t i = 0; i < sizeof type_names / sizeof *type_names; i++)
        if (type_names[i].type == type)
            return type_names[i].name;
    return "none";
}

const char *ply_quote(char quoted[44], const void *bytes, size_t size)
{
    const uint8_t *text = bytes;
    size_t kept = size > 40 ? 40 : size;
    for (size_t i = 0; i < kept; i++)
        quoted[i] = text[i] >= 32 && text[i] < 127 ? (char)text[i] : '?';
    memcpy(quoted + kept, size > kept ? "..." : "", size > kept ? 4 : 1);
    return quoted;
}

static bool is(struct word word, const char *text)
{
    return word.length == strlen(text) && !memcmp(word.text, text, word.length);
}

// Error at the current line; what: a sentence's middle, then the word that it is about.
static int fail(const struct reader *r, const char *what, struct word word)
{
    char quoted[44];
    return pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: header line %llu: %s '%s'", r->input->name, (unsigned long long)r->line,
                   what, ply_quote(quoted, word.text, word.length));
}

static struct word whole_line(const struct reader *r)
{
    const struct word *last = &r->words[(r->word_count < MOST_WORDS ? r->word_count : MOST_WORDS) - 1];
    return (struct word){r->words[0].text, (size_t)(last->text + last->length - r->words[0].text)};
}

static void split(struct reader *r, const uint8_t *text, size_t length)
{
    r->word_count = 0;
    for (size_t i = 0; i < length;) {
        if (pt_is_blank(text[i]) || text[i] == '\r') {
            i++;
            continue;
        }
        size_t start = i;
        while (i < length && !pt_is_blank(text[i]) && text[i] != '\r')
            i++;
        if (r->word_count < MOST_WORDS)
            r->words[r->word_count] = (struct word){text + start, i - start};
        r->word_count++;
    }
}

// The next line that is not blank.
static int next_line(struct reader *r)
{
    const uint8_t *data = r->input->data;
    size_t limit = r->input->size < PLY_LONGEST_HEADER ? r->input->size : PLY_LONGEST_HEADER;
    do {
        const uint8_t *start = data + r->offset;
        const uint8_t *stop = r->offset < limit ? memchr(start, r->mac ? '\r' : '\n', limit - r->offset) : NULL;
        if (!stop && limit < r->input->size)
            return pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: no end_header in the first %d bytes", r->input->name,
                           (int)PLY_LONGEST_HEADER);
        if (!stop && r->offset >= limit)
            return pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: the header ends at byte %llu without end_header", r->input->name,
                           (unsigned long long)r->offset);
        if (!stop)
            stop = data + limit; // the last line of a file of nothing but a header
        split(r, start, (size_t)(stop - start));
        r->offset = (uint64_t)(stop - data) + (stop != data + limit);
        r->line++;
    } while (r->word_count == 0);
    return PATINA_OK;
}

// "ply" may stand behind a byte order mark and blank lines. How its line ends says how all lines end: a binary body may
// begin with any byte, so a line end must not be guessed anew at end_header.
static int read_magic(struct reader *r)
{
    const uint8_t *data = r->input->data;
    size_t size = r->input->size, i = 0;
    char quoted[44];
    if (size == 0)
        return pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: the file is empty", r->input->name);
    if (size >= 2 && data[0] == 0x1f && data[1] == 0x8b)
        return pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: the file is packed by gzip; unpack it first", r->input->name);
    if (size >= 3 && !memcmp(data, "\xef\xbb\xbf", 3))
        i = 3;
    for (; i < size && i < PLY_LONGEST_HEADER && (pt_is_blank(data[i]) || pt_is_line_end(data[i])); i++)
        r->line += data[i] == '\n';
    if (size - i < 4 || memcmp(data + i, "ply", 3) || !(pt_is_blank(data[i + 3]) || pt_is_line_end(data[i + 3])))
        return pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: not a PLY file, it begins with '%s' instead of 'ply'", r->input->name,
                       ply_quote(quoted, data + i, size - i > 12 ? 12 : size - i));
    r->offset = i;
    for (i += 3; i < size && i < PLY_LONGEST_HEADER && !pt_is_line_end(data[i]); i++)
        ;
    r->mac = i < size && data[i] == '\r' && (i + 1 == size || data[i + 1] != '\n');
    r->header->crlf = i < size && data[i] == '\r' && !r->mac;
    return next_line(r);
}

static int read_format(struct reader *r)
{
    struct ply_header *h = r->header;
    if (h->format != PLY_NO_FORMAT)
        return fail(r, "a second format line", whole_line(r));
    if (r->word_count != 3)
        return fail(r, "expected 'format <name> 1.0', found", whole_line(r));
    if (is(r->words[1], "ascii"))
        h->format = PLY_ASCII;
    else if (is(r->words[1], "binary_little_endian"))
        h->format = PLY_LITTLE_ENDIAN;
    else if (is(r->words[1], "binary_big_endian"))
        h->format = PLY_BIG_ENDIAN;
    else
        return fail(r, "the format is none of ascii, binary_little_endian, binary_big_endian:", r->words[1]);
    if (!is(r->words[2], "1.0"))
        return fail(r, "the format's version is not 1.0 but", r->words[2]);
    return PATINA_OK;
}

static int take_name(const struct reader *r, struct word word, char name[PLY_NAME_SIZE])
{
    if (word.length >= PLY_NAME_SIZE)
        return fail(r, "a name of more than 63 bytes:", word);
    memcpy(name, word.text, word.length);
    name[word.length] = 0;
    return PATINA_OK;
}

static int read_element(struct reader *r)
{
    struct ply_header *h = r->header;
    if (r->word_count != 3)
        return fail(r, "expected 'element <name> <count>', found", whole_line(r));
    if (h->element_count == PLY_MOST_ELEMENTS)
        return fail(r, "more than 64 elements, the last read is", r->words[1]);
    struct ply_element *element = &h->elements[h->element_count];
    *element = (struct ply_element){.first = h->property_count};
    int code = take_name(r, r->words[1], element->name);
    if (code)
        return code;
    for (uint32_t i = 0; i < h->element_count; i++)
        if (!strcmp(h->elements[i].name, element->name))
            return fail(r, "a second element", r->words[1]);
    for (size_t i = 0; i < r->words[2].length; i++) {
        uint8_t c = r->words[2].text[i];
        if (c < '0' || c > '9' || element->count > (UINT64_MAX - 9) / 10)
            return fail(r, "an element's count must be a whole number below 10^19, not", r->words[2]);
        element->count = element->count * 10 + (uint64_t)(c - '0');
    }
    h->element_count++;
    return PATINA_OK;
}

static int take_type(const struct reader *r, struct word word, uint32_t *type)
{
    for (size_t i = 0; i < sizeof type_names / sizeof *type_names; i++) {
        if (is(word, type_names[i].name)) {
            *type = type_names[i].type;
            return PATINA_OK;
        }
    }
    return fail(r, "unknown type", word);
}

static int read_property(struct reader *r)
{
    struct ply_header *h = r->header;
    bool list = r->word_count > 1 && is(r->words[1], "list");
    if (h->element_count == 0)
        return fail(r, "a property before the first element:", whole_line(r));
    if (r->word_count != (list ? 5 : 3))
        return fail(r, "expected 'property <type> <name>' or 'property list <type> <type> <name>', found", whole_line(r));
    if (h->property_count == PLY_MOST_PROPERTIES)
        return fail(r, "more than 1024 properties, the last read is", r->words[2]);
    struct ply_property *property = &h->properties[h->property_count];
    *property = (struct ply_property){.count_type = PATINA_NONE};
    int code = list ? take_type(r, r->words[2], &property->count_type) : PATINA_OK;
    if (!code)
        code = take_type(r, r->words[list ? 3 : 1], &property->type);
    if (!code)
        code = take_name(r, r->words[list ? 4 : 2], property->name);
    if (code)
        return code;
    if (property->count_type == PATINA_FLOAT32 || property->count_type == PATINA_FLOAT64)
        return fail(r, "a list's count cannot be of type", r->words[2]);
    struct ply_element *element = &h->elements[h->element_count - 1];
    for (uint32_t i = element->first; i < h->property_count; i++)
        if (!strcmp(h->properties[i].name, property->name))
            return fail(r, "the element has two properties", r->words[list ? 4 : 2]);
    h->property_count++;
    element->properties++;
    return PATINA_OK;
}

static int read_comment(struct reader *r)
{
    if (r->word_count != 6 || !is(r->words[1], "patina") || !is(r->words[2], "origin"))
        return PATINA_OK;
    int code = PATINA_OK;
    for (int axis = 0; axis < 3 && !code; axis++) {
        struct word word = r->words[3 + axis];
        double *value = &r->header->origin[axis];
        if (!pt_parse_number(word.text, word.text + word.length, value) || !(fabs(*value) <= 1e15))
            code = fail(r, "an origin must be three numbers of at most 1e15, not", word);
    }
    return code;
}

// Sizes of a scanner's grid, as the Stanford repository's range images say them. Others mean nothing here.
static void read_info(struct reader *r)
{
    uint32_t *size = r->word_count == 3 && is(r->words[1], "num_cols")   ? &r->header->grid_columns
                     : r->word_count == 3 && is(r->words[1], "num_rows") ? &r->header->grid_rows
                                                                         : NULL;
    uint32_t value = 0;
    for (size_t i = 0; size && i < r->words[2].length && value < PLY_NO_CELL; i++) {
        uint8_t c = r->words[2].text[i];
        if (c < '0' || c > '9')
            return;
        value = value * 10 + (uint32_t)(c - '0');
    }
    if (size)
        *size = value;
}

// Old Blender exporters forgot the word "comment" on their own line. Before the first element an unknown line can
// change nothing of what follows, so it is let pass there; later it might be a misspelt property.
static int read_line(struct reader *r)
{
    struct word key = r->words[0];
    if (is(key, "property"))
        return read_property(r);
    if (is(key, "element"))
        return read_element(r);
    if (is(key, "format"))
        return read_format(r);
    if (is(key, "comment"))
        return read_comment(r);
    if (is(key, "obj_info"))
        read_info(r);
    if (is(key, "obj_info") || r->header->element_count == 0)
        return PATINA_OK;
    return fail(r, "unknown keyword", key);
}

int ply_read_header(const struct pt_input *input, struct ply_header *header)
{
    struct reader r = {.input = input, .header = header};
    int code = read_magic(&r);
    if (!code && r.word_count != 1)
        code = fail(&r, "expected 'ply' alone, found", whole_line(&r));
    if (!code)
        code = next_line(&r);
    while (!code && !(r.word_count == 1 && is(r.words[0], "end_header"))) {
        code = read_line(&r);
        if (!code)
            code = next_line(&r);
    }
    if (!code && header->format == PLY_NO_FORMAT)
        code = pt_fail(NULL, PATINA_ERROR_FORMAT, "%s: the header has no format line", input->name);
    header->body = r.offset;
    header->body_line = r.line + 1;
    return code;
}
