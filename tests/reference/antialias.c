// SPDX-License-Identifier: GPL-3.0-or-later
// [D 3.5], SPEC 2.4: the Laplace cross on depth, taken as steps. With k of the four neighbours far, the edge is taken to
// cover max(5/6 - k/3, 1/6) of the pixel, on a mesh 3/4; the rest shows the far neighbours.
#include "reference.h"
#include "tolerances.h"
#include "shared/colors.h"

#include <math.h>

struct ref_color ref_antialias(const struct antialias_args *args, const struct ref_planes *planes, int x, int y)
{
    static const int cross_x[4] = {1, 0, -1, 0}, cross_y[4] = {0, 1, 0, -1};
    const struct view_args *view = &args->view;
    size_t pixel = (size_t)y * view->width + (size_t)x;
    struct ref_color out = {0};
    if (planes->keys[pixel] == REF_EMPTY_KEY)
        return out;
    double z = ref_key_z(planes->keys[pixel]), behind[4] = {0.0}, terms[4] = {0.0};
    struct ref_range d = ref_level_distance(view, planes->normal, planes->deff, planes->from[pixel], ref_exactly(z));
    struct ref_range limit = {z + d.lo, z + d.hi};
    limit = ref_rounded(limit);
    int far = 0;
    for (int i = 0; i < 4; i++) {
        int qx = x + cross_x[i], qy = y + cross_y[i];
        if (qx < 0 || qy < 0 || qx >= (int)view->width || qy >= (int)view->height)
            continue; // unknown: taken for the same surface
        size_t neighbour = (size_t)qy * view->width + (size_t)qx;
        int empty = planes->keys[neighbour] == REF_EMPTY_KEY;
        if (empty && args->behind && planes->through[neighbour] < 1.0 / 512.0)
            continue; // hidden: what this surface borders on there lies before it
        enum ref_truth is_far = empty ? REF_YES : REF_NO;
        if (!empty && args->layers)
            is_far = ref_less(limit, ref_exactly(ref_key_z(planes->keys[neighbour])));
        out.unsure |= is_far == REF_UNSURE;
        if (is_far != REF_YES)
            continue;
        far++;
        for (int c = 0; c < 4 && !empty; c++) {
            behind[c] += planes->color[4 * neighbour + (size_t)c];
            terms[c] += fabs((double)planes->color[4 * neighbour + (size_t)c]);
        }
    }
    int mesh = ref_key_id(planes->keys[pixel]) - args->mesh_base < args->mesh_count;
    double coverage = far && mesh ? 0.75 : far ? fmax(5.0 / 6.0 - far / 3.0, 1.0 / 6.0) : 1.0;
    for (int c = 0; c < 4; c++) {
        double own = planes->color[4 * pixel + (size_t)c], share = far ? (1.0 - coverage) / far : 0.0;
        out.color[c] = own * coverage + share * behind[c];
        out.error[c] = far ? TOL_COLOR * (fabs(own) * coverage + share * terms[c]) : 0.0;
    }
    out.mixed = far > 0;
    return out;
}
