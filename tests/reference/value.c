// SPDX-License-Identifier: GPL-3.0-or-later
// The scalars of the points that pixels show.
#include "reference.h"
#include "shared/effects.h"

#include <math.h>

struct ref_value ref_value(const struct value_args *args, const struct ref_planes *planes, const float *scalars, int x, int y)
{
    const uint64_t key = planes->keys[(size_t)y * args->view.width + (size_t)x];
    const uint32_t id = ref_key_id(key) - args->instance.id_base;
    const int ours = key != REF_EMPTY_KEY && id - args->instance.id_first < args->instance.id_count;
    struct ref_value out = {.written = ours || args->first};
    if (!ours || !isfinite(scalars[id]))
        return out;
    const double most = (double)PT_VALUE_MOST, off = (double)scalars[id] - (double)args->offset;
    out.known = 1;
    out.value = fmin(fmax(off, -most), most);
    return out;
}
