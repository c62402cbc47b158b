// SPDX-License-Identifier: GPL-3.0-or-later
// [D 6], SPEC 4: a transparent surface casts a shadow as strong as its opacity, so what lies behind it casts, too.
#include "reference.h"
#include "shared/shadows.h"

#include <math.h>

float ref_limit(const struct limit_args *args, const struct ref_planes *planes, int x, int y)
{
    size_t pixel = (size_t)y * args->view.width + (size_t)x;
    uint64_t key = planes->keys[pixel];
    if (key == REF_EMPTY_KEY)
        return INFINITY;
    double let_through = 1.0 - args->loss / 255.0 * planes->opacities[ref_key_id(key) - args->caster] / 255.0;
    if (let_through == 0.0)
        return INFINITY;
    return (float)(ref_key_z(key) + (double)planes->deff[planes->from[pixel] & ~PT_FROM_MIXED]);
}
