// SPDX-License-Identifier: GPL-3.0-or-later
// The options of `patina render` that draw effects, as the table of effects lists them; what their values may be, the library says.
#include "tool.h"
#include "base/words.h"

#include <ctype.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

// ---- the table -----------------------------------------------------------------------------------------------------

enum kind { NUMBER, COUNT, COLOR, AXIS, SWITCH, CHOICE };

static const struct field {
    const char *name;
    enum kind kind;
    size_t offset;
} fields[] = {
#define ROW(field, kind) {#field, kind, offsetof(patina_effects, field)},
#define PATINA_EFFECT_NUMBER(field, ...) ROW(field, NUMBER)
#define PATINA_EFFECT_COUNT(field, ...) ROW(field, COUNT)
#define PATINA_EFFECT_COLOR(field, ...) ROW(field, COLOR)
#define PATINA_EFFECT_AXIS(field, ...) ROW(field, AXIS)
#define PATINA_EFFECT_SWITCH(field, ...) ROW(field, SWITCH)
#define PATINA_EFFECT_CHOICE(field, ...) ROW(field, CHOICE)
#include "patina/effects.def"
    {NULL, NUMBER, 0},
};

static const struct {
    const char *name; // CONTOUR_HEIGHT of contour_source
    uint32_t value;
} items[] = {
#define PATINA_EFFECT_ITEM(constant, value, label, about) {#constant, value},
#include "patina/effects.def"
    {NULL, 0},
};

static const struct {
    const char *name, *values, *help;
} options[] = {
#define PATINA_EFFECT(name, label, panel, option, values, help, about) {option, values, help},
#include "patina/effects.def"
    {NULL, NULL, NULL},
};

// ---- an option's values ----------------------------------------------------------------------------------------------

// What an option's list of fields says of one of them.
struct value {
    const struct field *field;
    const struct field *with; // becomes 1 with it; or NULL
    double otherwise;         // where the value is left out
    int optional;
};

static const struct field *find(const char *name, size_t length)
{
    for (const struct field *field = fields; field->name; field++)
        if (strlen(field->name) == length && !memcmp(field->name, name, length))
            return field;
    return NULL;
}

// The next of the list, and behind it; NULL at its end.
static const char *next_value(const char *list, int *optional, struct value *out)
{
    if (*list == '[') {
        *optional = 1;
        list++;
    }
    if (*list == ',')
        list++;
    if (!*list)
        return NULL;
    size_t length = strcspn(list, "[,+=");
    *out = (struct value){.field = find(list, length), .optional = *optional};
    list += length;
    if (*list == '=')
        out->otherwise = strtod(list + 1, NULL);
    else if (*list == '+')
        out->with = find(list + 1, strcspn(list + 1, "[,"));
    return list + strcspn(list, "[,");
}

static int width_of(const struct field *field) { return field->kind == COLOR || field->kind == AXIS ? 3 : 1; }

static int put(patina_effects *effects, const struct field *field, const double *numbers)
{
    char *at = (char *)effects + field->offset;
    if (field->kind == NUMBER) {
        *(float *)(void *)at = (float)numbers[0];
    } else if (field->kind == COLOR || field->kind == AXIS) {
        for (int k = 0; k < 3; k++)
            ((float *)(void *)at)[k] = (float)numbers[k];
    } else {
        if (!(numbers[0] >= 0.0 && numbers[0] <= 1e6) || numbers[0] != (double)(uint32_t)numbers[0])
            return -1;
        *(uint32_t *)(void *)at = (uint32_t)numbers[0];
    }
    return 0;
}

static int parse(const char *list, const char *text, patina_effects *effects)
{
    enum { MOST = 32 };
    static const double one[3] = {1.0};
    double numbers[MOST];
    struct value value;
    int optional = 0, at = 0;
    const int count = parse_numbers(text, numbers, 1, MOST);
    while (count > 0 && (list = next_value(list, &optional, &value))) {
        const int wide = width_of(value.field);
        const double *given = at < count ? numbers + at : wide == 1 ? &value.otherwise : NULL;
        if ((at < count && at + wide > count) || (at >= count && !value.optional))
            return -1;
        if (given && put(effects, value.field, given))
            return -1;
        if (at < count && value.with)
            put(effects, value.with, one);
        at += at < count ? wide : 0;
    }
    return at == count ? 0 : -1;
}

// The item of a choice by its word, in any case; -1: none.
static double item_of(const struct field *field, const char *word)
{
    const size_t prefix = strcspn(field->name, "_") + 1;
    for (size_t i = 0; items[i].name; i++)
        if (pt_same_start(items[i].name, field->name, prefix) && pt_same_word(items[i].name + prefix, word))
            return items[i].value;
    return -1.0;
}

// FIELD=VALUE, of any field.
static int parse_field(const char *text, patina_effects *effects)
{
    double numbers[3] = {0};
    const size_t length = strcspn(text, "=");
    const struct field *field = find(text, length);
    if (!field || text[length] != '=')
        return -1;
    const int wide = width_of(field);
    if (field->kind == CHOICE)
        numbers[0] = item_of(field, text + length + 1);
    else if (parse_numbers(text + length + 1, numbers, wide, wide) < 0)
        return -1;
    return put(effects, field, numbers);
}

int tool_parse_effect(const char *name, const char *value, patina_effects *effects)
{
    if (!strcmp(name, "--effect"))
        return parse_field(value, effects);
    for (size_t i = 0; options[i].name; i++)
        if (!strcmp(name, options[i].name))
            return parse(options[i].values, value, effects);
    return 1;
}

// ---- help ------------------------------------------------------------------------------------------------------------

// edl_strength -> STRENGTH, haze -> HAZE, fog_color -> R,G,B. Returns how many characters.
static int print_name(FILE *out, const struct field *field)
{
    if (field->kind == COLOR || field->kind == AXIS)
        return fprintf(out, "%s", field->kind == COLOR ? "R,G,B" : "X,Y,Z");
    const char *rest = strchr(field->name, '_'), *name = rest ? rest + 1 : field->name;
    for (const char *c = name; *c; c++)
        fputc(toupper((unsigned char)*c), out);
    return (int)strlen(name);
}

void tool_print_effects(FILE *out)
{
    enum { COLUMN = 37 };
    for (size_t i = 0; options[i].name; i++) {
        struct value value;
        int optional = 0, wide = fprintf(out, "  %s ", options[i].name), first = 1, opened = 0;
        for (const char *list = options[i].values; (list = next_value(list, &optional, &value)); first = 0) {
            wide += first ? 0 : fprintf(out, optional && !opened ? "[," : ",");
            opened |= optional;
            wide += print_name(out, value.field);
        }
        wide += opened ? fprintf(out, "]") : 0;
        fprintf(out, "%*s%s\n", wide + 2 > COLUMN ? 2 : COLUMN - wide, "", options[i].help);
    }
}

const char *tool_effect_option(size_t index) { return options[index].name; }
