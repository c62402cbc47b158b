// SPDX-License-Identifier: GPL-3.0-or-later
// Premultiplied colour over the background.
#include "reference.h"
#include "tolerances.h"
#include "shared/colors.h"

#include <math.h>

struct ref_color ref_compose(const struct compose_args *args, const struct ref_planes *planes, int x, int y)
{
    size_t pixel = (size_t)(y + (int)args->crop_y) * args->view.width + (size_t)(x + (int)args->crop_x);
    int empty = !args->everywhere && planes->keys[pixel] == REF_EMPTY_KEY;
    double through = empty ? 1.0 : 1.0 - planes->color[4 * pixel + 3];
    struct ref_color out = {0};
    for (int c = 0; c < 4; c++) {
        double own = empty ? 0.0 : planes->color[4 * pixel + (size_t)c];
        out.color[c] = own + through * args->background[c];
        out.error[c] = TOL_COLOR * (fabs(own) + fabs(through * args->background[c]));
    }
    return out;
}
