// SPDX-License-Identifier: GPL-3.0-or-later
// How far scans lie apart at the measured pixel whose surface a pixel shows.
#include "reference.h"
#include "shared/picture.h"

struct ref_reveal ref_reveal(const struct reveal_args *args, const struct ref_planes *planes, const float *apart, int x, int y)
{
    const size_t at = (size_t)y * args->view.width + (size_t)x;
    struct ref_reveal out = {.written = args->first != 0};
    if (!ref_is_of(&args->instance, planes->keys[at]))
        return out;
    out.written = 1;
    out.apart = (double)apart[planes->from[at] & 0x7FFFFFFFu];
    return out;
}
