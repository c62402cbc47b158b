// SPDX-License-Identifier: GPL-3.0-or-later
// [D 3.4], SPEC 2.3: 3 x 3 low-pass over the neighbours of the same layer, weights renormalised.
#include "reference.h"
#include "tolerances.h"
#include "shared/colors.h"

#include <math.h>
#include <stdlib.h>

struct ref_color ref_smooth(const struct smooth_args *args, const struct ref_planes *planes, int x, int y)
{
    const struct view_args *view = &args->view;
    size_t pixel = (size_t)y * view->width + (size_t)x;
    struct ref_color out = {0};
    if (planes->keys[pixel] == REF_EMPTY_KEY)
        return out;
    double z = ref_key_z(planes->keys[pixel]), sum = 0.0, terms[4] = {0.0};
    struct ref_range d = ref_level_distance(view, planes->normal, planes->deff, planes->from[pixel], ref_exactly(z));
    for (int dy = -1; dy <= 1; dy++) {
        for (int dx = -1; dx <= 1; dx++) {
            int qx = x + dx, qy = y + dy;
            if (qx < 0 || qy < 0 || qx >= (int)view->width || qy >= (int)view->height)
                continue;
            size_t neighbour = (size_t)qy * view->width + (size_t)qx;
            if (planes->keys[neighbour] == REF_EMPTY_KEY)
                continue;
            double step = fabs(ref_key_z(planes->keys[neighbour]) - z);
            enum ref_truth same = ref_less_equal(ref_rounded(ref_exactly(step)), d);
            out.unsure |= same == REF_UNSURE;
            if (same == REF_NO)
                continue;
            double weight = dx && dy ? args->corner : dx || dy ? args->edge : args->center;
            sum += weight;
            for (int i = 0; i < 4; i++) {
                out.color[i] += weight * planes->color[4 * neighbour + (size_t)i];
                terms[i] += weight * fabs((double)planes->color[4 * neighbour + (size_t)i]);
            }
        }
    }
    for (int i = 0; i < 4; i++) {
        out.color[i] /= sum;
        out.error[i] = TOL_COLOR * terms[i] / sum;
    }
    return out;
}
