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

static int parse_toon(const char *value, patina_effects *effects)
{
    double n[2] = {0};
    if (parse_numbers(value, n, 1, 2) < 0 || n[0] < 0 || n[0] > 255 || n[0] != (uint32_t)n[0])
        return -1;
    effects->toon_bands = (uint32_t)n[0];
    effects->toon_softness = (float)n[1];
    return 0;
}

static int parse_hatch(const char *value, patina_effects *effects)
{
    double n[7] = {0};
    if (parse_numbers(value, n, 1, 7) < 0 || n[0] < 0 || n[0] > 255 || n[0] != (uint32_t)n[0])
        return -1;
    effects->hatch_levels = (uint32_t)n[0];
    effects->hatch_spacing = (float)n[1];
    effects->hatch_opacity = (float)n[2];
    effects->hatch_ground = (float)n[3];
    for (int k = 0; k < 3; k++)
        effects->hatch_color[k] = (float)n[4 + k];
    return 0;
}

static int parse_fog(const char *value, patina_effects *effects)
{
    double n[6] = {0};
    int count = parse_numbers(value, n, 2, 6);
    if (count != 2 && count != 3 && count != 6)
        return -1;
    effects->fog_start = (float)n[0];
    effects->fog_end = (float)n[1];
    effects->fog_density = count > 2 ? (float)n[2] : 1.0f;
    effects->fog_fixed = count == 6;
    for (int k = 0; k < 3; k++)
        effects->fog_color[k] = (float)n[3 + k];
    return 0;
}

static int parse_focus(const char *value, patina_effects *effects)
{
    double n[2];
    if (parse_numbers(value, n, 2, 2) < 0)
        return -1;
    effects->focus_distance = (float)n[0];
    effects->focus_aperture = (float)n[1];
    return 0;
}

static int parse_paper(const char *value, patina_effects *effects)
{
    double n[4] = {0};
    int count = parse_numbers(value, n, 1, 4);
    if (count != 1 && count != 4)
        return -1;
    effects->paper_grain = (float)n[0];
    for (int k = 0; count == 4 && k < 3; k++)
        effects->paper_color[k] = (float)n[1 + k];
    return 0;
}

int tool_parse_effect(const char *name, const char *value, patina_effects *effects)
{
    static const struct {
        const char *name;
        int (*parse)(const char *value, patina_effects *effects);
    } options[] = {
        {"--edl", parse_edl}, {"--obscurance", parse_obscurance}, {"--toon", parse_toon},   {"--hatch", parse_hatch},
        {"--fog", parse_fog}, {"--focus", parse_focus},           {"--paper", parse_paper},
    };
    for (size_t i = 0; i < sizeof options / sizeof *options; i++)
        if (!strcmp(name, options[i].name))
            return options[i].parse(value, effects);
    return 1;
}
