// SPDX-License-Identifier: GPL-3.0-or-later
// Bands of light: the light is colour over albedo by luminance, its root falls into bands, full light into the middle of the
// last.
#include "reference.h"
#include "tolerances.h"
#include "shared/effects.h"

#include <math.h>

static double luminance(const float *c) { return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; }

struct ref_color ref_toon(const struct toon_args *args, const struct ref_planes *planes, int x, int y)
{
    size_t pixel = (size_t)y * args->view.width + (size_t)x;
    const float *albedo = planes->albedo + 4 * pixel, *color = planes->color + 4 * pixel;
    double own = luminance(albedo), brightness = luminance(color) / own, dark = (double)PT_TOON_DARK;
    struct ref_color out = {0};
    for (int c = 0; c < 4; c++)
        out.color[c] = color[c];
    out.unsure = fabs(own - dark) < 8.0 * TOL_UNIT * dark || fabs(brightness - dark) < 16.0 * TOL_UNIT * dark;
    if (!(own > dark))
        return out;
    // luminances 4 each, reciprocal 4, product; the root 5 of half of that; product and sum
    double root = brightness / sqrt(fmax(brightness, dark)), at = root * args->bands + 0.5,
           at_error = 16.0 * TOL_UNIT * (at + 1.0);
    double whole = floor(at), ramp = (at - whole - 0.5) * args->steepness + 0.5;
    double edge = fmin(fmax(ramp, 0.0), 1.0), level = fmax(whole - 0.5 + edge * edge * (3.0 - 2.0 * edge), 0.5);
    double level_error = 1.5 * args->steepness * at_error + 8.0 * TOL_UNIT * level;
    if (ramp > 1.0 + args->steepness * at_error || ramp < -args->steepness * at_error)
        level_error = 8.0 * TOL_UNIT * level;
    double band = level * level * args->inverse * args->inverse;
    double band_error = 2.0 * level * level_error * args->inverse * args->inverse + 4.0 * TOL_UNIT * band;
    for (int c = 0; c < 3; c++) {
        double base = brightness > dark ? color[c] / brightness : albedo[c];
        out.color[c] = base * band;
        out.error[c] = fabs(base) * (band_error + 16.0 * TOL_UNIT * band);
    }
    return out;
}
