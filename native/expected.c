// SPDX-License-Identifier: GPL-3.0-or-later
#include "expected.h"

#include <math.h>
#include <stddef.h>

static const struct curve_point {
    enum pt_means means;
    double spacing_px; // rising within a means
    float color, coverage, depth, normal;
} curve[] = {
#define PT_CURVE(means, spacing, color, coverage, depth, normal) \
    { PT_MEANS_##means, spacing, color, coverage, depth, normal },
#include "expected_curves.def"
#undef PT_CURVE
};

static const struct {
    const char *name;
    uint32_t quality, fill;
} table[PT_MEANS_COUNT] = {
    [PT_MEANS_UNFILLED] = { "unfilled", PATINA_QUALITY_PAPER, PATINA_FILL_OFF },
    [PT_MEANS_PAPER] = { "as in the paper", PATINA_QUALITY_PAPER, PATINA_FILL_PAPER },
    [PT_MEANS_CLOSED] = { "closed, depth of the source", PATINA_QUALITY_PAPER, PATINA_FILL_CLOSED },
    [PT_MEANS_REFINED] = { "closed, tangent planes", PATINA_QUALITY_REFINED, PATINA_FILL_CLOSED },
};

enum pt_means pt_means_of(uint32_t quality, uint32_t fill)
{
    if (fill == PATINA_FILL_OFF)
        return PT_MEANS_UNFILLED;
    if (fill == PATINA_FILL_PAPER)
        return PT_MEANS_PAPER;
    return quality == PATINA_QUALITY_PAPER ? PT_MEANS_CLOSED : PT_MEANS_REFINED;
}

void pt_means_settings(enum pt_means means, uint32_t *quality, uint32_t *fill)
{
    *quality = table[means].quality;
    *fill = table[means].fill;
}

const char *pt_means_name(enum pt_means means) { return means == PT_MEANS_SPLATS ? "discs" : table[means].name; }

static float between(float a, float b, double t) { return (float)((double)a + t * ((double)b - (double)a)); }

patina_expected_error pt_expected_error(enum pt_means means, double spacing_px)
{
    const struct curve_point *below = NULL, *above = NULL;
    if (!(spacing_px > 0.0))
        return (patina_expected_error){ 0 };
    for (size_t i = 0; i < sizeof curve / sizeof *curve; i++) {
        if (curve[i].means != means)
            continue;
        if (curve[i].spacing_px <= spacing_px)
            below = &curve[i];
        else if (!above)
            above = &curve[i];
    }
    below = below ? below : above;
    above = above ? above : below;
    if (!below) // not measured (while the table is being made)
        return (patina_expected_error){ 0 };
    double t = above == below ? 0.0 : log(spacing_px / below->spacing_px) / log(above->spacing_px / below->spacing_px);
    return (patina_expected_error){ .color = between(below->color, above->color, t),
                                    .coverage = between(below->coverage, above->coverage, t),
                                    .depth = between(below->depth, above->depth, t),
                                    .normal = between(below->normal, above->normal, t) };
}

enum pt_means pt_means_for(double target, double spacing_px)
{
    enum pt_means best = PT_MEANS_UNFILLED;
    for (int means = 0; means < PT_MEANS_COUNT; means++) {
        double error = (double)pt_expected_error((enum pt_means)means, spacing_px).color;
        if (error <= target)
            return (enum pt_means)means;
        if (error < (double)pt_expected_error(best, spacing_px).color)
            best = (enum pt_means)means;
    }
    return best;
}
