// SPDX-License-Identifier: GPL-3.0-or-later
// Batches of `patina draw`: a JSON list of drawings, each an object of options.
#include "draw.h"
#include "json.h"

#include <stdlib.h>
#include <string.h>

enum { MOST_NAME = 32 }; // letters of an option's name

struct draw_batch {
    const char *path;
    struct json_file file; // owns the texts of the options
    const struct draw_options *shared;
    struct draw_options *drawings;
    uint32_t count;
};

// Messages begin with the place of a drawing in the list, until tool_say_within(NULL).
static void say_within(const struct draw_batch *batch, uint32_t i, uint32_t line)
{
    char text[320];
    if (line)
        snprintf(text, sizeof text, "%.200s, line %u, drawing %u of %u", batch->path, line, i + 1, batch->count);
    else
        snprintf(text, sizeof text, "drawing %u of %u", i + 1, batch->count);
    tool_say_within(text);
}

// ---- one drawing -----------------------------------------------------------------------------------------------------

// What a value may be, beside a text that is written as at the command line.
static const struct key {
    const char *name;
    enum { TEXT, NUMBER, NUMBERS, SWITCH, TEXTS, FIELDS } value;
} keys[] = {{"plane", TEXT},       {"extent", NUMBERS},  {"depth", NUMBERS},  {"scale", NUMBER}, {"thickness", NUMBER},
            {"contours", NUMBER},  {"outlines", SWITCH}, {"flat", SWITCH},    {"pixel", NUMBER}, {"bits", NUMBER},
            {"depth-map", SWITCH}, {"mask", SWITCH},     {"crs", TEXT},       {"sheet", TEXT},   {"style", TEXT},
            {"title", FIELDS},     {"device", TEXT},     {"threads", NUMBER}, {"output", TEXT},  {"outputs", TEXTS}};
static const char *const wanted[] = {"a text",        "a number",        "a list of numbers",
                                     "true or false", "a list of texts", "an object of texts"}; // as key.value

static const struct key *find_key(const char *name)
{
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
        if (!strcmp(keys[i].name, name))
            return &keys[i];
    return NULL;
}

static int wrong_value(const char *text, const char *name)
{
    tool_say("'%s' is no value for \"%s\": see 'patina help --%s'", text, name, strcmp(name, "outputs") != 0 ? name : "output");
    return TOOL_USAGE;
}

static int take_text(const char *name, const char *text, struct draw_options *options)
{
    char option[MOST_NAME];
    snprintf(option, sizeof option, "--%s", strcmp(name, "outputs") != 0 ? name : "output");
    return draw_take_value(option, text, options) ? wrong_value(text, name) : TOOL_OK;
}

// A list as numbers separated by commas.
static int take_numbers(const struct json *value, struct draw_options *options)
{
    char text[256] = "";
    size_t length = 0;
    for (const struct json *n = value->first; n && length < sizeof text; n = n->next)
        length += (size_t)snprintf(text + length, sizeof text - length, "%s%s", n == value->first ? "" : ",", n->text);
    return length < sizeof text ? take_text(value->key, text, options) : wrong_value(text, value->key);
}

static int take_fields(const struct json *value, struct draw_options *options)
{
    char field[MOST_NAME];
    for (const struct json *f = value->first; f; f = f->next) {
        const int fits = snprintf(field, sizeof field, "%s=", f->key) < (int)sizeof field;
        const int i = fits ? draw_is_title(field) : -1;
        if (i < 0)
            return wrong_value(f->key, value->key);
        options->titles[i] = f->text;
    }
    return TOOL_OK;
}

static int all_are(const struct json *value, enum json_kind kind)
{
    for (const struct json *member = value->first; member; member = member->next)
        if (member->kind != kind)
            return 0;
    return 1;
}

