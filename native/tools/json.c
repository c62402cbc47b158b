// SPDX-License-Identifier: GPL-3.0-or-later
// The JSON reader. It decodes texts in place: what a text means is never longer than how it is written.
#include "json.h"
#include "page.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_BYTES = 4 << 20, MOST_DEPTH = 32 };

struct parser {
    const char *path;
    char *at;
    struct json *values; // room for all
    uint32_t count, line, depth;
};

const char *json_kind_name(enum json_kind kind)
{
    static const char *const names[] = {"null", "false", "true", "a number", "a text", "a list", "an object"};
    return names[kind];
}

static int fail(const struct parser *p, const char *what)
{
    tool_say("%s, line %u: %s", p->path, p->line, what);
    return -1;
}

static void skip_space(struct parser *p)
{
    for (; *p->at == ' ' || *p->at == '\t' || *p->at == '\r' || *p->at == '\n'; p->at++)
        p->line += *p->at == '\n';
}

// ---- texts ---------------------------------------------------------------------------------------------------------

static int is_digit(char c) { return c >= '0' && c <= '9'; }

// Four hexadecimal digits. -1: they are not.
static int32_t hexadecimal(const char *at)
{
    int32_t value = 0;
    for (int i = 0; i < 4; i++) {
        const char small = (char)(at[i] | 0x20);
        if (!is_digit(at[i]) && (small < 'a' || small > 'f'))
            return -1;
        value = 16 * value + (is_digit(at[i]) ? at[i] - '0' : small - 'a' + 10);
    }
    return value;
}

static char *put_utf8(char *to, uint32_t code)
{
    const int more = code < 0x80 ? 0 : code < 0x800 ? 1 : code < 0x10000 ? 2 : 3;
    static const uint8_t marks[] = {0, 0xC0, 0xE0, 0xF0};
    *to++ = (char)(marks[more] | code >> 6 * more);
    for (int i = more - 1; i >= 0; i--)
        *to++ = (char)(0x80 | (code >> 6 * i & 0x3F));
    return to;
}

// The code point of \uXXXX, or of a pair of surrogates. 0: there is none, or it is 0, which would end the text.
static uint32_t take_escaped(char **at)
{
    const int32_t one = hexadecimal(*at);
    if (one <= 0 || (one >= 0xDC00 && one < 0xE000))
        return 0;
    *at += 4;
    if (one < 0xD800 || one >= 0xE000)
        return (uint32_t)one;
    const int32_t other = (*at)[0] == '\\' && (*at)[1] == 'u' ? hexadecimal(*at + 2) : -1;
    if (other < 0xDC00 || other >= 0xE000)
        return 0;
    *at += 6;
    return 0x10000u + ((uint32_t)(one - 0xD800) << 10) + (uint32_t)(other - 0xDC00);
}

// A text in quotation marks. NULL after a message.
static const char *take_text(struct parser *p)
{
    static const char letters[] = "\"\\/bfnrt", meanings[] = "\"\\/\b\f\n\r\t";
    char *const begin = p->at + 1, *from = begin, *to = begin;
    while (*from != '"') {
        const char *const letter = *from == '\\' && from[1] ? strchr(letters, from[1]) : NULL;
        if (*from != '\\' && (unsigned char)*from >= 0x20)
            *to++ = *from++;
        else if (*from != '\\') {
            fail(p, "a text has no \" at its end, or a tab in it");
            return NULL;
        } else if (letter) {
            *to++ = meanings[letter - letters];
            from += 2;
        } else {
            const int escaped = from[1] == 'u';
            from += 2;
            const uint32_t code = escaped ? take_escaped(&from) : 0;
            if (!code) {
                fail(p, "a text has a \\ that means nothing: write \\\\ for a backslash, or use /");
                return NULL;
            }
            to = put_utf8(to, code);
        }
    }
    *to = 0;
    p->at = from + 1;
    return begin;
}

// Whether the text is UTF-8 as a whole.
static int is_utf8(const char *text)
{
    while (*text) {
        const char *begin = text;
        if (page_code_point(&text) == 0xFFFD && strncmp(begin, "\xEF\xBF\xBD", 3) != 0)
            return 0;
    }
    return 1;
}

// ---- values --------------------------------------------------------------------------------------------------------

static int take_value(struct parser *p, struct json *value);

static struct json *add(struct parser *p)
{
    struct json *value = &p->values[p->count++];
    *value = (struct json){.line = p->line};
    return value;
}

// The end of a number by JSON's grammar, or its beginning.
static char *end_of_number(char *at)
{
    char *const begin = at, *digits;
    at += *at == '-';
    for (digits = at; is_digit(*at);)
        at++;
    if (at == digits || (*digits == '0' && at > digits + 1))
        return begin;
    if (*at == '.') {
        for (digits = ++at; is_digit(*at);)
            at++;
        if (at == digits)
            return begin;
    }
    if (*at == 'e' || *at == 'E') {
        at += at[1] == '-' || at[1] == '+' ? 2 : 1;
        for (digits = at; is_digit(*at);)
            at++;
        if (at == digits)
            return begin;
    }
    return at;
}

