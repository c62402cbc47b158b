// SPDX-License-Identifier: GPL-3.0-or-later
// What an analysis knows of the point that a pixel shows (shared/picture.h, assess_args).
#include "reference.h"
#include "tolerances.h"
#include "shared/picture.h"

struct ref_assess ref_assess(const struct assess_args *args, const struct ref_planes *planes, const uint32_t *shapes, int x,
                             int y)
{
    const uint64_t key = planes->keys[(size_t)y * args->view.width + (size_t)x];
    struct ref_assess out = {.written = args->first != 0};
    if (!ref_is_of(&args->instance, key))
        return out;
    const uint32_t word = shapes[ref_key_id(key) - args->instance.id_base], class = word / 65536 % 64;
    out.written = 1;
    const double doubt = (15 - word / 33554432 % 16) / 15.0;
    out.trust = 1.0 - doubt * doubt;
    out.thickness = class ? (double)args->instance.spacing[class] * args->sigma_scale : 0.0;
    return out;
}
