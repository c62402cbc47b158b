// SPDX-License-Identifier: GPL-3.0-or-later
#include "expected.h"
#include "base/elementary.h"

#include <math.h>
#include <stddef.h>

static const struct curve_point {
    enum pt_means means;
    double spacing_px; // rising within a means
    float color, coverage, depth, normal;
} curve[] = {
#define PT_CURVE(means, spacing, color, coverage, depth, normal) {PT_MEANS_##means, spacing, color, coverage, depth, normal},
#include "expected_curves.def"
#undef PT_CURVE
};

static const struct {
    const char *name;
    uint32_t quality, fill;
} table[PT_MEANS_COUNT] = {
    [PT_MEANS_UNFILLED] = {"unfilled", PATINA_QUALITY_PAPER, PATINA_FILL_OFF},
    [PT_MEANS_PAPER] = {"as in the paper", PATINA_QUALITY_PAPER, PATINA_FILL_PAPER},
    [PT_MEANS_CLOSED] = {"closed, depth of the source", PATINA_QUALITY_PAPER, PATINA_FILL_CLOSED},
    [PT_MEANS_REFINED] = {"closed, tangent planes", PATINA_QUALITY_REFINED, PATINA_FILL_CLOSED},
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

const char *pt_means_name(enum pt_means means)
{
    return means == PT_MEANS_SPLATS ? "discs" : means == PT_MEANS_RANGES ? "range images" : table[means].name;
}

// How many times their colour error was exceeded by at most, on a knot, an astroid, slits, shells, plates, spheres that touch and a
// gyroid at 0.2 to 4 points a pixel, with noise of a spacing, strays and scan rows of 1 : 10: 10.1 times by filling (a knot with noise),
// 19.1 times by discs (rows).
static const float doubt_of_filling = 11.0f, doubt_of_discs = 20.0f;

static float between(float a, float b, double t) { return (float)((double)a + t * ((double)b - (double)a)); }

// Beyond the last of two measured points, s pixels apart; never more than `most`.
static float beyond(float before, float last, double step, double far, double most)
{
    const double power = fmax(pt_ln((double)last / (double)before) / step, 0.5);
    return (float)fmin((double)last * pt_exp(power * far), most);
}

static patina_expected_error on_curve(enum pt_means means, double spacing_px)
{
    const struct curve_point *below = NULL, *above = NULL, *before = NULL;
    for (size_t i = 0; i < sizeof curve / sizeof *curve; i++) {
        if (curve[i].means != means)
            continue;
        if (curve[i].spacing_px <= spacing_px) {
            before = below;
            below = &curve[i];
        } else if (!above)
            above = &curve[i];
    }
    patina_expected_error error = {.doubt = means == PT_MEANS_SPLATS ? doubt_of_discs : doubt_of_filling};
    if (!below && !above) // not measured (while the table is being made)
        return error;
    if (!above && before) {
        const double step = pt_ln(below->spacing_px / before->spacing_px), far = pt_ln(spacing_px / below->spacing_px);
        error.color = beyond(before->color, below->color, step, far, 1.0);
        error.coverage = beyond(before->coverage, below->coverage, step, far, 1.0);
        error.depth = beyond(before->depth, below->depth, step, far, INFINITY);
        error.normal = beyond(before->normal, below->normal, step, far, 90.0);
        return error;
    }
    below = below ? below : above;
    above = above ? above : below;
    double t = above == below ? 0.0 : pt_ln(spacing_px / below->spacing_px) / pt_ln(above->spacing_px / below->spacing_px);
    error.color = between(below->color, above->color, t);
    error.coverage = between(below->coverage, above->coverage, t);
    error.depth = between(below->depth, above->depth, t);
    error.normal = between(below->normal, above->normal, t);
    return error;
}

patina_expected_error pt_expected_error(enum pt_means means, double spacing_px)
{
    if (spacing_px > 0.0 && spacing_px <= PT_SPACING_KNOWN && means != PT_MEANS_RANGES)
        return on_curve(means, spacing_px);
    const float none = INFINITY;
    return (patina_expected_error){none, none, none, none, on_curve(means, 1.0).doubt};
}

enum pt_means pt_means_for(double target, double spacing_px)
{
    enum pt_means best = PT_MEANS_UNFILLED;
    if (!(spacing_px > 0.0))
        return best; // a handful of points: nothing lies between them
    for (int means = 0; means < PT_MEANS_COUNT; means++) {
        double error = (double)on_curve((enum pt_means)means, spacing_px).color;
        if (error <= target)
            return (enum pt_means)means;
        if (error < (double)on_curve(best, spacing_px).color)
            best = (enum pt_means)means;
    }
    return best;
}