static int take_key(const struct json *value, const struct key *key, struct draw_options *options)
{
    char option[MOST_NAME];
    if (key->value == SWITCH && (value->kind == JSON_TRUE || value->kind == JSON_FALSE)) {
        snprintf(option, sizeof option, "--%s", key->name);
        *draw_switch(option, options) = value->kind == JSON_TRUE;
        return TOOL_OK;
    }
    if (value->kind == JSON_TEXT && key->value != SWITCH && key->value != TEXTS)
        return take_text(key->name, value->text, options);
    if (value->kind == JSON_NUMBER && key->value == NUMBER)
        return take_text(key->name, value->text, options);
    if (value->kind == JSON_LIST && key->value == NUMBERS && all_are(value, JSON_NUMBER))
        return take_numbers(value, options);
    if (value->kind == JSON_OBJECT && key->value == FIELDS && all_are(value, JSON_TEXT))
        return take_fields(value, options);
    if (value->kind == JSON_LIST && key->value == TEXTS && all_are(value, JSON_TEXT)) {
        int result = TOOL_OK;
        for (const struct json *path = value->first; path && !result; path = path->next)
            result = take_text(key->name, path->text, options);
        return result;
    }
    tool_say("\"%s\" must be %s, not %s", key->name, wanted[key->value],
             value->kind == JSON_LIST && (key->value == NUMBERS || key->value == TEXTS) ? "a list of anything else"
             : value->kind == JSON_OBJECT && key->value == FIELDS                       ? "of anything else"
                                                                                        : json_kind_name(value->kind));
    return TOOL_USAGE;
}

static int is_repeated(const struct json *object, const struct json *value)
{
    for (const struct json *before = object->first; before != value; before = before->next)
        if (!strcmp(before->key, value->key))
            return 1;
    return 0;
}

static int take_drawing(const struct json *object, const struct draw_options *shared, struct draw_options *options)
{
    *options = *shared;
    options->batch = NULL;
    if (object->kind != JSON_OBJECT) {
        tool_say("a drawing must be an object such as {\"plane\": \"plan:1.2\", \"outputs\": [\"plan.dxf\"]}, not %s",
                 json_kind_name(object->kind));
        return TOOL_USAGE;
    }
    int result = TOOL_OK;
    for (const struct json *value = object->first; value && !result; value = value->next) {
        const struct key *key = find_key(value->key);
        result = TOOL_USAGE;
        if (!key)
            tool_say("there is no option \"%s\" of drawings: see 'patina help draw'", value->key);
        else if (is_repeated(object, value))
            tool_say("\"%s\" is there twice: remove one", value->key);
        else
            result = take_key(value, key, options);
    }
    if (!result && options->plane == DRAW_NO_PLANE) {
        tool_say("\"plane\" is missing, such as \"plane\": \"plan:1.2\"");
        result = TOOL_USAGE;
    }
    if (!result && !options->output_count) {
        tool_say("\"outputs\" is missing, such as \"outputs\": [\"plan.dxf\", \"plan.pdf\"]");
        result = TOOL_USAGE;
    }
    return result ? result : draw_check(options, shared);
}

// ---- what they write -------------------------------------------------------------------------------------------------

struct claim {
    char *path; // without what makes no difference
    uint32_t drawing;
};

struct claims {
    struct claim *list;
    size_t count;
};

// The path with another ending, unless that is empty. Alike for a.dxf, ./a.dxf and .//a.dxf. NULL without memory.
static char *copy_path(const char *path, const char *ending)
{
    char *copy = malloc(strlen(path) + strlen(ending) + 1), *to = copy;
    const char *dot = *ending ? strrchr(path, '.') : NULL, *at = path;
    if (!copy)
        return NULL;
    if (*at == '/')
        *to++ = *at++;
    for (int begins = 1; *at && at != dot; begins = *at++ == '/') {
        while (begins && (*at == '/' || (at[0] == '.' && at[1] == '/')))
            at++;
        if (at == dot || !*at)
            break;
        *to++ = *at;
    }
    strcpy(to, ending);
    return copy;
}

static int claim(struct claims *claims, uint32_t drawing, const char *path, const char *ending)
{
    char *copy = copy_path(path, ending);
    claims->list[claims->count++] = (struct claim){copy, drawing};
    return copy ? TOOL_OK : tool_failed("draw", NULL, PATINA_ERROR_MEMORY);
}

// Every file that is written for an output.
static int claim_output(struct claims *claims, const struct draw_options *options, uint32_t drawing, const char *path)
{
    static const char *const beside[] = {".tfw", ".prj", ".json", "-depth.tif", "-mask.tif"};
    int result = claim(claims, drawing, path, "");
    for (int i = 0; i < 5 && !result && draw_is_tiff(path); i++)
        if (i < 3 || (i == 3 ? options->depth_map : options->mask))
            result = claim(claims, drawing, path, beside[i]);
    return result;
}

