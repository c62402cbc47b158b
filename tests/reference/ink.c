// SPDX-License-Identifier: GPL-3.0-or-later
// [X 3.3]: lines in one colour, in that of their points, or by depth; over a picture or behind what is blended already.
#include "reference.h"
#include "tolerances.h"
#include "shared/picture.h"

#include <math.h>

enum { FIXED, POINT, DEPTH };

static double line_color(const struct ink_args *args, const void *colors, uint32_t id, double z, int c)
{
    const struct instance_args *instance = &args->instance;
    if (args->source == POINT) {
        double own = instance->color[c];
        if (instance->color_format == 1)
            own = ref_srgb(((const uint8_t *)colors)[3 * (size_t)id + (size_t)c]);
        else if (instance->color_format == 2)
            own = ((const float *)colors)[3 * (size_t)id + (size_t)c];
        return own * args->color[c];
    }
    if (args->source == FIXED)
        return args->color[c];
    double far = fmin(fmax((z - args->start) * args->scale, 0.0), 1.0);
    return args->color[c] * (1.0 - far) + args->far_color[c] * far;
}

struct ref_ink ref_ink(const struct ink_args *args, const struct ref_planes *planes, const float *line, const uint32_t *nearest,
                       const float color[4], float depth, int x, int y)
{
    const struct view_args *view = &args->view;
    uint32_t px = args->crop_x + (uint32_t)x, py = args->crop_y + (uint32_t)y;
    size_t pixel = (size_t)py * view->width + px;
    int known = px >= view->rect[0] && py >= view->rect[1] && px < view->rect[2] && py < view->rect[3];
    double share = known ? line[pixel] : 0.0, alpha = share * args->opacity;
    struct ref_ink out = {.depth = depth, .mask = alpha};
    int hidden = args->blank && planes->keys[pixel] != REF_EMPTY_KEY;
    for (int c = 0; c < 4; c++)
        out.color[c] = hidden ? args->background[c] : color[c];
    if (!(share > 0.0))
        return out;
    uint64_t key = planes->keys[nearest[pixel]];
    uint32_t id = ref_key_id(key) - args->instance.id_base;
    if (id - args->instance.id_first >= args->instance.id_count)
        return out;
    double through = args->behind ? 1.0 - out.color[3] : 1.0 - alpha;
    for (int c = 0; args->color_target && c < 4; c++) {
        double under = out.color[c], own = alpha * (c < 3 ? line_color(args, planes->colors, id, ref_key_z(key), c) : 1.0);
        out.color[c] = args->behind ? under + through * own : own + through * under;
        out.error[c] = TOL_COLOR * (fabs(under) + fabs(own));
    }
    if (args->depth && share >= 0.5)
        out.depth = ref_key_z(key);
    return out;
}
