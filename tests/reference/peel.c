// SPDX-License-Identifier: GPL-3.0-or-later
// [D 4, 5], SPEC 3: what a finished layer adds to the picture, and what may lie behind it. Decisions are exact: a sum or
// product of two float32 is exact in float64, so that rounding it once gives float32's own result.
#include "reference.h"
#include "tolerances.h"
#include "shared/colors.h"

#include <math.h>

struct ref_peel ref_peel(const struct peel_args *args, const struct ref_planes *planes, const float *limit,
                         const float *through, const float *over, int x, int y)
{
    size_t pixel = (size_t)y * args->view.width + (size_t)x;
    double z = ref_key_z(planes->keys[pixel]);
    struct ref_peel out = {.key = planes->keys[pixel], .through = args->first ? 1.0f : through[pixel]};
    for (int c = 0; c < 4; c++)
        out.over[c] = args->first ? 0.0 : over[4 * pixel + (size_t)c];
    if (out.key == REF_EMPTY_KEY) { // nothing here: nothing was measured behind it either
        out.limit = INFINITY;
        return out;
    }
    if (!args->first && !(z > limit[pixel])) { // filled across a layer that was taken before
        out.key = REF_EMPTY_KEY;
        out.limit = limit[pixel];
        return out;
    }
    const float *color = planes->color + 4 * pixel;
    double open = 1.0 - out.over[3];
    for (int c = 0; c < 4; c++) {
        out.over[c] += open * color[c];
        out.error[c] = TOL_COLOR * (fabs(out.over[c]) + fabs(color[c]));
    }
    float opaque = planes->shading[4 * pixel + 3], clear = (float)(1.0 - (double)opaque);
    out.through = (float)((double)out.through * (double)clear);
    out.limit = (float)(z + (double)planes->deff[planes->from[pixel] & ~PT_FROM_MIXED]);
    if (args->stop && (double)out.through < 1.0 / 512.0)
        out.limit = INFINITY;
    out.covered = 1;
    return out;
}
