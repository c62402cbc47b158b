// SPDX-License-Identifier: GPL-3.0-or-later
// The options of `patina render` that draw effects; what their values may be, the library says.
#include "tool.h"

#include <string.h>

static int parse_edl(const char *value, patina_effects *effects)
{
    double n[2] = {0};
    if (parse_numbers(value, n, 1, 2) < 0)
        return -1;
    effects->edl_strength = (float)n[0];
    effects->edl_radius = (float)n[1];
    return 0;
}

static int parse_obscurance(const char *value, patina_effects *effects)
{
    double n[2] = {0};
    if (parse_numbers(value, n, 1, 2) < 0)
        return -1;
    effects->obscurance_strength = (float)n[0];
    effects->obscurance_radius = (float)n[1];
    return 0;
}

int tool_parse_effect(const char *name, const char *value, patina_effects *effects)
{
    static const struct {
        const char *name;
        int (*parse)(const char *value, patina_effects *effects);
    } options[] = {
        {"--edl", parse_edl},
        {"--obscurance", parse_obscurance},
    };
    for (size_t i = 0; i < sizeof options / sizeof *options; i++)
        if (!strcmp(name, options[i].name))
            return options[i].parse(value, effects);
    return 1;
}