// Moves a number one byte to the front, over what was before it, so that a 0 can end it.
static int take_number(struct parser *p, struct json *value)
{
    char *const begin = p->at, *const end = end_of_number(begin);
    if (end == begin)
        return fail(p, "a number is not written as JSON has it, such as 0.5, -2 or 1e3");
    memmove(begin - 1, begin, (size_t)(end - begin));
    end[-1] = 0;
    value->kind = JSON_NUMBER;
    value->text = begin - 1;
    p->at = end;
    return 0;
}

// The members of an object or a list.
static int take_members(struct parser *p, struct json *value)
{
    const int object = *p->at == '{';
    const char end = object ? '}' : ']';
    const struct json **link = &value->first;
    value->kind = object ? JSON_OBJECT : JSON_LIST;
    if (++p->depth > MOST_DEPTH)
        return fail(p, "lists and objects are nested too deeply");
    p->at++;
    for (skip_space(p); *p->at != end || value->count; skip_space(p)) {
        const char *key = NULL;
        if (*p->at == end)
            return fail(p, "a , is before the end of a list or an object: remove it");
        if (object) {
            if (*p->at != '"')
                return fail(p, "a name in \" is missing, such as \"plane\"");
            key = take_text(p);
            if (!key)
                return -1;
            skip_space(p);
            if (*p->at != ':')
                return fail(p, "a : is missing after a name");
            p->at++;
            skip_space(p);
        }
        struct json *member = add(p);
        member->key = key;
        if (take_value(p, member))
            return -1;
        *link = member;
        link = &member->next;
        value->count++;
        skip_space(p);
        if (*p->at == end)
            break;
        if (*p->at != ',')
            return fail(p, object ? "a , or the } of an object is missing" : "a , or the ] of a list is missing");
        p->at++;
    }
    p->at++;
    p->depth--;
    return 0;
}

static int take_value(struct parser *p, struct json *value)
{
    static const char *const words[] = {"null", "false", "true"}; // as json_kind
    if (*p->at == '{' || *p->at == '[')
        return take_members(p, value);
    if (*p->at == '"') {
        value->kind = JSON_TEXT;
        value->text = take_text(p);
        return value->text ? 0 : -1;
    }
    if (*p->at == '-' || is_digit(*p->at))
        return take_number(p, value);
    for (int i = 0; i < 3; i++) {
        const size_t length = strlen(words[i]);
        if (strncmp(p->at, words[i], length) != 0)
            continue;
        value->kind = (enum json_kind)i;
        p->at += length;
        return 0;
    }
    return fail(p, *p->at ? "a value is missing: a text in \", a number, true, false, a list or an object"
                          : "the file ends before a value");
}

// ---- files ---------------------------------------------------------------------------------------------------------

// The file's bytes after a spare one, and a 0 after them. NULL after a message.
static char *read_all(const char *path, size_t *size)
{
    char why[128];
    FILE *stream = pt_stream_open(path, "rb");
    if (!stream) {
        tool_say("'%s' cannot be read: %s", path, pt_error_text(errno, why, sizeof why));
        return NULL;
    }
    char *text = malloc(MOST_BYTES + 2);
    *size = text ? fread(text + 1, 1, MOST_BYTES + 1, stream) : 0;
    const int error = ferror(stream) ? errno : 0;
    fclose(stream);
    if (text && !error && *size <= MOST_BYTES) {
        text[0] = ' ';
        text[1 + *size] = 0;
        return text;
    }
    if (!text)
        tool_say("%s: out of memory", path);
    else if (error)
        tool_say("'%s' cannot be read: %s", path, pt_error_text(error, why, sizeof why));
    else
        tool_say("%s: a JSON file has at most %d MiB", path, MOST_BYTES >> 20);
    free(text);
    return NULL;
}

int json_read(const char *path, struct json_file *file)
{
    size_t size, most = 1; // values: each but the first follows one of these
    *file = (struct json_file){.text = read_all(path, &size)};
    if (!file->text)
        return -1;
    struct parser p = {.path = path, .at = file->text + 1, .line = 1};
    if (strlen(p.at) != size || !is_utf8(p.at)) {
        tool_say("%s: the file is no text in UTF-8: save it as UTF-8", path);
        return -1;
    }
    for (const char *c = p.at; *c; c++)
        most += *c == ',' || *c == '[' || *c == '{';
    p.values = file->values = calloc(most, sizeof *p.values);
    if (!p.values) {
        tool_say("%s: out of memory", path);
        return -1;
    }
    if (!strncmp(p.at, "\xEF\xBB\xBF", 3)) // a mark of editors
        p.at += 3;
    skip_space(&p);
    struct json *root = add(&p);
    if (take_value(&p, root))
        return -1;
    skip_space(&p);
    if (*p.at)
        return fail(&p, "there is more after the end of the list or object");
    file->root = root;
    return 0;
}

void json_free(struct json_file *file)
{
    free(file->text);
    free(file->values);
    *file = (struct json_file){0};
}