static int compare(const void *a, const void *b)
{
    const struct claim *one = a, *other = b;
    const int order = strcmp(one->path, other->path);
    return order ? order : one->drawing < other->drawing ? -1 : one->drawing > other->drawing;
}

// Whether each file is written once. A tool_exit.
static int check_outputs(const struct draw_batch *batch)
{
    enum { EACH = 6 }; // files for an output, at most
    struct claims claims = {calloc((size_t)batch->count * DRAW_OUTPUTS * EACH + 1, sizeof *claims.list), 0};
    int result = claims.list ? claim(&claims, UINT32_MAX, batch->path, "") : tool_failed("draw", NULL, PATINA_ERROR_MEMORY);
    for (uint32_t i = 0; i < batch->count && !result; i++)
        for (int k = 0; k < batch->drawings[i].output_count && !result; k++)
            result = claim_output(&claims, &batch->drawings[i], i, batch->drawings[i].outputs[k]);
    if (!result)
        qsort(claims.list, claims.count, sizeof *claims.list, compare);
    for (size_t i = 1; i < claims.count && !result; i++) {
        const struct claim *a = &claims.list[i - 1], *b = &claims.list[i];
        if (strcmp(a->path, b->path) != 0)
            continue;
        result = TOOL_USAGE;
        if (b->drawing == UINT32_MAX)
            tool_say("%s: drawing %u would replace this file: give its output another name", batch->path, a->drawing + 1);
        else if (a->drawing == b->drawing)
            tool_say("%s: drawing %u writes '%s' twice: give one another name", batch->path, a->drawing + 1, a->path);
        else
            tool_say("%s: drawings %u and %u both write '%s': give one another name", batch->path, a->drawing + 1,
                     b->drawing + 1, a->path);
    }
    for (size_t i = 0; i < claims.count; i++)
        free(claims.list[i].path);
    free(claims.list);
    return result;
}

// ---- all drawings ----------------------------------------------------------------------------------------------------

static int read_list(struct draw_batch *batch)
{
    static const char example[] = "[{\"plane\": \"plan:1.2\", \"outputs\": [\"plan.dxf\"]}]";
    if (json_read(batch->path, &batch->file))
        return TOOL_USAGE;
    const struct json *root = batch->file.root;
    if (root->kind != JSON_LIST || !root->count) {
        tool_say("%s: the file must be a list of drawings, not %s: %s", batch->path,
                 root->kind == JSON_LIST ? "an empty one" : json_kind_name(root->kind), example);
        return TOOL_USAGE;
    }
    batch->count = root->count;
    batch->drawings = calloc(batch->count, sizeof *batch->drawings);
    if (!batch->drawings)
        return tool_failed("draw", NULL, PATINA_ERROR_MEMORY);
    int result = TOOL_OK;
    uint32_t i = 0;
    for (const struct json *object = root->first; object; object = object->next, i++) {
        say_within(batch, i, object->line);
        if (take_drawing(object, batch->shared, &batch->drawings[i]))
            result = TOOL_USAGE;
        tool_say_within(NULL);
    }
    return result ? result : check_outputs(batch);
}

struct draw_batch *draw_read_batch(const struct draw_options *options, int *result)
{
    struct draw_batch *batch = calloc(1, sizeof *batch);
    if (!batch) {
        *result = tool_failed("draw", NULL, PATINA_ERROR_MEMORY);
        return NULL;
    }
    batch->path = options->batch;
    batch->shared = options;
    *result = read_list(batch);
    if (!*result)
        return batch;
    draw_free_batch(batch);
    return NULL;
}

int draw_all(const struct draw_batch *batch, const struct draw_clouds *clouds)
{
    uint32_t failed = 0;
    for (uint32_t i = 0; i < batch->count; i++) {
        say_within(batch, i, 0);
        const int result = draw_one(&batch->drawings[i], clouds);
        tool_say_within(NULL);
        if (result == TOOL_CANCELLED || tool_cancelled())
            return TOOL_CANCELLED;
        failed += result != TOOL_OK;
    }
    tool_say("%s: %u of %u drawings are written", batch->path, batch->count - failed, batch->count);
    return failed ? TOOL_FAILED : TOOL_OK;
}

void draw_free_batch(struct draw_batch *batch)
{
    if (!batch)
        return;
    json_free(&batch->file);
    free(batch->drawings);
    free(batch);
}
